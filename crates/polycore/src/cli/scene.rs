//! The scene of a fit: which laws, which data, what is expected.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use polycore::hyperelastic::{self, FAMILIES, Family, data::Table};
use polycore::report::Expect;
use polycore::scene::{SceneError, Source};
use serde::Deserialize;

/// The file as written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Scene {
    /// Checked by its type only.
    #[serde(rename = "program")]
    _program: Program,
    #[serde(default)]
    title: String,
    fit: Fit,
    #[serde(default)]
    expect: Vec<Expect>,
}

/// The program that runs these scenes; `cargo xtask validate` chooses by it.
#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Program {
    Polycore,
}

/// What to fit to what.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Fit {
    /// Names of laws; all of them if not given.
    laws: Option<Vec<String>>,
    data: Vec<Data>,
}

/// A table of homogeneous states.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Data {
    /// Its name in the report.
    name: String,
    /// The CSV file, relative to the scene.
    file: PathBuf,
}

/// A scene that was checked, with its data.
pub struct Case {
    pub source: Source,
    pub title: String,
    pub laws: Vec<&'static Family>,
    pub data: Vec<(String, Table)>,
    pub expect: Vec<Expect>,
}

impl Case {
    /// Reads and checks a scene and the tables that it names.
    pub fn read(path: &Path) -> Result<Self, SceneError> {
        let source = Source::read(path)?;
        let Scene { _program: Program::Polycore, title, fit, expect } = source.parse()?;
        let laws = match &fit.laws {
            None => FAMILIES.iter().collect(),
            Some(names) => selected(&source, names)?,
        };
        let folder = path.parent().unwrap_or(Path::new(""));
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
            let table = Table::read(folder.join(&entry.file)).map_err(|error| {
                source.error(&key("file"), error, "a CSV table of stretches and nominal stresses")
            })?;
            for family in &laws {
                if table.measurements() < family.parameters.len() {
                    let found = format!("{} measured stresses", table.measurements());
                    let allowed = format!("at least {} for `{}`", family.parameters.len(), family.key);
                    return Err(source.error(&key("file"), found, allowed));
                }
            }
            data.push((entry.name, table));
        }
        if data.is_empty() {
            return Err(source.error(
                "fit.data",
                "no data",
                "at least one `[[fit.data]]` with `name` and `file`",
            ));
        }
        let case = Self { source, title, laws, data, expect };
        case.check_expectations()?;
        Ok(case)
    }

    /// The folder's name, or the file's if it lies in none.
    pub fn name(&self) -> String {
        let path = &self.source.path;
        let absolute = std::path::absolute(path).unwrap_or_else(|_| path.clone());
        let folder = absolute.parent().and_then(Path::file_name).or(absolute.file_stem());
        folder.map_or_else(|| "case".to_owned(), |name| name.to_string_lossy().into_owned())
    }

    /// What a run will do.
    pub fn plan(&self) -> String {
        let mut text = format!("{}: {}\n", self.source.path.display(), self.title);
        for (name, table) in &self.data {
            let (states, measured) = (table.states.len(), table.measurements());
            let _ = writeln!(
                text,
                "data {name}: {states} states, {measured} measured stresses ({})",
                table.source
            );
        }
        for family in &self.laws {
            let names: Vec<_> = family.parameters.iter().map(|parameter| parameter.name).collect();
            let _ = writeln!(text, "law {}: {}", family.key, names.join(", "));
        }
        let _ = writeln!(
            text,
            "{} fits, {} expectations; writes fits.csv, <data>_states.csv, pictures (not with --quick), report.json",
            self.laws.len() * self.data.len(),
            self.expect.len()
        );
        text
    }

    /// Names of all scalars that the report will have.
    fn quantities(&self) -> Vec<String> {
        let mut names = Vec::new();
        for (data, _) in &self.data {
            for family in &self.laws {
                let fixed = ["rms", "shear_modulus"].into_iter();
                let all = fixed.chain(family.parameters.iter().map(|parameter| parameter.name));
                // a law may be parameterised by its shear modulus
                for name in all {
                    names.push(format!("{data}.{}.{name}", family.key));
                }
            }
        }
        names
    }

    fn check_expectations(&self) -> Result<(), SceneError> {
        let names = self.quantities();
        for (i, expect) in self.expect.iter().enumerate() {
            if let Some(name) = expect.names().find(|name| !names.iter().any(|known| known == name)) {
                let found = format!("`{name}`, which this scene does not compute");
                let allowed =
                    "<data>.<law>.rms, .shear_modulus, or a parameter (`polycore check` lists them)";
                return Err(self.source.error(&format!("expect[{i}].quantity"), found, allowed));
            }
        }
        Ok(())
    }
}

fn selected(source: &Source, names: &[String]) -> Result<Vec<&'static Family>, SceneError> {
    let mut laws: Vec<&'static Family> = Vec::new();
    for (i, name) in names.iter().enumerate() {
        let all = || FAMILIES.iter().map(|family| family.key).collect::<Vec<_>>().join(", ");
        let key = format!("fit.laws[{i}]");
        let family =
            hyperelastic::family(name).map_err(|_| source.error(&key, format!("`{name}`"), all()))?;
        if laws.iter().any(|law| law.key == family.key) {
            return Err(source.error(&key, format!("`{name}` a second time"), "every law once"));
        }
        laws.push(family);
    }
    if laws.is_empty() {
        return Err(source.error("fit.laws", "no law", "at least one, or no key `laws` for all"));
    }
    Ok(laws)
}
