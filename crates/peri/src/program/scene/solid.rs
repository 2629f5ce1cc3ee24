//! Solids with any Poisson ratio, specified in place of a bond law.

use super::Scene;
use super::SurfaceCorrection;
use super::values::{plain, positive};
use crate::bonds::VolumeCorrection;
use crate::calibrate::{Calibration, Space};
use crate::critical::Critical;
use crate::error::Error;
use crate::material::{Correspondence, Driving, EightChainSolid, PointLaw, ViscousCorrespondence};
use crate::stress::StressMethod;
use harness::scene::{BranchSpec, ConstitutiveSpec, MullinsSpec, SceneError, Source, ViscosityKind};
use polycore::constitutive::Law;
use polycore::constitutive::surrogate::Kind;
use polycore::constitutive::viscoelastic::Viscoelastic;
use polycore::units::{Stress, Temperature};
use serde::Deserialize;
use std::sync::Arc;

/// Solid whose energy follows from the mean deformation of a family.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SolidLaw {
    /// Law of the solid.
    pub law: SolidKind,
    /// Shear modulus at rest, of `eight-chain`.
    pub shear_modulus: Option<Stress>,
    /// Bulk modulus at rest, of `eight-chain`; default in plane stress: incompressible.
    pub bulk_modulus: Option<Stress>,
    /// Links of a chain, of `eight-chain`.
    pub links: Option<f64>,
    /// Averages J of the volumetric energy over nearest neighbours, for `eight-chain` on a lattice, solid or
    /// plane strain. Default: true beside rigid planes and indenters if the bulk modulus is at least 50 times
    /// the shear modulus.
    pub pressure_filter: Option<bool>,
    /// Constitutive law of `correspondence`.
    pub constitutive: Option<ConstitutiveSpec>,
    /// Factor on the stabilisation of `correspondence`; default: 1.
    pub stabilisation: Option<f64>,
    /// Branches of `correspondence` that relax, beside `constitutive`, the law in equilibrium.
    #[serde(default)]
    pub branch: Vec<BranchSpec>,
    /// Temperature of the body, for branches with a `shift`.
    pub temperature: Option<Temperature>,
    /// Softening of the equilibrium law of `correspondence` by the largest strain so far.
    pub mullins: Option<MullinsSpec>,
}

/// Kinds of solids.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SolidKind {
    /// Eight-chain network of Arruda and Boyce over the directions of a family.
    EightChain,
    /// Any constitutive law, at the mean deformation of a family.
    Correspondence,
}

impl SolidKind {
    /// Returns the name in scenes.
    pub fn name(self) -> &'static str {
        match self {
            Self::EightChain => "eight-chain",
            Self::Correspondence => "correspondence",
        }
    }
}

/// Bulk modulus over shear modulus above which the pressure is filtered beside planes, where coarse lattices
/// are too stiff otherwise (docs/guide/src/how-to/contact.md). Without planes the compliance of grips held by
/// bonds compensates for that.
const FILTERED_RATIO: f64 = 50.0;

/// Temperature of a body whose viscosities have no shift, K.
const ROOM: f64 = 293.15;

/// Key of the block of the rest of the body.
pub(super) const KEY: &str = "material.solid";

impl SolidLaw {
    /// Returns true for a law learnt from data.
    pub fn is_learnt(&self) -> bool {
        self.constitutive.as_ref().is_some_and(|spec| spec.learnt.is_some())
    }

    /// Returns true for a law with a state.
    pub fn has_state(&self) -> bool {
        !self.branch.is_empty() || self.mullins.is_some()
    }

    /// Returns the numbers that a particle of this solid remembers.
    pub fn memory_of_a_particle(&self) -> usize {
        let numbers = |own: &BranchSpec| 6 + usize::from(own.viscosity == ViscosityKind::EyringSoftening);
        let branches: usize = self.branch.iter().map(numbers).sum();
        let pressure = usize::from(self.branch.iter().any(BranchSpec::has_pressure));
        // the relaxed part of the stabilisation, and the stabilisation of the step
        let stabilisation = usize::from(!self.branch.is_empty() && self.stabilisation != Some(0.0)) + 1;
        let softening = usize::from(self.mullins.is_some());
        if self.has_state() { branches + softening + pressure + stabilisation } else { 0 }
    }

    /// Adds branches and softening to the law in equilibrium.
    fn with_state<const D: usize>(
        &self,
        source: &Source,
        block: &str,
        space: Space,
        law: impl Law + 'static,
        driving: Driving,
    ) -> Result<Arc<dyn PointLaw<D>>, SceneError> {
        let branches = self.branch.iter().enumerate();
        let branches = branches.map(|(k, own)| own.branch(source, &format!("{block}.branch[{k}]")));
        let branches = branches.collect::<Result<Vec<_>, _>>()?;
        let key = format!("{block}.temperature");
        let shifted = self.branch.iter().any(|own| own.shift.is_some());
        let temperature = match self.temperature {
            Some(_) if !shifted => return Err(source.unexpected(&key, "no branch has a `shift`")),
            None if shifted => return Err(source.missing(&key, "needed for the `shift` of a branch")),
            temperature => temperature.map_or(ROOM, |temperature| temperature.si()),
        };
        let least = branches.iter().map(|branch| branch.shift.least_temperature()).fold(0.0, f64::max);
        if temperature < least {
            let found = format!("{temperature:.2} K, where WLF exceeds 12 decades");
            return Err(source.error(&key, found, format!("{least:.2} K and above")));
        }
        let wrong = |error: polycore::constitutive::Error| source.error(block, error, "a law with time");
        let mut law = Viscoelastic::new(Box::new(law), branches).map_err(wrong)?;
        if let Some(mullins) = &self.mullins {
            law =
                law.with_softening(mullins.softening(source, &format!("{block}.mullins"))?).map_err(wrong)?;
        }
        let solid = ViscousCorrespondence::new::<D>(law, space, self.stabilisation.unwrap_or(1.0), driving);
        let solid = solid.map(|solid| solid.at_temperature(temperature));
        Ok(Arc::new(solid.map_err(|error| match error {
            Error::Parameter { name: "stabilisation", found, allowed } => {
                source.error(&format!("{block}.stabilisation"), plain(found), allowed)
            }
            other => source.error(&format!("{block}.constitutive"), other, "a law with an energy"),
        })?))
    }

    /// Builds the law of the block with the key `block`; `planes` is true on a lattice beside rigid planes.
    ///
    /// # Errors
    /// A missing or unexpected key, or a value out of its domain.
    pub fn build<const D: usize>(
        &self,
        source: &Source,
        block: &str,
        space: Space,
        planes: bool,
        driving: Driving,
    ) -> Result<Arc<dyn PointLaw<D>>, SceneError> {
        let chains = self.law == SolidKind::EightChain;
        let other = if chains { SolidKind::Correspondence } else { SolidKind::EightChain }.name();
        for (key, given, of_chains) in [
            ("shear_modulus", self.shear_modulus.is_some(), true),
            ("bulk_modulus", self.bulk_modulus.is_some(), true),
            ("links", self.links.is_some(), true),
            ("pressure_filter", self.pressure_filter == Some(true), true),
            ("constitutive", self.constitutive.is_some(), false),
            ("stabilisation", self.stabilisation.is_some(), false),
            ("branch", !self.branch.is_empty(), false),
            ("temperature", self.temperature.is_some(), false),
            ("mullins", self.mullins.is_some(), false),
        ] {
            if given && of_chains != chains {
                let why = format!("`{}` does not use it, `{other}` does", self.law.name());
                return Err(source.unexpected(&format!("{block}.{key}"), why));
            }
        }
        let missing = |key: &str, why: &str| source.missing(&format!("{block}.{key}"), why);
        let wrong = |error: Error| match error {
            Error::Parameter { name, found, allowed } if chains || name == "stabilisation" => {
                source.error(&format!("{block}.{}", name.replace(' ', "_")), plain(found), allowed)
            }
            Error::Parameter { name, found, allowed } => {
                source.error(&format!("{block}.constitutive"), format!("{name}: {}", plain(found)), allowed)
            }
            other => source.error(block, other, "a law with an energy, and without stress at rest"),
        };
        if chains {
            let shear = self
                .shear_modulus
                .ok_or_else(|| missing("shear_modulus", "needed for `eight-chain`: a stress"))?;
            let links =
                self.links.ok_or_else(|| missing("links", "needed for `eight-chain`: a number above 1"))?;
            let bulk = match self.bulk_modulus {
                Some(bulk) => bulk.si(),
                None if space == Space::PlaneStress => f64::INFINITY,
                None => {
                    let why = "needed for `eight-chain`; only in plane stress is the default incompressible";
                    return Err(missing("bulk_modulus", why));
                }
            };
            let network = EightChainSolid::new(space, shear.si(), links, bulk).map_err(wrong)?;
            let volumetric = space != Space::PlaneStress && planes;
            let stiff = volumetric && bulk >= FILTERED_RATIO * shear.si();
            if !self.pressure_filter.unwrap_or(stiff) {
                return Ok(Arc::new(network));
            }
            if space == Space::PlaneStress {
                let allowed = "false: in plane stress the thickness is free to change";
                return Err(source.error(&format!("{block}.pressure_filter"), "true", allowed));
            }
            return Ok(Arc::new(network.filtered().map_err(wrong)?));
        }
        let spec = self.constitutive.as_ref().ok_or_else(|| {
            let why = "needed for `correspondence`: `model`, `parameters` and `bulk_modulus`, or `learnt`";
            missing("constitutive", why)
        })?;
        let (key, stabilisation) = (format!("{block}.constitutive"), self.stabilisation.unwrap_or(1.0));
        let Some(learnt) = spec.learnt(source, &key)? else {
            let law = spec.law(source, &key)?;
            if self.has_state() {
                return self.with_state(source, block, space, law, driving);
            }
            return Ok(Arc::new(Correspondence::stabilised(law, space, stabilisation).map_err(wrong)?));
        };
        if learnt.header().kind == Kind::Ann {
            let allowed = "a law of the kind `energy`: forces follow from one, and it has no stress at rest";
            return Err(source.error(&format!("{key}.learnt"), "a law of the kind `ann`", allowed));
        }
        if learnt.header().softening.is_some() {
            let allowed = "a law without: particles keep no history of it";
            return Err(source.error(&format!("{key}.learnt"), "a law with `softening`", allowed));
        }
        if self.has_state() {
            return self.with_state(source, block, space, learnt, driving);
        }
        Ok(Arc::new(Correspondence::stabilised(learnt, space, stabilisation).map_err(wrong)?))
    }
}

/// Checks a scene with a solid.
///
/// # Errors
/// A key of bond laws, or a block that the law does not take.
pub(super) fn check(source: &Source, scene: &Scene) -> Result<(), SceneError> {
    let material = &scene.material;
    for (key, given) in [
        ("youngs_modulus", material.youngs_modulus.is_some()),
        ("law", material.law.is_some()),
        ("links", material.links.is_some()),
        ("dissociation", material.dissociation.is_some()),
        ("rescale", material.rescale.is_some()),
        ("calibration", material.calibration != Calibration::default()),
        ("volume_correction", material.volume_correction != VolumeCorrection::default()),
        ("surface_correction", material.surface_correction != SurfaceCorrection::default()),
        ("fields", !material.fields.is_empty()),
    ] {
        if given {
            let why = format!("`{key}` belongs to bond laws");
            return Err(source.conflict(&format!("material.{key}"), "solid", why));
        }
    }
    if let Some(critical) = &material.critical {
        let relaxes = scene.solids().any(|(_, own)| !own.branch.is_empty());
        if critical.driving.is_some() && !(relaxes && critical.fracture_energy.is_some()) {
            let why = "needs `fracture_energy` beside it, and a solid with `branch`";
            return Err(source.unexpected("material.critical.driving", why));
        }
        if let Some(strength) = critical.strength {
            let key = "material.critical.strength";
            positive(source, key, strength.si(), "Pa")?;
            if critical.fracture_energy.is_none() {
                return Err(source.unexpected(key, "needs `fracture_energy` beside it"));
            }
        }
        check_limit(source, "material.critical", critical)?;
    }
    if scene.body.space != Space::Solid {
        positive(source, "body.thickness", scene.body.thickness.map_or(1.0, |t| t.si()), "m")?;
    }
    let other = scene
        .stress
        .iter()
        .flat_map(|stress| &stress.measures)
        .position(|&m| m != StressMethod::Constitutive);
    if let Some(index) = other {
        let allowed = "`constitutive`, the stress of the law itself";
        return Err(source.error(&format!("stress.measures[{index}]"), "a measure of bond forces", allowed));
    }
    let (space, planes, driving) = (scene.body.space, scene.is_beside_surfaces(), scene.driving());
    for (key, own) in scene.solids() {
        if own.pressure_filter == Some(true) && scene.body.points.is_some() {
            let allowed = "false: points of a cloud have no nearest neighbours";
            return Err(source.error(&format!("{key}.pressure_filter"), "true", allowed));
        }
        match space {
            Space::Solid => own.build::<3>(source, &key, space, planes, driving).map(|_| ())?,
            _ => own.build::<2>(source, &key, space, planes, driving).map(|_| ())?,
        }
    }
    super::part_solid::check(source, scene)
}

/// Checks a limit of bonds of a solid.
///
/// # Errors
/// A key of bond laws, or none or several of the alternatives of a solid.
pub(super) fn check_limit(source: &Source, key: &str, critical: &Critical) -> Result<(), SceneError> {
    if critical.convention.is_some() {
        let why = "a convention of bond laws; a `solid` always takes its `fracture_energy` by tearing";
        return Err(source.unexpected(&format!("{key}.convention"), why));
    }
    if critical.kink.is_some() {
        let why = "only of a bond law: solids soften straight";
        return Err(source.unexpected(&format!("{key}.kink"), why));
    }
    let allowed = "either `stretch`, above 1, or `fracture_energy`, above 0";
    let found = match (critical.alternatives().len(), critical.stretch, critical.fracture_energy) {
        (1, Some(stretch), _) if stretch > 1.0 && stretch.is_finite() => return Ok(()),
        (1, _, Some(energy)) if energy.si() > 0.0 && energy.si().is_finite() => return Ok(()),
        (1, Some(stretch), _) => format!("a stretch of {}", plain(stretch)),
        (1, _, Some(energy)) => format!("{} J/m²", plain(energy.si())),
        _ => format!("`{}` of a solid", critical.alternatives().join("` and `")),
    };
    Err(source.error(key, found, allowed))
}
