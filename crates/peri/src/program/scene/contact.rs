//! Contact settings of a scene: between particles, and with rigid planes.

use super::line::plane_of;
use super::values::{DiscreteBody, plain, vector};
use super::{Scene, SolverMethod};
use crate::bonds::{Bonds, Property};
use crate::calibrate::Space;
use crate::contact::{Contact, GripInterface, PAIR_STIFFNESS, PLANE_STIFFNESS, RigidPlane, grips};
use crate::error::Error;
use crate::solver::Loads;
use harness::scene::{SceneError, Source, check_name};
use polycore::units::{Length, Speed};
use serde::Deserialize;

/// Largest stiffness s: above it no method converges.
const STIFFEST: f64 = 1e4;
/// Largest coefficient of friction.
const ROUGHEST: f64 = 100.0;

/// Contact between particles that no intact bond joins, and with planes.
#[derive(Clone, Debug, Default, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ContactSpec {
    /// Stiffness s: a contact of two bodies is as compliant as 2/s layers of confined material, a contact
    /// with a plane as 1/s layers; 0 only records overlaps. Default: 2; for planes in equilibrium 10.
    pub stiffness: Option<f64>,
    /// Stiffness κ of a contact of particles over that of a bond as long as the horizon, instead of
    /// `stiffness`; 15 in the literature.
    pub short_range: Option<f64>,
    /// Coefficient of Coulomb friction μ between particles, and of planes without `friction`.
    pub friction: f64,
    /// Elastic slip γ of sticking contacts at the force at which they begin to slide; default: the slip at
    /// which tangential and normal stiffness are equal.
    #[serde(alias = "slip_length")]
    pub elastic_slip: Option<Length>,
    /// Ignored; kept for older scenes. Sticking friction holds by its elastic slip.
    pub slip_velocity: Option<Speed>,
    /// Holds regions of prescribed displacement at the surface of a solid instead of by bonds across it,
    /// which are as compliant as a layer of the body. Default: true beside planes, unless bonds break.
    pub tied_grips: Option<bool>,
    /// Rigid planes.
    pub plane: Vec<PlaneSpec>,
}

/// A rigid plane (a line in a plane body) that the body cannot pass.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlaneSpec {
    /// Name in curves and values; default: `plane` and its number.
    pub name: Option<String>,
    /// A point of the plane.
    pub point: Vec<Length>,
    /// Normal of any length, towards the body.
    pub normal: Vec<f64>,
    /// Stiffness s of the plane; default: `contact.stiffness` if above 0, else 10, in explicit dynamics 2.
    pub stiffness: Option<f64>,
    /// Coefficient of friction; default: `contact.friction`.
    pub friction: Option<f64>,
    /// Ties the faces of the body that lie on the plane at the start, in all directions; default: false.
    #[serde(default)]
    pub bonded: bool,
    /// Displacement at the end of the last step; the plane follows the load factor.
    pub displacement: Option<Vec<Length>>,
    /// Velocity, in explicit dynamics; added to the displacement.
    pub velocity: Option<Vec<Speed>>,
}

impl PlaneSpec {
    /// Returns its name; default: `plane` and its number.
    pub fn name(&self, index: usize) -> String {
        self.name.clone().unwrap_or_else(|| format!("plane{}", index + 1))
    }
}

impl Scene {
    /// Returns true for a lattice beside rigid planes.
    pub fn is_beside_planes(&self) -> bool {
        self.body.points.is_none() && self.contact.as_ref().is_some_and(|contact| !contact.plane.is_empty())
    }
}

impl ContactSpec {
    /// Returns the stiffness s of ties: that of the stiffest plane.
    pub fn tie_stiffness(&self, explicit: bool) -> f64 {
        let planes = self.plane.iter().map(|plane| self.stiffness_of(plane, explicit));
        planes.fold(if explicit { PAIR_STIFFNESS } else { PLANE_STIFFNESS }, f64::max)
    }

    /// Returns the stiffness s of pairs of particles.
    pub fn pair_stiffness(&self) -> f64 {
        self.stiffness.unwrap_or(PAIR_STIFFNESS)
    }

    /// Returns true where particles repel each other.
    pub fn has_pairs(&self) -> bool {
        self.short_range.unwrap_or(self.pair_stiffness()) > 0.0
    }

    /// Returns the stiffness s of a plane.
    pub fn stiffness_of(&self, plane: &PlaneSpec, explicit: bool) -> f64 {
        let own = if explicit { PAIR_STIFFNESS } else { PLANE_STIFFNESS };
        plane.stiffness.or(self.stiffness.filter(|&s| s > 0.0)).unwrap_or(own)
    }

    /// Returns the coefficient of friction of a plane.
    fn friction_of(&self, plane: &PlaneSpec) -> f64 {
        plane.friction.unwrap_or(self.friction)
    }

    /// Returns true if any coefficient of friction is above 0.
    pub fn has_friction(&self) -> bool {
        (self.friction > 0.0 && self.has_pairs())
            || self.plane.iter().any(|plane| self.friction_of(plane) > 0.0 && !plane.bonded)
    }

    /// Converts a plane.
    ///
    /// # Errors
    /// As [`super::check`].
    fn plane_in<const D: usize>(
        &self,
        source: &Source,
        key: &str,
        spec: &PlaneSpec,
        explicit: bool,
    ) -> Result<RigidPlane<D>, SceneError> {
        let (point, normal) = plane_of(source, key, &spec.point, &spec.normal)?;
        let none = [0.0; D];
        let displacement = spec.displacement.as_ref();
        let displacement =
            displacement.map_or(Ok(none), |v| vector(source, &format!("{key}.displacement"), v))?;
        let velocity = match &spec.velocity {
            None => none,
            Some(given) => {
                let values: Vec<f64> = given.iter().map(|v| v.si()).collect();
                <[f64; D]>::try_from(values.as_slice()).map_err(|_| {
                    let found = format!("{} components", values.len());
                    source.error(&format!("{key}.velocity"), found, format!("{D} components"))
                })?
            }
        };
        Ok(RigidPlane {
            point,
            normal,
            stiffness: self.stiffness_of(spec, explicit),
            friction: self.friction_of(spec),
            elastic_slip: self.elastic_slip.map(|slip| slip.si()),
            bonded: spec.bonded,
            displacement,
            velocity,
        })
    }

    /// Converts all planes; `explicit` selects the default stiffness of explicit dynamics.
    ///
    /// # Errors
    /// As [`super::check`].
    pub fn planes<const D: usize>(
        &self,
        source: &Source,
        explicit: bool,
    ) -> Result<Vec<RigidPlane<D>>, SceneError> {
        let each = self.plane.iter().enumerate();
        each.map(|(index, plane)| self.plane_in(source, &format!("contact.plane[{index}]"), plane, explicit))
            .collect()
    }

    /// Builds the contact of a body with bond modulus kθ = `micromodulus` and longitudinal modulus `modulus`.
    ///
    /// # Errors
    /// As [`Contact::with_planes`]; none after [`super::check`].
    pub fn contact<const D: usize>(
        &self,
        planes: Vec<RigidPlane<D>>,
        body: &DiscreteBody<D>,
        micromodulus: f64,
        modulus: &Property,
        tied: Option<(&[bool], f64)>,
    ) -> Result<Contact<D>, Error> {
        let bonds = &*body.bonds;
        let contact = match self.short_range {
            Some(short_range) => Contact::short_range(bonds, micromodulus, short_range)?,
            None => Contact::new(bonds, modulus.clone(), self.pair_stiffness())?,
        };
        let contact = contact.with_friction(self.friction, self.elastic_slip.map(|slip| slip.si()))?;
        let outside = body.surface();
        let (Some((held, stiffness)), Some(lattice)) = (tied, bonds.as_lattice()) else {
            return contact.with_planes(bonds, &outside, modulus.clone(), planes);
        };
        let interface = GripInterface::new(lattice, held);
        let surface = outside.clone().bounded_by(&interface.surface);
        contact.with_planes(bonds, &surface, modulus.clone(), planes)?.with_tied(
            lattice,
            interface,
            &outside,
            modulus.greatest(),
            stiffness,
        )
    }
}

/// Returns the particles of grips that are tied at their surface, by site; `None` without any.
///
/// # Errors
/// `tied_grips` of a bond law or a cloud.
pub fn tied_grips<const D: usize>(
    source: &Source,
    scene: &Scene,
    bonds: &dyn Bonds<D>,
    loads: &Loads<D>,
) -> Result<Option<Vec<bool>>, SceneError> {
    let Some(contact) = &scene.contact else { return Ok(None) };
    let can = scene.material.solid.is_some() && bonds.as_lattice().is_some();
    if contact.tied_grips == Some(true) && !can {
        let allowed = "false: only solids (`[material.solid]`) on a lattice have faces to tie";
        return Err(source.error("contact.tied_grips", "true", allowed));
    }
    let default = can && !contact.plane.is_empty() && !scene.breaks();
    let Some(lattice) = bonds.as_lattice().filter(|_| contact.tied_grips.unwrap_or(default)) else {
        return Ok(None);
    };
    let held = grips(lattice, &loads.constrained);
    let free = bonds.particles().iter().any(|&site| !held[site as usize]);
    Ok((free && held.contains(&true)).then_some(held))
}

/// Checks what needs no body.
///
/// # Errors
/// A [`SceneError`] that names the key, the value found and what is allowed.
pub(super) fn check(source: &Source, scene: &Scene) -> Result<(), SceneError> {
    let Some(contact) = &scene.contact else { return Ok(()) };
    let explicit = scene.method() == SolverMethod::Verlet;
    let stiff = |key: &str, found: f64| {
        let allowed = format!("0 to {}", plain(STIFFEST));
        if (0.0..=STIFFEST).contains(&found) { Ok(()) } else { Err(source.error(key, plain(found), allowed)) }
    };
    let rough = |key: &str, found: f64| {
        let allowed = format!("0 to {ROUGHEST}");
        if (0.0..=ROUGHEST).contains(&found) { Ok(()) } else { Err(source.error(key, plain(found), allowed)) }
    };
    stiff("contact.stiffness", contact.pair_stiffness())?;
    stiff("contact.short_range", contact.short_range.unwrap_or(0.0))?;
    if contact.short_range.is_some() && contact.stiffness.is_some() {
        let why = "`stiffness` follows the material, `short_range` is the κ of the literature";
        return Err(source.conflict("contact.short_range", "stiffness", why));
    }
    rough("contact.friction", contact.friction)?;
    for (index, plane) in contact.plane.iter().enumerate() {
        let key = |name: &str| format!("contact.plane[{index}].{name}");
        stiff(&key("stiffness"), contact.stiffness_of(plane, explicit))?;
        rough(&key("friction"), contact.friction_of(plane))?;
        let name = plane.name(index);
        check_name(source, &key("name"), &name)?;
        if contact.plane[..index].iter().enumerate().any(|(other, plane)| plane.name(other) == name) {
            return Err(source.error(&key("name"), format!("`{name}` twice"), "different names"));
        }
        if plane.velocity.is_some() && !explicit {
            let why = format!(
                "needs `solver.method = \"verlet\"`; with `{}` write `displacement`",
                scene.method().name()
            );
            return Err(source.unexpected(&key("velocity"), why));
        }
    }
    if scene.body.space == Space::Solid {
        contact.planes::<3>(source, explicit)?;
    } else {
        contact.planes::<2>(source, explicit)?;
    }
    match contact.elastic_slip {
        Some(slip) => super::values::positive(source, "contact.elastic_slip", slip.si(), "m"),
        None => Ok(()),
    }
}
