//! Viscoelastic points against closed forms and reference tables (`tests/data/time`, from an independent
//! script with Radau's method; formulation-time.md).

use evidence::{at_most, near, within};
use polycore::constitutive::hyperelastic::data::Mode;
use polycore::constitutive::hyperelastic::{Compressible, EightChain, LopezPamies, NeoHookean, Volumetric};
use polycore::constitutive::viscoelastic::{
    Branch, BranchState, History, Increment, Mullins, Pace, Reaction, Scheme, Shift, Spring, State,
    StrainSoftening, Trace, Viscoelastic, Viscosity, nominal_of_test, strain_of_test,
};
use polycore::constitutive::{Law, Workspace};
use polycore::tensor::{Tensor, Voigt, Voigt6x6, voigt};

const REST: Voigt = Voigt::new(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);

/// Numbers of a table, row by row; text is NaN.
fn table(name: &str) -> Vec<Vec<f64>> {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/time").join(name);
    let text = std::fs::read_to_string(path).unwrap();
    let row = |line: &str| line.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect();
    text.lines().skip(1).map(row).collect()
}

fn neo(modulus: f64) -> Spring {
    Spring::NeoHookean(NeoHookean::new(modulus).unwrap())
}

/// Law of a branch beside an incompressible neo-Hookean law.
fn one(modulus: f64, spring: Spring, viscosity: Viscosity) -> Viscoelastic {
    let law = Box::new(NeoHookean::new(modulus).unwrap());
    Viscoelastic::new(law, vec![Branch::new(spring, viscosity).unwrap()]).unwrap()
}

fn vhb_spring() -> Spring {
    Spring::LopezPamies(LopezPamies::new(vec![[5.42e3, -10.0], [20.78e3, 1.948]]).unwrap())
}

/// VHB 4910 of Kumar and Lopez-Pamies 2016.
fn vhb_viscosity() -> Viscosity {
    // K₂ = 1 /kPa²
    Viscosity::KumarLopezPamies {
        start: 7014e3,
        end: 0.1e3,
        thickening: 3507e3,
        thinning: 1e-6,
        exponents: [1.852, 0.26],
    }
}

fn vhb(viscosity: Viscosity) -> Viscoelastic {
    let law = Box::new(LopezPamies::new(vec![[13.54e3, 1.0], [1.08e3, -2.474]]).unwrap());
    Viscoelastic::new(law, vec![Branch::new(vhb_spring(), viscosity).unwrap()]).unwrap()
}

fn follow(law: &Viscoelastic, strain: &dyn Fn(f64) -> Voigt, times: &[f64], pace: Pace) -> Trace {
    let reaction = Reaction::Test(Mode::Uniaxial);
    let history = History { strain, temperature: &|_| 293.15, times, reaction };
    law.follow(&history, law.rest(), pace).unwrap()
}

fn viscous(trace: &Trace) -> Voigt {
    trace.points.last().unwrap().step.state.branches[0].viscous
}

fn shear(amount: f64) -> Voigt {
    Voigt::new(1.0, 1.0 + amount * amount, 1.0, amount, 0.0, 0.0)
}

fn norm(c: &Voigt) -> f64 {
    voigt::to_stress(c).norm()
}

#[test]
fn relaxation_at_a_held_stretch() {
    let law = one(1.0, neo(1.0), Viscosity::Constant(1.0));
    let held = strain_of_test(Mode::Uniaxial, 2.0);
    let stretch = |trace: &Trace| (held[0] / viscous(trace)[0]).sqrt();
    for row in table("relaxation_closed_form.csv") {
        let trace = follow(&law, &|_| held, &[0.0, row[0]], Pace::Equal(4096, Scheme::Sdirk2));
        near(&format!("elastic stretch at t = {}", row[0]), stretch(&trace), row[1], 3e-7);
        let own = trace.points[0].step.prediction.stress;
        let stress = nominal_of_test(&held, &own) * 2.0 - 3.5;
        near(&format!("stress of the branch at t = {}", row[0]), stress, row[2], 3e-6);
    }
    let exact = 1.21102324;
    for row in table("relaxation_orders.csv") {
        for (scheme, error) in [(Scheme::Euler, row[1]), (Scheme::Sdirk2, row[2])] {
            let trace = follow(&law, &|_| held, &[0.0, 1.0], Pace::Equal(row[0] as usize, scheme));
            near(&format!("{scheme:?}, {} steps", row[0]), stretch(&trace) / exact - 1.0, error, 1e-8);
            at_most("det C_v − 1", (voigt::to_stress(&viscous(&trace)).determinant() - 1.0).abs(), 1e-14);
        }
    }
}

/// Constant viscosity where C and C_v are not coaxial: shear to 2 within 1 s, then held for 1 s.
#[test]
fn orders_in_shear() {
    let law = one(1.0, neo(1.0), Viscosity::Constant(1.0));
    let strain = |t: f64| shear((2.0 * t).min(2.0));
    let row = &table("shear_reference.csv")[1];
    let reference = Voigt::new(row[1], row[2], row[3], row[4], 0.0, 0.0);
    for row in table("shear_orders.csv") {
        for (scheme, error) in [(Scheme::Euler, row[1]), (Scheme::Sdirk2, row[2])] {
            let trace = follow(&law, &strain, &[0.0, 2.0], Pace::Equal(row[0] as usize, scheme));
            let found = norm(&(viscous(&trace) - reference)) / norm(&reference);
            near(&format!("{scheme:?} {}", row[0]), found / error, 1.0, 1e-3);
        }
    }
}

/// Orders where the flow is not coaxial and η depends on J₂ and I₁ᵛ; each error is that of the script.
#[test]
fn orders_of_viscosities() {
    let path = |x: f64| {
        let f = Tensor::new(1.0, 2.0 * x, 0.0, 0.0, 1.0 + 0.3 * x, 0.0, 0.0, 0.0, 1.0 / (1.0 + 0.3 * x));
        voigt::from_stress(&(f.transpose() * f))
    };
    let bergstrom_boyce =
        Viscosity::BergstromBoyce { rate: 0.5, stress: 20e3, power: 4.0, creep: -0.7, offset: 0.05 };
    let eyring = Viscosity::Eyring { rate: 1e-3, stress: 6e3, pressure: 0.0, softening: None };
    let cases = [(vhb_viscosity(), 40.0), (bergstrom_boyce, 1.0), (eyring, 10.0)];
    for (rows, (viscosity, end)) in table("viscosity_orders.csv").chunks(4).zip(cases) {
        let law = vhb(viscosity);
        for row in rows {
            let reference = Voigt::new(row[4], row[5], row[6], row[7], 0.0, 0.0);
            for (scheme, error) in [(Scheme::Euler, row[2]), (Scheme::Sdirk2, row[3])] {
                let trace =
                    follow(&law, &|t| path(t / end), &[0.0, end], Pace::Equal(row[1] as usize, scheme));
                let found = norm(&(viscous(&trace) - reference)) / norm(&reference);
                near(&format!("{viscosity:?} {scheme:?} {}", row[1]), found / error, 1.0, 1e-3);
            }
        }
    }
}

/// Steady shear of a neo-Hookean branch: s⁵ − s² = κ², τ₁₂ = νκ/s³, N₁ = 2ν(s − s⁻²); and steady elongation,
/// σ₁ − σ₂ = 3ηε̇ at any rate.
#[test]
fn steady_flows() {
    let law = one(1.0, neo(1.0), Viscosity::Constant(1.0));
    for row in table("steady_shear.csv") {
        // steps of the shear 0.05 from the state at the start of each, seen from there
        let f = Tensor::new(1.0, 0.05, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
        let mut state = law.rest();
        let mut b = Tensor::identity();
        let c = voigt::from_stress(&(f.transpose() * f));
        for _ in 0..(400.0 * (row[0] / row[3]).max(1.0)) as usize {
            state.branches[0].viscous = voigt::from_stress(&b.try_inverse().unwrap());
            let increment = Increment { scheme: Scheme::Sdirk2, ..Increment::new(REST, c, 0.05 / row[0]) };
            state = law.advance_stress(&state, &increment, &mut Workspace::default()).unwrap().state;
            let inverse = voigt::to_stress(&state.branches[0].viscous).try_inverse().unwrap();
            b = f * inverse * f.transpose();
        }
        near(&format!("shear stress at κ = {}", row[0]), b[(0, 1)] / row[1] - 1.0, row[4], 1e-8);
        near(&format!("N₁ at κ = {}", row[0]), (b[(0, 0)] - b[(1, 1)]) / row[2] - 1.0, row[5], 1e-7);
    }
    let rate = 2.0;
    let strain = |t: f64| strain_of_test(Mode::Uniaxial, (rate * t).exp());
    let error = |steps| {
        let trace = follow(&law, &strain, &[0.0, 4.0], Pace::Equal(steps, Scheme::Sdirk2));
        let (c, stress) = (strain(4.0), trace.points[0].step.prediction.stress);
        let branch = c[0] * (stress[0] - 1.0) - c[2] * (stress[2] - 1.0);
        branch / (3.0 * rate) - 1.0
    };
    at_most("elongation, 400 steps", error(400).abs(), 1e-4);
    within("order in elongation", (error(200) / error(400)).log2(), 1.95, 2.05);
}

#[test]
fn vhb_in_tension() {
    let law = vhb(vhb_viscosity());
    let rows = table("vhb_uniaxial.csv");
    let mut work = Vec::new();
    for rows in rows.chunks(7) {
        let rate = rows[0][0];
        let top = 2.0 / rate;
        let stretch = |t: f64| if t <= top { 1.0 + rate * t } else { 3.0 - rate * (t - top) };
        let mut times = vec![0.0];
        for (k, row) in rows.iter().enumerate() {
            times.push(if k < 4 { (row[2] - 1.0) / rate } else { top + (3.0 - row[2]) / rate });
        }
        let strain = |t: f64| strain_of_test(Mode::Uniaxial, stretch(t));
        let trace = follow(&law, &strain, &times, Pace::Within(5.0));
        work.push(trace.steps);
        for (row, point) in rows.iter().zip(&trace.points) {
            let nominal = nominal_of_test(&strain(point.time), &point.step.prediction.stress) / 1e3;
            near(&format!("{rate} /s at {}, kPa", row[2]), nominal, row[3], 2e-3);
        }
    }
    within("steps of the error control", work.iter().sum::<usize>() as f64, 100.0, 4000.0);
}

/// Flow at constant true rate: σ = √3 τ₀ asinh(√3 ε̇/γ̇₀); with pressure and softening, fresh and aged.
#[test]
fn glassy_flow() {
    let drawn = |viscosity, modulus, rate: f64, end: f64, sign: f64| {
        let law = one(1.0, neo(modulus), viscosity);
        let strain = |t: f64| strain_of_test(Mode::Uniaxial, (sign * rate * t).exp());
        let trace = follow(&law, &strain, &[0.0, end / rate], Pace::Equal(4000, Scheme::Euler));
        let (c, stress) = (strain(end / rate), trace.points[0].step.prediction.stress);
        c[0] * (stress[0] - 1.0) - c[2] * (stress[2] - 1.0)
    };
    for row in table("eyring.csv") {
        let eyring = Viscosity::Eyring { rate: 1e-8, stress: 1.6e6, pressure: 0.0, softening: None };
        near(&format!("MPa at {} /s", row[0]), drawn(eyring, 600e6, row[0], 0.2, 1.0) / 1e6, row[1], 2e-5);
    }
    // polycarbonate: η₀ = τ₀/γ̇₀; R = 1 at γ = 0 stays for a slow softening
    for (index, row) in table("eyring_pressure.csv").iter().enumerate() {
        let aged = StrainSoftening { amount: 26.5, shape: [0.965, 50.0, 1.0 - 1e-9] };
        let eyring = Viscosity::Eyring {
            rate: 0.7e6 / 2.1e17,
            stress: 0.7e6,
            pressure: 0.08,
            softening: (index % 2 == 1).then_some(aged),
        };
        for (sign, expected) in [(1.0, row[2]), (-1.0, row[3])] {
            let found = sign * drawn(eyring, 900e6, row[0], 0.3, sign) / 1e6;
            near(&format!("MPa, row {index}, sign {sign}"), found / expected, 1.0, 1e-3);
        }
    }
}

/// Single steps of 1e-12 to 1e12 s beside the script's, then far beyond.
#[test]
fn stiff_steps() {
    let bergstrom_boyce =
        Viscosity::BergstromBoyce { rate: 1.0, stress: 1.0, power: 4.0, creep: 0.0, offset: 0.05 };
    let eyring = Viscosity::Eyring { rate: 1e-8, stress: 1.6e6, pressure: 0.0, softening: None };
    let step = |law: &Viscoelastic, stretch, duration, scheme| {
        let c = strain_of_test(Mode::Uniaxial, stretch);
        let increment = Increment { scheme, ..Increment::new(c, c, duration) };
        let found = law.advance(&law.rest(), &increment, &mut Workspace::default()).unwrap();
        let viscous = found.state.branches[0].viscous;
        let conditioning = c[0] / c[2];
        let volume = voigt::to_stress(&viscous).determinant();
        at_most("det C_v − 1, stiff steps", (volume - 1.0).abs(), 1e-15 * conditioning);
        assert!(found.dissipated >= 0.0 && found.prediction.stress.iter().all(|s| s.is_finite()));
        (c[0] / viscous[0]).sqrt()
    };
    let (soft, glassy) = (one(1.0, neo(1.0), bergstrom_boyce), one(1.0, neo(600e6), eyring));
    for row in table("stiff_step.csv") {
        near(&format!("Δt = {}, Euler", row[0]), step(&soft, 3.0, row[0], Scheme::Euler), row[1], 1e-8);
        near(&format!("Δt = {}, SDIRK2", row[0]), step(&soft, 3.0, row[0], Scheme::Sdirk2), row[3], 1e-8);
        near(&format!("Δt = {}, Eyring", row[0]), step(&glassy, 3.0, row[0], Scheme::Euler), row[4], 1e-8);
    }
    let chains = Spring::EightChain(EightChain::new(1e6, 5.0).unwrap());
    let laws = [
        vhb(vhb_viscosity()),
        one(1.0, neo(1e12), eyring),
        one(1.0, neo(1e6), Viscosity::Constant(1e-3)),
        one(1.0, chains, Viscosity::Constant(1e5)),
    ];
    for (index, law) in laws.iter().enumerate() {
        let reach = if index == 3 { 3.0 } else { 30.0 };
        let mut last = f64::INFINITY;
        for exponent in -30..=30 {
            let elastic = step(law, reach, 10.0_f64.powi(exponent), Scheme::Euler);
            assert!(
                elastic <= last * (1.0 + 1e-12) && elastic >= 1.0 - 1e-12,
                "{index} {exponent}: {elastic}"
            );
            last = elastic;
        }
    }
}

/// One cycle of simple shear: work = W + dissipation, and each beside the script's.
#[test]
fn ledger_of_a_cycle() {
    let bergstrom_boyce =
        Viscosity::BergstromBoyce { rate: 0.5, stress: 20e3, power: 4.0, creep: -0.7, offset: 0.05 };
    let eyring = Viscosity::Eyring { rate: 1e-3, stress: 6e3, pressure: 0.0, softening: None };
    let cases =
        [(vhb_viscosity(), 40.0), (bergstrom_boyce, 1.0), (eyring, 10.0), (Viscosity::Constant(300e3), 40.0)];
    for (rows, (viscosity, period)) in table("energy_cycle.csv").chunks(2).zip(cases) {
        let law = vhb(viscosity);
        let strain = |t: f64| shear(1.5 * (std::f64::consts::TAU * t / period).sin());
        let trace = follow(&law, &strain, &[0.0, 0.25 * period, period], Pace::Equal(2000, Scheme::Sdirk2));
        for (row, point) in rows.iter().zip(&trace.points) {
            let energy = point.step.prediction.energy.unwrap();
            near(&format!("work at {}", row[1]), point.work / 1e3, row[2], 3e-4);
            near(&format!("W at {}", row[1]), energy / 1e3, row[3], 3e-4);
            near(&format!("dissipation at {}", row[1]), point.dissipated / 1e3, row[4], 3e-4);
            at_most("open ledger", (point.work - energy - point.dissipated).abs() / point.work, 1e-5);
        }
    }
}

#[test]
fn mullins_in_tension() {
    let softening = Mullins { ratio: 2.104, offset: 0.2, slope: 0.1 };
    let law = Viscoelastic::new(Box::new(NeoHookean::new(1.0).unwrap()), Vec::new()).unwrap();
    let law = law.with_softening(softening).unwrap();
    let mut memory = Workspace::default();
    let mut state = law.rest();
    let mut dissipated = 0.0;
    for row in table("mullins.csv") {
        let c = strain_of_test(Mode::Uniaxial, row[0]);
        let found = law.advance(&state, &Increment::new(REST, c, 1.0), &mut memory).unwrap();
        dissipated += found.dissipated;
        // S of the isochoric part is a deviator: σ₁ − σ₃ as before
        let nominal = nominal_of_test(&c, &found.prediction.stress);
        near(&format!("stress at {}", row[0]), nominal, row[2], 1e-8);
        near(&format!("recoverable at {}", row[0]), found.prediction.energy.unwrap(), row[3], 1e-8);
        near(&format!("dissipated at {}", row[0]), dissipated, row[4], 1e-8);
        state = found.state;
    }
    let invalid = Mullins { ratio: 1.0, offset: 0.2, slope: 0.1 };
    assert!(invalid.check().unwrap_err().to_string().contains("mullins: r = 1 is outside (1, ∞)"));
}

/// ℂ of the whole step is 2 ∂S/∂C by central differences, and symmetric.
#[test]
fn tangent_of_a_step() {
    let equilibrium = || {
        let law = NeoHookean::new(1e5).unwrap();
        Box::new(Compressible::new(law, Volumetric::Ciarlet { lame: 1e6 }).unwrap())
    };
    let bergstrom_boyce =
        Viscosity::BergstromBoyce { rate: 0.5, stress: 20e3, power: 4.0, creep: -0.7, offset: 0.05 };
    let eyring = Viscosity::Eyring { rate: 1e-3, stress: 6e3, pressure: 0.1, softening: None };
    let chains = Spring::EightChain(EightChain::new(1e5, 8.0).unwrap());
    let branch = |spring, viscosity| Branch::new(spring, viscosity).unwrap();
    let laws = [
        vec![branch(neo(1e6), Viscosity::Constant(3e5))],
        vec![branch(vhb_spring(), vhb_viscosity()), branch(chains, bergstrom_boyce)],
        vec![branch(neo(6e7), eyring)],
    ];
    let start = Voigt::new(1.3, 0.9, 1.1, 0.3, -0.1, 0.2);
    for (index, branches) in laws.into_iter().enumerate() {
        let softening = Mullins { ratio: 2.0, offset: 1e4, slope: 0.1 };
        let law = Viscoelastic::new(equilibrium(), branches).unwrap().with_softening(softening).unwrap();
        let mut memory = Workspace::default();
        let loaded = Voigt::new(2.0, 0.8, 0.9, 0.5, 0.2, 0.1);
        let state: State =
            law.advance(&law.rest(), &Increment::new(REST, loaded, 0.5), &mut memory).unwrap().state;
        for (name, c, tolerance) in [("turned", start, 2e-7), ("coaxial, equal stretches", REST, 2e-6)] {
            let mut at = |c: Voigt, state: &State| {
                law.advance(state, &Increment::new(c, c, 0.7), &mut memory).unwrap().prediction
            };
            let rest = law.rest();
            let state = if name == "turned" { &state } else { &rest };
            let tangent = at(c, state).tangent.unwrap();
            let h = 1e-6;
            let differences = Voigt6x6::from_fn(|a, b| {
                let mut up = c;
                let mut down = c;
                (up[b], down[b]) = (up[b] + h, down[b] - h);
                let factor = if b < 3 { 1.0 } else { 0.5 };
                factor * (at(up, state).stress[a] - at(down, state).stress[a]) / h
            });
            let size = tangent.amax();
            at_most(
                &format!("law {index}, {name}: ℂ − 2∂S/∂C"),
                (tangent - differences).amax() / size,
                tolerance,
            );
            at_most(
                &format!("law {index}, {name}: asymmetry"),
                (tangent - tangent.transpose()).amax() / size,
                1e-13,
            );
        }
    }
}

/// Storage and loss of a small oscillation, with a temperature shift: a_T moves the frequency.
#[test]
fn small_oscillations() {
    for row in table("dma.csv") {
        for shift in [Shift::None, Shift::Wlf { reference: 253.15, constants: [8.86, 101.6] }] {
            let mut branch = Branch::new(neo(3.0), Viscosity::Constant(3.0)).unwrap();
            branch.shift = shift;
            let law = Viscoelastic::new(Box::new(NeoHookean::new(1.0).unwrap()), vec![branch]).unwrap();
            let omega = row[0] / shift.logarithm(293.15).exp();
            let periods = (2.0 * row[0]).ceil().max(4.0) as usize;
            let period = std::f64::consts::TAU / omega;
            let times: Vec<f64> = (0..=200 * periods).map(|k| period * k as f64 / 200.0).collect();
            let strain = |t: f64| shear(1e-4 * (omega * t).sin());
            let trace = follow(&law, &strain, &times, Pace::Equal(1, Scheme::Sdirk2));
            let (mut storage, mut loss) = (0.0, 0.0);
            for point in &trace.points[200 * (periods - 1)..] {
                let (c, s) = (strain(point.time), point.step.prediction.stress);
                let stress = s[3] + c[3] * s[1];
                storage += stress * (omega * point.time).sin() / 100.0 / 1e-4;
                loss += stress * (omega * point.time).cos() / 100.0 / 1e-4;
            }
            near(&format!("G′ at ωτ = {}", row[0]), storage / row[1] - 1.0, row[4], 1e-6);
            near(&format!("G″ at ωτ = {}", row[0]), loss / row[2] - 1.0, row[5], 1e-6);
        }
    }
}

/// The published sum of VHB keeps τ(e) monotone up to log strains of 1; its first term alone does not.
#[test]
fn monotone_springs() {
    near("least slope, kPa", vhb_spring().least_slope(1.0) / 1e3, 32.8, 0.3);
    let alone = Spring::LopezPamies(LopezPamies::new(vec![[5.42e3, -10.0]]).unwrap());
    assert!(alone.least_slope(0.1) > 0.0 && alone.least_slope(0.3) < 0.0);
}

#[test]
fn invalid_input() {
    let law = one(1.0, neo(1.0), Viscosity::Constant(1.0));
    let memory = &mut Workspace::default();
    let error = |found: Result<_, polycore::constitutive::Error>| found.err().map(|e| e.to_string()).unwrap();
    let message = error(law.advance(&law.rest(), &Increment::new(REST, REST, -1.0), memory));
    assert!(message.contains("duration: found -1; allowed: at least 0 s"), "{message}");
    let message = error(law.advance(
        &State { branches: Vec::new(), peak: 0.0 },
        &Increment::new(REST, REST, 1.0),
        memory,
    ));
    assert!(message.contains("states of branches: found 0"), "{message}");
    // a sudden stretch beyond locking would dissipate without limit
    let chains = Spring::EightChain(EightChain::new(1e6, 2.0).unwrap());
    let locked = one(1.0, chains, Viscosity::Constant(1.0));
    let beyond = strain_of_test(Mode::Uniaxial, 3.0);
    let message = error(locked.advance(&locked.rest(), &Increment::new(REST, beyond, 1.0), memory));
    assert!(message.contains("spring of a branch at the start of a step"), "{message}");
    let collapsed = Voigt::new(-1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
    assert!(law.advance(&law.rest(), &Increment::new(REST, collapsed, 1.0), memory).is_err());
    let history = History {
        strain: &|_| REST,
        temperature: &|_| 293.15,
        times: &[0.0, 2.0, 1.0],
        reaction: Reaction::Law,
    };
    let back = law.follow(&history, law.rest(), Pace::Within(1.0)).unwrap_err().to_string();
    assert!(back.contains("1 s after 2 s"), "{back}");
    for viscosity in [
        Viscosity::Constant(0.0),
        Viscosity::BergstromBoyce { rate: 1.0, stress: 1.0, power: 0.5, creep: 0.0, offset: 0.1 },
        Viscosity::Eyring { rate: 1.0, stress: f64::NAN, pressure: 0.0, softening: None },
    ] {
        assert!(Branch::new(neo(1.0), viscosity).is_err(), "{viscosity:?}");
    }
    // without a branch the law is the elastic one, to the bit
    let elastic = Viscoelastic::new(Box::new(NeoHookean::new(2.0).unwrap()), Vec::new()).unwrap();
    let c = shear(0.3);
    let own = elastic.advance(&elastic.rest(), &Increment::new(REST, c, 1.0), memory).unwrap().prediction;
    assert_eq!(own, elastic.equilibrium().tangent(&c, memory).unwrap());
    let _: &dyn Law = elastic.equilibrium();
}

/// The flow of a glassy branch converges at any strain, duration and temperature: Newton's method alone jumps
/// between both sides of the kink of ln sinh for some of them.
#[test]
fn glassy_steps_at_any_strain() {
    let spring = Spring::NeoHookean(NeoHookean::new(320.0).unwrap());
    let eyring = Viscosity::Eyring { rate: 1e-5, stress: 1.0, pressure: 0.0, softening: None };
    let mut branch = Branch::new(spring, eyring).unwrap();
    branch.shift = Shift::Arrhenius { reference: 293.15, energy: 60e3 };
    let rest = BranchState::REST;
    for thickness in (0..21).map(|k| 0.5 + 0.05 * f64::from(k)) {
        for stretch in [1.01_f64, 1.05, 1.1, 1.2] {
            let to = Voigt::new(stretch * stretch, 1.0, thickness, 0.0, 0.0, 0.0);
            for temperature in (0..12).map(|k| 240.0 + 10.0 * f64::from(k)) {
                let mut stress = f64::INFINITY;
                for duration in (-6..7).map(|k| 10f64.powf(0.5 * f64::from(k))) {
                    let increment = Increment { temperature, ..Increment::new(rest.viscous, to, duration) };
                    let (found, _) = branch.advance(&rest, &increment).unwrap();
                    assert!(found.norm() <= stress, "{thickness} {stretch} {temperature} {duration}");
                    stress = found.norm() * (1.0 + 1e-12);
                }
            }
        }
    }
}
