//! Raw heat flow of a calorimeter as data of a fit.

use super::fit_spec::{DataSpec, Direction, FitLaw, FitSpec, HeatFlowSpec, Limit, temperature, time};
use super::locate_error::located;
use crate::error::Error;
use crate::fit::{MeasuredPeak, Thermogram};
use crate::table::{TableColumn, read_with_lines};
use harness::scene::{SceneError, Source};
use polycore::units::dimension::{PowerDimension, SpecificPowerDimension};
use std::path::Path;

/// Heat flows of a file, and their line numbers.
struct FlowTable {
    measured: Thermogram,
    lines: Vec<usize>,
}

impl FitSpec {
    /// Checks the keys of heat flows.
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
                let why = "it belongs to raw heat flow; remove it or add `heat_flow` to the fit";
                return Err(source.unexpected(&key(&format!("data[{i}].{name}")), why));
            }
            if let Some(mass) = data.mass.map(|mass| mass.si()).filter(|mass| *mass <= 0.0) {
                let at = key(&format!("data[{i}].mass"));
                return Err(source.error(&at, format!("{mass} kg"), "a sample mass above 0"));
            }
        }
        let heat = self.heat_flow.as_ref().and_then(|flow| flow.latent_heat).map(|heat| heat.si());
        match heat.filter(|heat| *heat <= 0.0) {
            Some(heat) => {
                let allowed = "above 0 (heat of fusion of the perfect crystal)";
                Err(source.error(&key("heat_flow.latent_heat"), format!("{heat} J/kg"), allowed))
            }
            None => Ok(()),
        }
    }

    /// Returns the peak of file number `i`.
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
                allowed: format!("{} s or later: increasing times", times[row - 1]),
                path,
            };
            return Err(located(source, &at_key("file"), &error));
        }
        let [first, last] = [times[0], times[times.len() - 1]];
        let from = table.limit(data.from, first, first).map_err(|why| why.locate(source, &at_key("from")))?;
        let to = table.limit(data.to, last, from).map_err(|why| why.locate(source, &at_key("to")))?;
        if from >= to {
            let allowed = format!("after `from`, at {from} s, up to {last} s in {}", data.file.display());
            return Err(source.error(&at_key("to"), format!("{to} s"), allowed));
        }
        let sign = if flow.exothermal == Direction::Up { 1.0 } else { -1.0 };
        let per_mass = sign / data.mass.map_or(1.0, |mass| mass.si());
        table.measured.flows.iter_mut().for_each(|flow| *flow *= per_mass);
        // heat flow above this temperature belongs to the melt
        let melting = self.equilibrium_melting.map_or(f64::INFINITY, |melting| melting.si());
        table.measured.peak([from, to], flow.baseline, melting).map_err(|error| match &error {
            Error::Parameter { allowed, found, .. } => {
                let direction = format!("{:?}", flow.exothermal).to_lowercase();
                let found =
                    format!("`{direction}`, which gives {} the area {found:.4e} J/kg", data.file.display());
                source.error(&key("heat_flow.exothermal"), found, allowed)
            }
            _ => located(source, &at_key("file"), &error),
        })
    }

    /// Reads a file. Heat flows in watts need a mass; others must have none.
    fn read_flow(
        &self,
        source: &Source,
        path: &Path,
        data: &DataSpec,
        key: &dyn Fn(&str) -> String,
    ) -> Result<FlowTable, SceneError> {
        let read = |per_mass: bool| {
            let heat_flow = match per_mass {
                true => TableColumn::new::<SpecificPowerDimension>("heat_flow"),
                false => TableColumn::new::<PowerDimension>("heat_flow"),
            };
            if self.law == FitLaw::Avrami {
                let ([times, flows], lines) = read_with_lines(path, [time(), heat_flow])?;
                return Ok(FlowTable {
                    measured: Thermogram { times, temperatures: Vec::new(), flows },
                    lines,
                });
            }
            let columns = [time(), temperature(), heat_flow];
            let ([times, temperatures, flows], lines) = read_with_lines(path, columns)?;
            Ok(FlowTable { measured: Thermogram { times, temperatures, flows }, lines })
        };
        let error: Error = match read(data.mass.is_none()) {
            Ok(table) => return Ok(table),
            Err(error) => error,
        };
        // if the file is readable the other way, the error is the mass
        Err(match (read(data.mass.is_some()), data.mass) {
            (Err(_), _) => located(source, &key("file"), &error),
            (Ok(_), None) => {
                let why = format!(
                    "the heat flow of {} is a power; write the mass of the sample, e.g. \"5.2 mg\", or a \
                     column in W/g",
                    data.file.display()
                );
                source.missing(&key("mass"), why)
            }
            (Ok(_), Some(_)) => {
                let why = format!(
                    "the heat flow of {} is already per mass; remove it, or write a column in mW",
                    data.file.display()
                );
                source.unexpected(&key("mass"), why)
            }
        })
    }
}

/// A refused limit: the value found, and the allowed ones.
struct LimitError([String; 2]);

impl LimitError {
    fn locate(self, source: &Source, key: &str) -> SceneError {
        let [found, allowed] = self.0;
        source.error(key, found, allowed)
    }
}

impl FlowTable {
    /// Returns the time of a limit; for a temperature the first time after `start` at which cooling passes
    /// it.
    fn limit(&self, limit: Option<Limit>, default: f64, start: f64) -> Result<f64, LimitError> {
        let Thermogram { times, temperatures, .. } = &self.measured;
        let [first, last] = [times[0], times[times.len() - 1]];
        match limit {
            None => Ok(default),
            Some(Limit::Time(time)) if (first..=last).contains(&time.si()) => Ok(time.si()),
            Some(Limit::Time(time)) => {
                let allowed = format!("{first} to {last} s, the times of the file");
                Err(LimitError([format!("{} s", time.si()), allowed]))
            }
            Some(Limit::Temperature(_)) if temperatures.is_empty() => {
                let found = "a temperature in an isothermal run".to_owned();
                Err(LimitError([found, format!("a time, {first} to {last} s")]))
            }
            Some(Limit::Temperature(wanted)) => {
                let wanted = wanted.si();
                self.measured.first_crossing(wanted, start).ok_or_else(|| {
                    let celsius = |kelvin: f64| kelvin - 273.15;
                    let low = temperatures.iter().fold(f64::INFINITY, |low, &t| low.min(t));
                    let high = temperatures.iter().fold(0.0, |high: f64, &t| high.max(t));
                    let found = format!("{:.2} degC", celsius(wanted));
                    let allowed = "a temperature that the file passes on cooling, `to` after `from`";
                    let range = format!("the file covers {:.2} to {:.2} degC", celsius(low), celsius(high));
                    LimitError([found, format!("{allowed}; {range}")])
                })
            }
        }
    }
}
