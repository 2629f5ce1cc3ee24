//! Comparison of stresses around a hole with Kirsch's solution or the exact plate of the scene.

use super::moment::Moment;
use crate::error::Error;
use crate::exact::{HoleComparison, HoleRegion};
use crate::program::quantities as q;
use crate::program::scene::{ExactSpec, Scene};
use crate::stress::StressMethod;
use harness::observe::{Curve, Observer, Scalars};

/// Values of σ₁₁/σ∞ by each measure.
type Normals = Vec<(StressMethod, Vec<f64>)>;

/// Observer that compares with the closed form of a scene: peak and profile at θ = π/2, errors over regions.
pub(super) struct HoleErrors<'s> {
    scene: &'s Scene,
    found: Option<(HoleComparison, Normals)>,
}

impl<'s> HoleErrors<'s> {
    pub(super) fn new(scene: &'s Scene) -> Self {
        Self { scene, found: None }
    }

    fn hole(&self) -> Option<&HoleComparison> {
        self.found.as_ref().map(|(hole, _)| hole)
    }

    fn normal(&self, measure: StressMethod) -> Option<(&HoleComparison, &[f64])> {
        let (hole, fields) = self.found.as_ref()?;
        fields.iter().find(|(own, _)| *own == measure).map(|(_, normal)| (hole, &normal[..]))
    }
}

/// Returns the value at the particles nearest to the hole.
fn first_value(hole: &HoleComparison, values: &[f64]) -> Option<f64> {
    hole.profile(values)[1].first().copied()
}

/// Returns the largest value above the hole.
fn peak_value(hole: &HoleComparison, values: &[f64]) -> Option<f64> {
    hole.profile(values)[1].iter().copied().reduce(f64::max)
}

impl<'m, const D: usize> Observer<Moment<'m, D>, Error> for HoleErrors<'_> {
    fn scalars(&self, to: &mut Scalars<Moment<'m, D>>) {
        let (Some(spec), Some(stress)) = (&self.scene.exact, &self.scene.stress) else { return };
        let hole = || self.hole();
        to.add_if(q::KIRSCH_FIRST, |_| hole().and_then(|hole| first_value(hole, &hole.kirsch)));
        if matches!(spec, ExactSpec::PlateWithHole { .. }) {
            to.add_if(q::EXACT_FIRST, |_| hole().and_then(|hole| first_value(hole, &hole.exact)));
            to.add_if(q::EXACT_PEAK, |m| {
                first_value(hole()?, &hole()?.exact)?;
                Some(m.physics.plate.as_ref()?.stress(0.0, spec.hole().0)[0])
            });
        }
        for &measure in &stress.measures {
            let (name, normal_stress) = (measure.name(), || self.normal(measure));
            to.add_if(q::MEASURE_MAX.named(&[name]), |_| {
                normal_stress().map(|(hole, normal)| hole.most(normal))
            });
            for kind in spec.errors() {
                let region = match *kind {
                    "rmse_inner" | "rmse_inner_kirsch" => HoleRegion::Inner,
                    "rmse_bulk" => HoleRegion::Bulk,
                    "rmse_ring" => HoleRegion::Ring,
                    _ => HoleRegion::All,
                };
                to.add_if(q::MEASURE_ERROR.named(&[name, kind]), |_| {
                    let (hole, normal) = normal_stress()?;
                    let exact = if kind.ends_with("kirsch") { &hole.kirsch } else { &hole.exact };
                    Some(hole.error(normal, exact, region))
                });
            }
            to.add_if(q::MEASURE_PEAK.named(&[name]), |_| {
                normal_stress().and_then(|(hole, normal)| peak_value(hole, normal))
            });
            to.add_if(q::MEASURE_PEAK_ERROR.named(&[name]), |_| {
                let (hole, normal) = normal_stress()?;
                Some(peak_value(hole, normal)? / first_value(hole, &hole.exact)? - 1.0)
            });
            to.add_if(q::MEASURE_FIRST.named(&[name]), |_| {
                normal_stress().and_then(|(hole, normal)| first_value(hole, normal))
            });
        }
    }

    fn end(&mut self, m: &Moment<'m, D>) -> Result<(), Error> {
        let Some(spec) = &self.scene.exact else { return Ok(()) };
        let (radius, remote) = spec.hole();
        let hole = HoleComparison::new(m.bonds, radius, m.physics.plate.as_ref(), &m.physics.loaded);
        let fields = m.stresses()?.cauchy.iter();
        let fields =
            fields.map(|(measure, field)| (*measure, HoleComparison::normal(field, remote))).collect();
        self.found = Some((hole, fields));
        Ok(())
    }

    /// Returns profiles of the exact stresses and of every measure above the hole.
    fn curves(&self, m: &Moment<'m, D>) -> Vec<Curve> {
        let Some((hole, fields)) = &self.found else { return Vec::new() };
        let exact = m.physics.plate.as_ref().map(|_| ("exact", &hole.exact));
        let all = std::iter::once(("kirsch", &hole.kirsch)).chain(exact);
        let all = all.chain(fields.iter().map(|(measure, normal)| (measure.name(), normal)));
        let curve = |(name, values): (&str, &Vec<f64>)| {
            let [at, value] = hole.profile(values);
            Curve { name: name.to_owned(), columns: vec![("y", "m", at), ("stress", "", value)] }
        };
        all.map(curve).filter(|curve| !curve.columns[0].2.is_empty()).collect()
    }
}
