use super::*;
use crate::mesh::{CellSplit, Grid};

fn brick() -> Mesh {
    Grid::uniform([0.0; 3], [1.0; 3], [2, 2, 2]).unwrap().mesh("brick").unwrap()
}

fn tetrahedron(points: [[f64; 3]; 4]) -> Mesh {
    Mesh { points: points.to_vec(), tetrahedra: vec![[0, 1, 2, 3]], ..Mesh::default() }
}

fn refused(mesh: &Mesh, words: &[&str]) {
    let text = check(mesh, None).unwrap_err().to_string();
    assert!(words.iter().all(|word| text.contains(word)), "{text}");
}

fn noted(mesh: &Mesh, words: &str) {
    let notes = check(mesh, None).unwrap().notes;
    assert!(notes.len() == 1 && notes[0].contains(words), "{notes:?}");
}

#[test]
fn good_elements_measure_as_known() {
    let quality = check(&brick(), None).unwrap();
    assert!((quality.volume - 1.0).abs() < 1e-15 && quality.notes.is_empty());
    assert!((quality.scaled_jacobian.0 - 1.0).abs() < 1e-15 && (quality.aspect.0 - 1.0).abs() < 1e-15);
    // a regular tetrahedron: volume a³/(6√2), scaled Jacobian 1/√2 at each corner
    let regular = tetrahedron([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, 1.0], [-1.0, 1.0, -1.0]]);
    let quality = check(&regular, None).unwrap();
    assert!((quality.volume - 8f64.powf(1.5) / (6.0 * 2f64.sqrt())).abs() < 1e-14);
    assert!((quality.scaled_jacobian.0 - 0.5f64.sqrt()).abs() < 1e-15);
    // distortion keeps the box
    let distorted = brick().distorted(0.1).unwrap();
    assert!((check(&distorted, None).unwrap().volume - 1.0).abs() < 1e-14);
}

#[test]
fn the_volume_of_a_hexahedron_between_warped_sides() {
    // top at z = 1 + x y: volume 1 + 1/4
    let mut mesh = Grid::uniform([0.0; 3], [1.0; 3], [1, 1, 1]).unwrap().mesh("brick").unwrap();
    mesh.points[7][2] = 2.0;
    assert!((check(&mesh, None).unwrap().volume - 1.25).abs() < 1e-14);
}

#[test]
fn inverted_elements_and_slivers_are_refused() {
    let mut mesh = brick();
    mesh.hexahedra[5].swap(0, 6);
    refused(
        &mesh,
        &["hexahedron 5 at (7.500000e-1, 2.500000e-1, 7.500000e-1) m", "inverted", "allowed: above 0"],
    );
    // only one corner inverted: Gauss points do not detect it
    let mut mesh = brick();
    mesh.points[0] = [0.26, 0.26, 0.26];
    refused(&mesh, &["hexahedron 0 at", "inverted"]);
    let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let with = |last: [f64; 3]| tetrahedron([corners[0], corners[1], corners[2], last]);
    refused(&with([0.3, 0.3, 0.0]), &["tetrahedron 0", "without volume, Jacobian 0.000e0"]);
    refused(&with([0.3, 0.3, -1.0]), &["inverted", "Jacobian -1.000e0"]);
    refused(&with([0.3, 0.3, 1e-7]), &["sliver, scaled Jacobian", "allowed: 1e-6 or more"]);
    noted(&with([0.3, 0.3, 0.01]), "scaled Jacobian");
    refused(&with([1e200, 0.0, 1e200]), &["tetrahedron 0"]);
    let thin = |height| Grid::uniform([0.0; 3], [1.0, 1.0, height], [1, 1, 1]).unwrap().mesh("thin").unwrap();
    refused(&thin(1e-8), &["longest over shortest edge 1.000e8; allowed: at most 1e7"]);
    noted(&thin(1e-4), "longest over shortest edge 1.000e4");
}

#[test]
fn invalid_node_numbers_are_refused() {
    refused(&Mesh::default(), &["no hexahedra, tetrahedra or wedges"]);
    let mut mesh = brick();
    mesh.points[3][1] = f64::INFINITY;
    refused(&mesh, &["node 3 at [", "inf", "finite"]);
    let mut mesh = brick();
    mesh.hexahedra[1][2] = 27;
    refused(&mesh, &["element 1: node 27; allowed: below 27"]);
    let text = check(&mesh, Some(&[10, 20])).unwrap_err().to_string();
    assert!(text.contains("element 20:"), "{text}");
    let mut mesh = brick();
    mesh.hexahedra[1][2] = mesh.hexahedra[1][3];
    refused(&mesh, &["hexahedron 1", "twice; allowed: different nodes"]);
    let mut mesh = brick();
    mesh.hexahedra.push(mesh.hexahedra[3]);
    refused(&mesh, &["hexahedron 8", "has the nodes of hexahedron 3"]);
}

#[test]
fn invalid_sets_are_refused() {
    let with = |set: Vec<u32>| {
        let mut mesh = brick();
        mesh.element_sets.insert("hot".into(), set);
        mesh
    };
    refused(&with(vec![]), &["element set `hot`: empty"]);
    refused(&with(vec![3, 8]), &["element set `hot`: number 8 of 8"]);
    refused(&with(vec![3, 3]), &["element set `hot`: not in ascending order"]);
    let mut mesh = brick();
    mesh.node_sets.insert("cold".into(), vec![30]);
    refused(&mesh, &["node set `cold`: number 30 of 27"]);
    let mut mesh = brick();
    mesh.surfaces.insert("skin".into(), vec![Face { element: 1, side: 6 }]);
    refused(&mesh, &["surface `skin`: element 1 has no side 6"]);
    mesh.surfaces.insert("skin".into(), vec![]);
    refused(&mesh, &["surface `skin`: empty"]);
}

#[test]
fn doubtful_meshes_get_notes() {
    // the upper half with its own nodes: 9 duplicate nodes, 2 parts
    let mut mesh = brick();
    let copies: Vec<[f64; 3]> = mesh.points[9..18].to_vec();
    mesh.points.extend(copies);
    for node in mesh.hexahedra[4..].iter_mut().flatten().filter(|node| (9..18).contains(*node)) {
        *node += 18;
    }
    let quality = check(&mesh, None).unwrap();
    assert_eq!(quality.parts, 2);
    assert!(quality.notes[0].contains("2 parts share no node"), "{:?}", quality.notes);
    assert!(quality.notes[1].contains("9 nodes lie on others, nodes 9 and 27"), "{:?}", quality.notes);
    let mut mesh = brick();
    mesh.points.insert(0, [9.0; 3]);
    mesh.hexahedra.iter_mut().flatten().for_each(|node| *node += 1);
    mesh.node_sets.values_mut().flatten().for_each(|node| *node += 1);
    noted(&mesh, "1 nodes belong to no element, node 0 first");
    assert_eq!(drop_unused_nodes(&mut mesh), (1..28).collect::<Vec<_>>());
    assert_eq!(mesh, brick());
}

#[test]
fn half_faces_are_noted() {
    let mut mesh = Grid::uniform([0.0; 3], [1.0; 3], [1, 1, 1]).unwrap().mesh("brick").unwrap();
    mesh.points.push([0.3, 0.3, 2.0]);
    mesh.tetrahedra.push([4, 5, 7, 8]);
    noted(&mesh, "a side of hexahedron 0");
}

#[test]
fn a_large_mesh_of_tetrahedra_passes() {
    let grid = Grid::uniform([0.0; 3], [1.0; 3], [12, 12, 12]).unwrap();
    let block = crate::mesh::Block { name: "brick".into(), lower: [0.0; 3], upper: [1.0; 3] };
    let mesh = grid.blocks(&[block], CellSplit::SixTetrahedra).unwrap();
    let quality = check(&mesh, None).unwrap();
    // more than one work item
    assert!(mesh.element_count() > 2 * 4096 && quality.notes.is_empty());
    assert!((quality.volume - 1.0).abs() < 1e-12);
}
