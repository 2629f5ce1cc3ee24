//! Contacts that rigid surfaces hold in a search for equilibrium, see `contact::holds`: when they are added
//! and released.

use super::state::State;
use super::system::System;

/// Releases in one search, after which no contact is held.
const RELEASES: u32 = 20;
/// Overlap above which faces touch, in spacings: rounding must not be held.
const TOUCH: f64 = 1e-9;
/// Gap below which faces rest on a surface before the first load step, in spacings.
const RESTING: f64 = 0.05;
/// Gap above which contacts of the last load step are not held in the next, in spacings.
const NEAR: f64 = 0.25;
/// Residual at which contacts that pull are released, over that after the last release.
const DECADE: f64 = 0.1;

impl<const D: usize> System<'_, D> {
    /// Holds the contacts of a state.
    pub(super) fn hold_contacts(&mut self, state: &State<D>) {
        if let Some(contact) = &mut self.contact {
            contact.set_held(&state.contact.held);
        }
    }

    /// Adds those that touch now. At the start of a load step those of the last one stay only near a
    /// surface: one that withdraws must not drag the body along.
    pub(super) fn hold_touching(&mut self, state: &mut State<D>) {
        let Some(contact) = self.contact.as_mut().filter(|contact| contact.has_surfaces()) else { return };
        let own = &mut state.contact;
        let near = |gap: f64| contact.touching(&state.displacement, gap * self.bonds.spacing());
        let touching = near(-TOUCH);
        if state.counts.iteration == 0 && own.renewals == 0 {
            (own.release_at, own.releases) = (0.0, 0);
            if own.held.is_empty() && !touching.is_empty() {
                own.held = near(RESTING);
            } else {
                let near = near(NEAR);
                own.held.retain(|pair| near.binary_search(pair).is_ok());
            }
        }
        if own.releases < RELEASES {
            own.held.extend(touching);
            own.held.sort_unstable();
            own.held.dedup();
        }
        contact.set_held(&state.contact.held);
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
        let touching = contact.touching(&state.displacement, -TOUCH * self.bonds.spacing());
        let pull = state.contact.held.iter().any(|pair| touching.binary_search(pair).is_err());
        if pull {
            state.contact.releases += 1;
            state.contact.held = if state.contact.releases < RELEASES { touching } else { Vec::new() };
            contact.set_held(&state.contact.held);
        }
        pull
    }
}
