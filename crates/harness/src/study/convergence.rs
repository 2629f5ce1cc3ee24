//! Studies of one quantity, each twice as fine as the one before: where it goes, and how fast.

use super::{LIMIT, ORDER, Solved};
use crate::report::Report;
use crate::scene::{SceneError, Source};
use serde::Deserialize;

/// Three studies with steps or elements of h, h/2, h/4.
///
/// ```toml
/// [[convergence]]
/// name = "wall"
/// quantity = "face.temperature"
/// studies = ["wall-8", "wall-16", "wall-32"]
/// ```
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Convergence {
    /// Name: values are `NAME.limit` and `NAME.order`.
    pub name: String,
    /// The quantity, without the study's name.
    pub quantity: String,
    /// Studies from coarse to fine.
    pub studies: [String; 3],
    /// The two lowest powers of h in the error; default 2 and 4, those of finite elements in space.
    #[serde(default = "space")]
    pub powers: [u32; 2],
}

fn space() -> [u32; 2] {
    [2, 4]
}

impl Convergence {
    /// The limit, without the two powers of h (Richardson 1911, doi:10.1098/rsta.1911.0009), and the observed
    /// order log₂ |(v₀ − v₁)/(v₁ − v₂)|.
    pub fn limit_and_order(&self, [coarse, middle, fine]: [f64; 3]) -> [f64; 2] {
        let [first, second] = self.powers.map(|power| f64::from(power).exp2());
        let without = |fine: f64, coarse: f64, factor: f64| fine + (fine - coarse) / (factor - 1.0);
        let limit = without(without(fine, middle, first), without(middle, coarse, first), second);
        [limit, ((coarse - middle) / (middle - fine)).abs().log2()]
    }

    pub(super) fn check(&self, source: &Source, index: usize, known: &[&str]) -> Result<(), SceneError> {
        let key = |of: &str| format!("convergence[{index}].{of}");
        if let Some(name) = self.studies.iter().find(|name| !known.contains(&name.as_str())) {
            return Err(source.error(&key("studies"), format!("`{name}`"), "names of three studies"));
        }
        let [first, second] = self.powers;
        if !(1..second).contains(&first) || second > 16 {
            let found = format!("{first} and {second}");
            return Err(source.error(&key("powers"), found, "two increasing powers, from 1 to 16"));
        }
        Ok(())
    }

    pub(super) fn add<'a, S: Solved + 'a>(&self, report: &mut Report, of: impl Fn(&String) -> Option<&'a S>) {
        let values = self.studies.each_ref().map(|name| of(name)?.scalar(&self.quantity));
        let [Some((coarse, unit)), Some((middle, _)), Some((fine, _))] = values else { return };
        let [limit, order] = self.limit_and_order([coarse, middle, fine]);
        report.value(LIMIT.named(&[&self.name]).in_unit(unit), limit);
        // of equal values there is none
        if order.is_finite() {
            report.value(ORDER.named(&[&self.name]), order);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_powers_are_taken_out() {
        let spec = |powers| Convergence {
            name: String::new(),
            quantity: String::new(),
            studies: Default::default(),
            powers,
        };
        let values = |p: i32, q: i32| [1.0, 0.5, 0.25].map(|h: f64| 7.0 + 0.3 * h.powi(p) - 0.01 * h.powi(q));
        let [limit, order] = spec([2, 4]).limit_and_order(values(2, 4));
        assert!((limit - 7.0).abs() < 1e-14 && (order - 2.0).abs() < 0.1, "{limit}, {order}");
        let [limit, order] = spec([1, 2]).limit_and_order(values(1, 2));
        assert!((limit - 7.0).abs() < 1e-14 && (order - 1.0).abs() < 0.1, "{limit}, {order}");
    }
}
