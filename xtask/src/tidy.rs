//! Fast checks of the tree.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use miette::{IntoDiagnostic, Result, WrapErr, miette};

use crate::table::print;
use crate::workspace::Repository;

mod words;

/// Largest number of lines of a source file.
const MOST_LINES: usize = 500;

/// Largest size of a file in git.
const MOST_BYTES: u64 = 1_000_000;

/// Prints every finding; returns true if there is none.
pub fn run(workspace: &Repository) -> Result<bool> {
    let files = tracked(workspace.root())?;
    let mut findings = Vec::new();
    let mut words = words::WordCounts::default();
    for file in &files {
        let path = workspace.root().join(file);
        // a file deleted but not yet committed is still listed
        let Ok(metadata) = fs::metadata(&path) else { continue };
        if metadata.len() > MOST_BYTES {
            findings.push(format!(
                "{}: {} bytes in git, at most {MOST_BYTES} are allowed",
                file.display(),
                metadata.len()
            ));
        }
        if file.extension().is_some_and(|extension| extension == "rs") {
            let text = fs::read_to_string(&path).into_diagnostic()?;
            words.add(&file.display().to_string(), &text);
            let lines = text.lines().count();
            if is_source(file) && lines > MOST_LINES {
                findings.push(format!("{}: {lines} lines, at most {MOST_LINES} are allowed", file.display()));
            }
        }
    }
    findings.extend(unused_dependencies(workspace.root(), &files)?);
    findings.extend(words.findings());
    findings.extend(crate::pictures::findings(workspace.root(), &files)?);
    findings.extend(crate::prose::findings(workspace.root(), &files));
    for finding in &findings {
        print(&format!("{finding}\n"));
    }
    print(&words.summary());
    print(&format!("tidy: {} files in git, {} findings\n", files.len(), findings.len()));
    Ok(findings.is_empty())
}

/// Finds dependencies that the root manifest declares and no member uses.
fn unused_dependencies(root: &Path, files: &[PathBuf]) -> Result<Vec<String>> {
    let manifest = |path: &Path| -> Result<toml::Table> {
        let text = fs::read_to_string(root.join(path)).into_diagnostic()?;
        toml::from_str(&text).into_diagnostic().wrap_err_with(|| path.display().to_string())
    };
    let mut declared = manifest(Path::new("Cargo.toml"))?
        .remove("workspace")
        .and_then(|workspace| workspace.get("dependencies").and_then(toml::Value::as_table).cloned())
        .unwrap_or_default();
    for file in files.iter().filter(|file| file.file_name().is_some_and(|name| name == "Cargo.toml")) {
        let member = manifest(file)?;
        for block in ["dependencies", "dev-dependencies", "build-dependencies"] {
            for name in
                member.get(block).and_then(toml::Value::as_table).into_iter().flat_map(|block| block.keys())
            {
                declared.remove(name);
            }
        }
    }
    let finding = |name: &String| format!("Cargo.toml: `{name}` is declared but no crate uses it");
    Ok(declared.keys().map(finding).collect())
}

/// Returns true for Rust files under crates/*/src and xtask/src.
fn is_source(file: &Path) -> bool {
    let parts: Vec<_> = file.iter().filter_map(|part| part.to_str()).collect();
    let in_src = matches!(parts.as_slice(), ["crates", _, "src", ..] | ["xtask", "src", ..]);
    in_src && file.extension().is_some_and(|extension| extension == "rs")
}

/// Lists the files that git tracks or would add with `git add`.
pub fn tracked(root: &Path) -> Result<Vec<PathBuf>> {
    let output = Command::new("git")
        .args(["ls-files", "-z", "--cached", "--others", "--exclude-standard"])
        .current_dir(root)
        .output()
        .into_diagnostic()
        .wrap_err("cannot start git")?;
    if !output.status.success() {
        return Err(miette!("git ls-files: {}", String::from_utf8_lossy(&output.stderr).trim()));
    }
    let list = String::from_utf8(output.stdout).into_diagnostic()?;
    Ok(list.split('\0').filter(|name| !name.is_empty()).map(PathBuf::from).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dependencies_are_used() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).expect("a file");
        write("Cargo.toml", "[workspace.dependencies]\na = '1'\nb = '1'\nc = '1'\n");
        fs::create_dir(folder.path().join("m")).expect("a folder");
        write(
            "m/Cargo.toml",
            "[dependencies]\na.workspace = true\n[dev-dependencies]\nc = { workspace = true }\n",
        );
        let files = ["Cargo.toml", "m/Cargo.toml"].map(PathBuf::from);
        let found = unused_dependencies(folder.path(), &files).expect("manifests");
        assert_eq!(found, ["Cargo.toml: `b` is declared but no crate uses it"]);
        // and those of this repository
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let files = tracked(&root).expect("files");
        assert_eq!(unused_dependencies(&root, &files).expect("manifests"), [""; 0]);
    }

    #[test]
    fn sources() {
        assert!(is_source(Path::new("crates/peri/src/bonds/kernel.rs")));
        assert!(is_source(Path::new("xtask/src/tidy.rs")));
        assert!(!is_source(Path::new("crates/peri/tests/long.rs")));
        assert!(!is_source(Path::new("crates/peri/src/data.csv")));
    }
}
