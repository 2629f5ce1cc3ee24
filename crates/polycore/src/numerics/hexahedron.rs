//! The trilinear hexahedron: N_a = ∏_d ½(1 + ξ_d ξ_ad) of the corners a at natural coordinates ξ from −1 to
//! 1.

/// Corners in natural coordinates, in the order of Abaqus and VTK.
pub const CORNERS: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

fn factors(at: [f64; 3], corner: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|d| 0.5 * (1.0 + corner[d] * at[d]))
}

/// N of each corner.
pub fn shapes(at: [f64; 3]) -> [f64; 8] {
    CORNERS.map(|corner| factors(at, corner).iter().product())
}

/// ∂N/∂ξ of each corner.
pub fn slopes(at: [f64; 3]) -> [[f64; 3]; 8] {
    CORNERS.map(|corner| {
        let [x, y, z] = factors(at, corner);
        [0.5 * corner[0] * y * z, 0.5 * corner[1] * x * z, 0.5 * corner[2] * x * y]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A trilinear function is its own interpolant, and so are its derivatives.
    #[test]
    fn a_trilinear_function() {
        let f = |[x, y, z]: [f64; 3]| 1.0 + 2.0 * x - y + 3.0 * z + x * y - 2.0 * y * z + 0.5 * x * y * z;
        let at @ [x, y, z] = [0.3, -0.7, 0.2];
        let exact = [2.0 + y + 0.5 * y * z, -1.0 + x - 2.0 * z + 0.5 * x * z, 3.0 - 2.0 * y + 0.5 * x * y];
        let sum = |of: &dyn Fn(usize) -> f64| (0..8).map(|a| of(a) * f(CORNERS[a])).sum::<f64>();
        let (shapes, slopes) = (shapes(at), slopes(at));
        assert!((sum(&|a| shapes[a]) - f(at)).abs() < 1e-14);
        for d in 0..3 {
            assert!((sum(&|a| slopes[a][d]) - exact[d]).abs() < 1e-14, "{d}");
        }
    }
}
