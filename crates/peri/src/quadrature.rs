//! Gauss–Legendre quadrature with eight nodes.

/// Positive nodes on [−1, 1] and their weights (Abramowitz and Stegun, table 25.4).
const RULE: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];

/// Mean of a function over [a, b], including a = b; exact for polynomials of degree 15.
pub(crate) fn mean(a: f64, b: f64, function: impl Fn(f64) -> f64) -> f64 {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    RULE.iter()
        .map(|(node, weight)| {
            0.5 * weight * (function(middle - half * node) + function(middle + half * node))
        })
        .sum()
}

/// The nodes on [a, b] and their weights, which sum to b − a.
pub(crate) fn panel(a: f64, b: f64) -> [(f64, f64); 8] {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    std::array::from_fn(|k| {
        let (node, weight) = RULE[k / 2];
        (middle + if k % 2 == 0 { -half } else { half } * node, half * weight)
    })
}

#[cfg(test)]
mod tests {
    #[test]
    fn monomials_up_to_degree_15() {
        for degree in 0..16 {
            let exact = (2f64.powi(degree + 1) - 1.0) / f64::from(degree + 1);
            // rounding
            assert!((super::mean(1.0, 2.0, |x| x.powi(degree)) / exact - 1.0).abs() < 1e-14);
        }
    }
}
