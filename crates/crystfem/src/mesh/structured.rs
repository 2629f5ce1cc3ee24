//! Structured meshes: grid lines along the axes, and filled boxes.

use crate::error::Error;
use crate::mesh::split::{CellSplit, split};
use crate::mesh::{BOX_SIDES, Face, Mesh};

/// Coordinates within this fraction of the extent are equal.
const COORDINATE_TOLERANCE: f64 = 1e-9;

/// Largest number of nodes of a mesh: 2²⁸, or 15 GB of mesh alone, so that a typing error in a size gives a
/// message instead of exhausting memory.
pub(crate) const MAX_NODES: usize = 1 << 28;

/// A named box, filled with elements.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// Name of the element set.
    pub name: String,
    /// Smallest coordinates, m.
    pub lower: [f64; 3],
    /// Largest coordinates, m.
    pub upper: [f64; 3],
}

/// Grid lines along x, y and z, m, ascending, with conforming hexahedra between them.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Coordinates of the lines.
    pub lines: [Vec<f64>; 3],
}

impl Grid {
    /// Divides a box into equal elements.
    ///
    /// # Errors
    /// [`Error::Mesh`] or [`Error::Parameter`] for a box without volume, no elements, and more than 2²⁸
    /// nodes.
    pub fn uniform(lower: [f64; 3], upper: [f64; 3], elements: [usize; 3]) -> Result<Self, Error> {
        check_node_count(elements.map(|count| count as f64))?;
        let mut lines = [const { Vec::new() }; 3];
        for d in 0..3 {
            let [low, high, count] = [lower[d], upper[d], elements[d] as f64];
            if !(low.is_finite() && high.is_finite() && high > low) {
                let axis = ["x", "y", "z"][d];
                return Err(Error::Mesh(format!(
                    "the box from {low} to {high} m along {axis} has no extent"
                )));
            }
            if !(1..MAX_NODES).contains(&elements[d]) {
                let allowed = format!("1 … {}", MAX_NODES - 1);
                return Err(Error::Parameter { name: "elements along an axis", found: count, allowed });
            }
            lines[d] = (0..=elements[d])
                .map(|k| if k == elements[d] { high } else { low + (high - low) * (k as f64 / count) })
                .collect();
        }
        let grid = Self { lines };
        grid.check()?;
        Ok(grid)
    }

    /// Places lines at all faces of the blocks, and between them equal elements no longer than `size`.
    ///
    /// # Errors
    /// [`Error::Mesh`] or [`Error::Parameter`] for no blocks, a block without volume, a size that is not
    /// positive, and more than 2²⁸ nodes.
    pub fn through(blocks: &[Block], size: [f64; 3]) -> Result<Self, Error> {
        let mut lines = [const { Vec::new() }; 3];
        for (d, line) in lines.iter_mut().enumerate() {
            for block in blocks {
                block.check()?;
                line.extend([block.lower[d], block.upper[d]]);
            }
            let faces = unique(std::mem::take(line));
            line.extend(faces.first());
            for ends in faces.windows(2) {
                let lengths = graded(ends[1] - ends[0], size[d], 1.0)?;
                let count = lengths.len() as f64;
                let inner = (1..lengths.len()).map(|k| ends[0] + (ends[1] - ends[0]) * (k as f64 / count));
                line.extend(inner.chain([ends[1]]));
            }
        }
        let grid = Self { lines };
        grid.check()?;
        Ok(grid)
    }

    /// Meshes the whole grid as one block: hexahedra, an element set `name`, and surfaces and node sets on
    /// the sides of the box, [`BOX_SIDES`].
    ///
    /// # Errors
    /// [`Error::Mesh`] or [`Error::Parameter`] for lines that do not ascend, and more than 2²⁸ nodes.
    pub fn mesh(&self, name: &str) -> Result<Mesh, Error> {
        self.check()?;
        let end = |line: &Vec<f64>, first: bool| if first { line[0] } else { line[line.len() - 1] };
        let [lower, upper] = [true, false].map(|first| self.lines.each_ref().map(|line| end(line, first)));
        self.blocks(&[Block { name: name.to_owned(), lower, upper }], CellSplit::Hexahedra)
    }

    /// Meshes the cells inside any block, with element sets of the blocks (which may overlap: an element is
    /// in the set of each), and surfaces and node sets on the sides of the bounding box, [`BOX_SIDES`].
    ///
    /// # Errors
    /// [`Error::Mesh`] or [`Error::Parameter`] for lines that do not ascend, a block without volume or
    /// elements, and more than 2²⁸ nodes.
    pub fn blocks(&self, blocks: &[Block], cells: CellSplit) -> Result<Mesh, Error> {
        self.check()?;
        let [nx, ny, nz] = self.lines.each_ref().map(|line| line.len() - 1);
        let mut ranges = Vec::with_capacity(blocks.len());
        for block in blocks {
            block.check()?;
            // the centre of a cell decides
            let range: [_; 3] = std::array::from_fn(|d| {
                let line = &self.lines[d];
                let cells = &line[..line.len() - 1];
                // centres ascend: binary search takes ten comparisons for a thousand layers
                let until = |end: f64| {
                    let (mut low, mut high) = (0, cells.len());
                    while low < high {
                        let k = low.midpoint(high);
                        if 0.5 * (line[k] + line[k + 1]) > end { high = k } else { low = k + 1 }
                    }
                    low
                };
                until(block.lower[d])..until(block.upper[d])
            });
            if range.iter().any(std::ops::Range::is_empty) {
                return Err(Error::Mesh(format!("block `{}` contains no element of the grid", block.name)));
            }
            ranges.push((&block.name, range));
        }
        let cell = |i: usize, j: usize, k: usize| i + nx * (j + ny * k);
        let mut element_of = vec![u32::MAX; nx * ny * nz];
        for (_, [x, y, z]) in &ranges {
            for (k, j) in z.clone().flat_map(|k| y.clone().map(move |j| (k, j))) {
                element_of[cell(x.start, j, k)..cell(x.end - 1, j, k) + 1].fill(0);
            }
        }
        let mut mesh = Mesh::default();
        let mut odd = Vec::new();
        self.number(&mut element_of, &mut mesh, &mut odd);
        for (name, [x, y, z]) in &ranges {
            let set = mesh.element_sets.entry((*name).clone()).or_default();
            for (k, j) in z.clone().flat_map(|k| y.clone().map(move |j| (k, j))) {
                set.extend(&element_of[cell(x.start, j, k)..cell(x.end - 1, j, k) + 1]);
            }
            // cells ascend; blocks of one name may not
            set.sort_unstable();
            set.dedup();
        }
        self.sides(&element_of, &mut mesh);
        Ok(split(mesh, &odd, cells))
    }

    /// Meshes each filled cell by a hexahedron, x fastest: element sets `name` and, of each layer of cells
    /// with an element, `layer-1`, … upwards, surfaces and node sets on the sides of the bounding box,
    /// [`BOX_SIDES`].
    ///
    /// # Errors
    /// [`Error::Mesh`] or [`Error::Parameter`] for lines that do not ascend, more than 2²⁸ nodes, another
    /// number of cells, and no filled cell.
    pub(crate) fn cells(&self, name: &str, filled: &[bool]) -> Result<Mesh, Error> {
        self.check()?;
        let [nx, ny, nz] = self.lines.each_ref().map(|line| line.len() - 1);
        if filled.len() != nx * ny * nz || !filled.contains(&true) {
            return Err(Error::Mesh(format!("no filled cell of {}", nx * ny * nz)));
        }
        let mut element_of: Vec<u32> =
            filled.iter().map(|&filled| if filled { 0 } else { u32::MAX }).collect();
        let mut mesh = Mesh::default();
        self.number(&mut element_of, &mut mesh, &mut Vec::new());
        let layers = element_of
            .chunks(nx * ny)
            .map(|layer| layer.iter().copied().filter(|&element| element != u32::MAX).collect::<Vec<u32>>());
        for (number, layer) in (1..).zip(layers.filter(|layer| !layer.is_empty())) {
            mesh.element_sets.insert(format!("layer-{number}"), layer);
        }
        mesh.element_sets.insert(name.to_owned(), (0..mesh.hexahedra.len() as u32).collect());
        self.sides(&element_of, &mut mesh);
        Ok(mesh)
    }

    /// Numbers filled cells and their nodes, x fastest; `odd` is the parity of i + j + k of each element.
    fn number(&self, element_of: &mut [u32], mesh: &mut Mesh, odd: &mut Vec<bool>) {
        let [nx, ny, nz] = self.lines.each_ref().map(|line| line.len() - 1);
        // corners of two layers of nodes at a time: lower and upper
        let mut layers = [vec![u32::MAX; (nx + 1) * (ny + 1)], vec![u32::MAX; (nx + 1) * (ny + 1)]];
        let filled = |i: usize, j: usize, k: usize, element_of: &[u32]| {
            i < nx && j < ny && k < nz && element_of[i + nx * (j + ny * k)] != u32::MAX
        };
        let cells = element_of.iter().filter(|&&element| element != u32::MAX).count();
        mesh.hexahedra.reserve_exact(cells);
        odd.reserve_exact(cells);
        let mut count = 0;
        for k in 0..=nz {
            layers.swap(0, 1);
            let [below, above] = &mut layers;
            above.fill(u32::MAX);
            for (j, i) in (0..=ny).flat_map(|j| (0..=nx).map(move |i| (j, i))) {
                // node (i, j, k) is a corner of up to eight cells; wrapping excludes −1
                let used = (0..8).any(|c| {
                    let [i, j, k] =
                        [i.wrapping_sub(c & 1), j.wrapping_sub(c >> 1 & 1), k.wrapping_sub(c >> 2)];
                    filled(i, j, k, element_of)
                });
                if used {
                    above[i + (nx + 1) * j] = mesh.points.len() as u32;
                    mesh.points.push([self.lines[0][i], self.lines[1][j], self.lines[2][k]]);
                }
            }
            for (j, i) in (0..ny).flat_map(|j| (0..nx).map(move |i| (j, i))) {
                if k > 0 && filled(i, j, k - 1, element_of) {
                    element_of[i + nx * (j + ny * (k - 1))] = count;
                    count += 1;
                    let n = i + (nx + 1) * j;
                    let round = [n, n + 1, n + nx + 2, n + nx + 1];
                    let [a, b] = [round.map(|n| below[n]), round.map(|n| above[n])];
                    mesh.hexahedra.push([a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3]]);
                    odd.push((i + j + k - 1) % 2 == 1);
                }
            }
        }
        mesh.points.shrink_to_fit();
    }

    /// Builds surfaces and node sets on the sides of the bounding box of the filled cells.
    fn sides(&self, element_of: &[u32], mesh: &mut Mesh) {
        let n = self.lines.each_ref().map(|line| line.len() - 1);
        let cell = |at: [usize; 3]| element_of[at[0] + n[0] * (at[1] + n[1] * at[2])];
        for (number, name) in BOX_SIDES.into_iter().enumerate() {
            let (d, last) = (number / 2, number % 2 == 1);
            // sides of a hexahedron at x−, x+, y−, y+, z−, z+
            let side = [5, 3, 2, 4, 0, 1][number];
            let others = [(d + 1) % 3, (d + 2) % 3];
            let plane = |layer: usize| {
                let mut faces = Vec::new();
                for b in 0..n[others[1]] {
                    for a in 0..n[others[0]] {
                        let mut at = [layer; 3];
                        at[others[0]] = a;
                        at[others[1]] = b;
                        if cell(at) != u32::MAX {
                            faces.push(Face { element: cell(at), side });
                        }
                    }
                }
                faces.sort_unstable();
                faces
            };
            let mut order: Box<dyn Iterator<Item = usize>> =
                if last { Box::new((0..n[d]).rev()) } else { Box::new(0..n[d]) };
            let faces = order.find_map(|layer| Some(plane(layer)).filter(|faces| !faces.is_empty()));
            let faces = faces.unwrap_or_default();
            mesh.node_sets.insert(name.to_owned(), mesh.nodes_of(&faces));
            mesh.surfaces.insert(name.to_owned(), faces);
        }
    }

    /// Checks that lines ascend and that the nodes can be numbered.
    fn check(&self) -> Result<(), Error> {
        for (line, axis) in self.lines.iter().zip(["x", "y", "z"]) {
            if line.len() < 2 {
                return Err(Error::Mesh(format!(
                    "{} grid lines along {axis}; allowed: 2 or more",
                    line.len()
                )));
            }
            if let Some(ends) = line.windows(2).find(|ends| !(ends[1] - ends[0] > 0.0 && ends[1].is_finite()))
            {
                let [a, b] = [ends[0], ends[1]];
                return Err(Error::Mesh(format!("grid lines along {axis} do not ascend: {a} m, then {b} m")));
            }
        }
        check_node_count(self.lines.each_ref().map(|line| line.len() as f64 - 1.0))
    }
}

/// Refuses numbers of elements along each axis whose nodes cannot be numbered.
pub(crate) fn check_node_count(elements: [f64; 3]) -> Result<(), Error> {
    let nodes: f64 = elements.iter().map(|count| count + 1.0).product();
    if nodes <= MAX_NODES as f64 {
        return Ok(());
    }
    let allowed = format!("at most {MAX_NODES}");
    Err(Error::Parameter { name: "nodes of a structured mesh", found: nodes, allowed })
}

impl Block {
    fn check(&self) -> Result<(), Error> {
        for (d, axis) in ["x", "y", "z"].into_iter().enumerate() {
            let (lower, upper) = (self.lower[d], self.upper[d]);
            if !(upper - lower > 0.0 && lower.is_finite() && upper.is_finite()) {
                let name = &self.name;
                return Err(Error::Mesh(format!(
                    "block `{name}` has no extent along {axis}: from {lower} m to {upper} m"
                )));
            }
        }
        Ok(())
    }
}

/// Lengths of elements that fill `length`: the first at most `first`, each `growth` times the one before.
/// Their sum is `length` to rounding.
///
/// # Errors
/// [`Error::Parameter`] for a length or first element that is not positive, a growth below 1, and more than
/// 2²⁸ elements.
pub fn graded(length: f64, first: f64, growth: f64) -> Result<Vec<f64>, Error> {
    let count = count(length, first, growth)?;
    let relative: Vec<f64> = (0..count as i32).map(|k| growth.powi(k)).collect();
    let sum: f64 = relative.iter().sum();
    Ok(relative.into_iter().map(|part| length * (part / sum)).collect())
}

/// Number of elements of [`graded`].
pub(crate) fn count(length: f64, first: f64, growth: f64) -> Result<f64, Error> {
    for (name, found) in [("length", length), ("element size", first)] {
        if !(found > 0.0 && found.is_finite()) {
            return Err(Error::Parameter { name, found, allowed: "positive and finite, m".into() });
        }
    }
    if !(growth >= 1.0 && growth.is_finite()) {
        return Err(Error::Parameter {
            name: "growth of elements",
            found: growth,
            allowed: "1 or more".into(),
        });
    }
    // a last element of less than a billionth is rounding
    let ratio = length / first * (1.0 - COORDINATE_TOLERANCE);
    let count = if growth == 1.0 { ratio } else { (1.0 + ratio * (growth - 1.0)).ln() / growth.ln() };
    if count.is_nan() || count.ceil() >= MAX_NODES as f64 {
        let allowed = format!("at most {}", MAX_NODES - 1);
        return Err(Error::Parameter { name: "elements along an axis", found: count.ceil(), allowed });
    }
    Ok(count.ceil().max(1.0))
}

/// Sorts coordinates; those closer than [`COORDINATE_TOLERANCE`] of the extent become one.
pub(crate) fn unique(mut values: Vec<f64>) -> Vec<f64> {
    values.sort_unstable_by(f64::total_cmp);
    let extent = values.last().zip(values.first()).map_or(0.0, |(last, first)| last - first);
    values.dedup_by(|next, kept| *next - *kept <= COORDINATE_TOLERANCE * extent);
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::quality;

    #[test]
    fn a_uniform_brick_has_its_counts_and_sides() {
        let mesh = Grid::uniform([0.0; 3], [1.0, 2.0, 3.0], [2, 3, 4]).unwrap().mesh("brick").unwrap();
        assert_eq!((mesh.points.len(), mesh.hexahedra.len()), (3 * 4 * 5, 24));
        assert_eq!(mesh.element_sets["brick"].len(), 24);
        let counts: Vec<_> = BOX_SIDES.iter().map(|side| mesh.surfaces[*side].len()).collect();
        assert_eq!(counts, [12, 12, 8, 8, 6, 6]);
        for (number, side) in BOX_SIDES.iter().enumerate() {
            let (d, value) = (number / 2, if number % 2 == 0 { 0.0 } else { [1.0, 2.0, 3.0][number / 2] });
            for face in &mesh.surfaces[*side] {
                assert!(mesh.face_nodes(*face).iter().all(|node| mesh.points[*node as usize][d] == value));
            }
        }
        let volume = quality::check(&mesh, None).unwrap().volume;
        assert!((volume - 6.0).abs() < 1e-13);
    }

    #[test]
    fn an_l_shape_of_blocks_has_no_nodes_in_its_gap() {
        let block = |name: &str, lower, upper| Block { name: name.into(), lower, upper };
        let blocks = [
            block("foot", [0.0; 3], [3.0, 1.0, 1.0]),
            block("leg", [0.0; 3], [1.0, 1.0, 3.0]),
            block("head", [0.0, 0.0, 2.0], [1.0, 1.0, 3.0]),
        ];
        let grid = Grid::through(&blocks, [0.5, 1.0, 0.5]).unwrap();
        assert_eq!(grid.lines[0].len(), 7);
        let mesh = grid.blocks(&blocks, CellSplit::Hexahedra).unwrap();
        assert_eq!(mesh.hexahedra.len(), 12 + 8);
        assert_eq!(mesh.element_sets["leg"].len(), 12);
        assert!(mesh.element_sets["head"].iter().all(|e| mesh.element_sets["leg"].contains(e)));
        // rows of y: foot 7 × 3 nodes in (x, z), leg 3 × 4 more
        assert_eq!(mesh.points.len(), 2 * (21 + 12));
        assert_eq!(mesh.surfaces["right"].len(), 2);
        assert_eq!(mesh.surfaces["top"].len(), 2);
        assert!((quality::check(&mesh, None).unwrap().volume - 5.0).abs() < 1e-13);
    }

    #[test]
    fn invalid_grids_are_refused() {
        let text = |result: Result<Grid, Error>| result.unwrap_err().to_string();
        assert!(text(Grid::uniform([0.0; 3], [1.0, 0.0, 1.0], [1; 3])).contains("along y has no extent"));
        assert!(text(Grid::uniform([0.0; 3], [1.0; 3], [0, 1, 1])).contains("found 0; allowed: 1 …"));
        assert!(text(Grid::uniform([0.0; 3], [1.0; 3], [10_000; 3])).contains("nodes of a structured mesh"));
        let flat = Block { name: "flat".into(), lower: [0.0; 3], upper: [1.0, 1.0, 0.0] };
        assert!(text(Grid::through(&[flat], [1.0; 3])).contains("block `flat` has no extent along z"));
        assert!(text(Grid::through(&[], [1.0; 3])).contains("grid lines"));
        let mut grid = Grid::uniform([0.0; 3], [1.0; 3], [2; 3]).unwrap();
        let far = Block { name: "far".into(), lower: [2.0; 3], upper: [3.0; 3] };
        let error = grid.blocks(&[far], CellSplit::Hexahedra).unwrap_err().to_string();
        assert!(error.contains("`far` contains no element"));
        grid.lines[1].swap(0, 1);
        assert!(
            grid.mesh("brick").unwrap_err().to_string().contains("along y do not ascend: 0.5 m, then 0 m")
        );
        grid.lines[1][0] = f64::NAN;
        assert!(grid.mesh("brick").is_err());
    }

    #[test]
    fn graded_lengths_fill_and_grow() {
        let lengths = graded(1.0, 0.1, 1.5).unwrap();
        assert!((lengths.iter().sum::<f64>() - 1.0).abs() < 1e-15);
        assert!(lengths[0] <= 0.1 && lengths.windows(2).all(|pair| (pair[1] / pair[0] - 1.5).abs() < 1e-12));
        // ten tenths are ten elements in spite of rounding
        assert_eq!(graded(1.0, 0.1, 1.0).unwrap().len(), 10);
        assert_eq!(graded(0.3, 0.1, 1.0).unwrap().len(), 3);
        for (length, first, growth) in
            [(0.0, 1.0, 1.0), (1.0, f64::NAN, 1.0), (1.0, 1.0, 0.9), (1.0, 1e-300, 1.0), (1.0, -1.0, 2.0)]
        {
            assert!(graded(length, first, growth).is_err(), "{length} {first} {growth}");
        }
    }
}
