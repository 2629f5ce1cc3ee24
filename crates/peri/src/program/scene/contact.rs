//! Contact settings of a scene: between particles, and with rigid surfaces.

use super::IndenterSpec;
use super::curve_spec::CurveList;
use super::line::plane_of;
use super::surface_curve::{CurvedSurface, surface_amplitudes};
use super::values::{DiscreteBody, plain, vector};
use super::{Scene, SolverMethod};
use crate::bonds::{Bonds, Property};
use crate::calibrate::Space;
use crate::contact::{Contact, GripInterface, PAIR_STIFFNESS, PLANE_STIFFNESS, RigidSurface, grips};
use crate::error::Error;
use crate::solver::Loads;
use harness::scene::{SceneError, Source, check_name};
use polycore::units::{Length, Speed};
use serde::Deserialize;

/// Largest stiffness s: above it no method converges.
const STIFFEST: f64 = 1e4;
/// Largest coefficient of friction.
const ROUGHEST: f64 = 100.0;
/// Name of the contact of particles in files and pictures.
pub const PARTICLES: &str = "particles";

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
    /// Coefficient of Coulomb friction μ between particles, and of planes and indenters without `friction`.
    pub friction: f64,
    /// Elastic slip γ of sticking contacts at the force at which they begin to slide; default: the slip at
    /// which tangential and normal stiffness are equal.
    #[serde(alias = "slip_length")]
    pub elastic_slip: Option<Length>,
    /// Ignored; kept for older scenes. Sticking friction holds by its elastic slip.
    pub slip_velocity: Option<Speed>,
    /// Holds regions of prescribed displacement at the surface of a solid instead of by bonds across it,
    /// which are as compliant as a layer of the body. Default: true beside planes and indenters, unless bonds
    /// break.
    pub tied_grips: Option<bool>,
    /// Rigid planes.
    pub plane: Vec<PlaneSpec>,
    /// Rigid spheres, cylinders and planes, by displacement or by force.
    pub indenter: Vec<IndenterSpec>,
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
    /// Ties the faces of the body that lie on the plane at the start, in all directions; others touch it
    /// without friction; default: false.
    #[serde(default)]
    pub bonded: bool,
    /// Displacement at the end of the last step; the plane follows the load factor, and stays there in a
    /// later `[[step]]`.
    pub displacement: Option<Vec<Length>>,
    /// Velocity, in explicit dynamics, with `[[step]]` in explicit steps; added to the displacement.
    pub velocity: Option<Vec<Speed>>,
    /// Curve of time that multiplies `displacement`, or one for each component, instead of the load factor.
    pub curve: Option<CurveList>,
}

impl PlaneSpec {
    /// Returns its name; default: `plane` and its number.
    pub fn name(&self, index: usize) -> String {
        self.name.clone().unwrap_or_else(|| format!("plane{}", index + 1))
    }
}

impl Scene {
    /// Returns true for a lattice beside rigid surfaces.
    pub fn is_beside_surfaces(&self) -> bool {
        self.body.points.is_none() && self.contact.as_ref().is_some_and(ContactSpec::has_surfaces)
    }
}

impl ContactSpec {
    /// Returns true if it has rigid planes or indenters.
    pub fn has_surfaces(&self) -> bool {
        !self.plane.is_empty() || !self.indenter.is_empty()
    }

    /// Returns the names of all rigid surfaces: planes, then indenters.
    pub fn surface_names(&self) -> Vec<String> {
        let planes = self.plane.iter().enumerate().map(|(index, plane)| plane.name(index));
        planes.chain(self.indenter.iter().enumerate().map(|(index, own)| own.name(index))).collect()
    }

    /// Returns true if a curve of time moves or presses a rigid surface.
    pub(super) fn has_curve(&self) -> bool {
        self.plane.iter().any(|plane| plane.curve.is_some())
            || self.indenter.iter().any(|indenter| indenter.curve.is_some())
    }

    /// Lists what moves all rigid surfaces: planes, then indenters.
    pub(super) fn curved_surfaces(&self) -> Vec<CurvedSurface<'_>> {
        let planes = self.plane.iter().enumerate().map(|(index, plane)| CurvedSurface {
            key: format!("contact.plane[{index}]"),
            curve: plane.curve.as_ref(),
            displacement: plane.displacement.as_deref(),
            force: None,
        });
        let indenters = self.indenter.iter().enumerate().map(|(index, indenter)| CurvedSurface {
            key: format!("contact.indenter[{index}]"),
            curve: indenter.curve.as_ref(),
            displacement: indenter.displacement.as_deref(),
            force: indenter.force.as_deref(),
        });
        planes.chain(indenters).collect()
    }

    /// Returns the stiffness s of ties: that of the stiffest rigid surface.
    pub fn tie_stiffness(&self, explicit: bool) -> f64 {
        let own = self.plane.iter().map(|plane| plane.stiffness);
        let own = own.chain(self.indenter.iter().map(|indenter| indenter.stiffness));
        own.map(|own| self.stiffness_of(own, explicit))
            .fold(if explicit { PAIR_STIFFNESS } else { PLANE_STIFFNESS }, f64::max)
    }

    /// Returns the stiffness s of pairs of particles.
    pub fn pair_stiffness(&self) -> f64 {
        self.stiffness.unwrap_or(PAIR_STIFFNESS)
    }

    /// Returns true where particles repel each other.
    pub fn has_pairs(&self) -> bool {
        self.short_range.unwrap_or(self.pair_stiffness()) > 0.0
    }

    /// Returns the stiffness s of a rigid surface with or without its `own`.
    pub fn stiffness_of(&self, own: Option<f64>, explicit: bool) -> f64 {
        let default = if explicit { PAIR_STIFFNESS } else { PLANE_STIFFNESS };
        own.or(self.stiffness.filter(|&s| s > 0.0)).unwrap_or(default)
    }

    /// Returns the coefficient of friction of a rigid surface with or without its `own`.
    pub(super) fn friction_of(&self, own: Option<f64>) -> f64 {
        own.unwrap_or(self.friction)
    }

    /// Returns true if any coefficient of friction is above 0.
    pub fn has_friction(&self) -> bool {
        (self.friction > 0.0 && self.has_pairs())
            || self.plane.iter().any(|plane| self.friction_of(plane.friction) > 0.0 && !plane.bonded)
            || self.indenter.iter().any(|indenter| self.friction_of(indenter.friction) > 0.0)
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
    ) -> Result<RigidSurface<D>, SceneError> {
        let (point, normal) = plane_of(source, key, &spec.point, &spec.normal)?;
        let (displacement, velocity) =
            motion(source, key, spec.displacement.as_deref(), spec.velocity.as_deref())?;
        Ok(RigidSurface {
            stiffness: self.stiffness_of(spec.stiffness, explicit),
            friction: self.friction_of(spec.friction),
            elastic_slip: self.elastic_slip.map(|slip| slip.si()),
            bonded: spec.bonded,
            displacement,
            velocity,
            ..RigidSurface::plane(point, normal)
        })
    }

    /// Converts all planes, then all indenters.
    ///
    /// # Errors
    /// As [`super::check`].
    pub fn surfaces<const D: usize>(
        &self,
        source: &Source,
        scene: &Scene,
    ) -> Result<Vec<RigidSurface<D>>, SceneError> {
        let explicit = scene.has_dynamics();
        let planes = self.plane.iter().enumerate();
        let planes = planes
            .map(|(index, plane)| self.plane_in(source, &format!("contact.plane[{index}]"), plane, explicit));
        let indenters = self.indenter.iter().enumerate();
        let indenters = indenters.map(|(index, indenter)| {
            indenter.surface(source, &format!("contact.indenter[{index}]"), self, explicit)
        });
        let names = self.surface_names().into_iter();
        let amplitudes = surface_amplitudes(source, scene, self)?;
        let all = planes.chain(indenters).zip(names.zip(amplitudes));
        let moving = scene.earlier.moving;
        all.map(|(surface, (name, amplitudes))| {
            let surface: RigidSurface<D> = surface?;
            Ok(RigidSurface { name, amplitudes, drift: surface.velocity.map(|v| moving * v), ..surface })
        })
        .collect()
    }

    /// Builds the contact of a body with bond modulus kθ = `micromodulus` and longitudinal modulus `modulus`.
    ///
    /// # Errors
    /// As [`Contact::with_surfaces`]; none after [`super::check`].
    pub fn contact<const D: usize>(
        &self,
        surfaces: Vec<RigidSurface<D>>,
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
            return contact.with_surfaces(bonds, &outside, modulus.clone(), surfaces);
        };
        let interface = GripInterface::new(lattice, held);
        let surface = outside.clone().bounded_by(&interface.surface);
        contact.with_surfaces(bonds, &surface, modulus.clone(), surfaces)?.with_tied(
            lattice,
            interface,
            &outside,
            modulus.greatest(),
            stiffness,
        )
    }
}

/// Converts the displacement at load factor 1, m, and the velocity, m/s, of a rigid surface; zero by default.
///
/// # Errors
/// As [`super::check`].
pub(super) fn motion<const D: usize>(
    source: &Source,
    key: &str,
    displacement: Option<&[Length]>,
    velocity: Option<&[Speed]>,
) -> Result<([f64; D], [f64; D]), SceneError> {
    let none = [0.0; D];
    let displacement =
        displacement.map_or(Ok(none), |v| vector(source, &format!("{key}.displacement"), v))?;
    let Some(given) = velocity else { return Ok((displacement, none)) };
    let values: Vec<f64> = given.iter().map(|v| v.si()).collect();
    let velocity = <[f64; D]>::try_from(values.as_slice()).map_err(|_| {
        let found = format!("{} components", values.len());
        source.error(&format!("{key}.velocity"), found, format!("{D} components"))
    })?;
    Ok((displacement, velocity))
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
    // each step holds regions of its own
    let alone = scene.step.is_empty() && !scene.later;
    let default = can && alone && contact.has_surfaces() && !scene.breaks();
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
    let own = |part: &super::Inclusion| part.stiffness != 1.0 || part.has_law() || part.solid.is_some();
    if let Some(index) =
        scene.material.inclusions.iter().position(own).filter(|_| contact.short_range.is_some())
    {
        let why = "κ refers to the modulus of one material; `stiffness` follows that of each part";
        return Err(source.conflict("contact.short_range", &format!("material.inclusions[{index}]"), why));
    }
    rough("contact.friction", contact.friction)?;
    let names = contact.surface_names();
    for (number, name) in names.iter().enumerate() {
        let indenter = number.checked_sub(contact.plane.len());
        let (key, own, friction) = match indenter {
            None => {
                let plane = &contact.plane[number];
                (format!("contact.plane[{number}]"), plane.stiffness, plane.friction)
            }
            Some(index) => {
                let indenter = &contact.indenter[index];
                (format!("contact.indenter[{index}]"), indenter.stiffness, indenter.friction)
            }
        };
        stiff(&format!("{key}.stiffness"), contact.stiffness_of(own, explicit))?;
        rough(&format!("{key}.friction"), contact.friction_of(friction))?;
        check_name(source, &format!("{key}.name"), name)?;
        if names[..number].contains(name) {
            let found = format!("`{name}` twice");
            return Err(source.error(&format!("{key}.name"), found, "different names"));
        }
    }
    for (index, plane) in contact.plane.iter().enumerate() {
        let key = |name: &str| format!("contact.plane[{index}].{name}");
        if plane.velocity.is_some() && !scene.has_dynamics() {
            let why = format!(
                "needs `solver.method = \"verlet\"`; with `{}` write `displacement`",
                scene.method().name()
            );
            return Err(source.unexpected(&key("velocity"), why));
        }
    }
    if scene.body.space == Space::Solid {
        contact.surfaces::<3>(source, scene)?;
    } else {
        contact.surfaces::<2>(source, scene)?;
    }
    super::indenter::check(source, scene, contact)?;
    match contact.elastic_slip {
        Some(slip) => super::values::positive(source, "contact.elastic_slip", slip.si(), "m"),
        None => Ok(()),
    }
}
