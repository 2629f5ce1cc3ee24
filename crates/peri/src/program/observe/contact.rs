//! Scalars of contact, friction and rigid surfaces; warnings where contact is soft or never begins.

use super::moment::Moment;
use super::values::axes;
use crate::contact::SurfaceReaction;
use crate::program::quantities as q;
use crate::program::scene::{ContactSpec, PlaneSpec, Scene, ShapeKind, ShapeSpec};
use harness::observe::Scalars;

/// Energy of contact over the stored energy above which a run warns.
const SOFT_SHARE: f64 = 0.02;
/// Energy of contact over the stored energy at the advised stiffness.
const ADVISED_SHARE: f64 = 0.01;
/// Stored energy over work below which a body is undeformed.
const UNDEFORMED: f64 = 1e-12;

/// Returns the stiffness of the first plane, else of the first indenter, else of pairs of particles.
fn contact_stiffness(contact: &ContactSpec, scene: &Scene) -> f64 {
    let own = contact.plane.first().map(|plane| plane.stiffness);
    let own = own.or(contact.indenter.first().map(|indenter| indenter.stiffness));
    own.map(|own| contact.stiffness_of(own, scene.has_dynamics()))
        .or(contact.short_range)
        .unwrap_or(contact.pair_stiffness())
}

/// Returns the largest overlap of all steps.
fn deepest_overlap<const D: usize>(m: &Moment<D>) -> f64 {
    m.state.history.iter().filter_map(|row| Some(row.contact?.overlap)).fold(0.0, f64::max)
}

/// Returns the energy of contact over the stored energy.
fn contact_share<const D: usize>(m: &Moment<D>) -> Option<f64> {
    let last = m.state.history.last()?;
    let touching = last.contact?;
    let at_rest = last.stored <= UNDEFORMED * last.work.abs();
    Some(if at_rest || last.stored <= 0.0 { 0.0 } else { touching.energy / last.stored })
}

/// Adds energies, contacts, overlaps and forces of planes and indenters.
pub(super) fn scalars<const D: usize>(scene: &Scene, to: &mut Scalars<Moment<D>>) {
    let Some(contact) = &scene.contact else { return };
    let touching = |m: &Moment<D>| m.state.history.last()?.contact;
    to.add_if(q::CONTACT_STIFFNESS, |m| m.state.history.last().map(|_| contact_stiffness(contact, scene)));
    to.add_if(q::CONTACT_ENERGY, |m| Some(touching(m)?.energy));
    to.add_if(q::CONTACTS, |m| Some(touching(m)?.pairs as f64));
    to.add_if(q::DEEPEST_OVERLAP, |m| touching(m).map(|_| deepest_overlap(m)));
    to.add_if(q::CONTACT_SHARE, contact_share);
    if scene.output.contact && contact.has_pairs() {
        let surfaces = contact.surface_names().len();
        to.add_if(q::PAIR_PRESSURE, move |m| {
            let own = m.tractions().iter().filter(|one| one.surface == surfaces);
            m.state.history.last().map(|_| own.map(|one| one.pressure).fold(0.0, f64::max))
        });
    }
    if contact.has_friction() {
        to.add_if(q::FRICTION_WORK, |m| m.state.history.last().map(|last| last.rubbed));
    }
    for (index, name) in contact.surface_names().into_iter().enumerate() {
        let resting = move |m: &Moment<D>| m.state.history.last()?.resting.get(index).copied();
        for (d, axis) in axes(scene).iter().enumerate() {
            to.add_if(q::PLANE_FORCE.named(&[&name, axis]), |m| Some(resting(m)?.force[d]));
        }
        for (d, axis) in axes(scene).iter().enumerate().filter(|_| index >= contact.plane.len()) {
            to.add_if(q::INDENTER_DISPLACEMENT.named(&[&name, axis]), |m| Some(resting(m)?.moved[d]));
        }
        let own = index.checked_sub(contact.plane.len()).and_then(|own| contact.indenter.get(own));
        for (d, axis) in axes(scene).iter().enumerate().filter(|_| own.is_some_and(|own| own.mass.is_some()))
        {
            to.add_if(q::INDENTER_VELOCITY.named(&[&name, axis]), |m| Some(resting(m)?.velocity[d]));
        }
        let sizes: [fn(SurfaceReaction) -> f64; 4] =
            [|one| one.area, |one| one.spread, |one| one.width, |one| one.pressure];
        let quantities = [q::PLANE_AREA, q::PLANE_SPREAD, q::PLANE_WIDTH, q::PLANE_PRESSURE];
        for (quantity, get) in quantities.iter().zip(sizes) {
            to.add_if(quantity.named(&[&name]), |m| resting(m).map(get));
        }
    }
}

/// Warns of soft contact, and of planes that nothing touches.
pub(super) fn warnings<const D: usize>(m: &Moment<D>) -> Vec<String> {
    let mut warnings = Vec::new();
    let Some(contact) = m.scene.contact.as_ref().filter(|_| !m.state.history.is_empty()) else {
        return warnings;
    };
    if let Some(share) = contact_share(m).filter(|_| contact.short_range.is_none()) {
        let (stiffness, deepest) = (contact_stiffness(contact, m.scene), deepest_overlap(m));
        if share > SOFT_SHARE && m.scene.dynamics.is_none() {
            warnings.push(format!(
                "contact holds {:.1} % of the stored energy, and the load is too low by about that much: \
                 raise `stiffness` from \
                 {stiffness} to {:.0}",
                100.0 * share,
                stiffness * share / ADVISED_SHARE
            ));
        }
        if deepest > 0.5 {
            warnings.push(format!(
                "a contact overlaps by {deepest:.2} of half a spacing: raise `contact.stiffness` or reduce \
                 the spacing"
            ));
        }
    }
    let steps = |shape: &ShapeSpec| shape.add.or(shape.cut) != Some(ShapeKind::Box);
    let surfaces = contact.surface_names().len();
    if m.scene.output.contact
        && m.scene.body.shapes().iter().any(steps)
        && m.tractions().iter().any(|one| one.surface == surfaces)
    {
        warnings.push(
            "pressures of particles on each other: where curved or inclined faces of a lattice touch, on \
             steps, they rise at the ends of these; press with an indenter, or use their sums"
                .to_owned(),
        );
    }
    let rests = |plane: &PlaneSpec| {
        let wanted = plane.displacement.is_some() || plane.friction.is_some_and(|mu| mu > 0.0);
        ("plane", wanted && !plane.bonded)
    };
    let planes = contact.plane.iter().map(rests);
    let each = planes.chain(contact.indenter.iter().map(|own| ("indenter", own.is_driven())));
    for ((index, (kind, wanted)), name) in each.enumerate().zip(contact.surface_names()) {
        let gaps = m.state.history.iter().filter_map(|row| row.resting.get(index)).map(|resting| resting.gap);
        let least = gaps.fold(f64::INFINITY, f64::min);
        if least > 0.0 && wanted {
            warnings.push(format!("{kind} `{name}` touched nothing: the smallest gap was {least:.3e} m"));
        }
    }
    warnings
}
