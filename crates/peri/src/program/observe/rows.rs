//! Rows of the history: numbers of probes, flags and sections, and their columns.

use crate::bonds::Bonds;
use crate::calibrate::Space;
use crate::probe::{
    CrackTip, JIntegral, Section, StressEvaluator, WaveFront, mark_distances, mean_displacement, rotation,
};
use crate::program::quantities as q;
use crate::program::scene::{DiscreteBody, HistoryProbe, Scene, Track};
use crate::solver::State;
use harness::report::Named;
use harness::scene::{SceneError, Source};

/// Range of damage of particles at a crack tip: less is ahead of it, more behind it.
const TIP_DAMAGE: [f64; 2] = [0.35, 0.9];
/// Velocity of a wave front over the largest velocity.
const FRONT_VELOCITY: f64 = 0.02;

/// Function that computes part of a row of the history from a state.
pub type RowPart<const D: usize> =
    Box<dyn Fn(&dyn Bonds<D>, &State<D>, &StressEvaluator<D>) -> Vec<f64> + Send + Sync>;

/// Returns the parts of a row: probes, flags of a learnt law, mean stress of a periodic cell, sections.
///
/// # Errors
/// Regions without particles, marks outside the body, sections without bonds across them.
pub(super) fn rows<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &DiscreteBody<D>,
) -> Result<Vec<RowPart<D>>, SceneError> {
    let probes = scene.probe.iter().enumerate();
    let probes = probes.map(|(index, spec)| probe(source, &format!("probe[{index}]"), spec, body));
    let flags: RowPart<D> =
        Box::new(|bonds, state, evaluator| evaluator.flagged(bonds, state).into_iter().flatten().collect());
    let (low, high) = body.bounds;
    let volume = body.thickness * (0..D).map(|d| high[d] - low[d]).product::<f64>();
    let stress: Option<RowPart<D>> = scene.periodic.is_some().then(|| -> RowPart<D> {
        Box::new(move |bonds, state, evaluator| {
            let sum = evaluator.virial(bonds, state).unwrap_or([[f64::NAN; D]; D]);
            sum.iter().flatten().map(|entry| entry / volume).collect()
        })
    });
    let sections = scene.output.section.iter().enumerate().map(|(index, spec)| -> Result<RowPart<D>, _> {
        let key = format!("output.section[{index}]");
        let (point, normal) = spec.plane(source, &key)?;
        let allowed = "a point in the body: bonds must cross the plane";
        let section = Section::new(&*body.bonds, point, normal)
            .map_err(|none| source.error(&format!("{key}.point"), none, allowed))?;
        Ok(Box::new(move |bonds, state, evaluator| {
            let (force, moment) = section.force(evaluator, bonds, state);
            [&force, &moment[if D == 3 { 0 } else { 2 }..]].concat()
        }))
    });
    probes.chain([Ok(flags)]).chain(stress.map(Ok)).chain(sections).collect()
}

/// Builds a probe: one number, for a crack two.
fn probe<const D: usize>(
    source: &Source,
    key: &str,
    spec: &HistoryProbe,
    body: &DiscreteBody<D>,
) -> Result<RowPart<D>, SceneError> {
    let (axis, bonds) = (spec.axis.map_or(0, |axis| axis.index()), &*body.bonds);
    let sites = || spec.members(source, key, body);
    Ok(match spec.track {
        Track::Displacement => {
            let sites = sites()?;
            Box::new(move |_, state, _| vec![mean_displacement(state, &sites, axis)])
        }
        Track::Rotation => {
            let sites = sites()?;
            Box::new(move |bonds, state, _| vec![rotation(bonds, state, &sites, axis)])
        }
        Track::Strain => {
            let marks = spec.marks(source, key, body)?;
            Box::new(move |bonds, state, _| {
                let [rest, present] = mark_distances(bonds, state, &marks);
                vec![present / rest - 1.0]
            })
        }
        Track::Opening => {
            let marks = spec.marks(source, key, body)?;
            Box::new(move |bonds, state, _| {
                let [rest, present] = mark_distances(bonds, state, &marks);
                vec![present - rest]
            })
        }
        Track::Crack => {
            let tip = CrackTip {
                sites: sites()?,
                whole: (0..bonds.sites()).map(|site| bonds.bonded(site)).collect(),
                damage: spec.damage.unwrap_or(TIP_DAMAGE),
                axis,
                across: spec.across.map(|across| across.index()),
            };
            Box::new(move |bonds, _, _| tip.value(bonds).to_vec())
        }
        Track::Front => {
            let front = WaveFront::new(bonds, sites()?, axis, spec.threshold.unwrap_or(FRONT_VELOCITY));
            Box::new(move |_, state, _| vec![front.value(state)])
        }
        Track::JIntegral => {
            let (tip, radii) = spec.ring(source, key)?;
            let ring = JIntegral::new(bonds, body.thickness, tip, radii, axis)
                .map_err(|none| source.error(&format!("{key}.radii"), none, "a ring with particles"))?;
            Box::new(move |bonds, state, evaluator| vec![ring.value(evaluator, bonds, state)])
        }
    })
}

/// Returns the count of numbers of a probe in a row.
pub(super) fn width(probe: &HistoryProbe) -> usize {
    1 + usize::from(probe.track == Track::Crack)
}

/// Returns the components of the mean stress of a cell with periodic sides, row by row.
pub(super) fn mean_stress(scene: &Scene) -> Vec<Named> {
    let digits: &[&str] = match (&scene.periodic, scene.body.space) {
        (None, _) => &[],
        (Some(_), Space::Solid) => &["1", "2", "3"],
        (Some(_), _) => &["1", "2"],
    };
    let pairs = digits.iter().flat_map(|a| digits.iter().map(move |b| [*a, *b].concat()));
    pairs.map(|pair| q::MEAN_STRESS.named(&[&pair])).collect()
}

/// Returns the columns of probes, flags and mean stresses in the history, with units.
pub fn columns(scene: &Scene) -> Vec<(String, String)> {
    let each = |probe: &HistoryProbe| {
        let own = (probe.name.clone(), probe.track.unit().to_owned());
        let across = (width(probe) > 1).then(|| probe.named(q::PROBE_ACROSS));
        [Some(own), across.map(|Named { name, unit }| (name, unit))]
    };
    let flags = [q::OUTSIDE_SHARE, q::FLAGGED_SHARE].map(|share| (share.name.to_owned(), String::new()));
    let probes = scene.probe.iter().flat_map(each).flatten();
    let stress = mean_stress(scene).into_iter().map(|Named { name, unit }| (name, unit));
    probes.chain(flags.into_iter().filter(|_| scene.is_learnt())).chain(stress).collect()
}
