//! Fitted laws with time as materials of finite-element programs.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use polycore::Error;
use polycore::constitutive::hyperelastic::Hyperelastic;
use polycore::constitutive::viscoelastic::fit::TimeFit;
use polycore::constitutive::viscoelastic::{Hysteresis, Viscoelastic, user_material};
use polycore::file::atomic_write;

use super::card::FILES;
use super::material::{BULK_RATIO, stress};
use super::time_block::bulk_modulus;

/// Writes `time_materials_mm.inp` and `time_materials_si.inp`: the law as a user material, and as
/// `*HYSTERESIS` if Abaqus has it. Returns the number of state variables.
///
/// # Errors
/// As [`TimeFit::law`]; a file that cannot be written.
pub fn write(directory: &Path, found: &TimeFit) -> Result<usize, Error> {
    for (name, units, pascals) in FILES {
        let text = cards(found, units, pascals)?;
        let path = directory.join(format!("time_{name}"));
        atomic_write(path, |file| file.write_all(text.as_bytes()))?;
    }
    Ok(user_material::state_count(found.form.branches.len()))
}

fn cards(found: &TimeFit, units: &str, pascals: f64) -> Result<String, Error> {
    let law = found.law()?;
    let model = found.form.equilibrium;
    let mut text = format!(
        "** units {units}, s; K is {BULK_RATIO} times the modulus of a fast strain: these tests do not \
         determine it\n**\n** {} with branches, rms {}\n",
        model.key,
        stress(found.pooled.rms, 5)
    );
    for open in found.constants.iter().filter(|own| own.constant.fixed.is_none() && own.interval.is_none()) {
        let _ = writeln!(text, "** {}: the data do not determine it", open.constant.name);
    }
    let values = found.values();
    let parameters = model.parameters.iter().zip(&values);
    let scaled = parameters.map(|(own, value)| if own.unit == "Pa" { value / pascals } else { *value });
    let elastic: Vec<f64> = [bulk_modulus(found, &law)? / pascals].into_iter().chain(scaled).collect();
    text += &user_material::card(model.key, &elastic, &law, pascals);
    text += &hysteresis(found, &law, &elastic[1..], pascals)?;
    Ok(text)
}

/// Card of Abaqus' own law, or a comment that says why there is none; `parameters` are those of the
/// equilibrium law in the host's unit. K is 100 times the modulus of the equilibrium law: Abaqus refuses more
/// without hybrid elements.
fn hysteresis(
    found: &TimeFit,
    law: &Viscoelastic,
    parameters: &[f64],
    pascals: f64,
) -> Result<String, Error> {
    let model = found.form.equilibrium;
    let values = found.values();
    let own = &values[..model.parameters.len()];
    Ok(match Hysteresis::new(model, own, law, pascals) {
        Ok(card) => {
            let compliance = 2.0 * pascals / (BULK_RATIO * model.law(own)?.shear_modulus());
            let form = match model.key {
                "eight-chain" => "in five terms, too soft near locking",
                _ => "the same law",
            };
            let note =
                format!("** *HYSTERESIS of Abaqus: {form}; K is {BULK_RATIO} times the modulus at rest");
            format!("**\n{note}\n{}", card.card(model.key, parameters, compliance))
        }
        Err(reason) => format!("**\n** no *HYSTERESIS of Abaqus: {reason}\n"),
    })
}
