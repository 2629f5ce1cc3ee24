//! Files that LAMMPS writes itself: thermo output in logs, and `fix ave/time`.

use super::options::{LENGTHS, LammpsUnits, PLACES, PROPERTIES, ReadOptions, TILTS};
use crate::Error;
use std::path::Path;

/// Seconds in a femtosecond.
const FEMTOSECOND: f64 = 1e-15;

/// Which of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// A log, or a file of `thermo_style yaml`.
    Log,
    /// `fix ave/time` of scalars.
    Average,
}

/// How a file was understood.
pub(super) struct Origin {
    pub units: Option<LammpsUnits>,
    /// Whether the first row of each run can be taken for undeformed unless the scene says otherwise.
    pub first_is_undeformed: bool,
    /// Lines for provenance.
    pub notes: Vec<String>,
}

/// Rows of one `run`, or of one job that wrote averages.
#[derive(Default)]
struct Block {
    headings: Vec<String>,
    /// Lines and numbers.
    rows: Vec<(u64, Vec<f64>)>,
}

/// Whether LAMMPS wrote a text.
pub(super) fn kind(text: &[u8]) -> Option<Kind> {
    let start = String::from_utf8_lossy(&text[..text.len().min(1 << 14)]);
    let mut lines = start.lines();
    let title = lines
        .clone()
        .take(3)
        .any(|line| line.starts_with('#') && line.split_whitespace().any(|w| w == "TimeStep"));
    if title {
        return Some(Kind::Average);
    }
    let log = |line: &str| {
        line.starts_with("LAMMPS (")
            || line.starts_with("Per MPI rank memory")
            || line.starts_with("keywords: [")
            || thermo(line).is_some()
    };
    lines.any(log).then_some(Kind::Log)
}

/// The headings of a thermo block.
fn thermo(line: &str) -> Option<Vec<String>> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let other = words.get(1)?;
    // a table with commas, or a sentence that begins so
    let is =
        words[0] == "Step" && !line.contains(',') && other.starts_with(|c: char| c.is_ascii_alphabetic());
    is.then(|| words.iter().map(|word| (*word).to_owned()).collect())
}

/// Numbers between commas or spaces.
fn numbers(text: &str) -> Option<Vec<f64>> {
    let cells = text.split(|c: char| c == ',' || c.is_whitespace()).filter(|cell| !cell.is_empty());
    cells.map(|cell| cell.parse::<f64>().ok()).collect()
}

/// The blocks of a log, lines between rows that are none, and the units that it tells.
fn blocks_of_log(text: &str) -> (Vec<Block>, usize, Option<String>) {
    let (mut blocks, mut strange, mut units) = (Vec::<Block>::new(), 0, None);
    let mut inside = false;
    for (index, line) in text.lines().enumerate() {
        let trimmed = line.trim();
        let mut words = trimmed.split('#').next().unwrap_or_default().split_whitespace();
        if let (Some("units"), Some(name), None) = (words.next(), words.next(), words.next()) {
            units = Some(name.to_owned());
        }
        if let Some(list) = trimmed.strip_prefix("keywords: [") {
            let names =
                list.trim_end_matches(']').split(',').map(|name| name.trim().trim_matches(['\'', '"']));
            let headings = names.filter(|name| !name.is_empty()).map(str::to_owned).collect();
            blocks.push(Block { headings, rows: Vec::new() });
            inside = true;
        } else if let Some(headings) = thermo(trimmed) {
            blocks.push(Block { headings, rows: Vec::new() });
            inside = true;
        } else if trimmed.starts_with("Loop time of") || trimmed == "..." {
            inside = false;
        } else if inside && !trimmed.is_empty() && trimmed != "data:" {
            let cells = trimmed.strip_prefix("- [").map_or(trimmed, |cells| cells.trim_end_matches(']'));
            let Some(block) = blocks.last_mut() else { continue };
            match numbers(cells).filter(|row| !row.is_empty() && row.len() == block.headings.len()) {
                Some(row) => block.rows.push((index as u64 + 1, row)),
                None => strange += 1,
            }
        }
    }
    blocks.retain(|block| !block.rows.is_empty());
    (blocks, strange, units)
}

/// The blocks of a file of averages: a new one begins where the steps begin anew.
fn blocks_of_averages(path: &Path, text: &str) -> Result<(Vec<Block>, usize), Error> {
    let (mut blocks, mut strange) = (vec![Block::default()], 0);
    let mut headings: Vec<String> = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let Some(block) = blocks.last_mut() else { break };
        if let Some(title) = line.trim().strip_prefix('#') {
            let words: Vec<String> = title.split_whitespace().map(str::to_owned).collect();
            if words.first().is_some_and(|word| word == "TimeStep") {
                if words.get(1).is_some_and(|word| word == "Number-of-rows") {
                    return Err(Error::file(
                        path,
                        format!("vectors of `fix ave/time … mode vector` (line {})", index + 1),
                        "`mode scalar`: one line for each time step",
                    ));
                }
                headings = words;
            }
            continue;
        }
        if line.trim().is_empty() {
            continue;
        }
        match numbers(line).filter(|row| !row.is_empty() && row.len() == headings.len()) {
            Some(row) => {
                let anew = block.rows.last().is_some_and(|(_, last)| row[0] <= last[0])
                    || block.headings != headings;
                if anew && !block.rows.is_empty() {
                    blocks.push(Block::default());
                }
                if let Some(block) = blocks.last_mut() {
                    block.headings.clone_from(&headings);
                    block.rows.push((index as u64 + 1, row));
                }
            }
            None => strange += 1,
        }
    }
    blocks.retain(|block| !block.rows.is_empty());
    Ok((blocks, strange))
}

/// Where a property stands in a row.
#[derive(Clone, Copy)]
enum Place {
    Column(usize),
    /// The distance of two bounds.
    Between(usize, usize),
    /// 0, as the scene says.
    Zero,
}

/// The columns of a block by property.
fn columns(headings: &[String], options: &ReadOptions) -> Vec<(String, Place)> {
    let find = |name: &str| headings.iter().position(|heading| heading == name);
    let capital = |name: &str| name[..1].to_uppercase() + &name[1..];
    let mut found = Vec::new();
    for property in PROPERTIES {
        if options.names.get(property).is_some_and(|name| name == "0") {
            found.push((property.to_owned(), Place::Zero));
            continue;
        }
        let own = match options.names.get(property) {
            Some(name) => find(name),
            None if LENGTHS.contains(&property) || TILTS.contains(&property) => {
                find(&capital(property)).or_else(|| find(property))
            }
            None => property.strip_prefix('p').and_then(|place| {
                let number = PLACES.iter().position(|other| *other == place)? + 1;
                // `thermo_press` is LAMMPS' own compute
                find(&capital(property))
                    .or_else(|| find(property))
                    .or_else(|| find(&format!("c_thermo_press[{number}]")))
            }),
        };
        let bounds = || {
            let axis = property.strip_prefix('l').filter(|_| LENGTHS.contains(&property))?.to_uppercase();
            Some(Place::Between(find(&format!("{axis}lo"))?, find(&format!("{axis}hi"))?))
        };
        if let Some(place) = own.map(Place::Column).or_else(bounds) {
            found.push((property.to_owned(), place));
        }
    }
    found
}

/// What a block lacks.
fn lacking(found: &[(String, Place)], options: &ReadOptions) -> Vec<String> {
    let has = |name: &str| found.iter().any(|(property, _)| property == name);
    let mut missing: Vec<String> = Vec::new();
    if !has("F12") {
        missing.extend(LENGTHS.iter().filter(|name| !has(name)).map(ToString::to_string));
    }
    let of_stress = |letter: &str| PLACES.map(|place| format!("{letter}{place}"));
    if !["sxx", "S11", "P11"].into_iter().any(has) {
        missing.extend(of_stress("p").into_iter().filter(|name| !has(name)));
    }
    let named = options.names.iter().filter(|(property, _)| !has(property));
    missing.extend(named.map(|(property, name)| format!("{name} ({property})")));
    missing
}

/// A block with its number, and its columns by property.
type Known<'a> = (usize, &'a Block, Vec<(String, Place)>);

/// Headings with their units, rows, and how they were understood.
type Found = (Vec<(String, Option<String>)>, Vec<csv::StringRecord>, Origin);

/// Reads the thermo output of a log, or averages, as a table.
///
/// # Errors
/// No block with a box and a stress, blocks that the scene must choose from, units that nothing tells.
pub(super) fn read(path: &Path, text: &[u8], kind: Kind, options: &ReadOptions) -> Result<Found, Error> {
    let text = String::from_utf8_lossy(text);
    let (blocks, strange, told) = match kind {
        Kind::Log => blocks_of_log(&text),
        Kind::Average => {
            let (blocks, strange) = blocks_of_averages(path, &text)?;
            (blocks, strange, None)
        }
    };
    let what = if kind == Kind::Log { "a LAMMPS log" } else { "a file of `fix ave/time`" };
    if let Some(wrong) = options.blocks.iter().find(|&&number| number == 0 || number > blocks.len()) {
        return Err(Error::file(path, format!("block {wrong} of {what}"), format!("1 to {}", blocks.len())));
    }
    let chosen = |number: usize| options.blocks.is_empty() || options.blocks.contains(&number);
    let all = blocks
        .iter()
        .enumerate()
        .map(|(index, block)| (index + 1, block))
        .filter(|(number, _)| chosen(*number));
    let all: Vec<Known> =
        all.map(|(number, block)| (number, block, columns(&block.headings, options))).collect();
    let usable: Vec<_> = all.iter().filter(|(.., found)| lacking(found, options).is_empty()).collect();
    let Some((_, _, properties)) = usable.first() else {
        return Err(none_usable(path, what, &all, options));
    };
    let units = units(path, told.as_deref(), options)?;
    let triclinic = text.contains("triclinic box = ");
    if triclinic && kind == Kind::Log && !properties.iter().any(|(name, _)| TILTS.contains(&name.as_str())) {
        let allowed = "thermo_style with xy xz yz";
        return Err(Error::file(path, "a triclinic box whose tilt is not among the columns", allowed));
    }
    let starts_at_rest = kind == Kind::Log || usable.iter().all(|(_, block, _)| block.rows[0].1[0] == 0.0);
    let known = options.origin.is_some() || options.reference.is_some();
    let boxed = !properties.iter().any(|(name, _)| name == "F12");
    if boxed && !known && (usable.len() > 1 || !starts_at_rest) {
        let found = match starts_at_rest {
            true => format!("{what} with {} runs, and no word on which row is undeformed", usable.len()),
            false => {
                format!("{what} whose first row is a mean after the start, and no word on the undeformed box")
            }
        };
        let allowed = "`reference = \"run\"` (the first row of each run), `reference = \"file\"` (the first of the file: runs \
                       continue each other) or `reference_lengths` in `[data]`; `blocks = [2]` chooses runs";
        return Err(Error::file(path, found, allowed));
    }
    let same = |found: &[(String, Place)]| found.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    let names = same(properties);
    if let Some((number, ..)) = usable.iter().find(|(.., found)| same(found) != names) {
        let allowed = "one set of columns, or `blocks` in `[data]`";
        return Err(Error::file(path, format!("other columns in run {number} than before"), allowed));
    }
    let file = polycore::file::name_of(path);
    let time = |block: &Block| block.headings.iter().position(|name| name == "Time").zip(units);
    let timed = usable.iter().all(|(_, block, _)| time(block).is_some());
    let (mut records, mut before) = (Vec::new(), None);
    for (number, block, found) in &usable {
        // runs that continue each other are one path
        let joined = options.origin == Some(super::options::Origin::File) || usable.len() == 1;
        let id = if joined { file.clone() } else { format!("{file}-{number}") };
        for (line, row) in &block.rows {
            // LAMMPS prints the last row of a run again at the start of the next
            if joined && before == Some(row) {
                continue;
            }
            before = Some(row);
            let mut record = csv::StringRecord::from(vec![id.as_str()]);
            for (_, place) in found {
                record.push_field(&match *place {
                    Place::Column(at) => format!("{:?}", row[at]),
                    Place::Between(low, high) => format!("{:?}", row[high] - row[low]),
                    Place::Zero => "0".to_owned(),
                });
            }
            if let Some((at, units)) = time(block).filter(|_| timed) {
                record.push_field(&format!("{:?}", row[at] * units.sizes()[1] / FEMTOSECOND));
            }
            let mut position = csv::Position::new();
            position.set_line(*line);
            record.set_position(Some(position));
            records.push(record);
        }
    }
    let mut headings = vec![("run_id".to_owned(), None)];
    headings.extend(names.into_iter().map(|name| (name, None)));
    if timed {
        headings.push(("time_fs".to_owned(), None));
    }
    let mut notes = vec![format!("{what}, {} of {} blocks", usable.len(), blocks.len())];
    if let Some(units) = units {
        notes.push(format!("units {}", units.name()));
    }
    if boxed && !known {
        notes.push("its first row is undeformed".into());
    }
    if strange > 0 {
        notes.push(format!("{strange} lines within blocks that are no row left out"));
    }
    Ok((headings, records, Origin { units, first_is_undeformed: true, notes }))
}

fn units(path: &Path, told: Option<&str>, options: &ReadOptions) -> Result<Option<LammpsUnits>, Error> {
    let names: Vec<&str> = LammpsUnits::ALL.iter().map(|(name, _)| *name).collect();
    let of_log = told.and_then(|told| LammpsUnits::ALL.iter().find(|(name, _)| *name == told));
    match (options.units, of_log, told) {
        (Some(units), Some((name, other)), _) if units != *other => Err(Error::file(
            path,
            format!("`units {name}`"),
            format!("`units = \"{}\"`, as the scene says", units.name()),
        )),
        (Some(units), ..) => Ok(Some(units)),
        (None, Some((_, units)), _) => Ok(Some(*units)),
        (None, None, told) if options.stress_unit.is_none() => {
            let found = told.map_or("no word on its units".to_owned(), |told| format!("`units {told}`"));
            let allowed = format!("`units` in `[data]`: {} (or `stress_unit`)", names.join(", "));
            Err(Error::file(path, found, allowed))
        }
        _ => Ok(None),
    }
}

fn none_usable(path: &Path, what: &str, all: &[Known], options: &ReadOptions) -> Error {
    let allowed = "`thermo_style custom step … lx ly lz pxx pyy pzz pxy pxz pyz`, in a tilted box xy xz yz, too; columns of your \
                   own by `names` in `[data]`, as `names = { lx = \"v_lx\", pxx = \"c_p[1]\" }` (`pxy = \"0\"` where there is no shear)";
    let best = all.iter().min_by_key(|(.., found)| lacking(found, options).len());
    let found = match best {
        None => format!("{what} without thermo output in columns or yaml"),
        Some((number, block, found)) => format!(
            "{what} whose run {number} has the columns {}: without {}",
            block.headings.join(" "),
            lacking(found, options).join(", ")
        ),
    };
    Error::file(path, found, allowed)
}
