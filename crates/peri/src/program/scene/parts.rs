//! Parts of a body that do not touch, and bonds between them.

use super::{DiscreteBody, Scene};
use crate::bonds::components;
use crate::geometry::{NearbyGaps, Operation};
use std::collections::BTreeMap;

/// Largest number of parts that `peri check` lists.
const LISTED: usize = 12;

/// Particles whose bonds may meet a gap, by site.
struct GapSites(Vec<bool>);

impl GapSites {
    fn new<const D: usize>(body: &DiscreteBody<D>) -> Self {
        let mut near = vec![false; body.bonds.sites()];
        for &site in body.bonds.particles() {
            near[site as usize] = within(body, site as usize).is_some();
        }
        Self(near)
    }

    /// Returns true if the bond of two sites crosses a gap.
    fn crosses<const D: usize>(&self, body: &DiscreteBody<D>, site: usize, other: usize) -> bool {
        let place = |site: usize| body.bonds.position(site);
        self.0[site] && within(body, site).is_some_and(|near| near.severs(place(site), place(other)))
    }
}

/// Selects the gaps within a horizon of a site.
fn within<const D: usize>(body: &DiscreteBody<D>, site: usize) -> Option<NearbyGaps<'_, D>> {
    let reach = body.bonds.horizon() * (1.0 + 1e-9);
    body.gaps.as_ref().and_then(|gaps| gaps.within(body.bonds.position(site), reach))
}

/// Warns of bonds between separate parts of a cloud without `bond_gaps`.
pub(super) fn bonded_parts<const D: usize>(scene: &Scene, body: &DiscreteBody<D>) -> Option<String> {
    if body.gaps.is_none() || scene.body.bond_gaps.is_some() {
        return None;
    }
    let bonds = &*body.bonds;
    let near = GapSites::new(body);
    let mut across = 0_u64;
    for &site in bonds.particles() {
        bonds.neighbours(site as usize, &mut |bond| {
            across += u64::from((site as usize) < bond.site && near.crosses(body, site as usize, bond.site));
        });
    }
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
    let near = GapSites::new(body);
    let roots = components(bonds, |site, other| !near.crosses(body, site, other));
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
            if (site as usize) < bond.site && near.crosses(body, site as usize, bond.site) {
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
