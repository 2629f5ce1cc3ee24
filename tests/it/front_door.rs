//! Robustness against input files damaged at random: scenes, meshes, tool paths, tables, clouds, HDF5, laws,
//! checkpoints. No panic, no hang, no memory beyond what the file justifies, and an error that names the
//! place.
//!
//! 2000 mutations of each kind, always the same. The environment variable `FRONT_DOOR=100000` makes that many
//! new ones. Failures are kept in tests/proptest-regressions and tried first.

use crate::allocations;
use crate::bad::write_bad_scenes;
use crate::program::workspace;
use harness::scene::Source;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestCaseError, TestRng, TestRunner};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

mod hdf5;
mod points;
mod scenes;

/// Mutations of each kind, unless `FRONT_DOOR` says otherwise.
const MUTATIONS: u32 = 2000;
/// Time limit of each mutation, on a busy machine.
const TIME_LIMIT: Duration = Duration::from_secs(5);
/// Memory that opening a file may take: a constant, and a multiple of its length.
const MEMORY: [u64; 2] = [32 << 20, 256];
/// Bytes taken of a larger file.
const LARGEST: usize = 64 << 10;

/// Tokens to insert: extreme numbers, brackets, words of the formats.
const TOKENS: [&str; 48] = [
    "0",
    "-1",
    "1",
    "1e308",
    "-1e308",
    "1e-320",
    "nan",
    "inf",
    "-inf",
    "4294967296",
    "18446744073709551616",
    "-9223372036854775809",
    "999999999999",
    "0.0000001",
    "\"",
    "'",
    "[",
    "]",
    "{",
    "}",
    "=",
    ",",
    "\n",
    "\r\n",
    "\t",
    " ",
    "#",
    ".",
    "\0",
    "é",
    "𝓛",
    "\u{feff}",
    "0 mm",
    "1e300 mm",
    "-5 K",
    "[[",
    "]]",
    "[body]",
    "[[study]]",
    "free",
    "*NODE",
    "*ELEMENT, TYPE=C3D8",
    "$Nodes",
    "$EndNodes",
    "$Elements",
    "G1 X1e300",
    "NaN",
    "true",
];

/// Change of a file; places and lengths are shares of its length.
#[derive(Clone, Debug)]
enum Change {
    Flip(u16, u8),
    Delete(u16, u8),
    Repeat(u16, u8),
    Insert(u16, usize),
    Replace(u16, u8, usize),
    Cut(u16),
}

fn change() -> impl Strategy<Value = Change> {
    let token = 0..TOKENS.len();
    prop_oneof![
        (any::<u16>(), 1u8..).prop_map(|(at, bits)| Change::Flip(at, bits)),
        (any::<u16>(), any::<u8>()).prop_map(|(at, length)| Change::Delete(at, length)),
        (any::<u16>(), any::<u8>()).prop_map(|(at, length)| Change::Repeat(at, length)),
        (any::<u16>(), token.clone()).prop_map(|(at, token)| Change::Insert(at, token)),
        (any::<u16>(), 0u8..24, token).prop_map(|(at, length, token)| Change::Replace(at, length, token)),
        any::<u16>().prop_map(Change::Cut),
    ]
}

fn apply(bytes: &mut Vec<u8>, change: &Change) {
    let place = |at: u16| bytes.len() * usize::from(at) / (usize::from(u16::MAX) + 1);
    let end = |at: usize, length: u8| (at + usize::from(length)).min(bytes.len());
    match *change {
        Change::Flip(at, bits) => {
            let at = place(at);
            if let Some(byte) = bytes.get_mut(at) {
                *byte ^= bits;
            }
        }
        Change::Delete(at, length) => {
            let at = place(at);
            let end = end(at, length);
            bytes.drain(at..end);
        }
        Change::Repeat(at, length) => {
            let at = place(at);
            let piece = bytes[at..end(at, length)].to_vec();
            bytes.splice(at..at, piece);
        }
        Change::Insert(at, token) => {
            let at = place(at);
            bytes.splice(at..at, TOKENS[token].bytes());
        }
        Change::Replace(at, length, token) => {
            let at = place(at);
            let end = end(at, length);
            bytes.splice(at..end, TOKENS[token].bytes());
        }
        Change::Cut(at) => bytes.truncate(place(at)),
    }
}

/// Damages files of a kind and opens them; an error must contain `name`, the place of the fault.
fn attack(kind: &str, files: &[PathBuf], name: &str, open: impl Fn(&[u8]) -> Result<(), String>) {
    attack_some(1, kind, files, name, open);
}

/// Applies one of `share` mutations.
fn attack_some(
    share: u32,
    kind: &str,
    files: &[PathBuf],
    name: &str,
    open: impl Fn(&[u8]) -> Result<(), String>,
) {
    let corpus: Vec<Vec<u8>> = files
        .iter()
        .map(|file| {
            let mut bytes = fs::read(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
            bytes.truncate(LARGEST);
            bytes
        })
        .collect();
    assert!(!corpus.is_empty(), "{kind}");
    let asked = std::env::var("FRONT_DOOR").ok().map(|count| count.parse().expect("FRONT_DOOR, a count"));
    let config = Config {
        cases: asked.unwrap_or(MUTATIONS).div_ceil(share),
        source_file: Some(file!()),
        ..Config::default()
    };
    let mut runner = match asked {
        Some(_) => TestRunner::new(config),
        None => TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha)),
    };
    let inputs = (0..corpus.len(), prop::collection::vec(change(), 1..6));
    let result = runner.run(&inputs, |(index, changes)| {
        let mut bytes = corpus[index].clone();
        changes.iter().for_each(|change| apply(&mut bytes, change));
        let begun = Instant::now();
        let (opened, memory) = allocations::most(|| open(&bytes));
        prop_assert!(begun.elapsed() < TIME_LIMIT, "{:?}", begun.elapsed());
        let allowed = MEMORY[0] + MEMORY[1] * bytes.len() as u64;
        prop_assert!(memory <= allowed, "{memory} bytes of memory, {allowed} allowed");
        match opened {
            Err(message) if !message.contains(name) => {
                Err(TestCaseError::fail(format!("no place: {message}")))
            }
            _ => Ok(()),
        }
    });
    if let Err(error) = result {
        panic!("{kind}: {error}");
    }
}

/// Lists files below a folder of the workspace whose names have the given ending.
fn below(folder: &str, ending: &str) -> Vec<PathBuf> {
    let (mut found, mut folders) = (Vec::new(), vec![workspace().join(folder)]);
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.to_string_lossy().ends_with(ending) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// Cases of a program.
fn cases(program: &str) -> Vec<PathBuf> {
    let mark = format!("program = \"{program}\"");
    let mut files = below("cases", "case.toml");
    files.retain(|file| fs::read_to_string(file).unwrap().contains(&mark));
    files
}

/// Opens scenes given as text by `open`.
fn attack_scenes(files: &[PathBuf], open: impl Fn(&Source) -> Result<(), harness::scene::SceneError>) {
    attack("scene", files, "scene.toml", |bytes| {
        let source = Source::new("scene.toml", String::from_utf8_lossy(bytes).into_owned());
        open(&source).map_err(|error| error.render())
    });
}

/// Opens files at a path by `open`.
fn attack_files(kind: &str, files: &[PathBuf], name: &str, open: impl Fn(&Path) -> Result<(), String>) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    attack(kind, files, name, |bytes| {
        // a file that is overwritten would be flushed to the disk every time
        let _ = fs::remove_file(&path);
        fs::write(&path, bytes).unwrap();
        open(&path)
    });
}

#[test]
fn scenes_of_peri() {
    let mut files = cases("peri");
    let folder = tempfile::tempdir().unwrap();
    let bad = write_bad_scenes("peri", folder.path());
    files.extend(bad.iter().map(|scene| folder.path().join(format!("{}.toml", scene.name))));
    attack_scenes(&files, |source| {
        let scene = source.parse::<peri::program::scene::Scene>()?;
        peri::program::observe::check(source, &scene, false).map(|_| ())
    });
}

#[test]
fn scenes_of_crystfem() {
    use crystfem::program::scene::{FitScene, PartScene, PointScene, SceneKind, kind};
    attack_scenes(&cases("crystfem"), |source| match kind(source)? {
        SceneKind::Part => source.parse::<PartScene>()?.check(source),
        SceneKind::Point => source.parse::<PointScene>().map(|_| ()),
        SceneKind::Fit => source.parse::<FitScene>().map(|_| ()),
    });
}

#[test]
fn scenes_of_mdsurrogate() {
    let mut files = cases("mdsurrogate");
    files.extend(below("crates/mdsurrogate/tests/bad", ".toml"));
    attack_scenes(&files, |source| source.parse::<mdsurrogate::program::scene::Scene>()?.check(source));
}

#[test]
fn meshes_of_gmsh() {
    let files = below("crates/crystfem/tests/fixtures", ".msh");
    attack("Gmsh", &files, "part.msh", |bytes| {
        let mesh = crystfem::mesh::gmsh::parse(Path::new("part.msh"), bytes, 1e-3);
        mesh.map(|_| ()).map_err(|error| error.to_string())
    });
}

#[test]
fn meshes_of_abaqus() {
    let files = below("crates/crystfem/tests/fixtures", ".inp");
    attack("Abaqus", &files, "part.inp", |bytes| {
        let mesh = crystfem::mesh::abaqus::parse(Path::new("part.inp"), bytes, 1e-3);
        mesh.map(|_| ()).map_err(|error| error.to_string())
    });
}

#[test]
fn tool_paths() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::write(&path, text).unwrap();
        path
    };
    let lines: String =
        (0..40).map(|k| format!("G1 X{} Y{} Z{} E{} F1800\n", k % 7, k % 5, k / 8, k)).collect();
    let gcode = write("a.gcode", &format!("G21\nG90\nM82\nG92 E0\n; layer\n{lines}G28 ; home\n"));
    attack("G-code", &[gcode], "path.gcode", |bytes| {
        let path = crystfem::mesh::path::parse(Path::new("path.gcode"), bytes);
        path.map(|_| ()).map_err(|error| error.to_string())
    });
    let rows: String = (0..40).map(|k| format!("{k},{},{},{},{}\n", k % 7, k % 5, k / 8, k % 2)).collect();
    let table = write("a.csv", &format!("time [s],x [mm],y [mm],z [mm],print\n{rows}"));
    attack_files("table of moves", &[table], "path.csv", |path| {
        crystfem::mesh::path::read_csv(path).map(|_| ()).map_err(|error| error.to_string())
    });
}

#[test]
fn tables() {
    let mut files = below("cases", ".csv");
    files.extend(below("tests/bad/clouds", ".csv"));
    attack_files("CSV", &files, "table.csv", |path| {
        harness::output::csv::read(path).map(|_| ()).map_err(|error| error.to_string())
    });
    attack_files("history", &below("cases/ch4", ".csv"), "history.csv", |path| {
        crystfem::history::TemperatureHistory::read(path).map(|_| ()).map_err(|error| error.to_string())
    });
    let rubber = below("cases/ch1", ".csv");
    attack_files("rubber data", &rubber, "rubber.csv", |path| {
        polycore::constitutive::hyperelastic::data::TestData::read(path)
            .map(|_| ())
            .map_err(|error| error.to_string())
    });
}

#[test]
fn data_of_molecular_dynamics() {
    use mdsurrogate::dataset::{ReadOptions, read};
    let folder = tempfile::tempdir().unwrap();
    let head = "run_id,kind,rate_x,rate_y,rate_z,sample,time_fs,lx,ly,lz,F11,F22,F33,\
                avg_lx,avg_ly,avg_lz,avg_sxx,avg_syy,avg_szz,avg_sxy,avg_sxz,avg_syz\n";
    let row = |k: usize| {
        let (run, stretch) = (k / 20, 1.0 + 0.01 * (k % 20) as f64);
        let (lx, sxx) = (38.0 * stretch, 100 * k);
        format!("r{run},ux,1e-5,0,0,{k},{k},{lx},33,64,{stretch},1,1,{lx},33,64,{sxx},1,2,3,4,5\n")
    };
    let path = folder.path().join("a.csv");
    fs::write(&path, head.to_owned() + &(0..60).map(row).collect::<String>()).unwrap();
    let text = fs::read(&path).unwrap();
    attack_files("data set", &[path], "data.csv", |path| {
        read(path, &ReadOptions::default()).map(|_| ()).map_err(|error| error.to_string())
    });
    // one piece, and two, as `cat` joins them
    let half = 1 + text[..text.len() / 2].iter().rposition(|&byte| byte == b'\n').unwrap();
    let packed = [&[&text[..]][..], &[&text[..half], &text[half..]]].map(|pieces| {
        let path = folder.path().join(format!("{}.csv.gz", pieces.len()));
        fs::write(&path, pieces.iter().flat_map(|piece| gzip(piece)).collect::<Vec<u8>>()).unwrap();
        read(&path, &ReadOptions::default()).unwrap();
        path
    });
    let files: Vec<PathBuf> = packed.into_iter().chain(below("cases/ch3", ".csv.gz")).collect();
    attack_files("packed data set", &files, "data.csv.gz", |path| {
        read(path, &ReadOptions::default()).map(|_| ()).map_err(|error| error.to_string())
    });
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    packer.write_all(bytes).unwrap();
    packer.finish().unwrap()
}

#[test]
fn laws_of_a_surrogate() {
    use mdsurrogate::network::Activation;
    use mdsurrogate::surrogate::{Header, Kind, Surrogate, Symmetry};
    let folder = tempfile::tempdir().unwrap();
    let kinds = [("ann", Kind::Ann), ("energy", Kind::energy(Symmetry::Orthotropic))];
    let files = kinds.map(|(name, kind)| {
        let path = folder.path().join(name);
        let header = Header::new(kind, &[(8, Activation::Softplus)], 2);
        Surrogate::<f64>::random(header, 1).unwrap().write(&path).unwrap();
        path
    });
    attack_files("law", &files, "law.safetensors", |path| {
        Surrogate::<f64>::read(path).map(|_| ()).map_err(|error| error.to_string())
    });
}

#[test]
fn checkpoints() {
    const MAGIC: &harness::checkpoint::Magic = b"fronting";
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a");
    let value: Vec<(String, Vec<f64>)> = (0..9).map(|k| (format!("field {k}"), vec![0.5; 20 * k])).collect();
    harness::checkpoint::write(&path, MAGIC, &value).unwrap();
    attack_files("checkpoint", &[path], "checkpoint.bin", |path| {
        match harness::checkpoint::read::<Vec<(String, Vec<f64>)>>(path, MAGIC) {
            // its checksum rejects every change
            Ok(read) if read != value => Err("a damaged checkpoint was read".to_owned()),
            Ok(_) => Ok(()),
            Err(error) => Err(error.to_string()),
        }
    });
}
