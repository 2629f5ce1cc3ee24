//! Tool paths: moves of a nozzle, and the times at which elements are covered.

use std::path::Path;

use std::collections::BTreeMap;

use crate::error::Error;
use crate::mesh::Mesh;

/// Default filament diameter, m.
pub const FILAMENT: f64 = 1.75e-3;

mod comments;
mod cover;
mod csv;
mod deposit;
mod feature;
mod flow;
mod gcode;
mod height;
mod limits;
mod line;
mod motion_planning;
mod placement;
mod printer;
mod summary;

pub use cover::{ActivationTimes, Bead};
pub use csv::read_csv;
pub use deposit::{CellSettings, Deposit};
pub use feature::FAMILIES;
pub use flow::stadium_width;
pub use gcode::{parse, read_gcode};

/// A straight move of the nozzle at constant velocity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Move {
    /// Start, m.
    pub from: [f64; 3],
    /// End, m; z is the upper face of the bead.
    pub to: [f64; 3],
    /// Start time, s.
    pub start: f64,
    /// End time, s.
    pub end: f64,
    /// True if material is deposited.
    pub prints: bool,
    /// Length of filament fed, m; 0 if unknown.
    pub fed: f64,
    /// Height of the bead, m; 0 if the file does not state it.
    pub height: f64,
    /// Feature, an index into [`ToolPath::features`].
    pub feature: u16,
    /// Tool.
    pub tool: u16,
    /// Line of the file.
    pub line: u32,
}

/// Straight motion of X, Y, Z and filament, m, at feed rate F.
#[derive(Clone, Copy, Debug, PartialEq)]
struct MachineMotion {
    delta: [f64; 4],
    start: f64,
    end: f64,
    /// Index into the limits of the file.
    limits: u32,
    /// True if the machine stopped before it.
    stop: bool,
}

impl MachineMotion {
    fn length(&self) -> f64 {
        let across = self.delta[..3].iter().map(|x| x * x).sum::<f64>().sqrt();
        if across > 0.0 { across } else { self.delta[3].abs() }
    }
}

impl Move {
    /// Length, m.
    pub fn length(&self) -> f64 {
        (0..3).map(|d| (self.to[d] - self.from[d]).powi(2)).sum::<f64>().sqrt()
    }
}

/// A setting of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Setting {
    /// Temperature of the nozzle of the selected tool, K.
    Nozzle,
    /// Temperature of the bed, K.
    Bed,
    /// Bed heater off.
    BedOff,
    /// Fan speed, 0 to 1.
    Fan,
}

/// A setting from a time on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command {
    /// Time, s.
    pub time: f64,
    /// Setting.
    pub setting: Setting,
    /// Value.
    pub value: f64,
}

/// A tool path: moves in the order of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ToolPath {
    /// Moves.
    pub moves: Vec<Move>,
    /// Temperatures and the fan, in the order of time.
    pub commands: Vec<Command>,
    /// Dwells and feed-only motions after the last move, s.
    pub rest: f64,
    /// Notes on ignored input.
    pub notes: Vec<String>,
    /// Names of features; empty for an unnamed one.
    pub features: Vec<String>,
    /// Filament diameter stated in the file, m.
    pub filament: Option<f64>,
    /// True if E is a volume (M200), converted to a length by this diameter.
    pub volumetric: bool,
    /// Number of layers marked in the file; 0 without marks.
    pub layers: usize,
    /// Print time estimated by the slicer from the move `first` on, s.
    pub estimate: Option<f64>,
    first: usize,
    /// All motions, including feed-only ones.
    motions: Vec<MachineMotion>,
    /// Machine limits, in the order of the file.
    limits: Vec<limits::Limits>,
}

impl ToolPath {
    /// Generates a bar printed in alternating lines along x: from `lower` to `upper` in x and y, with lines
    /// of the bead's width (reduced to fill the bar evenly), `layers` of the bead's height upwards from z =
    /// 0, `velocity` while printing and between lines, m/s; each layer begins `interval` s after the one
    /// before.
    ///
    /// # Errors
    /// [`Error::Parameter`] for extents, bead, velocity or number of layers that are not positive, an
    /// interval shorter than a layer takes, and more than 10⁸ lines.
    pub fn raster(
        [lower, upper]: [[f64; 2]; 2],
        bead: Bead,
        layers: usize,
        velocity: f64,
        interval: f64,
    ) -> Result<Self, Error> {
        let parameter =
            |name, found, allowed: &str| Err(Error::Parameter { name, found, allowed: allowed.to_owned() });
        let extent = [upper[0] - lower[0], upper[1] - lower[1]];
        let positive = [
            ("extent along x", extent[0]),
            ("extent along y", extent[1]),
            ("width of the bead", bead.width),
            ("height of the bead", bead.height),
            ("velocity", velocity),
            ("layers", layers as f64),
        ];
        for (name, found) in positive {
            if !(found > 0.0 && found.is_finite()) {
                return parameter(name, found, "positive and finite");
            }
        }
        // tolerance of a billionth on the number of lines
        let lines = (extent[1] / bead.width - 1e-9).ceil().max(1.0);
        let count = lines * layers as f64;
        if count > 1e8 {
            return parameter("lines of a path", count, "at most 1e8");
        }
        let spacing = extent[1] / lines;
        let line = extent[0] / velocity;
        let step = spacing / velocity;
        let needed = lines * line + (lines - 1.0) * step;
        if interval.is_nan() || interval < needed * (1.0 - 1e-12) {
            let allowed = format!("{needed} s or more, what printing a layer takes");
            return Err(Error::Parameter { name: "time from layer to layer", found: interval, allowed });
        }
        let mut moves = Vec::with_capacity(2 * count as usize);
        let mut place = [lower[0], lower[1] + 0.5 * spacing, bead.height];
        let mut time = 0.0;
        for layer in 0..layers {
            let z = (layer + 1) as f64 * bead.height;
            for row in 0..lines as usize {
                let y = lower[1] + (row as f64 + 0.5) * spacing;
                // the nozzle waits, if necessary, on its way to the layer
                let start = layer as f64 * interval + row as f64 * (line + step);
                let ends = if row % 2 == 0 { [lower[0], upper[0]] } else { [upper[0], lower[0]] };
                let [from, to] = ends.map(|x| [x, y, z]);
                if time > 0.0 {
                    moves.push(Move {
                        from: place,
                        to: from,
                        start: time,
                        end: start.max(time),
                        ..Move::default()
                    });
                }
                time = start.max(time) + line;
                place = to;
                moves.push(Move { from, to, start: time - line, end: time, prints: true, ..Move::default() });
            }
        }
        Ok(Self { moves, ..Self::default() })
    }

    /// End of the last move and of the dwells after it, s.
    pub fn duration(&self) -> f64 {
        self.moves.last().map_or(0.0, |last| last.end) + self.rest
    }

    /// Times at which the bead covers elements, see [`ActivationTimes`].
    ///
    /// # Errors
    /// [`Error::Parameter`] or [`Error::Mesh`] for a bead without width or height, an element out of range, a
    /// path that prints nothing, and positions or times that are not finite.
    pub fn activation_times(
        &self,
        mesh: &Mesh,
        elements: &[u32],
        bead: Bead,
    ) -> Result<ActivationTimes, Error> {
        cover::activation(self, mesh, elements, bead)
    }
}

/// Lists names with their counts, most frequent first, at most twenty.
fn list_counts(counts: &mut BTreeMap<String, usize>) -> String {
    let mut all: Vec<(String, usize)> = std::mem::take(counts).into_iter().collect();
    all.sort_by(|a, b| b.1.cmp(&a.1).then_with(|| a.0.cmp(&b.0)));
    let more = all.len().saturating_sub(20);
    let mut names: Vec<String> =
        all.iter().take(20).map(|(name, count)| format!("{name} ({count})")).collect();
    if more > 0 {
        names.push(format!("{more} more"));
    }
    names.join(", ")
}

fn error(path: &Path, line: usize, what: &str, found: impl ToString, allowed: impl Into<String>) -> Error {
    crate::file::line_error(path, line, what, found, allowed)
}

#[cfg(test)]
mod dialects;
#[cfg(test)]
mod tests;
