//! The scene of fits and trials: which laws, which data, trials, expectations.

use std::fmt::Write;
use std::path::PathBuf;

use polycore::constitutive::hyperelastic::data::{Mode, Table};
use polycore::constitutive::hyperelastic::{self, MODELS, ModelDescriptor};
use polycore::report::Expect;
use polycore::scene::{SceneError, Source};
use serde::Deserialize;

use super::quantities as q;
use super::trials::Trial;

/// The file as written.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct Scene {
    /// Checked by its type only.
    #[serde(rename = "program")]
    _program: Program,
    /// One line for tables and pictures.
    #[serde(default)]
    title: String,
    /// Fits.
    #[serde(default)]
    fit: Fit,
    /// Laws at single states and fits to a few, with their expected behaviour.
    #[serde(default)]
    trial: Vec<Trial>,
    /// Expected results.
    #[serde(default)]
    expect: Vec<Expect>,
}

/// The program that runs these scenes; `cargo xtask validate` chooses by it.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
enum Program {
    Polycore,
}

/// Laws and data to fit.
#[derive(Default, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct Fit {
    /// Names of laws; all of them if not given.
    laws: Option<Vec<String>>,
    /// Whether a law fitted to one table is judged on the others, too.
    #[serde(default)]
    cross: bool,
    /// Tables of measurements.
    #[serde(default)]
    data: Vec<Data>,
}

/// A table of homogeneous states.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct Data {
    /// Its name in the report.
    name: String,
    /// The CSV file, relative to the scene.
    file: PathBuf,
    /// Only the states of this test.
    mode: Option<Mode>,
}

/// The JSON Schema of scenes.
pub fn schema() -> serde_json::Value {
    polycore::scene::schema("polycore", &[q::ALL], |generator| vec![generator.subschema_for::<Scene>()])
}

/// A scene that was checked, with its data.
pub struct Case {
    pub source: Source,
    pub title: String,
    pub laws: Vec<&'static ModelDescriptor>,
    pub cross: bool,
    pub data: Vec<(String, Table)>,
    pub trials: Vec<Trial>,
    pub expect: Vec<Expect>,
}

impl Case {
    /// Parses and checks a scene and the tables that it names.
    pub fn parse(source: &Source) -> Result<Self, SceneError> {
        let Scene { _program: Program::Polycore, title, fit, trial, expect } = source.parse()?;
        let laws = match &fit.laws {
            None => MODELS.iter().collect(),
            Some(names) => selected(source, names)?,
        };
        let mut data: Vec<(String, Table)> = Vec::new();
        for (i, entry) in fit.data.into_iter().enumerate() {
            let key = |field: &str| format!("fit.data[{i}].{field}");
            let valid = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
            if entry.name.is_empty() || !entry.name.chars().all(valid) {
                let allowed = "letters, digits, `-` and `_`: it names files";
                return Err(source.error(&key("name"), format!("`{}`", entry.name), allowed));
            }
            if data.iter().any(|(name, _)| *name == entry.name) {
                return Err(source.error(
                    &key("name"),
                    format!("`{}` a second time", entry.name),
                    "another name",
                ));
            }
            let mut table = Table::read(source.file(&entry.file)).map_err(|error| {
                source.error(&key("file"), error, "a CSV table of stretches and nominal stresses")
            })?;
            if let Some(mode) = entry.mode {
                table = table.of(mode).map_err(|error| {
                    source.error(&key("mode"), error, "a test of which the table has a stress")
                })?;
            }
            for model in &laws {
                if table.measurements() < model.parameters.len() {
                    let found = format!("{} measured stresses", table.measurements());
                    let allowed = format!("at least {} for `{}`", model.parameters.len(), model.key);
                    return Err(source.error(&key("file"), found, allowed));
                }
            }
            data.push((entry.name, table));
        }
        if data.is_empty() && trial.is_empty() {
            return Err(source.error(
                "fit.data",
                "no data",
                "at least one `[[fit.data]]` with `name` and `file`, or a `[[trial]]`",
            ));
        }
        super::trials::check(source, &trial)?;
        let case =
            Self { source: source.clone(), title, laws, cross: fit.cross, data, trials: trial, expect };
        case.check_expectations()?;
        Ok(case)
    }

    /// What a run will do, in lines.
    pub fn plan(&self) -> String {
        let mut text = format!("{}: {}\n", self.source.path.display(), self.title);
        for (name, table) in &self.data {
            let (states, measured) = (table.states.len(), table.measurements());
            let source =
                if table.source.is_empty() { "no line `# source: …` in it" } else { &table.source };
            let _ = writeln!(text, "data {name}: {states} states, {measured} measured stresses ({source})");
        }
        for model in &self.laws {
            let names: Vec<_> = model.parameters.iter().map(|parameter| parameter.name).collect();
            let _ = writeln!(text, "law {}: {}", model.key, names.join(", "));
        }
        let _ = writeln!(
            text,
            "{} fits, {} trials, {} expectations; writes fits.csv, <data>_states.csv, materials.toml, pictures (not with \
             --quick), report.json",
            self.laws.len() * self.data.len(),
            self.trials.len(),
            self.expect.len()
        );
        text
    }

    /// Names of all scalars that the report will have.
    fn quantities(&self) -> Vec<String> {
        let mut names = Vec::new();
        for (data, _) in &self.data {
            for model in &self.laws {
                let fit = format!("{data}.{}", model.key);
                names.extend(
                    [q::RMS, q::MAE, q::R2, q::SHEAR_MODULUS].map(|quantity| quantity.of(&[&fit]).name),
                );
                let parameters = model.parameters.iter().map(|parameter| parameter.name);
                names.extend(parameters.map(|parameter| q::PARAMETER.of(&[&fit, parameter]).name));
                for (other, _) in self.data.iter().filter(|(other, _)| self.cross && other != data) {
                    let fit = format!("{fit}.{other}");
                    names
                        .extend([q::RMS, q::MAE, q::R2, q::LOCKED].map(|quantity| quantity.of(&[&fit]).name));
                }
            }
        }
        for trial in &self.trials {
            names.extend(trial.quantities());
        }
        names
    }

    fn check_expectations(&self) -> Result<(), SceneError> {
        let names = self.quantities();
        for (i, expect) in self.expect.iter().enumerate() {
            if let Some(name) = expect.names().find(|name| !names.iter().any(|known| known == name)) {
                let known: Vec<&str> = names.iter().map(String::as_str).collect();
                return Err(self.source.unknown(&format!("expect[{i}].quantity"), name, &known));
            }
        }
        Ok(())
    }
}

fn selected(source: &Source, names: &[String]) -> Result<Vec<&'static ModelDescriptor>, SceneError> {
    let mut laws: Vec<&'static ModelDescriptor> = Vec::new();
    for (i, name) in names.iter().enumerate() {
        let all = || MODELS.iter().map(|model| model.key).collect::<Vec<_>>().join(", ");
        let key = format!("fit.laws[{i}]");
        let model = hyperelastic::model(name).map_err(|_| source.error(&key, format!("`{name}`"), all()))?;
        if laws.iter().any(|law| law.key == model.key) {
            return Err(source.error(&key, format!("`{name}` a second time"), "every law once"));
        }
        laws.push(model);
    }
    if laws.is_empty() {
        return Err(source.error("fit.laws", "no law", "at least one, or no key `laws` for all"));
    }
    Ok(laws)
}
