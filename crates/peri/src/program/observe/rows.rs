//! Rows of the history: what a scene's probes are on a body, and the columns of their numbers.

use crate::bonds::Bonds;
use crate::probe::{CrackTip, JIntegral, StressEvaluator, WaveFront, mean_displacement, rotation, strain};
use crate::program::quantities as q;
use crate::program::scene::{Body, Probe, Scene, Track};
use crate::solver::State;
use harness::report::Named;
use harness::scene::{SceneError, Source};

/// Damage of particles at the tip of a crack: less is not torn, more lies behind it.
const AT_THE_TIP: [f64; 2] = [0.35, 0.9];
/// Part of the largest velocity that the front of a wave has.
const AT_THE_FRONT: f64 = 0.02;

/// A probe on a body.
pub enum Tracked {
    Displacement(Vec<u32>, usize),
    Rotation(Vec<u32>, usize),
    Strain([Vec<u32>; 2]),
    Crack(CrackTip),
    Front(WaveFront),
    JIntegral(JIntegral),
}

impl Tracked {
    /// Finds the particles of a probe.
    ///
    /// # Errors
    /// Regions without particles, marks outside the body.
    pub fn new<const D: usize>(
        source: &Source,
        key: &str,
        probe: &Probe,
        body: &Body<D>,
    ) -> Result<Self, SceneError> {
        let (axis, bonds) = (probe.axis.map_or(0, |axis| axis.index()), &*body.bonds);
        let sites = || probe.members(source, key, body);
        Ok(match probe.track {
            Track::Displacement => Self::Displacement(sites()?, axis),
            Track::Rotation => Self::Rotation(sites()?, axis),
            Track::Strain => Self::Strain(probe.marks(source, key, body)?),
            Track::Crack => Self::Crack(CrackTip {
                sites: sites()?,
                whole: (0..bonds.sites()).map(|site| bonds.bonded(site)).collect(),
                damage: probe.damage.unwrap_or(AT_THE_TIP),
                axis,
                across: probe.across.map(|across| across.index()),
            }),
            Track::Front => {
                Self::Front(WaveFront::new(bonds, sites()?, axis, probe.threshold.unwrap_or(AT_THE_FRONT)))
            }
            Track::JIntegral => {
                let (tip, radii) = probe.ring(source, key)?;
                let ring = JIntegral::new(bonds, body.thickness, tip, radii, axis);
                Self::JIntegral(
                    ring.map_err(|none| {
                        source.error(&format!("{key}.radii"), none, "a ring with particles")
                    })?,
                )
            }
        })
    }

    /// Its numbers in a row of the history: one, two of a crack.
    pub fn row<const D: usize>(
        &self,
        bonds: &dyn Bonds<D>,
        state: &State<D>,
        evaluator: &StressEvaluator<D>,
    ) -> Vec<f64> {
        match self {
            Self::Displacement(sites, axis) => vec![mean_displacement(state, sites, *axis)],
            Self::Rotation(sites, axis) => vec![rotation(bonds, state, sites, *axis)],
            Self::Strain(marks) => vec![strain(bonds, state, marks)],
            Self::Crack(tip) => tip.value(bonds).to_vec(),
            Self::Front(front) => vec![front.value(state)],
            Self::JIntegral(ring) => vec![ring.value(evaluator, bonds, state)],
        }
    }
}

/// Numbers of a probe in a row.
pub(super) fn width(probe: &Probe) -> usize {
    1 + usize::from(probe.track == Track::Crack)
}

/// Columns of probes and flags in the table of the history, with their units.
pub fn columns(scene: &Scene) -> Vec<(String, String)> {
    let each = |probe: &Probe| {
        let own = (probe.name.clone(), probe.track.unit().to_owned());
        let across = (width(probe) > 1).then(|| probe.named(q::PROBE_ACROSS));
        [Some(own), across.map(|Named { name, unit }| (name, unit))]
    };
    let flags = [q::OUTSIDE_SHARE, q::FLAGGED_SHARE].map(|share| (share.name.to_owned(), String::new()));
    let probes = scene.probe.iter().flat_map(each).flatten();
    probes.chain(flags.into_iter().filter(|_| scene.is_learnt())).collect()
}
