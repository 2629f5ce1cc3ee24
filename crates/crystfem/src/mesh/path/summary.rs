//! Summary of a printed file for its author.

use super::ToolPath;
use polycore::numerics::bounds;

/// Drop of a printing move, m, above which it may print into the air.
const LOOSE_DROP: f64 = 1e-3;
/// Slope of such a drop.
const LOOSE_SLOPE: f64 = 0.2;
/// Largest number of listed features.
const MAX_LISTED: usize = 12;

impl ToolPath {
    /// Tools that print, ascending.
    pub fn tools(&self) -> Vec<u16> {
        let mut tools: Vec<u16> = self.printing_moves().map(|one| one.tool).collect();
        tools.sort_unstable();
        tools.dedup();
        tools
    }

    /// Turns beads without room above the bed (z ≤ 0) or falling through the air, as in purges of some
    /// printers, into travel moves. Returns their number, the line of the first, and their fraction of the
    /// filament.
    pub fn remove_loose(&mut self) -> Option<(usize, u32, f64)> {
        let whole = self.fed();
        let (mut count, mut line, mut fed) = (0, 0, 0.0);
        for one in self.moves.iter_mut().filter(|one| one.prints && one.fed > 0.0) {
            let across = (one.to[0] - one.from[0]).hypot(one.to[1] - one.from[1]);
            let fall = one.from[2] - one.to[2];
            if one.to[2].max(one.from[2]) <= 0.0 || (fall > LOOSE_DROP && fall > LOOSE_SLOPE * across) {
                line = if count == 0 { one.line } else { line };
                count += 1;
                fed += one.fed;
                (one.prints, one.fed) = (false, 0.0);
            }
        }
        (count > 0).then(|| (count, line, fed / whole))
    }

    /// Layers, bounding box, filament, volume and time of the print, and the volume fraction of each feature.
    /// `filament` is the diameter, m.
    pub fn summary(&self, filament: f64) -> Vec<String> {
        let ends = || self.printing_moves().flat_map(|one| [one.from, one.to]);
        let [low, high] = bounds(ends());
        let place = |at: [f64; 3]| {
            let [x, y, z] = at.map(|x| (1e6 * x).round() / 1e3);
            format!("({x}, {y}, {z}) mm")
        };
        let layers = if self.layers > 0 { self.layers } else { self.levels().len() };
        let volume: f64 = self.printing_moves().map(|one| one.volume(filament)).sum();
        let mut lines = vec![format!(
            "the file prints {layers} {}, centrelines from {} to {}, {:.3} mm³ of {:.1} mm of filament, in \
             {}",
            match (self.layers > 0, layers) {
                (true, 1) => "marked layer",
                (true, _) => "marked layers",
                (false, 1) => "level",
                (false, _) => "levels",
            },
            place(low),
            place(high),
            1e9 * volume,
            1e3 * self.fed(),
            clock(self.duration())
        )];
        let shares = self.shares();
        if shares.iter().any(|(name, _)| !name.is_empty()) {
            let name =
                |name: &str| if name.is_empty() { "without a name".to_owned() } else { format!("`{name}`") };
            let list = shares
                .iter()
                .take(MAX_LISTED)
                .map(|(of, share)| format!("{} {:.1} %", name(of), 100.0 * share));
            let more = shares.len().saturating_sub(MAX_LISTED);
            let more = if more > 0 { format!(", {more} more") } else { String::new() };
            lines.push(format!("by feature: {}{more}", list.collect::<Vec<_>>().join(", ")));
        }
        lines
    }

    /// Compares the duration, computed as described by `with`, with the slicer's estimate, if present. An
    /// estimate that differs by more than a twentieth comes with advice.
    pub fn compare_estimate(&self, with: &str) -> Option<String> {
        let estimate = self.estimate?;
        let start = self.moves.get(self.first).map_or(0.0, |one| one.start);
        let own = self.duration() - start;
        let off = 100.0 * (own / estimate - 1.0);
        let (own, said) = (clock(own), clock(estimate));
        let from = if self.first > 0 { "from the first layer on " } else { "" };
        let told =
            format!("{from}the path takes {own} {with}, and {said} as its slicer estimates ({off:+.1} %)");
        Some(match off.abs() > 5.0 {
            true => format!("{told}: `acceleration` and `jerk` set other limits"),
            false => told,
        })
    }
}

/// Formats a duration: `1 h 2 min 3.5 s`.
pub(super) fn clock(seconds: f64) -> String {
    let (hours, minutes) = ((seconds / 3600.0).floor(), (seconds % 3600.0 / 60.0).floor());
    let rest = (10.0 * (seconds - 3600.0 * hours - 60.0 * minutes)).round() / 10.0;
    match (hours > 0.0, minutes > 0.0) {
        (true, _) => format!("{hours} h {minutes} min {rest:.0} s"),
        (false, true) => format!("{minutes} min {rest} s"),
        (false, false) => format!("{rest} s"),
    }
}
