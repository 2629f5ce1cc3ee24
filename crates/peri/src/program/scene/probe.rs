//! Probes of a scene, recorded in every row of the history: displacements, strains between marks, rotations,
//! crack tips, wave fronts, J-integrals.

use super::region::region;
use super::values::{DiscreteBody, vector};
use super::{AxisName, Boundary, Scene, Side, SolverMethod};
use crate::calibrate::Space;
use harness::report::{Named, Quantity};
use harness::scene::{SceneError, Source};
use polycore::units::{Force, Length};
use serde::{Deserialize, Serialize};

/// Probe: a quantity recorded in every row of the history.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HistoryProbe {
    /// Name, its column in the history and the prefix of its values.
    pub name: String,
    /// Quantity.
    pub track: Track,
    /// Direction, or axis of rotation.
    pub axis: Option<AxisName>,
    /// A side of the bounding box; default: the whole body.
    pub side: Option<Side>,
    /// Depth from the side in particles.
    pub layers: Option<usize>,
    /// Or a box: lower corner …
    pub min: Option<Vec<Length>>,
    /// … and upper corner.
    pub max: Option<Vec<Length>>,
    /// Or a set of a mesh file of the body, as that of a boundary.
    pub set: Option<String>,
    /// Marks of a strain or an opening.
    pub from: Option<Vec<Length>>,
    /// The other mark.
    pub to: Option<Vec<Length>>,
    /// Range of damage of the particles at a crack tip.
    pub damage: Option<[f64; 2]>,
    /// Axis along which the distance of a crack tip from 0 is recorded.
    pub across: Option<AxisName>,
    /// Two positions between which the speed of a crack or a front is measured.
    pub gauges: Option<[Length; 2]>,
    /// Velocity of a front, as a fraction of the largest.
    pub threshold: Option<f64>,
    /// Crack tip of a J-integral.
    pub tip: Option<Vec<Length>>,
    /// Inner and outer radius of the integration ring about the tip.
    pub radii: Option<[Length; 2]>,
    /// Openings at which the report has the load, as `NAME_load_at_0.1mm`.
    #[serde(default)]
    pub load_at: Vec<Length>,
    /// Measured openings with the lowest and the highest load, drawn beside the computed ones.
    #[serde(default)]
    pub measured: Vec<(Length, Force, Force)>,
}

/// Quantities of a probe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Track {
    /// Mean displacement of the region along the axis, m.
    Displacement,
    /// Distance of two marks over that at rest, less 1.
    Strain,
    /// Distance of two marks less that at rest, m.
    Opening,
    /// Rotation of the region about the axis through the origin, rad.
    Rotation,
    /// Farthest position along the axis with damage in a range, m.
    Crack,
    /// Farthest position along the axis at which the velocity along it exceeds a fraction of the largest, m.
    Front,
    /// J-integral of a crack that grows along the axis, J/m².
    JIntegral,
}

impl Track {
    /// Returns the unit of its column.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Displacement | Self::Opening | Self::Crack | Self::Front => "m",
            Self::Rotation => "rad",
            Self::Strain => "",
            Self::JIntegral => "J/m²",
        }
    }
}

impl AxisName {
    /// Returns 0, 1 or 2.
    pub fn index(self) -> usize {
        self as usize
    }
}

impl HistoryProbe {
    /// Names a quantity of this probe; `*` becomes the unit of the probe.
    pub fn named(&self, quantity: Quantity) -> Named {
        let named = quantity.named(&[&self.name]);
        if named.unit == "*" { named.in_unit(self.track.unit()) } else { named }
    }

    /// Returns the sites of its region; without a region those of the whole body.
    ///
    /// # Errors
    /// As [`super::body_of`].
    pub fn members<const D: usize>(
        &self,
        source: &Source,
        key: &str,
        body: &DiscreteBody<D>,
    ) -> Result<Vec<u32>, SceneError> {
        if self.side.is_none() && self.min.is_none() && self.max.is_none() && self.set.is_none() {
            return Ok(body.bonds.particles().to_vec());
        }
        let place = Boundary {
            side: self.side,
            layers: self.layers,
            min: self.min.clone(),
            max: self.max.clone(),
            set: self.set.clone(),
            ..Boundary::default()
        };
        let (members, _) = region(source, key, &place, body)?;
        if members.is_empty() {
            return Err(source.error(key, "a region without particles", "a region with at least one"));
        }
        Ok(members)
    }

    /// Returns the particles nearest to each of the two marks of a strain or an opening.
    ///
    /// # Errors
    /// Marks outside the body or at the same particles.
    pub fn marks<const D: usize>(
        &self,
        source: &Source,
        key: &str,
        body: &DiscreteBody<D>,
    ) -> Result<[Vec<u32>; 2], SceneError> {
        let near = |name: &str, mark: &Option<Vec<Length>>| {
            let mark = vector::<D>(source, &format!("{key}.{name}"), mark.as_deref().unwrap_or_default())?;
            let distance = |site: u32| {
                let place = body.bonds.position(site as usize);
                (0..D).map(|d| (place[d] - mark[d]).powi(2)).sum::<f64>().sqrt()
            };
            let particles = body.bonds.particles();
            let least = particles.iter().map(|&site| distance(site)).fold(f64::INFINITY, f64::min);
            if least > 1.5 * body.bonds.spacing() {
                let found = format!("{mark:?} m, {least:.3e} m from the nearest particle");
                return Err(source.error(&format!("{key}.{name}"), found, "a place in the body"));
            }
            let most = least + 1e-6 * body.bonds.spacing();
            Ok(particles.iter().copied().filter(|&site| distance(site) <= most).collect::<Vec<u32>>())
        };
        let marks = [near("from", &self.from)?, near("to", &self.to)?];
        if marks[0] == marks[1] {
            let found = "the same particles as `from`";
            return Err(source.error(&format!("{key}.to"), found, "marks at least one spacing apart"));
        }
        Ok(marks)
    }

    /// Returns the tip and the radii of a J-integral, m.
    ///
    /// # Errors
    /// A tip of another dimension.
    pub fn ring<const D: usize>(
        &self,
        source: &Source,
        key: &str,
    ) -> Result<([f64; D], [f64; 2]), SceneError> {
        let tip = vector::<D>(source, &format!("{key}.tip"), self.tip.as_deref().unwrap_or_default())?;
        Ok((tip, self.radii.map_or([0.0; 2], |radii| radii.map(|r| r.si()))))
    }
}

/// Checks what needs no body.
///
/// # Errors
/// A [`SceneError`] that names the key, the value found and what is allowed.
pub(super) fn check(source: &Source, scene: &Scene) -> Result<(), SceneError> {
    let dimension = if scene.body.space == Space::Solid { 3 } else { 2 };
    for (index, probe) in scene.probe.iter().enumerate() {
        let key = |name: &str| format!("probe[{index}].{name}");
        let letters = |c: char| c.is_ascii_alphanumeric() || "_-".contains(c);
        if probe.name.is_empty() || !probe.name.chars().all(letters) {
            let found = format!("`{}`", probe.name);
            return Err(source.error(&key("name"), found, "letters, digits, `_` and `-`"));
        }
        let track = probe.track;
        // name, given, belongs, needed
        let of_crack = track == Track::Crack;
        let moving = of_crack || track == Track::Front;
        let of_j = track == Track::JIntegral;
        let marked = matches!(track, Track::Strain | Track::Opening);
        let in_region = !marked && !of_j;
        for (name, given, belongs, needed) in [
            ("axis", probe.axis.is_some(), !marked, !marked),
            ("from", probe.from.is_some(), marked, marked),
            ("to", probe.to.is_some(), marked, marked),
            ("side", probe.side.is_some(), in_region, false),
            ("min", probe.min.is_some(), in_region, false),
            ("max", probe.max.is_some(), in_region, false),
            ("set", probe.set.is_some(), in_region, false),
            ("tip", probe.tip.is_some(), of_j, of_j),
            ("radii", probe.radii.is_some(), of_j, of_j),
            ("damage", probe.damage.is_some(), of_crack, false),
            ("across", probe.across.is_some(), of_crack, false),
            ("gauges", probe.gauges.is_some(), moving, false),
            ("threshold", probe.threshold.is_some(), track == Track::Front, false),
            ("measured", !probe.measured.is_empty(), track == Track::Opening, false),
            ("load_at", !probe.load_at.is_empty(), track == Track::Opening, false),
        ] {
            if given && !belongs {
                let why = format!("a probe of `{}` does not use it", name_of(track));
                return Err(source.unexpected(&key(name), why));
            }
            if needed && !given {
                return Err(source.missing(&key(name), format!("needed for a probe of `{}`", name_of(track))));
            }
        }
        for (name, axis) in [("axis", probe.axis), ("across", probe.across)] {
            let plane_rotation = track == Track::Rotation && axis == Some(AxisName::Z);
            if axis.is_some_and(|axis| axis.index() >= dimension) && !plane_rotation {
                return Err(source.error(&key(name), "`z` in a plane body", "`x` or `y`"));
            }
        }
        if track == Track::Rotation && dimension == 2 && probe.axis != Some(AxisName::Z) {
            return Err(source.error(&key("axis"), "an axis in the plane", "`z` in a plane body"));
        }
        if of_crack && !scene.breaks() {
            return Err(
                source.unexpected(&key("track"), "`crack` needs `material.critical`, so that bonds break")
            );
        }
        if of_j && (dimension == 3 || scene.material.solid.is_none()) {
            let found = if dimension == 3 {
                "`j-integral` in three dimensions"
            } else {
                "`j-integral` of a bond law"
            };
            return Err(source.error(&key("track"), found, "a plane body with `material.solid`"));
        }
        if let Some([inner, outer]) = probe.radii
            && !(inner.si() >= 0.0 && inner.si() < outer.si() && outer.si().is_finite())
        {
            let found = format!("{} m to {} m", inner.si(), outer.si());
            return Err(source.error(&key("radii"), found, "0 ≤ inner < outer"));
        }
        if track == Track::Front && scene.method() != SolverMethod::Verlet {
            return Err(source.error(
                &key("track"),
                "`front` without motion",
                "`solver.method = \"verlet\"`",
            ));
        }
        if let Some([low, high]) = probe.damage
            && !(low > 0.0 && low <= high && high <= 1.0)
        {
            return Err(source.error(&key("damage"), format!("{low} to {high}"), "0 < from ≤ to ≤ 1"));
        }
        if let Some(threshold) = probe.threshold
            && !(threshold > 0.0 && threshold < 1.0)
        {
            return Err(source.error(&key("threshold"), threshold, "between 0 and 1"));
        }
        if let Some(at) = probe.load_at.iter().find(|at| !(at.si() > 0.0 && at.si().is_finite())) {
            return Err(source.error(&key("load_at"), format!("{} m", at.si()), "above 0"));
        }
        if let Some([from, to]) = probe.gauges
            && from.si() >= to.si()
        {
            let found = format!("{} m to {} m", from.si(), to.si());
            return Err(source.error(&key("gauges"), found, "the nearer one first"));
        }
    }
    Ok(())
}

fn name_of(track: Track) -> &'static str {
    match track {
        Track::Displacement => "displacement",
        Track::Strain => "strain",
        Track::Opening => "opening",
        Track::Rotation => "rotation",
        Track::Crack => "crack",
        Track::Front => "front",
        Track::JIntegral => "j-integral",
    }
}
