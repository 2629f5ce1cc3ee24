//! What a scene will build, and what it leaves out.

use super::values::plain;
use super::variant::Variant;
use super::{Body, Method, Scene, SurfaceCorrection};
use crate::bonds::VolumeCorrection;
use crate::material::SolidPoint;
use crate::solver::Criterion;
use harness::report::Named;
use harness::scene::{SceneError, Source};

/// Lines for `peri check`.
pub fn explain<const D: usize>(
    source: &Source,
    scene: &Scene,
    variant: &Variant,
    body: &Body<D>,
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
    }
    for (crack, severed) in scene.body.cracks.iter().zip(&body.severed) {
        let corners: Vec<String> = [Some(&crack.from), Some(&crack.to), crack.and.as_ref()]
            .into_iter()
            .flatten()
            .map(|point| point.iter().map(|x| plain(rounded(x.si() * 1e3))).collect::<Vec<_>>().join(", "))
            .collect();
        builds(format!("a crack, ({}) mm: {severed} bonds broken", corners.join(") – (")));
    }
    lines.extend(super::parts::explain(body));
    lines.extend(super::loads::explain(source, scene, body)?);
    lines.push(format!("  needs      {}", polycore::memory::needs(super::memory_needed(scene, bonds))));
    let mut builds = |text: String| lines.push(format!("  builds     {text}"));
    if let Some(criterion) = criterion {
        let limit = match criterion {
            Criterion::Stretch(stretch) => format!("at a stretch of {:.6}", stretch.least()),
            Criterion::Energy(limit) => format!("where that releases more than {limit:.4e} J/m³"),
            Criterion::Softening(law) => format!(
                "where that has taken {:.4e} J/m³ and soften from {:.4e} J/m³ on (e_f = {:.3})",
                law.limit,
                law.onset,
                law.ductility()
            ),
        };
        builds(format!("bonds that break {limit}, damage, a count of each particle's bonds"));
    }
    if scene.method() == Method::Lbfgs {
        builds("ten pairs of steps and gradient changes, a coarse level with its factors".to_owned());
    }
    if scene.solver.refine > 1 {
        builds(format!(
            "load steps cut where bonds would break, down to 1/{} of a step",
            scene.solver.refine
        ));
    }
    if scene.solver.snap_back {
        builds("loads that are lowered after bonds broke, until no others would at once".to_owned());
    }
    if let Some(dynamics) = &scene.dynamics {
        let method = dynamics.method();
        builds(format!("explicit dynamics up to {} s, {} rows of history", method.end_time, method.records));
    }
    if let Some(contact) = &scene.contact {
        builds(if contact.has_pairs() {
            let stiffness = match contact.short_range {
                Some(kappa) => format!("κ = {kappa}"),
                None => format!("s = {}", contact.pair_stiffness()),
            };
            format!("contact of stiffness {stiffness}, a list of close pairs without a bond")
        } else {
            "detection of overlaps in each step, no repulsion".to_owned()
        });
        if !contact.plane.is_empty() {
            builds(format!("{} rigid planes, faces of the body", contact.plane.len()));
        }
        if contact.rubs() {
            builds("friction: its forces, a pass of its own in each step".to_owned());
        }
    }
    if let Some(stress) = &scene.stress {
        let names: Vec<&str> = stress.measures.iter().map(|m| m.name()).collect();
        let when = if scene.output.every.is_some() { "in the steps written" } else { "once per variant" };
        builds(format!("stress {when}: {}", names.join(", ")));
    }
    let mut omits = |needed: bool, text: &str| {
        if !needed {
            lines.push(format!("  leaves out {text}"));
        }
    };
    omits(bonds.as_lattice().is_none(), "neighbour lists");
    omits(variant.surface == SurfaceCorrection::Energy, "surface-correction factors");
    omits(variant.volume == VolumeCorrection::Linear, "volume correction");
    omits(scene.stress.is_some(), "the stress pass");
    omits(scene.dynamics.is_some(), "inertia");
    omits(!scene.body.cracks.is_empty(), "pre-cut cracks");
    omits(scene.contact.is_some(), "contact (no [contact] in this scene)");
    omits(criterion.is_some(), "damage and bond breaking (no `critical` in this scene)");
    omits(scene.output.every.is_some(), "fields of the steps before the last");
    let constrained = scene.boundary.iter().any(|b| b.holds());
    omits(constrained, "prescribed displacements");
    omits(scene.boundary.iter().any(|b| b.traction.is_some() || b.force.is_some()), "body forces");
    omits(scene.output.fields, "VTKHDF fields");
    omits(scene.output.pictures, "pictures");
    lines.push(format!("  reports    {}", Named::list(reports)));
    lines.extend(super::warnings(source, scene, body).into_iter().map(|text| format!("  warning    {text}")));
    Ok(lines)
}

/// Without the digits that a change of units leaves behind.
fn rounded(value: f64) -> f64 {
    (value * 1e9).round() / 1e9
}
