//! Bodies of points: from a CSV file or a grid.

use super::GridSpec;
use super::Scene;
use super::memory;
use super::mesh_cells::CellMesh;
use super::mesh_region::MeshSets;
use super::values::{DiscreteBody, LARGEST_RATIO, check_order, positive, required, vector};
use super::variant::SceneVariant;
use crate::bonds::{BodyGeometry, BondDamage, CloudBonds, LatticeBonds};
use crate::geometry::{Cut, Gaps, recognise};
use harness::scene::{SceneError, Source};
use polycore::memory::{available, gib};
use polycore::table::Table;
use polycore::units::Length;
use polycore::units::dimension::{LengthDimension, VolumeDimension};
use std::collections::HashMap;
use std::path::Path;

/// Positions (m) and volumes (m³).
type CloudPoints<const D: usize> = (Vec<[f64; D]>, Vec<f64>);

/// Builds the body of a cloud.
///
/// # Errors
/// A [`SceneError`] that names the file and the line, or the key.
pub fn cloud<const D: usize>(
    source: &Source,
    scene: &Scene,
    variant: &SceneVariant,
    thickness: f64,
    cuts: &[Cut<D>],
) -> Result<DiscreteBody<D>, SceneError> {
    let horizon = required(source, "body.horizon", scene.body.horizon, "needed for a cloud of points")?.si();
    positive(source, "body.horizon", horizon, "m")?;
    let (positions, volumes, key) = match (&scene.body.points, &scene.body.grid) {
        (Some(points), _) => {
            let path = source.file(points);
            let (positions, volumes) = match meshfile::is_mesh(points) {
                true => cells_of_mesh(source, points, scene.body.unit, thickness)?,
                false => read::<D>(source, &path)?,
            };
            (positions, volumes, "body.points")
        }
        (None, Some(spec)) => {
            let (positions, volumes) = grid(source, spec, thickness)?;
            (positions, volumes, "body.grid")
        }
        (None, None) => return Err(source.missing("body.points", "needed for a cloud: `points` or a `grid`")),
    };
    if let Some(body) = recognise_lattice(&positions, &volumes, thickness, horizon, (scene, variant), cuts) {
        memory::refuse_too_large(source, scene, key, &*body.bonds)?;
        return Ok(body);
    }
    refuse_too_many_bonds(source, &positions, horizon)?;
    // cells of a grid may be far from cubes
    let gaps = scene.body.points.as_ref().and_then(|_| Gaps::of_points(&positions, &volumes, thickness));
    let severing = gaps.as_ref().filter(|_| scene.body.bond_gaps == Some(false));
    let bonds =
        CloudBonds::with_gaps(&positions, &volumes, thickness, horizon, variant.volume, cuts, severing)
            .map_err(|error| {
                let file =
                    scene.body.points.as_ref().map_or(String::new(), |path| format!("{}: ", path.display()));
                source.error(key, format!("{file}{error}"), "distinct points with volumes above 0")
            })?;
    if bonds.directed_bonds() == 0 {
        let found = format!("{horizon} m, which reaches no neighbour");
        return Err(source.error("body.horizon", found, "larger"));
    }
    memory::refuse_too_large(source, scene, "body.horizon", &bonds)?;
    let half = 0.5 * bonds.spacing();
    let [low, high] = polycore::numerics::bounds(positions.iter().copied());
    let (low, high) = (low.map(|x| x - half), high.map(|x| x + half));
    Ok(DiscreteBody {
        bonds: Box::new(bonds),
        bounds: (low, high),
        thickness,
        severed: Vec::new(),
        cuts: Vec::new(),
        gaps,
        operations: Vec::new(),
        interfaces: Vec::new(),
        sets: MeshSets::default(),
    })
}

/// Builds a lattice, which needs no neighbour list, if the points lie on one.
fn recognise_lattice<const D: usize>(
    positions: &[[f64; D]],
    volumes: &[f64],
    thickness: f64,
    horizon: f64,
    (scene, variant): (&Scene, &SceneVariant),
    cuts: &[Cut<D>],
) -> Option<DiscreteBody<D>> {
    let lattice = recognise(positions, volumes, thickness)?;
    // bonds as long as the horizon count despite rounding, as in a cloud
    let ratio = horizon / lattice.spacing * (1.0 + 1e-9);
    // larger ratios are refused for lattices; a neighbour list takes them
    if !(1.0..=LARGEST_RATIO).contains(&ratio) {
        return None;
    }
    let low = lattice.origin.map(|x| x - 0.5 * lattice.spacing);
    let high: [f64; D] = std::array::from_fn(|d| low[d] + lattice.cells[d] as f64 * lattice.spacing);
    let gaps = Gaps::of_cells(&lattice);
    let severing = gaps.as_ref().filter(|_| scene.body.bond_gaps != Some(true));
    let bonds = LatticeBonds::with_gaps(lattice, ratio, variant.volume, cuts, severing).ok()?;
    (bonds.directed_bonds() > 0).then(|| DiscreteBody {
        bonds: Box::new(bonds),
        bounds: (low, high),
        thickness,
        severed: Vec::new(),
        cuts: Vec::new(),
        gaps,
        operations: Vec::new(),
        interfaces: Vec::new(),
        sets: MeshSets::default(),
    })
}

/// Returns the centres and volumes of the cells of a grid, the first axis varying fastest.
fn grid<const D: usize>(
    source: &Source,
    spec: &GridSpec,
    thickness: f64,
) -> Result<CloudPoints<D>, SceneError> {
    let min: [f64; D] = vector(source, "body.grid.min", &spec.min)?;
    let max: [f64; D] = vector(source, "body.grid.max", &spec.max)?;
    check_order(source, "body.grid", min, max)?;
    let cells = <[usize; D]>::try_from(spec.cells.as_slice()).map_err(|_| {
        source.error("body.grid.cells", format!("{} numbers", spec.cells.len()), format!("{D} numbers"))
    })?;
    let count: f64 = cells.iter().map(|&n| n as f64).product();
    let needed = memory::bytes_of_cloud::<D>(count, 0.0);
    if cells.contains(&0) || needed > available() || count > f64::from(u32::MAX) {
        let allowed =
            format!("at least 1 along each axis, and at most {} (the available memory)", gib(available()));
        return Err(source.error(
            "body.grid.cells",
            format!("{cells:?}, which need {}", gib(needed)),
            allowed,
        ));
    }
    let size: [f64; D] = std::array::from_fn(|d| (max[d] - min[d]) / cells[d] as f64);
    let volume = size.iter().product::<f64>() * thickness;
    let place = |index: usize| {
        let mut left = index;
        std::array::from_fn(|d| {
            let k = left % cells[d];
            left /= cells[d];
            min[d] + (k as f64 + 0.5) * size[d]
        })
    };
    let count = cells.iter().product();
    Ok(((0..count).map(place).collect(), vec![volume; count]))
}

/// Reads the centroids and volumes of the cells of a mesh file.
fn cells_of_mesh<const D: usize>(
    source: &Source,
    file: &Path,
    unit: Option<Length>,
    thickness: f64,
) -> Result<CloudPoints<D>, SceneError> {
    let why = "the mesh file has none: the length of one unit, e.g. \"1 mm\"";
    let unit = required(source, "body.unit", unit, why)?;
    let mesh = CellMesh::<D>::read(source, "body.points", "body.unit", file, unit)?;
    let cells = mesh.moments().into_iter().map(|(volume, centre)| (centre, volume * thickness));
    Ok(cells.unzip())
}

fn read<const D: usize>(source: &Source, path: &Path) -> Result<CloudPoints<D>, SceneError> {
    let bad = |found: String, allowed: &str| {
        source.error("body.points", format!("{}{found}", path.display()), allowed)
    };
    let names: &[&str] = if D == 2 { &["x", "y", "volume"] } else { &["x", "y", "z", "volume"] };
    let columns = format!("columns {} (m, m³)", names.join(", "));
    let refused = |error: &dyn std::fmt::Display| {
        source.refused("body.points", format!("{error}; the file needs {columns}"))
    };
    let table = Table::read(path).map_err(|error| refused(&error))?;
    let headings: Vec<&str> = table.headings.iter().map(|heading| heading.text.as_str()).collect();
    let found = names.iter().filter_map(|name| table.find(name)).collect::<Vec<usize>>();
    if found.len() != names.len() || headings.len() != names.len() {
        let line = table.layout().heading_line;
        return Err(bad(format!(", headings in line {line}: `{}`", headings.join(", ")), &columns));
    }
    let in_si = |&column: &usize| match table.headings[column].name.as_str() {
        "volume" => table.column::<VolumeDimension>(column, Some("m^3")),
        _ => table.column::<LengthDimension>(column, Some("m")),
    };
    let values = found.iter().map(in_si).collect::<Result<Vec<_>, _>>();
    let values = values.map_err(|error| refused(&error))?;
    let (mut positions, mut volumes) = (Vec::new(), Vec::new());
    for row in 0..table.rows() {
        let volume = values[D][row];
        if volume <= 0.0 {
            return Err(bad(format!(", line {}: volume {volume}", table.line(row)), "a volume above 0"));
        }
        positions.push(std::array::from_fn(|d| values[d][row]));
        volumes.push(volume);
    }
    if positions.len() < 2 {
        let found = format!(": {} points", positions.len());
        return Err(bad(found, "at least two points, so that there is a bond"));
    }
    Ok((positions, volumes))
}

/// Refuses a horizon with so many bonds that memory does not suffice. Counts points in cells as wide as the
/// horizon: the block of 3^D cells around a point contains its ball, and about (block/ball) times as many
/// points.
fn refuse_too_many_bonds<const D: usize>(
    source: &Source,
    positions: &[[f64; D]],
    horizon: f64,
) -> Result<(), SceneError> {
    let mut cells: HashMap<[i64; D], f64> = HashMap::new();
    for position in positions {
        *cells.entry(position.map(|x| (x / horizon).floor() as i64)).or_default() += 1.0;
    }
    let around = |cell: &[i64; D]| -> f64 {
        let neighbour = |k: usize| -> [i64; D] {
            std::array::from_fn(|d| cell[d].saturating_add((k / 3_usize.pow(d as u32) % 3) as i64 - 1))
        };
        (0..3_usize.pow(D as u32)).filter_map(|k| cells.get(&neighbour(k))).sum()
    };
    let pairs: f64 = cells.iter().map(|(cell, count)| count * around(cell)).sum();
    let share = if D == 2 { std::f64::consts::PI / 9.0 } else { 4.0 / 3.0 * std::f64::consts::PI / 27.0 };
    let bonds = pairs * share;
    let (needed, available) = (memory::bytes_of_cloud::<D>(positions.len() as f64, bonds), available());
    if needed > available {
        let found = format!("{horizon} m, which makes about {bonds:.1e} bonds that need {}", gib(needed));
        let allowed = format!("at most {} (the available memory); take a smaller horizon", gib(available));
        return Err(source.error("body.horizon", found, allowed));
    }
    Ok(())
}
