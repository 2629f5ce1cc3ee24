//! Values computed once for a matrix and reused.

/// A value with its key: the generation of the equations and the bits of the weight of Q.
#[derive(Clone, Debug, Default)]
pub struct Cached<T> {
    key: Option<(u64, u64)>,
    /// The value.
    pub value: T,
}

impl<T> Cached<T> {
    /// Returns true if the value was made for this key.
    pub fn matches(&self, key: (u64, u64)) -> bool {
        self.key == Some(key)
    }

    /// Returns true if the value was made for this build of the equations, whose number is the upper half of
    /// the generation.
    pub fn matches_build(&self, build: u64) -> bool {
        self.key.is_some_and(|(generation, _)| generation >> 32 == build)
    }

    /// Sets the key.
    pub fn set_key(&mut self, key: (u64, u64)) {
        self.key = Some(key);
    }

    /// Clears the key, but keeps the value's memory.
    pub fn forget(&mut self) {
        self.key = None;
    }
}
