//! Keywords without effect on the mesh, with the equivalent scene keys.

use std::collections::BTreeMap;

use super::cards::{Card, Cards};

/// Scene keys and the keywords they replace.
const REPLACEMENTS: [(&str, &[&str]); 14] = [
    ("`density` of [materials.NAME]", &["DENSITY"]),
    ("`conductivity` of [materials.NAME]", &["CONDUCTIVITY"]),
    ("`specific_heat` of [materials.NAME]", &["SPECIFIC HEAT"]),
    ("`latent_heat` of [materials.NAME]", &["LATENT HEAT"]),
    ("[materials.NAME]", &["MATERIAL", "USER MATERIAL", "DEPVAR"]),
    ("[[region]] with `elements`", &["SOLID SECTION"]),
    ("`temperature` of [[region]]", &["INITIAL CONDITIONS"]),
    ("`temperature` of [[boundary]], whose `surface` may be a node set", &["BOUNDARY", "TEMPERATURE"]),
    ("`film` and `ambient` of [[boundary]]", &["FILM", "SFILM", "FILM PROPERTY"]),
    ("`emissivity` and `ambient` of [[boundary]]", &["RADIATE", "SRADIATE"]),
    ("`flux` of [[boundary]], or `power` of [[source]]", &["DFLUX", "DSFLUX", "CFLUX"]),
    ("values over time, `{ time = […], value = […] }`", &["AMPLITUDE"]),
    ("[time]", &["HEAT TRANSFER", "COUPLED TEMPERATURE-DISPLACEMENT", "UNCOUPLED TEMPERATURE-DISPLACEMENT"]),
    ("[mechanics]", &["ELASTIC", "EXPANSION", "PLASTIC", "VISCOELASTIC"]),
];

/// Keywords that join parts without shared nodes.
const JOINING: [&str; 7] =
    ["TIE", "CONTACT PAIR", "CONTACT", "EQUATION", "MPC", "GAP CONDUCTANCE", "EMBEDDED ELEMENT"];

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

    /// Writes a note for each keyword with an equivalent, and one for the rest.
    pub fn write_notes(self, notes: &mut Vec<String>) {
        let mut rest = Vec::new();
        for (keyword, (count, line, said)) in self.0 {
            let instead = REPLACEMENTS.iter().find(|(_, all)| all.contains(&keyword.as_str()));
            let why = match instead {
                Some((instead, _)) => format!("the deck has no units; give {instead}"),
                None if JOINING.contains(&keyword.as_str()) => {
                    "heat passes only between elements that share nodes: merge the nodes of the parts"
                        .to_owned()
                }
                None => {
                    rest.push(format!("*{keyword} ({count})"));
                    continue;
                }
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
