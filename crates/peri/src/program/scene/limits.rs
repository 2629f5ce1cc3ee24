//! Limits of bonds: of parts, and of bonds that soften.

use super::{Inclusions, plain};
use crate::bonds::{Bonds, Property};
use crate::critical::Critical;
use crate::error::Error;
use harness::scene::{SceneError, Source};
use polycore::units::EnergyPerArea;
use std::array;
use std::cell::RefCell;
use std::collections::HashMap;

/// Computes a limit of a bond from the criterion given for it, and the micromodulus over that of the scene's
/// Young's modulus.
pub type LimitOf<'a, T> = &'a dyn Fn(Critical, f64) -> Result<T, Error>;

/// Computes the limits of all bonds from that of the rest and those of parts and interfaces.
pub type LimitsOf<'a> = &'a dyn Fn(f64, LimitOf<f64>) -> Result<Property, SceneError>;

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
    limits: LimitsOf,
) -> Result<[Property; 2], SceneError> {
    let found = RefCell::new(vec![rest]);
    limits(rest[1], &|critical, stiffness| {
        let own = both(critical, stiffness)?;
        found.borrow_mut().push(own);
        Ok(own[1])
    })?;
    let mut found = found.into_inner();
    found.sort_by(|one, other| one[0].total_cmp(&other[0]).then(one[1].total_cmp(&other[1])));
    found.dedup();
    let rank = |own: [f64; 2]| found.iter().position(|other| *other == own).unwrap_or_default() as f64;
    let ranks = limits(rank(rest), &|critical, stiffness| Ok(rank(both(critical, stiffness)?)))?;
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
        limit: LimitOf<f64>,
    ) -> Result<Property, SceneError> {
        let varies = self.fracture_energy.is_some() || !self.each.is_empty();
        let mut stretch = vec![rest; if varies { bonds.sites() } else { 0 }];
        if let Some(energies) = &self.fracture_energy {
            for site in bonds.particles().iter().map(|&site| site as usize) {
                let energy = Some(EnergyPerArea::from_si(energies.value_at(site)));
                let critical = Critical { fracture_energy: energy, ..Critical::default() };
                stretch[site] = limit(critical, self.micromodulus.value_at(site)).map_err(|error| {
                    source.error("material.fields", error, "a fracture energy that bonds can have")
                })?;
            }
        }
        for (index, (inclusion, _, members)) in self.each.iter().enumerate() {
            let Some(critical) = inclusion.critical else { continue };
            let key = format!("material.inclusions[{index}].critical");
            // neighbours of equal stiffness share one bisection
            let mut last = None;
            for &site in members {
                let stiffness = self.micromodulus.value_at(site as usize);
                let own = match last {
                    Some((before, own)) if before == stiffness => own,
                    _ => limit(critical, stiffness).map_err(|error| limit_error(source, &key, error))?,
                };
                stretch[site as usize] = own;
                last = Some((stiffness, own));
            }
        }
        let property = Property::new(bonds, |site, _| stretch.get(site).copied().unwrap_or(rest));
        if self.each.iter().all(|(inclusion, ..)| inclusion.critical.is_none()) {
            return Ok(property);
        }
        let weak = self.weakened_bonds(source, bonds, limit)?;
        for (index, (_, _, members)) in self.each.iter().enumerate() {
            if members.is_empty() && !weak.iter().any(|one| one.0.contains(&index)) {
                let key = self.each[index].0.key(index);
                let found = "a shape without particles, and without bonds that pass through it";
                return Err(source.error(&key, found, "a shape with at least one"));
            }
        }
        Ok(property.weakened(weak.into_iter().map(|(_, bond, value)| (bond, value)).collect()))
    }

    /// Finds bonds that pass through inclusions with a limit, and the lowest limit between their ends.
    fn weakened_bonds(
        &self,
        source: &Source,
        bonds: &dyn Bonds<D>,
        limit: LimitOf<f64>,
    ) -> Result<Vec<Passing>, SceneError> {
        let reach = bonds.horizon() * (1.0 + 1e-9);
        let mut known: HashMap<(usize, u64), f64> = HashMap::new();
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
                    let stiffness = rest * stiffness(place);
                    let value = match known.get(&(index, stiffness.to_bits())) {
                        Some(&value) => value,
                        None => limit(critical, stiffness).map_err(|error| {
                            limit_error(source, &format!("material.inclusions[{index}].critical"), error)
                        })?,
                    };
                    known.insert((index, stiffness.to_bits()), value);
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
