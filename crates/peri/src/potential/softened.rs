//! Bonds that soften before they break, so that none breaks under load.

use super::BondPotential;
use crate::quadrature;

/// λ_f − 1 over λ₀ − 1: bonds soften from λ₀ to zero load at λ_f. At 4 the crack of a strip runs at the
/// energy of the bonds across it, to 2 % along an axis and at 45°, at m = 3 and 4; at 2 to 7 % (guide,
/// theory/tearing.md).
pub const DUCTILITY: f64 = 4.0;

/// d, the fraction of the law's tension that a bond carries: 1 up to λ₀, then (e_f − e)/[e(e_f − 1)] with e =
/// (λ − 1)/(λ₀ − 1), 0 beyond `end` = λ_f. For a linear law d t is bilinear in λ. It depends on the present
/// stretch: bonds unloaded before λ_f recover.
pub fn integrity(stretch: f64, end: f64) -> f64 {
    let e = DUCTILITY * (stretch - 1.0) / (end - 1.0);
    if e <= 1.0 {
        1.0
    } else if e < DUCTILITY {
        (DUCTILITY - e) / (e * (DUCTILITY - 1.0))
    } else {
        0.0
    }
}

/// Stretch λ₀ at which bonds begin to soften.
pub fn onset(end: f64) -> f64 {
    1.0 + (end - 1.0) / DUCTILITY
}

/// Energy ∫₁^λ d t dλ/kθ of such a bond.
pub fn softened_energy(law: &dyn BondPotential, stretch: f64, end: f64) -> f64 {
    let start = onset(end);
    if stretch <= start {
        return law.energy(stretch);
    }
    let last = stretch.min(end);
    let more = quadrature::mean(start, last, |stretch| integrity(stretch, end) * law.tension(stretch));
    law.energy(start) + (last - start) * more
}
