//! Studies of one quantity, each twice as fine as the one before: where it goes, and how fast.

use super::{PartScene, check_name};
use harness::scene::{SceneError, Source};
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
pub struct ConvergenceSpec {
    /// Its name: values are `NAME.limit` and `NAME.order`.
    pub name: String,
    /// The quantity, without the study's name.
    pub quantity: String,
    /// From coarse to fine.
    pub studies: [String; 3],
    /// The two lowest powers of h in the error; default 2 and 4, those of finite elements in space.
    #[serde(default = "space")]
    pub powers: [u32; 2],
}

fn space() -> [u32; 2] {
    [2, 4]
}

impl ConvergenceSpec {
    /// The limit, without the two powers of h (Richardson 1911, doi:10.1098/rsta.1911.0009), and the observed order
    /// log₂ |(v₀ − v₁)/(v₁ − v₂)|.
    pub fn limit_and_order(&self, [coarse, middle, fine]: [f64; 3]) -> [f64; 2] {
        let [first, second] = self.powers.map(|power| f64::from(power).exp2());
        let without = |fine: f64, coarse: f64, factor: f64| fine + (fine - coarse) / (factor - 1.0);
        let limit = without(without(fine, middle, first), without(middle, coarse, first), second);
        [limit, ((coarse - middle) / (middle - fine)).abs().log2()]
    }
}

impl PartScene {
    /// Checks names and powers.
    ///
    /// # Errors
    /// Names that are taken or that no study has, powers that do not rise from 1 on.
    pub fn check_convergence(&self, source: &Source) -> Result<(), SceneError> {
        for (index, spec) in self.convergence.iter().enumerate() {
            let key = |of: &str| format!("convergence[{index}].{of}");
            check_name(source, &key("name"), &spec.name)?;
            let taken = self.study.iter().map(|study| &study.name);
            let taken = taken.chain(self.convergence[..index].iter().map(|other| &other.name));
            if taken.into_iter().any(|other| *other == spec.name) {
                return Err(source.error(&key("name"), format!("`{}` twice", spec.name), "a unique name"));
            }
            for name in &spec.studies {
                if !self.study.iter().any(|study| study.name == *name) {
                    let allowed = "names of three studies";
                    return Err(source.error(&key("studies"), format!("`{name}`"), allowed));
                }
            }
            let [first, second] = spec.powers;
            if !(1..second).contains(&first) || second > 16 {
                let found = format!("{first} and {second}");
                return Err(source.error(&key("powers"), found, "two increasing powers, from 1 to 16"));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_powers_are_taken_out() {
        let spec = |powers| ConvergenceSpec {
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
