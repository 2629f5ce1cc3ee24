//! Damage variable of an energy, fitted to runs with unloading.

use crate::Error;
use crate::dataset::Path;
use crate::surrogate::{Softening, SofteningHistory, Surrogate, Workspace};
use nalgebra::{DMatrix, DVector};
use polycore::numerics::least_squares::levenberg_marquardt;
use polycore::tensor::Voigt;

/// A row unloads if ‖C − 1‖ is below this fraction of its largest value in the run; fluctuations of a small
/// cell are not unloading.
const UNLOADED: f64 = 0.9;

/// Weight of a prior that pulls the logarithm of each constant to its start value. A few runs do not
/// determine all constants; without the prior some drift to e^±20.
const PRIOR: f64 = 0.03;

/// Largest number of units; twelve runs do not determine more.
pub const MOST_UNITS: usize = 8;

/// Tells for each row of a run if it is on the loading curve.
pub fn loading(path: &Path) -> Vec<bool> {
    let mut greatest = 0.0f64;
    let identity = Voigt::new(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
    let row = |row: &crate::dataset::DataRow| {
        let strain = (row.c - identity).norm();
        greatest = greatest.max(strain);
        strain >= UNLOADED * greatest
    };
    path.rows.iter().map(row).collect()
}

/// Fits a damage variable with this number of units to an energy, by least squares of ‖S − Ŝ‖ over the
/// unloading rows of the runs.
///
/// # Errors
/// Returns [`Error::Data`] without unloading rows, and the errors of [`Surrogate::stress`] and
/// [`Surrogate::with_softening`].
pub fn soften(law: Surrogate, paths: &[&Path], units: usize) -> Result<Surrogate, Error> {
    let mut memory = Workspace::default();
    let mut rows = Vec::new();
    let mut greatest = 0.0f64;
    for path in paths {
        let mut history = SofteningHistory::default();
        for (row, loading) in path.rows.iter().zip(loading(path)) {
            let answer = law.stress(&row.c, &mut memory)?;
            let energy = answer.energy.unwrap_or(0.0);
            history.greatest = history.greatest.max(energy);
            if !loading && energy < history.greatest {
                rows.push((energy, history, answer.stress, row.s));
            }
        }
        greatest = greatest.max(history.greatest);
    }
    if rows.is_empty() {
        let (found, allowed) = ("no unloading rows".into(), "runs with unloading".into());
        return Err(Error::Data { what: "softening", found, allowed });
    }
    let scale = (rows.iter().map(|row| row.3.norm_squared()).sum::<f64>() / rows.len() as f64).sqrt();
    // ln a, ln b, ln c: different c separate the units
    let unit = |k: usize| [(0.5 / units as f64).ln(), 1.0, 2.0 * k as f64 - 1.0];
    let start = DVector::from_vec((0..units).flat_map(unit).collect());
    let problem = SofteningProblem { rows, greatest, scale, start: start.clone() };
    let (residuals, jacobian) = (|at: &_| Some(problem.residuals(at)), |at: &_| Some(problem.jacobian(at)));
    let found = levenberg_marquardt(start, 100, residuals, jacobian);
    law.with_softening(problem.softening(&found.at)).map_err(Error::from)
}

struct SofteningProblem {
    /// Energy W, history, S of the energy, and measured S.
    rows: Vec<(f64, SofteningHistory, Voigt, Voigt)>,
    greatest: f64,
    scale: f64,
    start: DVector<f64>,
}

impl SofteningProblem {
    fn softening(&self, at: &DVector<f64>) -> Softening {
        let unit = |unit: &[f64]| [unit[0].exp(), unit[1].exp(), unit[2].exp()];
        Softening { units: at.as_slice().chunks(3).map(unit).collect(), greatest: self.greatest }
    }

    fn residuals(&self, at: &DVector<f64>) -> DVector<f64> {
        let softening = self.softening(at);
        let row = |(energy, history, own, measured): &(f64, SofteningHistory, Voigt, Voigt)| -> [f64; 6] {
            let [damage, _] = softening.damage(*energy, *history);
            ((own * (1.0 - damage) - measured) / self.scale).into()
        };
        let prior = (at - &self.start) * PRIOR;
        let all = self.rows.iter().flat_map(row).chain(prior.iter().copied());
        DVector::from_iterator(6 * self.rows.len() + at.len(), all)
    }

    fn jacobian(&self, at: &DVector<f64>) -> DMatrix<f64> {
        let softening = self.softening(at);
        let mut jacobian = DMatrix::zeros(6 * self.rows.len() + at.len(), at.len());
        for (k, (energy, history, own, _)) in self.rows.iter().enumerate() {
            let [damage, _] = softening.damage(*energy, *history);
            for (unit, [a, b, c]) in softening.units.iter().enumerate() {
                let (x, y) = (1.0 - energy / history.greatest, history.greatest / self.greatest);
                let (fall, reached) = ((b * x).tanh(), y.powf(*c));
                // derivatives by ln a, ln b, ln c
                let slopes = [
                    a * fall * reached,
                    a * b * x * (1.0 - fall * fall) * reached,
                    a * fall * reached * c * y.ln(),
                ];
                for (part, slope) in slopes.into_iter().enumerate() {
                    let column = -(1.0 - damage) * slope / self.scale * own;
                    for a in 0..6 {
                        jacobian[(6 * k + a, 3 * unit + part)] = column[a];
                    }
                }
            }
        }
        for k in 0..at.len() {
            jacobian[(6 * self.rows.len() + k, k)] = PRIOR;
        }
        jacobian
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::DataRow;
    use crate::kinematics::cauchy_from_material;
    use crate::network::Activation::Softplus;
    use crate::surrogate::{Header, Kind, Symmetry};
    use polycore::tensor::{DeformationGradient, Tensor, Voigt};

    /// Returns a stretch along x to `most` and back.
    fn there_and_back(law: &Surrogate, most: f64) -> Path {
        let (mut memory, mut history) = (Workspace::default(), SofteningHistory::default());
        let rows = (0..=100u64).map(|sample| {
            let stretch = 1.0 + (most - 1.0) * (1.0 - (sample as f64 / 50.0 - 1.0).abs());
            let f = DeformationGradient::new(Tensor::from_diagonal(&[stretch, 1.0, 1.0].into())).unwrap();
            let c = Voigt::new(stretch * stretch, 1.0, 1.0, 0.0, 0.0, 0.0);
            let s = law.follow(&c, false, &mut history, &mut memory).unwrap().stress;
            DataRow::new(sample, f64::NAN, f, cauchy_from_material(&f, &s))
        });
        Path { id: most.to_string(), kind: "ux".into(), rates: [f64::NAN; 3], rows: rows.collect() }
    }

    /// The damage of the data is recovered, also on runs between those of the fit.
    #[test]
    fn finds_the_damage_of_its_data() {
        let header = Header::new(Kind::polyconvex_energy(Symmetry::Isotropic), &[(8, Softplus)], 1);
        let energy = Surrogate::random(header, 3).unwrap();
        let truth = Softening { units: vec![[0.6, 2.0, 1.5]], greatest: 4e4 };
        let softened = energy.clone().with_softening(truth).unwrap();
        let runs: Vec<Path> = [1.1, 1.2, 1.3].map(|most| there_and_back(&softened, most)).into();
        let paths: Vec<&Path> = runs.iter().collect();
        // C₁₁ − 1 is below 0.9 · 0.21 for strains up to 0.09
        assert_eq!(loading(paths[0]).iter().filter(|loading| !**loading).count(), 46);
        let found = soften(energy.clone(), &paths, 1).unwrap();
        // the prior costs 1e-4 of the stress
        let between = there_and_back(&softened, 1.25);
        let (mut memory, mut history) = (Workspace::default(), SofteningHistory::default());
        for row in &between.rows {
            let stress = found.follow(&row.c, false, &mut history, &mut memory).unwrap().stress;
            assert!((stress - row.s).norm() <= 1e-3 * row.s.norm().max(1.0), "{} {stress}", row.s);
        }
        let up = Path { rows: runs[0].rows[..50].to_vec(), ..runs[0].clone() };
        assert!(soften(energy, &[&up], 1).is_err());
    }
}
