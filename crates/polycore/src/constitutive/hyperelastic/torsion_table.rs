//! Tables of torsion: angle, torque, and axial force of a solid cylinder.

use std::f64::consts::PI;

use super::data::{Mode, TestData, TestState};
use super::table::{ImportedTest, TestFormat};
use super::torsion::TwistedCylinder;
use super::torsion_check::{HELD_STRETCHES, check_torques};
use super::weights::WeightSource;
use crate::table::{Error, Heading, Table, plain_unit, plainly};
use crate::units::dimension::{
    AngleDimension, ForceDimension, RatioDimension, TorqueDimension, TwistDimension,
};
use crate::units::{Dimension, Unit};

/// Cylinder of a torsion test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TestCylinder {
    /// Undeformed radius, m.
    pub radius: f64,
    /// Undeformed length, m, for a column of angles.
    pub length: Option<f64>,
    /// Length held in the test over the undeformed one, if no column has it.
    pub stretch: Option<f64>,
}

/// Columns of a table of torsion.
pub(super) struct TorsionColumns {
    angle: usize,
    twist: TwistUnit,
    torque: usize,
    force: Option<usize>,
    stretch: Option<usize>,
    cylinder: TestCylinder,
}

/// Units of the columns of torsion.
struct TorsionUnits {
    torques: Unit<TorqueDimension>,
    forces: Option<Unit<ForceDimension>>,
    ratios: Option<Unit<RatioDimension>>,
}

/// Unit of the twist.
enum TwistUnit {
    /// Angle per undeformed length.
    PerLength(Unit<TwistDimension>),
    /// Angle of a cylinder of a length, m.
    Angle(Unit<AngleDimension>, f64),
}

const ANGLES: [&str; 6] = ["twist", "twist per length", "angle", "twist angle", "angle of twist", "rotation"];
const TORQUES: [&str; 4] = ["torque", "moment", "torsional moment", "twisting moment"];
const FORCES: [&str; 4] = ["axial force", "normal force", "force", "axial load"];
const STRETCHES: [&str; 3] = ["stretch", "axial stretch", "lambda"];
/// Headings of a held strain, which is refused.
const STRAINS: [&str; 3] = ["strain", "axial strain", "elongation"];

/// Excess of a held stretch over 1 that counts as none.
const SAME_LENGTH: f64 = 1e-6;

/// Words beside a name that make a column another quantity.
const OTHERS: [&str; 12] = [
    "rate",
    "speed",
    "velocity",
    "error",
    "std",
    "sd",
    "deviation",
    "offset",
    "modulus",
    "energy",
    "weight",
    "inertia",
];

impl TorsionColumns {
    /// Finds the columns; `None` if the format does not ask for torsion.
    ///
    /// # Errors
    /// No cylinder; a column that is missing, repeated or in a unit of another quantity; angles without the
    /// length of the cylinder, or twists with it; a held stretch that is given twice or as a strain.
    pub fn find(file: &Table, format: &TestFormat) -> Result<Option<Self>, Error> {
        let cylinder = match (format.cylinder, format.mode) {
            (Some(cylinder), _) => cylinder,
            (None, Some(Mode::Torsion)) => {
                let allowed = "the radius of the cylinder, with `mode = \"torsion\"`";
                return Err(file.refuse_headings(allowed));
            }
            _ => return Ok(None),
        };
        let find = |names: &[&str], example: &str| find_column(file, format, names, example);
        let Some(angle) = find(&ANGLES, "twist [rad/m]")? else {
            return Err(file.refuse_headings("one column `twist [unit]`"));
        };
        let written = file.headings[angle].unit.as_deref().unwrap_or_default();
        let twist = match (Unit::parse(&plain_unit(written)), cylinder.length) {
            (Ok(unit), Some(length)) => TwistUnit::Angle(unit, length),
            (Ok(_), None) => {
                let allowed = "`length`, the undeformed length of the cylinder, in the data's entry, or \
                               angles per length, as in `twist [rad/m]`";
                return Err(file.refuse_headings(allowed));
            }
            (Err(_), Some(_)) => {
                let allowed = "a column of angles, as in `angle [deg]`, as the data's entry has a `length`";
                return Err(file.refuse_headings(allowed));
            }
            (Err(_), None) => TwistUnit::PerLength(file.unit(angle, None)?),
        };
        let stretch = find(&STRETCHES, "stretch")?;
        if stretch.is_some() && cylinder.stretch.is_some() {
            let allowed = "a column `stretch` or the key `stretch` in the data's entry, not both";
            return Err(file.refuse_headings(allowed));
        }
        if stretch.is_none() && !file.matching(&STRAINS).is_empty() {
            let allowed = "a column `stretch`, length over undeformed length, in place of a strain";
            return Err(file.refuse_headings(allowed));
        }
        let Some(torque) = find(&TORQUES, "torque [N mm]")? else {
            return Err(file.refuse_headings("one column `torque [unit]`"));
        };
        let force = find(&FORCES, "axial force [N]")?;
        Ok(Some(Self { angle, twist, torque, force, stretch, cylinder }))
    }

    /// Reads the rows; a blank torque or force was not measured.
    ///
    /// # Errors
    /// Units of other quantities, cells that are no number, stretches that are strains or in per cent,
    /// torques that [`check_torques`] refuses, no measurement at all.
    pub fn read(&self, file: &Table, format: &TestFormat) -> Result<ImportedTest, Error> {
        let torques = file.unit(self.torque, None)?;
        let forces = self.force.map(|column| file.unit(column, None)).transpose()?;
        let ratios = self.stretch.map(|column| file.unit(column, None)).transpose()?;
        let units = TorsionUnits { torques, forces, ratios };
        let weights = WeightSource::find(file, format)?;
        let (mut states, mut rows, mut turned) = (Vec::new(), Vec::new(), 0);
        for row in 0..file.rows() {
            let Some((mut state, is_turned)) = self.state(file, row, &units)? else { continue };
            for axis in 0..2 {
                if let Some(weights) = weights.as_ref().filter(|_| state.nominal[axis] != 0.0) {
                    state.roots[axis] = weights.root(file, row, state.nominal[axis])?;
                }
            }
            states.push(state);
            rows.push(row);
            turned += usize::from(is_turned);
        }
        let blank = file.rows() - rows.len();
        let remark = check_torques(&states)
            .map_err(|(at, allowed)| file.refuse_cell(rows[at], self.torque, &allowed))?;
        let is_at_rest = |state: &TestState| state.cylinder().is_some_and(|cylinder| cylinder.shear == 0.0);
        let mut notes: Vec<String> = remark.into_iter().map(|remark| format!("warning: {remark}")).collect();
        let unfitted = states.iter().filter(|state| state.nominal[0] == 0.0 && !is_at_rest(state)).count();
        if unfitted > 0 {
            notes.push(format!(
                "{unfitted} twists with a torque of 0 or none are fitted by their force alone"
            ));
        }
        if blank > 0 {
            notes.push(format!("{blank} rows without a torque or a force are left out"));
        }
        if turned > 0 {
            notes.push(format!("{turned} twists below 0 and their torques become positive"));
        }
        let pulls = |state: &&TestState| {
            state.nominal[1] > 0.0 && state.cylinder().is_some_and(|own| own.stretch < 1.0 + SAME_LENGTH)
        };
        let pulling = states.iter().filter(pulls).count();
        if pulling > 0 {
            notes.push(format!(
                "{pulling} axial forces are above 0, a pull, although the cylinder is not stretched: a \
                 rubber pushes, below 0"
            ));
        }
        let source = file.remark("# source:").unwrap_or_default().to_owned();
        let count = states.len();
        let absolute = weights.as_ref().is_some_and(WeightSource::is_absolute);
        let table = TestData::weighted(source, states, absolute);
        if table.measurements() == 0 {
            let found = format!("{count} rows");
            return Err(file.refuse(0, "table", found, "at least one row with a torque other than zero"));
        }
        Ok(ImportedTest { description: self.describe(file, &table), table, notes })
    }

    /// Reads a row; true if the twist was below 0. `None` without a torque and a force.
    fn state(
        &self,
        file: &Table,
        row: usize,
        units: &TorsionUnits,
    ) -> Result<Option<(TestState, bool)>, Error> {
        let own = match (self.stretch, &units.ratios) {
            (Some(column), Some(unit)) => Some(quantity(file, row, column, unit)?.unwrap_or(f64::NAN)),
            _ => None,
        };
        if let (Some(column), false) = (self.stretch, own.is_none_or(|l| HELD_STRETCHES.contains(&l))) {
            let (low, high) = (HELD_STRETCHES.start(), HELD_STRETCHES.end());
            let allowed = format!(
                "a stretch of {low} to {high}, length over undeformed length, 1 at the free length; for per \
                 cent use the heading `stretch [%]`"
            );
            return Err(file.refuse_cell(row, column, &allowed));
        }
        let stretch = own.or(self.cylinder.stretch).unwrap_or(1.0);
        let twist = self.twist.per_length(file, row, self.angle)?;
        let torque = quantity(file, row, self.torque, &units.torques)?;
        let force = match (self.force, &units.forces) {
            (Some(column), Some(unit)) => quantity(file, row, column, unit)?,
            _ => None,
        };
        if torque.is_none() && force.is_none() {
            return Ok(None);
        }
        let radius = self.cylinder.radius;
        // torques are odd in the twist, forces even
        let torque = torque.unwrap_or(0.0) * if twist < 0.0 { -1.0 } else { 1.0 };
        let nominal = [2.0 * torque / (PI * radius.powi(3)), force.unwrap_or(0.0) / (PI * radius * radius)];
        let cylinder = TwistedCylinder { stretch, shear: radius * twist.abs() };
        let state = TestState::new(Mode::Torsion, cylinder.surface(), nominal);
        if state.principal_stretches().is_err() || nominal.iter().any(|stress| !stress.is_finite()) {
            let allowed = "a twist and a `radius` of a finite shear and finite stresses";
            return Err(file.refuse_cell(row, self.angle, allowed));
        }
        Ok(Some((state, twist < 0.0)))
    }

    fn describe(&self, file: &Table, table: &TestData) -> String {
        let used: Vec<usize> =
            [self.angle, self.torque].into_iter().chain(self.force).chain(self.stretch).collect();
        let cylinders = || table.states.iter().filter_map(TestState::cylinder);
        let most = cylinders().map(|cylinder| cylinder.shear).fold(0.0, f64::max);
        let ends = |(low, high): (f64, f64), l: f64| (low.min(l), high.max(l));
        let (low, high) = cylinders().map(|cylinder| cylinder.stretch).fold((f64::INFINITY, 0.0), ends);
        let held =
            if high - low < SAME_LENGTH { format!("{low:.4}") } else { format!("{low:.4} to {high:.4}") };
        format!(
            "{}; torsion of a cylinder of radius {:.4} mm; shear at its surface up to {most:.4}, stretch \
             {held}",
            file.describe(&used),
            1e3 * self.cylinder.radius
        )
    }
}

impl TwistUnit {
    /// Twist of a row, 1/m.
    fn per_length(&self, file: &Table, row: usize, column: usize) -> Result<f64, Error> {
        let found = match self {
            Self::PerLength(unit) => quantity(file, row, column, unit)?,
            Self::Angle(unit, length) => quantity(file, row, column, unit)?.map(|angle| angle / length),
        };
        found.ok_or_else(|| file.refuse_cell(row, column, "a twist"))
    }
}

/// Finds the column with one of some names; `None` if there is none.
///
/// # Errors
/// Several columns with one of the names, or with an addition to it, as `torque 2` or `twist_deg`; one with
/// an addition alone.
fn find_column(
    file: &Table,
    format: &TestFormat,
    names: &[&str],
    example: &str,
) -> Result<Option<usize>, Error> {
    let weights = [&format.weight_column, &format.deviation_column];
    let is_weight = |heading: &Heading| {
        weights.into_iter().flatten().any(|name| heading.name == *name || heading.plain == plainly(name))
    };
    let begins = |heading: &Heading| {
        let mut rests = names.iter().filter_map(|name| heading.plain.strip_prefix(name));
        let is_other = |rest: &str| rest.split(' ').any(|word| OTHERS.contains(&word));
        rests.any(|rest| rest.is_empty() || rest.starts_with(' ') && !is_other(rest))
    };
    let alike = |i: &usize| begins(&file.headings[*i]) && !is_weight(&file.headings[*i]);
    let found: Vec<usize> = (0..file.headings.len()).filter(alike).collect();
    let refuse = |what: String, allowed: String| {
        let texts: Vec<&str> = found.iter().map(|i| file.headings[*i].text.as_str()).collect();
        Err(file.refuse(file.layout().heading_line, &what, texts.join(", "), &allowed))
    };
    match found[..] {
        [] => Ok(None),
        [one] if names.contains(&file.headings[one].plain.as_str()) => Ok(Some(one)),
        [one] => {
            refuse(format!("column {}", one + 1), format!("a heading `{example}`, with its unit in brackets"))
        }
        _ => {
            let numbers: Vec<String> = found.iter().map(|i| (i + 1).to_string()).collect();
            let allowed = format!("one of them as `{example}`: remove the others or give them another name");
            refuse(format!("columns {}", numbers.join(", ")), allowed)
        }
    }
}

/// Reads a number of a unit, SI; `None` from a blank cell.
fn quantity<D: Dimension>(
    file: &Table,
    row: usize,
    column: usize,
    unit: &Unit<D>,
) -> Result<Option<f64>, Error> {
    let Some(number) = file.number_or_blank(row, column)? else { return Ok(None) };
    let found = unit.quantity(number).map_err(|error| file.refuse_cell(row, column, &error.to_string()))?;
    Ok(Some(found.si()))
}

#[cfg(test)]
#[path = "torsion_table_tests.rs"]
mod tests;
