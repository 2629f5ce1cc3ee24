//! Fitted laws as materials of finite-element programs.

use std::io::Write as _;
use std::path::Path;

use polycore::Error;
use polycore::constitutive::hyperelastic::deck::{card, material_name};
use polycore::constitutive::hyperelastic::fit::Fit;
use polycore::constitutive::hyperelastic::host::CardProgram;
use polycore::file::atomic_write;

use super::material::BULK_RATIO;
use super::table_fits::TableFits;
use super::verdict::FitVerdict;
use super::volumetric::Bulk;

/// Files by system of units: name, description, and the host's unit of stress, Pa.
pub(super) const FILES: [(&str, &str, f64); 2] =
    [("materials_mm.inp", "mm, N, MPa", 1e6), ("materials_si.inp", "m, N, Pa", 1.0)];

/// Writes `materials_mm.inp` and `materials_si.inp` with a card of every fit; a law that the data do not
/// determine is named in a comment.
///
/// # Errors
/// A file that cannot be written.
pub fn write(directory: &Path, all: &[TableFits]) -> Result<(), Error> {
    let measured = all.iter().any(|set| matches!(set.bulk, Bulk::Measured(_)));
    for (name, units, pascals) in FILES {
        let assumed = format!(
            "; K is {BULK_RATIO} times the shear modulus: tests at constant volume do not determine it"
        );
        let mut text = format!("** units {units}{}\n", if measured { "" } else { &assumed });
        for FittedCard { name, set, fit, verdict } in cards(all) {
            let origin = match measured {
                true => format!("; K: {}", set.bulk.origin(fit.law.shear_modulus())),
                false => String::new(),
            };
            let comment = |line: &str| format!("** {line}\n");
            text += &format!("**\n{}", head(set, fit, verdict, &origin, &comment));
            if verdict.unusable.is_none() {
                let compliances = set.bulk.compliances(fit.law.shear_modulus(), pascals);
                text += &card(&name, fit.model.key, &scaled(fit, pascals), &compliances);
            }
        }
        atomic_write(directory.join(name), |file| file.write_all(text.as_bytes()))?;
    }
    Ok(())
}

/// Writes `materials_mm` and `materials_si` of each program, with a material of every fit; a law that a
/// program does not have, or that the data do not determine, is named in a comment.
///
/// # Errors
/// A file that cannot be written.
pub fn write_hosts(directory: &Path, all: &[TableFits], hosts: &[CardProgram]) -> Result<(), Error> {
    for (host, (file, units, pascals)) in hosts.iter().flat_map(|host| FILES.map(|file| (*host, file))) {
        let mut text = host.comment(&format!("units {units}"));
        let mut ids = 1..;
        for FittedCard { name, set, fit, verdict } in cards(all) {
            let (key, shear) = (fit.model.key, fit.law.shear_modulus());
            let comment = |line: &str| host.comment(line);
            let origin = format!("; K: {}", set.bulk.origin(shear));
            let head = head(set, fit, verdict, &origin, &comment);
            if verdict.unusable.is_some() {
                text += &head;
                continue;
            }
            let id = ids.next().unwrap_or_default();
            let name = name.to_lowercase();
            text += &match host.card(
                id,
                &name,
                key,
                &scaled(fit, pascals),
                &set.bulk.compliances(shear, pascals),
            ) {
                Some(card) => head + &card,
                None => host.comment(&format!("{} has no law `{key}`", host.name())),
            };
        }
        let path = directory.join(Path::new(file).with_extension(host.extension()));
        atomic_write(path, |file| file.write_all(text.as_bytes()))?;
    }
    Ok(())
}

/// Fit with the name of its material.
struct FittedCard<'a> {
    name: String,
    set: &'a TableFits<'a>,
    fit: &'a Fit,
    verdict: &'a FitVerdict,
}

/// Lists all fits, with names of which none is there twice.
fn cards<'a>(all: &'a [TableFits<'a>]) -> Vec<FittedCard<'a>> {
    let mut cards: Vec<FittedCard> = Vec::new();
    for (set, (fit, verdict)) in all.iter().flat_map(|set| set.judged().map(move |own| (set, own))) {
        let plain = material_name(fit.model.key, set.name);
        let numbered = (2..).map(|number| format!("{plain}_{number}"));
        let mut names = std::iter::once(plain.clone()).chain(numbered);
        let is_new = |name: &String| cards.iter().all(|card| card.name != *name);
        let name = names.find(is_new).unwrap_or_default();
        cards.push(FittedCard { name, set, fit, verdict });
    }
    cards
}

/// Parameters in the host's unit of stress.
fn scaled(fit: &Fit, pascals: f64) -> Vec<f64> {
    let scale = |unit: &str| if unit == "Pa" { pascals } else { 1.0 };
    fit.parameters.iter().map(|of| of.value / scale(of.unit)).collect()
}

/// Comments above a card, or in its place: origin and warnings, or the reason for which there is none.
fn head(
    set: &TableFits,
    fit: &Fit,
    verdict: &FitVerdict,
    origin: &str,
    comment: &dyn Fn(&str) -> String,
) -> String {
    let key = fit.model.key;
    if let Some(why) = &verdict.unusable {
        return comment(&format!("no card of {key} on {}: {why}", set.name));
    }
    let title = comment(&format!("{key} fitted to {}{origin}", set.name));
    let warnings = [verdict.warnings(), set.bulk.warnings()].concat();
    title + &warnings.iter().map(|line| comment(line)).collect::<String>()
}

#[cfg(test)]
mod tests {
    use super::card;

    #[test]
    fn hosts_have_their_own_forms() {
        for (key, parameters, expected) in [
            ("neo-hookean", &[0.4][..], "*HYPERELASTIC, NEO HOOKE\n2.000000000e-1, 5.000000000e-2\n"),
            (
                "mooney-rivlin",
                &[0.15, 0.02],
                "*HYPERELASTIC, MOONEY-RIVLIN\n1.500000000e-1, 2.000000000e-2, 5.000000000e-2\n",
            ),
            (
                "eight-chain",
                &[0.27, 25.0],
                "*HYPERELASTIC, ARRUDA-BOYCE\n2.700000000e-1, 5.000000000e0, 5.000000000e-2\n",
            ),
            (
                "ogden-2",
                &[0.4, 2.0, 0.1, -1.5],
                "*HYPERELASTIC, OGDEN, N=2\n4.000000000e-1, 2.000000000e0, 1.000000000e-1, \
                 -1.500000000e0, 5.000000000e-2, 0.000000000e0\n",
            ),
            (
                "yeoh",
                &[0.2, 0.002, 5e-5],
                "*HYPERELASTIC, YEOH\n2.000000000e-1, 2.000000000e-3, 5.000000000e-5, \
                 5.000000000e-2, 0.000000000e0, 0.000000000e0\n",
            ),
            (
                "gent",
                &[0.3, 75.0],
                "*USER MATERIAL, CONSTANTS=3\n4.000000000e1, 3.000000000e-1, 7.500000000e1\n",
            ),
        ] {
            let found = card("BAR", key, parameters, &[0.05]);
            assert!(found.ends_with(expected), "{found}");
        }
    }
}
