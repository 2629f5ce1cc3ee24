//! Constants of the material in the order of hosts.

use crystfem::kinetics::{self, Kinetics};
use crystfem::material::{CONSTANT_NAMES, Polymer, Semicrystalline, ThermalProperty};
use crystfem::melting::Melting;
use std::cell::RefCell;

/// Names of the constants, in order.
pub const NAMES: [&str; 15] = [
    "conductivity",
    "specific_heat",
    "latent_heat",
    "kinetics",
    "absolute_zero",
    "host",
    CONSTANT_NAMES[0],
    CONSTANT_NAMES[1],
    CONSTANT_NAMES[2],
    CONSTANT_NAMES[3],
    CONSTANT_NAMES[4],
    CONSTANT_NAMES[5],
    CONSTANT_NAMES[6],
    CONSTANT_NAMES[7],
    CONSTANT_NAMES[8],
];
/// Number of constants before those of the user's own kinetics.
pub const COMMON_COUNT: usize = 6;

/// Invalid constant of the material.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("umatht: {name}: found {found}; allowed: {allowed}")]
pub struct Error {
    /// Name of the constant.
    pub name: &'static str,
    /// Value found.
    pub found: f64,
    /// Allowed values.
    pub allowed: String,
}

impl From<crystfem::Error> for Error {
    fn from(error: crystfem::Error) -> Self {
        match error {
            crystfem::Error::Parameter { name, found, allowed } => Self { name, found, allowed },
            other => Self { name: "the material", found: f64::NAN, allowed: other.to_string() },
        }
    }
}

/// Material with the host's conventions.
pub struct HostMaterial {
    pub material: Semicrystalline,
    /// Absolute temperature at 0 of the host's scale, K.
    pub absolute_zero: f64,
    /// True if the host is CalculiX.
    pub calculix: bool,
}

impl HostMaterial {
    fn new(list: &[f64]) -> Result<Self, Error> {
        let wrong = |place: usize, found: f64, allowed: &str| Error {
            name: NAMES[place],
            found,
            allowed: allowed.to_owned(),
        };
        let &[conductivity, specific_heat, latent, column, ref rest @ ..] = list else {
            let allowed = "4 to 6 constants, 15 with `kinetics` 0";
            return Err(Error { name: "constants", found: list.len() as f64, allowed: allowed.into() });
        };
        for (place, number) in [(0, conductivity), (1, specific_heat)] {
            if !(number.is_finite() && number > 0.0) {
                return Err(wrong(place, number, "above 0"));
            }
        }
        let optional = |k: usize| rest.get(k).copied().unwrap_or(0.0);
        let absolute_zero = optional(0);
        if absolute_zero != 0.0 && absolute_zero != 273.15 {
            return Err(wrong(4, absolute_zero, "0 of a host in kelvin, 273.15 of one in °C"));
        }
        let calculix = match optional(1) {
            0.0 => false,
            1.0 => true,
            other => return Err(wrong(5, other, "0 (Abaqus) or 1 (CalculiX)")),
        };
        let pa12 = Some(Melting::PA12);
        let (kinetics, melting) = match (column, rest) {
            (1.0, _) => (kinetics::KineticConstants::TABLE_4_1_COLUMN_1, pa12),
            (2.0, _) => (kinetics::KineticConstants::TABLE_4_1_COLUMN_2, pa12),
            (
                0.0,
                &[
                    _,
                    _,
                    growth_rate,
                    nucleation,
                    activation_energy,
                    equilibrium_melting,
                    frozen,
                    avrami_exponent,
                    sharpness,
                    shape,
                    peak,
                ],
            ) => {
                let own = kinetics::KineticConstants {
                    growth_rate,
                    nucleation,
                    activation_energy,
                    equilibrium_melting,
                    frozen,
                    avrami_exponent,
                };
                let melts = [sharpness, shape, peak] != [0.0; 3];
                (own, melts.then(|| Melting::new(sharpness, shape, peak)).transpose()?)
            }
            (0.0, &[_, _, _, _, _, _, _, _]) => {
                let allowed = "15 with `kinetics` 0: k_m in 1/K, d and T_p in K of melting are constants 13 \
                               to 15, or 0, 0, 0 for crystals that never melt";
                return Err(Error { name: "constants", found: 12.0, allowed: allowed.into() });
            }
            _ => {
                let allowed = "1 or 2, a column of Table 4.1 (PA12); 0 with constants 7 to 15; 3 with these \
                               in a file (from a host only)";
                return Err(wrong(3, column, allowed));
            }
        };
        if latent.is_nan() || latent < 0.0 {
            return Err(wrong(2, latent, "0 or above"));
        }
        let material = Semicrystalline::new(Polymer {
            // the host has its own
            density: 1.0,
            conductivity: ThermalProperty::Constant(conductivity),
            specific_heat: ThermalProperty::Constant(specific_heat),
            kinetics: Kinetics::new(kinetics)?,
            melting,
            // α alone: the host gives ΔH·X∞
            ultimate_crystallinity: 1.0,
            latent_heat: (latent > 0.0).then_some(latent),
            seed: 0.0,
        })?;
        Ok(Self { material, absolute_zero, calculix })
    }
}

thread_local! {
    /// Constants of the last call on this thread: hosts call once per integration point and iteration.
    static LAST: RefCell<Option<(Vec<f64>, HostMaterial)>> = const { RefCell::new(None) };
}

/// Calls `work` with the material of a list of constants.
///
/// # Errors
/// A constant out of range.
pub fn with_material<R>(list: &[f64], work: impl FnOnce(&HostMaterial) -> R) -> Result<R, Error> {
    LAST.with_borrow_mut(|last| {
        let (_, constants) = match last.take() {
            Some(kept) if kept.0 == list => last.insert(kept),
            _ => last.insert((list.to_vec(), HostMaterial::new(list)?)),
        };
        Ok(work(constants))
    })
}
