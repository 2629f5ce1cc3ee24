//! Pictures without any system library or font: line plots (PNG, SVG) and particle fields (PNG), by [`kuva`].

use std::path::Path;

use crate::Error;

mod axis;
mod blocks;
mod canvas;
mod color;
mod field;
mod line;
mod particles;
mod plot;
mod strips;

pub use color::ColorMap;
pub use field::{FieldMap, Panel};
pub use line::{LegendPlace, LinePlot, Series};
pub use strips::{Stage, Strip, Strips};

fn picture_error(path: &Path, reason: impl ToString) -> Error {
    Error::Data { what: format!("picture {}", path.display()), reason: reason.to_string() }
}

#[cfg(test)]
mod tests;
