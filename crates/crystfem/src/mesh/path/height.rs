//! Bead heights: from comments, or down to the material below.

use super::{Move, ToolPath};
use polycore::numerics::bounds;
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// Largest number of cells of the map along each axis.
const MAX_CELLS: f64 = 1500.0;
/// Cell size of the map over the square root of a bead's cross-section.
const CELL_RATIO: f64 = 0.35;
/// Distance of equal levels over the square root of a bead's cross-section.
const LEVEL_RATIO: f64 = 0.05;
/// Smallest distance of different levels, for any cross-section, m.
const MIN_LEVEL_DISTANCE: f64 = 1e-6;
/// Number of tops stored a cell.
const STORED_TOPS: usize = 3;
/// Fraction of a bead's half width that counts as below another's centreline; touching neighbours do not.
const CORE_FRACTION: f64 = 0.9;
/// Fraction of a bead's length that must rest on the highest material below it.
const MIN_SUPPORT: f64 = 0.03;
/// Smallest width over the median width of the level, for beads higher than their level.
const MIN_WIDTH_RATIO: f64 = 0.75;
/// Tolerance of the width over the median, within which a bead on rising z keeps its height.
const WIDTH_TOLERANCE: f64 = 0.1;
/// Largest gap, in strand diameters, that is filled if nothing else is known.
const MAX_GAP: f64 = 2.0;
/// Group numbers below this are runs of moves with changing z.
const RISING_GROUPS: i64 = i64::MIN / 2;

/// Highest tops so far over the bed, descending, by cells in x and y.
struct TopMap {
    low: [f64; 2],
    size: f64,
    count: [usize; 2],
    tops: Vec<[f64; STORED_TOPS]>,
}

/// Material below a position.
enum BelowBead {
    Bead(f64),
    Bed,
    /// Unknown, because of too many tops above.
    Unknown,
}

impl TopMap {
    /// Builds the map around printing moves whose cross-sections have this mean square root, m.
    fn new(path: &ToolPath, root: f64) -> Self {
        let [low, high] =
            bounds(path.printing_moves().flat_map(|one| [one.from, one.to]).map(|[x, y, _]| [x, y]));
        let extent = [0, 1].map(|d| (high[d] - low[d]).max(0.0));
        let size = (CELL_RATIO * root).max(extent[0].max(extent[1]) / MAX_CELLS).max(f64::MIN_POSITIVE);
        let count = extent.map(|extent| ((extent / size) as usize).min(MAX_CELLS as usize) + 1);
        Self { low, size, count, tops: vec![[f64::NEG_INFINITY; STORED_TOPS]; count[0] * count[1]] }
    }

    /// Index of a cell, clamped to the map.
    fn cell(&self, at: [f64; 2]) -> usize {
        // a cast saturates
        let [i, j] = [0, 1].map(|d| (((at[d] - self.low[d]) / self.size) as usize).min(self.count[d] - 1));
        i * self.count[1] + j
    }

    fn below(&self, at: [f64; 2], z: f64, same: f64) -> BelowBead {
        for &top in &self.tops[self.cell(at)] {
            if top == f64::NEG_INFINITY {
                return BelowBead::Bed;
            }
            if top < z - same {
                return BelowBead::Bead(top);
            }
        }
        BelowBead::Unknown
    }

    fn add_top(&mut self, at: [f64; 2], z: f64, same: f64) {
        let cell = self.cell(at);
        let tops = &mut self.tops[cell];
        match tops.iter().position(|top| *top < z + same) {
            Some(k) if tops[k] > z - same => tops[k] = tops[k].max(z),
            Some(k) => {
                tops[k..].rotate_right(1);
                tops[k] = z;
            }
            None => {}
        }
    }

    /// Sample positions along a move, and z there.
    fn along(&self, one: &Move) -> impl Iterator<Item = ([f64; 2], f64)> + use<> {
        let one = *one;
        let across = (one.to[0] - one.from[0]).hypot(one.to[1] - one.from[1]);
        let pieces = (across / (0.7 * self.size)).ceil().clamp(1.0, 4.0 * MAX_CELLS);
        (0..pieces as u32).map(move |k| {
            let share = (f64::from(k) + 0.5) / pieces;
            let at = [0, 1, 2].map(|d| one.from[d] + share * (one.to[d] - one.from[d]));
            ([at[0], at[1]], at[2])
        })
    }

    /// Marks the core of a bead of a given width.
    fn mark_core(&mut self, one: &Move, width: f64, same: f64) {
        let along = [one.to[0] - one.from[0], one.to[1] - one.from[1]];
        let across = along[0].hypot(along[1]);
        let normal = if across > 0.0 { [-along[1] / across, along[0] / across] } else { [1.0, 0.0] };
        let half = 0.5 * CORE_FRACTION * width;
        let steps = (half / (0.7 * self.size)).floor().clamp(0.0, 64.0) as i32;
        let places: Vec<([f64; 2], f64)> = self.along(one).collect();
        for (at, z) in places {
            for step in -steps..=steps {
                let aside = f64::from(step) * 0.7 * self.size;
                self.add_top([0, 1].map(|d| at[d] + aside * normal[d]), z, same);
            }
        }
    }
}

/// A bead before its level is known.
struct UnresolvedBead {
    group: i64,
    /// Distance down to the material below.
    gap: f64,
    area: f64,
    length: f64,
    stated: bool,
}

impl UnresolvedBead {
    /// Diameter of a free strand, an upper bound on bead height.
    fn strand(&self) -> f64 {
        (4.0 * self.area / PI).sqrt()
    }

    fn fits(&self) -> bool {
        self.gap > 0.0 && (self.stated || self.gap <= 1.05 * self.strand())
    }
}

impl ToolPath {
    /// Bead height of each printing move, m: `height` if given, otherwise as stated in the file, otherwise
    /// down to the highest earlier bead below, or to the bed. A bead over air, with a gap larger than a
    /// strand, takes the height of others at its level, or reaches down to the next level; in a vase the rise
    /// of a turn. `filament` is the diameter, m.
    pub(super) fn heights(&self, filament: f64, height: Option<f64>) -> Vec<f64> {
        if let Some(height) = height {
            return vec![height; self.printing_moves().count()];
        }
        if self.printing_moves().all(|one| one.height > 0.0) {
            return self.printing_moves().map(|one| one.height).collect();
        }
        let found = self.gaps(filament);
        let levels = levels(&found);
        let flat = self.levels();
        let below = |z: f64| {
            let at = flat.partition_point(|level| *level < z - MIN_LEVEL_DISTANCE);
            at.checked_sub(1).map_or(0.0, |at| flat[at])
        };
        let height = |(one, found): (&Move, &UnresolvedBead)| {
            if found.stated {
                return one.height;
            }
            let Some(&(usual, width)) = levels.get(&found.group) else {
                // no bead at this level fits
                let step = one.to[2] - below(one.to[2]);
                let own = if found.group < RISING_GROUPS { found.strand() } else { step };
                let near = found.gap <= MAX_GAP * found.strand();
                return if near { found.gap } else { found.gap.min(own) };
            };
            let own = found.area / found.gap;
            if found.gap <= 0.0 {
                found.gap
            } else if found.group < RISING_GROUPS {
                // the first turn of a vase is a wedge on a flat layer
                if (own / width - 1.0).abs() <= WIDTH_TOLERANCE { found.gap } else { usual }
            } else if found.gap <= 1.01 * usual || (found.fits() && own >= MIN_WIDTH_RATIO * width) {
                found.gap
            } else {
                usual
            }
        };
        self.printing_moves().zip(&found).map(height).collect()
    }

    /// Stores the bead heights in the moves, as used for cells, so that they stay if lower moves are removed.
    pub fn with_heights(mut self, filament: f64, height: Option<f64>) -> Self {
        let heights = self.heights(filament, height);
        for (one, height) in self.moves.iter_mut().filter(|one| one.prints).zip(heights) {
            one.height = height;
        }
        self
    }

    /// Printing moves and the gaps below them, in the order of time.
    fn gaps(&self, filament: f64) -> Vec<UnresolvedBead> {
        let (mut sum, mut whole) = (0.0, 0.0);
        for one in self.printing_moves() {
            let (volume, length) = (one.volume(filament), one.length());
            if volume > 0.0 {
                sum += (volume * length).sqrt();
                whole += length;
            }
        }
        let mut map = TopMap::new(self, if whole > 0.0 { sum / whole } else { 0.0 });
        let mut found = Vec::new();
        let (mut run, mut rose) = (i64::MIN, false);
        for one in self.printing_moves() {
            let area = one.area(filament);
            let same = (LEVEL_RATIO * area.sqrt()).max(MIN_LEVEL_DISTANCE);
            let rises = (one.to[2] - one.from[2]).abs() > MIN_LEVEL_DISTANCE;
            run += i64::from(rises && !rose);
            rose = rises;
            let group = if rises { run } else { (one.to[2] / MIN_LEVEL_DISTANCE).round() as i64 };
            let stated = one.height > 0.0;
            let mut bead = UnresolvedBead { group, gap: one.height, area, length: one.length(), stated };
            if !stated {
                bead.gap = map.gap(one, same, bead.strand());
            }
            let high = if bead.fits() { bead.gap } else { bead.strand() };
            let width = if high > 0.0 { area / high } else { 0.0 };
            map.mark_core(one, width, same);
            found.push(bead);
        }
        found
    }
}

impl TopMap {
    /// Distance from a bead down to the material below it.
    fn gap(&self, one: &Move, same: f64, strand: f64) -> f64 {
        let (mut gaps, mut on_bed) = (Vec::new(), Vec::new());
        for (at, z) in self.along(one) {
            match self.below(at, z, same) {
                BelowBead::Bead(top) => gaps.push(z - top),
                BelowBead::Bed => on_bed.push(z),
                BelowBead::Unknown => {}
            }
        }
        let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
        if gaps.is_empty() || (on_bed.len() > gaps.len() && mean(&on_bed) <= strand) {
            return if on_bed.is_empty() { one.to[2] } else { mean_of_equal(&on_bed) };
        }
        if (one.to[2] - one.from[2]).abs() > MIN_LEVEL_DISTANCE {
            return mean(&gaps);
        }
        gaps.sort_unstable_by(f64::total_cmp);
        gaps[(MIN_SUPPORT * gaps.len() as f64) as usize]
    }
}

/// Mean, exact for equal values.
fn mean_of_equal(all: &[f64]) -> f64 {
    match all.iter().all(|one| *one == all[0]) {
        true => all[0],
        false => all.iter().sum::<f64>() / all.len() as f64,
    }
}

/// Height and width, at the median of length, of the supported beads of each level.
fn levels(found: &[UnresolvedBead]) -> BTreeMap<i64, (f64, f64)> {
    let mut groups: BTreeMap<i64, Vec<&UnresolvedBead>> = BTreeMap::new();
    for one in found.iter().filter(|one| one.fits()) {
        groups.entry(one.group).or_default().push(one);
    }
    let middle = |all: &mut Vec<&UnresolvedBead>, of: fn(&UnresolvedBead) -> f64| {
        all.sort_unstable_by(|a, b| of(a).total_cmp(&of(b)));
        let half = 0.5 * all.iter().map(|one| one.length).sum::<f64>();
        let mut sum = 0.0;
        let at = all.iter().position(|one| {
            sum += one.length;
            sum >= half
        });
        at.map_or(0.0, |at| of(all[at]))
    };
    let both =
        |all: &mut Vec<&UnresolvedBead>| (middle(all, |one| one.gap), middle(all, |one| one.area / one.gap));
    groups.into_iter().map(|(group, mut all)| (group, both(&mut all))).collect()
}
