//! Points of curves.

use std::f64::consts::TAU;

/// Segments of a full turn: they lie inside of a circle by up to 8e-5 of its radius.
const TURN: f64 = 256.0;
/// Segments between two knots of a spline.
const SPAN: usize = 32;

/// Returns points of an arc from one angle to another, degrees, anticlockwise; of a full circle without the
/// last.
pub fn arc(centre: [f64; 2], radius: f64, [from, to]: [f64; 2]) -> Vec<[f64; 2]> {
    let [from, to] = [from.to_radians(), to.to_radians()];
    let (points, _) = ellipse(centre, [radius, 0.0], 1.0, [from, to]);
    points
}

/// Returns points of an ellipse by its half axis and the ratio of the other one, from one parameter to
/// another, and true for a whole one, without its last point.
pub fn ellipse(centre: [f64; 2], axis: [f64; 2], ratio: f64, [from, to]: [f64; 2]) -> (Vec<[f64; 2]>, bool) {
    let whole = (to - from).abs() >= TAU * (1.0 - 1e-9);
    let turn = if whole { TAU } else { (to - from).rem_euclid(TAU) };
    let count = (TURN * turn / TAU).ceil().max(1.0) as usize;
    let point = |k: usize| {
        let (sine, cosine) = (from + turn * k as f64 / count as f64).sin_cos();
        [
            centre[0] + cosine * axis[0] - sine * ratio * axis[1],
            centre[1] + cosine * axis[1] + sine * ratio * axis[0],
        ]
    };
    ((0..count + usize::from(!whole)).map(point).collect(), whole)
}

/// Returns points of a polyline from its corners and the bulges after them, the tangent of a quarter of the
/// angle of the arc, above 0 for anticlockwise ones.
pub fn bulged(corners: &[([f64; 2], f64)], closed: bool) -> Vec<[f64; 2]> {
    let mut points = Vec::new();
    for (k, &(own, bulge)) in corners.iter().enumerate() {
        points.push(own);
        let next = corners.get(k + 1).or(if closed { corners.first() } else { None });
        let Some(&(other, _)) = next.filter(|_| bulge != 0.0) else { continue };
        let angle = 4.0 * bulge.atan();
        let across = [own[1] - other[1], other[0] - own[0]];
        let height = 0.5 / (0.5 * angle).tan();
        let centre = [0, 1].map(|d| 0.5 * (own[d] + other[d]) + height * across[d]);
        let count = (TURN * angle.abs() / TAU).ceil().max(1.0);
        let turned = |k: f64| {
            let (sine, cosine) = (angle * k / count).sin_cos();
            let from = [0, 1].map(|d| own[d] - centre[d]);
            [centre[0] + cosine * from[0] - sine * from[1], centre[1] + sine * from[0] + cosine * from[1]]
        };
        points.extend((1..count as usize).map(|k| turned(k as f64)));
    }
    points
}

/// Returns points of a rational B-spline, by de Boor's algorithm; `None` unless there is a knot for each
/// control point, one and the degree, ascending, and a weight above 0 for each point or none.
pub fn spline(degree: i32, knots: &[f64], weights: &[f64], control: &[[f64; 2]]) -> Option<Vec<[f64; 2]>> {
    let degree = usize::try_from(degree).ok().filter(|degree| (1..control.len()).contains(degree))?;
    let ascending = knots.windows(2).all(|pair| pair[0] <= pair[1]);
    let weighted = weights.is_empty() || weights.len() == control.len() && weights.iter().all(|w| *w > 0.0);
    if knots.len() != control.len() + degree + 1 || !ascending || !weighted {
        return None;
    }
    let weight = |k: usize| weights.get(k).copied().unwrap_or(1.0);
    let homogeneous: Vec<[f64; 3]> = (control.iter().enumerate())
        .map(|(k, point)| [weight(k) * point[0], weight(k) * point[1], weight(k)])
        .collect();
    let at = |span: usize, t: f64| {
        let mut own: Vec<[f64; 3]> = homogeneous[span - degree..=span].to_vec();
        for level in 1..=degree {
            for k in (level..=degree).rev() {
                let first = span - degree + k;
                let [low, high] = [knots[first], knots[first + degree + 1 - level]];
                let share = if high > low { (t - low) / (high - low) } else { 0.0 };
                own[k] = [0, 1, 2].map(|d| (1.0 - share) * own[k - 1][d] + share * own[k][d]);
            }
        }
        [0, 1].map(|d| own[degree][d] / own[degree][2])
    };
    let mut points = Vec::new();
    for span in (degree..control.len()).filter(|&span| knots[span + 1] > knots[span]) {
        let step = |k: usize| knots[span] + (knots[span + 1] - knots[span]) * k as f64 / SPAN as f64;
        points.extend((usize::from(!points.is_empty())..=SPAN).map(|k| at(span, step(k))));
    }
    Some(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A rational quadratic spline of nine control points is a circle; an arc of a bulge of 1 half of one.
    #[test]
    fn circles_of_splines_and_bulges() {
        let half = 0.5_f64.sqrt();
        let control =
            [[1., 0.], [1., 1.], [0., 1.], [-1., 1.], [-1., 0.], [-1., -1.], [0., -1.], [1., -1.], [1., 0.]];
        let weights = [1.0, half, 1.0, half, 1.0, half, 1.0, half, 1.0];
        let knots = [0., 0., 0., 1., 1., 2., 2., 3., 3., 4., 4., 4.];
        let points = spline(2, &knots, &weights, &control).unwrap();
        assert!(
            points.len() == 4 * SPAN + 1 && points.iter().all(|p| (p[0].hypot(p[1]) - 1.0).abs() < 1e-12)
        );
        assert!(
            spline(2, &knots[1..], &weights, &control).is_none()
                && spline(0, &knots, &[], &control).is_none()
        );
        let both = bulged(&[([1.0, 0.0], 1.0), ([-1.0, 0.0], 1.0)], true);
        assert!(both.len() == 256 && both.iter().all(|p| (p[0].hypot(p[1]) - 1.0).abs() < 1e-12));
        assert!(both[64][1] > 0.99 && both[192][1] < -0.99);
        let below = bulged(&[([-1.0, 0.0], 0.5), ([1.0, 0.0], 0.0)], false);
        let lowest = below.iter().map(|p| p[1]).fold(0.0, f64::min);
        assert!((lowest + 0.5).abs() < 1e-3, "{lowest}");
        let quarter = arc([2.0, 0.0], 1.0, [270.0, 360.0]);
        assert!((quarter[0][1] + 1.0).abs() < 1e-12 && (quarter[64][0] - 3.0).abs() < 1e-12);
    }
}
