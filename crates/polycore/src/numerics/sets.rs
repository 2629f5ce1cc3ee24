//! Disjoint sets (Tarjan 1975, doi:10.1145/321879.321884).

/// Disjoint sets of the numbers 0 … n − 1, each alone at first. The least number of a set represents it, in
/// any order of unions.
#[derive(Clone, Debug)]
pub struct DisjointSets(Vec<u32>);

impl DisjointSets {
    /// Creates `count` sets of one number each.
    pub fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    /// Representative of the set of a number: its least member.
    pub fn root(&mut self, of: u32) -> u32 {
        let (parent, mut at) = (&mut self.0, of);
        while parent[at as usize] != at {
            // halves the path for later searches
            parent[at as usize] = parent[parent[at as usize] as usize];
            at = parent[at as usize];
        }
        at
    }

    /// Joins the sets of two numbers; returns false if they were one.
    pub fn join(&mut self, a: u32, b: u32) -> bool {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
        a != b
    }

    /// Returns true if the number represents its set.
    pub fn is_root(&self, number: u32) -> bool {
        self.0[number as usize] == number
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers that differ by 6 or by 10 are of one parity.
    #[test]
    fn parities() {
        let mut sets = DisjointSets::new(100);
        let joined = (0..100).rev().flat_map(|k| [(k, k + 6), (k, k + 10)]).filter(|pair| pair.1 < 100);
        let joins = joined.filter(|&(a, b)| sets.join(b, a)).count();
        assert_eq!(joins, 98);
        assert!((0..100).all(|k| sets.root(k) == k % 2 && sets.is_root(k) == (k < 2)));
    }
}
