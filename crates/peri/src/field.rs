//! Vector fields stored component by component (structure of arrays), divided into fixed work items.

use std::ops::Range;

/// Sites per work item. Fixed by the data, never by the number of threads: sums taken item by item have the
/// same bits on any number of threads. A multiple of [`crate::bonds::TILE`].
pub const CHUNK: usize = 4096;

/// A vector field of dimension `D` on `sites` storage sites.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Field<const D: usize> {
    #[serde(with = "components")]
    components: [Vec<f64>; D],
}

impl<const D: usize> Field<D> {
    /// The zero field.
    pub fn zeros(sites: usize) -> Self {
        Self { components: std::array::from_fn(|_| vec![0.0; sites]) }
    }

    /// Number of sites.
    pub fn sites(&self) -> usize {
        self.components[0].len()
    }

    /// The components, each a slice over all sites.
    pub fn components(&self) -> [&[f64]; D] {
        std::array::from_fn(|d| self.components[d].as_slice())
    }

    /// Mutable components.
    pub fn components_mut(&mut self) -> [&mut [f64]; D] {
        self.components.each_mut().map(Vec::as_mut_slice)
    }

    /// Vector at a site.
    pub fn get(&self, site: usize) -> [f64; D] {
        std::array::from_fn(|d| self.components[d][site])
    }

    /// Replaces the vector at a site.
    pub fn set(&mut self, site: usize, value: [f64; D]) {
        for d in 0..D {
            self.components[d][site] = value[d];
        }
    }

    /// Splits the field into its work items, in order.
    pub fn chunks_mut(&mut self) -> Vec<[&mut [f64]; D]> {
        let mut iterators = self.components.each_mut().map(|c| c.chunks_mut(CHUNK));
        let count = iterators[0].len();
        (0..count).map(|_| iterators.each_mut().map(|i| i.next().unwrap_or_default())).collect()
    }

    /// Finds the first component (and site) that is not finite.
    pub fn non_finite(&self) -> Option<(usize, usize)> {
        (0..D).find_map(|d| self.components[d].iter().position(|x| !x.is_finite()).map(|site| (site, d)))
    }
}

/// Range of sites of work item `index` in a storage of `sites`.
pub fn chunk_range(index: usize, sites: usize) -> Range<usize> {
    index * CHUNK..((index + 1) * CHUNK).min(sites)
}

/// Serialises arrays of any length, which serde itself supports only up to 32 and not generically.
mod components {
    use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

    pub fn serialize<S: Serializer, const D: usize>(value: &[Vec<f64>; D], to: S) -> Result<S::Ok, S::Error> {
        value.as_slice().serialize(to)
    }

    pub fn deserialize<'de, De: Deserializer<'de>, const D: usize>(
        from: De,
    ) -> Result<[Vec<f64>; D], De::Error> {
        let components = Vec::<Vec<f64>>::deserialize(from)?;
        let found = components.len();
        if components.windows(2).any(|pair| pair[0].len() != pair[1].len()) {
            return Err(De::Error::custom("components of unequal length"));
        }
        components
            .try_into()
            .map_err(|_| De::Error::custom(format!("{found} components where {D} are needed")))
    }
}
