//! Fits of [`Hyperfoam`] to bars with free sides and to simple shear.

use nalgebra::{DMatrix, DVector};

use super::fit::Agreement;
use super::fit_map::REJECTED;
use super::{Error, FoamTerm, Hyperfoam};
use crate::numerics::least_squares::levenberg_marquardt;

/// Kind of a test of a foam.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FoamTestKind {
    /// Tension or compression with free sides; strains are stretches.
    Bar,
    /// Simple shear at constant volume; strains are amounts of shear.
    Shear,
}

/// Measured state of a foam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FoamState {
    /// Stretch or amount of shear.
    pub strain: f64,
    /// Nominal stress, Pa.
    pub nominal: f64,
    /// Lateral stretch, if it was measured.
    pub lateral: Option<f64>,
}

/// Test of a foam.
#[derive(Debug, Clone, PartialEq)]
pub struct FoamTest {
    /// Name in the file.
    pub name: String,
    /// Kind of the test.
    pub kind: FoamTestKind,
    /// Measured states.
    pub states: Vec<FoamState>,
}

/// Law fitted to a foam.
#[derive(Debug, Clone, PartialEq)]
pub struct FoamFit {
    /// The law.
    pub law: Hyperfoam,
    /// Residuals of all stresses and lateral stretches, weighted as the fit weights them, root mean square.
    pub misfit: f64,
    /// Number of starts, and of those that ended within 1e-4 of the least misfit.
    pub starts: (usize, usize),
}

/// Exponents of starts.
const EXPONENTS: [f64; 8] = [-16.0, -6.0, -2.0, 1.0, 2.0, 6.0, 12.0, 24.0];
/// Values of β of starts: ν = 0.05, 0.25, 0.4.
const BETAS: [f64; 3] = [0.055, 0.5, 2.0];
/// Number of starts for the optimiser, those of the least misfit.
const SELECTED: usize = 8;
/// Length of the range of β in a fit, from −⅓, i.e. ν up to 0.45: with β → ∞ and α → 0 a term becomes a
/// volumetric law of its own, along a valley without end.
const BETA_RANGE: f64 = 5.0 + 1.0 / 3.0;
/// Bounds of the logarithms of the optimiser.
const LARGEST_LOG: f64 = 30.0;

impl FoamTest {
    /// Largest measured |P|, Pa.
    pub fn largest(&self) -> f64 {
        self.states.iter().map(|state| state.nominal.abs()).fold(0.0, f64::max)
    }

    /// Computes the nominal stress of a law, Pa, and its lateral stretch; of simple shear 1.
    ///
    /// # Errors
    /// [`Error::NoConvergence`] of the lateral stretch.
    pub fn predict(&self, law: &Hyperfoam, strain: f64) -> Result<[f64; 2], Error> {
        let mut unused = vec![[0.0; 2]; 3 * law.terms().len()];
        slopes(self.kind, law.terms(), strain, &mut unused)
    }

    /// Compares the stresses of a law with the test.
    ///
    /// # Errors
    /// Errors of the law.
    pub fn agreement(&self, law: &Hyperfoam) -> Result<Agreement, Error> {
        let residual = |state: &FoamState| Ok(self.predict(law, state.strain)?[0] - state.nominal);
        let residuals = self.states.iter().map(residual).collect::<Result<Vec<f64>, Error>>()?;
        Ok(Agreement::of_residuals(&residuals, self.states.iter().map(|state| state.nominal)))
    }
}

/// Fits a law of so many terms to all tests at once. Residuals of a test count in units of its largest stress
/// and by the root of its number of states, so that shear counts as much as compression; lateral stretches
/// likewise, in units of the largest |λ₂ − 1|. The starts are those of a grid with the least misfit, and the
/// law with one term less with a further term.
///
/// # Errors
/// [`Error::Data`] for no test, a test without a stress, fewer states than parameters, no term;
/// [`Error::NoConvergence`].
pub fn fit(tests: &[FoamTest], terms: usize, stop: &dyn Fn() -> bool) -> Result<FoamFit, Error> {
    let refused = |reason: String| Error::Data { what: "fit of a foam".to_owned(), reason };
    let count: usize = tests.iter().map(|test| test.states.len()).sum();
    if terms == 0 || count < 3 * terms {
        return Err(refused(format!("{count} states for {} parameters", 3 * terms)));
    }
    if let Some(test) = tests.iter().find(|test| test.largest() == 0.0) {
        return Err(refused(format!("test `{}` has no stress other than zero", test.name)));
    }
    let grid = EXPONENTS.into_iter().flat_map(|exponent| BETAS.map(|beta| (exponent, beta)));
    let mut smaller = Vec::new();
    for number in 1..terms {
        smaller = search(tests, &candidates(&smaller, grid.clone()), number, stop)?.law.terms().to_vec();
    }
    let found = search(tests, &candidates(&smaller, grid), terms, stop)?;
    Ok(found)
}

/// Laws with a further term, whose modulus is that of the others together or a thousandth of it.
fn candidates(smaller: &[FoamTerm], grid: impl Iterator<Item = (f64, f64)>) -> Vec<Vec<FoamTerm>> {
    let total: f64 = smaller.iter().map(|term| term.modulus).sum();
    let sizes: &[f64] = if smaller.is_empty() { &[1.0] } else { &[1.0, 0.1, 1e-3] };
    let new = |(exponent, beta)| {
        let term = move |size: &f64| FoamTerm {
            modulus: if total > 0.0 { size * total } else { 1.0 },
            exponent,
            beta,
        };
        sizes.iter().map(move |size| [smaller, &[term(size)]].concat()).collect::<Vec<_>>()
    };
    grid.flat_map(new).collect()
}

fn search(
    tests: &[FoamTest],
    candidates: &[Vec<FoamTerm>],
    terms: usize,
    stop: &dyn Fn() -> bool,
) -> Result<FoamFit, Error> {
    // P is linear in a common factor of the moduli, λ₂ does not depend on it: the best factor is exact
    let scaled = |terms: &Vec<FoamTerm>| {
        let law = Hyperfoam::new(terms).ok()?;
        let (mut model_data, mut model_model) = (0.0, 0.0);
        for test in tests {
            let weight = test.largest().powi(2) * test.states.len() as f64;
            for state in &test.states {
                let model = test.predict(&law, state.strain).ok()?[0];
                model_data += model * state.nominal / weight;
                model_model += model * model / weight;
            }
        }
        let factor = model_data / model_model;
        let terms: Vec<FoamTerm> =
            terms.iter().map(|term| FoamTerm { modulus: factor * term.modulus, ..*term }).collect();
        let misfit = weighted(&terms, tests)?.0.norm_squared();
        (factor > 0.0 && misfit.is_finite()).then_some((misfit, terms))
    };
    let mut starts: Vec<(f64, Vec<FoamTerm>)> = candidates.iter().filter_map(scaled).collect();
    starts.sort_by(|a, b| a.0.total_cmp(&b.0));
    starts.truncate(SELECTED);
    let rows = residuals_count(tests);
    let mut ends: Vec<(f64, Vec<FoamTerm>)> = Vec::new();
    for (_, start) in &starts {
        if stop() {
            return Err(Error::Stopped);
        }
        let modulus: f64 = start.iter().map(|term| term.modulus).sum();
        let values = |q: &DVector<f64>| {
            let found = weighted(&law_terms(q, modulus), tests).map(|found| found.0);
            Some(found.unwrap_or_else(|| DVector::from_element(rows, REJECTED)))
        };
        let jacobian = |q: &DVector<f64>| {
            let own = law_terms(q, modulus);
            let (_, mut slopes) = weighted(&own, tests).filter(|_| !stop())?;
            for (k, term) in own.iter().enumerate() {
                slopes.column_mut(3 * k).scale_mut(term.modulus);
                let part = (term.beta + 1.0 / 3.0) / BETA_RANGE;
                slopes.column_mut(3 * k + 2).scale_mut(BETA_RANGE * part * (1.0 - part));
            }
            Some(slopes)
        };
        let logarithms = |term: &FoamTerm| {
            let part = (term.beta + 1.0 / 3.0) / BETA_RANGE;
            let odds = (part / (1.0 - part)).clamp((-LARGEST_LOG).exp(), LARGEST_LOG.exp());
            [(term.modulus / modulus).ln(), term.exponent, odds.ln()]
        };
        let at = DVector::from_iterator(3 * terms, start.iter().flat_map(logarithms));
        let end = levenberg_marquardt(at, 100, values, jacobian);
        if end.objective < REJECTED {
            ends.push((end.objective, law_terms(&end.at, modulus)));
        }
    }
    let Some((least, best)) = ends.iter().min_by(|a, b| a.0.total_cmp(&b.0)) else {
        return Err(Error::NoConvergence { iteration: "hyperfoam", steps: 0, residual: f64::NAN });
    };
    let agreeing = ends.iter().filter(|end| end.0 <= least * (1.0 + 2e-4)).count();
    let parts = tests.len() + tests.iter().filter(|test| lateral_scale(test) > 0.0).count();
    Ok(FoamFit {
        law: Hyperfoam::new(best)?,
        misfit: (2.0 * least / parts as f64).sqrt(),
        starts: (starts.len(), agreeing),
    })
}

/// Terms from ln(μ/M), α, and the logit of β in its range.
fn law_terms(q: &DVector<f64>, modulus: f64) -> Vec<FoamTerm> {
    let exponential = |log: f64| log.clamp(-LARGEST_LOG, LARGEST_LOG).exp();
    let term = |q: &[f64]| FoamTerm {
        modulus: modulus * exponential(q[0]),
        exponent: q[1],
        beta: BETA_RANGE / (1.0 + exponential(-q[2])) - 1.0 / 3.0,
    };
    q.as_slice().chunks_exact(3).map(term).collect()
}

/// Largest measured |λ₂ − 1|; 0 without lateral stretches.
fn lateral_scale(test: &FoamTest) -> f64 {
    test.states.iter().filter_map(|state| state.lateral).map(|l| (l - 1.0).abs()).fold(0.0, f64::max)
}

fn residuals_count(tests: &[FoamTest]) -> usize {
    let with_lateral = tests.iter().filter(|test| lateral_scale(test) > 0.0);
    let lateral = with_lateral.flat_map(|test| &test.states).filter(|state| state.lateral.is_some());
    lateral.count() + tests.iter().map(|test| test.states.len()).sum::<usize>()
}

/// Weighted residuals of stresses and lateral stretches, and their derivatives with respect to each μ, α, β;
/// `None` where the law has none.
fn weighted(terms: &[FoamTerm], tests: &[FoamTest]) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let count = residuals_count(tests);
    let (mut all, mut derivatives) = (DVector::zeros(count), DMatrix::zeros(count, 3 * terms.len()));
    let (mut of, mut row) = (vec![[0.0; 2]; 3 * terms.len()], 0);
    for test in tests {
        let (root, largest, lateral) =
            ((test.states.len() as f64).sqrt(), test.largest(), lateral_scale(test));
        for state in &test.states {
            let found = slopes(test.kind, terms, state.strain, &mut of).ok()?;
            let mut add = |axis: usize, measured: f64, scale: f64| {
                all[row] = (found[axis] - measured) / (scale * root);
                of.iter().enumerate().for_each(|(i, of)| derivatives[(row, i)] = of[axis] / (scale * root));
                row += 1;
            };
            add(0, state.nominal, largest);
            if let (Some(measured), true) = (state.lateral, lateral > 0.0) {
                add(1, measured, lateral);
            }
        }
    }
    let finite = all.iter().chain(derivatives.iter()).all(|value| value.is_finite());
    finite.then_some((all, derivatives))
}

/// Nominal stress, lateral stretch, and their derivatives with respect to each μ, α, β.
///
/// Bar, J = λ₁λ₂²: λ₁P = g = Σ2μ/α (λ₁^α − J^(−αβ)) where f = Σ2μ/α (λ₂^α − J^(−αβ)) = 0. Simple shear by
/// γ = 2 sinh t: P = Σ2μ/α sinh(αt)/cosh t.
fn slopes(
    kind: FoamTestKind,
    terms: &[FoamTerm],
    strain: f64,
    slopes: &mut [[f64; 2]],
) -> Result<[f64; 2], Error> {
    if kind == FoamTestKind::Shear {
        let t = (0.5 * strain).asinh();
        let mut nominal = 0.0;
        for (term, of) in terms.iter().zip(slopes.chunks_exact_mut(3)) {
            let a = term.exponent;
            let unit = 2.0 / a * (a * t).sinh() / t.cosh();
            nominal += term.modulus * unit;
            let by_exponent = 2.0 / a * t * (a * t).cosh() / t.cosh() - unit / a;
            of.copy_from_slice(&[[unit, 0.0], [term.modulus * by_exponent, 0.0], [0.0; 2]]);
        }
        return Ok([nominal, 1.0]);
    }
    let along = strain.ln();
    let across = lateral_log(terms, along)?;
    let (lateral, volume) = (across.exp(), along + 2.0 * across);
    let (mut nominal, mut steepness, mut coupling) = (0.0, 0.0, 0.0);
    for (&FoamTerm { modulus, exponent: a, beta }, of) in terms.iter().zip(slopes.chunks_exact_mut(3)) {
        let [first, second, bulk] = [a * along, a * across, -a * beta * volume].map(f64::exp);
        // ∂g and ∂f with respect to μ, α, β
        let by = |power: f64, log: f64| {
            let unit = 2.0 / a * (power - bulk);
            [unit, modulus * (2.0 / a * (log * power + beta * volume * bulk) - unit / a)]
        };
        let ([g_modulus, g_exponent], [f_modulus, f_exponent]) = (by(first, along), by(second, across));
        let by_beta = 2.0 * modulus * volume * bulk;
        of.copy_from_slice(&[[g_modulus, f_modulus], [g_exponent, f_exponent], [by_beta, by_beta]]);
        nominal += modulus * g_modulus;
        steepness += 2.0 * modulus * (second + 2.0 * beta * bulk);
        coupling += 4.0 * modulus * beta * bulk;
    }
    for of in slopes {
        let [g, f] = *of;
        *of = [(g - coupling / steepness * f) / strain, -lateral * f / steepness];
    }
    Ok([nominal / strain, lateral])
}

/// ln λ₂ of a free bar from ln λ₁: the zero of f, which increases for positive moduli and β, by Newton's
/// method, bracketed as it goes.
fn lateral_log(terms: &[FoamTerm], along: f64) -> Result<f64, Error> {
    const STEPS: usize = 200;
    let (mut log, mut low, mut high, mut f) = (0.0_f64, f64::NEG_INFINITY, f64::INFINITY, f64::NAN);
    for _ in 0..STEPS {
        let mut slope = 0.0;
        f = 0.0;
        for &FoamTerm { modulus, exponent: a, beta } in terms {
            let (power, bulk) = ((a * log).exp(), (-a * beta * (along + 2.0 * log)).exp());
            f += 2.0 * modulus / a * (power - bulk);
            slope += 2.0 * modulus * (power + 2.0 * beta * bulk);
        }
        if f > 0.0 {
            high = high.min(log)
        } else {
            low = low.max(log)
        }
        let step = (f / slope).clamp(-0.5, 0.5);
        if step.abs() <= 4.0 * f64::EPSILON * log.abs().max(0.1) || f == 0.0 {
            return Ok(log);
        }
        let trial = log - step;
        log = if slope > 0.0 && trial > low && trial < high {
            trial
        } else if low.is_finite() && high.is_finite() {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                return Ok(log);
            }
            middle
        } else {
            log - 0.5 * f.signum()
        };
    }
    Err(Error::NoConvergence { iteration: "lateral stretch", steps: STEPS, residual: f })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constitutive::hyperelastic::Hyperelastic;
    use crate::constitutive::hyperelastic::homogeneous::free_bar;
    use crate::tensor::DeformationGradient;
    use nalgebra::Matrix3;

    fn tests_of(law: &Hyperfoam, with_lateral: bool) -> Vec<FoamTest> {
        let of = |name: &str, kind, strains: &[f64]| {
            let mut test = FoamTest { name: name.to_owned(), kind, states: Vec::new() };
            for &strain in strains {
                let [nominal, lateral] = test.predict(law, strain).unwrap();
                let lateral = (with_lateral && kind == FoamTestKind::Bar).then_some(lateral);
                test.states.push(FoamState { strain, nominal, lateral });
            }
            test
        };
        vec![
            of("UC", FoamTestKind::Bar, &[0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95]),
            of("UT", FoamTestKind::Bar, &[1.05, 1.1, 1.2, 1.3]),
            of("SS", FoamTestKind::Shear, &[0.05, 0.1, 0.15]),
        ]
    }

    /// Data of a law give its parameters back, from starts that do not know it.
    #[test]
    fn a_law_gives_itself_back() {
        let term = FoamTerm { modulus: 0.12e6, exponent: 9.0, beta: 0.15 };
        let law = Hyperfoam::new(&[term]).unwrap();
        let found = fit(&tests_of(&law, true), 1, &|| false).unwrap();
        let [back] = found.law.terms() else { panic!("{found:?}") };
        evidence::at_most("misfit of hyperfoam to itself", found.misfit, 1e-8);
        for (a, b) in [(back.modulus, term.modulus), (back.exponent, 9.0), (back.beta, 0.15)] {
            assert!((a / b - 1.0).abs() < 1e-6, "{back:?}");
        }
    }

    /// Closed forms of both tests against the law in three dimensions, and their derivatives by differences
    /// of step 1e-6: truncation 1e-10 of terms with α² ~ 60.
    #[test]
    fn closed_forms_of_tests() {
        let term = |modulus, exponent, beta| FoamTerm { modulus, exponent, beta };
        let terms = [term(0.1, 8.0, 0.1), term(0.05, -2.5, 0.6)];
        let law = Hyperfoam::new(&terms).unwrap();
        let (mut of, mut worst, mut difference) = ([[0.0; 2]; 6], 0.0_f64, 0.0_f64);
        for (kind, strain) in [(FoamTestKind::Bar, 0.4), (FoamTestKind::Bar, 1.3), (FoamTestKind::Shear, 0.4)]
        {
            let found = slopes(kind, &terms, strain, &mut of).unwrap();
            let expected = match kind {
                FoamTestKind::Bar => free_bar(&law, strain).map(|bar| [bar.nominal, bar.lateral]).unwrap(),
                FoamTestKind::Shear => {
                    let mut matrix = Matrix3::identity();
                    matrix[(0, 1)] = strain;
                    let sheared = DeformationGradient::new(matrix).unwrap();
                    [law.first_piola_kirchhoff(&sheared).unwrap()[(0, 1)], 1.0]
                }
            };
            (0..2).for_each(|i| worst = worst.max((found[i] / expected[i] - 1.0).abs()));
            for i in 0..6 {
                let at = |step: f64| {
                    let mut moved = terms;
                    let one = &mut moved[i / 3];
                    *[&mut one.modulus, &mut one.exponent, &mut one.beta][i % 3] += step;
                    slopes(kind, &moved, strain, &mut [[0.0; 2]; 6]).unwrap()
                };
                let (up, down) = (at(1e-6), at(-1e-6));
                (0..2).for_each(|k| {
                    difference = difference.max(((up[k] - down[k]) / 2e-6 - of[i][k]).abs());
                });
            }
        }
        evidence::at_most("bar and shear of hyperfoam in closed form", worst, 1e-12);
        evidence::at_most("derivatives of bar and shear by μ, α, β", difference, 1e-8);
    }

    #[test]
    fn unusable_data() {
        let law = Hyperfoam::new(&[FoamTerm { modulus: 1e5, exponent: 2.0, beta: 0.1 }]).unwrap();
        let mut tests = tests_of(&law, false);
        assert!(fit(&tests, 0, &|| false).is_err());
        assert!(fit(&tests, 5, &|| false).unwrap_err().to_string().contains("14 states for 15 parameters"));
        assert!(matches!(fit(&tests, 1, &|| true), Err(Error::Stopped)));
        tests[2].states.iter_mut().for_each(|state| state.nominal = 0.0);
        assert!(fit(&tests, 1, &|| false).unwrap_err().to_string().contains("`SS` has no stress"));
    }
}
