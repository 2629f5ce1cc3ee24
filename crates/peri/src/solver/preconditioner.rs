//! Approximate inverse of the body's stiffness, for gradients of its energy: B g = ω g/(V M) + P A_c⁻¹ Pᵀ g,
//! with the Gershgorin mass M of dynamic relaxation and a coarse level.

use super::coarse::{BondCounts, CoarseBody, CoarseLevel};
use super::face_springs::{FaceSprings, HeldFace};
use super::mass::{has_own_mass, own_mass, update_unit_mass};
use super::particle_map::{ParticleMap, in_order};
use super::state::State;
use super::system::System;
use crate::bonds::BodyGeometry;
use crate::contact::Spring;
use crate::field::{CHUNK, Field, chunk_range};

/// Limits of the coarse level's degrees of freedom, in two and three dimensions: at least, particles per
/// degree of freedom, and at most.
const LEAST: [usize; 2] = [30_000, 8_000];
const SHARE: [usize; 2] = [8, 40];
const MOST: [usize; 2] = [125_000, 30_000];

/// The approximate inverse.
pub struct Preconditioner<const D: usize> {
    /// ω/(V M) of each particle.
    local: Vec<f64>,
    /// V of each particle.
    volumes: Vec<f64>,
    /// Gershgorin sums of each site for a unit bond tangent.
    unit_mass: Vec<f64>,
    /// The smallest of `local`, used for unsupported particles.
    least: f64,
    /// Faces in contact; `None`: in `local`.
    faces: Option<FaceSprings<D>>,
    coarse: Option<CoarseLevel<D>>,
}

impl<const D: usize> Preconditioner<D> {
    /// Creates an empty preconditioner.
    pub fn new() -> Self {
        Self {
            local: Vec::new(),
            volumes: Vec::new(),
            unit_mass: Vec::new(),
            least: 0.0,
            faces: None,
            coarse: None,
        }
    }

    /// Returns true if it is built.
    pub fn is_built(&self) -> bool {
        !self.local.is_empty()
    }

    /// Builds it from the present state only: `weight` is ω, `coarsening` the edge of a coarse cell over the
    /// particle spacing; `None`: without a coarse level.
    pub fn build(&mut self, system: &mut System<D>, state: &State<D>, weight: f64, coarsening: Option<f64>) {
        // half the Gershgorin sum is about a particle's own stiffness
        let mut springs = Vec::new();
        let own = has_own_mass(system, state);
        if own {
            own_mass(system, state, &mut springs);
        }
        let system = &*system;
        let (bonds, sites) = (&*system.bonds, system.bonds.sites());
        let survey = BondCounts::new(bonds, &state.displacement);
        self.unit_mass.resize(sites, 1.0);
        self.volumes = bonds.particles().iter().map(|&site| bonds.volume(site as usize)).collect();
        update_unit_mass(bonds, bonds.particles(), &mut self.unit_mass);
        let (law, modulus) = system.material.bond_law();
        let tangent = if own { modulus } else { state.stretches.tangent };
        if !own {
            springs.clone_from(&self.unit_mass);
        }
        let particles = bonds.particles().iter().map(|&site| site as usize);
        particles.filter(|&site| survey.bonded[site] == 0).for_each(|site| springs[site] = 0.0);
        springs.iter_mut().for_each(|m| *m *= 0.5 * tangent);
        let mut faces = Vec::new();
        if let Some(contact) = system.repulsion().filter(|_| coarsening.is_some()) {
            let visit: &mut Spring<D> = &mut |below, directions| {
                faces.push(HeldFace { below: below.to_vec(), directions: directions.to_vec() });
            };
            contact.springs(&state.displacement, visit);
            contact.pair_springs(bonds, &state.displacement, visit);
        }
        self.set_local(bonds, &springs, weight);
        let few = faces.len() <= bonds.particles().len();
        let exact = || FaceSprings::new(&faces, bonds.particles(), &system.loads, &self.local);
        self.faces = few.then(exact).flatten();
        if self.faces.is_none()
            && let Some(contact) = system.repulsion()
        {
            contact.add_to_diagonal(bonds, &state.displacement, &mut springs);
            self.set_local(bonds, &springs, weight);
        }
        let body = CoarseBody {
            bonds,
            loads: &system.loads,
            displacement: &state.displacement,
            law: (law, [modulus, system.material.volumetric()], state.stretches.fitted),
            springs: &springs,
            survey: &survey,
            faces: &faces,
        };
        let old = self.coarse.take();
        let Some(coarsening) = coarsening else { return };
        let most = (self.volumes.len() / SHARE[D - 2]).clamp(LEAST[D - 2], MOST[D - 2]);
        self.coarse = CoarseLevel::new(&body, coarsening * bonds.spacing(), most, old);
    }

    /// Computes the local part from the springs of sites, N/m⁵.
    fn set_local(&mut self, bonds: &dyn BodyGeometry<D>, springs: &[f64], weight: f64) {
        let local = |(&site, volume): (&u32, &f64)| {
            let spring = springs[site as usize];
            if spring > 0.0 { weight / (volume * spring) } else { f64::INFINITY }
        };
        self.local = bonds.particles().iter().zip(&self.volumes).map(local).collect();
        self.least = self.local.iter().copied().fold(f64::INFINITY, f64::min);
        if !self.least.is_finite() {
            self.least = 1.0;
        }
        self.local.iter_mut().filter(|local| local.is_infinite()).for_each(|local| *local = self.least);
    }

    /// Updates the local part where bonds broke; the coarse part stays.
    pub fn bonds_broke(&mut self, bonds: &dyn BodyGeometry<D>, sites: &[u32]) {
        let before: Vec<f64> = sites.iter().map(|&site| self.unit_mass[site as usize]).collect();
        update_unit_mass(bonds, sites, &mut self.unit_mass);
        for (&site, before) in sites.iter().zip(before) {
            let Ok(particle) = bonds.particles().binary_search(&site) else { continue };
            let local = &mut self.local[particle];
            let alone = bonds.is_alone(site as usize);
            if alone && let Some(faces) = &mut self.faces {
                faces.release_particle(particle);
            }
            *local = if alone { self.least } else { *local * before / self.unit_mass[site as usize] };
        }
    }

    /// Computes z = B g over particles, or its local part only; g and z are zero where components are
    /// constrained, equal over a region where they are shared.
    pub fn apply(
        &mut self,
        places: &ParticleMap,
        gradient: &Field<D>,
        result: &mut Field<D>,
        local_only: bool,
    ) {
        if let Some(coarse) = self.coarse.as_mut().filter(|_| !local_only) {
            coarse.solve(gradient);
        }
        let Self { local, faces, coarse, .. } = self;
        let coarse = coarse.as_ref().filter(|_| !local_only);
        let (g, particles) = (gradient.components(), gradient.sites());
        in_order(result.chunks_mut(), |chunk, z| {
            let range = chunk_range(chunk, particles);
            let (start, local) = (chunk * CHUNK, &local[range.clone()]);
            for d in 0..D {
                let (z, g) = (&mut *z[d], &g[d][range.clone()]);
                for k in 0..z.len() {
                    z[k] = g[k] * local[k];
                }
            }
            let Some(coarse) = coarse else { return };
            for particle in range.clone() {
                let value = coarse.value(particle);
                for d in 0..D {
                    z[d][particle - start] += value[d];
                }
            }
            for held in places.constrained(range) {
                for d in (0..D).filter(|d| held.components >> d & 1 == 1) {
                    z[d][held.particle - start] = 0.0;
                }
            }
        });
        if let Some(faces) = faces {
            faces.correct(gradient, result);
        }
        for (components, particles) in places.shared() {
            let of = |particle: usize| {
                let (g, value) = (gradient.get(particle), coarse.map_or([0.0; D], |own| own.value(particle)));
                std::array::from_fn::<f64, D, _>(|d| g[d] * local[particle] + value[d])
            };
            let each = particles.iter().map(|&particle| of(particle));
            let sum = each.fold([0.0; D], |sum, z| std::array::from_fn(|d| sum[d] + z[d]));
            for &particle in particles {
                let mut z = result.get(particle);
                (0..D)
                    .filter(|d| components >> d & 1 == 1)
                    .for_each(|d| z[d] = sum[d] / particles.len() as f64);
                result.set(particle, z);
            }
        }
    }

    /// Local part of each particle, m/N.
    #[cfg(feature = "gpu")]
    pub fn local(&self) -> &[f64] {
        &self.local
    }

    /// Volume of each particle, m³.
    pub fn volumes(&self) -> &[f64] {
        &self.volumes
    }

    /// Degrees of freedom of the coarse level and entries of its factors.
    pub fn coarse_size(&self) -> [usize; 2] {
        self.coarse.as_ref().map_or([0; 2], CoarseLevel::size)
    }
}
