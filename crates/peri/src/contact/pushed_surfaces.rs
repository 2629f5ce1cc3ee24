//! Rigid surfaces with a force: where contact balances it.
//!
//! A surface with the force P along e has one degree of freedom, its travel t. For a displacement u of the
//! body it stands where E(u, t) − Pt is least, E the energy of contact, so that Σ k o n·e = P. Forces on the
//! body there are the gradient of min_t (E − Pt), a function of u alone: methods that minimise the energy of
//! a body need not know of t. The sum grows with t as long as faces lie ahead; it is found by Newton's method
//! within a bracket, from the geometry alone, so that no earlier state changes a bit.
//!
//! Friction along e, of all surfaces but planes pressed along their normal, adds its potential to E: for
//! given normal forces it is convex in u − t, so that the sum still grows with t. Between steps its forces
//! are those at the end of the last one.

use super::friction_pair::FrictionPair;
use super::surface::{RigidSurface, SurfaceShape};
use super::surfaces::{MovingSurface, RigidSurfaces};
use crate::error::Error;
use crate::field::Field;

/// Relative error of the balance of a force.
const BALANCED: f64 = 1e-13;
/// Relative error of the balance beyond which a surface has lost the body.
const MISSED: f64 = 1e-6;
/// Largest number of evaluations; bisection alone needs 60.
const EVALUATIONS: u32 = 200;
/// Way back to the first touch, over the size of a closed surface, above which it surrounds the body or
/// overlaps it.
pub(crate) const BEHIND: f64 = 0.01;
/// Least component of a normal along the force of a plane that can balance it.
const FACING: f64 = 1e-3;
/// Largest number of doublings of the interval in which a balance is sought.
const DOUBLINGS: u32 = 60;

/// Friction of rigid surfaces with a force, sorted by pair.
#[derive(Clone, Copy)]
pub enum PushFriction<'a, const D: usize> {
    /// As a step ended: forces −k_t e.
    Resting(&'a [FrictionPair]),
    /// For the motion since a displacement at the start of the step.
    Sliding(&'a [FrictionPair], &'a Field<D>),
}

impl<'a, const D: usize> PushFriction<'a, D> {
    fn pairs(self) -> &'a [FrictionPair] {
        match self {
            Self::Resting(pairs) | Self::Sliding(pairs, _) => pairs,
        }
    }
}

impl<const D: usize> RigidSurfaces<D> {
    /// Starts surfaces with a force at first touch of the undeformed body.
    ///
    /// # Errors
    /// [`Error::Geometry`] for one that meets no face.
    pub(super) fn start_at_touch(&mut self, sites: usize) -> Result<(), Error> {
        for number in 0..self.each.len() {
            let Some((_, along)) = self.each[number].surface.pushed() else { continue };
            let rest = Field::zeros(sites);
            let Some(travel) = self.first_touch(&self.each[number].surface, &along, &rest) else {
                return Err(Error::geometry(format!(
                    "{}: found no face of the body ahead along its force; allowed: a surface in front of \
                     the body with a force towards it",
                    self.each[number].surface.title(number)
                )));
            };
            if let SurfaceShape::Facets(facets) = &self.each[number].surface.shape
                && travel < -BEHIND * facets.ball().1
            {
                return Err(Error::geometry(format!(
                    "{}: found its first touch from outside {:.4} mm behind its place; allowed: a surface in \
                     front of the body, which it neither surrounds nor overlaps, or a `displacement`",
                    self.each[number].surface.title(number),
                    -travel * 1e3
                )));
            }
            let point = &mut self.each[number].surface.point;
            (0..D).for_each(|d| point[d] += travel * along[d]);
        }
        Ok(())
    }

    /// Moves surfaces with a force to where contact balances it.
    pub fn balance(&mut self, field: &Field<D>, friction: PushFriction<D>) {
        for number in 0..self.each.len() {
            let surface = &self.each[number].surface;
            let Some((size, along)) = surface.pushed() else { continue };
            let wanted = size * self.each[number].factor;
            let touch = self.first_touch(surface, &along, field).unwrap_or(0.0);
            let travel = if wanted > 0.0 {
                let excess = |travel: f64| self.excess(number, travel, field, friction, wanted);
                let rubs = !self.rubbing(number, friction).is_empty();
                balanced(excess, wanted, touch, 1e-3 * self.spacing, rubs)
            } else {
                touch
            };
            self.each[number].now = along.map(|e| travel * e);
        }
    }

    /// Friction with a part along the force of a surface.
    fn rubbing<'a>(&self, number: usize, friction: PushFriction<'a, D>) -> Vec<(&'a FrictionPair, usize)> {
        let surface = &self.each[number].surface;
        if surface.friction == 0.0 || surface.bonded || surface.is_pushed_along_normal() {
            return Vec::new();
        }
        let own = |grip: &'a FrictionPair| {
            let (surface, element) = self.element(grip.pair)?;
            (surface == number).then_some((grip, element))
        };
        friction.pairs().iter().filter_map(own).collect()
    }

    /// Force of the contact of a surface along its own force less the wanted one, N, and its derivative, N/m,
    /// at a travel, m.
    fn excess(
        &self,
        number: usize,
        travel: f64,
        field: &Field<D>,
        friction: PushFriction<D>,
        wanted: f64,
    ) -> [f64; 2] {
        let placed = &self.each[number];
        let Some((_, along)) = placed.surface.pushed() else { return [0.0; 2] };
        let (mut force, mut stiffness) = (0.0, 0.0);
        let shift = along.map(|e| travel * e);
        for contact in self.near_at(&placed.surface, &shift, field, 0.0) {
            let facing: f64 = (0..D).map(|d| contact.normal[d] * along[d]).sum();
            force += facing * contact.stiffness * contact.overlap;
            stiffness += facing * facing * contact.stiffness;
        }
        let dot = |a: &[f64; 3]| (0..D).map(|d| a[d] * along[d]).sum::<f64>();
        for (grip, element) in self.rubbing(number, friction) {
            let PushFriction::Sliding(_, start) = friction else {
                force -= grip.stiffness * dot(&grip.slip);
                continue;
            };
            let (now, then) = (self.displacement(field, element), self.displacement(start, element));
            let moved = |d: usize| if d < D { now[d] - then[d] - (shift[d] - placed.before[d]) } else { 0.0 };
            let moved = std::array::from_fn(moved);
            force += dot(&grip.drag(moved).force);
            let tangent = grip.tangent_stiffness(moved);
            let (slipping, facing) = (dot(&tangent.direction), dot(&grip.normal));
            let across = (1.0 - facing * facing - slipping * slipping).max(0.0);
            stiffness += tangent.along * slipping * slipping + tangent.across * across;
        }
        [force - wanted, stiffness]
    }

    /// Sums P·t of the forces at load factor 1, of those with amplitudes at their mean multiples, and their
    /// travels, N·m.
    pub(super) fn travelled(&self) -> f64 {
        let of = |placed: &MovingSurface<D>| {
            let force = placed.surface.force.unwrap_or([0.0; D]);
            placed.weight * (0..D).map(|d| force[d] * placed.now[d]).sum::<f64>()
        };
        self.each.iter().map(of).sum()
    }

    /// Finds a surface whose force contact does not balance: its title, the balanced part and the force, N.
    pub(super) fn unbalanced(
        &self,
        field: &Field<D>,
        friction: PushFriction<D>,
    ) -> Option<(String, f64, f64)> {
        let unbalanced = |(number, placed): (usize, &MovingSurface<D>)| {
            let (size, along) = placed.surface.pushed()?;
            let wanted = size * placed.factor;
            let travel: f64 = (0..D).map(|d| placed.now[d] * along[d]).sum();
            let [excess, _] = self.excess(number, travel, field, friction, wanted);
            let lost = wanted > 0.0 && excess.abs() > MISSED * wanted;
            lost.then(|| (placed.surface.title(number), wanted + excess, wanted))
        };
        self.each.iter().enumerate().find_map(unbalanced)
    }

    /// Finds the least travel along `along`, m, at which a surface touches an element ahead of it.
    fn first_touch(&self, surface: &RigidSurface<D>, along: &[f64; D], field: &Field<D>) -> Option<f64> {
        let touch = |element: usize| {
            let (home, radius, _) = self.ball(element);
            let moved = self.displacement(field, element);
            surface.travel_to(std::array::from_fn(|d| home[d] + moved[d]), radius, along)
        };
        (0..self.elements()).filter(|&element| self.is_live(element)).filter_map(touch).min_by(f64::total_cmp)
    }
}

/// Finds the travel, m, at which `excess`, N, with its derivative, is 0, from that of first touch on, in an
/// interval that doubles from `step`. Without friction the excess is below 0 before first touch; friction may
/// carry more than the force.
fn balanced(excess: impl Fn(f64) -> [f64; 2], wanted: f64, touch: f64, mut step: f64, rubs: bool) -> f64 {
    let behind = rubs && excess(touch)[0] > 0.0;
    let (mut low, mut high) = if behind { (touch - step, touch) } else { (touch, touch + step) };
    let mut at = excess(if behind { low } else { high });
    for _ in 0..DOUBLINGS {
        if (at[0] < 0.0) == behind {
            break;
        }
        step *= 2.0;
        (low, high) = if behind { (low - step, low) } else { (high, high + step) };
        at = excess(if behind { low } else { high });
    }
    let mut travel = if behind { low } else { high };
    for _ in 0..EVALUATIONS {
        if at[0].abs() <= BALANCED * wanted {
            break;
        }
        if at[0] > 0.0 {
            high = travel
        } else {
            low = travel
        }
        let newton = travel - at[0] / at[1];
        let next = if low < newton && newton < high { newton } else { 0.5 * (low + high) };
        if next == travel {
            break;
        }
        travel = next;
        at = excess(travel);
    }
    travel
}

impl<const D: usize> RigidSurface<D> {
    /// Computes the travel along the unit vector `along`, m, at which the surface touches a ball of this
    /// centre and radius, m, ahead of it; `None` if it passes beside.
    pub fn travel_to(&self, centre: [f64; D], radius: f64, along: &[f64; D]) -> Option<f64> {
        let dot = |a: &[f64; D], b: &[f64; D]| (0..D).map(|d| a[d] * b[d]).sum::<f64>();
        if let SurfaceShape::Plane(normal) = &self.shape {
            let facing = dot(normal, along);
            return (facing > FACING).then(|| (self.height(centre) - radius) / facing);
        }
        if let SurfaceShape::Facets(facets) = &self.shape {
            return self.way_to_facets(facets, centre, radius, &along.map(|e| -e));
        }
        // |c − t e| = R + r across the axis
        let from = self.offset_of(centre);
        let across = match &self.shape {
            SurfaceShape::Cylinder(axis, _) => super::friction_pair::across(axis, *along),
            _ => *along,
        };
        let (square, ahead) = (dot(&across, &across), dot(&from, &across));
        let reach = self.radius().unwrap_or(0.0) + radius;
        let inside = ahead * ahead - square * (dot(&from, &from) - reach * reach);
        (square > FACING * FACING && ahead > 0.0 && inside >= 0.0).then(|| (ahead - inside.sqrt()) / square)
    }
}
