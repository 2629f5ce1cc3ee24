//! Limits of bonds from the materials at their ends.

use super::{Inclusions, plain};
use crate::bonds::{Bonds, Property};
use crate::critical::Critical;
use crate::error::Error;
use harness::scene::{SceneError, Source};
use polycore::units::EnergyPerArea;
use std::array;
use std::cell::RefCell;
use std::collections::HashMap;

/// Materials at the ends of a bond, on which its limit depends.
#[derive(Clone, Copy, PartialEq)]
pub struct BondEnds {
    /// Mean micromodulus over that of the scene's Young's modulus.
    pub stiffness: f64,
    /// Numbers of the laws of a solid.
    pub laws: [u16; 2],
}

impl BondEnds {
    /// The material of the rest of a body.
    pub const REST: Self = Self { stiffness: 1.0, laws: [0; 2] };
}

/// Computes a limit of a bond, from the criterion given for it.
pub type LimitOf<'a, T> = &'a dyn Fn(Critical, BondEnds) -> Result<T, Error>;

/// Rule for the limits of the bonds of a body.
#[derive(Clone, Copy)]
pub struct LimitRule<'a> {
    /// Number of the law of a solid in a site.
    pub law: &'a dyn Fn(u32) -> u16,
    /// The limit.
    pub limit: LimitOf<'a, f64>,
}

impl LimitRule<'_> {
    /// Returns the limit by the criterion of the block `key`.
    ///
    /// # Errors
    /// A limit out of its domain.
    pub(super) fn of_block(
        &self,
        (source, key): (&Source, &str),
        critical: Critical,
        ends: BondEnds,
    ) -> Result<f64, SceneError> {
        (self.limit)(critical, ends).map_err(|error| limit_error(source, key, error))
    }
}

/// Builds the error of a criterion in the block `key`.
pub fn limit_error(source: &Source, key: &str, error: Error) -> SceneError {
    match error {
        Error::Parameter { name, found, allowed } => {
            let name = name.strip_prefix("critical").unwrap_or_default();
            let unit = match name {
                ".fracture_energy" => " J/m²",
                ".strength" => " Pa",
                _ => "",
            };
            source.error(&format!("{key}{name}"), plain(found) + unit, allowed)
        }
        other => source.error(key, other, "a limit that bonds can have"),
    }
}

/// Computes where bonds begin to soften, and their limits. Each bond takes both from the same of its ends:
/// the one that softens first. `rest` are both of the rest of the body, and `limits` computes a limit of
/// every bond from that of the rest.
///
/// # Errors
/// Errors of `limits`.
pub fn softening_limits<const D: usize>(
    bonds: &dyn Bonds<D>,
    rest: [f64; 2],
    both: LimitOf<[f64; 2]>,
    limits: &dyn Fn(f64, LimitOf<f64>) -> Result<Property, SceneError>,
) -> Result<[Property; 2], SceneError> {
    let found = RefCell::new(vec![rest]);
    limits(rest[1], &|critical, ends| {
        let own = both(critical, ends)?;
        found.borrow_mut().push(own);
        Ok(own[1])
    })?;
    let mut found = found.into_inner();
    found.sort_by(|one, other| one[0].total_cmp(&other[0]).then(one[1].total_cmp(&other[1])));
    found.dedup();
    let rank = |own: [f64; 2]| found.iter().position(|other| *other == own).unwrap_or_default() as f64;
    let ranks = limits(rank(rest), &|critical, ends| Ok(rank(both(critical, ends)?)))?;
    Ok([0, 1].map(|part| ranks.replaced(bonds, |rank| found[rank as usize][part])))
}

impl<const D: usize> Inclusions<'_, D> {
    /// Returns the limit of each particle, of a bond law the critical stretch: `rest`, replaced by that of a
    /// fracture energy that follows a field, or of the last inclusion with `critical`.
    ///
    /// # Errors
    /// A limit out of its domain.
    pub fn limits(
        &self,
        source: &Source,
        bonds: &dyn Bonds<D>,
        rest: f64,
        rule: LimitRule,
    ) -> Result<Property, SceneError> {
        let varies = self.fracture_energy.is_some() || !self.each.is_empty();
        let mut stretch = vec![rest; if varies { bonds.sites() } else { 0 }];
        if let Some(energies) = &self.fracture_energy {
            for site in bonds.particles().iter().map(|&site| site as usize) {
                let energy = Some(EnergyPerArea::from_si(energies.value_at(site)));
                let critical = Critical { fracture_energy: energy, ..Critical::default() };
                let ends = BondEnds { stiffness: self.micromodulus.value_at(site), ..BondEnds::REST };
                stretch[site] = (rule.limit)(critical, ends).map_err(|error| {
                    source.error("material.fields", error, "a fracture energy that bonds can have")
                })?;
            }
        }
        for (index, (inclusion, _, members)) in self.each.iter().enumerate() {
            let Some(critical) = inclusion.critical else { continue };
            let key = format!("material.inclusions[{index}].critical");
            // neighbours of equal material share one bisection
            let mut last = None;
            for &site in members {
                let stiffness = self.micromodulus.value_at(site as usize);
                let ends = BondEnds { stiffness, laws: [(rule.law)(site); 2] };
                let own = match last {
                    Some((before, own)) if before == ends => own,
                    _ => rule.of_block((source, &key), critical, ends)?,
                };
                stretch[site as usize] = own;
                last = Some((ends, own));
            }
        }
        let property = Property::new(bonds, |site, _| stretch.get(site).copied().unwrap_or(rest));
        let mixed = self.bonds_of_two_laws(source, bonds, rule)?.into_iter();
        let mixed = mixed.filter(|&([a, b], own)| own != property.weaker(a as usize, b as usize)).collect();
        let property = property.with_bonds(mixed);
        if self.each.iter().all(|(inclusion, ..)| inclusion.critical.is_none()) {
            return Ok(property);
        }
        let weak = self.weakened_bonds(source, bonds, rule)?;
        for (index, (_, _, members)) in self.each.iter().enumerate() {
            if members.is_empty() && !weak.iter().any(|one| one.0.contains(&index)) {
                let key = self.each[index].0.key(index);
                let found = "a shape without particles, and without bonds that pass through it";
                return Err(source.error(&key, found, "a shape with at least one"));
            }
        }
        Ok(property.weakened(weak.into_iter().map(|(_, bond, value)| (bond, value)).collect()))
    }

    /// Finds bonds between particles of different laws, and the lower limit of both ends for these laws.
    fn bonds_of_two_laws(
        &self,
        source: &Source,
        bonds: &dyn Bonds<D>,
        rule: LimitRule,
    ) -> Result<Vec<([u32; 2], f64)>, SceneError> {
        let laws: Vec<u16> = bonds.particles().iter().map(|&site| (rule.law)(site)).collect();
        if laws.iter().all(|law| *law == laws[0]) {
            return Ok(Vec::new());
        }
        // number of the inclusion whose criterion a particle has, from 1 on; 0: the rest
        let mut owners = vec![0; bonds.sites()];
        for (index, (inclusion, _, members)) in self.each.iter().enumerate() {
            if inclusion.critical.is_some() {
                members.iter().for_each(|&site| owners[site as usize] = index + 1);
            }
        }
        let (mut known, mut found) = (HashMap::new(), Vec::new());
        for &site in bonds.particles() {
            let mut others = Vec::new();
            bonds.neighbours(site as usize, &mut |bond| {
                let other = bond.site as u32;
                if site < other && (rule.law)(site) != (rule.law)(other) {
                    others.push(other);
                }
            });
            for other in others {
                let ends = BondEnds { laws: [site, other].map(rule.law), ..BondEnds::REST };
                let mut least = f64::INFINITY;
                for owner in [site, other].map(|end| owners[end as usize]) {
                    let own = match owner.checked_sub(1) {
                        Some(index) => self.each[index].0.critical,
                        None => self.critical,
                    };
                    let Some(critical) = own else { continue };
                    let value = match known.get(&(owner, ends.laws)) {
                        Some(&value) => value,
                        None => {
                            let key = match owner.checked_sub(1) {
                                Some(index) => format!("material.inclusions[{index}].critical"),
                                None => "material.critical".to_owned(),
                            };
                            rule.of_block((source, &key), critical, ends)?
                        }
                    };
                    known.insert((owner, ends.laws), value);
                    least = least.min(value);
                }
                found.push(([site, other], least));
            }
        }
        Ok(found)
    }

    /// Finds bonds that pass through inclusions with a limit, and the lowest limit between their ends.
    fn weakened_bonds(
        &self,
        source: &Source,
        bonds: &dyn Bonds<D>,
        rule: LimitRule,
    ) -> Result<Vec<Passing>, SceneError> {
        let reach = bonds.horizon() * (1.0 + 1e-9);
        let mut known: HashMap<(usize, u64, [u16; 2]), f64> = HashMap::new();
        let mut found = Vec::new();
        for &site in bonds.particles() {
            let here = bonds.position(site as usize);
            let near = |&index: &usize| self.each[index].1.is_near(here, reach);
            let near: Vec<usize> = (0..self.each.len()).filter(near).collect();
            if near.iter().all(|&index| self.each[index].0.critical.is_none()) {
                continue;
            }
            // relative micromodulus of the rest at this end
            let inside = |place| near.iter().filter(move |&&index| self.each[index].1.contains(place));
            let stiffness = |place| inside(place).map(|&index| self.each[index].0.stiffness).product::<f64>();
            let rest = self.micromodulus.value_at(site as usize) / stiffness(here);
            let mut others = Vec::new();
            bonds.neighbours(site as usize, &mut |bond| {
                if site < bond.site as u32 {
                    others.push(bond.site as u32);
                }
            });
            for other in others {
                let there = bonds.position(other as usize);
                let mut ends: Vec<f64> =
                    near.iter().flat_map(|&index| self.each[index].1.passages(here, there)).collect();
                ends.sort_by(f64::total_cmp);
                let mut passing = (Vec::new(), [site, other], f64::INFINITY);
                for pair in ends.windows(2).filter(|pair| pair[1] - pair[0] > THIN) {
                    let part = 0.5 * (pair[0] + pair[1]);
                    let place: [f64; D] = array::from_fn(|d| here[d] + part * (there[d] - here[d]));
                    let last =
                        inside(place).rev().find_map(|&index| Some((index, self.each[index].0.critical?)));
                    let Some((index, critical)) = last else { continue };
                    let ends =
                        BondEnds { stiffness: rest * stiffness(place), laws: [site, other].map(rule.law) };
                    let material = (index, ends.stiffness.to_bits(), ends.laws);
                    let value = match known.get(&material) {
                        Some(&value) => value,
                        None => {
                            let key = format!("material.inclusions[{index}].critical");
                            rule.of_block((source, &key), critical, ends)?
                        }
                    };
                    known.insert(material, value);
                    passing.0.push(index);
                    passing.2 = passing.2.min(value);
                }
                if !passing.0.is_empty() {
                    found.push(passing);
                }
            }
        }
        Ok(found)
    }
}

/// Fraction of a bond's length below which a crossed part is rounding, where faces meet.
const THIN: f64 = 1e-6;

/// Inclusions that a bond passes through, its sites, and the lowest limit in them.
type Passing = (Vec<usize>, [u32; 2], f64);
