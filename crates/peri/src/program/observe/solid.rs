//! Draws solids from outside.

use super::frames::{in_space, tensor_in_space};
use super::moment::Moment;
use super::scale::{bridge_length, moment_title, stress_unit};
use crate::error::Error;
use crate::program::scene::StressSpec;
use harness::output::picture::{ColorMap, Particles, Skin, Solids, Strip};
use nalgebra::Matrix3;
use std::borrow::Cow;
use std::path::Path;

/// Number of pictures of a full turn.
const TURN_PICTURES: usize = 36;
/// Time for which each picture of a turn is shown, s.
const PICTURE_TIME: f64 = 0.12;
/// Empty bounding box.
pub const EMPTY_BOX: [[f64; 3]; 2] = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];

/// Body at a moment: current and reference positions of its particles, and values of one or two fields.
#[derive(Clone)]
pub struct BodyView {
    pub title: String,
    pub places: Vec<[f64; 3]>,
    pub rest: Vec<[f64; 3]>,
    pub values: [Vec<f64>; 2],
}

/// Field in a picture: the factor of its values, and its colours.
pub struct ColouredField {
    pub scale: f64,
    pub strip: Strip,
}

/// Pictures of a variant.
pub struct BodyPictures<'a, const D: usize> {
    pub moment: &'a Moment<'a, D>,
    /// Bounding box of all positions.
    pub bounds: [[f64; 3]; 2],
}

/// Extends a box by positions.
pub fn extend_box(bounds: &mut [[f64; 3]; 2], places: &[[f64; 3]]) {
    for place in places {
        for d in 0..3 {
            bounds[0][d] = bounds[0][d].min(place[d]);
            bounds[1][d] = bounds[1][d].max(place[d]);
        }
    }
}

/// Returns the stress component of the scene from a row-major 3 × 3 tensor; by default the largest principal
/// stress, of a plane tensor in its plane.
pub fn shown_stress(spec: &StressSpec, flat: bool, t: &[f64]) -> f64 {
    if let Some([a, b]) = spec.component() {
        return t[3 * a + b];
    }
    if flat {
        let (mean, half) = (0.5 * (t[0] + t[4]), 0.5 * (t[0] - t[4]));
        return mean + half.hypot(0.5 * (t[1] + t[3]));
    }
    // the eigenvalue iteration would not end
    if t.iter().any(|x| !x.is_finite()) {
        return f64::NAN;
    }
    let tensor = Matrix3::from_row_slice(t);
    (0.5 * (tensor + tensor.transpose())).symmetric_eigenvalues().max()
}

/// Returns the field of stresses, with a range that leaves out extremes: the Cauchy stress of a crushed
/// particle would use all colours.
pub fn stress_field(spec: &StressSpec, values: Vec<f64>) -> ColouredField {
    stress_strip(spec, stress_range(values))
}

/// Returns the range of values, with 0 and without extremes.
pub fn stress_range(mut values: Vec<f64>) -> (f64, f64) {
    values.retain(|value| !value.is_nan());
    values.sort_by(f64::total_cmp);
    let part =
        |share: f64| values.get((share * (values.len().max(1) - 1) as f64) as usize).copied().unwrap_or(0.0);
    (part(0.002).min(0.0), part(0.998).max(0.0))
}

/// Returns the field of stresses with a range, Pa.
pub fn stress_strip(spec: &StressSpec, (low, high): (f64, f64)) -> ColouredField {
    let (scale, unit) = stress_unit(high.max(-low));
    let index: String = match (&spec.component, spec.component()) {
        (Some(name), Some(_)) => {
            name.chars().filter_map(|c| "₀₁₂₃".chars().nth(c.to_digit(10)? as usize)).collect()
        }
        _ => "₁".to_owned(),
    };
    field(format!("σ{index} ({unit})"), scale, (low, high))
}

/// Returns the field of damage.
pub fn damage_field() -> ColouredField {
    field("damage".to_owned(), 1.0, (0.0, 0.6))
}

/// Returns the field of flags: 1 where a learnt law is uncertain, else 0.
pub fn flagged_field() -> ColouredField {
    field("flagged".to_owned(), 1.0, (0.0, 1.0))
}

/// Returns the field of energy densities with these values, J/m³.
pub fn energy_field(values: &[f64]) -> ColouredField {
    let most = values.iter().copied().fold(0.0, f64::max);
    let (scale, unit) = stress_unit(most);
    field(format!("energy density ({})", unit.replace("Pa", "J/m³")), scale, (0.0, most))
}

/// Returns a field with a factor of its values and a range before it.
pub fn field(label: String, scale: f64, (low, high): (f64, f64)) -> ColouredField {
    let range = (low * scale, high * scale);
    let range = if range.0 < range.1 && (range.1 - range.0).is_finite() { range } else { (0.0, 1.0) };
    ColouredField { scale, strip: Strip { label, range, colors: ColorMap::Viridis } }
}

/// Draws the end of a run without stages: stress or the length of the displacement, and a second field.
///
/// # Errors
/// A file that cannot be written.
pub fn draw_end<const D: usize>(
    m: &Moment<D>,
    second: Option<(ColouredField, Vec<f64>)>,
    output: &Path,
) -> Result<(), Error> {
    let stresses = m.stresses()?;
    let rest: Vec<[f64; 3]> = m.sites().map(|site| in_space(m.bonds.position(site))).collect();
    let moved = || m.sites().map(|site| in_space(m.state.displacement.get(site)));
    let places: Vec<[f64; 3]> =
        rest.iter().zip(moved()).map(|(x, u)| [0, 1, 2].map(|d| x[d] + u[d])).collect();
    let (first, values) = match (&m.scene.stress, stresses.cauchy.first()) {
        (Some(spec), Some((_, tensors))) => {
            let values: Vec<f64> =
                tensors.iter().map(|t| shown_stress(spec, false, &tensor_in_space(t))).collect();
            (stress_field(spec, values.clone()), values)
        }
        _ => {
            let values: Vec<f64> = moved().map(|u| u.iter().map(|u| u * u).sum::<f64>().sqrt()).collect();
            let largest = values.iter().fold(0.0_f64, |most, u| most.max(*u));
            (field("|u| (mm)".to_owned(), 1e3, (0.0, largest)), values)
        }
    };
    let (second, others) = second.filter(|(_, values)| values.iter().any(|&value| value > 0.0)).unzip();
    let fields = std::iter::once(first).chain(second).collect();
    let mut bounds = EMPTY_BOX;
    let title = moment_title(&m.state.history, m.state.history.len() as f64);
    extend_box(&mut bounds, &places);
    let view = BodyView { title, places, rest, values: [values, others.unwrap_or_default()] };
    let picture = BodyPictures { moment: m, bounds };
    picture.draw(output, fields, 1, |_| Ok(Cow::Borrowed(&view)))
}

impl<const D: usize> BodyPictures<'_, D> {
    /// Draws the stages side by side, and the last in a full turn if the scene requests it.
    ///
    /// # Errors
    /// A file that cannot be written; errors of `view`.
    pub fn draw<'l>(
        &self,
        output: &Path,
        fields: Vec<ColouredField>,
        stages: usize,
        mut view: impl FnMut(usize) -> Result<Cow<'l, BodyView>, polycore::Error>,
    ) -> Result<(), Error> {
        let (m, spacing) = (self.moment, self.moment.bonds.spacing());
        let spec = m.scene.output.solid.unwrap_or_default();
        let mut last = None;
        let scales: Vec<f64> = fields.iter().map(|field| field.scale).collect();
        let mut bounds = self.bounds;
        for d in 0..3 {
            bounds[0][d] -= 0.5 * spacing;
            bounds[1][d] += 0.5 * spacing;
        }
        let solids = Solids {
            title: m.titled(&m.scene.title),
            bounds,
            unit: ("mm".into(), 1e-3),
            view: spec.view(),
            fields: fields.into_iter().map(|field| field.strip).collect(),
        };
        let mut stage = |index: usize| -> Result<(String, Skin), polycore::Error> {
            let view = view(index)?;
            let BodyView { title, places, rest, values } = &*view;
            let mut at_rest = EMPTY_BOX;
            extend_box(&mut at_rest, rest);
            let bridge = bridge_length(m);
            let particles = Particles { reference: rest, positions: places, spacing, bridge };
            let value = |field: usize, k: usize| {
                let scale = scales.get(field).copied().unwrap_or(1.0);
                values[field].get(k).map_or(f64::NAN, |value| value * scale)
            };
            Ok((title.clone(), particles.skin(spec.plane(at_rest), |k| [value(0, k), value(1, k)])))
        };
        let name = &m.file_name();
        solids.write(output.join(format!("solid_{name}.png")), stages, |index| {
            let drawn = stage(index)?;
            last = spec.turntable.then(|| drawn.clone());
            Ok(drawn)
        })?;
        if let Some(last) = last {
            solids.turn(output.join(format!("turntable_{name}.png")), TURN_PICTURES, PICTURE_TIME, &last)?;
        }
        Ok(())
    }
}
