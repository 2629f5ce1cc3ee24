//! Drawings by ezdxf (`tests/fixtures/make_dxf.py`), and drawings that are no outline.

use super::*;
use std::f64::consts::PI;
use std::path::PathBuf;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)
}

/// Areas of a plate with a round hole, a slot and an ellipse, of a quarter of a ring, and of a circle that is
/// a rational spline; curves of 256 segments a turn take 1e-4 off a disc.
#[test]
fn areas_of_drawings() {
    let plate = read(&fixture("plate.dxf"), 1e-3, None).unwrap();
    let exact = 40.0 * 20.0 - PI * 16.0 - (8.0 * 4.0 + PI * 4.0) - PI * 3.0 * 1.5;
    assert!((plate.area / (exact * 1e-6) - 1.0).abs() < 2e-5, "{} {exact}", plate.area);
    assert_eq!(plate.loops.len(), 4);
    assert!(
        plate.notes.len() == 1 && plate.notes[0].starts_with("1 entities other than"),
        "{:?}",
        plate.notes
    );
    let corners = plate.loops.iter().find(|points| points.len() == 4).unwrap();
    assert!(corners.contains(&[0.04, 0.02]) && corners.contains(&[0.0, 0.0]), "{corners:?}");
    let outside = read(&fixture("plate.dxf"), 0.0254, Some("outline")).unwrap();
    assert!((outside.area / (800.0 * 0.0254_f64.powi(2)) - 1.0).abs() < 1e-12);
    assert_eq!(outside.notes, ["the drawing is in mm, and 25.4 mm are taken for its unit"]);
    let quarter = read(&fixture("quarter.dxf"), 1e-3, None).unwrap();
    let exact = PI / 4.0 * (400.0 - 144.0) * 1e-6;
    assert!((quarter.area / exact - 1.0).abs() < 2e-4 && quarter.loops.len() == 1, "{}", quarter.area);
    let circle = read(&fixture("spline.dxf"), 1.0, None).unwrap();
    assert!((circle.area / PI - 1.0).abs() < 1e-3 && circle.notes.is_empty(), "{}", circle.area);
}

/// A drawing of lines on the layer `0`, and of further pairs of codes and values.
fn drawn(lines: &[[f64; 4]], more: &str) -> Result<Outline, Error> {
    let line = |[a, b, c, d]: &[f64; 4]| format!("0\nLINE\n8\n0\n10\n{a}\n20\n{b}\n11\n{c}\n21\n{d}\n");
    let lines: String = lines.iter().map(line).collect();
    let text = format!("0\nSECTION\n2\nENTITIES\n{lines}{more}0\nENDSEC\n0\nEOF\n");
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), text).unwrap();
    read(file.path(), 1.0, None)
}

#[test]
fn drawings_that_are_no_outline() {
    let square = [[0., 0., 1., 0.], [1., 0., 1., 1.], [1., 1., 0., 1.], [0., 1., 0., 0.]];
    assert_eq!(drawn(&square, "").unwrap().area, 1.0);
    let with = |more: &[[f64; 4]]| [&square[..], more].concat();
    let bow = [[0., 0., 2., 2.], [2., 2., 2., 0.], [2., 0., 0., 1.5], [0., 1.5, 0., 0.]];
    let across = [[0.5, 0.5, 3., 0.5], [3., 0.5, 3., 0.7], [3., 0.7, 0.5, 0.7], [0.5, 0.7, 0.5, 0.5]];
    for (lines, more, fault) in [
        (with(&[])[..3].to_vec(), "", "open at (0, 0); allowed: closed loops"),
        (with(&[[0., 0., 5., 5.]]), "", "found 3 ends that meet at (0, 0)"),
        (with(&square[..1]), "", "found 3 ends that meet at"),
        (bow.to_vec(), "", "found loops that meet at"),
        (with(&across), "", "found loops that meet at"),
        (Vec::new(), "", "found no closed loop"),
        (Vec::new(), "0\nTEXT\n8\n0\n1\na\n10\n0\n20\n0\n40\n1\n", "found no closed loop"),
        (with(&[]), "0\nINSERT\n8\n0\n2\nblock\n10\n0\n20\n0\n", "a block; allowed: entities of their own"),
        (with(&[]), "0\nLINE\n8\nA\n10\n0\n20\n0\n30\n1\n11\n2\n21\n0\n", "on layer `A`, which does not lie"),
        (
            with(&[]),
            "0\nCIRCLE\n8\n0\n10\n5\n20\n5\n40\nnan\n",
            "value of code 40: found \"nan\"; allowed: a finite number",
        ),
        (
            with(&[]),
            "0\nSPLINE\n8\n0\n71\n3\n40\n0\n40\n1\n10\n0\n20\n0\n30\n0\n",
            "with 1 control points and 2 knots",
        ),
        (with(&[]), "0\nLINE\n8\n0\n10\nx\n", "value of code 10: found \"x\"; allowed: a finite number"),
    ] {
        let Err(error) = drawn(&lines, more) else { panic!("not refused: {fault}") };
        let message = error.to_string();
        assert!(message.contains(fault), "{fault}: {message}");
    }
    let message = read(&fixture("plate.dxf"), 1.0, Some("hole")).unwrap_err().to_string();
    assert!(message.contains("found no entity on layer `hole`; allowed: holes, notes, outline"), "{message}");
}

/// Files that are cut anywhere, or overwritten, are drawings or errors.
#[test]
fn damaged_drawings() {
    let whole = std::fs::read(fixture("quarter.dxf")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("damaged.dxf");
    let mut refused = 0;
    for k in 0..200 {
        let mut bytes = whole.clone();
        let at = k * whole.len() / 200;
        match k % 3 {
            0 => bytes.truncate(at),
            1 => bytes[at] = b'-',
            _ => bytes[at..(at + 9).min(whole.len())].fill(0xff),
        }
        std::fs::write(&file, bytes).unwrap();
        refused += usize::from(read(&file, 1e-3, None).is_err());
    }
    assert!(refused > 50, "{refused}");
    for bytes in
        [&b""[..], b"\x00\x01\x02", b"AutoCAD Binary DXF\r\n\x1a\x00", b"AutoCAD DXB 1.0\r\n\x1a\x00\x01"]
    {
        std::fs::write(&file, bytes).unwrap();
        assert!(read(&file, 1e-3, None).is_err());
    }
}
