//! Bonds that soften before they break, so that none breaks under load.

use super::BondPotential;
use crate::calibrate::Space;
use crate::quadrature;
use polycore::numerics::bisected;
use std::f64::consts::FRAC_PI_2;

/// Directions between the axis of tension and the plane across it.
const DIRECTIONS: u32 = 90;
/// Uniform strains between λ₀ − 1 and λ_f − 1 that are searched for the greatest stress.
const STRAINS: u32 = 100;

/// Fall of a bond's tension between λ₀ and λ_f.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BondSoftening {
    /// e_f: λ_f − 1 over λ₀ − 1.
    pub ductility: f64,
    /// Kink of the fall: fraction of the tension at λ₀, and place between λ₀ (0) and λ_f (1); `None`:
    /// straight.
    pub kink: Option<[f64; 2]>,
}

impl Default for BondSoftening {
    /// Uses e_f = 4, straight: the crack of a strip runs at the energy of the bonds across it, to 2 % along
    /// an axis and at 45°, at m = 3 and 4; at 2 to 7 % (guide, theory/fracture.md).
    fn default() -> Self {
        Self { ductility: 4.0, kink: None }
    }
}

impl BondSoftening {
    /// Computes e_f of a linear bond whose energy ∫₁^λf d t dλ is `energy` times that up to λ₀, with the kink
    /// (β, x): 1 + (`energy` − 1)/(β + x), β + x = 1 without one.
    pub fn of_linear(energy: f64, kink: Option<[f64; 2]>) -> Self {
        let area = kink.map_or(1.0, |[tension, place]| tension + place);
        Self { ductility: 1.0 + (energy - 1.0) / area, kink }
    }

    /// Returns the fraction d of the law's tension that a bond carries: 1 up to λ₀, then f(e)/e, 0 beyond
    /// λ_f = `end`, with e = (λ − 1)/(λ₀ − 1) and f falling from 1 to 0 at e_f, straight or with a kink. For
    /// a linear law d t is bilinear or trilinear in λ. It depends on the present stretch: bonds unloaded
    /// before λ_f recover.
    pub fn integrity(&self, stretch: f64, end: f64) -> f64 {
        let last = self.ductility;
        let e = last * (stretch - 1.0) / (end - 1.0);
        if e <= 1.0 {
            return 1.0;
        } else if e >= last {
            return 0.0;
        }
        let Some([tension, place]) = self.kink else {
            return (last - e) / (e * (last - 1.0));
        };
        let way = (e - 1.0) / (last - 1.0);
        let fall = if way < place {
            1.0 - (1.0 - tension) * way / place
        } else {
            tension * (1.0 - way) / (1.0 - place)
        };
        fall / e
    }

    /// Uniaxial strength of a body of linear bonds in all directions, over E(λ₀ − 1): greatest σ(ε) of
    /// uniform small strains with free sides. Above 1, as bonds at an angle soften later than those along
    /// the axis.
    pub fn uniaxial_strength(&self, space: Space) -> f64 {
        let solid = space == Space::Solid;
        let axes: Vec<[f64; 3]> = (0..DIRECTIONS)
            .map(|k| (f64::from(k) + 0.5) / f64::from(DIRECTIONS) * FRAC_PI_2)
            .map(|angle| [angle.cos().powi(2), angle.sin().powi(2), if solid { angle.sin() } else { 1.0 }])
            .collect();
        let force = |e: f64| e * self.integrity(1.0 + e, 1.0 + self.ductility);
        let stress = |strain: f64, side: f64, part: usize| -> f64 {
            axes.iter().map(|n| n[2] * n[part] * force(strain * n[0] + side * n[1])).sum()
        };
        let uniaxial = |strain: f64| {
            let side = bisected(-strain, 0.0, 50, |side| stress(strain, side, 1) < 0.0);
            stress(strain, side, 0)
        };
        let strains = (0..=STRAINS).map(|k| self.ductility.powf(f64::from(k) / f64::from(STRAINS)));
        strains.map(uniaxial).fold(0.0, f64::max) / uniaxial(1.0)
    }

    /// Stretch λ₀ at which bonds begin to soften.
    pub fn onset(&self, end: f64) -> f64 {
        1.0 + (end - 1.0) / self.ductility
    }

    /// Energy ∫₁^λ d t dλ/kθ of such a bond.
    pub fn energy(&self, law: &dyn BondPotential, stretch: f64, end: f64) -> f64 {
        let start = self.onset(end);
        if stretch <= start {
            return law.energy(stretch);
        }
        let bend = self.kink.map_or(end, |[_, place]| start + place * (end - start));
        let part = |from: f64, to: f64| {
            let tension = |stretch| self.integrity(stretch, end) * law.tension(stretch);
            (to - from) * quadrature::mean(from, to, tension)
        };
        let last = stretch.min(end);
        let first = law.energy(start) + part(start, last.min(bend));
        if last > bend { first + part(bend, last) } else { first }
    }
}
