//! Lines of Markdown prose that are too long to read beside code.

use std::fs;
use std::path::{Path, PathBuf};

/// Characters of the longest line.
const MOST: usize = 110;

/// Findings of `cargo xtask tidy`: lines of prose that are too long. Tables, code, headings, quotes, pictures
/// and HTML may be longer, and `docs/validation.md` is generated.
pub fn findings(root: &Path, files: &[PathBuf]) -> Vec<String> {
    let is_page = |file: &&PathBuf| file.extension().is_some_and(|extension| extension == "md");
    let pages = files.iter().filter(is_page).filter(|file| *file != Path::new("docs/validation.md"));
    let mut findings = Vec::new();
    for file in pages {
        let Ok(text) = fs::read_to_string(root.join(file)) else { continue };
        for (line, count) in long_lines(&text) {
            let place = file.display();
            findings.push(format!("{place}:{line}: {count} characters, at most {MOST} are allowed"));
        }
    }
    findings
}

/// Numbers of the lines that are too long, each with its characters.
fn long_lines(text: &str) -> Vec<(usize, usize)> {
    let mut is_code = false;
    let mut found = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let start = line.trim_start();
        if start.starts_with("```") {
            is_code = !is_code;
        }
        let is_free = ["|", "![", "<", "#", ">"].iter().any(|mark| start.starts_with(mark));
        let count = line.chars().count();
        if count > MOST && !is_code && !is_free {
            found.push((index + 1, count));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lines_of_prose() {
        let long = "λ ".repeat(60);
        let page = format!("# {long}\n{long}\n```sh\n{long}\n```\n| {long} |\n\n- {long}\n> {long}\nshort\n");
        assert_eq!(long_lines(&page), [(2, 120), (8, 122)]);
    }
}
