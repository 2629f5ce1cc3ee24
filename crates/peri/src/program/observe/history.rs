//! Scalars of the history: peak load, first break, energies, balances.

use super::moment::Moment;
use crate::probe::{driven_loop_energy, load_at, loop_energy, stiffness_at};
use crate::program::quantities as q;
use crate::program::scene::{Scene, plain};
use crate::solver::{Balance, StepRecord};
use harness::observe::Scalars;
use harness::report::Quantity;

/// Returns true for a history in time.
pub fn has_times(history: &[StepRecord]) -> bool {
    history.iter().any(|row| row.time > 0.0)
}

/// Returns the damped energy, J; in equilibria work less stored, released, dissipated and
/// friction energy.
pub fn damped_energy(row: &StepRecord, dynamic: bool) -> f64 {
    if dynamic || row.kinetic > 0.0 {
        row.damped
    } else {
        row.work - row.stored - row.released - row.rubbed - row.dissipated
    }
}

/// Returns secant and tangent stiffness at a displacement, N/m.
fn stiffness(history: &[StepRecord], displacement: f64) -> Option<[f64; 2]> {
    let rows = history.iter().map(|row| ([row.displacement, row.load], row.broken));
    stiffness_at(rows, displacement)
}

/// Returns true for loads in proportion to their factors, and displacements that are not.
fn is_driven_by_force(history: &[StepRecord]) -> bool {
    let follows = |get: fn(&StepRecord) -> f64| {
        let most = history.iter().max_by(|a, b| a.factor.abs().total_cmp(&b.factor.abs()));
        most.filter(|row| row.factor != 0.0).is_some_and(|row| {
            let unit = get(row) / row.factor;
            history.iter().all(|row| (get(row) - unit * row.factor).abs() <= 1e-9 * (unit * row.factor).abs())
        })
    };
    follows(|row| row.load) && !follows(|row| row.displacement)
}

/// Adds peak, first break, energies and balances.
pub(super) fn scalars<const D: usize>(scene: &Scene, to: &mut Scalars<Moment<D>>) {
    let dynamic = scene.dynamics.is_some();
    let breaks = scene.breaks();
    let records = scene.dynamics.as_ref().map_or(scene.step_count(), |dynamics| dynamics.method().records);
    let peak = |get: fn(&StepRecord) -> f64| {
        move |m: &Moment<D>| {
            let peak = StepRecord::peak(&m.state.history).filter(|_| m.state.history.len() > 1)?;
            Some(get(&m.state.history[peak]))
        }
    };
    if records > 1 || scene.solver.refine > 1 {
        to.add_if(q::PEAK_LOAD, peak(|row| row.load));
        to.add_if(q::DISPLACEMENT_AT_PEAK, peak(|row| row.displacement));
    }
    for at in scene.output.load_at.iter().map(|at| at.si()) {
        let path =
            |m: &Moment<D>| load_at(m.state.history.iter().map(|row| [row.displacement, row.load]), at);
        to.add_if(q::load_at(at), path);
    }
    for at in scene.output.stiffness_at.iter().map(|at| at.si()) {
        let both = move |m: &Moment<D>| stiffness(&m.state.history, at);
        let [secant, tangent] = q::stiffness_at(at);
        to.add_if(secant, move |m| Some(both(m)?[0]));
        to.add_if(tangent, move |m| Some(both(m)?[1]));
    }
    if scene.returns() || scene.has_curves() && !dynamic && !scene.has_several_motions() {
        to.add_if(q::LOOP_ENERGY, |m| {
            let rows = m.state.history.iter().map(|row| [row.displacement, row.load]);
            if is_driven_by_force(&m.state.history) { driven_loop_energy(rows) } else { loop_energy(rows) }
        });
    }
    if breaks {
        breaking_scalars(dynamic, to);
        if dynamic || scene.time.is_some() {
            to.add_if(q::FIRST_BREAK_TIME, |m| Some(m.state.history.iter().find(|row| row.broken > 0)?.time));
        }
        if scene.time.is_some() {
            add_last(to, q::LAST_TIME, |row| row.time);
        }
    }
    add_last(to, q::WORK_OF_LOADS, |row| row.work);
    add_last(to, q::STORED_ENERGY, |row| row.stored);
    if breaks {
        add_last(to, q::RELEASED_ENERGY, |row| row.released);
    }
    if scene.remembers() {
        add_last(to, q::DISSIPATED_ENERGY, |row| row.dissipated);
    }
    add_last(
        to,
        q::DAMPED_ENERGY,
        if dynamic { |row| damped_energy(row, true) } else { |row| damped_energy(row, false) },
    );
    if dynamic {
        // largest error of the energy balance over the largest work or kinetic energy
        to.add_if(q::ENERGY_ERROR, |m| {
            m.state.history.last()?;
            let off = |r: &StepRecord| {
                (r.work - r.stored - r.released - r.damped - r.rubbed - r.kinetic - r.dissipated).abs()
            };
            let most = m.each(|r| r.work.abs().max(r.kinetic)).fold(f64::MIN_POSITIVE, f64::max);
            Some(m.state.history.iter().map(off).fold(0.0, f64::max) / most)
        });
    } else {
        let balances: [fn(&Balance) -> f64; 3] =
            [|b| b.force, |b| b.moment / b.arm.max(f64::MIN_POSITIVE), |b| b.external];
        for (quantity, get) in q::BALANCES.into_iter().zip(balances) {
            to.add_if(quantity, move |m| {
                m.state.history.last()?;
                let most = |get: fn(&Balance) -> f64| {
                    m.state.history.iter().map(|row| get(&row.balance)).fold(0.0, f64::max)
                };
                Some(most(get) / most(|b| b.size).max(f64::MIN_POSITIVE))
            });
        }
    }
    to.add_if(q::LARGEST_RESIDUAL, |m| {
        m.state.history.last()?;
        Some(m.each(|row| row.residual).fold(0.0, f64::max))
    });
}

/// Largest share of the dissipated energy by which stored and dissipated energy may miss the work.
const LARGEST_MISS: f64 = 0.1;

/// Part of the greatest work by which the stored energy of equilibria may exceed the work of the loads: a
/// third in the first step where the load grows as the root of the displacement.
const LARGEST_EXCESS: f64 = 0.5;

/// Largest stretch less 1 up to which a body moves as a whole.
const DEFORMED: f64 = 1e-4;

/// Returns the first row of equilibria whose stored energy exceeds the work of the loads, and the excess, J.
fn excess<const D: usize>(m: &Moment<D>) -> Option<(usize, f64)> {
    if m.scene.dynamics.is_some() || m.scene.material.is_prestrained() {
        return None;
    }
    let mut greatest = 0.0_f64;
    m.state.history.iter().enumerate().find_map(|(step, row)| {
        greatest = greatest.max(row.work.abs());
        let excess = row.stored - row.work;
        // a rigid motion stores what the tolerance leaves
        let is_deformed = (row.largest_stretch - 1.0).abs() > DEFORMED;
        let exceeds = row.dissipated == 0.0 && is_deformed && excess > LARGEST_EXCESS * greatest;
        exceeds.then_some((step + 1, excess))
    })
}

/// Warns of increments too long for the energies of branches, of a stiffness asked for across a fall, and of
/// energy that no load has brought.
pub(super) fn warnings<const D: usize>(m: &Moment<D>) -> Vec<String> {
    let reached = |at: &f64| m.state.history.iter().any(|row| row.displacement >= *at * (1.0 - 1e-12));
    let asked = m.scene.output.stiffness_at.iter().map(|at| at.si()).filter(reached);
    let fallen = asked.filter(|&at| stiffness(&m.state.history, at).is_none()).map(|at| {
        format!(
            "no stiffness at {} mm: bonds break in the step around it; take more `steps`, or another \
             `output.stiffness_at`",
            plain(at * 1e3)
        )
    });
    let several = (!m.scene.output.stiffness_at.is_empty() && m.scene.has_several_motions()).then(|| {
        "`output.stiffness_at`: loads follow several curves or steps, so that load and displacement of the \
         history add up several motions; take the stiffness of one from its columns `reaction_…`"
            .to_owned()
    });
    let last = m.state.history.last().filter(|row| m.scene.dynamics.is_none() && row.broken == 0);
    let off = last.filter(|row| damped_energy(row, false).abs() > LARGEST_MISS * row.dissipated);
    let warning = |row: &StepRecord| {
        format!(
            "`dissipated_energy` {:.3e} J: with the stored energy it misses the work of the loads by {:.1e} \
             J; increments are long beside a relaxation time, take more `increments`",
            row.dissipated,
            damped_energy(row, false).abs()
        )
    };
    let unbrought = excess(m).map(|(step, excess)| {
        format!(
            "step {step}: the body stores {excess:.2e} J more than the work of the loads: it was under \
             stress at the start, or has left its path for another equilibrium; look at its picture, take \
             more `steps`"
        )
    });
    let fallen = fallen.chain(unbrought);
    fallen.chain(several).chain(off.filter(|row| row.dissipated > 0.0).map(warning)).collect()
}

/// Adds first break, breaking events and the last load.
fn breaking_scalars<const D: usize>(dynamic: bool, to: &mut Scalars<Moment<D>>) {
    let first = |history: &[StepRecord]| history.iter().position(|row| row.broken > 0);
    to.add_if(q::FIRST_BREAK, |m| Some(m.state.history[first(&m.state.history)?].displacement));
    // the load at the end of the step may be past the collapse
    to.add_if(q::LOAD_AT_FIRST_BREAK, |m| {
        Some(first(&m.state.history)?.checked_sub(1).map_or(0.0, |before| m.state.history[before].load))
    });
    if !dynamic {
        to.add_if(q::LOAD_OF_FIRST_EVENT, |m| {
            first(&m.state.history)?;
            Some(m.state.fracture.events.first()?.load)
        });
    }
    add_last(to, q::BROKEN_BONDS, |row| row.broken as f64);
    if !dynamic {
        to.add_if(q::BREAKING_EVENTS, |m| {
            m.state.history.last().map(|_| m.state.fracture.events.len() as f64)
        });
    }
    add_last(to, q::DETACHED_PARTICLES, |row| row.detached as f64);
    add_last(to, q::LAST_LOAD, |row| row.load);
    add_last(to, q::LAST_DISPLACEMENT, |row| row.displacement);
}

/// Adds a number of the last row.
pub(super) fn add_last<const D: usize>(
    to: &mut Scalars<Moment<D>>,
    quantity: Quantity,
    get: fn(&StepRecord) -> f64,
) {
    to.add_if(quantity, |m| m.state.history.last().map(get));
}
