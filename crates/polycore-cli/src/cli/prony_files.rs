//! Files of a Prony series: terms, curve, branches for scenes, card for Abaqus, picture.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use harness::output::csv;
use harness::output::picture::{LinePlot, Series};
use polycore::Error;
use polycore::constitutive::viscoelastic::Shift;
use polycore::constitutive::viscoelastic::linear::{PronyFit, WlfFit};
use polycore::file::atomic_write;

use super::MPA;
use super::material::{BULK_RATIO, DIGITS, digits};
use super::prony::{CELSIUS, MasterCurve, MeasuredModulus, PronySet};

/// Points of a curve in a picture.
const POINTS: usize = 200;

impl PronySet {
    /// Writes `NAME_prony.csv`, `NAME_curve.csv`, `NAME_shifts.csv` of isotherms, `NAME_branches.toml` and
    /// `NAME_prony.inp`.
    pub fn write(
        &self,
        directory: &Path,
        found: &PronyFit,
        master: Option<&MasterCurve>,
    ) -> Result<(), Error> {
        let file = |end: &str| directory.join(format!("{}_{end}", self.name));
        let terms = &found.series.terms;
        // that of the equilibrium modulus comes first
        let factors: Vec<f64> =
            found.factors.iter().skip(1).map(|factor| factor.unwrap_or(f64::NAN)).collect();
        let moduli: Vec<f64> = terms.iter().map(|term| term.modulus / MPA).collect();
        let times: Vec<f64> = terms.iter().map(|term| term.time).collect();
        let of_moduli: Vec<f64> = factors.iter().copied().step_by(2).collect();
        let of_times: Vec<f64> = factors.iter().copied().skip(1).step_by(2).collect();
        let columns: [csv::Column<'_>; 4] = [
            ("modulus", "MPa", &moduli),
            ("relaxation_time", "s", &times),
            ("modulus_factor_95", "", &of_moduli),
            ("time_factor_95", "", &of_times),
        ];
        csv::write(file("prony.csv"), &columns)?;
        let ([abscissa, unit], names) = self.columns();
        let curve = self.curve(master);
        let at: Vec<f64> = curve.iter().map(|point| point[0]).collect();
        let mut columns: Vec<(String, &str, Vec<f64>)> = vec![(abscissa.to_owned(), unit, at.clone())];
        for (k, name) in names.iter().enumerate() {
            let measured = curve.iter().map(|point| point[k + 1] / MPA).collect();
            let model = at.iter().map(|&at| self.model(found, at)[k] / MPA).collect();
            columns.push(((*name).to_owned(), "MPa", measured));
            columns.push((format!("{name}_model"), "MPa", model));
        }
        let columns: Vec<csv::Column<'_>> =
            columns.iter().map(|(name, unit, values)| (name.as_str(), *unit, values.as_slice())).collect();
        csv::write(file("curve.csv"), &columns)?;
        if let Some(master) = master {
            let celsius: Vec<f64> = master.shifts.iter().map(|shift| shift[0] - CELSIUS).collect();
            let logarithms: Vec<f64> = master.shifts.iter().map(|shift| shift[1]).collect();
            let columns: [csv::Column<'_>; 2] =
                [("temperature", "degC", &celsius), ("log10_a_T", "", &logarithms)];
            csv::write(file("shifts.csv"), &columns)?;
        }
        let (branches, card) = (self.branches(found), self.card(found, master));
        atomic_write(file("branches.toml"), |file| file.write_all(branches.as_bytes()))?;
        atomic_write(file("prony.inp"), |file| file.write_all(card.as_bytes()))
    }

    /// G over the measured modulus.
    fn share(&self) -> f64 {
        match self.modulus {
            MeasuredModulus::Tension => 1.0 / 3.0,
            MeasuredModulus::Shear => 1.0,
        }
    }

    /// Branches for `[material.solid]` of a scene.
    fn branches(&self, found: &PronyFit) -> String {
        let rest = digits(self.share() * found.series.equilibrium / MPA, DIGITS);
        let mut text =
            format!("# shear modulus at equilibrium {rest} MPa; for [material.solid] of a scene of peri\n");
        for term in &found.series.terms {
            let modulus = self.share() * term.modulus / MPA;
            let [nu, eta] = [modulus, modulus * term.time].map(|value| digits(value, DIGITS));
            let _ = writeln!(
                text,
                "[[material.solid.branch]]\nspring = \"neo-hookean\"\nviscosity = \"constant\"\n\
                 parameters = {{ nu = \"{nu} MPa\", eta = \"{eta} MPa s\" }}"
            );
        }
        text
    }

    /// Material of Abaqus in mm, N, MPa, s: instantaneous neo-Hookean law, relative moduli, WLF constants.
    fn card(&self, found: &PronyFit, master: Option<&MasterCurve>) -> String {
        let instantaneous = found.series.instantaneous();
        let shear = self.share() * instantaneous / MPA;
        let name = self.name.to_uppercase();
        let mut text = format!(
            "** units mm, N, MPa, s; K is {BULK_RATIO} times the shear modulus: the tests do not determine \
             it\n\
             *MATERIAL, NAME={name}\n*HYPERELASTIC, NEO HOOKE, MODULI=INSTANTANEOUS\n{:.6e}, {:.6e}\n\
             *VISCOELASTIC, TIME=PRONY\n",
            0.5 * shear,
            2.0 / (BULK_RATIO * shear)
        );
        for term in &found.series.terms {
            let _ = writeln!(text, "{:.6e}, 0.0, {:.6e}", term.modulus / instantaneous, term.time);
        }
        let wlf = master.and_then(|master| master.wlf.as_ref());
        if let Some(WlfFit { shift: Shift::Wlf { reference, constants: [first, second] }, .. }) = wlf {
            let celsius = reference - CELSIUS;
            let _ = writeln!(text, "** temperatures in degC\n*TRS, DEFINITION=WLF");
            let _ = writeln!(text, "{celsius:.4}, {first:.6e}, {second:.6e}");
        }
        text
    }

    /// Draws measured and fitted moduli, `NAME_prony.png`.
    pub fn draw(
        &self,
        directory: &Path,
        found: &PronyFit,
        master: Option<&MasterCurve>,
    ) -> Result<(), Error> {
        let ([abscissa, unit], names) = self.columns();
        let curve: Vec<Vec<f64>> = self.curve(master).into_iter().filter(|point| point[0] > 0.0).collect();
        let at: Vec<f64> = curve.iter().map(|point| point[0]).collect();
        let [low, high] =
            at.iter().fold([f64::INFINITY, 0.0], |[low, high]: [f64; 2], &x| [low.min(x), high.max(x)]);
        let fine: Vec<f64> =
            (0..=POINTS).map(|k| low * (high / low).powf(k as f64 / POINTS as f64)).collect();
        let mut plot =
            LinePlot::new(&format!("Prony series of {}, {} terms", self.name, found.series.terms.len()))
                .axes(&format!("{abscissa} [{unit}]"), "modulus [MPa]")
                .log_x()
                .log_y();
        for (k, name) in names.iter().enumerate() {
            let measured: Vec<f64> = curve.iter().map(|point| point[k + 1] / MPA).collect();
            let positive = |value: &f64| if *value > 0.0 { *value } else { f64::NAN };
            let measured: Vec<f64> = measured.iter().map(positive).collect();
            let model: Vec<f64> = fine.iter().map(|&at| self.model(found, at)[k] / MPA).collect();
            plot = plot.series(Series::markers(&format!("{name}, measured"), &at, &measured));
            plot = plot.series(Series::line(&format!("{name}, series"), &fine, &model));
        }
        plot.write(directory.join(format!("{}_prony.png", self.name)))
    }
}
