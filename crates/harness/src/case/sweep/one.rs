//! A single run of a sweep: its scene and its state.

use super::{Vary, divided};
use crate::case::{Case, Options};
use crate::checkpoint::Header;
use crate::report::{Provenance, Report};
use crate::scene::{Failure, SWEEP, SceneError, Source};
use polycore::Error;
use std::path::Path;

/// A run: name, values, and the scene with the table that sets them.
pub(super) struct Run {
    pub name: String,
    pub values: Vec<String>,
    pub source: Source,
}

impl Run {
    pub fn new<C: Case>(
        source: &Source,
        vary: &[Vary],
        name: String,
        values: Vec<String>,
        quick: bool,
    ) -> Self {
        let keys: Vec<String> = vary.iter().flat_map(Vary::keys).collect();
        let each = keys.iter().zip(values.iter().flat_map(|value| divided(value, ';')));
        let mut set: Vec<String> =
            each.map(|(key, value)| format!("{} = {}", quoted(key), literal(&value))).collect();
        for key in C::large_outputs(source) {
            if !keys.iter().any(|other| other == key) {
                set.push(format!("{} = false", quoted(key)));
            }
        }
        // a quick run is another run: what it finished is not taken for a whole one
        let quick = if quick { "quick = true\n" } else { "" };
        let (text, set) = (source.text.trim_end(), set.join(", "));
        let text = format!("{text}\n\n[{SWEEP}]\n{quick}set = {{ {set} }}\n");
        Self { name, values, source: source.with_text(text) }
    }

    /// Returns the report, if the run is finished in the folder of the sweep.
    pub fn finished(&self, sweep: &Path) -> Option<Report> {
        let report = Report::read(sweep.join(&self.name).join(crate::report::FILE_NAME)).ok()?;
        let Provenance { scene, stamp, .. } = &report.provenance;
        let same = scene.starts_with(self.source.text.trim_end());
        let holds = stamp.as_ref().is_none_or(|stamp| stamp.changed(&self.source.path).is_none());
        (same && holds).then_some(report)
    }

    /// Kept where it is finished, gone on with where it is begun.
    pub fn solve<C: Case>(&self, sweep: &Path, options: Options) -> Result<Report, Failure<C::Error>> {
        if let Some(report) = self.finished(sweep) {
            return Ok(report);
        }
        let begun = |header: Header| header.scene == self.source.text && header.check(options.output).is_ok();
        let resume = Header::read(options.output, C::PROGRAM.magic).is_ok_and(begun);
        Ok(crate::case::run::<C>(&self.source, Options { resume, ..options })?.report)
    }

    /// Returns a fault of a scene that nobody wrote, as one of the options that made it: of that at whose key
    /// it is, else of all.
    pub fn of_options(&self, scene: &Source, vary: &[Vary], fault: &SceneError) -> Error {
        let set = format!("{SWEEP}.set.");
        let key = fault.key().unwrap_or_default().trim_start_matches(set.as_str());
        let at_key = |vary: &&Vary| {
            let within = |rest: &str| rest.is_empty() || rest.starts_with(['.', '[']);
            vary.keys().iter().any(|own| key.strip_prefix(own.as_str()).is_some_and(within))
        };
        let named: Vec<&Vary> = vary.iter().filter(at_key).collect();
        let options = vary.iter().zip(&self.values).filter(|(v, _)| named.is_empty() || named.contains(v));
        let option: Vec<String> =
            options.map(|(vary, value)| format!("--vary {}={value}", vary.key)).collect();
        let mut reason = fault.message().replace(&set, "");
        // of a key that the scene has elsewhere
        if let Some((before, _)) = reason.split_once(&format!(" in `{SWEEP}.set`"))
            && let Some(name) = before.split('`').nth(1)
            && let Ok(value) = scene.parse::<serde_json::Value>()
        {
            let mut paths = Vec::new();
            paths_of(&value, name, "", &mut paths);
            reason = format!("{before}: a key is a path from the top of the scene");
            if let Some(path) = paths.first() {
                reason += &format!("; did you mean `{path}`?");
            }
        }
        let reason = match named[..] {
            [vary] => reason.trim_start_matches(&format!("`{}`: ", vary.key)).to_owned(),
            _ => reason,
        };
        Error::Option { option: option.join(" "), reason }
    }
}

/// Paths of the keys of a scene that have a name, blocks of studies left out.
fn paths_of(value: &serde_json::Value, name: &str, above: &str, paths: &mut Vec<String>) {
    match value {
        serde_json::Value::Object(table) => {
            for (key, value) in table.iter().filter(|(key, _)| !(above.is_empty() && *key == "study")) {
                let path = if above.is_empty() { key.clone() } else { format!("{above}.{key}") };
                if key == name {
                    paths.push(path.clone());
                }
                paths_of(value, name, &path, paths);
            }
        }
        serde_json::Value::Array(list) => {
            for (index, value) in list.iter().enumerate() {
                paths_of(value, name, &format!("{above}[{index}]"), paths);
            }
        }
        _ => {}
    }
}

pub(super) fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// Returns a value as TOML: numbers, truth values, arrays, tables and texts in quotes as they are, all else a
/// text.
fn literal(value: &str) -> String {
    if let Ok(whole) = value.parse::<i64>() {
        return whole.to_string();
    }
    if let Ok(number) = value.parse::<f64>() {
        return format!("{number:?}").to_lowercase();
    }
    let as_it_is = matches!(value, "true" | "false") || value.starts_with(['[', '{', '"']);
    if as_it_is { value.to_owned() } else { quoted(value) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::rows::numeric;

    #[test]
    fn values_in_toml() {
        for (value, toml) in [
            ("10s", "\"10s\""),
            ("3", "3"),
            ("007", "7"),
            (".5", "0.5"),
            ("1e3", "1000.0"),
            ("nan", "nan"),
            ("true", "true"),
            ("[\"1 mm\"]", "[\"1 mm\"]"),
            ("a \"b\" \\", "\"a \\\"b\\\" \\\\\""),
        ] {
            assert_eq!(literal(value), toml);
        }
        assert_eq!(crate::study::named("boundary[1].ambient", "80 degC"), "ambient-80degC");
        let texts = |list: &[&str]| list.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>();
        assert_eq!(numeric(&texts(&["10s", "20 s"])), Some((vec![10.0, 20.0], "s".into())));
        assert_eq!(numeric(&texts(&["10s", "1 min"])), None);
        assert_eq!(numeric(&texts(&["tr-bdf2"])), None);
    }
}
