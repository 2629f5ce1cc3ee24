//! Laws as materials of finite-element programs.

use crate::error::{file, value};
use polycore::constitutive::hyperelastic::deck_reader::{self, MaterialDeck};
use polycore::constitutive::hyperelastic::host::CardProgram;
use polycore::constitutive::hyperelastic::{any_model, deck};
use pyo3::prelude::*;
use std::path::PathBuf;

/// Name, model, parameters and bulk modulus in the deck's unit of stress, and notes.
type Material = (String, &'static str, Vec<f64>, Option<f64>, Vec<String>);

/// Reads the materials of a deck, and the reasons of those left out.
#[pyfunction]
pub fn read_deck(path: PathBuf) -> PyResult<(Vec<Material>, Vec<String>)> {
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_lowercase();
    let found = match CardProgram::find(&ending) {
        Some(host) => host.read(&path),
        None => deck_reader::read(&path),
    };
    let MaterialDeck { materials, left_out } = found.map_err(|error| file(&error))?;
    let plain = materials.into_iter().map(|m| (m.name, m.model.key, m.parameters, m.bulk, m.notes));
    Ok((plain.collect(), left_out))
}

/// Formats a law as the material of a program, with the Dᵢ of its volumetric energy.
#[pyfunction]
pub fn card(
    program: &str,
    name: &str,
    key: &str,
    values: Vec<f64>,
    compliances: Vec<f64>,
) -> PyResult<String> {
    let key = any_model(key).map_err(value)?.key;
    let host = match program {
        "abaqus" => return Ok(deck::card(name, key, &values, &compliances)),
        "ansys" => CardProgram::Ansys,
        "ls-dyna" => CardProgram::LsDyna,
        "febio" => CardProgram::Febio,
        "moose" => CardProgram::Moose,
        other => {
            let allowed = "abaqus, ansys, ls-dyna, febio, moose";
            return Err(value(format!("program: found {other:?}; allowed: {allowed}")));
        }
    };
    host.card(1, name, key, &values, &compliances)
        .ok_or_else(|| value(format!("{} has no law `{key}`", host.name())))
}
