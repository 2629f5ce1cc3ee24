//! Fits of compressible foams: scene block, values, files.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use harness::case::Run;
use harness::output::picture::{LinePlot, Series};
use harness::report::Report;
use harness::scene::{SceneError, Source};
use polycore::Error;
use polycore::constitutive::hyperelastic::foam::{FoamFit, FoamTest, fit};
use polycore::constitutive::hyperelastic::host::CardProgram;
use polycore::constitutive::hyperelastic::{Hyperelastic, Hyperfoam, deck};
use polycore::file::atomic_write;
use serde::Deserialize;

use super::MPA;
use super::material::{DIGITS, digits};
use super::quantities as q;

/// Tests of a foam to which a compressible law is fitted.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FoamSpec {
    /// Name in the report.
    name: String,
    /// CSV file, relative to the scene.
    file: PathBuf,
    /// Foam, in a table of several: a cell of its column `foam` or `material`.
    material: Option<String>,
    /// Numbers of terms of the laws to fit.
    #[serde(default = "one_to_three")]
    terms: Vec<usize>,
}

fn one_to_three() -> Vec<usize> {
    vec![1, 2, 3]
}

/// Largest number of terms: the solvers' `*HYPERFOAM` has six, tests determine no more than four.
const LARGEST_TERMS: usize = 4;

/// Checked tests of a foam.
pub struct FoamSet {
    name: String,
    tests: Vec<FoamTest>,
    terms: Vec<usize>,
    read: String,
}

/// Law of so many terms, fitted to all tests, and each test predicted by a fit to the others.
struct FoamLaw {
    key: String,
    fit: FoamFit,
    /// rms over the largest stress, by test; `None` if no law can be fitted to the others.
    predicted: Vec<Option<f64>>,
}

impl FoamSpec {
    /// Reads the table.
    ///
    /// # Errors
    /// A name that cannot name a file, a table that cannot be read, a number of terms out of its range.
    pub fn read(self, source: &Source, index: usize, others: &[FoamSet]) -> Result<FoamSet, SceneError> {
        let key = |field: &str| format!("foam[{index}].{field}");
        harness::scene::check_name(source, &key("name"), &self.name)?;
        if others.iter().any(|other| other.name == self.name) {
            return Err(source.error(&key("name"), format!("`{}` a second time", self.name), "another name"));
        }
        let (tests, read) = FoamTest::read(source.file(&self.file), self.material.as_deref())
            .map_err(|error| source.refused(&key("file"), error))?;
        let states: usize = tests.iter().map(|test| test.states.len()).sum();
        let most = LARGEST_TERMS.min(states / 3);
        if let Some(terms) = self.terms.iter().find(|terms| **terms == 0 || **terms > most) {
            let allowed = format!("1 to {most} terms of three parameters, for {states} states");
            return Err(source.error(&key("terms"), terms, allowed));
        }
        Ok(FoamSet { name: self.name, tests, terms: self.terms, read })
    }
}

impl FoamSet {
    /// Describes what a run will do, in a line.
    pub fn plan(&self) -> String {
        format!("foam {}: {}", self.name, self.read)
    }

    /// Lists the names of its scalars.
    pub fn quantities(&self) -> Vec<String> {
        let mut names = Vec::new();
        for terms in &self.terms {
            let key = format!("{}.{}", self.name, key(*terms));
            for test in &self.tests {
                let all = [q::FOAM_RMS, q::FOAM_RELATIVE, q::FOAM_END, q::FOAM_PREDICTED];
                names.extend(all.map(|quantity| quantity.named(&[&key, &test.name]).name));
            }
            names.push(q::SHEAR_MODULUS.named(&[&key]).name);
            for i in 1..=*terms {
                let own = ["mu", "alpha", "nu"].map(|name| format!("{name}_{i}"));
                names.extend(own.map(|name| q::PARAMETER.named(&[&key, &name]).name));
            }
        }
        names
    }

    /// Fits the laws, records values, writes files; returns the summary.
    ///
    /// # Errors
    /// Data to which no law can be fitted, a stop by the user, a file that cannot be written.
    pub fn run(&self, run: &Run, report: &mut Report) -> Result<String, Error> {
        let stop = run.options.interrupted;
        let mut laws = Vec::new();
        for terms in &self.terms {
            let fit_to = |tests: &[FoamTest]| match fit(tests, *terms, stop) {
                Err(polycore::constitutive::Error::Stopped) => Err(run.interruption()),
                found => Ok(found),
            };
            let found = fit_to(&self.tests)??;
            let mut predicted = Vec::new();
            for test in &self.tests {
                let others: Vec<FoamTest> =
                    self.tests.iter().filter(|other| other.name != test.name).cloned().collect();
                let law = fit_to(&others)?.ok().map(|found| found.law);
                let error = law.and_then(|law| test.agreement(&law).ok());
                predicted.push(error.map(|error| error.rms / test.largest()));
            }
            laws.push(FoamLaw { key: key(*terms), fit: found, predicted });
        }
        let mut text = format!("foam {}\n{}\n", self.name, self.read);
        let _ = writeln!(
            text,
            "rms of the stress over the largest of a test; in brackets of a fit to the other tests\n{:<14}{}",
            "law",
            self.tests.iter().map(|test| format!("{:>22}", test.name)).collect::<String>()
        );
        for law in &laws {
            text += &self.record(law, report)?;
        }
        self.write(run.options.output, &laws)?;
        if !run.options.quick {
            self.draw(run.options.output, &laws)?;
        }
        Ok(text)
    }

    /// Records the values of a law; returns its line of the summary.
    fn record(&self, law: &FoamLaw, report: &mut Report) -> Result<String, Error> {
        let key = format!("{}.{}", self.name, law.key);
        let mut text = format!("{:<14}", law.key);
        report.value(q::SHEAR_MODULUS.named(&[&key]), law.fit.law.shear_modulus() / MPA);
        for (i, term) in law.fit.law.terms().iter().enumerate() {
            for (name, value, unit) in [
                ("mu", term.modulus / MPA, "MPa"),
                ("alpha", term.exponent, ""),
                ("nu", term.poisson_ratio(), ""),
            ] {
                let quantity = q::PARAMETER.named(&[&key, &format!("{name}_{}", i + 1)]).in_unit(unit);
                report.value(quantity, value);
            }
        }
        for (test, predicted) in self.tests.iter().zip(&law.predicted) {
            let rms = test.agreement(&law.fit.law)?.rms;
            report.value(q::FOAM_RMS.named(&[&key, &test.name]), rms / MPA);
            report.value(q::FOAM_RELATIVE.named(&[&key, &test.name]), rms / test.largest());
            let end = test.predict(&law.fit.law, end_of(test))?[0];
            report.value(q::FOAM_END.named(&[&key, &test.name]), end / MPA);
            let mut cell = digits(rms / test.largest(), 3);
            if let Some(predicted) = predicted {
                report.value(q::FOAM_PREDICTED.named(&[&key, &test.name]), *predicted);
                let _ = write!(cell, " ({})", digits(*predicted, 2));
            }
            let _ = write!(text, "{cell:>22}");
        }
        report.work(&format!("{key}.starts"), law.fit.starts.0 as u64);
        report.work(&format!("{key}.starts_that_agree"), law.fit.starts.1 as u64);
        let _ = writeln!(text);
        Ok(text)
    }

    /// Writes `NAME_foam.csv`, states measured and computed, and the laws as `*HYPERFOAM` in `NAME_foam.inp`
    /// and as `TB,HYPER,,,,FOAM` in `NAME_foam.mac`.
    fn write(&self, directory: &Path, laws: &[FoamLaw]) -> Result<(), Error> {
        let mut text = "test,strain,measured_MPa,measured_lateral".to_owned();
        laws.iter().for_each(|law| {
            let _ = write!(text, ",{0}_MPa,{0}_lateral", law.key);
        });
        text.push('\n');
        for test in &self.tests {
            for state in &test.states {
                let lateral = state.lateral.map_or_else(String::new, |lateral| lateral.to_string());
                let _ = write!(text, "{},{},{},{lateral}", test.name, state.strain, state.nominal / MPA);
                for law in laws {
                    let [nominal, second] = test.predict(&law.fit.law, state.strain)?;
                    let _ = write!(text, ",{},{}", digits(nominal / MPA, DIGITS), digits(second, DIGITS));
                }
                text.push('\n');
            }
        }
        atomic_write(directory.join(format!("{}_foam.csv", self.name)), |file| {
            file.write_all(text.as_bytes())
        })?;
        atomic_write(directory.join(format!("{}_foam.inp", self.name)), |file| {
            writeln!(file, "** units mm, N, MPa; fitted to {}", self.name)?;
            laws.iter()
                .try_for_each(|law| file.write_all(card(&self.name, &law.key, &law.fit.law).as_bytes()))
        })?;
        atomic_write(directory.join(format!("{}_foam.mac", self.name)), |file| {
            writeln!(file, "! units mm, N, MPa")?;
            for (id, law) in (1..).zip(laws) {
                writeln!(file, "! {} fitted to {}", law.key, self.name)?;
                let values = values(&law.fit.law);
                let card = CardProgram::Ansys.card(id, &self.name, &law.key, &values, &[]);
                file.write_all(card.unwrap_or_default().as_bytes())?;
            }
            Ok(())
        })
    }

    /// Draws `NAME_TEST.png`.
    fn draw(&self, directory: &Path, laws: &[FoamLaw]) -> Result<(), Error> {
        for test in &self.tests {
            let x: Vec<f64> = test.states.iter().map(|state| state.strain).collect();
            let y: Vec<f64> = test.states.iter().map(|state| state.nominal / MPA).collect();
            let span = |list: &[f64]| {
                list.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [v.min(a), v.max(b)])
            };
            let ([left, right], [low, high]) = (span(&x), span(&y));
            let margin = 0.05 * (high - low);
            let mut plot = LinePlot::new(&format!("{}: {}", self.name, test.name))
                .axes("stretch or shear", "nominal stress, MPa")
                .x_range(left, right)
                .y_range(low - margin, high + margin)
                .series(Series::markers("measured", &x, &y));
            for law in laws {
                let predict =
                    |x: &f64| test.predict(&law.fit.law, *x).map_or(f64::NAN, |found| found[0] / MPA);
                let nominal: Vec<f64> = x.iter().map(predict).collect();
                plot = plot.series(Series::line(&law.key, &x, &nominal));
            }
            plot.write(directory.join(format!("{}_{}.png", self.name, test.name)))?;
        }
        Ok(())
    }
}

fn key(terms: usize) -> String {
    format!("hyperfoam-{terms}")
}

/// Strain farthest from rest: that of the largest stress.
fn end_of(test: &FoamTest) -> f64 {
    let by_stress = test.states.iter().max_by(|a, b| a.nominal.abs().total_cmp(&b.nominal.abs()));
    by_stress.map_or(0.0, |state| state.strain)
}

/// μ in MPa, α and β of each term.
fn values(law: &Hyperfoam) -> Vec<f64> {
    law.terms().iter().flat_map(|term| [term.modulus / MPA, term.exponent, term.beta]).collect()
}

/// Formats the law as `*HYPERFOAM`, in MPa.
fn card(foam: &str, key: &str, law: &Hyperfoam) -> String {
    format!("**\n{}", deck::card(&deck::material_name(key, foam), key, &values(law), &[]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use polycore::constitutive::hyperelastic::FoamTerm;

    /// β = 0.5: ν = 0.25.
    #[test]
    fn the_card_of_a_foam() {
        let term = FoamTerm { modulus: 0.2e6, exponent: 7.0, beta: 0.5 };
        let law = Hyperfoam::new(&[term, FoamTerm { beta: 0.0, ..term }]).unwrap();
        let expected = "*HYPERFOAM, N=2\n2.000000000e-1, 7.000000000e0, 2.000000000e-1, \
                        7.000000000e0, 2.500000000e-1, 0.000000000e0\n";
        let text = card("pad", "hyperfoam-2", &law);
        assert!(text.ends_with(expected) && text.contains("NAME=HYPERFOAM_2_PAD\n"), "{text}");
    }
}
