//! What a scene says of contact: between particles, and with rigid planes.

use super::line::plane_of;
use super::values::{plain, vector};
use super::{Method, Scene};
use crate::bonds::Bonds;
use crate::calibrate::Space;
use crate::contact::{Contact, Plane, STIFFNESS};
use crate::error::Error;
use crate::quantities as q;
use polycore::report::Named;
use polycore::scene::{SceneError, Source, check_name};
use polycore::units::{Length, Speed};
use serde::Deserialize;

/// Stiffest contact, beyond which no method would get anywhere, and stiffest one that L-BFGS can follow.
const STIFFEST: f64 = 1e4;
const STIFFEST_OF_LBFGS: f64 = 100.0;
/// Largest coefficient of friction.
const ROUGHEST: f64 = 100.0;

/// Contact between particles that no intact bond joins, and with planes.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ContactSpec {
    /// κ: stiffness of a contact over that of a bond as long as the horizon; 0 only shows how particles overlap.
    pub stiffness: f64,
    /// Coefficient of Coulomb friction μ between particles, and of planes that have none of their own.
    pub friction: f64,
    /// v_ε: slip velocity from which on friction resists in full.
    pub slip_velocity: Option<Speed>,
    /// ε: slip in a load step from which on friction resists in full, of quasi-static methods.
    pub slip_length: Option<Length>,
    /// Rigid planes.
    pub plane: Vec<PlaneSpec>,
}

impl Default for ContactSpec {
    fn default() -> Self {
        Self {
            stiffness: STIFFNESS,
            friction: 0.0,
            slip_velocity: None,
            slip_length: None,
            plane: Vec::new(),
        }
    }
}

/// A rigid plane (a line in a plane body) that the body cannot pass.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlaneSpec {
    /// Its name in curves and values; default: `plane` and its number.
    pub name: Option<String>,
    /// A point of the plane.
    pub point: Vec<Length>,
    /// Its normal, of any length, towards the body.
    pub normal: Vec<f64>,
    /// κ of the plane; default: that of `contact`, or 15 where that is 0.
    pub stiffness: Option<f64>,
    /// Its coefficient of friction; default: that of `contact`.
    pub friction: Option<f64>,
    /// Displacement at the end of the last step; the plane follows the load factor.
    pub displacement: Option<Vec<Length>>,
    /// Velocity, in explicit dynamics; added to the displacement.
    pub velocity: Option<Vec<Speed>>,
}

impl PlaneSpec {
    /// Its own name, or its number.
    pub fn name(&self, index: usize) -> String {
        self.name.clone().unwrap_or_else(|| format!("plane{}", index + 1))
    }
}

impl ContactSpec {
    /// κ of a plane.
    fn stiffness_of(&self, plane: &PlaneSpec) -> f64 {
        plane.stiffness.unwrap_or(if self.stiffness > 0.0 { self.stiffness } else { STIFFNESS })
    }

    /// μ of a plane.
    fn friction_of(&self, plane: &PlaneSpec) -> f64 {
        plane.friction.unwrap_or(self.friction)
    }

    /// Whether any coefficient of friction is above 0.
    pub fn rubs(&self) -> bool {
        self.friction > 0.0 || self.plane.iter().any(|plane| self.friction_of(plane) > 0.0)
    }

    /// The plane in its dimension.
    ///
    /// # Errors
    /// As [`super::check`].
    fn plane_in<const D: usize>(
        &self,
        source: &Source,
        key: &str,
        spec: &PlaneSpec,
    ) -> Result<Plane<D>, SceneError> {
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
        let (stiffness, friction) = (self.stiffness_of(spec), self.friction_of(spec));
        Ok(Plane { point, normal, stiffness, friction, displacement, velocity })
    }

    /// All planes.
    ///
    /// # Errors
    /// As [`super::check`].
    pub fn planes<const D: usize>(&self, source: &Source) -> Result<Vec<Plane<D>>, SceneError> {
        let each = self.plane.iter().enumerate();
        each.map(|(index, plane)| self.plane_in(source, &format!("contact.plane[{index}]"), plane)).collect()
    }

    /// Contact of a body of the bond modulus `modulus`.
    ///
    /// # Errors
    /// As [`Contact::new`]; none of a scene that is checked.
    pub fn contact<const D: usize>(
        &self,
        planes: Vec<Plane<D>>,
        bonds: &dyn Bonds<D>,
        modulus: f64,
    ) -> Result<Contact<D>, Error> {
        let contact = Contact::new(bonds, modulus, self.stiffness)?;
        let slip = self.slip_length.map(|l| l.si()).or(self.slip_velocity.map(|v| v.si()));
        let contact = contact.with_friction(self.friction, slip.unwrap_or(0.0))?;
        planes.into_iter().try_fold(contact, |contact, plane| contact.with_plane(bonds, plane))
    }
}

/// Values of all planes of a scene: forces along the axes, area, spread.
pub(super) fn values(scene: &Scene) -> impl Iterator<Item = Named> {
    let axes = if scene.body.space == Space::Solid { 3 } else { 2 };
    let planes = scene.contact.iter().flat_map(|contact| contact.plane.iter().enumerate());
    planes.flat_map(move |(index, plane)| of_plane(&plane.name(index), axes))
}

/// Values of a plane: forces along the axes, area, spread.
pub fn of_plane(name: &str, axes: usize) -> Vec<Named> {
    let forces = ["x", "y", "z"].into_iter().take(axes).map(|axis| q::PLANE_FORCE.of(&[name, axis]));
    forces.chain([q::PLANE_AREA.of(&[name]), q::PLANE_SPREAD.of(&[name])]).collect()
}

/// Checks what can be judged without a body.
///
/// # Errors
/// The key, what was found and what is allowed.
pub(super) fn check(source: &Source, scene: &Scene) -> Result<(), SceneError> {
    let Some(contact) = &scene.contact else { return Ok(()) };
    let stiff = |key: &str, found: f64| {
        let of_lbfgs = scene.method() == Method::Lbfgs;
        let (most, why) = match (0.0..=STIFFEST).contains(&found) {
            true if of_lbfgs => (STIFFEST_OF_LBFGS, " with `lbfgs`, more with `adr`"),
            _ => (STIFFEST, ""),
        };
        let allowed = format!("0 to {}{why}", plain(most));
        if (0.0..=most).contains(&found) { Ok(()) } else { Err(source.error(key, plain(found), allowed)) }
    };
    let rough = |key: &str, found: f64| {
        let allowed = format!("0 to {ROUGHEST}");
        if (0.0..=ROUGHEST).contains(&found) { Ok(()) } else { Err(source.error(key, plain(found), allowed)) }
    };
    stiff("contact.stiffness", contact.stiffness)?;
    rough("contact.friction", contact.friction)?;
    for (index, plane) in contact.plane.iter().enumerate() {
        let key = |name: &str| format!("contact.plane[{index}].{name}");
        stiff(&key("stiffness"), contact.stiffness_of(plane))?;
        rough(&key("friction"), contact.friction_of(plane))?;
        let name = plane.name(index);
        check_name(source, &key("name"), &name)?;
        if contact.plane[..index].iter().enumerate().any(|(other, plane)| plane.name(other) == name) {
            return Err(source.error(&key("name"), format!("`{name}` twice"), "different names"));
        }
        if plane.velocity.is_some() && scene.method() != Method::Verlet {
            let allowed = "`displacement`, or `solver.method = \"verlet\"`";
            return Err(source.error(&key("velocity"), "`velocity` of a quasi-static method", allowed));
        }
    }
    if scene.body.space == Space::Solid {
        contact.planes::<3>(source)?;
    } else {
        contact.planes::<2>(source)?;
    }
    let explicit = scene.method() == Method::Verlet;
    let (velocity, length) = (contact.slip_velocity.map(|v| v.si()), contact.slip_length.map(|l| l.si()));
    let [own, other] = [("slip_velocity", velocity, "m/s"), ("slip_length", length, "m")];
    let ([key, foreign], slip, unit, wrong) = match explicit {
        true => ([own.0, other.0], own.1, own.2, other.1),
        false => ([other.0, own.0], other.1, other.2, own.1),
    };
    let kind = if explicit { "explicit dynamics" } else { "a quasi-static method" };
    if wrong.is_some() {
        let found = format!("`{foreign}` of {kind}");
        return Err(source.error(&format!("contact.{foreign}"), found, format!("`{key}`")));
    }
    match slip {
        Some(slip) => super::values::positive(source, &format!("contact.{key}"), slip, unit),
        None if contact.rubs() => {
            let allowed =
                format!("a value: friction in {kind} needs it, as the slip from which on it resists in full");
            Err(source.error(&format!("contact.{key}"), "nothing", allowed))
        }
        None => Ok(()),
    }
}
