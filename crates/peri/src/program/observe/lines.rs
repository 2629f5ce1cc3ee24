//! Writes fields along lines through the undeformed body at the end of a run.

use super::moment::Moment;
use crate::error::Error;
use crate::probe::LineSampler;
use crate::program::scene::{LineField, Scene, cuts_of, line_fields};
use harness::observe::{Observer, Outputs};

/// Observer of the lines of a scene.
pub(super) struct LineObserver<'s>(pub &'s Scene);

impl<'m, const D: usize> Observer<Moment<'m, D>, Error> for LineObserver<'_> {
    /// Writes `line_NAME_VARIANT.csv` for every line.
    fn write(&self, m: &Moment<'m, D>, to: &Outputs) -> Result<(), Error> {
        let Self(scene) = self;
        if scene.output.line.is_empty() {
            return Ok(());
        }
        let (damage, stresses) = (m.damage(), m.stresses()?);
        let value = |field: LineField, site: usize| {
            let particle = || m.bonds.particles().partition_point(|&other| (other as usize) < site);
            match field {
                LineField::Displacement(d) => m.state.displacement.get(site)[d],
                LineField::Damage => damage.as_ref().map_or(f64::NAN, |damage| damage[particle()]),
                LineField::Stress { piola, measure, entry: [a, b] } => {
                    let fields = if piola { &stresses.piola } else { &stresses.cauchy };
                    fields.get(measure).map_or(f64::NAN, |(_, tensors)| tensors[particle()][a][b])
                }
            }
        };
        let cuts = cuts_of(scene);
        for line in &scene.output.line {
            let places = line.places::<D>();
            let around = LineSampler::new(m.bonds, &cuts, [places[0], places[places.len() - 1]]);
            let is_default = |field| !matches!(field, LineField::Stress { piola: true, .. });
            let wanted =
                line_fields(scene).into_iter().filter(|(f, name, _)| line.wants(name, is_default(*f)));
            let wanted: Vec<_> = wanted.collect();
            let empty = || Vec::with_capacity(places.len());
            let mut columns: Vec<(String, &str, Vec<f64>)> =
                wanted.iter().map(|(_, name, unit)| (name.clone(), *unit, empty())).collect();
            // point by point: the weights of all points would need more memory than the body
            for at in &places {
                let weights = around.weights(*at);
                for ((field, ..), (_, _, values)) in wanted.iter().zip(&mut columns) {
                    let sum = |weights: &Vec<(usize, f64)>| {
                        weights.iter().map(|(site, weight)| weight * value(*field, *site)).sum()
                    };
                    let found: f64 = weights.as_ref().map_or(f64::NAN, sum);
                    // interpolation with slopes may leave the range 0 to 1
                    values.push(if *field == LineField::Damage { found.clamp(0.0, 1.0) } else { found });
                }
            }
            line.write::<D>(&to.folder.join(format!("line_{}_{}.csv", line.name, m.physics.name)), &columns)?;
        }
        Ok(())
    }
}
