//! Branches of springs and dashpots, fitted to runs that unload.

use crate::Error;
use crate::dataset::{DataRow, Path};
use crate::eval::overstress;
use crate::train::loading;
use nalgebra::{DMatrix, DVector};
use polycore::constitutive::hyperelastic::NeoHookean;
use polycore::constitutive::viscoelastic::{Branch, BranchState, Spring, Viscosity};
use polycore::numerics::least_squares::levenberg_marquardt;
use polycore::tensor::Voigt;

/// Largest number of branches; a dozen runs at rates of one decade do not determine more.
pub const MOST_BRANCHES: usize = 3;

/// Weight of a prior that pulls the logarithm of each constant to its start value, as for damage.
const PRIOR: f64 = 0.03;

/// Fits neo-Hookean branches with constant viscosities to the hysteresis of runs: least squares of the
/// stress of unloading rows minus that of loading at the same strain of the same run. What the loading and
/// the unloading curve have in common belongs to the equilibrium law, which is learnt afterwards.
///
/// # Errors
/// [`Error::Data`] without unloading rows; errors of [`overstress`].
pub fn fit_branches(paths: &[&Path], count: usize) -> Result<Vec<Branch>, Error> {
    let runs = paths.iter().map(|path| Unloading::new(path)).filter(|run| !run.falls.is_empty());
    let runs: Vec<Unloading> = runs.collect();
    let scale =
        runs.iter().map(|run| run.scale / (run.falls.len() as f64).sqrt()).reduce(f64::min).ok_or_else(
            || {
                let (found, allowed) = ("no unloading rows".into(), "runs with unloading".into());
                Error::Data { what: "branches", found, allowed }
            },
        )?;
    let of_rows = |value: fn(&DataRow) -> f64| {
        runs.iter().flat_map(|run| run.path.rows.iter().map(value)).fold(0.0, f64::max)
    };
    let longest = of_rows(|row| row.time);
    let reach = of_rows(|row| (row.c - BranchState::REST.viscous).norm());
    // ln ν, ln τ: relaxation times in equal ratios within the longest run
    let constants = |k: usize| [(scale / reach).ln(), (longest * 0.1f64.powi(k as i32 + 1)).ln()];
    let start = DVector::from_vec((0..count).flat_map(constants).collect());
    let residuals = |at: &DVector<f64>| -> Option<DVector<f64>> {
        let branches = branches(at).ok()?;
        let mut all = Vec::new();
        for Unloading { path, falls, scale } in &runs {
            let own = overstress(&branches, path).ok()?;
            for fall in falls {
                let missed = fall.between(|row| own[row]) - fall.between(|row| path.rows[row].s);
                all.extend(missed.iter().map(|x| x / scale));
            }
        }
        all.extend((at - &start).iter().map(|x| x * PRIOR));
        Some(DVector::from_vec(all))
    };
    let jacobian = |at: &DVector<f64>| -> Option<DMatrix<f64>> {
        let column = |k: usize| {
            let [more, less] = [STEP, -STEP].map(|step| {
                let mut at = at.clone();
                at[k] += step;
                residuals(&at)
            });
            Some((more? - less?) / (2.0 * STEP))
        };
        Some(DMatrix::from_columns(&(0..at.len()).map(column).collect::<Option<Vec<_>>>()?))
    };
    let found = levenberg_marquardt(start.clone(), 100, residuals, jacobian);
    if !found.objective.is_finite() {
        let (found, allowed) =
            (format!("a misfit of {}", found.objective), "finite strains and stresses".into());
        return Err(Error::Data { what: "branches", found, allowed });
    }
    branches(&found.at)
}

/// Step of the differences in the logarithm of a constant.
const STEP: f64 = 1e-4;

fn branches(at: &DVector<f64>) -> Result<Vec<Branch>, Error> {
    let branch = |constants: &[f64]| {
        let [modulus, time] = [constants[0].exp(), constants[1].exp()];
        let spring = Spring::NeoHookean(NeoHookean::new(modulus)?);
        Ok(Branch::new(spring, Viscosity::Constant(modulus * time))?)
    };
    at.as_slice().chunks(2).map(branch).collect()
}

/// Row of unloading beside the rows of loading at the same strain.
struct Fall {
    row: usize,
    /// Neighbours in loading, and the share of the second.
    loading: [usize; 2],
    share: f64,
}

impl Fall {
    /// Value at the row minus that in loading.
    fn between(&self, value: impl Fn(usize) -> Voigt) -> Voigt {
        let [a, b] = self.loading.map(&value);
        value(self.row) - (a + self.share * (b - a))
    }
}

/// Run with its rows of unloading whose ‖C − 1‖ was passed in loading.
struct Unloading<'a> {
    path: &'a Path,
    falls: Vec<Fall>,
    /// Norm of all stresses of `falls` minus those in loading, Pa: every run weighs the same.
    scale: f64,
}

impl<'a> Unloading<'a> {
    fn new(path: &'a Path) -> Self {
        let strain = |row: usize| (path.rows[row].c - BranchState::REST.viscous).norm();
        let is_loading = loading(path);
        let peak = (0..path.rows.len()).max_by(|&a, &b| strain(a).total_cmp(&strain(b))).unwrap_or(0);
        let fall = |row: usize| {
            let after = (1..=peak).find(|&after| strain(after) >= strain(row))?;
            let [a, b] = [strain(after - 1), strain(after)];
            let share = if b > a { ((strain(row) - a) / (b - a)).clamp(0.0, 1.0) } else { 0.0 };
            Some(Fall { row, loading: [after - 1, after], share })
        };
        let falls: Vec<_> =
            (peak..path.rows.len()).filter(|&row| !is_loading[row]).filter_map(fall).collect();
        let square = |fall: &Fall| fall.between(|row| path.rows[row].s).norm_squared();
        let scale = falls.iter().map(square).sum::<f64>().sqrt();
        Self { path, falls, scale }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinematics::cauchy_from_material;
    use polycore::tensor::{DeformationGradient, Tensor};

    /// Returns a stretch along x to `most` and back in a `duration`, s, with the stress 300 GPa · E of a
    /// solid and that of branches.
    fn there_and_back(law: &[Branch], most: f64, duration: f64) -> Path {
        let rows = (0..=100u64).map(|sample| {
            let stretch = 1.0 + (most - 1.0) * (1.0 - (sample as f64 / 50.0 - 1.0).abs());
            let f = DeformationGradient::new(Tensor::from_diagonal(&[stretch, 1.0, 1.0].into())).unwrap();
            let s = Voigt::new(150e9 * (stretch * stretch - 1.0), 0.0, 0.0, 0.0, 0.0, 0.0);
            DataRow::new(sample, duration * sample as f64 / 100.0, f, cauchy_from_material(&f, &s))
        });
        let mut path =
            Path { id: most.to_string(), kind: "ux".into(), rates: [f64::NAN; 3], rows: rows.collect() };
        for (row, own) in overstress(law, &path).unwrap().into_iter().enumerate() {
            path.rows[row].s += own;
        }
        path
    }

    #[test]
    fn finds_the_branch_of_its_data() {
        let spring = Spring::NeoHookean(NeoHookean::new(20e9).unwrap());
        let truth = [Branch::new(spring, Viscosity::Constant(20e9 * 300e-15)).unwrap()];
        let runs = [(1.05, 1e-12), (1.1, 2e-12), (1.1, 4e-12)];
        let runs = runs.map(|(most, duration)| there_and_back(&truth, most, duration));
        let found = fit_branches(&runs.iter().collect::<Vec<_>>(), 1).unwrap();
        let unseen = there_and_back(&truth, 1.08, 3e-12);
        let stress = overstress(&found, &unseen).unwrap();
        let expected = overstress(&truth, &unseen).unwrap();
        let largest = expected.iter().map(Voigt::norm).fold(0.0, f64::max);
        let worst = stress.iter().zip(&expected).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        evidence::at_most("stress of a branch found in its data, relative", worst / largest, 5e-3);
    }

    #[test]
    fn runs_without_unloading_are_refused() {
        let mut run = there_and_back(&[], 1.1, 1e-12);
        run.rows.truncate(50);
        assert!(fit_branches(&[&run], 1).is_err());
    }
}
