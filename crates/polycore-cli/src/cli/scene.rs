//! Scenes of fits, trials and networks: laws, data, expectations.

use std::fmt::Write;

use harness::report::Expect;
use harness::scene::{SceneError, Source};
use polycore::constitutive::hyperelastic::host::CardProgram;
use polycore::constitutive::hyperelastic::{self, MODELS, ModelDescriptor};
use serde::Deserialize;

use super::data::{DataSet, TestTableSpec};
use super::foams::{FoamSet, FoamSpec};
use super::forecasts::{ForecastSet, ForecastSpec};
use super::networks::{NetworkSet, NetworkSpec};
use super::prony::{PronySet, PronySpec};
use super::quantities as q;
use super::time::{TimeCase, TimeSettings};
use super::trials::FitTrial;
use super::volumetric::{Bulk, VolumetricSet, VolumetricSpec};

/// Scene as written in the file.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct Scene {
    /// Checked by its type only.
    #[serde(rename = "program")]
    _program: Program,
    /// Title for tables and pictures, one line.
    #[serde(default)]
    title: String,
    /// Fits.
    #[serde(default)]
    fit: FitSettings,
    /// Fit of a law with time.
    time: Option<TimeSettings>,
    /// Laws at single states and fits to a few states, with their expected behaviour.
    #[serde(default)]
    trial: Vec<FitTrial>,
    /// Relaxation tests and oscillations, for Prony series.
    #[serde(default)]
    prony: Vec<PronySpec>,
    /// Tables of polymer networks to predict.
    #[serde(default)]
    network: Vec<NetworkSpec>,
    /// Volumetric tests, which give bulk moduli.
    #[serde(default)]
    volumetric: Vec<VolumetricSpec>,
    /// Foams to which compressible laws are fitted.
    #[serde(default)]
    foam: Vec<FoamSpec>,
    /// Tension curves whose rest is predicted from their beginning.
    #[serde(default)]
    forecast: Vec<ForecastSpec>,
    /// Expected results.
    #[serde(default)]
    expect: Vec<Expect>,
}

/// Program that runs these scenes; `cargo xtask validate` selects by it.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
enum Program {
    Polycore,
}

/// Laws and data to fit.
#[derive(Default, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct FitSettings {
    /// Names of laws; all laws if not given.
    laws: Option<Vec<String>>,
    /// Judge a law fitted to one table on the other tables of the same `material`, too.
    #[serde(default)]
    cross: bool,
    /// Programs for which materials are written beside those of Abaqus and CalculiX.
    #[serde(default)]
    cards: Vec<CardProgram>,
    /// Tables of measurements.
    #[serde(default)]
    data: Vec<TestTableSpec>,
}

/// JSON Schema of scenes.
pub fn schema() -> serde_json::Value {
    let quantities = [q::ALL, q::PRONY, q::NETWORKS, q::VOLUMETRIC, q::FOAMS, q::FORECASTS];
    harness::scene::schema("polycore", &quantities, |generator| vec![generator.subschema_for::<Scene>()])
}

/// Checked scene with its data.
pub struct FitCase {
    pub source: Source,
    pub title: String,
    pub laws: Vec<&'static ModelDescriptor>,
    pub cross: bool,
    /// Programs for which materials are written.
    pub cards: Vec<CardProgram>,
    pub data: Vec<DataSet>,
    pub time: Option<TimeCase>,
    pub prony: Vec<PronySet>,
    pub trials: Vec<FitTrial>,
    pub networks: Vec<NetworkSet>,
    pub volumetric: Vec<VolumetricSet>,
    pub foams: Vec<FoamSet>,
    pub forecasts: Vec<ForecastSet>,
    pub expect: Vec<Expect>,
}

impl FitCase {
    /// Parses and checks a scene and the tables that it names.
    pub fn parse(source: &Source) -> Result<Self, SceneError> {
        let Scene {
            _program: Program::Polycore,
            title,
            fit,
            time,
            prony,
            trial,
            network,
            volumetric,
            foam,
            forecast,
            expect,
        } = source.parse()?;
        let laws = match &fit.laws {
            None => MODELS.iter().collect(),
            Some(names) => select_laws(source, "fit.laws", names)?,
        };
        let mut data: Vec<DataSet> = Vec::new();
        for (i, entry) in fit.data.into_iter().enumerate() {
            let set = entry.read(source, i, &data)?;
            for model in laws.iter().filter(|_| fit.laws.is_some()) {
                if set.table.measurements() < model.parameters.len() {
                    let found = format!("{} measured stresses", set.table.measurements());
                    let allowed = format!("at least {} for `{}`", model.parameters.len(), model.key);
                    return Err(source.error(&format!("fit.data[{i}].{}", set.source_key()), found, allowed));
                }
            }
            data.push(set);
        }
        super::data::check_weights(source, &data)?;
        let time = time.map(|settings| TimeCase::new(source, settings)).transpose()?;
        let mut series: Vec<PronySet> = Vec::new();
        for (i, spec) in prony.into_iter().enumerate() {
            series.push(spec.read(source, i, &series)?);
        }
        if data.is_empty()
            && time.is_none()
            && series.is_empty()
            && volumetric.is_empty()
            && [trial.is_empty(), network.is_empty(), foam.is_empty(), forecast.is_empty()] == [true; 4]
        {
            return Err(source.error(
                "fit.data",
                "no data",
                "at least one `[[fit.data]]` with `name` and `file`, `[time]`, `[[prony]]`, `[[trial]]`, \
                 `[[network]]`, `[[volumetric]]`, `[[foam]]` or `[[forecast]]`",
            ));
        }
        super::trials::check(source, &trial)?;
        let mut networks: Vec<NetworkSet> = Vec::new();
        for (i, spec) in network.into_iter().enumerate() {
            networks.push(spec.read(source, i, &networks)?);
        }
        let mut volumes: Vec<VolumetricSet> = Vec::new();
        for (i, spec) in volumetric.into_iter().enumerate() {
            let set = spec.read(source, i, &volumes)?;
            if !data.is_empty() && data.iter().all(|other| other.material != set.material) {
                let found = set.material.as_deref().unwrap_or("none");
                let allowed = "the `material` of some [[fit.data]], which takes its bulk modulus";
                return Err(source.error(&format!("volumetric[{i}].material"), found, allowed));
            }
            volumes.push(set);
        }
        let mut foams: Vec<FoamSet> = Vec::new();
        for (i, spec) in foam.into_iter().enumerate() {
            foams.push(spec.read(source, i, &foams)?);
        }
        let mut forecasts: Vec<ForecastSet> = Vec::new();
        for (i, spec) in forecast.into_iter().enumerate() {
            forecasts.push(spec.read(source, i, &forecasts)?);
        }
        let (source, cross, cards) = (source.clone(), fit.cross, fit.cards);
        let (prony, trials, volumetric) = (series, trial, volumes);
        let case = Self {
            source,
            title,
            laws,
            cross,
            cards,
            data,
            time,
            prony,
            trials,
            networks,
            volumetric,
            foams,
            forecasts,
            expect,
        };
        case.check_expectations()?;
        Ok(case)
    }

    /// Describes what a run will do, in lines.
    pub fn plan(&self) -> String {
        let mut text = format!("{}: {}\n", self.source.path.display(), self.title);
        for DataSet { name, table, read, modes, .. } in &self.data {
            let (states, measured) = (table.states.len(), table.measurements());
            let source =
                if table.source.is_empty() { "no line `# source: …` in it" } else { &table.source };
            let _ = writeln!(text, "data {name}: {states} states, {measured} measured stresses ({source})");
            read.iter().for_each(|line| text += &format!("  {line}\n"));
            let names: Vec<&str> = modes.iter().map(|mode| mode.mode).collect();
            if !names.is_empty() {
                let _ = writeln!(text, "  laws ranked by predictions of {}, each left out", names.join(", "));
            }
        }
        for line in self
            .networks
            .iter()
            .map(NetworkSet::plan)
            .chain(self.volumetric.iter().map(VolumetricSet::plan))
            .chain(self.foams.iter().map(FoamSet::plan))
            .chain(self.forecasts.iter().map(ForecastSet::plan))
        {
            text += &format!("{line}\n");
        }
        for model in self.laws.iter().filter(|_| !self.data.is_empty()) {
            let names: Vec<_> = model.parameters.iter().map(|parameter| parameter.name).collect();
            let _ = writeln!(text, "law {}: {}", model.key, names.join(", "));
        }
        if let Some(time) = &self.time {
            text += &time.plan();
        }
        self.prony.iter().for_each(|set| text += &format!("{}\n", set.plan()));
        let of_fits = "fits.csv, <data>_states.csv, materials.toml, pictures (not with --quick), ";
        let mut files = if self.data.is_empty() { "" } else { of_fits }.to_owned();
        for host in &self.cards {
            files += &format!("materials_mm.{0}, materials_si.{0}, ", host.extension());
        }
        if self.data.iter().any(|set| !set.modes.is_empty()) {
            files += "<data>_ranking.csv, <data>_modes.png (not with --quick), ";
        }
        if !self.networks.is_empty() {
            files += "<network>_networks.csv, <network>_networks.png (not with --quick), ";
        }
        if !self.prony.is_empty() {
            files += "<prony>_prony.csv, <prony>_curve.csv, <prony>_branches.toml, <prony>_prony.inp, ";
        }
        if !self.volumetric.is_empty() {
            files += "<volumetric>_volumetric.csv, ";
        }
        if !self.foams.is_empty() {
            files += "<foam>_foam.csv, <foam>_foam.inp, <foam>_foam.mac, ";
        }
        if !self.forecasts.is_empty() {
            files += "<forecast>_forecast.csv, ";
        }
        let _ = writeln!(
            text,
            "{} fits, {} trials, {} tables of networks, {} expectations; writes {}report.json",
            self.laws.len() * self.data.len(),
            self.trials.len(),
            self.networks.len(),
            self.expect.len(),
            files
        );
        text
    }

    /// Tables on which a law that is fitted to `set` is judged, too.
    pub fn others<'a>(&'a self, set: &DataSet) -> impl Iterator<Item = &'a DataSet> {
        let (name, material) = (set.name.clone(), set.material.clone());
        self.data.iter().filter(move |other| self.cross && other.name != name && other.material == material)
    }

    /// Bulk modulus of laws fitted to `set`: of a volumetric test of its material, or assumed.
    pub fn bulk(&self, set: &DataSet) -> Bulk<'_> {
        let own = self.volumetric.iter().find(|test| test.material == set.material);
        own.map_or(Bulk::Assumed, Bulk::Measured)
    }

    /// Lists the names of all scalars of the report.
    fn quantities(&self) -> Vec<String> {
        let mut names = Vec::new();
        for set @ DataSet { name: data, table, .. } in &self.data {
            for model in &self.laws {
                let fit = format!("{data}.{}", model.key);
                let own = [q::RMS, q::MAE, q::R2, q::SHEAR_MODULUS, q::STABLE, q::FAILED];
                names.extend(own.map(|quantity| quantity.named(&[&fit]).name));
                names.extend(table.deviation.map(|_| q::CHI.named(&[&fit]).name));
                let parameters = model.parameters.iter().map(|parameter| parameter.name);
                for quantity in [q::PARAMETER, q::STANDARD_ERROR] {
                    names.extend(parameters.clone().map(|parameter| quantity.named(&[&fit, parameter]).name));
                }
                names.extend(super::ranking::quantities(set, model.key));
                for other in self.others(set) {
                    let fit = format!("{fit}.{}", other.name);
                    names.extend(
                        [q::RMS, q::MAE, q::R2, q::LOCKED, q::OUTSIDE]
                            .map(|quantity| quantity.named(&[&fit]).name),
                    );
                }
            }
        }
        for trial in &self.trials {
            names.extend(trial.quantities());
        }
        if let Some(time) = &self.time {
            names.extend(time.quantities());
        }
        names.extend(self.prony.iter().flat_map(PronySet::quantities));
        for set in &self.networks {
            names.extend(set.quantities());
        }
        names.extend(self.volumetric.iter().flat_map(VolumetricSet::quantities));
        for set in &self.foams {
            names.extend(set.quantities());
        }
        for set in &self.forecasts {
            names.extend(set.quantities());
        }
        names
    }

    fn check_expectations(&self) -> Result<(), SceneError> {
        let names = self.quantities();
        for (i, expect) in self.expect.iter().enumerate() {
            if let Some(name) = expect.names().find(|name| !names.iter().any(|known| known == name)) {
                let known: Vec<&str> = names.iter().map(String::as_str).collect();
                return Err(self.source.unknown(&format!("expect[{i}].quantity"), name, &known));
            }
        }
        Ok(())
    }
}

/// Finds laws by their names, each once.
///
/// # Errors
/// An unknown name, one twice, none.
pub fn select_laws(
    source: &Source,
    list: &str,
    names: &[String],
) -> Result<Vec<&'static ModelDescriptor>, SceneError> {
    let mut laws: Vec<&'static ModelDescriptor> = Vec::new();
    for (i, name) in names.iter().enumerate() {
        let all = || MODELS.iter().map(|model| model.key).collect::<Vec<_>>().join(", ");
        let key = format!("{list}[{i}]");
        let model = hyperelastic::model(name).map_err(|_| match advice(name) {
            Some(advice) => source.error(&key, format!("`{name}`"), advice),
            None => source.error(&key, format!("`{name}`"), all()),
        })?;
        if laws.iter().any(|law| law.key == model.key) {
            return Err(source.error(&key, format!("`{name}` a second time"), "every law once"));
        }
        laws.push(model);
    }
    if laws.is_empty() {
        return Err(source.error(list, "no law", "at least one law; leave out `laws` to fit all"));
    }
    Ok(laws)
}

/// Returns advice for an unknown name of a law, or for a property that no law here models.
fn advice(name: &str) -> Option<&'static str> {
    let plain: String = name.to_lowercase().chars().filter(char::is_ascii_alphanumeric).collect();
    Some(match plain.as_str() {
        "8chain" => "`eight-chain`, or `arruda-boyce`, its five terms in finite-element programs",
        "ogden" => "`ogden-1`, `ogden-2` or `ogden-3`, by the number of terms",
        "mooney" | "polynomial1" => "`mooney-rivlin`, the polynomial of first order",
        "polynomial" => "`polynomial-2` or `polynomial-3`, by the order, or `biderman`",
        "reducedpolynomial" | "reducedpolynomial3" | "yeoh3" => {
            "`yeoh`, the reduced polynomial of third order, or `reduced-polynomial-2`, `-4`, `-5`, `-6`"
        }
        "neohooke" | "neohookean" | "neo" => "`neo-hookean`",
        "kilian" => "`van-der-waals`, the law of Kilian",
        "kaliskeheinrich" => "`extended-tube`, the law of Kaliske and Heinrich",
        "marlow" => "`eight-chain-root-i2`, which behaves most similarly",
        "prony" | "viscoelastic" | "maxwell" | "creep" => {
            "an elastic law; rates and relaxation are fitted by `[time]` and `[[prony]]`"
        }
        "poissonratio" | "nu" => {
            "no such parameter: the rubber of a fit is incompressible; compressibility is `bulk_modulus` in \
             a scene of peri"
        }
        "hyperfoam" | "hyperfoam1" | "hyperfoam2" | "hyperfoam3" | "ogdenfoam" | "ogdenhill" | "blatzko" => {
            "an incompressible law; foams are fitted by a block `[[foam]]`"
        }
        _ => return None,
    })
}
