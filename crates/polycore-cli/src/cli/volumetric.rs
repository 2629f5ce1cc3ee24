//! Volumetric tests: scene block, bulk modulus for blocks and cards, values, files.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use harness::report::Report;
use harness::scene::{SceneError, Source};
use polycore::Error;
use polycore::constitutive::hyperelastic::bulk::{VolumetricFit, VolumetricState};
use polycore::file::atomic_write;
use serde::Deserialize;

use super::MPA;
use super::material::{BULK_RATIO, DIGITS, SHOWN, digits, stress};
use super::quantities as q;

/// Volumetric test, which gives the bulk modulus of fits of the same `material`.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VolumetricSpec {
    /// Name in the report.
    name: String,
    /// CSV file, relative to the scene: `pressure [MPa]` and `J`, or `volumetric strain [%]`.
    file: PathBuf,
    /// Terms (J − 1)²ⁱ/Dᵢ of the energy.
    #[serde(default = "one")]
    terms: usize,
    /// Material, as in `[[fit.data]]`.
    material: Option<String>,
}

fn one() -> usize {
    1
}

/// Largest number of terms: that of `*HYPERELASTIC`.
const LARGEST_TERMS: usize = 6;

/// Volumetric test with its fit.
pub struct VolumetricSet {
    name: String,
    pub material: Option<String>,
    states: Vec<VolumetricState>,
    fit: VolumetricFit,
}

impl VolumetricSpec {
    /// Reads and fits a test.
    ///
    /// # Errors
    /// A name that cannot name a file or is taken, a second test of a material, a table that cannot be read
    /// or fitted, a number of terms out of its range.
    pub fn read(
        self,
        source: &Source,
        index: usize,
        others: &[VolumetricSet],
    ) -> Result<VolumetricSet, SceneError> {
        let key = |field: &str| format!("volumetric[{index}].{field}");
        harness::scene::check_name(source, &key("name"), &self.name)?;
        if others.iter().any(|other| other.name == self.name) {
            return Err(source.error(&key("name"), format!("`{}` a second time", self.name), "another name"));
        }
        if let Some(other) = others.iter().find(|other| other.material == self.material) {
            let found = format!("a second test of the material of `{}`", other.name);
            return Err(source.error(&key("file"), found, "one volumetric test of each `material`"));
        }
        if !(1..=LARGEST_TERMS).contains(&self.terms) {
            return Err(source.error(&key("terms"), self.terms, format!("1 to {LARGEST_TERMS}")));
        }
        let refused = |error: Error| source.refused(&key("file"), error);
        let states = VolumetricState::read(source.file(&self.file)).map_err(refused)?;
        let fit = VolumetricFit::new(&states, self.terms).map_err(|error| refused(error.into()))?;
        Ok(VolumetricSet { name: self.name, material: self.material, states, fit })
    }
}

/// Bulk modulus of a fit.
#[derive(Clone, Copy)]
pub enum Bulk<'a> {
    /// Modulus of a volumetric test.
    Measured(&'a VolumetricSet),
    /// Multiple of the shear modulus: tests at constant volume do not determine it.
    Assumed,
}

impl Bulk<'_> {
    /// K of a law with a shear modulus, Pa.
    pub fn modulus(self, shear: f64) -> f64 {
        match self {
            Self::Measured(set) => set.fit.bulk,
            Self::Assumed => BULK_RATIO * shear,
        }
    }

    /// Dᵢ of the volumetric energy Σ (J − 1)²ⁱ/Dᵢ of a law with a shear modulus (Pa), in the reciprocal of a
    /// unit of stress.
    pub fn compliances(self, shear: f64, unit: f64) -> Vec<f64> {
        match self {
            Self::Measured(set) => set.fit.compliances.iter().map(|d| d * unit).collect(),
            Self::Assumed => vec![2.0 / (self.modulus(shear) / unit)],
        }
    }

    /// Defects of the volumetric test, a line each; none of an assumed modulus.
    pub fn warnings(self) -> Vec<String> {
        match self {
            Self::Measured(set) => set.warnings(),
            Self::Assumed => Vec::new(),
        }
    }

    /// Origin of K, for a comment.
    pub fn origin(self, shear: f64) -> String {
        match self {
            Self::Measured(set) => {
                let terms = set.fit.compliances.len();
                let first = if terms > 1 { format!(", 2/D1 of {terms} terms") } else { String::new() };
                format!("volumetric test `{}`{first}", set.name)
            }
            Self::Assumed => format!(
                "{BULK_RATIO} times the shear modulus of {}: these tests do not determine it",
                stress(shear, DIGITS)
            ),
        }
    }
}

impl VolumetricSet {
    /// Describes what a run will do, in a line, with the warnings below it.
    pub fn plan(&self) -> String {
        let (states, terms) = (self.states.len(), self.fit.compliances.len());
        let mut text = format!("volumetric {}: {states} states, {terms} terms", self.name);
        self.warnings().iter().for_each(|line| text += &format!("\n{line}"));
        text
    }

    /// Defects of the fit, a line each.
    pub fn warnings(&self) -> Vec<String> {
        let line = |defect: String| format!("warning: volumetric {}: {defect}", self.name);
        self.fit.warnings().into_iter().map(line).collect()
    }

    /// Lists the names of its scalars.
    pub fn quantities(&self) -> Vec<String> {
        let own = [q::BULK, q::BULK_ERROR, q::BULK_RMS, q::MONOTONIC]
            .map(|quantity| quantity.named(&[&self.name]).name);
        let terms = (1..=self.fit.compliances.len()).flat_map(|i| {
            let number = i.to_string();
            [q::COMPLIANCE, q::COMPLIANCE_ERROR].map(|quantity| quantity.named(&[&self.name, &number]).name)
        });
        own.into_iter().chain(terms).collect()
    }

    /// Records values, writes `NAME_volumetric.csv`; returns the summary.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn run(&self, directory: &Path, report: &mut Report) -> Result<String, Error> {
        let fit = &self.fit;
        report.value(q::BULK.named(&[&self.name]), fit.bulk / MPA);
        if let Some(error) = fit.bulk_error {
            report.value(q::BULK_ERROR.named(&[&self.name]), error / MPA);
        }
        report.value(q::BULK_RMS.named(&[&self.name]), fit.rms / MPA);
        let error = fit.bulk_error.map_or_else(String::new, |error| format!(" ± {}", stress(error, 2)));
        let mut text = format!("volumetric {}: K {}{error}", self.name, stress(fit.bulk, SHOWN));
        let is_monotonic = fit.softening().is_none();
        report.value(q::MONOTONIC.named(&[&self.name]), f64::from(u8::from(is_monotonic)));
        for (i, compliance) in fit.compliances.iter().enumerate() {
            let number = (i + 1).to_string();
            report.value(q::COMPLIANCE.named(&[&self.name, &number]), compliance * MPA);
            let _ = write!(text, ", D{number} {}", digits(compliance * MPA, SHOWN));
            if let Some(error) = fit.compliance_errors.get(i) {
                report.value(q::COMPLIANCE_ERROR.named(&[&self.name, &number]), error * MPA);
                let _ = write!(text, " ± {}", digits(error * MPA, 2));
            }
            text += " 1/MPa";
        }
        let _ = writeln!(text, "; rms of the pressure {}", stress(fit.rms, 3));
        self.warnings().iter().for_each(|line| text += &format!("{line}\n"));
        atomic_write(directory.join(format!("{}_volumetric.csv", self.name)), |file| {
            writeln!(file, "J,pressure_MPa,fitted_MPa")?;
            self.states.iter().try_for_each(|state| {
                let [measured, fitted] = [state.pressure, fit.pressure(state.ratio)]
                    .map(|pressure| digits(pressure / MPA, DIGITS));
                writeln!(file, "{},{measured},{fitted}", state.ratio)
            })
        })?;
        Ok(text)
    }
}
