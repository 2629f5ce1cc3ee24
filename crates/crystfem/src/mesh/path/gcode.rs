//! Reader of G-code.

use std::collections::BTreeMap;
use std::path::Path;

use super::comments::Comments;
use super::limits::Limits;
use super::line::{self, GcodeCommand, Words};
use super::printer::{MoveAttributes, Printer};
use super::{Command, Setting, ToolPath, error, list_counts};
use crate::error::Error;

/// 0 °C, K.
pub(super) const CELSIUS: f64 = 273.15;
/// Largest tool number: firmwares use larger ones for other purposes.
const MAX_TOOLS: f64 = 63.0;

/// Reads a G-code file for Marlin, Klipper or RepRapFirmware: G0 and G1 with X, Y, Z, E, F, also without the
/// command in a line of words alone; arcs G2 and G3 in the XY plane with I and J or R, as chords within 0.01
/// mm of the arc; G4 (dwell), G20 and G21 (inch, mm), G28 (home), G90 and G91, M82 and M83 (absolute,
/// relative; after M82 or M83, G90 and G91 do not affect E), G92 (set position), M200 (E is a volume), tools
/// (T), M104 and M109 of the selected tool or that of T, G10 with P and S likewise, M140 and M190
/// (temperatures; the waiting time is unknown), M106 and M107 of the part fan; machine limits (M201 to M205,
/// M566, SET_VELOCITY_LIMIT), which [`ToolPath::with_stated_limits`] applies; SAVE_GCODE_STATE and
/// RESTORE_GCODE_STATE; features, heights and layers in comments. A move deposits material if E increases
/// along it and it moves horizontally. Velocity is F all along a move. Other commands are skipped and counted
/// in a note.
///
/// # Errors
/// [`Error::Shared`] if the file cannot be read; [`Error::File`] with the line for binary files and archives,
/// words of moves that are not numbers, a move before any F, an F that is not positive, arcs without a valid
/// centre or radius, other curves (G5), other planes (G18, G19), and temperatures below absolute zero.
pub fn read_gcode(path: &Path) -> Result<ToolPath, Error> {
    parse(path, &crate::file::read_bytes(path)?)
}

/// Reads G-code from bytes; `path` is for messages only.
///
/// # Errors
/// Errors of [`read_gcode`].
pub fn parse(path: &Path, bytes: &[u8]) -> Result<ToolPath, Error> {
    let bytes = text_of(path, bytes)?;
    let end = if bytes.contains(&b'\n') { b'\n' } else { b'\r' };
    let lines = || (1..).zip(bytes.split(|byte| *byte == end));
    let mut limits = Limits::default();
    let mut first = Comments::new(false);
    for (_, text) in lines().filter(|(_, text)| text.contains(&b';')) {
        let text = String::from_utf8_lossy(text);
        if let (_, Some(comment)) = line::split(text.trim_end()) {
            first.read(comment, &mut limits);
        }
    }
    if first.limits_ignored {
        limits = Limits::default();
    }
    let mut reader = GcodeReader::new(path, first, limits);
    for (line, text) in lines() {
        reader.line(line, &String::from_utf8_lossy(text))?;
    }
    reader.finish()
}

/// Returns the text without a byte order mark.
fn text_of<'a>(path: &Path, bytes: &'a [u8]) -> Result<&'a [u8], Error> {
    let refused = |found: &str, allowed: &str| Err(error(path, 1, "file", found, allowed));
    let start = &bytes[..bytes.len().min(512)];
    match start {
        [b'G', b'C', b'D', b'E', ..] => {
            refused("binary G-code", "text: export it from the slicer as text (binary G-code off)")
        }
        [b'P', b'K', 3, 4, ..] => {
            refused("an archive", "the G-code file in it (Bambu: Metadata/plate_1.gcode)")
        }
        [0x1f, 0x8b, ..] => refused("a compressed file", "the G-code file in it"),
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => refused("UTF-16", "text in UTF-8 or ASCII"),
        [0xef, 0xbb, 0xbf, ..] => Ok(&bytes[3..]),
        _ => Ok(bytes),
    }
}

/// State of the reader.
struct GcodeReader<'a> {
    path: &'a Path,
    printer: Printer,
    remarks: Comments,
    tool_path: ToolPath,
    limits: Limits,
    /// Counts of skipped commands.
    skipped: BTreeMap<String, usize>,
    /// Temperatures of tools that have been set.
    hot: BTreeMap<u16, f64>,
    /// Last motion command, G0 to G3.
    motion: Option<f64>,
    /// Number of lines that repeat it.
    repeated: usize,
    /// True while the machine stands.
    stopped: bool,
    /// Factors of flow or velocity other than 100 %.
    factors: Vec<String>,
    /// Duration of a filament change, s.
    change: f64,
}

impl<'a> GcodeReader<'a> {
    fn new(path: &'a Path, first: Comments, limits: Limits) -> Self {
        let mut remarks = Comments::new(first.layers > 0);
        let mut first_volume = None;
        (remarks.estimate, remarks.filaments) = (first.estimate, first.filaments);
        (remarks.bambu, remarks.per_minute) = (first.bambu, first.per_minute);
        remarks.volumetric = first.volumetric;
        let mut printer = Printer::new();
        if remarks.volumetric {
            let diameter = remarks.filaments.first().copied().unwrap_or(super::FILAMENT);
            printer.volumetric = (0..=MAX_TOOLS as u16).map(|tool| (tool, diameter)).collect();
            first_volume = Some(diameter);
        }
        Self {
            path,
            printer,
            remarks,
            tool_path: ToolPath { limits: vec![limits], filament: first_volume, ..ToolPath::default() },
            limits,
            skipped: BTreeMap::new(),
            hot: BTreeMap::new(),
            motion: None,
            repeated: 0,
            stopped: false,
            factors: Vec::new(),
            change: first.change,
        }
    }

    fn line(&mut self, line: usize, text: &str) -> Result<(), Error> {
        let (code, comment) = line::split(text.trim_end());
        for command in line::commands(&code) {
            match command {
                GcodeCommand::Code(letter, number, words) => {
                    self.code(line, &code, letter, number, &words)?
                }
                GcodeCommand::Again(words) => match self.motion {
                    Some(motion) => {
                        self.repeated += 1;
                        self.run_command(line, &code, motion, &words)?;
                    }
                    None if words.wrong.is_some() => return Err(self.wrong(line, &words)),
                    None => self.skip("words without a command"),
                },
                GcodeCommand::Named(name, rest) => self.named(name, rest),
            }
        }
        if let Some(comment) = comment {
            let layers = self.remarks.layers;
            // settings have been read
            self.remarks.read(comment, &mut Limits::default());
            if layers == 0 && self.remarks.layers > 0 {
                self.tool_path.first = self.tool_path.moves.len();
            }
        }
        Ok(())
    }

    fn skip(&mut self, name: &str) {
        *self.skipped.entry(name.to_owned()).or_default() += 1;
    }

    fn wrong(&self, line: usize, words: &Words) -> Error {
        error(self.path, line, "word", words.wrong.as_deref().unwrap_or_default(), "a letter and a number")
    }

    fn run_command(&mut self, line: usize, text: &str, code: f64, words: &Words) -> Result<(), Error> {
        if words.wrong.is_some() {
            return Err(self.wrong(line, words));
        }
        self.motion = Some(code);
        let arc = [None, None, Some(-1.0), Some(1.0)][code as usize];
        let with = MoveAttributes {
            height: self.remarks.height(),
            feature: self.remarks.feature,
            limits: (self.tool_path.limits.len() - 1) as u32,
            line: line as u32,
            stop: self.stopped,
        };
        let ToolPath { moves, motions, .. } = &mut self.tool_path;
        let before = motions.len();
        let gone = self.printer.apply(|letter| words.value(letter), arc, with, moves, motions);
        self.stopped &= motions.len() == before;
        gone.map_err(|wrong| error(self.path, line, wrong.what, wrong.found_in(text), wrong.allowed))
    }

    fn code(
        &mut self,
        line: usize,
        text: &str,
        letter: char,
        number: f64,
        words: &Words,
    ) -> Result<(), Error> {
        let code = format!("{letter}{number}");
        let value = |letter: char| words.value(letter);
        match code.as_str() {
            "G0" | "G1" | "G2" | "G3" => return self.run_command(line, text, number, words),
            "G92" if words.wrong.is_some() => return Err(self.wrong(line, words)),
            "G5" if value('X').is_some() || value('Y').is_some() => {
                return Err(error(self.path, line, "command", code, "straight moves and arcs, G0 to G3"));
            }
            "G18" | "G19" => {
                return Err(error(self.path, line, "command", code, "G17, arcs in the XY plane"));
            }
            "G17" => {}
            "M104" | "M109" | "M140" | "M190" => {
                // S, or R that waits for cooling too; a command without either waits
                self.stopped |= matches!(code.as_str(), "M109" | "M190");
                if let Some(celsius) = value('S').or(value('R')) {
                    let tool = if number < 110.0 { Some(value('T')) } else { None };
                    self.heat(line, celsius, tool)?;
                }
            }
            // RepRapFirmware: temperature of a tool
            "G10" | "M568" if value('P').is_some() && value('S').is_some() => {
                self.heat(line, value('S').unwrap_or(0.0), Some(value('P')))?;
            }
            "M106" | "M107" => self.fan(&code, words),
            // P is in ms, S in s
            "G4" => {
                self.printer.time += value('S').unwrap_or(value('P').unwrap_or(0.0) * 1e-3).max(0.0);
                self.stopped = true;
            }
            "M400" => self.stopped = true,
            "G20" => self.printer.unit = 25.4e-3,
            "G21" => self.printer.unit = 1e-3,
            "G28" => self.printer.home(value),
            "G90" => self.printer.relative = false,
            "G91" => self.printer.relative = true,
            "M82" => self.printer.relative_feed = Some(false),
            "M83" => self.printer.relative_feed = Some(true),
            "G92" => self.printer.rename(value),
            "M200" => self.volumetric(words),
            "M201" | "M203" | "M204" | "M205" | "M566" => {
                self.remarks.per_minute |= code == "M566";
                let per_minute = self.remarks.per_minute;
                self.limit(|limits| limits.command(&code, words, per_minute));
            }
            "M220" | "M221" if value('S').is_some_and(|share| share != 100.0) => {
                let factor = format!("{code} S{}", value('S').unwrap_or_default());
                if !self.factors.contains(&factor) {
                    self.factors.push(factor);
                }
            }
            _ if letter == 'T' && number.fract() == 0.0 && (0.0..=MAX_TOOLS).contains(&number) => {
                self.select(number as u16);
            }
            _ => self.skip(&code),
        }
        Ok(())
    }

    fn limit(&mut self, change: impl FnOnce(&mut Limits)) {
        let before = self.limits;
        change(&mut self.limits);
        if self.limits != before {
            self.tool_path.limits.push(self.limits);
        }
    }

    fn select(&mut self, tool: u16) {
        if tool != self.printer.tool && !self.tool_path.moves.is_empty() {
            self.printer.time += self.change;
        }
        self.printer.tool = tool;
        self.stopped = true;
        // a tool without a temperature of its own shares the nozzle
        if let Some(&value) = self.hot.get(&tool) {
            self.set(Setting::Nozzle, value);
        }
    }

    fn set(&mut self, setting: Setting, value: f64) {
        self.tool_path.commands.push(Command { time: self.printer.time, setting, value });
    }

    /// Sets a temperature; `tool` is `Some` for a nozzle, with the tool if the command states it.
    fn heat(&mut self, line: usize, celsius: f64, tool: Option<Option<f64>>) -> Result<(), Error> {
        if celsius < -CELSIUS {
            return Err(error(self.path, line, "temperature", celsius, "-273.15 °C or above"));
        }
        let value = celsius + CELSIUS;
        let Some(tool) = tool else {
            // off: the schedule sets how it cools
            self.set(if celsius == 0.0 { Setting::BedOff } else { Setting::Bed }, value);
            return Ok(());
        };
        // 0 switches the heater off, and nothing is printed until it is on again
        if celsius == 0.0 {
            return Ok(());
        }
        let own = self.printer.tool;
        let tool = tool.filter(|tool| (0.0..=MAX_TOOLS).contains(tool)).map_or(own, |tool| tool as u16);
        self.hot.insert(tool, value);
        if tool == own {
            self.set(Setting::Nozzle, value);
        }
        Ok(())
    }

    fn fan(&mut self, code: &str, words: &Words) {
        // Bambu's part fan is also P1
        let of_part = |number: f64| number == 0.0 || (number == 1.0 && self.remarks.bambu);
        if let Some(number) = words.value('P').filter(|number| !of_part(*number)) {
            self.skip(&format!("{code} P{number}"));
            return;
        }
        let speed = match words.value('S') {
            _ if code == "M107" => 0.0,
            // RepRapFirmware writes a fraction
            Some(share) if share > 0.0 && share < 1.0 => share,
            Some(number) => number / 255.0,
            None => 1.0,
        };
        self.set(Setting::Fan, speed.clamp(0.0, 1.0));
    }

    /// Handles M200: D is the diameter; D0 or S0 ends it.
    fn volumetric(&mut self, words: &Words) {
        let tool = words.value('T').map_or(self.printer.tool, |tool| tool.clamp(0.0, MAX_TOOLS) as u16);
        let diameter = words.value('D').map(|d| d * self.printer.unit);
        let known = || self.remarks.filaments.get(usize::from(tool)).copied().unwrap_or(super::FILAMENT);
        if words.value('S') == Some(0.0) || diameter == Some(0.0) {
            self.printer.volumetric.remove(&tool);
        } else if diameter.is_some_and(|d| d > 0.0) || words.value('S').is_some() {
            let diameter = diameter.filter(|d| *d > 0.0).unwrap_or_else(known);
            self.printer.volumetric.insert(tool, diameter);
            self.tool_path.filament = Some(diameter);
        }
    }

    fn named(&mut self, name: &str, rest: &str) {
        let upper = name.to_ascii_uppercase();
        let state = || line::keys(rest).find(|(key, _)| key == "NAME").map_or("", |(_, value)| value);
        match upper.as_str() {
            "SET_VELOCITY_LIMIT" => self.limit(|limits| limits.velocity_limit(rest)),
            "SAVE_GCODE_STATE" => self.printer.save(state()),
            "RESTORE_GCODE_STATE" => self.printer.restore(state()),
            "SET_HEATER_TEMPERATURE" => self.heater(rest),
            "ACTIVATE_EXTRUDER" => {
                let extruder = line::keys(rest).find(|(key, _)| key == "EXTRUDER").map(|(_, value)| value);
                let number = extruder.and_then(|name| name.strip_prefix("extruder"));
                match number.map(|digits| if digits.is_empty() { Ok(0) } else { digits.parse::<u16>() }) {
                    Some(Ok(tool)) if f64::from(tool) <= MAX_TOOLS => self.select(tool),
                    _ => self.skip(&upper),
                }
            }
            _ => {
                if upper.contains("START") && self.tool_path.moves.is_empty() {
                    self.begin(&upper, rest);
                }
                self.skip(name);
            }
        }
    }

    /// Handles Klipper's heaters by name; 0 is off.
    fn heater(&mut self, rest: &str) {
        let of = |name: &str| line::keys(rest).find(|(key, _)| key == name).map(|(_, value)| value);
        let celsius = of("TARGET").map_or(Some(0.0), |text| text.parse::<f64>().ok());
        match (of("HEATER"), celsius.filter(|celsius| (0.0..1e4).contains(celsius))) {
            (Some("heater_bed"), Some(celsius)) => {
                self.set(if celsius == 0.0 { Setting::BedOff } else { Setting::Bed }, celsius + CELSIUS);
            }
            (Some(name), Some(celsius)) if celsius > 0.0 && name.starts_with("extruder") => {
                let tool = name["extruder".len()..].parse().unwrap_or(0);
                self.hot.insert(tool, celsius + CELSIUS);
                if tool == self.printer.tool {
                    self.set(Setting::Nozzle, celsius + CELSIUS);
                }
            }
            _ => self.skip("SET_HEATER_TEMPERATURE"),
        }
    }

    /// Handles a macro that starts a print, with its temperatures.
    fn begin(&mut self, name: &str, rest: &str) {
        for (key, value) in line::keys(rest) {
            let Some(celsius) = value.parse::<f64>().ok().filter(|found| *found > 20.0 && *found < 600.0)
            else {
                continue;
            };
            let is = |words: &[&str]| words.iter().any(|word| key.contains(word));
            let (setting, what) = if is(&["BED"]) {
                (Setting::Bed, "bed")
            } else if is(&["EXTRUDER", "HOTEND", "NOZZLE", "TOOL_TEMP"]) {
                (Setting::Nozzle, "nozzle")
            } else {
                continue;
            };
            self.set(setting, celsius + CELSIUS);
            if setting == Setting::Nozzle {
                self.hot.insert(self.printer.tool, celsius + CELSIUS);
            }
            self.tool_path
                .notes
                .push(format!("`{name}` with {key}={value} is taken for {celsius} °C of the {what}"));
        }
    }

    fn finish(mut self) -> Result<ToolPath, Error> {
        let (printer, remarks) = (&self.printer, self.remarks);
        let mut path = self.tool_path;
        if !printer.time.is_finite() {
            return Err(error(self.path, 1, "duration", printer.time, "a finite time, s"));
        }
        path.rest = printer.time - path.moves.last().map_or(0.0, |last| last.end);
        (path.features, path.layers) = (remarks.features, remarks.layers);
        path.estimate = remarks.estimate.map(|known| known.1);
        // estimate of the whole file; some slicers exclude moves before the first layer
        if remarks.estimate.is_none_or(|known| known.0 > 0) {
            path.first = 0;
        }
        // lengths of filament of the first diameter
        let diameter = path.filament.or(remarks.filaments.first().copied());
        if let (Some(whole), None) = (diameter, path.filament) {
            let factor =
                |tool: u16| remarks.filaments.get(usize::from(tool)).map_or(1.0, |own| (own / whole).powi(2));
            path.moves.iter_mut().for_each(|one| one.fed *= factor(one.tool));
        }
        path.volumetric = path.filament.is_some();
        path.filament = diameter;
        let (doubtful, line) = printer.doubtful;
        if doubtful > 0 && path.moves.iter().any(|one| one.prints && one.line >= line) {
            let read = if printer.relative_feed.is_some() {
                "absolute, as M82 says"
            } else {
                "relative, as the axes"
            };
            path.notes.push(format!(
                "{doubtful} moves feed between G91 and G90 without M83, the first in line {line}: E is read \
                 as {read} (firmwares differ)"
            ));
        }
        if self.repeated > 0 {
            path.notes.push(format!("{} lines without a command repeat the move before them", self.repeated));
        }
        if !self.factors.is_empty() {
            path.notes.push(format!(
                "factors of flow and velocity left out, as slicers do: {}",
                self.factors.join(", ")
            ));
        }
        if !self.skipped.is_empty() {
            path.notes.push(format!("commands not used: {}", list_counts(&mut self.skipped)));
        }
        Ok(path)
    }
}
