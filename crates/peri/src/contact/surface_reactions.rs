//! Results of the contact with rigid surfaces: forces, energies, stiffness.

use super::stiffness::all_axes;
use super::surface::{SurfaceReaction, SurfaceShape};
use super::surface_friction::ActiveFriction;
use super::surfaces::{MovingSurface, RigidSurfaces};
use crate::field::Field;
use crate::geometry::length;

impl<const D: usize> RigidSurfaces<D> {
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

    /// Force, area and width of the contact with each surface, without friction.
    pub fn reactions(&self, field: &Field<D>) -> Vec<SurfaceReaction> {
        let of = |placed: &MovingSurface<D>| {
            let mut resting = SurfaceReaction { gap: f64::INFINITY, ..SurfaceReaction::default() };
            (0..D).for_each(|d| resting.moved[d] = placed.now[d]);
            let touches = self.touches(placed, field);
            for touch in &touches {
                let force = touch.force();
                (0..D).for_each(|d| resting.force[d] += force[d]);
                resting.area += touch.area;
                resting.gap = resting.gap.min(-touch.overlap);
            }
            let size = length(resting.force);
            let normal: [f64; D] = match placed.surface.shape {
                SurfaceShape::Plane(normal) => normal,
                _ if size > 0.0 => std::array::from_fn(|d| resting.force[d] / size),
                _ => [0.0; D],
            };
            let (mut push, mut first, mut second) = (0.0, [0.0; D], [0.0; D]);
            let (mut low, mut high, mut count) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D], 0.0);
            for touch in &touches {
                let force = touch.force();
                let along: f64 = (0..D).map(|d| force[d] * normal[d]).sum();
                push += along;
                let from: [f64; D] = std::array::from_fn(|d| touch.place[d] - placed.surface.point[d]);
                let across = super::friction_pair::across(&normal, from);
                (0..D).for_each(|d| {
                    first[d] += along * across[d];
                    second[d] += along * across[d] * across[d];
                });
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

    /// Deepest overlap of a surface that has moved, m, before its last move and after it.
    pub fn approach(&self, field: &Field<D>) -> [f64; 2] {
        let mut most = [f64::NEG_INFINITY; 2];
        for placed in self.each.iter().filter(|placed| !placed.surface.bonded && placed.now != placed.before)
        {
            let near = self.near(placed, field, 0.0);
            let Some(deepest) = near.iter().max_by(|a, b| a.overlap.total_cmp(&b.overlap)) else { continue };
            let before = match placed.surface.shape {
                SurfaceShape::Plane(normal) => {
                    let moved = |d: usize| normal[d] * (placed.now[d] - placed.before[d]);
                    deepest.overlap - (0..D).map(moved).sum::<f64>()
                }
                _ => self.earlier_overlap(placed, field, deepest.element),
            };
            if deepest.overlap > most[1] {
                most = [before, deepest.overlap];
            }
        }
        most
    }

    /// Bound of the stiffness that surfaces add over volumes, N/m⁴, however many faces touch.
    pub fn stiffness(&self) -> f64 {
        let mut matrix = nalgebra::Matrix3::<f64>::zeros();
        for MovingSurface { surface, .. } in &self.each {
            let held = surface.bonded || surface.friction > 0.0;
            let normal = match surface.shape {
                SurfaceShape::Plane(normal) if !held => Some(normal),
                _ => None,
            };
            let isotropic = normal.is_none();
            let n = |d: usize| normal.and_then(|normal| normal.get(d).copied()).unwrap_or(0.0);
            matrix += nalgebra::Matrix3::from_fn(|a, b| {
                let part = if isotropic { f64::from(u8::from(a == b)) } else { n(a) * n(b) };
                surface.stiffness * part
            });
        }
        matrix.symmetric_eigenvalues().max() * self.penalty.greatest() * self.greatest
    }

    /// Visits elements in contact, with the stiffness of the present `friction`; or those nearer than
    /// `gap`, m, held in all directions where there is friction.
    pub fn springs(
        &self,
        field: &Field<D>,
        gap: Option<f64>,
        friction: ActiveFriction<D>,
        visit: &mut super::Spring<D>,
    ) {
        let mut below = Vec::new();
        for (number, placed) in self.each.iter().enumerate() {
            let surface = &placed.surface;
            for touch in self.touches_within(placed, field, gap.unwrap_or(0.0)) {
                below.clear();
                match touch.element.checked_sub(self.faces.len()) {
                    None => below.extend(self.faces.below(touch.element)),
                    Some(bare) => below.push((self.bare[bare] as usize, 1.0)),
                }
                let rubs = surface.friction > 0.0 && !surface.bonded;
                let directions = if touch.offset.is_some() || (gap.is_some() && rubs) {
                    all_axes(touch.stiffness)
                } else {
                    self.directions(number, &touch, field, friction)
                };
                visit(&below, &directions);
            }
        }
    }

    /// Surface and element of all contacts, ascending, and 1 for those that slip.
    pub fn in_touch(&self, field: &Field<D>, friction: ActiveFriction<D>) -> Vec<[u32; 3]> {
        let mut all = Vec::new();
        for (number, placed) in self.each.iter().enumerate() {
            for touch in self.touches(placed, field) {
                let slips =
                    self.active(number, touch.element, field, friction).is_some_and(|grip| grip.slips);
                all.push([number as u32, touch.element as u32, u32::from(slips)]);
            }
        }
        all
    }
}
