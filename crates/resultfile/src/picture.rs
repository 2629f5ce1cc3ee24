//! Pictures without any system library or font: line plots (PNG, SVG), particle fields and solids (PNG), by
//! [`kuva`].

use std::path::Path;

use polycore::Error;

mod axis;
mod bar;
mod blocks;
mod canvas;
mod color;
mod cubes;
mod field;
mod film;
mod line;
mod particles;
mod plot;
mod shade;
mod skin;
mod solid;
mod strips;

pub use color::ColorMap;
pub use cubes::Particles;
pub use field::{FieldMap, Panel};
pub use line::{LegendPlace, LinePlot, Series};
pub use skin::{Corner, Plane, Skin, View};
pub use solid::Solids;
pub use strips::{Stage, Strip, Strips};

fn picture_error(path: &Path, reason: impl ToString) -> Error {
    Error::Data { what: format!("picture {}", path.display()), reason: reason.to_string() }
}

#[cfg(test)]
mod tests;
