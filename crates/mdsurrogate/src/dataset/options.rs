//! How tables are to be understood.

use crate::kinematics::PeriodicBox;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Which columns of a molecular dynamics table are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Columns {
    /// `avg_…`: means over the interval before each sample. Stress at one instant in a small cell is mostly the
    /// vibration of bonds (formulation.md, chapter 3).
    #[default]
    Averaged,
    /// The values at the instant of sampling.
    Instantaneous,
}

/// The box that lengths are referred to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Origin {
    /// That of the first row of each run.
    Run,
    /// That of the first row of the file, the runs of which continue each other.
    File,
}

/// What the columns `pxx …` are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Measure {
    /// Pressures as of LAMMPS: σ = −p.
    Pressure,
}

/// Units of LAMMPS (`units` in its documentation); those of `lj` have no size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum LammpsUnits {
    /// atm, fs.
    Real,
    /// bar, ps.
    Metal,
    /// Pa, s.
    Si,
    /// dyn/cm², s.
    Cgs,
    /// Pa, fs.
    Electron,
    /// pg/(µm µs²) = 1 kPa, µs.
    Micro,
    /// ag/(nm ns²) = 1 MPa, ns.
    Nano,
}

impl LammpsUnits {
    /// All of them, by name.
    pub const ALL: [(&'static str, Self); 7] = [
        ("real", Self::Real),
        ("metal", Self::Metal),
        ("si", Self::Si),
        ("cgs", Self::Cgs),
        ("electron", Self::Electron),
        ("micro", Self::Micro),
        ("nano", Self::Nano),
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, one)| *one == self).map_or("", |(name, _)| name)
    }

    /// Pa in a unit of pressure, s in a unit of time.
    pub fn sizes(self) -> [f64; 2] {
        match self {
            Self::Real => [crate::kinematics::ATMOSPHERE, 1e-15],
            Self::Metal => [1e5, 1e-12],
            Self::Si => [1.0, 1.0],
            Self::Cgs => [0.1, 1.0],
            Self::Electron => [1.0, 1e-15],
            Self::Micro => [1e3, 1e-6],
            Self::Nano => [1e6, 1e-9],
        }
    }
}

/// How a table is to be understood.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ReadOptions {
    /// Averaged or instantaneous.
    pub columns: Columns,
    /// The undeformed box, Å; without it, lengths are referred to the row of each run where the file's own F is 1.
    pub reference: Option<PeriodicBox>,
    /// Which row of lengths is undeformed, where no row says so.
    pub origin: Option<Origin>,
    /// Pa in one unit of stress, for columns whose heading has no `[unit]`; MPa without it (of pressures: none).
    pub stress_unit: Option<f64>,
    /// What columns `pxx …` of a table are; without it they are refused.
    pub measure: Option<Measure>,
    /// Units of LAMMPS' own files, where a log does not tell them.
    pub units: Option<LammpsUnits>,
    /// Properties (`lx`, `pxx`, `F11`, …) and the headings of their columns.
    pub names: BTreeMap<String, String>,
    /// Blocks of a LAMMPS log that are read, from 1; all where none is named.
    pub blocks: Vec<usize>,
}

impl ReadOptions {
    /// What the headings of a table's samples begin with.
    pub(super) fn prefix(&self) -> &'static str {
        match self.columns {
            Columns::Averaged => "avg_",
            Columns::Instantaneous => "",
        }
    }
}

/// What a table can have.
pub const PROPERTIES: [&str; 52] = [
    "run_id", "kind", "sample", "time_fs", "lx", "ly", "lz", "xy", "xz", "yz", "sxx", "syy", "szz", "sxy",
    "sxz", "syz", "pxx", "pyy", "pzz", "pxy", "pxz", "pyz", "F11", "F12", "F13", "F21", "F22", "F23", "F31",
    "F32", "F33", "P11", "P12", "P13", "P21", "P22", "P23", "P31", "P32", "P33", "S11", "S22", "S33", "S12",
    "S13", "S23", "C11", "C22", "C33", "C12", "C13", "C23",
];

pub(super) const LENGTHS: [&str; 3] = ["lx", "ly", "lz"];
pub(super) const TILTS: [&str; 3] = ["xy", "xz", "yz"];
/// Places in the order of this crate, which is LAMMPS', too.
pub(super) const PLACES: [&str; 6] = ["xx", "yy", "zz", "xy", "xz", "yz"];

/// Whether a property is of the box or of stress at a sample, which averaged columns have with `avg_`.
pub(super) fn is_sampled(property: &str) -> bool {
    LENGTHS.contains(&property)
        || TILTS.contains(&property)
        || property.strip_prefix(['s', 'p']).is_some_and(|place| PLACES.contains(&place))
}
