//! Measured states of an incompressible rubber: homogeneous ones, and twisted cylinders.

use super::descriptor::Slopes;
use super::homogeneous::{biaxial, incompressible};
use super::torsion::TwistedCylinder;
use super::{Error, Hyperelastic};

/// Table of measured states.
#[derive(Debug, Clone, PartialEq)]
pub struct TestData {
    /// Source of the numbers: the `# source:` line of the file, or empty.
    pub source: String,
    /// The states, in the order of the file.
    pub states: Vec<TestState>,
    /// Standard deviation of a stress whose root of the weight is 1, Pa; that of another is this over its
    /// root. `None`: not known.
    pub deviation: Option<f64>,
}

/// Type of test.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// Bar: λ₂ = λ₃ = λ₁^{−1/2}.
    Uniaxial,
    /// Sheet stretched equally in both directions: λ₂ = λ₁.
    Equibiaxial,
    /// Wide strip ("planar tension"): λ₂ = 1.
    PureShear,
    /// Simple shear by γ: but for a rotation pure shear to λ = ½γ + √(1 + ¼γ²). `nominal` is the P₁ of that,
    /// (1 + λ⁻²) times the shear stress.
    SimpleShear,
    /// General biaxial state, any λ₁, λ₂; a table, not a test with one stretch.
    #[serde(skip)]
    Biaxial,
    /// General biaxial state of which a single stress was measured.
    #[serde(skip)]
    Component,
    /// σ₁ − σ₂ of a general biaxial state: as a pressure does not change it, it is the true stress along λ₁
    /// of the state whose second stretch is λ₃ and whose free face is that of λ₂. `nominal` is (σ₁ − σ₂)/λ₁.
    #[serde(skip)]
    Difference,
    /// [`TwistedCylinder`]: `stretches` are those at its surface, `nominal` is 2M/(πR³), N/(πR²).
    Torsion,
}

impl Mode {
    /// Tests that one stretch describes.
    pub const TESTS: [Self; 3] = [Self::Uniaxial, Self::Equibiaxial, Self::PureShear];

    /// Name of the test in tables and scenes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Uniaxial => "uniaxial",
            Self::Equibiaxial => "equibiaxial",
            Self::PureShear => "pure-shear",
            Self::SimpleShear => "simple-shear",
            Self::Biaxial => "biaxial",
            Self::Component => "biaxial, one stress",
            Self::Difference => "biaxial, difference of true stresses",
            Self::Torsion => "torsion",
        }
    }

    /// λ₂ of a test at λ₁, of torsion at fixed length; for biaxial states, which define none, λ₁.
    pub fn second_stretch(self, first: f64) -> f64 {
        match self {
            Self::Uniaxial => first.recip().sqrt(),
            Self::Torsion => first.recip(),
            Self::PureShear | Self::SimpleShear => 1.0,
            Self::Equibiaxial | Self::Biaxial | Self::Component | Self::Difference => first,
        }
    }
}

/// Two principal stretches (λ₃ = 1/(λ₁λ₂)) and their nominal stresses; of torsion as [`Mode::Torsion`] says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TestState {
    /// Type of test.
    pub mode: Mode,
    /// λ₁, λ₂.
    pub stretches: [f64; 2],
    /// P₁, P₂ in Pa. **Exactly zero means a free face or a body at rest: a condition, not a measurement.**
    pub nominal: [f64; 2],
    /// Roots of the weights of P₁, P₂: 1, or on average of the squares 1.
    pub roots: [f64; 2],
}

impl TestData {
    /// Creates a table of unknown standard deviations.
    pub fn new(source: String, states: Vec<TestState>) -> Self {
        Self { source, states, deviation: None }
    }

    /// Scales the roots of the weights, in 1/Pa if they are reciprocals of standard deviations (`absolute`),
    /// so that the mean of the weights is 1.
    pub(super) fn weighted(source: String, states: Vec<TestState>, absolute: bool) -> Self {
        let mut table = Self::new(source, states);
        let scale = (table.weight_sum() / table.measurements().max(1) as f64).sqrt();
        if scale > 0.0 {
            table.states.iter_mut().flat_map(|state| &mut state.roots).for_each(|root| *root /= scale);
            table.deviation = absolute.then_some(1.0 / scale);
        }
        table
    }

    /// Joins tables, whose measurements have these weights beside their own.
    ///
    /// # Errors
    /// [`Error::Data`] if the standard deviations of some are known, those of others not.
    pub fn join(tables: &[(&Self, f64)]) -> Result<Self, Error> {
        let known = tables.iter().filter(|(table, _)| table.deviation.is_some()).count();
        if known > 0 && known < tables.len() {
            let reason = "standard deviations of all tables, or of none".to_owned();
            return Err(Error::Data { what: "tables fitted at once".to_owned(), reason });
        }
        let weighted = |(table, weight): &(&Self, f64)| {
            let scale = weight.sqrt() / table.deviation.unwrap_or(1.0);
            table
                .states
                .iter()
                .map(move |state| TestState { roots: state.roots.map(|root| scale * root), ..*state })
                .collect::<Vec<_>>()
        };
        let source = tables.first().map_or_else(String::new, |(table, _)| table.source.clone());
        Ok(Self::weighted(source, tables.iter().flat_map(weighted).collect(), known > 0))
    }

    /// Selects the states of one test.
    ///
    /// # Errors
    /// [`Error::Data`] if no stress of it was measured.
    pub fn select(&self, mode: Mode) -> Result<Self, Error> {
        let states = self.states.iter().copied().filter(|state| state.mode == mode).collect();
        let table = Self { states, ..self.clone() };
        if table.measurements() == 0 {
            let reason = "contains no stress other than zero".to_owned();
            return Err(Error::Data { what: format!("mode `{}`", mode.name()), reason });
        }
        // the mean of the weights of the rows left is 1 again
        Self::join(&[(&table, 1.0)])
    }

    /// Sum of the weights of the measured stresses: their number without weights.
    pub fn weight_sum(&self) -> f64 {
        self.states.iter().flat_map(TestState::measured_roots).map(|root| root * root).sum()
    }

    /// Number of measured stresses, i.e. of those that are not exactly zero.
    pub fn measurements(&self) -> usize {
        self.states.iter().flat_map(TestState::measured).count()
    }
}

impl TestState {
    /// Creates a state of weight 1.
    pub fn new(mode: Mode, stretches: [f64; 2], nominal: [f64; 2]) -> Self {
        Self { mode, stretches, nominal, roots: [1.0; 2] }
    }

    /// λ₁, λ₂, λ₃.
    ///
    /// # Errors
    /// [`Error::Deformation`] if one is not positive and finite.
    pub fn principal_stretches(&self) -> Result<[f64; 3], Error> {
        incompressible(self.stretches[0], self.stretches[1])
    }

    /// Computes P₁, P₂ of a law, of torsion 2M/(πR³), N/(πR²), Pa.
    ///
    /// # Errors
    /// As [`biaxial`].
    pub fn predict<L: Hyperelastic + ?Sized>(&self, law: &L) -> Result<[f64; 2], Error> {
        match self.cylinder() {
            Some(cylinder) => cylinder.stresses(law),
            None => biaxial(law, self.stretches[0], self.stretches[1]),
        }
    }

    /// Computes the same from a closed form, with derivatives.
    pub(super) fn predict_slopes(&self, closed: Slopes, p: &[f64], slopes: &mut [[f64; 2]]) -> [f64; 2] {
        let Some(cylinder) = self.cylinder() else { return closed(p, self.stretches, slopes) };
        let mut part = vec![[0.0; 2]; slopes.len()];
        let mut stresses = [0.0; 2];
        slopes.fill([0.0; 2]);
        let add = |sum: &mut [f64; 2], one: [f64; 2]| *sum = [sum[0] + one[0], sum[1] + one[1]];
        for ring in cylinder.rings() {
            add(&mut stresses, ring.observed(closed(p, ring.stretches, &mut part)));
            slopes.iter_mut().zip(&part).for_each(|(sum, slope)| add(sum, ring.observed(*slope)));
        }
        stresses
    }

    /// The twisted cylinder of a state of torsion; `None` for homogeneous states.
    pub fn cylinder(&self) -> Option<TwistedCylinder> {
        (self.mode == Mode::Torsion).then(|| TwistedCylinder::from_surface(self.stretches))
    }

    /// Principal stretches of the strains that bound those of the body: its own, and of torsion those of the
    /// axis.
    ///
    /// # Errors
    /// As [`TestState::principal_stretches`].
    pub fn bounding_stretches(&self) -> Result<Vec<[f64; 3]>, Error> {
        let axis = self.cylinder().map(|cylinder| {
            let stretch = cylinder.stretch;
            incompressible(stretch, Mode::Uniaxial.second_stretch(stretch))
        });
        std::iter::once(self.principal_stretches()).chain(axis).collect()
    }

    /// State of simple shear by an amount γ at a shear stress τ = P₁₂ = σ₁₂, Pa: σ₁ − σ₃ = τ(λ + 1/λ).
    pub fn simple_shear(amount: f64, stress: f64) -> Self {
        let stretch = 0.5 * amount + (0.5 * amount).hypot(1.0);
        let nominal = stress * (1.0 + stretch.powi(-2));
        Self::new(Mode::SimpleShear, [stretch, 1.0], [nominal, 0.0])
    }

    /// Ratio of the stress that is compared to P: 1, so that nominal stresses are; λ₁ of
    /// [`Mode::Difference`], so that true ones are; of simple shear that of the shear stress.
    pub fn ratio(&self) -> f64 {
        match self.mode {
            Mode::Difference => self.stretches[0],
            Mode::SimpleShear => 1.0 / (1.0 + self.stretches[0].powi(-2)),
            _ => 1.0,
        }
    }

    /// Factor of P₁ or P₂ in residuals: [`TestState::ratio`] times the root of the weight.
    pub(super) fn factor(&self, axis: usize) -> f64 {
        self.ratio() * self.roots[axis]
    }

    /// Measured stresses times [`TestState::ratio`], Pa.
    pub fn measured(&self) -> impl Iterator<Item = f64> + Clone + use<> {
        let ratio = self.ratio();
        self.nominal.into_iter().filter(|nominal| *nominal != 0.0).map(move |nominal| ratio * nominal)
    }

    /// Roots of the weights of the measured stresses.
    pub fn measured_roots(&self) -> impl Iterator<Item = f64> + Clone + use<> {
        self.nominal.into_iter().zip(self.roots).filter(|(nominal, _)| *nominal != 0.0).map(|(_, root)| root)
    }

    /// Measured stresses as residuals count them, times the roots of their weights, Pa.
    pub(super) fn targets(&self) -> impl Iterator<Item = f64> + use<> {
        self.measured().zip(self.measured_roots()).map(|(stress, root)| root * stress)
    }
}
