//! Header of a model before training: scales of inputs and outputs from the training rows.

use crate::Error;
use crate::dataset::DataRow;
use crate::network::{Architecture, LANES};
use crate::surrogate::{CONSTANT_TOLERANCE, Features, Header, Kind, Support, Surrogate};
use nalgebra::Vector3;
use polycore::numerics::range;
use polycore::tensor::{Tensor, Voigt, voigt};

/// Number of representatives of the training strains in a law ([`Support`]).
const REPRESENTATIVES: usize = 256;

/// Smallest deviation of an input of an energy, relative to the deviation for independent variations of the
/// components of C. An invariant that varies less, e.g. det C of rubber, is scaled by this value:
/// standardised by its own deviation it would be noise, amplified in the stress by one over that deviation.
/// It stays an input, because its slope is a stress even if it is constant: the pressure. The value of 0.1 is
/// ten times below inputs with information of their own.
const LEAST_DEVIATION: f64 = 0.1;

/// Returns the names of invariants of an energy that hardly vary in its training rows although C does; they
/// are scaled by their possible variation ([`header`]), and predictions at other values are extrapolations.
pub fn constrained(model: &Surrogate, rows: &[&DataRow]) -> Vec<&'static str> {
    let Some(invariants) = model.header().kind.invariants() else { return Vec::new() };
    let values: Vec<[f64; LANES]> = rows.iter().map(|row| model.features(&row.c).values).collect();
    let constrained = |k: &usize| {
        let column: Vec<f64> = values.iter().map(|value| value[*k]).collect();
        // standardised deviation: 1, or less if the smallest deviation was used
        model.coefficients().inverse[*k] > 0.0
            && moments("inputs", &column).is_ok_and(|[_, deviation]| deviation < 0.5)
    };
    (0..invariants.count()).filter(constrained).map(|k| invariants.name(k)).collect()
}

/// Creates the header of a model: `rows` standardise the inputs (3.8) and scale the outputs, i.e. the stress
/// of an `ann` component by component if `standardised`, otherwise in MPa (as in the thesis), and an energy
/// by the largest product of deviations of S and C. Training box and representatives cover the rows and their
/// symmetric equivalents: after shear in one direction, an orthotropic law also knows the other direction.
///
/// # Errors
/// Returns [`Error::Data`] for no rows; [`Error::Parameter`] for non-finite numbers and invalid networks.
pub fn header(
    kind: Kind,
    architecture: Architecture,
    members: usize,
    rows: &[&DataRow],
    standardised: bool,
) -> Result<Header, Error> {
    let mut header = Header::new(kind, &[], members);
    let inputs = header.kind.inputs();
    // features do not depend on the hidden layers
    let raw = Surrogate::<f64>::random(header.clone(), 0)?;
    header.architecture = architecture;
    header.check()?;
    let features: Vec<Features> = rows.iter().map(|row| raw.features(&row.c)).collect();
    for k in 0..inputs {
        let column: Vec<f64> = features.iter().map(|features| features.values[k]).collect();
        [header.input_mean[k], header.input_deviation[k]] = moments("inputs", &column)?;
    }
    let known = equivalents(&header.kind, rows);
    let (mut stress_moments, mut strain_deviation) = ([[0.0; 2]; 6], [0.0; 6]);
    let mut largest = 0.0f64;
    for a in 0..6 {
        let stress: Vec<f64> = rows.iter().map(|row| row.s[a]).collect();
        let strain: Vec<f64> = rows.iter().map(|row| row.c[a]).collect();
        let known = known.iter().map(|c| c[a]);
        stress_moments[a] = moments("S", &stress)?;
        [_, strain_deviation[a]] = moments("C", &strain)?;
        largest = largest.max(stress_moments[a][1] * strain_deviation[a]);
        header.training_box[a] = range(known);
    }
    if header.kind != Kind::Ann {
        for (k, deviation) in header.input_deviation.iter_mut().enumerate() {
            let independent = |features: &Features| -> f64 {
                (0..6).map(|a| (features.slopes[k][a] * strain_deviation[a]).powi(2)).sum()
            };
            let square = features.iter().map(independent).sum::<f64>() / rows.len() as f64;
            *deviation = deviation.max(LEAST_DEVIATION * square.sqrt());
        }
    }
    header.support = Some(Support::from_rows(&known, REPRESENTATIVES)?);
    match header.kind {
        Kind::Ann if standardised => {
            for (a, [mean, deviation]) in stress_moments.into_iter().enumerate() {
                header.output_mean[a] = mean;
                // a constant stress is predicted by its mean
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

/// Returns the strains of rows and their symmetric equivalents: half turns about the axes, if these change
/// any row.
fn equivalents(kind: &Kind, rows: &[&DataRow]) -> Vec<Voigt> {
    let own: Vec<Voigt> = rows.iter().map(|row| row.c).collect();
    let mut all = own.clone();
    if let Kind::Energy { symmetry, axes, .. } = kind {
        for &axis in symmetry.two_fold_axes() {
            let axis = Vector3::from(axes[axis]);
            let turn = 2.0 * axis * axis.transpose() - Tensor::identity();
            let turned = |c: &Voigt| voigt::from_stress(&(turn * voigt::to_stress(c) * turn.transpose()));
            if own.iter().any(|c| (turned(c) - c).norm() > CONSTANT_TOLERANCE) {
                all.extend(own.iter().map(turned));
            }
        }
    }
    all
}

/// Computes mean and standard deviation (divisor n); a deviation due to rounding becomes 0.
fn moments(what: &'static str, values: &[f64]) -> Result<[f64; 2], Error> {
    if values.is_empty() {
        let (found, allowed) = ("no row".into(), "at least one training row".into());
        return Err(Error::Data { what: "training", found, allowed });
    }
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    // the second pass about the mean avoids cancellation
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
        let rows: Vec<&DataRow> = rows.iter().collect();
        for kind in [Kind::Ann, Kind::energy(Symmetry::Orthotropic), Kind::energy(Symmetry::Isotropic)] {
            let architecture = Architecture::new(kind.inputs(), &[(4, Tanh)], kind.outputs());
            let header = super::header(kind, architecture, 1, &rows, true).unwrap();
            let law = Surrogate::random(header, 1).unwrap();
            let at: Vec<Features> = rows.iter().map(|row| law.features(&row.c)).collect();
            for k in 0..law.header().kind.inputs() {
                let column: Vec<f64> = at.iter().map(|features| features.values[k]).collect();
                let [mean, deviation] = moments("", &column).unwrap();
                // shear is constant in these rows
                assert!(mean.abs() < 1e-12 && (deviation == 0.0 || (deviation - 1.0).abs() < 1e-12));
                assert!(constrained(&law, &rows).is_empty());
            }
        }
    }

    /// After shear to one side, an orthotropic energy knows the other side in its axes, but an `ann` does
    /// not.
    #[test]
    fn symmetry_extends_what_is_known() {
        let row = |sample: u64| {
            let shear = 0.01 * sample as f64;
            let f = Tensor::new(1.0, 0.0, shear, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0 + shear);
            let f = polycore::tensor::DeformationGradient::new(f).unwrap();
            DataRow::new(sample, f64::NAN, f, Voigt::new(1e6, 0.0, 2e6 + shear, 0.0, shear, 0.0))
        };
        let rows: Vec<DataRow> = (0..20).map(row).collect();
        let rows: Vec<&DataRow> = rows.iter().collect();
        let law = |kind: Kind| {
            let architecture = Architecture::new(kind.inputs(), &[(4, Tanh)], kind.outputs());
            Surrogate::<f64>::random(header(kind, architecture, 1, &rows, true).unwrap(), 1).unwrap()
        };
        let (mut c, mut other) = (rows[10].c, rows[10].c);
        other[4] = -other[4];
        for (kind, known) in [
            (Kind::Ann, false),
            (Kind::energy(Symmetry::Triclinic), false),
            (Kind::energy(Symmetry::Monoclinic), true),
            (Kind::energy(Symmetry::Orthotropic), true),
        ] {
            let law = law(kind);
            assert!(!law.flags(&c).any() && law.flags(&other).any() != known);
        }
        c[3] = 0.1;
        assert!(law(Kind::energy(Symmetry::Orthotropic)).flags(&c).unseen[3]);
    }

    /// Rubber: det C = 1 except for the last digit in a table, so W depends on the other invariants. If the
    /// volume varies by itself, nothing changes.
    #[test]
    fn an_invariant_without_variance_of_its_own() {
        let rows = |digits: i32, volume: f64| -> Vec<DataRow> {
            let mut random = crate::random::SplitMix64::new(2);
            let row = |sample: u64| {
                let noise = polycore::tensor::Tensor::from_fn(|_, _| 0.4 * (random.uniform() - 0.5));
                let f = polycore::tensor::Tensor::identity() + noise;
                let scale = ((1.0 + volume * (random.uniform() - 0.5)) / f.determinant()).cbrt();
                let unit = 10f64.powi(digits);
                let f = (f * scale).map(|value| (value * unit).round() / unit);
                let f = polycore::tensor::DeformationGradient::new(f).unwrap();
                DataRow::new(sample, f64::NAN, f, Voigt::new(1e6, 0.0, 0.0, 0.0, 0.0, 0.0))
            };
            (0..200).map(row).collect()
        };
        for (kind, name) in [
            (Kind::energy(Symmetry::Isotropic), "I3"),
            (Kind::energy(Symmetry::Transverse), "I3"),
            (Kind::polyconvex_energy(Symmetry::Orthotropic), "J"),
        ] {
            for (digits, volume) in [(4, 0.0), (8, 0.0), (15, 0.0), (8, 0.02)] {
                let rows = rows(digits, volume);
                let rows: Vec<&DataRow> = rows.iter().collect();
                let architecture = Architecture::new(kind.inputs(), &[], 1);
                let header = super::header(kind.clone(), architecture, 1, &rows, true).unwrap();
                let law = Surrogate::<f64>::random(header, 1).unwrap();
                assert_eq!(constrained(&law, &rows), [name], "{kind:?} {digits} {volume}");
                let k = (0..kind.inputs()).find(|&k| kind.invariants().unwrap().name(k) == name).unwrap();
                // 1/deviation of the others: one percent of strain is at most a tenth of a unit
                let others = (0..kind.inputs()).filter(|&other| other != k);
                let greatest = others.map(|other| law.coefficients().inverse[other]).fold(0.0, f64::max);
                assert!(
                    law.coefficients().inverse[k] < 20.0 * greatest,
                    "{} {greatest}",
                    law.coefficients().inverse[k]
                );
            }
            let free = rows(8, 0.6);
            let free: Vec<&DataRow> = free.iter().collect();
            let header =
                super::header(kind.clone(), Architecture::new(kind.inputs(), &[], 1), 1, &free, true)
                    .unwrap();
            assert!(constrained(&Surrogate::random(header, 1).unwrap(), &free).is_empty());
        }
    }

    /// Central differences, also in rotated material axes.
    #[test]
    fn slopes_are_derivatives_of_the_inputs() {
        let (s, c) = 0.4f64.sin_cos();
        let axes = [[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]];
        for symmetry in Symmetry::ALL {
            let kind = Kind::Energy { symmetry, axes, polyconvex: false, norms: false };
            let mut header = Header::new(kind, &[(4, Tanh)], 1);
            header.input_deviation[0] = 0.3;
            let law = Surrogate::random(header, 1).unwrap();
            let at = Voigt::new(1.2, 0.9, 1.1, 0.1, -0.2, 0.05);
            let slopes = law.features(&at).slopes;
            for a in 0..6 {
                let step = Voigt::from_fn(|b, _| if a == b { 1e-5 } else { 0.0 });
                let (up, down) = (law.features(&(at + step)).values, law.features(&(at - step)).values);
                for k in 0..law.header().kind.inputs() {
                    // rounding 1e-16/1e-5; at most cubic
                    assert!(
                        ((up[k] - down[k]) / 2e-5 - slopes[k][a] * law.coefficients().inverse[k]).abs()
                            < 1e-9,
                        "{symmetry:?} {k} {a}"
                    );
                }
            }
        }
    }
}
