//! Scenes of fits with time: the form of a law, measured runs, programs to predict.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use harness::scene::{SceneError, Source, ViscosityKind};
use polycore::constitutive::hyperelastic::model;
use polycore::constitutive::viscoelastic::fit::{
    BranchForm, Form, MeasuredRun, Measurement, SpringForm, Test, ViscosityForm, rates,
};
use polycore::constitutive::viscoelastic::{Pace, Scheme};
use polycore::table::Table;
use polycore::units::dimension::{RateDimension, StressDimension, TimeDimension};
use polycore::units::{Rate, Time};
use serde::Deserialize;

use super::{quantities as q, time_fits};

/// Fit of a law with time.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TimeSettings {
    /// Name of the equilibrium law.
    equilibrium: String,
    /// Branches.
    branch: Vec<BranchFormSpec>,
    /// Softening of the equilibrium law by the largest strain so far (Mullins effect).
    #[serde(default)]
    softening: bool,
    /// Constants that keep a value, SI: `"1.c" = -0.5`.
    #[serde(default)]
    fix: BTreeMap<String, f64>,
    /// Constants that are fitted although they would be fixed: `"1.K_2"`.
    #[serde(default)]
    free: Vec<String>,
    /// Number of starting points.
    #[serde(default = "three")]
    starts: usize,
    /// Steps between two points of a run.
    #[serde(default = "one")]
    steps: usize,
    /// Rate whose runs are also predicted by a fit to the others.
    leave_out: Option<Rate>,
    /// Tables of runs.
    data: Vec<RunTableSpec>,
    /// Programs to predict.
    #[serde(default)]
    predict: Vec<ProgramSpec>,
}

fn three() -> usize {
    3
}

fn one() -> usize {
    1
}

/// Branch: a spring in series with a dashpot.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct BranchFormSpec {
    /// The spring.
    spring: SpringName,
    /// The dashpot.
    viscosity: ViscosityKind,
    /// Number of equal branches.
    #[serde(default = "one")]
    count: usize,
}

/// Spring of a branch.
#[derive(Clone, Copy, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum SpringName {
    /// Neo-Hookean.
    NeoHookean,
    /// Power of I₁.
    #[serde(rename = "lopez-pamies-1")]
    LopezPamies1,
    /// Two powers of I₁.
    #[serde(rename = "lopez-pamies-2")]
    LopezPamies2,
    /// Eight-chain law.
    EightChain,
    /// A multiple of the equilibrium law.
    Proportional,
}

/// Test of a table or a program.
#[derive(Clone, Copy, Default, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum TestName {
    /// Tension and compression.
    #[default]
    Uniaxial,
    /// Simple shear.
    SimpleShear,
}

impl TestName {
    fn test(self) -> Test {
        match self {
            Self::Uniaxial => Test::Uniaxial,
            Self::SimpleShear => Test::SimpleShear,
        }
    }
}

/// Table of runs.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct RunTableSpec {
    /// Name in the report.
    name: String,
    /// CSV file, relative to the scene.
    file: PathBuf,
    /// The test.
    #[serde(default)]
    test: TestName,
    /// Columns whose cells tell runs apart.
    #[serde(default)]
    runs: Vec<String>,
}

/// Program of strain to predict, from rest.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct ProgramSpec {
    /// Name of the file.
    name: String,
    /// The test.
    #[serde(default)]
    test: TestName,
    /// Ramps and holds.
    steps: Vec<ProgramStep>,
}

/// Step of a program: `to` a strain at a `rate`, or `hold` for a time.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct ProgramStep {
    /// Stretch or shear at the end of a ramp.
    to: Option<f64>,
    /// Rate of the ramp.
    rate: Option<Rate>,
    /// Duration of a hold.
    hold: Option<Time>,
}

/// Checked fit with time.
pub struct TimeCase {
    pub form: Form,
    pub runs: Vec<MeasuredRun>,
    pub starts: usize,
    pub pace: Pace,
    pub leave_out: Option<f64>,
    pub programs: Vec<StrainProgram>,
    /// Layout of each file, one line each.
    pub read: Vec<String>,
}

/// Times and strains of a program.
pub struct StrainProgram {
    pub name: String,
    pub test: Test,
    pub path: Vec<[f64; 2]>,
}

/// Points of a ramp or a hold in the file of a prediction.
const POINTS: usize = 40;

/// Ratio of the first time of a hold to its duration.
const FIRST: f64 = 1e-3;

impl TimeCase {
    /// Checks the block `time` and reads its tables.
    pub fn new(source: &Source, settings: TimeSettings) -> Result<Self, SceneError> {
        let equilibrium =
            model(&settings.equilibrium).map_err(|error| source.refused("time.equilibrium", error))?;
        let mut branches = Vec::new();
        for (i, branch) in settings.branch.iter().enumerate() {
            if branch.count == 0 {
                return Err(source.error(&format!("time.branch[{i}].count"), 0, "at least 1"));
            }
            let form = branch.form().ok_or_else(|| {
                let allowed = "a viscosity that tests before yield determine: eyring";
                source.error(&format!("time.branch[{i}].viscosity"), "eyring-softening", allowed)
            })?;
            branches.extend(vec![form; branch.count]);
        }
        let fixed = settings.fix.into_iter().collect();
        let form = Form { equilibrium, branches, softening: settings.softening, fixed, free: settings.free };
        let known = form.names();
        for (key, name) in form
            .fixed
            .iter()
            .map(|(name, _)| ("fix", name))
            .chain(form.free.iter().map(|name| ("free", name)))
        {
            if !known.contains(name) {
                let known: Vec<&str> = known.iter().map(String::as_str).collect();
                return Err(source.unknown(&format!("time.{key}"), name, &known));
            }
        }
        if settings.starts == 0 || settings.steps == 0 {
            let key = if settings.starts == 0 { "time.starts" } else { "time.steps" };
            return Err(source.error(key, 0, "at least 1"));
        }
        let (mut runs, mut read) = (Vec::new(), Vec::new());
        for (i, data) in settings.data.iter().enumerate() {
            let key = format!("time.data[{i}].name");
            let before = settings.data[..i].iter().map(|data| data.name.as_str());
            check_own_name(source, &key, &data.name, before.chain([time_fits::ALL, time_fits::LEFT_OUT]))?;
            let path = source.file(&data.file);
            let found = data.read(&path);
            let (own, line) =
                found.map_err(|error| source.refused(&format!("time.data[{i}].file"), error))?;
            runs.extend(own);
            read.push(line);
        }
        if runs.is_empty() {
            return Err(source.error("time.data", "no run", "at least one table with a run"));
        }
        if let Some(rate) = settings.leave_out.map(|rate| rate.si()) {
            let known = rates(&runs);
            if !known.contains(&rate) || known.len() < 2 {
                let known: Vec<String> = known.iter().map(|rate| format!("{rate} /s")).collect();
                let allowed = format!("one of two or more rates of the data: {}", known.join(", "));
                return Err(source.error("time.leave_out", format!("{rate} /s"), allowed));
            }
        }
        let mut programs = Vec::new();
        for (i, program) in settings.predict.iter().enumerate() {
            let key = format!("time.predict[{i}]");
            let before = settings.predict[..i].iter().map(|program| program.name.as_str());
            check_own_name(source, &format!("{key}.name"), &program.name, before)?;
            programs.push(program.path(source, &key)?);
        }
        Ok(Self {
            form,
            runs,
            starts: settings.starts,
            pace: Pace::Equal(settings.steps, Scheme::Sdirk2),
            leave_out: settings.leave_out.map(|rate| rate.si()),
            programs,
            read,
        })
    }
}

/// Checks a name of values and files that nothing else has.
pub fn check_own_name<'a>(
    source: &Source,
    key: &str,
    name: &str,
    mut taken: impl Iterator<Item = &'a str>,
) -> Result<(), SceneError> {
    harness::scene::check_name(source, key, name)?;
    if taken.any(|other| other == name) {
        return Err(source.error(key, format!("`{name}`, which is taken"), "another name"));
    }
    Ok(())
}

impl TimeCase {
    /// Names of the scalars of the report.
    pub fn quantities(&self) -> Vec<String> {
        let left = self.leave_out.map(|_| time_fits::LEFT_OUT);
        let runs = self.runs.iter().map(|run| run.name.as_str()).chain([time_fits::ALL]).chain(left);
        let agreements = runs.flat_map(|run| [q::TIME_RMS.named(&[run]), q::TIME_R2.named(&[run])]);
        let constants = self.form.names().into_iter().map(|name| q::TIME_CONSTANT.named(&[&name]));
        agreements.chain(constants).map(|quantity| quantity.name).collect()
    }

    /// Describes what a run will do, in lines.
    pub fn plan(&self) -> String {
        let points: usize = self.runs.iter().map(|run| run.points().len()).sum();
        let mut text: String = self.read.iter().map(|line| format!("{line}\n")).collect();
        let _ = writeln!(
            text,
            "law with time: {}{}, {} branches; {} runs, {points} measured stresses, {} starts, {} \
             predictions",
            self.form.equilibrium.key,
            if self.form.softening { " with softening" } else { "" },
            self.form.branches.len(),
            self.runs.len(),
            self.starts,
            self.programs.len()
        );
        text
    }
}

impl BranchFormSpec {
    /// Form of a fit; `None` for a viscosity that is not fitted.
    fn form(&self) -> Option<BranchForm> {
        let spring = match self.spring {
            SpringName::NeoHookean => SpringForm::NeoHookean,
            SpringName::LopezPamies1 => SpringForm::LopezPamies(1),
            SpringName::LopezPamies2 => SpringForm::LopezPamies(2),
            SpringName::EightChain => SpringForm::EightChain,
            SpringName::Proportional => SpringForm::Proportional,
        };
        let viscosity = match self.viscosity {
            ViscosityKind::Constant => ViscosityForm::Constant,
            ViscosityKind::KumarLopezPamies => ViscosityForm::KumarLopezPamies,
            ViscosityKind::BergstromBoyce => ViscosityForm::BergstromBoyce,
            ViscosityKind::Eyring => ViscosityForm::Eyring,
            ViscosityKind::EyringSoftening => return None,
        };
        Some(BranchForm { spring, viscosity })
    }
}

impl RunTableSpec {
    /// Reads the runs: rows of equal cells in the columns `runs` that follow each other.
    fn read(&self, path: &Path) -> Result<(Vec<MeasuredRun>, String), polycore::Error> {
        let table = Table::read(path)?;
        let strain = match self.test.test() {
            Test::Uniaxial => table.require_column(&["stretch", "lambda"])?,
            Test::SimpleShear => table.require_column(&["shear", "gamma"])?,
        };
        let stress = table.require_column(&["nominal", "stress", "nominal stress"])?;
        let times = match table.matching(&["time", "t"])[..] {
            [column] => Some(table.column::<TimeDimension>(column, None)?),
            _ => None,
        };
        let rates = match table.matching(&["rate"])[..] {
            [column] => Some(table.column::<RateDimension>(column, None)?),
            _ => None,
        };
        if times.is_none() && rates.is_none() {
            return Err(table.refuse_headings("a column `time [s]` or `rate [1/s]`").into());
        }
        let stresses = table.column::<StressDimension>(stress, None)?;
        let marks = self.runs.iter().map(|name| table.require_column(&[name]));
        let marks: Vec<usize> = marks.collect::<Result<_, _>>()?;
        let mut groups: Vec<(String, Vec<usize>)> = Vec::new();
        for row in 0..table.rows() {
            let cells: Vec<&str> = marks.iter().map(|&column| table.text(row, column)).collect();
            let name = [&[self.name.as_str()], &cells[..]].concat().join("-");
            match groups.last_mut() {
                Some(last) if last.0 == name => last.1.push(row),
                _ => groups.push((name, vec![row])),
            }
        }
        let mut runs = Vec::new();
        for (name, rows) in groups {
            let point = |row: usize| Ok([table.number(row, strain)?, stresses[row]]);
            let points: Vec<[f64; 2]> =
                rows.iter().map(|&row| point(row)).collect::<Result<_, polycore::Error>>()?;
            let rate = rates.as_ref().map(|rates| rates[rows[0]]);
            let test = self.test.test();
            runs.push(match &times {
                None => MeasuredRun::cycle(&name, rate.unwrap_or_default(), test, &points)?,
                Some(times) => {
                    let timed = rows.iter().zip(&points).map(|(&row, point)| Measurement {
                        time: times[row],
                        strain: point[0],
                        nominal: point[1],
                    });
                    let path: f64 = points.windows(2).map(|pair| (pair[1][0] - pair[0][0]).abs()).sum();
                    let duration = times[rows[rows.len() - 1]] - times[rows[0]];
                    MeasuredRun::new(&name, rate.unwrap_or(path / duration), test, timed.collect())?
                }
            });
        }
        let used: Vec<usize> = marks.into_iter().chain([strain, stress]).collect();
        Ok((runs, format!("{}: {}", self.name, table.describe(&used))))
    }
}

impl ProgramSpec {
    fn path(&self, source: &Source, key: &str) -> Result<StrainProgram, SceneError> {
        let test = self.test.test();
        let mut path = vec![[0.0, test.rest()]];
        for (i, step) in self.steps.iter().enumerate() {
            let [start, from] = path[path.len() - 1];
            match (step.to, step.rate, step.hold) {
                (Some(to), Some(rate), None) if rate.si() > 0.0 && to != from => {
                    let duration = (to - from).abs() / rate.si();
                    path.extend((1..=POINTS).map(|k| {
                        let part = k as f64 / POINTS as f64;
                        [start + part * duration, from + part * (to - from)]
                    }));
                }
                (None, None, Some(hold)) if hold.si() > 0.0 => {
                    // equal ratios of the times since its start
                    let ratio = |k: usize| FIRST.powf(1.0 - k as f64 / POINTS as f64);
                    path.extend((0..=POINTS).map(|k| [start + hold.si() * ratio(k), from]));
                }
                _ => {
                    let allowed = "`to` another strain at a `rate` above 0, or `hold` for a time";
                    return Err(source.error(&format!("{key}.steps[{i}]"), "neither", allowed));
                }
            }
        }
        Ok(StrainProgram { name: self.name.clone(), test, path })
    }
}
