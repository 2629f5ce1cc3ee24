//! Numbers, units and distances of pictures.

use super::moment::Moment;
use crate::solver::{Criterion, StepRecord};

/// Four digits.
pub fn short(value: f64) -> String {
    let digits = if value == 0.0 { 0 } else { (3 - value.abs().log10().floor() as i32).clamp(0, 6) };
    let text = format!("{value:.*}", digits as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// The unit in which pictures show stresses up to `largest`, Pa: 1 over it, and its name.
pub fn stress_unit(largest: f64) -> (f64, &'static str) {
    let units = [(1e-9, "GPa"), (1e-6, "MPa"), (1e-3, "kPa")];
    units.into_iter().find(|(scale, _)| largest * scale >= 0.1).unwrap_or((1.0, "Pa"))
}

/// How far apart, in spacings, neighbours on a lattice may be that are still bonded: no intact bond was longer. Where
/// bonds break, the longest observed may have broken.
pub(super) fn bridge<const D: usize>(m: &Moment<D>) -> f64 {
    let most = match &m.physics.body.criterion {
        Some(Criterion::Stretch(stretch)) => stretch.least(),
        _ => m.each(|row| row.largest_stretch).fold(1.0, f64::max),
    };
    (1.02 * most).clamp(1.5, 100.0)
}

/// What a moment of a run is called: a load step's displacement and load, or a place within a step.
pub(super) fn title(history: &[StepRecord], time: f64) -> String {
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
