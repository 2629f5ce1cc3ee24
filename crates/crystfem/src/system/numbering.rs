//! Numbering of equations: they are appended when elements appear, and never renumbered.
//!
//! Nodes are sorted by number within groups of births. If births are layers of a mesh numbered by layers, a
//! group is a layer; otherwise it has an eighth of the equations before it. So lines of equal elements keep
//! consecutive equations, and with them equal rows. A node of a group that does not exist yet has an equation
//! out of use: an empty row that is not free.

use super::NONE;
use crate::problem::Problem;

/// Smallest number of equations of a group, unless node numbers separate it.
const MIN_GROUP: usize = 256;
/// Ratio of earlier equations to those of a group.
const GROUP_RATIO: usize = 8;

/// Order of all nodes that ever exist.
#[derive(Clone, Debug)]
pub struct Numbering {
    /// Node of each equation.
    pub nodes: Vec<u32>,
    /// Begin and end of the group of each birth; birth 0 is what exists from the start.
    groups: Vec<[u32; 2]>,
}

impl Numbering {
    /// Numbers the nodes of elements that are born, by `born`, or will be.
    pub fn new(problem: &Problem, born: &[u32]) -> Self {
        let mut birth_of = born.to_vec();
        for (birth, number) in problem.births.iter().zip(1..) {
            for &element in &birth.elements {
                let own = &mut birth_of[element as usize];
                *own = number.min(*own);
            }
        }
        let mut first = vec![NONE; problem.mesh.points.len()];
        for (element, &birth) in (0..).zip(&birth_of) {
            for &node in problem.mesh.nodes(element) {
                let own = &mut first[node as usize];
                *own = birth.min(*own);
            }
        }
        let last = birth_of.iter().filter(|&&birth| birth != NONE).max().map_or(0, |&birth| birth as usize);
        let births = last.max(problem.births.len()) + 1;
        // birth's number, and its lowest and highest new nodes
        let mut come = vec![(0, NONE, 0); births];
        for (node, &birth) in (0..).zip(&first).filter(|(_, birth)| **birth != NONE) {
            let (count, low, high) = &mut come[birth as usize];
            (*count, *low, *high) = (*count + 1, node.min(*low), node.max(*high));
        }
        // lowest new node of any later birth
        let mut later = vec![NONE; births];
        for birth in (1..births).rev() {
            later[birth - 1] = later[birth].min(come[birth].1);
        }
        let mut groups = Vec::with_capacity(births);
        let (mut start, mut end, mut top) = (0, 0, 0);
        for (birth, &(count, _, high)) in come.iter().enumerate() {
            (end, top) = (end + count, high.max(top));
            if birth == 0 || later[birth] > top || end - start >= MIN_GROUP.max(start / GROUP_RATIO) {
                groups.resize(birth + 1, [start as u32, end as u32]);
                start = end;
            }
        }
        groups.resize(births, [start as u32, end as u32]);
        let mut next: Vec<u32> = groups.iter().map(|group| group[0]).collect();
        let mut nodes = vec![0; end];
        // births of one group fill it together
        let mut leader: Vec<usize> = (0..births).collect();
        for birth in 1..births {
            if groups[birth] == groups[birth - 1] {
                leader[birth] = leader[birth - 1];
            }
        }
        for (node, &birth) in (0..).zip(&first).filter(|(_, birth)| **birth != NONE) {
            let next = &mut next[leader[birth as usize]];
            nodes[*next as usize] = node;
            *next += 1;
        }
        Self { nodes, groups }
    }

    /// Number of equations after `births` births, including those out of use.
    pub fn end(&self, births: usize) -> usize {
        self.groups[births.min(self.groups.len() - 1)][1] as usize
    }

    /// Equation of a node that appears with a birth.
    pub fn equation(&self, node: u32, birth: u32) -> Option<u32> {
        let [start, end] = *self.groups.get(birth as usize)?;
        let group = &self.nodes[start as usize..end as usize];
        group.binary_search(&node).ok().map(|at| start + at as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{Conductor, ThermalProperty};
    use crate::mesh::Grid;
    use crate::problem::Birth;
    use std::sync::Arc;

    /// Returns a block of 8 × 8 × 6 on which `births` are laid.
    fn problem(births: Vec<Vec<u32>>) -> (Problem, Vec<u32>) {
        let mesh = Grid::uniform([0.0; 3], [1.0; 3], [8, 8, 6]).unwrap().mesh("block").unwrap();
        let constant = |name| ThermalProperty::constant(name, 1.0).unwrap();
        let material = Arc::new(Conductor::new(1.0, constant("k"), constant("c")).unwrap());
        let mut born = vec![0; 384];
        births.iter().flatten().for_each(|&element| born[element as usize] = NONE);
        let births = births.into_iter().zip(1..);
        let births =
            births.map(|(elements, time)| Birth { time: f64::from(time), elements, temperature: 300.0 });
        (Problem { births: births.collect(), ..Problem::new(mesh, material, 300.0) }, born)
    }

    #[test]
    fn layers_keep_the_order_of_the_mesh() {
        let (problem, born) = problem((1..6).map(|layer| (64 * layer..64 * (layer + 1)).collect()).collect());
        let found = Numbering::new(&problem, &born);
        assert_eq!(found.nodes, (0..81 * 7).collect::<Vec<u32>>());
        assert_eq!(
            (0..6).map(|births| found.end(births)).collect::<Vec<_>>(),
            [162, 243, 324, 405, 486, 567]
        );
    }

    /// Element-by-element births against the mesh order: each node has one equation, before the end of its
    /// birth, and few are out of use.
    #[test]
    fn a_path_is_numbered_in_groups() {
        let (problem, born) = problem((64..384).rev().map(|element| vec![element]).collect());
        let found = Numbering::new(&problem, &born);
        let mut sorted = found.nodes.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..81 * 7).collect::<Vec<u32>>());
        let mut seen = std::collections::HashSet::new();
        (0..64).for_each(|element| seen.extend(problem.mesh.nodes(element)));
        assert_eq!(found.end(0), seen.len());
        for (birth, number) in problem.births.iter().zip(1..) {
            for node in problem.mesh.nodes(birth.elements[0]).iter().filter(|node| seen.insert(**node)) {
                let equation = found.equation(*node, number).unwrap();
                assert_eq!(found.nodes[equation as usize], *node);
                assert!((equation as usize) < found.end(number as usize));
            }
            assert!(found.end(number as usize) - seen.len() <= MIN_GROUP);
        }
    }
}
