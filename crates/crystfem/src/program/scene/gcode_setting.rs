//! Values over time from the settings of a G-code file: nozzle, bed or fan.

use super::locate_error::located;
use super::schedule::{FileSetting, ScheduleSpec, TimesSpec};
use crate::boundary::Schedule;
use crate::mesh::path::{Setting, ToolPath, read_gcode};
use harness::scene::{SceneError, Source};
use polycore::units::dimension::TemperatureDimension;
use polycore::units::{Acceleration, Dimension, Speed};
use serde::Deserialize;
use std::path::PathBuf;

/// Time in which a setting is reached, s.
const CHANGE_TIME: f64 = 1.0;
/// Default temperature towards which a bed cools, K, and its time constant, s: 3 mm of aluminium (7.3 kJ/(m²
/// K)) lose 12 W/(m² K).
const ROOM_TEMPERATURE: f64 = 298.15;
const COOLING_TIME: f64 = 600.0;
/// Sampled times of a cooling over its time constant: linear interpolation between them is off by at most 0.2
/// %.
const COOLING_SAMPLES: [f64; 20] =
    [0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.75, 0.9, 1.1, 1.3, 1.5, 1.8, 2.1, 2.5, 3.0, 3.6, 4.4, 5.5, 7.0];
/// Distance from room temperature at which a bed counts as cold, K.
const COLD: f64 = 1.0;

/// Keys of a scene that change the times of a path.
#[derive(Deserialize)]
struct PathOutline {
    mesh: Option<MeshOutline>,
    print: Option<PrintOutline>,
}

#[derive(Deserialize)]
struct MeshOutline {
    path: Option<PathTiming>,
}

#[derive(Deserialize)]
struct PathTiming {
    file: PathBuf,
    acceleration: Option<Acceleration>,
    jerk: Option<Speed>,
}

#[derive(Deserialize)]
struct PrintOutline {
    path: Option<PathBuf>,
    acceleration: Option<Acceleration>,
    jerk: Option<Speed>,
}

impl<D: Dimension + Copy> TimesSpec<D> {
    /// Reads the path of the file, with the times at which the scene prints it.
    fn path(&self, source: &Source, key: &str) -> Result<ToolPath, SceneError> {
        let Some(name) = &self.file else {
            return Err(source.missing(&format!("{key}.file"), "`of` needs a G-code file"));
        };
        let file = source.file(name);
        let path = read_gcode(&file).map_err(|error| located(source, &format!("{key}.file"), &error))?;
        let outline: PathOutline = source.parse()?;
        let own = outline.mesh.and_then(|mesh| mesh.path).map(|own| (own.file, own.acceleration, own.jerk));
        let along = outline.print.and_then(|own| own.path.map(|file| (file, own.acceleration, own.jerk)));
        for (other, acceleration, jerk) in own.into_iter().chain(along) {
            if let (Some(acceleration), Some(jerk), true) = (acceleration, jerk, source.file(other) == file) {
                let fault = |error| located(source, &format!("{key}.file"), &error);
                return path.with_acceleration(acceleration.si(), jerk.si()).map_err(fault);
            }
        }
        Ok(path.with_stated_limits())
    }

    /// Returns the temperature towards which a bed cools, K, and the time constant, s.
    fn cooling(&self) -> (f64, f64) {
        (
            self.cools_to.map_or(ROOM_TEMPERATURE, |room| room.si()),
            self.cooling_time.map_or(COOLING_TIME, |time| time.si()),
        )
    }

    /// Returns a setting of a G-code file over time. Each command acts within a second, but a bed that is
    /// switched off or set lower cools exponentially. Before the first command its value applies; the fan is
    /// off.
    pub(super) fn gcode_schedule(
        &self,
        source: &Source,
        key: &str,
        of: FileSetting,
        table: bool,
    ) -> Result<Schedule, SceneError> {
        let fault =
            |name: &str, found: &str, allowed: &str| source.error(&format!("{key}.{name}"), found, allowed);
        if self.file.is_some() && (table || self.period.is_some()) {
            let other = format!("{key}.{}", if table { "time" } else { "period" });
            return Err(source.conflict(&format!("{key}.of"), &other, "keep one of them"));
        }
        let path = self.path(source, key)?;
        let setting = match of {
            FileSetting::Nozzle => Setting::Nozzle,
            FileSetting::Bed => Setting::Bed,
            FileSetting::Fan => Setting::Fan,
        };
        let mut pairs = path.setting(setting);
        match (setting, self.low, self.high) {
            (Setting::Fan, Some(low), Some(high)) => {
                for (_, value) in &mut pairs {
                    *value = low.si() + (high.si() - low.si()) * *value;
                }
                pairs.insert(0, (f64::NEG_INFINITY, low.si()));
            }
            (Setting::Fan, ..) => {
                return Err(source.missing(
                    &format!("{key}.low"),
                    "a fan needs `low` and `high`: the values with the fan off and on",
                ));
            }
            (_, None, None) if D::NAME == TemperatureDimension::NAME => {}
            (_, None, None) => {
                return Err(fault("of", "a temperature setting", "`fan` with `low` and `high`"));
            }
            _ => {
                return Err(source.unexpected(
                    &format!("{key}.low"),
                    "temperatures of a file need no scale; remove `low` and `high`",
                ));
            }
        }
        let cooling = [("cools_to", self.cools_to.is_some()), ("cooling_time", self.cooling_time.is_some())];
        if let Some((name, _)) = cooling.iter().find(|(_, given)| *given && setting != Setting::Bed) {
            return Err(
                source.unexpected(&format!("{key}.{name}"), "it belongs to `of = \"bed\"`; remove it")
            );
        }
        let (room, constant) = self.cooling();
        if !(constant > 0.0 && constant.is_finite()) {
            return Err(fault("cooling_time", &constant.to_string(), "above 0, finite"));
        }
        let points = if setting == Setting::Bed { bed(&pairs, room, constant) } else { steps(&pairs) };
        Schedule::linear(&points).map_err(|error| located(source, &format!("{key}.file"), &error))
    }
}

/// Returns values that are reached within a second of their commands.
fn steps(pairs: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut points: Vec<(f64, f64)> = Vec::new();
    for &(time, value) in pairs {
        match points.last().copied() {
            None => points.push((time.max(-CHANGE_TIME), value)),
            // of several commands within a second, the last one applies
            Some((last, before)) => {
                let from = time.max(last + 1e-6 * CHANGE_TIME);
                points.extend([(from, before), (from + CHANGE_TIME, value)]);
            }
        }
    }
    points
}

/// Returns the temperatures of a bed, K. It heats within a second, and cools exponentially towards room
/// temperature down to its setting; NaN switches it off. If the file first switches it off, it was on before.
fn bed(pairs: &[(f64, f64)], room: f64, constant: f64) -> Vec<(f64, f64)> {
    let on = pairs.iter().position(|pair| !pair.1.is_nan());
    let Some(on) = on else { return pairs.first().map_or_else(Vec::new, |_| vec![(0.0, room)]) };
    let mut points = vec![(pairs[on].0.max(-CHANGE_TIME), pairs[on].1)];
    for (k, &(time, set)) in pairs.iter().enumerate().skip(on + 1) {
        let (last, now) = points[points.len() - 1];
        let from = time.max(last + 1e-6 * CHANGE_TIME);
        points.push((from, now));
        if set >= now {
            points.push((from + CHANGE_TIME, set));
            continue;
        }
        let next = pairs.get(k + 1).map_or(f64::INFINITY, |pair| pair.0);
        let at = |after: f64| room + (now - room) * (-after / constant).exp();
        // time at which it reaches its setting; never below room temperature
        let reached = if set > room { constant * ((now - room) / (set - room)).ln() } else { f64::INFINITY };
        let end = reached.min(next - from);
        let inside = COOLING_SAMPLES
            .iter()
            .map(|share| share * constant)
            .filter(|after| *after < end - 1e-6 * CHANGE_TIME);
        points.extend(inside.map(|after| (from + after, at(after))));
        if end.is_finite() && end > 2e-6 * CHANGE_TIME {
            points.push((from + end, if reached <= next - from { set } else { at(end) }));
        }
    }
    points
}

impl ScheduleSpec<TemperatureDimension> {
    /// Returns the time at which the file finally switches off its bed, s, and the temperature at `end`, K,
    /// unless the bed is cold by then.
    pub(super) fn still_hot(
        &self,
        source: &Source,
        key: &str,
        end: f64,
    ) -> Result<Option<(f64, f64)>, SceneError> {
        let Self::Over(over) = self else { return Ok(None) };
        if over.of != Some(FileSetting::Bed) {
            return Ok(None);
        }
        let pairs = over.path(source, key)?.setting(Setting::Bed);
        let Some(&(time, _)) = pairs.last().filter(|pair| pair.1.is_nan()) else { return Ok(None) };
        let (room, constant) = over.cooling();
        let schedule = Schedule::linear(&bed(&pairs, room, constant));
        let then = schedule.map_err(|error| located(source, key, &error))?.value_at(end);
        Ok((then > room + COLD).then_some((time, then)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bed at 60 °C is switched off at 10 s in a room of 20 °C, time constant 100 s: 20 + (60 − 20)/e °C
    /// after 100 s; set lower, it stops at its setting.
    #[test]
    fn beds_cool() {
        let at = |pairs: &[(f64, f64)], time: f64| {
            Schedule::linear(&bed(pairs, 20.0, 100.0)).unwrap().value_at(time)
        };
        let off = [(0.0, 60.0), (10.0, f64::NAN)];
        for (time, exact) in
            [(5.0, 60.0), (110.0, 20.0 + 40.0 / 1f64.exp()), (210.0, 20.0 + 40.0 / 2f64.exp())]
        {
            let found = at(&off, time);
            assert!((found - exact).abs() < 0.1, "{time}: {found} {exact}");
        }
        let lower = [(0.0, 60.0), (10.0, 40.0)];
        let reached = 10.0 + 100.0 * 2f64.ln();
        assert!((at(&lower, reached) - 40.0).abs() < 1e-9 && at(&lower, reached + 50.0) == 40.0);
        assert!(at(&lower, reached - 20.0) > 44.0);
        // switched on again before it is cold
        let again = [(0.0, 60.0), (10.0, f64::NAN), (110.0, 60.0)];
        assert!((at(&again, 110.0) - 34.7).abs() < 0.1 && at(&again, 112.0) == 60.0);
        assert_eq!(bed(&[(0.0, f64::NAN), (0.5, 60.0)], 20.0, 100.0), [(0.5, 60.0)]);
        assert_eq!(bed(&[(0.0, f64::NAN)], 20.0, 100.0), [(0.0, 20.0)]);
    }
}
