//! Breaking of compressed bonds across interfaces that slide.

use super::criterion::Criterion;
use super::state::State;
use super::system::System;
use crate::bonds::{Bonds, Overstretched};
use crate::field::Field;
use nalgebra::{SMatrix, SVector};
use std::collections::HashMap;

/// Bonds across interfaces that slide, by their sites.
#[derive(Clone, Debug, Default)]
pub struct SlidingBonds {
    pairs: Vec<[u32; 2]>,
    /// Sites that each site has a bond across to.
    across: HashMap<u32, Vec<u32>>,
}

impl SlidingBonds {
    /// Lists bonds, each once.
    pub fn new(pairs: Vec<[u32; 2]>) -> Self {
        let mut across: HashMap<u32, Vec<u32>> = HashMap::new();
        for &[a, b] in &pairs {
            across.entry(a).or_default().push(b);
            across.entry(b).or_default().push(a);
        }
        Self { pairs, across }
    }

    /// Returns true if no interface slides.
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    /// Slip of two particles over their distance at rest, along their bond: negative where it shortens it.
    ///
    /// y = F(ξ + j), where F is the deformation gradient of the bonds of both within their parts; of the jump
    /// j the slip is what lies normal to n, the mean of the bonds across. `None` without an F that can be
    /// inverted.
    fn slip<const D: usize>(&self, bonds: &dyn Bonds<D>, u: &Field<D>, [a, b]: [u32; 2]) -> Option<f64> {
        let place = |site: u32| SVector::from(bonds.position(site as usize));
        let moved = |site: u32| SVector::from(u.get(site as usize));
        let bond = |from: u32, to: u32| place(to) - place(from);
        let mut shape = SMatrix::<f64, D, D>::zeros();
        let mut deformed = shape;
        let mut normal = SVector::<f64, D>::zeros();
        for (end, sign) in [(a, 1.0), (b, -1.0)] {
            let across = &self.across[&end];
            normal += sign * across.iter().map(|&other| bond(end, other)).sum::<SVector<f64, D>>();
            bonds.neighbours(end as usize, &mut |own| {
                let other = own.site as u32;
                if !across.contains(&other) {
                    let at_rest = bond(end, other);
                    shape += own.weight * at_rest * at_rest.transpose();
                    deformed += own.weight * (at_rest + moved(other) - moved(end)) * at_rest.transpose();
                }
            });
        }
        let at_rest = bond(a, b);
        let jump = shape * deformed.try_inverse()? * (at_rest + moved(b) - moved(a)) - at_rest;
        let normal = normal.try_normalize(0.0)?;
        let slip = jump - normal * normal.dot(&jump);
        Some(slip.dot(&at_rest) / at_rest.norm_squared()).filter(|slip| slip.is_finite())
    }
}

impl<const D: usize> System<'_, D> {
    /// Lists the bonds across sliding interfaces that slip alone shortens by as much as breaks them in
    /// tension, to 1/λ_c, and that are as short; each from both ends. Where two parts slide, one half of the
    /// bonds is stretched and the other compressed alike, so that mode II takes the energy of mode I.
    pub(super) fn slid(&self, state: &State<D>) -> Vec<Overstretched> {
        let Some(Criterion::Stretch(critical)) = self.breaking.as_ref().map(|b| &b.criterion) else {
            return Vec::new();
        };
        let (bonds, u) = (&*self.bonds, &state.displacement);
        let square = |[a, b]: [u32; 2]| {
            let (here, there) = (bonds.position(a as usize), bonds.position(b as usize));
            let (from, to) = (u.get(a as usize), u.get(b as usize));
            let [mut now, mut rest] = [0.0; 2];
            for d in 0..D {
                now += (there[d] - here[d] + to[d] - from[d]).powi(2);
                rest += (there[d] - here[d]).powi(2);
            }
            now / rest
        };
        let mut found = Vec::new();
        for &[a, b] in &self.sliding.pairs {
            let shortest = 1.0 / critical.weaker(a as usize, b as usize);
            let is_short = square([a, b]) < shortest * shortest;
            let slides = || self.sliding.slip(bonds, u, [a, b]).is_some_and(|slip| slip < shortest - 1.0);
            if !(is_short && bonds.is_bonded(a as usize, b as usize) && slides()) {
                continue;
            }
            let elongation = square([a, b]) - 1.0;
            for [site, other] in [[a, b], [b, a]] {
                bonds.neighbours(site as usize, &mut |bond| {
                    if bond.site == other as usize {
                        let (index, length, weight) = (bond.index, bond.length, bond.weight);
                        found.push(Overstretched { site, index, elongation, length, weight });
                    }
                });
            }
        }
        found.sort_unstable_by_key(|bond| (bond.site, bond.index));
        found
    }
}
