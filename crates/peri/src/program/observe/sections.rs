//! Scalars and tables of forces and moments across sections.

use super::history::has_times;
use super::moment::Moment;
use super::rows::columns;
use crate::calibrate::Space;
use crate::error::Error;
use crate::program::quantities as q;
use crate::program::scene::{Scene, SectionSpec};
use crate::solver::StepRecord;
use harness::observe::{Observer, Outputs, Scalars};
use harness::output::csv;
use harness::report::Named;

/// Observer of the sections of a scene.
pub(super) struct Sections<'s>(pub &'s Scene);

impl Sections<'_> {
    /// Iterates over sections, the first column of each in a row of the history, and their scalars: forces
    /// along x, y(, z), then moments about z in a plane body, about x, y, z in a solid.
    fn each(&self) -> impl Iterator<Item = (&SectionSpec, usize, Vec<Named>)> {
        let solid = self.0.body.space == Space::Solid;
        let (axes, about) = (&["x", "y", "z"][..if solid { 3 } else { 2 }], if solid { 0 } else { 2 });
        let mut first = columns(self.0).len();
        self.0.output.section.iter().map(move |section| {
            let forces = axes.iter().map(|axis| q::SECTION_FORCE.named(&[&section.name, axis]));
            let moments = ["x", "y", "z"].into_iter().skip(about);
            let moments = moments.map(|axis| q::SECTION_MOMENT.named(&[&section.name, axis]));
            let names: Vec<Named> = forces.chain(moments).collect();
            let own = first;
            first += names.len();
            (section, own, names)
        })
    }
}

impl<'m, const D: usize> Observer<Moment<'m, D>, Error> for Sections<'_> {
    fn scalars(&self, to: &mut Scalars<Moment<'m, D>>) {
        for (_, first, names) in self.each() {
            for (k, named) in names.into_iter().enumerate() {
                to.add_if(named, |m| m.state.history.last()?.seen.get(first + k).copied());
            }
        }
    }

    /// Writes `section_NAME_VARIANT.csv` with the rows of the history.
    fn write(&self, m: &Moment<'m, D>, to: &Outputs) -> Result<(), Error> {
        let column = |get: &dyn Fn(&StepRecord) -> f64| m.state.history.iter().map(get).collect::<Vec<f64>>();
        for (section, first, names) in self.each() {
            let mut table = vec![
                ("displacement", "m", column(&|row| row.displacement)),
                ("load", "N", column(&|row| row.load)),
            ];
            table.extend(has_times(&m.state.history).then(|| ("time", "s", column(&|row| row.time))));
            let prefix = section.name.len() + 1;
            table.extend(names.iter().enumerate().map(|(k, named)| {
                let own = column(&|row| row.seen.get(first + k).copied().unwrap_or(f64::NAN));
                (&named.name[prefix..], &*named.unit, own)
            }));
            let view: Vec<csv::Column> =
                table.iter().map(|(name, unit, own)| (*name, *unit, &own[..])).collect();
            let file = format!("section_{}_{}.csv", section.name, m.physics.name);
            csv::write(to.folder.join(file), &view)?;
        }
        Ok(())
    }
}
