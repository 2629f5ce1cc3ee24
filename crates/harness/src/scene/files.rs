//! Files and results of other scenes that a scene is computed from. Their hashes tell whether results
//! still hold.

use std::collections::BTreeMap;
use std::fmt::{self, Write as _};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use sha2::{Digest, Sha256};
use toml::de::{DeTable, DeValue};

use super::{INPUTS, REPORT, SceneError, Source};
use crate::report::{FILE_NAME, Report};
use crate::stamp::{InputStamp, Stamp};

/// Hashes of the files that a scene has read, by their paths; all copies of a source share them.
pub(super) type Notes = Arc<Mutex<BTreeMap<PathBuf, String>>>;
/// Results of other scenes, by their names.
pub(super) type Inputs = Arc<BTreeMap<String, InputStamp>>;

/// Input that results no longer agree with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Changed {
    /// The contents of a file, or the file is gone.
    File(PathBuf),
    /// The results of an input.
    Input(String),
}

impl fmt::Display for Changed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(path) => write!(f, "the file {} has changed", path.display()),
            Self::Input(name) => write!(f, "the results of its input `{name}` have changed"),
        }
    }
}

impl Stamp {
    /// Returns the first input that has changed; `scene` is the path of the scene.
    pub fn changed(&self, scene: &Path) -> Option<Changed> {
        let folder = scene.parent().unwrap_or(Path::new(""));
        let other = |(path, hash): &(&PathBuf, &String)| {
            hash_of_file(&folder.join(path)).ok().as_ref() != Some(*hash)
        };
        if let Some((path, _)) = self.files.iter().find(other) {
            return Some(Changed::File(path.clone()));
        }
        let other = |(_, input): &(&String, &InputStamp)| {
            Self::identity_of(&input.output).as_ref() != Some(&input.identity)
        };
        self.inputs.iter().find(other).map(|(name, _)| Changed::Input(name.clone()))
    }

    /// SHA-256 of everything that determines the results: equal programs compute equal bits from it. Where
    /// the results of inputs lie makes no difference.
    pub fn identity(&self, program: &str, version: &str) -> String {
        let mut text = format!("{program} {version} {} {}\n", self.scene, self.quick);
        for (path, hash) in &self.files {
            // results of inputs have identities, which do not depend on the folder
            if !self.inputs.values().any(|input| path.starts_with(&input.output)) {
                let _ = writeln!(text, "{} {hash}", path.display());
            }
        }
        for (name, input) in &self.inputs {
            let _ = writeln!(text, "{name} {}", input.identity);
        }
        hash(text.as_bytes())
    }

    /// Returns the identity of the results in a folder, if they are finished.
    pub fn identity_of(output: &Path) -> Option<String> {
        let provenance = Report::read(output.join(FILE_NAME)).ok()?.provenance;
        Some(provenance.stamp?.identity(&provenance.program, &provenance.version))
    }
}

impl Source {
    /// Returns the folder of the scene, from which the paths in it count.
    pub fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    /// Returns the path of a file that the scene names. It is noted with the hash of its contents: results
    /// are stale when that changes.
    pub fn file(&self, name: impl AsRef<Path>) -> PathBuf {
        let (path, key) = (self.folder().join(&name), name.as_ref().to_path_buf());
        let mut notes = self.files.lock().unwrap_or_else(PoisonError::into_inner);
        // what cannot be read has its own error where it is read; a device may never end
        if !notes.contains_key(&key)
            && path.is_file()
            && let Ok(hash) = hash_of_file(&path)
        {
            notes.insert(key, hash);
        }
        path
    }

    /// Returns the hashes of all that has been read for the scene.
    pub fn stamp(&self, quick: bool) -> Stamp {
        let files = self.files.lock().unwrap_or_else(PoisonError::into_inner).clone();
        Stamp { scene: hash(self.text.as_bytes()), quick, files, inputs: (*self.inputs).clone() }
    }

    /// Returns the same scene with the results of its inputs.
    #[must_use]
    pub fn with_inputs(mut self, inputs: BTreeMap<String, InputStamp>) -> Self {
        self.inputs = Arc::new(inputs);
        self
    }

    /// Another text in the place of this scene, with the same inputs.
    #[must_use]
    pub fn with_text(&self, text: impl Into<String>) -> Self {
        Self { inputs: Arc::clone(&self.inputs), ..Self::new(&self.path, text) }
    }

    /// Returns the folder of the results of an input, named at `key`.
    ///
    /// # Errors
    /// No input has that name.
    pub fn input(&self, key: &str, name: &str) -> Result<PathBuf, SceneError> {
        match self.inputs.get(name) {
            Some(input) => Ok(input.output.clone()),
            None if self.inputs.is_empty() => {
                let allowed = "a name of `[inputs]`, with the scene whose results are read";
                Err(self.error(key, format!("`{name}`"), allowed))
            }
            None => {
                let known: Vec<&str> = self.inputs.keys().map(String::as_str).collect();
                Err(self.unknown(key, name, &known))
            }
        }
    }

    /// Returns the scenes named in `[inputs]`: names, and paths as they are written.
    ///
    /// # Errors
    /// A syntax error; an entry that is no path.
    pub fn inputs(&self) -> Result<Vec<(String, PathBuf)>, SceneError> {
        let mut root = DeTable::parse(&self.text).map_err(|error| SceneError::syntax(self, &error))?;
        self.overlay(root.get_mut())?;
        let Some(inputs) = root.get_ref().get(INPUTS) else { return Ok(Vec::new()) };
        let DeValue::Table(inputs) = inputs.get_ref() else {
            let found = "a value that is no table";
            return Err(self.error(INPUTS, found, "a table NAME = \"PATH of a scene\""));
        };
        let mut named = Vec::new();
        for (name, value) in inputs {
            let name = name.get_ref().to_string();
            match value.get_ref() {
                DeValue::String(path) if !path.is_empty() => named.push((name, PathBuf::from(path.as_ref()))),
                _ => {
                    let found = "a value that is no path";
                    let allowed = "the path of a scene, relative to this one";
                    return Err(self.error(&format!("{INPUTS}.{name}"), found, allowed));
                }
            }
        }
        Ok(named)
    }

    /// Returns the program that the scene names.
    pub fn program(&self) -> Option<String> {
        let root = DeTable::parse(&self.text).ok()?;
        Some(root.get_ref().get("program")?.get_ref().as_str()?.to_owned())
    }

    /// Returns the title of the scene, if it has one.
    pub fn title(&self) -> Option<String> {
        let root = DeTable::parse(&self.text).ok()?;
        let title = root.get_ref().get("title")?.get_ref().as_str()?.trim();
        (!title.is_empty()).then(|| title.to_owned())
    }

    /// Returns true for a scene with `[[expect]]`.
    pub(crate) fn has_expectations(&self) -> bool {
        DeTable::parse(&self.text).is_ok_and(|root| root.get_ref().contains_key("expect"))
    }

    /// Returns the names and patterns of `[report] values`.
    pub fn report_values(&self) -> Vec<String> {
        let values = || {
            let root = DeTable::parse(&self.text).ok()?;
            let table = root.get_ref().get(REPORT)?.get_ref().as_table()?.clone();
            let names = table.get("values")?.get_ref().as_array()?.clone();
            Some(names.iter().filter_map(|name| Some(name.get_ref().as_str()?.to_owned())).collect())
        };
        values().unwrap_or_default()
    }
}

fn hash(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}

fn hash_of_file(path: &Path) -> io::Result<String> {
    let mut hasher = Sha256::new();
    io::copy(&mut File::open(path)?, &mut hasher)?;
    Ok(hexadecimal(&hasher.finalize()))
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stamp_tells_what_changed() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("a.csv"), "abc").unwrap();
        let source = Source::new(at("case.toml"), "version = 1");
        assert_eq!(source.clone().file("a.csv"), at("a.csv"));
        source.file("none.csv");
        let stamp = source.stamp(false);
        // FIPS 180-2, appendix B.1
        let abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(stamp.files, BTreeMap::from([(PathBuf::from("a.csv"), abc.to_owned())]));
        assert_eq!(stamp.changed(&source.path), None);
        std::fs::write(at("a.csv"), "abd").unwrap();
        let changed = stamp.changed(&source.path).unwrap();
        assert_eq!(changed.to_string(), "the file a.csv has changed");
        std::fs::remove_file(at("a.csv")).unwrap();
        assert_eq!(stamp.changed(&source.path), Some(changed));
    }

    #[test]
    fn an_identity_does_not_depend_on_folders() {
        let stamp = |output: &str, identity: &str, quick| Stamp {
            scene: hash(b"text"),
            quick,
            files: BTreeMap::from([(PathBuf::from(output).join("fields"), "1".to_owned())]),
            inputs: BTreeMap::from([(
                "print".to_owned(),
                InputStamp { output: output.into(), identity: identity.into() },
            )]),
        };
        let identity = |stamp: &Stamp| stamp.identity("peri", "0.1.0");
        let first = stamp("/a", "1", false);
        assert_eq!(identity(&first), identity(&stamp("/b", "1", false)));
        for other in [stamp("/a", "2", false), stamp("/a", "1", true)] {
            assert_ne!(identity(&first), identity(&other));
        }
        assert_ne!(identity(&first), first.identity("peri", "0.2.0"));
    }

    #[test]
    fn inputs_are_paths() {
        let of = |text: &str| Source::new("a.toml", text).inputs();
        assert_eq!(of("version = 1").unwrap(), []);
        let named = of("[inputs]\nprint = '../b.toml'\n").unwrap();
        assert_eq!(named, [("print".to_owned(), PathBuf::from("../b.toml"))]);
        assert!(of("inputs = 3").unwrap_err().message().contains("no table"));
        assert!(of("[inputs]\nprint = 3").unwrap_err().message().contains("inputs.print"));
        // programs do not see them
        let source = Source::new("a.toml", "version = 1\n[inputs]\nprint = 'b.toml'");
        assert!(source.parse::<BTreeMap<String, String>>().unwrap().is_empty());
    }
}
