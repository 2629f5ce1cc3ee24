//! The two passes of materials whose forces are linear in a bond, on clouds: moments of family displacements,
//! and forces.
//!
//! The data of a neighbour lie together in four lanes, so that plain loops become vector instructions.

use super::cloud_lists::NeighbourRows;
use super::kernel::{ForceKernel, dispatch};
use super::{BodyGeometry, CloudBonds};
use crate::field::{CHUNK, Field, chunk_range};
use crate::parallel;
use crate::potential::StretchRange;
use pulp::{Arch, Simd, WithSimd};

type FourLanes = [f64; 4];

/// Particles whose forces are summed before they are written.
const BLOCK: usize = 16;

/// A particle in one line of the cache: position and volume, displacement.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct CloudParticle {
    /// X, then V in the last lane.
    x: FourLanes,
    u: FourLanes,
}

/// Particles of a cloud in the layout of both passes.
pub struct CloudPlaces<const D: usize> {
    places: Vec<CloudParticle>,
    /// θ of [`BodyGeometry::relief`]; empty where there is none.
    shifts: Vec<FourLanes>,
}

/// S column by column, with A in the last lane of the first column, or P alike.
pub type MomentColumns<const D: usize> = [FourLanes; D];

/// Moments of a family, over its intact bonds; columns by ξ.
#[derive(Clone, Copy)]
pub struct CloudMoments<const D: usize> {
    /// Σ_J (V_J/|ξ|²)|η|².
    pub square: f64,
    /// Σ_J (V_J/|ξ|²) η⊗ξ.
    pub first: MomentColumns<D>,
    /// Σ_J (V_J/|ξ|²) η⊗(θ_J − θ_I); zero where there is no θ.
    pub shifted: MomentColumns<D>,
}

impl<const D: usize> CloudPlaces<D> {
    /// Builds the layout of an undeformed cloud, without θ.
    pub(super) fn new(position: &Field<D>, volumes: &[f64]) -> Self {
        let place = |(site, &volume): (usize, &f64)| {
            let mut x = lanes(position.get(site));
            x[3] = volume;
            CloudParticle { x, u: [0.0; 4] }
        };
        Self { places: volumes.iter().enumerate().map(place).collect(), shifts: Vec::new() }
    }

    /// Loads a displacement.
    pub fn load(&mut self, displacement: &Field<D>) {
        parallel::for_chunks(&mut self.places, CHUNK, |chunk, places| {
            for (at, place) in places.iter_mut().enumerate() {
                place.u = lanes(displacement.get(chunk * CHUNK + at));
            }
        });
    }

    /// Number of [`MomentColumns`] of a particle in the second pass: S, and P if there is θ.
    pub fn stride(&self) -> usize {
        if self.shifts.is_empty() { 1 } else { 2 }
    }
}

fn lanes<const D: usize>(value: [f64; D]) -> FourLanes {
    std::array::from_fn(|d| if d < D { value[d] } else { 0.0 })
}

impl<const D: usize> CloudBonds<D> {
    /// Builds the layout for both passes, without θ.
    pub fn bare_places(&self) -> CloudPlaces<D> {
        CloudPlaces::new(self.positions(), self.volumes())
    }

    /// Builds the layout for [`Self::moments`] and [`Self::linear_force`].
    pub fn places(&self) -> CloudPlaces<D> {
        let mut places = self.bare_places();
        if let Some(relief) = self.relief() {
            places.shifts = (0..relief.sites()).map(|site| lanes(relief.get(site))).collect();
        }
        places
    }

    /// Computes the moments of the particles of work item `chunk`; `visit` receives each site.
    pub fn moments(
        &self,
        places: &CloudPlaces<D>,
        chunk: usize,
        visit: &mut dyn FnMut(usize, &CloudMoments<D>),
    ) {
        Arch::new().dispatch(CloudMomentPass { lists: self.lists(), places, chunk, visit });
    }

    /// Computes Σ_J (V_J/|ξ|²)[(A_I + A_J) η + (S_I + S_J) ξ + (P_I + P_J)(θ_J − θ_I)] of the particles of
    /// work item `chunk`, with [`CloudPlaces::stride`] `terms` a particle.
    pub fn linear_force(
        &self,
        places: &CloudPlaces<D>,
        terms: &[MomentColumns<D>],
        chunk: usize,
        force: &mut [&mut [f64]; D],
        track: Option<&mut StretchRange>,
    ) {
        let start = chunk_range(chunk, places.places.len()).start;
        dispatch(CloudLinearPass { lists: self.lists(), places, terms }, start, force, track);
    }
}

struct CloudMomentPass<'a, const D: usize> {
    lists: NeighbourRows<'a>,
    places: &'a CloudPlaces<D>,
    chunk: usize,
    visit: &'a mut dyn FnMut(usize, &CloudMoments<D>),
}

impl<const D: usize> WithSimd for CloudMomentPass<'_, D> {
    type Output = ();

    /// Compiles the loop for the instruction set.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let relieved = !self.places.shifts.is_empty();
        for site in chunk_range(self.chunk, self.places.places.len()) {
            let moments = if relieved {
                moments_of::<D, true>(&self.lists, self.places, site)
            } else {
                moments_of::<D, false>(&self.lists, self.places, site)
            };
            (self.visit)(site, &moments);
        }
    }
}

// closures and `array::from_fn` would not inherit the target features, as in the other kernels
#[inline(always)]
#[expect(clippy::needless_range_loop, reason = "lanes of several arrays at once")]
fn moments_of<const D: usize, const RELIEVED: bool>(
    lists: &NeighbourRows,
    places: &CloudPlaces<D>,
    site: usize,
) -> CloudMoments<D> {
    let own = places.places[site];
    let here = if RELIEVED { places.shifts[site] } else { [0.0; 4] };
    let (mut first, mut shifted, mut squares) = ([[0.0; 4]; D], [[0.0; 4]; D], [0.0; 4]);
    let row = lists.starts[site]..lists.starts[site + 1];
    let (neighbours, inverses) = (&lists.neighbours[row.clone()], &lists.inverse_length[row]);
    for k in 0..neighbours.len() {
        let j = neighbours[k] as usize;
        let there = &places.places[j];
        let share = lists.share(inverses[k], there.x[3]);
        let mut weighted = [0.0; 4];
        for a in 0..4 {
            let eta = there.u[a] - own.u[a];
            weighted[a] = share * eta;
            squares[a] += weighted[a] * eta;
        }
        for b in 0..D {
            let xi = there.x[b] - own.x[b];
            for a in 0..4 {
                first[b][a] += weighted[a] * xi;
            }
        }
        if RELIEVED {
            let theta = &places.shifts[j];
            for b in 0..D {
                let shift = theta[b] - here[b];
                for a in 0..4 {
                    shifted[b][a] += weighted[a] * shift;
                }
            }
        }
    }
    CloudMoments { square: squares[0] + squares[1] + squares[2] + squares[3], first, shifted }
}

struct CloudLinearPass<'a, const D: usize> {
    lists: NeighbourRows<'a>,
    places: &'a CloudPlaces<D>,
    terms: &'a [MomentColumns<D>],
}

impl<const D: usize> ForceKernel<D> for CloudLinearPass<'_, D> {
    #[inline(always)]
    fn run<S: Simd>(
        &self,
        _simd: S,
        start: usize,
        force: &mut [&mut [f64]; D],
        track: Option<&mut StretchRange>,
    ) {
        let mut seen = StretchRange::REST;
        // full lanes are kept: three of four would become scalars
        let mut sums = [[0.0; 4]; BLOCK];
        for first in (0..force[0].len()).step_by(BLOCK) {
            let length = BLOCK.min(force[0].len() - first);
            for (k, sum) in sums[..length].iter_mut().enumerate() {
                let site = start + first + k;
                match (self.places.shifts.is_empty(), track.is_some()) {
                    (true, false) => self.sum::<false, false>(site, sum, &mut seen),
                    (true, true) => self.sum::<false, true>(site, sum, &mut seen),
                    (false, false) => self.sum::<true, false>(site, sum, &mut seen),
                    (false, true) => self.sum::<true, true>(site, sum, &mut seen),
                }
            }
            for d in 0..D {
                for k in 0..length {
                    force[d][first + k] = sums[k][d];
                }
            }
        }
        if let Some(range) = track {
            *range = range.join(seen);
        }
    }
}

impl<const D: usize> CloudLinearPass<'_, D> {
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "lanes of several arrays at once")]
    fn sum<const RELIEVED: bool, const TRACK: bool>(
        &self,
        site: usize,
        out: &mut FourLanes,
        seen: &mut StretchRange,
    ) {
        let (lists, places) = (&self.lists, self.places);
        let stride = if RELIEVED { 2 } else { 1 };
        let own = places.places[site];
        let here = if RELIEVED { places.shifts[site] } else { [0.0; 4] };
        let own_slope = self.terms[stride * site][0][3];
        // Σ ξ and Σ (θ_J − θ_I), for the particle's own S and P, and the rest, column by column
        let (mut bonds, mut shifts) = ([0.0; D], [0.0; D]);
        let (mut change, mut stressed, mut relieved) = ([0.0; 4], [[0.0; 4]; D], [[0.0; 4]; D]);
        let row = lists.starts[site]..lists.starts[site + 1];
        let (neighbours, inverses) = (&lists.neighbours[row.clone()], &lists.inverse_length[row]);
        for k in 0..neighbours.len() {
            let j = neighbours[k] as usize;
            let there = &places.places[j];
            let share = lists.share(inverses[k], there.x[3]);
            let stress = &self.terms[stride * j];
            let slope = share * (own_slope + stress[0][3]);
            for a in 0..4 {
                change[a] += slope * (there.u[a] - own.u[a]);
            }
            for b in 0..D {
                let xi = share * (there.x[b] - own.x[b]);
                bonds[b] += xi;
                for a in 0..4 {
                    stressed[b][a] += stress[b][a] * xi;
                }
            }
            if RELIEVED {
                let (piola, theta) = (&self.terms[stride * j + 1], &places.shifts[j]);
                for b in 0..D {
                    let shift = share * (theta[b] - here[b]);
                    shifts[b] += shift;
                    for a in 0..4 {
                        relieved[b][a] += piola[b][a] * shift;
                    }
                }
            }
            if TRACK {
                let mut e = 0.0;
                for d in 0..D {
                    let eta = there.u[d] - own.u[d];
                    e += eta * (2.0 * (there.x[d] - own.x[d]) + eta);
                }
                let e = e * inverses[k] * inverses[k];
                (seen.low, seen.high) = (seen.low.min(e), seen.high.max(e));
            }
        }
        let (stress, piola) = (&self.terms[stride * site], &self.terms[stride * site + stride - 1]);
        for a in 0..4 {
            let mut sum = change[a];
            for b in 0..D {
                sum += stressed[b][a] + stress[b][a] * bonds[b];
                if RELIEVED {
                    sum += relieved[b][a] + piola[b][a] * shifts[b];
                }
            }
            out[a] = sum;
        }
    }
}
