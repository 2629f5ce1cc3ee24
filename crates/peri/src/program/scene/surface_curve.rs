//! Curves of time that move or press rigid surfaces.

use super::curve::{CurveTime, MOMENTS, Multiplied};
use super::curve_spec::CurveList;
use super::values::plain;
use super::{ContactSpec, Scene};
use crate::amplitude::Amplitude;
use harness::scene::{SceneError, Source};
use polycore::units::{Force, Length};

/// Displacement or force of a rigid surface and its curve.
pub(super) struct CurvedSurface<'a> {
    /// Key of the scene.
    pub(super) key: String,
    pub(super) curve: Option<&'a CurveList>,
    pub(super) displacement: Option<&'a [Length]>,
    pub(super) force: Option<&'a [Force]>,
}

impl CurvedSurface<'_> {
    /// Values that its curve multiplies, of one component or of all.
    pub(super) fn multiplied(&self, component: Option<usize>) -> Multiplied {
        let own = |d: usize| component.is_none_or(|component| component == d);
        let moved = self.displacement.iter().copied().flatten().enumerate().filter(|(d, _)| own(*d));
        let forces = self.force.iter().copied().flatten();
        Multiplied {
            lengths: moved.map(|(_, value)| value.si()).collect(),
            forces: forces.map(|force| force.si()).collect(),
            ..Multiplied::default()
        }
    }

    /// Converts its curve, or curves of the components; those of a force have no multiple below 0.
    fn amplitudes<const D: usize>(
        &self,
        source: &Source,
        time: &CurveTime,
    ) -> Result<[Amplitude; D], SceneError> {
        let Some(curve) = self.curve else { return Ok(std::array::from_fn(|_| time.common.clone())) };
        let key = format!("{}.curve", self.key);
        if self.displacement.is_none() && self.force.is_none() {
            let why = "a curve multiplies `displacement` or `force`; this surface has none";
            return Err(source.unexpected(&key, why));
        }
        if self.force.is_some() && matches!(curve, CurveList::Each(_)) {
            return Err(source.error(&key, "a list of curves", "one curve: a force keeps its direction"));
        }
        let each = time.amplitudes::<D>(source, &key, curve, |component| self.multiplied(component))?;
        // steps may be cut anywhere
        let between = (0..=MOMENTS).map(|k| time.end * f64::from(k) / f64::from(MOMENTS));
        let mut moments = time.moments().iter().copied().chain(between);
        let pulls = |moment: &f64| self.force.is_some() && each[0].multiple(moment / time.end) < 0.0;
        match moments.find(pulls) {
            Some(moment) => {
                let found = format!("{} at {} s", plain(each[0].multiple(moment / time.end)), plain(moment));
                let allowed = "multiples of 0 and above: a rigid surface pushes and never pulls";
                Err(source.error(&key, found, allowed))
            }
            None => Ok(each),
        }
    }
}

/// Amplitudes of the components of every rigid surface; `None` for all without curves.
///
/// # Errors
/// As [`amplitudes`], and a curve of a surface at rest.
pub(super) fn surface_amplitudes<const D: usize>(
    source: &Source,
    scene: &Scene,
    contact: &ContactSpec,
) -> Result<Vec<Option<[Amplitude; D]>>, SceneError> {
    let surfaces = contact.curved_surfaces();
    if !scene.has_curves() {
        return Ok(vec![None; surfaces.len()]);
    }
    let time = CurveTime::of_surfaces(scene);
    surfaces.iter().map(|surface| surface.amplitudes(source, &time).map(Some)).collect()
}
