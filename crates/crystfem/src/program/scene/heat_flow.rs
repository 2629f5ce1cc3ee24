//! Raw heat flow of a calorimeter as measurements of a fit.

use super::fault::located;
use super::fit_spec::{DataSpec, Direction, FitLaw, FitSpec, HeatFlowSpec, Limit, temperature, time};
use crate::error::Error;
use crate::fit::{MeasuredPeak, Thermogram};
use crate::table::{TableColumn, read_with_lines};
use harness::scene::{SceneError, Source};
use polycore::units::dimension::{PowerDimension, SpecificPowerDimension};
use std::path::Path;

/// Heat flows and lines of a file.
struct Table {
    measured: Thermogram,
    lines: Vec<usize>,
}

impl FitSpec {
    /// Refuses what belongs to heat flows where there are none.
    pub(super) fn check_heat_flow(
        &self,
        source: &Source,
        key: &dyn Fn(&str) -> String,
    ) -> Result<(), SceneError> {
        let foreign = |data: &DataSpec| {
            let given =
                [("mass", data.mass.is_some()), ("from", data.from.is_some()), ("to", data.to.is_some())];
            given.into_iter().find(|(_, given)| *given).map(|(name, _)| name)
        };
        for (i, data) in self.data.iter().enumerate() {
            if let (None, Some(name)) = (&self.heat_flow, foreign(data)) {
                let found = format!("`{name}` of a table of alpha");
                let allowed = "nothing, or `heat_flow` in the fit, for files with raw heat flow";
                return Err(source.error(&key(&format!("data[{i}].{name}")), found, allowed));
            }
            if let Some(mass) = data.mass.map(|mass| mass.si()).filter(|mass| *mass <= 0.0) {
                let at = key(&format!("data[{i}].mass"));
                return Err(source.error(&at, format!("{mass} kg"), "above 0: the mass of the sample"));
            }
        }
        let heat = self.heat_flow.as_ref().and_then(|flow| flow.latent_heat).map(|heat| heat.si());
        match heat.filter(|heat| *heat <= 0.0) {
            Some(heat) => {
                let allowed = "above 0: the heat of fusion of the perfect crystal";
                Err(source.error(&key("heat_flow.latent_heat"), format!("{heat} J/kg"), allowed))
            }
            None => Ok(()),
        }
    }

    /// The peak of the file number `i`.
    pub(super) fn measured(
        &self,
        source: &Source,
        key: &dyn Fn(&str) -> String,
        flow: &HeatFlowSpec,
        i: usize,
    ) -> Result<MeasuredPeak, SceneError> {
        let data = &self.data[i];
        let at_key = |field: &str| key(&format!("data[{i}].{field}"));
        let path = source.file(&data.file);
        let mut table = self.read_flow(source, &path, data, &at_key)?;
        let times = &table.measured.times;
        if let Some(row) = (1..times.len()).find(|&row| times[row] < times[row - 1]) {
            let error = Error::File {
                line: table.lines[row],
                what: "column `time`".into(),
                found: format!("{} s", times[row]),
                allowed: format!("{} s or later: times in ascending order", times[row - 1]),
                path,
            };
            return Err(located(source, &at_key("file"), &error));
        }
        let [first, last] = [times[0], times[times.len() - 1]];
        let from = table.limit(data.from, first, first).map_err(|why| why.at(source, &at_key("from")))?;
        let to = table.limit(data.to, last, from).map_err(|why| why.at(source, &at_key("to")))?;
        if from >= to {
            let allowed = format!("after `from`, at {from} s, up to {last} s in {}", data.file.display());
            return Err(source.error(&at_key("to"), format!("{to} s"), allowed));
        }
        let sign = if flow.exothermal == Direction::Up { 1.0 } else { -1.0 };
        let per_mass = sign / data.mass.map_or(1.0, |mass| mass.si());
        table.measured.flows.iter_mut().for_each(|flow| *flow *= per_mass);
        // what lies before it in the melt has no part in it
        let melting = self.equilibrium_melting.map_or(f64::INFINITY, |melting| melting.si());
        table.measured.peak([from, to], flow.baseline, melting).map_err(|error| match &error {
            Error::Parameter { allowed, found, .. } => {
                let direction = format!("{:?}", flow.exothermal).to_lowercase();
                let found = format!("`{direction}`, by which {} has {found:.4e} J/kg", data.file.display());
                source.error(&key("heat_flow.exothermal"), found, allowed)
            }
            _ => located(source, &at_key("file"), &error),
        })
    }

    /// Reads a file; a mass must be given of heat flows in watts, and not of others.
    fn read_flow(
        &self,
        source: &Source,
        path: &Path,
        data: &DataSpec,
        key: &dyn Fn(&str) -> String,
    ) -> Result<Table, SceneError> {
        let read = |per_mass: bool| {
            let heat_flow = match per_mass {
                true => TableColumn::new::<SpecificPowerDimension>("heat_flow"),
                false => TableColumn::new::<PowerDimension>("heat_flow"),
            };
            if self.law == FitLaw::Avrami {
                let ([times, flows], lines) = read_with_lines(path, [time(), heat_flow])?;
                return Ok(Table { measured: Thermogram { times, temperatures: Vec::new(), flows }, lines });
            }
            let columns = [time(), temperature(), heat_flow];
            let ([times, temperatures, flows], lines) = read_with_lines(path, columns)?;
            Ok(Table { measured: Thermogram { times, temperatures, flows }, lines })
        };
        let error: Error = match read(data.mass.is_none()) {
            Ok(table) => return Ok(table),
            Err(error) => error,
        };
        // the other way round it can be read: the fault is the mass
        Err(match (read(data.mass.is_some()), data.mass) {
            (Err(_), _) => located(source, &key("file"), &error),
            (Ok(_), None) => {
                let found = format!("nothing, and the heat flow of {} is a power", data.file.display());
                source.error(&key("mass"), found, "the sample's mass, e.g. \"5.2 mg\", or a column in W/g")
            }
            (Ok(_), Some(_)) => {
                let found = format!("`mass`, and the heat flow of {} is one per mass", data.file.display());
                source.error(&key("mass"), found, "nothing, or a column in mW")
            }
        })
    }
}

/// What was found as a limit, and what is allowed.
struct Refused([String; 2]);

impl Refused {
    fn at(self, source: &Source, key: &str) -> SceneError {
        let [found, allowed] = self.0;
        source.error(key, found, allowed)
    }
}

impl Table {
    /// The time of a limit: the first one after `start` at which a temperature is passed on cooling.
    fn limit(&self, limit: Option<Limit>, default: f64, start: f64) -> Result<f64, Refused> {
        let Thermogram { times, temperatures, .. } = &self.measured;
        let [first, last] = [times[0], times[times.len() - 1]];
        match limit {
            None => Ok(default),
            Some(Limit::Time(time)) if (first..=last).contains(&time.si()) => Ok(time.si()),
            Some(Limit::Time(time)) => {
                let allowed = format!("{first} to {last} s, the times of the file");
                Err(Refused([format!("{} s", time.si()), allowed]))
            }
            Some(Limit::Temperature(_)) if temperatures.is_empty() => {
                let found = "a temperature in an isothermal run".to_owned();
                Err(Refused([found, format!("a time, {first} to {last} s")]))
            }
            Some(Limit::Temperature(wanted)) => {
                let wanted = wanted.si();
                self.measured.first_crossing(wanted, start).ok_or_else(|| {
                    let celsius = |kelvin: f64| kelvin - 273.15;
                    let low = temperatures.iter().fold(f64::INFINITY, |low, &t| low.min(t));
                    let high = temperatures.iter().fold(0.0, |high: f64, &t| high.max(t));
                    let found = format!("{:.2} degC", celsius(wanted));
                    let allowed = "a temperature that the file falls through, `to` after `from`";
                    let range = format!("it has {:.2} to {:.2} degC", celsius(low), celsius(high));
                    Refused([found, format!("{allowed}; {range}")])
                })
            }
        }
    }
}
