//! Periodic sides of a lattice: the particles near a side have images beyond the opposite one.
//!
//! Images are sites without bonds of their own. A particle is bonded to the images within its horizon, so
//! that its family is whole; an image moves as its origin does, by a mean displacement gradient times the
//! distance between both. Each particle's force and energy follow from its own family: nothing is counted
//! twice, and kernels see an image as any other neighbour.

use super::LatticeBonds;
use crate::error::Error;
use crate::geometry::{Lattice, cell};

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

/// Adds empty layers as thick as the horizon beyond the periodic sides; no layers for other axes.
///
/// # Errors
/// [`Error::Geometry`] if the counts overflow.
pub(super) fn widen<const D: usize>(lattice: Lattice<D>, layers: [usize; D]) -> Result<Lattice<D>, Error> {
    if layers == [0; D] {
        return Ok(lattice);
    }
    let cells: [usize; D] = std::array::from_fn(|d| lattice.cells[d] + 2 * layers[d]);
    let total = cells.iter().try_fold(1, |product: usize, &n| product.checked_mul(n));
    let total = total.ok_or_else(|| Error::geometry(format!("a box of {cells:?} cells")))?;
    let mut occupied = vec![false; total];
    for index in (0..lattice.occupied.len()).filter(|&index| lattice.occupied[index]) {
        let inner = cell(index, lattice.cells);
        let place = (0..D).rev().fold(0, |place, d| place * cells[d] + inner[d] + layers[d]);
        occupied[place] = true;
    }
    let origin = std::array::from_fn(|d| lattice.origin[d] - lattice.spacing * layers[d] as f64);
    Ok(Lattice { origin, cells, occupied, ..lattice })
}

impl<const D: usize> LatticeBonds<D> {
    /// Finds the images in the layers of [`widen`], by their sites.
    pub(super) fn find_images(&self, layers: [usize; D]) -> Vec<PeriodicImage<D>> {
        let (cells, spacing) = (self.lattice.cells, self.lattice.spacing);
        let image = |index: usize| {
            let place = cell(index, cells);
            let mut origin = place;
            let mut shift = [0.0; D];
            for d in (0..D).filter(|&d| layers[d] > 0) {
                let count = cells[d] - 2 * layers[d];
                let from_first = place[d] as isize - layers[d] as isize;
                origin[d] = layers[d] + from_first.rem_euclid(count as isize) as usize;
                shift[d] = spacing * (place[d] as f64 - origin[d] as f64);
            }
            let at = (0..D).rev().fold(0, |at, d| at * cells[d] + origin[d]);
            let is_image = shift != [0.0; D] && self.lattice.occupied[at];
            let [site, origin] = [place, origin].map(|place| self.site(place) as u32);
            is_image.then_some(PeriodicImage { site, origin, shift })
        };
        let inside = |index: &usize| {
            let place = cell(*index, cells);
            (0..D).all(|d| (layers[d]..cells[d] - layers[d]).contains(&place[d]))
        };
        let outside = (0..self.lattice.occupied.len()).filter(|index| !inside(index));
        let mut images: Vec<PeriodicImage<D>> = outside.filter_map(image).collect();
        images.sort_unstable_by_key(|image| image.site);
        images
    }
}
