//! Contact of faces and particles with rigid planes.

use super::faces::Faces;
use super::friction_pair::{ContactPair, FrictionPair};
use super::plane::{PlaneReaction, RigidPlane};
use crate::bonds::{BodyGeometry, Bonds, Property};
use crate::error::Error;
use crate::field::Field;
use crate::geometry::length;
use crate::surface::BodySurface;
use rayon::prelude::*;

/// Distance of a face from a plane up to which it is tied to it, in spacings.
const TIED: f64 = 0.5;
/// Faces of a work item.
const BATCH: usize = 1024;

/// A plane in motion.
pub(super) struct MovingPlane<const D: usize> {
    pub(super) plane: RigidPlane<D>,
    /// Displacement of the plane now and at the last placement, m.
    pub(super) now: [f64; D],
    pub(super) before: [f64; D],
    /// Faces tied to the plane.
    tied: Vec<u32>,
}

/// A face, or a particle exposed to planes, beside a plane.
#[derive(Clone, Copy)]
pub(super) struct PlaneContact<const D: usize> {
    /// Number of a face, or number of faces plus the number of a bare particle.
    pub(super) element: usize,
    /// Position, m; of a particle, on its surface.
    place: [f64; D],
    /// Depth behind the plane, m.
    pub(super) overlap: f64,
    /// Displacement relative to the plane, m, if tied.
    offset: Option<[f64; D]>,
    /// Area, m², and normal stiffness, N/m.
    area: f64,
    pub(super) stiffness: f64,
}

impl<const D: usize> PlaneContact<D> {
    /// Energy, J.
    fn energy(&self) -> f64 {
        let square = self.offset.map_or(self.overlap * self.overlap, |x| x.iter().map(|x| x * x).sum());
        0.5 * self.stiffness * square
    }

    /// Force on the body, N.
    fn force(&self, normal: &[f64; D]) -> [f64; D] {
        match self.offset {
            Some(offset) => offset.map(|x| -self.stiffness * x),
            None => normal.map(|n| self.stiffness * self.overlap * n),
        }
    }
}

/// All planes of a scene with the elements they act on: faces of the body, and particles that have lost
/// bonds.
pub struct Planes<const D: usize> {
    pub(super) each: Vec<MovingPlane<D>>,
    pub(super) faces: Faces<D>,
    /// True for faces whose particles have all their bonds.
    sound: Vec<bool>,
    /// Sites of bare particles, which touch planes themselves, ascending, and their reference positions, m.
    pub(super) bare: Vec<u32>,
    homes: Vec<[f64; D]>,
    /// Bonds of each site in the reference state.
    bonded: Vec<u32>,
    /// Radius, m, and volume of the particle of each site.
    radii: Vec<f64>,
    volumes: Vec<f64>,
    /// M/Δx, Pa/m.
    penalty: Property,
    spacing: f64,
    /// Forces of all planes on faces and on bare particles, N, at the displacement of the last update; empty
    /// without contact.
    pushes: Vec<[f64; D]>,
    /// Friction forces in explicit dynamics, likewise.
    pub(super) drags: Vec<[f64; D]>,
    /// Bound of the eigenvalues that faces in contact add to the stiffness over volumes for a penalty of 1
    /// Pa/m.
    greatest: f64,
}

impl<const D: usize> Planes<D> {
    /// Places planes at rest beside a body; `modulus` is M, Pa, and `radius` that of a particle, m.
    ///
    /// # Errors
    /// [`Error::Parameter`] as for [`RigidPlane`]; [`Error::Geometry`] for a bonded plane that touches no
    /// face.
    pub fn new(
        bonds: &dyn Bonds<D>,
        surface: &BodySurface<D>,
        modulus: &Property,
        planes: Vec<RigidPlane<D>>,
        radius: impl Fn(usize) -> f64,
    ) -> Result<Self, Error> {
        let faces = Faces::new(bonds, surface, false);
        let (mut radii, mut volumes) = (vec![0.0; bonds.sites()], vec![0.0; bonds.sites()]);
        let mut bonded = vec![0; bonds.sites()];
        for site in bonds.particles().iter().map(|&site| site as usize) {
            (radii[site], volumes[site], bonded[site]) =
                (radius(site), bonds.volume(site), bonds.bonded(site));
        }
        let spacing = bonds.spacing();
        let of_particle =
            bonds.particles().iter().map(|&site| 0.5 / radii[site as usize]).fold(0.0, f64::max);
        let mut each = Vec::new();
        for (number, plane) in planes.into_iter().enumerate() {
            let plane = plane.checked()?;
            let near = |&face: &u32| plane.height(faces.places[face as usize]).abs() < TIED * spacing;
            let tied: Vec<u32> = (0..faces.len() as u32).filter(|face| plane.bonded && near(face)).collect();
            if plane.bonded && tied.is_empty() {
                return Err(Error::geometry(format!(
                    "bonded plane {}: found no face of the body within half a spacing; allowed: a plane that \
                    touches the body",
                    number + 1
                )));
            }
            each.push(MovingPlane { plane, now: [0.0; D], before: [0.0; D], tied });
        }
        let mut planes = Self {
            each,
            sound: vec![true; faces.len()],
            bare: Vec::new(),
            homes: Vec::new(),
            bonded,
            radii,
            volumes,
            penalty: Property::new(bonds, |site, _| modulus.value_at(site) / spacing),
            spacing,
            pushes: Vec::new(),
            drags: Vec::new(),
            greatest: faces.greatest(bonds).max(of_particle),
            faces,
        };
        if planes.faces.len() == 0 {
            planes.bare = bonds.particles().to_vec();
            planes.homes = planes.bare.iter().map(|&site| bonds.position(site as usize)).collect();
        }
        Ok(planes)
    }

    /// The planes.
    pub fn planes(&self) -> impl Iterator<Item = &RigidPlane<D>> {
        self.each.iter().map(|placed| &placed.plane)
    }

    /// Moves planes to their positions at a load factor and a time, s.
    pub fn move_to(&mut self, factor: f64, time: f64) {
        for placed in &mut self.each {
            let RigidPlane { displacement, velocity, .. } = placed.plane;
            placed.before = placed.now;
            placed.now = std::array::from_fn(|d| factor * displacement[d] + time * velocity[d]);
        }
    }

    /// Last move of every plane, m.
    pub fn moved(&self) -> impl Iterator<Item = [f64; D]> {
        self.each.iter().map(|placed| std::array::from_fn(|d| placed.now[d] - placed.before[d]))
    }

    /// Exposes the particles among `sites` that have lost bonds: they touch planes themselves, and faces
    /// above them no longer do.
    pub fn expose(&mut self, bonds: &dyn BodyGeometry<D>, sites: impl Iterator<Item = usize>) {
        let before = self.bare.len();
        for site in sites.filter(|&site| bonds.bonded(site) < self.bonded[site]) {
            self.bare.push(site as u32);
            let Ok(particle) = self.faces.particles.binary_search(&(site as u32)) else { continue };
            for &(face, _) in self.faces.above(particle) {
                if std::mem::replace(&mut self.sound[face as usize], false) {
                    self.bare.push(self.faces.head(face as usize) as u32);
                }
            }
        }
        if self.bare.len() > before {
            self.bare.sort_unstable();
            self.bare.dedup();
            self.homes = self.bare.iter().map(|&site| bonds.position(site as usize)).collect();
        }
    }

    /// Number of faces and bare particles.
    pub(super) fn elements(&self) -> usize {
        self.faces.len() + self.bare.len()
    }

    /// Site of the particle that represents an element.
    fn head(&self, element: usize) -> usize {
        match element.checked_sub(self.faces.len()) {
            None => self.faces.head(element),
            Some(bare) => self.bare[bare] as usize,
        }
    }

    /// Displacement of an element, m.
    pub(super) fn displacement(&self, field: &Field<D>, element: usize) -> [f64; D] {
        match element.checked_sub(self.faces.len()) {
            None => self.faces.mean(element, field),
            Some(bare) => field.get(self.bare[bare] as usize),
        }
    }

    /// Computes the state of an element beside a plane, whatever its overlap.
    pub(super) fn beside(
        &self,
        placed: &MovingPlane<D>,
        field: &Field<D>,
        element: usize,
    ) -> PlaneContact<D> {
        let RigidPlane { normal, stiffness, .. } = placed.plane;
        let moved = self.displacement(field, element);
        let (home, radius, area) = match element.checked_sub(self.faces.len()) {
            None => {
                let (radius, normal) = (self.faces.radii[element], self.faces.normals[element]);
                let below = std::array::from_fn(|d| self.faces.places[element][d] - radius * normal[d]);
                (below, radius, self.faces.areas[element])
            }
            Some(bare) => {
                let site = self.bare[bare] as usize;
                (self.homes[bare], self.radii[site], 0.5 * self.volumes[site] / self.radii[site])
            }
        };
        let place: [f64; D] = std::array::from_fn(|d| home[d] + moved[d] - radius * normal[d]);
        let shift: f64 = (0..D).map(|d| placed.now[d] * normal[d]).sum();
        let stiffness = stiffness * self.penalty.value_at(self.head(element)) * area;
        PlaneContact {
            element,
            place,
            overlap: shift - placed.plane.height(place),
            offset: None,
            area,
            stiffness,
        }
    }

    /// Elements that a plane acts on, in order: its tied faces, or those behind it.
    fn touches(&self, placed: &MovingPlane<D>, field: &Field<D>) -> Vec<PlaneContact<D>> {
        if placed.plane.bonded {
            let tied = |&face: &u32| {
                let mut element = face as usize;
                if !self.sound[element] {
                    let head = self.faces.head(element) as u32;
                    element = self.faces.len() + self.bare.binary_search(&head).ok()?;
                }
                let mut touch = self.beside(placed, field, element);
                let moved = self.displacement(field, element);
                touch.offset = Some(std::array::from_fn(|d| moved[d] - placed.now[d]));
                Some(touch)
            };
            return placed.tied.iter().filter_map(tied).collect();
        }
        self.near(placed, field, 0.0)
    }

    /// Elements nearer to a plane than `gap`, m, in order.
    pub(super) fn near(&self, placed: &MovingPlane<D>, field: &Field<D>, gap: f64) -> Vec<PlaneContact<D>> {
        let count = self.elements();
        let batch = |start: usize| {
            let range = start * BATCH..((start + 1) * BATCH).min(count);
            let live = range.filter(|&element| self.sound.get(element).copied().unwrap_or(true));
            live.map(|element| self.beside(placed, field, element))
                .filter(|touch| touch.overlap > -gap)
                .collect::<Vec<_>>()
        };
        (0..count.div_ceil(BATCH)).into_par_iter().map(batch).collect::<Vec<_>>().concat()
    }

    /// Computes the forces of all planes at a displacement, with friction for the motion since `start`.
    pub fn update(&mut self, field: &Field<D>, held: &[FrictionPair], start: Option<&Field<D>>) {
        let mut pushes = std::mem::take(&mut self.pushes);
        pushes.clear();
        let mut add = |planes: &Self, element: usize, force: [f64; D]| {
            if pushes.is_empty() {
                pushes.resize(planes.elements(), [0.0; D]);
            }
            (0..D).for_each(|d| pushes[element][d] += force[d]);
        };
        for placed in &self.each {
            for touch in self.touches(placed, field) {
                add(self, touch.element, touch.force(&placed.plane.normal));
            }
        }
        if let Some(start) = start {
            for grip in held {
                let Some((_, element)) = self.element(grip.pair) else { continue };
                let force = grip.drag(self.slipped(grip.pair, field, start)).force;
                add(self, element, std::array::from_fn(|d| force[d]));
            }
        }
        self.pushes = pushes;
    }

    /// Plane and element of a pair; `None` for two particles.
    pub(super) fn element(&self, pair: ContactPair) -> Option<(usize, usize)> {
        match pair {
            ContactPair::Particles(..) => None,
            ContactPair::Face(plane, face) => Some((plane as usize, face as usize)),
            ContactPair::Particle(plane, site) => {
                Some((plane as usize, self.faces.len() + self.bare.binary_search(&site).ok()?))
            }
        }
    }

    /// Adds the force densities of the last update on the sites from `start` on.
    pub fn force(&self, start: usize, force: &mut [&mut [f64]; D]) {
        if self.pushes.is_empty() {
            return;
        }
        self.spread(&self.pushes, start, force);
    }

    /// Adds forces on elements, N, to force densities, N/m³, on the sites from `start` on.
    pub(super) fn spread(&self, pushes: &[[f64; D]], start: usize, force: &mut [&mut [f64]; D]) {
        let (faces, bare) = pushes.split_at(self.faces.len());
        self.faces.spread(faces, &self.volumes, start, force);
        let at = |end: usize| self.bare.partition_point(|&site| (site as usize) < end);
        for particle in at(start)..at(start + force[0].len()) {
            let site = self.bare[particle] as usize;
            if bare[particle] != [0.0; D] {
                (0..D).for_each(|d| force[d][site - start] += bare[particle][d] / self.volumes[site]);
            }
        }
    }

    /// Sum of the squares of the force densities of the last update, (N/m³)².
    pub fn square(&self) -> f64 {
        if self.pushes.is_empty() {
            return 0.0;
        }
        let (faces, bare) = self.pushes.split_at(self.faces.len());
        let of_particle = |particle: usize| {
            let sum = self.faces.sum(particle, faces);
            sum.map(|f| (f / self.volumes[self.faces.particles[particle] as usize]).powi(2))
                .iter()
                .sum::<f64>()
        };
        let of_bare = |(push, &site): (&[f64; D], &u32)| {
            push.iter().map(|f| (f / self.volumes[site as usize]).powi(2)).sum::<f64>()
        };
        (0..self.faces.particles.len()).map(of_particle).sum::<f64>()
            + bare.iter().zip(&self.bare).map(of_bare).sum::<f64>()
    }

    /// Number of faces in contact, deepest overlap over half a spacing, and energy, J.
    pub fn summary(&self, field: &Field<D>) -> (u64, f64, f64) {
        let mut all = (0, 0.0_f64, 0.0);
        for touch in self.each.iter().flat_map(|placed| self.touches(placed, field)) {
            all.0 += 1;
            all.1 = all.1.max(if touch.offset.is_some() { 0.0 } else { 2.0 * touch.overlap / self.spacing });
            all.2 += touch.energy();
        }
        all
    }

    /// Force, area and width of the contact with each plane, without friction.
    pub fn reactions(&self, field: &Field<D>) -> Vec<PlaneReaction> {
        let of = |placed: &MovingPlane<D>| {
            let normal = placed.plane.normal;
            let mut resting = PlaneReaction { gap: f64::INFINITY, ..PlaneReaction::default() };
            let (mut push, mut first, mut second) = (0.0, [0.0; D], [0.0; D]);
            let (mut low, mut high, mut count) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D], 0.0);
            for touch in self.touches(placed, field) {
                let force = touch.force(&normal);
                let along: f64 = (0..D).map(|d| force[d] * normal[d]).sum();
                (0..D).for_each(|d| resting.force[d] += force[d]);
                resting.area += touch.area;
                push += along;
                let from: [f64; D] = std::array::from_fn(|d| touch.place[d] - placed.plane.point[d]);
                let across = super::friction_pair::across(&normal, from);
                (0..D).for_each(|d| {
                    first[d] += along * across[d];
                    second[d] += along * across[d] * across[d];
                });
                resting.gap = resting.gap.min(-touch.overlap);
                (0..D).for_each(|d| (low[d], high[d]) = (low[d].min(across[d]), high[d].max(across[d])));
                count += 1.0;
            }
            // a face covers half the distance to its neighbours on either side; in space each row has as many
            let rows: f64 = if D == 2 { count } else { count.sqrt() };
            let spans: [f64; D] = std::array::from_fn(|d| (high[d] - low[d]).max(0.0));
            let extent = if D == 2 { length(spans) } else { spans.into_iter().fold(0.0, f64::max) };
            resting.width = if rows > 1.0 { extent * rows / (rows - 1.0) } else { 0.0 };
            if push > 0.0 {
                let square: f64 = (0..D).map(|d| second[d] / push - (first[d] / push).powi(2)).sum();
                resting.spread = square.max(0.0).sqrt();
            }
            if resting.gap.is_infinite() {
                let gaps = self.near(placed, field, f64::INFINITY).into_iter().map(|touch| -touch.overlap);
                resting.gap = gaps.fold(f64::INFINITY, f64::min);
            }
            resting
        };
        self.each.iter().map(of).collect()
    }

    /// Deepest overlap of a plane that has moved, m, before its last move and after it.
    pub fn approach(&self, field: &Field<D>) -> [f64; 2] {
        let mut most = [f64::NEG_INFINITY; 2];
        for placed in self.each.iter().filter(|placed| !placed.plane.bonded && placed.now != placed.before) {
            let normal = placed.plane.normal;
            let moved: f64 = (0..D).map(|d| normal[d] * (placed.now[d] - placed.before[d])).sum();
            let overlaps = self.near(placed, field, 0.0).into_iter().map(|touch| touch.overlap);
            let after = overlaps.fold(f64::NEG_INFINITY, f64::max);
            if after > most[1] {
                most = [after - moved, after];
            }
        }
        most
    }

    /// Bound of the stiffness that planes add over volumes, N/m⁴, however many faces touch.
    pub fn stiffness(&self) -> f64 {
        let mut matrix = nalgebra::Matrix3::<f64>::zeros();
        for MovingPlane { plane, .. } in &self.each {
            let isotropic = plane.bonded || plane.friction > 0.0;
            let n = |d: usize| plane.normal.get(d).copied().unwrap_or(0.0);
            matrix += nalgebra::Matrix3::from_fn(|a, b| {
                let part = if isotropic { f64::from(u8::from(a == b)) } else { n(a) * n(b) };
                plane.stiffness * part
            });
        }
        matrix.symmetric_eigenvalues().max() * self.penalty.greatest() * self.greatest
    }

    /// Visits elements in contact or nearer than `gap`, m: the particles below with their weights, the
    /// directions in which the plane holds them, and the stiffness, N/m.
    pub fn springs(&self, field: &Field<D>, gap: f64, visit: &mut super::Spring<D>) {
        let mut below = Vec::new();
        for placed in &self.each {
            let plane = &placed.plane;
            let touches =
                if plane.bonded { self.touches(placed, field) } else { self.near(placed, field, gap) };
            for touch in touches {
                below.clear();
                match touch.element.checked_sub(self.faces.len()) {
                    None => below.extend(self.faces.below(touch.element)),
                    Some(bare) => below.push((self.bare[bare] as usize, 1.0)),
                }
                let normal = (!plane.bonded && plane.friction == 0.0).then_some(plane.normal);
                visit(&below, normal, touch.stiffness);
            }
        }
    }

    /// Plane and element of all contacts, ascending.
    pub fn in_touch(&self, field: &Field<D>) -> Vec<[u32; 2]> {
        let each = self.each.iter().enumerate();
        each.flat_map(|(number, placed)| {
            self.touches(placed, field).into_iter().map(move |touch| [number as u32, touch.element as u32])
        })
        .collect()
    }
}
