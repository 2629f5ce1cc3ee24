//! Motion of parts of a body: mean displacement, best-fit rotation, strain between marks, the front of a
//! wave.

use crate::bonds::Bonds;
use crate::solver::State;

/// Mean displacement of some sites along an axis, m.
pub fn mean_displacement<const D: usize>(state: &State<D>, sites: &[u32], axis: usize) -> f64 {
    let sum: f64 = sites.iter().map(|&site| state.displacement.get(site as usize)[axis]).sum();
    sum / sites.len() as f64
}

/// Best-fit rotation of some sites about an axis through the origin, rad: the angle of Σ (X × x, X · x)
/// across the axis.
pub fn rotation<const D: usize>(bonds: &dyn Bonds<D>, state: &State<D>, sites: &[u32], axis: usize) -> f64 {
    let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
    let (mut cross, mut dot) = (0.0, 0.0);
    for &site in sites {
        let (rest, moved) = (bonds.position(site as usize), state.displacement.get(site as usize));
        let of = |d: usize| rest.get(d).map_or([0.0; 2], |x| [*x, x + moved[d]]);
        let ([x, x1], [y, y1]) = (of(a), of(b));
        cross += x * y1 - y * x1;
        dot += x * x1 + y * y1;
    }
    cross.atan2(dot)
}

/// Distances between the centres of two marks, m: at rest, and now.
pub fn mark_distances<const D: usize>(
    bonds: &dyn Bonds<D>,
    state: &State<D>,
    marks: &[Vec<u32>; 2],
) -> [f64; 2] {
    let mean = |sites: &[u32], moved: bool| -> [f64; D] {
        let mut sum = [0.0; D];
        for &site in sites {
            let (rest, by) = (bonds.position(site as usize), state.displacement.get(site as usize));
            for d in 0..D {
                sum[d] += rest[d] + if moved { by[d] } else { 0.0 };
            }
        }
        sum.map(|x| x / sites.len() as f64)
    };
    let length = |moved: bool| {
        let (from, to) = (mean(&marks[0], moved), mean(&marks[1], moved));
        (0..D).map(|d| (to[d] - from[d]).powi(2)).sum::<f64>().sqrt()
    };
    [length(false), length(true)]
}

/// Front of a wave that runs along an axis: the position where the largest velocity of a plane of particles
/// falls below a fraction of the overall maximum.
pub struct WaveFront {
    /// Planes at right angles to the axis, ascending: position, m, and particles.
    planes: Vec<(f64, Vec<u32>)>,
    axis: usize,
    part: f64,
}

impl WaveFront {
    /// Sorts the particles of some sites into planes across the axis; `part` is the fraction of the largest
    /// velocity at the front.
    pub fn new<const D: usize>(bonds: &dyn Bonds<D>, mut sites: Vec<u32>, axis: usize, part: f64) -> Self {
        let place = |site: u32| bonds.position(site as usize)[axis];
        sites.sort_by(|&a, &b| place(a).total_cmp(&place(b)).then(a.cmp(&b)));
        let mut planes: Vec<(f64, Vec<u32>)> = Vec::new();
        for site in sites {
            match planes.last_mut() {
                Some((at, members)) if place(site) - *at < 1e-3 * bonds.spacing() => members.push(site),
                _ => planes.push((place(site), vec![site])),
            }
        }
        Self { planes, axis, part }
    }

    /// Position along the axis, m, interpolated linearly between two planes; NaN if nothing moves.
    pub fn value<const D: usize>(&self, state: &State<D>) -> f64 {
        let speed = |(at, sites): &(f64, Vec<u32>)| {
            let speeds = sites.iter().map(|&site| state.velocity.get(site as usize)[self.axis].abs());
            (*at, speeds.fold(0.0, f64::max))
        };
        let profile: Vec<(f64, f64)> = self.planes.iter().map(speed).collect();
        let least = self.part * profile.iter().map(|p| p.1).fold(0.0, f64::max);
        match profile.iter().rposition(|p| p.1 >= least) {
            Some(last) if least > 0.0 => {
                let (at, speed) = profile[last];
                profile
                    .get(last + 1)
                    .map_or(at, |&(next, less)| at + (speed - least) / (speed - less) * (next - at))
            }
            _ => f64::NAN,
        }
    }
}
