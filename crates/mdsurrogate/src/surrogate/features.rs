//! What the networks of a law are given at a C, and how it changes with C.

use super::{Header, Kind, Support, Surrogate, back};
use crate::Error;
use crate::dataset::Row;
use crate::network::{Architecture, LANES};
use polycore::tensor::Voigt;

/// Representatives of the training strains in a law ([`Support`]).
const REPRESENTATIVES: usize = 256;

/// Inputs of a network at a C.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Features {
    /// Standardised inputs (3.8); the first of them count.
    pub values: [f64; LANES],
    /// Of an energy: derivatives of its invariants, not yet standardised, by the six components of C, C₁₂ counted once.
    pub slopes: [[f64; 6]; LANES],
}

impl Surrogate<f64> {
    /// What each input is multiplied with when it is standardised (3.8); 0 for one without variance.
    #[cfg(feature = "train")]
    pub(crate) fn input_scales(&self) -> &[f64] {
        &self.inverse
    }

    /// The inputs at `c`; those of an `ann` are the components of C themselves and have no slopes.
    pub(crate) fn features(&self, c: &Voigt) -> Features {
        let mut features = Features { values: [0.0; LANES], slopes: [[0.0; 6]; LANES] };
        let local = self.input(&(*c).into(), &mut features.values);
        if let Some(invariants) = self.header.kind.invariants() {
            for k in 0..invariants.count() {
                let slope = invariants.gradient(&local, k);
                features.slopes[k] = match &self.turn {
                    Some(turn) => back(turn, &slope, &[[0.0; 6]; 6]).0,
                    None => slope,
                };
            }
        }
        features
    }
}

impl Header {
    /// A law of these hidden layers whose inputs are standardised by `rows` (3.8) and whose outputs are scaled by them:
    /// the stress of an `ann` component by component if `standardised`, else in MPa (as in the thesis); an energy by the
    /// largest product of deviations of S and C. The training box is that of the rows.
    ///
    /// # Errors
    /// [`Error::Data`] for no row; [`Error::Parameter`] for numbers that are not finite or no network.
    pub fn fitted(
        kind: Kind,
        architecture: Architecture,
        members: usize,
        rows: &[&Row],
        standardised: bool,
    ) -> Result<Self, Error> {
        let mut header = Self::new(kind, &[], members);
        let inputs = header.kind.inputs();
        // features of a law without hidden layers are those of any
        let raw = Surrogate::<f64>::random(header.clone(), 0)?;
        header.architecture = architecture;
        header.check()?;
        let values: Vec<[f64; LANES]> = rows.iter().map(|row| raw.features(&row.c).values).collect();
        for k in 0..inputs {
            let column: Vec<f64> = values.iter().map(|value| value[k]).collect();
            [header.input_mean[k], header.input_deviation[k]] = moments("inputs", &column)?;
        }
        let mut of_stress = [[0.0; 2]; 6];
        let mut largest = 0.0f64;
        for a in 0..6 {
            let stress: Vec<f64> = rows.iter().map(|row| row.s[a]).collect();
            let strain: Vec<f64> = rows.iter().map(|row| row.c[a]).collect();
            of_stress[a] = moments("S", &stress)?;
            largest = largest.max(of_stress[a][1] * moments("C", &strain)?[1]);
            header.training_box[a] = strain
                .iter()
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &c| [low.min(c), high.max(c)]);
        }
        let strains: Vec<Voigt> = rows.iter().map(|row| row.c).collect();
        header.support = Some(Support::of(&strains, REPRESENTATIVES)?);
        match header.kind {
            Kind::Ann if standardised => {
                for (a, [mean, deviation]) in of_stress.into_iter().enumerate() {
                    header.output_mean[a] = mean;
                    // a stress that never changes is its mean
                    header.output_deviation[a] = deviation;
                }
            }
            Kind::Ann => {}
            Kind::Energy { .. } if largest > 0.0 => header.output_deviation[0] = largest,
            Kind::Energy { .. } => {}
        }
        header.check()?;
        Ok(header)
    }
}

/// Mean and standard deviation (divisor n); a deviation that rounding leaves of a constant is 0.
fn moments(what: &'static str, values: &[f64]) -> Result<[f64; 2], Error> {
    if values.is_empty() {
        let (found, allowed) = ("no row".into(), "at least one row to learn from".into());
        return Err(Error::Data { what: "training", found, allowed });
    }
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    // a second pass about the mean does not cancel
    let deviation = (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt();
    if !deviation.is_finite() {
        return Err(Error::parameter(what, format!("mean {mean}, deviation {deviation}"), "finite numbers"));
    }
    Ok([mean, if deviation <= 1e-12 * mean.abs().max(1.0) { 0.0 } else { deviation }])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::tests::rows_of_a_law;
    use crate::network::Activation::Tanh;
    use crate::surrogate::Symmetry;

    #[test]
    fn inputs_have_no_mean_and_unit_deviation() {
        let rows = rows_of_a_law();
        let rows: Vec<&Row> = rows.iter().collect();
        for kind in [Kind::Ann, Kind::energy(Symmetry::Orthotropic), Kind::energy(Symmetry::Isotropic)] {
            let architecture = Architecture::new(kind.inputs(), &[(4, Tanh)], kind.outputs());
            let header = Header::fitted(kind, architecture, 1, &rows, true).unwrap();
            let law = Surrogate::random(header, 1).unwrap();
            let at: Vec<Features> = rows.iter().map(|row| law.features(&row.c)).collect();
            for k in 0..law.header().kind.inputs() {
                let column: Vec<f64> = at.iter().map(|features| features.values[k]).collect();
                let [mean, deviation] = moments("", &column).unwrap();
                // shear is constant in these rows
                assert!(mean.abs() < 1e-12 && (deviation == 0.0 || (deviation - 1.0).abs() < 1e-12));
            }
        }
    }

    /// By central differences, also in turned material axes.
    #[test]
    fn slopes_are_derivatives_of_the_inputs() {
        let (s, c) = 0.4f64.sin_cos();
        let axes = [[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]];
        for symmetry in Symmetry::ALL {
            let kind = Kind::Energy { symmetry, axes, polyconvex: false };
            let mut header = Header::new(kind, &[(4, Tanh)], 1);
            header.input_deviation[0] = 0.3;
            let law = Surrogate::random(header, 1).unwrap();
            let at = Voigt::new(1.2, 0.9, 1.1, 0.1, -0.2, 0.05);
            let slopes = law.features(&at).slopes;
            for a in 0..6 {
                let step = Voigt::from_fn(|b, _| if a == b { 1e-5 } else { 0.0 });
                let (up, down) = (law.features(&(at + step)).values, law.features(&(at - step)).values);
                for k in 0..law.header().kind.inputs() {
                    // rounding 1e-16/1e-5; cubic at most
                    assert!(
                        ((up[k] - down[k]) / 2e-5 - slopes[k][a] * law.inverse[k]).abs() < 1e-9,
                        "{symmetry:?} {k} {a}"
                    );
                }
            }
        }
    }
}
