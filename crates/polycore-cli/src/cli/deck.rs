//! `polycore deck`: laws of an Abaqus or CalculiX deck as blocks of scenes.

use std::fmt::Write as _;
use std::path::PathBuf;

use polycore::Error;
use polycore::constitutive::hyperelastic::deck::{self, DeckMaterial};
use polycore::units::Stress;

use super::material::{DIGITS, digits, stress};

/// Arguments of `polycore deck FILE.inp --stress "1 MPa"`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Deck with `*HYPERELASTIC`, `*HYPERFOAM` or user materials of crate `umat`.
    file: PathBuf,
    /// The deck's unit of stress: "1 MPa" with N and mm, "1 Pa" with N and m.
    #[arg(long, value_name = "QUANTITY", default_value = "1 MPa")]
    stress: Stress,
}

/// Formats a block `[material.solid]` of each material.
///
/// # Errors
/// [`Error::Io`]; [`Error::Option`] for a material without a law in this crate.
pub fn blocks(arguments: &Arguments) -> Result<String, Error> {
    let materials = deck::read(&arguments.file).map_err(|error| match error {
        Error::Constitutive(reason) => {
            Error::Option { option: "deck".to_owned(), reason: reason.to_string() }
        }
        other => other,
    })?;
    Ok(materials.iter().map(|material| block(material, arguments.stress.si())).collect::<Vec<_>>().join("\n"))
}

fn block(material: &DeckMaterial, unit: f64) -> String {
    let mut text = format!("[material.solid] # {}\nlaw = \"correspondence\"\n", material.name);
    let _ = writeln!(text, "[material.solid.constitutive]\nmodel = \"{}\"", material.model.key);
    if let Some(bulk) = material.bulk {
        let _ = writeln!(text, "bulk_modulus = \"{}\"", stress(bulk * unit, DIGITS));
    } else if !material.model.key.starts_with("hyperfoam") {
        text += "# bulk_modulus: the deck has D1 = 0, constant volume; write a stress\n";
    }
    text += "[material.solid.constitutive.parameters]\n";
    for (parameter, value) in material.model.parameters.iter().zip(&material.parameters) {
        let _ = match parameter.unit {
            "Pa" => writeln!(text, "{} = \"{}\"", parameter.name, stress(value * unit, DIGITS)),
            _ => writeln!(text, "{} = {}", parameter.name, digits(*value, DIGITS)),
        };
    }
    text
}
