//! Materials by plain loops over families: any [`Material`] with the states of all particles.

use super::{Bond, EnergyPart, Family, LawCover, LawRange, Material, Past, SolverMaterial};
use crate::bonds::{BodyGeometry, Bonds, Overstretched, Property, StretchScan, overstretched};
use crate::error::Error;
use crate::field::{CHUNK, Field, chunk_range};
use crate::parallel;
use crate::potential::{BondPotential, LinearBond, StretchRange};
use crate::stress::StressTensor;

/// The two passes of a material over a whole body, for materials with something faster than plain loops over
/// bonds. States and forces must equal those of [`Material::prepare`] and [`Material::force`] except for
/// rounding.
pub trait Passes<M: Material<D> + ?Sized, const D: usize>: Send + Sync {
    /// The first pass: states of all sites.
    fn prepare(
        &mut self,
        material: &M,
        bonds: &dyn Bonds<D>,
        displacement: &Field<D>,
        points: &mut [M::Point],
    );

    /// Runs the second pass over a work item; see [`SolverMaterial::force`].
    #[expect(clippy::too_many_arguments, reason = "those of the response, and what it has")]
    fn force(
        &self,
        material: &M,
        bonds: &dyn Bonds<D>,
        displacement: &Field<D>,
        points: &[M::Point],
        chunk: usize,
        force: &mut [&mut [f64]; D],
        track: Option<&mut StretchRange>,
    );
}

/// A material with the states of all particles.
pub struct Pointwise<M: Material<D>, const D: usize> {
    material: M,
    /// States, site by site.
    points: Vec<M::Point>,
    /// True if particles have histories.
    remembers: bool,
    passes: Option<Box<dyn Passes<M, D>>>,
    /// kθ of linear bonds of similar stiffness.
    modulus: f64,
    /// Greatest s_I/u_I when stretches last left the covered range.
    tangent: f64,
}

impl<M: Material<D>, const D: usize> Pointwise<M, D> {
    /// Initialises the states of a body in the reference state.
    pub fn new(material: M, bonds: &dyn Bonds<D>) -> Self {
        let rest = Field::zeros(bonds.sites());
        let begin = |&site: &u32| material.begin(&Family::new(bonds, &rest, site as usize));
        let begun: Vec<M::Point> = parallel::map_each(bonds.particles(), begin);
        let mut points = vec![M::Point::default(); bonds.sites()];
        for (&site, point) in bonds.particles().iter().zip(begun) {
            points[site as usize] = point;
        }
        let remembers = points.iter_mut().any(|point| material.past(point).is_some());
        copy_to_images(bonds, &mut points);
        let modulus = material.micromodulus(bonds);
        let passes = material.passes(bonds);
        Self { material, points, remembers, passes, modulus, tangent: 0.0 }
    }

    /// Updates the states of all particles.
    fn visit(
        &mut self,
        bonds: &dyn Bonds<D>,
        displacement: &Field<D>,
        visit: impl Fn(&M, &Family<D>, &mut M::Point) + Sync,
    ) {
        if size_of::<M::Point>() == 0 {
            return;
        }
        let material = &self.material;
        parallel::for_chunks(&mut self.points, CHUNK, |chunk, points| {
            for &site in particles_of(bonds, chunk) {
                let site = site as usize;
                visit(material, &Family::new(bonds, displacement, site), &mut points[site - chunk * CHUNK]);
            }
        });
        copy_to_images(bonds, &mut self.points);
    }

    /// Visits the force densities τ_IJ − τ_JI, N/m⁶, of the intact bonds of a particle, after
    /// [`SolverMaterial::prepare`].
    pub fn bond_forces(
        &self,
        bonds: &dyn Bonds<D>,
        displacement: &Field<D>,
        site: usize,
        mut visit: impl FnMut(&Bond<D>, [f64; D]),
    ) {
        Family::new(bonds, displacement, site).each(|bond| {
            visit(&bond, self.material.force(&bond, &self.points[site], &self.points[bond.to]));
        });
    }

    /// Visits the histories of the particles in their order, if there are any.
    fn pasts(&mut self, bonds: &dyn Bonds<D>, visit: &mut dyn FnMut(&mut Past)) {
        if self.remembers {
            for &site in bonds.particles() {
                self.material.past(&mut self.points[site as usize]).into_iter().for_each(&mut *visit);
            }
        }
    }

    /// Returns true for a material with a state; its energies then refer to a part.
    fn refer_to(&mut self, bonds: &dyn Bonds<D>, part: EnergyPart) -> bool {
        let mut any = false;
        self.pasts(bonds, &mut |past| (past.part, any) = (part, true));
        any
    }

    /// Σ V `of` over the particles, of their points.
    fn sum(&mut self, bonds: &dyn Bonds<D>, of: impl Fn(&M, &mut M::Point) -> f64 + Sync) -> f64 {
        let material = &self.material;
        let items = self.points.chunks_mut(CHUNK).collect();
        let sums = parallel::map_items(items, |chunk, points: &mut [M::Point]| {
            let sites = particles_of(bonds, chunk).iter().map(|&site| site as usize);
            sites
                .map(|site| bonds.volume(site) * of(material, &mut points[site - chunk * CHUNK]))
                .sum::<f64>()
        });
        sums.iter().sum()
    }

    fn prepared_energy(&self, bonds: &dyn Bonds<D>, displacement: &Field<D>) -> f64 {
        let of = |sites: &[u32]| {
            let each = sites.iter().map(|&site| {
                let family = Family::new(bonds, displacement, site as usize);
                family.volume() * self.material.energy(&family, &self.points[site as usize])
            });
            each.sum::<f64>()
        };
        parallel::map_chunks(bonds.particles(), CHUNK, of).iter().sum::<f64>()
    }

    /// The states, site by site.
    pub fn points(&self) -> &[M::Point] {
        &self.points
    }
}

/// Copies the states of particles to their images beyond periodic sides.
pub(super) fn copy_to_images<T: Clone, const D: usize>(bonds: &dyn BodyGeometry<D>, states: &mut [T]) {
    for image in bonds.images() {
        states[image.site as usize] = states[image.origin as usize].clone();
    }
}

/// The particles of a work item.
fn particles_of<const D: usize>(bonds: &dyn Bonds<D>, chunk: usize) -> &[u32] {
    let particles = bonds.particles();
    let range = chunk_range(chunk, bonds.sites());
    let place = |site: usize| particles.partition_point(|&particle| (particle as usize) < site);
    &particles[place(range.start)..place(range.end)]
}

impl<M: Material<D>, const D: usize> SolverMaterial<D> for Pointwise<M, D> {
    fn bond_law(&self) -> (&dyn BondPotential, f64) {
        (&LinearBond, self.modulus)
    }

    fn volumetric(&self) -> f64 {
        self.material.volumetric()
    }

    fn cover(
        &mut self,
        bonds: &mut dyn Bonds<D>,
        displacement: &Field<D>,
        cover: &LawCover,
    ) -> Result<f64, Error> {
        self.prepare(bonds, displacement);
        if let Some(known) = cover.known {
            self.tangent = known;
            return Ok(known);
        }
        let bonds = &*bonds;
        self.visit(bonds, displacement, M::stiffen);
        let of = |&site: &u32| {
            let family = Family::new(bonds, displacement, site as usize);
            let unit = family.sum(|bond| 2.0 * bond.weight / bond.length);
            if unit > 0.0 { self.material.stiffness(&family, &self.points) / unit } else { 0.0 }
        };
        self.tangent = parallel::map_each(bonds.particles(), of).into_iter().fold(0.0, f64::max);
        Ok(self.tangent)
    }

    fn prepare(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>) {
        match &mut self.passes {
            Some(passes) => passes.prepare(&self.material, bonds, displacement, &mut self.points),
            None => self.visit(bonds, displacement, M::prepare),
        }
    }

    fn has_points(&self) -> bool {
        size_of::<M::Point>() > 0
    }

    fn force(
        &self,
        bonds: &dyn Bonds<D>,
        displacement: &Field<D>,
        start: usize,
        force: &mut [&mut [f64]; D],
        mut track: Option<&mut StretchRange>,
    ) {
        let chunk = start / CHUNK;
        if let Some(passes) = &self.passes {
            return passes.force(&self.material, bonds, displacement, &self.points, chunk, force, track);
        }
        force.iter_mut().for_each(|component| component.fill(0.0));
        for &site in particles_of(bonds, chunk) {
            let site = site as usize;
            let mut sum = [0.0; D];
            self.bond_forces(bonds, displacement, site, |bond, density| {
                for d in 0..D {
                    sum[d] += density[d] * bond.volume;
                }
                if let Some(range) = track.as_deref_mut() {
                    let e = bond.elongation();
                    *range = range.join(StretchRange { low: e, high: e });
                }
            });
            for d in 0..D {
                force[d][site - start] = sum[d];
            }
        }
    }

    fn virial(&self, bonds: &dyn Bonds<D>, displacement: &Field<D>) -> StressTensor<D> {
        super::virial(&self.material, &self.points, bonds, displacement)
    }

    fn energy(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>, _met: StretchRange) -> f64 {
        self.prepare(bonds, displacement);
        self.prepared_energy(bonds, displacement)
    }

    fn memory(&mut self, bonds: &dyn Bonds<D>) -> Vec<f64> {
        let mut values = Vec::new();
        self.pasts(bonds, &mut |past| {
            values.extend_from_slice(&past.state);
            values.push(past.stabilisation);
        });
        values
    }

    fn recall(&mut self, bonds: &dyn Bonds<D>, duration: f64, values: &[f64]) -> Result<(), Error> {
        let (mut rest, mut missing) = (values, false);
        self.pasts(bonds, &mut |past| {
            past.duration = duration;
            let width = past.state.len();
            if let Some((own, after)) = rest.split_at_checked(width + 1) {
                past.state.copy_from_slice(&own[..width]);
                (past.stabilisation, rest) = (own[width], after);
            } else {
                missing = !values.is_empty();
            }
        });
        if missing || !rest.is_empty() {
            return Err(Error::geometry(format!("a state of {} values of another body", values.len())));
        }
        Ok(())
    }

    fn stabilise(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>, duration: f64) -> f64 {
        if !self.refer_to(bonds, EnergyPart::Stored) {
            return 0.0;
        }
        let before = self.energy(bonds, displacement, StretchRange::REST);
        self.sum(bonds, |material, point| {
            material.stabilise(point, duration);
            0.0
        });
        before - self.prepared_energy(bonds, displacement)
    }

    fn advance(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>) -> f64 {
        if !self.refer_to(bonds, EnergyPart::Stored) {
            return 0.0;
        }
        self.prepare(bonds, displacement);
        self.sum(bonds, M::advance)
    }

    fn energy_of(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>, part: EnergyPart) -> Option<f64> {
        self.refer_to(bonds, part).then(|| {
            self.prepare(bonds, displacement);
            let energy = self.prepared_energy(bonds, displacement);
            self.refer_to(bonds, EnergyPart::Stored);
            energy
        })
    }

    fn released(&self, _bonds: &dyn Bonds<D>, _list: &[Overstretched], _most: f64) -> Option<f64> {
        None
    }

    fn least_rest(&self) -> f64 {
        self.material.least_rest()
    }

    fn overstretched(
        &self,
        bonds: &dyn Bonds<D>,
        displacement: &Field<D>,
        critical: &Property,
        _seen: &StretchScan,
    ) -> Vec<Overstretched> {
        // passes may track a bond's stretch in another work item than the one that examines it here
        if self.material.least_rest() == 1.0 {
            return overstretched(bonds, displacement, critical, &StretchScan::default());
        }
        let of = |sites: &[u32]| {
            let mut found = Vec::new();
            for &site in sites {
                bonds.neighbours(site as usize, &mut |neighbour| {
                    let bond = Bond::new(site as usize, &neighbour, displacement);
                    let limit = self.material.rest(&bond) * critical.weaker(bond.from, bond.to);
                    let elongation = bond.elongation();
                    if elongation > limit * limit - 1.0 {
                        let (index, length, weight) = (neighbour.index, bond.length, bond.weight);
                        found.push(Overstretched { site, index, elongation, length, weight });
                    }
                });
            }
            found
        };
        let parts: Vec<Vec<Overstretched>> = parallel::map_chunks(bonds.particles(), CHUNK, of);
        parts.concat()
    }

    fn overloaded(
        &mut self,
        bonds: &dyn Bonds<D>,
        displacement: &Field<D>,
        limit: &Property,
        free: &(dyn Fn(usize) -> bool + Sync),
    ) -> Vec<(Overstretched, f64)> {
        let remembers = self.refer_to(bonds, EnergyPart::Driving);
        self.prepare(bonds, displacement);
        let energy = |&site: &u32| {
            let family = Family::new(bonds, displacement, site as usize);
            self.material.energy(&family, &self.points[site as usize])
        };
        let mut energies = vec![0.0; bonds.sites()];
        let each: Vec<f64> = parallel::map_each(bonds.particles(), energy);
        bonds.particles().iter().zip(each).for_each(|(&site, energy)| energies[site as usize] = energy);
        copy_to_images(bonds, &mut energies);
        let released = |bond: &Bond<D>, site: usize| {
            self.material.released_energy(bond, &self.points[site], energies[site]).unwrap_or(0.0)
        };
        let of = |sites: &[u32]| {
            let mut found = Vec::new();
            for &site in sites.iter().filter(|&&site| free(site as usize)) {
                bonds.neighbours(site as usize, &mut |neighbour| {
                    let bond = Bond::new(site as usize, &neighbour, displacement);
                    let elongation = bond.elongation();
                    if elongation > 0.0 && free(bond.to) {
                        let energy = 0.5 * (released(&bond, bond.from) + released(&bond, bond.to));
                        if energy > limit.weaker(bond.from, bond.to) {
                            let (index, length, weight) = (neighbour.index, bond.length, bond.weight);
                            found.push((Overstretched { site, index, elongation, length, weight }, energy));
                        }
                    }
                });
            }
            found
        };
        let parts: Vec<Vec<(Overstretched, f64)>> = parallel::map_chunks(bonds.particles(), CHUNK, of);
        if remembers {
            self.refer_to(bonds, EnergyPart::Stored);
            self.prepare(bonds, displacement);
        }
        parts.concat()
    }

    fn has_own_stiffness(&self, _tangent: f64) -> bool {
        true
    }

    fn own_stiffness(
        &mut self,
        bonds: &dyn Bonds<D>,
        displacement: &Field<D>,
        _stretches: [f64; 2],
    ) -> Vec<f64> {
        self.visit(bonds, displacement, M::stiffen);
        let of = |&site: &u32| {
            self.material.stiffness(&Family::new(bonds, displacement, site as usize), &self.points)
                / self.modulus
        };
        parallel::map_each(bonds.particles(), of)
    }

    fn frequency_bound(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>, enough: f64) -> f64 {
        let own = self.material.frequency_bound((bonds, displacement), &mut self.points, enough);
        if let Some(own) = own {
            return own;
        }
        self.visit(bonds, displacement, M::stiffen);
        let of = |&site: &u32| {
            self.material.stiffness(&Family::new(bonds, displacement, site as usize), &self.points)
        };
        2.0 * parallel::map_each(bonds.particles(), of).into_iter().fold(0.0, f64::max)
    }

    fn crushed(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>, sites: &[u32]) -> Vec<u32> {
        if !self.has_points() {
            return Vec::new();
        }
        self.prepare(bonds, displacement);
        sites.iter().copied().filter(|&site| self.material.is_crushed(&self.points[site as usize])).collect()
    }

    /// Frequencies grow as the bound of the stiffness does.
    fn range(&self, _stretches: [f64; 2]) -> LawRange {
        LawRange { mean_tangent: self.tangent, least_tangent: self.tangent, least_energy: 0.0 }
    }
}
