//! Forces on the mass of a body: gravity, the centrifugal force, formulas.

use super::curve::{CurveTime, Multiplied};
use super::curve_spec::CurveSpec;
use super::formula::{Formula, VectorFormula};
use super::inclusion::densities;
use super::rotation::direction;
use super::values::{DiscreteBody, ONE_OF_THEM, plain, positive, vector};
use super::{Scene, SolverMethod};
use crate::field::Field;
use crate::solver::{Centrifugal, CurvedRegion, ForceField, Loads, PlacedForce};
use harness::scene::{SceneError, Source};
use polycore::units::{Acceleration, AngularVelocity, Density, Length};
use serde::Deserialize;
use std::sync::Arc;

/// Force on all particles: an acceleration, a spin or formulas.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodyForceSpec {
    /// Acceleration of gravity, component by component.
    pub acceleration: Option<Vec<Acceleration>>,
    /// Rotation of the frame in which the body is seen: the centrifugal force on the deformed body.
    pub spin: Option<SpinSpec>,
    /// Force per reference volume, N/m³, as formulas of the reference position (m) and `t` (s).
    pub formula: Option<Vec<Formula>>,
    /// Mass density; default: that of `[dynamics]`.
    pub density: Option<Density>,
    /// Curve of time that multiplies acceleration, angular velocity or formulas; default: the load factor,
    /// or 1 for formulas of `t`.
    pub curve: Option<CurveSpec>,
}

/// Steady rotation about an axis.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpinSpec {
    /// A point of the axis.
    pub point: Vec<Length>,
    /// Direction of the axis, of any length, in a solid.
    pub axis: Option<Vec<f64>>,
    /// Angular velocity.
    pub angular_velocity: AngularVelocity,
}

impl BodyForceSpec {
    /// Returns true if the formulas depend on the time.
    pub fn depends_on_time(&self) -> bool {
        self.formula.iter().flatten().any(|formula| formula.find_variable_except("xyz").is_some())
    }

    /// Returns the key that needs a programme of times or dynamics.
    pub(super) fn timed(&self) -> Option<&'static str> {
        let keys = [("curve", self.curve.is_some()), ("formula", self.depends_on_time())];
        keys.into_iter().find_map(|(key, given)| given.then_some(key))
    }

    /// Returns true if it is not proportional to the load factor.
    pub fn is_curved(&self) -> bool {
        self.spin.is_some() || self.timed().is_some()
    }

    fn multiplied(&self) -> Multiplied {
        Multiplied {
            accelerations: self.acceleration.iter().flatten().map(|value| value.si()).collect(),
            speeds: self.spin.iter().map(|spin| spin.angular_velocity.si()).collect(),
            formulas: self.formula.is_some(),
            ..Multiplied::default()
        }
    }
}

/// Checks the forces of a scene, as far as they need no body.
///
/// # Errors
/// A [`SceneError`] that names the key, the value found and what is allowed.
pub(super) fn check(source: &Source, scene: &Scene) -> Result<(), SceneError> {
    for (index, force) in scene.body_force.iter().enumerate() {
        let key = |name: &str| format!("body_force[{index}].{name}");
        let kinds = [
            ("acceleration", force.acceleration.is_some()),
            ("spin", force.spin.is_some()),
            ("formula", force.formula.is_some()),
        ];
        let mut given = kinds.iter().filter(|(_, given)| *given).map(|(name, _)| *name);
        match (given.next(), given.next()) {
            (None, _) => {
                let why = "needed for a body force: `acceleration`, `spin` or `formula`";
                return Err(source.missing(&key("acceleration"), why));
            }
            (Some(first), Some(other)) => return Err(source.conflict(&key(other), first, ONE_OF_THEM)),
            (Some("formula"), None) if force.density.is_some() => {
                return Err(source.unexpected(&key("density"), "a formula is a force per volume"));
            }
            (Some("formula"), None) => {}
            (Some(_), None) => match (force.density, &scene.dynamics) {
                (Some(density), None) => positive(source, &key("density"), density.si(), "kg/m³")?,
                (Some(_), Some(_)) => {
                    return Err(source.conflict(&key("density"), "dynamics.density", ONE_OF_THEM));
                }
                (None, None) => return Err(source.missing(&key("density"), "needed without [dynamics]")),
                (None, Some(_)) => {}
            },
        }
        if let Some(spin) = force.spin.as_ref().filter(|spin| spin.angular_velocity.si() == 0.0) {
            let found = format!("{} rad/s", plain(spin.angular_velocity.si()));
            return Err(source.error(&key("spin.angular_velocity"), found, "other than 0"));
        }
        if force.depends_on_time() && force.curve.is_some() {
            let why = "a formula of `t` has its own course";
            return Err(source.conflict(&key("curve"), "formula", why));
        }
    }
    Ok(())
}

/// Adds the forces of a scene to the loads of its boundaries.
///
/// # Errors
/// Components, axes, formulas and curves that do not suit the body or the time.
pub(super) fn add<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &DiscreteBody<D>,
    loads: &mut Loads<D>,
) -> Result<(), SceneError> {
    let (particles, time) = (body.bonds.particles(), CurveTime::new(scene));
    for (index, force) in scene.body_force.iter().enumerate() {
        let key = |name: &str| format!("body_force[{index}].{name}");
        let density = force.density.or(scene.dynamics.as_ref().map(|dynamics| dynamics.density));
        let density = density.map_or(f64::NAN, |density| density.si());
        let amplitude = match &force.curve {
            Some(curve) => time.amplitude(source, &key("curve"), curve, &force.multiplied())?,
            None => time.common.clone(),
        };
        let places = particles.iter().map(|&site| body.bonds.position(site as usize));
        let values: Vec<[f64; D]> = if let Some(acceleration) = &force.acceleration {
            let value: Vec<f64> = acceleration.iter().map(|value| value.si()).collect();
            let value = <[f64; D]>::try_from(value.as_slice()).map_err(|_| {
                let found = format!("{} components", value.len());
                source.error(&key("acceleration"), found, format!("{D} components"))
            })?;
            let density = densities(source, scene, body, density)?;
            let of = |&site: &u32| value.map(|component| density.value_at(site as usize) * component);
            particles.iter().map(of).collect()
        } else if let Some(formula) = &force.formula {
            let formula = VectorFormula::new(source, &key("formula"), formula)?;
            let places: Vec<[f64; D]> = places.collect();
            formula.check(source, &key("formula"), &places, (time.end, time.moments()))?;
            if force.depends_on_time() {
                let end = time.end;
                let density = move |place, part| formula.value(place, part * end);
                let points = particles.iter().zip(places).map(|(&site, place)| (site, place, 1.0)).collect();
                add_field(body, loads, PlacedForce::new(points, density));
                continue;
            }
            places.iter().map(|place| formula.value(*place, 0.0)).collect()
        } else if let Some(spin) = &force.spin {
            let centre = vector::<D>(source, &key("spin.point"), &spin.point)?;
            let axis = direction::<D>(source, &key("spin.axis"), spin.axis.as_deref())?;
            let angular_velocity = spin.angular_velocity.si();
            let density = densities(source, scene, body, density)?;
            let held = |d: usize| loads.constrained.iter().any(|bits| bits >> d & 1 == 1);
            let across = (0..D).find(|&d| axis[d].abs() < 1.0 - 1e-9 && !held(d));
            if let Some(d) = across.filter(|_| scene.method() != SolverMethod::Verlet) {
                let found = format!("a body that nothing holds along {}", ["x", "y", "z"][d]);
                let allowed = "a `displacement` of some region there: a free body leaves the axis";
                return Err(source.error(&key("spin"), found, allowed));
            }
            add_field(body, loads, Centrifugal { density, angular_velocity, centre, axis, amplitude });
            continue;
        } else {
            continue;
        };
        let field = loads.body_force.get_or_insert_with(|| Field::zeros(body.bonds.sites()));
        if let Some(curved) = &mut loads.curved {
            let amplitudes = std::array::from_fn(|_| amplitude.clone());
            curved.pushed.push(CurvedRegion::new(particles.to_vec(), values, amplitudes, 0));
            continue;
        }
        for (&site, value) in particles.iter().zip(values) {
            let old = field.get(site as usize);
            field.set(site as usize, std::array::from_fn(|d| old[d] + value[d]));
        }
    }
    Ok(())
}

/// Adds a body force to loads that follow curves.
pub(super) fn add_field<const D: usize>(
    body: &DiscreteBody<D>,
    loads: &mut Loads<D>,
    field: impl ForceField<D> + 'static,
) {
    loads.body_force.get_or_insert_with(|| Field::zeros(body.bonds.sites()));
    loads.curved.get_or_insert_default().fields.push(Arc::new(field));
}
