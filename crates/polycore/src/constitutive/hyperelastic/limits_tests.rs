//! Locking, extreme stretches, bad input.

use super::tests::rotation;
use super::*;
use crate::tensor::Error as TensorError;

#[test]
fn locking_is_an_error_with_the_value_and_infinite_in_the_limit() {
    let (links, modulus) = (25.0, 2.0);
    let eight = EightChain::new(modulus, links).unwrap();
    let three = ThreeChain::new(modulus, links).unwrap();
    let gent = Gent::new(modulus, 72.0).unwrap();
    // Λ = 5 and λ = 5 exactly
    for (law, stretches, quantity, limit) in [
        (&eight as &dyn Hyperelastic, [5.0, 5.0, 5.0], "chain stretch", 5.0),
        (&three, [0.4, 5.0, 0.5], "principal stretch", 5.0),
        (&gent, [5.0, 5.0, 5.0], "I1 - 3", 72.0),
        (&gent, [7.0, 6.0, 1.0], "I1 - 3", 72.0),
    ] {
        for error in [law.energy_at(stretches).unwrap_err(), law.response_at(stretches).unwrap_err()] {
            match error {
                Error::Locked { quantity: q, value, limit: l, .. } => {
                    assert_eq!((q, l), (quantity, limit));
                    assert!(value >= limit, "{value}");
                }
                other => panic!("{other}"),
            }
        }
    }
    let locked = match gent.energy_at([5.0; 3]) {
        Err(Error::Locked { value, .. }) => value,
        other => panic!("{other:?}"),
    };
    evidence::near("Gent with J_m = 72, I₁ − 3 that is refused", locked, 72.0, 0.0);
    let message = gent.energy_at([5.0; 3]).unwrap_err().to_string();
    assert_eq!(message, "Gent: I1 - 3 = 72 has reached the locking value 72");

    // towards locking, with c = 1 − λ/5: β → 1/c, f → ln(2/c) − 1, all finite to the last representable
    // stretch
    let rest = three.energy_at([5.0 * (1.0 - 1e-9), 1.0, 1.0]).unwrap();
    let mut worst: f64 = 0.0;
    for c in [1e-3_f64, 1e-6, 1e-9, 1e-12, f64::EPSILON] {
        let stretch = 5.0 * (1.0 - c);
        // the stretch is rounded: the true complement
        let c = (5.0 - stretch) / 5.0;
        let response = three.response_at([stretch, 1.0, 1.0]).unwrap();
        let expected = modulus / 3.0 * 5.0 / c / stretch;
        worst = worst.max((response.stress[0] / expected - 1.0).abs());
        let energy = three.energy_at([stretch, 1.0, 1.0]).unwrap();
        let expected = rest + modulus * links / 3.0 * ((2.0 / c).ln() - (2.0 / 1e-9_f64).ln());
        // the complement of the comparison state is itself rounded to 1e-7
        assert!((energy - expected).abs() < 1e-5, "{c} {energy} {expected}");
    }
    evidence::at_most("stress towards locking, down to 1 − λ/√n = 2e-16", worst, 1e-14);
}

#[test]
fn extreme_stretches_give_a_finite_answer_or_a_locking_error() {
    let q = rotation();
    for law in &all().unwrap() {
        for stretches in [[1e8, 1.0, 1e-8], [1e8; 3], [1e-8; 3], [1e4, 1e-4, 1.0], [1e8, 1e-8, 1e-8]] {
            let diagonal = Tensor::from_diagonal(&stretches.into());
            for matrix in [diagonal, diagonal * q] {
                let Ok(f) = DeformationGradient::new(matrix) else { continue };
                let results = [
                    law.energy(&f).map(|energy| energy.is_finite()),
                    law.second_piola_kirchhoff(&f).map(|s| s.iter().all(|v| v.is_finite())),
                    law.cauchy(&f).map(|s| s.iter().all(|v| v.is_finite())),
                    law.material_tangent(&f).map(|s| s.iter().all(|v| v.is_finite())),
                ];
                for result in results {
                    assert!(
                        matches!(result, Ok(true) | Err(Error::Locked { .. } | Error::Overflow { .. })),
                        "{} {stretches:?} {result:?}",
                        law.name()
                    );
                }
            }
        }
        for bad in [[f64::NAN, 1.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, -1.0], [f64::INFINITY, 1.0, 1.0]] {
            let error = law.energy_at(bad).unwrap_err();
            assert!(
                matches!(error, Error::Deformation(TensorError::Stretch { .. })),
                "{} {error}",
                law.name()
            );
            let error = law.response_at(bad).unwrap_err();
            assert!(
                matches!(error, Error::Deformation(TensorError::Stretch { .. })),
                "{} {error}",
                law.name()
            );
        }
    }
}

/// Neo-Hookean at stretches 1e8, 1, 1e-8: the terms of S = μ(1 − C⁻¹) + λ ln J C⁻¹ in closed form.
#[test]
fn extreme_stretches_keep_their_digits() {
    let law = NeoHookean::new(2.0).unwrap();
    let law = Compressible::new(law, Volumetric::Logarithmic { lame: 3.0 }).unwrap();
    let f = DeformationGradient::from_stretches([1e8, 2.0, 1e-8]).unwrap();
    let log = 2.0_f64.ln();
    let stress = law.second_piola_kirchhoff(&f).unwrap();
    for (i, l) in [1e8_f64, 2.0, 1e-8].into_iter().enumerate() {
        let expected = 2.0 + (3.0 * log - 2.0) / (l * l);
        assert!((stress[(i, i)] / expected - 1.0).abs() < 1e-14, "{i}");
        let expected = (2.0 * l * l + 3.0 * log - 2.0) / 2.0;
        assert!((law.cauchy(&f).unwrap()[(i, i)] / expected - 1.0).abs() < 1e-14, "{i}");
    }
}

#[test]
fn bad_parameters_are_refused_with_the_value() {
    for (key, p, message) in [
        ("neo-hookean", vec![-1.0], "neo-Hookean: shear_modulus = -1 is outside (0, ∞)"),
        ("mooney-rivlin", vec![1.0, -2.0], "Mooney-Rivlin: C1 + C2 = -1 is outside (0, ∞)"),
        ("gent", vec![1.0, 0.0], "Gent: J_m = 0 is outside (0, ∞)"),
        ("ogden-1", vec![1.0, 0.0], "Ogden: alpha_1 = 0 is outside (−∞, 0) or (0, ∞)"),
        ("three-chain", vec![1.0, 1.0], "three-chain: links = 1 is outside (1, ∞)"),
        ("eight-chain", vec![f64::NAN, 9.0], "eight-chain: chain_modulus = NaN is outside (0, ∞)"),
        ("eight-chain-root-i2", vec![1.0, 9.0, -1.0], "eight-chain + c√I2: c = -1 is outside [0, ∞)"),
        ("gent", vec![1.0], "law `gent`: 1 parameters given, 2 needed"),
        ("rubber", vec![1.0], "unknown hyperelastic law `rubber`"),
    ] {
        let error = model(key).and_then(|model| model.law(&p)).err().unwrap().to_string();
        assert!(error.starts_with(message), "{error}");
    }
    assert!(Ogden::new(OgdenConvention::Thesis, &[]).is_err());
    let law = NeoHookean::new(1.0).unwrap();
    assert!(Compressible::new(law, Volumetric::Quadratic { lame: -1.0 }).is_err());
}
