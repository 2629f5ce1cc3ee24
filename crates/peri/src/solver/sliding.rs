//! Breaking of compressed bonds across interfaces that slide.

use super::criterion::Criterion;
use super::state::State;
use super::system::System;
use crate::bonds::{Bonds, Overstretched};
use crate::field::Field;
use crate::material::Bond;
use nalgebra::{SMatrix, SVector};
use std::collections::BTreeMap;

/// Bonds across interfaces that slide: for each site those to which it has one.
#[derive(Clone, Debug, Default)]
pub struct SlidingBonds(BTreeMap<u32, Vec<u32>>);

impl SlidingBonds {
    /// Lists bonds by their sites, each once.
    pub fn new(pairs: impl IntoIterator<Item = [u32; 2]>) -> Self {
        let mut across: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for [a, b] in pairs {
            across.entry(a).or_default().push(b);
            across.entry(b).or_default().push(a);
        }
        Self(across)
    }

    /// Returns true if no interface slides.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Slip of the ends of a bond across over their distance at rest, along the bond: negative where it
    /// shortens it; the same bits from either end.
    ///
    /// y = F(ξ + j), where F is the deformation gradient of the bonds of both within their parts; of the jump
    /// j the slip is what lies normal to n, the mean of the bonds across. `None` without an F that can be
    /// inverted.
    fn slip<const D: usize>(&self, bonds: &dyn Bonds<D>, u: &Field<D>, bond: &Bond<D>) -> Option<f64> {
        let mut shape = SMatrix::<f64, D, D>::zeros();
        let mut deformed = shape;
        let mut normal = SVector::<f64, D>::zeros();
        let [low, high] = [bond.from.min(bond.to), bond.from.max(bond.to)];
        for (end, sign) in [(low, 1.0), (high, -1.0)] {
            let across = self.0.get(&(end as u32))?;
            let place = |site: usize| SVector::from(bonds.position(site));
            normal += across
                .iter()
                .map(|&other| sign * (place(other as usize) - place(end)))
                .sum::<SVector<f64, D>>();
            bonds.neighbours(end, &mut |own| {
                if !across.contains(&(own.site as u32)) {
                    let own = Bond::new(end, &own, u);
                    let at_rest = SVector::from(own.reference);
                    shape += own.weight * at_rest * at_rest.transpose();
                    deformed += own.weight * (at_rest + SVector::from(own.change)) * at_rest.transpose();
                }
            });
        }
        let sign = if bond.from == low { 1.0 } else { -1.0 };
        let at_rest = sign * SVector::from(bond.reference);
        let jump = shape * deformed.try_inverse()? * (at_rest + sign * SVector::from(bond.change)) - at_rest;
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
        let mut found = Vec::new();
        for (&site, others) in &self.sliding.0 {
            bonds.neighbours(site as usize, &mut |neighbour| {
                if !others.contains(&(neighbour.site as u32)) {
                    return;
                }
                let bond = Bond::new(site as usize, &neighbour, u);
                let shortest = 1.0 / critical.weaker(bond.from, bond.to);
                let slips = || self.sliding.slip(bonds, u, &bond).is_some_and(|slip| slip < shortest - 1.0);
                let elongation = bond.elongation();
                if elongation < shortest * shortest - 1.0 && slips() {
                    let (index, length, weight) = (neighbour.index, bond.length, bond.weight);
                    found.push(Overstretched { site, index, elongation, length, weight });
                }
            });
        }
        found.sort_unstable_by_key(|bond| (bond.site, bond.index));
        found
    }
}
