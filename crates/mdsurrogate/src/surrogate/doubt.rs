//! The limit of an ensemble's spread.

use super::{Surrogate, Workspace};
use crate::Error;
use polycore::tensor::Voigt;

impl Surrogate<f64> {
    /// The same law, whose answers are flagged where its members disagree by more than at any of these strains, those of
    /// its training: as box and distance, a spread is in doubt beyond all that the training rows have. No limit for a
    /// single member, or for members that agree everywhere.
    ///
    /// # Errors
    /// Those of [`Surrogate::stress`].
    pub fn with_spread_limit(mut self, strains: &[Voigt]) -> Result<Self, Error> {
        let mut memory = Workspace::default();
        let mut greatest = 0.0f64;
        for c in strains {
            greatest = greatest.max(self.stress(c, &mut memory)?.spread);
        }
        self.header.spread_limit = (self.members.len() > 1 && greatest > 0.0).then_some(greatest);
        Ok(self)
    }
}
