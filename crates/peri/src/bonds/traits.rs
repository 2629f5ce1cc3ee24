//! Traits of a bonded body: its geometry, the forces of its bonds, and their damage.

use super::lattice_sums::GradientSums;
use super::{CloudBonds, LatticeBonds, LawShares, Overstretched, PeriodicImage, Softened, SoftenedBonds};
use crate::field::{CHUNK, Field};
use crate::potential::{EnergyTable, KernelFit, StretchRange, TangentTable};
use rayon::prelude::*;
use std::ops::Range;

/// A neighbour J of a particle I, as set-up code sees it.
#[derive(Clone, Copy, Debug)]
pub struct Neighbour<const D: usize> {
    /// Site of J.
    pub site: usize,
    /// Number of this bond among those of I, intact or not.
    pub index: u32,
    /// Reference bond ξ = X_J − X_I, m.
    pub bond: [f64; D],
    /// |ξ|, m.
    pub length: f64,
    /// V_J times volume correction and integrity, m³ (without surface correction).
    pub volume: f64,
    /// V_J with all corrections, m³: volume × surface factor.
    pub weight: f64,
    /// θ_J − θ_I of [`BodyGeometry::relief`], m; zero if there is none.
    pub relief: [f64; D],
}

/// Particles of a body of dimension `D` and their families: particles connected by intact bonds.
pub trait BodyGeometry<const D: usize>: Send + Sync {
    /// Storage sites; fields have this length.
    fn sites(&self) -> usize;
    /// Sites that hold a particle, ascending.
    fn particles(&self) -> &[u32];
    /// Reference position of the particle in a site, m.
    fn position(&self, site: usize) -> [f64; D];
    /// Volume of the particle in a site, m³.
    fn volume(&self, site: usize) -> f64;
    /// Horizon δ, m.
    fn horizon(&self) -> f64;
    /// Distance of neighbouring particles (for clouds the cube or square root of the mean volume), m.
    fn spacing(&self) -> f64;
    /// Images beyond periodic sides, by their sites: neighbours of particles without bonds of their own.
    fn images(&self) -> &[PeriodicImage<D>] {
        &[]
    }
    /// Edges of the cell between periodic sides, m; 0 along axes without.
    fn period(&self) -> [f64; D] {
        [0.0; D]
    }
    /// Returns the site of the particle whose image is in a site; other sites themselves.
    fn origin(&self, site: usize) -> usize {
        let found = self.images().binary_search_by_key(&(site as u32), |image| image.site);
        found.map_or(site, |at| self.images()[at].origin as usize)
    }
    /// Visits the intact bonds of a site.
    fn neighbours(&self, site: usize, visit: &mut dyn FnMut(Neighbour<D>));
    /// Returns the intact bond of a site with a [`Neighbour::index`].
    fn bond(&self, site: usize, index: u32) -> Neighbour<D>;
    /// Returns true if an intact bond connects two sites.
    fn is_bonded(&self, site: usize, other: usize) -> bool {
        let mut bonded = false;
        self.neighbours(site, &mut |bond| bonded |= bond.site == other);
        bonded
    }
    /// Number of intact bonds of a site.
    fn bonded(&self, site: usize) -> u32 {
        let mut count = 0;
        self.neighbours(site, &mut |_| count += 1);
        count
    }
    /// Returns true if a site has no intact bond.
    fn is_alone(&self, site: usize) -> bool {
        self.bonded(site) == 0
    }
    /// Number of bonds of a whole family, if all such families are alike: on lattices.
    fn whole_family(&self) -> Option<u32> {
        None
    }
    /// Returns true if a family is whole and no bond of the body has its own weight: sums over all such
    /// families are equal.
    fn has_whole_family(&self, site: usize) -> bool {
        let _ = site;
        false
    }
    /// θ, m, if it is set, see [`BondForces::set_relief`].
    fn relief(&self) -> Option<&Field<D>> {
        None
    }
    /// Finds a bond that only the first of its sites has; `None` if every family is symmetric, as it must be.
    fn one_sided(&self) -> Option<[usize; 2]> {
        self.particles().par_iter().find_map_first(|&site| {
            let mut lone = None;
            self.neighbours(site as usize, &mut |bond| {
                if lone.is_none() && !self.is_bonded(bond.site, site as usize) {
                    lone = Some([site as usize, bond.site]);
                }
            });
            lone
        })
    }
}

/// Kernels of bond laws. All other forces along bonds belong to a [`crate::material::Material`].
pub trait BondForces<const D: usize>: BodyGeometry<D> {
    /// Sets the bond law q(e) and its modulus kθ, N/m⁶.
    fn set_law(&mut self, fit: &KernelFit, modulus: f64);
    /// Sets several laws, each of the particles that `shares` give it, for which they are of this body: a
    /// pass of the kernel for each law, over the bonds with an end of it. Returns false if one of them has no
    /// kernel; then the law of [`Self::set_law`] remains.
    fn set_laws(&mut self, fits: &[&KernelFit], modulus: f64, shares: &LawShares) -> bool;
    /// Sets per-particle surface-correction factors (one field of `D` components over the sites).
    fn set_factors(&mut self, factors: Field<D>);
    /// Sets θ of solids of the mean family deformation, see [`crate::material::relief`]; call it before any
    /// bond breaks. Lattices have none.
    fn set_relief(&mut self, relief: Field<D>) {
        let _ = relief;
    }
    /// Copies a displacement for later calls of [`Self::force`] that read a copy: in mixed precision
    /// ([`LatticeBonds::set_mixed`]), and in clouds, whose forces take longer without a copy. From the first
    /// call on, both return the forces of the displacement last copied.
    fn prepare(&mut self, displacement: &Field<D>) {
        let _ = displacement;
    }
    /// Computes the force densities Σ_J f V_J, N/m³, of whole [`Self::piece`]s from the site `start` on;
    /// tracks, if asked, the stretches of every bond in at least one of the work items that hold its ends.
    fn force(
        &self,
        displacement: &Field<D>,
        start: usize,
        force: &mut [&mut [f64]; D],
        track: Option<&mut StretchRange>,
    );
    /// Granularity of [`Self::force`] in sites: `start` is a multiple of it, and it divides a work item. The
    /// bits of a force may depend on the bonds of the other sites of its piece only.
    fn piece(&self) -> usize {
        CHUNK
    }
    /// Computes the extremes of e = λ² − 1 over bonds with an end in work item `chunk`; those of all items
    /// together are those of the body.
    fn stretches(&self, displacement: &Field<D>, chunk: usize) -> StretchRange;
    /// Lists the intact bonds with e > `least`, up to rounding, by site and [`Neighbour::index`]. `sites` are
    /// whole pieces of one work item; all sites together list each bond from both ends.
    fn suspects(&self, displacement: &Field<D>, sites: Range<usize>, least: f64) -> Vec<[u32; 2]>;
    /// Computes Σ_I V_I Σ_J w V_J |ξ| φ(e) over the body; `None` if bonds must be visited one by one.
    fn energy_sum(&self, displacement: &Field<D>, table: &EnergyTable) -> Option<f64> {
        let _ = (displacement, table);
        None
    }
    /// Computes Σ_J (2 w V_J/|ξ|)·max(table(e), least)·(1 + max_{d≠e} |n_d n_e|) for each site of a work
    /// item, n the direction of the deformed bond; `None` as in [`Self::energy_sum`].
    fn stiffness_sums(
        &self,
        displacement: &Field<D>,
        chunk: usize,
        table: &TangentTable,
        least: f64,
    ) -> Option<Vec<f64>> {
        let _ = (displacement, chunk, table, least);
        None
    }
    /// Computes Σ share ξ⊗ξ/|ξ|² and Σ share η⊗ξ/|ξ|² over the intact bonds of each site of a work item;
    /// `None` as in [`Self::energy_sum`].
    fn gradient_sums(&self, displacement: &Field<D>, chunk: usize) -> Option<Vec<GradientSums<D>>> {
        let _ = (displacement, chunk);
        None
    }
}

/// Damage of bonds.
pub trait BondDamage<const D: usize>: BodyGeometry<D> {
    /// Severs bonds, each given from both ends.
    fn break_bonds(&mut self, bonds: &[Overstretched]);
    /// Damaged bonds (integrity below 1).
    fn softening(&self) -> &SoftenedBonds;
    /// Replaces the softened bonds, each given from both ends: [`BodyGeometry::neighbours`] weighs them by
    /// their integrity, [`BondForces::force`] does not.
    fn soften(&mut self, bonds: Vec<Softened>);
    /// Bits of the intact bonds, for checkpoints: as many words as [`Self::restore`] takes.
    fn intact(&self) -> Vec<u64>;
    /// Word and bit of a bond in [`Self::intact`], by site and [`Neighbour::index`].
    fn bit(&self, site: usize, index: u32) -> (usize, u64);
    /// Severs the bonds that are not intact in `words`; returns false if their number does not fit these
    /// bonds.
    fn restore(&mut self, words: &[u64]) -> bool;
    /// Intact bonds, each counted from both ends: the work of one force evaluation.
    fn directed_bonds(&self) -> u64;
}

/// The two representations, for functions that only one of them has.
pub enum BondKind<'a, const D: usize> {
    /// A regular lattice.
    Lattice(&'a LatticeBonds<D>),
    /// A cloud.
    Cloud(&'a CloudBonds<D>),
}

/// The bonds of a body: its geometry, the kernels of bond laws, and damage.
pub trait Bonds<const D: usize>: BondForces<D> + BondDamage<D> {
    /// Bytes held for bonds and particles.
    fn bytes(&self) -> usize;
    /// Representation of these bonds.
    fn kind(&self) -> BondKind<'_, D>;
    /// The lattice behind these bonds, if there is one.
    fn as_lattice(&self) -> Option<&LatticeBonds<D>> {
        if let BondKind::Lattice(lattice) = self.kind() { Some(lattice) } else { None }
    }
}
