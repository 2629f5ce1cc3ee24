//! Sums over the bonds of a lattice without forces: stretches, and energies, each bond seen from one of its ends.

use super::lattice_kernel::{Class, TILE, Tiles};
use crate::potential::StretchRange;
use pulp::{Arch, NullaryFnOnce};
use std::ops::Range;

/// A bond of the stencil.
#[derive(Clone, Copy, Debug)]
pub struct Span<const D: usize> {
    /// Distance to the neighbour in sites.
    pub shift: isize,
    /// Reference bond ξ, m.
    pub bond: [f64; D],
    /// |ξ|, m.
    pub length: f64,
    /// Volume correction.
    pub share: f64,
    /// 1/|ξ|².
    pub inverse_square: f64,
}

/// A stencil over a displacement.
pub struct Spans<'a, const D: usize> {
    /// All bonds of the stencil; bond k and bond (n − 1 − k) are opposite.
    pub spans: &'a [Span<D>],
    /// The storage.
    pub tiles: Tiles<'a, D>,
}

/// e = λ² − 1 of one bond of each particle of a tile, where it is intact; 0 elsewhere.
struct Elongations<'a, const D: usize> {
    displacement: [&'a [f64]; D],
    words: &'a [u64],
    span: &'a Span<D>,
    bit: usize,
    base: usize,
    out: &'a mut [f64; TILE],
}

impl<const D: usize> NullaryFnOnce for Elongations<'_, D> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        let Self { displacement, words, span, bit, base, out } = self;
        let there = base.wrapping_add_signed(span.shift);
        *out = [0.0; TILE];
        for d in 0..D {
            let (own, other) = (&displacement[d][base..base + TILE], &displacement[d][there..there + TILE]);
            for i in 0..TILE {
                let eta = other[i] - own[i];
                out[i] += eta * (2.0 * span.bond[d] + eta);
            }
        }
        for i in 0..TILE {
            let present = words[base + i] >> bit & 1 == 1;
            out[i] = if present { out[i] * span.inverse_square } else { 0.0 };
        }
    }
}

impl<const D: usize> Spans<'_, D> {
    /// The tiles of some sites that hold bonds, by their first site.
    fn tiles(&self, sites: Range<usize>) -> impl Iterator<Item = usize> {
        sites.step_by(TILE).filter(|base| self.tiles.classes[base / TILE] != Class::Empty)
    }

    /// Visits the elongations of the first `count` bonds of the stencil of a tile's particles, where any of them has that bond.
    #[inline(always)]
    fn visit(&self, base: usize, count: usize, mut visit: impl FnMut(&Span<D>, u64, usize, &[f64; TILE])) {
        let arch = Arch::new();
        let mut e = [0.0; TILE];
        for (word, words) in self.tiles.intact.iter().enumerate() {
            let mut any = 0;
            for bits in &words[base..base + TILE] {
                any |= bits;
            }
            while any != 0 {
                let bit = any.trailing_zeros() as usize;
                any &= any - 1;
                if 64 * word + bit >= count {
                    return;
                }
                let span = &self.spans[64 * word + bit];
                let (displacement, out) = (self.tiles.displacement, &mut e);
                arch.dispatch(Elongations { displacement, words, span, bit, base, out });
                visit(span, 1 << bit, word, &e);
            }
        }
    }

    /// Extremes of e over the bonds that begin in these sites, of one direction each.
    pub fn range(&self, sites: Range<usize>) -> StretchRange {
        let (mut low, mut high) = ([0.0_f64; TILE], [0.0_f64; TILE]);
        for base in self.tiles(sites) {
            self.visit(base, self.spans.len() / 2, |_, _, _, e| {
                for i in 0..TILE {
                    // a stretch that is not a number is no extreme, as in the kernels
                    low[i] = if e[i] < low[i] { e[i] } else { low[i] };
                    high[i] = if e[i] > high[i] { e[i] } else { high[i] };
                }
            });
        }
        StretchRange {
            low: low.iter().copied().fold(0.0, f64::min),
            high: high.iter().copied().fold(0.0, f64::max),
        }
    }

    /// The tiles with a bond beyond e = `least`, whichever end it is seen from.
    pub fn beyond(&self, sites: Range<usize>, least: f64) -> Vec<Range<usize>> {
        let mut found = Vec::new();
        for base in self.tiles(sites) {
            let mut beyond = false;
            self.visit(base, self.spans.len(), |_, _, _, e| beyond |= e.iter().any(|&e| e > least));
            if beyond {
                found.push(base..base + TILE);
            }
        }
        found
    }

    /// Σ share·|ξ|·φ(e) over the bonds that begin in these sites, of one direction each.
    pub fn energy(&self, sites: Range<usize>, energy: impl Fn(f64) -> f64) -> f64 {
        let mut total = 0.0;
        for base in self.tiles(sites) {
            self.visit(base, self.spans.len() / 2, |span, bit, word, e| {
                let words = &self.tiles.intact[word][base..base + TILE];
                let mut sum = 0.0;
                for i in 0..TILE {
                    if words[i] & bit != 0 {
                        sum += energy(e[i]);
                    }
                }
                total += span.share * span.length * sum;
            });
        }
        total
    }
}
