//! Draws the stages of a run from its field file.

use super::moment::Moment;
use super::scale::{bridge_length, moment_title};
use super::solid::{self, BodyView, shown_stress};
use crate::error::Error;
use crate::solver::StepRecord;
use harness::output::picture::{FieldMap, Panel};
use harness::output::vtkhdf;
use std::borrow::Cow;
use std::path::Path;

/// Draws stress and damage at some stages from the last intact state on, of a plane body or of the middle
/// plane y = const of a solid; a solid also from outside.
///
/// # Errors
/// Files that cannot be read or written.
pub fn draw_stages<const D: usize>(m: &Moment<D>, output: &Path) -> Result<(), Error> {
    let (cracks, spacing, history) = (m.damage_of_cracks(), m.bonds.spacing(), &m.state.history);
    let frames = vtkhdf::read(output.join(m.physics.field_file()))?;
    let damages: Vec<f64> = (0..frames.len())
        .map(|k| Ok(new_damage(frames.data(k, "damage")?.iter().sum(), cracks)))
        .collect::<Result<_, Error>>()?;
    // frame of the peak load, which the damage does not determine
    let peak = StepRecord::peak(history);
    let peak = peak.and_then(|k| frames.times().iter().position(|&time| time == (k + 1) as f64));
    let chosen = choose_frames(&damages, peak, m.scene.output.stages);
    let Some(spec) = &m.scene.stress else { return Ok(()) };
    let measure = format!("cauchy_{}", spec.measures[0].name());
    let flat = D == 2;
    let view = |frame: usize| -> Result<BodyView, polycore::Error> {
        let (places, moved) = (frames.points(frame)?, frames.data(frame, "displacement")?);
        let tensors = frames.data(frame, &measure)?;
        let at_rest = |(k, x): (usize, &[f64; 3])| [0, 1, 2].map(|d| x[d] - moved[3 * k + d]);
        Ok(BodyView {
            title: moment_title(history, frames.times()[frame]),
            rest: places.iter().enumerate().map(at_rest).collect(),
            places,
            values: [
                tensors.chunks(9).map(|t| shown_stress(spec, flat, t)).collect(),
                frames.data(frame, "damage")?,
            ],
        })
    };
    struct Stage {
        places: Vec<[f64; 2]>,
        rest: Vec<[f64; 2]>,
        stress: Vec<f64>,
        damage: Vec<f64>,
        title: String,
    }
    let (mut stages, mut all, mut bounds) = (Vec::new(), Vec::new(), solid::EMPTY_BOX);
    for &frame in &chosen {
        let BodyView { title, places, rest, values: [stress, damage] } = view(frame)?;
        solid::extend_box(&mut bounds, &places);
        let (low, high) = rest.iter().fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x[1]), h.max(x[1])));
        let middle = 0.5 * (low + high);
        let keep: Vec<usize> = (0..places.len())
            .filter(|&k| flat || (0.0..spacing).contains(&(rest[k][1] - middle + 0.01 * spacing)))
            .collect();
        let in_plane = |x: [f64; 3]| if flat { [x[0], x[1]] } else { [x[0], x[2]] };
        stages.push(Stage {
            places: keep.iter().map(|&k| in_plane(places[k])).collect(),
            rest: keep.iter().map(|&k| in_plane(rest[k])).collect(),
            stress: keep.iter().map(|&k| stress[k]).collect(),
            damage: keep.iter().map(|&k| damage[k]).collect(),
            title,
        });
        all.extend(stress);
    }
    let (field, damage) = (solid::stress_field(spec, all), solid::damage_field());
    let (scale, strips) = (field.scale, [field.strip.clone(), damage.strip.clone()]);
    if !flat {
        let picture = solid::BodyPictures { moment: m, bounds };
        let fields = vec![field, damage];
        picture.draw(output, fields, chosen.len(), |k| Ok(Cow::Owned(view(chosen[k])?)))?;
    }
    let bridge = bridge_length(m);
    let [wide, tall] = [0, 1].map(|d| {
        let ends = |(low, high): (f64, f64), x: &[f64; 2]| (low.min(x[d]), high.max(x[d]));
        let extent = |stage: &Stage| stage.places.iter().fold((f64::MAX, f64::MIN), ends);
        stages.iter().map(extent).map(|(low, high)| high - low).fold(0.0, f64::max)
    });
    let layout = StageLayout::for_aspect(wide / tall, stages.len());
    let mut map = FieldMap::new().lengths("mm", 1e-3).columns(layout.columns).size(layout.size);
    if !flat {
        map = map.axes(["x", "z"]);
    }
    for stage in &mut stages {
        stage.stress.iter_mut().for_each(|stress| *stress *= scale);
    }
    let kinds = [false, true];
    let order: Vec<(&Stage, bool)> = if layout.pairs {
        stages.iter().flat_map(|stage| kinds.map(|damage| (stage, damage))).collect()
    } else {
        kinds.iter().flat_map(|&damage| stages.iter().map(move |stage| (stage, damage))).collect()
    };
    for (stage, damage) in order {
        let (title, values) = if damage { ("", &stage.damage) } else { (&*stage.title, &stage.stress) };
        let strip = &strips[usize::from(damage)];
        let panel = Panel::new(title, &strip.label, &stage.places, values, spacing);
        let panel = panel.range(strip.range.0, strip.range.1).reference(&stage.rest).bridge(bridge);
        map = map.panel(panel);
    }
    map.write(output.join(format!("stages_{}.png", m.physics.name)))?;
    Ok(())
}

/// Returns the damage without that of the scene's cracks; smaller than rounding counts as 0.
fn new_damage(damage: f64, cracks: f64) -> f64 {
    let since = damage - cracks;
    if since > 3e-7 * cracks { since } else { 0.0 }
}

/// Layout of stages: side by side, damage below stress; wide bodies one below another, damage beside stress.
struct StageLayout {
    pairs: bool,
    columns: usize,
    /// Pixels of a body's longer side.
    size: usize,
}

impl StageLayout {
    /// Returns the layout for bodies `aspect` times as wide as high.
    fn for_aspect(aspect: f64, stages: usize) -> Self {
        match aspect {
            wide if wide > 1.8 => Self { pairs: true, columns: 2, size: 720 },
            narrow if narrow < 0.5 => Self { pairs: false, columns: stages, size: 720 },
            _ => Self { pairs: false, columns: stages, size: 420 },
        }
    }
}

/// Chooses the last frame before the first break, the peak if it is later, frames at even fractions of all
/// damage, and the last frame.
fn choose_frames(damage: &[f64], peak: Option<usize>, count: usize) -> Vec<usize> {
    let last = damage.len() - 1;
    let whole = damage.iter().rposition(|&d| d == 0.0).unwrap_or(0);
    let mut chosen = vec![whole];
    let peak = peak.filter(|peak| (whole + 1..last).contains(peak) && count > 2);
    chosen.extend(peak);
    for part in 1 + chosen.len() - 1..count.saturating_sub(1) {
        let target = damage[last] * part as f64 / (count - 1) as f64;
        let off = |k: usize| (damage[k] - target).abs();
        chosen.extend((whole..=last).min_by(|&a, &b| off(a).total_cmp(&off(b))));
    }
    chosen.push(last);
    chosen.sort_unstable();
    chosen.dedup();
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_are_chosen_by_damage() {
        assert_eq!(choose_frames(&[0.0, 0.0, 1.0, 5.0, 6.0, 9.0], None, 4), [1, 2, 4, 5]);
        // the peak takes the place of the first of them
        assert_eq!(choose_frames(&[0.0, 0.0, 0.1, 1.0, 5.0, 6.0, 9.0], Some(2), 4), [1, 2, 5, 6]);
        assert_eq!(choose_frames(&[0.0, 0.0], Some(0), 4), [1]);
        assert_eq!(choose_frames(&[3.0], None, 4), [0]);
    }
}
