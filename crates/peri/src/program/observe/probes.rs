//! What a scene's probes see in every row of the history, and the values that follow from their columns.

use super::{Moment, flags};
use crate::bonds::Bonds;
use crate::probe::{
    CrackTip, JIntegral, StressEvaluator, WaveFront, crossing, first_swing, mean_displacement, rotation,
    strain, unwrapped,
};
use crate::program::quantities as q;
use crate::program::scene::{Body, Probe, Scene, Track};
use crate::solver::State;
use harness::observe::Scalars;
use harness::report::{Named, Quantity};
use harness::scene::{SceneError, Source};
use std::f64::consts::PI;

/// Damage of particles at the tip of a crack: less is not torn, more lies behind it.
const AT_THE_TIP: [f64; 2] = [0.35, 0.9];
/// Part of the largest velocity that the front of a wave has.
const AT_THE_FRONT: f64 = 0.02;

/// A probe on a body.
pub enum Tracked {
    Displacement(Vec<u32>, usize),
    Rotation(Vec<u32>, usize),
    Strain([Vec<u32>; 2]),
    Crack(CrackTip),
    Front(WaveFront),
    JIntegral(JIntegral),
}

impl Tracked {
    /// Finds the particles of a probe.
    ///
    /// # Errors
    /// Regions without particles, marks outside the body.
    pub fn new<const D: usize>(
        source: &Source,
        key: &str,
        probe: &Probe,
        body: &Body<D>,
    ) -> Result<Self, SceneError> {
        let (axis, bonds) = (probe.axis.map_or(0, |axis| axis.index()), &*body.bonds);
        let sites = || probe.members(source, key, body);
        Ok(match probe.track {
            Track::Displacement => Self::Displacement(sites()?, axis),
            Track::Rotation => Self::Rotation(sites()?, axis),
            Track::Strain => Self::Strain(probe.marks(source, key, body)?),
            Track::Crack => Self::Crack(CrackTip {
                sites: sites()?,
                whole: (0..bonds.sites()).map(|site| bonds.bonded(site)).collect(),
                damage: probe.damage.unwrap_or(AT_THE_TIP),
                axis,
                across: probe.across.map(|across| across.index()),
            }),
            Track::Front => {
                Self::Front(WaveFront::new(bonds, sites()?, axis, probe.threshold.unwrap_or(AT_THE_FRONT)))
            }
            Track::JIntegral => {
                let (tip, radii) = probe.ring(source, key)?;
                let ring = JIntegral::new(bonds, body.thickness, tip, radii, axis);
                Self::JIntegral(
                    ring.map_err(|none| {
                        source.error(&format!("{key}.radii"), none, "a ring with particles")
                    })?,
                )
            }
        })
    }

    /// Its numbers in a row of the history: one, two of a crack.
    pub fn row<const D: usize>(
        &self,
        bonds: &dyn Bonds<D>,
        state: &State<D>,
        evaluator: &StressEvaluator<D>,
    ) -> Vec<f64> {
        match self {
            Self::Displacement(sites, axis) => vec![mean_displacement(state, sites, *axis)],
            Self::Rotation(sites, axis) => vec![rotation(bonds, state, sites, *axis)],
            Self::Strain(marks) => vec![strain(bonds, state, marks)],
            Self::Crack(tip) => tip.value(bonds).to_vec(),
            Self::Front(front) => vec![front.value(state)],
            Self::JIntegral(ring) => vec![ring.value(evaluator, bonds, state)],
        }
    }
}

/// Numbers of a probe in a row.
pub(super) fn width(probe: &Probe) -> usize {
    1 + usize::from(probe.track == Track::Crack)
}

/// Columns of probes and flags in the table of the history, with their units.
pub fn columns(scene: &Scene) -> Vec<(String, String)> {
    let each = |probe: &Probe| {
        let own = (probe.name.clone(), probe.track.unit().to_owned());
        let across = (width(probe) > 1).then(|| probe.named(q::PROBE_ACROSS));
        [Some(own), across.map(|Named { name, unit }| (name, unit))]
    };
    let flags = flags::COLUMNS.map(|share| (share.name.to_owned(), String::new()));
    let probes = scene.probe.iter().flat_map(each).flatten();
    probes.chain(flags.into_iter().filter(|_| scene.is_learnt())).collect()
}

/// Values of all probes.
pub(super) fn scalars<const D: usize>(scene: &Scene, to: &mut Scalars<Moment<D>>) {
    let mut column = 0;
    for probe in &scene.probe {
        of_probe(probe, column, to);
        column += width(probe);
    }
}

/// The values of a probe; what was never seen has none.
pub(super) fn of_probe<const D: usize>(probe: &Probe, column: usize, to: &mut Scalars<Moment<D>>) {
    let turns = probe.track == Track::Rotation;
    let rows = |m: &Moment<D>| {
        let all = m.state.history.iter().map(|row| (row.time, row.seen[column]));
        let rows = all.filter(|(_, x)| x.is_finite()).collect();
        if turns { unwrapped(rows) } else { rows }
    };
    let mut add = |quantity: Quantity, value: &dyn Fn(&[(f64, f64)]) -> Option<f64>| {
        to.add_if(probe.named(quantity), |m| value(&rows(m)).filter(|value| value.is_finite()));
    };
    let frequency = |rows: &[(f64, f64)]| first_swing(rows).map(|(_, time)| PI / time);
    let peak = |rows: &[(f64, f64)]| {
        let swing = if turns { first_swing(rows) } else { None };
        let until = swing.map_or(rows.len(), |(end, _)| end);
        rows[..until].iter().map(|row| row.1).max_by(|a, b| a.abs().total_cmp(&b.abs()))
    };
    add(q::PROBE, &|rows| rows.last().map(|row| row.1));
    add(q::PROBE_PEAK, &peak);
    if turns {
        add(q::PROBE_FREQUENCY, &frequency);
        add(q::PROBE_RATE, &|rows| frequency(rows).zip(peak(rows)).map(|(a, b)| a * b.abs()));
    }
    let gauges = probe.gauges.map(|gauges| gauges.map(|at| at.si()));
    if matches!(probe.track, Track::Crack | Track::Front) {
        add(q::PROBE_SPEED, &|rows| match gauges {
            Some([from, to]) => Some((to - from) / (crossing(rows, to)? - crossing(rows, from)?)),
            None => rows.first().zip(rows.last()).map(|(a, b)| (b.1 - a.1) / (b.0 - a.0)),
        });
        let between = |rows: &[(f64, f64)]| -> Option<Vec<f64>> {
            let [from, to] = gauges?;
            Some(rows.iter().map(|row| row.1).filter(|x| (from..=to).contains(x)).collect())
        };
        add(q::PROBE_BETWEEN_GAUGES, &|rows| Some(between(rows)?.len() as f64));
        add(q::PROBE_BACKSTEP, &|rows| {
            Some(between(rows)?.windows(2).map(|pair| pair[0] - pair[1]).fold(0.0, f64::max))
        });
    }
    if probe.track == Track::Crack {
        let [from, until] = gauges.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        to.add_if(probe.named(q::PROBE_ACROSS), |m| {
            let within = m.state.history.iter().filter(|row| (from..=until).contains(&row.seen[column]));
            within.map(|row| row.seen[column + 1]).filter(|x| x.is_finite()).reduce(f64::max)
        });
    }
}
