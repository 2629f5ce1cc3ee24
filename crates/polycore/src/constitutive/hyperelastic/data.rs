//! Measured homogeneous states of an incompressible rubber.

use super::Error;
use super::homogeneous::incompressible;

/// Table of homogeneous states.
#[derive(Debug, Clone, PartialEq)]
pub struct TestData {
    /// Source of the numbers: the `# source:` line of the file, or empty.
    pub source: String,
    /// The states, in the order of the file.
    pub states: Vec<TestState>,
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
        }
    }

    /// λ₂ of a test at λ₁; for biaxial states, which define none, λ₁.
    pub fn second_stretch(self, first: f64) -> f64 {
        match self {
            Self::Uniaxial => first.recip().sqrt(),
            Self::PureShear | Self::SimpleShear => 1.0,
            Self::Equibiaxial | Self::Biaxial | Self::Component | Self::Difference => first,
        }
    }
}

/// Two principal stretches (λ₃ = 1/(λ₁λ₂)) and their nominal stresses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TestState {
    /// Type of test.
    pub mode: Mode,
    /// λ₁, λ₂.
    pub stretches: [f64; 2],
    /// P₁, P₂ in Pa. **Exactly zero means a free face or a body at rest: a condition, not a measurement.**
    pub nominal: [f64; 2],
}

impl TestData {
    /// Selects the states of one test.
    ///
    /// # Errors
    /// [`Error::Data`] if no stress of it was measured.
    pub fn select(&self, mode: Mode) -> Result<Self, Error> {
        let states = self.states.iter().copied().filter(|state| state.mode == mode).collect();
        let table = Self { source: self.source.clone(), states };
        if table.measurements() == 0 {
            let reason = "contains no stress other than zero".to_owned();
            return Err(Error::Data { what: format!("mode `{}`", mode.name()), reason });
        }
        Ok(table)
    }

    /// Number of measured stresses, i.e. of those that are not exactly zero.
    pub fn measurements(&self) -> usize {
        self.states.iter().flat_map(TestState::measured).count()
    }
}

impl TestState {
    /// λ₁, λ₂, λ₃.
    ///
    /// # Errors
    /// [`Error::Deformation`] if one is not positive and finite.
    pub fn principal_stretches(&self) -> Result<[f64; 3], Error> {
        incompressible(self.stretches[0], self.stretches[1])
    }

    /// State of simple shear by an amount γ at a shear stress τ = P₁₂ = σ₁₂, Pa: σ₁ − σ₃ = τ(λ + 1/λ).
    pub fn simple_shear(amount: f64, stress: f64) -> Self {
        let stretch = 0.5 * amount + (0.5 * amount).hypot(1.0);
        let nominal = stress * (1.0 + stretch.powi(-2));
        Self { mode: Mode::SimpleShear, stretches: [stretch, 1.0], nominal: [nominal, 0.0] }
    }

    /// Factor of P in residuals: 1, so that nominal stresses are compared; λ₁ of [`Mode::Difference`], so
    /// that true ones are; of simple shear that of the shear stress.
    pub fn weight(&self) -> f64 {
        match self.mode {
            Mode::Difference => self.stretches[0],
            Mode::SimpleShear => 1.0 / (1.0 + self.stretches[0].powi(-2)),
            _ => 1.0,
        }
    }

    /// Measured stresses times [`TestState::weight`], Pa.
    pub fn measured(&self) -> impl Iterator<Item = f64> + Clone + use<> {
        let weight = self.weight();
        self.nominal.into_iter().filter(|nominal| *nominal != 0.0).map(move |nominal| weight * nominal)
    }
}
