//! `polycore deck`: laws of a finite-element program as blocks of scenes.

use std::fmt::Write as _;
use std::path::PathBuf;

use polycore::Error;
use polycore::constitutive::hyperelastic::deck_reader::{self, DeckMaterial, MaterialDeck};
use polycore::constitutive::hyperelastic::host::CardProgram;
use polycore::units::Stress;

use super::material::{DIGITS, digits, stress};

/// Arguments of `polycore deck FILE.inp --stress "1 MPa"`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Abaqus or CalculiX deck with `*HYPERELASTIC`, `*HYPERFOAM` or user materials of crate `umat`; or
    /// `.mac`, `.k` (`.key`, `.dyn`), `.feb`, `.i` with the materials that a fit writes for Ansys, LS-DYNA,
    /// FEBio, MOOSE.
    file: PathBuf,
    /// The deck's unit of stress: "1 MPa" with N and mm, "1 Pa" with N and m.
    #[arg(long, value_name = "QUANTITY", default_value = "1 MPa")]
    stress: Stress,
}

/// Formats a block `[material.solid]` of each material, and a comment for each that is left out.
///
/// # Errors
/// [`Error::Io`]; [`Error::Option`] for a file without a law in this crate.
pub fn blocks(arguments: &Arguments) -> Result<String, Error> {
    let path = &arguments.file;
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_lowercase();
    let found = match CardProgram::find(&ending) {
        Some(host) => host.read(path),
        None => deck_reader::read(path),
    };
    let MaterialDeck { materials, left_out } = found.map_err(|error| match error {
        Error::Constitutive(reason) => {
            Error::Option { option: "deck".to_owned(), reason: reason.to_string() }
        }
        other => other,
    })?;
    let blocks = materials.iter().map(|material| block(material, arguments.stress.si()));
    let comments: String = left_out.iter().map(|reason| format!("# left out: {reason}\n")).collect();
    let all = blocks.chain((!comments.is_empty()).then_some(comments)).collect::<Vec<_>>();
    Ok(all.join("\n"))
}

fn block(material: &DeckMaterial, unit: f64) -> String {
    let mut text = format!("[material.solid] # {}\n", material.name);
    material.notes.iter().for_each(|note| text += &format!("# {note}\n"));
    text += "law = \"correspondence\"\n";
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
