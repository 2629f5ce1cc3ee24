//! Conversion between key paths and places in the text.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue};

type Key<'i> = Spanned<DeString<'i>>;
type TreeValue<'i> = Spanned<DeValue<'i>>;

/// Returns the span of the value at `path` (`a.b[2].c`), or of its nearest existing parent other than the
/// root.
pub(super) fn span(root: &DeTable<'_>, path: &str) -> Option<Range<usize>> {
    let mut found = None;
    walk(root, path, &mut |value| found = Some(value.span()));
    found
}

/// Returns the value at `path`.
pub(super) fn value<'t, 'i>(root: &'t DeTable<'i>, path: &str) -> Option<&'t TreeValue<'i>> {
    let mut last = None;
    walk(root, path, &mut |value| last = Some(value)).then_some(last).flatten()
}

/// Visits what lies on the way to `path`; whether its end exists. A key may itself be a path, in quotes.
fn walk<'t, 'i>(table: &'t DeTable<'i>, path: &str, visit: &mut impl FnMut(&'t TreeValue<'i>)) -> bool {
    let mut ends: Vec<usize> = path.match_indices('.').map(|(at, _)| at).collect();
    ends.push(path.len());
    // the longest name first
    for end in ends.into_iter().rev() {
        let (part, rest) = (&path[..end], path[end..].strip_prefix('.'));
        // a quoted key may have brackets in it
        let name = if table.contains_key(part) { part } else { without_indices(part) };
        let (Some(mut value), indices) = (table.get(name), &part[name.len()..]) else { continue };
        visit(value);
        for index in indices.split(['[', ']']).filter(|index| !index.is_empty()) {
            let element = value.get_ref().as_array().zip(index.parse::<usize>().ok());
            let Some(next) = element.and_then(|(array, index)| array.get(index)) else { return false };
            value = next;
            visit(value);
        }
        return match (rest, value.get_ref().as_table()) {
            (None, _) => true,
            (Some(rest), Some(table)) => walk(table, rest, visit),
            (Some(_), None) => false,
        };
    }
    false
}

/// `a[1][2]` → `a`.
fn without_indices(part: &str) -> &str {
    match part.strip_suffix(']').and_then(|rest| rest.rfind('[')) {
        Some(at) => without_indices(&part[..at]),
        None => part,
    }
}

/// Returns the path of the innermost key or value around `place`.
pub(super) fn path(root: &DeTable<'_>, place: &Range<usize>) -> Option<String> {
    // what is missing from the file as a whole has no place, not the first key's
    if place.is_empty() {
        return None;
    }
    let mut found = None;
    visit(root, "", &mut |path, key, value| {
        let covers = |span: Range<usize>| span.start <= place.start && place.end <= span.end;
        // children come after their parents
        if covers(value.span()) || key.is_some_and(|key| covers(key.span())) {
            found = Some(path.to_owned());
        }
    });
    found
}

/// Returns the span of a key called `name`, preferably directly in the table at `parent`.
pub(super) fn key(root: &DeTable<'_>, parent: &str, name: &str) -> Option<(String, Range<usize>)> {
    let mut found: Option<(String, Range<usize>)> = None;
    visit(root, "", &mut |path, key, _| {
        if let Some(key) = key.filter(|key| key.get_ref() == name) {
            let direct = path.strip_suffix(name).is_some_and(|above| above.trim_end_matches('.') == parent);
            if found.is_none() || direct {
                found = Some((path.to_owned(), key.span()));
            }
        }
    });
    found
}

fn visit<'t, 'i>(
    table: &'t DeTable<'i>,
    above: &str,
    each: &mut impl FnMut(&str, Option<&'t Key<'i>>, &'t TreeValue<'i>),
) {
    for (key, value) in table {
        let name = key.get_ref();
        let path = if above.is_empty() { name.to_string() } else { format!("{above}.{name}") };
        each(&path, Some(key), value);
        inside(value, &path, each);
    }
}

fn inside<'t, 'i>(
    value: &'t TreeValue<'i>,
    path: &str,
    each: &mut impl FnMut(&str, Option<&'t Key<'i>>, &'t TreeValue<'i>),
) {
    match value.get_ref() {
        DeValue::Table(table) => visit(table, path, each),
        DeValue::Array(array) => {
            for (index, element) in array.iter().enumerate() {
                let path = format!("{path}[{index}]");
                each(&path, None, element);
                inside(element, &path, each);
            }
        }
        _ => {}
    }
}
