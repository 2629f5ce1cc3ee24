//! Exact side of a point from a line in a plane.

/// Relative bound on the rounding of a determinant of differences: (3 + 16 ε) ε with ε = 2⁻⁵³, see
/// J. R. Shewchuk, Discrete Comput. Geom. 18 (1997) 305, doi:10.1007/PL00009321.
const ROUNDING: f64 = 3.330_669_073_875_472e-16;

/// Returns twice the area of the triangle `a`, `b`, `c`, above 0 if it is anticlockwise, with an exact sign:
/// 0 if and only if the points lie on a line.
pub(super) fn orientation(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    let left = (a[0] - c[0]) * (b[1] - c[1]);
    let right = (a[1] - c[1]) * (b[0] - c[0]);
    let rounded = left - right;
    if rounded.abs() > ROUNDING * (left.abs() + right.abs()) {
        return rounded;
    }
    // ax by − ay bx + bx cy − by cx + cx ay − cy ax, a sum without rounding
    let mut sum = Expansion { parts: [0.0; 12], count: 0 };
    for (x, y) in [(a, b), (b, c), (c, a)] {
        sum.add_product(x[0], y[1]);
        sum.add_product(-x[1], y[0]);
    }
    sum.greatest()
}

/// Sum of numbers that do not overlap, least first.
struct Expansion {
    parts: [f64; 12],
    count: usize,
}

impl Expansion {
    /// Adds a product, which is the sum of two numbers.
    fn add_product(&mut self, x: f64, y: f64) {
        let product = x * y;
        self.add(x.mul_add(y, -product));
        self.add(product);
    }

    fn add(&mut self, value: f64) {
        let mut carry = value;
        for part in &mut self.parts[..self.count] {
            let sum = carry + *part;
            let virtual_part = sum - carry;
            *part = (carry - (sum - virtual_part)) + (*part - virtual_part);
            carry = sum;
        }
        self.parts[self.count] = carry;
        self.count += 1;
    }

    /// Returns the greatest part, which has the sign of the sum.
    fn greatest(&self) -> f64 {
        self.parts[..self.count].iter().rev().find(|part| **part != 0.0).copied().unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points one unit in the last place off a line through points that are no multiples of each other, from
    /// all sides of the triangle.
    #[test]
    fn signs_are_exact() {
        let (a, b) = ([12.0, 12.0], [24.0, 24.0]);
        for k in 0..256_u32 {
            let x = 0.5 + f64::from(k) * f64::EPSILON / 2.0;
            for l in 0..16_u32 {
                let y = 0.5 + f64::from(l) * f64::EPSILON / 2.0;
                let expected = y.partial_cmp(&x);
                for (p, q, r) in [(a, b, [x, y]), (b, [x, y], a), ([x, y], a, b)] {
                    assert_eq!(orientation(p, q, r).partial_cmp(&0.0), expected, "{k} {l}");
                }
            }
        }
        assert_eq!(orientation([0.1, 0.1], [0.3, 0.3], [0.7, 0.7]), 0.0);
    }
}
