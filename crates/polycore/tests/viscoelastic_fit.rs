//! Fits of laws with time beside an independent integration (`tests/data/time`), closed forms, and refusals.

use evidence::{at_most, near};
use polycore::constitutive::hyperelastic::model;
use polycore::constitutive::viscoelastic::fit::{
    BranchForm, FitSettings, Form, MeasuredRun, Measurement, SpringForm, Test, ViscosityForm, fit, leave_out,
    rates,
};
use polycore::constitutive::viscoelastic::{Pace, Scheme};

fn branch(spring: SpringForm, viscosity: ViscosityForm) -> BranchForm {
    BranchForm { spring, viscosity }
}

fn fixed(form: Form, constants: &[(&str, f64)]) -> Form {
    let constants = constants.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
    Form { fixed: constants, ..form }
}

/// Cycles of VHB 4910 to 3 at three rates, integrated by Radau's method at 1e-10 with the constants of Kumar
/// and Lopez-Pamies 2016.
fn cycles() -> Vec<MeasuredRun> {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/time/vhb_uniaxial.csv");
    let text = std::fs::read_to_string(path).unwrap();
    ["0.01", "0.03", "0.05"]
        .map(|rate| {
            let rows = text.lines().filter(|line| line.split(',').next() == Some(rate));
            let points: Vec<[f64; 2]> = rows
                .map(|line| {
                    let cells: Vec<&str> = line.split(',').collect();
                    [cells[2].parse().unwrap(), cells[3].parse::<f64>().unwrap() * 1e3]
                })
                .collect();
            MeasuredRun::cycle(rate, rate.parse().unwrap(), Test::Uniaxial, &points).unwrap()
        })
        .to_vec()
}

/// The constants that these cycles determine come back, the others held at their published values; a rate
/// left out is predicted.
#[test]
fn published_constants_come_back() {
    let runs = cycles();
    assert_eq!(rates(&runs), [0.01, 0.03, 0.05]);
    let klp = branch(SpringForm::LopezPamies(2), ViscosityForm::KumarLopezPamies);
    let form = Form::new(model("lopez-pamies").unwrap(), vec![klp]);
    let form = fixed(
        form,
        &[
            ("alpha_1", 1.0),
            ("mu_2", 1.08e3),
            ("alpha_2", -2.474),
            ("1.nu_1", 5.42e3),
            ("1.beta_1", -10.0),
            ("1.beta_2", 1.948),
            ("1.eta_inf", 100.0),
            ("1.K_1", 3507e3),
            ("1.K_2", 1e-6),
            ("1.gamma_1", 1.852),
        ],
    );
    // half a stretch between two points
    let pace = Pace::Equal(40, Scheme::Sdirk2);
    let settings = FitSettings { starts: 2, pace, ..Default::default() };
    let found = fit(&form, &runs, &settings).unwrap();
    for (name, published) in
        [("mu_1", 13.54e3), ("1.nu_2", 20.78e3), ("1.eta_0", 7014e3), ("1.gamma_2", 0.26)]
    {
        near(&format!("{name} over the published one"), found.value(name).unwrap() / published, 1.0, 2e-3);
    }
    at_most("rms, Pa", found.pooled.rms, 5.0);
    // the sum of the published spring is monotone, with 32.8 kPa (formulation-time.md, section A)
    near("least slope of the branch, kPa", found.least_slopes[0] / 1e3, 32.8, 0.5);
    assert_eq!(found.starts, (2, 2));
    assert!(found.constants.iter().filter(|constant| constant.interval.is_some()).count() == 4);
    at_most("evaluations", found.evaluations as f64, 600.0);
    let warm = FitSettings { starts: 0, first: Some(found.values()), ..settings };
    let left = leave_out(&form, &runs, |run| run.rate == 0.03, &warm, &|| false).unwrap();
    at_most("rms of the rate left out, Pa", left.pooled.rms, 5.0);
}

/// Steady simple shear of a neo-Hookean branch: stress μγ + νκ/s³ with κ = ηγ̇/ν and s⁵ − s² = κ²
/// (formulation-time.md, section A), exact; three rates determine the three constants.
#[test]
fn constants_of_steady_shear_come_back() {
    let (modulus, nu, eta) = (1e4, 5e4, 2e5);
    let steady = |rate: f64| {
        let kappa = eta * rate / nu;
        let mut s: f64 = 1.0;
        for _ in 0..200 {
            s = (s * s + kappa * kappa).powf(0.2);
        }
        nu * kappa / s.powi(3)
    };
    let run = |rate: f64| {
        let point = |k: u32| {
            let time = 40.0 + f64::from(k);
            let strain = rate * time;
            Measurement { time, strain, nominal: modulus * strain + steady(rate) }
        };
        MeasuredRun::new(&format!("{rate} /s"), rate, Test::SimpleShear, (0..4).map(point).collect()).unwrap()
    };
    let runs = [0.05, 0.2, 0.5].map(run);
    let form = Form::new(
        model("neo-hookean").unwrap(),
        vec![branch(SpringForm::NeoHookean, ViscosityForm::Constant)],
    );
    let pace = Pace::Equal(200, Scheme::Sdirk2);
    let found = fit(&form, &runs, &FitSettings { pace, ..Default::default() }).unwrap();
    for (name, expected) in [("shear_modulus", modulus), ("1.nu", nu), ("1.eta", eta)] {
        near(&format!("{name} over its value"), found.value(name).unwrap() / expected, 1.0, 1e-3);
    }
}

/// Errors name what is wrong.
#[test]
fn refusals() {
    let point = |time: f64, strain: f64, nominal: f64| Measurement { time, strain, nominal };
    let refused = |points: Vec<Measurement>| {
        MeasuredRun::new("bar", 1.0, Test::Uniaxial, points).unwrap_err().to_string()
    };
    assert!(refused(vec![point(1.0, 1.1, 1.0)]).contains("1 points"));
    assert!(refused(vec![point(0.0, 1.5, 1.0), point(1.0, 1.5, 0.9)]).contains("begin with the ramp"));
    assert!(refused(vec![point(2.0, 1.1, 1.0), point(1.0, 1.2, 1.0)]).contains("1 s follows 2 s"));
    assert!(refused(vec![point(1.0, -0.1, 1.0), point(2.0, 1.2, 1.0)]).contains("stretch is -0.1"));
    assert!(refused(vec![point(1.0, 1.1, f64::NAN), point(2.0, 1.2, 1.0)]).contains("not all are finite"));
    let runs = cycles();
    let neo = model("neo-hookean").unwrap();
    let message = |form: Form| fit(&form, &runs, &FitSettings::default()).unwrap_err().to_string();
    let constant = branch(SpringForm::NeoHookean, ViscosityForm::Constant);
    let unknown = fixed(Form::new(neo, vec![constant]), &[("1.tau", 3.0)]);
    let found = message(unknown);
    assert!(found.contains("1.tau") && found.contains("1.nu, 1.eta"), "{found}");
    assert!(message(Form::new(neo, vec![constant; 20])).contains("21 measured stresses for 41 constants"));
    // one power below 0 softens from I₁ = 3.14 on
    let softening = branch(SpringForm::LopezPamies(1), ViscosityForm::Constant);
    let found = message(fixed(Form::new(neo, vec![softening]), &[("1.beta_1", -10.0)]));
    assert!(found.contains("branch 1 softens elastically"), "{found}");
    let proportional = branch(SpringForm::Proportional, ViscosityForm::Constant);
    let gent = Form::new(model("gent").unwrap(), vec![proportional]);
    assert!(gent.law(&[1e4, 50.0, 1.0, 1e5]).err().unwrap().to_string().contains("proportional"));
    assert!(gent.law(&[1e4]).err().unwrap().to_string().contains("1 constants do not fit"));
    let none = fit(&Form::new(neo, vec![constant]), &[], &FitSettings::default()).unwrap_err();
    assert!(none.to_string().contains("no run"), "{none}");
}
