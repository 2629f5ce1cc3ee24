//! Friction between equilibria: the normal forces are those at the start of the load step, and what has slipped since then
//! stands for the velocity. The force is the gradient of Σ μN f₀(|Δu_t|), f₀(x) = −x³/3ε² + x²/ε + ε/3 below ε and x from there on
//! (Li et al. (2020), doi:10.1145/3386569.3392425): convex, so that equilibria exist and methods that seek a minimum find them.

use super::friction::{across, tangential};
use crate::field::{CHUNK, Field};
use crate::geometry::length;
use rayon::prelude::*;

/// What holds a particle across a normal.
#[derive(Clone, Copy)]
pub struct Grip<const D: usize> {
    pub site: u32,
    pub other: Other,
    /// μN over the particle's volume, N/m³.
    pub bound: f64,
    pub normal: [f64; D],
    /// Volume of the particle, m³.
    pub volume: f64,
}

/// The other side.
#[derive(Clone, Copy)]
pub enum Other {
    /// A particle.
    Site(u32),
    /// A plane, by its number.
    Plane(usize),
}

/// All that rubs in a load step.
pub struct Lagged<const D: usize> {
    /// Displacement at the start of the step.
    pub start: Field<D>,
    /// Work item by work item, by their sites.
    pub grips: Vec<Vec<Grip<D>>>,
    /// ε, m.
    pub slip: f64,
}

impl<const D: usize> Lagged<D> {
    /// What has slipped, m; `moved` is how far each plane has moved in this step.
    fn slipped(&self, grip: &Grip<D>, displacement: &Field<D>, moved: &[[f64; D]]) -> [f64; D] {
        let since = |site: u32| {
            let (now, then) = (displacement.get(site as usize), self.start.get(site as usize));
            std::array::from_fn::<f64, D, _>(|d| now[d] - then[d])
        };
        let (own, other) = (
            since(grip.site),
            match grip.other {
                Other::Site(site) => since(site),
                Other::Plane(plane) => moved[plane],
            },
        );
        across(&grip.normal, std::array::from_fn(|d| own[d] - other[d]))
    }

    /// Adds the force densities on the sites from `start` on, of one work item: all, or those of planes alone.
    pub fn force(
        &self,
        displacement: &Field<D>,
        moved: &[[f64; D]],
        start: usize,
        planes_only: bool,
        force: &mut [&mut [f64]; D],
    ) {
        let grips = &self.grips[start / CHUNK];
        let at = |site: usize| grips.partition_point(|grip| (grip.site as usize) < site);
        let grips = grips[at(start)..at(start + force[0].len())].iter();
        for grip in grips.filter(|grip| !planes_only || matches!(grip.other, Other::Plane(_))) {
            let slipped = self.slipped(grip, displacement, moved);
            let rub = tangential(grip.bound, self.slip, &grip.normal, slipped);
            for d in 0..D {
                force[d][grip.site as usize - start] += rub[d];
            }
        }
    }

    /// Energy that it has taken since the start of the step, J, and the force of each plane, N.
    pub fn taken(&self, displacement: &Field<D>, moved: &[[f64; D]]) -> (f64, Vec<[f64; 3]>) {
        let of = |grips: &Vec<Grip<D>>| {
            let (mut taken, mut forces) = (0.0, vec![[0.0; 3]; moved.len()]);
            for grip in grips {
                let slipped = self.slipped(grip, displacement, moved);
                let x = length(slipped) / self.slip;
                let path = if x < 1.0 { (1.0 - x / 3.0) * x * x } else { x - 1.0 / 3.0 };
                let energy = grip.bound * grip.volume * path * self.slip;
                match grip.other {
                    // the other half is seen from the other side
                    Other::Site(_) => taken += 0.5 * energy,
                    Other::Plane(plane) => {
                        taken += energy;
                        let rub = tangential(grip.bound, self.slip, &grip.normal, slipped);
                        (0..D).for_each(|d| forces[plane][d] += rub[d] * grip.volume);
                    }
                }
            }
            (taken, forces)
        };
        let parts: Vec<_> = self.grips.par_iter().map(of).collect();
        let mut all = (0.0, vec![[0.0; 3]; moved.len()]);
        for (taken, forces) in parts {
            all.0 += taken;
            all.1.iter_mut().zip(forces).for_each(|(sum, force)| (0..3).for_each(|d| sum[d] += force[d]));
        }
        all
    }

    /// Adds the greatest stiffness 2μN/ε to masses, in units of `tangent`, with the factor 2 of components that mix.
    pub fn add_stiffness(&self, tangent: f64, masses: &mut [f64]) {
        for grip in self.grips.iter().flatten() {
            masses[grip.site as usize] += 4.0 * grip.bound / (self.slip * tangent);
        }
    }
}
