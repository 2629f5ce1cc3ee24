//! Elements that rigid surfaces hold in a search for equilibrium.
//!
//! The energy of an element in contact is ½k⟨o⟩², whose curvature jumps where the overlap o changes its
//! sign: a search in which many elements touch and lift off again and again hardly advances. Between two
//! decades of the residual, elements that have touched are held with ½ko² instead; those that then pull are
//! released (the primal-dual active set of Hintermüller, Ito & Kunisch 2002,
//! doi:10.1137/S1052623401383558).

use super::Contact;
use super::friction_pair::ContactPair;
use super::surfaces::RigidSurfaces;
use crate::field::Field;

impl<const D: usize> RigidSurfaces<D> {
    /// Pairs nearer than `gap`, m, to surfaces that no force moves, and not tied to them, ascending.
    fn touching(&self, field: &Field<D>, gap: f64) -> Vec<ContactPair> {
        let mut pairs = Vec::new();
        for (number, placed) in self.each.iter().enumerate() {
            if placed.surface.force.is_none() {
                let touches = self.near(placed, field, gap);
                pairs.extend(touches.iter().map(|touch| self.pair(number, touch.element)));
            }
        }
        pairs.sort_unstable();
        pairs
    }

    fn set_held(&mut self, pairs: &[ContactPair]) {
        self.each.iter_mut().for_each(|placed| placed.held.clear());
        for &pair in pairs {
            let element = self.element(pair).filter(|&(_, element)| self.is_live(element));
            if let Some((number, element)) = element {
                self.each[number].held.push(element);
            }
        }
    }
}

impl<const D: usize> Contact<D> {
    /// Pairs in contact with rigid surfaces, or nearer than `gap`, m, that may be held, ascending.
    pub fn touching(&self, displacement: &Field<D>, gap: f64) -> Vec<ContactPair> {
        self.surfaces.as_ref().map_or_else(Vec::new, |surfaces| surfaces.touching(displacement, gap))
    }

    /// Holds pairs in contact, ascending, whether they push or pull; releases all others.
    pub fn set_held(&mut self, pairs: &[ContactPair]) {
        if let Some(surfaces) = &mut self.surfaces {
            surfaces.set_held(pairs);
        }
    }
}
