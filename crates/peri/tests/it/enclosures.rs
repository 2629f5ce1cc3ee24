//! Bodies inside closed facets: their volume, and their bonds against those of shapes.

use peri::bonds::{BodyGeometry, BondDamage};
use peri::geometry::{Enclosure, Facet, Shape};
use peri::prelude::*;
use std::collections::HashMap;
use std::f64::consts::PI;
use std::sync::Arc;

fn polygon(points: &[[f64; 2]]) -> Vec<Facet<2>> {
    (0..points.len()).map(|k| [points[k], points[(k + 1) % points.len()]]).collect()
}

fn enclosed<const D: usize>(facets: Vec<Facet<D>>) -> Shape<D> {
    Shape::Enclosed(Arc::new(Enclosure::new(facets).unwrap()))
}

fn cuboid(low: [f64; 3], high: [f64; 3]) -> Vec<Facet<3>> {
    let at = |k: usize| std::array::from_fn(|d| if k >> d & 1 == 1 { high[d] } else { low[d] });
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    sides.iter().flat_map(|[a, b, c, d]| [[at(*a), at(*b), at(*c)], [at(*a), at(*c), at(*d)]]).collect()
}

/// A unit sphere of triangles: an octahedron, each triangle split into four.
fn sphere(splits: usize) -> Vec<Facet<3>> {
    let axis = |d: usize, sign: f64| std::array::from_fn(|e| if e == d { sign } else { 0.0 });
    let mut facets: Vec<Facet<3>> = (0..8)
        .map(|k| {
            let signs = [0, 1, 2].map(|d| if k >> d & 1 == 1 { 1.0 } else { -1.0 });
            let [x, y, z] = [0, 1, 2].map(|d| axis(d, signs[d]));
            if signs.iter().product::<f64>() > 0.0 { [x, y, z] } else { [x, z, y] }
        })
        .collect();
    for _ in 0..splits {
        let middle = |p: [f64; 3], q: [f64; 3]| {
            let sum = [0, 1, 2].map(|d| p[d] + q[d]);
            let size = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
            sum.map(|x| x / size)
        };
        facets = facets
            .into_iter()
            .flat_map(|[a, b, c]| {
                let [p, q, r] = [middle(a, b), middle(b, c), middle(c, a)];
                [[a, p, r], [p, b, q], [r, q, c], [p, q, r]]
            })
            .collect();
    }
    facets
}

/// Counts of a body: particles and directed bonds.
fn counts<const D: usize>(body: &Body<D>) -> [u64; 2] {
    let bonds = body.build().unwrap();
    [bonds.particles().len() as u64, bonds.directed_bonds()]
}

/// The volume of particles inside a sphere converges to that of its mesh: the root mean square of relative
/// errors over several spacings falls at least like Δx^1.5, the error of counting points of a lattice whose
/// place relative to the surface is random (Δx² for a smooth surface; here corners of facets).
#[test]
fn volumes_of_filled_spheres_converge() {
    let facets = sphere(4);
    let volume = Enclosure::new(facets.clone()).unwrap().volume();
    assert!((volume / (4.0 / 3.0 * PI) - 1.0).abs() < 7e-3, "{volume}");
    let error = |cells: f64| {
        let squares = (0..8).map(|k| {
            let spacing = 2.0 / (cells * (1.0 + 0.03 * f64::from(k)));
            let body = Body::lattice(enclosed(facets.clone()), spacing);
            let particles = counts(&body)[0] as f64;
            (particles * spacing.powi(3) / volume - 1.0).powi(2)
        });
        (squares.sum::<f64>() / 8.0).sqrt()
    };
    let errors = [8.0, 16.0, 32.0].map(error);
    let order = (errors[0] / errors[2]).log2() / 2.0;
    evidence::near("order of the volume of a filled sphere", order, 2.0, 0.6);
    assert!(order > 1.4 && errors[2] < 0.01, "{errors:?}: order {order}");
}

/// Facets that are faces of boxes give the particles and bonds of the boxes; blocks that touch are one body.
#[test]
fn closed_facets_are_the_shapes_around_them() {
    let whole = Body::lattice(Shape::cuboid([0.0; 3], [8.0, 4.0, 4.0]), 1.0);
    let one = Body::lattice(enclosed(cuboid([0.0; 3], [8.0, 4.0, 4.0])), 1.0);
    assert_eq!(counts(&one), counts(&whole));
    let two = Body::lattice(enclosed(cuboid([0.0; 3], [5.0, 4.0, 4.0])), 1.0)
        .join(enclosed(cuboid([5.0, 0.0, 0.0], [8.0, 4.0, 4.0])));
    assert_eq!(counts(&two), counts(&whole));
    let apart = |shape: fn([f64; 3], [f64; 3]) -> Shape<3>| {
        Body::lattice(shape([0.0; 3], [5.0, 4.0, 4.0]), 1.0).join(shape([5.5, 0.0, 0.0], [8.5, 4.0, 4.0]))
    };
    let [parts, shapes] = [apart(|low, high| enclosed(cuboid(low, high))), apart(Shape::cuboid)];
    assert_eq!(counts(&parts), counts(&shapes), "a gap of half a spacing");
    assert!(counts(&parts)[1] < counts(&whole)[1]);
}

/// A fan of prisms around a node at a point of a lattice, up to three units in the last place beside it: each
/// point inside is in one prism, at any angle of the facets.
#[test]
fn points_at_a_node_are_in_one_cell() {
    let mut random = polycore::random::SplitMix64::new(7);
    let mut worst = 0;
    for fan in 0..400 {
        let [x, y] = [1 + fan % 20, 1 + fan / 20].map(|k| 0.1 * f64::from(k));
        let count = 4 + fan as usize % 5;
        let ring: Vec<[f64; 2]> = (0..count)
            .map(|k| {
                let angle = 2.0 * PI * (k as f64 + 0.4 * random.uniform()) / count as f64;
                let radius = 0.5 + random.uniform();
                [x + radius * angle.cos(), y + radius * angle.sin()]
            })
            .collect();
        let prisms: Vec<Enclosure<3>> = (0..count)
            .map(|k| {
                let base = [[x, y], ring[k], ring[(k + 1) % count]];
                let at = |k: usize, z: f64| [base[k % 3][0], base[k % 3][1], z];
                let mut facets = vec![[at(0, 0.0), at(2, 0.0), at(1, 0.0)], [0, 1, 2].map(|k| at(k, 1.0))];
                for k in 0..3 {
                    facets.push([at(k, 0.0), at(k + 1, 0.0), at(k + 1, 1.0)]);
                    facets.push([at(k, 0.0), at(k + 1, 1.0), at(k, 1.0)]);
                }
                Enclosure::new(facets).unwrap()
            })
            .collect();
        let beside = |x: f64, ulps: i64| f64::from_bits(x.to_bits().wrapping_add_signed(ulps));
        for (i, j) in (-3..=3).flat_map(|i| (-3..=3).map(move |j| (i, j))) {
            let point = [beside(x, i), beside(y, j), 0.5];
            let windings: i32 = prisms.iter().map(|prism| prism.facets().windings(point)).sum();
            worst += i32::from(windings != 1);
        }
    }
    assert_eq!(worst, 0, "points in no cell or in several");
}

/// No bond passes from one flank of a notch narrower than the horizon to the other. Of bonds near its tip
/// those stay that pass through its end: 6 more than with a box cut out. Bonds around a re-entrant corner
/// stay.
#[test]
fn bonds_end_at_notches() {
    let notched = polygon(&[
        [0.0, 0.0],
        [10.0, 0.0],
        [10.0, 8.0],
        [5.1, 8.0],
        [5.1, 4.0],
        [4.9, 4.0],
        [4.9, 8.0],
        [0.0, 8.0],
    ]);
    let body = Body::lattice(enclosed(notched), 1.0).plane_stress(1.0);
    let slot = Body::lattice(Shape::rectangle([0.0, 0.0], [10.0, 8.0]), 1.0)
        .cut(Shape::rectangle([4.9, 4.0], [5.1, 9.0]))
        .plane_stress(1.0);
    let [particles, bonds] = counts(&slot);
    assert_eq!(counts(&body), [particles, bonds + 12]);
    let corner = polygon(&[[0.0, 0.0], [10.0, 0.0], [10.0, 4.0], [4.0, 4.0], [4.0, 8.0], [0.0, 8.0]]);
    let corner = Body::lattice(enclosed(corner), 1.0).plane_stress(1.0);
    let shapes = Body::lattice(Shape::rectangle([0.0, 0.0], [10.0, 4.0]), 1.0)
        .join(Shape::rectangle([0.0, 0.0], [4.0, 8.0]))
        .plane_stress(1.0);
    assert_eq!(counts(&corner), counts(&shapes));
}

/// A slot between two bodies that touch at its end parts them as one inside a body does; a slanted slit cut
/// out parts its flanks as the same notch in the outline does; a polygon cut out has the surface of the box.
#[test]
fn slots_between_bodies_and_cut_out() {
    let outline =
        [[0.0, 0.0], [10.0, 0.0], [10.0, 8.0], [5.1, 8.0], [5.1, 4.0], [4.9, 4.0], [4.9, 8.0], [0.0, 8.0]];
    let one = Body::lattice(enclosed(polygon(&outline)), 0.5).plane_stress(1.0);
    let halves = [
        [[0.0, 0.0], [4.9, 0.0], [4.9, 8.0], [0.0, 8.0]],
        [[5.1, 4.0], [10.0, 4.0], [10.0, 8.0], [5.1, 8.0]],
        [[4.9, 0.0], [10.0, 0.0], [10.0, 4.0], [4.9, 4.0]],
    ];
    let [left, upper, lower] = halves.map(|points| enclosed(polygon(&points)));
    let several = Body::lattice(left, 0.5).join(lower).join(upper).plane_stress(1.0);
    assert_eq!(counts(&several)[0], counts(&one)[0]);
    let differ = counts(&one)[1].abs_diff(counts(&several)[1]);
    assert!(differ <= 24, "bonds around the tip: {differ}");

    let square = || Shape::rectangle([0.0, 0.0], [10.0, 8.0]);
    let whole = counts(&Body::lattice(square(), 0.5).plane_stress(1.0))[1];
    // slits as long, upright and slanted by 45°
    let slit = |[x, y]: [f64; 2], [a, b]: [f64; 2]| {
        let corner = |s: f64, t: f64| [x + s * a - t * b, y + s * b + t * a];
        enclosed(polygon(&[corner(-2.0, -0.1), corner(2.0, -0.1), corner(2.0, 0.1), corner(-2.0, 0.1)]))
    };
    let cut = |shape| whole - counts(&Body::lattice(square(), 0.5).cut(shape).plane_stress(1.0))[1];
    let half = 0.5_f64.sqrt();
    let [upright, slanted] = [[0.0, 1.0], [half, half]].map(|along| cut(slit([5.0, 4.0], along)));
    assert!(slanted as f64 > 0.7 * upright as f64 && upright > 100, "{slanted} {upright}");

    let hole = [[4.0, 3.0], [7.0, 3.0], [7.0, 6.0], [4.0, 6.0]];
    let [polygons, boxes] = [enclosed(polygon(&hole)), Shape::rectangle(hole[0], hole[2])]
        .map(|shape| Body::lattice(square(), 0.5).cut(shape).plane_stress(1.0).surface().faces().len());
    assert_eq!(polygons, boxes);
}

/// Sides of the cells of a sphere: as many to either side along each axis, with the area of its shadow.
#[test]
fn surfaces_are_sides_of_cells() {
    let body = Body::lattice(enclosed(sphere(4)), 0.05);
    let surface = body.surface();
    let mut sides: HashMap<[i64; 3], usize> = HashMap::new();
    for face in surface.faces() {
        *sides.entry(face.normal.map(|x| x as i64)).or_default() += 1;
    }
    assert_eq!(sides.len(), 6);
    for (normal, count) in &sides {
        assert_eq!(Some(count), sides.get(&normal.map(|x| -x)), "{normal:?}");
        assert!((*count as f64 * 0.0025 / PI - 1.0).abs() < 0.03, "{normal:?}: {count}");
    }
}
