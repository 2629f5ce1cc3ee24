//! Licences of the dependencies of our programs, for archives of binaries: each dependency with its terms and
//! their text.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::process::Command;

use miette::{IntoDiagnostic, Result, WrapErr, miette};
use serde::Deserialize;

use crate::workspace::Repository;

/// Prefixes of the names of licence files.
const TERMS: [&str; 5] = ["LICENSE", "LICENCE", "COPYING", "NOTICE", "UNLICENSE"];

#[derive(Deserialize)]
struct Metadata {
    packages: Vec<Package>,
}

#[derive(Deserialize)]
struct Package {
    name: String,
    version: String,
    license: Option<String>,
    authors: Vec<String>,
    manifest_path: String,
    source: Option<String>,
}

/// Dependency, its terms and their texts.
struct LinkedPackage {
    what: String,
    terms: String,
    texts: Vec<String>,
}

/// Generates `THIRD-PARTY.md`: crates linked into the programs, and their licences.
///
/// # Errors
/// Cargo fails; a crate without terms.
pub fn text(workspace: &Repository, programs: &[String]) -> Result<String> {
    let linked = linked(workspace, programs)?;
    let metadata = cargo(workspace, &["metadata", "--format-version", "1", "--locked"])?;
    let metadata: Metadata = serde_json::from_str(&metadata).into_diagnostic()?;
    let ours = |name: &str| fs::read_to_string(workspace.root().join(name)).into_diagnostic();
    let (mit, apache) = (ours("LICENSE-MIT")?, ours("LICENSE-APACHE")?);
    let mut parts = Vec::new();
    for package in metadata.packages.iter().filter(|package| package.source.is_some()) {
        let what = format!("{} {}", package.name, package.version);
        if linked.contains(&what) {
            parts.push(read_package(package, what, &mit, &apache)?);
        }
    }
    if parts.len() < linked.len() / 2 {
        return Err(miette!("terms of {} of {} crates were found", parts.len(), linked.len()));
    }
    Ok(format_list(&mut parts))
}

/// Lists name and version of all crates linked into the programs on this machine.
fn linked(workspace: &Repository, programs: &[String]) -> Result<BTreeSet<String>> {
    let mut arguments = vec!["tree", "--locked", "--edges", "normal", "--prefix", "none", "--format", "{p}"];
    let packages: Vec<String> = programs.iter().filter_map(|program| workspace.package(program)).collect();
    packages.iter().for_each(|package| arguments.extend(["--package", package]));
    let tree = cargo(workspace, &arguments)?;
    let of = |line: &str| {
        let (name, rest) = line.split_once(" v")?;
        Some(format!("{name} {}", rest.split_whitespace().next()?))
    };
    Ok(tree.lines().filter_map(of).collect())
}

fn cargo(workspace: &Repository, arguments: &[&str]) -> Result<String> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(arguments)
        .current_dir(workspace.root())
        .output()
        .into_diagnostic()
        .wrap_err("cannot start cargo")?;
    if !output.status.success() {
        return Err(miette!("cargo {}: {}", arguments[0], String::from_utf8_lossy(&output.stderr).trim()));
    }
    String::from_utf8(output.stdout).into_diagnostic()
}

fn read_package(package: &Package, what: String, mit: &str, apache: &str) -> Result<LinkedPackage> {
    let folder = Path::new(&package.manifest_path).parent().unwrap_or(Path::new("."));
    let mut texts = Vec::new();
    let entries = fs::read_dir(folder).into_diagnostic().wrap_err_with(|| folder.display().to_string())?;
    let mut files: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    files.sort();
    for file in files.iter().filter(|file| file.is_file()) {
        let name = file.file_name().unwrap_or_default().to_string_lossy().to_uppercase();
        if TERMS.iter().any(|terms| name.starts_with(terms)) {
            texts.push(String::from_utf8_lossy(&fs::read(file).into_diagnostic()?).trim().to_owned());
        }
    }
    let terms = package.license.clone().ok_or_else(|| miette!("{what} states no licence"))?;
    if texts.is_empty() {
        // the text of the terms that it names
        let holders = match package.authors.is_empty() {
            true => format!("the authors of {}", package.name),
            false => package.authors.join(", "),
        };
        let of = |text: &str| text.split_once("\n\n").map_or("", |(_, rest)| rest).to_owned();
        texts.push(match terms.as_str() {
            _ if terms.contains("Apache-2.0") => apache.trim().to_owned(),
            _ if terms.contains("MIT") => {
                let body = of(mit);
                let body = body.split_once("\n\n").map_or("", |(_, rest)| rest);
                format!("MIT License\n\nCopyright (c) {holders}\n\n{}", body.trim())
            }
            _ => return Err(miette!("{what} comes without the text of its licence, {terms}")),
        });
    }
    Ok(LinkedPackage { what, terms, texts })
}

/// Formats the list of crates, then every licence text once, with the names of its crates.
fn format_list(parts: &mut [LinkedPackage]) -> String {
    parts.sort_by(|a, b| a.what.cmp(&b.what));
    let mut text = String::from(
        "# Third-party software\n\nThe programs contain these crates.\n\n| crate | licence |\n|---|---|\n",
    );
    let mut texts: BTreeMap<String, (Vec<&str>, &str)> = BTreeMap::new();
    for part in parts.iter() {
        text += &format!("| {} | {} |\n", part.what, part.terms);
        for terms in &part.texts {
            let key = terms.split_whitespace().collect::<Vec<_>>().join(" ");
            texts.entry(key).or_insert_with(|| (Vec::new(), terms)).0.push(&part.what);
        }
    }
    let mut texts: Vec<_> = texts.into_values().collect();
    texts.sort_by(|a, b| (b.0.len(), &a.0).cmp(&(a.0.len(), &b.0)));
    for (crates, terms) in texts {
        text += &format!("\n## {}\n\n````text\n{terms}\n````\n", crates.join(", "));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    /// Every linked crate is listed with its terms; dev-dependencies and those of other systems are not.
    #[test]
    fn every_linked_crate_has_terms() {
        let workspace = Repository::new(PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(".."));
        let text = text(&workspace, &workspace.programs()).expect("terms of all crates");
        let (list, _) = text.split_once("\n## ").expect("texts");
        for name in ["nalgebra", "burn", "kuva", "rust-hdf5", "faer"] {
            assert!(list.contains(&format!("\n| {name} ")), "{name}");
        }
        for name in ["proptest", "criterion", "evidence", "windows-sys"] {
            assert!(!list.contains(&format!("\n| {name} ")), "{name}");
        }
        let rows = list.matches("\n| ").count() - 1;
        for row in list.lines().skip_while(|line| !line.starts_with("|---")).skip(1) {
            let what = row.split('|').nth(1).expect("a crate").trim();
            let heads = |line: &str| line.starts_with("## ") && line.contains(what);
            assert!(text.lines().any(heads), "no text for {what}");
        }
        assert!(rows > 200, "{rows} crates");
    }
}
