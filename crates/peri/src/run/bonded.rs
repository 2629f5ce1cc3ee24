//! A body with its bond law, as a variant of a scene asks for them.

use crate::bonds::Property;
use crate::calibrate;
use crate::correction::{bond_factors, surface_factors};
use crate::critical::{Context, Critical};
use crate::error::Error;
use crate::potential::BondPotential;
use crate::run::Failure;
use crate::scene::{self, Body, Inclusions, Scene, SurfaceCorrection, Variant};
use polycore::scene::Source;

/// A body, its law and their constants.
pub struct Bonded<const D: usize> {
    /// The body; its bonds do not have their law yet.
    pub body: Body<D>,
    /// The bond law.
    pub law: Box<dyn BondPotential>,
    /// kθ.
    pub modulus: f64,
    /// Where the scene names one.
    pub critical_stretch: Option<Property>,
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
        let (space, material) = (scene.body.space, &scene.material);
        let law = material.bond_law()?;
        let youngs_modulus = material.youngs_modulus.si();
        let (horizon, thickness) = (body.bonds.horizon(), body.thickness);
        let mut modulus = calibrate::modulus(space, youngs_modulus, horizon, thickness);
        if let Some(lattice) = body.bonds.as_lattice() {
            modulus *= calibrate::lattice_factor::<D>(material.calibration, lattice);
        }
        let surface = (variant.surface == SurfaceCorrection::Energy).then(|| {
            surface_factors(&*body.bonds, modulus, calibrate::stiffness_1111(space, youngs_modulus))
        });
        let inclusions = Inclusions::new(source, scene, &body)?;
        if let Some(factors) = bond_factors(&*body.bonds, surface, &inclusions.micromodulus) {
            body.bonds.set_factors(factors);
        }
        let resolve = |critical: Critical, stiffness: f64| {
            let modulus = stiffness * modulus;
            let context = Context { law: &*law, links: material.links, space, modulus, horizon, thickness };
            critical.resolve(&context)
        };
        let fault = |error| match error {
            Error::Parameter { name, found, allowed } => {
                let unit = if name == "critical.fracture_energy" { " J/m²" } else { "" };
                source.error(&format!("material.{name}"), scene::plain(found) + unit, allowed)
            }
            other => source.error("material.critical", other, "a critical stretch"),
        };
        let critical_stretch = match material.critical {
            Some(critical) => {
                let stretch = resolve(critical, 1.0).map_err(fault)?;
                let own = |critical, stiffness| resolve(critical, stiffness);
                Some(inclusions.critical_stretch(source, &*body.bonds, stretch, &own)?)
            }
            None => None,
        };
        Ok(Self { body, law, modulus, critical_stretch })
    }
}
