//! Requirements of a release: one version everywhere, one oldest compiler, and a complete archive.

use crate::program::{command, executable, finish, workspace};
use std::collections::BTreeSet;
use std::fs;
use std::io::Read;
use std::process::Command;

fn read(name: &str) -> String {
    fs::read_to_string(workspace().join(name)).unwrap()
}

#[test]
fn one_version_and_one_compiler() {
    let manifest: toml::Table = toml::from_str(&read("Cargo.toml")).unwrap();
    let package = &manifest["workspace"]["package"];
    let (version, rust) = (package["version"].as_str().unwrap(), package["rust-version"].as_str().unwrap());
    assert_eq!(version, env!("CARGO_PKG_VERSION"));
    for (name, crates) in manifest["workspace"]["dependencies"].as_table().unwrap() {
        if let Some(own) = crates.get("path").and_then(|_| crates.get("version")) {
            assert_eq!(own.as_str(), Some(version), "{name}");
        }
    }
    for (file, line) in [
        ("CITATION.cff", format!("\nversion: {version}\n")),
        ("CHANGELOG.md", format!("\n## {version} - ")),
        ("Dockerfile", format!("\nFROM rust:{rust}-slim")),
        ("README.md", format!("Rust ({rust} or newer)")),
        (".github/workflows/ci.yml", format!("dtolnay/rust-toolchain@{rust}\n")),
    ] {
        assert!(read(file).contains(&line), "{file} has no {line:?}");
    }
}

/// Published crates carry both licences, and settings of docs.rs.
#[test]
fn published_crates_are_complete() {
    let mut published = 0;
    for entry in fs::read_dir(workspace().join("crates")).unwrap() {
        let folder = entry.unwrap().path();
        let manifest = fs::read_to_string(folder.join("Cargo.toml")).unwrap();
        if manifest.contains("publish = false") {
            continue;
        }
        published += 1;
        assert!(manifest.contains("[package.metadata.docs.rs]"), "{}", folder.display());
        for licence in ["LICENSE-MIT", "LICENSE-APACHE"] {
            let text = fs::read_to_string(folder.join(licence)).unwrap();
            assert_eq!(text, read(licence), "{}", folder.display());
        }
        let name = folder.file_name().unwrap().to_str().unwrap();
        let cargo = std::env::var_os("CARGO").unwrap_or("cargo".into());
        let list = ["package", "--list", "--offline", "--allow-dirty", "--package", name];
        let output = Command::new(cargo).args(list).current_dir(workspace()).output().unwrap();
        let packed = String::from_utf8(output.stdout).unwrap();
        let has = |file: &str| packed.lines().any(|line| line.replace('\\', "/") == file);
        assert!(has("LICENSE-MIT") && has("README.md"), "{name}: {packed}{:?}", output.stderr);
        assert!(name != "harness" || has("src/view/page.js") && has("src/view/page.html"), "{packed}");
    }
    assert_eq!(published, 10);
}

/// Tests of a published crate read copies of data, because files outside of the package are not published.
#[test]
fn copies_inside_packages_are_current() {
    for (copy, original) in [
        ("polycore/tests/data/treloar1944_uniaxial.csv", "ch1/rubber-fits/treloar1944_uniaxial.csv"),
        ("polycore/tests/data/kawabata1981_biaxial.csv", "ch1/rubber-fits/kawabata1981_biaxial.csv"),
        ("polycore/tests/data/treloar1944_20C.csv", "external/treloar-fits/treloar1944_20C.csv"),
        ("crystfem/tests/fixtures/printed_bar.toml", "ch4/printed-bar/case.toml"),
    ] {
        let (copy, original) = (format!("crates/{copy}"), format!("cases/{original}"));
        assert_eq!(read(&copy), read(&original), "copy {original} to {copy}");
    }
}

/// The archive contains programs, completions, man pages and terms, in agreement with the programs.
#[test]
fn an_archive_for_this_system() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let from = executable("peri").parent().unwrap();
    let line = format!("dist --from {} --output {} --target here", from.display(), here.display());
    finish(command("xtask", &line, workspace()).spawn().unwrap()).with_code(0).shows("polymer-mechanics-");
    let name = format!("polymer-mechanics-{}-here", env!("CARGO_PKG_VERSION"));
    let left: Vec<_> = fs::read_dir(here).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left, [format!("{name}.tar.gz").as_str()], "and nothing else");
    let file = fs::File::open(here.join(format!("{name}.tar.gz"))).unwrap();
    let mut archive = tar::Archive::new(flate2::read::GzDecoder::new(file));
    let (mut places, mut terms, mut page) = (BTreeSet::new(), String::new(), String::new());
    for entry in archive.entries().unwrap() {
        let mut entry = entry.unwrap();
        let place = entry.path().unwrap().strip_prefix(&name).unwrap().to_string_lossy().into_owned();
        let into = match place.as_str() {
            "THIRD-PARTY.md" => Some(&mut terms),
            "man/man1/peri-run.1" => Some(&mut page),
            _ => None,
        };
        if let Some(text) = into {
            entry.read_to_string(text).unwrap();
        }
        if place == "bin/peri" {
            let mut bytes = Vec::new();
            entry.read_to_end(&mut bytes).unwrap();
            assert!(
                bytes == fs::read(executable("peri")).unwrap() && entry.header().mode().unwrap() & 0o100 != 0
            );
        }
        places.insert(place);
    }
    for program in ["crystfem", "mdsurrogate", "peri", "polycore"] {
        for place in [
            format!("bin/{program}{}", std::env::consts::EXE_SUFFIX),
            format!("completions/bash/{program}"),
            format!("completions/zsh/_{program}"),
            format!("completions/fish/{program}.fish"),
            format!("man/man1/{program}.1"),
            format!("man/man1/{program}-view.1"),
        ] {
            assert!(places.contains(&place), "no {place} in {places:#?}");
        }
    }
    for place in ["README.md", "CHANGELOG.md", "CITATION.cff", "LICENSE-APACHE", "LICENSE-MIT"] {
        assert!(places.contains(place), "no {place}");
    }
    // files that the image takes from it
    for place in read("Dockerfile").split_whitespace().filter_map(|word| word.strip_prefix("/archive/")) {
        assert!(places.iter().any(|found| found.starts_with(place)), "Dockerfile: no {place}");
    }
    assert!(page.starts_with(".ie") && page.contains("\\-\\-checkpoint\\-every"), "{page}");
    assert!(terms.contains("\n| nalgebra "), "{terms}");
}
