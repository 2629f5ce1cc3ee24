//! Tables of compositions: one network a row, measured or to be predicted.
//!
//! Columns, by name, in any order and in any capitals; further columns are kept and not used. Only the first
//! three must be there (the third alone beside `chains`), and cells may be empty. Another unit stands in the
//! heading: `G [kPa]`, `M_strand [g/mol]`, `w_sol [%]`.
//!
//! | column | content |
//! |---|---|
//! | `f` | functionality of the cross-linker; a mean is made of the two whole numbers beside it |
//! | `r` | groups of the cross-linkers per group of the chains |
//! | `M_strand_kg_mol` | molar mass of the strands |
//! | `M_linker_kg_mol` | molar mass of the cross-linker; none if empty |
//! | `M_mono_kg_mol`, `b1` | molar mass of chains with one group, and their share of the chains' groups |
//! | `p` | conversion of the groups of the cross-linkers; 1: all groups in deficit |
//! | `w_sol` | measured sol fraction |
//! | `chains` | of chains of M_n `M_strand_kg_mol` cross-linked at random: `most-probable` or `one-length` |
//! | `x` | cross-linked units per number-average chain |
//! | `sol` | `removed` (extracted) or `present` (left in; also if empty) |
//! | `kind` | `md` for simulated networks, whose `p` is known |
//! | `source` | author, by which the summary is sorted |
//! | `polymer` | a name of [`KNOWN_POLYMERS`](super::KNOWN_POLYMERS) |
//! | `G_MPa` | measured shear modulus, with which predictions are compared |

use std::path::Path;

use super::columns::Columns;
use super::{KnownPolymer, PrimaryChains, known_polymer};
use crate::table::{Error, Table};

/// Composition of a row; molar masses in kg/mol.
#[derive(Clone, Debug, PartialEq)]
pub struct Composition {
    /// Line in the file, from 1.
    pub line: usize,
    /// Source of the measurement.
    pub source: String,
    /// True for simulated networks.
    pub is_simulated: bool,
    /// True if the sol was extracted.
    pub extracted: bool,
    /// Polymer of the strands, if the row names one.
    pub polymer: Option<&'static KnownPolymer>,
    /// Functionality of the cross-linker.
    pub functionality: Option<f64>,
    /// Groups A per group B.
    pub ratio: Option<f64>,
    /// Molar mass of the strands.
    pub strand_mass: Option<f64>,
    /// Molar mass of the cross-linkers.
    pub linker_mass: Option<f64>,
    /// Molar mass of the chains with one group.
    pub ends_mass: Option<f64>,
    /// Share of the groups B on chains with one group.
    pub ends_share: Option<f64>,
    /// Conversion of the groups A.
    pub conversion: Option<f64>,
    /// Measured sol fraction.
    pub sol: Option<f64>,
    /// Distribution of long chains that are cross-linked at random.
    pub primary_chains: Option<PrimaryChains>,
    /// Cross-linked units per such chain.
    pub units: Option<f64>,
    /// Measured shear modulus, Pa.
    pub modulus: Option<f64>,
    /// Texts of all cells.
    pub cells: Vec<String>,
}

/// Table of compositions.
#[derive(Clone, Debug, PartialEq)]
pub struct CompositionTable {
    /// Headings as they are written.
    pub headings: Vec<String>,
    /// Rows.
    pub rows: Vec<Composition>,
    /// Headings of columns that are not used.
    pub unused: Vec<String>,
}

/// Allowed numbers of a column.
struct Allowed {
    words: &'static str,
    test: fn(f64) -> bool,
}

const POSITIVE: Allowed = Allowed { words: "a positive number", test: |x| x > 0.0 };
const NOT_NEGATIVE: Allowed = Allowed { words: "0 or a positive number", test: |x| x >= 0.0 };
const FUNCTIONALITY: Allowed = Allowed { words: "1 to 1000 groups", test: |x| (1.0..=1000.0).contains(&x) };
const SHARE: Allowed = Allowed { words: "a fraction within 0 to 1", test: |x| (0.0..=1.0).contains(&x) };
const CONVERSION: Allowed = Allowed {
    words: "a conversion within 0 to 1, since no group reacts twice",
    test: |x| (0.0..=1.0).contains(&x),
};

impl CompositionTable {
    /// Reads a CSV file in any layout of [`Table`].
    ///
    /// # Errors
    /// A file that cannot be read, a missing column, a cell that is no number or out of its range, with
    /// line, column, cell and what is allowed.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, crate::Error> {
        Ok(Self::from_table(&Table::read(path)?)?)
    }

    /// Takes the compositions from a table.
    ///
    /// # Errors
    /// As [`CompositionTable::read`].
    pub fn from_table(table: &Table) -> Result<Self, Error> {
        let columns = Columns::find(table)?;
        for (name, what) in [
            ("f", "functionality of the cross-linker"),
            ("r", "groups of the cross-linkers per group of the chains"),
            ("M_strand_kg_mol", "molar mass of the strands, kg/mol"),
        ] {
            let at_random = name != "M_strand_kg_mol" && columns.column("chains").is_some();
            if columns.column(name).is_none() && !at_random {
                return Err(table.refuse_headings(format!("a column `{name}`: {what}")));
            }
        }
        if table.rows() == 0 {
            return Err(table.refuse(0, "rows", "none".to_owned(), "a network in each row"));
        }
        let row = |row| Composition::from_row(table, &columns, row);
        Ok(Self {
            rows: (0..table.rows()).map(row).collect::<Result<_, _>>()?,
            unused: columns.unused(table),
            headings: table.headings.iter().map(|heading| heading.text.clone()).collect(),
        })
    }
}

impl Composition {
    fn from_row(table: &Table, columns: &Columns, row: usize) -> Result<Self, Error> {
        let text = |name: &str| columns.column(name).map_or("", |column| table.text(row, column));
        let number = |name: &str, allowed: &Allowed| -> Result<Option<f64>, Error> {
            let Some((column, scale)) = columns.scaled(name) else { return Ok(None) };
            match table.number_or_blank(row, column)?.map(|number| number * scale) {
                Some(value) if !(allowed.test)(value) => Err(table.refuse_cell(row, column, allowed.words)),
                found => Ok(found),
            }
        };
        let choice = |name: &str, allowed: &str, choices: &[(&str, bool)]| -> Result<bool, Error> {
            let found = text(name).to_lowercase();
            let known = choices.iter().find(|(known, _)| *known == found);
            match (known, columns.column(name)) {
                (Some((_, meaning)), _) => Ok(*meaning),
                (None, Some(column)) => Err(table.refuse_cell(row, column, allowed)),
                (None, None) => Ok(false),
            }
        };
        let sol = [("", false), ("present", false), ("removed", true), ("left", false), ("extracted", true)];
        let kind = [("", false), ("exp", false), ("md", true), ("measured", false), ("simulated", true)];
        let primary_chains = match (text("chains"), columns.column("chains")) {
            ("most-probable", _) => Some(PrimaryChains::MostProbable),
            ("one-length", _) => Some(PrimaryChains::OneLength),
            (found, Some(column)) if !found.is_empty() => {
                return Err(table.refuse_cell(row, column, "`most-probable` or `one-length`"));
            }
            _ => None,
        };
        let polymer = match text("polymer") {
            "" => None,
            name => Some(known_polymer(name).map_err(|error| {
                table.refuse_cell(row, columns.column("polymer").unwrap_or_default(), &error.to_string())
            })?),
        };
        Ok(Self {
            line: table.line(row),
            source: text("source").to_owned(),
            is_simulated: choice("kind", "`exp` (measured) or `md` (simulated)", &kind)?,
            extracted: choice("sol", "`present` (left in) or `removed` (extracted)", &sol)?,
            polymer,
            functionality: number("f", &FUNCTIONALITY)?,
            ratio: number("r", &POSITIVE)?,
            strand_mass: number("M_strand_kg_mol", &POSITIVE)?,
            linker_mass: number("M_linker_kg_mol", &NOT_NEGATIVE)?,
            ends_mass: number("M_mono_kg_mol", &NOT_NEGATIVE)?,
            ends_share: number("b1", &SHARE)?,
            conversion: number("p", &CONVERSION)?,
            sol: number("w_sol", &SHARE)?,
            primary_chains,
            units: number("x", &POSITIVE)?,
            modulus: number("G_MPa", &POSITIVE)?,
            cells: (0..table.headings.len()).map(|column| table.text(row, column).to_owned()).collect(),
        })
    }
}
