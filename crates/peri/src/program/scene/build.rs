//! Builds the body of a variant, and checks the rules that span several keys.

use super::Scene;
use super::cloud::cloud;
use super::crack::{cracks, severed};
use super::interface::cross_interfaces;
use super::memory;
use super::mesh_region::MeshSets;
use super::mesh_shape::check_filling;
use super::periodic::check_body;
use super::shapes::operations;
use super::values::DiscreteBody;
use super::variant::SceneVariant;
use crate::bonds::{BodyGeometry, BondDamage, LatticeBonds};
use crate::calibrate::Space;
use crate::geometry::{Cut, Gaps, MOST_CELLS, Operation, bounds, cell_counts, lattice};
use harness::scene::{SceneError, Source};
use polycore::memory::{available, gib};

/// Largest number of sites of a body: they are counted in 32 bits.
const MOST_SITES: f64 = u32::MAX as f64;

/// Builds the body of a variant.
///
/// # Errors
/// A [`SceneError`] that names the key, the value found and what is allowed.
pub fn body_of<const D: usize>(
    source: &Source,
    scene: &Scene,
    variant: &SceneVariant,
) -> Result<DiscreteBody<D>, SceneError> {
    let thickness = thickness(source, scene)?;
    let cuts = cracks(source, scene)?;
    let mut body = match scene.body.has_points() {
        true => cloud(source, scene, variant, thickness, &cuts)?,
        false => build_lattice_body(source, scene, variant, thickness, &cuts)?,
    };
    body.severed = severed(source, &*body.bonds, &cuts)?;
    body.cuts = cuts;
    body.sets = MeshSets::of_scene(source, scene)?;
    cross_interfaces(source, scene, &mut body)?;
    Ok(body)
}

/// Fills the shapes with a lattice of particles.
fn build_lattice_body<const D: usize>(
    source: &Source,
    scene: &Scene,
    variant: &SceneVariant,
    thickness: f64,
    cuts: &[Cut<D>],
) -> Result<DiscreteBody<D>, SceneError> {
    let (operations, low, high) = outline(source, scene)?;
    let counts = cell_counts(low, high, variant.spacing);
    refuse_too_large(source, scene, counts, variant.horizon_ratio)?;
    check_shapes(source, &operations, low, high)?;
    let lattice = lattice(&operations, variant.spacing, thickness)
        .map_err(|error| source.error("body.shapes", error, "a body with at least one particle"))?;
    check_filling(source, scene, &operations, &lattice)?;
    let volume = variant.spacing.powi(D as i32) * thickness;
    if !(volume.is_normal()) {
        let found = format!("{} m, with which the volume of a particle is {volume} m³", variant.spacing);
        return Err(source.error(spacing_key(scene), found, "a spacing whose cells have a volume"));
    }
    let gaps = Gaps::of_shapes(&operations, &lattice, variant.horizon_ratio * variant.spacing);
    let severing = gaps.as_ref().filter(|_| scene.body.bond_gaps != Some(true));
    let (ratio, across) = (variant.horizon_ratio, scene.periodic_axes());
    check_body(source, scene, (low, high), (&lattice, ratio), severing.is_some())?;
    let built = LatticeBonds::with_periodic_sides(lattice, ratio, variant.volume, (cuts, severing), across);
    let mut bonds = built
        .map_err(|error| source.error("body.horizon_ratio", error, "a horizon that reaches a neighbour"))?;
    if bonds.directed_bonds() == 0 {
        let found = format!(
            "{} m, which leaves {} particles without any bond",
            variant.spacing,
            bonds.particles().len()
        );
        return Err(source.error(
            spacing_key(scene),
            found,
            "smaller: a body of at least two bonded particles",
        ));
    }
    if scene.is_mixed() {
        bonds.set_mixed();
    }
    memory::refuse_too_large(source, scene, spacing_key(scene), &bonds)?;
    let (severed, cuts) = (Vec::new(), Vec::new());
    let bonds = Box::new(bonds);
    let (interfaces, sets, bounds) = (Vec::new(), MeshSets::default(), (low, high));
    Ok(DiscreteBody { bonds, bounds, thickness, severed, cuts, gaps, operations, interfaces, sets })
}

/// Returns a lower bound of the memory of a variant before it is built, bytes; 0 for a cloud.
///
/// # Errors
/// As [`body_of`].
pub fn least_memory<const D: usize>(
    source: &Source,
    scene: &Scene,
    variant: &SceneVariant,
) -> Result<f64, SceneError> {
    if scene.body.has_points() {
        return Ok(0.0);
    }
    let (_, low, high) = outline::<D>(source, scene)?;
    Ok(memory::bytes_of_lattice(scene, cell_counts(low, high, variant.spacing), variant.horizon_ratio).1)
}

/// Operations on shapes, and the bounding box of the added shapes.
type BodyOutline<const D: usize> = (Vec<Operation<D>>, [f64; D], [f64; D]);

pub(super) fn outline<const D: usize>(source: &Source, scene: &Scene) -> Result<BodyOutline<D>, SceneError> {
    let operations = operations(source, "body.shapes", scene.body.shapes())?;
    let (low, high) = bounds(&operations).ok_or_else(|| {
        source.error("body.shapes", "only shapes that are cut", "at least one shape with `add`")
    })?;
    Ok((operations, low, high))
}

fn thickness(source: &Source, scene: &Scene) -> Result<f64, SceneError> {
    match (scene.body.space, scene.body.thickness) {
        (Space::Solid, None) => Ok(1.0),
        (Space::Solid, Some(_)) => {
            Err(source.unexpected("body.thickness", "a `solid` takes its size from its shapes"))
        }
        (_, Some(t)) if t.si() > 0.0 => Ok(t.si()),
        (_, Some(t)) => Err(source.error("body.thickness", format!("{} m", t.si()), "above 0")),
        (_, None) => Err(source.missing("body.thickness", "needed for a plane body")),
    }
}

/// Refuses a lattice that is too large before it is allocated.
fn refuse_too_large<const D: usize>(
    source: &Source,
    scene: &Scene,
    counts: [f64; D],
    ratio: f64,
) -> Result<(), SceneError> {
    let cells: f64 = counts.iter().product();
    let (sites, needed) = memory::bytes_of_lattice(scene, counts, ratio);
    let available = available();
    if !(cells <= MOST_CELLS && sites <= MOST_SITES && needed <= available) {
        let found = format!("{cells:.3e} lattice cells, which need about {}", gib(needed));
        let allowed = format!(
            "at most {MOST_CELLS:.0e} cells and {} (the available memory); take a larger spacing",
            gib(available)
        );
        return Err(source.error(spacing_key(scene), found, allowed));
    }
    Ok(())
}

/// Returns the key that gives the spacing.
fn spacing_key(scene: &Scene) -> &'static str {
    if scene.study.iter().any(|study| !study.spacing.is_empty()) { "study" } else { "body.spacing" }
}

/// Refuses a cut that removes the whole body, by its key rather than as an empty lattice.
fn check_shapes<const D: usize>(
    source: &Source,
    operations: &[Operation<D>],
    low: [f64; D],
    high: [f64; D],
) -> Result<(), SceneError> {
    for (index, operation) in operations.iter().enumerate() {
        if let Operation::Cut(shape) = operation {
            let (from, to) = shape.bounds();
            if (0..D).all(|d| from[d] <= low[d] && to[d] >= high[d]) {
                let found = format!(
                    "a cut from {from:?} m to {to:?} m around the whole body ({low:?} m to {high:?} m)"
                );
                return Err(source.error(&format!("body.shapes[{index}]"), found, "smaller than the body"));
            }
        }
    }
    Ok(())
}
