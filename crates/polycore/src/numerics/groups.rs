//! Counting sort (Knuth, The Art of Computer Programming 3, 5.2).

/// Items in numbered groups; each group keeps the order of input. Fewer than 2³² items in all.
#[derive(Clone, Debug, PartialEq)]
pub struct Groups<T> {
    starts: Vec<u32>,
    items: Vec<T>,
}

impl<T: Copy> Groups<T> {
    /// Sorts pairs of a group below `count` and an item.
    pub fn new(count: usize, pairs: impl Iterator<Item = (usize, T)> + Clone) -> Self {
        let mut starts = vec![0; count + 1];
        pairs.clone().for_each(|(group, _)| starts[group + 1] += 1);
        (0..count).for_each(|group| starts[group + 1] += starts[group]);
        let mut next = starts.clone();
        let mut items: Vec<T> =
            pairs.clone().next().map_or(Vec::new(), |(_, any)| vec![any; starts[count] as usize]);
        for (group, item) in pairs {
            items[next[group] as usize] = item;
            next[group] += 1;
        }
        Self { starts, items }
    }

    /// Number of groups.
    pub fn count(&self) -> usize {
        self.starts.len() - 1
    }

    /// All items, group by group.
    pub fn items(&self) -> &[T] {
        &self.items
    }

    /// Items of a group.
    pub fn group(&self, group: usize) -> &[T] {
        self.groups(group, group)
    }

    /// Items of consecutive groups, from the first to the last.
    pub fn groups(&self, first: usize, last: usize) -> &[T] {
        &self.items[self.starts[first] as usize..self.starts[last + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers by their remainder.
    #[test]
    fn remainders() {
        let groups = Groups::new(4, (0..10).map(|k| (k % 3, k)));
        assert_eq!((groups.group(0), groups.group(2)), (&[0, 3, 6, 9][..], &[2, 5, 8][..]));
        assert_eq!((groups.group(3).len(), groups.groups(1, 3).len(), groups.count()), (0, 6, 4));
        assert!(Groups::<u32>::new(0, std::iter::empty()).items().is_empty());
    }
}
