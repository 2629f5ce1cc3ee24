//! What a scene's expectations may ask for: the names of the scalars that its report can have.

use super::variant::variants;
use super::{ExactSpec, Scene};
use polycore::scene::{SceneError, Source};

/// Sums over the whole body that must vanish, see [`crate::solver::Balance`], over its forces; of several variants the
/// largest is a value of its own.
pub const BALANCES: [&str; 3] = ["force_imbalance", "moment_imbalance", "reaction_imbalance"];

/// What the load at a displacement is called.
pub fn load_at_name(displacement: f64) -> String {
    format!("load_at_{}mm", (displacement * 1e9).round() / 1e6)
}

/// Scalars that a run of a scene without studies can give; some only where something happens (`first_break`).
pub fn quantities(scene: &Scene) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    let mut add = |given: bool, more: &[&str]| {
        names.extend(more.iter().filter(|_| given).map(ToString::to_string));
    };
    add(true, &["smallest_stretch", "largest_stretch", "fit_error", "largest_displacement", "work_of_loads"]);
    add(true, &["stored_energy", "damped_energy", "largest_residual"]);
    let records = scene.dynamics.as_ref().map_or(scene.solver.steps, |dynamics| dynamics.method().records);
    add(records > 1, &["peak_load", "displacement_at_peak"]);
    add(scene.dynamics.is_none(), &BALANCES);
    let critical = scene.material.critical.is_some();
    add(critical, &["critical_stretch", "fragments", "first_break", "load_at_first_break", "broken_bonds"]);
    add(critical && scene.dynamics.is_none(), &["breaking_events"]);
    add(critical, &["detached_particles", "last_load", "last_displacement", "released_energy"]);
    add(scene.contact.is_some(), &["contact_energy", "contacts", "deepest_overlap"]);
    let motion = ["critical_time_step", "time_step", "kinetic_energy", "energy_error"];
    add(scene.dynamics.is_some(), &motion);
    add(scene.boundary.iter().any(|b| b.holds()), &["reaction_x", "reaction_y", "reaction_z"]);
    let forces = scene.boundary.iter().any(|b| b.traction.is_some() || b.force.is_some());
    add(forces, &["applied_x", "applied_y", "applied_z"]);
    names.extend(scene.probe.iter().flat_map(super::Probe::values));
    if scene.body.space != crate::calibrate::Space::Solid {
        names.retain(|name| !name.ends_with("_z"));
    }
    names.extend(scene.output.load_at.iter().map(|at| load_at_name(at.si())));
    if let (Some(exact), Some(stress)) = (&scene.exact, &scene.stress) {
        names.push("kirsch_first".to_owned());
        if matches!(exact, ExactSpec::PlateWithHole { .. }) {
            names.extend(["exact_first", "exact_peak"].map(str::to_owned));
        }
        for measure in &stress.measures {
            let kinds = ["first", "peak", "peak_error", "max"].iter().chain(exact.errors());
            names.extend(kinds.map(|kind| format!("{}_{kind}", measure.name())));
        }
    }
    names
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
        // what must fail may have no scene at all
        let fails = variant.study.is_some_and(|index| scene.study[index].fails.is_some());
        let own = match variant.resolve(source, scene) {
            Ok((_, own)) => quantities(&own),
            Err(_) if fails => Vec::new(),
            Err(error) => return Err(error),
        };
        let own = own.into_iter().chain(fails.then(|| "failed_as_it_must".to_owned()));
        match variants.len() {
            1 => names.extend(own),
            _ => {
                for name in own {
                    let compared = scene.output.compare.as_ref().filter(|c| c.quantity == name).is_some();
                    names.extend(compared.then(|| format!("{name}_error[{}]", variant.name())));
                    names.extend(compared.then(|| format!("same_events[{}]", variant.name())));
                    names.extend(BALANCES.contains(&name.as_str()).then(|| name.clone()));
                    names.push(format!("{name}[{}]", variant.name()));
                }
            }
        }
        match families.iter_mut().find(|(family, _)| *family == variant.family()) {
            Some((_, count)) => *count += 1,
            None => families.push((variant.family(), 1)),
        }
    }
    for (family, _) in families.iter().filter(|(_, count)| *count > 1) {
        names.push(format!("peak_load_change[{family}]"));
        for measure in scene.stress.iter().flat_map(|stress| &stress.measures) {
            let kinds = scene.exact.iter().flat_map(|exact| exact.errors());
            names.extend(kinds.map(|kind| format!("{}_{kind}_order[{family}]", measure.name())));
        }
    }
    if scene.output.integrals {
        names.extend(crate::integrals::NAMES.map(str::to_owned));
    }
    names.extend(scene.exact.as_ref().map(|_| "kt_finite_width".to_owned()));
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
    for (index, expect) in scene.expect.iter().enumerate() {
        if let Some(name) = expect.names().find(|name| !names.iter().any(|known| known == name)) {
            let allowed: Vec<&str> = names.iter().map(String::as_str).collect();
            return Err(source.unknown(&format!("expect[{index}].quantity"), name, &allowed));
        }
    }
    Ok(())
}
