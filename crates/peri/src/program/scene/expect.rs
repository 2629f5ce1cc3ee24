//! What a scene's expectations may ask for: the names of the scalars that its report can have.

use super::variant::variants;
use super::{ExactSpec, Scene};
use crate::calibrate::Space;
use crate::program::quantities as q;
use harness::report::{Named, Quantity};
use harness::scene::{SceneError, Source};

/// Scalars that a run of a scene without studies can give; some only where something happens (`first_break`).
pub fn quantities(scene: &Scene) -> Vec<Named> {
    let mut all: Vec<Named> = Vec::new();
    let mut add =
        |given: bool, more: &[Quantity]| all.extend(more.iter().filter(|_| given).map(|&q| Named::from(q)));
    add(true, &[q::SMALLEST_STRETCH, q::LARGEST_STRETCH, q::LARGEST_DISPLACEMENT]);
    add(true, &[q::SMALLEST_STRETCH_MET, q::LARGEST_STRETCH_MET]);
    add(scene.material.solid.is_none() && !scene.material.is_prestrained(), &[q::FIT_ERROR]);
    add(true, &[q::WORK_OF_LOADS, q::STORED_ENERGY, q::DAMPED_ENERGY, q::LARGEST_RESIDUAL]);
    let records = scene.dynamics.as_ref().map_or(scene.solver.steps, |dynamics| dynamics.method().records);
    add(records > 1, &[q::PEAK_LOAD, q::DISPLACEMENT_AT_PEAK]);
    add(scene.dynamics.is_none(), &q::BALANCES);
    let critical = scene.material.critical.is_some();
    add(
        critical,
        &[q::FRAGMENTS, q::LARGEST_FRAGMENT, q::FIRST_BREAK, q::LOAD_AT_FIRST_BREAK, q::BROKEN_BONDS],
    );
    add(scene.is_learnt(), &[q::OUTSIDE_SHARE, q::FLAGGED_SHARE, q::FIRST_STEP_OUTSIDE]);
    let energy = scene.material.solid.is_some()
        && scene.material.critical.is_some_and(|critical| critical.fracture_energy.is_some());
    add(critical, &[if energy { q::CRITICAL_ENERGY } else { q::CRITICAL_STRETCH }]);
    let tearing = scene.material.solid.is_none() || energy;
    add(critical && tearing, &[q::TEARING_ENERGY, q::DISSIPATION_BIAS]);
    add(critical, &[q::NEW_CRACK_AREA, q::DISSIPATED_PER_AREA]);
    add(critical && scene.dynamics.is_none(), &[q::BREAKING_EVENTS, q::LOAD_OF_FIRST_EVENT]);
    add(critical, &[q::DETACHED_PARTICLES, q::LAST_LOAD, q::LAST_DISPLACEMENT, q::RELEASED_ENERGY]);
    add(
        scene.contact.is_some(),
        &[q::CONTACT_ENERGY, q::CONTACTS, q::DEEPEST_OVERLAP, q::CONTACT_SHARE, q::CONTACT_STIFFNESS],
    );
    let rubs = scene.contact.as_ref().is_some_and(super::ContactSpec::rubs);
    add(rubs, &[q::FRICTION_WORK]);
    let motion = [q::CRITICAL_TIME_STEP, q::TIME_STEP, q::KINETIC_ENERGY, q::ENERGY_ERROR];
    add(scene.dynamics.is_some(), &motion);
    add(scene.is_mixed(), &[q::MIXED_ERROR]);
    let axes = if scene.body.space == Space::Solid { &["x", "y", "z"][..] } else { &["x", "y"] };
    let mut along = |given: bool, quantity: Quantity| {
        all.extend(axes.iter().filter(|_| given).map(|axis| quantity.of(&[axis])));
    };
    along(scene.boundary.iter().any(|b| b.holds()), q::REACTION);
    along(scene.boundary.iter().any(|b| b.traction.is_some() || b.force.is_some()), q::APPLIED);
    for field in &scene.material.fields {
        all.extend(q::OF_A_FIELD.iter().map(|quantity| quantity.of(&[field.of.value_name()])));
    }
    all.extend(scene.probe.iter().flat_map(super::Probe::values));
    all.extend(super::line::values(scene));
    all.extend(super::contact::values(scene));
    all.extend(scene.output.load_at.iter().map(|at| q::load_at(at.si())));
    if let (Some(exact), Some(stress)) = (&scene.exact, &scene.stress) {
        all.push(q::KIRSCH_FIRST.into());
        if matches!(exact, ExactSpec::PlateWithHole { .. }) {
            all.extend([q::EXACT_FIRST, q::EXACT_PEAK].map(Named::from));
        }
        for name in stress.measures.iter().map(|measure| measure.name()) {
            let kinds = [q::MEASURE_FIRST, q::MEASURE_PEAK, q::MEASURE_PEAK_ERROR, q::MEASURE_MAX];
            all.extend(kinds.map(|quantity| quantity.of(&[name])));
            all.extend(exact.errors().iter().map(|error| q::MEASURE_ERROR.of(&[name, error])));
        }
    }
    all
}

/// Scalars that the report of a scene can have, with its variants.
///
/// # Errors
/// As [`super::check`].
pub fn quantities_of(source: &Source, scene: &Scene) -> Result<Vec<String>, SceneError> {
    let variants = variants(source, scene, false)?;
    let mut names = Vec::new();
    let mut families: Vec<(String, usize)> = Vec::new();
    for variant in &variants {
        let fails = variant.of.expect_error.is_some().then(|| Named::from(q::FAILED_AS_EXPECTED));
        let own = quantities(&variant.scene).into_iter().chain(fails).map(|quantity| quantity.name);
        match variants.len() {
            1 => names.extend(own),
            _ => {
                for name in own {
                    let compared = scene.output.compare.as_ref().filter(|c| c.quantity == name).is_some();
                    names.extend(compared.then(|| q::COMPARED.of(&[&name, &variant.name()]).name));
                    names.extend(compared.then(|| q::SAME_EVENTS.of(&[&variant.name()]).name));
                    names
                        .extend(q::BALANCES.iter().any(|balance| balance.name == name).then(|| name.clone()));
                    names.push(super::NAMING.value(&variant.of.name, &name));
                }
            }
        }
        match families.iter_mut().find(|(family, _)| *family == variant.family()) {
            Some((_, count)) => *count += 1,
            None => families.push((variant.family(), 1)),
        }
    }
    for (family, _) in families.iter().filter(|(_, count)| *count > 1) {
        names.push(q::PEAK_LOAD_CHANGE.of(&[family]).name);
        for measure in scene.stress.iter().flat_map(|stress| &stress.measures) {
            let kinds = scene.exact.iter().flat_map(|exact| exact.errors());
            names.extend(kinds.map(|kind| q::MEASURE_ORDER.of(&[measure.name(), kind, family]).name));
        }
    }
    names.extend(scene.comparisons().names().map(|quantity| quantity.name));
    if scene.output.integrals {
        names.extend(q::INTEGRALS.iter().map(|quantity| quantity.name.to_owned()));
    }
    names.extend(scene.exact.as_ref().map(|_| q::KT_FINITE_WIDTH.name.to_owned()));
    Ok(names)
}

/// Refuses an expectation that no run of the scene could meet.
///
/// # Errors
/// The name, and those that are most like it.
pub(super) fn check(source: &Source, scene: &Scene) -> Result<(), SceneError> {
    if scene.expect.is_empty() {
        return Ok(());
    }
    let names = quantities_of(source, scene)?;
    let known: Vec<&str> = names.iter().map(String::as_str).collect();
    harness::case::check_quantities(source, &scene.expect, &known, |_| false)
}
