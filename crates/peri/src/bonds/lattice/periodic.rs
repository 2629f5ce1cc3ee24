//! Periodic sides of a lattice: the particles near a side have images beyond the opposite one.
//!
//! Images are sites without bonds of their own. A particle is bonded to the images within its horizon, so
//! that its family is whole; an image moves as its origin does, by a mean displacement gradient times the
//! distance between both. Each particle's force and energy follow from its own family: nothing is counted
//! twice, and kernels see an image as any other neighbour.

use super::LatticeBonds;
use crate::geometry::{Cut, cell};

/// Image of a particle beyond a periodic side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PeriodicImage<const D: usize> {
    /// Site of the image.
    pub site: u32,
    /// Site of the particle.
    pub origin: u32,
    /// Reference position of the image less that of the particle, m: whole periods.
    pub shift: [f64; D],
}

/// Returns cuts with their copies beyond periodic sides, as far as bonds reach.
pub fn repeated<const D: usize>(cuts: &[Cut<D>], period: [f64; D], horizon: f64) -> Vec<Cut<D>> {
    let mut all = cuts.to_vec();
    for d in (0..D).filter(|&d| period[d] > 0.0) {
        let most = (horizon / period[d]).ceil() as i32;
        let moved = |cut: &Cut<D>, periods: i32| {
            let mut copy = *cut;
            copy.corner[d] += f64::from(periods) * period[d];
            copy
        };
        let copies = |cut| (-most..=most).map(move |periods| moved(cut, periods));
        all = all.iter().flat_map(copies).collect();
    }
    all
}

impl<const D: usize> LatticeBonds<D> {
    /// Returns the images in the cells of [`Lattice::widened`](crate::geometry::Lattice::widened) that repeat
    /// others, by their sites.
    pub(super) fn images_in(&self, copies: &[[usize; 2]]) -> Vec<PeriodicImage<D>> {
        let image = |pair: &[usize; 2]| {
            let [place, origin] = pair.map(|index| cell(index, self.lattice.cells));
            let shift = std::array::from_fn(|d| self.lattice.spacing * (place[d] as f64 - origin[d] as f64));
            let [site, origin] = [place, origin].map(|place| self.site(place) as u32);
            PeriodicImage { site, origin, shift }
        };
        let mut images: Vec<PeriodicImage<D>> = copies.iter().map(image).collect();
        images.sort_unstable_by_key(|image| image.site);
        images
    }
}
