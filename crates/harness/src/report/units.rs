//! Units in which results are shown: those that the scene uses.

use crate::scene::REPORT;
use serde::Deserialize;
use std::collections::BTreeMap;

/// Unit in which a number of a report is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShownUnit {
    /// Symbol beside the number.
    pub name: &'static str,
    /// Factor from the unit of the report.
    pub factor: f64,
}

/// A dimension: the unit of reports and its spellings, and units in which it may be shown, the largest first.
type UnitChoices = (&'static [&'static str], &'static [(&'static str, f64)]);

const DIMENSIONS: &[UnitChoices] = &[
    (&["m"], &[("m", 1.0), ("cm", 1e2), ("mm", 1e3), ("µm", 1e6), ("nm", 1e9)]),
    (&["m²", "m^2"], &[("m²", 1.0), ("mm²", 1e6)]),
    (&["m³", "m^3"], &[("m³", 1.0), ("mm³", 1e9)]),
    (&["N"], &[("kN", 1e-3), ("N", 1.0), ("mN", 1e3)]),
    (&["Pa"], &[("GPa", 1e-9), ("MPa", 1e-6), ("kPa", 1e-3), ("Pa", 1.0)]),
    (&["J"], &[("kJ", 1e-3), ("J", 1.0), ("mJ", 1e3), ("µJ", 1e6)]),
    (&["J/m²", "J/m^2"], &[("kJ/m²", 1e-3), ("N/mm", 1e-3), ("J/m²", 1.0)]),
    (&["s"], &[("h", 1.0 / 3600.0), ("min", 1.0 / 60.0), ("s", 1.0), ("ms", 1e3), ("µs", 1e6)]),
];

/// Numbers in the unit of the scene that are easy to read.
const READABLE: std::ops::Range<f64> = 1e-3..1e5;

/// Units that a scene uses.
#[derive(Debug, Default)]
pub struct SceneUnits {
    /// Number of uses, by name.
    counts: BTreeMap<&'static str, usize>,
    /// Units that the scene asks for, `[report] units`.
    requested: Vec<String>,
}

/// Unit of `[report] units`.
#[derive(Clone, Debug, Deserialize)]
#[serde(try_from = "String")]
pub(crate) struct RequestedUnit(String);

impl TryFrom<String> for RequestedUnit {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        let all = || DIMENSIONS.iter().flat_map(|dimension| dimension.1).map(|own| own.0);
        let unit = spelled(&name);
        all()
            .any(|own| own == unit)
            .then_some(Self(unit))
            .ok_or_else(|| format!("found `{name}`; allowed: {}", all().collect::<Vec<_>>().join(", ")))
    }
}

/// Spells a unit as results do: `m²` for `m^2`, `µm` for `um`.
fn spelled(unit: &str) -> String {
    unit.trim().replace("^2", "²").replace("^3", "³").replace('u', "µ")
}

impl SceneUnits {
    /// Counts the units of all quantities in a scene.
    pub fn from_scene(text: &str) -> Self {
        let mut units = Self::default();
        let root: toml::Table = text.parse().unwrap_or_default();
        let requested = || root.get(REPORT)?.get("units")?.as_array();
        let unit = |name: &toml::Value| RequestedUnit::try_from(name.as_str()?.to_owned()).ok();
        units.requested = requested().into_iter().flatten().filter_map(|name| Some(unit(name)?.0)).collect();
        let mut left = vec![toml::Value::Table(root)];
        while let Some(value) = left.pop() {
            match value {
                toml::Value::Table(table) => left.extend(table.into_iter().map(|(_, value)| value)),
                toml::Value::Array(items) => left.extend(items),
                toml::Value::String(quantity) => units.count(&quantity),
                _ => {}
            }
        }
        for (length, area, volume) in [("mm", "mm²", "mm³"), ("m", "m²", "m³")] {
            let count = units.counts.get(length).copied().unwrap_or_default();
            for unit in [area, volume] {
                *units.counts.entry(unit).or_default() += count;
            }
        }
        units
    }

    fn count(&mut self, quantity: &str) {
        let quantity = quantity.trim();
        let end = quantity.find(|c: char| !(c.is_ascii_digit() || "+-.eE".contains(c))).unwrap_or(0);
        let (number, unit) = quantity.split_at(end);
        let unit = spelled(unit);
        let known = DIMENSIONS.iter().flat_map(|dimension| dimension.1).find(|own| own.0 == unit);
        if let (Ok(_), Some((name, _))) = (number.parse::<f64>(), known) {
            *self.counts.entry(name).or_default() += 1;
        }
    }

    /// Returns the unit for numbers up to `largest`, in `unit` of the report: the first requested, that of
    /// the scene if it gives readable numbers, otherwise the largest unit that does. Other units stay.
    pub fn shown(&self, unit: &str, largest: f64) -> Option<ShownUnit> {
        let given = |dimension: &&UnitChoices| {
            dimension.0.contains(&unit) || dimension.1.iter().any(|own| own.0 == unit)
        };
        let (base, choices) = DIMENSIONS.iter().find(given)?;
        let is_base = base.contains(&unit);
        let own = choices.iter().find(|own| own.0 == unit && !is_base).map_or(1.0, |own| own.1);
        let of_name = |name: &String| choices.iter().find(|choice| choice.0 == name);
        if let Some((name, factor)) = self.requested.iter().find_map(of_name) {
            return Some(ShownUnit { name, factor: factor / own });
        }
        if !is_base {
            return None;
        }
        let count = |name: &str| self.counts.get(name).copied().unwrap_or_default();
        let used = choices.iter().filter(|own| count(own.0) > 0).max_by_key(|own| count(own.0));
        let readable =
            |own: &&(&'static str, f64)| largest == 0.0 || READABLE.contains(&(largest.abs() * own.1));
        // units that only their users expect
        let large = |own: &&(&str, f64)| largest.abs() * own.1 >= 0.1 && !["cm", "min", "h"].contains(&own.0);
        let (name, factor) =
            used.filter(readable).or_else(|| choices.iter().find(large)).or(choices.last()).copied()?;
        Some(ShownUnit { name, factor })
    }

    /// Returns a number of a report and its unit as they are shown.
    pub fn convert(&self, value: f64, unit: &str) -> (f64, String) {
        match self.shown(unit, value) {
            Some(shown) => (value * shown.factor, shown.name.to_owned()),
            None => (value, if unit == "degC" { "°C".to_owned() } else { unit.to_owned() }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_of_the_scene_come_first() {
        let scene = "# a plate's\nspacing = \"2 mm\"\nmin = [\"-5e1 mm\", \"1 m\"]\n\
                     stress = \"1 kPa\"\ntime = \"3 min\"\nname = \"e\"";
        let units = SceneUnits::from_scene(scene);
        let close = |(value, unit): (f64, String), expected: f64, name: &str| {
            assert!((value - expected).abs() < 1e-12 * expected.abs() && unit == name, "{value} {unit}");
        };
        close(units.convert(0.0125, "m"), 12.5, "mm");
        close(units.convert(2.5e4, "Pa"), 25.0, "kPa");
        close(units.convert(90.0, "s"), 1.5, "min");
        close(units.convert(2e-6, "m^2"), 2.0, "mm²");
        // numbers that nobody reads in that unit
        close(units.convert(2.5e9, "Pa"), 2.5, "GPa");
        close(units.convert(2e-9, "m"), 2.0, "nm");
        // nothing in the scene, and units that are not converted
        close(units.convert(0.25, "N"), 0.25, "N");
        close(units.convert(21.0, "degC"), 21.0, "°C");
        close(units.convert(3.0, "1/s"), 3.0, "1/s");
        assert_eq!(units.shown("m", 0.0).map(|unit| unit.name), Some("mm"));
        // those requested, whatever the number
        let units = SceneUnits::from_scene("[report]\nunits = [\"N\", \"um\"]\n[body]\nsize = \"2 mm\"");
        close(units.convert(2.5e7, "N"), 2.5e7, "N");
        close(units.convert(2e-3, "m"), 2000.0, "µm");
        // of reports in other units, too; the first of two
        let units = SceneUnits::from_scene("[report]\nunits = [\"kPa\", \"MPa\"]");
        close(units.convert(2.0, "MPa"), 2000.0, "kPa");
        close(units.convert(2.0, "Pa"), 2e-3, "kPa");
    }
}
