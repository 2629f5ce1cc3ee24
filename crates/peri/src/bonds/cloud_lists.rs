//! Neighbour lists of a cloud in compressed rows.

use super::cells::CellGrid;
use super::cloud_kernel::GROUP;
use crate::error::Error;
use crate::geometry::{Cut, Gaps, cuts_within, severed};
use crate::parallel;
use std::ops::Range;

/// Neighbours of all sites, ascending; each row padded to whole groups with the site itself.
pub(super) struct NeighbourLists {
    pub(super) starts: Vec<usize>,
    pub(super) neighbours: Vec<u32>,
    /// 1/|ξ| of each bond; 0 for the padding, and where broken.
    pub(super) inverse_length: Vec<f64>,
    /// Intact bonds, each counted from both ends.
    pub(super) directed_bonds: u64,
    /// Sites whose family a cut has divided, ascending.
    pub(super) parted: Vec<u32>,
}

impl NeighbourLists {
    /// Lists all pairs within `horizon`, except those that cross a cut or a gap; `order` is the index of each
    /// point in the input.
    ///
    /// # Errors
    /// [`Error::Geometry`] for two particles in one place.
    pub(super) fn new<const D: usize>(
        points: &[[f64; D]],
        order: &[u32],
        horizon: f64,
        cuts: &[Cut<D>],
        gaps: Option<&Gaps<D>>,
    ) -> Result<Self, Error> {
        // bonds as long as the horizon are bonds, whatever the rounding of positions
        let reach = horizon * (1.0 + 1e-9);
        let grid = CellGrid::new(points, reach);
        let square = |a: usize, b: usize| (0..D).map(|d| (points[b][d] - points[a][d]).powi(2)).sum::<f64>();
        let family = |(own, &here): (usize, &[f64; D])| {
            let mut list = Vec::new();
            let cuts = cuts_within(cuts, here, reach);
            let gaps = gaps.and_then(|gaps| gaps.within(here, reach));
            let (mut twin, mut parted) = (None, false);
            grid.near(here, reach, |other| {
                let square = square(own, other);
                if other != own && square == 0.0 {
                    twin = Some(other);
                }
                if other != own && square <= reach * reach {
                    if severed(&cuts, here, points[other]) {
                        parted = true;
                    } else if !gaps.as_ref().is_some_and(|gaps| gaps.severs(here, points[other])) {
                        list.push(other as u32);
                    }
                }
            });
            if let Some(twin) = twin {
                let (a, b) = (order[own].min(order[twin]), order[own].max(order[twin]));
                return Err(Error::geometry(format!("points {a} and {b} are both at {here:?} m")));
            }
            list.sort_unstable();
            Ok((list, parted))
        };
        let families: Vec<Result<(Vec<u32>, bool), Error>> =
            parallel::map(points.len(), |own| family((own, &points[own])));
        let (mut starts, mut neighbours) = (vec![0], Vec::new());
        let (mut directed_bonds, mut parted) = (0, Vec::new());
        for (own, family) in families.into_iter().enumerate() {
            let (list, is_parted) = family?;
            parted.extend(is_parted.then_some(own as u32));
            directed_bonds += list.len() as u64;
            let padded = list.len().next_multiple_of(GROUP) - list.len();
            neighbours.extend(list);
            neighbours.extend(std::iter::repeat_n(own as u32, padded));
            starts.push(neighbours.len());
        }
        let mut inverse_length = Vec::with_capacity(neighbours.len());
        for own in 0..points.len() {
            for &other in &neighbours[starts[own]..starts[own + 1]] {
                let square = square(own, other as usize);
                inverse_length.push(if square > 0.0 { 1.0 / square.sqrt() } else { 0.0 });
            }
        }
        Ok(Self { starts, neighbours, inverse_length, directed_bonds, parted })
    }

    /// Returns the range of a site's bonds and padding.
    pub(super) fn row(&self, site: usize) -> Range<usize> {
        self.starts[site]..self.starts[site + 1]
    }

    /// Severs bond `k` of a site: like padding, it becomes a bond of zero stiffness to the site itself.
    pub(super) fn break_bond(&mut self, site: u32, k: usize) {
        self.neighbours[k] = site;
        self.inverse_length[k] = 0.0;
        self.directed_bonds -= 1;
    }
}

/// Compressed rows, and the data that turn a volume into a weight.
pub(super) struct NeighbourRows<'a> {
    pub(super) starts: &'a [usize],
    pub(super) neighbours: &'a [u32],
    /// 1/|ξ|; 0 where broken.
    pub(super) inverse_length: &'a [f64],
    /// δ and Δx of the linear volume correction.
    pub(super) partial: Option<[f64; 2]>,
}

impl NeighbourRows<'_> {
    /// V_J/|ξ|², V_J with its correction.
    #[inline(always)]
    pub(super) fn share(&self, inverse: f64, volume: f64) -> f64 {
        let share = inverse * inverse * volume;
        match self.partial {
            None => share,
            // inlined: a call would not inherit the instruction set
            Some([horizon, spacing]) => {
                let part = (horizon + 0.5 * spacing - 1.0 / inverse) / spacing;
                share * part.clamp(0.0, 1.0)
            }
        }
    }
}
