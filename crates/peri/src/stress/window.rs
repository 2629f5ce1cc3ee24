//! Localisation functions φ of Hardy's stress, Eqs (2.15)–(2.18), averaged over a particle's cell.

use super::{StressMethod, segment_fraction};
use crate::parallel;

/// Standard deviation of the Gaussian window over its cut-off radius.
const DEVIATION: f64 = 1.0 / 3.0;

/// Shape of a localisation function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StressWindow {
    /// Eq. (2.29): constant in the ball.
    Ball,
    /// exp(−r²/2s²), s a third of the ball's radius, zero outside.
    Gaussian,
    /// Cubic B-spline that ends with the ball.
    Spline,
    /// Constant in the particle's own cell: averaged over it, the weights of linear interpolation.
    Cell,
}

impl StressWindow {
    /// Window of a measure that is a sum over bonds with a bond function.
    pub fn for_measure(measure: StressMethod) -> Self {
        match measure {
            StressMethod::Gaussian => Self::Gaussian,
            StressMethod::Spline => Self::Spline,
            StressMethod::LehoucqSilling => Self::Cell,
            _ => Self::Ball,
        }
    }

    /// φ at a point, over its value at the centre; `radius` in the unit of `x`, the cell's edge for
    /// [`Self::Cell`].
    pub fn value<const D: usize>(self, x: [f64; D], radius: f64) -> f64 {
        let q = x.iter().map(|c| c * c).sum::<f64>().sqrt() / radius;
        let inside = match self {
            Self::Cell => x.iter().all(|c| c.abs() < 0.5 * radius),
            _ => q < 1.0,
        };
        match self {
            _ if !inside => 0.0,
            Self::Ball | Self::Cell => 1.0,
            Self::Gaussian => (-0.5 * (q / DEVIATION).powi(2)).exp(),
            Self::Spline if q < 0.5 => 1.0 - 6.0 * q * q * (1.0 - q),
            Self::Spline => 2.0 * (1.0 - q).powi(3),
        }
    }
}

/// A window averaged over a cell of edge 1, tabulated on a grid finer than the cells. Its values at points
/// one cell apart have the same sum wherever the points lie: a partition of unity over the lattice.
pub struct AveragedWindow<const D: usize> {
    /// Intervals per cell.
    fine: usize,
    /// Cells from the centre to the table's ends.
    reach: usize,
    /// Points per cell at which bond functions are evaluated, along the longest axis.
    steps: usize,
    values: Vec<f64>,
}

impl<const D: usize> AveragedWindow<D> {
    /// Averages a window of `radius` cells.
    pub fn new(window: StressWindow, radius: f64) -> Self {
        let radius = if window == StressWindow::Cell { 1.0 } else { radius };
        let reach = (radius + 0.5).ceil() as usize + 1;
        // even, and in solids fewer for long horizons
        let fine = if D == 2 { 16 } else { (48 / reach).clamp(2, 6) & !1 };
        let steps = if window == StressWindow::Cell { fine } else { 4 };
        let side = 2 * reach * fine;
        let place = |i: usize| (i as f64 + 0.5) / fine as f64 - reach as f64;
        let value = |i: usize| {
            window.value::<D>(std::array::from_fn(|d| place(i / side.pow(d as u32) % side)), radius)
        };
        let values = parallel::map(side.pow(D as u32), value);
        Self { fine, reach, steps, values: averaged::<D>(values, side, fine) }
    }

    fn side(&self) -> usize {
        2 * self.reach * self.fine
    }

    /// Averaged window at a point, linear between nodes.
    pub fn value_at(&self, x: [f64; D]) -> f64 {
        let side = self.side();
        let (mut base, mut part) = (0, [0.0; D]);
        for d in (0..D).rev() {
            let c = (x[d] + self.reach as f64) * self.fine as f64;
            if !(0.0..(side - 1) as f64).contains(&c) {
                return 0.0;
            }
            base = base * side + c as usize;
            part[d] = c.fract();
        }
        (0..1 << D)
            .map(|corner: usize| {
                let (mut index, mut weight) = (base, 1.0);
                for (d, part) in part.iter().enumerate() {
                    let upper = corner >> d & 1 == 1;
                    index += if upper { side.pow(d as u32) } else { 0 };
                    weight *= if upper { *part } else { 1.0 - part };
                }
                weight * self.values[index]
            })
            .sum()
    }

    /// Offsets p from which the bond p → p + `offset` meets the window, with the bond function B(p) = ∫₀¹
    /// φ(p + α·offset) dα there, over its sum: Σ B = 1.
    pub fn bond_function(&self, offset: [i32; D]) -> Vec<([i32; D], f64)> {
        let mut found = self.raw_bond_function(offset);
        normalise(&mut found);
        found
    }

    /// Bond function over the window's value at the centre, not normalised.
    fn raw_bond_function(&self, offset: [i32; D]) -> Vec<([i32; D], f64)> {
        let reach = self.reach as i32;
        let low = offset.map(|o| -reach - o.max(0));
        let sides = offset.map(|o| (2 * reach + o.abs() + 1) as usize);
        let longest = offset.iter().map(|o| o.unsigned_abs()).max().unwrap_or(1) as usize;
        let steps = (self.steps * longest).max(self.fine);
        (0..sides.iter().product::<usize>())
            .filter_map(|index| {
                let mut rest = index;
                let start: [i32; D] = std::array::from_fn(|d| {
                    let c = (rest % sides[d]) as i32 + low[d];
                    rest /= sides[d];
                    c
                });
                let along = |k: usize| {
                    let alpha = (k as f64 + 0.5) / steps as f64;
                    self.value_at(std::array::from_fn(|d| f64::from(start[d]) + alpha * f64::from(offset[d])))
                };
                let sum: f64 = (0..steps).map(along).sum();
                (sum > 0.0).then_some((start, sum / steps as f64))
            })
            .collect()
    }

    /// Share of the window's volume in each cell around the centre.
    pub fn cells(&self) -> Vec<([i32; D], f64)> {
        let (reach, fine) = (self.reach as i32, self.fine);
        let across = (2 * reach + 1) as usize;
        let middle = |t: usize| (t as f64 + 0.5) / fine as f64 - 0.5;
        let mut found: Vec<([i32; D], f64)> = (0..across.pow(D as u32))
            .filter_map(|index| {
                let cell: [i32; D] =
                    std::array::from_fn(|d| (index / across.pow(d as u32) % across) as i32 - reach);
                let part = |t: usize| {
                    self.value_at(std::array::from_fn(|d| {
                        f64::from(cell[d]) + middle(t / fine.pow(d as u32) % fine)
                    }))
                };
                let sum: f64 = (0..fine.pow(D as u32)).map(part).sum();
                (sum > 0.0).then_some((cell, sum))
            })
            .collect();
        normalise(&mut found);
        found
    }
}

/// Mean of a window of `radius` about the origin over the segment from `p` to `q`, Eq. (2.15), over its value
/// at the centre.
pub fn bond_function<const D: usize>(window: StressWindow, p: [f64; D], q: [f64; D], radius: f64) -> f64 {
    let inside = segment_fraction(p, q, radius * radius);
    if window == StressWindow::Ball || inside == 0.0 {
        return inside;
    }
    // the part inside the ball is symmetric about the point nearest its centre, cut off by the ends
    let edge: [f64; D] = std::array::from_fn(|d| q[d] - p[d]);
    let dot = |a: [f64; D], b: [f64; D]| (0..D).map(|d| a[d] * b[d]).sum::<f64>();
    let (length, nearest) = (dot(edge, edge), -dot(p, edge) / dot(edge, edge));
    let foot = dot(p, p) - nearest * nearest * length;
    let reach = |radius: f64| ((radius * radius - foot) / length).max(0.0).sqrt();
    let (low, high) = ((nearest - reach(radius)).max(0.0), (nearest + reach(radius)).min(1.0));
    if high <= low {
        return 0.0;
    }
    let unit = length.sqrt() / radius;
    let along = |alpha: f64| (alpha - nearest) * unit;
    let square = (foot / (radius * radius)).max(0.0);
    let sum = match window {
        StressWindow::Spline => {
            // the pieces meet at half the radius
            let inner = reach(0.5 * radius);
            let knots = [low, nearest - inner, nearest + inner, high].map(|k| along(k.clamp(low, high)));
            let piece = |[from, to]: [f64; 2], inner| spline(to, square, inner) - spline(from, square, inner);
            piece([knots[0], knots[1]], false)
                + piece([knots[1], knots[2]], true)
                + piece([knots[2], knots[3]], false)
        }
        _ => {
            let wide = DEVIATION * std::f64::consts::SQRT_2;
            let erf = libm::erf(along(high) / wide) - libm::erf(along(low) / wide);
            0.5 * std::f64::consts::PI.sqrt() * wide * (-0.5 * square / DEVIATION.powi(2)).exp() * erf
        }
    };
    sum / unit
}

/// ∫ of the spline over the distance u along a line at the distance √`square` from the centre, 0 at u = 0;
/// lengths over the radius. With r² = c² + u²: ∫r = ½(u r + c² arsinh(u/c)), ∫r³ = ¼(u r³ + 3 c² ∫r).
fn spline(u: f64, square: f64, inner: bool) -> f64 {
    let r = (square + u * u).sqrt();
    let log = if square > 0.0 { square * (u / square.sqrt()).asinh() } else { 0.0 };
    let first = 0.5 * (u * r + log);
    let second = u * (square + u * u / 3.0);
    let third = 0.25 * (u * r.powi(3) + 3.0 * square * first);
    if inner { u - 6.0 * second + 6.0 * third } else { 2.0 * (u - 3.0 * first + 3.0 * second - third) }
}

/// Divides weights by their sum.
pub fn normalise<T>(weights: &mut [(T, f64)]) {
    let sum: f64 = weights.iter().map(|w| w.1).sum();
    for weight in weights {
        weight.1 /= sum;
    }
}

/// Averages `fine` samples along every axis. Samples lie between nodes: the cell about node i holds those
/// from i − fine/2 on; zero beyond the ends.
fn averaged<const D: usize>(mut values: Vec<f64>, side: usize, fine: usize) -> Vec<f64> {
    for d in 0..D {
        let stride = side.pow(d as u32);
        let one = |index: usize| {
            let along = index / stride % side;
            let (low, high) = (along.saturating_sub(fine / 2), (along + fine / 2).min(side));
            let line = index - along * stride;
            (low..high).map(|k| values[line + k * stride]).sum::<f64>() / fine as f64
        };
        values = parallel::map(values.len(), one);
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bonds::Stencil;

    const WINDOWS: [StressWindow; 4] =
        [StressWindow::Ball, StressWindow::Gaussian, StressWindow::Spline, StressWindow::Cell];

    /// Checks that Σ_p φ(p + x) over the lattice does not depend on x; without the average over the cell it
    /// does, by several percent.
    fn partition<const D: usize>(ratio: f64) {
        let far = ratio as i32 + 3;
        let side = (2 * far + 1) as usize;
        let sum = |x: [f64; D], f: &dyn Fn([f64; D]) -> f64| -> f64 {
            (0..side.pow(D as u32))
                .map(|i| {
                    f(std::array::from_fn(|d| x[d] + f64::from((i / side.pow(d as u32) % side) as i32 - far)))
                })
                .sum()
        };
        let places = [[0.0; D], [0.5; D], std::array::from_fn(|d| 0.137 + 0.31 * d as f64)];
        for window in WINDOWS {
            let table = AveragedWindow::<D>::new(window, ratio);
            let [a, b, c] = places.map(|x| sum(x, &|x| table.value_at(x)));
            // rounding of some thousand additions
            assert!((b / a - 1.0).abs() < 1e-12 && (c / a - 1.0).abs() < 1e-12, "{window:?} {a} {b} {c}");
        }
        let plain = places.map(|x| sum(x, &|x| StressWindow::Ball.value(x, ratio)));
        assert!(plain.iter().any(|p| (p / plain[0] - 1.0).abs() > 5e-3), "{plain:?}");
    }

    #[test]
    fn windows_are_partitions_of_unity() {
        for ratio in [3.015, 4.015, 6.015, 8.015] {
            partition::<2>(ratio);
        }
        for ratio in [3.015, 4.015, 6.015] {
            partition::<3>(ratio);
        }
    }

    /// Every bond has the same sum of weights before it is divided: that of the window over the cells. Solids
    /// of m = 3, 4 and 6, whose whole fields take long.
    #[test]
    fn weights_of_every_bond_sum_to_the_same() {
        for ratio in [3.015, 4.015, 6.015] {
            let table = AveragedWindow::<3>::new(StressWindow::Ball, ratio);
            let shares = table.cells();
            assert!((shares.iter().map(|s| s.1).sum::<f64>() - 1.0).abs() < 1e-13);
            let far = ratio as i32 + 3;
            let whole: f64 = (-far..=far)
                .flat_map(|x| (-far..=far).flat_map(move |y| (-far..=far).map(move |z| [x, y, z])))
                .map(|p| table.value_at(p.map(f64::from)))
                .sum();
            let stencil = Stencil::<3>::new(ratio);
            let step = if ratio > 4.5 { 29 } else { 7 };
            for offset in stencil.offsets.iter().step_by(step) {
                let raw: f64 = table.raw_bond_function(*offset).iter().map(|w| w.1).sum();
                assert!((raw / whole - 1.0).abs() < 1e-12, "{offset:?}: {raw} against {whole}");
            }
        }
    }

    /// Windows decrease from their centre and vanish outside: (2.16), (2.17); their mean along a bond is that
    /// of many points.
    #[test]
    fn shapes_and_means_along_bonds() {
        for window in WINDOWS {
            let values: Vec<f64> = (0..40).map(|k| window.value([0.05 * f64::from(k), 0.0], 1.5)).collect();
            assert!(values[0] == 1.0 && values.windows(2).all(|v| v[1] <= v[0]) && values[31] == 0.0);
        }
        for window in [StressWindow::Ball, StressWindow::Gaussian, StressWindow::Spline] {
            for (p, q) in [
                ([-2.0, 0.3], [1.9, -0.4]),
                ([0.1, 0.2], [0.9, 1.0]),
                ([0.5, 0.1], [3.0, 0.0]),
                // through the centre, and beside the inner piece
                ([-1.0, 0.0], [0.4, 0.0]),
                ([-0.3, 1.0], [0.4, 1.1]),
            ] {
                let points = 200_000;
                let at = |k: u32| {
                    let alpha = (f64::from(k) + 0.5) / f64::from(points);
                    window.value([p[0] + alpha * (q[0] - p[0]), p[1] + alpha * (q[1] - p[1])], 1.5)
                };
                let mean = (0..points).map(at).sum::<f64>() / f64::from(points);
                // points inside are counted to one in 200,000
                let found = bond_function(window, p, q, 1.5);
                assert!((found - mean).abs() < 1e-5, "{window:?} {p:?}: {found} against {mean}");
            }
        }
    }
}
