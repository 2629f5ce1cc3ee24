//! Options for reading tables.

use crate::kinematics::PeriodicBox;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Kind of columns to read from a molecular-dynamics table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum SampledColumns {
    /// Columns `avg_…`: means over the interval before each sample. In a small cell the instantaneous stress
    /// is mostly bond vibration (formulation.md, chapter 3).
    #[default]
    Averaged,
    /// Columns of the instantaneous values.
    Instantaneous,
}

/// Undeformed box.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum BoxReference {
    /// Box of the first row of each run.
    Run,
    /// Box of the first row of the file, whose runs continue each other.
    File,
}

/// Stress measure of the columns `pxx …`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum PressureConvention {
    /// Pressures as in LAMMPS: σ = −p.
    Pressure,
}

/// Units of LAMMPS (`units` in its documentation); `lj` is dimensionless and not supported.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum LammpsUnits {
    /// Pressure in atm, time in fs.
    Real,
    /// Pressure in bar, time in ps.
    Metal,
    /// Pressure in Pa, time in s.
    Si,
    /// Pressure in dyn/cm², time in s.
    Cgs,
    /// Pressure in Pa, time in fs.
    Electron,
    /// Pressure in pg/(µm µs²) = 1 kPa, time in µs.
    Micro,
    /// Pressure in ag/(nm ns²) = 1 MPa, time in ns.
    Nano,
}

impl LammpsUnits {
    /// All units, by name.
    pub const ALL: [(&'static str, Self); 7] = [
        ("real", Self::Real),
        ("metal", Self::Metal),
        ("si", Self::Si),
        ("cgs", Self::Cgs),
        ("electron", Self::Electron),
        ("micro", Self::Micro),
        ("nano", Self::Nano),
    ];

    /// Returns the name.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, units)| *units == self).map_or("", |(name, _)| name)
    }

    /// Returns the units of pressure, Pa, and of time, s.
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

/// Options for reading a table.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ReadOptions {
    /// Averaged or instantaneous columns.
    pub columns: SampledColumns,
    /// Undeformed box, Å; default: the row of each run at which the F of the file is 1.
    pub reference: Option<PeriodicBox>,
    /// Row whose box is undeformed, if no row shows it.
    pub origin: Option<BoxReference>,
    /// Unit of stress, Pa, for columns without `[unit]` in the heading; default MPa (none for pressures).
    pub stress_unit: Option<f64>,
    /// Stress measure of columns `pxx …` in a table; by default they are refused.
    pub pressure: Option<PressureConvention>,
    /// Units of LAMMPS output, if the log does not state them.
    pub units: Option<LammpsUnits>,
    /// Headings of the columns, by property (`lx`, `pxx`, `F11`, …).
    pub names: BTreeMap<String, String>,
    /// Blocks of a LAMMPS log to read, from 1; default: all.
    pub blocks: Vec<usize>,
}

impl ReadOptions {
    /// Returns the prefix of sampled columns.
    pub(super) fn prefix(&self) -> &'static str {
        match self.columns {
            SampledColumns::Averaged => "avg_",
            SampledColumns::Instantaneous => "",
        }
    }
}

/// Properties of a table.
pub const PROPERTIES: [&str; 52] = [
    "run_id", "kind", "sample", "time_fs", "lx", "ly", "lz", "xy", "xz", "yz", "sxx", "syy", "szz", "sxy",
    "sxz", "syz", "pxx", "pyy", "pzz", "pxy", "pxz", "pyz", "F11", "F12", "F13", "F21", "F22", "F23", "F31",
    "F32", "F33", "P11", "P12", "P13", "P21", "P22", "P23", "P31", "P32", "P33", "S11", "S22", "S33", "S12",
    "S13", "S23", "C11", "C22", "C33", "C12", "C13", "C23",
];

pub(super) const LENGTHS: [&str; 3] = ["lx", "ly", "lz"];
pub(super) const TILTS: [&str; 3] = ["xy", "xz", "yz"];
/// Components in the order of this crate and of LAMMPS.
pub(super) const PLACES: [&str; 6] = ["xx", "yy", "zz", "xy", "xz", "yz"];

/// Tells if a property is a box length, tilt or stress of a sample, which has the prefix `avg_` in averaged
/// columns.
pub(super) fn is_sampled(property: &str) -> bool {
    LENGTHS.contains(&property)
        || TILTS.contains(&property)
        || property.strip_prefix(['s', 'p']).is_some_and(|place| PLACES.contains(&place))
}
