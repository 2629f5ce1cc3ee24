//! Scenes: versioned TOML files that become typed values, with errors that point at the offending place.
//!
//! ```
//! # use harness::scene::Source;
//! # use polycore::units::Length;
//! #[derive(serde::Deserialize)]
//! #[serde(deny_unknown_fields)]
//! struct Scene {
//!     spacing: Length,
//! }
//! let source = Source::new("scene.toml", "version = 1\nspacng = '2 mm'");
//! let error = source.parse::<Scene>().err().unwrap();
//! assert_eq!(error.line(), Some(2));
//! assert!(error.message().contains("did you mean `spacing`?"));
//! ```
//!
//! Every scene begins with `version = 1`; [`Source::parse`] checks and removes that key, and `[inputs]`, so
//! scene types do not declare them. Alternatives are best written as a struct of options that is checked
//! afterwards: serde buffers untagged enums, after which it knows neither the place nor what would have been
//! allowed. Cross-field checks are the program's: it reports them with [`Source::error`].

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::report::RequestedUnit;
use serde::Deserialize as _;
use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer};

mod branch;
mod constitutive;
mod error;
mod failure;
mod files;
mod line;
mod locate;
mod overlay;
mod schema;
mod solid;

pub use crate::stamp::{InputStamp, Stamp};
pub use branch::{BranchConstant, BranchSpec, MullinsSpec, ShiftSpec, SpringKind, ViscosityKind};
pub use constitutive::{Constant, ConstitutiveSpec};
pub use error::SceneError;
pub use failure::Failure;
pub use files::Changed;
pub use line::{LineSpec, check_name};
pub use schema::schema;
pub use solid::{CutSpec, SolidSpec};

/// The only version of the scene format so far.
pub const VERSION: i64 = 1;

pub use polycore::error::EXIT_BAD_INPUT;

/// The table that a sweep writes behind a scene: what it sets, in `set`, holds over all else.
pub const SWEEP: &str = "sweep";

/// The table of a scene that names the scenes whose results it reads; the harness reads it, programs do not.
pub const INPUTS: &str = "inputs";

/// The table of a scene that names the values to show first and their units; the harness reads it, programs
/// do not.
pub const REPORT: &str = "report";

/// A larger file is not a scene; numbers in bulk belong into CSV files beside it.
pub const LARGEST_FILE: u64 = 16 << 20;

/// The text of a scene and where it came from.
#[derive(Clone, Debug)]
pub struct Source {
    /// The file, as given by the user.
    pub path: PathBuf,
    /// Content of the file.
    pub text: String,
    /// Replacements of parts of the scene, see [`Source::with_replaced`].
    overlays: Vec<overlay::Overlay>,
    /// Files that have been read for it.
    files: files::Notes,
    /// Results of the scenes that it names in `[inputs]`.
    inputs: files::Inputs,
}

impl Source {
    /// Returns a scene that does not lie in a file; `path` only names it in messages.
    pub fn new(path: impl Into<PathBuf>, text: impl Into<String>) -> Self {
        Self {
            path: path.into(),
            text: text.into(),
            overlays: Vec::new(),
            files: files::Notes::default(),
            inputs: files::Inputs::default(),
        }
    }

    /// Returns true for the name of a table.
    pub fn is_table(path: &Path) -> bool {
        path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("csv"))
    }

    /// Reads a scene file.
    ///
    /// # Errors
    /// The file is missing, a directory, unreadable, larger than [`LARGEST_FILE`] or not UTF-8.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, SceneError> {
        let path = path.as_ref();
        let fail = |code, what: String, help| SceneError::file(path, code, what, help);
        let io = |error: std::io::Error| match error.kind() {
            std::io::ErrorKind::NotFound => {
                fail("scene::missing_file", "there is no such file".into(), error::similar_file(path))
            }
            _ => fail("scene::unreadable", format!("cannot be read: {error}"), None),
        };
        let metadata = std::fs::metadata(path).map_err(io)?;
        if metadata.is_dir() {
            let help = error::scene_inside(path);
            return Err(fail("scene::directory", "is a directory, not a scene file".into(), help));
        }
        if Self::is_table(path) {
            let help = "name it in a scene: `version = 1`, the `program`, a `title`, and the block that \
                        reads it, as `[[fit.data]]` with `name` and `file` of polycore";
            return Err(fail("scene::table", "is a table, not a scene".into(), Some(help.into())));
        }
        let mut bytes = Vec::new();
        // the length of a pipe or device is not known beforehand: read one byte more than allowed
        File::open(path).and_then(|file| file.take(LARGEST_FILE + 1).read_to_end(&mut bytes)).map_err(io)?;
        if bytes.len() as u64 > LARGEST_FILE {
            let what = format!("is larger than {} MiB, too large for a scene", LARGEST_FILE >> 20);
            let help = "put tables of numbers into CSV files and name them in the scene".to_owned();
            return Err(fail("scene::too_large", what, Some(help)));
        }
        let text = String::from_utf8(bytes).map_err(|error| {
            let valid = error.utf8_error().valid_up_to();
            let line = 1 + error.as_bytes()[..valid].iter().filter(|&&byte| byte == b'\n').count();
            let what = format!("is not UTF-8 text (byte {valid}, line {line})");
            fail("scene::not_utf8", what, Some("save the file as UTF-8; is it a scene?".into()))
        })?;
        Ok(Self::new(path, text))
    }

    /// Parses the text as a scene of type `T`, which should `deny_unknown_fields`.
    ///
    /// # Errors
    /// A syntax error, a missing or unknown `version`, or whatever serde finds wrong.
    pub fn parse<T: DeserializeOwned>(&self) -> Result<T, SceneError> {
        let mut root = DeTable::parse(&self.text).map_err(|error| SceneError::syntax(self, &error))?;
        self.check_version(&root)?;
        root.get_mut().remove("version");
        self.overlay(root.get_mut())?;
        root.get_mut().remove(INPUTS);
        let report = root.get_mut().remove(REPORT).map_or(Ok(()), check_report);
        report.and_then(|()| T::deserialize(Deserializer::from(root))).map_err(|error| {
            // the first tree went into the deserializer; errors are rare, so parse once more
            match DeTable::parse(&self.text) {
                Ok(root) => {
                    let error = wrong_program::<T>(&root).unwrap_or(error);
                    SceneError::from_serde(self, root.get_ref(), &error)
                }
                Err(error) => SceneError::syntax(self, &error),
            }
        })
    }

    /// Reports the value at a dotted key path, for rules that span several keys.
    ///
    /// `source.error("body.parts[1].radius", "0.6 m, larger than the plate", "less than 0.5 m")`. A path that
    /// does not exist points at its nearest existing parent.
    pub fn error(&self, key: &str, found: impl ToString, allowed: impl ToString) -> SceneError {
        let (key, span) = self.place(key);
        SceneError::value(self, &key, span, &found.to_string(), &allowed.to_string())
    }

    /// Reports a key that must be written: "missing `key`: needed for …".
    pub fn missing(&self, key: &str, why: impl ToString) -> SceneError {
        let (key, span) = self.place(key);
        SceneError::missing(self, key, span, &why.to_string())
    }

    /// Reports a key that has no meaning here: "unexpected `key`: …".
    pub fn unexpected(&self, key: &str, why: impl ToString) -> SceneError {
        let (key, span) = self.place(key);
        SceneError::unexpected(self, key, span, &why.to_string())
    }

    /// Reports a key that excludes another one: "`key` conflicts with `other`: …".
    pub fn conflict(&self, key: &str, other: &str, why: impl ToString) -> SceneError {
        let (key, span) = self.place(key);
        SceneError::conflict(self, key, span, other, &why.to_string())
    }

    /// Reports an error at a key in its own words, such as a file that cannot be used.
    pub fn refused(&self, key: &str, error: impl ToString) -> SceneError {
        let (key, span) = self.place(key);
        SceneError::refused(self, key, span, &error.to_string())
    }

    /// Reports a name that is not known; a similar one is proposed, and of many the
    /// most similar ones are shown.
    pub fn unknown(&self, key: &str, name: &str, known: &[&str]) -> SceneError {
        let (key, span) = self.place(key);
        SceneError::unknown(self, key, span, name, known)
    }

    /// Returns the path in the text and the span of the value at a dotted key path.
    fn place(&self, key: &str) -> (String, std::ops::Range<usize>) {
        let root = DeTable::parse(&self.text).ok();
        let origin = root.as_ref().and_then(|root| self.origin(root.get_ref(), key));
        let key = origin.unwrap_or_else(|| key.to_owned());
        let span = root.as_ref().and_then(|root| locate::span(root.get_ref(), &key)).unwrap_or(0..0);
        (key, span)
    }

    fn check_version(&self, root: &Spanned<DeTable<'_>>) -> Result<(), SceneError> {
        let table = root.get_ref();
        let Some(value) = table.get("version") else {
            let keys = table.keys().map(|key| key.get_ref().as_ref());
            let similar = error::nearest("version", keys).and_then(|name| {
                let (key, _) = table.get_key_value(name)?;
                Some((name.to_owned(), key.span()))
            });
            return Err(SceneError::no_version(self, similar));
        };
        let known = match value.get_ref() {
            DeValue::Integer(integer) => {
                i64::from_str_radix(integer.as_str(), integer.radix()) == Ok(VERSION)
            }
            _ => false,
        };
        if known { Ok(()) } else { Err(SceneError::bad_version(self, value.span())) }
    }
}

/// The table `[report]`.
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct ReportSpec {
    #[serde(default, rename = "values")]
    _values: Vec<String>,
    #[serde(default, rename = "units")]
    _units: Vec<RequestedUnit>,
}

fn check_report(table: Spanned<DeValue<'_>>) -> Result<(), toml::de::Error> {
    ReportSpec::deserialize(toml::de::ValueDeserializer::from(table)).map(drop)
}

/// Returns the fault of the key `program` alone: where the scene is another program's, all other keys are,
/// too.
fn wrong_program<T: DeserializeOwned>(root: &Spanned<DeTable<'_>>) -> Option<toml::de::Error> {
    let (key, value) = root.get_ref().get_key_value("program")?;
    let mut alone = DeTable::new();
    alone.insert(key.clone(), value.clone());
    let error = T::deserialize(Deserializer::from(Spanned::new(root.span(), alone))).err()?;
    error.message().starts_with("unknown variant").then_some(error)
}

#[cfg(test)]
mod tests;
