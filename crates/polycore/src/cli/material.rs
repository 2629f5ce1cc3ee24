//! What a scene of `peri` takes of a fitted law.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use polycore::Error;
use polycore::constitutive::hyperelastic::data::Table;
use polycore::constitutive::hyperelastic::fit::Fit;
use polycore::output::atomic_write;

use super::MPA;

/// Laws whose chain stretch is that of the bond law `chain-affine`, (2.38).
const EIGHT_CHAINS: &str = "eight-chain";

/// Fewest links that `peri` takes.
const FEWEST_LINKS: f64 = 2.0;

/// `[material]` of `peri` for a fitted law: E = 3μ of an incompressible solid, and its links where it has chains.
fn block(fit: &Fit) -> String {
    let modulus = 3.0 * fit.law.shear_modulus() / MPA;
    let links = fit.parameters.iter().find(|parameter| parameter.name == "links");
    let mut text = format!("[material] # {}: E = 3 mu, exact at small strains\n", fit.model.key);
    let _ = writeln!(text, "youngs_modulus = \"{modulus:.6} MPa\"");
    let eight = fit.model.key.starts_with(EIGHT_CHAINS);
    match links.filter(|_| eight) {
        Some(links) if links.standard_error.is_some() && links.value >= FEWEST_LINKS => {
            let _ = writeln!(text, "law = \"chain-affine\"\nlinks = {:.5}", links.value);
            text += "dissociation = 1200 # tests without rupture do not determine it: the thesis' value\n";
        }
        Some(_) => text += "law = \"linear\" # the data do not determine the number of links\n",
        None => text += "law = \"linear\" # peri takes only the modulus of this law\n",
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
                write!(file, "\n# fitted to {data}, rms {:.5} MPa\n{}", fit.rms / MPA, block(fit))?;
            }
        }
        Ok(())
    })
}
