//! Converts the boundaries of a scene to loads and supports.

use super::formula::Formula;
use super::region::region;
use super::side_areas::side_areas;
use super::values::{DiscreteBody, ONE_OF_THEM};
use super::{Boundary, ContactSpec, Prescribed, PrescribedField, Scene, SolverMethod};
use crate::bonds::components;
use crate::contact::SurfaceShape;
use crate::field::Field;
use crate::solver::{
    ContactStops, INVERTS, Loads, RigidRegion, Support, Unsupported, find_unsupported, flattened, inverted,
};
use harness::scene::{SceneError, Source};

/// Times at which the balance of forces with curves is checked.
const BALANCES: usize = 1024;

/// Returns the loads and supports of a body, and by site whether a load or support acts there.
///
/// # Errors
/// As [`super::body_of`].
pub fn loads_of<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &DiscreteBody<D>,
) -> Result<(Loads<D>, Vec<bool>), SceneError> {
    let (mut regions, mut tractions) = (Vec::new(), Vec::new());
    let mut loaded = vec![false; body.bonds.sites()];
    for (index, boundary) in scene.boundary.iter().enumerate() {
        let key = format!("boundary[{index}]");
        let (members, depth) = region(source, &key, boundary, body)?;
        if members.is_empty() {
            return Err(source.error(&key, "a region without particles", "a region with at least one"));
        }
        let forced = boundary.prescribes_force() || boundary.displacement.is_some();
        let forced = forced || boundary.rotation.is_some() || boundary.rigid;
        for &site in members.iter().filter(|_| forced) {
            loaded[site as usize] = true;
        }
        let by_area = scene.material.solid.is_some() && boundary.layers.is_none() && boundary.depth.is_none();
        let depth = depth.filter(|_| !by_area);
        let support = support(source, &key, boundary, body, &members, depth, scene.later)?;
        if let (Some(side), Some(traction), true) = (boundary.side, &boundary.traction, by_area) {
            tractions.push((index, side, std::array::from_fn(|d| traction[d].si())));
        }
        regions.push((members, support));
    }
    let mut loads = Loads::new(body.bonds.sites(), &regions);
    let amplitudes = super::curve::amplitudes(source, scene)?;
    super::overlap::refuse(source, scene, body, &regions, &amplitudes)?;
    let mut surfaces = Vec::new();
    for (index, side, traction) in tractions {
        let areas = side_areas(source, &format!("boundary[{index}].traction"), body, side)?;
        let (mut alone, sites) = (Loads::default(), body.bonds.sites());
        if !amplitudes.is_empty() {
            add_traction(&areas, traction, sites, &mut alone, &mut loaded);
        }
        surfaces.extend(alone.body_force.map(|field| (index, field)));
        loads.pushed_regions.push(areas.iter().map(|area| area.0).collect());
        add_traction(&areas, traction, sites, &mut loads, &mut loaded);
    }
    apply_formulas(source, scene, body, &regions, &mut loads)?;
    super::rotation::turn(source, scene, body, &regions, &amplitudes, &mut loads)?;
    if scene.has_curves() {
        let rotates = |index: usize| scene.boundary[index].rotation.is_some();
        let kept = |index: usize| scene.boundary[index].held_in_place();
        super::curve::follow(&regions, rotates, kept, &surfaces, &amplitudes, &mut loads);
    }
    super::pressure::add(source, scene, body, &amplitudes, &mut loads)?;
    super::traction_field::add(source, scene, body, &amplitudes, &mut loads, &mut loaded)?;
    super::body_force::add(source, scene, body, &mut loads)?;
    let rest = Field::zeros(loads.curved.as_ref().map_or(0, |_| body.bonds.sites()));
    if loads.curved.is_some() {
        loads.set_peaks();
        loads.update_forces([1.0; 2], &*body.bonds, &rest);
    }
    join(source, scene, &regions, &mut loads, body.bonds.sites())?;
    loads.mean_gradient = scene.mean_gradient();
    refuse_inverted(source, scene, body, &loads)?;
    if scene.method() == SolverMethod::Verlet {
        // explicit dynamics needs neither balance nor supports
        return Ok((loads, loaded));
    }
    if loads.body_force.is_some() {
        let roots = components(&*body.bonds, |_, _| true);
        if loads.curved.is_some() {
            let (parts, _) = scene.load_steps();
            for &part in parts.iter().step_by(parts.len().div_ceil(BALANCES)) {
                loads.update_forces([part; 2], &*body.bonds, &rest);
                refuse_unbalanced(source, scene, body, &roots, &loads)?;
            }
            loads.update_forces([1.0; 2], &*body.bonds, &rest);
        }
        refuse_unbalanced(source, scene, body, &roots, &loads)?;
    }
    let all = (1_u8 << D) - 1;
    if body.bonds.particles().iter().all(|&site| loads.constrained(site as usize) == all) {
        return Err(source.error(
            "boundary",
            "every component of every particle is prescribed",
            "at least one free",
        ));
    }
    Ok((loads, loaded))
}

/// Lets the particles of `rigid` boundaries share their free components.
///
/// # Errors
/// A particle of two regions that both prescribe or share one component.
fn join<const D: usize>(
    source: &Source,
    scene: &Scene,
    regions: &[(Vec<u32>, Support<D>)],
    loads: &mut Loads<D>,
    sites: usize,
) -> Result<(), SceneError> {
    let mut taken = vec![0; sites];
    for (index, (boundary, (members, support))) in scene.boundary.iter().zip(regions).enumerate() {
        if !boundary.rigid {
            continue;
        }
        let components = (0..D).map(|d| u8::from(support.displacement[d].is_none()) << d).sum();
        for &site in members {
            let others = loads.constrained(site as usize) | taken[site as usize];
            if others & components != 0 {
                let found = "a particle whose displacement another region prescribes or shares";
                let allowed = "regions that move as a whole apart from others";
                return Err(source.error(&format!("boundary[{index}].rigid"), found, allowed));
            }
            taken[site as usize] |= components;
        }
        loads.join(RigidRegion { sites: members.clone(), components }, sites);
    }
    Ok(())
}

/// Adds a traction on the areas of a side, 1/m: it balances a uniform stress in every particle.
fn add_traction<const D: usize>(
    areas: &[(u32, f64)],
    traction: [f64; D],
    sites: usize,
    loads: &mut Loads<D>,
    loaded: &mut [bool],
) {
    let field = loads.body_force.get_or_insert_with(|| Field::zeros(sites));
    for &(site, area) in areas {
        let old = field.get(site as usize);
        field.set(site as usize, std::array::from_fn(|d| old[d] + area * traction[d]));
        loaded[site as usize] = true;
    }
}

/// Returns the velocities at the start, m/s.
///
/// # Errors
/// As [`super::body_of`].
pub fn velocities_of<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &DiscreteBody<D>,
) -> Result<Field<D>, SceneError> {
    let mut field = Field::zeros(body.bonds.sites());
    for (index, boundary) in scene.boundary.iter().enumerate() {
        if !boundary.prescribes_velocity() {
            continue;
        }
        let (members, _) = region(source, &format!("boundary[{index}]"), boundary, body)?;
        for site in members {
            let place = body.bonds.position(site as usize);
            let mut value = [0.0; D];
            for (d, value) in value.iter_mut().enumerate() {
                if let Some(formula) = boundary.velocity_field.as_ref().and_then(|v| v.get(d)) {
                    evaluate(source, &format!("boundary[{index}].velocity_field[{d}]"), formula, place)?;
                }
                *value = boundary.velocity_at(place, d);
            }
            field.set(site as usize, value);
        }
    }
    Ok(field)
}

impl Boundary {
    /// Component `d` of its velocity at a place at the start, m/s.
    pub(super) fn velocity_at<const D: usize>(&self, place: [f64; D], d: usize) -> f64 {
        let formula = self.velocity_field.as_ref().and_then(|formulas| formulas.get(d));
        let given = self.velocity.as_ref().and_then(|given| given.get(d)).map(|speed| speed.si());
        given.or_else(|| formula.map(|formula| formula.value_at(place))).unwrap_or(0.0)
    }
}

/// Evaluates a formula at a particle.
fn evaluate<const D: usize>(
    source: &Source,
    key: &str,
    formula: &Formula,
    place: [f64; D],
) -> Result<f64, SceneError> {
    let value = formula.value_at(place);
    if value.is_finite() {
        return Ok(value);
    }
    let found = format!("{value} of `{}` at {place:?} m", formula.text());
    Err(source.error(key, found, "a finite value at every particle of the region"))
}

/// Sets the displacements of `displacement_field`; where regions overlap, the last one wins.
fn apply_formulas<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &DiscreteBody<D>,
    regions: &[(Vec<u32>, Support<D>)],
    loads: &mut Loads<D>,
) -> Result<(), SceneError> {
    if scene.boundary.iter().all(|boundary| boundary.displacement_field.is_none()) {
        return Ok(());
    }
    let Some(field) = &mut loads.displacement else { return Ok(()) };
    for ((index, boundary), (members, support)) in scene.boundary.iter().enumerate().zip(regions) {
        for &site in members {
            let mut value = field.get(site as usize);
            for (d, value) in value.iter_mut().enumerate() {
                match boundary.displacement_field.as_ref().and_then(|field| field.get(d)) {
                    Some(PrescribedField::By(formula)) => {
                        let key = format!("boundary[{index}].displacement_field[{d}]");
                        *value = evaluate(source, &key, formula, body.bonds.position(site as usize))?;
                    }
                    _ => *value = support.displacement[d].unwrap_or(*value),
                }
            }
            field.set(site as usize, value);
        }
    }
    Ok(())
}

/// Refuses a part without supports under forces that do not balance: it has no equilibrium.
fn refuse_unbalanced<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &DiscreteBody<D>,
    roots: &[u32],
    loads: &Loads<D>,
) -> Result<(), SceneError> {
    let surfaces = scene.contact.as_ref().map_or(Ok(Vec::new()), |own| own.surfaces::<D>(source, scene))?;
    let stops = ContactStops {
        normals: super::indenter_place::stops(&surfaces, body),
        pairs: scene.contact.is_some(),
        rubs: scene.contact.as_ref().is_some_and(ContactSpec::has_friction)
            || surfaces.iter().any(|surface| surface.bonded),
    };
    let Some(part) = find_unsupported(&*body.bonds, roots, loads, None, &stops, scene.tolerance()) else {
        return Ok(());
    };
    let Unsupported { particles, total, force, axis, .. } = &part;
    let found = if particles == total {
        format!("a total force of {force:.3e} N along {axis}, along which no displacement is prescribed")
    } else {
        part.to_string()
    };
    let mut allowed = format!("balanced forces, or a `displacement` along {axis} of some region of it");
    if surfaces.iter().any(|surface| !matches!(surface.shape, SurfaceShape::Plane(_))) {
        allowed += "; an indenter without friction holds along the normals of its contact only";
    }
    Err(source.error("boundary", found, allowed))
}

/// Refuses prescribed displacements that turn the body inside out.
fn refuse_inverted<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &DiscreteBody<D>,
    loads: &Loads<D>,
) -> Result<(), SceneError> {
    let factors = match &scene.dynamics {
        // a load curve may stay far below 1
        Some(dynamics) if dynamics.factor.is_some() => return Ok(()),
        Some(_) => vec![1.0],
        None => scene.load_steps().0,
    };
    if let Some(found) = flattened(loads, &factors) {
        return Err(source.error("periodic.gradient", found, "one that leaves the cell right side out"));
    }
    match inverted(&*body.bonds, loads, &factors) {
        Some(found) => Err(source.error("boundary", found, INVERTS)),
        None => Ok(()),
    }
}

/// Returns the names of the regions of prescribed displacement, those of later steps last.
pub fn region_names(scene: &Scene) -> Vec<String> {
    let mut names = own_region_names(&scene.boundary);
    for name in scene.step.iter().flat_map(|step| own_region_names(&step.boundary)) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

/// Returns the names of the regions of prescribed displacement among the boundaries of a step.
pub(super) fn own_region_names(boundaries: &[Boundary]) -> Vec<String> {
    let constrained = boundaries.iter().enumerate().filter(|(_, b)| b.constrains());
    constrained.map(|(index, boundary)| name_of(index, boundary)).collect()
}

/// Orders the regions of prescribed displacement of a step as `names`, those of all steps; a region that the
/// step lacks is empty.
pub fn order_regions<const D: usize>(boundaries: &[Boundary], names: &[String], loads: &mut Loads<D>) {
    let own = own_region_names(boundaries);
    let find = |name: &String| own.iter().position(|own| own == name);
    let old = std::mem::take(&mut loads.held_regions);
    let each = names.iter().map(|name| find(name).and_then(|at| old.get(at).cloned()).unwrap_or_default());
    loads.held_regions = each.collect();
    for turned in &mut loads.turned {
        let place = own.get(turned.region).and_then(|own| names.iter().position(|name| name == own));
        turned.region = place.unwrap_or(turned.region);
    }
}

/// Returns lines for `peri check`: the particles of each boundary, and the free length between two grips.
pub(super) fn explain<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &DiscreteBody<D>,
) -> Result<Vec<String>, SceneError> {
    let mut lines = Vec::new();
    let mut grips = [[None; 2]; 3];
    for (index, boundary) in scene.boundary.iter().enumerate() {
        let (members, depth) = region(source, &format!("boundary[{index}]"), boundary, body)?;
        let layers = match (boundary.side, depth) {
            (Some(side), Some(depth)) => {
                let (axis, upper) = side.axis();
                if boundary.prescribes_displacement() {
                    grips[axis][usize::from(upper)] = Some(depth);
                }
                let layers = (depth / body.bonds.spacing()).round();
                format!(
                    "{layers} layer{}, {:.4} mm deep, ",
                    if layers == 1.0 { "" } else { "s" },
                    depth * 1e3
                )
            }
            _ => String::new(),
        };
        let what = [
            ("constrained", boundary.prescribes_displacement()),
            ("loaded", boundary.prescribes_force()),
            ("moving as a whole", boundary.rigid),
            ("moving at the start", boundary.prescribes_velocity()),
        ];
        let what: Vec<&str> = what.iter().filter(|(_, given)| *given).map(|(what, _)| *what).collect();
        let name = name_of(index, boundary);
        lines.push(format!("  boundary   {name}: {layers}{} particles {}", members.len(), what.join(", ")));
    }
    for (axis, depths) in grips.iter().enumerate() {
        if let [Some(low), Some(high)] = depths
            && axis < D
        {
            let free = body.bounds.1[axis] - body.bounds.0[axis] - low - high;
            lines.push(format!(
                "  boundary   {} mm free between {}- and {}+",
                mm(free),
                AXES[axis],
                AXES[axis]
            ));
        }
    }
    Ok(lines)
}

/// Converts to mm and rounds off the digits that a change of units leaves behind.
fn mm(length: f64) -> f64 {
    (length * 1e9).round() / 1e6
}

const AXES: [&str; 3] = ["x", "y", "z"];

/// Returns the name of a boundary: its own, its side, or its number.
pub(super) fn name_of(index: usize, boundary: &Boundary) -> String {
    match (&boundary.name, boundary.side) {
        (Some(name), _) => name.clone(),
        (None, Some(side)) => side.to_string(),
        (None, None) => boundary.set.clone().unwrap_or_else(|| {
            format!("{}{}", if boundary.shapes.is_empty() { "box" } else { "shapes" }, index + 1)
        }),
    }
}

fn support<const D: usize>(
    source: &Source,
    key: &str,
    boundary: &Boundary,
    body: &DiscreteBody<D>,
    members: &[u32],
    depth: Option<f64>,
    later: bool,
) -> Result<Support<D>, SceneError> {
    let count = |name: &str, found: usize| {
        if found == D {
            Ok(())
        } else {
            Err(source.error(
                &format!("{key}.{name}"),
                format!("{found} components"),
                format!("{D} components"),
            ))
        }
    };
    let refuse_both = |name: &str, both: bool, other: &str| match both {
        true => Err(source.conflict(&format!("{key}.{name}"), other, ONE_OF_THEM)),
        false => Ok(()),
    };
    let of_place = |name: &str, formula: &Formula| match formula.find_variable_except(&"xyz"[..D]) {
        Some(found) => {
            let allowed = if D == 2 { "`x` and `y`" } else { "`x`, `y` and `z`" };
            Err(source.error(&format!("{key}.{name}"), format!("`{found}` in `{}`", formula.text()), allowed))
        }
        None => Ok(()),
    };
    let mut support = Support { displacement: [None; D], body_force: [0.0; D] };
    if let Some(traction) = &boundary.traction {
        count("traction", traction.len())?;
        if boundary.side.is_none() {
            let why = "needs a `side`; other regions take `force`";
            return Err(source.unexpected(&format!("{key}.traction"), why));
        }
        if let Some(depth) = depth {
            support.body_force = std::array::from_fn(|d| traction[d].si() / depth);
        }
    }
    if let Some(force) = &boundary.force {
        count("force", force.len())?;
        let volume: f64 = members.iter().map(|&site| body.bonds.volume(site as usize)).sum();
        for d in 0..D {
            support.body_force[d] += force[d].si() / volume;
        }
    }
    if let Some(displacement) = &boundary.displacement {
        count("displacement", displacement.len())?;
        support.displacement = std::array::from_fn(|d| match displacement[d] {
            Prescribed::Free => None,
            Prescribed::At(value) => Some(value),
            Prescribed::Hold => Some(0.0),
        });
    }
    if super::rotation::rotation_of::<D>(source, key, boundary, later)?.is_some() {
        for (d, component) in support.displacement.iter_mut().enumerate() {
            let free = boundary.displacement.as_ref().is_some_and(|given| given[d] == Prescribed::Free);
            *component = if free { None } else { Some(component.unwrap_or(0.0)) };
        }
    }
    if boundary.rigid {
        refuse_both("rigid", boundary.rotation.is_some(), "rotation")?;
        refuse_both("rigid", boundary.displacement_field.is_some(), "displacement_field")?;
        refuse_both("rigid", boundary.velocity_field.is_some(), "velocity_field")?;
        if support.displacement.iter().all(Option::is_some) {
            let allowed = "a component of `displacement` that is `free`, or `rigid = false`";
            return Err(source.error(&format!("{key}.rigid"), "no free component", allowed));
        }
    }
    if let Some(field) = &boundary.displacement_field {
        count("displacement_field", field.len())?;
        refuse_both("displacement_field", boundary.displacement.is_some(), "displacement")?;
        for (d, constrained) in field.iter().enumerate() {
            if let PrescribedField::By(formula) = constrained {
                of_place(&format!("displacement_field[{d}]"), formula)?;
                support.displacement[d] = Some(0.0);
            }
        }
    }
    if let Some(velocity) = &boundary.velocity {
        count("velocity", velocity.len())?;
    }
    if let Some(field) = &boundary.velocity_field {
        count("velocity_field", field.len())?;
        refuse_both("velocity_field", boundary.velocity.is_some(), "velocity")?;
        for (d, formula) in field.iter().enumerate() {
            of_place(&format!("velocity_field[{d}]"), formula)?;
        }
    }
    if !boundary.prescribes_force()
        && !boundary.prescribes_displacement()
        && !boundary.prescribes_velocity()
        && !boundary.rigid
    {
        return Err(source.missing(
            &format!("{key}.displacement"),
            "needed for a boundary: `displacement`, `rotation`, `rigid`, `traction`, `traction_field`, \
             `force`, `pressure` or, in explicit dynamics, `velocity`",
        ));
    }
    Ok(support)
}
