//! Forces, stresses, energies, energy-momentum and flags of a state, for bond laws and solids.

use crate::bonds::Bonds;
use crate::material::{
    BodyTensor, BondMaterial, Family, Material, NonlocalSolid, PointLaw, Pointwise, SolverMaterial, virial,
};
use crate::parallel;
use crate::potential::KernelFit;
use crate::solver::State;
use crate::stress::{BondFits, StressTensor, force_over_length};
use polycore::constitutive::Flags;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A solid of any law.
pub type AnySolid<const D: usize> = NonlocalSolid<Arc<dyn PointLaw<D>>>;

/// Evaluates forces and stresses of a material in the states of a body.
pub struct StressEvaluator<const D: usize>(EvaluatorKind<D>);

enum EvaluatorKind<const D: usize> {
    /// Bond laws, with the solver's fits: bonds then carry the solver's forces.
    Bonds {
        material: Box<BondMaterial<'static>>,
        /// Largest relative error of the fits.
        bound: f64,
        /// True if the law is constant beyond the fitted stretches.
        clamped: bool,
        /// Last fits of all laws, with their stretches.
        last: Mutex<Option<([f64; 2], Vec<KernelFit>)>>,
    },
    Nothing,
    /// A solid, with states of its particles.
    Solid {
        solid: AnySolid<D>,
        learnt: bool,
        states: Mutex<Pointwise<AnySolid<D>, D>>,
    },
}

impl<const D: usize> StressEvaluator<D> {
    /// Creates an empty evaluator: no forces, no stresses.
    pub fn none() -> Self {
        Self(EvaluatorKind::Nothing)
    }

    /// Creates an evaluator of a bond law that is fitted to a relative error of `bound`; the law is `clamped`
    /// beyond the fitted stretches if bonds break.
    pub fn for_bonds(material: BondMaterial<'static>, bound: f64, clamped: bool) -> Self {
        let (material, last) = (Box::new(material), Mutex::new(None));
        Self(EvaluatorKind::Bonds { material, bound, clamped, last })
    }

    /// Creates an evaluator of a solid; `bonds` are those of the reference state. A law `learnt` from data
    /// has flags.
    pub fn for_solid(solid: AnySolid<D>, learnt: bool, bonds: &dyn Bonds<D>) -> Self {
        let states = Mutex::new(Pointwise::new(solid.clone(), bonds));
        Self(EvaluatorKind::Solid { solid, learnt, states })
    }

    /// Bond law, if the material is one.
    pub fn bond_material(&self) -> Option<&BondMaterial<'static>> {
        match &self.0 {
            EvaluatorKind::Bonds { material, .. } => Some(material),
            _ => None,
        }
    }

    /// Sums the forces of the bonds from `sites` to the sites that `wanted` accepts, N, each on its first
    /// particle: `visit` receives that site and the sum.
    pub fn forces(
        &self,
        bonds: &dyn Bonds<D>,
        state: &State<D>,
        sites: &[u32],
        wanted: &dyn Fn(usize) -> bool,
        visit: &mut dyn FnMut(usize, [f64; D]),
    ) {
        match &self.0 {
            EvaluatorKind::Nothing => {}
            EvaluatorKind::Bonds { material, bound, clamped, last } => {
                let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
                if last.as_ref().is_none_or(|(stretches, _)| *stretches != state.stretches.fitted) {
                    let fits = material.fits(state.stretches.fitted, *bound).ok().map(|fits| match clamped {
                        true => fits.into_iter().map(KernelFit::clamped).collect(),
                        false => fits,
                    });
                    *last = fits.map(|fits| (state.stretches.fitted, fits));
                }
                // the solver has made the same fits
                let Some((_, fits)) = &*last else { return };
                let Ok(fits) = BondFits::new(fits, material.shares(), bonds.sites()) else { return };
                for site in sites.iter().map(|&site| site as usize) {
                    let (own, volume) = (state.displacement.get(site), bonds.volume(site));
                    let mut sum = [0.0; D];
                    bonds.neighbours(site, &mut |bond| {
                        if wanted(bond.site) {
                            let other = state.displacement.get(bond.site);
                            let eta: [f64; D] = std::array::from_fn(|d| other[d] - own[d]);
                            let pull = force_over_length(fits, material.modulus(), volume, site, &bond, eta);
                            for d in 0..D {
                                sum[d] += pull * (bond.bond[d] + eta[d]);
                            }
                        }
                    });
                    visit(site, sum);
                }
            }
            EvaluatorKind::Solid { states, .. } => {
                let states = prepared(states, bonds, state);
                for site in sites.iter().map(|&site| site as usize) {
                    let (mut sum, volume) = ([0.0; D], bonds.volume(site));
                    states.bond_forces(bonds, &state.displacement, site, |bond, density| {
                        if wanted(bond.to) {
                            for d in 0..D {
                                sum[d] += volume * bond.volume * density[d];
                            }
                        }
                    });
                    visit(site, sum);
                }
            }
        }
    }

    /// Couples Σ V_I V_J (x_J − x_I) × T_IJ of the bonds of `sites` to the sites that `wanted` accepts, N m.
    ///
    /// Bonds of solids are not parallel to their forces, T_IJ − T_JI, and Σ_J V_J (x_J − x_I) × T_IJ = 0
    /// holds in a whole family only. With these couples, the moment of the forces of `sites` is the moment
    /// that the body transmits.
    pub fn couple(
        &self,
        bonds: &dyn Bonds<D>,
        state: &State<D>,
        sites: &[u32],
        wanted: &dyn Fn(usize) -> bool,
    ) -> [f64; 3] {
        let mut sum = [0.0; 3];
        let EvaluatorKind::Solid { states, .. } = &self.0 else { return sum };
        let states = prepared(states, bonds, state);
        for site in sites.iter().map(|&site| site as usize) {
            let (volume, points) = (bonds.volume(site), states.points());
            Family::new(bonds, &state.displacement, site).each(|bond| {
                if wanted(bond.to) {
                    let part = points[site].own_force(&bond);
                    let at = |of: &dyn Fn(usize) -> f64, d: usize| if d < D { of(d) } else { 0.0 };
                    let (arm, pull) = (|d: usize| bond.reference[d] + bond.change[d], |d: usize| part[d]);
                    for d in 0..3 {
                        let (a, b) = ((d + 1) % 3, (d + 2) % 3);
                        let cross = at(&arm, a) * at(&pull, b) - at(&arm, b) * at(&pull, a);
                        sum[d] += volume * bond.volume * cross;
                    }
                }
            });
        }
        sum
    }

    /// Volume times the mean first Piola–Kirchhoff stress, N·m, see [`virial`].
    pub fn virial(&self, bonds: &dyn Bonds<D>, state: &State<D>) -> Option<StressTensor<D>> {
        match &self.0 {
            EvaluatorKind::Nothing => None,
            EvaluatorKind::Bonds { material, .. } => {
                Some(virial(&**material, &vec![(); bonds.sites()], bonds, &state.displacement))
            }
            EvaluatorKind::Solid { states, .. } => {
                Some(prepared(states, bonds, state).virial(bonds, &state.displacement))
            }
        }
    }

    /// First Piola–Kirchhoff and Cauchy stress of a solid's law in every particle, Pa; `None` for bond laws.
    pub fn stress(&self, bonds: &dyn Bonds<D>, state: &State<D>) -> Option<[Vec<StressTensor<D>>; 2]> {
        let EvaluatorKind::Solid { solid, states, .. } = &self.0 else { return None };
        let states = prepared(states, bonds, state);
        let both = bonds.particles().iter().map(|&site| {
            let point = &states.points()[site as usize];
            let Some(deformation) = point.deformation() else { return ([[0.0; D]; D], [[0.0; D]; D]) };
            let (gradient, law) = (deformation.gradient(), solid.law_of(point));
            let piola = point.respond(law).piola * point.integrity();
            let volume = (1.0 + deformation.volume_change()) * law.thickness_stretch(deformation);
            let cauchy = piola * gradient.transpose() / volume;
            let rows = |t: &BodyTensor<D>| std::array::from_fn(|a| std::array::from_fn(|b| t[(a, b)]));
            (rows(&piola), rows(&cauchy))
        });
        let (piola, cauchy) = both.unzip();
        Some([piola, cauchy])
    }

    /// Computes Eshelby's energy–momentum ∇uᵀP − W 1 of a solid at some sites, Pa; `visit` receives the index
    /// in `sites` with it. Skips bond laws, and particles without deformation gradient.
    pub fn energy_momentum(
        &self,
        bonds: &dyn Bonds<D>,
        state: &State<D>,
        sites: &[u32],
        visit: &mut dyn FnMut(usize, StressTensor<D>),
    ) {
        let EvaluatorKind::Solid { solid, states, .. } = &self.0 else { return };
        let states = prepared(states, bonds, state);
        for (at, &site) in sites.iter().enumerate() {
            let point = &states.points()[site as usize];
            let Some(deformation) = point.deformation() else { continue };
            let law = solid.law_of(point);
            let piola = point.respond(law).piola;
            let tensor = (deformation.displacement_gradient.transpose() * piola
                - BodyTensor::<D>::identity() * point.energy(law).unwrap_or(0.0))
                * point.integrity();
            visit(at, std::array::from_fn(|a| std::array::from_fn(|b| tensor[(a, b)])));
        }
    }

    /// Energy densities of particles, J/m³, by the law itself; `None` without a law.
    pub fn energies(&self, bonds: &dyn Bonds<D>, state: &State<D>) -> Option<Vec<f64>> {
        let family = |site: u32| Family::new(bonds, &state.displacement, site as usize);
        match &self.0 {
            EvaluatorKind::Nothing => None,
            EvaluatorKind::Bonds { material, .. } => {
                let of = |&site: &u32| Material::<D>::energy(&**material, &family(site), &());
                Some(parallel::map_each(bonds.particles(), of))
            }
            EvaluatorKind::Solid { solid, states, .. } => {
                let states = prepared(states, bonds, state);
                let of = |&site: &u32| solid.energy(&family(site), &states.points()[site as usize]);
                Some(parallel::map_each(bonds.particles(), of))
            }
        }
    }

    /// Uncertainties of a learnt law, particle by particle; none for particles without it; `None` for laws in
    /// closed form.
    pub fn flags(&self, bonds: &dyn Bonds<D>, state: &State<D>) -> Option<Vec<Flags>> {
        let EvaluatorKind::Solid { solid, learnt: true, states } = &self.0 else { return None };
        let states = prepared(states, bonds, state);
        let of = |&site: &u32| {
            let point = &states.points()[site as usize];
            point.deformation().map_or(Flags::default(), |found| solid.law_of(point).flags(found))
        };
        Some(parallel::map_each(bonds.particles(), of))
    }

    /// Fractions of particles outside the box of the training data, and with any flag.
    pub fn flagged(&self, bonds: &dyn Bonds<D>, state: &State<D>) -> Option<[f64; 2]> {
        let flags = self.flags(bonds, state)?;
        let share = |is: &dyn Fn(&Flags) -> bool| {
            flags.iter().filter(|flags| is(flags)).count() as f64 / flags.len().max(1) as f64
        };
        Some([share(&|flags| flags.outside.contains(&true)), share(&Flags::any)])
    }
}

/// Computes the states of particles at a displacement.
fn prepared<'a, const D: usize>(
    states: &'a Mutex<Pointwise<AnySolid<D>, D>>,
    bonds: &dyn Bonds<D>,
    state: &State<D>,
) -> MutexGuard<'a, Pointwise<AnySolid<D>, D>> {
    let mut states = states.lock().unwrap_or_else(PoisonError::into_inner);
    // histories of another body are those of no run; the stress is then that without
    let _ = states.recall(bonds, state.memory.duration, &state.memory.values);
    states.prepare(bonds, &state.displacement);
    states
}
