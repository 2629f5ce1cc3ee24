//! Parts of a body that do not touch, and bonds between them.

use super::{DiscreteBody, Scene};
use crate::bonds::components;
use crate::geometry::Operation;
use std::collections::{BTreeMap, HashSet};

/// Largest number of parts that `peri check` lists.
const LISTED: usize = 12;

/// Finds the bonds that cross a gap, as pairs of sites, the lower one first.
fn crossing<const D: usize>(body: &DiscreteBody<D>) -> HashSet<[usize; 2]> {
    let (bonds, mut found) = (&*body.bonds, HashSet::new());
    let reach = bonds.horizon() * (1.0 + 1e-9);
    for site in bonds.particles().iter().map(|&site| site as usize) {
        let here = bonds.position(site);
        let Some(near) = body.gaps.as_ref().and_then(|gaps| gaps.within(here, reach)) else { continue };
        bonds.neighbours(site, &mut |bond| {
            if site < bond.site && near.severs(here, bonds.position(bond.site)) {
                found.insert([site, bond.site]);
            }
        });
    }
    found
}

/// Warns of bonds between separate parts of a cloud without `bond_gaps`.
pub(super) fn bonded_parts<const D: usize>(scene: &Scene, body: &DiscreteBody<D>) -> Option<String> {
    // between shapes such bonds are kept only by `bond_gaps`
    if scene.body.bond_gaps.is_some() || !body.operations.is_empty() {
        return None;
    }
    let across = crossing(body).len();
    (across > 0).then(|| {
        format!(
            "the points form parts more than 1.5 edges of their cubes apart, joined by {across} bonds: \
             `body.bond_gaps = false` \
             separates them, `true` keeps the bonds"
        )
    })
}

/// Returns lines for `peri check`; none for a body without gaps.
pub(super) fn explain<const D: usize>(body: &DiscreteBody<D>) -> Vec<String> {
    if body.gaps.is_none() {
        return Vec::new();
    }
    let bonds = &*body.bonds;
    let crossing = crossing(body);
    let crosses = |site: usize, other: usize| crossing.contains(&[site.min(other), site.max(other)]);
    let roots = components(bonds, |site, other| !crosses(site, other));
    let mut parts: BTreeMap<u32, (usize, Vec<bool>)> = BTreeMap::new();
    let mut bridges: BTreeMap<[u32; 2], u64> = BTreeMap::new();
    for &site in bonds.particles() {
        let (here, root) = (bonds.position(site as usize), roots[site as usize]);
        let (particles, of) = parts.entry(root).or_insert((0, vec![false; body.operations.len()]));
        *particles += 1;
        for (of, operation) in of.iter_mut().zip(&body.operations) {
            *of |= matches!(operation, Operation::Add(shape) if shape.contains(here));
        }
        bonds.neighbours(site as usize, &mut |bond| {
            if (site as usize) < bond.site && crosses(site as usize, bond.site) {
                let other = roots[bond.site];
                *bridges.entry([root.min(other), root.max(other)]).or_default() += 1;
            }
        });
    }
    let numbers: BTreeMap<u32, usize> = parts.keys().zip(1..).map(|(&root, number)| (root, number)).collect();
    let mut lines = Vec::new();
    for (number, (particles, of)) in parts.values().enumerate().take(LISTED) {
        let shapes: Vec<String> =
            (0..of.len()).filter(|&index| of[index]).map(|index| format!("shapes[{index}]")).collect();
        let names = if shapes.is_empty() { String::new() } else { format!(" of {}", shapes.join(", ")) };
        lines.push(format!("  part {:<5} {particles} particles{names}", number + 1));
    }
    if parts.len() > LISTED {
        lines.push(format!("  parts      {} more", parts.len() - LISTED));
    }
    for (pair, count) in bridges.iter().take(LISTED) {
        let [a, b] = pair.map(|root| numbers[&root]);
        lines.push(match a == b {
            true => format!("  parts      {count} bonds cross cuts of part {a} narrower than the horizon"),
            false => format!("  parts      {a} and {b} are bonded across a gap by {count} bonds"),
        });
    }
    if bridges.is_empty() {
        let horizon = bonds.horizon() * 1e3;
        lines.push(match parts.len() {
            1 => {
                format!("  parts      no bond crosses the cuts narrower than the horizon of {horizon:.4} mm")
            }
            _ if !body.interfaces.is_empty() => "  parts      none is bonded to another".to_owned(),
            _ => "  parts      none is bonded to another (`body.bond_gaps = true` bonds them)".to_owned(),
        });
    }
    lines
}
