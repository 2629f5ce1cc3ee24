//! Finds bonds beyond their critical stretch, and the fragments that broken bonds leave.

use super::{BodyGeometry, BondForces, Bonds, Neighbour, Property};
use crate::field::{CHUNK, Field, chunk_range};
use crate::parallel;
use crate::potential::StretchRange;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// A bond to be severed, seen from one of its ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overstretched {
    /// Site of the particle.
    pub site: u32,
    /// Number among the particle's bonds, see [`super::Neighbour::index`].
    pub index: u32,
    /// λ² − 1.
    pub elongation: f64,
    /// |ξ|, m.
    pub length: f64,
    /// w V_J, m³.
    pub weight: f64,
}

/// Stretches met while computing the forces of a displacement; empty if none were tracked.
#[derive(Clone, Debug, Default)]
pub struct StretchScan {
    /// Sites of one range, a divisor of a work item.
    pub part: usize,
    /// Extreme stretches of each range of sites, in order.
    pub ranges: Vec<StretchRange>,
}

impl StretchScan {
    /// Returns the ranges of `sites`, a work item, in which bonds beyond e = `least` may begin.
    fn beyond(&self, sites: Range<usize>, least: f64) -> Vec<Range<usize>> {
        if self.ranges.is_empty() {
            return vec![sites];
        }
        let mut found: Vec<Range<usize>> = Vec::new();
        for start in sites.clone().step_by(self.part) {
            let borne = self.ranges.get(start / self.part).is_some_and(|range| range.high <= least);
            // a stretch that is NaN must be examined
            if !borne {
                let end = (start + self.part).min(sites.end);
                match found.last_mut().filter(|last| last.end == start) {
                    Some(last) => last.end = end,
                    None => found.push(start..end),
                }
            }
        }
        found
    }
}

/// Lists all intact bonds beyond the `critical` stretch of the weaker of their ends, each from both ends: λ²
/// − 1 = η·(2ξ + η)/|ξ|² has the same bits from either. `seen` is the scan that [`BondForces::force`] made of
/// this displacement.
pub fn overstretched<const D: usize, B: BondForces<D> + ?Sized>(
    bonds: &B,
    displacement: &Field<D>,
    critical: &Property,
    seen: &StretchScan,
) -> Vec<Overstretched> {
    let sites = bonds.sites();
    // vectorised loops find the bonds to examine; their last bits may differ from those below
    let least = (critical.least() * critical.least() - 1.0) * (1.0 - 1e-9) - 1e-12;
    let beyond = |[site, index]: [u32; 2]| {
        // the other end of a bond to an image is listed there
        let site = bonds.origin(site as usize) as u32;
        let bond = bonds.bond(site as usize, index);
        let (own, other) = (displacement.get(site as usize), displacement.get(bond.site));
        let mut e = 0.0;
        for d in 0..D {
            let eta = other[d] - own[d];
            e += eta * (2.0 * bond.bond[d] + eta);
        }
        let e = e / (bond.length * bond.length);
        let critical = critical.weaker(site as usize, bond.site);
        let (length, weight) = (bond.length, bond.weight);
        (e > critical * critical - 1.0).then_some(Overstretched {
            site,
            index,
            elongation: e,
            length,
            weight,
        })
    };
    let of = |chunk: usize| {
        let parts = seen.beyond(chunk_range(chunk, sites), least).into_iter();
        let suspects = parts.flat_map(|sites| bonds.suspects(displacement, sites, least));
        suspects.filter_map(beyond).collect::<Vec<Overstretched>>()
    };
    let found: Vec<Vec<Overstretched>> = parallel::map(sites.div_ceil(CHUNK), of);
    let mut found = found.concat();
    found.par_sort_unstable_by_key(|bond| (bond.site, bond.index));
    found
}

/// Finds the other particle of a bond of a site, and its bond back: also across a periodic side, where the
/// bond leads to an image.
pub fn counterpart<const D: usize, B: BodyGeometry<D> + ?Sized>(
    bonds: &B,
    site: usize,
    bond: &Neighbour<D>,
) -> Option<(usize, Neighbour<D>)> {
    let (there, mut found) = (bonds.origin(bond.site), None);
    bonds.neighbours(there, &mut |back| {
        if back.bond == bond.bond.map(|x| -x) && bonds.origin(back.site) == site {
            found = Some((there, back));
        }
    });
    found
}

/// Adds the other ends of bonds across periodic sides, whose stretch rounding may keep below the limit there:
/// the mean deformation of a cell has other last bits from either end.
pub fn add_counterparts<const D: usize>(bonds: &dyn Bonds<D>, list: &mut Vec<Overstretched>) {
    if bonds.images().is_empty() {
        return;
    }
    let known: BTreeSet<(u32, u32)> = list.iter().map(|bond| (bond.site, bond.index)).collect();
    let other = |one: &Overstretched| {
        let bond = bonds.bond(one.site as usize, one.index);
        let (there, back) = counterpart(bonds, one.site as usize, &bond)?;
        let (site, index) = (there as u32, back.index);
        (!known.contains(&(site, index))).then_some(Overstretched {
            site,
            index,
            weight: back.weight,
            ..*one
        })
    };
    let missing: Vec<Overstretched> = list.iter().filter_map(other).collect();
    list.extend(missing);
    list.sort_unstable_by_key(|bond| (bond.site, bond.index));
}

/// Severs the intact bonds among pairs of sites.
pub fn sever_pairs<const D: usize>(bonds: &mut dyn Bonds<D>, pairs: &[[u32; 2]]) {
    let mut list = Vec::new();
    for [site, other] in pairs.iter().flat_map(|&[a, b]| [[a, b], [b, a]]) {
        bonds.neighbours(site as usize, &mut |bond| {
            if bond.site == other as usize {
                let (index, length, weight) = (bond.index, bond.length, bond.weight);
                list.push(Overstretched { site, index, elongation: 0.0, length, weight });
            }
        });
    }
    list.sort_unstable_by_key(|bond| (bond.site, bond.index));
    bonds.break_bonds(&list);
}

/// Hashes a set of bonds to one number: FNV-1a over their ends, in the order of [`overstretched`].
pub fn fingerprint(bonds: &[Overstretched]) -> u64 {
    let words = bonds.iter().flat_map(|bond| [bond.site, bond.index]).flat_map(u32::to_le_bytes);
    words.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

/// A part of the body connected by intact bonds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fragment {
    /// Number of particles, at least two.
    pub particles: usize,
    /// Volume, m³.
    pub volume: f64,
}

/// Lists the parts connected by intact bonds, largest first, without single particles.
pub fn fragments<const D: usize, B: BodyGeometry<D> + ?Sized>(bonds: &B) -> Vec<Fragment> {
    let roots = components(bonds, |_, _| true);
    // by its first site, which is its root
    let mut found: BTreeMap<u32, Fragment> = BTreeMap::new();
    for &site in bonds.particles() {
        let own = found.entry(roots[site as usize]).or_insert(Fragment { particles: 0, volume: 0.0 });
        own.particles += 1;
        own.volume += bonds.volume(site as usize);
    }
    let mut fragments: Vec<Fragment> = found.into_values().filter(|own| own.particles > 1).collect();
    fragments.sort_by(|a, b| b.volume.total_cmp(&a.volume));
    fragments
}

/// Returns, for each site, the first site of the part to which intact bonds that `holds` accepts connect it.
pub fn components<const D: usize, B: BodyGeometry<D> + ?Sized>(
    bonds: &B,
    holds: impl Fn(usize, usize) -> bool,
) -> Vec<u32> {
    let mut root: Vec<u32> = (0..bonds.sites() as u32).collect();
    let find = |root: &mut Vec<u32>, mut site: u32| {
        while root[site as usize] != site {
            root[site as usize] = root[root[site as usize] as usize];
            site = root[site as usize];
        }
        site
    };
    for &site in bonds.particles() {
        bonds.neighbours(site as usize, &mut |bond| {
            if holds(site as usize, bond.site) {
                let (a, b) = (find(&mut root, site), find(&mut root, bond.site as u32));
                root[a.max(b) as usize] = a.min(b);
            }
        });
    }
    for image in bonds.images() {
        let (a, b) = (find(&mut root, image.site), find(&mut root, image.origin));
        root[a.max(b) as usize] = a.min(b);
    }
    (0..bonds.sites() as u32).map(|site| find(&mut root, site)).collect()
}
