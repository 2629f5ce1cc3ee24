//! Shells of a surface: closure and orientation.

use polycore::numerics::{DisjointSets, bounds};
use std::collections::{HashMap, HashSet};
use std::path::Path;

use super::crossing;
use crate::error::Error;
use nalgebra::Vector3;

/// Depth inside a shell's box, as a fraction of it, of the points that locate the shell: off the edges of
/// other shells.
const INSET: f64 = 1.37e-4;

/// Distance of corners to merge, over the largest extent.
const MERGE_DISTANCE: f64 = 1e-6;

/// Limit on passes of splitting.
const MAX_SPLITS: usize = 30;
const MAX_PAIRS: usize = 100_000_000;

/// A shell: triangles connected by edges.
pub(super) struct Shell {
    triangles: Vec<u32>,
    bounds: [[f64; 3]; 2],
    /// Six times the signed volume, m³.
    six: f64,
}

/// Merges points closer than [`MERGE_DISTANCE`]; returns the index of each after merging into the first of
/// them.
pub(super) fn weld(points: &[[f64; 3]]) -> Vec<u32> {
    let [low, high] = bounds(points.iter().copied());
    let size = (0..3).map(|d| high[d] - low[d]).fold(0.0, f64::max);
    let near = MERGE_DISTANCE * size;
    if !(near > 0.0 && near.is_finite()) {
        return (0..points.len() as u32).collect();
    }
    // cells twice as large: points near a point are in its own cell and its neighbour on the nearer side
    let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    let mut first = Vec::with_capacity(points.len());
    for (number, point) in (0_u32..).zip(points) {
        let at = [0, 1, 2].map(|d| (point[d] - low[d]) / (2.0 * near));
        let own = at.map(|x| x.floor() as i64);
        let side = [0, 1, 2].map(|d| if at[d] - own[d] as f64 > 0.5 { 1 } else { -1 });
        let mut known = None;
        for k in 0..8 {
            let cell = [0, 1, 2].map(|d| own[d] + if k >> d & 1 == 1 { side[d] } else { 0 });
            let close = |other: &&u32| {
                let other = points[**other as usize];
                (0..3).map(|d| (other[d] - point[d]).powi(2)).sum::<f64>() <= near * near
            };
            let found = cells.get(&cell).and_then(|all| all.iter().find(close)).copied();
            known = match (known, found) {
                (Some(a), Some(b)) => Some(std::cmp::min::<u32>(a, b)),
                (a, b) => a.or(b),
            };
        }
        if known.is_none() {
            cells.entry(own).or_default().push(number);
        }
        first.push(known.unwrap_or(number));
    }
    first
}

/// Returns the shells of a closed surface, whose edges have as many triangles in one direction as in the
/// other. Two bodies may share an edge, or a face. Duplicate triangles are removed if the surface is not
/// closed with them.
///
/// # Errors
/// [`Error::Mesh`] with the open edges.
pub(super) fn shells(
    path: &Path,
    points: &[[f64; 3]],
    triangles: &mut Vec<[u32; 3]>,
    notes: &mut Vec<String>,
) -> Result<Vec<Shell>, Error> {
    let mut edges = edges(triangles);
    if !is_closed(&edges) {
        let mut known = HashSet::new();
        let before = triangles.len();
        triangles.retain(|&[a, b, c]| {
            let least = a.min(b).min(c);
            let turned = [[a, b, c], [b, c, a], [c, a, b]].into_iter().find(|three| three[0] == least);
            known.insert(turned)
        });
        let doubled = before - triangles.len();
        if doubled > 0 {
            notes.push(format!("{doubled} duplicate triangles are left out"));
            edges = self::edges(triangles);
        }
    }
    if !is_closed(&edges) {
        let split = split(points, triangles, &mut edges);
        if split > 0 {
            notes.push(format!("{split} triangles are split where corners of others lie on their edges"));
        }
    }
    closed(path, points, &edges)?;
    let mut joined = DisjointSets::new(triangles.len());
    for (k, &[a, b, c]) in (0_u32..).zip(&*triangles) {
        for [p, q] in [[a, b], [b, c], [c, a]] {
            joined.join(k, edges.get(&[p.min(q), p.max(q)]).map_or(k, |edge| edge.1));
        }
    }
    let mut number: HashMap<u32, usize> = HashMap::new();
    let mut shells: Vec<Shell> = Vec::new();
    for k in 0..triangles.len() as u32 {
        let next = shells.len();
        let own = *number.entry(joined.root(k)).or_insert(next);
        if own == next {
            let bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
            shells.push(Shell { triangles: Vec::new(), bounds, six: 0.0 });
        }
        shells[own].triangles.push(k);
    }
    for shell in &mut shells {
        let all = shell.triangles.iter().map(|&k| triangles[k as usize]);
        shell.bounds = bounds(all.clone().flatten().map(|n| points[n as usize]));
        let at = |n: u32| Vector3::from(points[n as usize]) - Vector3::from(shell.bounds[0]);
        shell.six = all.map(|[a, b, c]| at(a).cross(&at(b)).dot(&at(c))).sum();
    }
    Ok(shells)
}

/// Edges, lower corner first: the number of passes in either direction, and the first triangle.
type Edges = HashMap<[u32; 2], ([u32; 2], u32)>;

fn edges(triangles: &[[u32; 3]]) -> Edges {
    let mut edges = Edges::new();
    for (k, &[a, b, c]) in (0..).zip(triangles) {
        for [p, q] in [[a, b], [b, c], [c, a]] {
            edges.entry([p.min(q), p.max(q)]).or_insert(([0; 2], k)).0[usize::from(p > q)] += 1;
        }
    }
    edges
}

fn is_closed(edges: &Edges) -> bool {
    edges.values().all(|(count, _)| count[0] == count[1])
}

/// Splits triangles at corners of others on their edges, where the surface is open; returns their number.
fn split(points: &[[f64; 3]], triangles: &mut Vec<[u32; 3]>, edges: &mut Edges) -> usize {
    let [low, high] = bounds(points.iter().copied());
    let near = MERGE_DISTANCE * (0..3).map(|d| high[d] - low[d]).fold(0.0, f64::max);
    let at = |n: u32| Vector3::from(points[n as usize]);
    let before = triangles.len();
    for _ in 0..MAX_SPLITS {
        let mut open: Vec<[u32; 2]> =
            edges.iter().filter(|(_, (count, _))| count[0] != count[1]).map(|(ends, _)| *ends).collect();
        open.sort_unstable();
        let mut corners = open.as_flattened().to_vec();
        corners.sort_unstable();
        corners.dedup();
        if open.len() * corners.len() > MAX_PAIRS {
            break;
        }
        let on = |&[p, q]: &[u32; 2]| {
            let along = at(q) - at(p);
            let inside = |r: &u32| {
                let arm = at(*r) - at(p);
                let part = arm.dot(&along) / along.norm_squared();
                let apart = (arm - along * part).norm();
                part > 0.0 && part < 1.0 && apart <= near && *r != p && *r != q
            };
            corners.iter().copied().find(inside).map(|r| ([p, q], r))
        };
        let found: HashMap<[u32; 2], u32> = open.iter().filter_map(on).collect();
        if found.is_empty() {
            break;
        }
        for k in 0..triangles.len() {
            let [a, b, c] = triangles[k];
            for [p, q, third] in [[a, b, c], [b, c, a], [c, a, b]] {
                if let Some(&r) = found.get(&[p.min(q), p.max(q)]).filter(|r| **r != third) {
                    triangles[k] = [p, r, third];
                    triangles.push([r, q, third]);
                    break;
                }
            }
        }
        *edges = self::edges(triangles);
    }
    triangles.len() - before
}

/// Checks that every edge is passed equally often in both directions.
fn closed(path: &Path, points: &[[f64; 3]], edges: &Edges) -> Result<(), Error> {
    let unequal = edges.iter().filter(|(_, (count, _))| count[0] != count[1]);
    let mut wrong: Vec<([u32; 2], [u32; 2])> = unequal.map(|(ends, (count, _))| (*ends, *count)).collect();
    wrong.sort_unstable();
    let Some((ends, _)) = wrong.first() else { return Ok(()) };
    let count = |is: &dyn Fn(u32, u32) -> bool| wrong.iter().filter(|(_, [a, b])| is(*a, *b)).count();
    let open = count(&|a, b| a + b == 1);
    let many = count(&|a, b| a + b > 2);
    let turned = count(&|a, b| a + b == 2);
    let [p, q] = ends.map(|node| points[node as usize].map(|x| (1e9 * x).round() / 1e6));
    Err(Error::Mesh(format!(
        "{}: not a closed surface: {open} edges of one triangle, {many} of more than two, {turned} of two \
         that face opposite ways, the first from {p:?} to {q:?} mm; allowed: 0 (repair it where it was \
         drawn)",
        path.display()
    )))
}

/// Orients the shells: flips all if their total volume is negative, then shells that are inverted and not
/// surrounded by another. An inward-facing shell inside another is a cavity. Returns the volume, m³.
pub(super) fn orient(
    points: &[[f64; 3]],
    triangles: &mut [[u32; 3]],
    mut shells: Vec<Shell>,
    notes: &mut Vec<String>,
) -> f64 {
    if shells.iter().map(|shell| shell.six).sum::<f64>() < 0.0 {
        notes.push("triangles are clockwise seen from outside: turned".to_owned());
        triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        shells.iter_mut().for_each(|shell| shell.six = -shell.six);
    }
    let around = |k: usize, at: [f64; 3]| -> i32 {
        let others = shells.iter().enumerate().filter(|(other, shell)| {
            let [low, high] = shell.bounds;
            *other != k && (0..3).all(|d| low[d] <= at[d] && at[d] <= high[d])
        });
        let own = others.flat_map(|(_, shell)| shell.triangles.iter().map(|&n| &triangles[n as usize]));
        own.filter_map(|triangle| crossing(triangle, points, [at[0], at[1]]))
            .filter(|(z, _)| *z > at[2])
            .map(|(_, way)| way)
            .sum()
    };
    let wrong: Vec<usize> = (0..shells.len())
        .filter(|&k| {
            let shell = &shells[k];
            let places = extremes(shell, points, triangles).map(|at| around(k, at));
            match shell.six < 0.0 {
                true => places.into_iter().min() < Some(1),
                false => places.into_iter().max() < Some(0),
            }
        })
        .filter(|_| shells.len() > 1)
        .collect();
    if !wrong.is_empty() {
        let [count, all] = [wrong.len(), shells.len()];
        notes.push(format!("{count} of {all} shells are inside out and no cavities: turned"));
    }
    for k in wrong {
        shells[k].triangles.iter().for_each(|&n| triangles[n as usize].swap(1, 2));
        shells[k].six *= -1.0;
    }
    if shells.len() > 1 {
        let cavities = shells.iter().filter(|shell| shell.six < 0.0).count();
        notes.push(format!("{} shells, {cavities} of them cavities", shells.len()));
    }
    shells.iter().map(|shell| shell.six).sum::<f64>() / 6.0
}

/// Extreme points of a shell along each axis, slightly inside its box.
fn extremes(shell: &Shell, points: &[[f64; 3]], triangles: &[[u32; 3]]) -> [[f64; 3]; 6] {
    let [low, high] = shell.bounds;
    let corners = || shell.triangles.iter().flat_map(|&n| triangles[n as usize]).map(|n| points[n as usize]);
    std::array::from_fn(|k| {
        let (d, end) = (k % 3, if k < 3 { low } else { high });
        let at = corners().find(|at| at[d] == end[d]).unwrap_or(low);
        std::array::from_fn(|e| {
            let middle = 0.5 * (low[e] + high[e]);
            at[e] + INSET * (1.0 + 0.3 * e as f64) * (middle - at[e])
        })
    })
}
