//! Checks of a scene that need no body, and the list of its variants.

use super::values::{ONE_OF_THEM, plain, positive, ratio, required};
use super::variant::{SceneVariant, variants};
use super::{
    BodyForceSpec, ContactSpec, HORIZON_RATIO, HistoryProbe, PARTICLES, Scene, SolverMethod, Track,
    VaryingParameter,
};
use crate::calibrate::{Calibration, Space};
use crate::solver::Policy;
use crate::stress::StressMethod;
use harness::scene::{SceneError, Source};

/// Largest number of history rows of a run in time.
const MOST_RECORDS: usize = 1_000_000;

/// Checks a scene and lists its variants; `quick` leaves out those that a `--quick` run leaves out.
///
/// # Errors
/// A [`SceneError`] that names the key, the value found and what is allowed.
pub fn check(source: &Source, scene: &Scene, quick: bool) -> Result<Vec<SceneVariant>, SceneError> {
    let variants = variants(source, scene, quick)?;
    for variant in &variants {
        // a variant that must fail does so when it runs
        if variant.of.expect_error.is_none() {
            let (source, scene) = variant.resolved();
            check_variant(source, scene)?;
        }
    }
    let all = super::variant::variants(source, scene, false)?;
    let names: Vec<&str> = all.iter().map(|variant| variant.of.name.as_str()).collect();
    scene.comparisons().check(source, &names)?;
    scene.output.compare.iter().try_for_each(|compare| compare.check(source, &names))?;
    Ok(variants)
}

/// Checks the scene of one variant, see [`SceneVariant::resolved`].
///
/// # Errors
/// As [`check`].
pub fn check_variant(source: &Source, scene: &Scene) -> Result<(), SceneError> {
    body(source, scene)?;
    material(source, scene)?;
    super::interface::check(source, scene)?;
    solver(source, scene)?;
    let strained = scene.periodic.as_ref().is_some_and(|periodic| periodic.gradient.is_some());
    let bonded = scene.contact.iter().flat_map(|contact| &contact.plane).any(|plane| plane.bonded);
    // in motion, rigid surfaces suffice
    let indenters = scene.contact.iter().flat_map(|contact| &contact.indenter);
    let struck = scene.has_dynamics() && indenters.count() > 0;
    if scene.boundary.is_empty() && scene.body_force.is_empty() && !strained && !bonded && !struck {
        let needed = "needed for loads and supports: at least one [[boundary]], or a `bonded` plane";
        return Err(source.missing("boundary", needed));
    }
    let named = |at: usize| scene.boundary[at].name.as_ref();
    let twice = |&at: &usize| named(at).is_some() && (0..at).any(|before| named(before) == named(at));
    if let Some(at) = (0..scene.boundary.len()).find(twice) {
        let found = format!("`{}` twice", scene.boundary[at].name.as_deref().unwrap_or_default());
        let allowed = "different names: columns of the history have them";
        return Err(source.error(&format!("boundary[{at}].name"), found, allowed));
    }
    if let Some(stress) = &scene.stress
        && stress.measures.is_empty()
    {
        return Err(source.error("stress.measures", "an empty list", "at least one measure, or no [stress]"));
    }
    if let Some(stress) = &scene.stress
        && let Some(found) = &stress.component
    {
        let most = if scene.body.space == Space::Solid { 2 } else { 1 };
        if stress.component().is_none_or(|[a, b]| a.max(b) > most) {
            let allowed = if most == 1 { "`11`, `22` or `12`" } else { "two digits of 1 to 3, e.g. `33`" };
            return Err(source.error("stress.component", format!("`{found}`"), allowed));
        }
    }
    let lattices = scene.stress.iter().flat_map(|stress| &stress.measures).position(|m| m.needs_lattice());
    if let Some(index) = lattices.filter(|_| scene.body.points.is_some()) {
        let found = "a measure of lattices in a cloud";
        let allowed = "`hardy`, `gaussian`, `spline`, `ball-share`, `one-point` or `as-published`";
        return Err(source.error(&format!("stress.measures[{index}]"), found, allowed));
    }
    if let Some(exact) = &scene.exact {
        let ((radius, remote), name) = (exact.hole(), exact.name());
        positive(source, "exact.radius", radius, "m")?;
        positive(source, "exact.remote_stress", remote, "Pa")?;
        if scene.body.space == Space::Solid {
            let why = format!("`{name}` is the solution of a plane body");
            return Err(source.conflict("exact.problem", "space = \"solid\"", why));
        }
        if scene.stress.is_none() {
            let allowed = "a [stress] block with the measures to compare";
            return Err(source.error("exact", format!("{name} without [stress]"), allowed));
        }
    }
    dynamics(source, scene)?;
    super::device::check(source, scene)?;
    super::step::check(source, scene)?;
    super::body_force::check(source, scene)?;
    super::curve::check(source, scene)?;
    super::time::check(source, scene)?;
    super::contact::check(source, scene)?;
    super::probe::check(source, scene)?;
    super::line::check(source, scene)?;
    super::periodic::check(source, scene)?;
    output(source, scene)
}

fn dynamics(source: &Source, scene: &Scene) -> Result<(), SceneError> {
    let explicit = scene.method() == SolverMethod::Verlet;
    match &scene.dynamics {
        None if explicit => {
            let why = "needed for `method = \"verlet\"`: a block with `density` and `end_time`";
            return Err(source.missing("dynamics", why));
        }
        Some(_) if !explicit => {
            let why =
                format!("needs `solver.method = \"verlet\"`; `{}` is quasi-static", scene.method().name());
            return Err(source.unexpected("dynamics", why));
        }
        Some(dynamics) => {
            let solver = &scene.solver;
            let unused = [("path", solver.path.is_some()), ("stop_below", solver.stop_below.is_some())];
            if let Some((key, _)) = unused.iter().find(|(_, given)| *given) {
                let why = "has no effect with `method = \"verlet\"`: the time of `[dynamics]` has its own \
                           steps, its `factor` is a formula of `t`";
                return Err(source.unexpected(&format!("solver.{key}"), why));
            }
            let method = dynamics.method();
            positive(source, "dynamics.density", method.density, "kg/m³")?;
            positive(source, "dynamics.end_time", method.end_time, "s")?;
            positive(source, "dynamics.time_step", method.time_step.unwrap_or(1.0), "s")?;
            if !(1..=MOST_RECORDS).contains(&method.records) {
                return Err(source.error("dynamics.records", method.records, format!("1 to {MOST_RECORDS}")));
            }
            for (key, value, most) in [
                ("safety", method.safety, 1.0),
                ("damping", method.damping, 1e12),
                ("ramp", method.ramp, 1e12),
            ] {
                if !(0.0..=most).contains(&value) || (key == "safety" && value == 0.0) {
                    let allowed = format!("0 to {most:e}");
                    return Err(source.error(&format!("dynamics.{key}"), plain(value), allowed));
                }
            }
            let elsewhere = [
                (scene.body.has_points(), "a body of points"),
                (scene.material.solid.is_some(), "a `solid`"),
                (scene.material.is_prestrained(), "prestrained bonds"),
            ];
            if let Some((_, what)) = elsewhere.iter().find(|(has, _)| scene.is_mixed() && *has) {
                let allowed = "\"double\"; \"mixed\" is for bond laws in bodies of shapes";
                return Err(source.error("dynamics.precision", format!("\"mixed\" of {what}"), allowed));
            }
            if let Some(factor) = &dynamics.factor {
                if dynamics.ramp.is_some() {
                    return Err(source.conflict("dynamics.factor", "ramp", ONE_OF_THEM));
                }
                if let Some(found) = factor.find_variable_except("t") {
                    let found = format!("`{found}` in `{}`", factor.text());
                    return Err(source.error("dynamics.factor", found, "a formula of `t`, the time in s"));
                }
                for part in 0..=16 {
                    let time = method.end_time * f64::from(part) / 16.0;
                    let (value, rate) = factor.value_and_rate(time);
                    if !(value.is_finite() && rate.is_finite()) {
                        let found = format!("{value}, rising at {rate} 1/s, at {time} s");
                        return Err(source.error("dynamics.factor", found, "finite values and rates"));
                    }
                }
            }
        }
        None => {}
    }
    let moving = scene.boundary.iter().position(super::Boundary::prescribes_velocity);
    match moving.filter(|_| !explicit) {
        Some(index) => {
            let key = format!("boundary[{index}].velocity");
            let why =
                format!("needs `solver.method = \"verlet\"`; `{}` is quasi-static", scene.method().name());
            Err(source.unexpected(&key, why))
        }
        None => Ok(()),
    }
}

fn output(source: &Source, scene: &Scene) -> Result<(), SceneError> {
    for (key, list) in [("load_at", &scene.output.load_at), ("stiffness_at", &scene.output.stiffness_at)] {
        for (index, at) in list.iter().enumerate() {
            positive(source, &format!("output.{key}[{index}]"), at.si(), "m")?;
        }
    }
    let begins_at_rest = scene.programme().0.first() == Some(&0.0);
    if !scene.output.stiffness_at.is_empty() && scene.material.is_prestrained() && !begins_at_rest {
        let found = "a prestrained body, whose load at displacement 0 no step has";
        let allowed =
            "a first step at load factor 0: `path = [0, 1]` in [solver], half of the `steps` to each";
        return Err(source.error("output.stiffness_at", found, allowed));
    }
    if scene.output.every == Some(0) {
        return Err(source.error("output.every", 0, "at least 1 step"));
    }
    if scene.output.flags && !scene.is_learnt() && scene.study.is_empty() {
        let why = "only laws of `material.solid.constitutive.learnt` have flags";
        return Err(source.unexpected("output.flags", why));
    }
    if scene.output.energy && scene.material.is_prestrained() {
        return Err(source.unexpected("output.energy", "prestrained bodies have no energy densities"));
    }
    let touches = |contact: &ContactSpec| contact.has_surfaces() || contact.has_pairs();
    if scene.output.contact && !scene.contact.as_ref().is_some_and(touches) && scene.study.is_empty() {
        let why = "needs [contact] of particles, a [[contact.plane]] or a [[contact.indenter]]";
        return Err(source.unexpected("output.contact", why));
    }
    let names = scene.contact.as_ref().map_or_else(Vec::new, ContactSpec::surface_names);
    // names of files and of the scalar `contact_pressure` of particles that touch
    let taken = names.iter().find(|name| [PARTICLES, "contact"].contains(&name.as_str()));
    if let Some(name) = taken.filter(|_| scene.output.contact) {
        let found = format!("a plane or an indenter named `{name}`");
        let allowed = "another name: particles that touch have this one";
        return Err(source.error("output.contact", found, allowed));
    }
    super::picture_state::check(source, scene)?;
    if scene.output.animation.is_some() && !(scene.output.fields && scene.output.every.is_some()) {
        let key = if scene.output.fields { "every" } else { "fields" };
        let why = "`every` and `fields = true` write the frames of an `animation`";
        return Err(if key == "every" {
            source.missing("output.every", why)
        } else {
            source.conflict("output.animation", "fields = false", why)
        });
    }
    if !(1..=12).contains(&scene.output.stages) {
        return Err(source.error("output.stages", scene.output.stages, "1 to 12"));
    }
    match &scene.output.solid {
        Some(_) if scene.body.space != Space::Solid => {
            Err(source.unexpected("output.solid", "views need `space = \"solid\"`"))
        }
        Some(solid) => solid.check(source, "output.solid"),
        None => Ok(()),
    }
}

fn body(source: &Source, scene: &Scene) -> Result<(), SceneError> {
    let body = &scene.body;
    if body.points.is_some() && body.grid.is_some() {
        return Err(source.conflict("body.grid", "points", ONE_OF_THEM));
    }
    let has_mesh = body.points.as_deref().is_some_and(meshfile::is_mesh);
    if body.unit.is_some() && !has_mesh {
        return Err(source.unexpected("body.unit", "only a mesh file in `points` has a unit here"));
    }
    let name = if body.grid.is_some() { "grid" } else { "points" };
    match (body.shapes().is_empty(), body.has_points()) {
        (true, false) => {
            return Err(
                source.missing("body.shapes", "needed for the body, as `shapes`, `points` or a `grid`")
            );
        }
        (_, true) if body.shapes.is_some() => {
            return Err(source.conflict(&format!("body.{name}"), "shapes", ONE_OF_THEM));
        }
        (false, false) => {
            let spacing =
                required(source, "body.spacing", body.spacing, "needed for a lattice of particles")?;
            positive(source, "body.spacing", spacing.si(), "m")?;
            ratio(source, "body.horizon_ratio", body.horizon_ratio.unwrap_or(HORIZON_RATIO))?;
            if body.horizon.is_some() {
                return Err(source.unexpected("body.horizon", "a lattice takes `horizon_ratio`"));
            }
        }
        (_, true) => {
            for (key, given) in [
                ("body.spacing", body.spacing.is_some()),
                ("body.horizon_ratio", body.horizon_ratio.is_some()),
            ] {
                if given {
                    let why = "`points` and `grid` have their own spacing; write `horizon`";
                    return Err(source.unexpected(key, why));
                }
            }
            if scene.material.calibration == Calibration::Lattice {
                return Err(source.error(
                    "material.calibration",
                    "lattice",
                    "`continuum`: a cloud has no lattice sums",
                ));
            }
        }
    }
    Ok(())
}

fn material(source: &Source, scene: &Scene) -> Result<(), SceneError> {
    let material = &scene.material;
    if material.solid.is_some() {
        super::solid::check(source, scene)?;
        return inclusions(source, scene);
    }
    let Some(youngs_modulus) = material.youngs_modulus else {
        let why = "needed for a bond law; a [material.network] gives it, a [material.solid] takes its place";
        return Err(source.missing("material.youngs_modulus", why));
    };
    positive(source, "material.youngs_modulus", youngs_modulus.si(), "Pa")?;
    if let Some(index) =
        scene.stress.iter().flat_map(|stress| &stress.measures).position(|&m| m == StressMethod::Constitutive)
    {
        let key = format!("stress.measures[{index}]");
        return Err(source.error(
            &key,
            "`constitutive` of a bond law",
            "a measure of bond forces, such as `hardy`",
        ));
    }
    super::part_law::check(source, scene)?;
    if let Some(critical) = &material.critical {
        let given = critical.alternatives();
        if given.len() != 1 {
            let found = super::tearing::listed(&given);
            return Err(source.error("material.critical", found, crate::critical::ONE_OF));
        }
    }
    super::tearing::check(source, scene)?;
    for (index, field) in material.fields.iter().enumerate() {
        let key = format!("material.fields[{index}].of");
        if material.fields[..index].iter().any(|other| other.of == field.of) {
            return Err(source.error(&key, format!("`{}` a second time", field.of.name()), "each once"));
        }
        let energy = material.critical.is_some_and(|critical| critical.fracture_energy.is_some());
        if field.of == VaryingParameter::FractureEnergy && !energy {
            let allowed = "`material.critical.fracture_energy` beside it";
            return Err(source.error(&key, "a fracture energy of a material without one", allowed));
        }
    }
    if material.is_prestrained() || scene.softens() {
        // forces of these bonds are not those of the fitted law, from which stresses are taken
        let what = if scene.softens() { "bonds that soften" } else { "a prestrain in `material`" };
        if material.is_prestrained() && scene.softens() {
            let why = "prestrained bonds take `tearing` or `bonds`";
            return Err(source.conflict("material.critical.convention", "prestrain", why));
        }
        let j_integral = |probe: &HistoryProbe| probe.track == Track::JIntegral;
        for (key, given) in [
            ("stress", scene.stress.is_some()),
            ("output.section", !scene.output.section.is_empty()),
            ("probe", scene.probe.iter().any(j_integral)),
        ] {
            if given {
                return Err(source.unexpected(key, format!("not available with {what}")));
            }
        }
    }
    inclusions(source, scene)
}

/// Checks numbers of inclusions of any material.
fn inclusions(source: &Source, scene: &Scene) -> Result<(), SceneError> {
    let material = &scene.material;
    for (index, inclusion) in material.inclusions.iter().enumerate() {
        if inclusion.solid.is_some() && material.solid.is_none() {
            let key = format!("material.inclusions[{index}].solid");
            let why =
                "needs `material.solid`, that of the rest of the body; a part of a bond law has a `law`";
            return Err(source.unexpected(&key, why));
        }
        let key = format!("material.inclusions[{index}].stiffness");
        positive(source, &key, inclusion.stiffness, "")?;
        if let Some(density) = inclusion.density {
            let key = format!("material.inclusions[{index}].density");
            positive(source, &key, density.si(), "kg/m³")?;
            let weighs = |force: &BodyForceSpec| force.acceleration.is_some() || force.spin.is_some();
            if scene.dynamics.is_none() && !scene.body_force.iter().any(weighs) {
                let why = "only [dynamics] and an `acceleration` or a `spin` of [[body_force]] have masses";
                return Err(source.unexpected(&key, why));
            }
            if let Some(index) = scene.boundary.iter().position(|boundary| boundary.rigid)
                && scene.dynamics.is_some()
            {
                let why = "the particles of a region that moves as a whole have one density";
                return Err(source.conflict(&key, &format!("boundary[{index}].rigid"), why));
            }
        }
        if inclusion.critical.is_some() && material.critical.is_none() {
            let key = format!("material.inclusions[{index}].critical");
            return Err(source.unexpected(&key, "needs `material.critical`, that of the rest of the body"));
        }
    }
    Ok(())
}

fn solver(source: &Source, scene: &Scene) -> Result<(), SceneError> {
    let solver = &scene.solver;
    let within = |key: &str, value: f64, low: f64, high: f64| {
        if (low..=high).contains(&value) {
            Ok(())
        } else {
            let allowed = format!("{} to {}", plain(low), plain(high));
            Err(source.error(&format!("solver.{key}"), plain(value), allowed))
        }
    };
    within("tolerance", scene.tolerance(), 1e-12, 0.1)?;
    within("fit_bound", scene.fit_bound(), 1e-12, 1e-2)?;
    within("steps", solver.steps as f64, 1.0, 1e6)?;
    if let Some(path) = &solver.path {
        if path.is_empty() || !solver.steps.is_multiple_of(path.len()) {
            let found = format!("{} load factors in {} steps", path.len(), solver.steps);
            return Err(source.error("solver.path", found, "at least one, and as many steps to each"));
        }
        for (index, &factor) in path.iter().enumerate() {
            within(&format!("path[{index}]"), factor, -1e3, 1e3)?;
        }
    }
    within("max_iterations", solver.max_iterations as f64, 1.0, 1e9)?;
    within("mass_safety", solver.mass_safety.unwrap_or(1.1), 1.0, 100.0)?;
    if solver.mass_safety.is_some() && scene.method() != SolverMethod::Adr {
        let why = format!("`{}` has no fictitious mass; `method = \"adr\"` has", scene.method().name());
        return Err(source.unexpected("solver.mass_safety", why));
    }
    within("refine", solver.refine as f64, 1.0, 1e6)?;
    let refuses = [
        (!scene.breaks(), "bonds that never break"),
        (scene.method() == SolverMethod::Verlet, "explicit dynamics"),
        (solver.breaking == Policy::EachIteration, "`breaking = \"each-iteration\"`"),
        (scene.has_strength(), "bonds that soften"),
        (scene.contact.as_ref().is_some_and(ContactSpec::has_friction), "friction"),
    ];
    if let Some((_, what)) = refuses.into_iter().find(|(refused, _)| *refused && solver.refine > 1) {
        let allowed =
            "1, or a quasi-static scene whose bonds break at once and in equilibrium, without friction";
        return Err(source.error("solver.refine", format!("{} with {what}", solver.refine), allowed));
    }
    let found = match (solver.refine, &solver.path) {
        (1, _) => Some("`snap_back` without `refine`"),
        (_, Some(_)) => Some("`snap_back` along a `path`"),
        _ => None,
    };
    if let Some(found) = found.filter(|_| solver.snap_back) {
        let allowed = "`refine` above 1 and a load that grows in proportion";
        return Err(source.error("solver.snap_back", found, allowed));
    }
    within("accept", solver.accept.unwrap_or(0.0), 0.0, 1.0)?;
    within("stop_below", solver.stop_below.map_or(0.0, |part| part.si()), 0.0, 1.0)
}
