//! Stress of first- and second-order tetrahedra: exact states, beams, curved bodies.

use crate::stresses::{ball, cooling, heat_within, heated, hot_spot};
use crystfem::mechanics::{Body, FixedComponent, SolidifyingMaxwell};
use crystfem::mesh::{Block, CellSplit, Grid, Mesh};
use evidence::{at_most, near, within};
use std::collections::HashMap;

fn brick(size: [f64; 3], count: [usize; 3], split: CellSplit, second: bool) -> Mesh {
    let grid = Grid::uniform([0.0; 3], size, count).unwrap();
    let block = [Block { name: "all".into(), lower: [0.0; 3], upper: size }];
    let mesh = grid.blocks(&block, split).unwrap();
    if second { mesh.second_order() } else { mesh }
}

/// Returns 3-2-1 supports of a brick with a corner at the origin.
fn three_two_one_supports(mesh: &Mesh) -> Vec<FixedComponent> {
    let far = |d: usize| {
        let most = mesh.points.iter().map(|p| p[d]).fold(0.0, f64::max);
        let at = |p: &[f64; 3]| p[d] == most && (0..3).all(|e| e == d || p[e] == 0.0);
        mesh.points.iter().position(at).unwrap() as u32
    };
    let origin = mesh.points.iter().position(|p| *p == [0.0; 3]).unwrap() as u32;
    vec![(origin, 0), (origin, 1), (origin, 2), (far(0), 1), (far(0), 2), (far(1), 2)]
}

/// Computes one elastic step with moduli of elements and free strains by position.
fn step<'a>(
    mesh: &'a Mesh,
    poisson: f64,
    modulus: impl Fn(usize) -> f64,
    strain: impl Fn(usize, [f64; 3]) -> f64,
) -> Body<'a> {
    let mut body = Body::new(mesh, poisson).unwrap();
    body.activate(0..mesh.element_count(), 1);
    let law = |e| SolidifyingMaxwell::elastic(modulus(e), poisson, 0.0, f64::INFINITY);
    let hold = |e| law(e).increment([300.0, 0.0], [300.0, 0.0], 0.0);
    body.step(hold, |e, _, place| strain(e, place), &three_two_one_supports(mesh)).unwrap();
    body
}

fn largest(body: &Body, mesh: &Mesh) -> f64 {
    let points = (0..mesh.element_count()).flat_map(|e| (0..body.points(e)).map(move |p| (e, p)));
    points.flat_map(|(e, p)| body.stress(e, p)).fold(0.0, |most: f64, s| most.max(s.abs()))
}

/// Bodies with uniform or linear free strain are stress-free, on distorted meshes and with curved edges.
#[test]
fn free_bodies_have_no_stress() {
    let size = [3e-3, 2e-3, 2e-3];
    for (name, split, second, linear, least, most) in [
        ("tet4", CellSplit::FiveTetrahedra, false, false, 0.0, 1e-10),
        ("tet4_six", CellSplit::SixTetrahedra, false, false, 0.0, 1e-10),
        ("tet10", CellSplit::FiveTetrahedra, true, false, 0.0, 1e-10),
        ("tet10_linear", CellSplit::SixTetrahedra, true, true, 0.0, 1e-10),
        ("hex8_linear", CellSplit::Hexahedra, false, true, 0.0, 1e-10),
        // constant strains cannot bend: locking of the first order
        ("tet4_linear", CellSplit::SixTetrahedra, false, true, 0.05, 0.5),
    ] {
        let mesh = brick(size, [3, 2, 2], split, second);
        let mesh = if linear { mesh } else { mesh.distorted(0.15).unwrap() };
        let strain = |place: [f64; 3]| if linear { 1e-2 * place[2] / 2e-3 } else { 1e-2 };
        let body = step(&mesh, 0.4, |_| 1e9, |_, place| strain(place));
        within(&format!("tetrahedra_free_{name}"), largest(&body, &mesh) / 1e7, least, most);
    }
}

/// Fits the curvature of the lower edge by least squares over the middle quarter.
fn curvature(mesh: &Mesh, body: &Body) -> f64 {
    let length = mesh.points.iter().map(|p| p[0]).fold(0.0, f64::max);
    let edge: Vec<[f64; 2]> = (0..mesh.points.len())
        .filter(|&n| mesh.points[n][1] == 0.0 && mesh.points[n][2] == 0.0)
        .map(|n| [mesh.points[n][0] / length - 0.5, body.state.displacement[n][2]])
        .filter(|p| p[0].abs() < 0.1251)
        .collect();
    let matrix = nalgebra::DMatrix::from_fn(edge.len(), 3, |row, power| edge[row][0].powi(power as i32));
    let right = nalgebra::DVector::from_fn(edge.len(), |row, _| edge[row][1]);
    2.0 * matrix.svd(true, true).solve(&right, 1e-14).unwrap()[2] / (length * length)
}

/// Timoshenko's bimetal, 1 mm of 3 GPa and 2 mm of 1.5 GPa, free strains of −1 and −2 %, ν = 0: κ =
/// 4.864864865 /m. The second order is exact away from the ends; the first order is too stiff, and converges
/// from below.
#[test]
fn a_bimetal_bends() {
    let found = |count: [usize; 3], second: bool| {
        let mesh = brick([0.04, 2e-3, 3e-3], count, CellSplit::SixTetrahedra, second);
        let low = |e: usize| mesh.centre(e as u32)[2] < 1e-3;
        let body =
            step(&mesh, 0.0, |e| if low(e) { 3e9 } else { 1.5e9 }, |e, _| if low(e) { -0.01 } else { -0.02 });
        curvature(&mesh, &body).abs() / 4.864_864_865
    };
    near("tetrahedra_bimetal_tet10", found([16, 1, 3], true), 1.0, 3e-4);
    let first = [[16, 1, 3], [32, 2, 6]].map(|count| found(count, false));
    within("tetrahedra_bimetal_tet4", first[0], 0.45, 0.52);
    within("tetrahedra_bimetal_tet4_half", first[1], 0.74, 0.82);
}

/// Splits each hexahedron into four tetrahedra per side, around its center. New nodes, and second-order nodes
/// on edges, move to the circle or sphere of radius 1 if all surrounding nodes lie on it.
fn split(hexahedra: &Mesh, second: bool, radius: impl Fn([f64; 3]) -> f64) -> Mesh {
    let mut mesh = Mesh { points: hexahedra.points.clone(), ..Mesh::default() };
    let round = |places: &[[f64; 3]], axes: usize| {
        let mut mean: [f64; 3] =
            std::array::from_fn(|d| places.iter().map(|p| p[d]).sum::<f64>() / places.len() as f64);
        if places.iter().all(|place| (radius(*place) - 1.0).abs() < 1e-9) {
            let now = radius(mean);
            (0..axes).for_each(|d| mean[d] /= now);
        }
        mean
    };
    // a circle is round in x and y only
    let axes = if radius([0.0, 0.0, 1.0]) == 0.0 { 2 } else { 3 };
    let mut middles: HashMap<[u32; 4], u32> = HashMap::new();
    for (element, corners) in (0_u32..).zip(&hexahedra.hexahedra) {
        mesh.points.push(hexahedra.centre(element));
        let centre = mesh.points.len() as u32 - 1;
        for side in crystfem::mesh::HEXAHEDRON_SIDES {
            let ring = side.map(|k| corners[k]);
            let mut key = ring;
            key.sort_unstable();
            let middle = *middles.entry(key).or_insert_with(|| {
                mesh.points.push(round(&ring.map(|node| hexahedra.points[node as usize]), axes));
                mesh.points.len() as u32 - 1
            });
            for k in 0..4 {
                mesh.tetrahedra.push([ring[(k + 1) % 4], ring[k], middle, centre]);
            }
        }
    }
    if !second {
        return mesh;
    }
    let mut mesh = mesh.second_order();
    for cell in &mesh.others {
        for (k, [a, b]) in [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]].into_iter().enumerate() {
            let ends = [a, b].map(|end| mesh.points[cell.nodes()[end] as usize]);
            mesh.points[cell.nodes()[4 + k] as usize] = round(&ends, axes);
        }
    }
    mesh
}

/// Computes errors of a cooling ball, as for hexahedra: surface displacement, and stress at element centers,
/// weighted by volume.
fn ball_errors(n: usize, second: bool) -> [f64; 2] {
    const POISSON: f64 = 0.4;
    let radius = |[x, y, z]: [f64; 3]| (x * x + y * y + z * z).sqrt();
    let mesh = split(&ball(n), second, radius);
    let body = heated(&mesh, POISSON, |place| cooling(radius(place)));
    let surface = mesh.points.iter().zip(&body.state.displacement);
    let moved = surface
        .filter(|(point, _)| (radius(**point) - 1.0).abs() < 1e-9)
        .map(|(point, u)| {
            ((0..3).map(|d| point[d] * u[d]).sum::<f64>() / (3.0 * heat_within(1.0)) - 1.0).abs()
        })
        .fold(0.0, f64::max);
    let (mut difference, mut whole) = (0.0, 0.0);
    for element in 0..mesh.element_count() {
        let corners = mesh.corners(element as u32);
        let place: [f64; 3] = std::array::from_fn(|d| {
            corners.iter().map(|&node| mesh.points[node as usize][d]).sum::<f64>() / 4.0
        });
        let r = radius(place);
        let inner = heat_within(r) / r.powi(3);
        let radial = 2.0 / (1.0 - POISSON) * (heat_within(1.0) - inner);
        let hoop = (2.0 * heat_within(1.0) + inner - cooling(r)) / (1.0 - POISSON);
        let found = body.mean_stress(element);
        for (k, (a, b)) in [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)].into_iter().enumerate() {
            let normal = place[a] * place[b] / (r * r);
            let exact = radial * normal + hoop * (if a == b { 1.0 } else { 0.0 } - normal);
            let twice = if a == b { 1.0 } else { 2.0 };
            difference += twice * (found[k] - exact).powi(2);
            whole += twice * exact * exact;
        }
    }
    [moved, (difference / whole).sqrt()]
}

#[test]
fn a_ball_cools() {
    for (name, second, orders, most) in
        [("tet4", false, [1.8, 1.0], [0.025, 0.05]), ("tet10", true, [2.3, 2.1], [6e-4, 4e-3])]
    {
        let errors = [2, 4].map(|n| ball_errors(n, second));
        for (k, what) in ["surface", "stress"].into_iter().enumerate() {
            let order = (errors[0][k] / errors[1][k]).log2();
            within(&format!("tetrahedra_ball_order_{name}_{what}"), order, orders[k], 6.0);
            at_most(&format!("tetrahedra_ball_{name}_{what}"), errors[1][k], most[k]);
        }
    }
}

/// NAFEMS T1, a hot spot in a plate, Eε = 100 MPa: −49.550398 MPa at the center.
#[test]
fn a_hot_spot_in_a_plate() {
    let radius = |[x, y, _]: [f64; 3]| x.hypot(y);
    let error = |n: usize| {
        let mesh = split(&hot_spot(n), true, radius);
        let hot = |place: [f64; 3]| if radius(place) < 1.0 { 1.0 } else { 0.0 };
        let body = heated(&mesh, 0.3, hot);
        // tetrahedra of the first hexahedron, at the center of the spot
        let mean = (0..24).map(|e| 100.0 * body.mean_stress(e)[1]).sum::<f64>() / 24.0;
        (mean + 49.550_398).abs()
    };
    let [coarse, fine] = [2, 4].map(error);
    at_most("tetrahedra_hot_spot_centre", fine, 5e-3);
    within("tetrahedra_hot_spot_order", (coarse / fine).log2(), 2.5, 6.0);
}

/// Mixed element types, and unsupported ones.
#[test]
fn element_types_can_be_mixed() {
    let wedges = brick([1.0; 3], [1, 1, 1], CellSplit::Wedges, false);
    assert!(Body::new(&wedges, 0.3).is_err());
    assert!(Body::new(&wedges.second_order(), 0.3).is_err());
    let mut both = brick([1.0; 3], [1, 1, 1], CellSplit::Hexahedra, false);
    // a tetrahedron on a face of the hexahedron
    both.points.push([0.3, 0.3, 2.0]);
    both.tetrahedra.push([4, 5, 7, 8]);
    let body = step(&both, 0.3, |_| 1e9, |_, _| 1e-2);
    assert_eq!((body.points(0), body.points(1)), (8, 1));
    assert!(largest(&body, &both) < 1e-3);
    let mut inverted = both.clone();
    inverted.tetrahedra[0].swap(0, 1);
    assert!(Body::new(&inverted, 0.3).is_err());
}
