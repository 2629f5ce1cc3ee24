//! Chains of a drawing, joined to closed loops.

use super::Chain;
use polycore::numerics::segments_meet;

/// Largest distance of ends that are joined, over the size of the drawing.
const JOINED: f64 = 1e-6;

/// Joins chains to closed loops.
///
/// # Errors
/// A text with what was found and what is allowed: open chains, branches, loops that meet, no loop.
pub fn loops(chains: Vec<Chain>) -> Result<Vec<Vec<[f64; 2]>>, String> {
    let [low, high] = polycore::numerics::bounds(chains.iter().flat_map(|chain| &chain.points).copied());
    let near = JOINED * (high[0] - low[0]).max(high[1] - low[1]);
    let (closed, open): (Vec<Chain>, Vec<Chain>) = chains.into_iter().partition(|chain| chain.closed);
    let mut loops: Vec<Vec<[f64; 2]>> = closed.into_iter().map(|chain| chain.points).collect();
    let partners = partners(&open, near)?;
    let mut used = vec![false; open.len()];
    for first in 0..open.len() {
        let (mut points, mut end) = (Vec::new(), 2 * first + 1);
        while !used[end / 2] {
            used[end / 2] = true;
            let own = &open[end / 2].points;
            // up to the end that the next chain begins with
            if end % 2 == 1 {
                points.extend(&own[..own.len() - 1]);
            } else {
                points.extend(own[1..].iter().rev());
            }
            end = partners[end] ^ 1;
        }
        loops.extend((!points.is_empty()).then_some(points));
    }
    for points in &mut loops {
        points.dedup_by(|a, b| distance(*a, *b) <= near);
        while points.len() > 1 && distance(points[0], points[points.len() - 1]) <= near {
            points.pop();
        }
    }
    if loops.is_empty() {
        return Err("found no closed loop; allowed: lines and curves around an area".to_owned());
    }
    match meeting(&loops) {
        Some(at) => {
            Err(format!("found loops that meet at {}; allowed: loops apart from each other", shown(at)))
        }
        None => Ok(loops),
    }
}

/// Finds the end that each end of a chain meets: 2k is the start of chain k, 2k + 1 its end.
fn partners(open: &[Chain], near: f64) -> Result<Vec<usize>, String> {
    let end = |number: usize| {
        let points = &open[number / 2].points;
        points[if number.is_multiple_of(2) { 0 } else { points.len() - 1 }]
    };
    let mut order: Vec<usize> = (0..2 * open.len()).collect();
    order.sort_by(|&a, &b| end(a)[0].total_cmp(&end(b)[0]));
    let mut found: Vec<Vec<usize>> = vec![Vec::new(); order.len()];
    for (rank, &own) in order.iter().enumerate() {
        for &other in order[rank + 1..].iter().take_while(|&&other| end(other)[0] - end(own)[0] <= near) {
            if distance(end(own), end(other)) <= near {
                found[own].push(other);
                found[other].push(own);
            }
        }
    }
    let partner = |(number, found): (usize, &Vec<usize>)| match found[..] {
        [other] => Ok(other),
        [] => Err(format!(
            "found {}, open at {}; allowed: closed loops, whose ends meet",
            open[number / 2].name,
            shown(end(number))
        )),
        _ => Err(format!(
            "found {} ends that meet at {}, one of {}; allowed: two, and each entity once",
            found.len() + 1,
            shown(end(number)),
            open[number / 2].name
        )),
    };
    found.iter().enumerate().map(partner).collect()
}

/// Finds a point where two segments of loops meet other than at their common corner.
fn meeting(loops: &[Vec<[f64; 2]>]) -> Option<[f64; 2]> {
    let mut segments: Vec<(usize, usize, [[f64; 2]; 2])> = Vec::new();
    for (number, points) in loops.iter().enumerate() {
        let next = |k: usize| points[(k + 1) % points.len()];
        segments.extend((0..points.len()).map(|k| (number, k, [points[k], next(k)])));
    }
    let side = |[p, q]: [[f64; 2]; 2], d: usize| [p[d].min(q[d]), p[d].max(q[d])];
    segments.sort_by(|a, b| side(a.2, 0)[0].total_cmp(&side(b.2, 0)[0]));
    for (rank, &(own, k, one)) in segments.iter().enumerate() {
        let [_, right] = side(one, 0);
        let beside = segments[rank + 1..].iter().take_while(|segment| side(segment.2, 0)[0] <= right);
        for &(other, l, two) in beside {
            let count = loops[own].len();
            let joined = own == other && ((k + 1) % count == l || (l + 1) % count == k);
            if !joined && segments_meet(one, two) {
                return Some(one[0]);
            }
        }
    }
    None
}

/// Turns outer loops anticlockwise and holes clockwise; returns the area inside.
pub fn orient(loops: &mut [Vec<[f64; 2]>]) -> f64 {
    let inside = |at: [f64; 2], points: &[[f64; 2]]| {
        let edges = points.iter().zip(points.iter().cycle().skip(1));
        let above = |(p, q): &(&[f64; 2], &[f64; 2])| {
            let crossing = p[0] + (at[1] - p[1]) / (q[1] - p[1]) * (q[0] - p[0]);
            (p[1] > at[1]) != (q[1] > at[1]) && at[0] < crossing
        };
        edges.filter(above).count() % 2 == 1
    };
    let depth = |own: usize| {
        let others = loops.iter().enumerate().filter(|(other, _)| *other != own);
        others.filter(|(_, points)| loops[own].first().is_some_and(|&at| inside(at, points))).count()
    };
    let holes: Vec<bool> = (0..loops.len()).map(|own| depth(own) % 2 == 1).collect();
    let mut sum = 0.0;
    for (points, hole) in loops.iter_mut().zip(holes) {
        let area = area(points);
        if (area < 0.0) != hole {
            points.reverse();
        }
        sum += if hole { -area.abs() } else { area.abs() };
    }
    sum
}

/// Area of a loop, above 0 if it is anticlockwise.
fn area(points: &[[f64; 2]]) -> f64 {
    let Some(first) = points.first() else { return 0.0 };
    let from = |p: &[f64; 2]| [p[0] - first[0], p[1] - first[1]];
    let edges = points.iter().zip(points.iter().cycle().skip(1));
    edges.map(|(p, q)| (from(p), from(q))).map(|(p, q)| 0.5 * (p[0] * q[1] - p[1] * q[0])).sum()
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Formats a point in units of the drawing.
fn shown([x, y]: [f64; 2]) -> String {
    let digits = |x: f64| format!("{}", (x * 1e6).round() / 1e6);
    format!("({}, {})", digits(x), digits(y))
}
