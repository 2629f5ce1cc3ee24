//! Bodies of `peri` from mesh files: against shapes, and against the finite element meshes of `crystfem`.

use crate::program::{peri, workspace};
use std::fs;
use std::path::PathBuf;

/// Values of the report of a scene that runs in a folder of its own.
fn values(scene: &str, arguments: &str) -> serde_json::Value {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    peri(&format!("run scene.toml --output out {arguments}"), folder.path()).with_code(0);
    let report = fs::read_to_string(folder.path().join("out/report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    let mut values = report["values"].clone();
    // of a hole that is a shape
    values.as_object_mut().unwrap().remove("kt_finite_width");
    values
}

fn case(name: &str) -> String {
    let folder = workspace().join("cases/meshes").join(name);
    let text = fs::read_to_string(folder.join("case.toml")).unwrap();
    text.replace("file = \"", &format!("file = \"{}/", folder.display()))
}

fn without(text: &str, block: &str) -> String {
    text.split("\n\n").filter(|part| !part.contains(block)).collect::<Vec<_>>().join("\n\n")
}

/// A plate whose mesh has all particles of a box with a disk cut out: the same bits, on one and two threads.
#[test]
fn a_mesh_is_the_body_of_its_shapes() {
    let mesh = without(&case("plate-with-hole"), "[[expect]]").replace("\"10 mm\", \"5 mm\"", "\"10 mm\"");
    let file = mesh.lines().find(|line| line.starts_with("shapes = ")).unwrap().to_owned();
    let shapes = "shapes = [{ add = \"box\", min = [\"-500 mm\", \"-500 mm\"], \
                  max = [\"500 mm\", \"500 mm\"] }, \
                  { cut = \"disk\", centre = [\"0 mm\", \"0 mm\"], radius = \"60 mm\" }]";
    let from_mesh = values(&mesh, "--threads 1");
    assert!(from_mesh.to_string().contains("hardy_rmse_inner"), "{from_mesh}");
    assert_eq!(from_mesh, values(&mesh.replace(&file, shapes), "--threads 1"));
    assert_eq!(from_mesh, values(&mesh, "--threads 2"));
}

/// A polygon is the box with its corners, in either direction, closed by its first corner or not.
#[test]
fn a_polygon_is_a_box() {
    let base = fs::read_to_string(workspace().join("tests/bad/peri/square.toml")).unwrap();
    let shape = base.lines().find(|line| line.starts_with("shapes = ")).unwrap().to_owned();
    let expected = values(&base, "");
    for corners in [
        &["0", "10", "10", "10", "10", "0", "0", "0"][..],
        &["0", "0", "10", "0", "10", "10", "0", "10"],
        &["0", "0", "10", "0", "10", "10", "0", "10", "0", "0"],
    ] {
        let points: Vec<String> =
            corners.chunks(2).map(|at| format!("[\"{} mm\", \"{} mm\"]", at[0], at[1])).collect();
        let polygon = format!("shapes = [{{ add = \"polygon\", points = [{}] }}]", points.join(", "));
        assert_eq!(values(&base.replace(&shape, &polygon), ""), expected);
    }
}

/// An edge of a plane element and the two nodes of another, ten spacings apart, have the particles of the
/// sides of a box; z differs by rounding.
#[test]
fn edges_of_a_plane_deck_are_sides() {
    let base = fs::read_to_string(workspace().join("tests/bad/peri/square.toml")).unwrap();
    let deck = fs::read_to_string(workspace().join("tests/bad/inputs/plane.inp")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("plane.inp");
    fs::write(&file, deck.replace("3, 10, 10", "3, 10, 10, 1e-9")).unwrap();
    let shape = base.lines().find(|line| line.starts_with("shapes = ")).unwrap().to_owned();
    let mesh = format!("shapes = [{{ add = \"mesh\", file = \"{}\", unit = \"1 mm\" }}]", file.display());
    let sets = base
        .replace(&shape, &mesh)
        .replace("side = \"x-\"", "set = \"LEFT\"")
        .replace("side = \"x+\"", "set = \"RIGHT\"");
    assert_eq!(values(&sets, ""), values(&base, ""));
}

/// The bush of Gmsh's file and the same mesh as meshio writes it for VTK, with physical groups as an array of
/// cells: the same bits.
#[test]
fn a_mesh_of_vtk_is_that_of_gmsh() {
    let gmsh = without(&case("bush"), "[[expect]]");
    let studies = gmsh.find("[[study]]").unwrap();
    let gmsh = gmsh[..studies].replace("thickness =", "spacing = \"0.5 mm\"\nthickness =");
    let groups = fs::read_to_string(workspace().join("cases/meshes/bush/bush.msh")).unwrap();
    let mut vtk = gmsh.clone();
    for line in groups.lines().skip_while(|line| *line != "$PhysicalNames").skip(2) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let [_, tag, name] = words[..] else { break };
        let [key, array] = ["block", "set"].map(|key| (format!("{key} = {name}"), key));
        for (named, key) in [key, array] {
            vtk = vtk.replace(&named, &format!("{key} = \"gmsh:physical-{tag}\""));
        }
        let part = name.trim_matches('"');
        vtk = vtk.replace(&format!("part = \"{part}\""), &format!("part = \"gmsh:physical-{tag}\""));
    }
    let file = workspace().join("crates/meshfile/tests/fixtures/bush.vtu");
    let own = workspace().join("cases/meshes/bush/bush.msh");
    let vtk = vtk.replace(&own.display().to_string(), &file.display().to_string());
    assert!(!vtk.contains("bush.msh") && vtk.contains("physical-"), "{vtk}");
    assert_eq!(values(&vtk, ""), values(&gmsh, ""));
}

/// A file that a deck includes belongs to the scene: its contents are in the record of the run.
#[test]
fn included_files_are_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let deck = fs::read_to_string(workspace().join("tests/bad/inputs/plane.inp")).unwrap();
    let (nodes, rest) = deck.split_at(deck.find("*ELEMENT").unwrap());
    fs::write(folder.path().join("nodes.inp"), nodes).unwrap();
    fs::write(folder.path().join("part.inp"), format!("*INCLUDE, INPUT=nodes.inp\n{rest}")).unwrap();
    let base = fs::read_to_string(workspace().join("tests/bad/peri/square.toml")).unwrap();
    let shape = base.lines().find(|line| line.starts_with("shapes = ")).unwrap().to_owned();
    let mesh = "shapes = [{ add = \"mesh\", file = \"part.inp\", unit = \"1 mm\" }]";
    fs::write(folder.path().join("scene.toml"), base.replace(&shape, mesh)).unwrap();
    peri("run scene.toml --output out", folder.path()).with_code(0);
    let report = fs::read_to_string(folder.path().join("out/report.json")).unwrap();
    assert!(report.contains("\"part.inp\"") && report.contains("\"nodes.inp\""), "{report}");
}

/// Mesh files of `crystfem`'s tests.
fn fixtures() -> Vec<PathBuf> {
    let folder = workspace().join("crates/crystfem/tests/fixtures");
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let is_mesh = |path: &PathBuf| {
        path.extension().is_some_and(|ending| ["msh", "inp", "vtu", "e"].iter().any(|own| ending == *own))
    };
    files.filter(is_mesh).collect()
}

/// Checks a scene of a body and returns what is printed.
fn checked(body: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let scene = format!(
        "version = 1\nprogram = \"peri\"\n[body]\nspace = \"solid\"\n{body}\n[material]\nlaw = \
         \"linear\"\nyoungs_modulus = \"1 MPa\"\n[[boundary]]\nside = \"x-\"\nlayers = 1\n\
         displacement = [\"0 mm\", \"0 mm\", \"0 mm\"]\n"
    );
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    peri("check scene.toml", folder.path()).with_code(0).stdout
}

/// Volumes inside the facets of all element types are those of finite elements (Gauss quadrature of shape
/// functions), and particles fill them. Curved sides of second-order elements become flat pieces between
/// their nodes: of arcs of 15°, chords of half of it lose 1 − cos 7.5° of the radius, 1 %.
#[test]
fn volumes_are_those_of_finite_elements() {
    let mut worst: f64 = 0.0;
    for file in fixtures() {
        let mesh = crystfem::mesh::read(&file, 1e-3).unwrap();
        let expected = mesh.quality.volume * 1e9;
        let spacing = (expected / 5000.0).cbrt();
        let text = checked(&format!(
            "spacing = \"{spacing} mm\"\nshapes = [{{ add = \"mesh\", file = \"{}\", unit = \"1 mm\" }}]",
            file.display()
        ));
        let line = text.lines().find(|line| line.contains("body.shapes[0]: ")).unwrap();
        let numbers: Vec<f64> = line.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        let [volume, filled] = numbers[..] else { panic!("{line}") };
        let curved = file.file_name().unwrap().to_string_lossy().starts_with("second_");
        let error = (volume / expected - 1.0).abs();
        assert!(error < if curved { 0.02 } else { 1e-6 }, "{}: {volume} {expected}", file.display());
        worst = worst.max(if curved { 0.0 } else { error });
        assert!((filled / volume - 1.0).abs() < 0.15, "{}: {line}", file.display());
    }
    evidence::near(
        "volume inside facets over that of finite elements of first order, less 1",
        worst,
        0.0,
        1e-6,
    );
}

/// One particle for each cell.
#[test]
fn cells_become_points() {
    let file = workspace().join("crates/crystfem/tests/fixtures/tets_ascii.msh");
    let mesh = crystfem::mesh::read(&file, 1e-3).unwrap();
    let size = (mesh.quality.volume / mesh.mesh.element_count() as f64).cbrt() * 1e3;
    let text = checked(&format!(
        "points = \"{}\"\nunit = \"1 mm\"\nhorizon = \"{} mm\"",
        file.display(),
        3.0 * size
    ));
    assert!(text.contains(&format!("{} particles", mesh.mesh.element_count())), "{text}");
}
