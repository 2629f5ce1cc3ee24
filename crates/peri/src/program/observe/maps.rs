//! Draws a body at the end of a run.

use super::moment::Moment;
use super::scale::{bridge_length, short, stress_unit};
use super::{solid, stages};
use crate::contact::{RigidSurface, SurfaceReaction};
use crate::error::Error;
use crate::program::scene::Scene;
use crate::solver::StepRecord;
use harness::observe::{Observer, Outputs};
use harness::output::picture::{FieldMap, Panel};
use std::path::Path;

/// Observer that draws stresses and flags of plane bodies, stages of breaking, and solids.
pub(super) struct Pictures<'s>(pub &'s Scene);

impl<'m, const D: usize> Observer<Moment<'m, D>, Error> for Pictures<'_> {
    fn write(&self, m: &Moment<'m, D>, to: &Outputs) -> Result<(), Error> {
        let spec = &self.0.output;
        let breaks = m.physics.body.criterion.is_some();
        let has_stages = spec.fields && spec.every.is_some() && self.0.stress.is_some() && breaks;
        if to.pictures { self.draw_all(m, has_stages, to.folder) } else { Ok(()) }
    }

    fn draw(&self, m: &Moment<'m, D>, to: &Outputs) -> Result<(), Error> {
        self.draw_all(m, false, to.folder)
    }
}

impl Pictures<'_> {
    /// Draws fields of a plane body, and a solid; with stages those of breaking in place of the moment.
    fn draw_all<const D: usize>(&self, m: &Moment<D>, stages: bool, folder: &Path) -> Result<(), Error> {
        let spec = &self.0.output;
        let flags = if spec.flags { m.physics.evaluator.flags(m.bonds, m.state) } else { None };
        let flags: Option<Vec<f64>> =
            flags.map(|flags| flags.iter().map(|flags| f64::from(u8::from(flags.any()))).collect());
        let energies = if spec.energy { m.physics.evaluator.energies(m.bonds, m.state) } else { None };
        if D == 2 {
            maps(m, folder)?;
            flags.iter().try_for_each(|values| flagged(m, values, folder))?;
            energies.iter().try_for_each(|values| energy_map(m, values, folder))?;
        }
        if stages {
            stages::draw_stages(m, folder)?;
        } else if D == 3 {
            let flags = flags.map(|flags| (solid::flagged_field(), flags));
            let energies = energies.map(|values| (solid::energy_field(&values), values));
            let second = flags.or(energies).or_else(|| Some((solid::damage_field(), m.damage()?)));
            solid::draw_end(m, second, folder)?;
        }
        Ok(())
    }
}

/// Draws the stress components of the first measure (Fig. 2.6) in a plane body.
fn maps<const D: usize>(m: &Moment<D>, output: &Path) -> Result<(), Error> {
    let Some((measure, field)) = m.stresses()?.cauchy.first() else { return Ok(()) };
    let [rest, places] = plane_positions(m);
    let largest = field.iter().flatten().flatten().fold(0.0_f64, |most, s| most.max(s.abs()));
    let (scale, unit) = match &m.scene.exact {
        Some(exact) => (1.0 / exact.hole().1, "/σ∞".to_owned()),
        None => {
            let (scale, unit) = stress_unit(largest);
            (scale, format!(" ({unit})"))
        }
    };
    let components: Vec<(&str, Vec<f64>)> = [("σ₁₁", 0, 0), ("σ₂₂", 1, 1), ("σ₁₂", 0, 1)]
        .map(|(name, a, b)| (name, field.iter().map(|t| t[a][b] * scale).collect()))
        .into();
    let mut map = FieldMap::new().lengths("mm", 1e-3);
    let [wide, high] = [0, 1].map(|d| {
        let (low, high) =
            places.iter().fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(x[d]), high.max(x[d])));
        high - low
    });
    if wide > 1.8 * high {
        map = map.columns(1).size(1200);
    }
    let height = rigid_height(m, m.state.history.last());
    for (name, values) in &components {
        let label = format!("{name}{unit}");
        // in a torn body these are residual stresses of its pieces
        let last = m.state.history.last().filter(|last| last.broken > 0);
        let moment = last.map_or(String::new(), |r| {
            format!(", U = {} mm, F = {} N", short(r.displacement * 1e3), short(r.load))
        });
        let title = m.titled(&format!("{label}, {}{moment}", measure.name()));
        let panel = Panel::new(&title, &label, &places, values, m.bonds.spacing()).reference(&rest);
        let panel = panel.bridge(bridge_length(m));
        map = map.panel(if m.physics.placed.is_empty() { panel } else { panel.rigid(&height) });
    }
    Ok(map.write(output.join(format!("stress_{}.png", m.file_name())))?)
}

/// Returns the height above rigid planes and indenters in a row of the history, m.
pub(super) fn rigid_height<const D: usize>(
    m: &Moment<D>,
    row: Option<&StepRecord>,
) -> impl Fn([f64; 2]) -> f64 + Sync {
    let (surfaces, moved) = (&m.physics.placed, row.map_or(&[][..], |row| &row.resting));
    move |place| {
        let above = |(surface, at): (&RigidSurface<D>, &SurfaceReaction)| {
            surface.height(std::array::from_fn(|d| place[d] - at.moved[d]))
        };
        surfaces.iter().zip(moved).map(above).fold(f64::INFINITY, f64::min)
    }
}

/// Draws the particles of a plane body at which a learnt law is uncertain.
///
/// # Errors
/// A file that cannot be written.
fn flagged<const D: usize>(m: &Moment<D>, values: &[f64], output: &Path) -> Result<(), Error> {
    let [rest, places] = plane_positions(m);
    let panel = Panel::new(
        &m.titled("where the learnt law is uncertain"),
        "flagged",
        &places,
        values,
        m.bonds.spacing(),
    );
    let map = FieldMap::new()
        .lengths("mm", 1e-3)
        .panel(panel.range(0.0, 1.0).reference(&rest).bridge(bridge_length(m)));
    Ok(map.write(output.join(format!("flags_{}.png", m.file_name())))?)
}

/// Draws the energy density of a plane body.
///
/// # Errors
/// A file that cannot be written.
fn energy_map<const D: usize>(m: &Moment<D>, values: &[f64], output: &Path) -> Result<(), Error> {
    let [rest, places] = plane_positions(m);
    let field = solid::energy_field(values);
    let values: Vec<f64> = values.iter().map(|w| w * field.scale).collect();
    let label = &field.strip.label;
    let panel = Panel::new(&m.titled(label), label, &places, &values, m.bonds.spacing()).reference(&rest);
    let map = FieldMap::new().lengths("mm", 1e-3).panel(panel.bridge(bridge_length(m)));
    Ok(map.write(output.join(format!("energy_{}.png", m.file_name())))?)
}

/// Returns the reference and current positions of the particles of a plane body.
fn plane_positions<const D: usize>(m: &Moment<D>) -> [Vec<[f64; 2]>; 2] {
    let rest: Vec<[f64; 2]> =
        m.sites().map(|site| [m.bonds.position(site)[0], m.bonds.position(site)[1]]).collect();
    let moved = m.sites().map(|site| m.state.displacement.get(site));
    let places = rest.iter().zip(moved).map(|(x, u)| [x[0] + u[0], x[1] + u[1]]).collect();
    [rest, places]
}
