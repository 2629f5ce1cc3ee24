//! What readers of several blocks share: checks of single values, and the body that they refer to.

use crate::bonds::Bonds;
use crate::geometry::{Cut, Gaps, Operation};
use crate::surface::BodySurface;
use harness::scene::{SceneError, Source};
use polycore::units::Length;

/// Largest horizon ratio: a stencil beyond it has more bonds than any use.
pub const LARGEST_RATIO: f64 = 20.0;

/// A discretised body.
pub struct Body<const D: usize> {
    /// Its bonds.
    pub bonds: Box<dyn Bonds<D>>,
    /// Lower and upper corner of its particles' cells, m.
    pub bounds: ([f64; D], [f64; D]),
    /// Thickness (1 in 3D), m.
    pub thickness: f64,
    /// How many bonds each crack severs.
    pub severed: Vec<u64>,
    /// Its cracks.
    pub cuts: Vec<Cut<D>>,
    /// Its gaps, whether bonds cross them or not.
    pub gaps: Option<Gaps<D>>,
    /// The shapes added and cut; empty for points and grids.
    pub operations: Vec<Operation<D>>,
}

impl<const D: usize> Body<D> {
    /// Face points of its surface: of its shapes, else of its lattice; none of a cloud.
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

/// A number as a user would write it.
pub fn plain(value: f64) -> String {
    if value == 0.0 || !value.is_finite() || (1e-3..1e5).contains(&value.abs()) {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

pub(super) fn positive(source: &Source, key: &str, value: f64, unit: &str) -> Result<(), SceneError> {
    if value > 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(source.error(key, format!("{value} {unit}").trim_end(), "above 0"))
    }
}

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

pub(super) fn vector<const D: usize>(
    source: &Source,
    key: &str,
    value: &[Length],
) -> Result<[f64; D], SceneError> {
    let values: Vec<f64> = value.iter().map(|l| l.si()).collect();
    <[f64; D]>::try_from(values.as_slice())
        .map_err(|_| source.error(key, format!("{} components", value.len()), format!("{D} components")))
}

/// The corners of a box must span one.
pub(super) fn ordered<const D: usize>(
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

pub(super) fn needed<T: Copy>(
    source: &Source,
    key: &str,
    value: Option<T>,
    what: &str,
) -> Result<T, SceneError> {
    value.ok_or_else(|| source.error(key, "nothing", what))
}
