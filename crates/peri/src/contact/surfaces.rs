//! Contact of faces and particles with rigid surfaces.

use super::faces::Faces;
use super::friction_pair::{ContactPair, FrictionPair};
use super::surface::{RigidSurface, SurfaceShape};
use crate::bonds::{BodyGeometry, Bonds, Property};
use crate::error::Error;
use crate::field::Field;
use crate::parallel;
use crate::surface::BodySurface;

/// Distance of a face from a plane up to which it is tied to it, in spacings.
const TIED: f64 = 0.5;
/// Faces of a work item.
const BATCH: usize = 1024;

/// A rigid surface in motion.
#[derive(Clone)]
pub(super) struct MovingSurface<const D: usize> {
    pub(super) surface: RigidSurface<D>,
    /// Displacement of the surface now and at the last placement, m.
    pub(super) now: [f64; D],
    pub(super) before: [f64; D],
    /// Displacement of a surface with a mass after its flight, m.
    pub(super) flown: [f64; D],
    /// Load factor of its force.
    pub(super) factor: f64,
    /// Mean rate of its displacement over the load factor in the present step, m, and mean of the multiples
    /// of its force at two factors.
    pub(super) rate: [f64; D],
    pub(super) weight: f64,
    /// Faces tied to the surface.
    tied: Vec<u32>,
    /// Elements held in a search for equilibrium, faces first, ascending.
    pub(super) held: Vec<usize>,
}

/// A face, or a particle exposed to rigid surfaces, beside one.
#[derive(Clone, Copy)]
pub(super) struct SurfaceContact<const D: usize> {
    /// Number of a face, or number of faces plus the number of a bare particle.
    pub(super) element: usize,
    /// Position, m; of a particle, on its surface.
    pub(super) place: [f64; D],
    /// Depth behind the surface, m, and its unit normal there.
    pub(super) overlap: f64,
    pub(super) normal: [f64; D],
    /// Displacement relative to the surface, m, if tied.
    pub(super) offset: Option<[f64; D]>,
    /// Area, m², and normal stiffness, N/m.
    pub(super) area: f64,
    pub(super) stiffness: f64,
}

impl<const D: usize> SurfaceContact<D> {
    /// Energy, J.
    pub(super) fn energy(&self) -> f64 {
        let square = self.offset.map_or(self.overlap * self.overlap, |x| x.iter().map(|x| x * x).sum());
        0.5 * self.stiffness * square
    }

    /// Force on the body, N.
    pub(super) fn force(&self) -> [f64; D] {
        match self.offset {
            Some(offset) => offset.map(|x| -self.stiffness * x),
            None => self.normal.map(|n| self.stiffness * self.overlap * n),
        }
    }
}

/// All rigid surfaces of a scene with the elements they act on: faces of the body, and particles that have
/// lost bonds.
#[derive(Clone)]
pub struct RigidSurfaces<const D: usize> {
    pub(super) each: Vec<MovingSurface<D>>,
    pub(super) faces: Faces<D>,
    /// True for faces whose particles have all their bonds.
    sound: Vec<bool>,
    /// Sites of bare particles, which touch surfaces themselves, ascending, and their reference positions, m.
    pub(super) bare: Vec<u32>,
    homes: Vec<[f64; D]>,
    /// Bonds of each site in the reference state.
    bonded: Vec<u32>,
    /// Radius, m, and volume of the particle of each site.
    radii: Vec<f64>,
    pub(super) volumes: Vec<f64>,
    /// M/Δx, Pa/m.
    pub(super) penalty: Property,
    pub(super) spacing: f64,
    /// Forces of all surfaces on faces and on bare particles, N, at the displacement of the last update;
    /// empty without contact.
    pub(super) pushes: Vec<[f64; D]>,
    /// Friction forces in explicit dynamics, likewise.
    pub(super) drags: Vec<[f64; D]>,
    /// Bound of the eigenvalues that faces in contact add to the stiffness over volumes for a penalty of 1
    /// Pa/m.
    pub(super) greatest: f64,
}

impl<const D: usize> RigidSurfaces<D> {
    /// Places surfaces at rest beside a body; `modulus` is M, Pa, and `radius` that of a particle, m.
    ///
    /// # Errors
    /// [`Error::Parameter`] as for [`RigidSurface`]; [`Error::Geometry`] for a bonded plane that touches no
    /// face, and for a surface with a force that meets none.
    pub fn new(
        bonds: &dyn Bonds<D>,
        outside: &BodySurface<D>,
        modulus: &Property,
        surfaces: Vec<RigidSurface<D>>,
        radius: impl Fn(usize) -> f64,
    ) -> Result<Self, Error> {
        let faces = Faces::new(bonds, outside, false);
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
        for (number, surface) in surfaces.into_iter().enumerate() {
            let surface = surface.checked()?;
            let near = |&face: &u32| surface.height(faces.places[face as usize]).abs() < TIED * spacing;
            let tied: Vec<u32> =
                (0..faces.len() as u32).filter(|face| surface.bonded && near(face)).collect();
            if surface.bonded && tied.is_empty() {
                return Err(Error::geometry(format!(
                    "bonded {}: found no face of the body within half a spacing; allowed: a plane that \
                    touches the body",
                    surface.title(number)
                )));
            }
            let (rate, now, before) = (surface.displacement, [0.0; D], [0.0; D]);
            each.push(MovingSurface {
                surface,
                now,
                before,
                flown: [0.0; D],
                factor: 0.0,
                rate,
                weight: 1.0,
                tied,
                held: Vec::new(),
            });
        }
        let mut all = Self {
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
        if all.faces.len() == 0 {
            all.bare = bonds.particles().to_vec();
            all.homes = all.bare.iter().map(|&site| bonds.position(site as usize)).collect();
        }
        all.start_at_touch(bonds.sites())?;
        Ok(all)
    }

    /// The surfaces.
    pub fn surfaces(&self) -> impl Iterator<Item = &RigidSurface<D>> {
        self.each.iter().map(|placed| &placed.surface)
    }

    /// Moves surfaces to their positions at a load factor and a time, s; one with a force follows in
    /// [`Self::balance`].
    pub fn move_to(&mut self, factor: f64, time: f64) {
        for placed in &mut self.each {
            let surface = &placed.surface;
            (placed.before, placed.factor) = (placed.now, surface.force_factor(factor));
            if surface.inertia.is_some() {
                placed.now = placed.flown;
            } else if surface.force.is_none() {
                placed.now = surface.place_at(factor, time);
            }
        }
    }

    /// Sets the rates of displacements between two load factors.
    pub(super) fn set_rates(&mut self, before: f64, after: f64) {
        self.each.iter_mut().for_each(|placed| placed.rate = placed.surface.rate(before, after));
    }

    /// Sets the multiples of forces that follow amplitudes to their mean at two load factors.
    pub(super) fn set_weights(&mut self, factors: [f64; 2]) {
        for placed in self.each.iter_mut().filter(|placed| placed.surface.amplitudes.is_some()) {
            let [before, after] = factors.map(|factor| placed.surface.force_factor(factor));
            placed.weight = 0.5 * (before + after);
        }
    }

    /// Mean rate of the displacement of every surface over the load factor in the present step, m.
    pub(super) fn rates(&self) -> impl Iterator<Item = [f64; D]> {
        self.each.iter().map(|placed| placed.rate)
    }

    /// Last move of every surface, m.
    pub fn moved(&self) -> impl Iterator<Item = [f64; D]> {
        self.each.iter().map(|placed| std::array::from_fn(|d| placed.now[d] - placed.before[d]))
    }

    /// Exposes the particles among `sites` that have lost bonds: they touch surfaces themselves, and faces
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

    /// Computes the state of an element beside a surface moved by `shift`, m, whatever its overlap.
    pub(super) fn beside(
        &self,
        surface: &RigidSurface<D>,
        shift: &[f64; D],
        field: &Field<D>,
        element: usize,
    ) -> SurfaceContact<D> {
        let (home, radius, area) = self.ball(element);
        let moved = self.displacement(field, element);
        let centre: [f64; D] = std::array::from_fn(|d| home[d] + moved[d]);
        let stiffness = surface.stiffness * self.penalty.value_at(self.head(element)) * area;
        if let SurfaceShape::Facets(facets) = &surface.shape {
            // h − r of the ball is the height of its lowest point
            let from = surface.offset_of(std::array::from_fn(|d| centre[d] - shift[d]));
            let (height, normal) = facets.height_and_normal(from);
            let place = std::array::from_fn(|d| centre[d] - radius * normal[d]);
            let overlap = radius - height;
            return SurfaceContact { element, place, overlap, normal, offset: None, area, stiffness };
        }
        let normal = match surface.shape {
            SurfaceShape::Plane(normal) => normal,
            _ => surface.normal(std::array::from_fn(|d| centre[d] - shift[d])),
        };
        let place: [f64; D] = std::array::from_fn(|d| centre[d] - radius * normal[d]);
        let overlap = match surface.shape {
            SurfaceShape::Plane(_) => {
                (0..D).map(|d| shift[d] * normal[d]).sum::<f64>() - surface.height(place)
            }
            _ => -surface.height(std::array::from_fn(|d| place[d] - shift[d])),
        };
        SurfaceContact { element, place, overlap, normal, offset: None, area, stiffness }
    }

    /// Centre in the reference state, m, radius, m, and area, m², of the ball of an element.
    pub(super) fn ball(&self, element: usize) -> ([f64; D], f64, f64) {
        match element.checked_sub(self.faces.len()) {
            None => {
                let (radius, normal) = (self.faces.radii[element], self.faces.normals[element]);
                let below = std::array::from_fn(|d| self.faces.places[element][d] - radius * normal[d]);
                (below, radius, self.faces.areas[element])
            }
            Some(bare) => {
                let site = self.bare[bare] as usize;
                (self.homes[bare], self.radii[site], 0.5 * self.volumes[site] / self.radii[site])
            }
        }
    }

    /// Computes the overlap of an element, m, with a surface where it was before its last move.
    pub(super) fn earlier_overlap(&self, placed: &MovingSurface<D>, field: &Field<D>, element: usize) -> f64 {
        match placed.surface.shape {
            SurfaceShape::Plane(normal) => {
                let along = |moved: &[f64; D]| (0..D).map(|d| moved[d] * normal[d]).sum::<f64>();
                let now = self.beside(&placed.surface, &placed.now, field, element).overlap;
                now - (along(&placed.now) - along(&placed.before))
            }
            _ => self.beside(&placed.surface, &placed.before, field, element).overlap,
        }
    }

    /// Elements that a surface acts on, in order: those tied to it, those behind it and those it holds.
    pub(super) fn touches(&self, placed: &MovingSurface<D>, field: &Field<D>) -> Vec<SurfaceContact<D>> {
        self.touches_within(placed, field, 0.0)
    }

    /// Likewise, with those nearer than `gap`, m.
    pub(super) fn touches_within(
        &self,
        placed: &MovingSurface<D>,
        field: &Field<D>,
        gap: f64,
    ) -> Vec<SurfaceContact<D>> {
        let beside = |element: usize| self.beside(&placed.surface, &placed.now, field, element);
        let mut touches = self.near(placed, field, gap);
        let free = |element: &&usize| touches.binary_search_by_key(*element, |touch| touch.element).is_err();
        let pulled: Vec<SurfaceContact<D>> =
            placed.held.iter().filter(free).map(|&element| beside(element)).collect();
        touches.extend(pulled);
        touches.extend(self.tied(placed).into_iter().map(|element| {
            let moved = self.displacement(field, element);
            let offset = std::array::from_fn(|d| moved[d] - placed.now[d]);
            SurfaceContact { offset: Some(offset), ..beside(element) }
        }));
        touches.sort_unstable_by_key(|touch| touch.element);
        touches
    }

    /// Elements tied to a surface, ascending: faces, or the particles below those that have lost bonds.
    fn tied(&self, placed: &MovingSurface<D>) -> Vec<usize> {
        let element = |&face: &u32| {
            if self.sound[face as usize] {
                return Some(face as usize);
            }
            let head = self.faces.head(face as usize) as u32;
            Some(self.faces.len() + self.bare.binary_search(&head).ok()?)
        };
        let mut tied: Vec<usize> = placed.tied.iter().filter_map(element).collect();
        tied.sort_unstable();
        tied
    }

    /// Elements nearer to a surface than `gap`, m, and not tied to it, in order.
    pub(super) fn near(
        &self,
        placed: &MovingSurface<D>,
        field: &Field<D>,
        gap: f64,
    ) -> Vec<SurfaceContact<D>> {
        let mut near = self.near_at(&placed.surface, &placed.now, field, gap);
        if !placed.tied.is_empty() {
            let tied = self.tied(placed);
            near.retain(|touch| tied.binary_search(&touch.element).is_err());
        }
        near
    }

    /// Elements nearer to a surface moved by `shift`, m, than `gap`, m, in order.
    pub(super) fn near_at(
        &self,
        surface: &RigidSurface<D>,
        shift: &[f64; D],
        field: &Field<D>,
        gap: f64,
    ) -> Vec<SurfaceContact<D>> {
        let count = self.elements();
        let batch = |start: usize| {
            let range = start * BATCH..((start + 1) * BATCH).min(count);
            let live = range.filter(|&element| self.is_live(element));
            live.filter(|&element| self.is_beside(surface, shift, field, element, gap))
                .map(|element| self.beside(surface, shift, field, element))
                .filter(|touch| touch.overlap > -gap)
                .collect::<Vec<_>>()
        };
        parallel::map(count.div_ceil(BATCH), batch).concat()
    }

    /// Returns true for a bare particle, and for a face whose particles have all their bonds.
    pub(super) fn is_live(&self, element: usize) -> bool {
        self.sound.get(element).copied().unwrap_or(true)
    }

    /// Computes the forces of all surfaces at a displacement, with friction for the motion since `start`.
    pub fn update(&mut self, field: &Field<D>, held: &[FrictionPair], start: Option<&Field<D>>) {
        self.balance(field, super::push_friction(held, start));
        let mut pushes = std::mem::take(&mut self.pushes);
        pushes.clear();
        let mut add = |surfaces: &Self, element: usize, force: [f64; D]| {
            if pushes.is_empty() {
                pushes.resize(surfaces.elements(), [0.0; D]);
            }
            (0..D).for_each(|d| pushes[element][d] += force[d]);
        };
        for placed in &self.each {
            for touch in self.touches(placed, field) {
                add(self, touch.element, touch.force());
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

    /// Pair of a surface and an element.
    pub(super) fn pair(&self, surface: usize, element: usize) -> ContactPair {
        match element.checked_sub(self.faces.len()) {
            None => ContactPair::Face(surface as u32, element as u32),
            Some(bare) => ContactPair::Particle(surface as u32, self.bare[bare]),
        }
    }

    /// Surface and element of a pair; `None` for two particles.
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
}
