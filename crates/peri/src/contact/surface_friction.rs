//! Friction of faces and particles on rigid surfaces.

use super::friction_pair::{ContactPair, FrictionPair, TangentStiffness, known_in};
use super::stiffness::all_axes;
use super::surfaces::{RigidSurfaces, SurfaceContact};
use crate::field::Field;
use nalgebra::Vector3;

/// Friction between equilibria, sorted by pair, and the displacement from which on it acts; or none.
pub(super) type ActiveFriction<'a, const D: usize> = Option<(&'a [FrictionPair], &'a Field<D>)>;

impl<const D: usize> RigidSurfaces<D> {
    /// Motion of a face or particle against a surface since `start`, m.
    pub fn slipped(&self, pair: ContactPair, field: &Field<D>, start: &Field<D>) -> [f64; 3] {
        let Some((number, element)) = self.element(pair) else { return [0.0; 3] };
        let (now, then) = (self.displacement(field, element), self.displacement(start, element));
        let placed = &self.each[number];
        let moved = |d: usize| now[d] - then[d] - (placed.now[d] - placed.before[d]);
        std::array::from_fn(|d| if d < D { moved(d) } else { 0.0 })
    }

    /// Computes the stiffness of the friction of an element; `None` without any.
    pub(super) fn active(
        &self,
        surface: usize,
        element: usize,
        field: &Field<D>,
        friction: ActiveFriction<D>,
    ) -> Option<TangentStiffness> {
        let (held, start) = friction?;
        let pair = self.pair(surface, element);
        let grip = known_in(held, pair)?;
        Some(grip.tangent_stiffness(self.slipped(pair, field, start)))
    }

    /// Directions in which a surface holds an element in contact, with the stiffness along each, N/m.
    pub(super) fn directions(
        &self,
        surface: usize,
        touch: &SurfaceContact<D>,
        field: &Field<D>,
        friction: ActiveFriction<D>,
    ) -> Vec<([f64; D], f64)> {
        let mut directions = vec![(touch.normal, touch.stiffness)];
        let Some(grip) = self.active(surface, touch.element, field, friction) else { return directions };
        if grip.along == touch.stiffness && grip.across == touch.stiffness {
            return all_axes(touch.stiffness);
        }
        let normal = Vector3::from_fn(|d, _| touch.normal.get(d).copied().unwrap_or(0.0));
        let across: [f64; 3] = normal.cross(&Vector3::from(grip.direction)).into();
        for (direction, stiffness) in [(grip.direction, grip.along), (across, grip.across)] {
            // in the plane, one of them is the axis across it
            if stiffness > 0.0 && direction[..D].iter().any(|x| *x != 0.0) {
                directions.push((std::array::from_fn(|d| direction[d]), stiffness));
            }
        }
        directions
    }

    /// Motion of a face or particle against a surface in a step, s, with a velocity, m/s, m.
    pub fn carried(&self, pair: ContactPair, velocity: &Field<D>, step: f64) -> [f64; 3] {
        let Some((number, element)) = self.element(pair) else { return [0.0; 3] };
        let (placed, v) = (&self.each[number], self.displacement(velocity, element));
        std::array::from_fn(|d| if d < D { step * v[d] - (placed.now[d] - placed.before[d]) } else { 0.0 })
    }

    /// Computes the friction forces of explicit dynamics from elastic slips.
    pub fn drag(&mut self, held: &[FrictionPair]) {
        let mut drags = std::mem::take(&mut self.drags);
        drags.clear();
        for grip in held {
            let Some((_, element)) = self.element(grip.pair) else { continue };
            if drags.is_empty() {
                drags.resize(self.elements(), [0.0; D]);
            }
            (0..D).for_each(|d| drags[element][d] -= grip.stiffness * grip.slip[d]);
        }
        self.drags = drags;
    }

    /// Adds the force densities of friction in explicit dynamics on the sites from `start` on.
    pub fn friction(&self, start: usize, force: &mut [&mut [f64]; D]) {
        if !self.drags.is_empty() {
            self.spread(&self.drags, start, force);
        }
    }

    /// Computes the friction of all contacts at a displacement, with the normal forces there; the slips of
    /// `old`, sorted by pair, continue. Contacts that began after `start` slip for their part of the way
    /// only.
    pub fn grips(&self, field: &Field<D>, start: &Field<D>, old: &[FrictionPair]) -> Vec<FrictionPair> {
        let mut grips = Vec::new();
        for (number, placed) in self.each.iter().enumerate() {
            let surface = &placed.surface;
            if surface.friction == 0.0 || surface.bonded {
                continue;
            }
            for touch in self.near(placed, field, 0.0) {
                let bound = surface.friction * touch.stiffness * touch.overlap;
                let pair = self.pair(number, touch.element);
                let stiffness = surface.elastic_slip.map_or(touch.stiffness, |slip| bound / slip);
                let normal = std::array::from_fn(|d| touch.normal.get(d).copied().unwrap_or(0.0));
                let known = known_in(old, pair);
                let then = self.earlier_overlap(placed, start, touch.element);
                let share = if then >= 0.0 { 1.0 } else { touch.overlap / (touch.overlap - then) };
                let slip = known.map_or([0.0; 3], |grip| grip.slip);
                let mut grip = FrictionPair { pair, slip, bound, stiffness, normal, share, growth: 0.0 };
                grip.project();
                if bound > 0.0 {
                    grips.push(grip);
                }
            }
        }
        grips.sort_unstable_by_key(|grip| grip.pair);
        grips
    }
}
