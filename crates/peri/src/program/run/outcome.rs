//! Results of one variant.

use crate::bonds::{Bonds, Fragment};
use crate::program::scene::SceneVariant;
use crate::solver::{BreakingEvent, State, StepRecord};
use harness::observe::Curve;
use harness::report::{Named, Phases};
use harness::study::Solved;
use serde::{Deserialize, Serialize};

/// Results of a variant without its fields.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct VariantOutcome {
    /// Name of the variant.
    pub name: String,
    /// Spacing, m.
    pub spacing: f64,
    /// Horizon over spacing.
    pub horizon_ratio: f64,
    /// Name without the spacing: variants of one family differ in spacing only.
    pub family: String,
    /// Named scalars with units.
    pub values: Vec<(String, f64, String)>,
    /// Named profiles.
    pub profiles: Vec<Profile>,
    /// History of load steps.
    pub history: Vec<StepRecord>,
    /// Breaking events in their order.
    pub events: Vec<BreakingEvent>,
    /// Fragments, the largest first.
    pub fragments: Vec<Fragment>,
    /// True for explicit dynamics.
    pub dynamic: bool,
    /// True if the load was lowered after bonds broke, see `solver.snap_back`.
    pub snaps_back: bool,
    /// Names of the regions of prescribed displacement.
    pub regions: Vec<String>,
    /// Rows of the history at the start of each later step of a programme.
    pub starts: Vec<usize>,
    /// Names of rigid surfaces: planes, then indenters.
    pub surfaces: Vec<String>,
    /// Number of planes.
    pub planes: usize,
    /// Columns of probes, with units.
    pub probes: Vec<(String, String)>,
    /// Warnings.
    pub warnings: Vec<String>,
    /// Expected behaviour from the scene.
    pub description: Option<String>,
    /// Keys that its study varies, with their values as texts.
    pub varied: Vec<(String, String)>,
    /// Error with which the variant ended.
    pub error: Option<String>,
    /// Work done.
    pub work: Vec<(String, u64)>,
    /// Seconds by phase.
    pub seconds: Vec<(String, f64)>,
}

/// Curve along a line.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Profile {
    /// Name.
    pub name: String,
    /// Positions, m.
    pub at: Vec<f64>,
    /// Values relative to the reference.
    pub value: Vec<f64>,
}

impl Profile {
    /// Converts a curve of two columns.
    pub fn from_curve(curve: Curve) -> Option<Self> {
        let mut columns = curve.columns.into_iter().map(|(_, _, values)| values);
        Some(Self { name: curve.name, at: columns.next()?, value: columns.next()? })
    }
}

impl VariantOutcome {
    /// Creates empty results.
    pub fn new(name: String, variant: &SceneVariant) -> Self {
        Self {
            name,
            spacing: variant.spacing,
            horizon_ratio: variant.horizon_ratio,
            family: variant.family(),
            values: Vec::new(),
            profiles: Vec::new(),
            history: Vec::new(),
            events: Vec::new(),
            fragments: Vec::new(),
            dynamic: variant.scene.at_end().dynamics.is_some(),
            snaps_back: false,
            regions: Vec::new(),
            surfaces: Vec::new(),
            starts: Vec::new(),
            planes: 0,
            probes: Vec::new(),
            warnings: Vec::new(),
            description: None,
            varied: variant.of.varied.clone(),
            error: None,
            work: Vec::new(),
            seconds: Vec::new(),
        }
    }

    /// Returns the name for files, without spaces and shell characters.
    pub fn file_name(&self) -> String {
        self.name.replace(' ', "_").replace('=', "-")
    }

    /// Value of a key that its study varies.
    pub fn text_of(&self, key: &str) -> Option<&String> {
        self.varied.iter().find(|own| own.0 == key).map(|own| &own.1)
    }

    /// Adds a scalar.
    pub fn value(&mut self, quantity: impl Into<Named>, value: f64) {
        let Named { name, unit } = quantity.into();
        self.values.push((name, value, unit));
    }

    /// Returns a scalar by name.
    pub fn get(&self, name: &str) -> Option<f64> {
        self.values.iter().find(|(n, _, _)| n == name).map(|v| v.1)
    }

    /// Returns a count of work by name.
    pub fn count_of(&self, name: &str) -> u64 {
        self.work.iter().find(|(n, _)| n == name).map_or(0, |w| w.1)
    }

    /// Records counts of the solution.
    pub fn record_work<const D: usize>(&mut self, bonds: &dyn Bonds<D>, state: &State<D>) {
        let directed = bonds.directed_bonds();
        for (name, count) in [
            ("particles", bonds.particles().len() as u64),
            ("directed_bonds", directed),
            ("steps", if state.stage.finished > 0 { state.history.len() } else { state.step } as u64),
            ("iterations", state.counts.total_iterations),
            ("unconverged_searches", state.counts.unconverged),
            ("force_evaluations", state.counts.evaluations),
            ("bond_evaluations", state.counts.bond_evaluations),
            ("bytes_bonds", bonds.bytes() as u64),
        ] {
            self.work.push((name.to_owned(), count));
        }
        if state.motion.limits.bounds > 0 {
            self.work.push(("frequency_bounds".to_owned(), state.motion.limits.bounds));
            self.work.push(("frequency_searches".to_owned(), state.motion.limits.searches));
        }
    }

    /// Records the seconds of all phases.
    pub fn record_seconds(&mut self, phases: &Phases) {
        self.seconds = phases.seconds().map(|(name, seconds)| (name.to_owned(), seconds)).collect();
    }

    /// Returns the seconds of a phase.
    pub fn seconds_of(&self, phase: &str) -> f64 {
        self.seconds.iter().filter(|(name, _)| name == phase).map(|s| s.1).fold(0.0, |sum, s| sum + s)
    }
}

impl Solved for VariantOutcome {
    fn name(&self) -> &str {
        &self.name
    }

    fn scalar(&self, quantity: &str) -> Option<(f64, &str)> {
        self.values.iter().find(|(name, _, _)| name == quantity).map(|(_, value, unit)| (*value, &**unit))
    }

    fn solve_seconds(&self) -> f64 {
        self.seconds_of("solve")
    }
}

/// Returns families of at least two variants that differ in spacing only, coarse to fine.
pub fn families(outcomes: &[VariantOutcome]) -> Vec<(String, Vec<&VariantOutcome>)> {
    let mut families: Vec<(String, Vec<&VariantOutcome>)> = Vec::new();
    for outcome in outcomes {
        match families.iter_mut().find(|(name, _)| *name == outcome.family) {
            Some((_, members)) => members.push(outcome),
            None => families.push((outcome.family.clone(), vec![outcome])),
        }
    }
    for (_, members) in &mut families {
        members.sort_by(|a, b| b.spacing.total_cmp(&a.spacing));
    }
    families.retain(|(_, members)| members.len() > 1);
    families
}
