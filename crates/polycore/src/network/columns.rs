//! Columns of a table of compositions: their headings and units.

use crate::table::{Error, Heading, Table, plain_unit, plainly};
use crate::units::dimension::{MolarMassDimension, RatioDimension, StressDimension};
use crate::units::{Dimension, Unit};

/// Dimension of the numbers of a column.
#[derive(Clone, Copy, PartialEq)]
enum Measure {
    /// Words.
    Text,
    /// Numbers without a dimension, or in per cent.
    Ratio,
    /// Molar masses, in kg/mol if the heading has no other unit.
    MolarMass,
    /// Stresses, in MPa if the heading has no other unit.
    Stress,
}

/// Column that is read.
struct Column {
    /// Heading.
    name: &'static str,
    /// Heading before another unit: `G` of `G [kPa]` and `G_kPa`.
    stem: &'static str,
    measure: Measure,
}

const fn column(name: &'static str, stem: &'static str, measure: Measure) -> Column {
    Column { name, stem, measure }
}

const COLUMNS: [Column; 15] = [
    column("source", "source", Measure::Text),
    column("kind", "kind", Measure::Text),
    column("sol", "sol", Measure::Text),
    column("polymer", "polymer", Measure::Text),
    column("chains", "chains", Measure::Text),
    column("f", "f", Measure::Ratio),
    column("r", "r", Measure::Ratio),
    column("p", "p", Measure::Ratio),
    column("x", "x", Measure::Ratio),
    column("w_sol", "w_sol", Measure::Ratio),
    column("b1", "b1", Measure::Ratio),
    column("M_strand_kg_mol", "M_strand", Measure::MolarMass),
    column("M_linker_kg_mol", "M_linker", Measure::MolarMass),
    column("M_mono_kg_mol", "M_mono", Measure::MolarMass),
    column("G_MPa", "G", Measure::Stress),
];

impl Measure {
    /// Unit of a heading without one.
    fn own_unit(self) -> &'static str {
        match self {
            Self::Text | Self::Ratio => "",
            Self::MolarMass => "kg/mol",
            Self::Stress => "MPa",
        }
    }

    /// SI value of 1 in a unit.
    fn scale(self, unit: &str) -> Result<f64, String> {
        fn of<D: Dimension>(unit: &str) -> Result<f64, String> {
            let one = Unit::<D>::parse(&plain_unit(unit)).and_then(|unit| unit.quantity(1.0));
            one.map(|one| one.si()).map_err(|error| error.to_string())
        }
        match self {
            Self::Text => Ok(1.0),
            Self::Ratio => of::<RatioDimension>(unit),
            Self::MolarMass => of::<MolarMassDimension>(unit),
            Self::Stress => of::<StressDimension>(unit),
        }
    }
}

impl Column {
    /// Unit of a heading of this column; `None` for headings of others.
    fn unit(&self, heading: &Heading) -> Option<String> {
        let own = self.measure.own_unit();
        if heading.plain == plainly(self.name) {
            return Some(heading.unit.clone().unwrap_or_else(|| own.to_owned()));
        }
        if self.name != self.stem && heading.plain == plainly(self.stem) {
            return heading.unit.clone();
        }
        let ending = heading.plain.strip_prefix(&format!("{} ", plainly(self.stem)))?;
        // as it is written: mPa is not MPa
        let ending = heading.name.get(heading.name.len() - ending.len()..)?.replace('_', "/");
        let is_unit =
            !ending.starts_with(|c: char| c.is_ascii_digit()) && self.measure.scale(&ending).is_ok();
        let has_unit = match self.measure {
            Measure::Text => false,
            Measure::Ratio => self.stem.len() > 1,
            Measure::MolarMass | Measure::Stress => true,
        };
        (has_unit && is_unit && heading.unit.is_none()).then_some(ending)
    }
}

/// Places of the columns in a table.
pub(super) struct Columns {
    /// Name, place and SI value of 1.
    found: Vec<(&'static str, usize, f64)>,
}

impl Columns {
    /// Finds the columns by their headings, exact ones before those in other capitals or units.
    ///
    /// # Errors
    /// Two columns of one name, units of another dimension, units that contradict the name.
    pub fn find(table: &Table) -> Result<Self, Error> {
        let mut found = Vec::new();
        for column in COLUMNS {
            let headings = || table.headings.iter().enumerate();
            let mut places: Vec<usize> = headings()
                .filter(|(_, heading)| heading.name == column.name)
                .map(|(place, _)| place)
                .collect();
            if places.is_empty() {
                places = headings()
                    .filter(|(_, heading)| column.unit(heading).is_some())
                    .map(|(place, _)| place)
                    .collect();
            }
            let place = match places[..] {
                [] => continue,
                [place] => place,
                _ => return Err(table.refuse_headings(format!("one column `{}`", column.name))),
            };
            let heading = &table.headings[place];
            let unit = column.unit(heading).unwrap_or_default();
            let own = column.measure.own_unit();
            let is_named = heading.plain == plainly(column.name) && column.name != column.stem;
            let scale = match column.measure.scale(&unit) {
                Ok(scale) if !is_named || column.measure.scale(own) == Ok(scale) => scale,
                _ => {
                    let what = format!("unit of column {}, `{}`", place + 1, heading.text);
                    let allowed = match own {
                        "" => format!("`{0}`, or `{0} [%]`", column.name),
                        own => format!("`{}`, or `{} [{own}]` with its unit", column.name, column.stem),
                    };
                    return Err(table.refuse(table.layout().heading_line, &what, unit, &allowed));
                }
            };
            found.push((column.name, place, scale));
        }
        Ok(Self { found })
    }

    /// Place of a column in the table.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.scaled(name).map(|(place, _)| place)
    }

    /// Place of a column and the SI value of 1 in its unit.
    pub fn scaled(&self, name: &str) -> Option<(usize, f64)> {
        self.found.iter().find(|(known, ..)| *known == name).map(|&(_, place, scale)| (place, scale))
    }

    /// Names of the other columns.
    pub fn unused(&self, table: &Table) -> Vec<String> {
        let is_used = |place: usize| self.found.iter().any(|&(_, used, _)| used == place);
        let others = table.headings.iter().enumerate().filter(|(place, _)| !is_used(*place));
        others.map(|(_, heading)| heading.name.clone()).filter(|name| !name.is_empty()).collect()
    }
}
