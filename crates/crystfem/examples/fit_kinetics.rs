//! Hoffman–Lauritzen kinetics fitted to cooling runs that are computed with known constants.

use crystfem::fit::{FixedConstants, KineticFit, Run, nakamura};
use crystfem::kinetics::{KineticConstants, Kinetics, cooling_curve};

/// Constants of the computed runs.
pub const TRUTH: KineticConstants = KineticConstants::TABLE_4_1_COLUMN_1;

/// Fits runs at 1, 5 and 20 K/min with a value every hundredth of α.
pub fn fitted() -> Result<KineticFit, crystfem::Error> {
    let KineticConstants { equilibrium_melting, frozen, activation_energy, .. } = TRUTH;
    let known = FixedConstants { equilibrium_melting, frozen, activation_energy };
    let kinetics = Kinetics::new(TRUTH)?;
    let mut runs = Vec::new();
    for rate in [1.0 / 60.0, 5.0 / 60.0, 20.0 / 60.0] {
        let curve = cooling_curve(&kinetics, rate, equilibrium_melting, 373.15, 0.0, 2);
        let degrees = (1..=99).map(|percent| 0.01 * f64::from(percent));
        let rows = degrees.filter_map(|alpha| Some((curve.temperature_at(alpha)?, alpha)));
        let (temperatures, degrees) = rows.unzip();
        runs.push(Run::cooling(rate, temperatures, degrees, &known)?);
    }
    nakamura(&runs, &known)
}

#[allow(dead_code, reason = "the tests include this file and call what it shows")]
pub(crate) fn main() -> Result<(), crystfem::Error> {
    let fit = fitted()?;
    for constant in &fit.estimates {
        println!("{:16} {:.6e} {}", constant.name, constant.value, constant.unit);
    }
    println!("rms error of α {:.1e}; true constants {TRUTH:?}", fit.rms);
    Ok(())
}
