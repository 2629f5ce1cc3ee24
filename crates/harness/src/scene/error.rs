//! Errors in scenes: where, what was found, what is allowed.

use std::fmt;
use std::io::IsTerminal;
use std::ops::Range;
use std::path::Path;

use miette::{Diagnostic, GraphicalReportHandler, GraphicalTheme, LabeledSpan, NamedSource, SourceCode};
use toml::de::DeTable;

use super::{EXIT_BAD_INPUT, Source, VERSION, locate};

/// Error in a scene: a [`miette::Diagnostic`] with file, line, caret and help.
#[derive(Debug)]
pub struct SceneError(Box<ErrorContent>);

#[derive(Debug)]
struct ErrorContent {
    code: &'static str,
    message: String,
    key: Option<String>,
    help: Option<String>,
    /// Label, place, line and text; none when the file could not be read at all.
    place: Option<ErrorPlace>,
}

#[derive(Debug)]
struct ErrorPlace {
    /// Bytes in the longest line that the picture would show.
    longest_line: usize,
    label: String,
    span: Range<usize>,
    line: usize,
    text: NamedSource<String>,
}

/// The command lines of this workspace that run scenes.
const PROGRAMS: [&str; 4] = ["crystfem", "mdsurrogate", "peri", "polycore"];

/// Longer lists of what is allowed show those alone that are nearest to what was found.
const MOST_SHOWN: usize = 12;

/// Longer lines are not shown: nobody reads them.
const LONGEST_LINE: usize = 2000;

impl SceneError {
    /// Returns the whole message in one line, without the picture of the source.
    pub fn message(&self) -> &str {
        &self.0.message
    }

    /// Returns the dotted path of the key the error is about.
    pub fn key(&self) -> Option<&str> {
        self.0.key.as_deref()
    }

    /// Returns the line, counted from 1.
    pub fn line(&self) -> Option<usize> {
        self.0.place.as_ref().map(|place| place.line)
    }

    /// Returns the exit code for bad input.
    pub fn exit_code(&self) -> u8 {
        EXIT_BAD_INPUT
    }

    /// Returns the message with the lines of the source it is about, as the command lines print it: one
    /// message line, never wrapped, so that it can be searched for; in colours if standard error is a
    /// terminal.
    pub fn render(&self) -> String {
        self.render_with(std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none())
    }

    /// [`Self::render`] without colours, for messages that other programs show.
    pub fn plain(&self) -> String {
        self.render_with(false)
    }

    fn render_with(&self, colors: bool) -> String {
        let theme = if colors { GraphicalTheme::unicode() } else { GraphicalTheme::unicode_nocolor() };
        let handler = GraphicalReportHandler::new_themed(theme).with_wrap_lines(false);
        let mut text = String::new();
        if let Some(place) = self.0.place.as_ref().filter(|place| place.longest_line > LONGEST_LINE) {
            // the picture would be as wide, and the handler panics beyond 65535 columns
            let (code, name) = (self.0.code, place.text.name());
            return format!(
                "{code}\n\n  × {self}\n    [{name}:{}] (in a line too long to show)\n",
                place.line
            );
        }
        // the handler fails only if the label lies outside of the text, which `at` excludes
        if handler.render_report(&mut text, self).is_err() {
            text = format!("{self}\n");
        }
        text
    }

    pub(super) fn file(path: &Path, code: &'static str, what: String, help: Option<String>) -> Self {
        let message = format!("{}: {what}", path.display());
        Self(Box::new(ErrorContent { code, message, key: None, help, place: None }))
    }

    fn from_span(
        source: &Source,
        code: &'static str,
        key: Option<String>,
        span: Range<usize>,
        message: String,
    ) -> Self {
        let length = source.text.len();
        let start = floor_boundary(&source.text, span.start.min(length));
        let end = floor_boundary(&source.text, span.end.clamp(start, length));
        let line = 1 + source.text[..start].matches('\n').count();
        let text =
            NamedSource::new(source.path.display().to_string(), source.text.clone()).with_language("toml");
        // a picture shows the lines of the span, one before and one after
        let from = source.text[..start].rmatch_indices('\n').nth(1).map_or(0, |(at, _)| at);
        let to = source.text[end..].match_indices('\n').nth(1).map_or(length, |(at, _)| end + at);
        let longest_line = source.text[from..to].lines().map(str::len).max().unwrap_or(0);
        let place = ErrorPlace { longest_line, label: String::new(), span: start..end, line, text };
        Self(Box::new(ErrorContent { code, message, key, help: None, place: Some(place) }))
    }

    fn label(mut self, label: impl Into<String>) -> Self {
        if let Some(place) = &mut self.0.place {
            place.label = label.into();
        }
        self
    }

    fn help(mut self, help: Option<String>) -> Self {
        self.0.help = help;
        self
    }

    pub(super) fn syntax(source: &Source, error: &toml::de::Error) -> Self {
        let end = source.text.trim_end().len();
        let mut span = error.span().unwrap_or(end..end);
        let cut = span.start >= end;
        if cut {
            // a caret needs a character to stand under
            span = floor_boundary(&source.text, end.saturating_sub(1))..end;
        }
        let help = cut.then(|| "the text ends unexpectedly; is the file complete?".to_owned());
        let message = format!("not valid TOML: {}", error.message());
        Self::from_span(source, "scene::syntax", None, span, message).label("here").help(help)
    }

    pub(super) fn no_version(source: &Source, similar: Option<(String, Range<usize>)>) -> Self {
        let suggestion = similar.as_ref().map(|(name, _)| format!("; did you mean `version` by `{name}`?"));
        let message =
            format!("missing `version`; allowed: `version = {VERSION}`{}", suggestion.unwrap_or_default());
        let span = similar.map_or(0..0, |(_, span)| span);
        let help = Some(format!("begin the file with `version = {VERSION}`"));
        Self::from_span(source, "scene::version", Some("version".into()), span, message)
            .label("here")
            .help(help)
    }

    pub(super) fn bad_version(source: &Source, span: Range<usize>) -> Self {
        let found = source.text.get(span.clone()).unwrap_or_default();
        let message = format!("`version`: found {}; allowed: {VERSION}", shorten(found));
        Self::from_span(source, "scene::version", Some("version".into()), span, message).label("here")
    }

    pub(super) fn value(source: &Source, key: &str, span: Range<usize>, found: &str, allowed: &str) -> Self {
        let message = format!("`{key}`: found {found}; allowed: {allowed}");
        Self::from_span(source, "scene::value", Some(key.into()), span, message).label("here")
    }

    pub(super) fn refused(source: &Source, key: String, span: Range<usize>, what: &str) -> Self {
        let message = format!("`{key}`: {what}");
        Self::from_span(source, "scene::value", Some(key), span, message).label("found here")
    }

    pub(super) fn missing(source: &Source, key: String, span: Range<usize>, why: &str) -> Self {
        let message = format!("missing `{key}`: {why}");
        // a block that the file lacks belongs to its end
        let end = source.text.trim_end().len();
        let span = if span.is_empty() { end.saturating_sub(1)..end } else { span };
        Self::from_span(source, "scene::missing_key", Some(key), span, message).label("needed here")
    }

    pub(super) fn unexpected(source: &Source, key: String, span: Range<usize>, why: &str) -> Self {
        let message = format!("unexpected `{key}`: {why}");
        Self::from_span(source, "scene::unexpected_key", Some(key), span, message).label("remove this")
    }

    pub(super) fn conflict(source: &Source, key: String, span: Range<usize>, other: &str, why: &str) -> Self {
        let message = format!("`{key}` conflicts with `{other}`: {why}");
        Self::from_span(source, "scene::conflict", Some(key), span, message).label("here")
    }

    /// Translates serde's words for the reader of a TOML file.
    pub(super) fn from_serde(source: &Source, root: &DeTable<'_>, error: &toml::de::Error) -> Self {
        let span = error.span().unwrap_or(0..0);
        let parent = locate::path(root, &span);
        let serde = error.message();
        let quoted = quoted(serde);
        let Some((&name, allowed)) = quoted.split_first() else {
            return Self::wrong(source, parent, span, serde);
        };
        if serde.starts_with("unknown field") {
            // the span of a key; inside buffered values (untagged enums) serde only knows the table
            let above =
                parent.as_deref().map(|path| path.strip_suffix(name).unwrap_or(path).trim_end_matches('.'));
            let there = source.text.get(span.clone()).unwrap_or_default().trim_matches(['"', '\'']);
            let (path, span) = match &parent {
                // also the last part of a path in quotes
                Some(parent) if there == name || there.ends_with(&format!(".{name}")) => {
                    (parent.clone(), span)
                }
                _ => locate::key(root, above.unwrap_or(""), name).unwrap_or((name.to_owned(), span)),
            };
            let what = format!("unknown key `{name}`{}", within(&path, name));
            return Self::choice(source, "scene::unknown_key", path, span, &what, name, allowed);
        }
        if serde.starts_with("unknown variant") {
            let path = parent.unwrap_or_default();
            let what = format!("`{path}`: found `{name}`");
            let owner =
                (path == "program").then(|| PROGRAMS.iter().find(|program| **program == name)).flatten();
            let error = Self::choice(source, "scene::unknown_choice", path, span, &what, name, allowed);
            return match owner {
                Some(owner) => {
                    error.help(Some(format!("this is a scene of `{owner}`: `{owner} run` solves it")))
                }
                None => error,
            };
        }
        if serde.starts_with("missing field") {
            let path = parent.map_or_else(|| name.to_owned(), |path| format!("{path}.{name}"));
            let place = if path == name { 0..0 } else { span };
            let message = format!("missing `{path}`");
            let label = format!("`{name}` is needed here");
            return Self::from_span(source, "scene::missing_key", Some(path), place, message).label(label);
        }
        Self::wrong(source, parent, span, serde)
    }

    fn wrong(source: &Source, key: Option<String>, span: Range<usize>, serde: &str) -> Self {
        let words = translate(serde);
        match key {
            Some(key) => Self::refused(source, key, span, &words),
            None => Self::from_span(source, "scene::value", None, span, words).label("found here"),
        }
    }

    pub(super) fn unknown(
        source: &Source,
        key: String,
        span: Range<usize>,
        name: &str,
        allowed: &[&str],
    ) -> Self {
        let mut near: Vec<&str> = allowed.to_vec();
        if near.len() > MOST_SHOWN {
            near.sort_by_key(|candidate| strsim::damerau_levenshtein(name, candidate));
            near.truncate(MOST_SHOWN);
        }
        let what = format!("`{key}`: found `{name}`");
        let error = Self::choice(source, "scene::unknown_choice", key, span, &what, name, &near);
        let left = allowed.len() - near.len();
        error.help((left > 0).then(|| format!("{left} more are allowed, less like `{name}`")))
    }

    fn choice(
        source: &Source,
        code: &'static str,
        key: String,
        span: Range<usize>,
        what: &str,
        name: &str,
        allowed: &[&str],
    ) -> Self {
        let suggestion = nearest(name, allowed.iter().copied());
        let list = allowed.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
        let list = if list.is_empty() { "nothing".to_owned() } else { list };
        let hint = suggestion.map(|name| format!("; did you mean `{name}`?")).unwrap_or_default();
        let label = suggestion.map_or("not known".to_owned(), |name| format!("did you mean `{name}`?"));
        let advice = advice(name)
            .filter(|_| suggestion.is_none())
            .map(|advice| format!("; {advice}"))
            .unwrap_or_default();
        let message = format!("{what}; allowed: {list}{hint}{advice}");
        Self::from_span(source, code, Some(key), span, message).label(label)
    }
}

/// Returns the name used here for a word of other programs.
fn advice(name: &str) -> Option<&'static str> {
    let plain: String = name.to_lowercase().chars().filter(char::is_ascii_alphanumeric).collect();
    Some(match plain.as_str() {
        "arrudaboyce" => "Arruda and Boyce's law is `eight-chain` here",
        "reducedpolynomial" => "the reduced polynomial of third order is `yeoh` here",
        "prony" | "viscoelastic" => {
            "relaxation is a `[[material.solid.branch]]` of `peri`; `polycore` fits its constants"
        }
        "poissonratio" | "poissonsratio" => {
            "Poisson's ratio follows from `bulk_modulus` and the shear modulus, ν = (3K − 2G)/(6K + 2G), or \
             from the law"
        }
        _ => return None,
    })
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.message)
    }
}

impl std::error::Error for SceneError {}

impl Diagnostic for SceneError {
    fn code<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        Some(Box::new(self.0.code))
    }

    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.0.help.as_ref().map(|help| Box::new(help) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.0.place.as_ref().map(|place| &place.text as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let place = self.0.place.as_ref()?;
        let label = LabeledSpan::new_with_span(Some(place.label.clone()), place.span.clone());
        Some(Box::new(std::iter::once(label)))
    }
}

/// Returns the candidate that `name` most likely stands for.
pub(super) fn nearest<'a>(name: &str, candidates: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let lower = name.to_lowercase();
    let scored = candidates
        .map(|candidate| (strsim::damerau_levenshtein(&lower, &candidate.to_lowercase()), candidate));
    let (distance, candidate) = scored.min()?;
    let longest = name.chars().count().max(candidate.chars().count());
    (distance <= (longest / 3).max(1) && distance < longest).then_some(candidate)
}

pub(super) fn similar_file(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_str()?;
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let Ok(entries) = std::fs::read_dir(parent) else {
        return Some(format!("there is no directory {} either", parent.display()));
    };
    let mut names: Vec<String> =
        entries.take(10_000).flatten().filter_map(|entry| entry.file_name().into_string().ok()).collect();
    names.sort();
    let similar = nearest(name, names.iter().map(String::as_str))?;
    Some(format!("did you mean {}?", parent.join(similar).display()))
}

pub(super) fn scene_inside(directory: &Path) -> Option<String> {
    let case = directory.join("case.toml");
    case.is_file().then(|| format!("did you mean {}?", case.display()))
}

/// Returns the words between backticks.
fn quoted(message: &str) -> Vec<&str> {
    message.split('`').skip(1).step_by(2).collect()
}

fn within(path: &str, name: &str) -> String {
    match path.strip_suffix(name).map(|above| above.trim_end_matches('.')) {
        Some("") | None => String::new(),
        Some(above) => format!(" in `{above}`"),
    }
}

/// Rust's type names into TOML's.
fn translate(serde: &str) -> String {
    if serde.starts_with("data did not match any variant") {
        return "none of the allowed forms fits".to_owned();
    }
    let Some((found, expected)) = serde.rsplit_once(", expected ") else { return serde.to_owned() };
    let expected = match expected {
        "f64" | "f32" => "a number",
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number, not negative",
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number",
        "a sequence" => "an array",
        "a map" => "a table",
        other if other.starts_with("struct ") => "a table",
        other if other.starts_with("nonzero ") || other.starts_with("a nonzero ") => {
            "a whole number, not zero"
        }
        other => other,
    };
    let found =
        found.strip_prefix("invalid type: ").or(found.strip_prefix("invalid value: ")).unwrap_or(found);
    format!(
        "found {}; allowed: {expected}",
        found.replace("floating point", "number").replace("sequence", "array")
    )
}

fn shorten(text: &str) -> String {
    let line = text.lines().next().unwrap_or_default();
    if line.chars().count() > 40 {
        line.chars().take(40).chain("…".chars()).collect()
    } else {
        line.to_owned()
    }
}

fn floor_boundary(text: &str, mut at: usize) -> usize {
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}
