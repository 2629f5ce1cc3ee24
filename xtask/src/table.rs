//! Rows of text, aligned for a terminal or written as Markdown.

use std::io::Write as _;

use harness::report::aligned;

/// Writes to standard output; ignores a closed pipe.
pub fn print(text: &str) {
    let _ = std::io::stdout().write_all(text.as_bytes());
}

/// Heading and rows with as many cells.
pub struct TextTable<const N: usize> {
    heading: [&'static str; N],
    rows: Vec<[String; N]>,
}

impl<const N: usize> TextTable<N> {
    /// Creates a table without rows.
    pub fn new(heading: [&'static str; N]) -> Self {
        Self { heading, rows: Vec::new() }
    }

    /// Adds a row.
    pub fn push(&mut self, row: [String; N]) {
        self.rows.push(row);
    }

    /// Returns true if there is no row.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Formats columns padded to their widest cell.
    pub fn text(&self) -> String {
        let heading = self.heading.map(str::to_owned);
        aligned(&std::iter::once(&heading).chain(&self.rows).collect::<Vec<_>>())
    }

    /// Formats a table of GitHub's Markdown.
    pub fn markdown(&self) -> String {
        let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
        let escape = |cell: &String| cell.replace('|', "\\|").replace('\n', " ");
        let mut text = line(&self.heading.map(str::to_owned));
        text += &format!("|{}\n", "---|".repeat(N));
        for row in &self.rows {
            text += &line(&row.iter().map(escape).collect::<Vec<_>>());
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_aligned_and_markdown_escaped() {
        let mut table = TextTable::new(["λ", "name"]);
        table.push(["12".into(), "a|b".into()]);
        assert_eq!(table.text(), "λ   name\n12  a|b\n");
        assert_eq!(table.markdown(), "| λ | name |\n|---|---|\n| 12 | a\\|b |\n");
    }
}
