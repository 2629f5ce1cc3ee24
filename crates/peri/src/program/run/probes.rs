//! What a scene's probes see in every row of the history, and the values that follow from their columns.

use super::material::Observed;
use super::outcome::Outcome;
use crate::bonds::Bonds;
use crate::program::quantities as q;
use crate::program::scene::{Body, Probe, Scene, Track};
use crate::solver::State;
use harness::report::{Named, Quantity};
use harness::scene::{SceneError, Source};
use std::f64::consts::PI;

/// Damage of particles at the tip of a crack: less is not torn, more lies behind it.
const AT_THE_TIP: [f64; 2] = [0.35, 0.9];
/// Part of the largest velocity that the front of a wave has.
const AT_THE_FRONT: f64 = 0.02;
/// How near, in spacings, particles of a crack's tip lie.
const TIP: f64 = 2.0;

/// The probes of a scene, on a body.
pub struct Probes<const D: usize> {
    probes: Vec<(Probe, Members)>,
    /// Intact bonds of each site as the body was built; only where a crack is looked for.
    whole: Vec<u32>,
}

/// Which particles a probe looks at.
enum Members {
    Region(Vec<u32>),
    Marks([Vec<u32>; 2]),
    /// Planes at right angles to the axis, ascending: place and particles.
    Planes(Vec<(f64, Vec<u32>)>),
    /// Particles of a ring about a crack tip, each with V/t ∇q, m.
    Ring(Vec<u32>, Vec<[f64; 2]>),
}

impl<const D: usize> Probes<D> {
    /// Finds the particles of all probes.
    ///
    /// # Errors
    /// Regions without particles, marks outside the body.
    pub fn new(source: &Source, scene: &Scene, body: &Body<D>) -> Result<Self, SceneError> {
        let bonds = &*body.bonds;
        let mut probes = Vec::new();
        for (index, probe) in scene.probe.iter().enumerate() {
            let key = format!("probe[{index}]");
            let members = match (probe.track, probe.axis) {
                (Track::Strain, _) => Members::Marks(probe.marks(source, &key, body)?),
                (Track::JIntegral, _) => {
                    let (sites, weights) = probe.ring(source, &key, body)?;
                    Members::Ring(sites, weights)
                }
                (Track::Front, Some(axis)) => {
                    Members::Planes(planes(bonds, probe.members(source, &key, body)?, axis.index()))
                }
                _ => Members::Region(probe.members(source, &key, body)?),
            };
            probes.push((probe.clone(), members));
        }
        let cracks = scene.probe.iter().any(|probe| probe.track == Track::Crack);
        let whole =
            if cracks { (0..bonds.sites()).map(|site| bonds.bonded(site)).collect() } else { Vec::new() };
        Ok(Self { probes, whole })
    }

    /// A number of each probe, two of a crack: its tip, and how far from 0 it is across.
    pub fn see(&self, bonds: &dyn Bonds<D>, state: &State<D>, observed: &Observed<D>) -> Vec<f64> {
        let mut seen = Vec::new();
        for (probe, members) in &self.probes {
            let axis = probe.axis.map_or(0, |axis| axis.index());
            match (probe.track, members) {
                (Track::Displacement, Members::Region(sites)) => {
                    let sum: f64 =
                        sites.iter().map(|&site| state.displacement.get(site as usize)[axis]).sum();
                    seen.push(sum / sites.len() as f64);
                }
                (Track::Rotation, Members::Region(sites)) => seen.push(rotation(bonds, state, sites, axis)),
                (Track::Crack, Members::Region(sites)) => seen.extend(self.tip(bonds, probe, sites, axis)),
                (Track::Strain, Members::Marks(marks)) => seen.push(strain(bonds, state, marks)),
                (Track::Front, Members::Planes(planes)) => {
                    seen.push(front(state, planes, axis, probe.threshold.unwrap_or(AT_THE_FRONT)));
                }
                (Track::JIntegral, Members::Ring(sites, weights)) => {
                    seen.push(j_integral(bonds, state, observed, sites, weights, axis));
                }
                _ => seen.push(f64::NAN),
            }
        }
        seen
    }

    /// The farthest particle at rest with damage in the range, and the largest distance from 0 across of those near it.
    fn tip(&self, bonds: &dyn Bonds<D>, probe: &Probe, sites: &[u32], axis: usize) -> [f64; 2] {
        let [low, high] = probe.damage.unwrap_or(AT_THE_TIP);
        let damaged = |&site: &u32| {
            let whole = self.whole[site as usize];
            let damage = 1.0 - f64::from(bonds.bonded(site as usize)) / f64::from(whole.max(1));
            whole > 0 && (low..=high).contains(&damage)
        };
        let torn: Vec<[f64; D]> =
            sites.iter().copied().filter(damaged).map(|site| bonds.position(site as usize)).collect();
        let Some(tip) = torn.iter().max_by(|a, b| a[axis].total_cmp(&b[axis])) else { return [f64::NAN; 2] };
        let near = |place: &&[f64; D]| {
            let square: f64 = (0..D).map(|d| (place[d] - tip[d]).powi(2)).sum();
            square <= (TIP * bonds.spacing()).powi(2)
        };
        let across = probe.across.map_or(f64::NAN, |across| {
            torn.iter().filter(near).map(|place| place[across.index()].abs()).fold(0.0, f64::max)
        });
        [tip[axis], across]
    }
}

/// J = Σ V/t (P_ij u_i,1 − W δ_1j) ∂q/∂X_j along the axis 1, J/m²: the domain form of Li, Shih & Needleman (1985),
/// doi:10.1016/0013-7944(85)90029-3, of Rice's integral in the reference configuration, for flanks without traction.
fn j_integral<const D: usize>(
    bonds: &dyn Bonds<D>,
    state: &State<D>,
    observed: &Observed<D>,
    sites: &[u32],
    weights: &[[f64; 2]],
    axis: usize,
) -> f64 {
    let mut sum = 0.0;
    observed.energy_momentum(bonds, state, sites, &mut |at, tensor| {
        sum += weights[at].iter().zip(tensor[axis]).map(|(weight, entry)| weight * entry).sum::<f64>();
    });
    sum
}

/// Particles by their place along an axis.
fn planes<const D: usize>(bonds: &dyn Bonds<D>, mut sites: Vec<u32>, axis: usize) -> Vec<(f64, Vec<u32>)> {
    let place = |site: u32| bonds.position(site as usize)[axis];
    sites.sort_by(|&a, &b| place(a).total_cmp(&place(b)).then(a.cmp(&b)));
    let mut planes: Vec<(f64, Vec<u32>)> = Vec::new();
    for site in sites {
        match planes.last_mut() {
            Some((at, members)) if place(site) - *at < 1e-3 * bonds.spacing() => members.push(site),
            _ => planes.push((place(site), vec![site])),
        }
    }
    planes
}

/// Where the largest velocity of a plane falls below a part of the largest of all, between two planes linearly.
fn front<const D: usize>(state: &State<D>, planes: &[(f64, Vec<u32>)], axis: usize, part: f64) -> f64 {
    let speed = |(at, sites): &(f64, Vec<u32>)| {
        let speeds = sites.iter().map(|&site| state.velocity.get(site as usize)[axis].abs());
        (*at, speeds.fold(0.0, f64::max))
    };
    let profile: Vec<(f64, f64)> = planes.iter().map(speed).collect();
    let least = part * profile.iter().map(|p| p.1).fold(0.0, f64::max);
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

/// The rotation about an axis through the origin that fits best: the angle of Σ (X × x, X · x) across the axis.
fn rotation<const D: usize>(bonds: &dyn Bonds<D>, state: &State<D>, sites: &[u32], axis: usize) -> f64 {
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

fn strain<const D: usize>(bonds: &dyn Bonds<D>, state: &State<D>, marks: &[Vec<u32>; 2]) -> f64 {
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
    length(true) / length(false) - 1.0
}

impl Outcome {
    /// Which columns of [`crate::solver::Record::seen`] are whose, with their units.
    pub(super) fn seen_columns(scene: &Scene) -> Vec<(String, String)> {
        let each = |probe: &Probe| {
            let mut columns = vec![(probe.name.clone(), probe.track.unit().to_owned())];
            if probe.track == Track::Crack {
                let Named { name, unit } = probe.named(q::PROBE_ACROSS);
                columns.push((name, unit));
            }
            columns
        };
        let flags = [q::OUTSIDE_SHARE, q::FLAGGED_SHARE].map(|share| (share.name.to_owned(), String::new()));
        scene.probe.iter().flat_map(each).chain(flags.into_iter().filter(|_| scene.is_learnt())).collect()
    }

    /// The values of the probes; what was never seen has none.
    pub(super) fn values_of_probes(&mut self, scene: &Scene) {
        self.probes = Self::seen_columns(scene);
        let mut column = 0;
        for probe in &scene.probe {
            let own = column;
            let rows: Vec<(f64, f64)> =
                self.history.iter().map(|r| (r.time, r.seen[own])).filter(|(_, x)| x.is_finite()).collect();
            column += 1;
            let rows = if probe.track == Track::Rotation { unwrapped(rows) } else { rows };
            let mut add = |quantity: Quantity, value: Option<f64>| {
                if let Some(value) = value.filter(|value| value.is_finite()) {
                    let Named { name, unit } = probe.named(quantity);
                    self.values.push((name, value, unit));
                }
            };
            add(q::PROBE, rows.last().map(|r| r.1));
            let swing = if probe.track == Track::Rotation { first_swing(&rows) } else { None };
            let until = swing.map_or(rows.len(), |(end, _)| end);
            let peak = rows[..until].iter().map(|r| r.1).max_by(|a, b| a.abs().total_cmp(&b.abs()));
            add(q::PROBE_PEAK, peak);
            match (probe.track, probe.gauges.map(|gauges| gauges.map(|at| at.si()))) {
                (Track::Rotation, _) => {
                    let frequency = swing.map(|(_, time)| PI / time);
                    add(q::PROBE_FREQUENCY, frequency);
                    add(q::PROBE_RATE, frequency.zip(peak).map(|(a, b)| a * b.abs()));
                }
                (Track::Crack | Track::Front, Some([from, to])) => {
                    let times = (crossing(&rows, from), crossing(&rows, to));
                    let speed = |(a, b): (f64, f64)| (to - from) / (b - a);
                    add(q::PROBE_SPEED, times.0.zip(times.1).map(speed));
                    let between: Vec<f64> =
                        rows.iter().map(|r| r.1).filter(|x| (from..=to).contains(x)).collect();
                    add(q::PROBE_BETWEEN_GAUGES, Some(between.len() as f64));
                    let back = between.windows(2).map(|pair| pair[0] - pair[1]).fold(0.0, f64::max);
                    add(q::PROBE_BACKSTEP, Some(back));
                }
                (Track::Crack | Track::Front, None) => {
                    let speed = rows.first().zip(rows.last()).map(|(a, b)| (b.1 - a.1) / (b.0 - a.0));
                    add(q::PROBE_SPEED, speed);
                }
                _ => {}
            }
            if probe.track == Track::Crack {
                let gauges = probe.gauges.map_or([f64::NEG_INFINITY, f64::INFINITY], |g| g.map(|at| at.si()));
                let within = self.history.iter().filter(|r| (gauges[0]..=gauges[1]).contains(&r.seen[own]));
                let most = within.map(|r| r.seen[own + 1]).filter(|x| x.is_finite()).reduce(f64::max);
                if let Some(most) = most {
                    self.value(probe.named(q::PROBE_ACROSS), most);
                }
                column += 1;
            }
        }
        if scene.is_learnt() {
            self.values_of_flags(column);
        }
    }

    /// The shares of flagged particles, which `see` noted from `column` on; a warning where there were any.
    fn values_of_flags(&mut self, column: usize) {
        let Some(&[outside, flagged]) = self.history.last().and_then(|r| r.seen.get(column..column + 2))
        else {
            return;
        };
        self.value(q::OUTSIDE_SHARE, outside);
        self.value(q::FLAGGED_SHARE, flagged);
        let first = |column: usize| self.history.iter().position(|r| r.seen[column] > 0.0).map(|row| row + 1);
        let steps = if self.is_dynamic() { "row" } else { "step" };
        let (left, any) = (first(column), first(column + 1));
        if let Some(left) = left {
            self.value(q::FIRST_STEP_OUTSIDE, left as f64);
            self.warnings.push(format!(
                "the learnt law leaves the box of its training data from {steps} {left} on; in the last {steps} in {:.3} % of the particles",
                100.0 * outside
            ));
        } else if let Some(any) = any {
            self.warnings.push(format!(
                "the learnt law is uncertain inside the box of its training data from {steps} {any} on; in the last {steps} in {:.3} % \
                 of the particles",
                100.0 * flagged
            ));
        }
    }
}

/// Angles without jumps of 2π.
fn unwrapped(mut rows: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    let turn = 2.0 * PI;
    for k in 1..rows.len() {
        rows[k].1 -= turn * ((rows[k].1 - rows[k - 1].1) / turn).round();
    }
    rows
}

/// The first row beyond the zero that ends the first half swing, and the time of that zero.
fn first_swing(rows: &[(f64, f64)]) -> Option<(usize, f64)> {
    let most = rows.iter().map(|r| r.1.abs()).fold(0.0, f64::max);
    let inside = rows.iter().position(|r| r.1.abs() >= 0.5 * most && most > 0.0)?;
    let end = (inside + 1..rows.len()).find(|&k| rows[k].1 * rows[inside].1 < 0.0)?;
    let ((t0, a0), (t1, a1)) = (rows[end - 1], rows[end]);
    (t1 > 0.0).then(|| (end, t0 + a0 / (a0 - a1) * (t1 - t0)))
}

/// When a place is first reached, between two rows linearly.
fn crossing(rows: &[(f64, f64)], place: f64) -> Option<f64> {
    let k = rows.iter().position(|r| r.1 >= place).filter(|&k| k > 0)?;
    let ((t0, x0), (t1, x1)) = (rows[k - 1], rows[k]);
    Some(t0 + (place - x0) / (x1 - x0) * (t1 - t0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pendulum() {
        let rows: Vec<(f64, f64)> =
            (0..=40).map(|k| 0.1 * f64::from(k)).map(|t| (t, 4.0 * (2.5 * t).sin())).collect();
        // as atan2 would give it
        let wrapped = rows.iter().map(|&(t, a)| (t, a.sin().atan2(a.cos()))).collect();
        let rows_again = unwrapped(wrapped);
        assert!(rows.iter().zip(&rows_again).all(|(a, b)| (a.1 - b.1).abs() < 1e-12));
        let (end, time) = first_swing(&rows_again).unwrap();
        assert!(end == 13 && (PI / time / 2.5 - 1.0).abs() < 2e-3, "{end} {time}");
        assert_eq!(first_swing(&rows[..5]), None);
        let line: Vec<(f64, f64)> = (0..5).map(|k| (f64::from(k), 3.0 * f64::from(k))).collect();
        assert_eq!(
            (crossing(&line, 4.5), crossing(&line, 20.0), crossing(&line, 0.0)),
            (Some(1.5), None, None)
        );
    }
}
