//! Material blocks for scenes of `peri`, from fitted laws.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use polycore::Error;
use polycore::constitutive::hyperelastic::fit::{Fit, FittedParameter};
use polycore::file::atomic_write;

use super::MPA;
use super::ranking;
use super::table_fits::{TableFits, unit_of};
use super::verdict::FitVerdict;
use super::volumetric::Bulk;

/// Laws whose block is printed in preference to others.
const EIGHT_CHAINS: &str = "eight-chain";

/// Ratio of bulk to shear modulus: nearly incompressible. Tests at constant volume do not determine it.
pub const BULK_RATIO: f64 = 100.0;

/// Number of standard errors to either side of a value that hold 95 % of a normal distribution.
const HALF_WIDTH: f64 = 1.96;

/// Converts stresses in a value of a law with time to MPa; returns it with its unit.
pub fn in_megapascals(value: f64, unit: &str) -> (f64, &'static str) {
    match unit {
        "Pa" => (value / MPA, "MPa"),
        "Pa s" => (value / MPA, "MPa s"),
        "1/Pa^2" => (value * MPA * MPA, "1/MPa^2"),
        "1/s" => (value, "1/s"),
        _ => (value, ""),
    }
}

/// Formats `[material.solid]` of `peri` for a fitted law, with its confidence intervals. For a law that the
/// data do not determine, or that is not elliptic there, it is a comment with advice.
fn block(fit: &Fit, verdict: &FitVerdict, bulk: Bulk) -> String {
    let rms = stress(fit.rms, 5);
    let lost = || verdict.without_ellipticity().map(|lost| lost + ", where a simulation localises");
    if let Some(why) = verdict.unusable.clone().or_else(lost) {
        return format!("# {}, rms {rms}: no block, {why}\n", fit.model.key);
    }
    let shear = fit.law.shear_modulus();
    let mut text = format!("[material.solid] # {}, rms {rms}\n", fit.model.key);
    let warnings = [verdict.warnings(), bulk.warnings()].concat();
    warnings.iter().for_each(|line| text += &format!("# {line}\n"));
    let _ = writeln!(text, "law = \"correspondence\"");
    let _ = writeln!(text, "[material.solid.constitutive]\nmodel = \"{}\"", fit.model.key);
    let _ =
        writeln!(text, "bulk_modulus = \"{}\" # {}", stress(bulk.modulus(shear), DIGITS), bulk.origin(shear));
    text += "[material.solid.constitutive.parameters]\n";
    for parameter in &fit.parameters {
        let is_stress = parameter.unit == "Pa";
        let value = if is_stress {
            format!("\"{}\"", stress(parameter.value, DIGITS))
        } else {
            digits(parameter.value, DIGITS)
        };
        let _ = write!(text, "{} = {value}", parameter.name);
        let _ = match parameter.standard_error.map(|error| HALF_WIDTH * error) {
            Some(error) if is_stress => {
                let (unit, scale) = unit_of(parameter.value);
                writeln!(text, " # ± {:.2e} {unit}, 95 %", error / scale)
            }
            Some(error) => writeln!(text, " # ± {error:.2e}, 95 %"),
            None => writeln!(text, " # the data do not determine its error"),
        };
    }
    text
}

/// Formats the block of the law that a ranking puts first; without one, that of the eight-chain law with the
/// least rms or, without such a law, of the best law. Laws that are stable and whose parameters are all known
/// to half of their size come first; a law that the data do not determine, or that is not elliptic within
/// them, is never taken.
pub fn best(set: &TableFits) -> String {
    let ranked = ranking::best(&set.ranked).map(|law| law.key);
    let known = |fit: &Fit| {
        let sure = |parameter: &FittedParameter| {
            parameter.standard_error.is_some_and(|error| HALF_WIDTH * error < parameter.value.abs())
        };
        fit.parameters.iter().all(sure)
    };
    let usable = || set.judged().filter(|(_, verdict)| verdict.is_recommended());
    let sure = || usable().filter(|(fit, verdict)| known(fit) && verdict.instability.is_none());
    let least = |a: &(&Fit, &FitVerdict), b: &(&Fit, &FitVerdict)| a.0.rms.total_cmp(&b.0.rms);
    let best = usable().find(|(fit, _)| ranked == Some(fit.model.key));
    let best = best
        .or_else(|| sure().filter(|(fit, _)| fit.model.key.starts_with(EIGHT_CHAINS)).min_by(least))
        .or_else(|| sure().min_by(least))
        .or_else(|| usable().filter(|(_, verdict)| verdict.instability.is_none()).min_by(least))
        .or_else(|| usable().min_by(least));
    let data = set.name;
    match best {
        Some((fit, verdict)) => {
            // indented lines are printed as they are
            let block = block(fit, verdict, set.bulk);
            let indented: String = block.lines().map(|line| format!("  {line}\n")).collect();
            format!("for a scene of peri, from {data}:\n{indented}")
        }
        None if set.fits.is_empty() => String::new(),
        None => format!("{data}: no block for a scene of peri: no law is determined and elliptic there\n"),
    }
}

/// Names the laws of a table that are no materials, or not elliptic there, in a line; empty without any.
pub fn doubts(set: &TableFits) -> String {
    let open = set
        .judged()
        .filter_map(|(fit, verdict)| Some(format!("{} ({})", fit.model.key, verdict.open.as_deref()?)));
    let open: Vec<String> = open.collect();
    let usable = set.judged().filter(|(_, verdict)| verdict.unusable.is_none());
    let lost = usable.filter_map(|(fit, verdict)| {
        let states = verdict.without_ellipticity()?;
        Some(format!("{} is {states}", fit.model.key))
    });
    let open = (!open.is_empty()).then(|| format!("no block, no card of {}", open.join(", ")));
    let parts: Vec<String> = open.into_iter().chain(lost).collect();
    match parts.is_empty() {
        true => String::new(),
        false => format!("warning: {}: {}\n", set.name, parts.join("; ")),
    }
}

/// Writes `materials.toml`: the block of every fit, under comments.
pub fn write(directory: &Path, all: &[TableFits]) -> Result<(), Error> {
    atomic_write(directory.join("materials.toml"), |file| {
        writeln!(file, "# Use one block; docs/guide/src/how-to/fit.md describes its limits.")?;
        for set in all {
            for (fit, verdict) in set.judged() {
                write!(file, "\n# fitted to {}\n{}", set.name, block(fit, verdict, set.bulk))?;
            }
        }
        Ok(())
    })
}

/// Number of significant digits of parameters in files.
pub const DIGITS: usize = 10;
/// Number of significant digits on the terminal.
pub const SHOWN: usize = 7;

/// Formats a stress with its unit.
pub fn stress(value: f64, significant: usize) -> String {
    let (unit, scale) = unit_of(value);
    format!("{} {unit}", digits(value / scale, significant))
}

/// Formats a number with so many significant digits.
pub fn digits(value: f64, significant: usize) -> String {
    let exponent = if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 };
    let after = significant as i32 - 1 - exponent;
    match exponent {
        -5..=6 => format!("{value:.*}", after.max(0) as usize),
        _ => format!("{value:.*e}", significant - 1),
    }
}
