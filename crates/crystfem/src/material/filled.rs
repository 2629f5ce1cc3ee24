//! A material that fills a fraction of its elements.

use super::{Crystallization, PointInput, ThermalMaterial, ThermalResponse};
use crate::error::Error;
use std::collections::HashMap;
use std::sync::Arc;

/// A material that fills a fraction of its elements, spread evenly: ρ and k are scaled by the fraction;
/// energies and states per mass are unchanged (rule of mixtures with air that neither stores nor conducts).
#[derive(Clone)]
pub struct Filled {
    /// Filling material.
    material: Arc<dyn ThermalMaterial>,
    /// Filled fraction; above 1 for overfilled elements.
    fill: f64,
}

impl Filled {
    /// Returns a material that fills a fraction of its elements.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a fraction that is not above 0 and finite.
    pub fn new(material: Arc<dyn ThermalMaterial>, fill: f64) -> Result<Self, Error> {
        if fill > 0.0 && fill.is_finite() {
            return Ok(Self { material, fill });
        }
        Err(Error::Parameter { name: "filled part", found: fill, allowed: "above 0, finite".into() })
    }
}

/// Replaces materials by [`Filled`] ones, one for each pair of material and fraction in use; `part_of` is the
/// index of each element in the fractions `parts`.
///
/// # Errors
/// Errors of [`Filled::new`]; [`Error::Parameter`] for more than 65536 materials.
pub fn fill_elements(
    materials: &mut Vec<Arc<dyn ThermalMaterial>>,
    material_of: &mut [u16],
    parts: &[f64],
    part_of: &[usize],
) -> Result<(), Error> {
    let mut all: Vec<Arc<dyn ThermalMaterial>> = Vec::new();
    let mut known: HashMap<(u16, usize), u16> = HashMap::new();
    for (material, &part) in material_of.iter_mut().zip(part_of) {
        let key = (*material, part);
        *material = match known.get(&key) {
            Some(&found) => found,
            None => {
                let number = u16::try_from(all.len()).map_err(|_| Error::Parameter {
                    name: "filled parts of all materials",
                    found: all.len() as f64,
                    allowed: "at most 65536".into(),
                })?;
                all.push(Arc::new(Filled::new(materials[usize::from(key.0)].clone(), parts[part])?));
                known.insert(key, number);
                number
            }
        };
    }
    *materials = all;
    Ok(())
}

impl ThermalMaterial for Filled {
    fn density(&self) -> f64 {
        self.fill * self.material.density()
    }

    fn state_names(&self) -> &'static [&'static str] {
        self.material.state_names()
    }

    fn initial_state(&self, temperature: f64, state: &mut [f64]) {
        self.material.initial_state(temperature, state);
    }

    fn field_names(&self) -> &'static [&'static str] {
        self.material.field_names()
    }

    fn fields(&self, state: &[f64], fields: &mut [f64]) {
        self.material.fields(state, fields);
    }

    fn crystallization_rate(&self, temperature: f64, state: &[f64]) -> f64 {
        self.material.crystallization_rate(temperature, state)
    }

    fn energy(&self, temperature: f64, state: &[f64]) -> f64 {
        self.material.energy(temperature, state)
    }

    fn is_linear(&self) -> bool {
        self.material.is_linear()
    }

    fn constant_conductivity(&self) -> bool {
        self.material.constant_conductivity()
    }

    fn potential(&self, temperature: f64) -> Option<[f64; 2]> {
        self.material.potential(temperature).map(|pair| pair.map(|x| self.fill * x))
    }

    fn crystals(&self) -> Option<&Crystallization> {
        self.material.crystals()
    }

    fn filling(&self) -> Option<&Arc<dyn ThermalMaterial>> {
        Some(&self.material)
    }

    fn respond(&self, at: &PointInput, old: &[f64], new: &mut [f64]) -> Result<ThermalResponse, Error> {
        let own = self.material.respond(at, old, new)?;
        Ok(ThermalResponse {
            flux: self.fill * own.flux,
            d_flux_d_temperature: self.fill * own.d_flux_d_temperature,
            d_flux_d_gradient: self.fill * own.d_flux_d_gradient,
            ..own
        })
    }
}
