//! Fits of one table.

use polycore::constitutive::hyperelastic::data::TestData;
use polycore::constitutive::hyperelastic::fit::{Agreement, Fit};

use super::ranking::RankedLaw;
use super::verdict::FitVerdict;
use super::volumetric::Bulk;

/// Fits to one table.
pub struct TableFits<'a> {
    pub name: &'a str,
    pub table: &'a TestData,
    /// Layout of the file.
    pub read: &'a [String],
    pub fits: Vec<Fit>,
    /// Verdicts on these fits, in their order.
    pub verdicts: Vec<FitVerdict>,
    /// Laws that could not be fitted, and the reason.
    pub failed: Vec<(&'static str, String)>,
    /// Law, other table, agreement there; `None` if the law locks.
    pub crossed: Vec<(&'static str, &'a str, Option<Agreement>)>,
    /// Other table, its number of states and of those outside the strains of this one.
    pub outside: Vec<(&'a str, usize, usize)>,
    /// Laws by their predictions of modes left out; none without `rank`.
    pub ranked: Vec<RankedLaw>,
    /// Bulk modulus of its blocks and cards.
    pub bulk: Bulk<'a>,
}

impl TableFits<'_> {
    /// Iterates over fits with their verdicts.
    pub fn judged(&self) -> impl Iterator<Item = (&Fit, &FitVerdict)> + Clone {
        self.fits.iter().zip(&self.verdicts)
    }

    /// Unit of the table's stresses and its value in Pa, chosen by the largest modulus.
    pub fn unit(&self) -> (&'static str, f64) {
        unit_of(self.fits.iter().map(|fit| fit.law.shear_modulus()).fold(0.0, f64::max))
    }
}

/// Unit in which a stress has a readable number, and its value in Pa.
pub fn unit_of(stress: f64) -> (&'static str, f64) {
    match stress.abs() {
        size if size >= 1e9 => ("GPa", 1e9),
        size if size >= 1e4 => ("MPa", 1e6),
        size if size >= 1e2 => ("kPa", 1e3),
        _ => ("Pa", 1.0),
    }
}
