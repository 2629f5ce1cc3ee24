//! Uniaxial runs: stress against strain as in Fig. 3.5, moduli, peaks.

use crate::dataset::{Dataset, Path as Run};
use crate::error::Error;
use crate::program::quantities as q;
use harness::output::csv;
use harness::output::picture::{LinePlot, Series};
use harness::report::Report;
use std::path::Path;

const AXES: [&str; 3] = ["x", "y", "z"];

/// Strains of the modulus: below, the drift of a crystal that is not yet at rest rules; above, it softens or stiffens.
const MODULUS: [f64; 2] = [0.02, 0.08];
/// Strains before and after 12 %, where the thesis sees a crystal pulled in x stiffen (§3.2).
const STIFFENING: [[f64; 2]; 2] = [[0.04, 0.12], [0.12, 0.20]];
/// Samples of a moving mean, so that a peak is none of the noise.
const MEAN_OF: usize = 5;

/// Engineering strain and Cauchy stress (Pa) along the axis.
fn curve(run: &Run, axis: usize) -> Vec<[f64; 2]> {
    run.rows.iter().map(|row| [row.deformation.matrix()[(axis, axis)] - 1.0, row.cauchy[axis]]).collect()
}

/// Slope of the line through the points between two strains by least squares; none for fewer than five.
fn slope(points: &[[f64; 2]], [low, high]: [f64; 2]) -> Option<f64> {
    let own: Vec<[f64; 2]> = points.iter().filter(|p| (low..=high).contains(&p[0])).copied().collect();
    let mean = |k: usize| own.iter().map(|p| p[k]).sum::<f64>() / own.len() as f64;
    let [x, y] = [mean(0), mean(1)];
    let sum = |f: &dyn Fn(&[f64; 2]) -> f64| own.iter().map(f).sum::<f64>();
    let width = sum(&|p| (p[0] - x).powi(2));
    (own.len() >= 5 && width > 0.0).then(|| sum(&|p| (p[0] - x) * (p[1] - y)) / width)
}

/// The largest of a moving mean, and its strain.
fn peak(points: &[[f64; 2]]) -> Option<[f64; 2]> {
    let mean = |window: &[[f64; 2]], k: usize| window.iter().map(|p| p[k]).sum::<f64>() / MEAN_OF as f64;
    let means = points.windows(MEAN_OF).map(|window| [mean(window, 0), mean(window, 1)]);
    means.max_by(|a, b| a[1].total_cmp(&b[1]))
}

/// Moduli of all runs in a direction, peaks of the run that has the highest, and their ratios.
pub(super) fn measure(report: &mut Report, set: &Dataset) {
    let mut moduli = [None; 3];
    let mut peaks = [None; 3];
    for (axis, name) in AXES.iter().enumerate() {
        let runs = || set.paths.iter().filter(|path| path.kind == format!("u{name}"));
        let all: Vec<[f64; 2]> = runs().flat_map(|run| curve(run, axis)).collect();
        moduli[axis] = slope(&all, MODULUS);
        peaks[axis] = runs().filter_map(|run| peak(&curve(run, axis))).max_by(|a, b| a[1].total_cmp(&b[1]));
        if let Some(modulus) = moduli[axis] {
            report.value(q::MODULUS.of(&[name]), modulus / 1e9);
        }
        if let Some([strain, stress]) = peaks[axis] {
            report.value(q::PEAK_STRESS.of(&[name]), stress / 1e9);
            report.value(q::PEAK_STRAIN.of(&[name]), strain);
        }
        if let [Some(before), Some(after)] = STIFFENING.map(|range| slope(&all, range)) {
            report.value(q::STIFFENING.of(&[name]), after / before);
        }
    }
    for axis in [0, 1] {
        if let (Some(across), Some(along)) = (moduli[axis], moduli[2]) {
            report.value(q::MODULUS_RATIO.of(&[AXES[axis]]), along / across);
        }
        if let (Some([across, _]), Some([along, _])) = (peaks[axis], peaks[2]) {
            report.value(q::PEAK_STRAIN_RATIO.of(&[AXES[axis]]), across / along);
        }
    }
}

/// Stress against engineering strain, one picture a direction as in Fig. 3.5.
pub(super) fn draw(set: &Dataset, heldout: Option<&Dataset>, output: &Path) -> Result<(), Error> {
    for (axis, name) in AXES.iter().enumerate() {
        let kind = format!("u{name}");
        let mut plot = LinePlot::new(&format!("Uniaxial tension in {name}"))
            .axes("engineering strain", "Cauchy stress (MPa)");
        let (mut strains, mut stresses, mut rates) = (Vec::new(), Vec::new(), Vec::new());
        let own = set.paths.iter().filter(|path| path.kind == kind);
        let kept = heldout.into_iter().flat_map(|set| &set.paths).filter(|path| path.kind == kind);
        for (path, held) in own.map(|path| (path, false)).chain(kept.map(|path| (path, true))) {
            let points = curve(path, axis);
            let strain: Vec<f64> = points.iter().map(|p| p[0]).collect();
            let stress: Vec<f64> = points.iter().map(|p| p[1] / 1e6).collect();
            let label = format!("{}: {:.3e}/s", path.id, path.rates[axis]);
            let series = if held { Series::reference } else { Series::line };
            plot = plot.series(series(&label, &strain, &stress));
            rates.extend(std::iter::repeat_n(path.rates[axis], strain.len()));
            strains.extend(strain);
            stresses.extend(stress);
        }
        if strains.is_empty() {
            continue;
        }
        csv::write(
            output.join(format!("uniaxial-{name}.csv")),
            &[("rate", "1/s", &rates), ("strain", "", &strains), ("stress", "MPa", &stresses)],
        )?;
        plot.write(output.join(format!("uniaxial-{name}.png")))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_and_peaks_by_hand() {
        // 2 and 6 Pa before and after 0.12, then down
        let stress = |e: f64| match e {
            e if e <= 0.12 => 1.0 + 2.0 * e,
            e if e <= 0.2 => 1.24 + 6.0 * (e - 0.12),
            e => 1.72 - (e - 0.2),
        };
        let points: Vec<[f64; 2]> = (0..=60).map(|k| 0.005 * f64::from(k)).map(|e| [e, stress(e)]).collect();
        assert!((slope(&points, MODULUS).unwrap() - 2.0).abs() < 1e-12);
        assert!((slope(&points, [0.125, 0.2]).unwrap() - 6.0).abs() < 1e-12);
        assert_eq!(slope(&points, [0.0, 0.015]), None);
        // five samples from the peak on: 1.72, 1.715, 1.71, 1.705, 1.7
        let [strain, height] = peak(&points).unwrap();
        assert!((strain - 0.21).abs() < 1e-9 && (height - 1.71).abs() < 1e-9, "{strain} {height}");
    }
}
