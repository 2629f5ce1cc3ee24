//! Paths of two quantities: swings over time, crossings of positions, stiffness and loops of loads over
//! displacements, the envelope of equilibria that snap back.

use std::f64::consts::PI;

/// Removes jumps of 2π from angles over time, as `atan2` returns them.
pub fn unwrapped(mut rows: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    let turn = 2.0 * PI;
    for k in 1..rows.len() {
        rows[k].1 -= turn * ((rows[k].1 - rows[k - 1].1) / turn).round();
    }
    rows
}

/// Finds the first half swing of a pendulum from rows of time and angle: the first row beyond the zero that
/// ends it, and the time of that zero; the frequency is π over it.
pub fn first_swing(rows: &[(f64, f64)]) -> Option<(usize, f64)> {
    let most = rows.iter().map(|r| r.1.abs()).fold(0.0, f64::max);
    let inside = rows.iter().position(|r| r.1.abs() >= 0.5 * most && most > 0.0)?;
    let end = (inside + 1..rows.len()).find(|&k| rows[k].1 * rows[inside].1 < 0.0)?;
    let ((t0, a0), (t1, a1)) = (rows[end - 1], rows[end]);
    (t1 > 0.0).then(|| (end, t0 + a0 / (a0 - a1) * (t1 - t0)))
}

/// Time at which a position is first reached, interpolated linearly; `None` if the first row is already
/// there.
pub fn crossing(rows: &[(f64, f64)], place: f64) -> Option<f64> {
    let k = rows.iter().position(|r| r.1 >= place).filter(|&k| k > 0)?;
    let ((t0, x0), (t1, x1)) = (rows[k - 1], rows[k]);
    Some(t0 + (place - x0) / (x1 - x0) * (t1 - t0))
}

/// Load at a displacement of a path of displacements and loads that begins at rest, interpolated linearly.
pub fn load_at(path: impl IntoIterator<Item = [f64; 2]>, displacement: f64) -> Option<f64> {
    let mut before = [0.0; 2];
    for here in path {
        if here[0] >= displacement * (1.0 - 1e-12) {
            let part = (displacement - before[0]) / (here[0] - before[0]);
            return Some(before[1] + part.min(1.0) * (here[1] - before[1]));
        }
        before = here;
    }
    None
}

/// Energy per length that a crack takes: from rows of its tip, m, and of the energy spent, J, the middle of
/// each advance by at least `least`, m, the energy spent in it over its length, J/m, and its length, m.
pub fn resistance(rows: impl IntoIterator<Item = [f64; 2]>, least: f64) -> Vec<[f64; 3]> {
    let mut rows = rows.into_iter().filter(|row| row.iter().all(|x| x.is_finite()));
    let Some(mut before) = rows.next() else { return Vec::new() };
    let mut found = Vec::new();
    for here in rows {
        let [advance, spent] = [here[0] - before[0], here[1] - before[1]];
        if advance.abs() >= least {
            found.push([0.5 * (before[0] + here[0]), spent / advance.abs(), advance.abs()]);
            before = here;
        } else if found.is_empty() && advance == 0.0 {
            // until the crack starts
            before = here;
        }
    }
    found
}

/// Secant and tangent stiffness, N/m, at a displacement where a path of displacements and loads first comes
/// to it: load over displacement, and the slope there of the parabola through the two points beside and the
/// next one, of second order in their distances.
///
/// The path begins at rest; points at displacement 0 before all others, as of a body with stresses of its
/// own, are its start in place of that, and secants count from the load there. Each point has the number of
/// events so far, such as broken bonds. Returns `None` between two points with different numbers, where the
/// load drops; no parabola passes through both.
pub fn stiffness_at(path: impl IntoIterator<Item = ([f64; 2], u64)>, displacement: f64) -> Option<[f64; 2]> {
    let mut path: Vec<([f64; 2], u64)> = std::iter::once(([0.0; 2], 0)).chain(path).collect();
    let start = path.iter().position(|point| point.0[0] != 0.0)?.checked_sub(1)?;
    path.drain(..start);
    let end = path.iter().position(|point| point.0[0] >= displacement * (1.0 - 1e-12)).filter(|&k| k > 0)?;
    let [(a, before), (b, after)] = [path[end - 1], path[end]];
    if before != after {
        return None;
    }
    let next = path.get(end + 1).filter(|point| point.0[0] > b[0] && point.1 == after);
    let last = end.checked_sub(2).map(|k| &path[k]).filter(|point| point.0[0] < a[0] && point.1 == before);
    let slope = |a: [f64; 2], b: [f64; 2]| (b[1] - a[1]) / (b[0] - a[0]);
    let chord = slope(a, b);
    let curvature = next.or(last).map_or(0.0, |&(c, _)| (slope(b, c) - chord) / (c[0] - a[0]));
    let load = a[1] + ((displacement - a[0]) / (b[0] - a[0])).min(1.0) * (b[1] - a[1]);
    Some([(load - path[0].0[1]) / displacement, chord + curvature * (2.0 * displacement - a[0] - b[0])])
}

/// Work, J, of the last loop of a path of displacements and loads that begins at rest, ∮ F du by the
/// trapezoidal rule: from the last time that it passed its final displacement. `None` if it never did.
pub fn loop_energy(path: impl IntoIterator<Item = [f64; 2]>) -> Option<f64> {
    last_loop(path, 0)
}

/// Work, J, of the last loop as [`loop_energy`], of a path that its loads drive: from the last time that it
/// passed its final load. A body that has moved on meanwhile has F times this way in it.
pub fn driven_loop_energy(path: impl IntoIterator<Item = [f64; 2]>) -> Option<f64> {
    last_loop(path, 1)
}

/// ∮ F du from the last time that the path passed the final value of its component `by`.
fn last_loop(path: impl IntoIterator<Item = [f64; 2]>, by: usize) -> Option<f64> {
    let path: Vec<[f64; 2]> = std::iter::once([0.0; 2]).chain(path).collect();
    let end = path.last()?[by];
    let size = path.iter().map(|point| point[by].abs()).fold(0.0, f64::max);
    let is_off = |point: &[f64; 2]| (point[by] - end).abs() > 1e-9 * size;
    // the last point away from the end, and the sign of that way
    let away = path.iter().rposition(is_off)?;
    let sign = (path[away][by] - end).signum();
    let start = path[..away].iter().rposition(|point| (point[by] - end) * sign <= 1e-9 * size)?;
    let area = |a: [f64; 2], b: [f64; 2]| 0.5 * (a[1] + b[1]) * (b[0] - a[0]);
    let [a, b] = [path[start], path[start + 1]];
    let part = ((end - a[by]) / (b[by] - a[by])).clamp(0.0, 1.0);
    let crossing = [a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1])];
    let rest = path[start + 1..].windows(2).map(|ends| area(ends[0], ends[1]));
    Some(area(crossing, b) + rest.sum::<f64>())
}

/// Envelope of equilibria that snap back, as a test machine records it: the greatest load at each
/// displacement of a path of displacements and loads, linear between them; at the greatest displacement the
/// fall to the load at the end of the path. Returns displacements, ascending, and loads.
pub fn envelope(path: &[[f64; 2]]) -> [Vec<f64>; 2] {
    let mut at: Vec<f64> = path.iter().map(|point| point[0]).collect();
    at.sort_by(f64::total_cmp);
    at.dedup();
    let greatest = |u: f64| {
        let mut most = f64::NEG_INFINITY;
        for ends in path.windows(2) {
            let [[a, before], [b, after]] = [ends[0], ends[1]];
            if a.min(b) <= u && u <= a.max(b) {
                let part = (u - a) / (b - a);
                most = most.max(if a == b { before.max(after) } else { before + part * (after - before) });
            }
        }
        most
    };
    let mut load: Vec<f64> = at.iter().map(|&u| greatest(u)).collect();
    if let (Some(&most), Some(end)) = (at.last(), path.last())
        && most > end[0]
    {
        at.push(most);
        load.push(end[1]);
    }
    [at, load]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_machine_sees_the_upper_branch_and_the_fall() {
        // up to 3 N at 3 m, back to 1 m, a second branch that crosses the range of the first, and the end at
        // 2 m
        let path = [[0.0, 0.0], [3.0, 3.0], [1.0, 0.5], [2.0, 2.5], [2.0, 0.0]];
        let [at, load] = envelope(&path);
        assert_eq!(at, [0.0, 1.0, 2.0, 3.0, 3.0]);
        assert_eq!(load, [0.0, 1.0, 2.5, 3.0, 0.0]);
        // without snap-back it is the path
        assert_eq!(
            envelope(&[[0.0, 0.0], [1.0, 2.0], [2.0, 1.0]]),
            [vec![0.0, 1.0, 2.0], vec![0.0, 2.0, 1.0]]
        );
    }

    #[test]
    fn stiffness_of_a_parabola() {
        // F = 3u + u²: the slope is exact at and between points, at the end and after a turn
        let load = |u: f64| [u, 3.0 * u + u * u];
        let smooth = |path: &[[f64; 2]], at: f64| stiffness_at(path.iter().map(|&point| (point, 0)), at);
        let path: Vec<[f64; 2]> = [0.5, 1.2, 2.0, 1.0, 0.0].map(load).to_vec();
        for at in [0.2, 0.5, 0.9, 1.2, 2.0] {
            let [secant, tangent] = smooth(&path, at).unwrap();
            let chord = load_at(path.iter().copied(), at).unwrap() / at;
            assert!((secant - chord).abs() < 1e-12 && (tangent - 3.0 - 2.0 * at).abs() < 1e-12, "{at}");
        }
        assert_eq!(smooth(&path, 2.1), None);
        assert_eq!(smooth(&[[1.0, 4.0]], 1.0), Some([4.0, 4.0]));
        assert_eq!(smooth(&[], 1.0), None);
    }

    #[test]
    fn resistance_of_a_crack_that_waits_and_jumps() {
        // 2 J/m, in advances of 1, 3 and 1 m; losses before it starts do not count
        let rows =
            [[f64::NAN, 0.0], [5.0, 0.0], [5.0, 0.5], [6.0, 2.5], [6.2, 2.9], [9.0, 8.5], [10.0, 10.5]];
        assert_eq!(resistance(rows, 0.9), [[5.5, 2.0, 1.0], [7.5, 2.0, 3.0], [9.5, 2.0, 1.0]]);
        assert_eq!(resistance([[1.0, 0.0]], 0.9), [[0.0; 3]; 0]);
    }

    #[test]
    fn stiffness_across_falls_and_from_a_load_at_rest() {
        // 4 N/m, bonds that break between 2 and 3 m, then 1 N/m
        let path = [([1.0, 4.0], 0), ([2.0, 8.0], 0), ([3.0, 3.0], 7), ([4.0, 4.0], 7)];
        for (at, expected) in [
            (1.5, Some([4.0, 4.0])),
            (2.0, Some([4.0, 4.0])),
            (2.5, None),
            (3.0, None),
            (3.5, Some([1.0, 1.0])),
        ] {
            assert_eq!(stiffness_at(path, at), expected, "{at}");
        }
        // 5 N of a stress of the body itself, in one row and in two, then 2 N/m
        let rest = ([0.0, 5.0], 0);
        assert_eq!(stiffness_at([rest, ([1.0, 7.0], 0)], 0.5), Some([2.0, 2.0]));
        assert_eq!(stiffness_at([([0.0, 1.0], 0), rest, ([1.0, 7.0], 0)], 0.5), Some([2.0, 2.0]));
        assert_eq!(stiffness_at([rest], 0.5), None);
    }

    #[test]
    fn loops_of_a_load() {
        // a spring of 2 N/m beside a Coulomb slider of 1 N between loads of 0 and 6 N: u = (F ∓ 1)/2 but for
        // the parts where it sticks; a loop loses twice 1 N times 2 m
        let cycle = [[2.5, 6.0], [2.5, 4.0], [0.5, 0.0]];
        let again = [[0.5, 2.0], [2.5, 6.0], [2.5, 4.0], [0.5, 0.0]];
        let path = || [[0.0, 1.0]].into_iter().chain(cycle).chain(again);
        assert_eq!(driven_loop_energy(path()), Some(2.0 * 2.0));
        // by displacement it is the same loop
        assert_eq!(loop_energy(path()), Some(2.0 * 2.0));
        // from rest the body has not come back
        assert_eq!(driven_loop_energy([[0.0, 1.0]].into_iter().chain(cycle)), Some(8.75 - 4.0));
        assert_eq!(loop_energy([[0.0, 1.0]].into_iter().chain(cycle).take(3)), None);
        assert_eq!(driven_loop_energy([[1.0, 2.0], [2.0, 3.0]]), None);
    }

    #[test]
    fn loops() {
        // Coulomb's block of 2 N on a spring of 4 N/m, between 0 and 3 m, from rest and again
        let first = [[0.5, 2.0], [3.0, 2.0], [2.0, -2.0], [0.0, -2.0]];
        let again = [[1.0, 2.0], [3.0, 2.0], [2.0, -2.0], [0.0, -2.0]];
        assert_eq!(loop_energy(first), Some(0.5 + 5.0 + 4.0));
        assert_eq!(loop_energy(first.into_iter().chain(again)), Some(2.0 * 4.0));
        // a part of a loop, closed at 1 m
        let part = [[2.0, 4.0], [1.0, 1.0]];
        assert_eq!(loop_energy(part), Some(3.0 - 2.5));
        assert_eq!(loop_energy([[1.0, 2.0], [2.0, 3.0]]), None);
        assert_eq!(loop_energy([]), None);
        // no way at all
        assert_eq!(loop_energy([[0.0, 1.0]]), None);
    }

    #[test]
    fn a_pendulum() {
        let rows: Vec<(f64, f64)> =
            (0..=40).map(|k| 0.1 * f64::from(k)).map(|t| (t, 4.0 * (2.5 * t).sin())).collect();
        // as atan2 would return it
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
