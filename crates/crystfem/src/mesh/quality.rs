//! Quality checks of a mesh.

use nalgebra::Vector3;
use polycore::numerics::DisjointSets;
use rayon::prelude::*;

use crate::element::natural::{Natural, QuadratureRule, corner};
use crate::error::Error;
use crate::mesh::surface::OuterSurface;
use crate::mesh::{Face, Mesh};

/// Smallest accepted scaled Jacobian: det of the three edges at a corner over the product of their lengths, 1
/// for a brick, 1/√2 for the corner of a regular tetrahedron. Gradients on an element grow with its inverse:
/// below this bound they lose six of fifteen digits.
pub const MIN_SCALED_JACOBIAN: f64 = 1e-6;

/// Scaled Jacobian below which a note is made: an angle between an edge and the plane of two others under 3°.
pub const POOR_SCALED_JACOBIAN: f64 = 0.05;

/// Largest accepted ratio of an element's longest to its shortest edge: conductances of an element scale with
/// its square, and (10⁷)² leaves two digits of the small one.
pub const MAX_ASPECT: f64 = 1e7;

/// Ratio of edges above which a note is made.
pub const POOR_ASPECT: f64 = 1e3;

/// Quality of an accepted mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Quality {
    /// Total volume, m³.
    pub volume: f64,
    /// Smallest scaled Jacobian and its element.
    pub scaled_jacobian: (f64, u32),
    /// Largest ratio of edges and its element.
    pub aspect: (f64, u32),
    /// Number of parts without shared nodes.
    pub parts: usize,
    /// Notes on accepted but doubtful findings.
    pub notes: Vec<String>,
}

/// Checks a mesh. `labels` are the element numbers in its file, for messages; by default elements count from
/// 0.
///
/// # Errors
/// [`Error::Mesh`] with the element, its centre, the value found and what is allowed: no elements, a node out
/// of range or repeated in an element, coordinates that are not finite, an inverted element or one without
/// volume (Jacobian at a corner or at a Gauss point not positive), a scaled Jacobian below
/// [`MIN_SCALED_JACOBIAN`], a ratio of edges above [`MAX_ASPECT`], a duplicate element, a face of
/// three elements, and a set that is empty or has members out of range.
pub fn check(mesh: &Mesh, labels: Option<&[u64]>) -> Result<Quality, Error> {
    let elements = mesh.element_count();
    if elements == 0 {
        return Err(Error::Mesh("no hexahedra, tetrahedra or wedges; allowed: 1 or more".into()));
    }
    check_numbers(mesh, labels)?;
    // worst of each work item, then of all in order: the same on any number of threads
    let items: Vec<WorstMeasures> = (0..elements.div_ceil(ITEM))
        .into_par_iter()
        .map(|item| {
            WorstMeasures::measure(mesh, (item * ITEM) as u32..((item + 1) * ITEM).min(elements) as u32)
        })
        .collect();
    let worst = items.into_iter().reduce(WorstMeasures::merge).unwrap_or_default();
    let refuse = |(value, element): (f64, u32), what: &str, allowed: String| {
        Err(Error::Mesh(format!("{}: {what} {value:.3e}; allowed: {allowed}", place(mesh, labels, element))))
    };
    if worst.determinant.0.is_nan() || worst.determinant.0 <= 0.0 {
        return refuse(worst.determinant, "inverted or without volume, Jacobian", "above 0 m³".into());
    }
    if worst.scaled.0.is_nan() || worst.scaled.0 < MIN_SCALED_JACOBIAN {
        return refuse(worst.scaled, "sliver, scaled Jacobian", format!("{MIN_SCALED_JACOBIAN:e} or more"));
    }
    if worst.aspect.0.is_nan() || worst.aspect.0 > MAX_ASPECT {
        return refuse(worst.aspect, "longest over shortest edge", format!("at most {MAX_ASPECT:e}"));
    }
    check_duplicates(mesh, labels)?;
    check_sets(mesh)?;
    let surface = OuterSurface::of_all(mesh)?;
    let mut notes = Vec::new();
    if worst.scaled.0 < POOR_SCALED_JACOBIAN {
        let (value, element) = worst.scaled;
        notes.push(format!("{}: scaled Jacobian {value:.3e}, the least", place(mesh, labels, element)));
    }
    if worst.aspect.0 > POOR_ASPECT {
        let (value, element) = worst.aspect;
        notes.push(format!("{}: longest over shortest edge {value:.3e}", place(mesh, labels, element)));
    }
    let (parts, unused, first) = parts(mesh);
    if parts > 1 {
        notes.push(format!("{parts} parts share no node: no heat flows between them"));
    }
    if unused > 0 {
        notes.push(format!("{unused} nodes belong to no element, node {first} first"));
    }
    if let Some((count, [a, b])) = coincident_nodes(mesh, &surface) {
        let [x, y, z] = mesh.points[a as usize];
        notes.push(format!(
            "{count} nodes lie on others, nodes {a} and {b} at ({x:.6e}, {y:.6e}, {z:.6e}) m first: not \
             merged"
        ));
    }
    if let Some((hexahedron, tetrahedron)) = half_faces(mesh, &surface) {
        let [a, b] = [hexahedron, tetrahedron].map(|element| place(mesh, labels, element));
        notes.push(format!("a side of {a} is two triangles, {b} has one of them: no heat flows there"));
    }
    Ok(Quality { volume: worst.volume, scaled_jacobian: worst.scaled, aspect: worst.aspect, parts, notes })
}

/// Removes unused nodes, also from node sets; returns the old indices of those kept.
pub fn drop_unused_nodes(mesh: &mut Mesh) -> Vec<u32> {
    let mut number = vec![u32::MAX; mesh.points.len()];
    let others = mesh.others.iter().flat_map(|cell| cell.nodes());
    for node in mesh.hexahedra.iter().flatten().chain(mesh.tetrahedra.iter().flatten()).chain(others) {
        if let Some(number) = number.get_mut(*node as usize) {
            *number = 0;
        }
    }
    let kept: Vec<u32> = (0..number.len() as u32).filter(|node| number[*node as usize] == 0).collect();
    for (new, old) in kept.iter().enumerate() {
        number[*old as usize] = new as u32;
    }
    let renumber = |node: &mut u32| *node = number.get(*node as usize).copied().unwrap_or(u32::MAX);
    mesh.hexahedra.iter_mut().flatten().for_each(renumber);
    mesh.tetrahedra.iter_mut().flatten().for_each(renumber);
    mesh.others.iter_mut().flat_map(|cell| cell.nodes_mut()).for_each(renumber);
    for set in mesh.node_sets.values_mut() {
        set.iter_mut().for_each(renumber);
        set.retain(|node| *node != u32::MAX);
    }
    mesh.points = kept.iter().map(|old| mesh.points[*old as usize]).collect();
    kept
}

/// Number of elements of a work item.
const ITEM: usize = 4096;

/// Worst quality measures of some elements; the first element if equal.
#[derive(Clone, Copy, Debug)]
struct WorstMeasures {
    volume: f64,
    determinant: (f64, u32),
    scaled: (f64, u32),
    aspect: (f64, u32),
}

impl Default for WorstMeasures {
    fn default() -> Self {
        Self { volume: 0.0, determinant: (f64::INFINITY, 0), scaled: (f64::INFINITY, 0), aspect: (0.0, 0) }
    }
}

impl WorstMeasures {
    fn measure(mesh: &Mesh, elements: std::ops::Range<u32>) -> Self {
        elements.fold(Self::default(), |worst, element| {
            let [volume, determinant, scaled, aspect] = measures(mesh, element);
            worst.merge(Self {
                volume,
                determinant: (determinant, element),
                scaled: (scaled, element),
                aspect: (aspect, element),
            })
        })
    }

    fn merge(self, next: Self) -> Self {
        // NaN counts as the worst
        let least = |a: (f64, u32), b: (f64, u32)| if a.0.is_nan() || a.0 <= b.0 { a } else { b };
        let most = |a: (f64, u32), b: (f64, u32)| if a.0.is_nan() || a.0 >= b.0 { a } else { b };
        Self {
            volume: self.volume + next.volume,
            determinant: least(self.determinant, next.determinant),
            scaled: least(self.scaled, next.scaled),
            aspect: most(self.aspect, next.aspect),
        }
    }
}

/// Volume, smallest Jacobian determinant (of the map from the unit cube or corner), smallest scaled Jacobian,
/// ratio of edges.
fn measures(mesh: &Mesh, element: u32) -> [f64; 4] {
    let mut least = [f64::INFINITY; 2];
    let mut edges = [f64::INFINITY, 0.0];
    let mut take = |[a, b, c]: [Vector3<f64>; 3], corner: bool| {
        let determinant = a.cross(&b).dot(&c);
        let lengths = [a.norm(), b.norm(), c.norm()];
        let scaled = determinant / (lengths[0] * lengths[1] * lengths[2]);
        // `min` would ignore NaN
        least[0] = if determinant.is_nan() { f64::NAN } else { least[0].min(determinant) };
        if corner {
            // 0/0 of coincident nodes: the determinant decides
            least[1] = if scaled.is_nan() { 0.0 } else { least[1].min(scaled) };
            edges = lengths.iter().fold(edges, |[low, high], length| [low.min(*length), high.max(*length)]);
        }
        determinant
    };
    let volume = match *mesh.nodes(element) {
        [a, b, c, d] => {
            let x = [a, b, c, d].map(|node| mesh.point(node));
            let whole = take([x[1] - x[0], x[2] - x[0], x[3] - x[0]], true);
            for [p, q, r, s] in [[1, 2, 0, 3], [2, 0, 1, 3], [3, 0, 2, 1]] {
                take([x[q] - x[p], x[r] - x[p], x[s] - x[p]], true);
            }
            whole / 6.0
        }
        [a, b, c, d, e, f, g, h] => {
            let x = [a, b, c, d, e, f, g, h].map(|node| mesh.point(node));
            for (p, [q, r, s]) in CORNERS.into_iter().enumerate() {
                take([x[q] - x[p], x[r] - x[p], x[s] - x[p]], true);
            }
            let point = 0.5 / 3f64.sqrt();
            let mut volume = 0.0;
            for gauss in 0..8usize {
                let at = [0, 1, 2].map(|d| if gauss >> d & 1 == 1 { 0.5 + point } else { 0.5 - point });
                volume += 0.125 * take(gradient(&x, at), false);
            }
            volume
        }
        _ => return measures_of_other(mesh, element),
    };
    [volume, least[0], least[1], edges[1] / edges[0]]
}

/// Measures of a wedge or a second-order element, as in [`measures`]: Jacobian at corners and integration
/// points, and straight edges between corners.
fn measures_of_other(mesh: &Mesh, element: u32) -> [f64; 4] {
    let shape = mesh.shape(element);
    let x: Vec<Vector3<f64>> = mesh.nodes(element).iter().map(|&node| mesh.point(node)).collect();
    let determinant = |natural: &Natural| {
        let mut columns = [Vector3::zeros(); 3];
        for (place, slope) in x.iter().zip(&natural.gradients) {
            for (column, slope) in columns.iter_mut().zip(slope) {
                *column += (place - x[0]) * *slope;
            }
        }
        columns[0].cross(&columns[1]).dot(&columns[2])
    };
    let rule = QuadratureRule::for_shape(shape);
    let own: Vec<f64> = rule.at.iter().map(determinant).collect();
    let volume = own.iter().zip(&rule.weights).map(|(own, weight)| own * weight).sum();
    let mut least = [f64::INFINITY; 2];
    let mut edges = [f64::INFINITY, 0.0f64];
    let corners = (0..shape.corners()).map(|k| determinant(&Natural::new(shape, corner(shape, k))));
    for found in own.iter().copied().chain(corners) {
        least[0] = if found.is_nan() || least[0].is_nan() { f64::NAN } else { least[0].min(found) };
    }
    for k in 0..shape.corners() {
        let to = |&[p, q]: &[usize; 2]| (p == k).then_some(q).or((q == k).then_some(p));
        let at: Vec<Vector3<f64>> =
            shape.edges().iter().filter_map(to).map(|other| x[other] - x[k]).collect();
        let lengths = [at[0].norm(), at[1].norm(), at[2].norm()];
        // the determinants have determined its sign
        let scaled = at[0].cross(&at[1]).dot(&at[2]).abs() / (lengths[0] * lengths[1] * lengths[2]);
        least[1] = if scaled.is_nan() { 0.0 } else { least[1].min(scaled) };
        edges = lengths.iter().fold(edges, |[low, high], length| [low.min(*length), high.max(*length)]);
    }
    [volume, least[0], least[1], edges[1] / edges[0]]
}

/// Nodes adjacent to each corner of a hexahedron, ordered for a positive triple product.
const CORNERS: [[usize; 3]; 8] =
    [[1, 3, 4], [2, 0, 5], [3, 1, 6], [0, 2, 7], [7, 5, 0], [4, 6, 1], [5, 7, 2], [6, 4, 3]];

/// Gradients ∂x/∂ξ, ∂x/∂η, ∂x/∂ζ of a hexahedron at a point of the unit cube.
fn gradient(x: &[Vector3<f64>; 8], [s, t, u]: [f64; 3]) -> [Vector3<f64>; 3] {
    let mix = |a: Vector3<f64>, b: Vector3<f64>, t: f64| a * (1.0 - t) + b * t;
    [
        mix(mix(x[1] - x[0], x[2] - x[3], t), mix(x[5] - x[4], x[6] - x[7], t), u),
        mix(mix(x[3] - x[0], x[2] - x[1], s), mix(x[7] - x[4], x[6] - x[5], s), u),
        mix(mix(x[4] - x[0], x[5] - x[1], s), mix(x[7] - x[3], x[6] - x[2], s), t),
    ]
}

/// Describes an element in a message: its label and centre.
fn place(mesh: &Mesh, labels: Option<&[u64]>, element: u32) -> String {
    let [x, y, z] = mesh.centre(element);
    let kind = mesh.shape(element).name();
    let number = labels.and_then(|labels| labels.get(element as usize)).copied();
    format!("{kind} {} at ({x:.6e}, {y:.6e}, {z:.6e}) m", number.unwrap_or(element.into()))
}

/// Checks node numbers and coordinates.
fn check_numbers(mesh: &Mesh, labels: Option<&[u64]>) -> Result<(), Error> {
    if let Some((node, point)) =
        mesh.points.iter().enumerate().find(|(_, p)| p.iter().any(|x| !x.is_finite()))
    {
        return Err(Error::Mesh(format!("node {node} at {point:?} m; allowed: finite coordinates")));
    }
    let count = mesh.points.len();
    for element in 0..mesh.element_count() as u32 {
        let nodes = mesh.nodes(element);
        if let Some(node) = nodes.iter().find(|node| **node as usize >= count) {
            let number = labels.and_then(|labels| labels.get(element as usize)).copied();
            let number = number.unwrap_or(element.into());
            return Err(Error::Mesh(format!("element {number}: node {node}; allowed: below {count}")));
        }
        if let Some(node) = (1..nodes.len()).find_map(|k| nodes[..k].contains(&nodes[k]).then_some(nodes[k]))
        {
            let place = place(mesh, labels, element);
            return Err(Error::Mesh(format!("{place}: node {node} twice; allowed: different nodes")));
        }
    }
    Ok(())
}

/// Checks for duplicate elements.
fn check_duplicates(mesh: &Mesh, labels: Option<&[u64]>) -> Result<(), Error> {
    let mut keys: Vec<([u32; 8], u32)> = (0..mesh.element_count() as u32)
        .map(|element| {
            // corners distinguish elements
            let mut key = [u32::MAX; 8];
            let nodes = mesh.corners(element);
            key[..nodes.len()].copy_from_slice(nodes);
            key.sort_unstable();
            (key, element)
        })
        .collect();
    keys.par_sort_unstable();
    match keys.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        None => Ok(()),
        Some(pair) => {
            let [first, second] = [pair[0].1, pair[1].1].map(|element| place(mesh, labels, element));
            Err(Error::Mesh(format!("{second} has the nodes of {first}; allowed: each element once")))
        }
    }
}

/// Checks that sets are not empty, sorted, and in range.
fn check_sets(mesh: &Mesh) -> Result<(), Error> {
    let check = |kind: &str, name: &str, set: &[u32], count: usize| {
        let found = match set.last() {
            None => "empty".to_owned(),
            Some(last) if *last as usize >= count => format!("number {last} of {count}"),
            _ if !set.is_sorted_by(|a, b| a < b) => "not in ascending order".to_owned(),
            _ => return Ok(()),
        };
        Err(Error::Mesh(format!(
            "{kind} set `{name}`: {found}; allowed: existing {kind}s, ascending, 1 or more"
        )))
    };
    for (name, set) in &mesh.node_sets {
        check("node", name, set, mesh.points.len())?;
    }
    for (name, set) in &mesh.element_sets {
        check("element", name, set, mesh.element_count())?;
    }
    for (name, faces) in &mesh.surfaces {
        let missing = |face: &&Face| {
            face.element as usize >= mesh.element_count() || face.side >= mesh.side_count(face.element)
        };
        if faces.is_empty() {
            return Err(Error::Mesh(format!("surface `{name}`: empty; allowed: 1 face or more")));
        }
        if let Some(face) = faces.iter().find(missing) {
            let Face { element, side } = face;
            return Err(Error::Mesh(format!("surface `{name}`: element {element} has no side {side}")));
        }
    }
    Ok(())
}

/// Counts parts without shared nodes and unused nodes; returns also the first unused node.
fn parts(mesh: &Mesh) -> (usize, usize, usize) {
    let mut sets = DisjointSets::new(mesh.points.len());
    let mut used = vec![false; mesh.points.len()];
    for element in 0..mesh.element_count() as u32 {
        let nodes = mesh.nodes(element);
        for node in nodes {
            used[*node as usize] = true;
            sets.join(nodes[0], *node);
        }
    }
    let parts = (0..used.len()).filter(|&node| used[node] && sets.is_root(node as u32)).count();
    let unused = used.iter().filter(|used| !**used).count();
    (parts, unused, used.iter().position(|used| !used).unwrap_or(0))
}

/// Counts coincident nodes, within 1e-9 of the box's diagonal; returns also the first pair. Only nodes of the
/// outer surface are compared: faces between duplicate nodes are outer faces.
fn coincident_nodes(mesh: &Mesh, surface: &OuterSurface) -> Option<(usize, [u32; 2])> {
    let [lower, upper] = mesh.bounds()?;
    let near = 1e-9 * (Vector3::from(upper) - Vector3::from(lower)).norm();
    let faces: Vec<Face> = surface.faces().collect();
    let nodes = mesh.nodes_of(&faces);
    // cells much larger than the distance: most points search one cell only
    let cell = |x: f64, d: usize| ((x - lower[d]) / (64.0 * near)).floor() as i64;
    let mut sorted: Vec<([i64; 3], u32)> =
        nodes.iter().map(|n| ([0, 1, 2].map(|d| cell(mesh.points[*n as usize][d], d)), *n)).collect();
    sorted.par_sort_unstable();
    let mut pairs = Vec::new();
    for a in &nodes {
        let point = mesh.points[*a as usize];
        let low = [0, 1, 2].map(|d| cell(point[d] - near, d));
        let high = [0, 1, 2].map(|d| cell(point[d] + near, d));
        for (i, j) in (low[0]..=high[0]).flat_map(|i| (low[1]..=high[1]).map(move |j| (i, j))) {
            let first = sorted.partition_point(|entry| entry.0 < [i, j, low[2]]);
            let inside = sorted[first..].iter().take_while(|entry| entry.0 <= [i, j, high[2]]);
            let close = inside
                .map(|entry| entry.1)
                .find(|b| *b < *a && (0..3).all(|d| (mesh.points[*b as usize][d] - point[d]).abs() <= near));
            if let Some(b) = close {
                pairs.push([b, *a]);
                break;
            }
        }
    }
    Some((pairs.len(), *pairs.first()?))
}

/// Finds a hexahedron and a tetrahedron that meet at half a side.
fn half_faces(mesh: &Mesh, surface: &OuterSurface) -> Option<(u32, u32)> {
    let has = |corners: usize| mesh.others.iter().any(|cell| cell.shape.corners() == corners);
    let squares = !mesh.hexahedra.is_empty() || has(8) || has(6);
    let split = !mesh.tetrahedra.is_empty() || has(4) || has(6);
    if !(squares && split) {
        return None;
    }
    let mut triangles: Vec<([u32; 3], u32)> = Vec::new();
    for face in surface.faces() {
        if let [a, b, c] = *mesh.face_nodes(face).corners() {
            let mut key = [a, b, c];
            key.sort_unstable();
            triangles.push((key, face.element));
        }
    }
    triangles.sort_unstable();
    surface.faces().find_map(|face| {
        let [a, b, c, d] = *mesh.face_nodes(face).corners() else { return None };
        [[a, b, c], [b, c, d], [c, d, a], [d, a, b]].into_iter().find_map(|mut key| {
            key.sort_unstable();
            let place = triangles.binary_search_by_key(&key, |entry| entry.0).ok()?;
            Some((face.element, triangles[place].1))
        })
    })
}

#[cfg(test)]
mod tests;
