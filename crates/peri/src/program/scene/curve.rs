//! Curves of time that multiply what a boundary prescribes: formulas, or tables of files.

use super::curve_spec::{CurveList, CurveSpec, CurveTable};
use super::formula::Formula;
use super::values::plain;
use super::{BodyForceSpec, Boundary, ContactSpec, Prescribed, Scene};
use crate::field::Field;
use crate::solver::{Amplitude, CurvedLoads, CurvedRegion, LoadCurve, Loads, Support, ramped};
use harness::scene::{SceneError, Source};
use polycore::table::{Table, plain_unit};
use polycore::units::dimension::{
    AccelerationDimension, AngleDimension, AngularVelocityDimension, ForceDimension, LengthDimension,
    StressDimension, TimeDimension,
};
use polycore::units::{Dimension, Unit};
use std::fmt;

/// Parts of the time of a run at which a formula is checked.
pub(super) const MOMENTS: u32 = 256;
/// Largest multiple at the start of a quasi-static programme, which begins without load.
const START: f64 = 1e-9;

impl Boundary {
    /// Returns true if a curve multiplies what the boundary prescribes, or a part of it.
    pub fn has_curve(&self) -> bool {
        self.curve.is_some() || self.rotation.as_ref().is_some_and(|rotation| rotation.curve.is_some())
    }

    /// Returns the key that needs a programme of times or dynamics.
    fn timed(&self) -> Option<&'static str> {
        let keys = [("curve", self.has_curve()), ("traction_field", self.depends_on_time())];
        keys.into_iter().find_map(|(key, given)| given.then_some(key))
    }

    /// Returns true if the boundary prescribes a displacement or a force.
    fn loads(&self) -> bool {
        self.prescribes_displacement() || self.prescribes_force()
    }
}

impl Scene {
    /// Returns true if loads follow curves: those of boundaries, or any in a later step.
    pub fn has_curves(&self) -> bool {
        self.later
            || self.boundary.iter().any(|own| own.timed().is_some() || own.pressure.is_some())
            || self.body_force.iter().any(BodyForceSpec::is_curved)
            || self.contact.as_ref().is_some_and(ContactSpec::has_curve)
    }

    /// Returns true if loads follow curves that differ, or steps.
    pub fn has_several_motions(&self) -> bool {
        let curves = self.boundary.iter().filter_map(|own| own.curve.as_ref());
        let texts = curves.flat_map(|curve| match curve {
            CurveList::All(own) => vec![format!("{own:?}")],
            CurveList::Each(each) => each.iter().map(|own| format!("{own:?}")).collect(),
        });
        self.later || !self.step.is_empty() || texts.collect::<std::collections::BTreeSet<_>>().len() > 1
    }

    /// Returns true if forces depend on the displacement.
    pub fn has_followers(&self) -> bool {
        self.boundary.iter().any(|own| own.pressure.is_some())
            || self.body_force.iter().any(|force| force.spin.is_some())
    }

    /// Returns the load factor of explicit dynamics and its rate over the time, s; `None` for a ramp. With
    /// curves the factor is the part of the whole time.
    pub fn amplitude(&self) -> Option<Box<LoadCurve<'_>>> {
        let dynamics = self.dynamics.as_ref()?;
        if self.has_curves() {
            let end = dynamics.end_time.si();
            return Some(Box::new(move |time| (time / end, 1.0 / end)));
        }
        let factor = dynamics.factor.as_ref()?;
        Some(Box::new(|time| factor.value_and_rate(time)))
    }
}

/// Time of a run with curves, or of one of its steps: its end, s, and the load factor of what has no curve.
pub(super) struct CurveTime {
    /// Time of a curve at the start, s.
    begin: f64,
    pub(super) end: f64,
    explicit: bool,
    moments: Vec<f64>,
    pub(super) common: Amplitude,
}

impl CurveTime {
    pub(super) fn new(scene: &Scene) -> Self {
        if let Some(dynamics) = &scene.dynamics {
            let (end, ramp) = (dynamics.method().end_time, dynamics.method().ramp);
            let common = match dynamics.factor.clone() {
                Some(factor) => of_formula(factor, [0.0, end]),
                None => Amplitude::new(move |part| {
                    let (value, rate) = ramped(part * end, ramp);
                    (value, rate * end)
                }),
            };
            let moments = (0..=MOMENTS).map(|k| end * f64::from(k) / f64::from(MOMENTS)).collect();
            return Self { begin: 0.0, end, explicit: true, moments, common };
        }
        let (factors, times) = scene.programme();
        let Some(&end) = times.last() else {
            // a later step without times: the load factor itself
            let common = Amplitude::new(|part| (part, 1.0));
            return Self { begin: 0.0, end: 1.0, explicit: false, moments: Vec::new(), common };
        };
        let moments: Vec<f64> = std::iter::once(0.0).chain(times).collect();
        let factors = std::iter::once(0.0).chain(factors).collect();
        let common = of_rows(moments.clone(), factors, [0.0, end]);
        Self { begin: 0.0, end, explicit: false, common, moments }
    }

    /// Time of rigid surfaces: their curves are over the time of all steps, and those without one stay where
    /// the first step has left them.
    pub(super) fn of_surfaces(scene: &Scene) -> Self {
        let mut time = Self::new(scene);
        if scene.later {
            let factor = scene.earlier.factor;
            (time.begin, time.common) = (scene.earlier.time, Amplitude::new(move |_| (factor, 0.0)));
        }
        time
    }

    /// Times at which curves and formulas are checked, s.
    pub(super) fn moments(&self) -> &[f64] {
        &self.moments
    }

    /// Converts and checks the curve at a key; `values` are those that it multiplies.
    pub(super) fn amplitude(
        &self,
        source: &Source,
        key: &str,
        curve: &CurveSpec,
        values: &Multiplied,
    ) -> Result<Amplitude, SceneError> {
        let amplitude = match curve {
            CurveSpec::Formula(formula) => {
                if let Some(found) = formula.find_variable_except("t") {
                    let found = format!("`{found}` in `{}`", formula.text());
                    return Err(source.error(key, found, "a formula of `t`, the time in s"));
                }
                of_formula(formula.clone(), [self.begin, self.end])
            }
            CurveSpec::Table(table) => self.of_table(source, key, table, values)?,
        };
        for &time in &self.moments {
            let (value, rate) =
                (amplitude.multiple(time / self.end), amplitude.rate(time / self.end) / self.end);
            if !value.is_finite() || self.explicit && !rate.is_finite() {
                let found = format!("{value}, rising at {rate} 1/s, at {} s", plain(self.begin + time));
                let allowed =
                    format!("finite values and rates from 0 s to {} s", plain(self.begin + self.end));
                return Err(source.error(key, found, allowed));
            }
        }
        let start = amplitude.multiple(0.0);
        if !self.explicit && self.begin == 0.0 && values.moves() && start.abs() > START {
            let found = format!("{start} at 0 s");
            return Err(source.error(key, found, "0 at 0 s: a quasi-static run begins at rest"));
        }
        Ok(amplitude)
    }

    /// Converts and checks the curves of all components at a key; `values` are those that the curve of a
    /// component, or of all, multiplies.
    pub(super) fn amplitudes<const D: usize>(
        &self,
        source: &Source,
        key: &str,
        curve: &CurveList,
        values: impl Fn(Option<usize>) -> Multiplied,
    ) -> Result<[Amplitude; D], SceneError> {
        let each: Vec<Amplitude> = match curve {
            CurveList::All(curve) => vec![self.amplitude(source, key, curve, &values(None))?; D],
            CurveList::Each(curves) => {
                let each = curves.iter().enumerate().map(|(d, curve)| {
                    self.amplitude(source, &format!("{key}[{d}]"), curve, &values(Some(d)))
                });
                each.collect::<Result<_, _>>()?
            }
        };
        let found = each.len();
        <[Amplitude; D]>::try_from(each).map_err(|_| {
            source.error(key, format!("{found} curves"), format!("one, or {D}: one for each component"))
        })
    }

    fn of_table(
        &self,
        source: &Source,
        key: &str,
        spec: &CurveTable,
        values: &Multiplied,
    ) -> Result<Amplitude, SceneError> {
        let refused = |error: &dyn fmt::Display| source.refused(&format!("{key}.file"), error);
        let table = Table::read(source.file(&spec.file)).map_err(|error| refused(&error))?;
        let column = |name: &str| table.require_column(&[name]).map_err(|error| refused(&error));
        let [at, of] = [column(&spec.time)?, column(&spec.value)?];
        let times = table.column::<TimeDimension>(at, None).map_err(|error| refused(&error))?;
        let rows = (0..table.rows()).map(|row| table.number(row, of)).collect::<Result<Vec<f64>, _>>();
        let rows = rows.map_err(|error| refused(&error))?;
        if let Some(row) = (1..times.len()).find(|&row| times[row] <= times[row - 1]) {
            let before = plain(times[row - 1]);
            return Err(refused(&table.refuse_cell(
                row,
                at,
                &format!("a time above {before} s, as in a curve"),
            )));
        }
        let unit = table.headings[of].unit.as_deref().map(plain_unit).unwrap_or_default();
        if let Some((found, allowed)) = values.misfit(&unit) {
            let allowed = format!("{allowed}, as column `{}` multiplies it", table.headings[of].text);
            return Err(source.error(&format!("{key}.value"), found, allowed));
        }
        let end = self.begin + self.end;
        let whole = format!("times from 0 s to {} s, the whole run", plain(end));
        match (times.first(), times.last()) {
            (Some(&first), Some(&last)) if first <= 0.0 && last >= end * (1.0 - 1e-9) => {
                Ok(of_rows(times, rows, [self.begin, self.end]))
            }
            (Some(first), Some(last)) => {
                let found = format!("times from {} s to {} s", plain(*first), plain(*last));
                Err(source.error(&format!("{key}.file"), found, whole))
            }
            _ => Err(source.error(&format!("{key}.file"), "no row", whole)),
        }
    }
}

/// Amplitude of a formula of the time over `end`, s, from `begin` on.
fn of_formula(formula: Formula, [begin, end]: [f64; 2]) -> Amplitude {
    Amplitude::new(move |part| {
        let (value, rate) = formula.value_and_rate(begin + part * end);
        (value, rate * end)
    })
}

/// Amplitude that is linear between points of time, s, over `end` from `begin` on; at a point it has the rate
/// after it.
fn of_rows(times: Vec<f64>, values: Vec<f64>, [begin, end]: [f64; 2]) -> Amplitude {
    Amplitude::new(move |part| {
        let now = begin + part * end;
        let after = times.partition_point(|&time| time <= now);
        let after = after.min(times.len() - 1).max(usize::from(times.len() > 1));
        let before = after.saturating_sub(1);
        let length = times[after] - times[before];
        let rise = if length > 0.0 { (values[after] - values[before]) / length } else { 0.0 };
        let within = now.clamp(times[before], times[after]) - times[before];
        // the end of a line to the bit
        let value = if within == length { values[after] } else { values[before] + rise * within };
        (value, rise * end)
    })
}

/// Values that a curve multiplies, SI, by their dimension.
#[derive(Default)]
pub(super) struct Multiplied {
    pub(super) lengths: Vec<f64>,
    pub(super) forces: Vec<f64>,
    pub(super) stresses: Vec<f64>,
    pub(super) angles: Vec<f64>,
    pub(super) fields: bool,
    pub(super) accelerations: Vec<f64>,
    pub(super) speeds: Vec<f64>,
    /// True for forces that are formulas of the position.
    pub(super) formulas: bool,
}

impl Multiplied {
    /// Values of a boundary, of one component or of all.
    fn new(boundary: &Boundary, component: Option<usize>) -> Self {
        let own = |d: usize| component.is_none_or(|component| component == d);
        let moved = boundary.displacement.iter().flatten().enumerate().filter(|(d, _)| own(*d));
        let forces = boundary.force.iter().flatten().enumerate().filter(|(d, _)| own(*d));
        let stresses = boundary.traction.iter().flatten().enumerate().filter(|(d, _)| own(*d));
        let stresses = stresses.map(|(_, stress)| stress).chain(&boundary.pressure);
        let turned =
            boundary.rotation.iter().filter(|rotation| component.is_none() && rotation.curve.is_none());
        let length = |held: &Prescribed| match held {
            Prescribed::At(value) => *value,
            Prescribed::Free | Prescribed::Hold => 0.0,
        };
        Self {
            lengths: moved.map(|(_, held)| length(held)).collect(),
            forces: forces.map(|(_, force)| force.si()).collect(),
            stresses: stresses.map(|stress| stress.si()).collect(),
            angles: turned.map(|rotation| rotation.angle.si()).collect(),
            fields: boundary.displacement_field.is_some(),
            formulas: boundary.traction_field.is_some(),
            ..Self::default()
        }
    }

    /// Returns true if any value is a displacement.
    pub(super) fn moves(&self) -> bool {
        self.fields || self.lengths.iter().chain(&self.angles).any(|value| *value != 0.0)
    }

    /// Returns true if any value is not 0.
    pub(super) fn is_load(&self) -> bool {
        self.moves() || self.formulas || self.forces.iter().chain(&self.stresses).any(|value| *value != 0.0)
    }

    /// Returns what does not suit a column with a unit, and what would.
    fn misfit(&self, unit: &str) -> Option<(String, String)> {
        if unit.is_empty() {
            return None;
        }
        let fields = (self.fields || self.formulas).then(|| {
            let allowed = "a column without a unit".to_owned();
            (format!("a column in {unit} for formulas of the position"), allowed)
        });
        fields
            .or_else(|| misfit_of::<LengthDimension>(unit, &self.lengths, "m"))
            .or_else(|| misfit_of::<ForceDimension>(unit, &self.forces, "N"))
            .or_else(|| misfit_of::<StressDimension>(unit, &self.stresses, "Pa"))
            .or_else(|| misfit_of::<AngleDimension>(unit, &self.angles, "rad"))
            .or_else(|| misfit_of::<AccelerationDimension>(unit, &self.accelerations, "m/s²"))
            .or_else(|| misfit_of::<AngularVelocityDimension>(unit, &self.speeds, "rad/s"))
    }
}

fn misfit_of<D: Dimension>(unit: &str, values: &[f64], si: &str) -> Option<(String, String)> {
    let one =
        Unit::<D>::parse(unit).ok().and_then(|unit| unit.quantity(1.0).ok()).map_or(f64::NAN, |one| one.si());
    let fits = |value: &&f64| (value.abs() / one - 1.0).abs() < 1e-9;
    let value = values.iter().filter(|value| **value != 0.0).find(|value| !fits(value))?;
    Some((
        format!("a column in {unit} for {} {si}", plain(*value)),
        format!("values of 0, 1 {unit} or -1 {unit}"),
    ))
}

/// Amplitudes of the angle and of each component of every boundary; none without curves.
///
/// # Errors
/// A curve that is not defined over the run, that has another variable than `t` or a unit that does not suit
/// the values, and files that cannot be read.
pub(super) fn amplitudes<const D: usize>(
    source: &Source,
    scene: &Scene,
) -> Result<Vec<(Amplitude, [Amplitude; D])>, SceneError> {
    if !scene.has_curves() {
        return Ok(Vec::new());
    }
    let time = CurveTime::new(scene);
    let of = |(index, boundary): (usize, &Boundary)| {
        let key = format!("boundary[{index}].curve");
        let each: [Amplitude; D] = match &boundary.curve {
            None => std::array::from_fn(|_| time.common.clone()),
            Some(curve) => {
                time.amplitudes(source, &key, curve, |component| Multiplied::new(boundary, component))?
            }
        };
        let angle = match boundary.rotation.as_ref().and_then(|rotation| rotation.curve.as_ref()) {
            Some(curve) => {
                let angle = boundary.rotation.iter().map(|rotation| rotation.angle.si()).collect();
                let values = Multiplied { angles: angle, ..Multiplied::default() };
                time.amplitude(source, &format!("boundary[{index}].rotation.curve"), curve, &values)?
            }
            None if boundary.rotation.is_some() && matches!(boundary.curve, Some(CurveList::Each(_))) => {
                let why = "needed beside a curve for each component: the curve of the angle";
                return Err(source.missing(&format!("boundary[{index}].rotation.curve"), why));
            }
            None => each[0].clone(),
        };
        Ok((angle, each))
    };
    scene.boundary.iter().enumerate().map(of).collect()
}

/// Returns the amplitude of what has no curve.
pub fn common_amplitude(scene: &Scene) -> Amplitude {
    CurveTime::new(scene).common
}

/// Lets the loads of all boundaries follow their amplitudes; `surfaces` are the tractions of solids, by
/// boundary.
pub(super) fn follow<const D: usize>(
    regions: &[(Vec<u32>, Support<D>)],
    rotates: impl Fn(usize) -> bool,
    kept: impl Fn(usize) -> u8,
    surfaces: &[(usize, Field<D>)],
    amplitudes: &[(Amplitude, [Amplitude; D])],
    loads: &mut Loads<D>,
) {
    let mut curved = CurvedLoads::default();
    for (index, ((members, support), (_, amplitudes))) in regions.iter().zip(amplitudes).enumerate() {
        let region = |sites: Vec<u32>, values: Vec<[f64; D]>, components: u8| {
            CurvedRegion::new(sites, values, amplitudes.clone(), components)
        };
        let components = (0..D).map(|d| u8::from(support.displacement[d].is_some()) << d).sum();
        if let Some(field) = loads.displacement.as_ref().filter(|_| components != 0 && !rotates(index)) {
            let values = members.iter().map(|&site| field.get(site as usize)).collect();
            let mut held = region(members.clone(), values, components);
            held.kept = kept(index);
            curved.held.push(held);
        }
        if support.body_force != [0.0; D] {
            curved.pushed.push(region(members.clone(), vec![support.body_force; members.len()], 0));
        }
        for (_, field) in surfaces.iter().filter(|(own, _)| *own == index) {
            let each = (0..field.sites()).map(|site| (site as u32, field.get(site)));
            let (sites, values) = each.filter(|(_, value)| *value != [0.0; D]).unzip();
            curved.pushed.push(region(sites, values, 0));
        }
    }
    loads.curved = Some(Box::new(curved));
    loads.set_peaks();
}

/// Checks the keys that exclude curves, and what curves need.
///
/// # Errors
/// A [`SceneError`] that names the key.
pub(super) fn check(source: &Source, scene: &Scene) -> Result<(), SceneError> {
    let mut boundaries = scene.boundary.iter().enumerate();
    let of_boundary = boundaries.find_map(|(index, own)| Some(format!("boundary[{index}].{}", own.timed()?)));
    let surfaces = scene.contact.as_ref().map(ContactSpec::curved_surfaces).unwrap_or_default();
    let of_surface = surfaces.iter().find(|own| own.curve.is_some()).map(|own| format!("{}.curve", own.key));
    let mut forces = scene.body_force.iter().enumerate();
    let of_force = forces.find_map(|(index, force)| Some(format!("body_force[{index}].{}", force.timed()?)));
    let first = of_boundary.or(of_force).or(of_surface);
    if !scene.has_curves() {
        return Ok(());
    }
    for (index, boundary) in scene.boundary.iter().enumerate() {
        if boundary.has_curve() && !boundary.loads() {
            let why =
                "a curve multiplies displacements, rotations, forces and tractions; this boundary has none";
            return Err(source.unexpected(&format!("boundary[{index}].curve"), why));
        }
    }
    if scene.dynamics.is_some() {
        return Ok(());
    }
    let Some(time) = &scene.time else {
        let Some(first) = first else { return Ok(()) };
        let why = format!("needed for `{first}`: the steps of a programme, or dynamics");
        return Err(source.missing("time", why));
    };
    let idle = |boundary: &Boundary| boundary.timed().is_none() && Multiplied::new(boundary, None).is_load();
    let boundary = scene.boundary.iter().position(idle).map(|index| format!("boundary[{index}]"));
    let force = scene.body_force.iter().position(|force| force.timed().is_none());
    let force = force.map(|index| format!("body_force[{index}]"));
    let surface = surfaces.iter().find(|own| own.curve.is_none() && own.multiplied(None).is_load());
    match boundary.or(force).or(surface.map(|own| own.key.clone())) {
        Some(key) if time.step.iter().all(|step| step.factor.is_none()) => {
            let found = "a load without `curve`, in a programme whose factor stays 0";
            let allowed = "a `curve` here, or a `factor` in [[time.step]]";
            Err(source.error(&key, found, allowed))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_joined_by_lines() {
        let amplitude = of_rows(vec![0.0, 2.0, 3.0], vec![0.0, 4.0, 4.0], [0.0, 3.0]);
        let found = [0.0, 1.0, 2.0, 2.5, 3.0]
            .map(|time| (amplitude.multiple(time / 3.0), amplitude.rate(time / 3.0)));
        let near = |(a, b): ((f64, f64), (f64, f64))| (a.0 - b.0).abs() < 1e-14 && (a.1 - b.1).abs() < 1e-14;
        let expected = [(0.0, 6.0), (2.0, 6.0), (4.0, 0.0), (4.0, 0.0), (4.0, 0.0)];
        assert!(found.into_iter().zip(expected).all(near), "{found:?}");
        let later = of_rows(vec![0.0, 2.0, 3.0], vec![0.0, 4.0, 4.0], [1.0, 2.0]);
        assert_eq!([0.0, 0.5, 1.0].map(|part| later.multiple(part)), [2.0, 4.0, 4.0]);
    }

    #[test]
    fn units_multiply_one() {
        let of = |lengths: &[f64]| Multiplied { lengths: lengths.to_vec(), ..Multiplied::default() };
        assert!(of(&[0.0, 1e-3, -1e-3]).misfit("mm").is_none() && of(&[2e-3]).misfit("").is_none());
        let (found, allowed) = of(&[0.0, 2e-3]).misfit("mm").unwrap();
        assert_eq!((&*found, &*allowed), ("a column in mm for 0.002 m", "values of 0, 1 mm or -1 mm"));
        assert!(of(&[1.0]).misfit("N").is_some());
    }
}
