//! Description of a part scene: what it builds, what it leaves out, and how it is solved.

use crate::boundary::{Condition, FaceSelection};
use crate::error::Error;
use crate::program::observe::observers;
use crate::program::scene::{PartScene, millimetres};
use crate::simulation::Simulation;
use harness::report::Named;
use harness::scene::{Failure, Source};

/// Checks a scene and returns its description, line by line, with the scalars it reports.
///
/// # Errors
/// Returns an error for an invalid scene.
pub fn explain_scene(
    source: &Source,
    scene: &PartScene,
) -> Result<(Vec<String>, Vec<Named>), Failure<Error>> {
    let built = scene.mesh.build(source)?;
    let (points, elements) = (built.mesh.points.len(), built.mesh.element_count());
    let [low, high] = built.mesh.bounds().unwrap_or_default().map(millimetres);
    let mut lines = vec![
        format!("builds     {points} nodes, {elements} elements, {:.4e} m³", built.volume),
        format!("builds     a mesh from {low} to {high}"),
    ];
    lines.extend(built.notes.iter().map(|note| format!("note       {note}")));
    let task = scene.task(source, built)?;
    let cut = scene.cut_steps();
    lines.extend(task.notes.iter().chain(&cut).map(|note| format!("note       {note}")));
    let quantities = observers(scene, &task).names();
    let mut problem = std::sync::Arc::unwrap_or_clone(task.problem);
    let births = problem.births.len();
    if births > 0 {
        lines.push(format!(
            "builds     {births} births with {} elements in total; elements have no equations before their \
             birth",
            task.printed.len()
        ));
    }
    let names = problem.field_names();
    if !names.is_empty() {
        lines.push(format!("builds     states: {}", names.join(", ")));
    }
    for (condition, number) in problem.conditions.iter().zip(1..) {
        lines.push(format!("builds     condition {number}: {}", describe(condition)));
    }
    if let Some(mechanics) = &task.mechanics {
        let [bearing, shapes] = mechanics.counts;
        lines.push(format!(
            "builds     stress of {bearing} elements of {shapes} shapes, {} nodes on the bed{}; solved \
              whenever the free strain changes by {:e}, with about 45 matrix products per element",
            mechanics.settings.bed.len(),
            match (mechanics.settings.release, mechanics.settings.release_at) {
                (false, _) => String::new(),
                (true, None) => ", released at the end".to_owned(),
                (true, Some(time)) => format!(", released at {time} s"),
            },
            mechanics.settings.strain_step
        ));
    }
    if task.mechanics.as_ref().is_some_and(|mechanics| mechanics.stiff) {
        // second-order elements cannot be printed
        let advice = if births > 0 { "use hexahedra" } else { "use `mesh.order = 2` or hexahedra" };
        lines.push(format!(
            "note       4-node tetrahedra are far too stiff in bending: warpage and stress are rough; \
              {advice}"
        ));
    }
    if let Some(interfaces) = &task.interfaces {
        lines.push(format!(
            "builds     healing of {} interfaces, {}",
            interfaces.interfaces.len(),
            interfaces.law.explain()
        ));
    }
    let radiates = problem.conditions.iter().any(|c| matches!(c, Condition::Radiation { .. }));
    let changes = problem.conditions.iter().any(|c| !c.breaks().is_empty())
        || problem.sources.iter().any(|source| !source.power.breaks().is_empty());
    let latent = scene.materials.values().any(|material| material.latent_heat.is_some());
    for (needed, what) in [
        (births > 0, "births: all elements exist from the start"),
        (!names.is_empty(), "material states"),
        (latent || names.is_empty(), "latent heat: crystallinity does not affect the temperature"),
        (radiates, "radiation"),
        (!problem.sources.is_empty(), "heat sources"),
        (changes, "time-dependent conditions"),
        (task.mechanics.is_some(), "stress and warpage"),
        (task.interfaces.is_some(), "healing of interfaces"),
        (!scene.probe.is_empty(), "probes"),
        (scene.output.fields, "fields (VTKHDF)"),
        (scene.output.pictures, "pictures and animations"),
    ] {
        if !needed {
            lines.push(format!("leaves out {what}"));
        }
    }
    // with births, no element may exist at the start
    let when = if births > 0 { "solver     after the last birth: " } else { "solver     " };
    problem.births.clear();
    let simulation = Simulation::new(problem, task.settings)?;
    lines.extend(simulation.explain(task.end).into_iter().map(|line| format!("{when}{line}")));
    scene.refuse_too_large(source, &simulation, task.mechanics.as_ref(), task.end)?;
    lines.push(format!("ends at    {} s", task.end));
    let needed = scene.memory(&simulation, task.mechanics.as_ref(), task.end);
    lines.push(format!("needs      {}", polycore::memory::needs(needed)));
    // layers and births have too many scalars for a list
    let few = quantities.iter().filter(|q| !q.name.starts_with("layer-") && !q.name.contains("_at_birth_"));
    lines.push(format!("reports    {}", Named::list(few)));
    Ok((lines, quantities))
}

/// Describes a boundary condition.
fn describe(condition: &Condition) -> String {
    let place = match condition.surface() {
        Some(FaceSelection::Outer { except }) if except.is_empty() => "the current outer surface".to_owned(),
        Some(FaceSelection::Outer { except }) => {
            format!("the current outer surface except {} faces", except.len())
        }
        Some(FaceSelection::Faces(faces)) => format!("{} faces", faces.len()),
        None => String::new(),
    };
    let what = match condition {
        Condition::Temperature { nodes, .. } => format!("temperature of {} nodes", nodes.len()),
        Condition::Flux { .. } => format!("flux into {place}"),
        Condition::Film { .. } => format!("convection on {place}"),
        Condition::Radiation { .. } => format!("radiation of {place}"),
    };
    match condition.breaks().len() {
        0 => what,
        kinks => format!("{what}, with {kinks} given times, at which steps end"),
    }
}
