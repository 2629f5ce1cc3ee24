use super::*;
use crate::mechanics::{Branch, EyringFlow, Hexahedron, MaxwellIncrement, Phase, Shift, SolidifyingMaxwell};
use evidence::{at_most, near};
use nalgebra::{SVector, Vector3};

/// Returns an elastic body without expansion.
fn elastic(modulus: f64) -> SolidifyingMaxwell {
    SolidifyingMaxwell::elastic(modulus, 0.0, 0.0, f64::INFINITY)
}

fn hold(modulus: f64) -> MaxwellIncrement {
    elastic(modulus).increment([300.0, 0.0], [300.0, 0.0], 0.0)
}

/// Returns a block of elements from the origin on, with layers along z.
fn block(count: [usize; 3], size: [f64; 3]) -> Mesh {
    let [nx, ny, nz] = count;
    let node = |i: usize, j: usize, k: usize| ((k * (ny + 1) + j) * (nx + 1) + i) as u32;
    let mut mesh = Mesh::default();
    for k in 0..=nz {
        for j in 0..=ny {
            for i in 0..=nx {
                let at = |index: usize, d: usize| size[d] * index as f64 / count[d] as f64;
                mesh.points.push([at(i, 0), at(j, 1), at(k, 2)]);
            }
        }
    }
    for k in 0..nz {
        for j in 0..ny {
            for i in 0..nx {
                let lower = [node(i, j, k), node(i + 1, j, k), node(i + 1, j + 1, k), node(i, j + 1, k)];
                let upper = [
                    node(i, j, k + 1),
                    node(i + 1, j, k + 1),
                    node(i + 1, j + 1, k + 1),
                    node(i, j + 1, k + 1),
                ];
                mesh.hexahedra.push(std::array::from_fn(|n| if n < 4 { lower[n] } else { upper[n - 4] }));
            }
        }
    }
    mesh
}

/// Returns 3-2-1 supports: the corner at the origin, two components of the corner along x, one of that along
/// y.
fn resting(mesh: &Mesh) -> Vec<FixedComponent> {
    let far = |d: usize| {
        let most = mesh.points.iter().map(|p| p[d]).fold(0.0, f64::max);
        mesh.points.iter().position(|p| p[d] == most && (0..3).all(|e| e == d || p[e] == 0.0)).unwrap() as u32
    };
    vec![(0, 0), (0, 1), (0, 2), (far(0), 1), (far(0), 2), (far(1), 2)]
}

/// Returns the curvature of the lower edge by least squares over the middle quarter of the length.
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

/// Patch test: strains at every Gauss point are exact in a block with one distorted element inside, under
/// displacements of a linear field.
#[test]
fn the_patch_test_holds() {
    let mut mesh = block([3, 3, 3], [3.0, 3.0, 3.0]);
    for (n, point) in mesh.points.iter_mut().enumerate() {
        if point.iter().all(|x| *x > 0.5 && *x < 2.5) {
            (0..3).for_each(|d| point[d] += 0.2 * ((7 * n + 3 * d) as f64).sin());
        }
    }
    for nodes in &mesh.hexahedra {
        let corners = nodes.map(|node| mesh.points[node as usize]);
        let element = Hexahedron::new(&corners, 0.3).unwrap();
        let linear = |p: [f64; 3]| [1e-3 * p[0] + 2e-3 * p[1], -1e-3 * p[2], 3e-3 * p[0] - 2e-3 * p[2]];
        let local = SVector::from_fn(|k, _| linear(corners[k / 3])[k % 3]);
        for strain in element.strains(&local, &SVector::zeros(), 1.0) {
            let exact = VoigtVector::from_row_slice(&[1e-3, 0.0, -2e-3, 2e-3, -1e-3, 3e-3]);
            at_most("stress_patch_strain", (strain - exact).amax(), 1e-16);
        }
    }
}

/// A free cube with a free strain linear in z bends without stress.
#[test]
fn a_free_cube_has_no_stress() {
    let mesh = block([3, 3, 3], [3e-3; 3]);
    let mut body = Body::new(&mesh, 0.4).unwrap();
    body.activate(0..27, 1);
    body.step(|_| hold(1e9), |_, _, place| 1e-2 * place[2] / 3e-3, &resting(&mesh)).unwrap();
    let most = (0..27).flat_map(|e| (0..GAUSS_POINTS).map(move |p| (e, p)));
    let most = most.flat_map(|(e, p)| body.stress(e, p)).fold(0.0_f64, |most, s| most.max(s.abs()));
    at_most("stress_free_cube", most / 1e7, 1e-10);
}

/// Timoshenko's bimetal, 1 mm of 3 GPa and 2 mm of 1.5 GPa, free strains of −1 and −2 %: κ = 4.864864865 /m;
/// the element of `docs/reference/print/fem.py` gives 4.8644041.
#[test]
fn a_bimetal_bends() {
    let mesh = block([16, 1, 3], [0.04, 2e-3, 3e-3]);
    let mut body = Body::new(&mesh, 0.0).unwrap();
    body.activate(0..48, 1);
    let low = |element: usize| element < 16;
    body.step(
        |e| hold(if low(e) { 3e9 } else { 1.5e9 }),
        |e, _, _| if low(e) { -0.01 } else { -0.02 },
        &resting(&mesh),
    )
    .unwrap();
    let found = curvature(&mesh, &body);
    near("stress_bimetal", found.abs() / 4.864_864_865, 1.0, 2e-4);
    near("stress_bimetal_peer", found.abs() / 4.864_404_083, 1.0, 1e-6);
}

/// Layers of 1 mm that shrink by 1 % one after the other: κ = (6ε/h) Σ (i − 1)/i³.
#[test]
fn layers_in_sequence_bend() {
    for (layers, along, length, exact) in [(2, 24, 0.024, 7.5), (8, 32, 0.064, 19.935_708_52)] {
        let mesh = block([along, 1, layers], [length, 2e-3, 1e-3 * layers as f64]);
        let mut body = Body::new(&mesh, 0.0).unwrap();
        for layer in 0..layers {
            body.activate(layer * along..(layer + 1) * along, 1);
            let shrinks = |e: usize| if e / along == layer { -0.01 } else { 0.0 };
            body.step(|_| hold(1e9), |e, _, _| shrinks(e), &resting(&mesh)).unwrap();
        }
        near(&format!("stress_layers_{layers}"), curvature(&mesh, &body).abs() / exact, 1.0, 2e-6);
    }
}

/// Layers on a substrate of 2 mm, 2 mm in all: κ = Σ 6εh(t + (i − 1)h)/(t + ih)³, towards 15 /m for
/// infinitely many.
#[test]
fn layers_bend_their_substrate() {
    for (layers, exact) in [(1, 3.75), (2, 7.256_944_444), (8, 12.447_044_67)] {
        let height = 2e-3 / layers as f64;
        let mesh = block([32, 1, 2 * layers], [0.064, 2e-3, 4e-3]);
        let mut body = Body::new(&mesh, 0.0).unwrap();
        body.activate(0..32 * layers, 1);
        for layer in layers..2 * layers {
            body.activate(32 * layer..32 * (layer + 1), 1);
            let shrinks = |e: usize| if e / 32 == layer { -0.01 } else { 0.0 };
            body.step(|_| hold(1e9), |e, _, _| shrinks(e), &resting(&mesh)).unwrap();
        }
        let beam: f64 = (1..=layers)
            .map(|i| 0.06 * height * (2e-3 + (i as f64 - 1.0) * height) / (2e-3 + i as f64 * height).powi(3))
            .sum();
        near("stress_layers_on_a_substrate_beam", beam / exact, 1.0, 1e-8);
        near(
            &format!("stress_layers_on_a_substrate_{layers}"),
            curvature(&mesh, &body).abs() / exact,
            1.0,
            1e-5,
        );
    }
}

/// Eight layers on a bed, ε = 0.010 + 0.004(i − ½)/8, are released: beam 0.4921875 /m, `fem.py` 0.50156.
#[test]
fn a_part_is_released_from_its_bed() {
    let mesh = block([32, 1, 8], [0.064, 2e-3, 8e-3]);
    let mut body = Body::new(&mesh, 0.0).unwrap();
    let bed: Vec<FixedComponent> = (0..mesh.points.len() as u32)
        .filter(|&n| mesh.points[n as usize][2] == 0.0)
        .flat_map(|n| (0..3).map(move |d| (n, d)))
        .collect();
    for layer in 0..8 {
        body.activate(32 * layer..32 * (layer + 1), 1);
        let strain = -(0.010 + 0.004 * (layer as f64 + 0.5) / 8.0);
        body.step(|_| hold(1e9), |e, _, _| if e / 32 == layer { strain } else { 0.0 }, &bed).unwrap();
    }
    let middle = (0..GAUSS_POINTS).map(|p| body.stress(16, p)[0]).sum::<f64>() / 8.0;
    near("stress_on_the_bed", middle / 1.022_749_135e7, 1.0, 1e-6);
    body.step(|_| hold(1e9), |_, _, _| 0.0, &resting(&mesh)).unwrap();
    near("stress_released", curvature(&mesh, &body).abs() / 0.501_560_187, 1.0, 1e-5);
}

/// Work of a release is ½R·Δu of the reactions and balances the stored energy; rotations are those of a
/// circle.
#[test]
fn a_release_does_the_work_of_its_reactions() {
    let mesh = block([32, 1, 4], [0.064, 2e-3, 4e-3]);
    let mut body = Body::new(&mesh, 0.3).unwrap();
    let bed: Vec<FixedComponent> = (0..mesh.points.len() as u32)
        .filter(|&n| mesh.points[n as usize][2] == 0.0)
        .flat_map(|n| (0..3).map(move |d| (n, d)))
        .collect();
    body.activate(0..128, 1);
    body.step(|_| hold(1e9), |e, _, _| -1e-3 * (e / 32) as f64, &bed).unwrap();
    let before = body.state.clone();
    let mut reaction = vec![Vector3::<f64>::zeros(); mesh.points.len()];
    for (element, nodes) in mesh.hexahedra.iter().enumerate() {
        let stresses = std::array::from_fn(|point| VoigtVector::from(body.stress(element, point)));
        let (forces, _) = body.shape_of(element).forces(&stresses);
        for (k, &node) in nodes.iter().enumerate() {
            reaction[node as usize] += Vector3::from(forces.fixed_rows::<3>(3 * k));
        }
    }
    body.step(|_| hold(1e9), |_, _, _| 0.0, &resting(&mesh)).unwrap();
    let work = body.state.balance.energies.work - before.balance.energies.work;
    let moved = body.state.displacement.iter().zip(&before.displacement);
    let by_reactions: f64 = moved
        .zip(&reaction)
        .map(|((after, before), r)| 0.5 * r.dot(&(Vector3::from(*after) - Vector3::from(*before))))
        .sum();
    near("stress_release_work", work / by_reactions, 1.0, 1e-9);
    assert!(work < 0.0);
    at_most("stress_release_closure", body.state.balance.worst, 1e-13);
    // both ends rest: centres of the last elements are 31 mm from the middle of the arc
    let turned = body.largest_rotation();
    near("stress_release_rotation", turned / (curvature(&mesh, &body).abs() * 0.031), 1.0, 2e-3);
}

/// Iterations of the solver agree with `pcg.csv` and `pcg_slender.csv` of the formulation, to 1e-6
/// of the load, with a molten top layer.
#[test]
fn iterations_do_not_follow_the_shape() {
    for (count, floor, published) in [
        ([8, 8, 4], 1.0, 34),
        ([8, 8, 4], 1e-6, 31),
        ([16, 16, 8], 1.0, 41),
        ([32, 32, 8], 1.0, 41),
        ([32, 32, 8], 1e-6, 40),
        ([4, 4, 64], 1.0, 47),
        ([4, 4, 64], 1e-4, 46),
        ([48, 2, 24], 1.0, 45),
        ([48, 2, 24], 1e-4, 46),
    ] {
        let mesh = block(count, count.map(|n| n as f64));
        let mut body = Body::new(&mesh, 0.4).unwrap();
        body.tolerance = 1e-6;
        body.activate(0..mesh.hexahedra.len(), 1);
        let bed: Vec<FixedComponent> = (0..mesh.points.len() as u32)
            .filter(|&n| mesh.points[n as usize][2] == 0.0)
            .flat_map(|n| (0..3).map(move |d| (n, d)))
            .collect();
        let layer = |element: usize| element / (count[0] * count[1]);
        body.step(
            |e| hold(if layer(e) == count[2] - 1 { floor } else { 1.0 }),
            |e, _, _| if layer(e) == count[2] - 2 { 1.0 } else { 0.1 },
            &bed,
        )
        .unwrap();
        let name = format!("stress_iterations_{}x{}x{}_{floor:e}", count[0], count[1], count[2]);
        near(&name, body.state.iterations as f64, f64::from(published), 3.0);
    }
}

#[test]
fn unsupported_elements_are_refused() {
    let mesh = block([1, 1, 1], [1.0; 3]);
    assert!(Body::new(&mesh, 0.5).is_err() && Body::new(&mesh, f64::NAN).is_err());
    let mut twisted = mesh.clone();
    twisted.points.swap(0, 6);
    assert!(Body::new(&twisted, 0.3).is_err());
    let wedge = crate::mesh::Cell::new(&[0, 1, 3, 4, 5, 7]).unwrap();
    assert!(Body::new(&Mesh { others: vec![wedge], ..mesh }, 0.3).is_err());
}

/// A bimetal creeps to Timoshenko's curvature of the moduli that remain, 3 and 0.5 GPa: 3.618421053 /m; if
/// both layers relax alike its curvature stays and its stress falls by e^{−t/τ}. With flow both, and the
/// yielding one in many steps, stay in balance.
#[test]
fn a_bimetal_creeps() {
    let mesh = block([16, 1, 3], [0.04, 2e-3, 3e-3]);
    let low = |element: usize| element < 16;
    let law = |branches: &[(f64, f64)], stress: Option<f64>| {
        let branches = branches.iter().map(|&(modulus, time)| Branch { modulus, time }).collect();
        let flow = stress.map(|stress| EyringFlow { stress, reference: 300.0 });
        let amorphous = Phase { flow, ..Phase::new(branches, Shift::None) };
        SolidifyingMaxwell { amorphous, ..elastic(1.0) }
    };
    let shrink = |e: usize| if low(e) { -0.01 } else { -0.02 };
    let bent = |lower: &SolidifyingMaxwell, upper: &SolidifyingMaxwell, times: &[f64]| {
        let mut body = Body::new(&mesh, 0.0).unwrap();
        body.activate(0..48, 2);
        let law = |e: usize| if low(e) { lower } else { upper };
        for (k, &time) in times.iter().enumerate() {
            let free = |e: usize, _: usize, _: [f64; 3]| if k == 0 { shrink(e) } else { 0.0 };
            let increment = |e: usize| law(e).increment([300.0, 0.0], [300.0, 0.0], time);
            body.step(increment, free, &resting(&mesh)).unwrap();
        }
        (curvature(&mesh, &body).abs(), body.stress(8, 0)[0], body.state.balance)
    };
    let still = [(1.5e9, f64::INFINITY), (1.5e9, f64::INFINITY)];
    let creeping = [(0.5e9, f64::INFINITY), (1e9, 10.0)];
    // κ = 6ε(1 + m)²/(h(3(1 + m)² + (1 + mn)(m² + 1/(mn)))), m = t₁/t₂, n = E₁/E₂
    let timoshenko = |m: f64, n: f64| {
        let square = (1.0 + m) * (1.0 + m);
        6.0 * 0.01 * square / (3e-3 * (3.0 * square + (1.0 + m * n) * (m * m + 1.0 / (m * n))))
    };
    let times: Vec<f64> = std::iter::once(0.0).chain((0..60).map(|_| 5.0)).collect();
    let (found, ..) = bent(&law(&still, None), &law(&creeping, None), &times);
    near("creeping_bimetal", found / timoshenko(0.5, 6.0), 1.0, 3e-4);
    // τ₀ far above all stresses: the linear body
    let (linear, stress, _) = bent(&law(&still, None), &law(&creeping, None), &times[..4]);
    let (flowing, flowed, balance) = bent(&law(&still, Some(1e15)), &law(&creeping, Some(1e15)), &times[..4]);
    near("creeping_bimetal_without_flow", flowing / linear, 1.0, 1e-9);
    near("creeping_bimetal_stress", flowed / stress, 1.0, 1e-9);
    at_most("creeping_bimetal_closure", balance.worst, 1e-12);
    let alike = |modulus: f64| law(&[(0.5 * modulus, 10.0), (0.5 * modulus, 10.0)], None);
    let (first, fresh, _) = bent(&alike(3e9), &alike(1.5e9), &[0.0]);
    let (later, old, _) = bent(&alike(3e9), &alike(1.5e9), &[0.0, 7.0, 13.0]);
    near("relaxing_bimetal", later / first, 1.0, 1e-9);
    near("relaxing_bimetal_stress", old / fresh, (-2.0_f64).exp(), 1e-9);
    // a layer that yields ends where its elastic part alone bends
    let yields = [(0.5e9, f64::INFINITY), (1e9, 1e4)];
    let times: Vec<f64> =
        std::iter::once(0.0).chain((-10..=60).map(|k| 10.0_f64.powf(0.1 * f64::from(k)))).collect();
    let (found, _, balance) = bent(&law(&still, None), &law(&yields, Some(1.6e6)), &times);
    near("yielded_bimetal", found / timoshenko(0.5, 6.0), 1.0, 3e-4);
    at_most("yielded_bimetal_closure", balance.worst, 1e-12);
}
