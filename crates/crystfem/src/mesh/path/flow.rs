//! Flow of the filament: volumes, cross-sections, widths.

use super::{Move, Setting, ToolPath};
use std::f64::consts::PI;

/// Distance below which levels are equal, m.
const LEVEL_TOLERANCE: f64 = 5e-8;

/// Width of a bead of cross-section `area` and height `height`, m: a rectangle between two half circles, A/h
/// + h(1 − π/4).
pub fn stadium_width(area: f64, height: f64) -> f64 {
    area / height + height * (1.0 - 0.25 * PI)
}

impl Move {
    /// Volume of the filament fed, m³, for a diameter `filament`, m.
    pub fn volume(&self, filament: f64) -> f64 {
        0.25 * PI * filament * filament * self.fed
    }

    /// Cross-section of the bead, A = ΔE π d²/4 / L over its horizontal length, m².
    pub fn area(&self, filament: f64) -> f64 {
        self.volume(filament) / (self.to[0] - self.from[0]).hypot(self.to[1] - self.from[1])
    }
}

impl ToolPath {
    /// Returns true if the file states filament feed.
    pub fn has_feed(&self) -> bool {
        self.printing_moves().any(|one| one.fed > 0.0)
    }

    /// Filament fed in printing moves, m.
    pub fn fed(&self) -> f64 {
        self.printing_moves().map(|one| one.fed).sum()
    }

    /// Heights at which printing moves end, m, ascending, without duplicates from rounding.
    pub fn levels(&self) -> Vec<f64> {
        let mut levels: Vec<f64> = self.printing_moves().map(|one| one.to[2]).collect();
        levels.sort_unstable_by(f64::total_cmp);
        levels.dedup_by(|next, kept| *next - *kept < LEVEL_TOLERANCE);
        levels
    }

    /// A setting over time: pairs of start time, s, and value. The last of simultaneous commands wins. For
    /// the bed NaN means off.
    pub fn setting(&self, setting: Setting) -> Vec<(f64, f64)> {
        let mut pairs: Vec<(f64, f64)> = Vec::new();
        for command in &self.commands {
            let value = match command.setting {
                Setting::BedOff if setting == Setting::Bed => f64::NAN,
                own if own == setting => command.value,
                _ => continue,
            };
            while pairs.last().is_some_and(|pair| pair.0 >= command.time) {
                pairs.pop();
            }
            pairs.push((command.time, value));
        }
        pairs.dedup_by(|next, kept| next.1.to_bits() == kept.1.to_bits());
        pairs
    }
}
