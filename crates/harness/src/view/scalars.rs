//! Components and invariants of an array that are shown, each with name and unit.

use nalgebra::Matrix3;
use polycore::tensor::von_mises;

/// The value of a scalar from the components of an array at a place.
pub type ScalarRule = Box<dyn Fn(&[f64]) -> f64>;

/// A scalar made of the components of an array at a place.
pub struct ArrayScalar {
    /// Name on the page.
    pub name: String,
    /// Components of the array.
    pub components: usize,
    /// Value at a place.
    pub of: ScalarRule,
    /// The least are shown first, and dropped last.
    pub rank: u8,
    unit: &'static str,
}

/// Names of the components of a symmetric tensor of six, in VTK's order, and of one of nine, rows first.
const SIX: [&str; 6] = ["11", "22", "33", "12", "23", "13"];
/// Positions of the six components of a symmetric tensor among nine, rows first.
const OF_NINE: [usize; 6] = [0, 4, 8, 1, 5, 2];

impl ArrayScalar {
    /// Returns the unit of values up to `largest`, and what to multiply by.
    pub fn shown(&self, largest: f64) -> (&'static str, f64) {
        let units: &[(&'static str, f64)] = match self.unit {
            "Pa" => &[("GPa", 1e-9), ("MPa", 1e-6), ("kPa", 1e-3)],
            "m" => &[("m", 1.0), ("mm", 1e3), ("µm", 1e6)],
            _ => &[],
        };
        let fits = |(_, scale): &&(&str, f64)| largest * scale >= 0.1;
        units.iter().find(fits).copied().unwrap_or((self.unit, 1.0))
    }
}

/// Returns the scalars of an array, those of bodies in a plane without the third direction.
pub fn scalars(array: &str, components: usize, plane: bool) -> Vec<ArrayScalar> {
    let (stem, unit) = match array {
        _ if ["cauchy", "piola", "contact"].iter().any(|kind| array.starts_with(kind)) => (array, "Pa"),
        _ => [("_Pa", "Pa"), ("_degC", "°C"), ("_m", "m")]
            .into_iter()
            .find_map(|(end, unit)| Some((array.strip_suffix(end)?, unit)))
            .unwrap_or((array, "")),
    };
    let rank = u8::from(array.starts_with("piola")) * 8;
    let scalar = |what: &str, order: u8, of: ScalarRule| {
        let name = if what.is_empty() { stem.to_owned() } else { format!("{stem} {what}") };
        ArrayScalar { name, components, of, rank: rank + order, unit }
    };
    match components {
        1 => vec![scalar("", 0, Box::new(|values| values[0]))],
        6 | 9 => {
            let part = move |k: usize| if components == 9 { OF_NINE[k] } else { k };
            let six = move |values: &[f64]| -> [f64; 6] { [0, 1, 2, 3, 4, 5].map(|k| values[part(k)]) };
            let mut list = Vec::new();
            if !array.starts_with("piola") {
                list.push(scalar("von Mises", 1, Box::new(move |values| von_mises(six(values)))));
                list.push(scalar(
                    "largest principal",
                    2,
                    Box::new(move |values| largest_principal(six(values))),
                ));
            }
            for k in (0..6).filter(|k| !plane || [0, 1, 3].contains(k)) {
                list.push(scalar(SIX[k], if k < 3 { 1 } else { 3 }, Box::new(move |values| values[part(k)])));
            }
            list
        }
        _ => {
            let length = |values: &[f64]| values.iter().map(|x| x * x).sum::<f64>().sqrt();
            let mut list = vec![scalar("magnitude", 1, Box::new(length))];
            for k in 0..components {
                list.push(scalar(&format!("{}", k + 1), 4, Box::new(move |values| values[k])));
            }
            list
        }
    }
}

fn largest_principal(six: [f64; 6]) -> f64 {
    if six.iter().any(|x| !x.is_finite()) {
        return f64::NAN;
    }
    let [a, b, c, d, e, f] = six;
    Matrix3::new(a, d, f, d, b, e, f, e, c).symmetric_eigenvalues().max()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invariants_of_known_states() {
        // pure shear τ: principal stress τ, von Mises √3 τ; a pressure adds nothing to the latter
        let shear = [-5.0, -5.0, -5.0, 2.0, 0.0, 0.0];
        assert!((von_mises(shear) - 2.0 * 3f64.sqrt()).abs() < 1e-14);
        assert!((largest_principal(shear) + 3.0).abs() < 1e-13);
        assert!(largest_principal([f64::NAN; 6]).is_nan());
        let names = |plane| -> Vec<String> {
            scalars("cauchy_hardy", 9, plane).into_iter().map(|scalar| scalar.name).collect()
        };
        assert_eq!((names(true).len(), names(false).len()), (5, 8));
        let nine = [1.0, 2.0, 3.0, 2.0, 5.0, 6.0, 3.0, 6.0, 9.0];
        let find = |name: &str| {
            let all = scalars("residual_stress_Pa", 9, false);
            let scalar = all.into_iter().find(|scalar| scalar.name == name).unwrap();
            ((scalar.of)(&nine), scalar.shown(3e4))
        };
        assert_eq!(find("residual_stress 23"), (6.0, ("kPa", 1e-3)));
        assert_eq!(find("residual_stress 13").0, 3.0);
        let heat = &scalars("temperature_degC", 1, false)[0];
        assert_eq!((heat.name.as_str(), heat.shown(200.0)), ("temperature", ("°C", 1.0)));
    }
}
