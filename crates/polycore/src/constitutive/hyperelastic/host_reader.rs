//! Materials of Ansys, LS-DYNA, FEBio and MOOSE as laws, in the forms in which [`CardProgram::card`] writes
//! them; other materials are left out with the reason.

use super::Error;
use super::any_model;
use super::deck_reader::{DeckMaterial, MaterialDeck};
use super::host::CardProgram;

/// Key of a law with its parameters, and the Dᵢ or the bulk modulus; or what is allowed.
type HostLaw = Result<(&'static str, Vec<f64>, Volume), String>;

/// Volumetric constants of a material.
enum Volume {
    /// Dᵢ of Σ (J − 1)²ⁱ/Dᵢ; D₁ = 0 is constant volume.
    Compliances(Vec<f64>),
    Bulk(f64),
    /// Poisson's ratio at rest.
    Poisson(f64),
}

/// Material as a text, before its law is known.
struct CardMaterial<'a> {
    line: usize,
    name: String,
    written: &'a str,
    law: HostLaw,
}

impl CardProgram {
    /// Finds the program whose files have this ending, in small letters.
    pub fn find(extension: &str) -> Option<Self> {
        Some(match extension {
            "mac" => Self::Ansys,
            "k" => Self::LsDyna,
            "feb" => Self::Febio,
            "i" => Self::Moose,
            _ => return None,
        })
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
        for CardMaterial { line, name, written, law } in found {
            match law.and_then(|law| material(&name, law)) {
                Ok(material) => deck.materials.push(material),
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

fn number(cell: &str) -> Result<f64, String> {
    let cell = cell.trim();
    let found = if cell.is_empty() { Ok(0.0) } else { cell.parse::<f64>() };
    found.ok().filter(|found| found.is_finite()).ok_or_else(|| format!("a finite number, not `{cell}`"))
}

/// Number of a material with the comment that names its law and table.
fn named(id: &str, comment: &str) -> String {
    match is_title(&comment) {
        true => format!("material {id}, {}", comment.split(';').next().unwrap_or_default()),
        false => format!("material {id}"),
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
fn series(c: &[f64]) -> Result<(&'static str, Vec<f64>), String> {
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
fn ogden(terms: &[[f64; 2]]) -> Result<(&'static str, Vec<f64>), String> {
    let key = match terms.len() {
        1 => "ogden-1",
        2 => "ogden-2",
        3 => "ogden-3",
        count => return Err(format!("1 to 3 terms; {count} given")),
    };
    Ok((key, terms.concat()))
}

/// `TB,HYPER` with its `TBDATA`; another `TB` of the same material than a density or thermal one leaves it
/// out, as moduli may then be instantaneous.
fn ansys(text: &str) -> Vec<CardMaterial<'_>> {
    const APART: [&str; 6] = ["CTE", "DENS", "EFLX", "SDAMP", "SPHT", "THERM"];
    let cells = |line: &str| -> Vec<String> {
        let line = line.split('!').next().unwrap_or_default();
        line.split(',').map(|cell| cell.trim().to_uppercase()).collect()
    };
    let lines: Vec<(usize, &str)> = (1..).zip(text.lines().map(str::trim)).collect();
    let mut found = Vec::new();
    let mut comment = "";
    for (at, &(line, written)) in lines.iter().enumerate() {
        comment = written.strip_prefix('!').map(str::trim).filter(is_title).unwrap_or(comment);
        let head = cells(written);
        let cell = |i: usize| head.get(i).map_or("", String::as_str);
        if cell(0) != "TB" || cell(1) != "HYPER" {
            continue;
        }
        let id = cell(2);
        let other = lines.iter().map(|(_, line)| cells(line)).find(|cells| {
            let one = |i: usize| cells.get(i).map_or("", String::as_str);
            one(0) == "TB" && one(1) != "HYPER" && one(2) == id && !APART.contains(&one(1))
        });
        let data = || -> Result<Vec<f64>, String> {
            let mut constants = Vec::new();
            for &(_, row) in &lines[at + 1..] {
                let row = cells(row);
                match row[0].as_str() {
                    "TBDATA" => {}
                    "" if row.len() == 1 => continue,
                    "TBTEMP" => return Err("constants of one temperature, without TBTEMP".to_owned()),
                    _ => break,
                }
                let first = row.get(1).and_then(|cell| cell.parse::<usize>().ok()).filter(|first| *first > 0);
                let first = first.ok_or("TBDATA with the place of its first constant, from 1 on")?;
                constants.resize(constants.len().max(first - 1).min(1000), 0.0);
                for (i, cell) in row[2..].iter().enumerate() {
                    let value = number(cell)?;
                    if first + i > constants.len() {
                        constants.push(value);
                    } else {
                        constants[first + i - 1] = value;
                    }
                }
            }
            Ok(constants)
        };
        let law = match other {
            Some(other) => Err(format!("a material without TB,{}", other[1])),
            None => data().and_then(|constants| ansys_law(cell(5), cell(4), &constants)),
        };
        found.push(CardMaterial { line, name: named(id, comment), written, law });
        comment = "";
    }
    found
}

fn ansys_law(option: &str, points: &str, constants: &[f64]) -> HostLaw {
    let points: usize = points.parse().unwrap_or(1);
    let count = match option {
        "NEO" => 1,
        "BOYCE" | "GENT" => 2,
        "ETUBE" => 4,
        "YEOH" | "MOONEY" => points,
        "OGDEN" => 2 * points,
        _ => return Err("the options NEO, MOONEY, YEOH, OGDEN, BOYCE, GENT, ETUBE".to_owned()),
    };
    let held = if ["YEOH", "OGDEN"].contains(&option) { points } else { 1 };
    if constants.len() > count.saturating_add(held) {
        return Err(format!("{count} constants and {held} d; {} given", constants.len()));
    }
    let at = |i: usize| constants.get(i).copied().unwrap_or(0.0);
    let c: Vec<f64> = (0..count).map(at).collect();
    let (key, parameters) = match (option, &c[..]) {
        ("NEO", _) => ("neo-hookean", c),
        ("BOYCE", _) => ("arruda-boyce", c),
        ("GENT", _) => ("gent", c),
        ("ETUBE", _) => ("extended-tube", c),
        ("YEOH", c) => series(c)?,
        ("OGDEN", c) => {
            let term = |term: &[f64]| [0.5 * term[0] * term[1], term[1]];
            ogden(&c.chunks_exact(2).map(term).collect::<Vec<_>>())?
        }
        (_, &[a, b]) => ("mooney-rivlin", vec![a, b]),
        (_, &[a, b, d]) => ("polynomial-2", vec![a, b, 0.0, d, 0.0]),
        (_, [_, _, _, _, _]) => ("polynomial-2", c),
        (_, &[a, b, d, e, f, g, h, i, j]) => match [e, f, h, i, j] == [0.0; 5] {
            true => ("biderman", vec![a, b, d, g]),
            false => ("polynomial-3", c),
        },
        _ => return Err("MOONEY of 2, 3, 5 or 9 constants".to_owned()),
    };
    Ok((key, parameters, Volume::Compliances((count..count + held).map(at).collect())))
}

/// `*MAT_077_H+` and `*MAT_077_O+` with constants (N = 0) and without relaxation.
fn ls_dyna(text: &str) -> Vec<CardMaterial<'_>> {
    let lines: Vec<(usize, &str)> = (1..).zip(text.lines()).collect();
    let mut found = Vec::new();
    let mut comment = "";
    for (at, &(line, written)) in lines.iter().enumerate() {
        comment = written.strip_prefix('$').map(str::trim).filter(is_title).unwrap_or(comment);
        let keyword = written.trim().to_uppercase();
        if !keyword.starts_with("*MAT_") {
            continue;
        }
        let own = lines[at + 1..].iter().take_while(|(_, row)| !row.starts_with('*'));
        let rows: Vec<Vec<&str>> =
            own.filter(|(_, row)| !row.starts_with('$')).map(|(_, row)| fields(row)).collect();
        let id = rows.first().and_then(|row| row.first()).map_or("", |cell| cell.trim());
        let law = ls_dyna_law(&keyword, &rows);
        found.push(CardMaterial { line, name: named(id, comment), written: written.trim(), law });
        comment = "";
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
    let mut found = Vec::new();
    for (at, _) in text.match_indices("<material ") {
        let Some(end) = text[at..].find('>') else { continue };
        let head = &text[at..=at + end];
        let attribute = |key: &str| head.split(&format!(" {key}=\"")).nth(1)?.split('"').next();
        let law = match text[at..].find("</material>") {
            Some(close) => febio_law(attribute("type").unwrap_or_default(), &text[at + end + 1..at + close]),
            None => Err("an end `</material>`".to_owned()),
        };
        let line = 1 + text[..at].matches('\n').count();
        let name = attribute("name").or(attribute("id")).unwrap_or_default();
        found.push(CardMaterial { line, name: format!("material {name}"), written: head, law });
    }
    found
}

fn febio_law(kind: &str, body: &str) -> HostLaw {
    let known = ["Mooney-Rivlin", "Yeoh", "Gent", "Ogden"];
    if !known.contains(&kind) {
        return Err(format!("the types {}", known.join(", ")));
    }
    let mut constants: Vec<(&str, f64)> = Vec::new();
    let mut rest = body.trim();
    while !rest.is_empty() {
        if let Some((_, after)) = rest.strip_prefix("<!--").and_then(|rest| rest.split_once("-->")) {
            rest = after.trim_start();
            continue;
        }
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

/// Blocks with `type = ComputeNeoHookeanStress`, K = λ + ⅔μ.
fn moose(text: &str) -> Vec<CardMaterial<'_>> {
    let mut found: Vec<CardMaterial> = Vec::new();
    let (mut comment, mut block) = ("", Vec::new());
    for (line, written) in (1..).zip(text.lines().map(str::trim)) {
        comment = written.strip_prefix('#').map(str::trim).filter(is_title).unwrap_or(comment);
        if !written.starts_with('[') {
            block.push((line, written));
            continue;
        }
        let value = |key: &str| {
            let pairs = block.iter().filter_map(|(_, row): &(usize, &str)| row.split_once('='));
            let mut same = pairs.filter(|(found, _)| found.trim() == key);
            same.next().map(|(_, value)| value.split('#').next().unwrap_or_default().trim().to_owned())
        };
        let is_law = |(_, row): &&(usize, &str)| {
            row.split_once('=')
                .is_some_and(|(key, value)| key.trim() == "type" && value.trim() == "ComputeNeoHookeanStress")
        };
        if let Some(&(line, written)) = block.iter().find(is_law) {
            let constant = |key: &str| number(&value(key).ok_or_else(|| format!("a constant `{key}`"))?);
            let law =
                constant("lambda").and_then(|lame| Ok([lame, constant("mu")?])).map(|[lame, modulus]| {
                    ("neo-hookean", vec![modulus], Volume::Bulk(lame + 2.0 / 3.0 * modulus))
                });
            let id = (found.len() + 1).to_string();
            found.push(CardMaterial { line, name: named(&id, comment), written, law });
            comment = "";
        }
        block.clear();
    }
    found
}

#[cfg(test)]
#[path = "host_reader_tests.rs"]
mod tests;
