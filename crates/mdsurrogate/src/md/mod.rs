//! Molecular dynamics of a deformed crystal with LAMMPS: plans, inputs, runs and results.
//!
//! A folder holds a whole set: `plan.json` (this module), `in/` and `runs/ID.in` ([`input`]), start
//! configurations in `prepared/`, a table `runs/ID.csv` per finished run, and all of them joined in
//! `runs.csv`, which [`crate::dataset::read`] reads. A run is finished when its table exists. Tables are
//! written whole, so an interrupted set continues with the missing runs.

mod engine;
mod folder;
pub mod input;
mod results;

pub use engine::Engine;
pub use folder::Folder;
pub use results::{MdSample, heading, read_run, table};

use crate::Error;
use serde::{Deserialize, Serialize};

/// Names of the six rates: stretches of the edges, then tilts.
pub const AXES: [&str; 6] = ["x", "y", "z", "xy", "xz", "yz"];

/// Settings of all runs of a set. Times in fs, as in LAMMPS' `units real`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Protocol {
    /// Cells along x, y, z; the thesis: 8, 4, 2.
    pub cells: [usize; 3],
    /// Time step, fs.
    pub time_step: f64,
    /// Steps of a run.
    pub steps: u64,
    /// Steps between samples, also the interval of the averages.
    pub every: u64,
    /// Temperature of thermostats and initial velocities, K.
    pub temperature: f64,
    /// Steps of box relaxation at 0 K. Without it the first NPT destroys the crystal.
    pub relaxation: u64,
    /// Steps of NVT after the initial velocities.
    pub warm_up: u64,
    /// Steps of NPT at 1 atm; the second half gives the reference lengths.
    pub equilibration: u64,
    /// Steps of NVT in the reference box before the first start configuration.
    pub settling: u64,
    /// Number of start configurations, used by the runs in turn.
    pub snapshots: usize,
    /// Steps between start configurations.
    pub gap: u64,
    /// Seed of the initial velocities.
    pub seed: u32,
    /// Stepwise loading, one step per interval of samples, instead of constant rates.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stepwise: Option<Stepwise>,
}

/// Quasi-static loading of Fig. 3.5 (§3.2): in each interval an increment of strain is applied, then the box
/// is fixed, the atoms relax at constant volume, and the stress is averaged over the rest of the interval.
/// The thesis uses increments of 1 % and averages over 5 ps: intervals of 10,000 steps plus pull and
/// relaxation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stepwise {
    /// Steps in which the strain increment is applied, with barostats on the other edges.
    pub pull: u64,
    /// Steps of NVT before the averages.
    pub relax: u64,
}

impl Default for Protocol {
    /// Returns the settings of the thesis (§3.2–3.3): 8 × 4 × 2 cells, 0.5 fs, runs of 5 ps sampled every 50
    /// fs, 50 ps of NPT at 300 K.
    fn default() -> Self {
        Self {
            cells: [8, 4, 2],
            time_step: 0.5,
            steps: 10_000,
            every: 100,
            temperature: 300.0,
            relaxation: 200,
            warm_up: 400,
            equilibration: 100_000,
            settling: 1200,
            snapshots: 6,
            gap: 300,
            seed: 1201,
            stepwise: None,
        }
    }
}

impl Protocol {
    /// Checks the settings.
    ///
    /// # Errors
    /// Returns [`Error::Parameter`] for invalid settings.
    pub fn check(&self) -> Result<(), Error> {
        let positive = [("time step", self.time_step), ("temperature", self.temperature)];
        for (name, value) in positive {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::parameter(name, value, "a positive number"));
            }
        }
        if self.every == 0 || self.steps == 0 || !self.steps.is_multiple_of(self.every) {
            let found = format!("{} steps with a sample every {}", self.steps, self.every);
            return Err(Error::parameter("sampling", found, "a multiple, at least one interval"));
        }
        for (name, value) in [
            ("relaxation", self.relaxation),
            ("equilibration", self.equilibration),
            ("warm-up", self.warm_up),
            ("settling", self.settling),
            ("gap", self.gap),
            ("snapshots", self.snapshots as u64),
            ("seed", u64::from(self.seed)),
        ] {
            if value == 0 {
                return Err(Error::parameter(name, 0, "at least 1"));
            }
        }
        if self.equilibration < 4 {
            return Err(Error::parameter("equilibration", self.equilibration, "at least 4 steps"));
        }
        if let Some(Stepwise { pull, relax }) = self.stepwise
            && (pull == 0 || pull.saturating_add(relax) >= self.every)
        {
            let found = format!("{pull} steps of pull and {relax} of relaxation in {}", self.every);
            let allowed = "at least 1 step of pull, and fewer than an interval in total";
            return Err(Error::parameter("stepwise", found, allowed));
        }
        if self.cells.contains(&0) || self.cells.iter().any(|n| *n > 1000) {
            return Err(Error::parameter("cells", format!("{:?}", self.cells), "1 to 1000 each"));
        }
        Ok(())
    }
}

/// Deformation run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MdRun {
    /// Name of the run and of its files.
    pub id: String,
    /// Kind of loading: `ux`, `bxy`, …: stretched edges; `gxy`: shear; `m…`: both.
    pub kind: String,
    /// Engineering rates, 1/fs, of lx, ly, lz and of the tilts xy/ly, xz/lz, yz/lz. An edge without a rate
    /// has its own barostat of 1 atm, a tilt without a rate is fixed.
    pub rates: [Option<f64>; 6],
    /// Index of the start configuration, from 0.
    pub snapshot: usize,
    /// Fraction of the run after which all rates are reversed: loading, then unloading.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unload: Option<f64>,
    /// Seed of new velocities for a replica of another run, which starts with [`Protocol::warm_up`] steps of
    /// NVT.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u32>,
}

/// A whole set: protocol and runs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MdPlan {
    /// Settings of all runs.
    pub protocol: Protocol,
    /// Runs of the set.
    pub runs: Vec<MdRun>,
}

/// Grid of rates of Table 3.2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RateGrid {
    /// Levels of rate per direction; the thesis: 15.
    pub levels: usize,
    /// Strains at the end of a run with the largest rates; Table 3.2: 0.5, 0.6, 0.15.
    pub ultimate_strains: [f64; 3],
    /// Factor on all rates.
    pub rate_scale: f64,
}

impl Default for RateGrid {
    fn default() -> Self {
        Self { levels: 15, ultimate_strains: [0.5, 0.6, 0.15], rate_scale: 1.0 }
    }
}

impl RateGrid {
    /// Returns the rates of each direction, 1/fs: evenly spaced from a fifteenth of the largest to the
    /// largest rate, which is strain/duration. **Table 3.2 prints them per step of 0.5 fs**, not per fs:
    /// 10,000 steps × 50e-6 = 0.5 (formulation.md, chapter 3). A single level is the largest rate.
    pub fn rates(&self, protocol: &Protocol) -> [Vec<f64>; 3] {
        let duration = protocol.steps as f64 * protocol.time_step;
        self.ultimate_strains.map(|strain| {
            let greatest = self.rate_scale * strain / duration;
            let last = (self.levels.max(2) - 1) as f64;
            let level = |index: usize| {
                let share = if self.levels < 2 { 1.0 } else { index as f64 / last };
                greatest * (1.0 / 15.0 + share * (1.0 - 1.0 / 15.0))
            };
            (0..self.levels).map(level).collect()
        })
    }

    /// Returns all runs: each direction at each level, then each pair of directions at each pair of levels;
    /// 15 levels give 3·15 + 3·15² = 720 runs.
    ///
    /// # Errors
    /// Returns [`Error::Parameter`] for more than 200 levels, and for strains or a scale that are not
    /// positive.
    pub fn runs(&self, protocol: &Protocol) -> Result<Vec<MdRun>, Error> {
        if self.levels > 200 {
            return Err(Error::parameter("levels", self.levels, "0 to 200"));
        }
        for value in self.ultimate_strains.into_iter().chain([self.rate_scale]) {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::parameter("ultimate strain or rate scale", value, "a positive number"));
            }
        }
        let rates = self.rates(protocol);
        let mut runs = Vec::new();
        for axis in 0..3 {
            for (level, &rate) in rates[axis].iter().enumerate() {
                let mut loading = [None; 6];
                loading[axis] = Some(rate);
                runs.push((format!("u{}_{level}", AXES[axis]), loading));
            }
        }
        for (first, second) in [(0, 1), (0, 2), (1, 2)] {
            for (i, &a) in rates[first].iter().enumerate() {
                for (j, &b) in rates[second].iter().enumerate() {
                    let mut loading = [None; 6];
                    (loading[first], loading[second]) = (Some(a), Some(b));
                    runs.push((format!("b{}{}_{i}_{j}", AXES[first], AXES[second]), loading));
                }
            }
        }
        let numbered = runs.into_iter().enumerate();
        Ok(numbered.map(|(n, (id, rates))| MdRun::new(id, rates, n % protocol.snapshots)).collect())
    }
}

impl MdRun {
    /// Creates a run; its rates determine its kind.
    pub fn new(id: String, rates: [Option<f64>; 6], snapshot: usize) -> Self {
        let names = |range: std::ops::Range<usize>| -> String {
            range.filter(|&axis| rates[axis].is_some()).map(|axis| AXES[axis]).collect()
        };
        let (pulled, sheared) = (names(0..3), names(3..6));
        let kind = match (pulled.len(), sheared.is_empty()) {
            (1, true) => format!("u{pulled}"),
            (2, true) => format!("b{pulled}"),
            (3, true) => format!("t{pulled}"),
            (0, _) => format!("g{sheared}"),
            _ => format!("m{pulled}{sheared}"),
        };
        Self { id, kind, rates, snapshot, unload: None, seed: None }
    }

    /// Returns the run and `count` − 1 replicas, `ID_r1`, …, with other start configurations and velocities:
    /// their mean has less noise.
    pub fn replicas(self, count: usize, protocol: &Protocol) -> Vec<Self> {
        let replica = |k: usize| Self {
            id: if k == 0 { self.id.clone() } else { format!("{}_r{k}", self.id) },
            snapshot: (self.snapshot + k) % protocol.snapshots,
            seed: (k > 0).then(|| protocol.seed.wrapping_add(k as u32).max(1)),
            ..self.clone()
        };
        (0..count.max(1)).map(replica).collect()
    }

    /// Parses a general path: `x=1e-5,xy=-2e-5`, rates in 1/fs; `unload=0.6` reverses all rates after that
    /// fraction of the run. This reaches any C: F of a box is upper triangular, as is the Cholesky factor of
    /// C.
    /// triangle, as is the Cholesky factor of C.
    ///
    /// Returns [`Error::Parameter`] for an unknown or repeated axis, an invalid rate, and an empty path.
    /// [`Error::Parameter`] for an unknown axis, an axis twice, a rate that is no finite number, none at all.
    pub fn parse(text: &str, id: String, snapshot: usize) -> Result<Self, Error> {
        let bad = |found: String| {
            Error::parameter(
                "path",
                found,
                "x, y, z, xy, xz, yz with a rate in 1/fs each, as `x=1e-5,xy=2e-5`, and `unload` with a \
                 fraction between 0 and 1",
            )
        };
        let (mut rates, mut unload) = ([None; 6], None);
        for part in text.split(',') {
            let (axis, rate) = part.split_once('=').ok_or_else(|| bad(format!("`{part}`")))?;
            if axis.trim() == "unload" {
                let share = rate.trim().parse().ok().filter(|share| *share > 0.0 && *share < 1.0);
                if share.is_none() || unload.is_some() {
                    return Err(bad(format!("`{part}`")));
                }
                unload = share;
                continue;
            }
            let index = AXES.iter().position(|name| *name == axis.trim());
            let index = index.ok_or_else(|| bad(format!("the axis `{}`", axis.trim())))?;
            let rate: f64 = rate.trim().parse().map_err(|_| bad(format!("the rate `{}`", rate.trim())))?;
            if !rate.is_finite() || rates[index].is_some() {
                return Err(bad(format!("`{part}`")));
            }
            rates[index] = Some(rate);
        }
        if rates == [None; 6] {
            return Err(bad(format!("`{text}`")));
        }
        Ok(Self { unload, ..Self::new(id, rates, snapshot) })
    }
}

#[cfg(test)]
mod tests;
