//! Formats, units and distances for pictures.

use super::moment::Moment;
use crate::solver::{Criterion, StepRecord};

/// Formats with four digits.
pub fn short(value: f64) -> String {
    let digits = if value == 0.0 { 0 } else { (3 - value.abs().log10().floor() as i32).clamp(0, 6) };
    let text = format!("{value:.*}", digits as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Returns the factor and the name of the unit for stresses up to `largest`, Pa.
pub fn stress_unit(largest: f64) -> (f64, &'static str) {
    let units = [(1e-9, "GPa"), (1e-6, "MPa"), (1e-3, "kPa")];
    units.into_iter().find(|(scale, _)| largest * scale >= 0.1).unwrap_or((1.0, "Pa"))
}

/// Returns the largest distance, in spacings, of lattice neighbours that pictures draw as connected. By
/// stretch criteria it is the critical stretch: the longest observed bond may have broken.
pub(super) fn bridge_length<const D: usize>(m: &Moment<D>) -> f64 {
    let most = match &m.physics.body.criterion {
        Some(Criterion::Stretch(stretch)) => stretch.least(),
        _ => m.each(|row| row.largest_stretch).fold(1.0, f64::max),
    };
    (1.02 * most).clamp(1.5, 100.0)
}

/// Returns the title of a moment: displacement and load of a step, or the equilibrium within a step.
pub(super) fn moment_title(history: &[StepRecord], time: f64) -> String {
    let step = time.ceil() as usize;
    let Some(record) = step.checked_sub(1).and_then(|k| history.get(k)) else { return String::new() };
    let place = format!("U = {} mm", short(record.displacement * 1e3));
    let part = time - time.floor();
    if part > 0.0 {
        format!("{place}, equilibrium {:.0}", part / (1.0 - part))
    } else {
        format!("{place}, F = {} N", short(record.load))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_digits() {
        assert_eq!(
            [116.0, 0.021234, 89.57346, 0.0, 12345.6].map(short),
            ["116", "0.02123", "89.57", "0", "12346"]
        );
    }
}
