//! Polymer networks from their chemistry.

use crate::error::value;
use polycore::network::{
    EndLinked, LinkerMix, Melt, PolymerNetwork, PrimaryChains, Reacted, Solvent, Vulcanized, known_polymer,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Computes an end-linked network; molar masses in kg/mol, everything else in SI units.
#[pyfunction]
#[pyo3(signature = (*, functionality, strand_mass, ratio, conversion, sol_fraction, linker_mass, ends,
    extracted, polymer, density, temperature, entanglement_modulus, loop_factor))]
#[expect(clippy::too_many_arguments, reason = "the keywords of the function in Python")]
pub fn network<'py>(
    py: Python<'py>,
    functionality: Vec<(f64, f64)>,
    strand_mass: f64,
    ratio: f64,
    conversion: Option<f64>,
    sol_fraction: Option<f64>,
    linker_mass: f64,
    ends: (f64, f64),
    extracted: bool,
    polymer: &str,
    density: Option<f64>,
    temperature: f64,
    entanglement_modulus: Option<f64>,
    loop_factor: Option<f64>,
) -> PyResult<Bound<'py, PyDict>> {
    let melt = melt(polymer, density, temperature, entanglement_modulus, extracted)?;
    let reacted = match (conversion, sol_fraction) {
        (Some(conversion), None) => Reacted::Conversion(conversion),
        (None, Some(sol)) => Reacted::SolFraction(sol),
        _ => return Err(value("conversion, sol_fraction: exactly one is needed".to_owned())),
    };
    let linkers = match functionality[..] {
        [(mean, _)] => LinkerMix::mean(mean),
        _ => {
            let whole = |(f, share): &(f64, f64)| match f.fract() == 0.0 && (1.0..=1e3).contains(f) {
                true => Ok((*f as u32, *share)),
                false => Err(value(format!("functionality: found {f}; allowed: whole numbers of 1 to 1000"))),
            };
            LinkerMix::new(&functionality.iter().map(whole).collect::<PyResult<Vec<_>>>()?)
        }
    };
    let mut recipe = EndLinked::new(1, strand_mass, reacted)
        .linkers(linkers.map_err(refused)?)
        .ratio(ratio)
        .linker_mass(linker_mass)
        .ends(ends.0, ends.1);
    if let Some(factor) = loop_factor {
        recipe = recipe.loop_factor(factor);
    }
    figures(py, &recipe.network(&melt).map_err(refused)?)
}

/// Computes a network of long chains cross-linked at random.
#[pyfunction]
#[pyo3(signature = (*, chains, mass, units, sol_fraction, extracted, polymer, density, temperature,
    entanglement_modulus))]
#[expect(clippy::too_many_arguments, reason = "the keywords of the function in Python")]
pub fn vulcanized<'py>(
    py: Python<'py>,
    chains: &str,
    mass: f64,
    units: Option<f64>,
    sol_fraction: Option<f64>,
    extracted: bool,
    polymer: &str,
    density: Option<f64>,
    temperature: f64,
    entanglement_modulus: Option<f64>,
) -> PyResult<Bound<'py, PyDict>> {
    let chains = match chains {
        "most-probable" => PrimaryChains::MostProbable,
        "one-length" => PrimaryChains::OneLength,
        other => return Err(value(format!("chains: found {other:?}; allowed: most-probable, one-length"))),
    };
    let melt = melt(polymer, density, temperature, entanglement_modulus, extracted)?;
    let recipe = match (units, sol_fraction) {
        (Some(units), None) => Vulcanized::new(chains, mass, units),
        (None, Some(sol)) => Vulcanized::with_sol(chains, mass, sol).map_err(refused)?,
        _ => return Err(value("units, sol_fraction: exactly one is needed".to_owned())),
    };
    figures(py, &recipe.network(&melt).map_err(refused)?)
}

/// Volume fraction of polymer of a gel at equilibrium with a solvent.
#[pyfunction]
pub fn swollen_fraction(volume: f64, interaction: f64, modulus: f64, temperature: f64) -> PyResult<f64> {
    Solvent::new(volume, interaction)
        .and_then(|solvent| solvent.polymer_fraction(modulus, temperature))
        .map_err(refused)
}

/// Shear modulus of a dry gel, Pa, from its volume fraction at equilibrium with a solvent.
#[pyfunction]
pub fn modulus_of_swelling(volume: f64, interaction: f64, fraction: f64, temperature: f64) -> PyResult<f64> {
    Solvent::new(volume, interaction)
        .and_then(|solvent| solvent.modulus(fraction, temperature))
        .map_err(refused)
}

fn refused(error: polycore::network::Error) -> PyErr {
    value(error.to_string())
}

/// Creates a melt; density and entanglement modulus are those of the polymer if `None`.
fn melt(
    polymer: &str,
    density: Option<f64>,
    temperature: f64,
    entanglement_modulus: Option<f64>,
    extracted: bool,
) -> PyResult<Melt> {
    let known = known_polymer(polymer).map_err(refused)?;
    let missing = |what: &str| value(format!("{what}: unknown for {}; give it", known.name));
    Ok(Melt {
        density: density.or(known.density).ok_or_else(|| missing("density"))?,
        temperature,
        entanglement_modulus: entanglement_modulus
            .or(known.entanglement_modulus)
            .ok_or_else(|| missing("entanglement_modulus"))?,
        chain: Some(known.chain),
        extracted,
    })
}

/// Returns the fields of `polymech.Network`.
fn figures<'py>(py: Python<'py>, network: &PolymerNetwork) -> PyResult<Bound<'py, PyDict>> {
    let found = PyDict::new(py);
    found.set_item("modulus", network.modulus())?;
    found.set_item("phantom", network.phantom())?;
    found.set_item("entangled", network.entangled())?;
    found.set_item("stiffening", network.stiffening())?;
    found.set_item("sol", network.sol.mass)?;
    found.set_item("conversion", network.conversion[0])?;
    found.set_item("least_conversion", network.least_conversion)?;
    found.set_item("strands", network.strands)?;
    found.set_item("junctions", network.junctions)?;
    found.set_item("segments", network.segments().unwrap_or(f64::NAN))?;
    found.set_item("locking_stretch", network.locking_stretch().unwrap_or(f64::NAN))?;
    let [low, high] = network.fracture_energy().unwrap_or([f64::NAN; 2]);
    found.set_item("fracture_energy", (low, high))?;
    Ok(found)
}
