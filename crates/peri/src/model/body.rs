//! A body of shapes on a regular lattice, before it is built.

use crate::bonds::{LatticeBonds, VolumeCorrection};
use crate::calibrate::Space;
use crate::error::Error;
use crate::geometry::{Cut, Gaps, Operation, Shape, lattice};
use crate::surface::BodySurface;

/// Shapes filled with particles on a regular lattice; lengths in m.
#[derive(Clone, Debug)]
pub struct Body<const D: usize> {
    operations: Vec<Operation<D>>,
    cracks: Vec<Cut<D>>,
    spacing: f64,
    ratio: f64,
    correction: VolumeCorrection,
    bond_gaps: bool,
    pub(super) space: Space,
    pub(super) thickness: f64,
}

impl<const D: usize> Body<D> {
    /// Fills a shape with particles `spacing` apart and a horizon of 3.015 spacings: a solid in three
    /// dimensions, in two a sheet in plane stress, 1 m thick.
    pub fn lattice(shape: Shape<D>, spacing: f64) -> Self {
        Self {
            operations: vec![Operation::Add(shape)],
            cracks: Vec::new(),
            spacing,
            ratio: 3.015,
            correction: VolumeCorrection::None,
            bond_gaps: false,
            space: if D == 2 { Space::PlaneStress } else { Space::Solid },
            thickness: 1.0,
        }
    }

    /// Adds another shape.
    pub fn join(mut self, shape: Shape<D>) -> Self {
        self.operations.push(Operation::Add(shape));
        self
    }

    /// Cuts a shape out of everything added so far.
    pub fn cut(mut self, shape: Shape<D>) -> Self {
        self.operations.push(Operation::Cut(shape));
        self
    }

    /// Adds a crack of zero width: no bond crosses it.
    pub fn crack(mut self, crack: Cut<D>) -> Self {
        self.cracks.push(crack);
        self
    }

    /// Keeps the bonds across [`Gaps`]: between shapes that do not touch, and across cut-outs narrower than
    /// the horizon.
    pub fn bond_gaps(mut self) -> Self {
        self.bond_gaps = true;
        self
    }

    /// Sets the horizon δ, in spacings.
    pub fn horizon(mut self, ratio: f64) -> Self {
        self.ratio = ratio;
        self
    }

    /// Sets the volume correction of neighbours near the horizon; default: none.
    pub fn volume_correction(mut self, correction: VolumeCorrection) -> Self {
        self.correction = correction;
        self
    }

    /// Face points of the surface.
    pub fn surface(&self) -> BodySurface<D> {
        BodySurface::of_shapes(&self.operations, self.spacing)
    }

    /// Builds particles and bonds.
    ///
    /// # Errors
    /// [`Error::Geometry`] of [`lattice()`] and [`LatticeBonds::new`], and for a thickness that is not
    /// positive.
    pub fn build(&self) -> Result<LatticeBonds<D>, Error> {
        if !(self.thickness > 0.0 && self.thickness.is_finite()) {
            let found = self.thickness;
            return Err(Error::geometry(format!("thickness: found {found} m; allowed: above 0, finite")));
        }
        let lattice = lattice(&self.operations, self.spacing, self.thickness)?;
        let gaps = (!self.bond_gaps)
            .then(|| Gaps::of_shapes(&self.operations, &lattice, self.ratio * self.spacing))
            .flatten();
        LatticeBonds::with_gaps(lattice, self.ratio, self.correction, &self.cracks, gaps.as_ref())
    }
}

impl Body<2> {
    /// A thin sheet: plane stress, Poisson's ratio 1/3.
    pub fn plane_stress(mut self, thickness: f64) -> Self {
        (self.space, self.thickness) = (Space::PlaneStress, thickness);
        self
    }

    /// A thick slab: plane strain, Poisson's ratio 1/4.
    pub fn plane_strain(mut self, thickness: f64) -> Self {
        (self.space, self.thickness) = (Space::PlaneStrain, thickness);
        self
    }
}
