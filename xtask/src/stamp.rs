//! Provenance of a measurement; detects stale records.

use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};

use harness::report::Report;
use miette::{IntoDiagnostic, Result, WrapErr};
use serde::{Deserialize, Serialize};

/// Provenance of a bench's rows, or of a number that a test measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SourceStamp {
    /// Commit that was checked out.
    commit: String,
    /// UTC, ISO 8601.
    date: String,
    machine: String,
    /// Files and folders below the root, whose contents …
    sources: Vec<String>,
    /// … had this hash.
    hash: String,
}

impl SourceStamp {
    /// Creates the provenance of a measurement made now from `sources`.
    pub fn new(root: &Path, sources: &[String]) -> Result<Self> {
        let provenance = Report::new("xtask", env!("CARGO_PKG_VERSION"), "").provenance;
        let hash = hash(root, sources).into_diagnostic().wrap_err_with(|| sources.join(", "))?;
        Ok(Self {
            commit: provenance.git.map_or_else(|| "unknown".to_owned(), |git| git.hash),
            date: provenance.date,
            machine: provenance.host.cpu,
            sources: sources.to_vec(),
            hash,
        })
    }

    /// Returns true if the sources have not changed.
    pub fn fresh(&self, root: &Path) -> bool {
        hash(root, &self.sources).is_ok_and(|now| now == self.hash)
    }
}

/// Format: `2026-11-22, commit 0123456789, AMD EPYC`.
impl fmt::Display for SourceStamp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let day = self.date.split('T').next().unwrap_or(&self.date);
        write!(f, "{day}, commit {:.10}, {}", self.commit, self.machine)
    }
}

/// Numerics of `polycore` on which the other crates depend.
const NUMERICS: [&str; 4] = ["constitutive", "langevin", "random", "tensor"];

/// Lists the sources that numbers of crates depend on: `parts` of their folders (`src`, `tests`), and the
/// numerics of `polycore`.
pub fn sources(root: &Path, crates: &[&str], parts: &[&str]) -> Vec<String> {
    let folders =
        crates.iter().flat_map(|name| parts.iter().map(move |part| format!("crates/{name}/{part}")));
    let below =
        NUMERICS.iter().flat_map(|name| ["", ".rs"].map(|end| format!("crates/polycore/src/{name}{end}")));
    folders.chain(below).filter(|source| root.join(source).exists()).collect()
}

/// Hashes names and contents of all files, sorted by name. Lines of Rust that are blank or comments do not
/// count.
fn hash(root: &Path, sources: &[String]) -> std::io::Result<String> {
    let mut files = Vec::new();
    for source in sources {
        collect(&root.join(source), &mut files)?;
    }
    files.sort();
    let mut all = Vec::new();
    for file in files {
        all.extend(file.strip_prefix(root).unwrap_or(&file).to_string_lossy().as_bytes());
        all.push(0);
        all.extend(content(&file)?);
        all.push(0);
    }
    Ok(hash_bytes(&all))
}

/// Hashes bytes by FNV-1a: the same on every machine.
pub fn hash_bytes(bytes: &[u8]) -> String {
    let add = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
    format!("{:016x}", bytes.iter().fold(0xcbf2_9ce4_8422_2325, add))
}

/// Content of a file as far as it matters.
fn content(file: &Path) -> std::io::Result<Vec<u8>> {
    let bytes = fs::read(file)?;
    if file.extension().is_none_or(|extension| extension != "rs") {
        return Ok(bytes);
    }
    let is_code = |line: &&str| !line.is_empty() && !line.starts_with("//");
    let text = String::from_utf8_lossy(&bytes);
    Ok(text.lines().map(str::trim).filter(is_code).collect::<Vec<_>>().join("\n").into_bytes())
}

fn collect(path: &Path, files: &mut Vec<PathBuf>) -> std::io::Result<()> {
    if path.is_file() {
        files.push(path.to_path_buf());
        return Ok(());
    }
    for entry in fs::read_dir(path)? {
        collect(&entry?.path(), files)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stale_when_a_source_changes() {
        let root = tempfile::tempdir().expect("a folder");
        let write = |name: &str, text: &str| {
            let path = root.path().join(name);
            fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            fs::write(path, text).expect("a file");
        };
        write("crates/peri/src/a/b.rs", "fn b() {}");
        write("crates/polycore/src/tensor.rs", "");
        let sources = sources(root.path(), &["peri"], &["src", "tests"]);
        assert_eq!(sources, ["crates/peri/src", "crates/polycore/src/tensor.rs"]);
        let stamp = SourceStamp::new(root.path(), &sources).expect("a stamp");
        write("crates/crystfem/src/lib.rs", "");
        assert!(stamp.fresh(root.path()));
        write("crates/peri/src/a/b.rs", "fn b() { }");
        assert!(!stamp.fresh(root.path()));
        write("crates/peri/src/a/b.rs", "fn b() {}");
        assert!(stamp.fresh(root.path()));
        write("crates/peri/src/a/c.rs", "");
        assert!(!stamp.fresh(root.path()), "a new file");
        assert!(SourceStamp::new(root.path(), &["crates/none".to_owned()]).is_err());
    }
}
