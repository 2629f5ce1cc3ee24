//! Scalars of probes, computed from their columns in the history.

use super::moment::Moment;
use super::rows::{columns, mean_stress, width};
use crate::probe::{crossing, first_swing, load_at, unwrapped};
use crate::program::quantities as q;
use crate::program::scene::{HistoryProbe, Scene, Track};
use harness::observe::Scalars;
use harness::report::Quantity;
use std::f64::consts::PI;

/// Adds the scalars of all probes.
pub(super) fn scalars<const D: usize>(scene: &Scene, to: &mut Scalars<Moment<D>>) {
    let mut column = 0;
    for probe in &scene.probe {
        probe_scalars(probe, column, to);
        column += width(probe);
    }
}

/// Adds the mean stress of a cell with periodic sides.
pub(super) fn mean_stresses<const D: usize>(scene: &Scene, to: &mut Scalars<Moment<D>>) {
    let names = mean_stress(scene);
    let first = columns(scene).len() - names.len();
    for (k, named) in names.into_iter().enumerate() {
        to.add_if(named, |m| m.state.history.last()?.seen.get(first + k).copied());
    }
}

/// Time and value of each row in which a probe has a value.
type ProbeRows = [(f64, f64)];

/// Adds the scalars of a probe that has values.
pub(super) fn probe_scalars<const D: usize>(
    probe: &HistoryProbe,
    column: usize,
    to: &mut Scalars<Moment<D>>,
) {
    let is_rotation = probe.track == Track::Rotation;
    let rows = |m: &Moment<D>| {
        let all = m.state.history.iter().map(|row| (row.time, row.seen[column]));
        let rows = all.filter(|(_, x)| x.is_finite()).collect();
        if is_rotation { unwrapped(rows) } else { rows }
    };
    let mut add = |quantity: Quantity, value: &dyn Fn(&ProbeRows) -> Option<f64>| {
        to.add_if(probe.named(quantity), |m| value(&rows(m)).filter(|value| value.is_finite()));
    };
    let frequency = |rows: &ProbeRows| first_swing(rows).map(|(_, time)| PI / time);
    let peak = |rows: &ProbeRows| {
        let swing = if is_rotation { first_swing(rows) } else { None };
        let until = swing.map_or(rows.len(), |(end, _)| end);
        rows[..until].iter().map(|row| row.1).max_by(|a, b| a.abs().total_cmp(&b.abs()))
    };
    add(q::PROBE, &|rows| rows.last().map(|row| row.1));
    add(q::PROBE_PEAK, &peak);
    if is_rotation {
        add(q::PROBE_FREQUENCY, &frequency);
        add(q::PROBE_RATE, &|rows| frequency(rows).zip(peak(rows)).map(|(a, b)| a * b.abs()));
    }
    let gauges = probe.gauges.map(|gauges| gauges.map(|at| at.si()));
    if matches!(probe.track, Track::Crack | Track::Front) {
        add(q::PROBE_SPEED, &|rows| match gauges {
            Some([from, to]) => Some((to - from) / (crossing(rows, to)? - crossing(rows, from)?)),
            None => rows.first().zip(rows.last()).map(|(a, b)| (b.1 - a.1) / (b.0 - a.0)),
        });
        add(q::PROBE_ARRIVAL, &|rows| {
            let [from, _] = gauges?;
            rows.iter().find(|row| row.1 >= from).map(|row| row.0)
        });
        let between = |rows: &ProbeRows| -> Option<Vec<f64>> {
            let [from, to] = gauges?;
            Some(rows.iter().map(|row| row.1).filter(|x| (from..=to).contains(x)).collect())
        };
        add(q::PROBE_BETWEEN_GAUGES, &|rows| Some(between(rows)?.len() as f64));
        add(q::PROBE_BACKSTEP, &|rows| {
            Some(between(rows)?.windows(2).map(|pair| pair[0] - pair[1]).fold(0.0, f64::max))
        });
    }
    for at in probe.load_at.iter().map(|at| at.si()) {
        let path =
            |m: &Moment<D>| load_at(m.state.history.iter().map(|row| [row.seen[column], row.load]), at);
        to.add_if(q::probe_load_at(&probe.name, at), path);
    }
    if probe.track == Track::Crack {
        let [from, until] = gauges.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        to.add_if(probe.named(q::PROBE_ACROSS), |m| {
            let within = m.state.history.iter().filter(|row| (from..=until).contains(&row.seen[column]));
            within.map(|row| row.seen[column + 1]).filter(|x| x.is_finite()).reduce(f64::max)
        });
    }
}
