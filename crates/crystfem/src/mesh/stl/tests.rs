//! Tests of surfaces in the formats of common programs, and of the cells inside.

use super::*;
use nalgebra::Vector3;

fn parsed(bytes: &[u8]) -> Result<Stl, Error> {
    parse(Path::new("a.stl"), bytes, 1e-3)
}

/// Returns the triangles of a box.
fn brick(size: [f32; 3]) -> Vec<[[f32; 3]; 3]> {
    let corner = |k: usize| [0, 1, 2].map(|d| if k >> d & 1 == 1 { size[d] } else { 0.0 });
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).map(|t| t.map(corner)).collect()
}

fn ascii(triangles: &[[[f32; 3]; 3]]) -> String {
    let corner = |[x, y, z]: [f32; 3]| format!("   vertex {x:e} {y} {z}\n");
    let facet = |t: &[[f32; 3]; 3]| {
        format!(" facet normal 0 0 0\n  outer loop\n{}  endloop\n endfacet\n", t.map(corner).concat())
    };
    format!("solid part\n{}endsolid part\n", triangles.iter().map(facet).collect::<String>())
}

fn binary(triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
    // begins with the keyword of text, as some programs write it
    let mut bytes = b"solid but binary".to_vec();
    bytes.resize(80, b' ');
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        bytes.extend([0; 12]);
        bytes.extend(triangle.iter().flatten().flat_map(|x| x.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

/// Returns a sphere of radius 5 about (5, 5, 5) by splitting an octahedron five times.
fn sphere() -> Vec<[[f32; 3]; 3]> {
    let unit = |d: usize, s: f64| Vector3::from([0, 1, 2].map(|e| if e == d { s } else { 0.0 }));
    let mut all = Vec::new();
    for (x, y, z) in (0..8).map(|k| (k & 1, k >> 1 & 1, k >> 2)) {
        let sign = |k: i32| f64::from(1 - 2 * k);
        let [a, b, c] = [unit(0, sign(x)), unit(1, sign(y)), unit(2, sign(z))];
        all.push(if (x + y + z) % 2 == 0 { [a, b, c] } else { [a, c, b] });
    }
    for _ in 0..5 {
        let parts = all.iter().flat_map(|&[a, b, c]| {
            let [d, e, f] = [(a + b).normalize(), (b + c).normalize(), (c + a).normalize()];
            [[a, d, f], [d, b, e], [f, e, c], [d, e, f]]
        });
        all = parts.collect();
    }
    all.iter().map(|t| t.map(|p| [0, 1, 2].map(|d| (5.0 + 5.0 * p[d]) as f32))).collect()
}

#[test]
fn text_and_bytes_are_one_surface() {
    let triangles = brick([3.0, 2.0, 1.0]);
    let [text, bytes] = [ascii(&triangles).into_bytes(), binary(&triangles)].map(|all| parsed(&all).unwrap());
    assert_eq!(text, bytes);
    assert_eq!((text.points.len(), text.triangles.len(), text.notes.len()), (8, 12, 0));
    assert!((text.volume - 6e-9).abs() < 1e-22);
    // inverted
    let turned: Vec<_> = triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
    let turned = parsed(&binary(&turned)).unwrap();
    assert!((turned.volume - 6e-9).abs() < 1e-22 && turned.notes[0].contains("turned"));
}

#[test]
fn a_box_fills_its_cells() {
    let stl = parsed(&binary(&brick([3.0, 2.0, 1.0]))).unwrap();
    let voxels = super::voxels(&stl, [5e-4; 3], 0.5).unwrap().0;
    assert_eq!(voxels.mesh.element_count(), 6 * 4 * 2);
    assert!((voxels.ratio - 1.0).abs() < 1e-6 && voxels.fill.iter().all(|fill| (fill - 1.0).abs() < 1e-6));
    // partly filled cells: 3 = 4 × 0.8 − 0.2
    let voxels = super::voxels(&stl, [8e-4, 5e-4, 4e-4], 0.1).unwrap().0;
    assert_eq!(voxels.mesh.element_count(), 4 * 4 * 3);
    assert!((voxels.fill.iter().sum::<f64>() * 1.6e-10 / 6e-9 - 1.0).abs() < 1e-12);
    assert!((voxels.fill[3] - 0.75).abs() < 1e-6 && (voxels.fill[47] - 0.375).abs() < 1e-6);
    assert!((voxels.ratio - 7.68 / 6.0).abs() < 1e-6 && !voxels.can_be_full());
}

#[test]
fn a_sphere_has_its_volume() {
    let stl = parsed(&binary(&sphere())).unwrap();
    let exact = 4.0 / 3.0 * std::f64::consts::PI * 125e-9;
    // chords of 90°/32
    assert!((stl.volume / exact - 1.0).abs() < 2e-3, "{}", stl.volume / exact);
    let full = super::voxels(&stl, [5e-4; 3], 0.5).unwrap().0;
    assert!((full.ratio - 1.0).abs() < 0.01 && full.can_be_full(), "{}", full.ratio);
    let parts = super::voxels(&stl, [1e-3; 3], 0.0).unwrap().0;
    assert!((parts.fill.iter().sum::<f64>() * 1e-9 / stl.volume - 1.0).abs() < 1e-12);
    // rays alone miss little of it
    assert!(parts.left_out.abs() < 1e-12 && parts.fill.iter().all(|fill| *fill < 1.002));
    let inner = (0..parts.fill.len() as u32).filter(|&e| {
        let centre = Vector3::from(parts.mesh.centre(e)).add_scalar(-5e-3);
        centre.norm() < 4e-3
    });
    assert!(inner.into_iter().all(|e| parts.fill[e as usize] > 0.998));
}

/// Returns a box between two corners, outward or inward.
fn shell(low: [f32; 3], high: [f32; 3], outward: bool) -> Vec<[[f32; 3]; 3]> {
    let moved = brick([0, 1, 2].map(|d| high[d] - low[d]));
    let place = |at: [f32; 3]| [0, 1, 2].map(|d| low[d] + at[d]);
    moved.into_iter().map(|[a, b, c]| if outward { [a, b, c] } else { [a, c, b] }.map(place)).collect()
}

/// Shells in mm, with their volume according to slicers, mm³.
#[test]
fn shells_are_united_as_slicers_do() {
    let whole = |outward| shell([0.0; 3], [10.0; 3], outward);
    let inner = |outward| shell([3.0; 3], [7.0; 3], outward);
    let beside = |outward| shell([20.0, 0.0, 0.0], [30.0, 10.0, 10.0], outward);
    let cases: [(&str, Vec<Vec<_>>, f64, &str); 13] = [
        (
            "overlapping",
            vec![whole(true), shell([5.0, 0.0, 0.0], [15.0, 10.0, 10.0], true)],
            1500.0,
            "overlap: 500",
        ),
        ("nested", vec![whole(true), inner(true)], 1000.0, "overlap: 64"),
        ("twice", vec![whole(true), whole(true)], 1000.0, ""),
        ("cavity", vec![whole(true), inner(false)], 936.0, "2 shells, 1 of them cavities"),
        (
            "a body in a cavity",
            vec![whole(true), inner(false), shell([4.0; 3], [6.0; 3], true)],
            944.0,
            "3 shells",
        ),
        ("all inside out, with a cavity", vec![whole(false), inner(true)], 936.0, "turned"),
        ("one of two inside out", vec![whole(true), beside(false)], 2000.0, "1 of 2 shells are inside out"),
        (
            "a hollow one of two inside out",
            vec![whole(true), beside(false), shell([22.0, 2.0, 2.0], [28.0, 8.0, 8.0], true)],
            1784.0,
            "2 of 3 shells are inside out",
        ),
        ("a common face", vec![whole(true), shell([10.0, 0.0, 0.0], [20.0, 10.0, 10.0], true)], 2000.0, ""),
        ("a common edge", vec![whole(true), shell([10.0, 10.0, 0.0], [20.0, 20.0, 10.0], true)], 2000.0, ""),
        ("a common corner", vec![whole(true), shell([10.0; 3], [20.0; 3], true)], 2000.0, "2 shells"),
        (
            "a duplicate triangle",
            vec![whole(true), whole(true)[..1].to_vec()],
            1000.0,
            "1 duplicate triangles",
        ),
        (
            "crossing bars",
            vec![
                shell([0.0, 4.0, 4.0], [10.0, 6.0, 6.0], true),
                shell([4.0, 0.0, 4.0], [6.0, 10.0, 6.0], true),
                shell([4.0, 4.0, 0.0], [6.0, 6.0, 10.0], true),
            ],
            104.0,
            "overlap: 16",
        ),
    ];
    for (name, shells, volume, note) in cases {
        let stl = parsed(&binary(&shells.concat())).unwrap_or_else(|error| panic!("{name}: {error}"));
        let (voxels, notes) = super::voxels(&stl, [1e-3; 3], 0.1).unwrap();
        let notes = [stl.notes, notes].concat().join("; ");
        // cells as large as the parts: rays are exact
        assert!(
            (voxels.volume * 1e9 / volume - 1.0).abs() < 1e-6,
            "{name}: {} mm³, {notes}",
            voxels.volume * 1e9
        );
        assert!((voxels.ratio - 1.0).abs() < 1e-6, "{name}: {}", voxels.ratio);
        assert!(notes.contains(note), "{name}: {notes}");
    }
    // an inward-facing shell that extends outside the others is no cavity
    let through = shell([4.0, 4.0, -1.0], [6.0, 6.0, 11.0], false);
    let stl = parsed(&binary(&[whole(true), through].concat())).unwrap();
    assert!(stl.notes[0].contains("1 of 2 shells are inside out"), "{:?}", stl.notes);
    assert!((super::voxels(&stl, [1e-3; 3], 0.1).unwrap().0.volume * 1e9 - 1008.0).abs() < 1e-3);
}

/// Two spheres, each centre on the other: their common volume counts once.
#[test]
fn overlapping_spheres_have_the_volume_of_their_union() {
    let moved = |by: f32| sphere().into_iter().map(move |t| t.map(|[x, y, z]| [x + by, y, z]));
    let stl = parsed(&binary(&moved(0.0).chain(moved(5.0)).collect::<Vec<_>>())).unwrap();
    let (voxels, notes) = super::voxels(&stl, [5e-4; 3], 0.1).unwrap();
    // two caps of height r/2: the lens has the volume 5 π r³/12
    let pi = std::f64::consts::PI;
    let exact = (8.0 / 3.0 - 5.0 / 12.0) * pi * 125.0;
    assert!((voxels.volume * 1e9 / exact - 1.0).abs() < 3e-3, "{}", voxels.volume * 1e9 / exact);
    assert!(notes[0].contains("overlap"), "{notes:?}");
}

/// Corners within the tolerance are merged: exact volume, a note.
#[test]
fn corners_are_welded_at_a_tolerance_of_the_size() {
    let noisy = |by: f32| {
        let mut count = 0_u32;
        let mut move_by = move |x: f32| {
            count = count.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            x + by * (f32::from((count >> 16) as u16) / 65_535.0 - 0.5)
        };
        brick([10.0; 3]).iter().map(|t| t.map(|p| p.map(&mut move_by))).collect::<Vec<_>>()
    };
    for by in [1e-17, 1e-9, 1e-6, 5e-6] {
        let stl = parsed(&binary(&noisy(by))).unwrap_or_else(|error| panic!("{by}: {error}"));
        assert!((stl.volume * 1e9 / 1000.0 - 1.0).abs() < 3e-6, "{by}: {}", stl.volume);
        assert!(stl.notes[0].contains("corners closer than 1e-6"), "{:?}", stl.notes);
    }
    assert!(parsed(&binary(&noisy(1e-3))).unwrap_err().to_string().contains("not a closed surface"));
    // small triangles vanish, the surface stays closed: the first corner as a triangle of 1e-6 mm
    let mut cut = brick([10.0; 3]);
    let tiny = |d: usize| [0, 1, 2].map(|e| if d == e { 1e-6 } else { 0.0 });
    cut.push([tiny(0), tiny(1), tiny(2)]);
    let stl = parsed(&binary(&cut)).unwrap();
    assert!(stl.notes.iter().any(|note| note.contains("1 of them smaller")), "{:?}", stl.notes);
}

/// Corners on edges of other triangles, one and three on an edge, close a surface; a hole does not.
#[test]
fn corners_on_edges_of_others_close_a_surface() {
    let [a, c, d] = [[0.0, 0.0, 10.0], [10.0, 10.0, 10.0], [0.0, 10.0, 10.0]];
    let whole = brick([10.0; 3]);
    let is_top = |t: &[[f32; 3]; 3]| t.iter().all(|p| p[2] == 10.0);
    for on in [vec![5.0], vec![2.5, 5.0, 6.25], vec![3.3]] {
        let mut triangles: Vec<_> = whole.iter().copied().filter(|t| !is_top(t)).collect();
        let edge: Vec<[f32; 3]> = [0.0].iter().chain(&on).chain(&[10.0]).map(|x| [*x, 0.0, 10.0]).collect();
        triangles.extend(edge.windows(2).map(|two| [two[0], two[1], c]));
        triangles.push([a, c, d]);
        let stl = parsed(&binary(&triangles)).unwrap_or_else(|error| panic!("{on:?}: {error}"));
        assert!((stl.volume * 1e9 / 1000.0 - 1.0).abs() < 1e-9, "{on:?}: {}", stl.volume);
        assert!(stl.notes[0].contains(&format!("{} triangles are split", on.len())), "{:?}", stl.notes);
        let last = triangles.len() - 2;
        triangles.remove(last);
        assert!(
            parsed(&binary(&triangles)).unwrap_err().to_string().contains("not a closed surface"),
            "{on:?}"
        );
    }
}

/// Variants of text and binary files are read.
#[test]
fn files_as_programs_write_them() {
    let triangles = brick([3.0, 2.0, 1.0]);
    let text = ascii(&triangles);
    let bytes = binary(&triangles);
    let half = |part: &[_]| ascii(part);
    let forms: [(&str, Vec<u8>, &str); 11] = [
        ("capitals", text.to_uppercase().into_bytes(), ""),
        ("carriage returns", text.replace('\n', "\r\n").into_bytes(), ""),
        ("carriage returns alone", text.replace('\n', "\r").into_bytes(), ""),
        ("spaces and an empty line before", format!("\n  \t{text}").into_bytes(), ""),
        ("a byte order mark", format!("\u{feff}{text}").into_bytes(), ""),
        ("two solids", (half(&triangles[..5]) + &half(&triangles[5..])).into_bytes(), ""),
        (
            "no name, numbers with plus signs",
            text.replace(" part", "").replace("e0", ".0E+00").into_bytes(),
            "",
        ),
        ("a name of keywords", text.replace("part", "facet vertex 1 2").into_bytes(), ""),
        ("one line", text.replace("\n ", " ").replace("solid part", "solid\n").into_bytes(), ""),
        ("trailing bytes", [bytes.clone(), vec![0; 7]].concat(), "7 bytes after the last triangle"),
        ("trailing text", [bytes.clone(), b"solid trailer".to_vec()].concat(), "13 bytes after"),
    ];
    let plain = parsed(&bytes).unwrap();
    for (name, form, note) in forms {
        let stl = parsed(&form).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!((&stl.points, stl.triangles.len()), (&plain.points, 12), "{name}");
        assert!(
            stl.notes.concat().contains(note) && stl.notes.is_empty() == note.is_empty(),
            "{name}: {:?}",
            stl.notes
        );
    }
    for first in [b's', b'X'] {
        let mut short = bytes[..bytes.len() - 1].to_vec();
        short[0] = first;
        let short = parsed(&short).unwrap_err().to_string();
        assert!(short.contains("683 bytes, and bytes 81 to 84 count 12 triangles"), "{short}");
        assert!(short.contains("cut off"), "{short}");
    }
}

/// Truncated or altered files give an error, or a surface with cells.
#[test]
fn damaged_files_are_errors_or_surfaces() {
    let shells = [brick([3.0, 2.0, 1.0]), shell([1.0; 3], [2.0, 3.0, 4.0], true)].concat();
    for good in [ascii(&shells).into_bytes(), binary(&shells)] {
        for place in (0..good.len()).step_by(3) {
            for bit in [0x01, 0x40, 0x80] {
                let mut changed = good.clone();
                changed[place] ^= bit;
                for bytes in [&good[..place], &changed[..]] {
                    let Ok(stl) = parsed(bytes) else { continue };
                    let [low, high] = stl.bounds();
                    let size = (0..3).map(|d| high[d] - low[d]).fold(0.0, f64::max);
                    assert!(size > 0.0 && stl.volume > 0.0);
                    // too many cells are refused
                    _ = super::voxels(&stl, [size / 4.0; 3], 0.1);
                }
            }
        }
    }
}

#[test]
fn errors_name_the_defect() {
    let triangles = brick([3.0, 2.0, 1.0]);
    let refused = |bytes: &[u8], words: &[&str]| {
        let text = parsed(bytes).unwrap_err().to_string();
        assert!(words.iter().all(|word| text.contains(word)), "{text}");
    };
    refused(&binary(&triangles[..11]), &["a.stl: not a closed surface: 3 edges of one triangle, 0 of more"]);
    let mut turned = triangles.clone();
    turned[4].swap(0, 1);
    refused(&binary(&turned), &["3 of two that face opposite ways", "mm; allowed: 0"]);
    let bytes = binary(&triangles);
    refused(&bytes[10..], &["a.stl:1: STL: found \"674 bytes"]);
    refused(b"", &["text that begins with `solid`"]);
    let text = ascii(&triangles);
    refused(
        text.replacen("vertex", "vertx", 1).as_bytes(),
        &["a.stl:4: line of an STL: found \"vertx 0e0 0 0\""],
    );
    refused(
        text.replacen("vertex 0e0 0 0", "vertex 0e0 0", 1).as_bytes(),
        &["a.stl:4: vertex: found", "three"],
    );
    refused(
        text.replacen("vertex 0e0 0 0\n", "\n", 1).as_bytes(),
        &["a.stl:8: vertices of a facet: found \"2\""],
    );
    refused(
        text.replacen("vertex 0e0", "vertex nan", 1).as_bytes(),
        &["a.stl:4: vertex: found \"vertex nan", "finite"],
    );
    refused(b"solid nothing\nendsolid\n", &["vertices: found \"0\""]);
    let zero = parse(Path::new("a.stl"), &bytes, 0.0).unwrap_err().to_string();
    assert!(zero.contains("scale of the mesh: found 0"), "{zero}");
}
