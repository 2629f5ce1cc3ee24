//! Scene of fits.

use super::fit_part::PartFit;
use super::fit_spec::{FitLaw, FitSpec, alpha, table, temperature, time};
use super::locate_error::located_in;
use super::material::KINETICS_KEYS;
use super::{PictureOutput, Program, check_name};
use crate::fit::{Cooling, FixedConstants, MeasuredPeak, Run};
use crate::kinetics::{KineticConstants, Kinetics};
use harness::report::Expect;
use harness::scene::{SceneError, Source};
use serde::Deserialize;

/// A scene of fits.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FitScene {
    /// Program of the scene: `crystfem`.
    pub program: Program,
    /// Title for tables and pictures.
    #[serde(default)]
    pub title: String,
    /// The fits.
    pub fit: Vec<FitSpec>,
    /// Files to write.
    #[serde(default)]
    pub output: PictureOutput,
    /// Expected results.
    #[serde(default)]
    pub expect: Vec<Expect>,
}

/// A checked fit with its data.
pub enum Job {
    /// Times, s, and α.
    Avrami(Vec<f64>, Vec<f64>),
    /// Cooling curves, and the temperatures at which they are compared, K.
    Ozawa(Vec<Cooling>, Vec<f64>),
    /// Runs, and prescribed constants.
    Nakamura(Vec<Run>, FixedConstants),
    /// A part, and the measurements in it.
    Part(Box<PartFit>),
}

impl FitScene {
    /// Reads the data of all fits, and the peaks of those from heat flows.
    ///
    /// # Errors
    /// Returns a [`SceneError`] with key, value and allowed values; for data with file, line and column.
    pub fn jobs(&self, source: &Source) -> Result<Vec<(Job, Vec<MeasuredPeak>)>, SceneError> {
        if self.fit.is_empty() {
            return Err(source.missing("fit", "a fit scene needs at least one [[fit]]"));
        }
        let mut jobs = Vec::new();
        for (index, fit) in self.fit.iter().enumerate() {
            let key = |field: &str| format!("fit[{index}].{field}");
            check_name(source, &key("name"), &fit.name)?;
            if self.fit[..index].iter().any(|other| other.name == fit.name) {
                return Err(source.error(
                    &key("name"),
                    format!("`{}` twice", fit.name),
                    "a different name for each fit",
                ));
            }
            let tables = |other: &&FitSpec| {
                other.heat_flow.is_some() && fit.name.strip_prefix(&other.name) == Some("-heat-flow")
            };
            let taken =
                self.fit.iter().find(tables).map(|other| format!("the heat flow of `{}`", other.name));
            let taken = taken.or_else(|| (fit.name == "estimates").then(|| "all estimates".to_owned()));
            if let Some(taken) = taken {
                let found = format!("`{0}`, but {0}.csv holds {taken}", fit.name);
                return Err(source.error(&key("name"), found, "a different name"));
            }
            fit.check_keys(source, &key)?;
            fit.check_heat_flow(source, &key)?;
            let measured = |flow| {
                (0..fit.data.len()).map(|i| fit.measured(source, &key, flow, i)).collect::<Result<_, _>>()
            };
            let peaks: Vec<MeasuredPeak> = fit.heat_flow.as_ref().map_or(Ok(Vec::new()), measured)?;
            jobs.push((fit.job(source, &key, &peaks)?, peaks));
        }
        Ok(jobs)
    }
}

impl FitSpec {
    fn check_keys(&self, source: &Source, key: &dyn Fn(&str) -> String) -> Result<(), SceneError> {
        use FitLaw::{Nakamura, Ozawa, Part};
        let foreign = [
            ("temperatures", !self.temperatures.is_empty(), Ozawa),
            ("equilibrium_melting", self.equilibrium_melting.is_some(), Nakamura),
            ("frozen", self.frozen.is_some(), Nakamura),
            ("glass_transition", self.glass_transition.is_some(), Nakamura),
            ("activation_energy", self.activation_energy.is_some(), Nakamura),
            ("predict", !self.predict.is_empty(), Nakamura),
            ("part", self.part.is_some(), Part),
            ("material", self.material.is_some(), Part),
        ];
        for (name, given, law) in foreign {
            if given && law != self.law {
                let law = format!("{law:?}").to_lowercase();
                let why = format!("it belongs to `law = \"{law}\"`; remove it or change the law");
                return Err(source.unexpected(&key(name), why));
            }
        }
        let rows = self.data.len();
        let needed = if self.law == Ozawa { 3 } else { 1 };
        if rows < needed {
            return Err(source.error(&key("data"), format!("{rows} files"), format!("at least {needed}")));
        }
        if self.law == FitLaw::Avrami && rows > 1 {
            return Err(source.error(&key("data[1]"), "2 files", "1 file (use one [[fit]] per temperature)"));
        }
        if self.law == Part && self.heat_flow.is_some() {
            let why = "fits of a part use α, not heat flow; remove it";
            return Err(source.unexpected(&key("heat_flow"), why));
        }
        for (i, rate) in self.predict.iter().map(|rate| rate.si()).enumerate() {
            let at = key(&format!("predict[{i}]"));
            if !(rate > 0.0 && rate.is_finite()) {
                return Err(source.error(&at, format!("{rate} K/s"), "a cooling rate above 0"));
            }
            if let Some(row) = self.data.iter().position(|data| data.rate.is_none()) {
                let why = "a prediction needs the cooling rate of each run";
                return Err(source.missing(&key(&format!("data[{row}].rate")), why));
            }
        }
        for (i, data) in self.data.iter().enumerate() {
            if self.law != Part && data.probe.is_some() {
                let at = key(&format!("data[{i}].probe"));
                return Err(
                    source.unexpected(&at, "it belongs to `law = \"part\"`; remove it or change the law")
                );
            }
            let at = key(&format!("data[{i}].rate"));
            match (self.law, data.rate.map(|rate| rate.si())) {
                (Part, Some(_)) => {
                    return Err(source.unexpected(&at, "the part determines the cooling; remove it"));
                }
                (FitLaw::Avrami, Some(_)) => {
                    return Err(source.unexpected(&at, "Avrami's law fits isothermal runs; remove it"));
                }
                (Ozawa, None) => {
                    return Err(source.missing(&at, "Ozawa's law needs the cooling rate of each run"));
                }
                (_, Some(rate)) if !(rate > 0.0 && rate.is_finite()) => {
                    return Err(source.error(&at, format!("{rate} K/s"), "a cooling rate above 0"));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Reads the data of a fit, from the peaks of its heat flows if it has any, else from tables of α.
    fn job(
        &self,
        source: &Source,
        key: &dyn Fn(&str) -> String,
        peaks: &[MeasuredPeak],
    ) -> Result<Job, SceneError> {
        match self.law {
            FitLaw::Avrami => {
                if let [MeasuredPeak { peak, .. }] = peaks {
                    let times = peak.times.iter().map(|time| time - peak.times[0]).collect();
                    return Ok(Job::Avrami(times, peak.degrees.clone()));
                }
                let columns = [time().within(0.0, f64::INFINITY), alpha()];
                let [times, degrees] = table(source, &key("data[0].file"), &self.data[0].file, columns)?;
                Ok(Job::Avrami(times, degrees))
            }
            FitLaw::Ozawa => {
                if self.temperatures.is_empty() {
                    let why = "Ozawa's law needs at least one temperature at which it compares the rates";
                    return Err(source.missing(&key("temperatures"), why));
                }
                let mut coolings = Vec::new();
                for (i, data) in self.data.iter().enumerate() {
                    let at = key(&format!("data[{i}].file"));
                    let [temperatures, degrees] = match peaks.get(i) {
                        Some(found) => [found.temperatures.clone(), found.peak.degrees.clone()],
                        None => table(source, &at, &data.file, [temperature(), alpha()])?,
                    };
                    coolings.push(Cooling { rate: data.rate.map_or(0.0, |r| r.si()), temperatures, degrees });
                }
                Ok(Job::Ozawa(coolings, self.temperatures.iter().map(|t| t.si()).collect()))
            }
            FitLaw::Nakamura => {
                let known = self.known(source, key)?;
                let mut runs = Vec::new();
                for (i, data) in self.data.iter().enumerate() {
                    let at = key(&format!("data[{i}].file"));
                    runs.push(match (data.rate, peaks.get(i)) {
                        (Some(rate), found) => {
                            let [temperatures, degrees] = match found {
                                Some(found) => [found.temperatures.clone(), found.peak.degrees.clone()],
                                None => table(source, &at, &data.file, [temperature(), alpha()])?,
                            };
                            let run = Run::cooling(rate.si(), temperatures, degrees, &known);
                            run.map_err(|error| source.error(&at, error, "decreasing temperatures"))?
                        }
                        (None, Some(found)) => found.run(),
                        (None, None) => {
                            let columns = [time(), temperature(), alpha()];
                            let [times, temperatures, degrees] = table(source, &at, &data.file, columns)?;
                            Run { times, temperatures, degrees, history: Vec::new() }
                        }
                    });
                }
                Ok(Job::Nakamura(runs, known))
            }
            FitLaw::Part => Ok(Job::Part(Box::new(self.read_part(source, key)?))),
        }
    }

    fn known(&self, source: &Source, key: &dyn Fn(&str) -> String) -> Result<FixedConstants, SceneError> {
        let Some(melting) = self.equilibrium_melting else {
            let why = "Nakamura's law needs the temperature T₀, e.g. from a Hoffman–Weeks plot";
            return Err(source.missing(&key("equilibrium_melting"), why));
        };
        let frozen = match (self.frozen, self.glass_transition) {
            (Some(frozen), None) => frozen.si(),
            (None, Some(glass)) => glass.si() - 30.0,
            (None, None) => {
                let why = "Nakamura's law needs `frozen`, or `glass_transition` for T∞ = T_g − 30 K";
                return Err(source.missing(&key("frozen"), why));
            }
            (Some(_), Some(_)) => {
                return Err(source.conflict(&key("glass_transition"), &key("frozen"), "keep one of them"));
            }
        };
        let example = KineticConstants::TABLE_4_1_COLUMN_1;
        let known = FixedConstants {
            equilibrium_melting: melting.si(),
            frozen,
            activation_energy: self.activation_energy.map_or(example.activation_energy, |u| u.si()),
        };
        let trial = KineticConstants {
            equilibrium_melting: known.equilibrium_melting,
            frozen: known.frozen,
            activation_energy: known.activation_energy,
            ..example
        };
        let block = key("");
        let block = block.trim_end_matches('.');
        Kinetics::new(trial).map_err(|error| located_in(source, block, &KINETICS_KEYS, &error))?;
        Ok(known)
    }
}
