//! Mesh readers on damaged input give an error or a checked mesh, but no panic, endless loop or huge
//! allocation.

use std::path::Path;

use crystfem::mesh::path::{self, Bead};
use crystfem::mesh::{self, Grid, ReadMesh, abaqus, gmsh};
use proptest::prelude::*;

type Parse = fn(&Path, &[u8], f64) -> Result<ReadMesh, crystfem::Error>;

const FILES: [(&str, Parse); 9] = [
    ("hexes_ascii.msh", gmsh::parse),
    ("hexes_binary.msh", gmsh::parse),
    ("tets_ascii.msh", gmsh::parse),
    ("tets_binary.msh", gmsh::parse),
    ("hexes_ascii_40.msh", gmsh::parse),
    ("hexes_ascii_22.msh", gmsh::parse),
    ("hexes_binary_22.msh", gmsh::parse),
    ("hexes.inp", abaqus::parse),
    ("tets.inp", abaqus::parse),
];

fn fixture(name: &str) -> Vec<u8> {
    std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)).unwrap()
}

/// Checks that the result is a valid mesh or an error.
fn judge(name: &str, parse: Parse, bytes: &[u8]) {
    match parse(Path::new(name), bytes, 1.0) {
        Ok(read) => {
            assert_eq!(read.node_labels.len(), read.mesh.points.len());
            assert_eq!(read.element_labels.len(), read.mesh.element_count());
            assert!(mesh::quality::check(&read.mesh, None).is_ok());
        }
        Err(error) => {
            let text = error.to_string();
            assert!(text.contains(name) && text.chars().count() < 3000, "{text}");
        }
    }
}

/// Words of such files, inserted at wrong places.
const WORDS: [&str; 16] = [
    "0",
    "-1",
    "1",
    "4294967295",
    "18446744073709551615",
    "1e308",
    "nan",
    "\n",
    ",",
    "*",
    "$",
    "\"",
    "*NODE\n",
    "$EndNodes\n",
    "*ELSET,ELSET=a,GENERATE\n1,18446744073709551615\n",
    "\0",
];

const PATH: &str = "G28 ; home\nG1 X0 Y0.25 Z0.2 F600\nM83\nG1 X10 E1\nG0 Y0.75\nG1 X0 E1 (back)\nG4 \
    P100\nG92 E0\nG91\n\
                    G1 Z0.2\nG90\nM117 layer\n";

#[derive(Clone, Debug)]
enum Damage {
    Flip(usize, u8),
    Cut(usize),
    Remove(usize, usize),
    Insert(usize, usize),
    Repeat(usize, usize),
}

fn damage() -> impl Strategy<Value = Damage> {
    let place = 0usize..1 << 20;
    prop_oneof![
        (place.clone(), any::<u8>()).prop_map(|(at, byte)| Damage::Flip(at, byte)),
        place.clone().prop_map(Damage::Cut),
        (place.clone(), 1usize..200).prop_map(|(at, length)| Damage::Remove(at, length)),
        (place.clone(), 0..WORDS.len()).prop_map(|(at, word)| Damage::Insert(at, word)),
        (place, 1usize..200).prop_map(|(at, length)| Damage::Repeat(at, length)),
    ]
}

fn apply(bytes: &mut Vec<u8>, damage: &Damage) {
    let place = |at: usize| at % (bytes.len() + 1);
    match *damage {
        Damage::Flip(at, byte) => {
            let at = place(at);
            if let Some(old) = bytes.get_mut(at) {
                *old = byte;
            }
        }
        Damage::Cut(at) => {
            // cut mostly near the end, so that something is left to read
            let at = bytes.len() - place(at) / 8;
            bytes.truncate(at);
        }
        Damage::Remove(at, length) => {
            let at = place(at);
            let end = (at + length).min(bytes.len());
            bytes.drain(at..end);
        }
        Damage::Insert(at, word) => {
            let at = place(at);
            bytes.splice(at..at, WORDS[word].bytes());
        }
        Damage::Repeat(at, length) => {
            let at = place(at);
            let end = (at + length).min(bytes.len());
            let part = bytes[at..end].to_vec();
            bytes.splice(at..at, part);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
     fn damaged_files_are_errors_or_meshes(
        file in 0..FILES.len(), damages in prop::collection::vec(damage(), 1..4)
    ) {
        let (name, parse) = FILES[file];
        let mut bytes = fixture(name);
        for damage in &damages {
            apply(&mut bytes, damage);
        }
        judge(name, parse, &bytes);
    }

    #[test]
     fn numbers_of_binary_files(
        at in 0usize..7000, value in prop_oneof![Just(u64::MAX), Just(1u64 << 40), any::<u64>()]
    ) {
        let mut bytes = fixture("hexes_binary.msh");
        if let Some(place) = bytes.get_mut(at..at + 8) {
            place.copy_from_slice(&value.to_le_bytes());
        }
        judge("hexes_binary.msh", gmsh::parse, &bytes);
    }

    #[test]
    fn damaged_paths(damages in prop::collection::vec(damage(), 1..6)) {
        let mut bytes = PATH.repeat(20).into_bytes();
        for damage in &damages {
            apply(&mut bytes, damage);
        }
        let mesh = Grid::uniform([0.0; 3], [0.02, 0.02, 1e-3], [9, 9, 5]).unwrap().mesh("plate").unwrap();
        let all: Vec<u32> = (0..mesh.element_count() as u32).collect();
        match path::parse(Path::new("a.gcode"), &bytes) {
            Ok(path) => {
                prop_assert!(path.moves.iter().all(|moved| moved.start <= moved.end));
                prop_assert!(path.moves.windows(2).all(|pair| pair[0].end <= pair[1].start));
                let bead = Bead { width: 4e-4, height: 3e-4 };
                if let Ok(mut activation) = path.activation_times(&mesh, &all, bead) {
                    activation.fill(&mesh);
                    prop_assert!(activation.times.iter().all(|time| *time >= 0.0));
                }
            }
            Err(error) => prop_assert!(error.to_string().starts_with("a.gcode:"), "{error}"),
        }
    }

    #[test]
    fn noise(bytes in prop::collection::vec(any::<u8>(), 0..300), binary in any::<bool>()) {
        let header = if binary { &b"$MeshFormat\n4.1 1 \
            8\n\x01\0\0\0\n$EndMeshFormat\n$Nodes\n"[..] } else { b"*NODE\n" };
        let all = [header, &bytes].concat();
        judge("noise", if binary { gmsh::parse } else { abaqus::parse }, &all);
        judge("noise", abaqus::parse, &bytes);
        judge("noise", gmsh::parse, &bytes);
        let _ = path::parse(Path::new("noise"), &bytes);
    }
}

/// Files truncated at each byte of their first part, and at each hundredth of the rest.
#[test]
fn cut_files() {
    for (name, parse) in FILES {
        let bytes = fixture(name);
        for end in (0..bytes.len().min(600)).chain((600..bytes.len()).step_by(bytes.len() / 100 + 1)) {
            judge(name, parse, &bytes[..end]);
        }
    }
}

/// Announced counts without data allocate nothing.
#[cfg(target_os = "linux")]
#[test]
fn announced_counts_allocate_nothing() {
    // peak address space, bytes
    let peak = || -> usize {
        let status = std::fs::read_to_string("/proc/self/status").unwrap();
        let line = status.lines().find(|line| line.starts_with("VmPeak")).unwrap();
        line.split_whitespace().nth(1).unwrap().parse::<usize>().unwrap() * 1024
    };
    let before = peak();
    for count in [1_000_000_000_000u64, u64::MAX] {
        let header = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n";
        for text in [
            format!("{header}$Nodes\n1 {count} 1 {count}\n3 1 0 {count}\n1\n"),
            format!("{header}$Nodes\n{count} {count} 1 {count}\n3 1 0 1\n1\n0 0 0\n"),
            format!("{header}$Elements\n1 {count} 1 {count}\n3 1 5 {count}\n1 1\n"),
            format!("{header}$Entities\n{count} {count} {count} {count}\n1 0 0 0 {count} 1\n"),
            format!("{header}$PhysicalNames\n{count}\n3 1 \"a\"\n"),
        ] {
            judge("announced", gmsh::parse, text.as_bytes());
        }
        let text = format!("*NODE\n1,0,0,0\n{count},0,0,1\n*NSET,NSET=a,GENERATE\n1,{count}\n");
        judge("announced", abaqus::parse, text.as_bytes());
    }
    // the other tests of this program need less in total
    assert!(peak() - before < 2 << 30);
}

#[test]
fn readers_are_chosen_by_extension() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures");
    assert_eq!(mesh::read(&folder.join("hexes.inp"), 1.0).unwrap().mesh.hexahedra.len(), 16);
    assert_eq!(mesh::read(&folder.join("hexes_binary.msh"), 1.0).unwrap().mesh.hexahedra.len(), 16);
    let error = mesh::read(Path::new("part.stl"), 1.0).unwrap_err().to_string();
    assert!(error.contains("part.stl: allowed: `.msh`"), "{error}");
}
