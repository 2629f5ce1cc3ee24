//! Load stepping: a first guess, an equilibrium, the bonds that break in it, the next equilibrium.

use super::force_scale::{Balance, ForceScale};
use super::method::{Method, StepCallback, Watch};
use super::record::StepRecord;
use super::state::State;
use super::system::{FIRST_RESIDUAL, System};

use crate::bonds::StretchRange;
use crate::error::Error;

/// A method that finds the equilibrium of a state at the load factor of its step.
pub trait Equilibrium<const D: usize> {
    /// Moves the free components until the forces balance; leaves the force of the final displacement in
    /// [`State::force`], counts iterations in [`Counts::iteration`](super::Counts) (reset by the caller) and
    /// the others. Returns the stretches of that displacement, if it has computed them.
    ///
    /// # Errors
    /// [`Error::NotConverged`], [`Error::NotFinite`], and errors of `watch`.
    fn equilibrate(
        &mut self,
        system: &mut System<D>,
        state: &mut State<D>,
        watch: &mut Watch<D>,
    ) -> Result<Option<StretchRange>, Error>;

    /// Updates for the sites whose bonds have broken since the last equilibrium.
    fn bonds_broke(&mut self, system: &System<D>, sites: &[u32]);

    /// Required out-of-balance force over its reference.
    fn tolerance(&self) -> f64;
}

/// Settings of a method that seeks one equilibrium after another.
pub trait QuasiStatic<const D: usize> {
    /// Creates the solver.
    fn solver(&self) -> impl Equilibrium<D>;
}

impl<const D: usize, M: QuasiStatic<D>> Method<D> for M {
    /// Solves the remaining load steps of `state`, see [`load_stepping`].
    fn solve(
        &self,
        system: &mut System<D>,
        state: &mut State<D>,
        watch: &mut Watch<D>,
        finished: &mut StepCallback<D>,
    ) -> Result<(), Error> {
        load_stepping(&mut self.solver(), system, state, watch, finished)
    }
}

/// Solves the remaining load steps of `state`; `finished` receives every finished step and, with
/// [`StepControl::round`](super::StepControl) above 0, every equilibrium in which bonds have just broken.
///
/// # Errors
/// Errors of [`Equilibrium::equilibrate`] and of `finished`; [`Error::NoEquilibrium`] if nothing holds a part
/// with a force, at the start or once it is torn off: `state` is then at the last finished step;
/// [`Error::Geometry`] for prescribed displacements that press the body through itself.
pub fn load_stepping<const D: usize>(
    method: &mut dyn Equilibrium<D>,
    system: &mut System<D>,
    state: &mut State<D>,
    watch: &mut Watch<D>,
    finished: &mut StepCallback<D>,
) -> Result<(), Error> {
    if state.step == 0 && !state.control.predicted {
        system.refuse_inverted(&system.factors)?;
    }
    let stepped = step_by_step(method, system, state, watch, finished);
    if matches!(stepped, Err(Error::NoEquilibrium { .. })) {
        state.retreat();
    }
    stepped
}

fn step_by_step<const D: usize>(
    method: &mut dyn Equilibrium<D>,
    system: &mut System<D>,
    state: &mut State<D>,
    watch: &mut Watch<D>,
    finished: &mut StepCallback<D>,
) -> Result<(), Error> {
    let stiffness = system.stiffness_at_rest();
    // from the reference state: an interrupted run must make the same guess
    let predictor = system.loads.affine_predictor(&*system.bonds, stiffness);
    system.scale = ForceScale::new(&*system.bonds, &system.loads, stiffness);
    let shortest = system.shortest();
    system.restore(state)?;
    let (tolerance, forced) = (method.tolerance(), system.loads.body_force.is_some());
    system.set_forces(system.factors.get(state.step).copied().unwrap_or(1.0), &state.displacement);
    system.refuse_unsupported(state, tolerance)?;
    'steps: while state.step < system.factors.len() {
        if !state.control.predicted && system.friction().is_some() {
            state.contact.start = Some(state.displacement.clone());
            state.contact.active.clone_from(&state.contact.grips);
            let ratio = step_ratio(&system.factors, state.step);
            for grip in &mut state.contact.active {
                grip.share = 1.0;
                grip.extrapolate(ratio);
            }
            (state.contact.renewals, state.contact.loose) = (0, FIRST_RESIDUAL);
        }
        system.begin_step(state);
        if !state.control.predicted && system.cut_at_touch(state) {
            continue;
        }
        if !state.control.predicted {
            let duration = system.time_at(Some(state.step)) - system.time_at(state.step.checked_sub(1));
            system.begin_time_step(state, duration)?;
            predict(system, state, &predictor);
            state.control.predicted = true;
            // the step may leave the fitted range: its first force and mass must include it
            system.covers_stretches(state, None)?;
        }
        loop {
            loop {
                let observed = method.equilibrate(system, state, watch);
                if matches!(observed, Ok(_) | Err(Error::NotConverged { .. })) {
                    system.refuse_far(state)?;
                }
                let observed = observed?;
                if !system.covers_stretches(state, observed)? {
                    continue;
                }
                if !system.renew_friction(state, method.tolerance()) {
                    break;
                }
                state.counts.iteration = 0;
            }
            if system.cut(state, shortest) {
                continue 'steps;
            }
            work_of_loads(system, state);
            system.book_flow(state);
            if system.lower(state, shortest) {
                continue;
            }
            let sites = if system.may_break(state.stretches.balanced) {
                system.break_bonds(state)
            } else {
                Vec::new()
            };
            state.control.round += 1;
            state.counts.iteration = 0;
            if sites.is_empty() {
                break;
            }
            state.control.cuts = 0;
            method.bonds_broke(system, &sites);
            system.refuse_unsupported(state, tolerance)?;
            finished(&*system.bonds, state)?;
            let particles = system.bonds.particles();
            particles.iter().for_each(|&site| state.velocity.set(site as usize, [0.0; D]));
        }
        system.check_overlaps(state)?;
        system.refuse_lost(state)?;
        system.end_time_step(state)?;
        record(system, state);
        state.step += 1;
        state.control.predicted = false;
        state.control.round = 0;
        (state.counts.step_iterations, state.control.cuts) = (0, 0);
        system.raise(state, shortest);
        if forced {
            state.accept();
        }
        finished(&*system.bonds, state)?;
        if severed(system, state) {
            break;
        }
    }
    Ok(())
}

/// Returns the length of a load step over that of the one before, 0 in the first.
fn step_ratio(factors: &[f64], step: usize) -> f64 {
    let at = |step: Option<usize>| step.map_or(0.0, |step| factors[step]);
    let Some(last) = step.checked_sub(1) else { return 0.0 };
    let before = at(Some(last)) - at(last.checked_sub(1));
    if before == 0.0 { 0.0 } else { (factors[step] - factors[last]) / before }
}

/// Moves the body with its grips and lets it start from rest. If bonds may break, which takes many small
/// steps, extrapolates the last equilibria u, u′, u″ by 3u − 3u′ + u″ if they are equally spaced and no bond
/// broke since, by 2u − u′ if there are two; affinely otherwise. If grips rotate, moves with the nearest of
/// them.
fn predict<const D: usize>(system: &System<D>, state: &mut State<D>, predictor: &[[f64; 4]; D]) {
    let factor = system.factors[state.step];
    let at = |back: usize| {
        (state.step + 1)
            .checked_sub(back)
            .map_or(0.0, |s| s.checked_sub(1).map_or(0.0, |s| system.factors[s]))
    };
    let increment = factor - at(1);
    // contact of flanks changes the direction of displacements
    let smooth = system.repulsion().is_none();
    if state.step > 0 && system.breaking.is_some() && (smooth || system.refine > 1) {
        state.control.past.push(state.displacement.clone());
        if state.control.past.len() > 3 {
            state.control.past.remove(0);
        }
    }
    let time =
        |back: usize| system.time_at((state.step + 1).checked_sub(back).and_then(|s| s.checked_sub(1)));
    let length = |back: usize| time(back) - time(back + 1);
    let even = |back: usize| {
        (at(back) - at(back + 1) - increment).abs() <= 1e-6 * increment.abs()
            && (length(back) - length(0)).abs() <= 1e-6 * length(0)
    };
    let weights: &[f64] = match state.control.past.len() {
        _ if !smooth || system.loads.curved.is_some() => &[],
        3 if even(1) && even(2) => &[1.0, -3.0, 3.0],
        2 | 3 if even(1) => &[-1.0, 2.0],
        _ => &[],
    };
    let of_curves = system.loads.curved.as_ref().map(|_| system.loads.curved_predictor(&*system.bonds));
    let predictor = of_curves.as_ref().unwrap_or(predictor);
    let past = &state.control.past[state.control.past.len() - weights.len()..];
    let carried = system.loads.turns_between([at(1), factor]);
    if carried {
        system.loads.carry(&*system.bonds, [at(1), factor], &mut state.displacement);
    }
    let before = (!system.loads.rigid.is_empty()).then(|| state.displacement.clone());
    for &site in system.bonds.particles() {
        let site = site as usize;
        let position = system.bonds.position(site);
        let mut value = state.displacement.get(site);
        let constrained = system.loads.constrained(site);
        for d in 0..D {
            if constrained >> d & 1 == 1 {
                value[d] =
                    factor * system.loads.displacement.as_ref().map_or(0.0, |field| field.get(site)[d]);
            } else if carried {
                continue;
            } else if weights.is_empty() {
                let affine: f64 = (0..D).map(|e| predictor[d][e + 1] * position[e]).sum();
                value[d] += increment * (predictor[d][0] + affine);
            } else {
                value[d] = past.iter().zip(weights).map(|(u, weight)| weight * u.get(site)[d]).sum();
            }
        }
        state.displacement.set(site, value);
        state.velocity.set(site, [0.0; D]);
    }
    system.loads.place_turned(&*system.bonds, factor, &mut state.displacement);
    if let Some(before) = before {
        system.level_move(state, &before);
    }
}

/// Adds the work of the loads since the last equilibrium, by the trapezoidal rule.
fn work_of_loads<const D: usize>(system: &mut System<D>, state: &mut State<D>) {
    let factor = system.factors[state.step];
    if let Some(contact) = system.contact.as_mut().filter(|contact| contact.has_pushed()) {
        contact.balance(&state.displacement, None);
    }
    if let Some(contact) = system.friction() {
        state.contact.surface_friction = contact.slide(&state.displacement, &[]).2;
    }
    if system.loads.curved.is_some() {
        let before = state.step.checked_sub(1).map_or(0.0, |before| system.factors[before]);
        state.work += system.work_of_curves(state, [before, factor]);
        return;
    }
    let (pull, push) = system.conjugates(state);
    let [old_factor, old_pull, old_push] = state.control.balanced;
    state.work += 0.5 * (pull + old_pull) * (factor - old_factor);
    state.work += 0.5 * (factor + old_factor) * (push - old_push);
    state.control.balanced = [factor, pull, push];
}

fn record<const D: usize>(system: &mut System<D>, state: &mut State<D>) {
    let observed = state.stretches.balanced;
    // softening takes rounds of its own
    if state.control.round > 1 || state.history.last().map_or(0, |r| r.broken) != state.fracture.broken {
        state.control.past.clear();
    }
    // rigid surfaces act at the final displacement
    if let Some(contact) = system.contact.as_mut().filter(|contact| contact.repels()) {
        contact.update(&*system.bonds, &state.displacement);
    }
    if let Some(contact) = system.friction() {
        let (grips, dissipated, _) = contact.slide(&state.displacement, &state.contact.grips);
        state.contact.grips = grips;
        state.motion.energies.rubbed += dissipated;
    }
    let balance = Balance::new(system, state);
    let stored = system.stored_energy(state, system.fitted_part(observed));
    let row = system.row(state, state.control.balanced, observed, stored);
    let (residual, rounds) = (state.convergence.residual, state.control.round);
    let time = state.stage.time + system.time_at(Some(state.step));
    state.history.push(StepRecord { residual, rounds, balance, time, kinetic: 0.0, damped: 0.0, ..row });
}

/// Returns true if the load has fallen below the fraction of its largest value in this step of a programme
/// at which the step stops.
fn severed<const D: usize>(system: &System<D>, state: &State<D>) -> bool {
    let largest = state.history[state.stage.rows..].iter().map(|r| r.load.abs()).fold(0.0, f64::max);
    let last = state.history.last().map_or(0.0, |r| r.load.abs());
    system.stop_below > 0.0 && state.fracture.broken > 0 && last < system.stop_below * largest
}
