//! Paths of two quantities: swings over time, crossings of positions, the envelope of equilibria that snap
//! back.

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
