//! Finds cracks that end just before the surface or another crack, where bonds bridge them.

use super::DiscreteBody;
use crate::geometry::{Cut, length};
use std::collections::BTreeMap;

/// Width of a bridge beyond a crack front, in spacings.
const BRIDGE_WIDTH: f64 = 0.5;
/// Distance beyond a crack front up to which bonds are counted, in spacings.
const SEARCH_WIDTH: f64 = 1.5;
/// Length of the pieces of a crack front in which bonds are counted, in spacings.
const PIECE_LENGTH: f64 = 2.0;
/// Largest distance of two cracks that meet, in spacings.
const MEETING_DISTANCE: f64 = 2e-3;

/// Returns a warning for each bridged crack.
pub(super) fn bridges<const D: usize>(body: &DiscreteBody<D>) -> Vec<String> {
    let spacing = body.bonds.spacing();
    let each = body.cuts.iter().enumerate().filter_map(|(index, cut)| {
        if let Some((other, gap)) = missed(body, index) {
            return Some(format!(
                "body.cracks[{index}] misses body.cracks[{other}] by {:.4} mm: bonds pass between them; let \
                 them meet within \
                 {:.4} mm, or reach beyond each other",
                gap * 1e3,
                MEETING_DISTANCE * spacing * 1e3
            ));
        }
        let bonds = before_an_end(body, cut);
        (bonds > 0).then(|| {
            format!(
                "body.cracks[{index}] ends less than a spacing ({:.3} mm) before the surface or another \
                 crack: {bonds} bonds cross \
                 there and bridge it; let it reach beyond",
                spacing * 1e3
            )
        })
    });
    each.collect()
}

/// Counts bonds that pass the plane of a cut just beyond its front, at places where none pass farther out.
fn before_an_end<const D: usize>(body: &DiscreteBody<D>, cut: &Cut<D>) -> u64 {
    let (bonds, spacing) = (&*body.bonds, body.bonds.spacing());
    let sizes = cut.edges.map(length);
    // near and far, by the edge, its end and the piece along the rim
    let mut counts: BTreeMap<(usize, bool, i64), [u64; 2]> = BTreeMap::new();
    for &site in bonds.particles() {
        let here = bonds.position(site as usize);
        if !cut.is_within(here, bonds.horizon() + SEARCH_WIDTH * spacing) {
            continue;
        }
        bonds.neighbours(site as usize, &mut |bond| {
            let there = std::array::from_fn(|d| here[d] + bond.bond[d]);
            let passes = |found: &[f64; D]| 0.0 < found[0] && found[0] < 1.0;
            if bond.site < site as usize {
                return;
            }
            let Some(found) = cut.passage(here, there).filter(passes) else { return };
            for edge in 0..D - 1 {
                let (place, size) = (found[edge + 1], sizes[edge]);
                let upper = place > 0.5;
                let beyond = size * if upper { place - 1.0 } else { -place } / spacing;
                let along = (0..D - 1).find(|&other| other != edge);
                let beside = along.is_some_and(|other| !(0.0..=1.0).contains(&found[other + 1]));
                if beside || !(MEETING_DISTANCE..=SEARCH_WIDTH).contains(&beyond) {
                    continue;
                }
                let piece = along
                    .map_or(0, |other| (found[other + 1] * sizes[other] / (PIECE_LENGTH * spacing)) as i64);
                counts.entry((edge, upper, piece)).or_default()[usize::from(beyond > BRIDGE_WIDTH)] += 1;
            }
        });
    }
    counts.values().filter(|[_, far]| *far == 0).map(|[near, _]| near).sum()
}

/// Returns the crack that a front of crack `index` misses by less than half a spacing inside the body, and
/// the distance, m.
fn missed<const D: usize>(body: &DiscreteBody<D>, index: usize) -> Option<(usize, f64)> {
    let (bonds, spacing) = (&*body.bonds, body.bonds.spacing());
    let inside = |place: &[f64; D]| {
        let near = |&site: &u32| {
            let there = bonds.position(site as usize);
            (0..D).all(|d| (there[d] - place[d]).abs() <= 0.5 * spacing * (1.0 + 1e-9))
        };
        bonds.particles().iter().any(near)
    };
    let nearest = |place: &[f64; D]| {
        let others = body.cuts.iter().enumerate().filter(|&(other, _)| other != index);
        let each = others.map(|(other, cut)| (other, distance(cut, *place)));
        each.min_by(|a, b| a.1.0.total_cmp(&b.1.0))
    };
    rim(&body.cuts[index], 0.5 * spacing).iter().find_map(|place| {
        let (other, (apart, corner)) = nearest(place)?;
        let near = MEETING_DISTANCE * spacing < apart && apart < BRIDGE_WIDTH * spacing;
        // of rims of unequal length, one ends beside the other's corner
        (near && (D == 2 || !corner) && inside(place)).then_some((other, apart))
    })
}

/// Returns points along the fronts of a cut, at most `apart` from each other, m.
fn rim<const D: usize>(cut: &Cut<D>, apart: f64) -> Vec<[f64; D]> {
    if D == 2 {
        return cut.corners();
    }
    let mut places = Vec::new();
    for edge in 0..D - 1 {
        let count = (length(cut.edges[edge]) / apart).ceil().min(1e4) as usize + 1;
        for end in [0.0, 1.0] {
            for k in 0..=count {
                let part = k as f64 / count as f64;
                let across = cut.edges[(D - 2) - edge];
                places.push(std::array::from_fn(|d| {
                    cut.corner[d] + part * cut.edges[edge][d] + end * across[d]
                }));
            }
        }
    }
    places
}

/// Returns the distance of a point from a cut, m, and true if a corner (in 2D an end) is nearest.
fn distance<const D: usize>(cut: &Cut<D>, point: [f64; D]) -> (f64, bool) {
    let dot = |a: &[f64; D], b: &[f64; D]| (0..D).map(|d| a[d] * b[d]).sum::<f64>();
    let from: [f64; D] = std::array::from_fn(|d| point[d] - cut.corner[d]);
    let off = |parts: [f64; 2]| {
        let left = |d: usize| from[d] - (0..D - 1).map(|edge| parts[edge] * cut.edges[edge][d]).sum::<f64>();
        length(std::array::from_fn::<f64, D, _>(left))
    };
    let [e, f] = [cut.edges[0], cut.edges[D - 2]];
    let corner = |parts: [f64; 2]| parts.iter().take(D - 1).all(|&part| part == 0.0 || part == 1.0);
    if D == 2 {
        let parts = [(dot(&from, &e) / dot(&e, &e)).clamp(0.0, 1.0), 0.0];
        return (off(parts), corner(parts));
    }
    let (ee, ff, ef) = (dot(&e, &e), dot(&f, &f), dot(&e, &f));
    let (pe, pf, volume) = (dot(&from, &e), dot(&from, &f), ee * ff - ef * ef);
    let inner = [(pe * ff - pf * ef) / volume, (pf * ee - pe * ef) / volume];
    if inner.iter().all(|part| (0.0..=1.0).contains(part)) {
        return (off(inner), false);
    }
    let rims = [0.0, 1.0].into_iter().flat_map(|end| {
        [[end, ((pf - end * ef) / ff).clamp(0.0, 1.0)], [((pe - end * ef) / ee).clamp(0.0, 1.0), end]]
    });
    rims.map(|parts| (off(parts), corner(parts)))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .unwrap_or((f64::INFINITY, true))
}
