//! Fast checks of the tree.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use miette::{IntoDiagnostic, Result, WrapErr, miette};

use crate::table::print;
use crate::workspace::Workspace;

/// Longer source files want to be two.
const MOST_LINES: usize = 500;

/// Larger files do not belong into git.
const MOST_BYTES: u64 = 1_000_000;

/// Prints every finding; passes if there is none.
pub fn run(workspace: &Workspace) -> Result<bool> {
    let files = tracked(workspace.root())?;
    let mut findings = Vec::new();
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
        if is_source(file) {
            let lines = fs::read_to_string(&path).map(|text| text.lines().count()).into_diagnostic()?;
            if lines > MOST_LINES {
                findings.push(format!("{}: {lines} lines, at most {MOST_LINES} are allowed", file.display()));
            }
        }
    }
    for finding in &findings {
        print(&format!("{finding}\n"));
    }
    print(&format!("tidy: {} files in git, {} findings\n", files.len(), findings.len()));
    Ok(findings.is_empty())
}

/// Rust files under crates/*/src and xtask/src.
fn is_source(file: &Path) -> bool {
    let parts: Vec<_> = file.iter().filter_map(|part| part.to_str()).collect();
    let in_src = matches!(parts.as_slice(), ["crates", _, "src", ..] | ["xtask", "src", ..]);
    in_src && file.extension().is_some_and(|extension| extension == "rs")
}

/// What git knows, and what it would take in with `git add`.
fn tracked(root: &Path) -> Result<Vec<PathBuf>> {
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
    fn sources() {
        assert!(is_source(Path::new("crates/peri/src/bonds/kernel.rs")));
        assert!(is_source(Path::new("xtask/src/tidy.rs")));
        assert!(!is_source(Path::new("crates/peri/tests/long.rs")));
        assert!(!is_source(Path::new("crates/peri/src/data.csv")));
    }
}
