//! Least-squares fit of a law to homogeneous states.
//!
//! Minimised is the sum of squares of the nominal-stress residuals, over every stress of the table that was measured
//! (is not exactly zero; [`super::data::State::nominal`]). The figure of merit, `rms`, is the root of its mean.
//! Levenberg–Marquardt in transformed parameters (ln p for positive ones, ln(p/limit − 1) for locking limits) keeps
//! every iterate in the law's domain; several starts guard against local minima.

use std::cell::Cell;

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, Owned};

use super::data::Table;
use super::descriptor::Start;
use super::{Domain, Error, Hyperelastic, ModelDescriptor, homogeneous};

/// A fitted law.
pub struct Fit {
    /// The law.
    pub law: Box<dyn Hyperelastic>,
    /// Its model.
    pub model: &'static ModelDescriptor,
    /// Its parameters.
    pub parameters: Vec<Fitted>,
    /// Root mean square of the residuals over the measured stresses, Pa.
    pub rms: f64,
    /// Draws of all parameters from their posterior ([`crate::posterior`]); those that the data do not determine stay at their
    /// values. Empty where the data determine none.
    pub draws: Vec<Vec<f64>>,
    /// Measured stresses.
    pub measurements: usize,
    /// Evaluations of all residuals, over all starts (without those for derivatives).
    pub iterations: usize,
    /// Starts tried, and how many of them ended within 1e-4 of the best rms.
    pub starts: (usize, usize),
}

/// A fitted parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Fitted {
    /// Its name.
    pub name: &'static str,
    /// `Pa` or `1`.
    pub unit: &'static str,
    /// In that unit.
    pub value: f64,
    /// From s²(JᵀJ)⁻¹ at the minimum, s² = Σr²/(m − k); `None` if the data do not determine the parameter: it sits at
    /// an end of its domain, which for a locking limit is 1e6 × the least value allowed.
    pub standard_error: Option<f64>,
}

/// Model minus data for every measured stress, Pa, state by state.
///
/// # Errors
/// What the law refuses at a state of the table.
pub fn residuals<L: Hyperelastic + ?Sized>(law: &L, table: &Table) -> Result<Vec<f64>, Error> {
    let mut residuals = Vec::with_capacity(2 * table.states.len());
    for state in &table.states {
        let nominal = homogeneous::biaxial(law, state.stretches[0], state.stretches[1])?;
        let measured = nominal.into_iter().zip(state.nominal).filter(|(_, data)| *data != 0.0);
        residuals.extend(measured.map(|(model, data)| model - data));
    }
    Ok(residuals)
}

/// Root mean square of [`residuals`], Pa.
///
/// # Errors
/// As [`residuals`].
pub fn rms<L: Hyperelastic + ?Sized>(law: &L, table: &Table) -> Result<f64, Error> {
    let residuals = residuals(law, table)?;
    Ok((residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len() as f64).sqrt())
}

/// How a law follows the measured stresses of a table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Agreement {
    /// Root mean square of the residuals, Pa.
    pub rms: f64,
    /// Mean of their absolute values, Pa.
    pub mae: f64,
    /// 1 − Σr²/Σ(P − P̄)² with P̄ the mean of the measured stresses; none where they are all the same.
    pub r2: Option<f64>,
}

impl Agreement {
    /// Of a law and a table.
    ///
    /// # Errors
    /// As [`residuals`]: at a state beyond locking there is no stress to compare.
    pub fn of<L: Hyperelastic + ?Sized>(law: &L, table: &Table) -> Result<Self, Error> {
        let residuals = residuals(law, table)?;
        let count = residuals.len() as f64;
        let measured = || table.states.iter().flat_map(|state| state.nominal).filter(|data| *data != 0.0);
        let mean = measured().sum::<f64>() / count;
        let variation: f64 = measured().map(|data| (data - mean).powi(2)).sum();
        let squares: f64 = residuals.iter().map(|r| r * r).sum();
        Ok(Self {
            rms: (squares / count).sqrt(),
            mae: residuals.iter().map(|r| r.abs()).sum::<f64>() / count,
            r2: (variation > 0.0).then(|| 1.0 - squares / variation),
        })
    }
}

/// The best fit of a model to a table.
///
/// # Errors
/// [`Error::Data`] if the table has fewer measurements than the law has parameters; [`Error::NoConvergence`] if no
/// start arrives anywhere.
pub fn fit(model: &'static ModelDescriptor, table: &Table) -> Result<Fit, Error> {
    let measurements = table.measurements();
    if measurements < model.parameters.len() {
        return Err(Error::Data {
            what: format!("fit of `{}`", model.key),
            reason: format!("{measurements} measurements for {} parameters", model.parameters.len()),
        });
    }
    let modulus = neo_hookean_modulus(table)?;
    let map = Map::new(model, table, modulus)?;
    let solver = LevenbergMarquardt::new().with_patience(200);
    let mut ends: Vec<(f64, DVector<f64>)> = Vec::new();
    let mut iterations = 0;
    let starts = (model.starts)(&Start { limits: &map.limits, modulus, table });
    for start in &starts {
        let problem = Problem { map: &map, table, at: map.inverse(start), evaluations: Cell::new(0) };
        let (problem, report) = solver.minimize(problem);
        iterations += problem.evaluations.get();
        if report.objective_function < REJECTED && map.residuals(&problem.at, table).is_some() {
            ends.push((report.objective_function, problem.at));
        }
    }
    let Some((_, best)) = ends.iter().min_by(|a, b| a.0.total_cmp(&b.0)) else {
        return Err(Error::NoConvergence { iteration: "fit", steps: iterations, residual: f64::NAN });
    };
    let values = map.parameters(best);
    let law = model.law(&values)?;
    let rms = rms(&law, table)?;
    // objective = ½Σr², so 1e-4 in rms is 2e-4 in the objective
    let least = 0.5 * measurements as f64 * (rms / modulus).powi(2);
    let agreeing = ends.iter().filter(|(objective, _)| *objective <= least * (1.0 + 2e-4)).count();
    let (errors, draws) = map.uncertainty(best, table);
    let parameters = model
        .parameters
        .iter()
        .zip(values)
        .enumerate()
        .map(|(i, (parameter, value))| Fitted {
            name: parameter.name,
            unit: parameter.unit,
            value,
            standard_error: errors[i],
        })
        .collect();
    Ok(Fit { law, model, parameters, rms, draws, measurements, iterations, starts: (starts.len(), agreeing) })
}

/// The modulus of the best neo-Hookean law, in closed form: P is linear in μ. Scale and start of every fit.
fn neo_hookean_modulus(table: &Table) -> Result<f64, Error> {
    let unit = super::NeoHookean::new(1.0)?;
    let (mut model_data, mut model_model) = (0.0, 0.0);
    for state in &table.states {
        let model = homogeneous::biaxial(&unit, state.stretches[0], state.stretches[1])?;
        for (model, data) in model.into_iter().zip(state.nominal).filter(|(_, data)| *data != 0.0) {
            model_data += model * data;
            model_model += model * model;
        }
    }
    let modulus = model_data / model_model;
    if modulus.is_finite() && modulus > 0.0 {
        return Ok(modulus);
    }
    Err(Error::Data {
        what: "fit".to_owned(),
        reason: format!("the data have a mean stiffness of {modulus} Pa; it must be positive"),
    })
}

/// Between the parameters p of a law and the unbounded q of the optimiser.
struct Map<'a> {
    model: &'a ModelDescriptor,
    /// Lower limit of each p.
    limits: Vec<f64>,
    modulus: f64,
}

/// |q| beyond which a parameter is at its limit or at infinity for all purposes; e^±40 = 4e∓18.
const FARTHEST: f64 = 40.0;

impl<'a> Map<'a> {
    fn new(model: &'a ModelDescriptor, table: &Table, modulus: f64) -> Result<Self, Error> {
        let mut limits = Vec::new();
        for parameter in model.parameters {
            limits.push(match parameter.domain {
                Domain::Real => f64::NEG_INFINITY,
                Domain::Positive => 0.0,
                Domain::Above(limit) => {
                    let mut most = 0.0_f64;
                    for state in &table.states {
                        most = most.max(limit(state.principal_stretches()?));
                    }
                    most
                }
            });
        }
        Ok(Self { model, limits, modulus })
    }

    fn scale(&self, i: usize) -> f64 {
        if self.model.parameters[i].unit == "Pa" { self.modulus } else { 1.0 }
    }

    fn parameters(&self, q: &DVector<f64>) -> Vec<f64> {
        (0..q.len()).map(|i| self.value(i, q[i]).0).collect()
    }

    /// p and dp/dq.
    fn value(&self, i: usize, q: f64) -> (f64, f64) {
        let exponential = q.clamp(-FARTHEST, FARTHEST).exp();
        match self.model.parameters[i].domain {
            Domain::Real => (q * self.scale(i), self.scale(i)),
            Domain::Positive => (exponential * self.scale(i), exponential * self.scale(i)),
            Domain::Above(_) => {
                // never the limit itself, where the energy is infinite, nor beyond what data can tell from infinity
                let excess = self.limits[i] * exponential.clamp(1e-12, 1e6);
                (self.limits[i] + excess, excess)
            }
        }
    }

    fn inverse(&self, p: &[f64]) -> DVector<f64> {
        DVector::from_fn(p.len(), |i, _| match self.model.parameters[i].domain {
            Domain::Real => p[i] / self.scale(i),
            Domain::Positive => (p[i] / self.scale(i)).ln(),
            Domain::Above(_) => (p[i] / self.limits[i] - 1.0).ln(),
        })
    }

    /// Residuals in units of the modulus.
    fn residuals(&self, q: &DVector<f64>, table: &Table) -> Option<DVector<f64>> {
        let law = self.model.law(&self.parameters(q)).ok()?;
        let residuals = residuals(&law, table).ok()?;
        Some(DVector::from_vec(residuals) / self.modulus)
    }

    /// dr/dq by central differences of step ∛ε, good to 1e-10.
    fn jacobian(&self, q: &DVector<f64>, table: &Table) -> Option<DMatrix<f64>> {
        let mut columns = Vec::with_capacity(q.len());
        for i in 0..q.len() {
            let step = f64::EPSILON.cbrt() * q[i].abs().max(1.0);
            let (mut up, mut down) = (q.clone(), q.clone());
            up[i] += step;
            down[i] -= step;
            let difference = self.residuals(&up, table)? - self.residuals(&down, table)?;
            columns.push(difference / (up[i] - down[i]));
        }
        Some(DMatrix::from_columns(&columns))
    }

    /// Standard errors, one for each parameter; `None` for those the residuals do not depend on, and for all if the rest are collinear. And
    /// draws of the parameters.
    fn uncertainty(&self, q: &DVector<f64>, table: &Table) -> (Vec<Option<f64>>, Vec<Vec<f64>>) {
        let mut errors = vec![None; q.len()];
        let Some((live, covariance, degrees)) = self.covariance(q, table) else {
            return (errors, Vec::new());
        };
        for (k, &i) in live.iter().enumerate() {
            errors[i] = Some(covariance[(k, k)].sqrt() * self.value(i, q[i]).1.abs());
        }
        let at: Vec<f64> = live.iter().map(|&i| q[i]).collect();
        let drawn = crate::posterior::draws(&at, &covariance, degrees, crate::posterior::DRAWS, 0);
        let parameters = |drawn: Vec<f64>| {
            let mut q = q.clone();
            live.iter().zip(drawn).for_each(|(&i, value)| q[i] = value);
            self.parameters(&q)
        };
        (errors, drawn.unwrap_or_default().into_iter().map(parameters).collect())
    }

    /// The q that the residuals determine, their covariance s²(JᵀJ)⁻¹ and the degrees of freedom.
    fn covariance(&self, q: &DVector<f64>, table: &Table) -> Option<(Vec<usize>, DMatrix<f64>, usize)> {
        let (residuals, jacobian) = (self.residuals(q, table)?, self.jacobian(q, table)?);
        let norms: Vec<f64> = jacobian.column_iter().map(|column| column.norm()).collect();
        // the differences carry 1e-10, and an effect below 1e-6 of the stresses tells nothing
        let live: Vec<usize> = (0..q.len()).filter(|&i| norms[i] > 1e-6).collect();
        let columns: Vec<_> = live.iter().map(|&i| jacobian.column(i) / norms[i]).collect();
        if columns.is_empty() || residuals.len() <= live.len() {
            return None;
        }
        let scaled = DMatrix::from_columns(&columns);
        let normal = scaled.tr_mul(&scaled);
        if normal.clone().symmetric_eigenvalues().min() < 1e-9 {
            return None;
        }
        let degrees = residuals.len() - live.len();
        let variance = residuals.norm_squared() / degrees as f64;
        let inverse = normal.cholesky()?.inverse();
        let covariance = DMatrix::from_fn(live.len(), live.len(), |a, b| {
            variance * inverse[(a, b)] / (norms[live[a]] * norms[live[b]])
        });
        Some((live, covariance, degrees))
    }
}

/// A residual in units of the modulus that no step is accepted with.
const REJECTED: f64 = 1e100;

struct Problem<'a> {
    map: &'a Map<'a>,
    table: &'a Table,
    at: DVector<f64>,
    evaluations: Cell<usize>,
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, q: &DVector<f64>) {
        self.at.copy_from(q);
    }

    fn params(&self) -> DVector<f64> {
        self.at.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        self.evaluations.set(self.evaluations.get() + 1);
        // a trial where the law overflows must be rejected; `None` would end the search
        let rejected = || DVector::from_element(self.table.measurements(), REJECTED);
        Some(self.map.residuals(&self.at, self.table).unwrap_or_else(rejected))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        self.map.jacobian(&self.at, self.table)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constitutive::hyperelastic::data::{Mode, State};
    use crate::constitutive::hyperelastic::{MODELS, model};

    fn treloar() -> Table {
        let text = include_str!("../../../../../cases/ch1/rubber-fits/treloar1944_uniaxial.csv");
        Table::parse("treloar", text).unwrap()
    }

    fn kawabata() -> Table {
        let text = include_str!("../../../../../cases/ch1/rubber-fits/kawabata1981_biaxial.csv");
        Table::parse("kawabata", text).unwrap()
    }

    fn find(fit: &Fit, name: &str) -> f64 {
        fit.parameters.iter().find(|parameter| parameter.name == name).unwrap().value
    }

    /// formulation.md, "Fits": 8-chain on Treloar, rms 0.0749 MPa, μ 0.2731 MPa, n 25.46 (the digits printed).
    #[test]
    fn eight_chain_on_treloar() {
        let fit = fit(model("eight-chain").unwrap(), &treloar()).unwrap();
        assert!((fit.rms - 0.0749e6).abs() < 0.00005e6, "{}", fit.rms);
        assert!((fit.law.shear_modulus() - 0.2731e6).abs() < 0.00005e6);
        assert!((find(&fit, "links") - 25.46).abs() < 0.005);
        assert_eq!((fit.measurements, fit.starts), (20, (3, 3)));
    }

    /// formulation.md: 0.0898 (8-chain, Kawabata), 0.0748 and 0.0254 MPa (8-chain + c√I₂, Treloar, Kawabata). On
    /// Kawabata the optimum is n → ∞ along a valley so flat that the printed values lie on it, a little short of the end
    /// (0.08966 and 0.02525): half a unit of the last digit below, no more above.
    #[test]
    fn root_i2_is_what_kawabata_asks_for() {
        let of = |key: &str, table: &Table| fit(model(key).unwrap(), table).unwrap().rms / 1e6;
        let found = of("eight-chain", &kawabata());
        assert!(found > 0.0896 && found < 0.08985, "{found}");
        let found = of("eight-chain-root-i2", &treloar());
        assert!((found - 0.0748).abs() < 0.00005, "{found}");
        let found = of("eight-chain-root-i2", &kawabata());
        assert!(found > 0.0252 && found < 0.02545, "{found}");
    }

    /// Upper bounds: an exhaustive scan in numpy, exponents on grids of 0.7 (Treloar) and 0.23 (Kawabata), moduli ≥ 0
    /// solved exactly.
    #[test]
    fn ogden_fits_find_the_global_minimum() {
        for (table, bounds) in
            [(treloar(), [0.30940, 0.07791, 0.06714]), (kawabata(), [0.04385, 0.01180, 0.00861])]
        {
            for (key, bound) in ["ogden-1", "ogden-2", "ogden-3"].into_iter().zip(bounds) {
                let found = fit(model(key).unwrap(), &table).unwrap().rms / 1e6;
                assert!(found < bound, "{key} {found} {bound}");
            }
        }
    }

    #[test]
    fn every_law_finds_back_its_own_parameters() {
        for model in MODELS {
            let law = model.law(model.example).unwrap();
            let states = [1.05, 1.2, 1.5, 2.0, 2.6, 3.3, 4.0].into_iter().flat_map(|l: f64| {
                [l.recip().sqrt(), 1.0, l.sqrt(), l].map(|other| State {
                    mode: Mode::Biaxial,
                    stretches: [l, other],
                    nominal: homogeneous::biaxial(&law, l, other).unwrap(),
                })
            });
            let table = Table { source: "synthetic".into(), states: states.collect() };
            let fit = fit(model, &table).unwrap();
            assert!(fit.rms < 1e-6 * law.shear_modulus(), "{} {}", model.key, fit.rms);
            // the terms of an Ogden sum may come back in another order
            if !model.key.starts_with("ogden") {
                for (parameter, value) in fit.parameters.iter().zip(model.example) {
                    assert!((parameter.value / value - 1.0).abs() < 1e-4, "{} {parameter:?}", model.key);
                }
            }
        }
    }

    /// One parameter, linear: μ and its standard error in closed form, s/√Σg².
    #[test]
    fn standard_error_of_the_linear_law() {
        let table = treloar();
        let fit = fit(model("neo-hookean").unwrap(), &table).unwrap();
        let sum: f64 = table
            .states
            .iter()
            .filter(|state| state.nominal[0] != 0.0)
            .map(|state| {
                let l = state.stretches[0];
                (l - 1.0 / (l * l)).powi(2)
            })
            .sum();
        let expected = (fit.rms * fit.rms * 20.0 / 19.0 / sum).sqrt();
        let found = fit.parameters[0].standard_error.unwrap();
        assert!((found / expected - 1.0).abs() < 1e-8, "{found} {expected}");
        assert!((fit.parameters[0].value / neo_hookean_modulus(&table).unwrap() - 1.0).abs() < 1e-9);
    }

    #[test]
    fn hopeless_data_are_refused() {
        let one = Table::parse("t", "stretch,nominal_MPa\n2,1\n").unwrap();
        let error = fit(model("gent").unwrap(), &one).err().unwrap().to_string();
        assert_eq!(error, "fit of `gent`: 1 measurements for 2 parameters");
        let pushed = Table::parse("t", "stretch,nominal_MPa\n2,-1\n3,-1\n").unwrap();
        let error = fit(model("gent").unwrap(), &pushed).err().unwrap().to_string();
        assert!(error.contains("must be positive"), "{error}");
    }
}
