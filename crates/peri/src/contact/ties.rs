//! Ties of grips at their surface: bonds between held and free particles are removed, and faces follow
//! instead.
//!
//! A region of prescribed displacement that holds a body by its bonds is compliant: families that reach
//! across its surface see half of the strain on either side, as if the body were about one layer longer. A
//! face of the free side at X_f, pulled by the traction s(M/Δx)(u_f − U(X_f)), with U extrapolated linearly
//! from the two held particles behind it, has no such layer.

use super::faces::Faces;
use crate::bonds::{BodyGeometry, LatticeBonds, Overstretched};
use crate::field::Field;
use crate::surface::{BodySurface, SurfaceFace};

/// Lists bonds between held particles and others, each from both ends.
pub fn across<const D: usize>(bonds: &dyn BodyGeometry<D>, held: &[bool]) -> Vec<Overstretched> {
    let mut list = Vec::new();
    for &site in bonds.particles() {
        bonds.neighbours(site as usize, &mut |bond| {
            if held[site as usize] != held[bond.site] {
                let (index, length) = (bond.index, bond.length);
                let (weight, elongation) = (bond.weight, 0.0);
                list.push(Overstretched { site, index, elongation, length, weight });
            }
        });
    }
    list
}

/// Marks, by site, the particles of regions that are held in all components and at least as large as a
/// family: single held particles have no surface.
pub fn grips<const D: usize>(bonds: &LatticeBonds<D>, constrained: &[u8]) -> Vec<bool> {
    let all = (1_u8 << D) - 1;
    let is_held = |site: usize| constrained.get(site).is_some_and(|bits| *bits == all);
    let mut found = vec![false; bonds.sites()];
    let mut seen = vec![false; bonds.sites()];
    for &site in bonds.particles().iter().filter(|&&site| is_held(site as usize)) {
        if std::mem::replace(&mut seen[site as usize], true) {
            continue;
        }
        let (mut region, mut next) = (vec![site as usize], 0);
        while let Some(&own) = region.get(next) {
            bonds.neighbours(own, &mut |bond| {
                if is_held(bond.site) && !std::mem::replace(&mut seen[bond.site], true) {
                    region.push(bond.site);
                }
            });
            next += 1;
        }
        if region.len() > bonds.stencil().offsets.len() {
            region.into_iter().for_each(|site| found[site] = true);
        }
    }
    found
}

/// Faces of free particles tied to held ones.
#[derive(Clone)]
pub struct Ties<const D: usize> {
    /// Faces, with the held particles among their entries.
    faces: Faces<D>,
    /// Number of free entries of each face, which come first.
    free: Vec<usize>,
    volumes: Vec<f64>,
    /// sM/Δx, Pa/m.
    penalty: f64,
    /// Forces on faces, N, at the displacement of the last update.
    pushes: Vec<[f64; D]>,
    /// Value of [`Faces::greatest`].
    greatest: f64,
}

/// Sides of free particles beside held ones, with the held particles from which to extrapolate and their
/// factors.
pub struct GripInterface<const D: usize> {
    /// The sides, with normals towards the held particles.
    pub surface: BodySurface<D>,
    behind: Vec<Vec<(u32, f64)>>,
}

impl<const D: usize> GripInterface<D> {
    /// Finds the surface between held particles and others.
    pub fn new(bonds: &LatticeBonds<D>, held: &[bool]) -> Self {
        let (mut sides, mut behind) = (Vec::new(), Vec::new());
        let mut occupied = vec![false; bonds.sites()];
        bonds.particles().iter().for_each(|&site| occupied[site as usize] = true);
        for &site in bonds.particles().iter().filter(|&&site| !held[site as usize]) {
            for patch in 0..2 * D {
                let (axis, outward) = (patch / 2, [-1, 1][patch % 2]);
                let offset = std::array::from_fn(|d| if d == axis { outward } else { 0 });
                let beyond = |from: usize| {
                    let there = from.checked_add_signed(bonds.shift(offset))?;
                    (held.get(there) == Some(&true) && occupied[there]).then_some(there)
                };
                let Some(first) = beyond(site as usize) else { continue };
                let mut place = bonds.position(site as usize);
                place[axis] += 0.5 * f64::from(outward) * bonds.spacing();
                let normal = std::array::from_fn(|d| if d == axis { f64::from(outward) } else { 0.0 });
                sides.push(SurfaceFace { place, normal, patch: patch as u32 });
                behind.push(match beyond(first) {
                    Some(second) => vec![(first as u32, -1.5), (second as u32, 0.5)],
                    None => vec![(first as u32, -1.0)],
                });
            }
        }
        Self { surface: BodySurface::of_sides(sides), behind }
    }
}

impl<const D: usize> Ties<D> {
    /// Ties the sides of an interface to the particles behind, in a body with the outer surface `outside` and
    /// no bonds across the interface; the penalty is sM/Δx, Pa/m.
    pub fn new(
        bonds: &LatticeBonds<D>,
        interface: GripInterface<D>,
        outside: &BodySurface<D>,
        penalty: f64,
    ) -> Self {
        let GripInterface { surface, behind } = interface;
        let mut faces = Faces::new(bonds, &surface.bounded_by(outside), true);
        let greatest = faces.greatest(bonds);
        let free: Vec<usize> = (0..faces.len()).map(|face| faces.below(face).count()).collect();
        let sources = faces.sources.clone();
        faces.tie(|face| behind[sources[face] as usize].clone());
        let mut volumes = vec![0.0; bonds.sites()];
        bonds.particles().iter().for_each(|&site| volumes[site as usize] = bonds.volume(site as usize));
        Self { faces, free, volumes, penalty, pushes: Vec::new(), greatest }
    }

    /// Number of tied faces.
    pub fn len(&self) -> usize {
        self.faces.len()
    }

    fn stiffness(&self, face: usize) -> f64 {
        self.penalty * self.faces.areas[face]
    }

    /// Computes the forces at a displacement.
    pub fn update(&mut self, field: &Field<D>) {
        let push = |face: usize| {
            let stiffness = self.stiffness(face);
            self.faces.mean(face, field).map(|x| -stiffness * x)
        };
        self.pushes = (0..self.faces.len()).map(push).collect();
    }

    /// Adds the force densities of the last update on the sites from `start` on.
    pub fn force(&self, start: usize, force: &mut [&mut [f64]; D]) {
        self.faces.spread(&self.pushes, &self.volumes, start, force);
    }

    /// Energy, J.
    pub fn energy(&self, field: &Field<D>) -> f64 {
        let of = |face: usize| {
            let square: f64 = self.faces.mean(face, field).iter().map(|x| x * x).sum();
            0.5 * self.stiffness(face) * square
        };
        (0..self.faces.len()).map(of).sum()
    }

    /// Bound of the stiffness that the ties add over volumes, N/m⁴.
    pub fn greatest(&self) -> f64 {
        self.penalty * self.greatest
    }

    /// Visits the free particles of every face with their weights, and its stiffness, N/m.
    pub fn springs(&self, visit: &mut super::Spring<D>) {
        for face in 0..self.faces.len() {
            let free: Vec<(usize, f64)> = self.faces.below(face).take(self.free[face]).collect();
            visit(&free, &super::stiffness::all_axes(self.stiffness(face)));
        }
    }
}
