//! Bond laws as solvers use them: forces by the kernels of [`crate::bonds`].

use super::bonded::mixed;
use super::fitted_law::FittedLaw;
use super::softened::{SofteningLoss, lacking_energy};
use super::{BondMaterial, LawCover, LawRange, SolverMaterial};
use crate::bonds::{Bonds, Overstretched};
use crate::error::Error;
use crate::field::{CHUNK, Field};
use crate::parallel;
use crate::potential::{BondPotential, KernelFit, StretchRange, TangentTable};
use crate::stress::StressTensor;

/// Ratio of the largest tangent to that at rest above which every particle has the stiffness of its own
/// bonds.
const STIFFENED: f64 = 1.2;
/// Least tangent of a bond in its particles' stiffness, over that at rest.
const LEAST_TANGENT: f64 = 0.25;

/// Bond laws in the kernels. If one of several is a table, the kernels evaluate that of the rest, and plain
/// loops the bonds of other laws.
pub(super) struct BondKernels<'a> {
    material: BondMaterial<'a>,
    /// All laws, that of the rest first.
    laws: Vec<FittedLaw<'a>>,
    /// Particles with bonds of other laws, by site, unless kernels evaluate all laws.
    beside: Vec<u32>,
    /// Forces that softened bonds of the present displacement have lost.
    lacking: SofteningLoss,
}

impl<'a> BondKernels<'a> {
    pub fn new(material: BondMaterial<'a>) -> Self {
        let laws = material.laws().cloned().map(FittedLaw::new).collect();
        Self { material, laws, beside: Vec::new(), lacking: SofteningLoss::default() }
    }

    /// Computes the mean of a quantity of the laws of a bond, by their numbers.
    #[inline]
    fn mean(&self, from: usize, to: usize, of: impl Fn(&FittedLaw<'a>) -> f64) -> f64 {
        match self.material.shares() {
            None => of(&self.laws[0]),
            Some(shares) => shares.mean(from, to, |number| of(&self.laws[number])),
        }
    }

    /// Tabulates the tangents within stretches; returns the least that bounds of stiffness take.
    fn sample_tangents(&mut self, stretches: [f64; 2]) -> f64 {
        // bonds crushed to zero have no bound: the law's value at a thousandth
        let [low, high] = stretches.map(|stretch| stretch.powi(2) - 1.0);
        self.laws.iter_mut().for_each(|law| law.sample_tangents(StretchRange { low, high }));
        // a bond past its greatest force is soft, but a light particle would jump when it meets a stiff one
        LEAST_TANGENT * self.material.law().tangent().abs()
    }

    /// Replaces the forces of particles beside other laws in the sites from `start` on.
    fn replace_forces<const D: usize>(
        &self,
        bonds: &dyn Bonds<D>,
        displacement: &Field<D>,
        start: usize,
        force: &mut [&mut [f64]; D],
    ) {
        let end = start + force[0].len();
        let place = |site: usize| self.beside.partition_point(|&own| (own as usize) < site);
        for site in self.beside[place(start)..place(end)].iter().map(|&site| site as usize) {
            let (own, mut sum) = (displacement.get(site), [0.0; D]);
            bonds.neighbours(site, &mut |bond| {
                let other = displacement.get(bond.site);
                let eta: [f64; D] = std::array::from_fn(|d| other[d] - own[d]);
                let e = (0..D).map(|d| eta[d] * (2.0 * bond.bond[d] + eta[d])).sum::<f64>();
                let e = e / (bond.length * bond.length);
                let pull = self.mean(site, bond.site, |law| law.pull(e));
                let pull = 2.0 * self.material.modulus() * bond.weight / bond.length * pull;
                for d in 0..D {
                    sum[d] += pull * (bond.bond[d] + eta[d]);
                }
            });
            for d in 0..D {
                force[d][site - start] = sum[d];
            }
        }
    }
}

impl<const D: usize> SolverMaterial<D> for BondKernels<'_> {
    fn bond_law(&self) -> (&dyn BondPotential, f64) {
        (self.material.law(), self.material.modulus())
    }

    fn cover(
        &mut self,
        bonds: &mut dyn Bonds<D>,
        _displacement: &Field<D>,
        cover: &LawCover,
    ) -> Result<f64, Error> {
        let mut steepest = 0.0_f64;
        for (number, law) in self.laws.iter_mut().enumerate() {
            let found = law.cover(cover).map_err(|error| self.material.of_law(number, error))?;
            steepest = steepest.max(found);
        }
        let (fits, modulus): (Vec<&KernelFit>, _) =
            (self.laws.iter().filter_map(|law| law.fit.as_ref()).collect(), self.material.modulus());
        bonds.set_law(fits[0], modulus);
        if let Some(shares) = self.material.shares() {
            shares.check(bonds.sites())?;
            let kernels = bonds.set_laws(&fits, modulus, shares);
            self.beside = if kernels { Vec::new() } else { shares.beside_others(bonds) };
        }
        Ok(steepest * self.material.modulus())
    }

    fn prepare(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>) {
        if let Some((soft, fit)) = self.material.soft.as_ref().zip(self.laws[0].fit.as_ref()) {
            self.lacking = SofteningLoss::new(&self.material, soft, fit, bonds, displacement);
        }
    }

    fn has_points(&self) -> bool {
        false
    }

    fn is_fitted_law(&self) -> bool {
        self.material.soft.is_none() && self.laws.len() == 1
    }

    fn tangents(&mut self, stretches: [f64; 2]) -> Option<(&TangentTable, f64)> {
        let least = self.sample_tangents(stretches);
        let table = self.laws[0].tangents().filter(|_| self.laws.len() == 1)?;
        Some((table, least))
    }

    fn force(
        &self,
        bonds: &dyn Bonds<D>,
        displacement: &Field<D>,
        start: usize,
        force: &mut [&mut [f64]; D],
        track: Option<&mut StretchRange>,
    ) {
        bonds.force(displacement, start, force, track);
        if self.material.soft.is_some() {
            self.lacking.add(start, force);
        }
        if !self.beside.is_empty() {
            self.replace_forces(bonds, displacement, start, force);
        }
    }

    fn piece(&self, bonds: &dyn Bonds<D>) -> usize {
        bonds.piece()
    }

    /// Σ_I V_I Σ_J w V_J kθ |ξ| φ.
    fn energy(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>, observed: StretchRange) -> f64 {
        self.laws.iter_mut().for_each(|law| law.sample_energies(observed));
        let modulus = self.material.modulus();
        let Some(table) = self.laws[0].energies() else { return 0.0 };
        let lacking = self
            .material
            .soft
            .as_ref()
            .map(|soft| modulus * lacking_energy(&self.material, soft, table, bonds, displacement));
        if self.laws.len() == 1
            && let Some(sum) = bonds.energy_sum(displacement, table)
        {
            return modulus * sum + lacking.unwrap_or(0.0);
        }
        let this = &*self;
        let of = |sites: &[u32]| {
            let mut sum = 0.0;
            for &site in sites {
                let own = displacement.get(site as usize);
                let mut energy = 0.0;
                bonds.neighbours(site as usize, &mut |bond| {
                    let other = displacement.get(bond.site);
                    let mut e = 0.0;
                    for d in 0..D {
                        let eta = other[d] - own[d];
                        e += eta * (2.0 * bond.bond[d] + eta);
                    }
                    let e = e / (bond.length * bond.length);
                    let density = this.mean(site as usize, bond.site, |law| {
                        law.energies().map_or(0.0, |table| table.value(e))
                    });
                    energy += bond.weight * bond.length * density;
                });
                sum += bonds.volume(site as usize) * energy;
            }
            sum
        };
        modulus * parallel::map_chunks(bonds.particles(), CHUNK, of).iter().sum::<f64>()
            + lacking.unwrap_or(0.0)
    }

    fn virial(&self, bonds: &dyn Bonds<D>, displacement: &Field<D>) -> StressTensor<D> {
        super::virial(&self.material, &vec![(); bonds.sites()], bonds, displacement)
    }

    /// Half of a bond's energy 2kθ|ξ|φ w V_I V_J from either end. q is constant beyond the fit, so the energy
    /// grows with half of it.
    fn released(&self, bonds: &dyn Bonds<D>, list: &[Overstretched], most: f64) -> Option<f64> {
        let material = &self.material;
        let energy = |bond: &Overstretched| {
            let stretch = (1.0 + bond.elongation).sqrt();
            let (site, other) = (bond.site as usize, || bonds.bond(bond.site as usize, bond.index).site);
            if let Some(soft) = &material.soft {
                let (softening, end) = soft.of_bond(site, other());
                let energy = softening.energy(material.law(), stretch, end);
                return bonds.volume(site) * bond.weight * bond.length * energy;
            }
            let of = |law: &dyn BondPotential| {
                let mut energy = law.energy(stretch.min(most));
                if stretch > most {
                    let beyond = bond.elongation - (most * most - 1.0);
                    energy += 0.5 * beyond * law.tension(most) / most;
                }
                energy
            };
            let energy =
                if self.laws.len() == 1 { of(material.law()) } else { material.mean(site, other(), of) };
            bonds.volume(site) * bond.weight * bond.length * energy
        };
        Some(material.modulus() * list.iter().map(energy).sum::<f64>())
    }

    fn has_own_stiffness(&self, tangent: f64) -> bool {
        let softest = self.material.laws().map(|law| law.tangent().abs()).fold(f64::INFINITY, f64::min);
        tangent > STIFFENED * self.material.modulus() * softest
    }

    /// Σ_J (2 w V_J/|ξ|)·max(|t′|, |t|/λ)(1 + max_{d≠e} |n_d n_e|) with the directions of the deformed bonds.
    fn own_stiffness(
        &mut self,
        bonds: &dyn Bonds<D>,
        displacement: &Field<D>,
        stretches: [f64; 2],
    ) -> Vec<f64> {
        let least = self.sample_tangents(stretches);
        if self.laws.len() == 1
            && let Some(table) = self.laws[0].tangents()
        {
            let sites = bonds.sites();
            let chunk = |chunk| bonds.stiffness_sums(displacement, chunk, table, least);
            let sums: Vec<Option<Vec<f64>>> = parallel::map(sites.div_ceil(CHUNK), chunk);
            let sums: Option<Vec<Vec<f64>>> = sums.into_iter().collect();
            if let Some(sums) = sums {
                let sums = sums.concat();
                return bonds.particles().iter().map(|&site| sums[site as usize]).collect();
            }
        }
        let this = &*self;
        let of = |&site: &u32| {
            let own = displacement.get(site as usize);
            let mut sum = 0.0;
            bonds.neighbours(site as usize, &mut |bond| {
                let other = displacement.get(bond.site);
                let mut zeta = [0.0; D];
                let mut square = 0.0;
                for d in 0..D {
                    zeta[d] = bond.bond[d] + other[d] - own[d];
                    square += zeta[d] * zeta[d];
                }
                let e = square / (bond.length * bond.length) - 1.0;
                let tangent = this
                    .mean(site as usize, bond.site, |law| law.tangents().map_or(0.0, |table| table.value(e)))
                    .max(least);
                let mixed = mixed(zeta) / square.max(f64::MIN_POSITIVE);
                sum += 2.0 * bond.weight / bond.length * tangent * (1.0 + mixed);
            });
            sum
        };
        parallel::map_each(bonds.particles(), of)
    }

    fn softens_at(&self, stretch: f64) -> bool {
        self.material.laws().any(|law| law.tension_derivative(stretch) < 0.0)
    }

    /// Bounds of all laws.
    fn range(&self, stretches: [f64; 2]) -> LawRange {
        let ranges = self.laws.iter().map(|law| law.range(stretches, D));
        let nothing = LawRange { mean_tangent: 0.0, least_tangent: f64::INFINITY, least_energy: 0.0 };
        ranges.fold(nothing, |a, b| LawRange {
            mean_tangent: a.mean_tangent.max(b.mean_tangent),
            least_tangent: a.least_tangent.min(b.least_tangent),
            least_energy: a.least_energy.min(b.least_energy),
        })
    }
}
