//! Dependency rules of docs/ARCHITECTURE.md.

use crate::program::{executable, workspace};
use std::process::Command;

/// Lines of `cargo tree` with flags, separated by blanks.
fn lines(flags: &str) -> Vec<String> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let arguments = ["tree", "--offline", "--prefix", "none"];
    let output = Command::new(cargo)
        .args(arguments)
        .args(flags.split_whitespace())
        .current_dir(workspace())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().map(|line| line.trim_end_matches(" (*)").to_owned()).collect()
}

/// Packages of a crate's build.
fn tree(package: &str, flags: &str) -> Vec<String> {
    let lines = lines(&format!("--edges normal,build --package {package} {flags}"));
    lines.iter().filter_map(|line| Some(line.split_whitespace().next()?.to_owned())).collect()
}

/// `cargo xtask` and the check of the libraries alone (`.ci/run`) build packages as the whole workspace does;
/// a feature that another package asks for belongs into crates/workspace-hack.
#[test]
fn one_build_serves_all_commands() {
    let with_features = |flags: &str| lines(&format!("--format {{p}}[{{f}}] --edges normal,build{flags}"));
    let all = with_features(",dev --workspace");
    let own = with_features(" --package xtask");
    let libraries = "polycore -p peri -p crystfem -p mdsurrogate -p workspace-hack";
    let libraries = with_features(&format!(" --no-default-features -p {libraries}"));
    let foreign = libraries.iter().filter(|line| !line.contains(" (/"));
    for line in own.iter().chain(foreign) {
        assert!(all.contains(line), "{line} is built twice: add its features to crates/workspace-hack");
    }
}

/// The siblings depend on `polycore` only, and only `mdsurrogate` on the training framework.
#[test]
fn no_crate_is_built_with_what_it_does_not_need() {
    let framework = |name: &String| name == "burn" || name.starts_with("burn-");
    assert!(tree("mdsurrogate", "").iter().any(framework));
    assert!(!tree("polymech", "").iter().any(framework), "the Python module is built with burn");
    for package in ["polycore", "peri", "crystfem"] {
        let tree = tree(package, "");
        assert!(tree.iter().any(|name| name == "polycore"), "{tree:?}");
        assert!(!tree.iter().any(framework), "{package} is built with burn");
        // learnt laws are a feature of polycore, for scenes of peri; arrays are for polycore itself
        let has = |name: &str| tree.iter().any(|other| other == name);
        assert_eq!(has("safetensors"), package != "crystfem", "{package}");
        assert_eq!(has("ndarray"), package == "polycore", "{package}");
        assert_eq!(has("harness"), package != "polycore", "{package}");
        for other in ["peri", "crystfem", "mdsurrogate", "evidence"] {
            assert!(package == other || !tree.iter().any(|name| name == other), "{package}: {other}");
        }
    }
}

/// A library without scenes brings no harness, scene format, errors with carets, pictures or command line.
/// Data sets of `mdsurrogate` and tool paths of `crystfem` are tables: they read CSV, too.
#[test]
fn libraries_bring_no_shell() {
    for package in ["polycore", "peri", "crystfem", "mdsurrogate"] {
        let tree = tree(package, "--no-default-features");
        for name in [
            "harness",
            "miette",
            "toml",
            "schemars",
            "csv",
            "kuva",
            "png",
            "clap",
            "indicatif",
            "rust-hdf5",
            "burn",
        ] {
            let reads_tables = package != "polycore" && package != "peri" && name == "csv";
            assert!(reads_tables || !tree.iter().any(|other| other == name), "{package}: {name}");
        }
        // a library takes the laws that its user passes
        let learnt = tree.iter().any(|name| name == "safetensors");
        assert_eq!(learnt, package == "mdsurrogate", "{package}");
    }
}

/// A binary runs on any Linux of its age: it loads nothing but the C library and its companions.
#[cfg(target_os = "linux")]
#[test]
fn binaries_need_nothing_but_libc() {
    for program in ["crystfem", "mdsurrogate", "peri", "polycore"] {
        let Ok(output) = Command::new("ldd").arg(executable(program)).output() else {
            return evidence::skipped("ldd");
        };
        let text = String::from_utf8(output.stdout).unwrap();
        let names = text.lines().filter_map(|line| line.split_whitespace().next()?.rsplit('/').next());
        for name in names {
            let known = [
                "linux-vdso.",
                "libgcc_s.",
                "libm.",
                "libc.",
                "libdl.",
                "libpthread.",
                "ld-linux",
                "statically",
            ];
            assert!(known.iter().any(|known| name.starts_with(known)), "{program} loads {name}");
        }
    }
}
