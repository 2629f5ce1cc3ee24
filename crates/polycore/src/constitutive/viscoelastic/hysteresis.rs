//! Law of Bergström and Boyce as `*HYSTERESIS` of Abaqus.
//!
//! Network B has S times the stress of the hyperelastic law, and flows with
//! ε̇ = A (λ_cr − 1 + E)^C σ^m, σ the Mises stress, ε̇ = √(⅔ D:D) and λ_cr = √(tr C_v/3) (*Abaqus Theory
//! Guide*, 4.8.1). With the Frobenius norms |τ| = √(⅔) σ and |D| = √(3/2) ε̇ of
//! [`Viscosity::BergstromBoyce`], A = (⅔)^((m+1)/2) γ̇₀/τ̂^m, C = c, E = ξ.

use super::{Shift, Spring, Viscoelastic, Viscosity};
use crate::constitutive::hyperelastic::{Hyperelastic, ModelDescriptor, deck};

/// Constants of `*HYSTERESIS`, in the order of its data line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hysteresis {
    /// S.
    pub scale: f64,
    /// A, 1/(s stress^m).
    pub rate: f64,
    /// m.
    pub power: f64,
    /// C.
    pub creep: f64,
    /// E.
    pub offset: f64,
}

impl Hysteresis {
    /// Converts a law whose equilibrium law is `model` with `parameters`, Pa; A is in a host's unit of stress
    /// of so many pascals.
    ///
    /// # Errors
    /// The reason in words for a law that Abaqus does not have.
    pub fn new(
        model: &ModelDescriptor,
        parameters: &[f64],
        law: &Viscoelastic,
        pascals: f64,
    ) -> Result<Self, &'static str> {
        if law.softening().is_some() {
            return Err("it has no softening; this law softens by its largest strain");
        }
        let [branch] = law.branches() else {
            return Err("it has one branch; this law has another number");
        };
        if branch.shift != Shift::None {
            return Err("it has no shift with temperature");
        }
        let Viscosity::BergstromBoyce { rate, stress, power, creep, offset } = branch.viscosity else {
            return Err("its viscosity is that of Bergström and Boyce");
        };
        let scale = match (&branch.spring, model.key, parameters) {
            (Spring::NeoHookean(spring), "neo-hookean", &[modulus]) => spring.shear_modulus() / modulus,
            (Spring::EightChain(spring), "eight-chain", &[modulus, links]) => {
                let own: Vec<f64> = spring.parameters().into_iter().map(|(_, value)| value).collect();
                if own[1] != links {
                    return Err("its branch is a multiple of the equilibrium law; this one has other links");
                }
                own[0] / modulus
            }
            (Spring::LopezPamies(_), "lopez-pamies", _) => return Err("it has no law of Lopez-Pamies"),
            _ => return Err("its branch is a multiple of an equilibrium law that Abaqus has"),
        };
        let norms = (2.0_f64 / 3.0).powf(0.5 * (power + 1.0));
        let rate = norms * rate * (stress / pascals).powf(-power);
        Ok(Self { scale, rate, power, creep, offset })
    }

    /// Formats it behind the `*HYPERELASTIC` card of `key` with `parameters` and D₁ in the host's unit of
    /// stress, which then states long-term moduli.
    pub fn card(&self, key: &str, parameters: &[f64], compliance: f64) -> String {
        let elastic = deck::card(&deck::material_name(key, ""), key, parameters, &[compliance]);
        let long_term = |line: &str| match line.starts_with("*HYPERELASTIC") {
            true => format!("{line}, MODULI=LONG TERM\n"),
            false => format!("{line}\n"),
        };
        let elastic: String = elastic.lines().map(long_term).collect();
        let Self { scale, rate, power, creep, offset } = *self;
        let numbers = deck::lines(&[scale, rate, power, creep, offset]);
        let note =
            "S, A, m, C, E, the order of a published deck, not run in Abaqus; hybrid elements need D1 = 0";
        format!("** {note}\n{elastic}*HYSTERESIS\n{numbers}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constitutive::hyperelastic::{Compressible, EightChain, NeoHookean, Volumetric, any_model};
    use crate::constitutive::viscoelastic::Branch;
    use crate::tensor::Tensor;

    fn law(spring: Spring, viscosity: Viscosity) -> Viscoelastic {
        let rubber = NeoHookean::new(4e5).unwrap();
        let rubber = Compressible::new(rubber, Volumetric::Ciarlet { lame: 4e7 }).unwrap();
        Viscoelastic::new(Box::new(rubber), vec![Branch::new(spring, viscosity).unwrap()]).unwrap()
    }

    const FLOW: Viscosity =
        Viscosity::BergstromBoyce { rate: 2.0, stress: 3e5, power: 4.5, creep: -0.6, offset: 0.02 };

    /// D = τ/(2η) of the law here has the equivalent rate of Abaqus' equation, at any stress and C_v.
    #[test]
    fn flow_rates_agree() {
        let neo = any_model("neo-hookean").unwrap();
        let own = law(Spring::NeoHookean(NeoHookean::new(6e5).unwrap()), FLOW);
        let card = Hysteresis::new(neo, &[4e5], &own, 1e6).unwrap();
        assert!((card.scale - 1.5).abs() < 1e-15);
        for (a, b, shear, trace) in [(0.1, 0.3, 0.2, 3.0), (-0.5, 0.2, 0.0, 3.4), (1.2, -0.1, 0.7, 9.0)] {
            // MPa
            let tau = Tensor::new(a, shear, 0.0, shear, b, 0.1, 0.0, 0.1, -a - b);
            let j2 = 0.5 * tau.norm_squared();
            let fluidity = FLOW.fluidity(j2 * 1e12, trace).logarithm.exp();
            let flow = tau * (0.5e6 * fluidity);
            let found = (2.0 / 3.0 * flow.norm_squared()).sqrt();
            let mises = (3.0 * j2).sqrt();
            let chain = (trace / 3.0).sqrt() - 1.0 + card.offset;
            let expected = card.rate * chain.powf(card.creep) * mises.powf(card.power);
            assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
        }
    }

    #[test]
    fn cards_and_reasons() {
        let neo = any_model("neo-hookean").unwrap();
        let own = law(Spring::NeoHookean(NeoHookean::new(6e5).unwrap()), FLOW);
        let card = Hysteresis::new(neo, &[4e5], &own, 1e6).unwrap().card("neo-hookean", &[0.4], 0.05);
        let expected = "*MATERIAL, NAME=NEO_HOOKEAN\n*HYPERELASTIC, NEO HOOKE, MODULI=LONG TERM\n\
                        2.000000000e-1, 5.000000000e-2\n*HYSTERESIS\n1.500000000e0, ";
        assert!(
            card.contains(expected) && card.ends_with("4.500000000e0, -6.000000000e-1, 2.000000000e-2\n")
        );
        let eight = any_model("eight-chain").unwrap();
        let chains = |links| Spring::EightChain(EightChain::new(6e5, links).unwrap());
        assert_eq!(Hysteresis::new(eight, &[4e5, 20.0], &law(chains(20.0), FLOW), 1e6).unwrap().scale, 1.5);
        let constant = Viscosity::Constant(1e6);
        for (model, parameters, own, says) in [
            (eight, &[4e5, 20.0][..], law(chains(25.0), FLOW), "other links"),
            (neo, &[4e5][..], law(chains(25.0), FLOW), "multiple of an equilibrium law"),
            (eight, &[4e5, 20.0][..], law(chains(20.0), constant), "Bergström and Boyce"),
        ] {
            let reason = Hysteresis::new(model, parameters, &own, 1e6).unwrap_err();
            assert!(reason.contains(says), "{reason}");
        }
    }
}
