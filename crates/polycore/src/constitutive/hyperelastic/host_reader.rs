//! Materials of Ansys, LS-DYNA, FEBio and MOOSE as laws, in the forms in which [`CardProgram::card`] writes
//! them; other materials are left out with the reason.

use std::path::Path;

use super::Error;
use super::ansys_reader::ansys;
use super::any_model;
use super::deck_keywords::{card_notes, cell_number, decoded};
use super::deck_reader::{DeckMaterial, MaterialDeck};
use super::host::CardProgram;

/// Key of a law with its parameters, and the Dᵢ or the bulk modulus; or what is allowed.
pub(super) type HostLaw = Result<(&'static str, Vec<f64>, Volume), String>;

/// Volumetric constants of a material.
pub(super) enum Volume {
    /// Dᵢ of Σ (J − 1)²ⁱ/Dᵢ; D₁ = 0 is constant volume.
    Compliances(Vec<f64>),
    Bulk(f64),
    /// Poisson's ratio at rest.
    Poisson(f64),
}

/// Material as a text, before its law is known.
pub(super) struct CardMaterial<'a> {
    pub line: usize,
    pub name: String,
    pub written: &'a str,
    /// Comments since the material before.
    pub comments: Vec<&'a str>,
    pub law: HostLaw,
}

impl CardProgram {
    /// Finds the program whose files have this ending, in small letters.
    pub fn find(extension: &str) -> Option<Self> {
        Some(match extension {
            "mac" => Self::Ansys,
            "k" | "key" | "dyn" => Self::LsDyna,
            "feb" => Self::Febio,
            "i" => Self::Moose,
            _ => return None,
        })
    }

    /// Reads a file; see [`CardProgram::parse`].
    ///
    /// # Errors
    /// [`crate::Error::Io`]; as [`CardProgram::parse`].
    pub fn read(self, path: impl AsRef<Path>) -> Result<MaterialDeck, crate::Error> {
        let path = path.as_ref();
        let text = decoded(&std::fs::read(path).map_err(crate::Error::from_io("read", path))?);
        Ok(self.parse(&path.display().to_string(), &text)?)
    }

    /// Reads the materials that [`CardProgram::card`] writes. Left out are other kinds, materials with other
    /// properties than these, and numbers that are none.
    ///
    /// # Errors
    /// [`Error::Data`] if no material can be read, with the reasons.
    pub fn parse(self, name: &str, text: &str) -> Result<MaterialDeck, Error> {
        let found = match self {
            Self::Ansys => ansys(text),
            Self::LsDyna => ls_dyna(text),
            Self::Febio => febio(text),
            Self::Moose => moose(text),
        };
        let mut deck = MaterialDeck::default();
        for CardMaterial { line, name, written, comments, law } in found {
            match law.and_then(|law| material(&name, law)) {
                Ok(mut material) => {
                    material.notes.extend(card_notes(&comments, material.model.key));
                    deck.materials.push(material);
                }
                Err(allowed) => {
                    deck.left_out.push(format!("{name}: line {line}: found `{written}`; allowed: {allowed}"));
                }
            }
        }
        deck.checked(name, &format!("no material of {} in a form that this program writes", self.name()))
    }
}

/// Checks the law of a material.
fn material(name: &str, law: (&'static str, Vec<f64>, Volume)) -> Result<DeckMaterial, String> {
    let (key, parameters, volume) = law;
    let model = any_model(key).map_err(|error| error.to_string())?;
    let shear = model.law(&parameters).map_err(|error| error.to_string())?.shear_modulus();
    let mut notes = Vec::new();
    let bulk = match volume {
        Volume::Bulk(bulk) => Some(bulk),
        Volume::Poisson(ratio) => Some(2.0 / 3.0 * shear * (1.0 + ratio) / (1.0 - 2.0 * ratio)),
        Volume::Compliances(all) => {
            let more = (2..).zip(all.iter().skip(1)).filter(|(_, d)| **d != 0.0);
            let more: Vec<String> = more.map(|(i, d)| format!("d{i} = {d}")).collect();
            if !more.is_empty() {
                notes.push(format!("{} left out: K = 2/d1 is that at rest", more.join(", ")));
            }
            all.first().filter(|first| **first != 0.0).map(|first| 2.0 / first)
        }
    };
    if let Some(bulk) = bulk.filter(|bulk| !(*bulk > 0.0 && bulk.is_finite())) {
        return Err(format!("a bulk modulus above 0; {bulk} given"));
    }
    Ok(DeckMaterial { name: name.to_owned(), model, parameters, bulk, notes })
}

pub(super) fn number(cell: &str) -> Result<f64, String> {
    cell_number(cell).ok_or_else(|| format!("a finite number, not `{}`", cell.trim()))
}

/// Number of a material with the comment that names its law and table.
pub(super) fn named(id: &str, comments: &[&str]) -> String {
    match comments.iter().rfind(|comment| is_title(comment)) {
        Some(title) => format!("material {id}, {}", title.split(';').next().unwrap_or_default()),
        None => format!("material {id}"),
    }
}

/// Returns true for a comment that names a law and its table.
fn is_title(comment: &&str) -> bool {
    comment.contains(" fitted to ")
}

/// Polynomial in I₁ − 3 and I₂ − 3 of C₁₀, C₀₁, C₂₀, C₁₁, C₀₂, C₃₀, C₂₁, C₁₂, C₀₃: the law with the fewest
/// parameters.
fn polynomial(c: &[f64; 9]) -> (&'static str, Vec<f64>) {
    let only = |places: &[usize]| (0..9).all(|i| c[i] == 0.0 || places.contains(&i));
    let pick = |places: &[usize]| places.iter().map(|&i| c[i]).collect::<Vec<f64>>();
    let laws: [(&str, &[usize]); 6] = [
        ("mooney-rivlin", &[0, 1]),
        ("reduced-polynomial-2", &[0, 2]),
        ("yeoh", &[0, 2, 5]),
        ("biderman", &[0, 1, 2, 5]),
        ("polynomial-2", &[0, 1, 2, 3, 4]),
        ("polynomial-3", &[0, 1, 2, 3, 4, 5, 6, 7, 8]),
    ];
    if only(&[0]) {
        return ("neo-hookean", vec![2.0 * c[0]]);
    }
    let [.., last] = laws;
    let (key, places) = laws.into_iter().find(|(_, places)| only(places)).unwrap_or(last);
    (key, pick(places))
}

/// Polynomial of so many powers of I₁ − 3.
pub(super) fn series(c: &[f64]) -> Result<(&'static str, Vec<f64>), String> {
    let key = match c {
        [modulus] => return Ok(("neo-hookean", vec![2.0 * modulus])),
        [_, _] => "reduced-polynomial-2",
        [_, _, _] => "yeoh",
        [_, _, _, _] => "reduced-polynomial-4",
        [_, _, _, _, _] => "reduced-polynomial-5",
        [_, _, _, _, _, _] => "reduced-polynomial-6",
        _ => return Err("1 to 6 powers of I1 − 3".to_owned()),
    };
    Ok((key, c.to_vec()))
}

/// Ogden's law of terms (μ, α) of Σ 2μ/α² (Σ λ^α − 3).
pub(super) fn ogden(terms: &[[f64; 2]]) -> Result<(&'static str, Vec<f64>), String> {
    let key = match terms.len() {
        1 => "ogden-1",
        2 => "ogden-2",
        3 => "ogden-3",
        count => return Err(format!("1 to 3 terms; {count} given")),
    };
    Ok((key, terms.concat()))
}

/// `*MAT_077_H+` and `*MAT_077_O+` with constants (N = 0) and without relaxation.
fn ls_dyna(text: &str) -> Vec<CardMaterial<'_>> {
    let lines: Vec<(usize, &str)> = (1..).zip(text.lines()).collect();
    let mut found = Vec::new();
    let mut comments = Vec::new();
    for (at, &(line, written)) in lines.iter().enumerate() {
        comments.extend(written.strip_prefix('$').map(str::trim));
        let keyword = written.trim().to_uppercase();
        if !keyword.starts_with("*MAT_") {
            continue;
        }
        let own = lines[at + 1..].iter().take_while(|(_, row)| !row.starts_with('*'));
        let rows: Vec<Vec<&str>> =
            own.filter(|(_, row)| !row.starts_with('$')).map(|(_, row)| fields(row)).collect();
        let id = rows.first().and_then(|row| row.first()).map_or("", |cell| cell.trim());
        let law = ls_dyna_law(&keyword, &rows);
        let comments = std::mem::take(&mut comments);
        found.push(CardMaterial { line, name: named(id, &comments), written: written.trim(), comments, law });
    }
    found
}

/// Fields of 20 characters.
fn fields(row: &str) -> Vec<&str> {
    let bounds: Vec<usize> = row.char_indices().map(|(at, _)| at).step_by(20).chain([row.len()]).collect();
    bounds.windows(2).map(|ends| &row[ends[0]..ends[1]]).collect()
}

fn ls_dyna_law(keyword: &str, rows: &[Vec<&str>]) -> HostLaw {
    if !["*MAT_077_H+", "*MAT_077_O+"].contains(&keyword) {
        return Err("*MAT_077_H+, *MAT_077_O+, fields of 20 characters".to_owned());
    }
    let [head, constants, rest @ ..] = rows else { return Err("two rows of fields".to_owned()) };
    let numbers = |row: &[&str]| row.iter().map(|cell| number(cell)).collect::<Result<Vec<f64>, String>>();
    // after the number and the density: ν, N, NV, G, SIGF, REF
    let more = numbers(head.get(2..).unwrap_or_default())?;
    let [poisson, others @ ..] = &more[..] else { return Err("Poisson's ratio in field 3".to_owned()) };
    if others.iter().any(|other| *other != 0.0) {
        return Err("N of 0 and no relaxation behind Poisson's ratio".to_owned());
    }
    if !(*poisson > -1.0 && *poisson < 0.5) {
        return Err(format!("Poisson's ratio above −1 and below ½; {poisson} given"));
    }
    let c = numbers(constants)?;
    let (key, parameters) = match (keyword.ends_with("H+"), &c[..], rest) {
        // C10 C01 C11 C20 C02 C30
        (true, &[a, b, d, e, f, g], []) => polynomial(&[a, b, e, d, f, g, 0.0, 0.0, 0.0]),
        (false, moduli, [exponents]) => {
            let exponents = numbers(exponents)?;
            if exponents.len() != moduli.len() {
                return Err("as many μ as α".to_owned());
            }
            let terms = moduli.iter().zip(exponents).map(|(mu, alpha)| [0.5 * mu * alpha, alpha]);
            ogden(&terms.collect::<Vec<_>>())?
        }
        _ => return Err("six constants of H, or a row of μ and one of α".to_owned()),
    };
    Ok((key, parameters, Volume::Poisson(*poisson)))
}

/// `<material>` of the types `Mooney-Rivlin`, `Yeoh`, `Gent`, `Ogden` with constants alone.
fn febio(text: &str) -> Vec<CardMaterial<'_>> {
    const START: &str = "<material";
    let (plain, remarks) = without_comments(text);
    let mut found = Vec::new();
    let mut before = 0;
    for (at, _) in plain.match_indices(START) {
        if !plain[at + START.len()..].starts_with(char::is_whitespace) {
            continue;
        }
        let Some(end) = plain[at..].find('>').map(|end| at + end) else { continue };
        let head = &plain[at + START.len()..end];
        let law = match plain[end..].find("</material>") {
            Some(close) if !head.ends_with('/') => {
                let kind = attribute(head, "type").unwrap_or_default();
                febio_law(kind, &plain[end + 1..end + close])
            }
            _ => Err("an end `</material>`".to_owned()),
        };
        let line = 1 + text[..at].matches('\n').count();
        let name = attribute(head, "name").or(attribute(head, "id")).unwrap_or_default();
        let own = remarks.iter().filter(|(place, _)| (before..at).contains(place));
        let comments: Vec<&str> = own.map(|(_, remark)| *remark).collect();
        before = at;
        let name = format!("material {name}");
        found.push(CardMaterial { line, name, written: &text[at..=end], comments, law });
    }
    found
}

/// Replaces the comments of an XML text by blanks, and lists them with their places.
fn without_comments(text: &str) -> (String, Vec<(usize, &str)>) {
    let (mut plain, mut remarks) = (String::with_capacity(text.len()), Vec::new());
    let mut rest = text;
    while let Some(start) = rest.find("<!--") {
        let end = rest[start..].find("-->").map_or(rest.len(), |end| start + end + 3);
        let comment = &rest[start..end];
        plain += &rest[..start];
        remarks.push((plain.len(), comment.trim_start_matches("<!--").trim_end_matches("-->").trim()));
        plain.extend(comment.bytes().map(|byte| if byte == b'\n' { '\n' } else { ' ' }));
        rest = &rest[end..];
    }
    (plain + rest, remarks)
}

/// Value of an attribute in single or double quotes.
fn attribute<'a>(head: &'a str, key: &str) -> Option<&'a str> {
    let mut rest = head;
    loop {
        let (name, after) = rest.split_once('=')?;
        let after = after.trim_start();
        let quote = after.chars().next().filter(|quote| ['"', '\''].contains(quote))?;
        let (value, after) = after[1..].split_once(quote)?;
        if name.trim() == key {
            return Some(value);
        }
        rest = after;
    }
}

fn febio_law(kind: &str, body: &str) -> HostLaw {
    let known = ["Mooney-Rivlin", "Yeoh", "Gent", "Ogden"];
    if !known.contains(&kind) {
        return Err(format!("the types {}", known.join(", ")));
    }
    let mut constants: Vec<(&str, f64)> = Vec::new();
    let mut rest = body.trim();
    while !rest.is_empty() {
        let tag = rest.strip_prefix('<').and_then(|rest| rest.split_once('>'));
        let (tag, after) = tag.ok_or("constants in tags")?;
        let value = after.split_once(&format!("</{tag}>"));
        let (value, after) =
            value.ok_or_else(|| format!("constants in tags without attributes, not <{tag}>"))?;
        // a density is no constant of the law
        if tag != "density" {
            constants.push((tag, number(value)?));
        }
        rest = after.trim_start();
    }
    let value = |key: &str| constants.iter().find(|(tag, _)| *tag == key).map(|(_, value)| *value);
    let list = |letter: &str| -> Vec<f64> { (1..=6).map_while(|i| value(&format!("{letter}{i}"))).collect() };
    let (c, m) = (list("c"), list("m"));
    let (key, parameters) = match (kind, &c[..]) {
        ("Mooney-Rivlin", [c1, 0.0] | [c1]) => ("neo-hookean", vec![2.0 * c1]),
        ("Mooney-Rivlin", &[c1, c2]) => ("mooney-rivlin", vec![c1, c2]),
        ("Yeoh", c) => series(c)?,
        ("Gent", []) => ("gent", ["G", "Jm"].into_iter().filter_map(value).collect()),
        ("Ogden", c) if c.len() == m.len() => {
            ogden(&c.iter().zip(&m).map(|(c, m)| [0.5 * c, *m]).collect::<Vec<_>>())?
        }
        _ => return Err("c1, c2, …; of Ogden as many m; of Gent G, Jm".to_owned()),
    };
    let bulk = value("k").ok_or("the bulk modulus <k>")?;
    if constants.len() != c.len() + m.len() + 1 + if kind == "Gent" { 2 } else { 0 } {
        return Err("constants of the law and <k> alone".to_owned());
    }
    Ok((key, parameters, Volume::Bulk(bulk)))
}

/// Blocks with `type = ComputeNeoHookeanStress` of large strains, K = λ + ⅔μ.
fn moose(text: &str) -> Vec<CardMaterial<'_>> {
    const KINEMATICS: &str = "large_kinematics";
    let mut found: Vec<CardMaterial> = Vec::new();
    let (mut comments, mut block, mut title, mut global) = (Vec::new(), Vec::new(), "", None);
    for (line, written) in (1..).zip(text.lines().map(str::trim)) {
        comments.extend(written.strip_prefix('#').map(str::trim));
        if !written.starts_with('[') {
            let plain = written.split('#').next().unwrap_or_default();
            let pair = plain.split_once('=');
            block.extend(pair.map(|(key, value)| (line, written, key.trim(), unquoted(value))));
            continue;
        }
        let value = |key: &str| block.iter().find(|own| own.2 == key).map(|own| own.3);
        if title == "[GlobalParams]" {
            global = value(KINEMATICS);
        }
        if let Some(&(line, written, ..)) = block.iter().find(|own| own.2 == "type" && own.3 == MOOSE_LAW) {
            let constant = |key: &str| number(value(key).ok_or_else(|| format!("a constant `{key}`"))?);
            let law = match value(KINEMATICS).or(global) {
                Some(large) if !large.eq_ignore_ascii_case("true") => {
                    Err(format!("`{KINEMATICS} = true`, not `{large}`: without it the law is linear"))
                }
                _ => constant("lambda").and_then(|lame| {
                    let modulus = constant("mu")?;
                    Ok(("neo-hookean", vec![modulus], Volume::Bulk(lame + 2.0 / 3.0 * modulus)))
                }),
            };
            let (id, comments) = ((found.len() + 1).to_string(), std::mem::take(&mut comments));
            found.push(CardMaterial { line, name: named(&id, &comments), written, comments, law });
        }
        block.clear();
        title = written;
    }
    found
}

const MOOSE_LAW: &str = "ComputeNeoHookeanStress";

/// Value without blanks and quotes around it.
fn unquoted(value: &str) -> &str {
    value.trim().trim_matches(['"', '\'']).trim()
}

#[cfg(test)]
#[path = "host_reader_tests.rs"]
mod tests;
