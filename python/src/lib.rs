//! `polymech._polymech`: the crates of this workspace as a Python module, in plain arrays and texts.
//!
//! Users see the package `polymech` in `python/package`: shapes of arrays, names, pictures and docstrings
//! are there. This module contains the parts that need Rust: runs of scenes ([`scenes`]), fields of VTKHDF
//! files ([`fields`]), laws at many points ([`laws`], [`surrogates`], by [`predict`]) and in decks
//! ([`decks`]), models of `peri` ([`model`], [`bond`]), polymer networks ([`network`]), laws with time
//! ([`time`]) and the material of `crystfem` at a point ([`point`]). Work releases the interpreter's lock;
//! [`watch`] handles signals and calls Python's functions.

use pyo3::prelude::*;

mod bond;
mod decks;
mod error;
mod fields;
mod laws;
mod model;
mod network;
mod point;
mod pool;
mod predict;
mod scenes;
mod surrogates;
mod time;
mod watch;

#[pymodule(gil_used = false)]
mod _polymech {
    use super::*;

    #[pymodule_export]
    use super::{
        bond::BondLaw,
        decks::{card, read_deck},
        error::{Interrupted, RunError, SceneError},
        fields::{field, layout},
        laws::{Law, fit_law, fit_volumetric, langevin, langevin_methods, models},
        model::Simulation,
        network::modulus_of_swelling,
        network::network,
        network::swollen_fraction,
        network::vulcanized,
        point::{course, fit_kinetics},
        scenes::{check, resume, run, schema, sweep, view},
        surrogates::LearntLaw,
        time::{follow, prony},
    };

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        crate::pool::loaded();
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
