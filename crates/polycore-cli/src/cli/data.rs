//! Tables of measured states to which laws are fitted: entries of a scene, checks.

use std::path::PathBuf;

use harness::scene::{SceneError, Source};
use polycore::constitutive::hyperelastic::data::{Mode, TestData};
use polycore::constitutive::hyperelastic::fit::neo_hookean_modulus;
use polycore::constitutive::hyperelastic::ranking::{ModeTable, modes};
use polycore::constitutive::hyperelastic::{
    Deviation, HELD_STRETCHES, StrainMeasure, TestCylinder, TestFormat, TestStressMeasure,
};
use polycore::units::Length;
use serde::Deserialize;

/// Table of measured states.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TestTableSpec {
    /// Name in the report.
    name: String,
    /// CSV file, relative to the scene.
    file: Option<PathBuf>,
    /// Names of tables above that are fitted at once, in place of `file`.
    #[serde(default)]
    tables: Vec<String>,
    /// Rank the laws: leave each mode of deformation out in turn and predict it by a fit to the others.
    #[serde(default)]
    rank: bool,
    /// Test whose states are used; for a table without a column of tests, the test of all states.
    mode: Option<Mode>,
    /// Measure of the strain, if its heading does not name it.
    strain: Option<StrainMeasure>,
    /// Measure of the stress, if its heading does not name it.
    stress: Option<TestStressMeasure>,
    /// Unit of a stress whose heading has none: `MPa`.
    stress_unit: Option<String>,
    /// Heading of the strain, if there are several.
    strain_column: Option<String>,
    /// Heading of the stress, if there are several.
    stress_column: Option<String>,
    /// Material, in a table with one stress component in each row: a cell of its column `material` or
    /// `source`.
    material: Option<String>,
    /// Tests of a table with one stress component in each row, as the file names them: `["UT", "UC"]`.
    #[serde(default)]
    tests: Vec<String>,
    /// Heading of the standard deviations of the stresses, in a unit of stress or in % of each: squares are
    /// weighted by their reciprocal squares.
    deviation_column: Option<String>,
    /// Standard deviation of all stresses, `"0.02 MPa"`, of each as a share of it, `"2 %"`, or the root of
    /// the sum of both squares, `"0.02 MPa + 2 %"`.
    deviation: Option<String>,
    /// Heading of weights of the squares.
    weight_column: Option<String>,
    /// Weight of the squares of this table among `tables` that are fitted at once.
    weight: Option<f64>,
    /// Undeformed radius of the cylinder of a test of `mode = "torsion"`.
    radius: Option<Length>,
    /// Undeformed length of a cylinder, for a column of angles.
    length: Option<Length>,
    /// Length of a cylinder held in the test over the undeformed one, 1 if not given; or a column `stretch`.
    stretch: Option<f64>,
}

/// Table to be fitted.
pub struct DataSet {
    pub name: String,
    pub table: TestData,
    /// Material, if the scene names one.
    pub material: Option<String>,
    /// Layout of the file, and the rows left out, one line each.
    pub read: Vec<String>,
    /// Names of the tables of which it consists; none if it has a file.
    pub parts: Vec<String>,
    /// Weight among tables that are fitted at once, if the scene gives one.
    weight: Option<f64>,
    /// Modes of deformation that are left out in turn; none without `rank`.
    pub modes: Vec<ModeTable>,
}

impl TestTableSpec {
    /// Reads the table, or joins the tables that it names.
    ///
    /// # Errors
    /// A name that cannot name a file, a file that cannot be read, both or neither of `file` and `tables`,
    /// tables that are unknown or of several materials, data without stiffness, a ranking of one mode.
    pub fn read(self, source: &Source, index: usize, above: &[DataSet]) -> Result<DataSet, SceneError> {
        let key = |field: &str| format!("fit.data[{index}].{field}");
        let valid = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if self.name.is_empty() || !self.name.chars().all(valid) {
            let allowed = "letters, digits, `-` and `_`: it names files";
            return Err(source.error(&key("name"), format!("`{}`", self.name), allowed));
        }
        if above.iter().any(|other| other.name == self.name) {
            return Err(source.error(&key("name"), format!("`{}` a second time", self.name), "another name"));
        }
        self.check_cylinder(source, &key)?;
        let rank = self.rank;
        if let Some(weight) = self.weight.filter(|weight| !(*weight > 0.0 && weight.is_finite())) {
            return Err(source.error(&key("weight"), weight, "a number above 0"));
        }
        let mut set = match &self.file {
            Some(_) if !self.tables.is_empty() => {
                return Err(source.error(&key("tables"), "a `file`, too", "`file` or `tables`"));
            }
            Some(_) => self.read_file(source, &key)?,
            None => self.join(source, &key, above)?,
        };
        neo_hookean_modulus(&set.table).map_err(|error| source.refused(&key(set.source_key()), error))?;
        if rank {
            set.modes = modes(&set.table);
            if let [only] = &set.modes[..] {
                let allowed = "a table of at least two modes of deformation, or `tables` of several";
                return Err(source.error(&key("rank"), format!("{} tests alone", only.mode), allowed));
            }
        }
        Ok(set)
    }

    /// Checks that a table of torsion has its cylinder, and no other table one.
    fn check_cylinder(&self, source: &Source, key: &dyn Fn(&str) -> String) -> Result<(), SceneError> {
        let is_torsion = self.mode == Some(Mode::Torsion);
        let lengths = [("radius", self.radius), ("length", self.length)];
        let sizes = lengths.map(|(name, length)| (name, length.map(Length::si)));
        for (name, size) in sizes.into_iter().chain([("stretch", self.stretch)]) {
            let Some(size) = size else { continue };
            if !is_torsion {
                let why = "is of a test of `mode = \"torsion\"`; remove it, or set that mode";
                return Err(source.unexpected(&key(name), why));
            }
            if !(size > 0.0 && size.is_finite()) {
                return Err(source.error(&key(name), size, "a number above 0"));
            }
        }
        if let Some(stretch) = self.stretch.filter(|stretch| !HELD_STRETCHES.contains(stretch)) {
            let (low, high) = (HELD_STRETCHES.start(), HELD_STRETCHES.end());
            let allowed = format!("{low} to {high}, length over undeformed length: 1.25 is 25 % longer");
            return Err(source.error(&key("stretch"), stretch, allowed));
        }
        if !is_torsion {
            return Ok(());
        }
        if self.radius.is_none() {
            let why = "needed with `mode = \"torsion\"`: the undeformed radius, as \"5 mm\"";
            return Err(source.missing(&key("radius"), why));
        }
        for (name, is_given) in [
            ("strain", self.strain.is_some()),
            ("stress", self.stress.is_some()),
            ("stress_unit", self.stress_unit.is_some()),
            ("strain_column", self.strain_column.is_some()),
            ("stress_column", self.stress_column.is_some()),
            ("tests", !self.tests.is_empty()),
        ] {
            if is_given {
                let why = "a table of torsion has `twist [rad/m]` or `angle [deg]`, and `torque [N mm]`";
                return Err(source.unexpected(&key(name), why));
            }
        }
        Ok(())
    }

    fn read_file(self, source: &Source, key: &dyn Fn(&str) -> String) -> Result<DataSet, SceneError> {
        let deviation = |text: &String| {
            Deviation::parse(text)
                .map_err(|allowed| source.error(&key("deviation"), format!("`{text}`"), allowed))
        };
        let column = self.weight_column.as_ref().or(self.deviation_column.as_ref());
        let weights = column.map(|name| format!("`{name}`")).or(self.deviation.clone());
        let format = TestFormat {
            mode: self.mode,
            strain: self.strain,
            stress: self.stress,
            stress_unit: self.stress_unit,
            strain_column: self.strain_column,
            stress_column: self.stress_column,
            material: self.material.clone(),
            tests: self.tests,
            weight_column: self.weight_column,
            deviation_column: self.deviation_column,
            deviation: self.deviation.as_ref().map(deviation).transpose()?,
            cylinder: self.radius.map(|radius| TestCylinder {
                radius: radius.si(),
                length: self.length.map(Length::si),
                stretch: self.stretch,
            }),
        };
        let reading = TestData::read_as(source.file(self.file.unwrap_or_default()), &format)
            .map_err(|error| source.refused(&key("file"), error))?;
        let mut read = [vec![reading.description], reading.notes].concat();
        let mut table = reading.table;
        if let Some(weights) = weights {
            read.push(format!("squares weighted by {weights}"));
        }
        if let Some(mode) = self.mode {
            table = table
                .select(mode)
                .map_err(|error| source.error(&key("mode"), error, "a test with a stress in the table"))?;
        }
        let (parts, modes, weight) = (Vec::new(), Vec::new(), self.weight);
        Ok(DataSet { name: self.name, table, material: self.material, read, parts, weight, modes })
    }

    fn join(
        self,
        source: &Source,
        key: &dyn Fn(&str) -> String,
        above: &[DataSet],
    ) -> Result<DataSet, SceneError> {
        let read = [
            self.mode.is_some(),
            self.strain.is_some(),
            self.stress.is_some(),
            self.stress_unit.is_some(),
            self.strain_column.is_some(),
            self.stress_column.is_some(),
            self.material.is_some(),
            !self.tests.is_empty(),
            self.weight_column.is_some(),
            self.deviation_column.is_some(),
            self.deviation.is_some(),
            self.weight.is_some(),
            self.radius.is_some() || self.length.is_some() || self.stretch.is_some(),
        ];
        if self.tables.is_empty() || read.contains(&true) {
            let allowed = "the `file` of a table, or `tables` alone, names of tables above to fit at once";
            return Err(source.error(&key("file"), "no file", allowed));
        }
        let mut parts: Vec<&DataSet> = Vec::new();
        for (i, name) in self.tables.iter().enumerate() {
            let place = key(&format!("tables[{i}]"));
            let Some(part) = above.iter().find(|set| set.name == *name) else {
                let known: Vec<&str> = above.iter().map(|set| set.name.as_str()).collect();
                return Err(source.unknown(&place, name, &known));
            };
            if parts.iter().any(|other| other.name == *name) || !part.parts.is_empty() {
                let allowed = "tables with a file, each once";
                return Err(source.error(&place, format!("`{name}`"), allowed));
            }
            if let Some(other) = parts.iter().find(|other| other.material != part.material) {
                let found = format!("`{name}` of another material than `{}`", other.name);
                return Err(source.error(&place, found, "tables of one `material`"));
            }
            parts.push(part);
        }
        let tables: Vec<(&TestData, f64)> =
            parts.iter().map(|part| (&part.table, part.weight.unwrap_or(1.0))).collect();
        Ok(DataSet {
            name: self.name,
            table: TestData::join(&tables).map_err(|error| source.refused(&key("tables"), error))?,
            material: parts[0].material.clone(),
            read: vec![format!("rows of {}", self.tables.join(", "))],
            parts: self.tables,
            weight: None,
            modes: Vec::new(),
        })
    }
}

/// Refuses the weight of a table that is not fitted together with others.
///
/// # Errors
/// A [`SceneError`] at the weight.
pub fn check_weights(source: &Source, data: &[DataSet]) -> Result<(), SceneError> {
    let is_joined = |name: &String| data.iter().any(|set| set.parts.contains(name));
    let idle = |set: &DataSet| set.weight.is_some() && !is_joined(&set.name);
    match data.iter().position(idle) {
        None => Ok(()),
        Some(index) => {
            let why = "needs another table whose `tables` name this one";
            Err(source.unexpected(&format!("fit.data[{index}].weight"), why))
        }
    }
}

impl DataSet {
    /// Doubts about its file, a line each.
    pub fn warnings(&self) -> Vec<String> {
        let doubts = self.read.iter().filter_map(|line| line.strip_prefix("warning: "));
        doubts.map(|doubt| format!("warning: {}: {doubt}", self.name)).collect()
    }

    /// Key of the scene that names its states.
    pub fn source_key(&self) -> &'static str {
        if self.parts.is_empty() { "file" } else { "tables" }
    }
}
