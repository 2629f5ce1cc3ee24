//! Fitted laws with time as a material block of `peri`.

use std::fmt::Write as _;

use harness::scene::BranchSpec;
use polycore::constitutive::Error;
use polycore::constitutive::hyperelastic::Hyperelastic;
use polycore::constitutive::viscoelastic::Viscoelastic;
use polycore::constitutive::viscoelastic::fit::TimeFit;

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
    let _ = writeln!(
        text,
        "model = \"{key}\"\nbulk_modulus = \"{}\" # {BULK_RATIO} times the modulus of a fast strain: \
         these tests do not determine it\n[material.solid.constitutive.parameters]",
        stress(bulk_modulus(found, &law)?, DIGITS)
    );
    for (parameter, value) in found.form.equilibrium.parameters.iter().zip(&values) {
        let (name, value) = constant(parameter.name, *value, parameter.unit);
        let _ = writeln!(text, "{name} = {value}{}", remark(found, &name));
    }
    if let Some(softening) = law.softening() {
        text += "[material.solid.mullins]\n";
        for (name, value, unit) in
            [("r", softening.ratio, ""), ("m", softening.offset, "Pa"), ("beta", softening.slope, "")]
        {
            let (name, value) = constant(name, value, unit);
            let _ = writeln!(text, "{name} = {value}{}", remark(found, &format!("mullins.{name}")));
        }
    }
    for (k, branch) in (1..).zip(law.branches()) {
        let ([spring, viscosity], constants) = BranchSpec::constants(branch);
        let _ = writeln!(
            text,
            "[[material.solid.branch]]\nspring = \"{spring}\"\nviscosity = \"{viscosity}\"\n\
             [material.solid.branch.parameters]"
        );
        for (name, value, unit) in constants {
            let (name, value) = constant(name, value, unit);
            let _ = writeln!(text, "{name} = {value}{}", remark(found, &format!("{k}.{name}")));
        }
    }
    Ok(text)
}

/// Bulk modulus of a fitted law, Pa, which tests at constant volume do not determine: [`BULK_RATIO`] times
/// the shear modulus of a fast strain.
///
/// # Errors
/// As [`TimeFit::law`].
pub fn bulk_modulus(found: &TimeFit, law: &Viscoelastic) -> Result<f64, Error> {
    let model = found.form.equilibrium;
    let shear = model.law(&found.values()[..model.parameters.len()])?.shear_modulus();
    Ok(BULK_RATIO * (shear + law.branch_modulus()))
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

/// Formats a constant, stresses in MPa.
fn constant(name: &str, value: f64, unit: &str) -> ConstantText {
    let (value, unit) = in_megapascals(value, unit);
    let number = digits(value, DIGITS);
    (name.to_owned(), if unit.is_empty() { number } else { format!("\"{number} {unit}\"") })
}
