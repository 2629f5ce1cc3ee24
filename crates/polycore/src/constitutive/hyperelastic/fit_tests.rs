use super::*;
use crate::constitutive::hyperelastic::data::{Mode, TestState};
use crate::constitutive::hyperelastic::homogeneous;
use crate::constitutive::hyperelastic::{MODELS, model};

fn treloar() -> TestData {
    let text = include_str!("../../../tests/data/treloar1944_uniaxial.csv");
    TestData::parse("treloar", text).unwrap()
}

fn kawabata() -> TestData {
    let text = include_str!("../../../tests/data/kawabata1981_biaxial.csv");
    TestData::parse("kawabata", text).unwrap()
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
    assert_eq!((fit.measurements, fit.starts), (20, (4, 4)));
}

/// formulation.md: 0.0898 (8-chain, Kawabata), 0.0748 and 0.0254 MPa (8-chain + c√I₂, Treloar, Kawabata). On
/// Kawabata the optimum is n → ∞ along a valley so flat that the printed values lie on it, a little short of
/// the end (0.08966 and 0.02525): half a unit of the last digit below, no more above.
#[test]
fn root_i2_is_what_kawabata_asks_for() {
    let of = |key: &str, table: &TestData| fit(model(key).unwrap(), table).unwrap().rms / 1e6;
    let found = of("eight-chain", &kawabata());
    assert!(found > 0.0896 && found < 0.08985, "{found}");
    let found = of("eight-chain-root-i2", &treloar());
    assert!((found - 0.0748).abs() < 0.00005, "{found}");
    let found = of("eight-chain-root-i2", &kawabata());
    assert!(found > 0.0252 && found < 0.02545, "{found}");
}

/// Upper bounds: an exhaustive scan in numpy, exponents on grids of 0.7 (Treloar) and 0.23 (Kawabata), moduli
/// ≥ 0 solved exactly.
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
            [l.recip().sqrt(), 1.0, l.sqrt(), l].map(|other| {
                let nominal = homogeneous::biaxial(&law, l, other).unwrap();
                TestState::new(Mode::Biaxial, [l, other], nominal)
            })
        });
        let table = TestData::new("synthetic".into(), states.collect());
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

/// Tests a law that is linear in one parameter: μ and its standard error in closed form, s/√Σg².
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
    let one = TestData::parse("t", "stretch,nominal_MPa\n2,1\n").unwrap();
    let error = fit(model("gent").unwrap(), &one).err().unwrap().to_string();
    assert_eq!(error, "fit of `gent`: 1 measurements for 2 parameters");
    let pushed =
        TestData::parse("t", "stretch_1,stretch_2,nominal_1_MPa,nominal_2_MPa\n2,1,-1,0\n3,1,-1,0\n")
            .unwrap();
    let error = fit(model("gent").unwrap(), &pushed).err().unwrap().to_string();
    assert!(error.contains("must be positive"), "{error}");
}

/// Independent values: closed forms and scipy's least_squares from many starts (`issue 39`).
#[test]
fn ordinary_data_fit_every_law() {
    let of = |text: &str| TestData::parse("t", text).unwrap();
    // exact neo-Hookean compression of 0.4 MPa
    let squeezed: String = [0.95, 0.9, 0.85, 0.8, 0.7, 0.6]
        .iter()
        .fold("stretch,nominal_MPa\n".into(), |text, l| format!("{text}{l},{}\n", 0.4 * (l - 1.0 / (l * l))));
    // one term suffices: corona radiata, Budday 2017, every fourth digitised point, rounded
    let brain = "stretch,nominal_kPa\n0.9015,-0.7289\n0.9143,-0.5379\n0.9272,-0.3829\n0.9401,-0.2651\n\
                 0.953,-0.1766\n\
                 0.9659,-0.1114\n0.9788,-0.0595\n0.9917,-0.0227\n1.0147,0.0281\n1.0375,0.0584\n\
                 1.0604,0.0851\n1.0832,0.1193\n";
    // exact one-term Ogden law in equibiaxial tension, α = 4, and a noisy bar of 300 Pa
    let biaxial: String = (1..12).fold("mode,stretch,nominal_Pa\n".into(), |text, i| {
        let l = 1.0 + 0.1 * f64::from(i);
        let nominal = 0.5 * 900.0 * (l.powi(4) - l.powi(-8)) / l;
        format!("{text}equibiaxial,{l},{nominal}\n")
    });
    let noisy: String = (1..40).fold("stretch,nominal_Pa\n".into(), |text, i| {
        let l = 1.0 + 0.05 * f64::from(i);
        let noise = 1.0 + 0.03 * (12.9898 * f64::from(i)).sin();
        format!("{text}{l},{}\n", 300.0 * noise * (l - 1.0 / (l * l)))
    });
    for (name, table, modulus) in [
        ("squeezed", of(&squeezed), Some(0.4e6)),
        ("brain", of(brain), None),
        ("biaxial", of(&biaxial), None),
        ("noisy", of(&noisy), None),
        ("treloar", treloar(), None),
        ("kawabata", kawabata(), None),
    ] {
        let rms = |key: &str| {
            let found = fit(model(key).unwrap(), &table).unwrap_or_else(|error| panic!("{name}: {error}"));
            if let Some(modulus) = modulus {
                assert!((found.law.shear_modulus() / modulus - 1.0).abs() < 1e-5, "{name}: {key}");
            }
            found.rms
        };
        // the compression has fewer points than the polynomial of third order has terms
        let fitted = MODELS.iter().filter(|model| model.parameters.len() <= table.measurements());
        let all: Vec<(&str, f64)> = fitted.clone().map(|model| (model.key, rms(model.key))).collect();
        let of = |key: &str| all.iter().find(|one| one.0 == key).unwrap().1;
        // a locking limit 1e6 times the least leaves 1e-6 of the stresses
        let least = 2e-6 * neo_hookean_modulus(&table).unwrap();
        for model in fitted {
            for inner in model.contains {
                let [outer, inner] = [of(model.key), of(inner.key)];
                assert!(outer <= inner * (1.0 + 1e-5) + least, "{name}: {} {outer} {inner}", model.key);
            }
        }
    }
}

/// Dragon Skin FX Pro, 21 points: scipy from many starts has 0.0019264 MPa at α = −6.0815 and −0.5588.
#[test]
fn a_double_exponent_is_no_minimum() {
    let text = "stretch,nominal_MPa\n1.091,0.0009719\n1.977,0.004658\n2.864,0.007998\n3.75,0.01168\n\
                4.636,0.01662\n\
                5.523,0.02263\n6.409,0.02936\n7.295,0.03838\n8.182,0.0483\n9.068,0.0599\n9.955,0.0728\n\
                10.841,0.08561\n\
                11.727,0.1008\n12.614,0.1175\n13.5,0.136\n14.386,0.1564\n15.273,0.1779\n16.159,0.1993\n\
                17.045,0.2209\n\
                17.932,0.2426\n18.818,0.2613\n";
    let table = TestData::parse("slacker", text).unwrap();
    let found = fit(model("ogden-2").unwrap(), &table).unwrap();
    assert!(found.rms < 0.00192645e6, "{} {:?}", found.rms, found.parameters);
    let three = fit(model("ogden-3").unwrap(), &table).unwrap();
    assert!(three.rms <= found.rms, "{}", three.rms);
}

/// Treloar's bar in 24 points: scipy's projected search from 150 starts ends at 0.071481 MPa with two terms.
/// With three it follows the last point to the exponent 159.7 (0.0367 MPa), whose modulus lies below the
/// least one here, 4e-18 of the whole: 0.0482 MPa.
#[test]
fn three_terms_on_a_bar() {
    let text = include_str!("../../../tests/data/treloar1944_20C.csv");
    let table = TestData::parse("treloar", text).unwrap().select(Mode::Uniaxial).unwrap();
    let of = |key: &str| fit(model(key).unwrap(), &table).unwrap().rms / 1e6;
    assert!((of("ogden-2") - 0.071481).abs() < 1e-6);
    let found = of("ogden-3");
    assert!(found < 0.0483, "{found}");
}

/// Wide strip in 13 points, where three terms follow a flat valley to the least modulus, e⁻⁴⁰ of the whole,
/// at the exponent −26.445. scipy's `least_squares` with that bound, from 300 random starts: 4955.84673 Pa. A
/// search in all parameters at once takes 26 000 evaluations.
#[test]
fn few_evaluations_along_a_valley() {
    let text = include_str!("../../../tests/data/treloar1944_20C.csv");
    let table = TestData::parse("treloar", text).unwrap().select(Mode::PureShear).unwrap();
    let found = fit(model("ogden-3").unwrap(), &table).unwrap();
    assert!((found.rms / 4955.84673 - 1.0).abs() < 1e-6, "{}", found.rms);
    assert!(found.iterations < 2000, "{}", found.iterations);
}

/// Terms without effect are reported as absent, locking limits beyond the data as undetermined.
#[test]
fn what_data_do_not_determine() {
    let text: String = [1.2, 1.4, 1.6, 1.8, 2.0, 2.2, 2.4]
        .iter()
        .fold("stretch,nominal_Pa\n".into(), |text, l| format!("{text}{l},{}\n", 3.0 * (l - 1.0 / (l * l))));
    let table = TestData::parse("gel", &text).unwrap();
    let identifiability = |key: &str| -> Vec<Identifiability> {
        fit(model(key).unwrap(), &table)
            .unwrap()
            .parameters
            .iter()
            .map(|parameter| parameter.identifiability)
            .collect()
    };
    use Identifiability::{Absent, Determined, Undetermined};
    assert_eq!(identifiability("neo-hookean"), [Determined]);
    assert_eq!(identifiability("mooney-rivlin"), [Determined, Absent]);
    assert_eq!(identifiability("eight-chain"), [Determined, Undetermined]);
    assert_eq!(identifiability("ogden-1"), [Determined, Determined]);
    let stopped = fit_until(model("gent").unwrap(), &table, &|| true).err().unwrap();
    assert_eq!(stopped, Error::Stopped);
}

/// Slopes in closed form against the law and its differences.
#[test]
fn slopes_of_ogden_terms() {
    let model = model("ogden-3").unwrap();
    let slopes = model.slopes.unwrap();
    let p = [0.4e6, 1.3, 0.003e6, 5.0, 0.01e6, -2.0];
    for stretches in [[2.0, 0.8], [1.0, 1.0], [0.6, 1.3], [1.0 + 1e-7, 1.0]] {
        let mut found = [[0.0; 2]; 6];
        let nominal = slopes(&p, stretches, &mut found);
        let of =
            |p: &[f64]| homogeneous::biaxial(&model.law(p).unwrap(), stretches[0], stretches[1]).unwrap();
        for axis in [0, 1] {
            assert!((nominal[axis] - of(&p)[axis]).abs() <= 1e-12 * 0.4e6, "{stretches:?}");
            for i in 0..6 {
                let step = 1e-6 * p[i].abs();
                let [mut up, mut down] = [p, p];
                up[i] += step;
                down[i] -= step;
                let difference = (of(&up)[axis] - of(&down)[axis]) / (2.0 * step);
                let scale = 1e-4 * (0.4e6 / p[i].abs());
                assert!(
                    (found[i][axis] - difference).abs() < 1e-6 * difference.abs() + 1e-5 * scale,
                    "{i} {stretches:?}"
                );
            }
        }
    }
}
