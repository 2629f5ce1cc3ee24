//! The search: residuals of all runs, their Jacobian, and starting points.

use nalgebra::{DMatrix, DVector};

use super::super::{Pace, Viscoelastic};
use super::form::{Constant, Form, Scales};
use super::runs::{self, MeasuredRun};
use super::{SpringForm, ViscosityForm};
use crate::constitutive::Error;
use crate::constitutive::hyperelastic::{Domain, fit as elastic};
use crate::numerics::least_squares::levenberg_marquardt;

/// Residual of constants without a law, relative to the scale of the stresses.
const REJECTED: f64 = 1e6;

/// Forward difference of q.
const DIFFERENCE: f64 = 1e-5;

/// Relative decrease of Σr² over a number of iterations below which a search ends.
const PROGRESS: (f64, usize) = (1e-5, 4);

/// Most iterations from one start.
const ITERATIONS: usize = 60;

/// Least-squares problem in the unbounded q of the constants that are fitted.
pub(super) struct Problem<'a> {
    pub form: &'a Form,
    pub runs: &'a [MeasuredRun],
    pub constants: Vec<Constant>,
    pub scales: Scales,
    pace: Pace,
    /// Constants of the equilibrium law without time.
    elastic: Vec<f64>,
    /// Root mean square of the stresses, Pa.
    size: f64,
}

impl<'a> Problem<'a> {
    pub fn new(form: &'a Form, runs: &'a [MeasuredRun], pace: Pace) -> Result<Self, Error> {
        let table = runs::elastic(runs);
        let measured: Vec<f64> = runs.iter().flat_map(|run| run.points()).map(|p| p.nominal).collect();
        let size = (measured.iter().map(|p| p * p).sum::<f64>() / measured.len().max(1) as f64).sqrt();
        let modulus = elastic::neo_hookean_modulus(&table)?;
        let durations = runs.iter().map(MeasuredRun::duration);
        let [shortest, longest] =
            durations.fold([f64::INFINITY, 0.0_f64], |[least, most], t| [least.min(t), most.max(t)]);
        let mut limits = Vec::new();
        for parameter in form.equilibrium.parameters {
            let mut most = 0.0_f64;
            if let Domain::Above(limit) = parameter.domain {
                for state in &table.states {
                    most = most.max(limit(state.principal_stretches()?));
                }
            }
            limits.push(most);
        }
        let unit = 1000_f64.powf(size.log(1000.0).floor());
        let (peaks, most) = runs::turns(runs);
        let energy = 0.5 * modulus * most;
        let scales = Scales { modulus, unit, durations: [shortest, longest], energy, peaks, limits };
        let constants = form.constants(&scales)?;
        let free = constants.iter().filter(|constant| constant.fixed.is_none()).count();
        if measured.len() < free {
            let reason = format!("{} measured stresses for {free} constants", measured.len());
            return Err(Error::Data { what: "fit of a law with time".to_owned(), reason });
        }
        let elastic = elastic::fit(form.equilibrium, &table)?;
        let elastic = elastic.parameters.iter().map(|parameter| parameter.value).collect();
        Ok(Self { form, runs, constants, scales, pace, elastic, size })
    }

    /// Number of measured stresses.
    pub fn measurements(&self) -> usize {
        self.runs.iter().map(|run| run.points().len()).sum()
    }

    /// All constants at q.
    pub fn values(&self, q: &DVector<f64>) -> Vec<f64> {
        let mut free = q.iter();
        let value = |constant: &Constant| match constant.fixed {
            Some((value, _)) => value,
            None => constant.map.constant(free.next().copied().unwrap_or(0.0)),
        };
        self.constants.iter().map(value).collect()
    }

    /// q of all constants.
    pub fn inverse(&self, values: &[f64]) -> DVector<f64> {
        let free = self.constants.iter().zip(values).filter(|(constant, _)| constant.fixed.is_none());
        DVector::from_vec(free.map(|(constant, value)| constant.map.inverse(*value)).collect())
    }

    pub fn law(&self, q: &DVector<f64>) -> Result<Viscoelastic, Error> {
        self.form.law(&self.values(q))
    }

    /// Model minus data of each run at each of several q, Pa, in their order.
    fn residuals_at(&self, points: &[DVector<f64>]) -> Vec<Option<DVector<f64>>> {
        let tasks: Vec<(usize, usize)> =
            (0..points.len()).flat_map(|i| (0..self.runs.len()).map(move |j| (i, j))).collect();
        let found = in_order(&tasks, |&(i, j)| {
            let law = self.law(&points[i]).ok()?;
            let residuals = self.runs[j].residuals(&law, self.pace).ok()?;
            residuals.iter().all(|r| r.is_finite()).then_some(residuals)
        });
        let whole = |runs: &[Option<Vec<f64>>]| {
            let runs: Option<Vec<&[f64]>> = runs.iter().map(Option::as_deref).collect();
            Some(DVector::from_vec(runs?.concat()))
        };
        found.chunks(self.runs.len()).map(whole).collect()
    }

    /// Model minus data, Pa; `None` where there is no law or no stress.
    pub fn residuals(&self, q: &DVector<f64>) -> Option<DVector<f64>> {
        self.residuals_at(std::slice::from_ref(q)).pop().flatten()
    }

    /// Residuals and their derivatives by q, Pa.
    pub fn jacobian(&self, q: &DVector<f64>) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let moved = |i: usize| {
            let mut there = q.clone();
            there[i] += DIFFERENCE;
            there
        };
        let points: Vec<DVector<f64>> = [q.clone()].into_iter().chain((0..q.len()).map(moved)).collect();
        let mut found = self.residuals_at(&points).into_iter();
        let here = found.next()??;
        // a column without a law has no effect: the search turns elsewhere
        let column = |there: Option<DVector<f64>>| match there {
            Some(there) => (there - &here) / DIFFERENCE,
            None => DVector::zeros(here.len()),
        };
        let columns: Vec<DVector<f64>> = found.map(column).collect();
        let jacobian = DMatrix::from_columns(&columns);
        Some((here, jacobian))
    }

    /// Searches from q: Levenberg–Marquardt until Σr² stands still. Returns q, Σr², Pa², and the evaluations
    /// of all residuals.
    pub fn search(&self, from: DVector<f64>) -> Option<(DVector<f64>, f64, usize)> {
        let (count, size) = (self.measurements(), self.size);
        let evaluations = std::cell::Cell::new(0);
        let mut squares: Vec<f64> = Vec::new();
        let history = std::cell::RefCell::new(&mut squares);
        let residuals = |q: &DVector<f64>| {
            evaluations.set(evaluations.get() + 1);
            let rejected = || DVector::from_element(count, REJECTED);
            Some(self.residuals(q).map_or_else(rejected, |found| found / size))
        };
        let jacobian = |q: &DVector<f64>| {
            let (here, jacobian) = self.jacobian(q)?;
            evaluations.set(evaluations.get() + q.len() + 1);
            let mut history = history.borrow_mut();
            history.push(here.norm_squared());
            let (done, (least, stride)) = (history.len(), PROGRESS);
            let stands = done > stride && history[done - 1] > (1.0 - least) * history[done - 1 - stride];
            (!stands && done <= ITERATIONS).then(|| jacobian / size)
        };
        let end = levenberg_marquardt(from, 20, residuals, jacobian).at;
        let found = self.residuals(&end)?;
        Some((end, found.norm_squared(), evaluations.get()))
    }

    /// Starting point of a number: the elastic fit with part of its modulus, branches of relaxation times
    /// spread over those of the runs. The first lies in the middle of all choices, others follow a sequence
    /// without random numbers.
    pub fn start(&self, number: usize) -> DVector<f64> {
        let mut draw = Sequence { number, index: 0 };
        let scales = &self.scales;
        let mut values = Vec::new();
        let share = draw.between(0.5, 0.9);
        for (parameter, value) in self.form.equilibrium.parameters.iter().zip(&self.elastic) {
            values.push(match (parameter.unit, parameter.domain) {
                ("Pa", _) => share * value,
                (_, Domain::Real) => value.clamp(-5.0, 8.0),
                _ => *value,
            });
        }
        let count = self.form.branches.len() as f64;
        let [shortest, longest] = [0.02 * scales.durations[0], 0.5 * scales.durations[1]];
        for (k, branch) in self.form.branches.iter().enumerate() {
            let part = (k as f64 + draw.between(0.2, 0.8)) / count;
            let time = shortest * (longest / shortest).powf(part);
            let ratio = draw.between(0.3_f64.ln(), 3.0_f64.ln()).exp() / count;
            let modulus = ratio * scales.modulus;
            match branch.spring {
                SpringForm::NeoHookean => values.push(modulus),
                SpringForm::LopezPamies(terms) => {
                    for r in 0..terms {
                        let exponent = [draw.between(0.2, 1.6), draw.between(-8.0, 0.0)];
                        values.extend([modulus / terms as f64, exponent[r % 2]]);
                    }
                }
                SpringForm::EightChain => values.extend([modulus, 30.0]),
                SpringForm::Proportional => values.push(ratio / share),
            }
            // stress of the branch where it flows
            let stress = 0.5 * modulus;
            match branch.viscosity {
                ViscosityForm::Constant => values.push(modulus * time),
                ViscosityForm::KumarLopezPamies => {
                    let thinning = scales.unit.powi(-2);
                    let power = draw.between(0.2, 1.2);
                    let start = modulus * time * (1.0 + (thinning * stress * stress).powf(power));
                    let thickening = draw.between(-4.0, -1.0).exp() * start;
                    values.extend([start, 1e-3 * start, thickening, thinning]);
                    values.extend([draw.between(1.0, 3.0), power]);
                }
                ViscosityForm::BergstromBoyce => {
                    let power = draw.between(2.0, 8.0);
                    let creep = draw.between(-0.8, -0.2);
                    let scale = stress * (time * 0.3_f64.powf(creep)).powf(power.recip());
                    values.extend([1.0, scale, power, creep, 0.01]);
                }
                ViscosityForm::Eyring => {
                    let ratio = draw.between(1.0, 6.0);
                    values.extend([1.0 / (time * ratio.sinh()), stress / ratio]);
                }
            }
        }
        if self.form.softening {
            let width = draw.between(0.1, 0.5) * scales.energy;
            values.extend([draw.between(1.3, 2.5), width, draw.between(0.05, 0.3)]);
        }
        self.inverse(&values)
    }
}

/// Maps items, in their order on any number of threads.
#[cfg(any(feature = "solvers", feature = "hdf5"))]
fn in_order<T: Sync, R: Send>(items: &[T], map: impl Fn(&T) -> R + Sync + Send) -> Vec<R> {
    use rayon::prelude::*;
    items.par_iter().map(map).collect()
}

#[cfg(not(any(feature = "solvers", feature = "hdf5")))]
fn in_order<T, R>(items: &[T], map: impl Fn(&T) -> R) -> Vec<R> {
    items.iter().map(map).collect()
}

/// Numbers that fill a cube of any dimension evenly: multiples of square roots of primes, modulo 1 (Richtmyer
/// 1951).
struct Sequence {
    number: usize,
    index: usize,
}

const PRIMES: [f64; 24] = [
    2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0, 23.0, 29.0, 31.0, 37.0, 41.0, 43.0, 47.0, 53.0, 59.0, 61.0,
    67.0, 71.0, 73.0, 79.0, 83.0, 89.0,
];

impl Sequence {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        let prime = PRIMES[self.index % PRIMES.len()];
        self.index += 1;
        low + (high - low) * (0.5 + self.number as f64 * prime.sqrt()).fract()
    }
}
