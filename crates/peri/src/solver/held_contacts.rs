//! Active set of rigid surfaces in a search for equilibrium, see [`crate::contact`]'s `holds`.

use super::state::State;
use super::system::System;

/// Releases in one search, after which no contact is held.
const RELEASES: u32 = 20;
/// Gap below which contacts are held from the start of a search, in spacings.
const NEAR: f64 = 0.05;
/// Residual at which contacts that pull are released, over that after the last release.
const DECADE: f64 = 0.1;

impl<const D: usize> System<'_, D> {
    /// Holds the contacts of a state.
    pub(super) fn hold_contacts(&mut self, state: &State<D>) {
        if let Some(contact) = &mut self.contact {
            contact.hold(&state.contact.held);
        }
    }

    /// Adds those that touch now, at the start of a search all anew.
    pub(super) fn hold_touching(&mut self, state: &mut State<D>) {
        let Some(contact) = self.contact.as_mut().filter(|contact| contact.has_surfaces()) else { return };
        let mut gap = 0.0;
        if state.counts.iteration == 0 && state.contact.renewals == 0 {
            gap = NEAR * self.bonds.spacing();
            (state.contact.release_at, state.contact.releases) = (0.0, 0);
        }
        if state.contact.releases < RELEASES {
            state.contact.held.extend(contact.touching(&state.displacement, gap));
            state.contact.held.sort_unstable();
            state.contact.held.dedup();
        }
        contact.hold(&state.contact.held);
    }

    /// Releases contacts that pull where the residual is small enough, at most `tolerance`, or `at_last`;
    /// returns true if there were any.
    pub(super) fn release_contacts(&mut self, state: &mut State<D>, tolerance: f64, at_last: bool) -> bool {
        let Some(contact) = self.contact.as_mut().filter(|_| !state.contact.held.is_empty()) else {
            return false;
        };
        let residual = state.convergence.residual;
        if state.contact.release_at == 0.0 {
            state.contact.release_at = DECADE * residual;
        }
        if residual > state.contact.release_at.max(tolerance) && !at_last {
            return false;
        }
        state.contact.release_at = 0.0;
        let touching = contact.touching(&state.displacement, 0.0);
        let pull = state.contact.held.iter().any(|pair| touching.binary_search(pair).is_err());
        if pull {
            state.contact.releases += 1;
            state.contact.held = if state.contact.releases < RELEASES { touching } else { Vec::new() };
            contact.hold(&state.contact.held);
        }
        pull
    }
}
