//! Plane sections of rectangles.

use super::structured::unique;
use crate::error::Error;
use crate::mesh::PlaneSection;
use std::collections::BTreeMap;

/// A rectangle of a section, filled with equal quadrangles.
#[derive(Clone, Debug, PartialEq)]
pub struct Rectangle {
    /// Name of its elements; its sides, where no other rectangle covers them, are `NAME-inner`, `NAME-outer`,
    /// `NAME-bottom` and `NAME-top`.
    pub name: String,
    /// Least radius and z, m.
    pub lower: [f64; 2],
    /// Largest radius and z, m.
    pub upper: [f64; 2],
    /// Elements along r and z.
    pub elements: [usize; 2],
}

impl Rectangle {
    /// Lines along r or z, m.
    fn lines(&self, d: usize) -> impl Iterator<Item = f64> + '_ {
        let (low, high, count) = (self.lower[d], self.upper[d], self.elements[d]);
        let inner = move |k| low + (high - low) * (k as f64 / count as f64);
        (0..=count).map(move |k| if k == count { high } else { inner(k) })
    }
}

impl PlaneSection {
    /// Fills rectangles, which meet where they share a side.
    ///
    /// # Errors
    /// [`Error::Mesh`] for a rectangle without extent or elements, rectangles that overlap, and sides whose
    /// nodes do not meet.
    pub fn rectangles(rectangles: &[Rectangle]) -> Result<Self, Error> {
        for Rectangle { name, lower, upper, elements } in rectangles {
            if !(0..2).all(|d| upper[d] > lower[d] && lower[d].is_finite() && upper[d].is_finite()) {
                return Err(Error::Mesh(format!(
                    "block `{name}` has no extent: from {lower:?} to {upper:?} m"
                )));
            }
            if elements.contains(&0) {
                return Err(Error::Mesh(format!(
                    "block `{name}` has {elements:?} elements; allowed: 1 or more"
                )));
            }
        }
        let grid = [0, 1].map(|d| unique(rectangles.iter().flat_map(|own| own.lines(d)).collect()));
        // a line of a rectangle is the nearest of the grid
        let nearest = |d: usize, x: f64| {
            let after = grid[d].partition_point(|&line| line < x);
            let near = [after.saturating_sub(1), after.min(grid[d].len() - 1)];
            near.into_iter().min_by(|&a, &b| (grid[d][a] - x).abs().total_cmp(&(grid[d][b] - x).abs()))
        };
        let mut section = Self::default();
        let mut node_at: BTreeMap<[usize; 2], u32> = BTreeMap::new();
        let mut spans: Vec<[[usize; 2]; 2]> = Vec::new();
        let mut edges: Vec<[[usize; 2]; 2]> = Vec::new();
        for own in rectangles {
            let [r, z] = [0, 1].map(|d| own.lines(d).filter_map(|x| nearest(d, x)).collect::<Vec<usize>>());
            let [nr, nz] = own.elements;
            let span = [[r[0], z[0]], [r[nr], z[nz]]];
            let over = |other: &[[usize; 2]; 2]| {
                (0..2).all(|d| span[0][d] < other[1][d] && other[0][d] < span[1][d])
            };
            if let Some(other) = spans.iter().position(over) {
                let (name, other) = (&own.name, &rectangles[other].name);
                return Err(Error::Mesh(format!(
                    "blocks `{other}` and `{name}` overlap; allowed: blocks that meet"
                )));
            }
            spans.push(span);
            let mut node = |i: usize, k: usize| {
                *node_at.entry([r[i], z[k]]).or_insert_with(|| {
                    section.points.push([grid[0][r[i]], grid[1][z[k]]]);
                    section.points.len() as u32 - 1
                })
            };
            for k in 0..nz {
                for i in 0..nr {
                    let ring = vec![node(i, k), node(i + 1, k), node(i + 1, k + 1), node(i, k + 1)];
                    let number = section.elements.len() as u32;
                    section.element_sets.entry(own.name.clone()).or_default().push(number);
                    section.elements.push(ring);
                }
            }
            let mut side = |side: &str, ends: Vec<[u32; 2]>| {
                section.edges.entry(format!("{}-{side}", own.name)).or_default().extend(ends);
            };
            side("inner", (0..nz).map(|k| [node(0, k), node(0, k + 1)]).collect());
            side("outer", (0..nz).map(|k| [node(nr, k), node(nr, k + 1)]).collect());
            side("bottom", (0..nr).map(|i| [node(i, 0), node(i + 1, 0)]).collect());
            side("top", (0..nr).map(|i| [node(i, nz), node(i + 1, nz)]).collect());
            for k in [0, nz] {
                edges.extend((0..nr).map(|i| [[r[i], z[k]], [r[i + 1], z[k]]]));
            }
            for i in [0, nr] {
                edges.extend((0..nz).map(|k| [[r[i], z[k]], [r[i], z[k + 1]]]));
            }
        }
        let key = |&[a, b]: &[u32; 2]| [a.min(b), a.max(b)];
        let mut times: BTreeMap<[u32; 2], usize> = BTreeMap::new();
        section.edges.values().flatten().for_each(|ends| *times.entry(key(ends)).or_default() += 1);
        section.edges.values_mut().for_each(|ends| ends.retain(|ends| times[&key(ends)] == 1));
        let inside = |&[a, b]: &[[usize; 2]; 2]| {
            let d = usize::from(a[0] == b[0]);
            (a[d] + 1..b[d])
                .map(|line| if d == 0 { [line, a[1]] } else { [a[0], line] })
                .find(|place| node_at.contains_key(place))
        };
        match edges.iter().find_map(inside) {
            None => Ok(section),
            Some([r, z]) => Err(Error::Mesh(format!(
                "blocks do not meet at r = {:.6e} m, z = {:.6e} m, a node on the side of another's element; \
                 allowed: the same lines on both sides",
                grid[0][r], grid[1][z]
            ))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::surface::area;
    use crate::mesh::{RevolvedCells, quality};

    fn block(name: &str, lower: [f64; 2], upper: [f64; 2], elements: [usize; 2]) -> Rectangle {
        Rectangle { name: name.into(), lower, upper, elements }
    }

    /// A shaft with a flange: the volume of both, and the shaft's outside without what the flange covers.
    #[test]
    fn blocks_meet() {
        let shaft = block("shaft", [0.0, 0.0], [0.1, 0.3], [3, 9]);
        let flange = block("flange", [0.1, 0.1], [0.3, 0.2], [5, 3]);
        let section = PlaneSection::rectangles(&[shaft, flange]).unwrap();
        assert_eq!(section.points.len(), 4 * 10 + 5 * 4);
        let body = section.revolve(0.1, 1, RevolvedCells::Hexahedra).unwrap();
        let found = quality::check(&body.mesh, None).unwrap();
        let solid = 0.01 * 0.3 + (0.09 - 0.01) * 0.1;
        assert!((found.volume / (0.5 * 0.1_f64.sin() * solid) - 1.0).abs() < 1e-12);
        assert_eq!((found.parts, body.mesh.element_sets["flange"].len()), (1, 15));
        let own =
            |name: &str| body.mesh.surfaces[name].iter().map(|face| area(&body.mesh, *face)).sum::<f64>();
        let chord = 2.0 * 0.05_f64.sin();
        assert!((own("shaft-outer") / (0.1 * chord * 0.2) - 1.0).abs() < 1e-12);
        assert!((own("flange-outer") / (0.3 * chord * 0.1) - 1.0).abs() < 1e-12);
        for covered in ["shaft-inner", "flange-inner"] {
            assert!(!body.mesh.surfaces.contains_key(covered));
        }
    }

    #[test]
    fn invalid_blocks_are_refused() {
        let shaft = block("shaft", [0.0, 0.0], [0.1, 0.3], [3, 9]);
        let refused = |other: Rectangle, words: &str| {
            let error = PlaneSection::rectangles(&[shaft.clone(), other]).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        };
        refused(block("flange", [0.1, 0.1], [0.1, 0.2], [5, 3]), "block `flange` has no extent");
        refused(block("flange", [0.1, 0.1], [0.3, 0.2], [5, 0]), "allowed: 1 or more");
        refused(block("flange", [0.05, 0.1], [0.3, 0.2], [5, 3]), "blocks `shaft` and `flange` overlap");
        refused(block("flange", [0.1, 0.1], [0.3, 0.2], [5, 2]), "blocks do not meet at r = 1.0");
    }
}
