use super::axis::{labels, ticks};
use super::*;

#[test]
fn ticks_are_round_and_few() {
    assert_eq!(ticks(0.0, 3.0, 5), [0.0, 1.0, 2.0, 3.0]);
    assert_eq!(labels(&ticks(-1.0, 1.0, 5)), ["−1.0", "−0.5", "0.0", "0.5", "1.0"]);
    assert_eq!(labels(&ticks(0.0, 1e7, 5)), ["0", "2×10⁶", "4×10⁶", "6×10⁶", "8×10⁶", "1.0×10⁷"]);
    assert_eq!(labels(&[-2e-7, 0.0, 2e-7]), ["−2×10⁻⁷", "0", "2×10⁻⁷"]);
    for (low, high) in [(0.0, 1.0), (-3.7, 12.9), (1e-12, 3e-12), (1e20, 9e20), (0.999, 1.001)] {
        for most in 3..9 {
            let found = ticks(low, high, most);
            assert!(found.len() >= 2 && found.len() <= most + 1, "{low} {high} {most}: {found:?}");
            assert!(
                found.iter().all(|tick| *tick >= low - 1e-9 * high.abs() && *tick <= high * (1.0 + 1e-9))
            );
            let mut names = labels(&found);
            names.dedup();
            assert_eq!(names.len(), found.len(), "{names:?}");
        }
    }
    assert!(ticks(1e20, f64::from_bits(1e20f64.to_bits() + 1), 5).len() <= 6);
    assert!(labels(&ticks(0.0, 5e-324, 5)).len() <= 6);
    assert_eq!(ticks(1.0, 1.0, 5), [1.0]);
    assert_eq!(labels(&[0.0]), ["0"]);
}

fn wave(phase: f64) -> (Vec<f64>, Vec<f64>) {
    let x: Vec<f64> = (0..200).map(|i| 1.0 + 0.05 * f64::from(i)).collect();
    let y = x.iter().map(|x| (x + phase).sin() / x).collect();
    (x, y)
}

fn lines() -> LinePlot {
    let mut plot = LinePlot::new("Stress along the ligament").axes("r / a", "σ_θθ / σ∞");
    for (name, phase) in [("Hardy, m = 3", 0.0), ("one-point, m = 3", 0.4), ("printed", 0.8)] {
        let (x, y) = wave(phase);
        plot = plot.series(Series::line(name, &x, &y));
    }
    let (x, mut y) = wave(0.2);
    y[100] = f64::NAN;
    plot.series(Series::reference("Kirsch (1898)", &x, &y))
}

fn convergence() -> LinePlot {
    let h = [4.0, 2.0, 1.0, 0.5];
    let mut plot = LinePlot::new("Convergence").axes("spacing (mm)", "RMSE").log_x().log_y();
    for (name, order) in [("m = 3", 1.0), ("m = 4", 1.5), ("m = 6", 2.0)] {
        plot = plot.series(Series::marked_line(name, &h, &h.map(|h: f64| 0.01 * h.powf(order))));
    }
    plot.series(Series::markers("measured", &h, &h.map(|h| 0.02 * h))).legend(LegendPlace::TopLeft)
}

/// Sixteen decades of error, as `xtask bench langevin` draws.
fn errors() -> LinePlot {
    let time = [1.2, 3.4, 5.0, 8.1, 20.0];
    LinePlot::new("Inverse Langevin function: error against time")
        .axes("time per call (ns)", "largest relative error")
        .log_x()
        .log_y()
        .series(Series::markers("Cohen", &time[..1], &[4.9e-2]))
        .series(Series::markers("Kröger", &time[1..2], &[2.7e-3]))
        .series(Series::markers("Howard", &time[2..3], &[7.6e-6]))
        .series(Series::markers("exact", &time[4..], &[2.2e-16]))
}

fn show(name: &str) -> Option<std::path::PathBuf> {
    // set to look at the pictures
    let directory = std::path::PathBuf::from(std::env::var_os("POLY_PICTURES")?);
    Some(directory.join(name))
}

#[test]
fn line_plots_in_both_formats() {
    let directory = tempfile::tempdir().unwrap();
    for (name, plot) in [("lines", lines()), ("convergence", convergence()), ("errors", errors())] {
        for format in ["png", "svg"] {
            let file = format!("{name}.{format}");
            let path = show(&file).unwrap_or_else(|| directory.path().join(&file));
            plot.write(&path).unwrap();
            let bytes = std::fs::read(path).unwrap();
            match format {
                "png" => assert!(bytes.starts_with(b"\x89PNG\r\n\x1a\n")),
                _ => assert!(String::from_utf8(bytes).unwrap().contains(&plot.title)),
            }
        }
    }
}

#[test]
fn what_cannot_be_drawn_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.svg");
    let fail = |plot: LinePlot| plot.write(&path).unwrap_err().to_string();
    let one = |x: f64, y: f64| LinePlot::new("t").series(Series::line("s", &[1.0, x], &[1.0, y]));
    assert!(fail(LinePlot::new("t")).contains("nothing to draw"));
    assert!(
        fail(LinePlot::new("t").series(Series::line("s", &[f64::NAN], &[1.0]))).contains("nothing to draw")
    );
    assert!(fail(one(f64::INFINITY, 1.0)).contains("(inf, 1) of `s`"));
    assert!(fail(one(0.0, 1.0).log_x()).contains("(0, 1) of `s`"));
    assert!(fail(one(1.0, -1.0).log_y()).contains("(1, -1) of `s`"));
    assert!(fail(one(2.0, 2.0).x_range(3.0, 1.0)).contains("axis range"));
    assert!(
        one(2.0, 2.0).write(directory.path().join("a.gif")).unwrap_err().to_string().contains(".png or .svg")
    );
    // degenerate, but fine
    one(1.0, 1.0).write(&path).unwrap();
    one(1.0, 1e-300).write(&path).unwrap();
    LinePlot::new("").series(Series::line("<&\"", &[1.0, 2.0, 3.0], &[1.0])).write(&path).unwrap();
}

/// Returns a plate with a hole under tension: enough to see edges, extremes and a deformed shape.
fn plate(columns: usize, stretch: f64) -> (Vec<[f64; 2]>, Vec<f64>) {
    let spacing = 1.0 / columns as f64;
    let mut positions = Vec::new();
    let mut values = Vec::new();
    for index in 0..columns * columns {
        let [x, y] = [index % columns, index / columns].map(|i| (i as f64 + 0.5) * spacing - 0.5);
        let r2 = (x * x + y * y) / 0.01;
        if r2 >= 1.0 {
            positions.push([x * (1.0 - 0.3 * (stretch - 1.0)) + 0.02 * (stretch - 1.0) * y, y * stretch]);
            let cos2 = (x * x - y * y) / (x * x + y * y);
            values.push(0.5 * (1.0 + 1.0 / r2) + 0.5 * (1.0 + 3.0 / (r2 * r2)) * cos2);
        }
    }
    (positions, values)
}

#[test]
fn field_maps() {
    let directory = tempfile::tempdir().unwrap();
    let (undeformed, values) = plate(180, 1.0);
    let (deformed, _) = plate(180, 1.35);
    let spacing = 1.0 / 180.0;
    let signed: Vec<f64> = values.iter().map(|value| 1e7 * (value - 1.0)).collect();
    let single = FieldMap::new().lengths("mm", 1e-3).panel(Panel::new(
        "Plate with a hole",
        "σ_yy / σ∞",
        &undeformed,
        &values,
        spacing,
    ));
    let double = FieldMap::new()
        .lengths("mm", 1e-3)
        .panel(Panel::new("clamped range", "P₂₂ (MPa)", &undeformed, &values, spacing).range(0.0, 2.0))
        .panel(Panel::new("deformed", "Δσ [Pa]", &deformed, &signed, spacing).colors(ColorMap::Diverging));
    let bare = FieldMap::new()
        .size(300)
        .columns(2)
        .panel(Panel::new("", "", &undeformed, &values, spacing))
        .panel(Panel::new(
            "a title much longer than the picture below it is wide",
            "t",
            &[[0.0; 2]],
            &[3.0],
            1.0,
        ))
        .panel(Panel::new("NaN", "x", &[[0.0, 0.0], [1.0, 0.0]], &[f64::NAN, 1.0], 1.0));
    for (name, map) in [("plate", single), ("plates", double), ("bare", bare)] {
        let file = format!("{name}.png");
        let path = show(&file).unwrap_or_else(|| directory.path().join(&file));
        map.write(&path).unwrap();
        assert!(std::fs::read(path).unwrap().starts_with(b"\x89PNG"));
    }
}

/// The pixels themselves: blocks of whole pixels in the colours of the map, NaN grey, title and bar on white.
#[test]
fn field_pixels() {
    let (positions, values) = ([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]], [0.0, f64::NAN, 1.0]);
    let canvas =
        FieldMap::new().size(300).panel(Panel::new("", "", &positions, &values, 1.0)).canvas().unwrap();
    let row = 26 + 50;
    let colors = [[68, 1, 84], [190, 190, 190], [253, 231, 37]]; // viridis' published ends (matplotlib)
    for (block, color) in colors.iter().enumerate() {
        for x in [0, 50, 99] {
            let found = canvas.get(26 + 100 * block + x, row);
            assert!(found.iter().zip(color).all(|(a, b)| a.abs_diff(*b) <= 3), "{block} {x}: {found:?}");
        }
    }
    assert_eq!((canvas.get(25, row), canvas.get(26 + 300, row)), ([255; 3], [255; 3]));
}

/// A floor at y = 0 below three particles: a rim of 18 pixels, grey under a black line.
#[test]
fn rigid_bodies_beside_particles() {
    let (positions, values) = ([[0.5, 0.5], [1.5, 0.5], [2.5, 0.5]], [0.0, 0.5, 1.0]);
    let floor = |place: [f64; 2]| place[1];
    let panel = Panel::new("", "", &positions, &values, 1.0).rigid(&floor);
    let canvas = FieldMap::new().size(300).panel(panel).canvas().unwrap();
    let below = 26 + 18 + 100;
    let grey = [222; 3];
    let found = [0, 1, 17, 18].map(|down| canvas.get(26 + 18 + 150, below + down));
    assert_eq!(found, [[0; 3], grey, grey, [255; 3]]);
    // no particle beside the first, above the floor
    assert_eq!(canvas.get(26 + 9, below - 50), [255; 3]);
}

#[test]
fn fields_that_cannot_be_drawn() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("f.png");
    let positions = [[0.0, 0.0], [1.0, 0.0]];
    let panel = |values: &'static [f64], spacing| Panel::new("p", "q", &positions, values, spacing);
    for (panel, part) in [
        (panel(&[1.0], 1.0), "1 values for 2 particles"),
        (panel(&[1.0, 2.0], 0.0), "spacing 0"),
        (panel(&[1.0, 2.0], f64::NAN), "spacing NaN"),
        (panel(&[1.0, 2.0], 1.0).range(2.0, 1.0), "range 2 … 1"),
        (panel(&[-1e308, 1e308], 1.0), "is not valid"),
        (panel(&[1.0, 2.0], 1.0).bridge(f64::NAN), "bridge NaN"),
        (Panel::new("p", "q", &[], &[], 1.0), "no particles"),
        (Panel::new("p", "q", &[[f64::NAN, 0.0]], &[1.0], 1.0), "not finite"),
    ] {
        let error = FieldMap::new().panel(panel).write(&path).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
    assert!(FieldMap::new().write(&path).unwrap_err().to_string().contains("no panel"));
    let map = FieldMap::new().panel(panel(&[f64::INFINITY, 2.0], 1.0));
    map.write(&path).unwrap();
    assert!(map.clone().lengths("mm", 0.0).write(&path).unwrap_err().to_string().contains("factor 0"));
    assert!(map.write(directory.path().join("f.svg")).unwrap_err().to_string().contains(".png"));
}
