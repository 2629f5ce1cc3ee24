//! Scenes that are built: bodies, meshes, layers and tool paths, as `check` builds them.

use super::{attack_some, cases, fs};
use crate::{parts, scenes};
use harness::scene::{Failure, Source};
use std::path::{Path, PathBuf};

/// Size above which bodies and meshes are checked, not built.
const LARGEST: f64 = 4e6;
const MOST_ELEMENTS: f64 = 4e3;
/// Share of mutations that are built, which takes milliseconds.
const SHARE: u32 = 20;

fn message<E: std::error::Error>(failure: Failure<E>) -> String {
    match failure {
        Failure::Scene(error) => error.render(),
        // errors of a solution name themselves
        Failure::Run(error) => format!("scene.toml: {error}"),
    }
}

/// Damages scenes in a folder with the files that they name.
fn attack(kind: &str, folder: &Path, files: &[PathBuf], open: impl Fn(&Source) -> Result<(), String>) {
    attack_some(SHARE, kind, files, "scene.toml", |bytes| {
        open(&Source::new(folder.join("scene.toml"), String::from_utf8_lossy(bytes).into_owned()))
    });
}

fn write_files(folder: &Path, texts: &[String]) -> Vec<PathBuf> {
    let write = |(number, text): (usize, &String)| {
        let path = folder.join(format!("{number}.toml"));
        fs::write(&path, text).unwrap();
        path
    };
    texts.iter().enumerate().map(write).collect()
}

#[test]
fn bodies_of_peri() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("points.csv"), scenes::points()).unwrap();
    let texts = [scenes::plate("\"100 mm\"", "1e-3"), scenes::bar().to_owned(), scenes::fracture("8 mm", "")];
    let files = write_files(folder.path(), &texts);
    attack("body", folder.path(), &files, |source| {
        use peri::calibrate::Space;
        use peri::program::scene::{Scene, check, least_memory};
        let scene = source.parse::<Scene>().map_err(|error| error.render())?;
        for variant in check(source, &scene, false).map_err(|error| error.render())? {
            let (source, scene) = variant.resolved();
            let least = match scene.body.space {
                Space::Solid => least_memory::<3>(source, scene, &variant),
                _ => least_memory::<2>(source, scene, &variant),
            };
            if least.map_err(|error| error.render())? > LARGEST {
                return Ok(());
            }
        }
        peri::program::run::explanation(source, &scene, false).map(|_| ()).map_err(message)
    });
}

#[test]
fn parts_of_crystfem() {
    let folder = tempfile::tempdir().unwrap();
    let case = crate::program::workspace().join("cases/ch4/tool-path");
    fs::copy(case.join("part.gcode"), folder.path().join("part.gcode")).unwrap();
    let rows = "0,0,1,1,0\n1,10,1,1,1\n2,20,1,1,1\n3,20,3,1,0\n5,0,3,1,1\n";
    fs::write(folder.path().join("moves.csv"), format!("time,x,y,z,print\n{rows}")).unwrap();
    let along = fs::read_to_string(case.join("case.toml")).unwrap().replace("[40, 20, 4]", "[20, 10, 2]");
    let table = along.replace("part.gcode", "moves.csv");
    let layers = parts::BAR
        .replace("[print]", "[print]\nelements = \"bar\"\nlayer_height = \"0.5 mm\"")
        .replace("emissivity = 0.9", "");
    let files = write_files(folder.path(), &[along, table, layers, parts::BAR.to_owned()]);
    attack("part", folder.path(), &files, |source| {
        let scene = source.parse::<crystfem::program::scene::PartScene>().map_err(|error| error.render())?;
        let elements = scene.mesh.elements(source).map_err(|error| error.render())?;
        if elements.iter().product::<f64>() > MOST_ELEMENTS || scene.mesh.file.is_some() {
            return Ok(());
        }
        crystfem::program::run::explain(source, false).map(|_| ()).map_err(message)
    });
}

/// Kinetics and fits, with their tables.
#[test]
fn points_and_fits_of_crystfem() {
    use crystfem::program::scene::{SceneKind, kind};
    for file in cases("crystfem") {
        let source = Source::read(&file).unwrap();
        if kind(&source).unwrap() == SceneKind::Part {
            continue;
        }
        let folder = file.parent().unwrap().to_owned();
        attack("points", &folder, &[file], |source| match kind(source).map_err(|error| error.render())? {
            SceneKind::Part => Ok(()),
            _ => crystfem::program::run::explain(source, false).map(|_| ()).map_err(message),
        });
    }
}
