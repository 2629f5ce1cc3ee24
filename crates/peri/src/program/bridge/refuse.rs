//! Refuses scenes that tables of bond forces cannot represent.

use crate::program::scene::{Scene, SceneVariant, SolverMethod, SurfaceCorrection};
use crate::solver::Policy;
use harness::scene::{SceneError, Source};

/// Refuses a scene that is not a lattice with one bond law under prescribed displacements.
///
/// # Errors
/// A [`SceneError`] that names the key, the value found and what is allowed.
pub(super) fn refuse(source: &Source, scene: &Scene, variant: &SceneVariant) -> Result<(), SceneError> {
    let material = &scene.material;
    let energy = variant.surface == SurfaceCorrection::Energy;
    let reasons = [
        (
            scene.body.has_points(),
            if scene.body.points.is_some() { "body.points" } else { "body.grid" },
            "a cloud, whose bonds have as many lengths as pairs",
            "`shapes` on a lattice: LAMMPS has a table for each bond length",
        ),
        (
            material.solid.is_some(),
            "material.solid",
            "a solid whose bond forces depend on whole families",
            "a bond law: a table knows the length of its bond only",
        ),
        (
            energy,
            "material.surface_correction",
            "`energy`, a weight of its own for each pair",
            "`none`: LAMMPS has a table for each bond length",
        ),
        (
            scene.softens(),
            "material.critical.convention",
            "`softening`, bonds that soften before they break",
            "`tearing` or `bonds`: the tables end where bonds break at once",
        ),
        (
            !material.inclusions.is_empty(),
            "material.inclusions",
            "inclusions, which give pairs weights of their own",
            "none: LAMMPS has a table for each bond length",
        ),
        (
            !material.fields.is_empty(),
            "material.fields",
            "parameters that follow fields, different for each pair",
            "none: LAMMPS has a table for each bond length",
        ),
        (
            !material.unbreakable.is_empty(),
            "material.unbreakable",
            "particles whose bonds never break",
            "none: the tables end where bonds break at once",
        ),
        (
            !scene.interface.is_empty(),
            "interface",
            "interfaces, whose bonds have limits of their own",
            "none: LAMMPS has a table for each bond length",
        ),
        (!scene.step.is_empty(), "step", "steps in sequence", "one step: the driver knows the first alone"),
        (
            !scene.body_force.is_empty(),
            "body_force",
            "a body force",
            "prescribed displacements: the driver moves clamps",
        ),
        (scene.periodic.is_some(), "periodic", "periodic sides", "none: the driver's box ends with the body"),
        (scene.contact.is_some(), "contact", "contact", "none: the tables act between bonded particles only"),
        (
            scene.dynamics.is_some() || scene.method() == SolverMethod::Verlet,
            if scene.dynamics.is_some() { "dynamics" } else { "solver.method" },
            "explicit dynamics",
            "a quasi-static scene: the driver minimises the energy",
        ),
        (
            scene.solver.breaking == Policy::EachIteration,
            "solver.breaking",
            "`each-iteration`",
            "`at-equilibrium`: the iterations of LAMMPS are not ours",
        ),
        (
            scene.solver.refine > 1,
            "solver.refine",
            "load steps that are cut where bonds break",
            "1: the driver takes the steps that are prescribed",
        ),
    ];
    if let Some((_, key, found, allowed)) = reasons.into_iter().find(|(refused, ..)| *refused) {
        return Err(source.error(key, found, allowed));
    }
    for (index, boundary) in scene.boundary.iter().enumerate() {
        let loads = [
            ("traction", boundary.traction.is_some(), "a traction"),
            ("traction_field", boundary.traction_field.is_some(), "a traction by formulas"),
            ("pressure", boundary.pressure.is_some(), "a pressure"),
            ("force", boundary.force.is_some(), "a force"),
            ("rotation", boundary.rotation.is_some(), "a rotation"),
            ("rigid", boundary.rigid, "a region that moves as a whole"),
            ("curve", boundary.has_curve(), "a curve of time"),
            ("displacement_field", boundary.displacement_field.is_some(), "a field of displacements"),
        ];
        if let Some((name, _, found)) = loads.into_iter().find(|(_, given, _)| *given) {
            let key = format!("boundary[{index}].{name}");
            let allowed = "`displacement`: the driver moves clamps, each as a whole";
            return Err(source.error(&key, found, allowed));
        }
    }
    Ok(())
}
