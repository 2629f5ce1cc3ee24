//! Columns of stress in the measures that tables have, turned into σ.

use super::options::{Measure, PLACES, ReadOptions};
use super::table::{Column, Table};
use crate::Error;
use crate::kinematics::{NAMES, cauchy_from_material};
use polycore::tensor::{DeformationGradient, Tensor, Voigt, voigt};

/// P Fᵀ of a first Piola–Kirchhoff stress is symmetric; rounding in tables and noise stay below this part of it.
const ASYMMETRY: f64 = 0.01;

/// Headings of the six components of σ, of its pressure, and of S; `%` stands for the place.
const CAUCHY: [&str; 4] = ["s%", "sigma_%", "stress_%", "cauchy_%"];
const PRESSURE: [&str; 5] = ["p%", "P%", "p_%", "press_%", "pressure_%"];

/// Where a table keeps stress.
#[derive(Clone, Copy)]
pub(super) enum Stress {
    /// σ.
    Cauchy([Column; 6]),
    /// −σ.
    Pressure([Column; 6]),
    /// S.
    Second([Column; 6]),
    /// P, row by row.
    First([Column; 9]),
}

impl Stress {
    /// The stress beside a deformation F.
    pub fn of_deformation(table: &Table, prefix: &str, options: &ReadOptions) -> Result<Self, Error> {
        let named = |pattern: &str| PLACES.map(|place| format!("{prefix}{}", pattern.replace('%', place)));
        let first = |pattern: &&&str| named(pattern).iter().any(|name| table.has(name));
        if let Some(pattern) = CAUCHY.iter().find(first) {
            return Ok(Self::Cauchy(table.columns(named(pattern))?));
        }
        // P12 and P21: of a symmetric tensor nobody writes both
        if ["P12", "P21"].iter().all(|name| table.has(name)) {
            return Ok(Self::First(table.columns(nine("P"))?));
        }
        if table.has("S11") {
            return Ok(Self::Second(table.columns(NAMES.map(|name| format!("S{name}")))?));
        }
        if let Some(pattern) = PRESSURE.iter().find(first) {
            if options.measure != Some(Measure::Pressure) && !table.is_lammps() {
                let names = named(pattern);
                return Err(Error::file(
                    &table.path,
                    format!(
                        "the pressures {} … {}: a pressure has the other sign, p = −σ",
                        names[0], names[5]
                    ),
                    format!(
                        "`stress = \"pressure\"` in `[data]` (then σ = −p is taken), or columns {prefix}sxx … {prefix}syz, \
                         positive in tension"
                    ),
                ));
            }
            return Ok(Self::Pressure(table.columns(named(pattern))?));
        }
        if table.has("P11") {
            let allowed = "nine components of the first Piola–Kirchhoff stress, P11 P12 P13 P21 … P33, row by row, or of \
                           another stress sxx … syz or S11 … S23";
            return Err(Error::file(&table.path, "P11, but not both of P12 and P21", allowed));
        }
        Ok(Self::Cauchy(table.columns(named(CAUCHY[0]))?))
    }

    pub fn columns(&self) -> &[Column] {
        match self {
            Self::Cauchy(six) | Self::Pressure(six) | Self::Second(six) => six,
            Self::First(nine) => nine,
        }
    }

    /// Pa in a unit of each column.
    pub fn units(&self, table: &Table, options: &ReadOptions) -> Result<Vec<f64>, Error> {
        let default = match self {
            Self::Pressure(_) => options.stress_unit.or(table.pressure_unit()),
            // a variable of somebody's own may have any unit
            _ if table.is_lammps() => options.stress_unit,
            _ => Some(options.stress_unit.unwrap_or(1e6)),
        };
        let of = |column: &Column| match table.stress_unit(*column)?.or(default) {
            Some(unit) => Ok(unit),
            None => Err(Error::file(
                &table.path,
                format!("{} without a unit", self.name()),
                "a unit in the headings, as `pxx [atm]`, or `stress_unit` in the scene (pressures of LAMMPS: 1 atm with `units real`, 1 bar \
                 with `units metal`)",
            )),
        };
        self.columns().iter().map(of).collect()
    }

    /// What it is called, for a line that tells how a table was understood.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Cauchy(_) => "Cauchy stress",
            Self::Pressure(_) => "pressure (σ = −p)",
            Self::Second(_) => "second Piola–Kirchhoff stress",
            Self::First(_) => "first Piola–Kirchhoff stress",
        }
    }

    /// σ at F of the numbers of its columns, Pa.
    pub fn cauchy(&self, f: &DeformationGradient, numbers: &[f64]) -> Voigt {
        match self {
            Self::Cauchy(_) => Voigt::from_row_slice(numbers),
            Self::Pressure(_) => -Voigt::from_row_slice(numbers),
            Self::Second(_) => cauchy_from_material(f, &Voigt::from_row_slice(numbers)),
            Self::First(_) => cauchy_of_first(f, numbers),
        }
    }
}

/// σ = P Fᵀ/J of P row by row; its symmetric part.
pub(super) fn cauchy_of_first(f: &DeformationGradient, first: &[f64]) -> Voigt {
    let kirchhoff = Tensor::from_row_slice(first) * f.matrix().transpose();
    voigt::from_stress(&(0.5 / f.jacobian() * (kirchhoff + kirchhoff.transpose())))
}

/// Names of nine components, row by row.
pub(super) fn nine(letter: &str) -> [String; 9] {
    std::array::from_fn(|k| format!("{letter}{}{}", k / 3 + 1, k % 3 + 1))
}

/// Whether P and F go together: P Fᵀ = J σ is symmetric.
#[derive(Default)]
pub(super) struct Symmetry {
    skew: f64,
    skew_of_transpose: f64,
    size: f64,
}

impl Symmetry {
    pub fn add(&mut self, f: &DeformationGradient, numbers: &[f64]) {
        let first = Tensor::from_row_slice(numbers);
        let skew = |tensor: Tensor| (tensor - tensor.transpose()).norm_squared();
        self.skew += skew(first * f.matrix().transpose());
        self.skew_of_transpose += skew(first.transpose() * f.matrix().transpose());
        self.size += first.norm_squared();
    }

    /// # Errors
    /// A stress that is none of this deformation.
    pub fn check(&self, path: &std::path::Path) -> Result<(), Error> {
        let limit = ASYMMETRY * ASYMMETRY * self.size;
        if self.skew <= limit {
            return Ok(());
        }
        let (found, allowed) = if self.skew_of_transpose <= limit {
            (
                "the transpose of the first Piola–Kirchhoff stress (the nominal stress of some authors)",
                "P_iJ with the face second",
            )
        } else {
            ("P11 … P33 that are no first Piola–Kirchhoff stress of F: P Fᵀ is not symmetric", "P = J σ F⁻ᵀ")
        };
        Err(Error::file(path, found, format!("{allowed}, P11 P12 P13 P21 … P33")))
    }
}
