//! What a law answers, and how far it is to be trusted.

use nalgebra::{SMatrix, SVector};

/// Why an answer may not be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Flags {
    /// Components of C outside the box of the training data.
    pub outside: [bool; 6],
    /// Of those, the ones that never changed in the training data: shear that was never seen, for example.
    pub unseen: [bool; 6],
    /// Farther from the representatives of the training strains than any training row: in a gap of the box.
    pub far: bool,
    /// The members of the ensemble disagree by more than the law's limit.
    pub spread: bool,
}

impl Flags {
    /// Whether there is any doubt.
    pub fn any(&self) -> bool {
        self.outside.contains(&true) || self.far || self.spread
    }
}

/// Stress at a C, with doubts.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Answer<T: nalgebra::Scalar> {
    /// S (3.3), Pa.
    pub stress: SVector<T, 6>,
    /// ℂ = 2 ∂S/∂C, Pa, in the Voigt order without factors (dS = ℂ dE with doubled shear strains); if asked for.
    pub tangent: Option<SMatrix<T, 6, 6>>,
    /// W, J/m³; an `ann` has none.
    pub energy: Option<T>,
    /// Root mean square over the members of the norm of their distance from the mean, Pa; 0 for a single one.
    pub spread: T,
    /// Doubts.
    pub flags: Flags,
}
