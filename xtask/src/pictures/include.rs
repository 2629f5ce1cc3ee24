//! Files shown in Markdown: the fence behind `<!-- file: PATH -->` has the text of the file, so that it is
//! visible in plain Markdown, too; of `PATH#NAME` the part between `// ANCHOR: NAME` and `// ANCHOR_END:
//! NAME`.

use std::fs;
use std::path::{Path, PathBuf};

use miette::{IntoDiagnostic, Result, WrapErr, miette};

const MARKER: &str = "<!-- file: ";

/// Returns the page with current files; paths are relative to the root.
///
/// # Errors
/// A file that cannot be read; a marker without a fence behind it.
fn updated(root: &Path, page: &str) -> Result<String> {
    let mut text = String::new();
    let mut lines = page.split_inclusive('\n');
    while let Some(line) = lines.next() {
        text += line;
        let Some(path) = line.trim_end().strip_prefix(MARKER).and_then(|rest| rest.strip_suffix(" -->"))
        else {
            continue;
        };
        let fence = lines.next().unwrap_or_default();
        if !fence.starts_with("```") || !lines.any(|line| line.trim_end() == "```") {
            return Err(miette!("{path}: expected a fence behind the marker"));
        }
        text += &format!("{fence}{}\n```\n", shown(root, path)?.trim_end());
    }
    Ok(text)
}

/// Text of a file, or of one of its parts.
fn shown(root: &Path, path: &str) -> Result<String> {
    let (path, anchor) = path.split_once('#').map_or((path, None), |(path, anchor)| (path, Some(anchor)));
    let text = fs::read_to_string(root.join(path)).into_diagnostic().wrap_err_with(|| path.to_owned())?;
    // visible to the tests that include examples
    let text = text.replace("\npub(crate) fn main()", "\nfn main()");
    let Some(anchor) = anchor else { return Ok(text) };
    let part = text.split_once(&format!("// ANCHOR: {anchor}\n"));
    let part = part.and_then(|(_, rest)| rest.split_once(&format!("// ANCHOR_END: {anchor}")));
    let (part, _) = part.ok_or_else(|| miette!("{path}: missing anchor `{anchor}`"))?;
    let lines = || part.lines().filter(|line| !line.trim().is_empty());
    let indent = lines().map(|line| line.len() - line.trim_start().len()).min().unwrap_or(0);
    let dedented: Vec<&str> =
        part.trim_end().lines().map(|line| line.get(indent..).unwrap_or_default()).collect();
    Ok(dedented.join("\n").trim_start_matches('\n').to_owned())
}

/// Markdown files with markers, each with its text and what it should be.
fn pages<'a>(root: &Path, files: &'a [PathBuf]) -> Result<Vec<(&'a PathBuf, String, String)>> {
    let mut pages = Vec::new();
    for file in files.iter().filter(|file| file.extension().is_some_and(|extension| extension == "md")) {
        let Ok(page) = fs::read_to_string(root.join(file)) else { continue };
        if page.contains(&format!("\n{MARKER}")) {
            let updated = updated(root, &page).wrap_err_with(|| file.display().to_string())?;
            pages.push((file, page, updated));
        }
    }
    Ok(pages)
}

/// Writes the current files into all pages that show them.
pub fn update(root: &Path, files: &[PathBuf]) -> Result<()> {
    for (file, page, updated) in pages(root, files)? {
        if page != updated {
            fs::write(root.join(file), updated)
                .into_diagnostic()
                .wrap_err_with(|| file.display().to_string())?;
        }
    }
    Ok(())
}

/// Findings of `cargo xtask tidy`: pages that show an older state of a file.
pub fn findings(root: &Path, files: &[PathBuf]) -> Result<Vec<String>> {
    let stale = pages(root, files)?.into_iter().filter(|(_, page, updated)| page != updated);
    let finding = |(file, ..): (&PathBuf, String, String)| {
        format!("{}: shows an older state of a file; run `cargo xtask pictures`", file.display())
    };
    Ok(stale.map(finding).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fences_show_files() {
        let root = tempfile::tempdir().expect("a folder");
        let write = |name: &str, text: &str| fs::write(root.path().join(name), text).expect("a file");
        write("a.toml", "x = 1\n");
        write("page.md", "# Page\n\n<!-- file: a.toml -->\n```toml\nx = 0\ny = 1\n```\nend\n");
        let files = ["page.md", "a.toml"].map(PathBuf::from);
        assert_eq!(findings(root.path(), &files).expect("findings").len(), 1);
        update(root.path(), &files).expect("an update");
        let page = fs::read_to_string(root.path().join("page.md")).expect("text");
        assert_eq!(page, "# Page\n\n<!-- file: a.toml -->\n```toml\nx = 1\n```\nend\n");
        assert_eq!(findings(root.path(), &files).expect("findings"), [""; 0]);
        write("a.rs", "use b;\n    // ANCHOR: main\n    fn main() {}\n    // ANCHOR_END: main\n");
        write("page.md", "# Page\n\n<!-- file: a.rs#main -->\n```rust\n```\n");
        update(root.path(), &files).expect("an update");
        let page = fs::read_to_string(root.path().join("page.md")).expect("text");
        assert_eq!(page, "# Page\n\n<!-- file: a.rs#main -->\n```rust\nfn main() {}\n```\n");
        write("page.md", "# Page\n\n<!-- file: a.rs#none -->\n```rust\n```\n");
        assert!(findings(root.path(), &files).is_err());
        write("page.md", "# Page\n\n<!-- file: a.toml -->\nno fence\n");
        assert!(findings(root.path(), &files).is_err());
    }
}
