//! Pictures of fits: curves over the data for each test of a table, and model against measurement.

use std::path::Path;

use harness::output::picture::{LinePlot, Series};
use polycore::Error;
use polycore::constitutive::hyperelastic::data::{Mode, TestData, TestState};
use polycore::constitutive::hyperelastic::fit::{self, Fit};
use polycore::constitutive::hyperelastic::ranking::ModeTable;
use polycore::constitutive::hyperelastic::{Hyperelastic, ModelKind, TwistedCylinder};

use super::MPA;

/// Test that may occur among general biaxial states, and the stress drawn over its first stretch.
struct TestPlot {
    key: &'static str,
    title: &'static str,
    /// Labels of abscissa and ordinate.
    axes: [&'static str; 2],
    mode: Mode,
    /// Index of the stress.
    stress: usize,
    holds: fn(&TestState) -> bool,
}

const NOMINAL: [&str; 2] = ["stretch", "nominal stress, MPa"];

const TESTS: [TestPlot; 6] = [
    TestPlot {
        key: "uniaxial",
        title: "uniaxial tension",
        axes: NOMINAL,
        mode: Mode::Uniaxial,
        stress: 0,
        holds: |state| match state.mode {
            Mode::Biaxial => state.nominal[1] == 0.0,
            mode => mode == Mode::Uniaxial,
        },
    },
    TestPlot {
        key: "pure-shear",
        title: "pure shear",
        axes: NOMINAL,
        mode: Mode::PureShear,
        stress: 0,
        holds: |state| match state.mode {
            Mode::Biaxial => state.stretches[1] == 1.0 && state.nominal[1] != 0.0,
            mode => mode == Mode::PureShear && first_or_rest(state),
        },
    },
    TestPlot {
        key: "simple-shear",
        title: "simple shear, as the pure shear of its stretch",
        axes: NOMINAL,
        mode: Mode::PureShear,
        stress: 0,
        holds: |state| state.mode == Mode::SimpleShear,
    },
    TestPlot {
        key: "equibiaxial",
        title: "equibiaxial tension",
        axes: NOMINAL,
        mode: Mode::Equibiaxial,
        stress: 0,
        holds: |state| match state.mode {
            Mode::Biaxial => state.stretches[0] == state.stretches[1] && state.nominal[1] != 0.0,
            mode => mode == Mode::Equibiaxial && first_or_rest(state),
        },
    },
    TestPlot {
        key: "torsion",
        title: "torque M of a cylinder of radius R",
        axes: ["shear at the surface", "2M/(πR³), MPa"],
        mode: Mode::Torsion,
        stress: 0,
        holds: |state| state.mode == Mode::Torsion && state.nominal[0] != 0.0,
    },
    TestPlot {
        key: "torsion-force",
        title: "axial force N of a twisted cylinder of radius R",
        axes: ["shear at the surface", "N/(πR²), MPa"],
        mode: Mode::Torsion,
        stress: 1,
        holds: |state| state.mode == Mode::Torsion && state.nominal[1] != 0.0,
    },
];

impl TestPlot {
    /// State of the test at a first stretch: of torsion with the held length of another state.
    fn at(&self, like: &TestState, stretch: f64) -> TestState {
        let second = match self.mode {
            Mode::Torsion => like.stretches[0] * like.stretches[1] / stretch,
            mode => mode.second_stretch(stretch),
        };
        TestState::new(self.mode, [stretch, second], [0.0; 2])
    }

    /// Abscissa of a state.
    fn abscissa(state: &TestState) -> f64 {
        state.cylinder().map_or(state.stretches[0], |cylinder| cylinder.shear)
    }
}

/// Returns true unless only the second stress of a state was measured.
fn first_or_rest(state: &TestState) -> bool {
    state.nominal[0] != 0.0 || state.nominal[1] == 0.0
}

/// Number of points of a curve.
const POINTS: usize = 200;

/// Categories of the thesis, each with its own pictures: together they would be more curves than colours.
const KINDS: [(ModelKind, &str); 2] =
    [(ModelKind::Phenomenological, "phenomenological"), (ModelKind::Micromechanical, "chains")];

/// Draws `<data>_<test>_<kind>.png` for every test with at least three states, and
/// `<data>_parity_<kind>.png` for biaxial tables.
pub fn pictures(directory: &Path, name: &str, table: &TestData, fits: &[Fit]) -> Result<(), Error> {
    for (kind, suffix) in KINDS {
        let fits: Vec<&Fit> = fits.iter().filter(|fit| fit.model.kind == kind).collect();
        if fits.is_empty() {
            continue;
        }
        for test in &TESTS {
            let states: Vec<&TestState> = table.states.iter().filter(|state| (test.holds)(state)).collect();
            if states.len() >= 3 {
                let path = directory.join(format!("{name}_{}_{suffix}.png", test.key));
                curves(name, test, &states, &fits, table.deviation).write(path)?;
            }
        }
        let is_general = |state: &TestState| {
            state.mode != table.states[0].mode
                || state.nominal[1] != 0.0
                || matches!(state.mode, Mode::Component | Mode::Difference)
        };
        if table.states.iter().any(is_general) {
            parity(name, table, &fits)?.write(directory.join(format!("{name}_parity_{suffix}.png")))?;
        }
    }
    Ok(())
}

/// Draws the stress of a test over its stretch, of torsion over the shear at the surface.
fn curves(
    name: &str,
    test: &TestPlot,
    states: &[&TestState],
    fits: &[&Fit],
    deviation: Option<f64>,
) -> LinePlot {
    let x: Vec<f64> = states.iter().map(|state| TestPlot::abscissa(state)).collect();
    let y: Vec<f64> = states.iter().map(|state| state.nominal[test.stress] / MPA).collect();
    let stretches: Vec<f64> = states.iter().map(|state| state.stretches[0]).collect();
    let ends = span(&stretches, 1.0).map(|l| 1.0 + 1.03 * (l - 1.0)).map(|l| l.max(0.01));
    let [low, high] = match test.mode {
        Mode::Torsion => [0.0, 1.03 * span(&x, 0.0)[1]],
        _ => ends,
    };
    let [least, most] = span(&y, 0.0).map(|nominal| 1.1 * nominal);
    let mut plot = LinePlot::new(&format!("{name}: {}", test.title))
        .axes(test.axes[0], test.axes[1])
        .x_range(low, high)
        .y_range(least, most)
        .series(Series::markers("measured", &x, &y));
    if let Some(deviation) = deviation {
        plot = plot.series(bars(test, states, &x, deviation).joined());
    }
    for fit in fits {
        let found = curve(test, states, &fit.law, ends);
        let shown: Vec<f64> = found.iter().map(|(state, _)| TestPlot::abscissa(state)).collect();
        let nominal: Vec<f64> = found.iter().map(|(_, nominal)| *nominal).collect();
        plot = plot.series(Series::line(fit.model.key, &shown, &nominal));
    }
    plot
}

/// Draws `<data>_modes.png`: a law over the measurements of every mode of deformation that one stretch
/// describes, with bars of one standard deviation if it is known.
pub fn every_mode(
    directory: &Path,
    name: &str,
    modes: &[ModeTable],
    fit: &Fit,
    deviation: Option<f64>,
) -> Result<(), Error> {
    let mut plot =
        LinePlot::new(&format!("{name}: {}", fit.model.key)).axes("stretch", "nominal stress, MPa");
    let mut empty = true;
    for mode in modes {
        let test = TESTS.iter().find(|test| test.key == mode.mode || (test.key, mode.mode) == COMPRESSION);
        let states: Vec<&TestState> =
            mode.table.states.iter().filter(|state| state.nominal[0] != 0.0).collect();
        let (Some(test), false) = (test, states.is_empty()) else { continue };
        let x: Vec<f64> = states.iter().map(|state| state.stretches[0]).collect();
        let y: Vec<f64> = states.iter().map(|state| state.nominal[0] / MPA).collect();
        empty = false;
        plot = plot.series(Series::markers(mode.mode, &x, &y));
        if let Some(deviation) = deviation {
            plot = plot.series(bars(test, &states, &x, deviation).joined());
        }
        let found = curve(test, &states, &fit.law, span(&x, 1.0));
        let stretches: Vec<f64> = found.iter().map(|(state, _)| state.stretches[0]).collect();
        let nominal: Vec<f64> = found.iter().map(|(_, nominal)| *nominal).collect();
        plot = plot.series(Series::line("", &stretches, &nominal).joined());
    }
    if empty { Ok(()) } else { plot.write(directory.join(format!("{name}_modes.png"))) }
}

/// Test that the mode of compression belongs to.
const COMPRESSION: (&str, &str) = ("uniaxial", "compression");

/// States of a range of stretches and their stresses, MPa; beyond locking the curve ends. Torsion has a
/// curve, from no twist on, for each held length among some states.
fn curve(
    test: &TestPlot,
    states: &[&TestState],
    law: &dyn Hyperelastic,
    [low, high]: [f64; 2],
) -> Vec<(TestState, f64)> {
    let mut likes: Vec<&TestState> = Vec::new();
    for state in states {
        let held = |state: &TestState| state.stretches[0] * state.stretches[1];
        let same = |other: &&TestState| (held(other) / held(state) - 1.0).abs() < SAME_LENGTH;
        if likes.is_empty() || (test.mode == Mode::Torsion && !likes.iter().any(same)) {
            likes.push(state);
        }
    }
    let mut points = Vec::new();
    for like in &likes {
        let cylinder = like.cylinder().map(|cylinder| TwistedCylinder { shear: 0.0, ..cylinder });
        let from = cylinder.map_or(low, |untwisted| untwisted.surface()[0]);
        for i in 0..=POINTS {
            let state = test.at(like, from + (high - from) * i as f64 / POINTS as f64);
            let nominal = state.predict(law).map_or(f64::NAN, |nominal| nominal[test.stress] / MPA);
            points.push((state, nominal));
        }
        if likes.len() > 1 {
            // a gap before the next curve
            points.push((test.at(like, high), f64::NAN));
        }
    }
    points
}

/// Relative difference of held lengths, halved, within which states of torsion have one curve.
const SAME_LENGTH: f64 = 1e-6;

/// Bars of one standard deviation, given that of a stress of weight 1, Pa.
fn bars(test: &TestPlot, states: &[&TestState], x: &[f64], deviation: f64) -> Series {
    let end = |sign: f64| -> Vec<f64> {
        let size = |state: &TestState| deviation / state.roots[test.stress] / state.ratio();
        states.iter().map(|state| (state.nominal[test.stress] + sign * size(state)) / MPA).collect()
    };
    Series::bars(x, &end(-1.0), &end(1.0))
}

/// Draws every stress of the table, model over measurement.
fn parity(name: &str, table: &TestData, fits: &[&Fit]) -> Result<LinePlot, Error> {
    let measured: Vec<f64> =
        table.states.iter().flat_map(TestState::measured).map(|stress| stress / MPA).collect();
    let [lowest, highest] = span(&measured, 0.0).map(|nominal| 1.1 * nominal);
    let mut plot = LinePlot::new(&format!("{name}: all measured stresses"))
        .axes("measured nominal stress, MPa", "nominal stress of the law, MPa")
        .x_range(lowest, highest)
        .y_range(lowest, highest)
        .series(Series::reference("equal", &[lowest, highest], &[lowest, highest]));
    for fit in fits {
        let residuals = fit::residuals(&fit.law, table)?;
        let roots = table.states.iter().flat_map(TestState::measured_roots);
        let model: Vec<f64> = residuals
            .iter()
            .zip(roots)
            .zip(&measured)
            .map(|((r, root), data)| r / root / MPA + data)
            .collect();
        plot = plot.series(Series::markers(fit.model.key, &measured, &model));
    }
    Ok(plot)
}

/// Least and largest of some values, the value at rest included.
fn span(values: &[f64], rest: f64) -> [f64; 2] {
    values.iter().fold([rest, rest], |[low, high], value| [value.min(low), value.max(high)])
}
