//! Print plan: time and temperature at which elements appear, layer by layer or along a tool path.

use crate::boundary::Schedule;
use crate::error::Error;
use crate::mesh::layers::groups;
use crate::mesh::path::{Setting, ToolPath};
use crate::problem::Birth;
use std::collections::BTreeMap;

/// Name in the error for births before the path sets a nozzle temperature.
pub const NOZZLE: &str = "birth before any temperature of the nozzle, s";

/// Order of a print.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PrintPlan {
    /// Births, in the order of time.
    pub births: Vec<Birth>,
    /// Elements that are never printed, ascending.
    pub absent: Vec<u32>,
    /// Elements of each layer, for a print by layers.
    pub layers: Vec<Vec<u32>>,
    /// End time, s: one interval after the last layer, or the end of the path plus a window after the last
    /// birth.
    pub end: f64,
}

impl PrintPlan {
    /// Plans layer k (from 0) at `start` + k · `interval`, s, at the `temperature`, K, of that time.
    pub fn in_layers(
        layers: Vec<Vec<u32>>,
        start: f64,
        interval: f64,
        temperature: impl Fn(f64) -> f64,
    ) -> Self {
        let birth = |(layer, elements): (u32, &Vec<u32>)| {
            let time = start + f64::from(layer) * interval;
            Birth { time, elements: elements.clone(), temperature: temperature(time) }
        };
        let births: Vec<Birth> = (0..).zip(&layers).map(birth).collect();
        let end = start + births.len() as f64 * interval;
        Self { births, absent: Vec::new(), layers, end }
    }

    /// Plans each element at its time along a path, s after `start`; elements of one `window` appear together
    /// (default: a hundredth of the path's duration). The temperature is given, or that of the nozzle at
    /// deposition.
    ///
    /// # Errors
    /// Errors of [`groups`]; [`Error::Parameter`] named [`NOZZLE`].
    pub fn along_path(
        path: &ToolPath,
        times: &[f64],
        start: f64,
        window: Option<f64>,
        temperature: Option<&Schedule>,
    ) -> Result<Self, Error> {
        let window = window.unwrap_or(0.01 * path.duration());
        let nozzle = path.setting(Setting::Nozzle);
        let mut births = Vec::new();
        for (time, elements) in groups(times, window)? {
            let time = start + time;
            if let Some(schedule) = temperature {
                births.push(Birth { time, elements, temperature: schedule.value_at(time) });
                continue;
            }
            // the temperature at deposition, not at birth: tools differ
            let mut by_temperature: BTreeMap<u64, Vec<u32>> = BTreeMap::new();
            for element in elements {
                let laid = times.get(element as usize).copied().unwrap_or(time - start);
                let before = nozzle.partition_point(|(from, _)| *from <= laid);
                let Some(set) = before.checked_sub(1).map(|at| nozzle[at].1) else {
                    let allowed = "later than the first M104 or M109".into();
                    return Err(Error::Parameter { name: NOZZLE, found: time, allowed });
                };
                by_temperature.entry(set.to_bits()).or_default().push(element);
            }
            let alike = by_temperature.into_iter();
            births.extend(alike.map(|(bits, elements)| {
                let temperature = f64::from_bits(bits);
                Birth { time, elements, temperature }
            }));
        }
        let last = births.last().map_or(start, |birth| birth.time);
        let end = (start + path.duration()).max(last + window);
        Ok(Self { births, absent: Vec::new(), layers: Vec::new(), end })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_appear_one_after_the_other() {
        let plan = PrintPlan::in_layers(vec![vec![0, 1], vec![2], vec![4]], 5.0, 10.0, |time| 400.0 + time);
        let births: Vec<_> =
            plan.births.iter().map(|b| (b.time, b.elements.clone(), b.temperature)).collect();
        assert_eq!(births, [(5.0, vec![0, 1], 405.0), (15.0, vec![2], 415.0), (25.0, vec![4], 425.0)]);
        assert_eq!(plan.end, 35.0);
    }
}
