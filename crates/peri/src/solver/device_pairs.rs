//! Pairs of particles that may touch, on a graphics card: listed by the host, with a margin, until particles
//! have moved so far that others may touch.

use super::device_run::GROWTH;
use super::system::System;
use crate::field::Field;
use crate::gpu::DeviceBody;

/// Validity of the list of pairs on a card.
pub struct ListedPairs {
    /// Way of no less than any particle in the last move, m, and that until pairs must be renewed; ∞ without
    /// pairs.
    way: f64,
    room: f64,
    /// Number of rebuilds at which the card took the list; `None`: not yet, or bonds have broken since.
    taken: Option<u64>,
}

impl ListedPairs {
    /// Validity of a list that the card does not have yet.
    pub fn new() -> Self {
        Self { way: f64::INFINITY, room: f64::INFINITY, taken: None }
    }

    /// Returns true if pairs are listed.
    pub fn are_listed(&self) -> bool {
        self.room != f64::INFINITY
    }

    /// Counts a way, m, that no particle exceeds in a move; returns false if pairs may have come near that
    /// are not listed.
    pub fn hold_after(&mut self, way: f64) -> bool {
        self.way = way;
        self.room -= way;
        self.are_complete()
    }

    /// Returns true if all pairs that may touch are listed.
    pub fn are_complete(&self) -> bool {
        // false for what is not a number
        self.room >= 0.0
    }

    /// Number of moves like the last that the list holds for, at least.
    pub fn moves_left(&self) -> f64 {
        if self.are_listed() { self.room / (GROWTH * self.way) } else { f64::INFINITY }
    }

    /// Has the list renewed before the next forces, after bonds have broken.
    pub fn expire(&mut self) {
        self.taken = None;
        if self.are_listed() {
            self.room = f64::NEG_INFINITY;
        }
    }

    /// Makes the list hold at a displacement, m, and as long as possible.
    pub fn renew<const D: usize>(
        &mut self,
        body: &mut DeviceBody<D>,
        system: &mut System<D>,
        displacement: &Field<D>,
    ) {
        let Some(contact) = system.contact.as_mut().filter(|contact| contact.has_pairs()) else { return };
        contact.renew_pairs(&*system.bonds, displacement);
        let rebuilds = Some(contact.rebuilds());
        if self.taken != rebuilds {
            body.set_pairs(contact.pair_rows(&*system.bonds));
            self.taken = rebuilds;
        }
        self.room = contact.room_of_pairs();
    }
}
