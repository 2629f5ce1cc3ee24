//! Bond laws as materials: no state of a particle, forces by the kernels of [`crate::bonds`].

use super::softened::{SofteningLoss, lacking_energy};
use super::{Bond, Family, LawCover, LawRange, Material, SolverMaterial};
use crate::bonds::{BodyGeometry, Bonds, Overstretched, Property};
use crate::error::Error;
use crate::field::{CHUNK, Field};
use crate::parallel;
use crate::potential::{BondPotential, BondSoftening, EnergyTable, KernelFit, StretchRange, TangentTable};
use crate::stress::StressTensor;
use std::sync::Arc;

/// Ratio of the largest tangent to that at rest above which every particle has the stiffness of its own
/// bonds.
const STIFFENED: f64 = 1.2;
/// Least tangent of a bond in its particles' stiffness, over that at rest.
const LEAST_TANGENT: f64 = 0.25;
/// Samples of a law over a range of stretches.
const SAMPLES: u32 = 200;

/// A bond law with its micromodulus.
#[derive(Clone)]
pub struct BondMaterial<'a> {
    law: Arc<dyn BondPotential + 'a>,
    modulus: f64,
    /// Bonds that soften before they break, and their λ_f.
    soft: Option<(BondSoftening, Property)>,
}

impl<'a> BondMaterial<'a> {
    /// Creates the material of a law, or of a reference to one, in units of kθ = `modulus`, N/m⁶.
    pub fn new(law: impl BondPotential + 'a, modulus: f64) -> Self {
        Self { law: Arc::new(law), modulus, soft: None }
    }

    /// Makes bonds soften to zero load at a stretch λ_f, that of the weaker of their ends.
    pub fn softening(self, softening: BondSoftening, end: Property) -> Self {
        Self { soft: Some((softening, end)), ..self }
    }

    /// The law.
    pub fn law(&self) -> &(dyn BondPotential + 'a) {
        &*self.law
    }

    /// kθ, N/m⁶.
    pub fn modulus(&self) -> f64 {
        self.modulus
    }

    /// 2kθ times the factors of a bond.
    pub(super) fn scale<const D: usize>(&self, bond: &Bond<D>) -> f64 {
        2.0 * self.modulus * bond.weight / bond.volume
    }
}

impl<const D: usize> Material<D> for BondMaterial<'_> {
    type Point = ();

    /// 2kθ t(λ) ζ/|ζ|, Eqs (2.6), (2.47).
    fn force(&self, bond: &Bond<D>, (): &(), (): &()) -> [f64; D] {
        let mut size = self.scale(bond) * self.law.tension_at_strain(bond.strain());
        if let Some((softening, end)) = &self.soft {
            size *= softening.integrity(bond.stretch(), end.weaker(bond.from, bond.to));
        }
        bond.direction().map(|x| size * x)
    }

    /// Σ_J kθ |ξ| φ w V_J, Eq. (2.39).
    fn energy(&self, family: &Family<D>, (): &()) -> f64 {
        let energy = |bond: &Bond<D>| match &self.soft {
            None => self.law.energy(bond.stretch()),
            Some((softening, end)) => {
                softening.energy(&*self.law, bond.stretch(), end.weaker(bond.from, bond.to))
            }
        };
        self.modulus * family.sum(|bond| bond.weight * bond.length * energy(&bond))
    }

    /// Σ_J (2kθ w V_J/|ξ|)·max(|t′|, |t|/λ)(1 + max_{d≠e} |n_d n_e|).
    fn stiffness(&self, family: &Family<D>, _points: &[()]) -> f64 {
        self.modulus
            * family.sum(|bond| {
                let stretch = bond.stretch().max(f64::MIN_POSITIVE);
                let slope = self.law.tension_derivative(stretch).abs();
                let tangent = slope.max(self.law.tension(stretch).abs() / stretch);
                2.0 * bond.weight / bond.length * tangent * (1.0 + mixed(bond.direction()))
            })
    }

    fn micromodulus(&self, _bonds: &dyn BodyGeometry<D>) -> f64 {
        self.modulus * self.law.tangent() / 3.0
    }

    fn respond<'a>(self, _bonds: &dyn Bonds<D>) -> Box<dyn SolverMaterial<D> + 'a>
    where
        Self: 'a,
    {
        let lacking = SofteningLoss::default();
        Box::new(Kernels { material: self, fitted: None, table: None, tangents: None, fit: None, lacking })
    }
}

/// max_{d≠e} |n_d n_e|.
pub(super) fn mixed<const D: usize>(n: [f64; D]) -> f64 {
    let pairs = (0..D).flat_map(|d| (0..d).map(move |e| (d, e)));
    pairs.map(|(d, e)| (n[d] * n[e]).abs()).fold(0.0, f64::max)
}

/// A bond law in the kernels.
struct Kernels<'a> {
    material: BondMaterial<'a>,
    /// Energies of the fit, unless it is a table.
    fitted: Option<EnergyTable>,
    /// Energies of the law over the range of stretches last requested: sampling it takes longer than summing
    /// bonds.
    table: Option<(StretchRange, EnergyTable)>,
    /// Tangents likewise.
    tangents: Option<(StretchRange, TangentTable)>,
    /// The fit, if bonds soften.
    fit: Option<KernelFit>,
    /// Forces that softened bonds of the present displacement have lost.
    lacking: SofteningLoss,
}

impl<const D: usize> SolverMaterial<D> for Kernels<'_> {
    fn bond_law(&self) -> (&dyn BondPotential, f64) {
        (&*self.material.law, self.material.modulus)
    }

    fn cover(
        &mut self,
        bonds: &mut dyn Bonds<D>,
        _displacement: &Field<D>,
        cover: &LawCover,
    ) -> Result<f64, Error> {
        let (law, modulus) = (&*self.material.law, self.material.modulus);
        let mut fit = KernelFit::new(law, cover.stretches, cover.bound)?;
        if cover.clamped {
            fit = fit.clamped();
        }
        bonds.set_law(&fit, modulus);
        self.fitted = EnergyTable::of_fit(&fit, law.energy(1.0));
        self.fit = self.material.soft.is_some().then_some(fit);
        let tangent =
            |stretch: f64| law.tension_derivative(stretch).abs().max(law.tension(stretch).abs() / stretch);
        Ok(samples(cover.stretches).map(tangent).fold(0.0, f64::max) * modulus)
    }

    fn prepare(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>) {
        if let Some(((softening, end), fit)) = self.material.soft.as_ref().zip(self.fit.as_ref()) {
            self.lacking = SofteningLoss::new(&self.material, (*softening, end), fit, bonds, displacement);
        }
    }

    fn has_points(&self) -> bool {
        false
    }

    fn is_fitted_law(&self) -> bool {
        self.material.soft.is_none()
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
    }

    fn piece(&self, bonds: &dyn Bonds<D>) -> usize {
        bonds.piece()
    }

    /// Σ_I V_I Σ_J w V_J kθ |ξ| φ.
    fn energy(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>, observed: StretchRange) -> f64 {
        let (law, modulus) = (&*self.material.law, self.material.modulus);
        if self.fitted.is_none() && self.table.as_ref().is_none_or(|(range, _)| *range != observed) {
            self.table = Some((observed, EnergyTable::new(law, observed)));
        }
        let Some(table) = self.fitted.as_ref().or(self.table.as_ref().map(|(_, table)| table)) else {
            return 0.0;
        };
        let lacking = self.material.soft.as_ref().map(|(softening, end)| {
            modulus * lacking_energy(&self.material, (*softening, end), table, bonds, displacement)
        });
        if let Some(sum) = bonds.energy_sum(displacement, table) {
            return modulus * sum + lacking.unwrap_or(0.0);
        }
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
                    energy += bond.weight * bond.length * table.value(e / (bond.length * bond.length));
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
        let law = &*self.material.law;
        let energy = |bond: &Overstretched| {
            let stretch = (1.0 + bond.elongation).sqrt();
            if let Some((softening, end)) = &self.material.soft {
                let other = bonds.bond(bond.site as usize, bond.index).site;
                let energy = softening.energy(law, stretch, end.weaker(bond.site as usize, other));
                return bonds.volume(bond.site as usize) * bond.weight * bond.length * energy;
            }
            let mut energy = law.energy(stretch.min(most));
            if stretch > most {
                let beyond = bond.elongation - (most * most - 1.0);
                energy += 0.5 * beyond * law.tension(most) / most;
            }
            bonds.volume(bond.site as usize) * bond.weight * bond.length * energy
        };
        Some(self.material.modulus * list.iter().map(energy).sum::<f64>())
    }

    fn has_own_stiffness(&self, tangent: f64) -> bool {
        tangent > STIFFENED * self.material.modulus * self.material.law.tangent().abs()
    }

    /// Σ_J (2 w V_J/|ξ|)·max(|t′|, |t|/λ)(1 + max_{d≠e} |n_d n_e|) with the directions of the deformed bonds.
    fn own_stiffness(
        &mut self,
        bonds: &dyn Bonds<D>,
        displacement: &Field<D>,
        stretches: [f64; 2],
    ) -> Vec<f64> {
        let law = &*self.material.law;
        // bonds crushed to zero have no bound: the law's value at a thousandth
        let [low, high] = stretches.map(|stretch| stretch.powi(2) - 1.0);
        let range = StretchRange { low, high };
        let tangents = self.tangents.take().filter(|(sampled, _)| *sampled == range);
        let (_, table) =
            self.tangents.insert(tangents.unwrap_or_else(|| (range, TangentTable::new(law, range))));
        // a bond past its greatest force is soft, but a light particle would jump when it meets a stiff one
        let least = LEAST_TANGENT * law.tangent().abs();
        let sites = bonds.sites();
        let chunk = |chunk| bonds.stiffness_sums(displacement, chunk, table, least);
        let sums: Vec<Option<Vec<f64>>> = parallel::map(sites.div_ceil(CHUNK), chunk);
        let sums: Option<Vec<Vec<f64>>> = sums.into_iter().collect();
        if let Some(sums) = sums {
            let sums = sums.concat();
            return bonds.particles().iter().map(|&site| sums[site as usize]).collect();
        }
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
                let tangent = table.value(e).max(least);
                let mixed = mixed(zeta) / square.max(f64::MIN_POSITIVE);
                sum += 2.0 * bond.weight / bond.length * tangent * (1.0 + mixed);
            });
            sum
        };
        parallel::map_each(bonds.particles(), of)
    }

    fn range(&self, stretches: [f64; 2]) -> LawRange {
        let law = &*self.material.law;
        let (mut steepest, mut tension) = (0.0_f64, 0.0_f64);
        let mut range = LawRange { mean_tangent: 0.0, least_tangent: f64::INFINITY, least_energy: 0.0 };
        for stretch in samples(stretches) {
            let slope = law.tension_derivative(stretch).abs();
            steepest = steepest.max(slope);
            tension = tension.max(law.tension(stretch) / stretch);
            range.least_tangent = range.least_tangent.min(slope);
            range.least_energy = range.least_energy.min(law.energy(stretch));
        }
        range.mean_tangent = steepest + (D - 1) as f64 * tension;
        range
    }
}

fn samples([low, high]: [f64; 2]) -> impl Iterator<Item = f64> {
    (0..=SAMPLES).map(move |k| low + (high - low) * f64::from(k) / f64::from(SAMPLES))
}
