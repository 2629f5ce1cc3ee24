//! Contact in compressed rows, as a graphics card takes it.

use super::Contact;
use super::list::difference;
use super::stiffness::mixed;
use super::surface::SurfaceShape;
use super::surfaces::RigidSurfaces;
use crate::bonds::BodyGeometry;
use crate::field::Field;
use std::ops::Range;

/// Contact with planes: elements, which are faces and then bare particles, and the particles below them.
pub struct PlaneRows<const D: usize> {
    /// Unit normal of each plane, towards the body.
    pub normals: Vec<[f64; D]>,
    /// Displacement of each plane along its normal, m, as it stands.
    pub shifts: Vec<f64>,
    /// 1 + max_{d≠e} |n_d n_e| of each normal.
    pub mixed: Vec<f64>,
    /// Ends of the entries of elements, after a 0; entries of site and weight.
    pub ends: Vec<u32>,
    /// Sites below elements, with weights.
    pub below: Vec<(u32, f64)>,
    /// Height of each element above each plane, both in the reference state, m, plane by plane.
    pub heights: Vec<f64>,
    /// Stiffness of each element, N/m, plane by plane; 0 where it does not touch.
    pub stiffness: Vec<f64>,
    /// Sites of particles below elements, ascending.
    pub sites: Vec<u32>,
    /// After a 0, two ends of each particle: of its entries of faces, of all.
    pub particle_ends: Vec<u32>,
    /// Elements above particles, with weights over volumes, m⁻³.
    pub above: Vec<(u32, f64)>,
    /// Largest gap of an element about to touch, m.
    pub near: f64,
}

/// Pairs of particles without a bond that are near each other, each from both ends.
pub struct PairRows<const D: usize> {
    /// Sites of particles with others near them, ascending.
    pub sites: Vec<u32>,
    /// Ends of their entries, after a 0.
    pub ends: Vec<u32>,
    /// True for particles without bonds.
    pub alone: Vec<bool>,
    /// Site of the other particle.
    pub others: Vec<u32>,
    /// ξ, m.
    pub bonds: Vec<[f64; D]>,
    /// Contact distance d, m.
    pub distances: Vec<f64>,
    /// k V of the other particle, N/m⁴.
    pub stiffness: Vec<f64>,
    /// Largest gap of particles about to touch, m.
    pub near: f64,
}

impl<const D: usize> PlaneRows<D> {
    /// Number of elements.
    pub fn elements(&self) -> usize {
        self.ends.len() - 1
    }
}

/// Numbers of those in an ascending list of sites that lie in ranges.
pub fn numbers_within(list: &[u32], ranges: &[Range<usize>]) -> Vec<u32> {
    let at = |end: usize| list.partition_point(|&site| (site as usize) < end) as u32;
    ranges.iter().flat_map(|range| at(range.start)..at(range.end)).collect()
}

impl<const D: usize> Contact<D> {
    /// First thing besides contact of particles and planes that move by themselves, without friction.
    pub fn beyond_rows(&self) -> Option<&'static str> {
        let any = |is: &dyn Fn(&super::RigidSurface<D>) -> bool| self.surfaces().any(is);
        [
            (self.ties.is_some(), "tied grips"),
            (self.has_friction(), "friction"),
            (any(&|surface| surface.bonded), "a bonded plane"),
            (any(&|surface| surface.force.is_some()), "a rigid surface with a force"),
            (any(&|surface| !matches!(surface.shape, SurfaceShape::Plane(_))), "an indenter"),
        ]
        .into_iter()
        .find_map(|(given, what)| given.then_some(what))
    }

    /// Rows of the present elements and planes; `None` without surfaces.
    pub fn plane_rows(&self) -> Option<PlaneRows<D>> {
        Some(self.surfaces.as_ref()?.rows(self.near))
    }

    /// Rows of the pairs that are listed; `None` if particles do not repel each other.
    pub fn pair_rows(&self, bonds: &dyn BodyGeometry<D>) -> Option<PairRows<D>> {
        let (mut sites, mut ends, mut alone, mut others) = (Vec::new(), vec![0], Vec::new(), Vec::new());
        let (mut along, mut distances, mut stiffness) = (Vec::new(), Vec::new(), Vec::new());
        for (own, candidates) in self.list.candidates().take_while(|_| self.has_pairs()) {
            let home = bonds.position(own as usize);
            for other in candidates {
                let bond = difference(home, bonds.position(other as usize));
                others.push(other);
                along.push(bond);
                distances.push(self.list.distance(own as usize, other as usize, bond));
                stiffness.push(self.pair(own, other) * bonds.volume(other as usize));
            }
            sites.push(own);
            alone.push(bonds.is_alone(own as usize));
            ends.push(others.len() as u32);
        }
        let rows =
            PairRows { sites, ends, alone, others, bonds: along, distances, stiffness, near: self.near };
        self.has_pairs().then_some(rows)
    }

    /// Makes the list of pairs hold for a displacement, and as long as possible.
    pub fn renew_pairs(&mut self, bonds: &dyn BodyGeometry<D>, displacement: &Field<D>) {
        if self.has_pairs() {
            self.list.renew(bonds, displacement);
        }
    }

    /// Distance by which every particle may move after [`Self::renew_pairs`] until pairs must be renewed, m.
    pub fn room_of_pairs(&self) -> f64 {
        if self.has_pairs() { self.list.room() } else { f64::INFINITY }
    }

    /// [`Self::greatest_stiffness`] from that of pairs, N/m⁴.
    pub fn stiffness_with_pairs(&self, pairs: f64) -> f64 {
        pairs + self.half_surface_stiffness()
    }

    /// Displacements of the surfaces along their normals, m, at a load factor and a time, s.
    pub fn plane_shifts_at(&self, factor: f64, time: f64) -> Vec<f64> {
        let shift = |surface: &super::RigidSurface<D>| along(&surface.shape, surface.place_at(factor, time));
        self.surfaces().map(shift).collect()
    }

    /// Forces of planes, N, from their sizes.
    pub fn plane_forces(&self, sizes: &[f64]) -> Vec<[f64; 3]> {
        let force = |(surface, size): (&super::RigidSurface<D>, &f64)| {
            let SurfaceShape::Plane(normal) = &surface.shape else { return [0.0; 3] };
            std::array::from_fn(|d| normal.get(d).map_or(0.0, |n| n * size))
        };
        self.surfaces().zip(sizes).map(force).collect()
    }
}

fn along<const D: usize>(shape: &SurfaceShape<D>, moved: [f64; D]) -> f64 {
    let SurfaceShape::Plane(normal) = shape else { return 0.0 };
    (0..D).map(|d| normal[d] * moved[d]).sum()
}

impl<const D: usize> RigidSurfaces<D> {
    fn rows(&self, near: f64) -> PlaneRows<D> {
        let (faces, count) = (self.faces.len(), self.elements());
        let (mut ends, mut below) = (vec![0], Vec::new());
        for element in 0..count {
            match element.checked_sub(faces) {
                None => below.extend(self.faces.below(element).map(|(site, w)| (site as u32, w))),
                Some(bare) => below.push((self.bare[bare], 1.0)),
            }
            ends.push(below.len() as u32);
        }
        let rest = Field::zeros(self.volumes.len());
        let (mut normals, mut shifts) = (Vec::new(), Vec::new());
        let (mut heights, mut stiffness) = (Vec::new(), Vec::new());
        for placed in &self.each {
            let SurfaceShape::Plane(normal) = placed.surface.shape else { continue };
            normals.push(normal);
            shifts.push(along(&placed.surface.shape, placed.now));
            for element in 0..count {
                let touch = self.beside(&placed.surface, &[0.0; D], &rest, element);
                heights.push(-touch.overlap);
                stiffness.push(if self.is_live(element) { touch.stiffness } else { 0.0 });
            }
        }
        let mut sites = [&self.faces.particles[..], &self.bare[..]].concat();
        sites.sort_unstable();
        sites.dedup();
        let (mut particle_ends, mut above) = (vec![0], Vec::new());
        for site in &sites {
            let volume = self.volumes[*site as usize];
            if let Ok(particle) = self.faces.particles.binary_search(site) {
                above.extend(self.faces.above(particle).iter().map(|&(face, w)| (face, w / volume)));
            }
            particle_ends.push(above.len() as u32);
            if let Ok(bare) = self.bare.binary_search(site) {
                above.push(((faces + bare) as u32, 1.0 / volume));
            }
            particle_ends.push(above.len() as u32);
        }
        let mixed = normals.iter().map(|&normal| 1.0 + mixed(normal)).collect();
        PlaneRows {
            normals,
            shifts,
            mixed,
            ends,
            below,
            heights,
            stiffness,
            sites,
            particle_ends,
            above,
            near,
        }
    }
}
