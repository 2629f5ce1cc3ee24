//! Parts of a body of shapes, and the bonds across their interfaces.

use super::{Operation, Shape};
use crate::bonds::BodyGeometry;
use crate::parallel;

/// Fraction of a bond's length below which a piece of it is rounding, where faces meet.
const THIN: f64 = 1e-6;

/// Shapes with the number of their part: a point belongs to the part of the last shape that adds it.
#[derive(Clone, Debug)]
pub struct Parts<const D: usize> {
    operations: Vec<(Operation<D>, u32)>,
}

impl<const D: usize> Parts<D> {
    /// Numbers the part of each operation; those of cuts are ignored.
    pub fn new(operations: &[Operation<D>], parts: &[u32]) -> Self {
        Self { operations: operations.iter().cloned().zip(parts.iter().copied()).collect() }
    }

    /// Returns the part of a point; `None` outside of the body.
    pub fn part_at(&self, point: [f64; D]) -> Option<u32> {
        let last = self.operations.iter().rev().find(|(operation, _)| operation.shape().contains(point));
        last.and_then(|(operation, part)| matches!(operation, Operation::Add(_)).then_some(*part))
    }

    /// Bounding box of all shapes of a part; `None` without any.
    pub fn bounds(&self, part: u32) -> Option<([f64; D], [f64; D])> {
        let own = self.operations.iter().filter(|(_, of)| *of == part);
        super::bounds(&own.map(|(operation, _)| operation.clone()).collect::<Vec<_>>())
    }

    /// Distance of the bounding boxes of two parts, m; 0 where they meet.
    pub fn gap(&self, pair: [u32; 2]) -> f64 {
        let [Some((low, high)), Some((from, to))] = pair.map(|part| self.bounds(part)) else { return 0.0 };
        let along = |d: usize| (low[d] - to[d]).max(from[d] - high[d]).max(0.0);
        (0..D).map(|d| along(d).powi(2)).sum::<f64>().sqrt()
    }

    /// Fractions of the segment from `a` to `b` at which it enters or leaves a shape.
    pub fn passages(&self, a: [f64; D], b: [f64; D]) -> Vec<f64> {
        let mut ends = Vec::new();
        self.operations.iter().for_each(|(operation, _)| operation.shape().passages(a, b, &mut ends));
        ends
    }

    /// Finds the bonds whose straight line passes from one part of a pair to the other, for each pair: by
    /// their sites, ascending. A bond across a thin part crosses two interfaces.
    pub fn bonds_across(&self, bonds: &dyn BodyGeometry<D>, pairs: &[[u32; 2]]) -> Vec<Vec<[u32; 2]>> {
        let of = |&site: &u32| {
            let here = bonds.position(site as usize);
            let mut found = Vec::new();
            if !self.is_near_another(here, bonds.horizon() * (1.0 + 1e-9)) {
                return found;
            }
            bonds.neighbours(site as usize, &mut |bond| {
                if (site as usize) < bond.site {
                    for pair in self.passed(here, bonds.position(bond.site)) {
                        let wanted = pairs.iter().position(|[a, b]| pair == [*a.min(b), *a.max(b)]);
                        found.extend(wanted.map(|index| (index, [site, bond.site as u32])));
                    }
                }
            });
            found
        };
        let found: Vec<Vec<(usize, [u32; 2])>> = parallel::map_each(bonds.particles(), of);
        let mut across = vec![Vec::new(); pairs.len()];
        found.into_iter().flatten().for_each(|(index, bond)| across[index].push(bond));
        across
    }

    /// Returns true if shapes of two parts lie within `reach` of a point along every axis.
    fn is_near_another(&self, point: [f64; D], reach: f64) -> bool {
        let near = |shape: &Shape<D>| {
            let (low, high) = shape.bounds();
            (0..D).all(|d| low[d] - reach <= point[d] && point[d] <= high[d] + reach)
        };
        let mut parts = self.operations.iter().filter_map(|(operation, part)| match operation {
            Operation::Add(shape) if near(shape) => Some(*part),
            _ => None,
        });
        let first = parts.next();
        parts.any(|part| Some(part) != first)
    }

    /// Lists the pairs of parts between which the segment from `a` to `b` passes, each once and ascending;
    /// the space between two parts belongs to their interface.
    fn passed(&self, a: [f64; D], b: [f64; D]) -> Vec<[u32; 2]> {
        let mut ends = self.passages(a, b);
        ends.extend([0.0, 1.0]);
        ends.sort_by(f64::total_cmp);
        let middles = ends.windows(2).filter(|pair| pair[1] - pair[0] > THIN).map(|pair| {
            let part = 0.5 * (pair[0] + pair[1]);
            std::array::from_fn(|d| a[d] + part * (b[d] - a[d]))
        });
        let places = std::iter::once(a).chain(middles).chain([b]);
        let parts: Vec<u32> = places.filter_map(|place| self.part_at(place)).collect();
        let mut pairs: Vec<[u32; 2]> = parts
            .windows(2)
            .filter(|pair| pair[0] != pair[1])
            .map(|pair| [pair[0].min(pair[1]), pair[0].max(pair[1])])
            .collect();
        pairs.sort_unstable();
        pairs.dedup();
        pairs
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Body;

    /// Counts by hand, at a horizon of 1.5 cells: each cell beside an interface has 3 bonds across it, at the
    /// ends of the row 2.
    #[test]
    fn bonds_across_a_plane_and_around_a_hole() {
        let layer = |low: f64| Shape::rectangle([0.0, low], [6.0, low + 2.0]);
        let body = Body::lattice(layer(0.0), 1.0).join(layer(2.0)).join(layer(4.0)).horizon(1.5);
        let bonds = body.build().unwrap();
        let operations: Vec<Operation<2>> = [0.0, 2.0, 4.0].map(|low| Operation::Add(layer(low))).into();
        let parts = Parts::new(&operations, &[0, 1, 2]);
        let counts = |bonds: &dyn BodyGeometry<2>, pairs: &[[u32; 2]]| -> Vec<usize> {
            parts.bonds_across(bonds, pairs).iter().map(Vec::len).collect()
        };
        assert_eq!(counts(&bonds, &[[1, 0], [2, 1], [0, 2]]), [16, 16, 0]);
        // bonds of three cells pass through the layer of two: both interfaces, and two per column at 90°
        let wide = body.horizon(3.0).build().unwrap();
        let across = parts.bonds_across(&wide, &[[0, 1], [1, 2]]);
        let both = across[0].iter().filter(|bond| across[1].contains(bond)).count();
        assert_eq!(both, 6, "the straight bonds of three cells");
        let hole = Shape::disk([3.0, 3.0], 0.6);
        let cut: Vec<Operation<2>> = operations.into_iter().chain([Operation::Cut(hole)]).collect();
        let holed = Parts::new(&cut, &[0, 1, 2, 0]);
        assert_eq!(holed.part_at([3.0, 3.0]), None);
        assert_eq!(
            [[1.0, 2.0], [1.0, 1.9], [1.0, 7.0]].map(|place| holed.part_at(place)),
            [Some(1), Some(0), None]
        );
        assert_eq!(holed.passed([3.0, 0.5], [3.0, 5.5]), [[0, 1], [1, 2]]);
    }
}
