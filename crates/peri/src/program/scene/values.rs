//! Shared by several blocks: checks of single values, and the discretised body.

use super::mesh_region::MeshSets;
use crate::bonds::Bonds;
use crate::geometry::{Cut, Gaps, Operation};
use crate::surface::BodySurface;
use harness::scene::{SceneError, Source};
use polycore::units::Length;

/// Largest horizon ratio.
pub const LARGEST_RATIO: f64 = 20.0;

/// Advice for two keys that exclude each other.
pub(super) const ONE_OF_THEM: &str = "write one of them";

/// A discretised body.
pub struct DiscreteBody<const D: usize> {
    /// Bonds.
    pub bonds: Box<dyn Bonds<D>>,
    /// Lower and upper corner of the cells of all particles, m.
    pub bounds: ([f64; D], [f64; D]),
    /// Thickness (1 in 3D), m.
    pub thickness: f64,
    /// Number of bonds that each crack breaks.
    pub severed: Vec<u64>,
    /// Cracks.
    pub cuts: Vec<Cut<D>>,
    /// Gaps, with or without bonds across them.
    pub gaps: Option<Gaps<D>>,
    /// Added and cut shapes; empty for points and grids.
    pub operations: Vec<Operation<D>>,
    /// Bonds across each `[[interface]]`, by their sites.
    pub interfaces: Vec<Vec<[u32; 2]>>,
    /// Named sets of its mesh files.
    pub sets: MeshSets<D>,
}

impl<const D: usize> DiscreteBody<D> {
    /// Returns the face points of its surface: of its shapes, else of its lattice; none of a cloud.
    pub fn surface(&self) -> BodySurface<D> {
        match self.bonds.as_lattice() {
            _ if !self.operations.is_empty() => {
                BodySurface::of_shapes(&self.operations, self.bonds.spacing())
            }
            Some(lattice) => BodySurface::of_lattice(lattice),
            None => BodySurface::default(),
        }
    }
}

/// Formats a number as a user would write it.
pub fn plain(value: f64) -> String {
    if value == 0.0 || !value.is_finite() || (1e-3..1e5).contains(&value.abs()) {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

/// Refuses a value that is not positive and finite.
pub(super) fn positive(source: &Source, key: &str, value: f64, unit: &str) -> Result<(), SceneError> {
    if value > 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(source.error(key, format!("{value} {unit}").trim_end(), "above 0"))
    }
}

/// Refuses a horizon ratio out of range.
pub(super) fn ratio(source: &Source, key: &str, ratio: f64) -> Result<(), SceneError> {
    if (1.0..=LARGEST_RATIO).contains(&ratio) {
        Ok(())
    } else {
        Err(source.error(
            key,
            plain(ratio),
            format!("1 to {LARGEST_RATIO}: the horizon must reach a neighbour"),
        ))
    }
}

/// Converts lengths to a vector, m.
pub(super) fn vector<const D: usize>(
    source: &Source,
    key: &str,
    value: &[Length],
) -> Result<[f64; D], SceneError> {
    let values: Vec<f64> = value.iter().map(|l| l.si()).collect();
    <[f64; D]>::try_from(values.as_slice())
        .map_err(|_| source.error(key, format!("{} components", value.len()), format!("{D} components")))
}

/// Refuses a box whose lower corner is not below its upper one.
pub(super) fn check_order<const D: usize>(
    source: &Source,
    key: &str,
    min: [f64; D],
    max: [f64; D],
) -> Result<(), SceneError> {
    match (0..D).find(|&d| min[d] >= max[d]) {
        Some(d) => {
            let found = format!("{} m, not below `max` {} m in component {d}", min[d], max[d]);
            Err(source.error(&format!("{key}.min[{d}]"), found, "below `max`"))
        }
        None => Ok(()),
    }
}

/// Returns a value that must be written; `why` says what needs it.
pub(super) fn required<T: Copy>(
    source: &Source,
    key: &str,
    value: Option<T>,
    why: &str,
) -> Result<T, SceneError> {
    value.ok_or_else(|| source.missing(key, why))
}
