//! Fitted laws with time as a material block of `peri`.

use std::fmt::Write as _;

use polycore::constitutive::Error;
use polycore::constitutive::hyperelastic::Hyperelastic;
use polycore::constitutive::viscoelastic::fit::TimeFit;
use polycore::constitutive::viscoelastic::{Branch, Spring, Viscosity};

use super::material::{BULK_RATIO, DIGITS, digits, in_megapascals, stress};

/// Name of a key, number with its unit.
type ConstantText = (String, String);

/// Formats `[material.solid]` with its branches; constants that the data do not determine are marked.
///
/// # Errors
/// As [`TimeFit::law`].
pub fn block(found: &TimeFit) -> Result<String, Error> {
    let law = found.law()?;
    let key = found.form.equilibrium.key;
    let mut text = format!("[material.solid] # {key} with branches, rms {}\n", stress(found.pooled.rms, 5));
    text += "law = \"correspondence\"\n[material.solid.constitutive]\n";
    let values = found.values();
    let shear =
        found.form.equilibrium.law(&values[..found.form.equilibrium.parameters.len()])?.shear_modulus();
    let _ = writeln!(
        text,
        "model = \"{key}\"\nbulk_modulus = \"{}\" # {BULK_RATIO} times the modulus of a fast strain: \
         these tests do not determine it\n[material.solid.constitutive.parameters]",
        stress(BULK_RATIO * (shear + law.branch_modulus()), DIGITS)
    );
    for (parameter, value) in found.form.equilibrium.parameters.iter().zip(&values) {
        let (name, value) = constant(parameter.name, *value, parameter.unit);
        let _ = writeln!(text, "{name} = {value}{}", remark(found, &name));
    }
    for (k, branch) in (1..).zip(law.branches()) {
        let ([spring, viscosity], constants) = described(branch);
        let _ = writeln!(
            text,
            "[[material.solid.branch]]\nspring = \"{spring}\"\nviscosity = \"{viscosity}\"\n\
             [material.solid.branch.parameters]"
        );
        for (name, value) in constants {
            let _ = writeln!(text, "{name} = {value}{}", remark(found, &format!("{k}.{name}")));
        }
    }
    Ok(text)
}

/// Comment on a constant that was fixed or not determined.
fn remark(found: &TimeFit, name: &str) -> String {
    let known = found.constants.iter().find(|constant| constant.constant.name == name);
    match known.map(|constant| (constant.constant.fixed, constant.interval)) {
        Some((Some((_, reason)), _)) => format!(" # fixed: {reason}"),
        Some((None, None)) => " # the data do not determine it".to_owned(),
        _ => String::new(),
    }
}

/// Names of spring and viscosity in scenes, and their constants.
fn described(branch: &Branch) -> ([&'static str; 2], Vec<ConstantText>) {
    let (spring, law, names): (_, &dyn Hyperelastic, Vec<(String, &str)>) = match &branch.spring {
        Spring::NeoHookean(law) => ("neo-hookean", law, vec![("nu".to_owned(), "Pa")]),
        Spring::LopezPamies(law) => {
            let count = law.parameters().len() / 2;
            let named = (1..=count).flat_map(|r| [(format!("nu_{r}"), "Pa"), (format!("beta_{r}"), "1")]);
            (if count == 1 { "lopez-pamies-1" } else { "lopez-pamies-2" }, law, named.collect())
        }
        Spring::EightChain(law) => {
            ("eight-chain", law, vec![("chain_modulus".to_owned(), "Pa"), ("links".to_owned(), "1")])
        }
    };
    let values = law.parameters();
    let mut constants: Vec<ConstantText> =
        names.iter().zip(values).map(|((name, unit), (_, value))| constant(name, value, unit)).collect();
    let (viscosity, own): (_, Vec<(&str, f64, &str)>) = match branch.viscosity {
        Viscosity::Constant(eta) => ("constant", vec![("eta", eta, "Pa s")]),
        Viscosity::KumarLopezPamies { start, end, thickening, thinning, exponents } => (
            "kumar-lopez-pamies",
            vec![
                ("eta_0", start, "Pa s"),
                ("eta_inf", end, "Pa s"),
                ("K_1", thickening, "Pa s"),
                ("K_2", thinning, "1/Pa2"),
                ("gamma_1", exponents[0], "1"),
                ("gamma_2", exponents[1], "1"),
            ],
        ),
        Viscosity::BergstromBoyce { rate, stress, power, creep, offset } => (
            "bergstrom-boyce",
            vec![
                ("rate", rate, "1/s"),
                ("stress", stress, "Pa"),
                ("m", power, "1"),
                ("c", creep, "1"),
                ("xi", offset, "1"),
            ],
        ),
        Viscosity::Eyring { rate, stress, .. } => {
            ("eyring", vec![("rate", rate, "1/s"), ("stress", stress, "Pa")])
        }
    };
    constants.extend(own.into_iter().map(|(name, value, unit)| constant(name, value, unit)));
    ([spring, viscosity], constants)
}

/// Formats a constant, stresses in MPa.
fn constant(name: &str, value: f64, unit: &str) -> ConstantText {
    let (value, unit) = in_megapascals(value, unit);
    let number = digits(value, DIGITS);
    (name.to_owned(), if unit.is_empty() { number } else { format!("\"{number} {unit}\"") })
}
