//! Parts of a scene that stand in for others: how a study changes the scene it belongs to.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue};

use super::{SWEEP, SceneError, Source, locate};

/// Replacement of a part of the scene by another part.
#[derive(Clone, Debug)]
pub(super) enum Overlay {
    /// The value written at `by` stands at `key`.
    Replace { key: String, by: String },
    /// Each entry `PATH = VALUE` of the table at `by` stands at its path; tables are merged, all else is
    /// replaced.
    Merge { by: String },
}

impl Source {
    /// Returns the same scene where the value of `key` is the one written at `by`: [`Source::parse`] finds it
    /// there, and errors about the first point at the second. Of several that concern a key the first holds.
    #[must_use]
    pub fn with_replaced(&self, key: &str, by: &str) -> Self {
        let mut source = self.clone();
        source.overlays.push(Overlay::Replace { key: key.to_owned(), by: by.to_owned() });
        source
    }

    /// Returns the same scene as [`Source::with_replaced`], before all other replacements of this key.
    #[must_use]
    pub fn with_replaced_first(&self, key: &str, by: &str) -> Self {
        let mut source = self.clone();
        source.overlays.insert(0, Overlay::Replace { key: key.to_owned(), by: by.to_owned() });
        source
    }

    /// Returns the same scene with the table at `by` over it. Its keys are paths (`"boundary[1].film"`, or
    /// nested tables); tables are merged, all else is replaced, and what is not there yet is added.
    #[must_use]
    pub fn with_merged(&self, by: &str) -> Self {
        let mut source = self.clone();
        source.overlays.push(Overlay::Merge { by: by.to_owned() });
        source
    }

    /// Puts the changes into a parsed scene.
    pub(super) fn overlay(&self, root: &mut DeTable<'_>) -> Result<(), SceneError> {
        let sweep = root.get(SWEEP).map(Spanned::get_ref);
        let keys = sweep.into_iter().filter_map(DeValue::as_table).flat_map(DeTable::keys);
        if let Some(unknown) =
            keys.map(|key| key.get_ref()).find(|key| !["quick", "set"].contains(&key.as_ref()))
        {
            return Err(self.unknown(SWEEP, unknown, &["quick", "set"]));
        }
        let sweep = sweep.is_some().then(|| Overlay::Merge { by: format!("{SWEEP}.set") });
        // the first holds: it comes last
        for overlay in sweep.iter().chain(&self.overlays).rev() {
            match overlay {
                Overlay::Replace { key, by } => {
                    let Some(value) = locate::value(root, by).cloned() else { continue };
                    let place = value.span();
                    put(root, key, value, &place, false).map_err(|wrong| wrong.at(self, by, place))?;
                }
                Overlay::Merge { by } => {
                    let Some(DeValue::Table(table)) = locate::value(root, by).map(Spanned::get_ref) else {
                        continue;
                    };
                    for (key, value) in table.clone() {
                        let (path, place) = (key.get_ref().to_string(), key.span());
                        put(root, &path, value, &place, true)
                            .map_err(|wrong| wrong.at(self, &format!("{by}.{path}"), place))?;
                    }
                }
            }
        }
        root.remove(SWEEP);
        Ok(())
    }

    /// Returns the key in the text that holds what stands at `key`.
    pub(super) fn origin(&self, root: &DeTable<'_>, key: &str) -> Option<String> {
        let sweep = Overlay::Merge { by: format!("{SWEEP}.set") };
        std::iter::once(&sweep).chain(&self.overlays).find_map(|overlay| match overlay {
            Overlay::Replace { key: old, by } => {
                let rest =
                    key.strip_prefix(old.as_str()).filter(|r| r.is_empty() || r.starts_with(['.', '[']))?;
                Some(format!("{by}{rest}"))
            }
            Overlay::Merge { by } => {
                let path = format!("{by}.{key}");
                locate::value(root, &path).map(|_| path)
            }
        })
    }
}

/// Why a value cannot stand where it should.
struct Wrong {
    found: String,
    allowed: String,
}

impl Wrong {
    fn at(self, source: &Source, key: &str, place: Range<usize>) -> SceneError {
        SceneError::value(source, key, place, &self.found, &self.allowed)
    }
}

/// Puts a value at a path (`a.b[2].c`), with the tables above it where they are missing.
fn put<'i>(
    table: &mut DeTable<'i>,
    path: &str,
    value: Spanned<DeValue<'i>>,
    place: &Range<usize>,
    merge: bool,
) -> Result<(), Wrong> {
    let (part, rest) = path.split_once('.').map_or((path, None), |(part, rest)| (part, Some(rest)));
    let (name, indices) = part.find('[').map_or((part, ""), |at| part.split_at(at));
    let key = || Spanned::new(place.clone(), DeString::Owned(name.to_owned()));
    let numbers: Option<Vec<usize>> =
        indices.split_terminator(']').map(|index| index.strip_prefix('[')?.parse().ok()).collect();
    let Some(numbers) = numbers.filter(|_| !name.is_empty()) else {
        let allowed = "names with dots between them, `[0]` and so on after the name of an array".into();
        return Err(Wrong { found: format!("`{part}`"), allowed });
    };
    if numbers.is_empty() && rest.is_none() {
        match (table.get_mut(name), merge) {
            (Some(old), true) => over(old, value),
            _ => {
                table.insert(key(), value);
            }
        }
        return Ok(());
    }
    if numbers.is_empty() && !table.contains_key(name) {
        table.insert(key(), Spanned::new(place.clone(), DeValue::Table(DeTable::new())));
    }
    let missing = |what: String| Wrong { found: format!("`{part}`"), allowed: what };
    let Some(mut slot) = table.get_mut(name) else {
        return Err(missing(format!("an existing array: there is no `{name}`")));
    };
    for index in numbers {
        let count = slot.get_ref().as_array().map(|array| array.len());
        let element = match slot.get_mut() {
            DeValue::Array(array) => array.get_mut(index),
            _ => None,
        };
        slot = element.ok_or_else(|| {
            missing(match count {
                Some(count) => format!("`{name}` has {count} elements, counted from 0"),
                None => format!("`{name}` is not an array"),
            })
        })?;
    }
    match (rest, slot.get_mut()) {
        (None, _) => {
            if merge {
                over(slot, value);
            } else {
                *slot = value;
            }
            Ok(())
        }
        (Some(rest), DeValue::Table(inner)) => put(inner, rest, value, place, merge),
        (Some(_), _) => Err(missing(format!("a table: `{part}` is none"))),
    }
}

/// Lays a value over another: tables are merged, all else is replaced.
fn over<'i>(old: &mut Spanned<DeValue<'i>>, new: Spanned<DeValue<'i>>) {
    if !(old.get_ref().is_table() && new.get_ref().is_table()) {
        *old = new;
        return;
    }
    if let (DeValue::Table(into), DeValue::Table(table)) = (old.get_mut(), new.into_inner()) {
        for (key, value) in table {
            match into.get_mut(key.get_ref().as_ref()) {
                Some(slot) => over(slot, value),
                None => {
                    into.insert(key, value);
                }
            }
        }
    }
}
