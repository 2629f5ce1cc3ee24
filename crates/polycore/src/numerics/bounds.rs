//! Ranges of numbers and boxes around points. NaN is ignored.

/// Least and greatest number; [∞, −∞] for none.
pub fn range(numbers: impl IntoIterator<Item = f64>) -> [f64; 2] {
    numbers.into_iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
}

/// Lower and upper corner of the box around points.
pub fn bounds<const D: usize>(points: impl IntoIterator<Item = [f64; D]>) -> [[f64; D]; 2] {
    let (mut low, mut high) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D]);
    for point in points {
        (0..D).for_each(|d| (low[d], high[d]) = (low[d].min(point[d]), high[d].max(point[d])));
    }
    [low, high]
}

/// Returns true if two segments in the plane of the first two axes meet.
pub fn segments_meet<const D: usize>([a, b]: [[f64; D]; 2], [p, q]: [[f64; D]; 2]) -> bool {
    let side = |p: [f64; D], q: [f64; D], at: [f64; D]| {
        let cross = (q[0] - p[0]) * (at[1] - p[1]) - (q[1] - p[1]) * (at[0] - p[0]);
        if cross == 0.0 { 0.0 } else { cross.signum() }
    };
    let within = |d: usize| a[d].min(b[d]) <= p[d].max(q[d]) && p[d].min(q[d]) <= a[d].max(b[d]);
    side(a, b, p) * side(a, b, q) <= 0.0 && side(p, q, a) * side(p, q, b) <= 0.0 && within(0) && within(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends() {
        assert_eq!(range([2.0, f64::NAN, -3.0, 1.0]), [-3.0, 2.0]);
        assert_eq!(range([]), [f64::INFINITY, f64::NEG_INFINITY]);
        assert_eq!(bounds([[0.0, 5.0], [1.0, -2.0], [0.5, f64::NAN]]), [[0.0, -2.0], [1.0, 5.0]]);
    }
}
