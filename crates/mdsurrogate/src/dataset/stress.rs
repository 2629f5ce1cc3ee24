//! Stress columns in different measures, and their conversion to σ.

use super::options::{PLACES, PressureConvention, ReadOptions};
use super::table::{ColumnIndex, DataTable};
use crate::Error;
use crate::kinematics::{NAMES, cauchy_from_material};
use polycore::tensor::{DeformationGradient, Tensor, Voigt, voigt};

/// Largest relative asymmetry of P Fᵀ for a first Piola–Kirchhoff stress with rounding and noise.
const ASYMMETRY: f64 = 0.01;

/// Headings of the components of σ and of pressures; `%` stands for the component.
const CAUCHY: [&str; 4] = ["s%", "sigma_%", "stress_%", "cauchy_%"];
const PRESSURE: [&str; 5] = ["p%", "P%", "p_%", "press_%", "pressure_%"];

/// Columns of stress.
#[derive(Clone, Copy)]
pub(super) enum StressColumns {
    /// Cauchy stress σ.
    Cauchy([ColumnIndex; 6]),
    /// Pressure −σ.
    Pressure([ColumnIndex; 6]),
    /// Second Piola–Kirchhoff stress S.
    Second([ColumnIndex; 6]),
    /// First Piola–Kirchhoff stress P, row by row.
    First([ColumnIndex; 9]),
}

impl StressColumns {
    /// Finds the stress columns of a table with deformations.
    pub fn find(table: &DataTable, prefix: &str, options: &ReadOptions) -> Result<Self, Error> {
        let named = |pattern: &str| PLACES.map(|place| format!("{prefix}{}", pattern.replace('%', place)));
        let first = |pattern: &&&str| named(pattern).iter().any(|name| table.contains(name));
        if let Some(pattern) = CAUCHY.iter().find(first) {
            return Ok(Self::Cauchy(table.columns(named(pattern))?));
        }
        // P12 and P21 are both written for an asymmetric tensor only
        if ["P12", "P21"].iter().all(|name| table.contains(name)) {
            return Ok(Self::First(table.columns(tensor_names("P"))?));
        }
        if table.contains("S11") {
            return Ok(Self::Second(table.columns(NAMES.map(|name| format!("S{name}")))?));
        }
        if let Some(pattern) = PRESSURE.iter().find(first) {
            if options.pressure != Some(PressureConvention::Pressure) && !table.is_lammps() {
                let names = named(pattern);
                return Err(Error::file(
                    &table.path,
                    format!("the pressures (p = −σ) {} … {}", names[0], names[5]),
                    format!(
                        "`stress = \"pressure\"` in `[data]`, which takes σ = −p, or columns {prefix}sxx … \
                         {prefix}syz, positive in tension"
                    ),
                ));
            }
            return Ok(Self::Pressure(table.columns(named(pattern))?));
        }
        if table.contains("P11") {
            let allowed = "nine components of the first Piola–Kirchhoff stress P11 P12 P13 P21 … P33, row \
                by row, or another stress sxx … syz or S11 … S23";
            return Err(Error::file(&table.path, "P11 without P12 and P21", allowed));
        }
        Ok(Self::Cauchy(table.columns(named(CAUCHY[0]))?))
    }

    pub fn columns(&self) -> &[ColumnIndex] {
        match self {
            Self::Cauchy(six) | Self::Pressure(six) | Self::Second(six) => six,
            Self::First(nine) => nine,
        }
    }

    /// Returns the unit of each column, Pa.
    pub fn units(&self, table: &DataTable, options: &ReadOptions) -> Result<Vec<f64>, Error> {
        let default = match self {
            Self::Pressure(_) => options.stress_unit.or(table.pressure_unit()),
            // variables of the user may have any unit
            _ if table.is_lammps() => options.stress_unit,
            _ => Some(options.stress_unit.unwrap_or(1e6)),
        };
        let unit = |column: &ColumnIndex| match table.stress_unit(*column)?.or(default) {
            Some(unit) => Ok(unit),
            None => Err(Error::file(
                &table.path,
                format!("{} without a unit", self.name()),
                "a unit in the headings, as `pxx [atm]`, or `stress_unit` in the scene (pressures of \
                 LAMMPS: 1 atm with `units real`, 1 bar with `units metal`)",
            )),
        };
        self.columns().iter().map(unit).collect()
    }

    /// Returns the name of the measure.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Cauchy(_) => "Cauchy stress",
            Self::Pressure(_) => "pressure (σ = −p)",
            Self::Second(_) => "second Piola–Kirchhoff stress",
            Self::First(_) => "first Piola–Kirchhoff stress",
        }
    }

    /// Computes σ at F from the numbers of the columns, Pa.
    pub fn cauchy(&self, f: &DeformationGradient, numbers: &[f64]) -> Voigt {
        match self {
            Self::Cauchy(_) => Voigt::from_row_slice(numbers),
            Self::Pressure(_) => -Voigt::from_row_slice(numbers),
            Self::Second(_) => cauchy_from_material(f, &Voigt::from_row_slice(numbers)),
            Self::First(_) => cauchy_of_first(f, numbers),
        }
    }
}

/// Computes σ = P Fᵀ/J, its symmetric part; P row by row.
pub(super) fn cauchy_of_first(f: &DeformationGradient, first: &[f64]) -> Voigt {
    let kirchhoff = Tensor::from_row_slice(first) * f.matrix().transpose();
    voigt::from_stress(&(0.5 / f.jacobian() * (kirchhoff + kirchhoff.transpose())))
}

/// Returns the names of nine components, row by row.
pub(super) fn tensor_names(letter: &str) -> [String; 9] {
    std::array::from_fn(|k| format!("{letter}{}{}", k / 3 + 1, k % 3 + 1))
}

/// Check that P and F belong together: P Fᵀ = J σ is symmetric.
#[derive(Default)]
pub(super) struct SymmetryCheck {
    skew: f64,
    skew_of_transpose: f64,
    size: f64,
}

impl SymmetryCheck {
    pub fn add(&mut self, f: &DeformationGradient, numbers: &[f64]) {
        let first = Tensor::from_row_slice(numbers);
        let skew = |tensor: Tensor| (tensor - tensor.transpose()).norm_squared();
        self.skew += skew(first * f.matrix().transpose());
        self.skew_of_transpose += skew(first.transpose() * f.matrix().transpose());
        self.size += first.norm_squared();
    }

    /// Refuses a stress that does not belong to the deformation.
    ///
    /// # Errors
    /// Returns [`Error::File`] with the probable reason.
    pub fn check(&self, path: &std::path::Path) -> Result<(), Error> {
        let limit = ASYMMETRY * ASYMMETRY * self.size;
        if self.skew <= limit {
            return Ok(());
        }
        let (found, allowed) = if self.skew_of_transpose <= limit {
            (
                "the transpose of the first Piola–Kirchhoff stress (nominal stress)",
                "P_iJ, with the normal as second index",
            )
        } else {
            ("no first Piola–Kirchhoff stress of F: P Fᵀ is not symmetric", "P = J σ F⁻ᵀ")
        };
        Err(Error::file(path, found, format!("{allowed}, in the order P11 P12 P13 P21 … P33")))
    }
}
