//! Functions of J = det F, continued as parabolas below a limit of compression.

/// J below which ln J and J⁻² are continued as parabolas.
pub(super) const CRUSH_LIMIT: f64 = 0.2;

/// ln J at J = 1 + `change`, a parabola below [`CRUSH_LIMIT`].
pub(super) fn logarithm(change: f64) -> f64 {
    let (s, r) = (1.0 + change - CRUSH_LIMIT, 1.0 / CRUSH_LIMIT);
    if s > 0.0 { change.ln_1p() } else { CRUSH_LIMIT.ln() + s * r - 0.5 * s * s * r * r }
}

/// Derivatives of [`logarithm`].
pub(super) fn logarithm_slopes(change: f64) -> [f64; 2] {
    let (jacobian, r) = (1.0 + change, 1.0 / CRUSH_LIMIT);
    if jacobian > CRUSH_LIMIT {
        return [1.0 / jacobian, -1.0 / (jacobian * jacobian)];
    }
    [r - (jacobian - CRUSH_LIMIT) * r * r, -r * r]
}

/// J⁻² and its derivatives, a parabola below [`CRUSH_LIMIT`].
pub(super) fn inverse_square(jacobian: f64) -> [f64; 3] {
    if jacobian > CRUSH_LIMIT {
        let r = 1.0 / jacobian;
        return [r * r, -2.0 * r.powi(3), 6.0 * r.powi(4)];
    }
    let (s, r) = (jacobian - CRUSH_LIMIT, 1.0 / CRUSH_LIMIT);
    let (first, second) = (-2.0 * r.powi(3), 6.0 * r.powi(4));
    [r * r + first * s + 0.5 * second * s * s, first + second * s, second]
}
