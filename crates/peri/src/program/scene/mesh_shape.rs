//! Shapes inside closed facets: cells of mesh files, STL surfaces, drawings, polygons.

use super::mesh_cells::CellMesh;
use super::values::{DiscreteBody, plain, positive, required, vector};
use super::{Scene, ShapeSpec};
use crate::geometry::{Enclosure, Facet, Lattice, Operation, Parts, Shape, cell};
use harness::scene::{SceneError, Source};
use polycore::numerics::segments_meet;
use polycore::units::Length;
use std::sync::Arc;

/// Difference of the volume of cells and that inside their surface, over it, that rounding explains.
const EQUAL: f64 = 1e-9;
/// Depth of an overlap of cells that is refused, in spacings.
const LEAST_OVERLAP: f64 = 0.05;

/// Builds the shape of a mesh file.
///
/// # Errors
/// A file that cannot be used, an unknown block, cells that overlap, a surface that is not closed.
pub(super) fn mesh_shape<const D: usize>(
    source: &Source,
    key: &str,
    spec: &ShapeSpec,
) -> Result<Shape<D>, SceneError> {
    let [file_key, unit_key] = ["file", "unit"].map(|name| format!("{key}.{name}"));
    let file = spec.file.as_deref().unwrap_or_else(|| "".as_ref());
    let unit = required(source, &unit_key, spec.unit, "the file has none")?;
    let ending = file.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let at = |error: String| source.refused(&file_key, format!("{}: {error}", file.display()));
    if spec.layer.is_some() && ending != "dxf" {
        return Err(source.unexpected(&format!("{key}.layer"), "only drawings (`.dxf`) have layers"));
    }
    if ending == "dxf" {
        return outline(source, key, spec, unit.si());
    }
    if ending == "stl" {
        if D == 2 {
            let allowed = "a mesh of triangles and quadrangles";
            return Err(source.error(&file_key, "an STL surface in a plane body", allowed));
        }
        if spec.block.is_some() {
            return Err(source.unexpected(&format!("{key}.block"), "an STL surface has no blocks"));
        }
        positive(source, &unit_key, unit.si(), "m")?;
        let surface = meshfile::stl::read(&source.file(file), unit.si())
            .map_err(|error| source.refused(&file_key, error.to_string()))?;
        let corner = |node: u32| -> [f64; D] { std::array::from_fn(|d| surface.points[node as usize][d]) };
        let facet = |nodes: &[u32; 3]| std::array::from_fn(|k| corner(nodes[k.min(2)]));
        let facets = surface.triangles.iter().map(facet).collect();
        return Ok(enclosed(Enclosure::new(facets).map_err(|error| at(error.to_string()))?));
    }
    if !meshfile::is_mesh(file) {
        let allowed = format!("{}, `.stl` or, in a plane body, `.dxf`", meshfile::FORMATS);
        return Err(source.error(&file_key, format!("`{}`", file.display()), allowed));
    }
    let mesh = CellMesh::<D>::read(source, &file_key, &unit_key, file, unit)?;
    let cells = match &spec.block {
        None => mesh.cells().to_vec(),
        Some(name) => {
            let places = mesh.content().element_sets.get(name).cloned().unwrap_or_default();
            let cells = mesh.cells_of(places);
            if cells.is_empty() {
                let known = mesh.blocks();
                let block = format!("{key}.block");
                if known.is_empty() {
                    let found = format!("`{name}` of {}, which names no cells", mesh.path());
                    return Err(source.error(&block, found, "no `block`, which takes all cells"));
                }
                return Err(source.unknown(&block, name, &known));
            }
            cells
        }
    };
    let (facets, volume) = mesh.boundary(&cells).map_err(at)?;
    let body = Enclosure::new(facets).map_err(|error| at(error.to_string()))?;
    if (body.volume() - volume).abs() > EQUAL * volume {
        let found = format!(
            "{}, whose cells have {volume:.6e} m^{D} and a surface around {:.6e} m^{D}",
            mesh.path(),
            body.volume()
        );
        return Err(source.error(&file_key, found, "each cell once, and none inside of another"));
    }
    Ok(enclosed(body))
}

/// Builds the shape of the outline of a drawing.
///
/// # Errors
/// In 3D, with a block, and as [`meshfile::dxf::read`].
fn outline<const D: usize>(
    source: &Source,
    key: &str,
    spec: &ShapeSpec,
    unit: f64,
) -> Result<Shape<D>, SceneError> {
    let [file_key, unit_key] = ["file", "unit"].map(|name| format!("{key}.{name}"));
    let file = spec.file.as_deref().unwrap_or_else(|| "".as_ref());
    if D != 2 {
        return Err(source.error(&file_key, "a drawing in a solid", "a mesh, or an STL surface"));
    }
    if spec.block.is_some() {
        return Err(source.unexpected(&format!("{key}.block"), "a drawing has a `layer`"));
    }
    positive(source, &unit_key, unit, "m")?;
    let outline = meshfile::dxf::read(&source.file(file), unit, spec.layer.as_deref())
        .map_err(|error| source.refused(&file_key, error.to_string()))?;
    let corner = |point: [f64; 2]| -> [f64; D] { std::array::from_fn(|d| point[d.min(1)]) };
    let sides = |points: &Vec<[f64; 2]>| -> Vec<Facet<D>> {
        let ends = |k: usize| std::array::from_fn(|end| corner(points[(k + end) % points.len()]));
        (0..points.len()).map(ends).collect()
    };
    let body = Enclosure::new(outline.loops.iter().flat_map(sides).collect())
        .map_err(|error| source.refused(&file_key, format!("{}: {error}", file.display())))?;
    Ok(enclosed(body))
}

/// Notes of the readers of drawings and closed surfaces.
pub(super) fn notes(source: &Source, scene: &Scene) -> Vec<String> {
    let read = |shape: &ShapeSpec| {
        let (file, unit) = shape.file.as_ref().zip(shape.unit)?;
        let path = source.file(file);
        let ending = file.extension()?.to_string_lossy().to_lowercase();
        let notes = match ending.as_str() {
            "dxf" => meshfile::dxf::read(&path, unit.si(), shape.layer.as_deref()).ok()?.notes,
            "stl" => meshfile::stl::read(&path, unit.si()).ok()?.notes,
            _ => return None,
        };
        Some(notes.into_iter().map(|note| format!("{}: {note}", file.display())).collect::<Vec<_>>())
    };
    scene.body.shapes().iter().filter_map(read).flatten().collect()
}

fn enclosed<const D: usize>(body: Enclosure<D>) -> Shape<D> {
    Shape::Enclosed(Arc::new(body))
}

/// Builds a polygon from its corners, in either direction; the last may repeat the first.
///
/// # Errors
/// In 3D, fewer than three corners, edges that cross, no area.
pub(super) fn polygon<const D: usize>(
    source: &Source,
    key: &str,
    points: &[Vec<Length>],
) -> Result<Shape<D>, SceneError> {
    if D != 2 {
        return Err(source.error(key, "a polygon", "`ball`, `cylinder`, `box` or `mesh` in a solid"));
    }
    let key = format!("{key}.points");
    let corner = |(index, point): (usize, &Vec<Length>)| vector(source, &format!("{key}[{index}]"), point);
    let mut corners: Vec<[f64; D]> = points.iter().enumerate().map(corner).collect::<Result<_, _>>()?;
    // closed by its first corner
    if corners.len() > 1 && corners.first() == corners.last() {
        corners.pop();
    }
    let count = corners.len();
    if count < 3 {
        return Err(source.error(&key, format!("{count} corners"), "at least 3"));
    }
    let next = |k: usize| (k + 1) % count;
    let area: f64 = (0..count)
        .map(|k| {
            let [p, q] = [corners[k], corners[next(k)]];
            let [x, y] = [0, 1].map(|d| (p[d] - corners[0][d], q[d] - corners[0][d]));
            x.0 * y.1 - y.0 * x.1
        })
        .sum();
    for (one, other) in (0..count).flat_map(|one| (one + 1..count).map(move |other| (one, other))) {
        let neighbours = other == next(one) || one == next(other);
        let edge = |k: usize| [corners[k], corners[next(k)]];
        if !neighbours && segments_meet(edge(one), edge(other)) {
            let found = format!("edges from corners {one} and {other} that meet");
            return Err(source.error(&key, found, "a polygon whose edges do not cross"));
        }
    }
    if area < 0.0 {
        corners.reverse();
    }
    let facets = (0..count).map(|k| std::array::from_fn(|end| corners[(k + end) % count])).collect();
    let body = Enclosure::new(facets).map_err(|error| source.error(&key, error, "corners around an area"))?;
    Ok(enclosed(body))
}

/// Returns lines for `peri check`: the volume of each shape of a file or polygon, and that of its particles.
pub(super) fn explain<const D: usize>(scene: &Scene, body: &DiscreteBody<D>) -> Vec<String> {
    if body.operations.iter().all(|operation| operation.enclosure().is_none()) {
        return Vec::new();
    }
    let parts = shape_numbers(&body.operations);
    let mut filled = vec![0.0; body.operations.len()];
    for &site in body.bonds.particles() {
        if let Some(shape) = parts.part_at(body.bonds.position(site as usize)) {
            filled[shape as usize] += body.bonds.volume(site as usize);
        }
    }
    let line = |(index, operation): (usize, &Operation<D>)| {
        let own = operation.enclosure()?;
        let name = scene.body.shapes().get(index)?.block.as_ref();
        let name = name.map_or(String::new(), |name| format!(", block {name}"));
        let [volume, filled] = [own.volume() * body.thickness, filled[index]].map(|v| v * 1e9);
        Some(format!("body.shapes[{index}]{name}: {volume:.6} mm³, its particles {filled:.6} mm³"))
    };
    body.operations.iter().enumerate().filter_map(line).collect()
}

/// Numbers shapes as parts.
fn shape_numbers<const D: usize>(operations: &[Operation<D>]) -> Parts<D> {
    Parts::new(operations, &(0..operations.len() as u32).collect::<Vec<u32>>())
}

/// Checks that blocks of one mesh file do not overlap, and that each has particles.
///
/// # Errors
/// A particle in several cells, cells that overlap by more than [`LEAST_OVERLAP`], a block without particles.
pub(super) fn check_filling<const D: usize>(
    source: &Source,
    scene: &Scene,
    operations: &[Operation<D>],
    lattice: &Lattice<D>,
) -> Result<(), SceneError> {
    let bodies: Vec<(usize, &Enclosure<D>)> = operations
        .iter()
        .enumerate()
        .filter_map(|(index, operation)| Some((index, operation.enclosure()?)))
        .collect();
    if bodies.is_empty() {
        return Ok(());
    }
    let shapes = scene.body.shapes();
    let same_file =
        |one: usize, other: usize| shapes[one].file.is_some() && shapes[one].file == shapes[other].file;
    let overlapping = |what: &str, place: [f64; D], index: usize, other: Option<usize>| {
        let at: Vec<String> = place.iter().map(|x| plain((x * 1e9).round() / 1e6)).collect();
        let others = other.map_or("cells overlap".to_owned(), |other| {
            format!("a cell of body.shapes[{other}] and one of this shape overlap")
        });
        let found = format!("a {what} at ({}) mm where {others}", at.join(", "));
        let allowed = "cells that share faces only; name only one of two nested blocks";
        source.error(&format!("body.shapes[{index}]"), found, allowed)
    };
    let parts = shape_numbers(operations);
    let mut filled = vec![0_u64; operations.len()];
    for index in (0..lattice.occupied.len()).filter(|&index| lattice.occupied[index]) {
        let cell = cell(index, lattice.cells);
        let place: [f64; D] = std::array::from_fn(|d| lattice.origin[d] + lattice.spacing * cell[d] as f64);
        if let Some(part) = parts.part_at(place) {
            filled[part as usize] += 1;
        }
        let mut owner: Option<usize> = None;
        for &(index, body) in &bodies {
            let depth = body.depth(place);
            let same = owner.filter(|&other| same_file(index, other));
            if depth > 1 || depth > 0 && same.is_some() {
                return Err(overlapping("particle", place, index, same));
            }
            owner = owner.or((depth > 0).then_some(index));
        }
    }
    let margin = LEAST_OVERLAP * lattice.spacing;
    let pairs = bodies.iter().flat_map(|one| bodies.iter().map(move |two| (*one, *two)));
    for ((index, body), (other, beside)) in pairs {
        if index != other && !same_file(index, other) {
            continue;
        }
        if let Some(place) = body.shared_point(beside, margin) {
            return Err(overlapping("point", place, index, (other != index).then_some(other)));
        }
    }
    for &(index, body) in &bodies {
        if filled[index] == 0 {
            let (low, high) = body.facets().bounds();
            let width = (0..D).map(|d| high[d] - low[d]).fold(f64::INFINITY, f64::min);
            let found = format!(
                "a shape without particles at a spacing of {} mm; it is {} mm wide",
                plain((lattice.spacing * 1e9).round() / 1e6),
                plain((width * 1e9).round() / 1e6)
            );
            let allowed = "a smaller `body.spacing`, or a shape that no later one covers";
            return Err(source.error(&format!("body.shapes[{index}]"), found, allowed));
        }
    }
    Ok(())
}
