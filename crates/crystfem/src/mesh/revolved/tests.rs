use super::*;
use crate::mesh::surface::{OuterSurface, area};
use crate::mesh::{ElementShape, Tube, quality};
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

/// Rectangle of quadrangles from r = `inner` to `outer` and z = 0 to `height`, with its sides as edges.
fn rectangle([inner, outer]: [f64; 2], height: f64, [nr, nz]: [usize; 2]) -> PlaneSection {
    let mut section = PlaneSection::default();
    let node = |i: usize, k: usize| (i + (nr + 1) * k) as u32;
    for k in 0..=nz {
        let z = if k == nz { height } else { height * (k as f64 / nz as f64) };
        section
            .points
            .extend((0..=nr).map(|i| {
                [if i == nr { outer } else { inner + (outer - inner) * (i as f64 / nr as f64) }, z]
            }));
    }
    for k in 0..nz {
        section
            .elements
            .extend((0..nr).map(|i| vec![node(i, k), node(i + 1, k), node(i + 1, k + 1), node(i, k + 1)]));
    }
    section.element_sets.insert("wall".into(), (0..(nr * nz) as u32).collect());
    let mut side = |name: &str, ends: Vec<[u32; 2]>| section.edges.insert(name.into(), ends);
    side("bore", (0..nz).map(|k| [node(0, k), node(0, k + 1)]).collect());
    side("shell", (0..nz).map(|k| [node(nr, k + 1), node(nr, k)]).collect());
    side("bottom", (0..nr).map(|i| [node(i, 0), node(i + 1, 0)]).collect());
    side("top", (0..nr).map(|i| [node(i, nz), node(i + 1, nz)]).collect());
    section
}

/// Splits each quadrangle into triangles along alternate diagonals, every other one clockwise.
fn triangles(mut section: PlaneSection) -> PlaneSection {
    let quadrangles = std::mem::take(&mut section.elements);
    for (k, ring) in quadrangles.iter().enumerate() {
        let [a, b, c, d] = ring[..] else { continue };
        let pair = if k % 2 == 0 { [vec![a, b, c], vec![c, a, d]] } else { [vec![b, a, d], vec![b, c, d]] };
        section.elements.extend(pair);
    }
    for set in section.element_sets.values_mut() {
        *set = set.iter().flat_map(|&element| [2 * element, 2 * element + 1]).collect();
    }
    section
}

fn area_of(mesh: &Mesh, name: &str) -> f64 {
    mesh.surfaces[name].iter().map(|face| area(mesh, *face)).sum()
}

/// A tube, and a cylinder without a bore, of all kinds of elements: volume and areas of a polygon of chords
/// φ, cuts exact, all outer faces named once.
#[test]
fn bodies_have_their_volumes_and_surfaces() {
    use ElementShape::{Hexahedron, Tetrahedron, Wedge};
    let chord: f64 = FRAC_PI_2 / 6.0;
    let flat = 2.0 * (0.5 * chord).sin() / chord;
    for (inner, of_triangles, cells, first, last) in [
        (0.02, false, RevolvedCells::Hexahedra, Hexahedron, Hexahedron),
        (0.02, true, RevolvedCells::Hexahedra, Wedge, Wedge),
        (0.02, false, RevolvedCells::Tetrahedra, Tetrahedron, Tetrahedron),
        (0.0, false, RevolvedCells::Hexahedra, Hexahedron, Wedge),
        (0.0, true, RevolvedCells::Hexahedra, Tetrahedron, Tetrahedron),
        (0.0, false, RevolvedCells::Tetrahedra, Tetrahedron, Tetrahedron),
    ] {
        let section = rectangle([inner, 0.1], 0.14, [4, 3]);
        let section = if of_triangles { triangles(section) } else { section };
        let Revolved { mesh, labels } = section.revolve(FRAC_PI_2, 6, cells).unwrap();
        let count = mesh.element_count();
        let what = format!("{inner} {of_triangles} {cells:?}");
        assert_eq!((mesh.shape(0), mesh.shape(count as u32 - 1)), (first, last), "{what}");
        assert_eq!((mesh.element_sets["wall"].len(), labels.len()), (count, count), "{what}");
        let found = quality::check(&mesh, Some(&labels)).unwrap();
        let whole = 0.25 * PI * (0.01 - inner * inner);
        assert!((found.volume / (whole * 0.14 * chord.sin() / chord) - 1.0).abs() < 1e-12, "{what}");
        // tetrahedra around the axis are flat
        let has_notes = !found.notes.is_empty();
        assert!(found.parts == 1 && (!has_notes || first == Tetrahedron), "{what}: {:?}", found.notes);
        for (name, exact) in [
            ("shell", FRAC_PI_2 * 0.1 * 0.14 * flat),
            ("top", whole * chord.sin() / chord),
            ("bottom", whole * chord.sin() / chord),
            ("start", (0.1 - inner) * 0.14),
            ("end", (0.1 - inner) * 0.14),
        ] {
            assert!((area_of(&mesh, name) / exact - 1.0).abs() < 1e-12, "{what} {name}");
        }
        assert_eq!(mesh.surfaces.contains_key("bore"), inner > 0.0, "{what}");
        assert_eq!(mesh.node_sets.get("axis").map_or(0, Vec::len), if inner > 0.0 { 0 } else { 4 });
        let mut named: Vec<Face> = mesh.surfaces.values().flatten().copied().collect();
        named.sort_unstable();
        let outside: Vec<Face> = OuterSurface::of_all(&mesh).unwrap().faces().collect();
        assert_eq!(named, outside, "{what}");
        assert!(quality::check(&mesh.second_order(), None).is_ok(), "{what}");
    }
}

/// A triangle with an edge on the axis among others without one gives a tetrahedron beside hexahedra; the
/// error of the volume falls to a quarter with half the angle.
#[test]
fn a_cone_and_its_error_by_the_angle() {
    let section = PlaneSection {
        points: vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
        elements: vec![vec![0, 1, 2]],
        ..PlaneSection::default()
    };
    let missing = |angle: f64| {
        let body = section.revolve(angle, 1, RevolvedCells::Hexahedra).unwrap();
        assert_eq!(body.mesh.tetrahedra.len(), 1);
        1.0 - quality::check(&body.mesh, None).unwrap().volume / (angle / 6.0)
    };
    let [wide, narrow] = [0.2, 0.1].map(missing);
    assert!((wide / narrow - 4.0).abs() < 0.01, "{wide} {narrow}");
    assert!((narrow / (0.01 / 6.0) - 1.0).abs() < 0.01, "{narrow}");
}

/// The mesh of a tube is that of its rectangle, node by node.
#[test]
fn a_tube_is_a_revolved_rectangle() {
    let tube = Tube { radii: [0.02, 0.1], angle: 1.0, length: 0.14, elements: [4, 2, 3] };
    let expected = tube.mesh().unwrap();
    let body = rectangle([0.02, 0.1], 0.14, [4, 3]).revolve(1.0, 2, RevolvedCells::Hexahedra).unwrap();
    let sorted = |mesh: &Mesh| {
        let mut elements: Vec<Vec<[i64; 3]>> = mesh
            .hexahedra
            .iter()
            .map(|nodes| {
                let mut places = nodes.map(|n| mesh.points[n as usize].map(|x| (1e12 * x).round() as i64));
                places.sort_unstable();
                places.to_vec()
            })
            .collect();
        elements.sort();
        elements
    };
    assert_eq!(sorted(&body.mesh), sorted(&expected));
    for (name, nodes) in &expected.node_sets {
        assert_eq!(body.mesh.surfaces[name].len(), expected.surfaces[name].len(), "{name}");
        assert_eq!(body.mesh.nodes_of(&body.mesh.surfaces[name]).len(), nodes.len(), "{name}");
    }
}

/// Section of two blocks with a named interface, in mm, as Abaqus writes it.
const TWO_BLOCKS: &str = "*NODE
1, 1., 0.
2, 2., 0.
3, 3., 0.
4, 1., 1.
5, 2., 1.
6, 3., 1.
7, 9., 9.
*ELEMENT, TYPE=CAX4R, ELSET=core
10, 1, 2, 5, 4
*ELEMENT, TYPE=CAX3, ELSET=skin
11, 2, 5, 3
12, 3, 6, 5
*NSET, NSET=far
7
*NSET, NSET=seam
2, 5
*SURFACE, NAME=bore
10, S4
*SURFACE, NAME=seam
core, S2
";

#[test]
fn sections_of_files_keep_their_names() {
    let read = |text: &str| {
        let content = meshfile::abaqus::parse(Path::new("two.inp"), text.as_bytes(), |_| None)?;
        PlaneSection::convert(Path::new("two.inp"), content, 1e-3)
    };
    let (section, notes) = read(TWO_BLOCKS).unwrap();
    assert_eq!(section.points.len(), 6);
    assert_eq!(section.labels, [10, 11, 12]);
    assert!(notes.iter().any(|note| note.contains("`far` has nothing")), "{notes:?}");
    let body = section.revolve(0.1, 2, RevolvedCells::Hexahedra).unwrap();
    assert_eq!(body.labels, [10, 10, 11, 11, 12, 12]);
    assert_eq!(body.mesh.element_sets["skin"], [2, 3, 4, 5]);
    assert_eq!(body.mesh.surfaces["seam"].len(), 2);
    assert_eq!(body.mesh.node_sets["seam"].len(), 6);
    let arc = 4.0 * (0.025_f64).sin() * 1e-3 * 1e-3;
    assert!((area_of(&body.mesh, "bore") / arc - 1.0).abs() < 1e-12);
    assert!((area_of(&body.mesh, "seam") / (2.0 * arc) - 1.0).abs() < 1e-12);
    quality::check(&body.mesh, Some(&body.labels)).unwrap();
    for (found, written, words) in [
        ("1, 1., 0.\n", "1, 1., 0., 0.5\n", "two.inp: node 1 at (1, 0, 0.5); allowed: z = 0"),
        ("TYPE=CAX4R", "TYPE=C3D4", "element 10 is a solid"),
        (
            "CAX3, ELSET=skin\n11, 2, 5, 3\n12, 3, 6, 5",
            "CAX6, ELSET=skin\n11, 2, 5, 3, 1, 4, 6",
            "second order",
        ),
    ] {
        let error = read(TWO_BLOCKS.replace(found, written).split("*SURFACE").next().unwrap());
        let error = error.unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn invalid_bodies_are_refused() {
    let section = rectangle([0.0, 1.0], 1.0, [2, 2]);
    let refused = |section: &PlaneSection, angle: f64, around: usize, words: &str| {
        let error = section.revolve(angle, around, RevolvedCells::Hexahedra).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    };
    refused(&section, 0.0, 1, "angle of the sector: found 0");
    refused(&section, f64::NAN, 1, "angle of the sector");
    refused(&section, 6.3, 9, "angle of the sector: found 6.3");
    refused(&section, 2.0, 1, "angle of an element: found 2");
    refused(&section, 1.0, 0, "elements around the axis: found 0");
    refused(&section, 1.0, usize::MAX, "nodes of a body of revolution");
    refused(&PlaneSection::default(), 1.0, 1, "no triangles or quadrangles");
    let mut left = section.clone();
    left.points[0][0] = -0.1;
    refused(&left, 1.0, 1, "a node at r = -1.0");
    let mut named = section;
    named.edges.insert("end".into(), vec![[0, 1]]);
    refused(&named, 1.0, 1, "a set `end`; allowed: other names");
}
