//! Uniaxial runs: stress-strain curves as in Fig. 3.5, moduli and peaks.

use crate::dataset::Dataset;
use crate::error::Error;
use crate::eval::uniaxial::{MODULUS, STIFFENING, curve, peak, slope};
use crate::program::quantities as q;
use harness::output::csv;
use harness::output::picture::{LinePlot, Series};
use harness::report::Report;
use std::path::Path;

const AXES: [&str; 3] = ["x", "y", "z"];

/// Reports for each direction the modulus of all runs and the highest peak, and their ratios.
pub(super) fn measure(report: &mut Report, set: &Dataset) {
    let mut moduli = [None; 3];
    let mut peaks = [None; 3];
    for (axis, name) in AXES.iter().enumerate() {
        let runs = || set.paths.iter().filter(|path| path.kind == format!("u{name}"));
        let all: Vec<[f64; 2]> = runs().flat_map(|run| curve(run, axis)).collect();
        moduli[axis] = slope(&all, MODULUS);
        peaks[axis] = runs().filter_map(|run| peak(&curve(run, axis))).max_by(|a, b| a[1].total_cmp(&b[1]));
        if let Some(modulus) = moduli[axis] {
            report.value(q::MODULUS.named(&[name]), modulus / 1e9);
        }
        if let Some([strain, stress]) = peaks[axis] {
            report.value(q::PEAK_STRESS.named(&[name]), stress / 1e9);
            report.value(q::PEAK_STRAIN.named(&[name]), strain);
        }
        if let [Some(before), Some(after)] = STIFFENING.map(|range| slope(&all, range)) {
            report.value(q::STIFFENING.named(&[name]), after / before);
        }
    }
    for axis in [0, 1] {
        if let (Some(across), Some(along)) = (moduli[axis], moduli[2]) {
            report.value(q::MODULUS_RATIO.named(&[AXES[axis]]), along / across);
        }
        if let (Some([across, _]), Some([along, _])) = (peaks[axis], peaks[2]) {
            report.value(q::PEAK_STRAIN_RATIO.named(&[AXES[axis]]), across / along);
        }
    }
}

/// Draws stress against engineering strain, one picture per direction, as in Fig. 3.5.
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
