//! Materials of Ansys as laws.

use super::host_reader::{CardMaterial, HostLaw, Volume, named, number, ogden, series};

/// Command of a text for Ansys.
struct AnsysCommand<'a> {
    line: usize,
    written: &'a str,
    /// Cells in capitals, without the comment.
    cells: Vec<String>,
}

impl AnsysCommand<'_> {
    fn cell(&self, i: usize) -> &str {
        self.cells.get(i).map_or("", String::as_str)
    }

    /// Returns true for a command with these first letters, of which four count.
    fn has_name(&self, name: &str) -> bool {
        self.cell(0).chars().take(4).eq(name.chars().take(4))
    }

    /// Number of the material of a `TB`.
    fn material(&self) -> &str {
        if self.cell(2).is_empty() { "1" } else { self.cell(2) }
    }
}

/// Splits a text at lines and `$`, up to `/EOF`.
fn ansys_commands(text: &str) -> Vec<AnsysCommand<'_>> {
    let lines = (1..).zip(text.lines().map(str::trim));
    let parts = lines.flat_map(|(line, written)| {
        let (own, comment) = written.split_at(written.find('!').unwrap_or(written.len()));
        own.split('$').chain((!comment.is_empty()).then_some(comment)).map(move |part| (line, part.trim()))
    });
    let commands = parts.map(|(line, written)| {
        let own = written.split('!').next().unwrap_or_default();
        let cells = own.split(',').map(|cell| cell.trim().to_uppercase()).collect();
        AnsysCommand { line, written, cells }
    });
    commands.take_while(|command| command.cell(0) != "/EOF").collect()
}

/// Constants of a `TB` from the commands behind it, up to the next `TB`.
fn ansys_constants(commands: &[AnsysCommand]) -> Result<Vec<f64>, String> {
    let mut constants = Vec::new();
    for command in commands.iter().take_while(|command| command.cell(0) != "TB") {
        for other in ["TBTEMP", "TBMODIF", "TBDELE", "TBCOPY"] {
            if command.has_name(other) {
                return Err(format!("constants of one temperature in TBDATA alone, without {other}"));
            }
        }
        if !command.has_name("TBDATA") {
            continue;
        }
        let first = command.cell(1).parse::<usize>().ok().filter(|first| *first > 0);
        let first = first.ok_or("TBDATA with the place of its first constant, from 1 on")?;
        constants.resize(constants.len().max(first - 1).min(1000), 0.0);
        for (i, cell) in command.cells.iter().skip(2).enumerate() {
            let value = number(cell)?;
            if first + i > constants.len() {
                constants.push(value);
            } else {
                constants[first + i - 1] = value;
            }
        }
    }
    Ok(constants)
}

/// `TB,HYPER` with its `TBDATA`; another `TB` of the same material than a density or thermal one leaves it
/// out, as moduli may then be instantaneous.
pub(super) fn ansys(text: &str) -> Vec<CardMaterial<'_>> {
    const APART: [&str; 6] = ["CTE", "DENS", "EFLX", "SDAMP", "SPHT", "THERM"];
    let commands = ansys_commands(text);
    let tables = || commands.iter().enumerate().filter(|(_, command)| command.cell(0) == "TB");
    let is_law = |command: &AnsysCommand| command.cell(1) == "HYPER";
    let mut found: Vec<CardMaterial> = Vec::new();
    let mut comments = Vec::new();
    for (at, command) in commands.iter().enumerate() {
        comments.extend(command.written.strip_prefix('!').map(str::trim));
        if command.cell(0) != "TB" || APART.contains(&command.cell(1)) {
            continue;
        }
        let id = command.material();
        let mut own = tables().filter(|(_, other)| other.material() == id);
        let law = match is_law(command) {
            false if own.any(|(_, other)| is_law(other)) => continue,
            false => Err("TB,HYPER alone".to_owned()),
            true => match own.find(|(i, other)| *i != at && !APART.contains(&other.cell(1))) {
                Some((_, other)) if is_law(other) => Err("one TB,HYPER of each material".to_owned()),
                Some((_, other)) => Err(format!("a material without TB,{}", other.cell(1))),
                None => ansys_constants(&commands[at + 1..])
                    .and_then(|constants| ansys_law(command.cell(5), command.cell(4), &constants)),
            },
        };
        let (line, written, comments) = (command.line, command.written, std::mem::take(&mut comments));
        found.push(CardMaterial { line, name: named(id, &comments), written, comments, law });
    }
    found
}

fn ansys_law(option: &str, points: &str, constants: &[f64]) -> HostLaw {
    let points: usize = if points.is_empty() { 1 } else { points.parse().unwrap_or(0) };
    if !(1..=9).contains(&points) {
        return Err("1 to 9 points behind the number of temperatures".to_owned());
    }
    let count = match option {
        "NEO" => 1,
        "BOYCE" | "GENT" => 2,
        "ETUBE" => 4,
        "YEOH" | "MOONEY" => points,
        "OGDEN" => 2 * points,
        "FOAM" => 3 * points,
        _ => return Err("the options NEO, MOONEY, YEOH, OGDEN, BOYCE, GENT, ETUBE, FOAM".to_owned()),
    };
    let held = match option {
        "YEOH" | "OGDEN" => points,
        "FOAM" => 0,
        _ => 1,
    };
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
        ("FOAM", c) => {
            let keys = ["hyperfoam-1", "hyperfoam-2", "hyperfoam-3"];
            let key = keys.get(points - 1).ok_or("1 to 3 terms of FOAM")?;
            let pairs = c.chunks_exact(2).zip(&c[2 * points..]);
            (*key, pairs.flat_map(|(pair, beta)| [0.5 * pair[0] * pair[1], pair[1], *beta]).collect())
        }
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
