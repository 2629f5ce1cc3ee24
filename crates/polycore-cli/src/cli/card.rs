//! Fitted laws as materials of Abaqus and CalculiX.

use std::io::Write as _;
use std::path::Path;

use polycore::Error;
use polycore::constitutive::hyperelastic::deck::card;
use polycore::file::atomic_write;

use super::material::{BULK_RATIO, unusable};
use super::table_fits::TableFits;

/// Files by system of units: name, description, and the host's unit of stress, Pa.
const FILES: [(&str, &str, f64); 2] =
    [("materials_mm.inp", "mm, N, MPa", 1e6), ("materials_si.inp", "m, N, Pa", 1.0)];

/// Writes `materials_mm.inp` and `materials_si.inp` with a card of every fit.
///
/// # Errors
/// A file that cannot be written.
pub fn write(directory: &Path, all: &[TableFits]) -> Result<(), Error> {
    for (name, units, pascals) in FILES {
        atomic_write(directory.join(name), |file| {
            writeln!(
                file,
                "** units {units}; K is {BULK_RATIO} times the shear modulus: tests at constant volume do \
                 not determine it"
            )?;
            for set in all {
                for fit in set.fits.iter().filter(|fit| unusable(fit).is_none()) {
                    let parameters = fit.parameters.iter();
                    let scale = |unit: &str| if unit == "Pa" { pascals } else { 1.0 };
                    let scaled: Vec<f64> = parameters.map(|of| of.value / scale(of.unit)).collect();
                    let bulk = set.bulk.modulus(fit.law.shear_modulus()) / pascals;
                    write!(
                        file,
                        "**\n** {} fitted to {}\n{}",
                        fit.model.key,
                        set.name,
                        card(fit.model.key, &scaled, bulk)
                    )?;
                }
            }
            Ok(())
        })?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::card;

    #[test]
    fn hosts_have_their_own_forms() {
        for (key, parameters, expected) in [
            ("neo-hookean", &[0.4][..], "*HYPERELASTIC, NEO HOOKE\n2.000000e-1, 5.000000e-2\n"),
            (
                "mooney-rivlin",
                &[0.15, 0.02],
                "*HYPERELASTIC, MOONEY-RIVLIN\n1.500000e-1, 2.000000e-2, 5.000000e-2\n",
            ),
            (
                "eight-chain",
                &[0.27, 25.0],
                "*HYPERELASTIC, ARRUDA-BOYCE\n2.700000e-1, 5.000000e0, 5.000000e-2\n",
            ),
            (
                "ogden-2",
                &[0.4, 2.0, 0.1, -1.5],
                "*HYPERELASTIC, OGDEN, N=2\n4.000000e-1, 2.000000e0, 1.000000e-1, -1.500000e0, 5.000000e-2, \
                 0.000000e0\n",
            ),
            (
                "yeoh",
                &[0.2, 0.002, 5e-5],
                "*HYPERELASTIC, YEOH\n2.000000e-1, 2.000000e-3, 5.000000e-5, 5.000000e-2, 0.000000e0, \
                 0.000000e0\n",
            ),
            ("gent", &[0.3, 75.0], "*USER MATERIAL, CONSTANTS=3\n4.000000e1, 3.000000e-1, 7.500000e1\n"),
        ] {
            let found = card(key, parameters, 40.0);
            assert!(found.ends_with(expected), "{found}");
        }
    }
}
