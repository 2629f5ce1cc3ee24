//! Draws values over the number of a study: `r=0.7`, `r=0.8`, `r=0.9`.

use super::outcome::VariantOutcome;
use harness::output::picture::{LinePlot, Series};
use harness::report::{Bound, Expect, SceneUnits};
use polycore::Error;
use std::path::Path;

/// Number of studies from which a picture is drawn.
const FEWEST: usize = 3;

/// Values of one name over the number of their studies.
struct StudyCurve {
    /// Name of the value.
    value: String,
    /// Key of the studies.
    key: String,
    /// Spacing and horizon of the studies.
    lattice: String,
    /// Number and reference.
    references: Vec<[f64; 2]>,
    /// Number and computed value.
    computed: Vec<[f64; 2]>,
    unit: String,
}

/// Draws `study_KEY_VALUE.png` for each value with a reference in at least three studies `KEY=NUMBER`: the
/// computed values as points, the references as a line, in the units of the scene. Of several spacings or
/// horizons the first that the expectations name is drawn.
///
/// # Errors
/// A file that cannot be written.
pub fn draw_studies(
    expectations: &[Expect],
    outcomes: &[VariantOutcome],
    units: &SceneUnits,
    output: &Path,
) -> Result<(), Error> {
    for curve in curves(expectations, outcomes) {
        let numbers = curve.computed.iter().chain(&curve.references);
        let largest = numbers.map(|point| point[1].abs()).fold(0.0, f64::max);
        let shown = units.shown(&curve.unit, largest);
        let (scale, unit) = shown.map_or((1.0, &*curve.unit), |shown| (shown.factor, shown.name));
        let split = |points: &[[f64; 2]]| -> (Vec<f64>, Vec<f64>) {
            let mut points = points.to_vec();
            points.sort_by(|a, b| a[0].total_cmp(&b[0]));
            points.iter().map(|[x, y]| (*x, scale * y)).unzip()
        };
        let name = curve.value.replace('_', " ");
        let label = if unit.is_empty() { name.clone() } else { format!("{name} [{unit}]") };
        let [references, computed] = [&curve.references, &curve.computed].map(|points| split(points));
        LinePlot::new(&name)
            .axes(&curve.key, &label)
            .size(520.0, 440.0)
            .series(Series::markers("computed", &computed.0, &computed.1))
            .series(Series::reference("reference", &references.0, &references.1))
            .write(output.join(format!("study_{}_{}.png", curve.key, curve.value)))?;
    }
    Ok(())
}

/// Collects the curves, in the order of the expectations.
fn curves(expectations: &[Expect], outcomes: &[VariantOutcome]) -> Vec<StudyCurve> {
    let mut curves: Vec<StudyCurve> = Vec::new();
    for expect in expectations {
        let Bound::Near { reference, .. } = expect.bound else { continue };
        let Some((value, variant)) = expect.quantity.strip_suffix(']').and_then(|name| name.split_once('['))
        else {
            continue;
        };
        let Some((lattice, key, number)) = numbered(variant) else { continue };
        let known = |curve: &StudyCurve| curve.value == value && curve.key == key;
        // a spacing or horizon of its own has no part in the line of the others
        if curves.iter().any(|curve| known(curve) && curve.lattice != lattice) {
            continue;
        }
        let place = curves.iter().position(known);
        let place = place.unwrap_or_else(|| {
            let [value, key, lattice] = [value, key, lattice].map(str::to_owned);
            let (references, computed, unit) = (Vec::new(), Vec::new(), String::new());
            curves.push(StudyCurve { value, key, lattice, references, computed, unit });
            curves.len() - 1
        });
        let curve = &mut curves[place];
        curve.references.push([number, reference]);
        let solved = outcomes.iter().filter(|outcome| outcome.name == variant);
        for (_, found, unit) in solved.flat_map(|outcome| &outcome.values).filter(|found| found.0 == value) {
            if found.is_finite() {
                curve.computed.push([number, *found]);
                curve.unit.clone_from(unit);
            }
        }
    }
    curves.retain(|curve| curve.references.len() >= FEWEST && !curve.computed.is_empty());
    curves
}

/// Returns the lattice, key and number of a study `KEY=NUMBER`, the last word of the name of a variant; a
/// ratio of two values has no variant of its own.
fn numbered(variant: &str) -> Option<(&str, &str, f64)> {
    let (lattice, study) = variant.rsplit_once(' ').filter(|_| !variant.contains(['[', ']']))?;
    let (key, number) = study.split_once('=')?;
    let number: f64 = number.parse().ok()?;
    let is_lattice = key == "m";
    (!is_lattice && number.is_finite()).then_some((lattice, key, number))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_studies() {
        assert_eq!(numbered("dx=1mm m=3.015 r=0.7"), Some(("dx=1mm m=3.015", "r", 0.7)));
        let ratio = "dx=1mm m=3.015 r=1] / load[dx=1mm m=3.015 r=2";
        let infinite = "dx=1mm m=3.015 n=inf";
        for other in ["dx=1mm m=3.015", "dx=1mm m=3.015 fine", "dx=1mm m=3.015 a=x", "r=0.7", ratio, infinite]
        {
            assert_eq!(numbered(other), None, "{other}");
        }
    }
}
