//! Solids with a state: frozen forces, relaxation in closed form, ledgers with broken bonds, resumed runs.

use crate::bodies::{Body, Slit, hold};
use crate::materials::battery;
use evidence::{at_most, near};
use peri::bonds::{BodyGeometry, Bonds};
use peri::calibrate::Space;
use peri::material::{Driving, Material, NonlocalSolid, ViscousCorrespondence};
use peri::solver::{Breaking, Criterion, Lbfgs, Method, Policy, State, Status, System, VelocityVerlet};
use polycore::constitutive::hyperelastic::{Compressible, NeoHookean, Volumetric};
use polycore::constitutive::viscoelastic::{Branch, Mullins, Spring, Viscoelastic, Viscosity};
use std::sync::Arc;

type Solid = NonlocalSolid<Arc<ViscousCorrespondence>>;

/// μ = 1, λ as given, a branch of ν = 3 that relaxes in 1 s.
fn solid<const D: usize>(space: Space, lame: f64, driving: Driving, softening: Option<Mullins>) -> Solid {
    let rubber = Compressible::new(NeoHookean::new(1.0).unwrap(), Volumetric::Ciarlet { lame }).unwrap();
    let spring = Spring::NeoHookean(NeoHookean::new(3.0).unwrap());
    let branch = Branch::new(spring, Viscosity::Constant(3.0)).unwrap();
    let mut law = Viscoelastic::new(Box::new(rubber), vec![branch]).unwrap();
    if let Some(softening) = softening {
        law = law.with_softening(softening).unwrap();
    }
    NonlocalSolid(Arc::new(ViscousCorrespondence::new::<D>(law, space, 1.0, driving).unwrap()))
}

/// With a state that does not change in the step the forces are those of an energy, within the bound of the
/// stiffness.
#[test]
fn frozen_states_pass_the_battery() {
    let rule = Driving::Equilibrium;
    for space in [Space::PlaneStrain, Space::PlaneStress] {
        let of = |bonds: &dyn Bonds<2>| solid::<2>(space, 5.0, rule, None).respond(bonds);
        at_most("viscous_stiffness_over_bound", battery::<2>(&format!("{space:?}"), [8, 7], &of), 2.0);
    }
    let of = |bonds: &dyn Bonds<3>| solid::<3>(Space::Solid, 5.0, rule, None).respond(bonds);
    at_most("viscous_stiffness_over_bound", battery::<3>("solid", [4, 4, 3], &of), 2.0);
}

/// Pulls a strip with a notch in 40 steps to `rise` within a second, holds it for a second in 20.
fn tear(
    rule: Driving,
    moving: bool,
    steps: [u32; 2],
    start: Option<&State<2>>,
    saved: &mut Vec<State<2>>,
) -> State<2> {
    let mut body = Body::<2>::solid([30, 24], 0.1, 3.015);
    body.slits = vec![Slit { at: 1.2, from: -1.0, to: 1.2 }];
    let mut built = body.build();
    let bonds = &mut built.lattice;
    let softening = Mullins { ratio: 2.0, offset: 0.2, slope: 0.1 };
    let solid =
        solid::<2>(Space::PlaneStress, 20.0, rule, (rule == Driving::Equilibrium).then_some(softening));
    let loads = hold(bonds, |[_, y]| match y {
        y if y < 0.3 => Some((3, [0.0; 2])),
        y if y > 2.1 => Some((3, [0.0, 0.6])),
        _ => None,
    });
    let mut state = start.cloned().unwrap_or_else(|| State::new(bonds.sites()));
    let ramp = (1..=steps[0]).map(|k| f64::from(k) / f64::from(steps[0])).map(|part| (part, part));
    let holds = (1..=steps[1]).map(|k| (1.0 + f64::from(k) / f64::from(steps[1]), 1.0));
    let (times, factors): (Vec<f64>, Vec<f64>) = ramp.chain(holds).unzip();
    let mut system = System::new(bonds, solid, &loads, &factors);
    system.times = times.into();
    system.breaking = Some(Breaking { criterion: Criterion::Energy(0.5), policy: Policy::AtEquilibrium });
    let mut seen = 0;
    let mut watch = |status: &Status, state: &State<2>| {
        seen += 1;
        if status.restartable && state.fracture.broken > 0 && (!moving || seen % 50 == 0) {
            saved.push(state.clone());
        }
        Ok(())
    };
    let finished = &mut |_: &dyn Bonds<2>, _: &_| Ok(());
    let solved = if moving {
        system.times = Vec::new().into();
        VelocityVerlet { records: 20, ramp: 10.0, safety: 0.45, ..VelocityVerlet::new(1.0, 10.0) }.solve(
            &mut system,
            &mut state,
            &mut watch,
            finished,
        )
    } else {
        Lbfgs { tolerance: 1e-6, ..Default::default() }.solve(&mut system, &mut state, &mut watch, finished)
    };
    solved.unwrap();
    state
}

/// Work = stored + dissipated + released (+ kinetic) while a strip tears; a run resumed from any saved state
/// has equal bits.
#[test]
fn a_relaxing_strip_tears_and_its_ledger_closes() {
    for (rule, moving) in
        [(Driving::Equilibrium, false), (Driving::Total, false), (Driving::Equilibrium, true)]
    {
        let mut saved = Vec::new();
        let whole = tear(rule, moving, [40, 20], None, &mut saved);
        let last = whole.history.last().unwrap();
        eprintln!(
            "{rule:?}, moving {moving}: {} broken; work {:.5}, stored {:.5}, released {:.5}, dissipated \
             {:.5}, kinetic {:.5}",
            last.broken, last.work, last.stored, last.released, last.dissipated, last.kinetic
        );
        assert!(last.broken > 0 && last.dissipated > 0.0);
        let held = last.stored + last.released + last.dissipated + last.kinetic;
        if moving {
            at_most("viscous_energy_balance", (held / last.work - 1.0).abs(), 0.01);
        } else {
            // the drop of the load in an equilibrium with broken bonds does no work, all else is balanced
            assert!(held <= 1.01 * last.work, "{last:?}");
        }
        for state in saved.iter().step_by(saved.len().div_ceil(3)) {
            let again = tear(rule, moving, [40, 20], Some(state), &mut Vec::new());
            assert!(again == whole, "{moving}: from step {}, round {}", state.step, state.control.round);
        }
    }
}

/// Without broken bonds the ledger closes to the error of the work integral, of second order in the steps.
#[test]
fn the_ledger_closes_to_the_work_integral() {
    let gap = |steps: [u32; 2]| {
        let mut body = Body::<2>::solid([20, 14], 0.1, 3.015);
        body.slits = vec![Slit { at: 0.7, from: -1.0, to: 0.8 }];
        let mut built = body.build();
        let bonds = &mut built.lattice;
        let softening = Mullins { ratio: 2.0, offset: 0.2, slope: 0.1 };
        let solid = solid::<2>(Space::PlaneStress, 20.0, Driving::Equilibrium, Some(softening));
        let loads = hold(bonds, |[_, y]| match y {
            y if y < 0.3 => Some((3, [0.0; 2])),
            y if y > 1.1 => Some((3, [0.0, 0.6])),
            _ => None,
        });
        let legs = [(0.0, 0.0, 1.0, 1.0), (1.0, 1.0, 3.0, 1.0), (3.0, 1.0, 3.5, 0.3)];
        let mut places: Vec<(f64, f64)> = Vec::new();
        for (from, low, to, high) in legs {
            let count = steps[0];
            places.extend(
                (1..=count)
                    .map(|k| f64::from(k) / f64::from(count))
                    .map(|part| (from + part * (to - from), low + part * (high - low))),
            );
        }
        let (times, factors): (Vec<f64>, Vec<f64>) = places.into_iter().unzip();
        let mut state = State::new(bonds.sites());
        let mut system = System::new(bonds, solid, &loads, &factors);
        system.times = times.into();
        let method = Lbfgs { tolerance: 1e-8, ..Default::default() };
        method.solve(&mut system, &mut state, &mut |_, _| Ok(()), &mut |_, _| Ok(())).unwrap();
        let last = state.history.last().unwrap();
        (last.work - last.stored - last.dissipated) / last.work
    };
    let [coarse, fine] = [gap([20, 20]), gap([40, 40])];
    eprintln!("gaps {coarse:.3e}, {fine:.3e}");
    at_most("viscous_ledger_gap", fine.abs(), 2e-3);
    near("viscous_ledger_order", (coarse / fine).log2(), 2.0, 1.2);
}
