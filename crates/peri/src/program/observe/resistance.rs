//! Tearing energy over the length of a crack, from the tips of crack probes and the energies of the history.

use super::moment::Moment;
use crate::calibrate::Space;
use crate::error::Error;
use crate::probe::resistance;
use crate::program::quantities as q;
use crate::program::scene::{Scene, Track};
use crate::solver::StepRecord;
use harness::observe::{Observer, Outputs, Scalars};
use harness::output::csv;

/// Observer of the energy that growing cracks take, for each crack probe of a sheet or plate that breaks.
pub(super) struct Resistance<'s>(pub &'s Scene);

impl Resistance<'_> {
    /// Returns the names of crack probes with their first columns in the history.
    fn probes(&self) -> impl Iterator<Item = (&str, usize)> {
        let Self(scene) = self;
        let plane = scene.breaks() && scene.body.space != Space::Solid;
        let mut column = 0;
        let each = scene.probe.iter().map(move |probe| {
            let own = column;
            column += super::rows::width(probe);
            (probe, own)
        });
        let cracks = each.filter(move |(probe, _)| plane && probe.track == Track::Crack);
        cracks.map(|(probe, column)| (probe.name.as_str(), column))
    }
}

/// Energy of new cracks until a row, J.
fn spent(row: &StepRecord) -> f64 {
    row.work - row.stored - row.kinetic - row.rubbed - row.dissipated - row.damped
}

/// Returns the tip, m, in a column of the history and the energy spent, J/m, over the thickness, row by row.
fn rows<'m, const D: usize>(m: &Moment<'m, D>, column: usize) -> impl Iterator<Item = [f64; 2]> + use<'m, D> {
    let thickness = m.scene.body.thickness.map_or(1.0, |thickness| thickness.si());
    let history = &m.state.history;
    history.iter().map(move |row| [row.seen[column], spent(row) / thickness])
}

impl<'m, const D: usize> Observer<Moment<'m, D>, Error> for Resistance<'_> {
    fn scalars(&self, to: &mut Scalars<Moment<'m, D>>) {
        for (name, column) in self.probes() {
            to.add_if(q::PROBE_TEARING_ENERGY.named(&[name]), |m| {
                let each = resistance(rows(m, column), m.bonds.spacing());
                let [energy, length] =
                    each.iter().fold([0.0; 2], |sum, row| [sum[0] + row[1] * row[2], sum[1] + row[2]]);
                (length > 0.0).then_some(energy / length)
            });
        }
    }

    /// Writes `resistance_PROBE_VARIANT.csv`.
    fn write(&self, m: &Moment<'m, D>, to: &Outputs) -> Result<(), Error> {
        for (name, column) in self.probes() {
            let each = resistance(rows(m, column), m.bonds.spacing());
            if each.is_empty() {
                continue;
            }
            let [tip, energy] = [0, 1].map(|k| each.iter().map(|row| row[k]).collect::<Vec<f64>>());
            let columns = [("tip", "m", &tip[..]), ("tearing_energy", "J/m^2", &energy)];
            csv::write(to.folder.join(format!("resistance_{name}_{}.csv", m.physics.name)), &columns)?;
        }
        Ok(())
    }
}
