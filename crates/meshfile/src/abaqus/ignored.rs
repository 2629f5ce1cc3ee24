//! Keywords without effect on the mesh.

use std::collections::BTreeMap;

use super::Advice;
use super::cards::{Card, Cards};

/// Counts of ignored keywords, with the first line and its content.
#[derive(Default)]
pub(super) struct Ignored(BTreeMap<String, (usize, usize, String)>);

impl Ignored {
    /// Skips a keyword; keeps its first data line for the note.
    pub fn add(&mut self, card: &Card, cards: &mut Cards) {
        let entry = self.0.entry(card.keyword.clone()).or_insert((0, card.line, String::new()));
        if entry.0 == 0 {
            entry.2 = card.parameter("NAME").map(str::to_owned).unwrap_or_default();
            if let (true, Some(row)) = (entry.2.is_empty(), cards.row()) {
                entry.2 = row.text().chars().take(40).collect();
            }
        }
        entry.0 += 1;
    }

    /// Writes a note for each keyword with advice, and one for the rest.
    pub fn write_notes(self, advice: Advice, notes: &mut Vec<String>) {
        let mut rest = Vec::new();
        for (keyword, (count, line, said)) in self.0 {
            let Some(why) = advice(&keyword) else {
                rest.push(format!("*{keyword} ({count})"));
                continue;
            };
            let said = if said.is_empty() { String::new() } else { format!(", `{said}`") };
            let times = if count > 1 { format!(", {count} times") } else { String::new() };
            notes.push(format!("*{keyword} (line {line}{said}{times}) is NOT used: {why}"));
        }
        if !rest.is_empty() {
            notes.push(format!("keywords not used: {}", rest.join(", ")));
        }
    }
}
