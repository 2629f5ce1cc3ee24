//! Output files of LAMMPS: thermo output in logs, and `fix ave/time`.

use super::options::{LENGTHS, LammpsUnits, PLACES, PROPERTIES, ReadOptions, TILTS};
use crate::Error;
use std::path::Path;

/// Seconds in a femtosecond.
const FEMTOSECOND: f64 = 1e-15;

/// Kind of output file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LammpsFile {
    /// Log, or output of `thermo_style yaml`.
    Log,
    /// Output of `fix ave/time` with scalars.
    Average,
}

/// Interpretation of a file.
pub(super) struct LammpsReading {
    pub units: Option<LammpsUnits>,
    /// True if the first row of each run is undeformed, unless the scene says otherwise.
    pub first_is_undeformed: bool,
    /// Notes for the provenance.
    pub notes: Vec<String>,
}

/// Rows of one `run` command, or of one job with averages.
#[derive(Default)]
struct ThermoBlock {
    headings: Vec<String>,
    /// Line number and values of each row.
    rows: Vec<(u64, Vec<f64>)>,
}

/// Recognizes a file of LAMMPS by its text.
pub(super) fn kind(text: &[u8]) -> Option<LammpsFile> {
    let start = String::from_utf8_lossy(&text[..text.len().min(1 << 14)]);
    let mut lines = start.lines();
    let title = lines
        .clone()
        .take(3)
        .any(|line| line.starts_with('#') && line.split_whitespace().any(|w| w == "TimeStep"));
    if title {
        return Some(LammpsFile::Average);
    }
    let is_log = |line: &str| {
        line.starts_with("LAMMPS (")
            || line.starts_with("Per MPI rank memory")
            || line.starts_with("keywords: [")
            || thermo_headings(line).is_some()
    };
    lines.any(is_log).then_some(LammpsFile::Log)
}

/// Returns the headings of a thermo block, if the line has them.
fn thermo_headings(line: &str) -> Option<Vec<String>> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let other = words.get(1)?;
    // not a table with commas, and not a sentence that begins with "Step"
    let is_heading =
        words[0] == "Step" && !line.contains(',') && other.starts_with(|c: char| c.is_ascii_alphabetic());
    is_heading.then(|| words.iter().map(|word| (*word).to_owned()).collect())
}

/// Parses numbers separated by commas or spaces.
fn numbers(text: &str) -> Option<Vec<f64>> {
    let cells = text.split(|c: char| c == ',' || c.is_whitespace()).filter(|cell| !cell.is_empty());
    cells.map(|cell| cell.parse::<f64>().ok()).collect()
}

/// Returns the blocks of a log, the number of other lines inside them, and the units stated in the log.
fn blocks_of_log(text: &str) -> (Vec<ThermoBlock>, usize, Option<String>) {
    let (mut blocks, mut strange, mut units) = (Vec::<ThermoBlock>::new(), 0, None);
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
            blocks.push(ThermoBlock { headings, rows: Vec::new() });
            inside = true;
        } else if let Some(headings) = thermo_headings(trimmed) {
            blocks.push(ThermoBlock { headings, rows: Vec::new() });
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

/// Returns the blocks of a file of averages and the number of other lines; a block begins where the time step
/// restarts.
fn blocks_of_averages(path: &Path, text: &str) -> Result<(Vec<ThermoBlock>, usize), Error> {
    let (mut blocks, mut strange) = (vec![ThermoBlock::default()], 0);
    let mut headings: Vec<String> = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let Some(block) = blocks.last_mut() else { break };
        if let Some(title) = line.trim().strip_prefix('#') {
            let words: Vec<String> = title.split_whitespace().map(str::to_owned).collect();
            if words.first().is_some_and(|word| word == "TimeStep") {
                if words.get(1).is_some_and(|word| word == "Number-of-rows") {
                    return Err(Error::file(
                        path,
                        format!("`fix ave/time … mode vector` (line {})", index + 1),
                        "`mode scalar`, one line per time step",
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
                let restarts = block.rows.last().is_some_and(|(_, last)| row[0] <= last[0])
                    || block.headings != headings;
                if restarts && !block.rows.is_empty() {
                    blocks.push(ThermoBlock::default());
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

/// Source of a property in a row.
#[derive(Clone, Copy)]
enum ColumnSource {
    Column(usize),
    /// Difference of two bounds.
    Between(usize, usize),
    /// Zero, as the scene says.
    Zero,
}

/// Finds the columns of a block, by property.
fn columns(headings: &[String], options: &ReadOptions) -> Vec<(String, ColumnSource)> {
    let find = |name: &str| headings.iter().position(|heading| heading == name);
    let capital = |name: &str| name[..1].to_uppercase() + &name[1..];
    let mut found = Vec::new();
    for property in PROPERTIES {
        if options.names.get(property).is_some_and(|name| name == "0") {
            found.push((property.to_owned(), ColumnSource::Zero));
            continue;
        }
        let column = match options.names.get(property) {
            Some(name) => find(name),
            None if LENGTHS.contains(&property) || TILTS.contains(&property) => {
                find(&capital(property)).or_else(|| find(property))
            }
            None => property.strip_prefix('p').and_then(|place| {
                let number = PLACES.iter().position(|other| *other == place)? + 1;
                // `thermo_press` is the built-in compute of LAMMPS
                find(&capital(property))
                    .or_else(|| find(property))
                    .or_else(|| find(&format!("c_thermo_press[{number}]")))
            }),
        };
        let bounds = || {
            let axis = property.strip_prefix('l').filter(|_| LENGTHS.contains(&property))?.to_uppercase();
            Some(ColumnSource::Between(find(&format!("{axis}lo"))?, find(&format!("{axis}hi"))?))
        };
        if let Some(place) = column.map(ColumnSource::Column).or_else(bounds) {
            found.push((property.to_owned(), place));
        }
    }
    found
}

/// Returns the properties that a block lacks.
fn missing_properties(found: &[(String, ColumnSource)], options: &ReadOptions) -> Vec<String> {
    let has = |name: &str| found.iter().any(|(property, _)| property == name);
    let mut missing: Vec<String> = Vec::new();
    if !has("F12") {
        missing.extend(LENGTHS.iter().filter(|name| !has(name)).map(ToString::to_string));
    }
    let stress_names = |letter: &str| PLACES.map(|place| format!("{letter}{place}"));
    if !["sxx", "S11", "P11"].into_iter().any(has) {
        missing.extend(stress_names("p").into_iter().filter(|name| !has(name)));
    }
    let named = options.names.iter().filter(|(property, _)| !has(property));
    missing.extend(named.map(|(property, name)| format!("{name} ({property})")));
    missing
}

/// Number and block, and its columns by property.
type KnownBlock<'a> = (usize, &'a ThermoBlock, Vec<(String, ColumnSource)>);

/// Headings with units, rows, and the interpretation of a file.
type LammpsTable = (Vec<(String, Option<String>)>, Vec<csv::StringRecord>, LammpsReading);

/// Reads the thermo output of a log, or averages, as a table.
///
/// # Errors
/// Returns an error for files without a block of box and stress, ambiguous blocks, and unknown units.
pub(super) fn read(
    path: &Path,
    text: &[u8],
    kind: LammpsFile,
    options: &ReadOptions,
) -> Result<LammpsTable, Error> {
    let text = String::from_utf8_lossy(text);
    let (blocks, strange, stated_units) = match kind {
        LammpsFile::Log => blocks_of_log(&text),
        LammpsFile::Average => {
            let (blocks, strange) = blocks_of_averages(path, &text)?;
            (blocks, strange, None)
        }
    };
    let what = if kind == LammpsFile::Log { "a LAMMPS log" } else { "a file of `fix ave/time`" };
    if let Some(wrong) = options.blocks.iter().find(|&&number| number == 0 || number > blocks.len()) {
        return Err(Error::file(path, format!("block {wrong} of {what}"), format!("1 to {}", blocks.len())));
    }
    let chosen = |number: usize| options.blocks.is_empty() || options.blocks.contains(&number);
    let all = blocks
        .iter()
        .enumerate()
        .map(|(index, block)| (index + 1, block))
        .filter(|(number, _)| chosen(*number));
    let all: Vec<KnownBlock> =
        all.map(|(number, block)| (number, block, columns(&block.headings, options))).collect();
    let usable: Vec<_> =
        all.iter().filter(|(.., found)| missing_properties(found, options).is_empty()).collect();
    let Some((_, _, properties)) = usable.first() else {
        return Err(unusable_file(path, what, &all, options));
    };
    let units = units(path, stated_units.as_deref(), options)?;
    let triclinic = text.contains("triclinic box = ");
    if triclinic
        && kind == LammpsFile::Log
        && !properties.iter().any(|(name, _)| TILTS.contains(&name.as_str()))
    {
        let allowed = "thermo_style with xy xz yz";
        return Err(Error::file(path, "a triclinic box without columns of its tilts", allowed));
    }
    let starts_at_rest =
        kind == LammpsFile::Log || usable.iter().all(|(_, block, _)| block.rows[0].1[0] == 0.0);
    let known = options.origin.is_some() || options.reference.is_some();
    let boxed = !properties.iter().any(|(name, _)| name == "F12");
    if boxed && !known && (usable.len() > 1 || !starts_at_rest) {
        let found = match starts_at_rest {
            true => format!("{what} with {} runs and an unknown undeformed row", usable.len()),
            false => {
                format!("{what} whose first row is a mean, and an unknown undeformed box")
            }
        };
        let allowed = "in `[data]` `reference = \"run\"` (the first row of each run), `reference = \
            \"file\"` (the first row of the file, if runs continue each other) or `reference_lengths`; \
            `blocks = [2]` selects runs";
        return Err(Error::file(path, found, allowed));
    }
    let same =
        |found: &[(String, ColumnSource)]| found.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    let names = same(properties);
    if let Some((number, ..)) = usable.iter().find(|(.., found)| same(found) != names) {
        let allowed = "the same columns in all blocks, or `blocks` in `[data]`";
        return Err(Error::file(path, format!("different columns in run {number}"), allowed));
    }
    let file = polycore::file::name_of(path);
    let time = |block: &ThermoBlock| block.headings.iter().position(|name| name == "Time").zip(units);
    let timed = usable.iter().all(|(_, block, _)| time(block).is_some());
    let (mut records, mut before) = (Vec::new(), None);
    for (number, block, found) in &usable {
        // runs that continue each other are one path
        let joined = options.origin == Some(super::options::BoxReference::File) || usable.len() == 1;
        let id = if joined { file.clone() } else { format!("{file}-{number}") };
        for (line, row) in &block.rows {
            // LAMMPS repeats the last row of a run at the start of the next one
            if joined && before == Some(row) {
                continue;
            }
            before = Some(row);
            let mut record = csv::StringRecord::from(vec![id.as_str()]);
            for (_, place) in found {
                record.push_field(&match *place {
                    ColumnSource::Column(at) => format!("{:?}", row[at]),
                    ColumnSource::Between(low, high) => format!("{:?}", row[high] - row[low]),
                    ColumnSource::Zero => "0".to_owned(),
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
        notes.push("first row is undeformed".into());
    }
    if strange > 0 {
        notes.push(format!("{strange} other lines inside blocks skipped"));
    }
    Ok((headings, records, LammpsReading { units, first_is_undeformed: true, notes }))
}

fn units(path: &Path, stated: Option<&str>, options: &ReadOptions) -> Result<Option<LammpsUnits>, Error> {
    let names: Vec<&str> = LammpsUnits::ALL.iter().map(|(name, _)| *name).collect();
    let of_log = stated.and_then(|stated| LammpsUnits::ALL.iter().find(|(name, _)| *name == stated));
    match (options.units, of_log, stated) {
        (Some(units), Some((name, other)), _) if units != *other => Err(Error::file(
            path,
            format!("`units {name}`"),
            format!("`units = \"{}\"`, as in the scene", units.name()),
        )),
        (Some(units), ..) => Ok(Some(units)),
        (None, Some((_, units)), _) => Ok(Some(*units)),
        (None, None, stated) if options.stress_unit.is_none() => {
            let found = stated.map_or("unknown units".to_owned(), |stated| format!("`units {stated}`"));
            let allowed = format!("`units` in `[data]`: {} (or `stress_unit`)", names.join(", "));
            Err(Error::file(path, found, allowed))
        }
        _ => Ok(None),
    }
}

fn unusable_file(path: &Path, what: &str, all: &[KnownBlock], options: &ReadOptions) -> Error {
    let allowed = "`thermo_style custom step … lx ly lz pxx pyy pzz pxy pxz pyz`, in a tilted box also xy \
        xz yz; `names` in `[data]` for other columns, e.g. `names = { lx = \"v_lx\", pxx = \"c_p[1]\" }` \
        (`pxy = \"0\"` without shear)";
    let best = all.iter().min_by_key(|(.., found)| missing_properties(found, options).len());
    let found = match best {
        None => format!("{what} without thermo output in columns or yaml"),
        Some((number, block, found)) => format!(
            "{what} whose run {number} has the columns {}, without {}",
            block.headings.join(" "),
            missing_properties(found, options).join(", ")
        ),
    };
    Error::file(path, found, allowed)
}
