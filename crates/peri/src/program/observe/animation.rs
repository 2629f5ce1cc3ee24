//! Draws all frames of the field file one after another.

use super::maps::rigid_height;
use super::moment::Moment;
use super::scale::{bridge_length, moment_title, stress_unit};
use super::solid::{ColouredField, EMPTY_BOX, extend_box, field, shown_stress, stress_range, stress_strip};
use crate::error::Error;
use crate::program::scene::Animation;
use harness::output::picture::{FieldMap, Panel, Particles, Solids};
use harness::output::vtkhdf::{self, Series};
use std::path::Path;

/// Frames at most: of more as many at equal distances.
const MOST: usize = 120;
/// Time of all frames, s, and bounds of that of one.
const TIME: f64 = 6.0;
const EACH: [f64; 2] = [0.04, 0.3];
/// Pixels of a plane body's longer side.
const SIZE: usize = 560;

/// Field that is shown: stress, else energy density, contact pressure, damage, else the displacement.
enum FilmField {
    Stress(String),
    Scalar(&'static str),
    Displacement,
}

/// Frames of a field file and how they are drawn.
struct FilmFrames<'a, const D: usize> {
    m: &'a Moment<'a, D>,
    series: Series,
    shown: FilmField,
    chosen: Vec<usize>,
}

/// Draws the animation of a scene; a warning says why it is of another kind, or that there is none.
pub fn animate<const D: usize>(m: &Moment<D>, output: &Path) -> Vec<String> {
    let Some(kind) = m.scene.output.animation else { return Vec::new() };
    let path = |kind: Animation| output.join(format!("animation_{}.{}", m.physics.name, kind.name()));
    let drawn = FilmFrames::new(m, output).and_then(|frames| {
        let first = frames.draw(&path(kind));
        match first {
            Err(why) if kind == Animation::Mp4 => frames
                .draw(&path(Animation::Gif))
                .map(|_| Some(format!("`output.animation`: a GIF in place of the MP4, as {why}"))),
            other => other.map(|()| None),
        }
    });
    match drawn {
        Ok(warning) => warning.into_iter().collect(),
        Err(why) => vec![format!("`output.animation`: there is none, as {why}")],
    }
}

impl<'a, const D: usize> FilmFrames<'a, D> {
    fn new(m: &'a Moment<'a, D>, output: &Path) -> Result<Self, Error> {
        let series = vtkhdf::read(output.join(m.physics.field_file()))?;
        let spec = &m.scene.output;
        let shown = match &m.scene.stress {
            Some(stress) => FilmField::Stress(format!("cauchy_{}", stress.measures[0].name())),
            None if spec.energy => FilmField::Scalar("energy_density"),
            None if spec.contact => FilmField::Scalar("contact_pressure"),
            None if m.physics.whole.is_some() => FilmField::Scalar("damage"),
            None => FilmField::Displacement,
        };
        let (count, kept) = (series.len(), series.len().min(MOST));
        let chosen = (1..=kept).map(|k| k * count / kept - 1).collect();
        Ok(Self { m, series, shown, chosen })
    }

    /// Values of the field in a frame.
    fn values(&self, frame: usize) -> Result<Vec<f64>, polycore::Error> {
        Ok(match (&self.shown, &self.m.scene.stress) {
            (FilmField::Stress(name), Some(spec)) => {
                let tensors = self.series.data(frame, name)?;
                tensors.chunks(9).map(|t| shown_stress(spec, D == 2, t)).collect()
            }
            (FilmField::Scalar(name), _) => self.series.data(frame, name)?,
            _ => {
                let moved = self.series.data(frame, "displacement")?;
                moved.chunks(3).map(|u| u.iter().map(|u| u * u).sum::<f64>().sqrt()).collect()
            }
        })
    }

    /// Field with the range of all frames.
    fn field(&self, range: (f64, f64)) -> ColouredField {
        let (scale, unit) = stress_unit(range.1.max(-range.0));
        match (&self.shown, &self.m.scene.stress) {
            (FilmField::Stress(_), Some(spec)) => stress_strip(spec, range),
            (FilmField::Scalar("damage"), _) => super::solid::damage_field(),
            (FilmField::Scalar("contact_pressure"), _) => {
                field(format!("contact pressure ({unit})"), scale, range)
            }
            (FilmField::Scalar(_), _) => super::solid::energy_field(&[range.1]),
            _ => field("|u| (mm)".to_owned(), 1e3, range),
        }
    }

    fn draw(&self, path: &Path) -> Result<(), Error> {
        let (m, spacing) = (self.m, self.m.bonds.spacing());
        let (mut bounds, mut range) = (EMPTY_BOX, (0.0_f64, 0.0_f64));
        for &frame in &self.chosen {
            extend_box(&mut bounds, &self.series.points(frame)?);
            let values = self.values(frame)?;
            let (low, high) = match self.shown {
                FilmField::Stress(_) => stress_range(values),
                _ => values.iter().fold((0.0_f64, 0.0_f64), |(low, high), x| (low.min(*x), high.max(*x))),
            };
            range = (range.0.min(low), range.1.max(high));
        }
        let (field, bridge) = (self.field(range), bridge_length(m));
        let title = |frame: usize| moment_title(&m.state.history, self.series.times()[frame]);
        let seconds = (TIME / self.chosen.len() as f64).clamp(EACH[0], EACH[1]);
        let body = |frame: usize| -> Result<_, polycore::Error> {
            let (places, moved) = (self.series.points(frame)?, self.series.data(frame, "displacement")?);
            let at_rest = |(k, x): (usize, &[f64; 3])| [0, 1, 2].map(|d| x[d] - moved[3 * k + d]);
            let rest: Vec<[f64; 3]> = places.iter().enumerate().map(at_rest).collect();
            let values: Vec<f64> = self.values(frame)?.iter().map(|value| value * field.scale).collect();
            Ok((places, rest, values))
        };
        if D == 2 {
            let longest = self.chosen.iter().map(|&frame| title(frame).chars().count()).max().unwrap_or(0);
            let flat = |x: &[[f64; 3]]| -> Vec<[f64; 2]> { x.iter().map(|x| [x[0], x[1]]).collect() };
            let corners = [bounds[0], bounds[1]].map(|x| [x[0], x[1]]);
            return Ok(FieldMap::animate(path, self.chosen.len(), seconds, |k, take| {
                let frame = self.chosen[k];
                let (places, rest, values) = body(frame)?;
                let (places, rest) = (flat(&places), flat(&rest));
                let strip = &field.strip;
                let panel = Panel::new(&title(frame), &strip.label, &places, &values, spacing);
                let panel = panel.range(strip.range.0, strip.range.1).reference(&rest).bridge(bridge);
                // of an equilibrium within a step, where they were before it
                let row = self.series.times()[frame] as usize;
                let height = rigid_height(m, row.checked_sub(1).and_then(|row| m.state.history.get(row)));
                let panel = panel.within(corners);
                let panel = if m.physics.placed.is_empty() { panel } else { panel.rigid(&height) };
                take(&FieldMap::new().lengths("mm", 1e-3).size(SIZE).room_for(longest).panel(panel));
                Ok(())
            })?);
        }
        for d in 0..3 {
            bounds[0][d] -= 0.5 * spacing;
            bounds[1][d] += 0.5 * spacing;
        }
        let spec = m.scene.output.solid.unwrap_or_default();
        let solids = Solids {
            title: m.scene.title.clone(),
            bounds,
            unit: ("mm".into(), 1e-3),
            view: spec.view(),
            fields: vec![field.strip.clone()],
        };
        Ok(solids.animate(path, self.chosen.len(), seconds, |k| {
            let (places, rest, values) = body(self.chosen[k])?;
            let mut at_rest = EMPTY_BOX;
            extend_box(&mut at_rest, &rest);
            let particles = Particles { reference: &rest, positions: &places, spacing, bridge };
            Ok((title(self.chosen[k]), particles.skin(spec.plane(at_rest), |k| [values[k], f64::NAN])))
        })?)
    }
}
