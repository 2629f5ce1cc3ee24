//! What a scene of `peri` takes of a fitted law.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use polycore::Error;
use polycore::constitutive::hyperelastic::data::Table;
use polycore::constitutive::hyperelastic::fit::Fit;
use polycore::output::atomic_write;

use super::MPA;

/// Laws of which the printed block is taken before others.
const EIGHT_CHAINS: &str = "eight-chain";

/// Bulk over shear modulus: nearly incompressible. Tests at constant volume do not determine it.
pub const BULK_RATIO: f64 = 100.0;

/// Standard errors to either side of a value that hold 95 % of a normal distribution.
const HALF_WIDTH: f64 = 1.96;

/// `[material.solid]` of `peri` for a fitted law: the law itself, with its intervals of confidence.
fn block(fit: &Fit) -> String {
    let shear = fit.law.shear_modulus();
    let mut text = format!("[material.solid] # {}, rms {:.5} MPa\n", fit.model.key, fit.rms / MPA);
    let _ = writeln!(text, "law = \"correspondence\"");
    let _ = writeln!(text, "[material.solid.constitutive]\nmodel = \"{}\"", fit.model.key);
    let _ = writeln!(
        text,
        "bulk_modulus = \"{:.6} MPa\" # {BULK_RATIO} times the shear modulus of {:.6} MPa: these tests do not determine it",
        BULK_RATIO * shear / MPA,
        shear / MPA
    );
    text += "[material.solid.constitutive.parameters]\n";
    for parameter in &fit.parameters {
        let (unit, scale) = if parameter.unit == "Pa" { (" MPa", MPA) } else { ("", 1.0) };
        let quote = if unit.is_empty() { "" } else { "\"" };
        let _ = write!(text, "{} = {quote}{:.6}{unit}{quote}", parameter.name, parameter.value / scale);
        let _ = match parameter.standard_error {
            Some(error) => writeln!(text, " # ± {:.2e}{unit}, 95 %", HALF_WIDTH * error / scale),
            None => writeln!(text, " # not determined by the data"),
        };
    }
    text
}

/// The block of the eight-chain law with the least rms; without such a one, of the best law.
pub fn best(data: &str, fits: &[Fit]) -> String {
    let chains = |fit: &&Fit| fit.model.key.starts_with(EIGHT_CHAINS);
    let least = |a: &&Fit, b: &&Fit| a.rms.total_cmp(&b.rms);
    let fit = fits.iter().filter(chains).min_by(least).or(fits.iter().min_by(least));
    fit.map_or_else(String::new, |fit| format!("for a scene of peri, from {data}:\n{}", block(fit)))
}

/// `materials.toml`: the block of every fit, under comments.
pub fn write(directory: &Path, all: &[(&str, &Table, Vec<Fit>)]) -> Result<(), Error> {
    atomic_write(directory.join("materials.toml"), |file| {
        writeln!(file, "# Take one block: docs/guide/src/how-to/fit.md says what it can and cannot do.")?;
        for (data, _, fits) in all {
            for fit in fits {
                write!(file, "\n# fitted to {data}\n{}", block(fit))?;
            }
        }
        Ok(())
    })
}
