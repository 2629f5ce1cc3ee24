//! Pictures of the material alone (Figs 4.1, 4.4, 4.5).

use crate::material::Semicrystalline;
use crate::point::Curves;
use crate::program::observe::celsius::{CELSIUS, of_kelvin};
use harness::output::picture::{LinePlot, Series};
use polycore::Error;
use std::path::Path;

/// Rows that a curve is drawn with at most.
const ROWS: usize = 4000;

/// A finished run.
pub struct Run {
    /// Its name.
    pub name: String,
    /// Names of its fields.
    pub fields: &'static [&'static str],
    /// Its curves.
    pub curves: Curves,
}

impl Run {
    /// Every k-th row, so that a long curve stays drawable, and the last.
    fn thinned(&self, values: impl Fn(usize) -> f64) -> Vec<f64> {
        let rows = self.curves.time.len();
        let every = rows.div_ceil(ROWS);
        let mut kept: Vec<f64> = (0..rows).step_by(every).map(&values).collect();
        kept.push(values(rows - 1));
        // what cannot be drawn is left out
        kept.iter_mut().filter(|x| x.abs() > 1e6).for_each(|x| *x = f64::NAN);
        kept
    }

    fn of_kelvin(&self) -> Vec<f64> {
        self.thinned(|row| self.curves.temperature[row] - CELSIUS)
    }
}

/// x and y.
type Curve = (Vec<f64>, Vec<f64>);

/// Temperature histories; α and dα/dt over temperature and over time.
pub fn curves(title: &str, runs: &[Run], output: &Path) -> Result<(), Error> {
    if runs.is_empty() {
        return Ok(());
    }
    let longest = runs.iter().map(|run| run.curves.time[run.curves.time.len() - 1]).fold(0.0, f64::max);
    let (unit, scale) = match longest {
        ..600.0 => ("s", 1.0),
        ..36_000.0 => ("min", 60.0),
        _ => ("h", 3600.0),
    };
    let time = |run: &Run| run.thinned(|row| run.curves.time[row].min(1e6 * scale) / scale);
    let axis = format!("time ({unit})");
    let plot = |name: &str, x: &str, y: &str, series: &dyn Fn(&Run) -> Option<Curve>| {
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
    plot("temperature.png", &axis, "temperature (°C)", &|run| Some((time(run), run.of_kelvin())))?;
    let alpha = |run: &Run| {
        let index = run.fields.iter().position(|field| *field == "alpha")?;
        Some(run.thinned(|row| run.curves.fields[row][index]))
    };
    let relative = "relative crystallinity α";
    plot("alpha.png", "temperature (°C)", relative, &|run| Some((run.of_kelvin(), alpha(run)?)))?;
    plot("alpha_time.png", &axis, relative, &|run| Some((time(run), alpha(run)?)))?;
    plot("rate.png", "temperature (°C)", "dα/dt (1/s)", &|run| {
        alpha(run)?;
        Some((run.of_kelvin(), run.thinned(|row| run.curves.rate[row])))
    })
}

/// The rate K(T), and the distribution of melting temperatures (Fig. 4.1).
pub fn laws(name: &str, material: &Semicrystalline, output: &Path) -> Result<(), Error> {
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
        .series(Series::line("Hoffman–Lauritzen", &of_kelvin(&temperatures), &rates))
        .write(output.join(format!("kinetics{suffix}.png")))?;
    let Some(melting) = &material.crystallization().melting else { return Ok(()) };
    let [sharpness, _, peak] = melting.constants();
    let temperatures = sampled(peak - 50.0 / sharpness, peak + 15.0 / sharpness);
    let molten: Vec<f64> = temperatures.iter().map(|&t| melting.molten(t)).collect();
    let density: Vec<f64> = temperatures.iter().map(|&t| melting.molten_slope(t)).collect();
    LinePlot::new("Melting")
        .axes("temperature (°C)", "Xm, and dXm/dT (1/K)")
        .series(Series::line("degree of melting Xm", &of_kelvin(&temperatures), &molten))
        .series(Series::line("distribution dXm/dT", &of_kelvin(&temperatures), &density))
        .write(output.join(format!("melting{suffix}.png")))
}
