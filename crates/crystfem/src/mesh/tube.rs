//! A sector of a tube.

use crate::error::Error;
use crate::mesh::{BOX_SIDES, Grid, Mesh};

/// A sector of a hollow cylinder around the z axis, from the plane y = 0 (x > 0) towards positive y, with its
/// lower end at z = 0. Faces are plane: a body of N elements around differs from the cylinder by (angle/N)².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tube {
    /// Inner and outer radius, m.
    pub radii: [f64; 2],
    /// Angle of the sector, rad: above 0, below 2π.
    pub angle: f64,
    /// Length along z, m.
    pub length: f64,
    /// Number of elements along the radius, around, and along z.
    pub elements: [usize; 3],
}

/// Surfaces and node sets, in the order of [`BOX_SIDES`] of the box of radius, angle and z.
const SIDES: [&str; 6] = ["bore", "shell", "start", "end", "bottom", "top"];

impl Tube {
    /// Meshes the sector with hexahedra: element set `tube`; surfaces and node sets `bore`, `shell`,
    /// `bottom`, `top`, and the cuts `start` (y = 0) and `end`.
    ///
    /// # Errors
    /// [`Error::Parameter`] for radii, an angle or a length without extent, elements of a quarter turn or
    /// more, no elements, and more than 2²⁸ nodes.
    pub fn mesh(&self) -> Result<Mesh, Error> {
        let wrong =
            |name, found, allowed: &str| Err(Error::Parameter { name, found, allowed: allowed.into() });
        let [inner, outer] = self.radii;
        if !(inner > 0.0 && inner.is_finite()) {
            return wrong("radius of the bore", inner, "above 0 m, finite");
        }
        if !(outer > inner && outer.is_finite()) {
            return wrong("outer radius", outer, "above that of the bore, finite");
        }
        if !(self.angle > 0.0 && self.angle < std::f64::consts::TAU) {
            return wrong("angle of the sector", self.angle, "above 0 rad, below 2π");
        }
        if !(self.length > 0.0 && self.length.is_finite()) {
            return wrong("length of the tube", self.length, "above 0 m, finite");
        }
        let around = self.angle / self.elements[1] as f64;
        if around >= std::f64::consts::FRAC_PI_2 && around.is_finite() {
            return wrong("angle of an element", around, "below π/2 rad: more elements around");
        }
        let grid = Grid::uniform([inner, 0.0, 0.0], [outer, self.angle, self.length], self.elements)?;
        let mut mesh = grid.mesh("tube")?;
        for point in &mut mesh.points {
            let [radius, angle, z] = *point;
            *point = [radius * angle.cos(), radius * angle.sin(), z];
        }
        for (side, name) in BOX_SIDES.into_iter().zip(SIDES) {
            if let Some(faces) = mesh.surfaces.remove(side) {
                mesh.surfaces.insert(name.into(), faces);
            }
            if let Some(nodes) = mesh.node_sets.remove(side) {
                mesh.node_sets.insert(name.into(), nodes);
            }
        }
        Ok(mesh)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::quality;
    use crate::mesh::surface::area;
    use std::f64::consts::{FRAC_PI_2, PI};

    /// Volume and areas of a polygon of chords φ: volume sin φ/φ, bore and shell 2 sin(φ/2)/φ, cuts exact.
    #[test]
    fn a_sector_has_its_volume_and_surfaces() {
        let tube = Tube { radii: [0.02, 0.1], angle: FRAC_PI_2, length: 0.14, elements: [8, 9, 7] };
        let mesh = tube.mesh().unwrap();
        let quality = quality::check(&mesh, None).unwrap();
        let chord: f64 = FRAC_PI_2 / 9.0;
        let volume = 0.25 * PI * (0.01 - 0.0004) * 0.14;
        assert!((quality.volume / (volume * chord.sin() / chord) - 1.0).abs() < 1e-12);
        let side = |name: &str| mesh.surfaces[name].iter().map(|face| area(&mesh, *face)).sum::<f64>();
        let flat = 2.0 * (0.5 * chord).sin() / chord;
        for (name, exact) in [
            ("bore", FRAC_PI_2 * 0.02 * 0.14 * flat),
            ("shell", FRAC_PI_2 * 0.1 * 0.14 * flat),
            ("start", 0.08 * 0.14),
            ("end", 0.08 * 0.14),
            ("top", 0.25 * PI * 0.0096 * chord.sin() / chord),
            ("bottom", 0.25 * PI * 0.0096 * chord.sin() / chord),
        ] {
            assert!((side(name) / exact - 1.0).abs() < 1e-12, "{name}: {} {exact}", side(name));
        }
        assert!(mesh.node_sets["start"].iter().all(|&node| mesh.points[node as usize][1] == 0.0));
        assert_eq!(mesh.surfaces.len(), 6);
    }

    #[test]
    fn invalid_tubes_are_refused() {
        let tube = Tube { radii: [0.02, 0.1], angle: 1.0, length: 0.14, elements: [2, 1, 2] };
        let refused = |tube: Tube, words: &str| {
            let text = tube.mesh().unwrap_err().to_string();
            assert!(text.contains(words), "{text}");
        };
        refused(Tube { radii: [0.0, 0.1], ..tube }, "radius of the bore: found 0");
        refused(Tube { radii: [0.1, 0.1], ..tube }, "outer radius: found 0.1");
        refused(Tube { angle: f64::NAN, ..tube }, "angle of the sector");
        refused(Tube { angle: 6.3, ..tube }, "angle of the sector: found 6.3");
        refused(Tube { angle: 2.0, ..tube }, "angle of an element: found 2");
        refused(Tube { length: 0.0, ..tube }, "length of the tube: found 0");
        refused(Tube { elements: [2, 0, 2], ..tube }, "elements along an axis: found 0");
    }
}
