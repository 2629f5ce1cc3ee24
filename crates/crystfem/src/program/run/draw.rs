//! Pictures of the material alone (Figs 4.1, 4.4, 4.5).

use crate::material::Semicrystalline;
use crate::point::Curves;
use crate::program::observe::celsius::{CELSIUS, to_celsius};
use harness::output::picture::{LinePlot, Series};
use polycore::Error;
use std::path::Path;

/// Largest number of drawn rows per curve.
const MOST_ROWS: usize = 4000;

/// Results of a finished point.
pub struct PointRun {
    /// Name of the point.
    pub name: String,
    /// Names of its fields.
    pub fields: &'static [&'static str],
    /// Time histories of all quantities.
    pub curves: Curves,
}

impl PointRun {
    /// Takes every k-th row and the last, so that a picture stays small.
    fn thinned(&self, values: impl Fn(usize) -> f64) -> Vec<f64> {
        let rows = self.curves.time.len();
        let every = rows.div_ceil(MOST_ROWS);
        let mut kept: Vec<f64> = (0..rows).step_by(every).map(&values).collect();
        kept.push(values(rows - 1));
        // values beyond the axes are not drawn
        kept.iter_mut().filter(|x| x.abs() > 1e6).for_each(|x| *x = f64::NAN);
        kept
    }

    fn celsius(&self) -> Vec<f64> {
        self.thinned(|row| self.curves.temperature[row] - CELSIUS)
    }
}

/// x and y of a drawn curve.
type XyData = (Vec<f64>, Vec<f64>);

/// Draws temperature histories, and α and dα/dt over temperature and over time.
pub fn draw_curves(title: &str, runs: &[PointRun], output: &Path) -> Result<(), Error> {
    if runs.is_empty() {
        return Ok(());
    }
    let longest = runs.iter().map(|run| run.curves.time[run.curves.time.len() - 1]).fold(0.0, f64::max);
    let (unit, scale) = match longest {
        ..600.0 => ("s", 1.0),
        ..36_000.0 => ("min", 60.0),
        _ => ("h", 3600.0),
    };
    let time = |run: &PointRun| run.thinned(|row| run.curves.time[row].min(1e6 * scale) / scale);
    let axis = format!("time ({unit})");
    let plot = |name: &str, x: &str, y: &str, series: &dyn Fn(&PointRun) -> Option<XyData>| {
        let mut plot = LinePlot::new(title).axes(x, y).size(900.0, 480.0);
        let mut any = false;
        for run in runs {
            if let Some((x, y)) = series(run) {
                any |= x.iter().zip(&y).any(|(x, y)| !x.is_nan() && !y.is_nan());
                plot = plot.series(Series::line(&run.name, &x, &y));
            }
        }
        if any { plot.write(output.join(name)) } else { Ok(()) }
    };
    plot("temperature.png", &axis, "temperature (°C)", &|run| Some((time(run), run.celsius())))?;
    let alpha = |run: &PointRun| {
        let index = run.fields.iter().position(|field| *field == "alpha")?;
        Some(run.thinned(|row| run.curves.fields[row][index]))
    };
    let relative = "relative crystallinity α";
    plot("alpha.png", "temperature (°C)", relative, &|run| Some((run.celsius(), alpha(run)?)))?;
    plot("alpha_time.png", &axis, relative, &|run| Some((time(run), alpha(run)?)))?;
    plot("rate.png", "temperature (°C)", "dα/dt (1/s)", &|run| {
        alpha(run)?;
        Some((run.celsius(), run.thinned(|row| run.curves.rate[row])))
    })
}

/// Draws the rate K(T) and the distribution of melting temperatures (Fig. 4.1).
pub fn draw_laws(name: &str, material: &Semicrystalline, output: &Path) -> Result<(), Error> {
    let suffix = if name.is_empty() { String::new() } else { format!("_{name}") };
    let sampled = |low: f64, high: f64| -> Vec<f64> {
        (0..=400).map(|i| low + (high - low) * f64::from(i) / 400.0).collect()
    };
    let kinetics = material.kinetics();
    let constants = kinetics.constants();
    let temperatures = sampled(constants.frozen, constants.equilibrium_melting);
    let rates: Vec<f64> = temperatures.iter().map(|&t| kinetics.rate(t)).collect();
    LinePlot::new("Rate of crystallization")
        .axes("temperature (°C)", "K(T) (1/s)")
        .series(Series::line("Hoffman–Lauritzen", &to_celsius(&temperatures), &rates))
        .write(output.join(format!("kinetics{suffix}.png")))?;
    let Some(melting) = &material.crystallization().melting else { return Ok(()) };
    let [sharpness, _, peak] = melting.constants();
    let temperatures = sampled(peak - 50.0 / sharpness, peak + 15.0 / sharpness);
    let molten: Vec<f64> = temperatures.iter().map(|&t| melting.molten(t)).collect();
    let density: Vec<f64> = temperatures.iter().map(|&t| melting.molten_slope(t)).collect();
    LinePlot::new("Melting")
        .axes("temperature (°C)", "Xm, and dXm/dT (1/K)")
        .series(Series::line("degree of melting Xm", &to_celsius(&temperatures), &molten))
        .series(Series::line("distribution dXm/dT", &to_celsius(&temperatures), &density))
        .write(output.join(format!("melting{suffix}.png")))
}
