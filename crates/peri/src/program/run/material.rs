//! A body with its material, as a variant of a scene asks for them.

use crate::bonds::{Bonds, Property};
use crate::calibrate;
use crate::correction::{bond_factors, surface_factors};
use crate::critical::{Context, Critical, Crossing, Toughness, bilinear, energy_limit};
use crate::error::Error;
use crate::material::{
    BondMaterial, Family, Material, NonlocalSolid, PointLaw, Pointwise, Prestrained, Response,
    energy_at_strength,
};
use crate::potential::{BondPotential, KernelFit};
use crate::program::run::Failure;
use crate::program::scene::{self, Body, Followed, Inclusions, Scene, SurfaceCorrection, Variant};
use crate::solver::{Criterion, State};
use crate::stress::{Tensor, force_over_length};
use harness::scene::Source;
use polycore::constitutive::Flags;
use rayon::prelude::*;
use std::sync::{Arc, Mutex, PoisonError};

/// A solid of any law.
pub type Solid<const D: usize> = NonlocalSolid<Arc<dyn PointLaw<D>>>;

/// What acts between the particles of a scene.
pub enum Acting<const D: usize> {
    /// A bond law.
    Bonds(BondMaterial<'static>),
    /// A bond law with prestrains.
    Prestrained(Prestrained<D>),
    /// A solid of the mean deformation of a family.
    Solid(Solid<D>),
}

impl<const D: usize> Acting<D> {
    /// For the solver.
    pub fn respond(&self, bonds: &dyn Bonds<D>) -> Box<dyn Response<D>> {
        match self {
            Self::Bonds(bonded) => bonded.clone().respond(bonds),
            Self::Prestrained(prestrained) => prestrained.clone().respond(bonds),
            Self::Solid(solid) => solid.clone().respond(bonds),
        }
    }

    /// Longitudinal modulus at rest, Pa.
    pub fn longitudinal_modulus(&self, bonds: &dyn Bonds<D>) -> f64 {
        match self {
            Self::Bonds(bonded) => bonded.longitudinal_modulus(bonds),
            Self::Prestrained(prestrained) => prestrained.longitudinal_modulus(bonds),
            Self::Solid(solid) => solid.longitudinal_modulus(bonds),
        }
    }

    /// kθ, N/m⁶, of linear bonds about as stiff.
    pub fn micromodulus(&self, bonds: &dyn Bonds<D>) -> f64 {
        match self {
            Self::Bonds(bonded) => bonded.modulus(),
            Self::Prestrained(prestrained) => prestrained.micromodulus(bonds),
            Self::Solid(solid) => solid.micromodulus(bonds),
        }
    }
}

/// A body, its material and their constants.
pub struct Bonded<const D: usize> {
    /// The body; its bonds do not have their law yet.
    pub body: Body<D>,
    /// The material.
    pub material: Acting<D>,
    /// When bonds break, where the scene says so.
    pub criterion: Option<Criterion>,
    /// Fracture energies of the critical stretch of a bond law.
    pub toughness: Option<Toughness>,
    /// The parameters that follow fields.
    pub followed: Vec<Followed>,
    /// Stiffness of the material over what it is without inclusions.
    pub stiffness: Property,
}

impl<const D: usize> Bonded<D> {
    /// Calibrates and corrects a body.
    ///
    /// # Errors
    /// A fault of the material.
    pub fn new(
        source: &Source,
        scene: &Scene,
        variant: &Variant,
        mut body: Body<D>,
    ) -> Result<Self, Failure> {
        let (space, spec) = (scene.body.space, &scene.material);
        let (horizon, thickness) = (body.bonds.horizon(), body.thickness);
        if let Some(solid) = &spec.solid {
            let law = solid.build::<D>(source, space, scene.is_beside_planes())?;
            let criterion = match spec.critical {
                Some(Critical { stretch: Some(stretch), .. }) => Some(stretch.into()),
                Some(Critical { fracture_energy: Some(energy), strength: Some(strength), .. }) => {
                    let strength = strength.si();
                    let fault = |allowed: String| {
                        let found = scene::plain(strength) + " Pa";
                        source.error("material.critical.strength", found, allowed)
                    };
                    let onset = energy_at_strength(&*law, strength).ok_or_else(|| {
                        fault("a stress that the law reaches in uniaxial tension".to_owned())
                    })?;
                    let softening = bilinear(&*body.bonds, energy.si(), onset).map_err(|limit| {
                        fault(format!(
                            "less, or a finer spacing: at it W = {onset:.4e} J/m³, and bonds of this fracture energy \
                             break at {limit:.4e} J/m³"
                        ))
                    })?;
                    Some(Criterion::Softening(softening))
                }
                Some(Critical { fracture_energy: Some(energy), .. }) => {
                    Some(Criterion::Energy(energy_limit(&*body.bonds, energy.si())))
                }
                _ => None,
            };
            let material = Acting::Solid(NonlocalSolid(law));
            return Ok(Self {
                body,
                material,
                criterion,
                toughness: None,
                followed: Vec::new(),
                stiffness: 1.0.into(),
            });
        }
        let law: Arc<dyn BondPotential> = Arc::from(spec.bond_law()?);
        let youngs_modulus = spec.youngs_modulus.map_or(f64::NAN, |modulus| modulus.si());
        let mut modulus = calibrate::modulus(space, youngs_modulus, horizon, thickness);
        if let Some(lattice) = body.bonds.as_lattice() {
            modulus *= calibrate::lattice_factor::<D>(spec.calibration, lattice);
        }
        let surface = (variant.surface == SurfaceCorrection::Energy).then(|| {
            surface_factors(&*body.bonds, modulus, calibrate::stiffness_1111(space, youngs_modulus))
        });
        let crossing = spec.critical.map(|_| Crossing::new(&*body.bonds, surface.as_ref()));
        let followed = scene::followed(source, scene, &body)?;
        let inclusions = Inclusions::new(source, scene, &body, &followed)?;
        if let Some(factors) = bond_factors(&*body.bonds, surface, &inclusions.micromodulus) {
            body.bonds.set_factors(factors);
        }
        let context = |stiffness: f64, crossing: Crossing| {
            let (links, modulus) = (spec.links, stiffness * modulus);
            let convention = spec.critical.and_then(|critical| critical.convention).unwrap_or_default();
            Context { law: &*law, links, space, modulus, horizon, thickness, crossing, convention }
        };
        let fault = |error| match error {
            Error::Parameter { name, found, allowed } => {
                let unit = if name == "critical.fracture_energy" { " J/m²" } else { "" };
                source.error(&format!("material.{name}"), scene::plain(found) + unit, allowed)
            }
            other => source.error("material.critical", other, "a critical stretch"),
        };
        let (mut criterion, mut toughness): (Option<Criterion>, _) = (None, None);
        if let Some((critical, crossing)) = spec.critical.zip(crossing) {
            let rest = context(1.0, crossing);
            let stretch = critical.resolve(&rest).map_err(fault)?;
            toughness = Some(Toughness::new(&critical, &rest, stretch));
            let own = |critical: Critical, stiffness| critical.resolve(&context(stiffness, crossing));
            criterion = Some(inclusions.critical_stretch(source, &*body.bonds, stretch, &own)?.into());
        }
        let mut bonded = BondMaterial::new(law, modulus);
        if scene.softens()
            && let Some(Criterion::Stretch(end)) = &criterion
        {
            bonded = bonded.softening(end.clone());
        }
        let material = match inclusions.prestrain {
            Some(strain) => {
                let prestrained = Prestrained::new(bonded, strain);
                Acting::Prestrained(match &criterion {
                    Some(criterion) => prestrained.clamped(criterion.most()),
                    None => prestrained,
                })
            }
            None => Acting::Bonds(bonded),
        };
        Ok(Self { body, material, criterion, toughness, followed, stiffness: inclusions.micromodulus })
    }
}

/// Forces and stresses of a state, as outputs need them.
pub enum Observed<'a, const D: usize> {
    /// Of a bond law, with the fit that the solver makes: bonds then carry the solver's own forces.
    Bonds {
        /// The law.
        material: &'a BondMaterial<'static>,
        /// Largest relative error of the fit.
        bound: f64,
        /// Whether the law is constant beyond the fitted stretches.
        clamped: bool,
        /// The fit made last, with its stretches.
        last: Mutex<Option<([f64; 2], KernelFit)>>,
    },
    /// Of a solid of which no output asks.
    Nothing,
    /// Of a solid, with states of its particles.
    Solid {
        /// Its law.
        law: &'a dyn PointLaw<D>,
        /// Whether it is learnt from data.
        learnt: bool,
        /// The solid at work.
        states: Mutex<Pointwise<Solid<D>, D>>,
    },
}

impl<'a, const D: usize> Observed<'a, D> {
    /// `bonds` are those of the body as it was built.
    pub fn new(scene: &Scene, material: &'a Acting<D>, bonds: &dyn Bonds<D>) -> Self {
        match material {
            Acting::Bonds(material) => Self::Bonds {
                material,
                bound: scene.fit_bound(),
                clamped: scene.material.critical.is_some(),
                last: Mutex::new(None),
            },
            Acting::Prestrained(_) => Self::Nothing,
            Acting::Solid(_) if !scene.observes_forces() => Self::Nothing,
            Acting::Solid(solid) => {
                let (learnt, states) = (scene.is_learnt(), Mutex::new(Pointwise::new(solid.clone(), bonds)));
                Self::Solid { law: &*solid.0, learnt, states }
            }
        }
    }

    /// Forces of the bonds of `sites` to the sites that `wanted` names, N, each on the particle in the first: `visit` takes that site
    /// and their sum.
    pub fn forces(
        &self,
        bonds: &dyn Bonds<D>,
        state: &State<D>,
        sites: &[u32],
        wanted: &dyn Fn(usize) -> bool,
        visit: &mut dyn FnMut(usize, [f64; D]),
    ) {
        match self {
            Self::Nothing => {}
            Self::Bonds { material, bound, clamped, last } => {
                let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
                if last.as_ref().is_none_or(|(stretches, _)| *stretches != state.stretches.fitted) {
                    let fit = KernelFit::new(material.law(), state.stretches.fitted, *bound).ok();
                    *last =
                        fit.map(|fit| (state.stretches.fitted, if *clamped { fit.clamped() } else { fit }));
                }
                // the solver has made the same fit
                let Some((_, fit)) = &*last else { return };
                for site in sites.iter().map(|&site| site as usize) {
                    let (own, volume) = (state.displacement.get(site), bonds.volume(site));
                    let mut sum = [0.0; D];
                    bonds.neighbours(site, &mut |bond| {
                        if wanted(bond.site) {
                            let other = state.displacement.get(bond.site);
                            let eta: [f64; D] = std::array::from_fn(|d| other[d] - own[d]);
                            let pull = force_over_length(
                                fit,
                                material.modulus(),
                                bond.weight,
                                volume,
                                bond.bond,
                                eta,
                            );
                            for d in 0..D {
                                sum[d] += pull * (bond.bond[d] + eta[d]);
                            }
                        }
                    });
                    visit(site, sum);
                }
            }
            Self::Solid { states, .. } => {
                let mut states = states.lock().unwrap_or_else(PoisonError::into_inner);
                states.prepare(bonds, &state.displacement);
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

    /// Σ V_I V_J (x_J − x_I) × T_IJ over the bonds of `sites` to the sites that `wanted` names, N m: bonds of solids are not parallel to their
    /// forces, T_IJ − T_JI, and Σ_J V_J (x_J − x_I) × T_IJ = 0 in a whole family alone. With it, the moment of the forces of `sites` is what the
    /// body transmits.
    pub fn couple(
        &self,
        bonds: &dyn Bonds<D>,
        state: &State<D>,
        sites: &[u32],
        wanted: &dyn Fn(usize) -> bool,
    ) -> [f64; 3] {
        let mut sum = [0.0; 3];
        let Self::Solid { states, .. } = self else { return sum };
        let mut states = states.lock().unwrap_or_else(PoisonError::into_inner);
        states.prepare(bonds, &state.displacement);
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

    /// First Piola–Kirchhoff and Cauchy stress of a solid's law in every particle, Pa; `None` for bond laws.
    pub fn stress(&self, bonds: &dyn Bonds<D>, state: &State<D>) -> Option<[Vec<Tensor<D>>; 2]> {
        let Self::Solid { law, states, .. } = self else { return None };
        let mut states = states.lock().unwrap_or_else(PoisonError::into_inner);
        states.prepare(bonds, &state.displacement);
        let both = bonds.particles().iter().map(|&site| {
            let point = &states.points()[site as usize];
            let Some(deformation) = point.deformation() else { return ([[0.0; D]; D], [[0.0; D]; D]) };
            let gradient = deformation.gradient();
            let piola = point.respond(*law).piola * point.integrity();
            let volume = (1.0 + deformation.volume_change()) * law.thickness_stretch(deformation);
            let cauchy = piola * gradient.transpose() / volume;
            let rows =
                |t: &crate::material::Tensor<D>| std::array::from_fn(|a| std::array::from_fn(|b| t[(a, b)]));
            (rows(&piola), rows(&cauchy))
        });
        let (piola, cauchy) = both.unzip();
        Some([piola, cauchy])
    }

    /// Eshelby's energy–momentum ∇uᵀP − W 1 of a solid at some sites, Pa; `visit` takes the place in `sites` with it. Nothing
    /// of bond laws, and of particles without deformation gradient.
    pub fn energy_momentum(
        &self,
        bonds: &dyn Bonds<D>,
        state: &State<D>,
        sites: &[u32],
        visit: &mut dyn FnMut(usize, Tensor<D>),
    ) {
        let Self::Solid { law, states, .. } = self else { return };
        let mut states = states.lock().unwrap_or_else(PoisonError::into_inner);
        states.prepare(bonds, &state.displacement);
        for (at, &site) in sites.iter().enumerate() {
            let point = &states.points()[site as usize];
            let Some(deformation) = point.deformation() else { continue };
            let piola = point.respond(*law).piola;
            let tensor = (deformation.displacement_gradient.transpose() * piola
                - crate::material::Tensor::<D>::identity() * point.energy(*law).unwrap_or(0.0))
                * point.integrity();
            visit(at, std::array::from_fn(|a| std::array::from_fn(|b| tensor[(a, b)])));
        }
    }

    /// Where and why a learnt law is uncertain, particle by particle; none where it is not at work; `None` for laws in closed form.
    pub fn flags(&self, bonds: &dyn Bonds<D>, state: &State<D>) -> Option<Vec<Flags>> {
        let Self::Solid { law, learnt: true, states } = self else { return None };
        let mut states = states.lock().unwrap_or_else(PoisonError::into_inner);
        states.prepare(bonds, &state.displacement);
        let of = |&site: &u32| {
            states.points()[site as usize].deformation().map_or(Flags::default(), |found| law.flags(found))
        };
        Some(bonds.particles().par_iter().map(of).collect())
    }

    /// The shares of particles outside of the box of the training data, and with any flag.
    pub fn flagged(&self, bonds: &dyn Bonds<D>, state: &State<D>) -> Option<[f64; 2]> {
        let flags = self.flags(bonds, state)?;
        let share = |is: &dyn Fn(&Flags) -> bool| {
            flags.iter().filter(|flags| is(flags)).count() as f64 / flags.len().max(1) as f64
        };
        Some([share(&|flags| flags.outside.contains(&true)), share(&Flags::any)])
    }
}
