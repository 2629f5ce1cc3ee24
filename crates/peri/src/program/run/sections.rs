//! Forces across sections of the body: the sum of the bond forces that cross a plane, as the areal force density of Silling
//! (2000), doi:10.1016/S0022-5096(99)00029-0, over the whole plane.

use super::material::Observed;
use super::outcome::Outcome;
use crate::bonds::Bonds;
use crate::program::scene::{Body, Scene, SectionSpec};
use crate::solver::State;
use harness::output::csv;
use harness::scene::{SceneError, Source};
use polycore::Error;
use std::path::Path;

/// Distance from a plane, over the spacing, up to which a particle counts as behind it.
const ON_PLANE: f64 = 1e-9;

/// The sections of a scene, on a body.
pub struct Sections<const D: usize> {
    each: Vec<Section<D>>,
}

struct Section<const D: usize> {
    point: [f64; D],
    normal: [f64; D],
    /// Sites behind the plane that bonds joined to those in front as the body was built.
    behind: Vec<u32>,
    /// Distance up to which a particle counts as behind, m.
    on: f64,
}

impl<const D: usize> Section<D> {
    fn is_in_front(&self, place: [f64; D]) -> bool {
        (0..D).map(|d| (place[d] - self.point[d]) * self.normal[d]).sum::<f64>() > self.on
    }
}

impl<const D: usize> Sections<D> {
    /// Finds the bonds that cross each section.
    ///
    /// # Errors
    /// A section that no bond crosses.
    pub fn new(source: &Source, specs: &[SectionSpec], body: &Body<D>) -> Result<Self, SceneError> {
        let bonds = &*body.bonds;
        let mut each = Vec::new();
        for (index, spec) in specs.iter().enumerate() {
            let key = format!("output.section[{index}]");
            let (point, normal) = spec.plane(source, &key)?;
            let mut section = Section { point, normal, behind: Vec::new(), on: ON_PLANE * bonds.spacing() };
            let crosses = |site: usize| {
                let mut crosses = false;
                bonds.neighbours(site, &mut |bond| crosses |= section.is_in_front(bonds.position(bond.site)));
                crosses
            };
            let reach = bonds.horizon() * (1.0 + ON_PLANE);
            let near = |site: usize| {
                let place = bonds.position(site);
                let height = (0..D).map(|d| (place[d] - point[d]) * normal[d]).sum::<f64>();
                (-reach..=section.on).contains(&height)
            };
            let all = bonds.particles().iter().copied();
            let behind: Vec<u32> =
                all.filter(|&site| near(site as usize) && crosses(site as usize)).collect();
            if behind.is_empty() {
                let allowed = "a point in the body: bonds must cross the plane";
                return Err(source.error(&format!("{key}.point"), "a plane that no bond crosses", allowed));
            }
            section.behind = behind;
            each.push(section);
        }
        Ok(Self { each })
    }

    /// Forces and moments of every section, as [`SectionSpec::values`] names them: F = Σ f_IJ V_I V_J over the intact bonds
    /// from behind a plane to its front, and the moments of these forces, in deformed positions, about its point; of solids with the
    /// couples of their bonds ([`Observed::couple`]).
    pub fn see(&self, bonds: &dyn Bonds<D>, state: &State<D>, observed: &Observed<D>) -> Vec<f64> {
        let mut seen = Vec::new();
        for section in &self.each {
            let (mut force, mut moment) = ([0.0; D], [0.0; 3]);
            let in_front = |site: usize| section.is_in_front(bonds.position(site));
            observed.forces(bonds, state, &section.behind, &in_front, &mut |site, sum| {
                let (rest, own) = (bonds.position(site), state.displacement.get(site));
                let arm: [f64; D] = std::array::from_fn(|d| rest[d] + own[d] - section.point[d]);
                let at = |of: [f64; D], d: usize| of.get(d).copied().unwrap_or(0.0);
                for d in 0..3 {
                    let (a, b) = ((d + 1) % 3, (d + 2) % 3);
                    moment[d] += at(arm, a) * at(sum, b) - at(arm, b) * at(sum, a);
                }
                for d in 0..D {
                    force[d] += sum[d];
                }
            });
            let couple = observed.couple(bonds, state, &section.behind, &in_front);
            (0..3).for_each(|d| moment[d] += couple[d]);
            seen.extend(force);
            seen.extend(&moment[if D == 3 { 0 } else { 2 }..]);
        }
        seen
    }
}

/// Writes `section_NAME_VARIANT.csv`, a row for each row of the history, and adds the values of the last to the outcome.
///
/// # Errors
/// A file that cannot be written.
pub fn write<const D: usize>(scene: &Scene, outcome: &mut Outcome, output: &Path) -> Result<(), Error> {
    let mut first = Outcome::seen_columns(scene).len();
    for section in &scene.output.section {
        let names = section.values(D);
        let own = first..first + names.len();
        first = own.end;
        // displacement, load, and the time of a run in motion
        let columns = outcome.columns();
        let is_shared = |name: &str| ["displacement", "load", "time"].contains(&name);
        let shared = columns.iter().filter(|(name, ..)| is_shared(name));
        let mut table: Vec<(&str, &str, Vec<f64>)> =
            shared.map(|(name, unit, values)| (name.as_str(), unit.as_str(), values.clone())).collect();
        let row =
            |k: usize| outcome.history.iter().map(|r| r.seen.get(k).copied().unwrap_or(f64::NAN)).collect();
        let prefix = section.name.len() + 1;
        table.extend(
            names.iter().zip(own.clone()).map(|(named, k)| (&named.name[prefix..], &*named.unit, row(k))),
        );
        let view: Vec<csv::Column> =
            table.iter().map(|(name, unit, values)| (*name, *unit, values.as_slice())).collect();
        csv::write(output.join(format!("section_{}_{}.csv", section.name, outcome.file_name())), &view)?;
        let last = outcome.history.last().and_then(|r| r.seen.get(own)).map(<[f64]>::to_vec);
        for (named, value) in names.into_iter().zip(last.unwrap_or_default()) {
            outcome.value(named, value);
        }
    }
    Ok(())
}
