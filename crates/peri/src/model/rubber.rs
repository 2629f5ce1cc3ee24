//! Rubber of a bond law, described by its Young's modulus, and composites of several.

use super::{Body, IntoMaterial};
use crate::bonds::{BodyGeometry, LatticeBonds, LawShares};
use crate::calibrate::{Calibration, lattice_factor, modulus};
use crate::critical::{Context, Convention, Critical, Crossing};
use crate::error::Error;
use crate::material::{BondMaterial, PartLaw};
use crate::potential::{BondPotential, BondSoftening, Law, Scaled};
use polycore::units::EnergyPerArea;
use std::sync::Arc;

/// Rubber whose bonds follow a [`Law`], or a law of the caller.
#[derive(Clone)]
pub struct Rubber {
    law: RubberLaw,
    youngs_modulus: f64,
    links: f64,
    dissociation: f64,
    calibration: Calibration,
    critical: Option<Critical>,
}

#[derive(Clone)]
enum RubberLaw {
    Named(Law),
    Own(Arc<dyn BondPotential>),
}

impl Rubber {
    /// Creates rubber of Young's modulus E, Pa, that does not break. Chains have n̄ = 720 links of D̂ = 1200
    /// unless [`Self::chains`] sets others.
    pub fn new(law: Law, youngs_modulus: f64) -> Self {
        Self::from_law(RubberLaw::Named(law), youngs_modulus)
    }

    /// Creates rubber of any law, scaled so that t′(1) = 3, as the calibration of kθ expects.
    pub fn with_law(law: impl BondPotential + 'static, youngs_modulus: f64) -> Self {
        Self::from_law(RubberLaw::Own(Arc::new(law)), youngs_modulus)
    }

    fn from_law(law: RubberLaw, youngs_modulus: f64) -> Self {
        let (links, dissociation, calibration) = (720.0, 1200.0, Calibration::Continuum);
        Self { law, youngs_modulus, links, dissociation, calibration, critical: None }
    }

    /// Sets chains of n̄ `links` and a dissociation energy D̂, in units of kθ.
    pub fn chains(mut self, links: f64, dissociation: f64) -> Self {
        (self.links, self.dissociation) = (links, dissociation);
        self
    }

    /// Sets the source of kθ: the lattice's sums or the continuum's integrals, the default.
    pub fn calibration(mut self, calibration: Calibration) -> Self {
        self.calibration = calibration;
        self
    }

    /// Breaks bonds at a stretch λ_c.
    pub fn critical_stretch(mut self, stretch: f64) -> Self {
        self.critical = Some(Critical { stretch: Some(stretch), ..Critical::default() });
        self
    }

    /// Breaks bonds at the stretch that follows from a tearing energy G, J/m², see [`Convention::Tearing`].
    pub fn fracture_energy(self, energy: f64) -> Self {
        self.fracture_energy_by(Convention::Tearing, energy)
    }

    /// Breaks bonds at the stretch that follows from a fracture energy G, J/m², by a convention.
    pub fn fracture_energy_by(mut self, convention: Convention, energy: f64) -> Self {
        let (energy, convention) = (Some(EnergyPerArea::from_si(energy)), Some(convention));
        self.critical = Some(Critical { fracture_energy: energy, convention, ..Critical::default() });
        self
    }
}

impl<const D: usize> IntoMaterial<D> for Rubber {
    type Material = BondMaterial<'static>;

    fn into_material(
        self,
        body: &Body<D>,
        bonds: &LatticeBonds<D>,
    ) -> Result<(Self::Material, Option<f64>), Error> {
        let found = self.youngs_modulus;
        if !(found > 0.0 && found.is_finite()) {
            let allowed = "above 0, finite".into();
            return Err(Error::Parameter { name: "Young's modulus", found, allowed });
        }
        let (law, links): (Box<dyn BondPotential>, _) = match self.law {
            RubberLaw::Named(law) => {
                let links = law.is_chain().then_some(self.links);
                (law.build(self.links, self.dissociation, law.rescales())?, links)
            }
            RubberLaw::Own(law) => {
                let found = law.tangent();
                if !(found > 0.0 && found.is_finite()) {
                    let allowed = "above 0, finite".into();
                    return Err(Error::Parameter { name: "t′(1) of the bond law", found, allowed });
                }
                (Box::new(Scaled { law, factor: 3.0 / found }), None)
            }
        };
        let (space, horizon, thickness) = (body.space, bonds.horizon(), body.thickness);
        let modulus = modulus(space, found, horizon, thickness) * lattice_factor(self.calibration, bonds);
        let (crossing, convention) = (Crossing::new(bonds, None), Convention::default());
        let softening = BondSoftening::default();
        let mut context = Context {
            law: &*law,
            links,
            space,
            modulus,
            horizon,
            thickness,
            crossing,
            convention,
            softening,
        };
        if let Some(critical) = self.critical {
            context.softening = critical.softening(&context)?;
        }
        let softening = context.softening;
        let critical = self.critical.map(|critical| critical.resolve(&context)).transpose()?;
        let material = BondMaterial::new(law, modulus);
        let soft = self.critical.and_then(|own| own.convention) == Some(Convention::Softening);
        match critical.filter(|_| soft) {
            Some(end) => Ok((material.softening(softening, end.into(), None)?, critical)),
            None => Ok((material, critical)),
        }
    }
}

/// Rubber with parts of other rubbers, such as fibres and layers: half of a bond across a border has the law
/// of either end.
pub struct CompositeRubber<const D: usize> {
    rest: Rubber,
    parts: Vec<(PartTest<D>, Rubber)>,
}

/// Selects the points X, m, of a part.
type PartTest<const D: usize> = Box<dyn Fn([f64; D]) -> bool>;

impl<const D: usize> CompositeRubber<D> {
    /// Creates a rubber without parts. Bonds of the whole body break at its limit, if it has one, unless
    /// [`Model::critical_stretch`](super::Model::critical_stretch) gives a field of others.
    pub fn new(rest: Rubber) -> Self {
        Self { rest, parts: Vec::new() }
    }

    /// Makes a part of the body of another rubber. If parts overlap, the last one counts.
    pub fn add_part(mut self, region: impl Fn([f64; D]) -> bool + 'static, rubber: Rubber) -> Self {
        self.parts.push((Box::new(region), rubber));
        self
    }
}

impl<const D: usize> IntoMaterial<D> for CompositeRubber<D> {
    type Material = BondMaterial<'static>;

    fn into_material(
        self,
        body: &Body<D>,
        bonds: &LatticeBonds<D>,
    ) -> Result<(Self::Material, Option<f64>), Error> {
        let (rest, critical) = self.rest.into_material(body, bonds)?;
        let (mut laws, mut regions): (Vec<PartLaw<'static>>, _) = (Vec::new(), Vec::new());
        for (index, (region, rubber)) in self.parts.into_iter().enumerate() {
            let part = index + 1;
            if rubber.critical.is_some() {
                return Err(Error::geometry(format!(
                    "critical stretch of part {part}: found one of its own; allowed: that of the rest, or a \
                    field by `Model::critical_stretch`"
                )));
            }
            if !bonds.particles().iter().any(|&site| region(bonds.position(site as usize))) {
                return Err(Error::geometry(format!("part {part} of the rubber has no particle")));
            }
            let (own, _) = IntoMaterial::<D>::into_material(rubber, body, bonds)?;
            let factor = own.modulus() / rest.modulus();
            let part = format!("part {part}");
            laws.extend(own.laws().cloned().map(|law| {
                let law: Arc<dyn BondPotential> = Arc::new(Scaled { law, factor });
                PartLaw { part: part.clone(), law }
            }));
            regions.push(region);
        }
        let number = |_, place| (regions.iter().rposition(|region| region(place)).map_or(0, |k| k + 1), 1.0);
        let shares = LawShares::new(bonds, laws.len() + 1, number)?;
        Ok((rest.with_parts(laws, Arc::new(shares))?, critical))
    }
}
