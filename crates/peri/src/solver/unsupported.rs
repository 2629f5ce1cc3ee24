//! Loads without an equilibrium: parts of a body with a force and no support, and displacements far beyond
//! the body.
//!
//! Intact bonds divide a body into parts. Supports prescribe single components; a part of which component d
//! is nowhere prescribed has no reaction along d, so if its forces along d do not vanish it has no
//! equilibrium at any displacement. If every such sum vanishes, dead loads give its rotation a bounded
//! potential, so that no other mechanism lacks an equilibrium: only translations are checked. Contact pushes:
//! a plane may hold a part that presses on it, a round surface one that it stops, a part held along d one
//! behind it.

use super::force_scale::ForceScale;
use super::load::Loads;
use super::state::State;
use super::system::System;
use crate::bonds::{BodyGeometry, components};
use crate::error::Error;
use crate::field::Field;
use polycore::numerics::DisjointSets;
use std::collections::BTreeMap;
use std::fmt;

/// Displacement over the size of the body, or over the largest prescribed one, beyond which it is not an
/// equilibrium.
const FARTHEST: f64 = 1e3;

/// A part of a body, connected by intact bonds, whose forces along an axis nothing balances.
#[derive(Clone, Debug, PartialEq)]
pub struct Unsupported {
    /// Number of particles.
    pub particles: usize,
    /// Number of particles of the body.
    pub total: usize,
    /// Middle of the part in the reference configuration, m.
    pub middle: Vec<f64>,
    /// Axis of the force.
    pub axis: &'static str,
    /// Sum of the part's forces along the axis at load factor 1, N.
    pub force: f64,
}

impl fmt::Display for Unsupported {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let middle: Vec<String> = self.middle.iter().map(|x| format!("{:.4}", x * 1e3)).collect();
        write!(
            f,
            "a part of {} of {} particles around X = ({}) mm bears {:.3e} N along {} at load factor 1, \
            and nothing holds it along {}",
            self.particles,
            self.total,
            middle.join(", "),
            self.force,
            self.axis,
            self.axis
        )
    }
}

/// Contacts that may hold a part besides supports, by pushing.
#[derive(Clone, Debug, Default)]
pub struct ContactStops<const D: usize> {
    /// Directions in which rigid surfaces push.
    pub normals: Vec<[f64; D]>,
    /// True if particles repel each other.
    pub pairs: bool,
    /// True with friction, which may hold along every axis.
    pub rubs: bool,
}

/// Forces and extent of a part.
#[derive(Clone, Copy)]
struct PartLoads<const D: usize> {
    particles: usize,
    /// Components prescribed in any particle.
    held: u8,
    /// Σ V b and Σ V |b| along each axis, N.
    force: [f64; D],
    size: [f64; D],
    /// Σ X, Σ x and the extent of x, m.
    reference: [f64; D],
    middle: [f64; D],
    extent: [[f64; 2]; D],
}

/// Finds the first part of a body whose forces along an axis sum to more than `tolerance` of their sizes and
/// which nothing can hold; `roots` are the parts, as [`components`] has them.
pub fn find_unsupported<const D: usize>(
    bonds: &dyn BodyGeometry<D>,
    roots: &[u32],
    loads: &Loads<D>,
    displacement: Option<&Field<D>>,
    stops: &ContactStops<D>,
    tolerance: f64,
) -> Option<Unsupported> {
    let body = loads.body_force.as_ref()?;
    let mut pieces: BTreeMap<u32, PartLoads<D>> = BTreeMap::new();
    for &site in bonds.particles() {
        let (site, root) = (site as usize, roots[site as usize]);
        let (volume, force, rest) = (bonds.volume(site), body.get(site), bonds.position(site));
        let moved = displacement.map_or([0.0; D], |field| field.get(site));
        let piece = pieces.entry(root).or_insert(PartLoads {
            particles: 0,
            held: 0,
            force: [0.0; D],
            size: [0.0; D],
            reference: [0.0; D],
            middle: [0.0; D],
            extent: [[f64::INFINITY, f64::NEG_INFINITY]; D],
        });
        piece.particles += 1;
        piece.held |= loads.constrained(site);
        for d in 0..D {
            let place = rest[d] + moved[d];
            piece.force[d] += volume * force[d];
            piece.size[d] += volume * force[d].abs();
            piece.reference[d] += rest[d];
            piece.middle[d] += place;
            piece.extent[d] = [piece.extent[d][0].min(place), piece.extent[d][1].max(place)];
        }
    }
    for d in 0..D {
        join_pieces(roots, loads, d, &mut pieces);
    }
    let holds = |piece: &PartLoads<D>, d: usize| {
        let sign = piece.force[d].signum();
        let middle = piece.middle[d] / piece.particles as f64;
        let ahead = |other: &PartLoads<D>| {
            let end = if sign > 0.0 { other.extent[d][1] } else { -other.extent[d][0] };
            other.held >> d & 1 == 1 && end > sign * middle
        };
        piece.held >> d & 1 == 1
            || stops.rubs
            || stops.normals.iter().any(|normal| normal[d] * sign < 0.0)
            || stops.pairs && pieces.values().any(ahead)
    };
    for piece in pieces.values() {
        for d in 0..D {
            if piece.force[d].abs() > tolerance * piece.size[d] && !holds(piece, d) {
                return Some(Unsupported {
                    particles: piece.particles,
                    total: bonds.particles().len(),
                    middle: piece.reference.map(|x| x / piece.particles as f64).to_vec(),
                    axis: ["x", "y", "z"][d],
                    force: piece.force[d],
                });
            }
        }
    }
    None
}

/// Gives parts that share component d in regions that move as a whole the forces and supports of all of
/// them along d.
fn join_pieces<const D: usize>(
    roots: &[u32],
    loads: &Loads<D>,
    d: usize,
    pieces: &mut BTreeMap<u32, PartLoads<D>>,
) {
    let places: Vec<u32> = pieces.keys().copied().collect();
    let mut sets = DisjointSets::new(places.len());
    for region in loads.rigid.iter().filter(|region| region.components >> d & 1 == 1) {
        let mut parts =
            region.sites.iter().filter_map(|&site| places.binary_search(&roots[site as usize]).ok());
        let Some(first) = parts.next() else { continue };
        parts.for_each(|other| {
            sets.join(first as u32, other as u32);
        });
    }
    let mut sums = vec![(0.0, 0.0, 0); places.len()];
    for (number, piece) in (0..).zip(pieces.values()) {
        let sum = &mut sums[sets.root(number) as usize];
        *sum = (sum.0 + piece.force[d], sum.1 + piece.size[d], sum.2 | piece.held & 1 << d);
    }
    for (number, piece) in (0..).zip(pieces.values_mut()) {
        let (force, size, held) = sums[sets.root(number) as usize];
        (piece.force[d], piece.size[d]) = (force, size);
        piece.held |= held;
    }
}

impl<const D: usize> System<'_, D> {
    fn stops(&self, state: &State<D>) -> ContactStops<D> {
        let Some(contact) = self.repulsion() else { return ContactStops::default() };
        ContactStops {
            normals: contact.stops(&*self.bonds, &state.displacement),
            pairs: contact.has_pairs(),
            rubs: contact.has_friction() || contact.is_tied(),
        }
    }

    /// Refuses parts with a force and no support, in a body with dead loads only.
    ///
    /// # Errors
    /// [`Error::NoEquilibrium`] for such a part.
    pub(super) fn refuse_unsupported(&self, state: &State<D>, tolerance: f64) -> Result<(), Error> {
        if self.loads.body_force.is_none() || self.factors.is_empty() {
            return Ok(());
        }
        let sites = || self.bonds.particles().iter().map(|&site| site as usize);
        let loaded =
            |site: usize| self.loads.body_force.as_ref().is_some_and(|body| body.get(site) != [0.0; D]);
        if state.fracture.broken > 0 && !sites().any(loaded) {
            return Err(self.no_equilibrium(
                state,
                "every particle that bore a force has lost all its bonds".to_owned(),
            ));
        }
        let roots = components(&*self.bonds, |_, _| true);
        let (bonds, moved, stops) = (&*self.bonds, Some(&state.displacement), self.stops(state));
        match find_unsupported(bonds, &roots, &self.loads, moved, &stops, tolerance) {
            Some(part) => Err(self.no_equilibrium(state, part.to_string())),
            None => Ok(()),
        }
    }

    /// Refuses a state in which a rigid surface with a force has lost the body.
    ///
    /// # Errors
    /// [`Error::NoEquilibrium`] for such a surface.
    pub(super) fn refuse_lost(&self, state: &State<D>) -> Result<(), Error> {
        match self.repulsion().and_then(|contact| contact.unbalanced(&state.displacement)) {
            Some((surface, found, wanted)) => Err(self.no_equilibrium(
                state,
                format!("{surface} has a force of {wanted:.3e} N, of which contact balances {found:.3e} N"),
            )),
            None => Ok(()),
        }
    }

    /// Refuses a balance of forces at a displacement that only rounding can balance.
    ///
    /// # Errors
    /// [`Error::NoEquilibrium`] beyond it.
    pub(super) fn refuse_far(&self, state: &State<D>) -> Result<(), Error> {
        if self.loads.body_force.is_none() {
            return Ok(());
        }
        let factor = self.factors.get(state.step).copied().unwrap_or(1.0);
        let ForceScale { largest, diagonal, .. } = self.scale;
        let limit = FARTHEST * diagonal.max(largest * factor.abs());
        let sites = self.bonds.particles().iter().map(|&site| state.displacement.get(site as usize));
        let square = sites.map(|u| u.iter().map(|x| x * x).sum::<f64>()).fold(0.0, f64::max);
        let far = square.sqrt();
        if far <= limit || limit == 0.0 {
            return Ok(());
        }
        Err(self.no_equilibrium(
            state,
            format!("a displacement of {far:.3e} m is reached, of a body {diagonal:.3e} m in size"),
        ))
    }

    fn no_equilibrium(&self, state: &State<D>, why: String) -> Error {
        let factor = self.factors.get(state.step).copied().unwrap_or(1.0);
        Error::NoEquilibrium { step: state.step, factor, torn: state.fracture.broken > 0, why }
    }
}
