//! Fitted laws as materials of finite-element programs.

use std::io::Write as _;
use std::path::Path;

use polycore::Error;
use polycore::constitutive::hyperelastic::deck::card;
use polycore::constitutive::hyperelastic::host::CardProgram;
use polycore::file::atomic_write;

use super::material::{BULK_RATIO, unusable};
use super::table_fits::TableFits;
use super::volumetric::Bulk;

/// Files by system of units: name, description, and the host's unit of stress, Pa.
pub(super) const FILES: [(&str, &str, f64); 2] =
    [("materials_mm.inp", "mm, N, MPa", 1e6), ("materials_si.inp", "m, N, Pa", 1.0)];

/// Writes `materials_mm.inp` and `materials_si.inp` with a card of every fit.
///
/// # Errors
/// A file that cannot be written.
pub fn write(directory: &Path, all: &[TableFits]) -> Result<(), Error> {
    let measured = all.iter().any(|set| matches!(set.bulk, Bulk::Measured(_)));
    for (name, units, pascals) in FILES {
        atomic_write(directory.join(name), |file| {
            match measured {
                true => writeln!(file, "** units {units}")?,
                false => writeln!(
                    file,
                    "** units {units}; K is {BULK_RATIO} times the shear modulus: tests at constant volume \
                     do not determine it"
                )?,
            }
            for set in all {
                for fit in set.fits.iter().filter(|fit| unusable(fit).is_none()) {
                    let parameters = fit.parameters.iter();
                    let scale = |unit: &str| if unit == "Pa" { pascals } else { 1.0 };
                    let scaled: Vec<f64> = parameters.map(|of| of.value / scale(of.unit)).collect();
                    let compliances = set.bulk.compliances(fit.law.shear_modulus(), pascals);
                    let origin = match measured {
                        true => format!("; K: {}", set.bulk.origin(fit.law.shear_modulus())),
                        false => String::new(),
                    };
                    writeln!(file, "**\n** {} fitted to {}{origin}", fit.model.key, set.name)?;
                    set.bulk.warnings().iter().try_for_each(|line| writeln!(file, "** {line}"))?;
                    write!(file, "{}", card(fit.model.key, &scaled, &compliances))?;
                }
            }
            Ok(())
        })?;
    }
    Ok(())
}

/// Writes `materials_mm` and `materials_si` of each program, with a material of every fit; a law that a
/// program does not have is named in a comment.
///
/// # Errors
/// A file that cannot be written.
pub fn write_hosts(directory: &Path, all: &[TableFits], hosts: &[CardProgram]) -> Result<(), Error> {
    for (host, (name, units, pascals)) in hosts.iter().flat_map(|host| FILES.map(|file| (*host, file))) {
        let mut text = host.comment(&format!("units {units}"));
        let usable = all.iter().flat_map(|set| set.fits.iter().map(move |fit| (set, fit)));
        for (id, (set, fit)) in (1..).zip(usable.filter(|(_, fit)| unusable(fit).is_none())) {
            let (key, shear) = (fit.model.key, fit.law.shear_modulus());
            let scale = |unit: &str| if unit == "Pa" { pascals } else { 1.0 };
            let scaled: Vec<f64> = fit.parameters.iter().map(|of| of.value / scale(of.unit)).collect();
            text += &match host.card(id, key, &scaled, &set.bulk.compliances(shear, pascals)) {
                Some(card) => {
                    let origin = set.bulk.origin(shear);
                    let head = host.comment(&format!("{key} fitted to {}; K: {origin}", set.name));
                    let warnings =
                        set.bulk.warnings().iter().map(|line| host.comment(line)).collect::<String>();
                    head + &warnings + &card
                }
                None => host.comment(&format!("{} has no law `{key}`", host.name())),
            };
        }
        let name = Path::new(name).with_extension(host.extension());
        atomic_write(directory.join(name), |file| file.write_all(text.as_bytes()))?;
    }
    Ok(())
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
            let found = card(key, parameters, &[0.05]);
            assert!(found.ends_with(expected), "{found}");
        }
    }
}
