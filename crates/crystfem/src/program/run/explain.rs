//! What a part's scene builds and leaves out, and how it will be solved.

use super::Failure;
use crate::boundary::{Condition, FaceSelection};
use crate::program::observe::observers;
use crate::program::scene::{PartScene, millimetres};
use crate::simulation::Simulation;
use harness::report::Named;
use harness::scene::Source;

/// The lines of one scene, that is checked, and what it reports.
///
/// # Errors
/// A fault of the scene.
pub fn one(source: &Source, scene: &PartScene) -> Result<(Vec<String>, Vec<Named>), Failure> {
    let built = scene.mesh.build(source)?;
    let (points, elements) = (built.mesh.points.len(), built.mesh.element_count());
    let [low, high] = built.mesh.bounds().unwrap_or_default().map(millimetres);
    let mut lines = vec![
        format!("builds     {points} nodes, {elements} elements, {:.4e} m³", built.volume),
        format!("builds     a mesh that reaches from {low} to {high}"),
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
            "builds     {births} births, {} elements in all; elements not printed yet have no equations",
            task.printed.len()
        ));
    }
    let names = problem.field_names();
    if !names.is_empty() {
        lines.push(format!("builds     states: {}", names.join(", ")));
    }
    for (condition, number) in problem.conditions.iter().zip(1..) {
        lines.push(format!("builds     condition {number}: {}", told(condition)));
    }
    if let Some(mechanics) = &task.mechanics {
        let [bearing, shapes] = mechanics.counts;
        lines.push(format!(
            "builds     stress of {bearing} elements of {shapes} shapes, {} nodes on the bed{}; about 45 products of its matrix for each element whenever the free strain \
             changes by {:e}",
            mechanics.settings.bed.len(),
            if mechanics.settings.release { ", released at the end" } else { "" },
            mechanics.settings.strain_step
        ));
    }
    if task.mechanics.as_ref().is_some_and(|mechanics| mechanics.stiff) {
        // elements of second order are not printed
        let advice = if births > 0 { "hexahedra bend right" } else { "`mesh.order = 2`, or hexahedra" };
        lines.push(format!(
            "note       stress of tetrahedra of 4 nodes: they bend far too little, warpage and stress are rough; {advice}"
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
        (births > 0, "births: everything exists from the start"),
        (!names.is_empty(), "states of materials"),
        (latent || names.is_empty(), "latent heat: temperature does not depend on crystallinity"),
        (radiates, "radiation"),
        (!problem.sources.is_empty(), "heat sources"),
        (changes, "conditions that change over time"),
        (task.mechanics.is_some(), "stress and warpage"),
        (task.interfaces.is_some(), "healing of interfaces"),
        (!scene.probe.is_empty(), "probes"),
        (scene.output.fields, "fields (VTKHDF)"),
        (scene.output.pictures, "pictures and the animation"),
    ] {
        if !needed {
            lines.push(format!("leaves out {what}"));
        }
    }
    // at the start there may be nothing yet
    let when = if births > 0 { "solver     when all is printed: " } else { "solver     " };
    problem.births.clear();
    let simulation = Simulation::new(problem, task.settings)?;
    lines.extend(simulation.explain(task.end).into_iter().map(|line| format!("{when}{line}")));
    scene.refuse_too_large(source, &simulation, task.mechanics.as_ref(), task.end)?;
    lines.push(format!("ends at    {} s", task.end));
    let needed = scene.memory(&simulation, task.mechanics.as_ref(), task.end);
    lines.push(format!("needs      {}", polycore::memory::needs(needed)));
    // those of layers and births are many
    let few = quantities.iter().filter(|q| !q.name.starts_with("layer-") && !q.name.contains("_at_birth_"));
    lines.push(format!("reports    {}", Named::list(few)));
    Ok((lines, quantities))
}

/// A condition in words.
fn told(condition: &Condition) -> String {
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
        kinks => format!("{what}, over {kinks} given times, at which steps end"),
    }
}
