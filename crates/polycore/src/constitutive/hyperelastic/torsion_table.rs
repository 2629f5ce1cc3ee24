//! Tables of torsion: angle, torque, and axial force of a solid cylinder.

use std::f64::consts::PI;

use super::data::{Mode, TestData, TestState};
use super::table::{ImportedTest, TestFormat};
use super::torsion::TwistedCylinder;
use super::weights::WeightSource;
use crate::table::{Error, Table, plain_unit};
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

/// Share of the largest torque below which one against its twist is noise.
const NOISE_LEVEL: f64 = 0.02;

impl TorsionColumns {
    /// Finds the columns; `None` if the format does not ask for torsion.
    ///
    /// # Errors
    /// No cylinder, a column that is missing or has a unit of another quantity, angles without the length of
    /// the cylinder or twists with it, a held stretch that is given twice or as a strain.
    pub fn find(file: &Table, format: &TestFormat) -> Result<Option<Self>, Error> {
        let cylinder = match (format.cylinder, format.mode) {
            (Some(cylinder), _) => cylinder,
            (None, Some(Mode::Torsion)) => {
                let allowed = "the radius of the cylinder, with `mode = \"torsion\"`";
                return Err(file.refuse_headings(allowed));
            }
            _ => return Ok(None),
        };
        let optional = |names: &[&str]| file.matching(names).first().copied();
        let angle = file.require_column(&ANGLES)?;
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
        let stretch = optional(&STRETCHES);
        if stretch.is_some() && cylinder.stretch.is_some() {
            let allowed = "a column `stretch` or the key `stretch` in the data's entry, not both";
            return Err(file.refuse_headings(allowed));
        }
        if stretch.is_none() && optional(&STRAINS).is_some() {
            let allowed = "a column `stretch`, length over undeformed length, in place of a strain";
            return Err(file.refuse_headings(allowed));
        }
        let torque = file.require_column(&TORQUES)?;
        Ok(Some(Self { angle, twist, torque, force: optional(&FORCES), stretch, cylinder }))
    }

    /// Reads the rows; a blank torque or force was not measured.
    ///
    /// # Errors
    /// Units of other quantities, cells that are no number, a stretch that is not above 0, torques against
    /// their twists, no measurement at all.
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
        let largest = states.iter().map(|state| state.nominal[0].abs()).fold(0.0, f64::max);
        if let Some(at) = states.iter().position(|state| state.nominal[0] < -NOISE_LEVEL * largest) {
            let allowed = "a torque with the sign of its twist";
            return Err(file.refuse_cell(rows[at], self.torque, allowed));
        }
        let is_at_rest = |state: &TestState| state.cylinder().is_some_and(|cylinder| cylinder.shear == 0.0);
        let offset = |state: &TestState| is_at_rest(state) && state.nominal[0] > NOISE_LEVEL * largest;
        if let Some(at) = states.iter().position(offset) {
            return Err(file.refuse_cell(rows[at], self.torque, "no torque at a twist of 0"));
        }
        let mut notes = Vec::new();
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
        if let (Some(column), false) = (self.stretch, own.is_none_or(|l| l > 0.0)) {
            return Err(file.refuse_cell(row, column, "a stretch above 0, 1 at the free length"));
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
mod tests {
    use super::*;
    use crate::constitutive::hyperelastic::{Deviation, MooneyRivlin};

    fn format(length: Option<f64>, stretch: Option<f64>) -> TestFormat {
        let cylinder = TestCylinder { radius: 5e-3, length, stretch };
        TestFormat { mode: Some(Mode::Torsion), cylinder: Some(cylinder), ..TestFormat::default() }
    }

    fn read(text: &str, format: &TestFormat) -> Result<ImportedTest, crate::constitutive::Error> {
        TestData::parse_as("t.csv", text.as_bytes().to_vec(), format)
    }

    /// M = πψR⁴(C₁ + C₂), N = −½πψ²R⁴(C₁ + 2C₂), in three sets of units.
    #[test]
    fn torque_and_force_of_a_cylinder() {
        let [a, b] = [0.2e6, 0.05e6];
        let law = MooneyRivlin::new(a, b).unwrap();
        let (radius, length, angle) = (5e-3_f64, 40e-3, 6.0_f64);
        let twist = angle / length;
        let torque = PI * twist * radius.powi(4) * (a + b);
        let force = -0.5 * PI * twist * twist * radius.powi(4) * (a + 2.0 * b);
        for (text, length) in [
            (format!("twist [rad/m],torque [N m],axial force [N]\n{twist},{torque},{force}\n"), None),
            (
                format!(
                    "angle [deg];torque [N mm];force [kN]\n{};{};{}\n",
                    angle.to_degrees(),
                    1e3 * torque,
                    1e-3 * force
                ),
                Some(length),
            ),
            (format!("twist [rad/mm],moment [N*mm],force [N]\n{},{},\n", -1e-3 * twist, -1e3 * torque), None),
        ] {
            let reading = read(&text, &format(length, None)).unwrap();
            let state = reading.table.states[0];
            let found = state.predict(&law).unwrap();
            for axis in (0..2).filter(|&axis| state.nominal[axis] != 0.0) {
                assert!((found[axis] / state.nominal[axis] - 1.0).abs() < 1e-9, "{text}{state:?} {found:?}");
            }
            let shear = state.cylinder().unwrap().shear;
            assert!((shear / (twist * radius) - 1.0).abs() < 1e-12, "{shear}");
        }
    }

    #[test]
    fn rows_notes_and_weights() {
        let text = "# source: mine\nstretch,twist [rad/m],torque [N mm],force [N]\n1,0,0,0\n1,100,,\n\
                    1.2,100,80,\n1,-100,-90,0.4\n1,50,0,-1\n";
        let reading = read(text, &format(None, None)).unwrap();
        assert_eq!((reading.table.states.len(), reading.table.measurements()), (4, 4));
        assert!((reading.table.states[1].cylinder().unwrap().stretch - 1.2).abs() < 1e-12);
        let notes = reading.notes.join("; ");
        for part in [
            "1 rows without",
            "1 twists with a torque of 0",
            "1 twists below 0",
            "1 axial forces are above 0",
        ] {
            assert!(notes.contains(part), "{notes}");
        }
        assert!(reading.description.contains("radius 5.0000 mm; shear at its surface up to 0.5000"));
        let weighted = TestFormat { deviation: Deviation::parse("2 %").ok(), ..format(None, None) };
        let weighted = read(text, &weighted).unwrap().table;
        let shares = weighted.states[1..]
            .iter()
            .map(|state| weighted.deviation.unwrap() / state.roots[0] / state.nominal[0].abs());
        assert!(shares.zip([0.02; 2]).all(|(found, share)| (found / share - 1.0).abs() < 1e-12));
    }

    #[test]
    fn bad_tables_of_torsion() {
        let plain = format(None, None);
        let bare = TestFormat { cylinder: None, ..plain.clone() };
        let error = read("stretch,stress [MPa]\n2,1\n", &bare).unwrap_err().to_string();
        assert!(error.contains("the radius of the cylinder"), "{error}");
        for (text, format, part) in [
            ("angle [deg],torque [N m]\n1,1\n", &plain, "`length`, the undeformed length"),
            ("twist [rad/m],torque [N m]\n1,1\n", &format(Some(0.1), None), "has a `length`"),
            ("twist,torque [N m]\n1,1\n", &plain, "unit of column 1, `twist`"),
            ("twist [rad/m],torque\n1,1\n", &plain, "unit of column 2, `torque`"),
            ("twist [rad/m],torque [N]\n1,1\n", &plain, "a torque"),
            ("twist [rad/m],torque [N m],force [MPa]\n1,1,1\n", &plain, "a force"),
            ("twist [rad/m],stress [MPa]\n1,1\n", &plain, "one column `torque [unit]`"),
            ("stretch,stress [MPa]\n1,1\n", &plain, "one column `twist [unit]`"),
            ("twist [rad/m],torque [N m]\n1,x\n", &plain, "line 2: column 2, `torque [N m]`: found `x`"),
            (
                "twist [rad/m],torque [N m]\n1,1\n2,-1\n",
                &plain,
                "line 3: column 2, `torque [N m]`: found `-1`",
            ),
            ("twist [rad/m],torque [N m]\n1e200,1\n", &plain, "of a finite shear"),
            ("twist [rad/m],torque [N m]\n1,0\n", &plain, "a torque other than zero"),
            ("twist [rad/m],torque [N m],stretch\n1,1,0\n", &plain, "a stretch above 0"),
            ("twist [rad/m],torque [N m],stretch\n1,1,1\n", &format(None, Some(1.1)), "not both"),
            ("twist [rad/m],torque [N m],strain [%]\n1,1,25\n", &plain, "in place of a strain"),
            ("twist [rad/m],torque [N m]\n0,5\n90,25\n", &plain, "no torque at a twist of 0"),
        ] {
            let error = read(text, format).unwrap_err().to_string();
            assert!(error.contains(part), "{text}{error}");
        }
    }
}
