//! Shape functions of wedges and of second-order elements, and their integration rules (Zienkiewicz & Taylor,
//! vol. 1).
//!
//! Natural coordinates: −1 … 1 along each axis of a hexahedron; r, s ≥ 0, r + s ≤ 1 in the triangle of a
//! wedge and −1 … 1 along its third axis; r, s, t ≥ 0, r + s + t ≤ 1 in a tetrahedron.

use super::{CORNERS, MAX_ELEMENT_NODES, MAX_ELEMENT_POINTS};
use meshfile::ElementShape;
use std::sync::OnceLock;

/// N and ∂N/∂ξ of each node at one point.
#[derive(Clone, Copy, Debug)]
pub struct Natural {
    /// N.
    pub shapes: [f64; MAX_ELEMENT_NODES],
    /// ∂N/∂ξ.
    pub gradients: [[f64; 3]; MAX_ELEMENT_NODES],
}

/// An element type at its integration points.
#[derive(Debug)]
pub struct QuadratureRule {
    /// Number of points.
    pub points: usize,
    /// Weights.
    pub weights: [f64; MAX_ELEMENT_POINTS],
    /// Shape functions at the points.
    pub at: Vec<Natural>,
}

/// Barycentric coordinates of a triangle and their gradients.
fn triangle(r: f64, s: f64) -> [(f64, [f64; 2]); 3] {
    [(1.0 - r - s, [-1.0, -1.0]), (r, [1.0, 0.0]), (s, [0.0, 1.0])]
}

impl Natural {
    /// Evaluates the shape functions at natural coordinates; any shape, 8-node hexahedra and 4-node
    /// tetrahedra included.
    pub fn new(shape: ElementShape, [r, s, t]: [f64; 3]) -> Self {
        let mut natural = Self { shapes: [0.0; MAX_ELEMENT_NODES], gradients: [[0.0; 3]; MAX_ELEMENT_NODES] };
        match shape {
            ElementShape::Hexahedron | ElementShape::Hexahedron20 => natural.hexahedron(shape, [r, s, t]),
            ElementShape::Tetrahedron | ElementShape::Tetrahedron10 => {
                let own = [
                    (1.0 - r - s - t, [-1.0; 3]),
                    (r, [1.0, 0.0, 0.0]),
                    (s, [0.0, 1.0, 0.0]),
                    (t, [0.0, 0.0, 1.0]),
                ];
                let second = shape.is_second_order();
                for (a, &(l, slope)) in own.iter().enumerate() {
                    // L (2L − 1)
                    let (value, factor) =
                        if second { (l * (2.0 * l - 1.0), 4.0 * l - 1.0) } else { (l, 1.0) };
                    natural.set(a, value, slope.map(|x| factor * x));
                }
                for (a, &[p, q]) in (4..shape.nodes()).zip(shape.edges()) {
                    let ((l, dl), (m, dm)) = (own[p], own[q]);
                    natural.set(a, 4.0 * l * m, [0, 1, 2].map(|d| 4.0 * (dl[d] * m + l * dm[d])));
                }
            }
            ElementShape::Wedge | ElementShape::Wedge15 => natural.wedge(shape, [r, s, t]),
        }
        natural
    }

    fn set(&mut self, node: usize, value: f64, gradient: [f64; 3]) {
        self.shapes[node] = value;
        self.gradients[node] = gradient;
    }

    fn hexahedron(&mut self, shape: ElementShape, at: [f64; 3]) {
        for (a, corner) in CORNERS.iter().enumerate() {
            let f = [0, 1, 2].map(|d| 1.0 + corner[d] * at[d]);
            let product = 0.125 * f[0] * f[1] * f[2];
            let slopes = [0, 1, 2].map(|d| 0.125 * corner[d] * f[(d + 1) % 3] * f[(d + 2) % 3]);
            if shape == ElementShape::Hexahedron {
                self.set(a, product, slopes);
            } else {
                // ⅛ ∏(1 + ξ_d ξ) (Σ ξ_d ξ − 2)
                let rest = f[0] + f[1] + f[2] - 5.0;
                self.set(a, product * rest, [0, 1, 2].map(|d| slopes[d] * rest + product * corner[d]));
            }
        }
        for (a, &[p, q]) in (8..shape.nodes()).zip(shape.edges()) {
            // ¼ (1 − ξ²) along the edge, linear across
            let middle = [0, 1, 2].map(|d| 0.5 * (CORNERS[p][d] + CORNERS[q][d]));
            let factor = [0, 1, 2].map(|d| {
                if middle[d] == 0.0 {
                    (1.0 - at[d] * at[d], -2.0 * at[d])
                } else {
                    (1.0 + middle[d] * at[d], middle[d])
                }
            });
            let value = 0.25 * factor[0].0 * factor[1].0 * factor[2].0;
            let slope = |d: usize| 0.25 * factor[d].1 * factor[(d + 1) % 3].0 * factor[(d + 2) % 3].0;
            self.set(a, value, [0, 1, 2].map(slope));
        }
    }

    fn wedge(&mut self, shape: ElementShape, [r, s, t]: [f64; 3]) {
        let own = triangle(r, s);
        for (a, sign) in (0..6).map(|a| (a, if a < 3 { -1.0 } else { 1.0 })) {
            let (l, slope) = own[a % 3];
            let f = 1.0 + sign * t;
            let (value, by_l, by_t) = if shape == ElementShape::Wedge {
                (0.5 * l * f, 0.5 * f, 0.5 * l * sign)
            } else {
                // ½ L [(2L − 1)(1 ± t) − (1 − t²)]
                let inner = (2.0 * l - 1.0) * f - (1.0 - t * t);
                (0.5 * l * inner, 0.5 * inner + l * f, 0.5 * l * ((2.0 * l - 1.0) * sign + 2.0 * t))
            };
            self.set(a, value, [by_l * slope[0], by_l * slope[1], by_t]);
        }
        for (a, &[p, q]) in (6..shape.nodes()).zip(shape.edges()) {
            let ((l, dl), (m, dm)) = (own[p % 3], own[q % 3]);
            if p % 3 == q % 3 {
                // L (1 − t²)
                let f = 1.0 - t * t;
                self.set(a, l * f, [f * dl[0], f * dl[1], -2.0 * t * l]);
            } else {
                // 2 L M (1 ± t)
                let sign = if p < 3 { -1.0 } else { 1.0 };
                let f = 1.0 + sign * t;
                let slope = |d: usize| 2.0 * f * (dl[d] * m + l * dm[d]);
                self.set(a, 2.0 * l * m * f, [slope(0), slope(1), 2.0 * l * m * sign]);
            }
        }
    }
}

/// Natural coordinates of a corner.
pub fn corner(shape: ElementShape, corner: usize) -> [f64; 3] {
    let simplex = |k: usize| [f64::from(u8::from(k == 1)), f64::from(u8::from(k == 2))];
    match shape.corners() {
        8 => CORNERS[corner],
        4 => [simplex(corner)[0], simplex(corner)[1], f64::from(u8::from(corner == 3))],
        _ => [simplex(corner % 3)[0], simplex(corner % 3)[1], if corner < 3 { -1.0 } else { 1.0 }],
    }
}

/// Natural coordinates of the centre.
pub fn middle(shape: ElementShape) -> [f64; 3] {
    match shape.corners() {
        8 => [0.0; 3],
        4 => [0.25; 3],
        _ => [1.0 / 3.0, 1.0 / 3.0, 0.0],
    }
}

/// Gauss's rule of three points on −1 … 1.
pub const GAUSS_3: [(f64, f64); 3] =
    [(-0.774_596_669_241_483_4, 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 9.0)];

/// Dunavant's rule of degree 4 on a triangle: two orbits of three points, each (repeated coordinate, weight
/// over ½).
pub const DUNAVANT: [(f64, f64); 2] = [
    (0.445_948_490_915_964_9, 0.223_381_589_678_011_47),
    (0.091_576_213_509_770_74, 0.109_951_743_655_321_87),
];

/// Points r, s and weights (of area ½) of [`DUNAVANT`].
pub fn dunavant() -> impl Iterator<Item = ([f64; 2], f64)> {
    DUNAVANT.into_iter().flat_map(|(a, weight)| {
        let far = 1.0 - 2.0 * a;
        [[a, a], [far, a], [a, far]].map(|at| (at, 0.5 * weight))
    })
}

/// Integration points and weights. All but the wedge's are exact for products of two shape functions of an
/// element with straight edges; point g of a 6-node wedge lies nearest to its corner g.
fn points(shape: ElementShape) -> Vec<([f64; 3], f64)> {
    match shape {
        ElementShape::Wedge => {
            let near = [[1.0 / 6.0, 1.0 / 6.0], [2.0 / 3.0, 1.0 / 6.0], [1.0 / 6.0, 2.0 / 3.0]];
            let place = |t: f64| near.map(|[r, s]| ([r, s, t], 1.0 / 6.0));
            [place(-super::GAUSS), place(super::GAUSS)].concat()
        }
        ElementShape::Wedge15 => {
            let along = |(t, w): (f64, f64)| dunavant().map(move |([r, s], area)| ([r, s, t], w * area));
            GAUSS_3.into_iter().flat_map(along).collect()
        }
        // fourteen points of degree 5 (Walkington 2000): two orbits of four, one of six
        ElementShape::Tetrahedron | ElementShape::Tetrahedron10 => {
            let mut points = Vec::with_capacity(14);
            for (a, weight) in [
                (0.310_885_919_263_300_6, 0.112_687_925_718_015_85),
                (0.092_735_250_310_891_23, 0.073_493_043_116_361_95),
            ] {
                let far = 1.0 - 3.0 * a;
                points
                    .extend([[a, a, a], [far, a, a], [a, far, a], [a, a, far]].map(|at| (at, weight / 6.0)));
            }
            let (a, weight) = (0.045_503_704_125_649_65, 0.042_546_020_777_081_466);
            let b = 0.5 - a;
            let places = [[b, b, a], [b, a, b], [a, b, b], [b, a, a], [a, b, a], [a, a, b]];
            points.extend(places.map(|at| (at, weight / 6.0)));
            points
        }
        ElementShape::Hexahedron | ElementShape::Hexahedron20 => {
            let all = (0..27).map(|k| [GAUSS_3[k % 3], GAUSS_3[k / 3 % 3], GAUSS_3[k / 9]]);
            all.map(|g| (g.map(|(x, _)| x), g.iter().map(|(_, w)| w).product())).collect()
        }
    }
}

impl QuadratureRule {
    /// Returns the rule of a shape, computed once.
    pub fn for_shape(shape: ElementShape) -> &'static Self {
        static RULES: [OnceLock<QuadratureRule>; 6] = [const { OnceLock::new() }; 6];
        RULES[shape as usize].get_or_init(|| {
            let points = points(shape);
            let mut weights = [0.0; MAX_ELEMENT_POINTS];
            for (weight, (_, own)) in weights.iter_mut().zip(&points) {
                *weight = *own;
            }
            let at = points.iter().map(|(place, _)| Natural::new(shape, *place)).collect();
            Self { points: points.len(), weights, at }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// N is 1 at its own node and 0 at the others, the sum is 1, and gradients agree with finite differences.
    #[test]
    fn shape_functions_belong_to_their_nodes() {
        for shape in ElementShape::ALL {
            let corners: Vec<[f64; 3]> = (0..shape.corners()).map(|k| corner(shape, k)).collect();
            let middles =
                shape.edges().iter().map(|&[p, q]| [0, 1, 2].map(|d| 0.5 * (corners[p][d] + corners[q][d])));
            let places: Vec<[f64; 3]> = corners.iter().copied().chain(middles).take(shape.nodes()).collect();
            for (a, place) in places.iter().enumerate() {
                let natural = Natural::new(shape, *place);
                for b in 0..shape.nodes() {
                    let exact = f64::from(u8::from(a == b));
                    assert!((natural.shapes[b] - exact).abs() < 1e-15, "{shape:?} {a} {b}");
                }
            }
            let at = [0.21, 0.13, 0.37];
            let natural = Natural::new(shape, at);
            assert!((natural.shapes.iter().sum::<f64>() - 1.0).abs() < 1e-15);
            for d in 0..3 {
                let moved = |h: f64| {
                    let mut place = at;
                    place[d] += h;
                    Natural::new(shape, place).shapes
                };
                let (low, high) = (moved(-1e-5), moved(1e-5));
                for a in 0..shape.nodes() {
                    let slope = (high[a] - low[a]) / 2e-5;
                    assert!((natural.gradients[a][d] - slope).abs() < 1e-9, "{shape:?} {a} {d}");
                }
            }
        }
    }

    /// ∫ r^i s^j t^k over each element: i!j!k!/(i+j+k+3)! of a tetrahedron, up to degree 5.
    #[test]
    fn rules_are_exact() {
        let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
        // ∫₋₁¹ t^k
        let line = |k: u32| if k.is_multiple_of(2) { 2.0 / f64::from(k + 1) } else { 0.0 };
        let simplex = |i: u32, j: u32| factorial(i) * factorial(j) / factorial(i + j + 2);
        for shape in [
            ElementShape::Wedge,
            ElementShape::Hexahedron20,
            ElementShape::Tetrahedron10,
            ElementShape::Wedge15,
        ] {
            for (i, j, k) in (0..216).map(|n| (n % 6, n / 6 % 6, n / 36)) {
                let (exact, fits) = match shape {
                    ElementShape::Tetrahedron10 => (
                        factorial(i) * factorial(j) * factorial(k) / factorial(i + j + k + 3),
                        i + j + k <= 5,
                    ),
                    ElementShape::Wedge => (simplex(i, j) * line(k), i + j <= 2 && k <= 3),
                    ElementShape::Wedge15 => (simplex(i, j) * line(k), i + j <= 4),
                    _ => (line(i) * line(j) * line(k), true),
                };
                let power = |[r, s, t]: [f64; 3]| r.powi(i as i32) * s.powi(j as i32) * t.powi(k as i32);
                let found: f64 = points(shape).iter().map(|&(at, weight)| weight * power(at)).sum();
                assert!(!fits || (found - exact).abs() < 1e-14, "{shape:?} {i} {j} {k}: {found} {exact}");
            }
        }
    }
}
