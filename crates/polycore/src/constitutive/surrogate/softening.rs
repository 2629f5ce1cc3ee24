//! Damage variable: lowers the stress of an energy on unloading.

use super::{Prediction, Surrogate, Workspace};
use crate::constitutive::{Error, Law};
use crate::tensor::Voigt;
use serde::{Deserialize, Serialize};

/// Bound of (m/m₀)^c.
const LARGEST_GROWTH: f64 = 1e12;

/// Pseudo-elasticity (Ogden and Roxburgh 1999, <https://doi.org/10.1098/rspa.1999.0431>) with a monotone
/// network in place of their error function: S = (1 − d) 2 ∂W/∂C with
///
/// > d = 1 − exp(−Σₖ aₖ tanh(bₖ (1 − W/m)) (m/m₀)^cₖ), aₖ, bₖ, cₖ ≥ 0,
///
/// where m is the greatest W of the history. While W grows beyond it, d = 0; d grows as W falls, and with m
/// at any W, so that no cycle gains work. A small c is damage from the first strain on, a large one that of
/// chains which break near m₀.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Softening {
    /// (aₖ, bₖ, cₖ) of each unit.
    pub units: Vec<[f64; 3]>,
    /// m₀: the greatest W of the training data, J/m³.
    pub greatest: f64,
}

/// Loading history of a point.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SofteningHistory {
    /// m: the greatest W, J/m³; 0 at first.
    pub greatest: f64,
}

impl Softening {
    /// Checks the units.
    ///
    /// # Errors
    /// [`Error::Invalid`] for numbers that are negative or not finite, and for no unit.
    pub fn check(&self) -> Result<(), Error> {
        let good = |value: &f64| value.is_finite() && *value >= 0.0;
        if self.units.is_empty() || !self.units.iter().flatten().all(good) {
            let found = format!("{:?}", self.units);
            return Err(Error::invalid("softening", found, "units of three numbers, 0 or more"));
        }
        match self.greatest > 0.0 && self.greatest.is_finite() {
            true => Ok(()),
            false => Err(Error::invalid("softening", self.greatest, "a positive energy")),
        }
    }

    /// d and ∂d/∂W at an energy W below the greatest of the history.
    pub fn damage(&self, energy: f64, history: SofteningHistory) -> [f64; 2] {
        let most = history.greatest;
        if energy >= most {
            return [0.0; 2];
        }
        let (mut sum, mut slope) = (0.0, 0.0);
        for [a, b, c] in &self.units {
            let fall = (b * (1.0 - energy / most)).tanh();
            // far beyond m₀ nothing is left, and no product is 0 · ∞
            let reached = a * (most / self.greatest).powf(*c).min(LARGEST_GROWTH);
            sum += reached * fall;
            slope -= reached * (1.0 - fall * fall) * b / most;
        }
        let kept = (-sum).exp();
        [1.0 - kept, kept * slope]
    }
}

impl Surrogate<f64> {
    /// Adds softening to the energy.
    ///
    /// # Errors
    /// [`Softening::check`]; [`Error::Invalid`] for a law without an energy.
    pub fn with_softening(mut self, softening: Softening) -> Result<Self, Error> {
        self.header.softening = Some(softening);
        self.header.check()?;
        Ok(self)
    }

    /// Computes S at C after a history and updates the history; ℂ on unloading is (1 − d) ℂ₀ − S₀ ⊗ S₀ ∂d/∂W.
    /// For a law without softening it equals [`Surrogate::stress`] and [`Surrogate::tangent`].
    ///
    /// # Errors
    /// Those of [`Surrogate::tangent`].
    pub fn follow(
        &self,
        c: &Voigt,
        tangent: bool,
        history: &mut SofteningHistory,
        memory: &mut Workspace,
    ) -> Result<Prediction, Error> {
        let mut answer = if tangent { Law::tangent(self, c, memory) } else { Law::stress(self, c, memory) }?;
        let (Some(softening), Some(energy)) = (&self.header.softening, answer.energy) else {
            return Ok(answer);
        };
        history.greatest = history.greatest.max(energy);
        let [damage, slope] = softening.damage(energy, *history);
        // dW = S : dE
        answer.tangent = answer
            .tangent
            .map(|tangent| tangent * (1.0 - damage) - answer.stress * answer.stress.transpose() * slope);
        answer.stress *= 1.0 - damage;
        answer.deviation *= 1.0 - damage;
        answer.spread *= 1.0 - damage;
        Ok(answer)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Header, Kind, Symmetry};
    use super::*;
    use crate::constitutive::network::Activation::Softplus;

    fn law() -> Surrogate {
        let header = Header::new(Kind::polyconvex_energy(Symmetry::Isotropic), &[(8, Softplus)], 2);
        let softening = Softening { units: vec![[0.4, 3.0, 2.0], [0.1, 20.0, 0.5]], greatest: 1e5 };
        Surrogate::random(header, 3).unwrap().with_softening(softening).unwrap()
    }

    fn at(stretch: f64) -> Voigt {
        Voigt::new(stretch * stretch, 1.0, 1.0, 0.05 * (stretch - 1.0), 0.0, 0.0)
    }

    /// Loading is that of the energy; after it the stress is lower, in a cycle work is lost, and a second
    /// cycle below the greatest energy follows one curve.
    #[test]
    fn unloads_below_the_curve_of_loading() {
        let (law, mut memory, mut history) = (law(), Workspace::default(), SofteningHistory::default());
        let stretches =
            |from: f64, to: f64| (0..=200).map(move |k| from + (to - from) * f64::from(k) / 200.0);
        for stretch in stretches(1.0, 1.3) {
            let own = law.follow(&at(stretch), false, &mut history, &mut memory).unwrap();
            assert_eq!(own, law.stress(&at(stretch), &mut memory).unwrap(), "{stretch}");
        }
        let mut down = Vec::new();
        for stretch in stretches(1.3, 1.0).skip(1) {
            let own = law.follow(&at(stretch), false, &mut history, &mut memory).unwrap().stress;
            let first = law.stress(&at(stretch), &mut memory).unwrap().stress;
            assert!(own.norm() < first.norm() || first.norm() < 1e-6, "{stretch}: {own} {first}");
            down.push(own);
        }
        for (stretch, down) in stretches(1.0, 1.3).skip(1).zip(down.iter().rev().skip(1)) {
            let again = law.follow(&at(stretch), false, &mut history, &mut memory).unwrap().stress;
            assert!((again - down).norm() <= 1e-9 * down.norm(), "{stretch}");
        }
        // the same point after more: more damage
        let [before, _] =
            law.header().softening.as_ref().unwrap().damage(1e4, SofteningHistory { greatest: 2e4 });
        let [after, _] =
            law.header().softening.as_ref().unwrap().damage(1e4, SofteningHistory { greatest: 3e4 });
        assert!(0.0 < before && before < after && after < 1.0);
        let far = Softening { units: vec![[1e3, 20.0, 80.0]], greatest: 1.0 };
        assert_eq!(far.damage(1e5, SofteningHistory { greatest: 1e6 }).map(f64::abs), [1.0, 0.0]);
    }

    /// Against central differences of S, 2 ∂S/∂C, on unloading.
    #[test]
    fn tangent_of_unloading() {
        let (law, mut memory) = (law(), Workspace::default());
        let mut history =
            SofteningHistory { greatest: law.stress(&at(1.3), &mut memory).unwrap().energy.unwrap() };
        let c = at(1.1);
        let tangent = law.follow(&c, true, &mut history, &mut memory).unwrap().tangent.unwrap();
        for b in 0..6 {
            let step = Voigt::from_fn(|k, _| if k == b { 1e-5 } else { 0.0 });
            let up = law.follow(&(c + step), false, &mut history, &mut memory).unwrap().stress;
            let low = law.follow(&(c - step), false, &mut history, &mut memory).unwrap().stress;
            // a shear of C counts twice, as doubled shear strains do
            let slope = (up - low) / 2e-5 * if b < 3 { 2.0 } else { 1.0 };
            assert!((slope - tangent.column(b)).norm() < 1e-7 * tangent.norm(), "{b}");
        }
        assert!((tangent - tangent.transpose()).norm() < 1e-12 * tangent.norm());
    }

    #[test]
    fn what_is_no_softening() {
        let softening = |units, greatest| Softening { units, greatest };
        for wrong in [
            softening(vec![], 1.0),
            softening(vec![[-1.0, 1.0, 1.0]], 1.0),
            softening(vec![[1.0, f64::NAN, 1.0]], 1.0),
            softening(vec![[1.0; 3]], 0.0),
        ] {
            assert!(law().with_softening(wrong).is_err());
        }
        let ann = Surrogate::random(Header::new(Kind::Ann, &[(3, Softplus)], 1), 1).unwrap();
        assert!(ann.with_softening(softening(vec![[1.0; 3]], 1.0)).is_err());
        // with the law in its file
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("law.safetensors");
        law().write(&path).unwrap();
        assert_eq!(Surrogate::read(&path).unwrap().header(), law().header());
    }
}
