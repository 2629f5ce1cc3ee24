//! State of a printer, and its changes by moves and arcs.

use super::{MachineMotion, Move};
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

/// Largest distance of chords from their arc, m.
const CHORD_ERROR: f64 = 1e-5;
/// Limit on chords of an arc.
const MAX_CHORDS: f64 = 1e6;
/// Largest distance of an arc's end from its circle: as a fraction of the radius, and m (digits of files).
const ARC_TOLERANCE: (f64, f64) = (1e-2, 2e-5);

/// Invalid word of a move.
pub(super) struct MoveError {
    pub what: &'static str,
    /// Value found; `None` for the whole line.
    found: Option<f64>,
    pub allowed: String,
}

impl MoveError {
    pub fn found_in(&self, text: &str) -> String {
        self.found.map_or_else(|| text.trim().to_owned(), |found| found.to_string())
    }
}

/// State of the printer; positions in m in machine coordinates.
#[derive(Debug, Default)]
pub(super) struct Printer {
    /// Length unit, m.
    pub unit: f64,
    place: [f64; 3],
    /// Offset of G92: stated minus machine position.
    offset: [f64; 3],
    /// Filament fed, as stated, in units of the file.
    feed: f64,
    pub relative: bool,
    /// E mode after M82 or M83; before them E follows G90 and G91.
    pub relative_feed: Option<bool>,
    /// Velocity, m/s; 0 before the first F.
    velocity: f64,
    pub time: f64,
    /// Selected tool.
    pub tool: u16,
    /// Diameters of filament, m, of tools whose E is a volume (M200).
    pub volumetric: BTreeMap<u16, f64>,
    /// Number of moves that feed between G91 and G90 without M83, which firmwares interpret differently, and
    /// the line of the first.
    pub doubtful: (usize, u32),
    /// States saved by SAVE_GCODE_STATE, by name.
    saved: BTreeMap<String, SavedState>,
}

/// Saved modes, velocity and offsets of a [`Printer`].
#[derive(Clone, Copy, Debug)]
struct SavedState {
    relative: bool,
    relative_feed: Option<bool>,
    velocity: f64,
    offset: [f64; 3],
    feed: f64,
}

/// Attributes of a move.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct MoveAttributes {
    pub height: f64,
    pub feature: u16,
    pub limits: u32,
    pub line: u32,
    /// True if the machine stood before it.
    pub stop: bool,
}

impl Printer {
    /// Returns a printer at the origin, in millimetres.
    pub fn new() -> Self {
        Self { unit: 1e-3, ..Self::default() }
    }

    /// Adds a move, or the chords of an arc that turns by the sign of `arc`; no move if the nozzle stays.
    pub fn apply(
        &mut self,
        value: impl Fn(char) -> Option<f64>,
        arc: Option<f64>,
        with: MoveAttributes,
        moves: &mut Vec<Move>,
        motions: &mut Vec<MachineMotion>,
    ) -> Result<(), MoveError> {
        let velocity = |found| MoveError {
            what: "velocity F",
            found: Some(found),
            allowed: "positive and finite, before or in the first move".into(),
        };
        if let Some(feed) = value('F') {
            // per minute; firmwares ignore 0
            if feed != 0.0 {
                self.velocity = feed * self.unit / 60.0;
            }
            if feed < 0.0 || !self.velocity.is_finite() {
                return Err(velocity(feed));
            }
        }
        let from = self.place;
        for (d, letter) in ['X', 'Y', 'Z'].into_iter().enumerate() {
            if let Some(number) = value(letter) {
                let to = number * self.unit;
                self.place[d] = if self.relative { from[d] + to } else { to - self.offset[d] };
            }
        }
        let fed = match value('E') {
            None => 0.0,
            Some(number) if self.relative_feed.unwrap_or(self.relative) => number,
            Some(number) => number - self.feed,
        };
        self.feed += fed;
        if self.relative && self.relative_feed != Some(true) && value('E').is_some_and(|number| number > 0.0)
        {
            self.doubtful =
                (self.doubtful.0 + 1, if self.doubtful.0 == 0 { with.line } else { self.doubtful.1 });
        }
        // m of filament
        let fed = match self.volumetric.get(&self.tool) {
            Some(diameter) => fed * self.unit.powi(3) / (0.25 * PI * diameter * diameter),
            None => fed * self.unit,
        };
        let (length, places) = match arc {
            Some(turn) => self.arc(from, turn, value)?,
            None => {
                let length = (0..3).map(|d| (self.place[d] - from[d]).powi(2)).sum::<f64>().sqrt();
                (length, vec![self.place])
            }
        };
        // feed-only motions take time too
        let way = if length > 0.0 { length } else { fed.abs() };
        if way == 0.0 {
            return Ok(());
        }
        if self.velocity == 0.0 {
            return Err(velocity(0.0));
        }
        let start = self.time;
        self.time += way / self.velocity;
        let mut motion = MachineMotion {
            delta: [0.0, 0.0, 0.0, fed],
            start,
            end: self.time,
            limits: with.limits,
            stop: with.stop,
        };
        if length == 0.0 {
            motions.push(motion);
            return Ok(());
        }
        // filament fed during a vertical move alone refills the nozzle after a retraction
        let across = arc.is_some() || self.place[0] != from[0] || self.place[1] != from[1];
        let count = places.len() as f64;
        let mut before = (from, start);
        for (k, to) in (1..).zip(places) {
            let end = if k as f64 == count {
                self.time
            } else {
                start + (self.time - start) * (f64::from(k) / count)
            };
            let (prints, fed) = (fed > 0.0 && across, fed / count);
            let (from, start) = before;
            let MoveAttributes { height, feature, line, .. } = with;
            moves.push(Move { from, to, start, end, prints, fed, height, feature, tool: self.tool, line });
            motion.delta = [to[0] - from[0], to[1] - from[1], to[2] - from[2], fed];
            (motion.start, motion.end) = (start, end);
            motions.push(motion);
            motion.stop = false;
            before = (to, end);
        }
        Ok(())
    }

    /// Computes the length of an arc in the XY plane from a position to the present one, and the ends of its
    /// chords of equal angle; equal XY is a full circle; z rises linearly.
    fn arc(
        &self,
        from: [f64; 3],
        turn: f64,
        value: impl Fn(char) -> Option<f64>,
    ) -> Result<(f64, Vec<[f64; 3]>), MoveError> {
        let to = self.place;
        let (across, up) = ([to[0] - from[0], to[1] - from[1]], to[2] - from[2]);
        let way = across[0].hypot(across[1]);
        let centre = match (value('I'), value('J'), value('R')) {
            (None, None, None) => {
                return Err(MoveError { what: "arc", found: None, allowed: "I and J, or R".into() });
            }
            (None, None, Some(_)) if way == 0.0 => {
                return Err(MoveError {
                    what: "arc",
                    found: None,
                    allowed: "I and J for a full circle".into(),
                });
            }
            (None, None, Some(radius)) => {
                let own = radius.abs() * self.unit;
                // half a digit of the file
                if own < 0.5 * way - ARC_TOLERANCE.1 {
                    let allowed = format!("{} or more in size", 0.5 * way / self.unit);
                    return Err(MoveError { what: "radius of an arc", found: Some(radius), allowed });
                }
                let height = (own * own - 0.25 * way * way).max(0.0).sqrt() / way;
                // a negative radius selects the longer arc
                let side = turn * radius.signum();
                [
                    from[0] + 0.5 * across[0] - side * height * across[1],
                    from[1] + 0.5 * across[1] + side * height * across[0],
                ]
            }
            (i, j, _) => [from[0] + i.unwrap_or(0.0) * self.unit, from[1] + j.unwrap_or(0.0) * self.unit],
        };
        let radius = |place: [f64; 3]| (place[0] - centre[0]).hypot(place[1] - centre[1]);
        let angle = |place: [f64; 3]| (place[1] - centre[1]).atan2(place[0] - centre[0]);
        let (first, last) = (radius(from), radius(to));
        if (first - last).abs() > ARC_TOLERANCE.0 * first + ARC_TOLERANCE.1 {
            let [first, last] = [first, last].map(|radius| (1e9 * radius).round() / 1e9 / self.unit);
            let allowed = format!("as far as its start, {first} from its centre");
            return Err(MoveError {
                what: "end of an arc, distance from its centre",
                found: Some(last),
                allowed,
            });
        }
        if first == 0.0 {
            return Err(MoveError { what: "radius of an arc", found: Some(0.0), allowed: "above 0".into() });
        }
        let mut sweep = (turn * (angle(to) - angle(from))).rem_euclid(TAU);
        if way <= 1e-9 * first {
            sweep = TAU;
        }
        // sagitta r (1 − cos(φ/2))
        let most = 2.0 * (1.0 - CHORD_ERROR / first).clamp(-1.0, 1.0).acos();
        let count = (sweep / most).ceil().clamp(1.0, MAX_CHORDS) as u32;
        let begin = angle(from);
        let places = (1..=count).map(|k| {
            if k == count {
                return to;
            }
            let part = f64::from(k) / f64::from(count);
            let (at, radius) = (begin + turn * sweep * part, first + (last - first) * part);
            [centre[0] + radius * at.cos(), centre[1] + radius * at.sin(), from[2] + up * part]
        });
        Ok(((0.5 * (first + last) * sweep).hypot(up), places.collect()))
    }

    /// Homes the named axes, or all.
    pub fn home(&mut self, value: impl Fn(char) -> Option<f64>) {
        let named = ['X', 'Y', 'Z'].map(|letter| value(letter).is_some());
        for d in 0..3 {
            if named[d] || named == [false; 3] {
                self.place[d] = 0.0;
                self.offset[d] = 0.0;
            }
        }
    }

    /// Handles G92: sets the stated position without motion.
    pub fn rename(&mut self, value: impl Fn(char) -> Option<f64>) {
        for (d, letter) in ['X', 'Y', 'Z'].into_iter().enumerate() {
            if let Some(number) = value(letter) {
                self.offset[d] = number * self.unit - self.place[d];
            }
        }
        if let Some(number) = value('E') {
            self.feed = number;
        }
        // all axes, without a word
        if ['X', 'Y', 'Z', 'E'].into_iter().all(|letter| value(letter).is_none()) {
            self.feed = 0.0;
            self.offset = self.place.map(|x| -x);
        }
    }

    /// Saves modes, velocity and offsets under a name, like Klipper.
    pub fn save(&mut self, name: &str) {
        let Self { relative, relative_feed, velocity, offset, feed, .. } = *self;
        let state = SavedState { relative, relative_feed, velocity, offset, feed };
        self.saved.insert(name.to_owned(), state);
    }

    /// Restores them; the position stays.
    pub fn restore(&mut self, name: &str) {
        if let Some(saved) = self.saved.get(name).copied() {
            (self.relative, self.relative_feed) = (saved.relative, saved.relative_feed);
            (self.velocity, self.offset, self.feed) = (saved.velocity, saved.offset, saved.feed);
        }
    }
}
