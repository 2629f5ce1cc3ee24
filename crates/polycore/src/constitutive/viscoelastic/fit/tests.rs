use evidence::near;

use super::problem::Problem;
use super::{
    BranchForm, FitSettings, Form, MeasuredRun, Measurement, SpringForm, Test, ViscosityForm, fit,
    uncertainty,
};
use crate::constitutive::hyperelastic::model;
use crate::constitutive::viscoelastic::{Pace, Scheme};

/// Determines from three cycles of VHB 4910 to 3 the constants of the published law with 1 kPa of noise on
/// 123 points, as an independent script has it (formulation-time.md, section C): ln η₀ to 0.4, ln K₁ to 3.8,
/// γ₁ to 140 %. The script's points are not known, these are equal steps of 0.1.
#[test]
fn uncertainty_of_a_published_law() {
    let run = |rate: f64| {
        let point = |k: u32| {
            let path = 0.1 * f64::from(k);
            let strain = if k <= 20 { 1.0 + path } else { 5.0 - path };
            Measurement { time: path / rate, strain, nominal: 1e3 * path }
        };
        MeasuredRun::new(&format!("{rate}"), rate, Test::Uniaxial, (0..=40).map(point).collect()).unwrap()
    };
    let runs = [0.01, 0.03, 0.05].map(run);
    let branch =
        BranchForm { spring: SpringForm::LopezPamies(2), viscosity: ViscosityForm::KumarLopezPamies };
    let mut form = Form::new(model("lopez-pamies").unwrap(), vec![branch]);
    form.fixed = vec![("1.eta_inf".to_owned(), 100.0), ("1.K_2".to_owned(), 1e-6)];
    let problem = Problem::new(&form, &runs, Pace::Equal(4, Scheme::Sdirk2)).unwrap();
    let published = [
        13.54e3, 1.0, 1.08e3, -2.474, 5.42e3, -10.0, 20.78e3, 1.948, 7014e3, 100.0, 3507e3, 1e-6, 1.852, 0.26,
    ];
    let at = problem.inverse(&published);
    let (_, jacobian) = problem.jacobian(&at).unwrap();
    let scaled = jacobian / 1e3;
    let covariance = scaled.tr_mul(&scaled).try_inverse().unwrap();
    let interval = |k: usize| 1.96 * covariance[(k, k)].sqrt();
    near("ln eta_0, 95 %", interval(8), 0.4, 0.1);
    near("ln K_1, 95 %", interval(9), 3.8, 0.4);
    near("gamma_1, relative, 95 %", interval(10), 1.4, 0.2);
    let (values, errors) = uncertainty(scaled);
    // the direction of K₁ and γ₁ is below the noise: no interval
    assert!(values[11] < 1.0 && errors[9].is_none() && errors[8].is_some());
}

/// Fits softening to a cycle of a body without branches in closed form, to two strains: all constants return;
/// to one strain β is fixed at 0 and m is m + βW_max.
#[test]
fn softening_in_closed_form() {
    let (mu, r, m, beta) = (0.5e6, 1.6, 0.15e6, 0.2);
    let run = |peaks: &[f64]| {
        let (mut points, mut most, mut at) = (Vec::new(), 0.0_f64, 1.0);
        for goal in peaks.iter().flat_map(|peak| [*peak, 1.05]) {
            for k in 1..=20 {
                let strain = at + (goal - at) * f64::from(k) / 20.0;
                let energy = 0.5 * mu * (strain * strain + 2.0 / strain - 3.0);
                most = most.max(energy);
                let zeta = 1.0 - libm::erf((most - energy) / (m + beta * most)) / r;
                let nominal = zeta * mu * (strain - strain.powi(-2));
                points.push(Measurement { time: points.len() as f64 + 1.0, strain, nominal });
            }
            at = goal;
        }
        MeasuredRun::new("cycle", 0.1, Test::Uniaxial, points).unwrap()
    };
    let form = Form { softening: true, ..Form::new(model("neo-hookean").unwrap(), Vec::new()) };
    let found = fit(&form, &[run(&[1.8, 2.6])], &FitSettings::default()).unwrap();
    for (name, value) in [("shear_modulus", mu), ("mullins.r", r), ("mullins.m", m), ("mullins.beta", beta)] {
        near(&format!("{name} of a softening fit"), found.value(name).unwrap() / value, 1.0, 1e-4);
    }
    // noise of the strain at the start is no turn
    let jitter = [1.0003, 1.0001, 1.0004, 1.0002].into_iter().enumerate();
    let jitter = jitter.map(|(k, strain)| Measurement { time: 0.1 * k as f64, strain, nominal: 0.0 });
    let cycle = run(&[2.0]);
    let measured = |points| MeasuredRun::new("cycle", 0.1, Test::Uniaxial, points).unwrap();
    let noisy = measured(jitter.chain(cycle.points().iter().copied()).collect());
    let single = fit(&form, &[noisy], &FitSettings::default()).unwrap();
    let most = 0.5 * mu * (4.0 + 1.0 - 3.0);
    near("m of one cycle", single.value("mullins.m").unwrap() / (m + beta * most), 1.0, 1e-4);
    let fixed = single.constants.iter().find(|own| own.constant.name == "mullins.beta").unwrap();
    assert_eq!(fixed.constant.fixed.map(|(value, _)| value), Some(0.0));
    let ramp = measured(cycle.points()[..20].to_vec());
    let error = fit(&form, &[ramp], &FitSettings::default()).unwrap_err().to_string();
    assert!(error.contains("no run that turns back"), "{error}");
}
