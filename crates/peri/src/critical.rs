//! Critical bond stretch: the readings of "1.2 √n̄", a number, or a fracture energy.

use crate::calibrate::Space;
use crate::error::Error;
use crate::potential::{BondPotential, NetworkStretch};
use polycore::units::EnergyPerArea;
use serde::Deserialize;
use std::f64::consts::PI;

/// As written in a scene: one of `percent_over_contour` (with `reading`), `stretch`, `fracture_energy`.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Critical {
    /// Factor f on the contour stretch √n̄, e.g. 1.2.
    pub percent_over_contour: Option<f64>,
    /// What f√n̄ is the stretch of.
    pub reading: Option<Reading>,
    /// The critical bond stretch itself.
    pub stretch: Option<f64>,
    /// Fracture energy G, from which the stretch follows: the mesh-objective choice.
    pub fracture_energy: Option<EnergyPerArea>,
}

/// Readings of f√n̄ (formulation.md, Critical stretch). (2.38) is the trace of an isochoric deformation: the bond stretch
/// belongs on its right, the chain stretch g on its left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
pub enum Reading {
    /// l = f√n̄.
    R1,
    /// l = f√(n̄/8).
    R2,
    /// g(l) solved the other way round: l = g(f√n̄).
    R3,
    /// l = g(f√(n̄/8)): the literal text, the only physical one.
    #[default]
    R4,
}

impl Reading {
    /// All readings.
    pub const ALL: [Self; 4] = [Self::R1, Self::R2, Self::R3, Self::R4];

    /// The critical bond stretch for a factor and a number of links.
    pub fn stretch(self, factor: f64, links: f64) -> f64 {
        let (contour, eighth) = (factor * links.sqrt(), factor * (links / 8.0).sqrt());
        match self {
            Self::R1 => contour,
            Self::R2 => eighth,
            Self::R3 => NetworkStretch::chain_stretch(contour),
            Self::R4 => NetworkStretch::chain_stretch(eighth),
        }
    }
}

/// What a critical stretch depends on besides its own numbers.
pub struct Context<'a> {
    /// The bond law.
    pub law: &'a dyn BondPotential,
    /// Links per bond, where the law has chains.
    pub links: Option<f64>,
    /// The space.
    pub space: Space,
    /// kθ.
    pub modulus: f64,
    /// Horizon, m.
    pub horizon: f64,
    /// Thickness, m.
    pub thickness: f64,
}

impl Critical {
    /// The critical bond stretch.
    ///
    /// # Errors
    /// [`Error::Parameter`] where none or several of the alternatives are given, or a value is out of its domain.
    pub fn resolve(&self, context: &Context) -> Result<f64, Error> {
        let fault =
            |name, found, allowed: &str| Err(Error::Parameter { name, found, allowed: allowed.to_owned() });
        match (self.percent_over_contour, self.stretch, self.fracture_energy) {
            (Some(factor), None, None) => match context.links {
                Some(links) if factor > 0.0 => Ok(self.reading.unwrap_or_default().stretch(factor, links)),
                Some(_) => fault("critical.percent_over_contour", factor, "above 0"),
                None => fault("critical.percent_over_contour", factor, "a chain law: `pmb` has no links"),
            },
            (None, Some(stretch), None) if stretch > 1.0 => Ok(stretch),
            (None, Some(stretch), None) => fault("critical.stretch", stretch, "above 1"),
            (None, None, Some(energy)) => stretch_of_energy(context, energy.si()),
            _ => fault("critical", f64::NAN, "exactly one of percent_over_contour, stretch, fracture_energy"),
        }
    }
}

/// Fracture energy G of a critical stretch: Φ = ∫₁^{λc} t dλ/kθ, G = tδ⁴kθΦ in a sheet, (2π/5)δ⁵kθΦ in a solid.
pub fn fracture_energy(context: &Context, stretch: f64) -> f64 {
    let energy = context.law.energy(stretch) * context.modulus;
    match context.space {
        Space::Solid => 2.0 * PI / 5.0 * context.horizon.powi(5) * energy,
        _ => context.thickness * context.horizon.powi(4) * energy,
    }
}

/// The stretch at which a bond has stored its share of G, by bisection: energy grows with stretch in tension.
fn stretch_of_energy(context: &Context, energy: f64) -> Result<f64, Error> {
    let fault = |allowed: &str| {
        Err(Error::Parameter { name: "critical.fracture_energy", found: energy, allowed: allowed.to_owned() })
    };
    if !(energy > 0.0 && energy.is_finite()) {
        return fault("above 0");
    }
    let (mut low, mut high) = (1.0, 2.0);
    while fracture_energy(context, high) < energy {
        low = high;
        high *= 2.0;
        if high > 1e9 {
            return fault("smaller: no bond stretch stores it");
        }
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if fracture_energy(context, middle) < energy { low = middle } else { high = middle }
    }
    Ok(0.5 * (low + high))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::modulus;
    use crate::potential::Law;

    /// formulation.md, table of the four examples, to its printed digits.
    #[test]
    fn readings_of_the_four_examples() {
        let table = [
            (1.2, 720.0, [32.20, 11.38, 5.849, 2.9442]),
            (1.1, 400.0, [22.0, 7.78, 4.542, 2.3037]),
            (1.1, 200.0, [15.56, 5.50, 3.613, 1.8574]),
            (1.1, 100.0, [11.0, 3.89, 2.879, 1.5193]),
        ];
        for (factor, links, expected) in table {
            for ((reading, expected), digits) in
                Reading::ALL.iter().zip(expected).zip([6e-3, 6e-3, 6e-4, 6e-5])
            {
                let found = reading.stretch(factor, links);
                assert!(
                    (found - expected).abs() <= digits,
                    "{reading:?} {factor} {links}: {found} {expected}"
                );
            }
        }
    }

    #[test]
    fn stretch_and_fracture_energy_invert_each_other() {
        for law in Law::ALL {
            for (space, horizon) in [(Space::PlaneStress, 6e-3), (Space::Solid, 6e-3)] {
                let built = law.build(720.0, 1200.0, false).unwrap();
                let kt = modulus(space, 0.6e6, horizon, 3e-3);
                let context = Context {
                    law: &*built,
                    links: Some(720.0),
                    space,
                    modulus: kt,
                    horizon,
                    thickness: 3e-3,
                };
                let energy = fracture_energy(&context, 1.7);
                let found = stretch_of_energy(&context, energy).unwrap();
                assert!((found - 1.7).abs() < 1e-12, "{law:?}: {found}");
            }
        }
    }

    /// For the linear bond: G = (2π/5)δ⁵kθ·(3/2)s² = (6/5)·E·s²δ... against Silling & Askari's G = 9Ks²δ/5 ... in 3D.
    #[test]
    fn linear_bond_has_the_textbook_fracture_energy() {
        let (e, horizon, s) = (1e7, 0.03, 0.02);
        let law = Law::Pmb.build(0.0, 0.0, false).unwrap();
        let kt = modulus(Space::Solid, e, horizon, 1.0);
        let context =
            Context { law: &*law, links: None, space: Space::Solid, modulus: kt, horizon, thickness: 1.0 };
        // G₀ = (π/10) c s₀² δ⁵ with c = 6kθ (Silling & Askari 2005, Eq. (24): πcs₀²δ⁵/10)
        let exact = PI / 10.0 * 6.0 * kt * s * s * horizon.powi(5);
        assert!((fracture_energy(&context, 1.0 + s) / exact - 1.0).abs() < 1e-12);
    }
}
