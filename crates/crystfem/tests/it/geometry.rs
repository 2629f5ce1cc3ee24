//! Meshes from files of other programs, from scene to report: correct results, or refusals at the wrong key.

use crystfem::program::run::{Crystfem, explain};
use harness::case::{Options, run};
use harness::report::Report;
use harness::scene::Source;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

const REST: &str = r#"
[materials.m]
law = "conductor"
density = "1000 kg/m^3"
conductivity = "0.13 W/(m K)"
specific_heat = "1000 J/(kg K)"
[[region]]
material = "m"
temperature = "100 degC"
[output]
pictures = false
fields = false
"#;
const COOLS: &str = r#"
[[boundary]]
surface = "outer"
film = "15 W/(m^2 K)"
ambient = "25 degC"
[time]
end = "100 s"
"#;

fn source(here: &Path, mesh: &str, rest: &str) -> Source {
    let text = format!("version = 1\nprogram = \"crystfem\"\n{mesh}{rest}{REST}");
    fs::write(here.join("case.toml"), text).unwrap();
    Source::read(here.join("case.toml")).unwrap()
}

fn report(here: &Path, mesh: &str, rest: &str) -> Report {
    let source = source(here, mesh, rest);
    run::<Crystfem>(&source, Options::new(&here.join("out"))).unwrap().report
}

/// Returns boxes from corner to corner as STL, each outward or inward.
fn stl(boxes: &[([f64; 3], [f64; 3], bool)]) -> String {
    let mut text = "solid part\n".to_owned();
    for (low, high, outward) in boxes {
        let corner = |k: usize| [0, 1, 2].map(|d| if k >> d & 1 == 1 { high[d] } else { low[d] });
        for [a, b, c, d] in
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
        {
            for mut three in [[a, b, c], [a, c, d]] {
                if !outward {
                    three.swap(0, 1);
                }
                text += "facet normal 0 0 0\nouter loop\n";
                three.map(corner).iter().for_each(|[x, y, z]| writeln!(text, "vertex {x} {y} {z}").unwrap());
                text += "endloop\nendfacet\n";
            }
        }
    }
    text + "endsolid part\n"
}

/// Blocks of 10 mm on cells of 1 mm cool for 100 s. Two blocks that overlap by half are 1.5 blocks (63.08 °C,
/// as one block of 15 × 10 × 10 mm); shells inside change nothing; a cavity does.
#[test]
fn shells_of_a_file_are_one_part() {
    let whole = ([0.0; 3], [10.0; 3], true);
    let long = ([0.0; 3], [15.0, 10.0, 10.0], true);
    let half = ([5.0, 0.0, 0.0], [15.0, 10.0, 10.0], true);
    let inner = |outward| ([3.0; 3], [7.0; 3], outward);
    let beside = |outward| ([20.0, 0.0, 0.0], [30.0, 10.0, 10.0], outward);
    for (name, boxes, volume, mean) in [
        ("one block", vec![long], 1.5e-6, Some(63.08)),
        ("overlapping", vec![whole, half], 1.5e-6, Some(63.08)),
        ("overlapping and nested", vec![whole, half, inner(true)], 1.5e-6, Some(63.08)),
        ("the same twice", vec![long, long], 1.5e-6, Some(63.08)),
        (
            "overlapping, inside out",
            vec![([0.0; 3], [10.0; 3], false), ([5.0, 0.0, 0.0], [15.0, 10.0, 10.0], false)],
            1.5e-6,
            Some(63.08),
        ),
        ("a cavity", vec![whole, inner(false)], 0.936e-6, None),
        ("a cavity and a second body inside out", vec![whole, inner(false), beside(false)], 1.936e-6, None),
    ] {
        let directory = tempfile::tempdir().unwrap();
        let here = directory.path();
        fs::write(here.join("part.stl"), stl(&boxes)).unwrap();
        let mesh =
            "[mesh.stl]\nfile = \"part.stl\"\nunit = \"1 mm\"\ncell = [\"1 mm\", \"1 mm\", \"1 mm\"]\n";
        let report = report(here, mesh, COOLS);
        let value = |name: &str| report.scalar(name).unwrap();
        assert!((value("printed_volume") / volume - 1.0).abs() < 1e-6, "{name}: {}", value("printed_volume"));
        assert!((value("cells_over_body") - 1.0).abs() < 1e-6, "{name}: {}", value("cells_over_body"));
        if let Some(mean) = mean {
            assert!((value("mean_temperature") - mean).abs() < 0.01, "{name}: {}", value("mean_temperature"));
        }
    }
}

/// A cube of 10 units: implausible sizes of prints are errors at `unit`, with the size.
#[test]
fn implausible_sizes_are_errors_of_the_unit() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    for (side, unit, cell, says) in [
        (0.01, "1 mm", "1 mm", Some("0.01 × 0.01 × 0.01 mm")),
        (0.1, "1 mm", "1 mm", Some("0.1 × 0.1 × 0.1 mm")),
        (10.0, "1 m", "100 mm", Some("10000 × 10000 × 10000 mm")),
        (10.0, "1 um", "1 um", Some("0.01 × 0.01 × 0.01 mm")),
        (0.01, "1 m", "1 mm", None),
        (10.0, "1 mm", "1 mm", None),
        (0.4, "25.4 mm", "1 mm", None),
    ] {
        fs::write(here.join("part.stl"), stl(&[([0.0; 3], [side; 3], true)])).unwrap();
        let cells = format!("[\"{cell}\", \"{cell}\", \"{cell}\"]");
        let mesh = format!("[mesh.stl]\nfile = \"part.stl\"\nunit = \"{unit}\"\ncell = {cells}\n");
        let result = explain(&source(here, &mesh, COOLS), false).map_err(|error| error.to_string());
        match (result, says) {
            (Ok(lines), None) => {
                assert!(lines.iter().any(|line| line.contains("the part is 10")), "{side} {unit}: {lines:?}");
            }
            (Err(error), Some(size)) => {
                let words = ["mesh.stl.unit", size, "(the file contains"];
                assert!(words.iter().all(|word| error.contains(word)), "{side} {unit}: {error}");
            }
            (result, _) => panic!("{side} {unit}: {result:?}"),
        }
    }
}

/// Returns a bar of eight bricks of `step` units along x, as a deck of Abaqus and CalculiX with node sets at
/// its ends.
fn deck(step: usize) -> String {
    let mut text = "*HEADING\nbar\n*NODE, NSET=ALL\n".to_owned();
    for i in 0..9 {
        for (k, [y, z]) in [[0, 0], [1, 0], [1, 1], [0, 1]].into_iter().enumerate() {
            writeln!(text, "{}, {}., {y}., {z}.", 4 * i + k + 1, step * i).unwrap();
        }
    }
    text += "*ELEMENT, TYPE=DC3D8, ELSET=BAR\n";
    for i in 0..8 {
        let at = |k: usize| 4 * i + k;
        let ends = [1, 2, 3, 4, 5, 6, 7, 8].map(at);
        // corners of one end, then of the other
        writeln!(text, "{}, {}", i + 1, ends.map(|n| n.to_string()).join(", ")).unwrap();
    }
    text + "*NSET, NSET=COLD, GENERATE\n1, 4, 1\n*NSET, NSET=HOT\n33, 34, 35, 36\n*NSET, NSET=EDGE\n1, 2\n\
                *MATERIAL, NAME=STEEL\n*CONDUCTIVITY\n50.,\n\
            *AMPLITUDE, NAME=RAMP\n0., 0., 1., 1.\n*STEP\n*HEAT TRANSFER\n1., 1.\n*BOUNDARY\nCOLD, 11, 11, \
            20.\n*END STEP\n"
}

/// Node sets carry temperatures at their nodes and films on their faces; unused keywords of the deck are
/// listed.
#[test]
fn node_sets_of_a_deck_are_boundaries() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::write(here.join("bar.inp"), deck(1)).unwrap();
    let mesh = "[mesh]\nfile = \"bar.inp\"\nunit = \"1 mm\"\n";
    let end = "[time]\nend = \"1e5 s\"\n[[probe]]\nname = \"p\"\nat = [\"2 mm\", \"0.5 mm\", \"0.5 mm\"]\n";
    let hold = |name: &str, celsius: f64| {
        format!("[[boundary]]\nsurface = \"{name}\"\ntemperature = \"{celsius} degC\"\n")
    };
    let film = |name: &str| {
        format!("[[boundary]]\nsurface = \"{name}\"\nfilm = \"130 W/(m^2 K)\"\nambient = \"20 degC\"\n")
    };
    let at_two = |rest: String| report(here, mesh, &(rest + end)).scalar("p.temperature").unwrap();
    let found = at_two(hold("COLD", 20.0) + &hold("HOT", 100.0));
    assert!((found - 40.0).abs() < 1e-6, "{found}");
    // k/h = 1 mm: as if the bar were 1 mm longer
    let found = at_two(film("COLD") + &hold("HOT", 100.0));
    assert!((found - (20.0 + 80.0 * 3.0 / 9.0)).abs() < 1e-6, "{found}");
    // nodes along an edge can have a temperature, but no film
    assert!(at_two(hold("EDGE", 20.0) + &hold("HOT", 100.0)) > 40.0);
    let refused = |rest: String| explain(&source(here, mesh, &(rest + end)), false).unwrap_err().to_string();
    let error = refused(film("EDGE"));
    assert!(error.contains("node set `EDGE` (2 nodes) has all nodes of no face"), "{error}");
    let error = refused(hold("WARM", 20.0));
    assert!(error.contains("`WARM`") && error.contains("COLD"), "{error}");
    let lines = explain(&source(here, mesh, &(hold("COLD", 20.0) + end)), false).unwrap().join("\n");
    for note in [
        "the part is 8 × 1 × 1 mm",
        "*CONDUCTIVITY (line 56, `50.,`) is NOT used: the deck has no units; give `conductivity` of \
         [materials.NAME]",
        "*AMPLITUDE (line 58, `RAMP`) is NOT used",
        "*BOUNDARY (line 63, `COLD, 11, 11, 20.`) is NOT used",
        "keywords not used: *END STEP (1), *STEP (1)",
    ] {
        assert!(lines.contains(note), "{note}:\n{lines}");
    }
    // without a unit the bar is 8 m long
    let lines = explain(
        &source(here, "[mesh]\nfile = \"bar.inp\"\n", &(hold("COLD", 20.0) + "[time]\nend = \"1 s\"\n")),
        false,
    );
    let lines = lines.unwrap().join("\n");
    assert!(lines.contains("8 × 1 × 1 m") && lines.contains("unit"), "{lines}");
    fs::write(here.join("bar.inp"), deck(10)).unwrap();
    let error =
        explain(&source(here, "[mesh]\nfile = \"bar.inp\"\n", "[time]\nend = \"1 s\"\n"), false).unwrap_err();
    assert!(error.to_string().contains("missing `mesh.unit`: in metres the part is 80 × 1 × 1 m"));
}

/// `check` opens the files of thermal analyses.
#[test]
fn files_of_thermal_analyses_are_opened_by_check() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let grid = |temperatures: &str| {
        let array = |name: &str, kind: &str, text: &str| {
            format!("<DataArray type=\"{kind}\" Name=\"{name}\" format=\"ascii\">{text}</DataArray>")
        };
        let (points, cells) =
            (array("P", "Float64", "0 0 0 1 0 0 0 1 0"), array("connectivity", "Int32", "0 1 2"));
        let (ends, kinds) = (array("offsets", "Int32", "3"), array("types", "UInt8", "5"));
        let values = array("T", "Float64", temperatures);
        format!(
            "<VTKFile \
             type=\"UnstructuredGrid\"><UnstructuredGrid><Piece><Points>{points}</Points><Cells>{cells}{ends}{kinds}</Cells><PointData>{values}</PointData></Piece></UnstructuredGrid></VTKFile>"
        )
    };
    let write = |name: &str, text: &str| fs::write(here.join(name), text).unwrap();
    write("good.vtu", &grid("480 470 460"));
    write("cold.vtu", &grid("180 170 -460"));
    write("short.vtu", &grid("480 470"));
    let series = |file: &str| {
        format!(
            "<VTKFile><Collection><DataSet timestep=\"0\" file=\"good.vtu\"/><DataSet timestep=\"9\" \
             file=\"{file}\"/></Collection></VTKFile>"
        )
    };
    write("good.pvd", &series("good.vtu"));
    write("gone.pvd", &series("gone.vtu"));
    write("no.vtu", "no XML");
    let scene = |file: &str, more: &str| {
        let text = format!(
            "version = 1\nprogram = \"crystfem\"\n[material]\nlaw = \"semicrystalline\"\ndensity = \"1010 \
             kg/m^3\"\n\
                         conductivity = \"0.25 W/(m K)\"\n\
             specific_heat = \"2200 J/(kg K)\"\nkinetics = \"table-4.1-column-1\"\ncrystallinity = \
             0.25\n[output]\npictures = false\n\
             [[nodes]]\nname = \"n\"\nfile = \"{file}\"\nunit = \"K\"\n{more}"
        );
        write("nodes.toml", &text);
        Source::read(here.join("nodes.toml")).unwrap()
    };
    for (file, more, says) in [
        ("cold.vtu", "", "above 0 K"),
        ("short.vtu", "", "2 values of `T`; allowed: 3"),
        ("gone.pvd", "", "gone.vtu, which does not exist"),
        ("no.vtu", "", "no.vtu"),
        ("good.vtu", "array = \"Temp\"\n", "T"),
    ] {
        let source = scene(file, more);
        let check = explain(&source, false).unwrap_err().to_string();
        assert!(check.contains("nodes[0].file") && check.contains(says), "{file}: {check}");
        // a run gives the same error, before it writes files
        let output = here.join("out");
        let error = run::<Crystfem>(&source, Options::new(&output)).unwrap_err().to_string();
        assert_eq!(error, check, "{file}");
        assert!(!output.exists(), "{file}");
    }
    let lines = explain(&scene("good.pvd", ""), false).unwrap().join("\n");
    assert!(lines.contains("3 nodes of 1 elements of good.pvd, from 460 to 480 K at t = 0 s"), "{lines}");
    let finished = run::<Crystfem>(&scene("good.pvd", ""), Options::new(&here.join("out"))).unwrap();
    assert_eq!(finished.report.scalar("n.least_alpha"), Some(0.0));
}

/// A bar of second-order tetrahedra on a stiff bed cools: the elastic law, from scene to report, against
/// hexahedra.
#[test]
fn tetrahedra_warp_as_hexahedra_do() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let scene = |cells: &str, elements: &str, order: u8| {
        let mesh = format!(
            "[mesh]\norder = {order}\n[mesh.brick]\nsize = [\"24 mm\", \"4 mm\", \"4 mm\"]\n\
                         elements = {elements}\ncells = \"{cells}\"\n"
        );
        let capacity = if order == 2 { "capacity = \"consistent\"\n" } else { "" };
        let rest = format!(
            "[mechanics]\nmaterial = \"m\"\nbed = \"bottom\"\n\
                         law = {{ elastic = {{ modulus = \"1 GPa\", poisson = 0.3, expansion = \"1e-4 1/K\" \
                         }} }}\n\
              strain_step = 1e-3\n[[boundary]]\nsurface = \"top\"\nfilm = \"500 W/(m^2 K)\"\nambient = \"20 \
              degC\"\n\
                          [time]\nend = \"20 s\"\nstep = \"1 s\"\n{capacity}"
        );
        report(here, &mesh, &rest)
    };
    let hexahedra = scene("hexahedra", "[24, 4, 8]", 1);
    for (order, elements, near) in [(2, "[12, 2, 3]", 0.03), (1, "[12, 2, 3]", 0.5)] {
        let found = scene("six-tetrahedra", elements, order);
        for name in ["warpage", "largest_displacement"] {
            let ratio = found.scalar(name).unwrap() / hexahedra.scalar(name).unwrap();
            assert!((ratio - 1.0).abs() < near, "{order} {name}: {ratio}");
        }
        assert!(found.scalar("worst_stress_balance").unwrap() < 1e-10);
    }
}

/// A part at 100 °C on a mould at 0 °C cools to 0 °C as a whole: it shrinks by the same strain everywhere and
/// stays flat, whichever elements a file has first, those of the part or of the mould.
#[test]
fn the_order_of_elements_changes_no_stress() {
    const N: usize = 3;
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let node = |i: usize, j: usize, k: usize| 1 + i + (N + 1) * (j + (N + 1) * k);
    let mut nodes = "*NODE\n".to_owned();
    for (k, j, i) in (0..=N + 1).flat_map(|k| (0..=N).flat_map(move |j| (0..=N).map(move |i| (k, j, i)))) {
        writeln!(nodes, "{}, {i}, {j}, {k}", node(i, j, k)).unwrap();
    }
    let layers = |range: std::ops::Range<usize>| -> Vec<String> {
        let cells = range.flat_map(|k| (0..N).flat_map(move |j| (0..N).map(move |i| (i, j, k))));
        let corners = |k: usize, i: usize, j: usize| {
            [node(i, j, k), node(i + 1, j, k), node(i + 1, j + 1, k), node(i, j + 1, k)]
                .map(|node| node.to_string())
                .join(", ")
        };
        cells.map(|(i, j, k)| format!("{}, {}", corners(k, i, j), corners(k + 1, i, j))).collect()
    };
    for part_first in [false, true] {
        let sets = [("MOULD", layers(0..2)), ("PART", layers(2..N + 1))];
        let order = if part_first { [1, 0] } else { [0, 1] };
        let mut text = nodes.clone();
        let mut id = 0;
        for (name, elements) in order.map(|set| &sets[set]) {
            writeln!(text, "*ELEMENT, TYPE=C3D8, ELSET={name}").unwrap();
            for element in elements {
                id += 1;
                writeln!(text, "{id}, {element}").unwrap();
            }
        }
        fs::write(here.join("m.inp"), text).unwrap();
        let material = |name: &str, degrees: u8| {
            format!(
                "[materials.{name}]\nlaw = \"conductor\"\ndensity = \"1000 kg/m^3\"\n\
                 conductivity = \"1 W/(m K)\"\nspecific_heat = \"1000 J/(kg K)\"\n[[region]]\n\
                 elements = \"{name}\"\nmaterial = \"{name}\"\ntemperature = \"{degrees} degC\"\n"
            )
        };
        let mesh = "[mesh]\nfile = \"m.inp\"\nunit = \"1 mm\"\n";
        let mechanics = "[mechanics]\nmaterial = \"PART\"\n[mechanics.law.elastic]\nmodulus = \"1 GPa\"\n\
                         poisson = 0.4\nexpansion = \"1e-4 1/K\"\n";
        let rest = "[[boundary]]\nsurface = \"bottom\"\ntemperature = \"0 degC\"\n[time]\nend = \"1e9 s\"\n\
                    scheme = \"backward-euler\"\nstep = \"1e9 s\"\n\
                    [output]\npictures = false\nfields = false\n";
        let materials = material("MOULD", 0) + &material("PART", 100);
        let text = format!("version = 1\nprogram = \"crystfem\"\n{mesh}{materials}{mechanics}{rest}");
        fs::write(here.join("case.toml"), text).unwrap();
        let source = Source::read(here.join("case.toml")).unwrap();
        let found = run::<Crystfem>(&source, Options::new(&here.join("out"))).unwrap().report;
        let warpage = found.scalar("warpage").unwrap();
        assert!(warpage < 1e-10, "part first {part_first}: {warpage}");
    }
}
