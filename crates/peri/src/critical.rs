//! Critical bond stretch: interpretations of "1.2 √n̄", a number, or a fracture energy.

mod area;
mod crossing;

pub use area::CrackArea;
pub use crossing::{Convention, Crossing};

use crate::bonds::BodyGeometry;
use crate::calibrate::{Space, modulus};
use crate::error::Error;
use crate::material::{Driving, PointLaw, energy_at_strength};
use crate::potential::{BondPotential, BondSoftening, NetworkStretch};
use crate::solver::{Bilinear, Criterion};
use polycore::numerics::{bisect, bisected};
use polycore::units::{EnergyPerArea, Stress};
use serde::Deserialize;
use std::f64::consts::PI;

/// Critical stretch of a scene: one of `percent_over_contour` (with `interpretation`), `stretch`,
/// `fracture_energy`.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Critical {
    /// Factor f on the contour stretch √n̄, e.g. 1.2.
    pub percent_over_contour: Option<f64>,
    /// Stretch that f√n̄ refers to.
    pub interpretation: Option<Interpretation>,
    /// Critical bond stretch.
    pub stretch: Option<f64>,
    /// Fracture energy G, from which the stretch follows: independent of the mesh.
    pub fracture_energy: Option<EnergyPerArea>,
    /// Energy that the fracture energy of a bond law refers to; default: `tearing`; of an inclusion, that of
    /// the base material.
    pub convention: Option<Convention>,
    /// Uniaxial tensile strength, force over the undeformed section, in addition to the fracture energy:
    /// bonds soften. Of a solid, or of a `linear` law with `convention = "softening"`.
    pub strength: Option<Stress>,
    /// Kink of the softening of a bond law with a strength: fraction of the strength, and of the opening at
    /// which a crack is free; default: none. Concrete: [0.333, 0.222] (Petersson).
    pub kink: Option<[f64; 2]>,
    /// Energy of a solid with branches that breaking has to release; default: `equilibrium`.
    pub driving: Option<Driving>,
}

/// Interpretations of f√n̄, R1 to R4 in the documents (formulation.md, Critical stretch). (2.38) is the trace
/// of an isochoric deformation: the bond stretch belongs on its right, the chain stretch g on its left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Interpretation {
    /// R1: l = f√n̄.
    BondFull,
    /// R2: l = f√(n̄/8).
    BondEighth,
    /// R3: (2.38) solved in reverse: l = g(f√n̄).
    ChainFull,
    /// R4: l = g(f√(n̄/8)): the literal text, the only physical interpretation.
    #[default]
    ChainEighth,
}

impl Interpretation {
    /// All interpretations.
    pub const ALL: [Self; 4] = [Self::BondFull, Self::BondEighth, Self::ChainFull, Self::ChainEighth];

    /// Name in scenes.
    pub fn name(self) -> &'static str {
        match self {
            Self::BondFull => "bond-full",
            Self::BondEighth => "bond-eighth",
            Self::ChainFull => "chain-full",
            Self::ChainEighth => "chain-eighth",
        }
    }

    /// Computes the critical bond stretch for a factor and a number of links.
    pub fn stretch(self, factor: f64, links: f64) -> f64 {
        let (contour, eighth) = (factor * links.sqrt(), factor * (links / 8.0).sqrt());
        match self {
            Self::BondFull => contour,
            Self::BondEighth => eighth,
            Self::ChainFull => NetworkStretch::chain_stretch(contour),
            Self::ChainEighth => NetworkStretch::chain_stretch(eighth),
        }
    }
}

/// Body and law data that a critical stretch depends on.
pub struct Context<'a> {
    /// The bond law.
    pub law: &'a dyn BondPotential,
    /// Links per bond, if the law has chains.
    pub links: Option<f64>,
    /// The space.
    pub space: Space,
    /// kθ.
    pub modulus: f64,
    /// Horizon, m.
    pub horizon: f64,
    /// Thickness, m.
    pub thickness: f64,
    /// Bonds across a cut through the body.
    pub crossing: Crossing,
    /// Default convention of a fracture energy.
    pub convention: Convention,
    /// Softening of the convention of that name, see [`Critical::softening`].
    pub softening: BondSoftening,
}

/// Computes the energy density Y_c, J/m³, beyond which bonds of a solid with the fracture energy G, J/m²,
/// break: G/(c Σ ŵ|ξ₁|), with the sum over the largest family of the body. c = 1.13 + 0.98/m, m the horizon
/// over the spacing, makes the crack of a pure-shear strip run at G (cases/ch5/rubber-tearing): bonds ahead
/// of a tip release less than the mean of those that a crack cuts.
pub fn energy_limit<const D: usize>(bonds: &dyn BodyGeometry<D>, fracture_energy: f64) -> f64 {
    let (reach, calibration) = share_of_crack(bonds);
    fracture_energy / (calibration * reach)
}

/// Σ ŵ|ξ₁| of the largest family, m, and c of bonds that break at once.
fn share_of_crack<const D: usize>(bonds: &dyn BodyGeometry<D>) -> (f64, f64) {
    // the axis along which the family reaches farthest, for bodies thinner than the family
    let mut most = [0.0_f64; 2];
    for &site in bonds.particles() {
        let (mut whole, mut reach) = (0.0, [0.0; D]);
        bonds.neighbours(site as usize, &mut |bond| {
            whole += bond.volume;
            (0..D).for_each(|d| reach[d] += bond.volume * bond.bond[d].abs());
        });
        if whole > most[0] {
            most = [whole, reach.into_iter().fold(0.0, f64::max)];
        }
    }
    (most[1] / most[0], 1.13 + 0.98 * bonds.spacing() / bonds.horizon())
}

/// c of bonds of ductility 1, 2, 4, and 8 or more, over that of bonds that break at once: softening spreads
/// the load over the bonds ahead of the tip. Linear in log₂ e_f in between. From pure-shear strips of rubber
/// and of small strains: theory/fracture.md of the guide.
const CALIBRATION: [f64; 4] = [1.0, 0.85, 0.73, 0.62];

/// Softening law of bonds with the strength whose uniform state has the energy density Y₀ = `onset`, J/m³,
/// and the fracture energy G, J/m²: Y_c = G/(c(Y_c/Y₀) Σ ŵ|ξ₁|), see [`energy_limit`].
///
/// # Errors
/// The limit Y_c of bonds that break at once, if it is below Y₀: such bonds break before their strength.
pub fn bilinear<const D: usize>(
    bonds: &dyn BodyGeometry<D>,
    fracture_energy: f64,
    onset: f64,
) -> Result<Bilinear, f64> {
    let (reach, brittle) = share_of_crack(bonds);
    let calibration = |ductility: f64| {
        let place = ductility.log2().clamp(0.0, 3.0);
        let at = (place as usize).min(2);
        brittle * (CALIBRATION[at] + (place - at as f64) * (CALIBRATION[at + 1] - CALIBRATION[at]))
    };
    // e_f c(e_f) grows with e_f
    let wanted = fracture_energy / (reach * onset);
    if wanted.is_nan() || wanted < brittle {
        return Err(fracture_energy / (brittle * reach));
    }
    let most = wanted / calibration(8.0);
    let [_, high] = bisect(1.0, most, 100, |ductility| ductility * calibration(ductility) < wanted);
    Ok(Bilinear { onset, limit: high * onset })
}

/// Alternatives of [`Critical`].
pub const ONE_OF: &str = "exactly one of `percent_over_contour`, `stretch`, `fracture_energy`";

impl Critical {
    /// Names of the alternatives given.
    pub fn alternatives(&self) -> Vec<&'static str> {
        let all = [
            ("percent_over_contour", self.percent_over_contour.is_some()),
            ("stretch", self.stretch.is_some()),
            ("fracture_energy", self.fracture_energy.is_some()),
        ];
        all.into_iter().filter(|(_, given)| *given).map(|(name, _)| name).collect()
    }

    /// Criterion for breaking bonds of a solid: a stretch, an energy, or an energy of softening beyond a
    /// strength.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a strength that the law does not reach or that is too large for the fracture
    /// energy.
    pub fn solid_criterion<const D: usize>(
        &self,
        law: &dyn PointLaw<D>,
        bonds: &dyn BodyGeometry<D>,
    ) -> Result<Criterion, Error> {
        let energy = self.fracture_energy.map_or(f64::NAN, |energy| energy.si());
        match (self.stretch, self.strength.map(|strength| strength.si())) {
            (Some(stretch), _) => Ok(stretch.into()),
            (None, None) => Ok(Criterion::Energy(energy_limit(bonds, energy).into())),
            (None, Some(strength)) => {
                let fault =
                    |allowed| Error::Parameter { name: "critical.strength", found: strength, allowed };
                let onset = energy_at_strength(law, strength)
                    .ok_or_else(|| fault("a stress that the law reaches in uniaxial tension".to_owned()))?;
                let softening = bilinear(bonds, energy, onset).map_err(|limit| {
                    fault(format!(
                        "less, or a finer spacing: at it W = {onset:.4e} J/m³, and bonds of this fracture \
                         energy break at {limit:.4e} J/m³"
                    ))
                })?;
                Ok(softening.into())
            }
        }
    }

    /// Softening of bonds with a strength: λ₀ by [`BondSoftening::uniaxial_strength`], e_f from the
    /// fracture energy G = kθΦ_f Σ_J w V_J |ξ_e||ξ|, as for [`fracture_energy`]; default without one.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a strength at which bonds store more than the fracture energy, or without
    /// one.
    pub fn softening(&self, context: &Context) -> Result<BondSoftening, Error> {
        let Some(strength) = self.strength.map(|strength| strength.si()) else {
            return Ok(BondSoftening::default());
        };
        let fault = |allowed| Error::Parameter { name: "critical.strength", found: strength, allowed };
        let soft = self.convention.unwrap_or(context.convention) == Convention::Softening;
        let Some(energy) = self.fracture_energy.filter(|_| soft).map(|energy| energy.si()) else {
            return Err(fault("none without a fracture energy by `softening`".to_owned()));
        };
        let space = if context.space == Space::Solid { Space::Solid } else { Space::PlaneStress };
        let strain = strength * modulus(space, 1.0, context.horizon, context.thickness) / context.modulus;
        let mut ratio = 1.0;
        for _ in 0..100 {
            let rise = context.crossing.reach * context.modulus * context.law.energy(1.0 + strain / ratio);
            if !(strength > 0.0 && energy > rise) {
                return Err(fault(format!(
                    "above 0, and a lower strength or a finer spacing: at this strength bonds already store \
                     {rise:.4e} of the {energy:.4e} J/m²"
                )));
            }
            let softening = BondSoftening::of_linear(energy / rise, self.kink);
            let next = softening.uniaxial_strength(space);
            if (next - ratio).abs() < 1e-12 {
                return Ok(softening);
            }
            ratio = next;
        }
        Err(fault("a lower strength: no softening was found that has it".to_owned()))
    }

    /// λ₀ and the critical bond stretch λ_f; with a strength it sets the softening of the context.
    ///
    /// # Errors
    /// As [`Self::softening`] and [`Self::resolve`].
    pub fn softened(&self, context: &mut Context) -> Result<[f64; 2], Error> {
        if self.strength.is_some() {
            context.softening = self.softening(context)?;
        }
        let end = self.resolve(context)?;
        Ok([context.softening.onset(end), end])
    }

    /// Computes the critical bond stretch.
    ///
    /// # Errors
    /// [`Error::Parameter`] if none or several of the alternatives are given, or a value is out of its
    /// domain.
    pub fn resolve(&self, context: &Context) -> Result<f64, Error> {
        let fault =
            |name, found, allowed: &str| Err(Error::Parameter { name, found, allowed: allowed.to_owned() });
        match (self.percent_over_contour, self.stretch, self.fracture_energy) {
            (Some(factor), None, None) => match context.links {
                Some(links) => {
                    // below the contour that (2.38) maps to 1, its left branch compresses
                    let contour = match self.interpretation.unwrap_or_default() {
                        Interpretation::BondFull | Interpretation::ChainFull => factor * links.sqrt(),
                        Interpretation::BondEighth | Interpretation::ChainEighth => {
                            factor * (links / 8.0).sqrt()
                        }
                    };
                    if contour > 1.0 && contour.is_finite() {
                        Ok(self.interpretation.unwrap_or_default().stretch(factor, links))
                    } else {
                        fault(
                            "critical.percent_over_contour",
                            factor,
                            "finite and above the contour 1 of the chains",
                        )
                    }
                }
                None => fault("critical.percent_over_contour", factor, "a chain law: `linear` has no links"),
            },
            (None, Some(stretch), None) if stretch > 1.0 => Ok(stretch),
            (None, Some(stretch), None) => fault("critical.stretch", stretch, "above 1"),
            (None, None, Some(energy)) => {
                stretch_of_energy(context, self.convention.unwrap_or(context.convention), energy.si())
            }
            _ => fault("critical (number of alternatives)", self.alternatives().len() as f64, ONE_OF),
        }
    }
}

/// Computes the fracture energy G, J/m², of a critical stretch, with Φ = ∫₁^{λc} t dλ/kθ.
/// [`Convention::Tearing`]: κkθΦ Σ_J w V_J |ξ_e||ξ| of a [`Crossing`]; [`Convention::Bonds`]: tδ⁴kθΦ in a
/// sheet, (2π/5)δ⁵kθΦ in a solid; [`Convention::Softening`]: kθΦ Σ_J w V_J |ξ_e||ξ| of bonds that soften to
/// zero load at this stretch.
pub fn fracture_energy(context: &Context, convention: Convention, stretch: f64) -> f64 {
    let energy = match convention {
        Convention::Softening => context.softening.energy(context.law, stretch, stretch),
        _ => context.law.energy(stretch),
    } * context.modulus;
    match (convention, context.space) {
        (Convention::Softening, _) => context.crossing.reach * energy,
        (Convention::Tearing, _) => context.crossing.loss * context.crossing.reach * energy,
        (Convention::Bonds, Space::Solid) => 2.0 * PI / 5.0 * context.horizon.powi(5) * energy,
        (Convention::Bonds, _) => context.thickness * context.horizon.powi(4) * energy,
    }
}

/// Fracture energies of a bond law in a body.
#[derive(Clone, Copy, Debug)]
pub struct Toughness {
    /// Convention of the scene's fracture energy; `None` if it gives a stretch.
    pub convention: Option<Convention>,
    /// Critical stretch λ_c.
    pub stretch: f64,
    /// Energy at which a crack runs, J/m².
    pub tearing: f64,
    /// Energy of the bonds across a unit of crack by the continuum's integral, J/m².
    pub bonds: f64,
    /// Bonds across a cut through the body.
    pub crossing: Crossing,
    /// Softening, if that is the convention.
    pub softening: BondSoftening,
}

impl Toughness {
    /// Computes the fracture energies of a critical stretch that follows from `critical`.
    pub fn new(critical: &Critical, context: &Context, stretch: f64) -> Self {
        let given = critical.fracture_energy.map(|_| critical.convention.unwrap_or(context.convention));
        let soft = given == Some(Convention::Softening);
        let tearing = if soft { Convention::Softening } else { Convention::Tearing };
        let tearing = fracture_energy(context, tearing, stretch);
        let mut bonds = fracture_energy(context, Convention::Bonds, stretch);
        if soft {
            bonds *= context.softening.energy(context.law, stretch, stretch) / context.law.energy(stretch);
        }
        Self {
            convention: given,
            stretch,
            tearing,
            bonds,
            crossing: context.crossing,
            softening: context.softening,
        }
    }
}

/// Finds the stretch at which bonds have stored their shares of G, by bisection: energy grows with stretch in
/// tension.
fn stretch_of_energy(context: &Context, convention: Convention, energy: f64) -> Result<f64, Error> {
    let fault = |allowed: &str| {
        Err(Error::Parameter { name: "critical.fracture_energy", found: energy, allowed: allowed.to_owned() })
    };
    if !(energy > 0.0 && energy.is_finite()) {
        return fault("above 0");
    }
    let of = |stretch: f64| fracture_energy(context, convention, stretch);
    let (mut low, mut high) = (1.0, 2.0);
    while of(high) < energy {
        low = high;
        high *= 2.0;
        if high > 1e9 {
            return fault("smaller: no bond stretch stores it");
        }
    }
    Ok(bisected(low, high, 200, |stretch| of(stretch) < energy))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::potential::Law;

    fn context<'a>(
        law: &'a dyn BondPotential,
        space: Space,
        modulus: f64,
        horizon: f64,
        thickness: f64,
    ) -> Context<'a> {
        let crossing = Crossing { reach: 2.0, short: 1.0, bonds: 28.0, loss: 1.4, whole: true };
        let convention = Convention::default();
        let softening = BondSoftening::default();
        Context { law, links: None, space, modulus, horizon, thickness, crossing, convention, softening }
    }

    /// Compares with formulation.md, table of the four examples, to its printed digits.
    #[test]
    fn interpretations_of_the_four_examples() {
        let table = [
            (1.2, 720.0, [32.20, 11.38, 5.849, 2.9442]),
            (1.1, 400.0, [22.0, 7.78, 4.542, 2.3037]),
            (1.1, 200.0, [15.56, 5.50, 3.613, 1.8574]),
            (1.1, 100.0, [11.0, 3.89, 2.879, 1.5193]),
        ];
        for (factor, links, expected) in table {
            for ((interpretation, expected), digits) in
                Interpretation::ALL.iter().zip(expected).zip([6e-3, 6e-3, 6e-4, 6e-5])
            {
                let found = interpretation.stretch(factor, links);
                assert!(
                    (found - expected).abs() <= digits,
                    "{interpretation:?} {factor} {links}: {found} {expected}"
                );
            }
        }
        let dent = |interpretation: Interpretation| interpretation.stretch(1.2, 720.0);
        let [r1, r2, r3, r4] = Interpretation::ALL.map(dent);
        evidence::near("DENT, critical bond stretch by R1", r1, 32.20, 6e-3);
        evidence::near("DENT, critical bond stretch by R2", r2, 11.38, 6e-3);
        evidence::near("DENT, critical bond stretch by R3", r3, 5.849, 6e-4);
        evidence::near("DENT, critical bond stretch by R4", r4, 2.9442, 6e-5);
    }

    #[test]
    fn stretch_and_fracture_energy_invert_each_other() {
        for law in Law::ALL {
            for (space, horizon) in [(Space::PlaneStress, 6e-3), (Space::Solid, 6e-3)] {
                let built = law.build(720.0, 1200.0, false).unwrap();
                let kt = modulus(space, 0.6e6, horizon, 3e-3);
                let context = Context { links: Some(720.0), ..context(&*built, space, kt, horizon, 3e-3) };
                for convention in [Convention::Tearing, Convention::Bonds] {
                    let energy = fracture_energy(&context, convention, 1.7);
                    let found = stretch_of_energy(&context, convention, energy).unwrap();
                    assert!((found - 1.7).abs() < 1e-12, "{law:?} {convention:?}: {found}");
                }
            }
        }
    }

    /// Compares G = (2π/5)δ⁵kθ·(3/2)s² = (6/5)·E·s²δ of the linear bond with Silling & Askari's G = 9Ks²δ/5
    /// in 3D.
    #[test]
    fn linear_bond_has_the_textbook_fracture_energy() {
        let (e, horizon, s) = (1e7, 0.03, 0.02);
        let law = Law::Linear.build(0.0, 0.0, false).unwrap();
        let kt = modulus(Space::Solid, e, horizon, 1.0);
        let context = context(&*law, Space::Solid, kt, horizon, 1.0);
        // G₀ = (π/10) c s₀² δ⁵ with c = 6kθ (Silling & Askari 2005, Eq. (24): πcs₀²δ⁵/10)
        let exact = PI / 10.0 * 6.0 * kt * s * s * horizon.powi(5);
        let found = fracture_energy(&context, Convention::Bonds, 1.0 + s);
        assert!((found / exact - 1.0).abs() < 1e-12);
    }

    /// Compares with `reference/ch2/s8_G.py`: G = 2.67 N/mm, E = 0.6 N/mm², δ = 6.03 mm give Φ = 2πG/(3Eδ),
    /// and a linear bond breaks at 1 + √(2Φ/3).
    #[test]
    fn critical_stretch_of_a_fracture_energy() {
        let (e, horizon, thickness) = (0.6e6, 6.03e-3, 3e-3);
        let energy = 2.67e3;
        let phi = 2.0 * PI * energy / (3.0 * e * horizon);
        let law = Law::Linear.build(0.0, 0.0, false).unwrap();
        let (space, modulus) = (Space::PlaneStress, modulus(Space::PlaneStress, e, horizon, thickness));
        let context = context(&*law, space, modulus, horizon, thickness);
        let critical = Critical {
            fracture_energy: Some(EnergyPerArea::from_si(energy)),
            convention: Some(Convention::Bonds),
            ..Critical::default()
        };
        let found = critical.resolve(&context).unwrap();
        assert!((found - (1.0 + (2.0 * phi / 3.0).sqrt())).abs() < 1e-12, "{found}");
    }

    #[test]
    fn interpretations_that_break_at_rest_are_refused() {
        let law = Law::ChainOffset.build(720.0, 1200.0, false).unwrap();
        let context = Context { links: Some(720.0), ..context(&*law, Space::PlaneStress, 1.0, 1.0, 1.0) };
        for (factor, interpretation) in [
            (0.03, Interpretation::BondFull),
            (0.1, Interpretation::BondEighth),
            (0.05, Interpretation::ChainEighth),
            (f64::INFINITY, Interpretation::ChainEighth),
        ] {
            let critical = Critical {
                percent_over_contour: Some(factor),
                interpretation: Some(interpretation),
                ..Critical::default()
            };
            assert!(critical.resolve(&context).is_err(), "{factor} {interpretation:?}");
        }
    }
}
