//! Indenters of a scene: rigid spheres, cylinders, planes and surfaces of STL files with a displacement or a
//! force of their own.

use super::contact::motion;
use super::curve_spec::CurveList;
use super::line::plane_of;
use super::values::{plain, required, vector};
use super::{ContactSpec, Scene, SolverMethod};
use crate::contact::{Inertia, RigidSurface};
use crate::geometry::{Enclosure, SignedDistance, length};
use harness::scene::{SceneError, Source};
use polycore::units::{Force, Length, Mass, Speed};
use serde::Deserialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A rigid sphere (in a plane body a circle), cylinder, plane or closed surface that the body cannot pass.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IndenterSpec {
    /// Name in curves and values; default: `indenter` and its number.
    pub name: Option<String>,
    /// Centre of a sphere or circle, a point of the axis of a cylinder, a point of a plane; of a `file` the
    /// place of its origin, by default that of the scene.
    pub point: Option<Vec<Length>>,
    /// Closed surface of an STL file, in a solid.
    pub file: Option<PathBuf>,
    /// Length of a unit of the file.
    pub unit: Option<Length>,
    /// Radius of a sphere, circle or cylinder.
    pub radius: Option<Length>,
    /// Direction of the axis of a cylinder, of any length, in a solid.
    pub axis: Option<Vec<f64>>,
    /// Normal of a plane, of any length, towards the body.
    pub normal: Option<Vec<f64>>,
    /// Stiffness s; default: `contact.stiffness` if above 0, else 10, in explicit dynamics 2.
    pub stiffness: Option<f64>,
    /// Coefficient of friction; default: `contact.friction`.
    pub friction: Option<f64>,
    /// Displacement at the end of the last step; it follows the load factor.
    pub displacement: Option<Vec<Length>>,
    /// Velocity, in explicit dynamics, with `[[step]]` in explicit steps; added to the displacement. With
    /// `mass` that at the start.
    pub velocity: Option<Vec<Speed>>,
    /// Mass, in explicit dynamics: contact and `force` accelerate the indenter, which does not turn; in a
    /// plane body that of its thickness.
    pub mass: Option<Mass>,
    /// Force on the indenter at the end of the last step instead of a displacement, in equilibrium: it moves
    /// along the force only, from where it first touches the body at rest. It stays in a later `[[step]]`. In
    /// explicit dynamics on an indenter with a `mass`.
    pub force: Option<Vec<Force>>,
    /// Curve of time that multiplies `displacement` or `force` instead of the load factor; of a displacement
    /// also one for each component.
    pub curve: Option<CurveList>,
}

impl IndenterSpec {
    /// Returns its name; default: `indenter` and its number.
    pub fn name(&self, index: usize) -> String {
        self.name.clone().unwrap_or_else(|| format!("indenter{}", index + 1))
    }

    /// Returns true if it is pressed on the body.
    pub fn is_driven(&self) -> bool {
        self.displacement.is_some() || self.force.is_some()
    }

    /// Converts the indenter.
    ///
    /// # Errors
    /// As [`super::check`].
    pub(super) fn surface<const D: usize>(
        &self,
        source: &Source,
        key: &str,
        contact: &ContactSpec,
        explicit: bool,
    ) -> Result<RigidSurface<D>, SceneError> {
        let surface = match &self.file {
            Some(file) => self.faceted(source, key, file)?,
            None => self.shaped(source, key)?,
        };
        let (displacement, velocity) =
            motion(source, key, self.displacement.as_deref(), self.velocity.as_deref())?;
        let force = match &self.force {
            None => None,
            Some(force) => Some(self.force(source, key, force)?),
        };
        let inertia = self.mass.map(|mass| Inertia { mass: mass.si(), force: force.unwrap_or([0.0; D]) });
        Ok(RigidSurface {
            stiffness: contact.stiffness_of(self.stiffness, explicit),
            friction: contact.friction_of(self.friction),
            elastic_slip: contact.elastic_slip.map(|slip| slip.si()),
            displacement,
            velocity,
            force: force.filter(|_| inertia.is_none()),
            inertia,
            ..surface
        })
    }

    /// Reads the closed surface of a file.
    ///
    /// # Errors
    /// As [`super::check`]; a file that cannot be read, or whose surface is not closed.
    fn faceted<const D: usize>(
        &self,
        source: &Source,
        key: &str,
        file: &Path,
    ) -> Result<RigidSurface<D>, SceneError> {
        let file_key = format!("{key}.file");
        let others = [
            ("radius", self.radius.is_some()),
            ("normal", self.normal.is_some()),
            ("axis", self.axis.is_some()),
        ];
        if let Some((name, _)) = others.into_iter().find(|(_, given)| *given) {
            return Err(source.conflict(&file_key, name, "the shape is that of the file"));
        }
        if D == 2 {
            return Err(source.error(&file_key, "a surface in a plane body", "a `radius` or a `normal`"));
        }
        let ending = file.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        if ending != "stl" {
            return Err(source.error(&file_key, format!("`{}`", file.display()), "a closed surface, `.stl`"));
        }
        let unit = required(source, &format!("{key}.unit"), self.unit, "the file has none")?.si();
        super::values::positive(source, &format!("{key}.unit"), unit, "m")?;
        let point = match &self.point {
            Some(point) => vector(source, &format!("{key}.point"), point)?,
            None => [0.0; D],
        };
        let read = meshfile::stl::read(&source.file(file), unit)
            .map_err(|error| source.refused(&file_key, error.to_string()))?;
        let corner = |node: u32| -> [f64; D] { std::array::from_fn(|d| read.points[node as usize][d]) };
        let facet = |nodes: &[u32; 3]| std::array::from_fn(|k| corner(nodes[k.min(2)]));
        let body = Enclosure::new(read.triangles.iter().map(facet).collect())
            .map_err(|error| source.refused(&file_key, format!("{}: {error}", file.display())))?;
        Ok(RigidSurface::facets(point, Arc::new(SignedDistance::new(body))))
    }

    /// Notes of the reader of its file.
    pub(super) fn notes(&self, source: &Source) -> Vec<String> {
        let Some((file, unit)) = self.file.as_ref().zip(self.unit) else { return Vec::new() };
        meshfile::stl::read(&source.file(file), unit.si()).map(|read| read.notes).unwrap_or_default()
    }

    /// Converts a plane, sphere or cylinder.
    ///
    /// # Errors
    /// As [`super::check`].
    fn shaped<const D: usize>(&self, source: &Source, key: &str) -> Result<RigidSurface<D>, SceneError> {
        if self.unit.is_some() {
            return Err(source.unexpected(&format!("{key}.unit"), "the unit of a `file`"));
        }
        let point_key = format!("{key}.point");
        let Some(place) = &self.point else {
            return Err(source.missing(&point_key, "the place of the indenter at the start"));
        };
        let point = vector(source, &point_key, place)?;
        Ok(match (&self.radius, &self.normal) {
            (Some(_), Some(_)) => {
                let why = "a plane has a `normal`, a sphere or cylinder a `radius`";
                return Err(source.conflict(&format!("{key}.normal"), "radius", why));
            }
            (None, None) => {
                let why = "a `radius` of a sphere, circle or cylinder, the `normal` of a plane, or a `file`";
                return Err(source.missing(&format!("{key}.radius"), why));
            }
            (None, Some(normal)) => {
                if self.axis.is_some() {
                    let why = "the axis of a cylinder, which has a `radius`; a plane has a `normal` only";
                    return Err(source.unexpected(&format!("{key}.axis"), why));
                }
                let (point, normal) = plane_of(source, key, place, normal)?;
                RigidSurface::plane(point, normal)
            }
            (Some(radius), None) => {
                super::values::positive(source, &format!("{key}.radius"), radius.si(), "m")?;
                match &self.axis {
                    None => RigidSurface::sphere(point, radius.si()),
                    Some(axis) => {
                        let key = format!("{key}.axis");
                        if D == 2 {
                            let why = "a plane body has circles, whose axis is z";
                            return Err(source.unexpected(&key, why));
                        }
                        let Ok(axis) = <[f64; D]>::try_from(axis.as_slice()) else {
                            let found = format!("{} components", axis.len());
                            return Err(source.error(&key, found, format!("{D} components")));
                        };
                        if !length(axis).is_normal() {
                            let allowed = "finite numbers, not all of them 0";
                            return Err(source.error(&key, format!("{axis:?}"), allowed));
                        }
                        let size = length(axis);
                        RigidSurface::cylinder(point, axis.map(|x| x / size), radius.si())
                    }
                }
            }
        })
    }

    fn force<const D: usize>(
        &self,
        source: &Source,
        key: &str,
        force: &[Force],
    ) -> Result<[f64; D], SceneError> {
        let key = format!("{key}.force");
        if self.displacement.is_some() {
            let why = "an indenter has a force or a displacement";
            return Err(source.conflict(&key, "displacement", why));
        }
        let values: Vec<f64> = force.iter().map(|f| f.si()).collect();
        let Ok(values) = <[f64; D]>::try_from(values.as_slice()) else {
            let found = format!("{} components", values.len());
            return Err(source.error(&key, found, format!("{D} components")));
        };
        if !length(values).is_normal() {
            return Err(source.error(&key, "no force", "components of which one is not 0, finite"));
        }
        Ok(values)
    }
}

/// Checks what needs no body.
///
/// # Errors
/// A [`SceneError`] that names the key, the value found and what is allowed.
pub(super) fn check(source: &Source, scene: &Scene, contact: &ContactSpec) -> Result<(), SceneError> {
    let explicit = scene.method() == SolverMethod::Verlet;
    for (index, indenter) in contact.indenter.iter().enumerate() {
        let key = |name: &str| format!("contact.indenter[{index}].{name}");
        if indenter.velocity.is_some() && !scene.has_dynamics() {
            let why = format!(
                "needs `solver.method = \"verlet\"`; with `{}` write `displacement`",
                scene.method().name()
            );
            return Err(source.unexpected(&key("velocity"), why));
        }
        if let Some(mass) = indenter.mass {
            super::values::positive(source, &key("mass"), mass.si(), "kg")?;
            let others = [
                ("displacement", indenter.displacement.is_some(), "contact and a `force` move a mass"),
                ("step", scene.later || !scene.step.is_empty(), "a mass flies in a scene of one step"),
            ];
            if let Some((other, _, why)) = others.into_iter().find(|(_, given, _)| *given) {
                return Err(source.conflict(&key("mass"), other, why));
            }
            if !explicit {
                let why = "only explicit dynamics has masses; in equilibrium write `displacement` or `force`";
                return Err(source.unexpected(&key("mass"), why));
            }
        }
        if indenter.force.is_none() && indenter.mass.is_none() {
            continue;
        }
        if explicit && indenter.mass.is_none() {
            let why = "its inertia: explicit dynamics moves an indenter without one by `displacement` or \
                       `velocity`";
            return Err(source.missing(&key("mass"), why));
        }
        if contact.stiffness_of(indenter.stiffness, explicit) == 0.0 {
            return Err(source.error(
                &key("stiffness"),
                0,
                "above 0 of an indenter with a `force` or a `mass`",
            ));
        }
        if indenter.force.is_none() || explicit {
            continue;
        }
        let follows = indenter.curve.is_none() && !scene.later;
        let factors = if follows { scene.programme().0 } else { Vec::new() };
        if let Some(factor) = factors.into_iter().find(|factor| *factor < 0.0) {
            let found = format!("a load factor of {}", plain(factor));
            let allowed = "factors of 0 and above: an indenter pushes and never pulls";
            return Err(source.error(&key("force"), found, allowed));
        }
    }
    Ok(())
}

/// Longest way of an indenter in one step of an equilibrium, m.
fn longest_step<const D: usize>(scene: &Scene, surface: &RigidSurface<D>) -> f64 {
    let factors = scene.load_steps().0;
    let starts = std::iter::once(0.0).chain(factors.iter().copied());
    let way = |(from, to): (f64, &f64)| {
        let [before, after] = [from, *to].map(|factor| surface.displacement_at(factor));
        length(std::array::from_fn::<f64, D, _>(|d| after[d] - before[d]))
    };
    starts.zip(&factors).map(way).fold(0.0, f64::max)
}

/// Refuses steps of an indenter longer than half its size, m.
///
/// # Errors
/// A [`SceneError`] that names the longest step.
pub(super) fn refuse_leap<const D: usize>(
    source: &Source,
    scene: &Scene,
    (key, surface): (&str, &RigidSurface<D>),
    half: f64,
    size: &str,
) -> Result<(), SceneError> {
    let most = longest_step(scene, surface);
    if most <= half || scene.method() == SolverMethod::Verlet {
        return Ok(());
    }
    let found =
        format!("a step of {} mm, longer than {size}: it could pass a part of the body", plain(most * 1e3));
    let allowed = format!("steps of {size} or less: more `solver.steps` or shorter steps of the programme");
    Err(source.error(key, found, allowed))
}
