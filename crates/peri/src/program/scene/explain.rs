//! Lists what a scene builds and what it leaves out, for `peri check`.

use super::values::plain;
use super::variant::SceneVariant;
use super::{Boundary, DiscreteBody, Scene, SolverMethod, SurfaceCorrection};
use crate::bonds::{Property, VolumeCorrection};
use crate::material::SolidPoint;
use crate::solver::{Bilinear, Criterion};
use harness::report::Named;
use harness::scene::{SceneError, Source};

/// Returns the lines of `peri check` for a variant.
pub fn explain<const D: usize>(
    source: &Source,
    scene: &Scene,
    variant: &SceneVariant,
    body: &DiscreteBody<D>,
    criterion: Option<&Criterion>,
    reports: &[Named],
) -> Result<Vec<String>, SceneError> {
    let bonds = &*body.bonds;
    let particles = bonds.particles().len();
    let directed = bonds.directed_bonds();
    let mut lines = vec![format!("variant {}", variant.name())];
    let mut builds = |text: String| lines.push(format!("  builds     {text}"));
    builds(format!(
        "{particles} particles, {directed} directed bonds ({:.1} each)",
        directed as f64 / particles.max(1) as f64
    ));
    match bonds.as_lattice() {
        Some(lattice) => builds(format!(
            "a lattice: one stencil of {} bonds, a bit mask per particle",
            lattice.stencil().offsets.len()
        )),
        None => builds("a neighbour list: the points form no lattice".to_owned()),
    }
    builds(format!(
        "bonds {:.1} MB, solver fields {:.1} MB",
        bonds.bytes() as f64 / 1e6,
        (bonds.sites() * (3 * D + 1) * 8) as f64 / 1e6
    ));
    if let Some(solid) = &scene.material.solid {
        let states = (bonds.sites() * size_of::<SolidPoint<D>>()) as f64 / 1e6;
        builds(format!("a solid, `{}`: states of particles {states:.1} MB", solid.law.name()));
        super::part_solid::explain(scene).into_iter().for_each(&mut builds);
        for own in scene.solids().map(|(_, own)| own).filter(|own| own.has_state()) {
            let (remembered, branches) = (own.memory_of_a_particle(), own.branch.len());
            let megabytes = (8 * remembered * bonds.particles().len()) as f64 / 1e6;
            builds(format!("{branches} branches: {remembered} numbers a particle, {megabytes:.1} MB"));
        }
    }
    super::part_law::explain(scene, bonds).into_iter().for_each(&mut builds);
    super::explain_network(source, &scene.material)?.into_iter().for_each(&mut builds);
    for (crack, severed) in scene.body.cracks.iter().zip(&body.severed) {
        let corners: Vec<String> = [Some(&crack.from), Some(&crack.to), crack.and.as_ref()]
            .into_iter()
            .flatten()
            .map(|point| point.iter().map(|x| plain(rounded(x.si() * 1e3))).collect::<Vec<_>>().join(", "))
            .collect();
        builds(format!("a crack, ({}) mm: {severed} bonds broken", corners.join(") – (")));
    }
    super::mesh_shape::explain(scene, body).into_iter().for_each(&mut builds);
    super::interface::explain(scene, body, criterion).into_iter().for_each(&mut builds);
    lines.extend(super::parts::explain(body));
    lines.extend(super::loads::explain(source, scene, body)?);
    lines.push(format!("  needs      {}", polycore::memory::needs(super::memory_needed(scene, bonds))));
    let mut builds = |text: String| lines.push(format!("  builds     {text}"));
    if let Some(criterion) = criterion {
        let limit = match criterion {
            Criterion::Stretch(stretch) => format!("at a stretch of {:.6}", stretch.least()),
            Criterion::Energy(limit) => format!("when they release more than {:.4e} J/m³", limit.least()),
            Criterion::Softening { onset, limit } => {
                let law = Bilinear { onset: onset.least(), limit: limit.least() };
                let ductility = match [onset, limit].map(Property::uniform) {
                    [Some(_), Some(_)] => format!("e_f = {:.3}", law.ductility()),
                    _ => "the least of all".to_owned(),
                };
                format!(
                    "when they have taken {:.4e} J/m³, and soften from {:.4e} J/m³ on ({ductility})",
                    law.limit, law.onset
                )
            }
        };
        builds(format!("bonds that break {limit}; damage of each particle"));
    }
    if scene.method() == SolverMethod::Lbfgs {
        builds("L-BFGS: ten pairs of steps and gradient changes, a factored coarse level".to_owned());
    }
    if scene.solver.refine > 1 {
        builds(format!(
            "load steps that are bisected where bonds would break, down to 1/{} of a step",
            scene.solver.refine
        ));
    }
    if scene.solver.snap_back {
        builds("loads that are lowered after bonds break, until no other bond would break".to_owned());
    }
    if scene.time.is_some() {
        let (steps, times) = (scene.step_count(), scene.load_steps().1);
        builds(format!("a programme of {steps} steps in {} s", plain(times.last().copied().unwrap_or(0.0))));
    }
    if let Some(dynamics) = &scene.dynamics {
        let method = dynamics.method();
        builds(format!("explicit dynamics up to {} s, {} rows of history", method.end_time, method.records));
    }
    if !scene.step.is_empty() {
        let count = scene.step.len();
        builds(format!("{count} later steps, each from the state at the end of the one before"));
    }
    if let Some(contact) = &scene.contact {
        builds(if contact.has_pairs() {
            let stiffness = match contact.short_range {
                Some(kappa) => format!("κ = {kappa}"),
                None => format!("s = {}", contact.pair_stiffness()),
            };
            format!("contact of stiffness {stiffness}: a list of close particles without a bond")
        } else {
            "a search for overlaps in each step, no repulsion".to_owned()
        });
        if !contact.plane.is_empty() {
            builds(format!("{} rigid planes, faces of the body", contact.plane.len()));
        }
        if !contact.indenter.is_empty() {
            builds(format!("{} indenters, faces of the body", contact.indenter.len()));
        }
        if contact.has_friction() {
            builds("friction: a pass over contacts in each step".to_owned());
        }
    }
    if let Some(stress) = &scene.stress {
        let names: Vec<&str> = stress.measures.iter().map(|m| m.name()).collect();
        let when = if scene.output.every.is_some() { "in each written step" } else { "once per variant" };
        builds(format!("stress {when}: {}", names.join(", ")));
    }
    let left_out: Vec<&str> = [
        (bonds.as_lattice().is_none(), "neighbour lists"),
        (variant.surface == SurfaceCorrection::Energy, "surface correction"),
        (variant.volume == VolumeCorrection::Linear, "volume correction"),
        (scene.stress.is_some(), "stress"),
        (scene.has_dynamics(), "inertia"),
        (
            !scene.body.cracks.is_empty() || scene.step.iter().any(|step| !step.cracks.is_empty()),
            "pre-cut cracks",
        ),
        (scene.contact.is_some(), "contact (needs [contact])"),
        (
            criterion.is_some(),
            "damage and bond breaking (needs `material.critical` or that of an [[interface]])",
        ),
        (scene.output.every.is_some(), "fields of earlier steps (need `output.every`)"),
        (scene.boundary.iter().any(Boundary::prescribes_displacement), "prescribed displacements"),
        (scene.has_forces(), "body forces"),
        (scene.output.fields, "VTKHDF fields"),
        (scene.output.pictures, "pictures"),
    ]
    .into_iter()
    .filter_map(|(is_built, name)| (!is_built).then_some(name))
    .collect();
    lines.extend(wrapped_list("leaves out", &left_out));
    let names: Vec<String> = reports.iter().map(|named| Named::list([named])).collect();
    let mut names: Vec<&str> = names.iter().map(String::as_str).collect();
    let more = format!("and {} more in report.json", names.len().saturating_sub(LISTED_REPORTS));
    if names.len() > LISTED_REPORTS {
        names.truncate(LISTED_REPORTS);
        names.push(&more);
    }
    lines.extend(wrapped_list("reports", &names));
    lines.extend(super::warnings(source, scene, body).into_iter().map(|text| format!("  warning    {text}")));
    Ok(lines)
}

/// Names of scalars that `check` lists.
const LISTED_REPORTS: usize = 40;

/// Characters of a line of `check` that lists names.
const LINE_WIDTH: usize = 100;

/// Returns names separated by commas, in lines of up to [`LINE_WIDTH`] characters; the label stands before
/// the first.
fn wrapped_list(label: &str, names: &[&str]) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for (index, name) in names.iter().enumerate() {
        let comma = if index + 1 < names.len() { "," } else { "" };
        match lines.last_mut() {
            Some(line) if line.chars().count() + name.chars().count() + 2 <= LINE_WIDTH => {
                *line += &format!(" {name}{comma}");
            }
            _ => {
                let label = if index == 0 { label } else { "" };
                lines.push(format!("  {label:<10} {name}{comma}"));
            }
        }
    }
    lines
}

/// Rounds off the digits that a change of units leaves behind.
fn rounded(value: f64) -> f64 {
    (value * 1e9).round() / 1e9
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_wrapped() {
        let names = ["a".repeat(50), "b".repeat(34), "c".repeat(90)];
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let lines = wrapped_list("reports", &names);
        assert_eq!(lines.len(), 2, "{lines:?}");
        assert_eq!(lines[0], format!("  reports    {}, {},", names[0], names[1]));
        assert_eq!(lines[0].len(), LINE_WIDTH);
        assert_eq!(lines[1], format!("             {}", names[2]));
        assert!(wrapped_list("reports", &[]).is_empty());
    }
}
