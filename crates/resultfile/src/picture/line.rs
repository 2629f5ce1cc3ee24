//! Curves over two axes.

/// A plot of several curves.
///
/// ```
/// # use resultfile::picture::{LinePlot, Series};
/// let x = [0.0, 1.0, 2.0];
/// let plot = LinePlot::new("Stress along the ligament")
///     .axes("x / a", "stress / applied stress")
///     .series(Series::line("Hardy, m = 3", &x, &[3.0, 1.3, 1.1]))
///     .series(Series::reference("Kirsch", &x, &[3.0, 1.2, 1.1]));
/// # let directory = tempfile::tempdir().unwrap();
/// plot.write(directory.path().join("profile.svg"))?;
/// # Ok::<(), polycore::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct LinePlot {
    pub(super) title: String,
    pub(super) x_label: String,
    pub(super) y_label: String,
    pub(super) log: [bool; 2],
    pub(super) x_range: Option<(f64, f64)>,
    pub(super) y_range: Option<(f64, f64)>,
    pub(super) legend: LegendPlace,
    pub(super) size: (f64, f64),
    pub(super) series: Vec<Series>,
}

/// Position of the legend.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum LegendPlace {
    /// Right of the axes, never over the data.
    #[default]
    Outside,
    TopRight,
    TopLeft,
    BottomRight,
    BottomLeft,
}

/// A named curve.
#[derive(Clone, Debug)]
pub struct Series {
    pub(super) name: String,
    points: Vec<(f64, f64)>,
    pub(super) style: SeriesStyle,
    /// True for a series that belongs to the one before it.
    pub(super) joined: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum SeriesStyle {
    Line,
    Markers,
    Both,
    Reference,
}

impl Series {
    /// Joined by a line. A NaN interrupts it.
    pub fn line(name: &str, x: &[f64], y: &[f64]) -> Self {
        Self::new(name, x, y, SeriesStyle::Line)
    }

    /// Single points: measurements.
    pub fn markers(name: &str, x: &[f64], y: &[f64]) -> Self {
        Self::new(name, x, y, SeriesStyle::Markers)
    }

    /// Points joined by a line: convergence studies.
    pub fn marked_line(name: &str, x: &[f64], y: &[f64]) -> Self {
        Self::new(name, x, y, SeriesStyle::Both)
    }

    /// Returns a dashed black line, a reference for the others.
    pub fn reference(name: &str, x: &[f64], y: &[f64]) -> Self {
        Self::new(name, x, y, SeriesStyle::Reference)
    }

    fn new(name: &str, x: &[f64], y: &[f64], style: SeriesStyle) -> Self {
        // a missing partner is as undefined as a NaN
        let count = x.len().max(y.len());
        let at = |values: &[f64], index: usize| values.get(index).copied().unwrap_or(f64::NAN);
        let points = (0..count).map(|index| (at(x, index), at(y, index))).collect();
        Self { name: name.to_owned(), points, style, joined: false }
    }

    /// Returns vertical bars from `low` to `high`: errors of measurements.
    pub fn bars(x: &[f64], low: &[f64], high: &[f64]) -> Self {
        let ends = |((x, low), high): ((&f64, &f64), &f64)| [(*x, *low), (*x, *high), (f64::NAN, f64::NAN)];
        let points = x.iter().zip(low).zip(high).flat_map(ends).collect();
        Self { name: String::new(), points, style: SeriesStyle::Line, joined: false }
    }

    /// Gives a series the colour and the name of the series before it.
    #[must_use]
    pub fn joined(mut self) -> Self {
        self.joined = true;
        self
    }

    /// Returns the runs between undefined points.
    pub(super) fn runs(&self) -> impl Iterator<Item = &[(f64, f64)]> {
        self.points.split(|(x, y)| x.is_nan() || y.is_nan()).filter(|run| !run.is_empty())
    }
}

impl LinePlot {
    /// Returns a plot with linear axes and no series yet.
    pub fn new(title: &str) -> Self {
        Self {
            title: title.to_owned(),
            x_label: String::new(),
            y_label: String::new(),
            log: [false; 2],
            x_range: None,
            y_range: None,
            legend: LegendPlace::Outside,
            size: (640.0, 420.0),
            series: Vec::new(),
        }
    }

    /// Labels of the axes, with their units.
    pub fn axes(mut self, x: &str, y: &str) -> Self {
        (self.x_label, self.y_label) = (x.to_owned(), y.to_owned());
        self
    }

    /// Makes the x axis logarithmic.
    pub fn log_x(mut self) -> Self {
        self.log[0] = true;
        self
    }

    /// Makes the y axis logarithmic.
    pub fn log_y(mut self) -> Self {
        self.log[1] = true;
        self
    }

    /// Shows this part of the x axis instead of all data.
    pub fn x_range(mut self, low: f64, high: f64) -> Self {
        self.x_range = Some((low, high));
        self
    }

    /// Shows this part of the y axis instead of all data.
    pub fn y_range(mut self, low: f64, high: f64) -> Self {
        self.y_range = Some((low, high));
        self
    }

    /// Moves the legend into a free corner.
    pub fn legend(mut self, place: LegendPlace) -> Self {
        self.legend = place;
        self
    }

    /// Width and height of an SVG in pixels; a PNG has twice as many.
    pub fn size(mut self, width: f64, height: f64) -> Self {
        self.size = (width, height);
        self
    }

    /// Adds a curve.
    pub fn series(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    pub(super) fn check(&self) -> Result<(), String> {
        let mut any = false;
        for series in &self.series {
            for &(x, y) in series.runs().flatten() {
                any = true;
                let undrawable = |value: f64, log: bool| {
                    value.is_infinite() || value.abs() > 1e300 || (log && value <= 0.0)
                };
                if undrawable(x, self.log[0]) || undrawable(y, self.log[1]) {
                    return Err(format!("({x}, {y}) of `{}` cannot be drawn on these axes", series.name));
                }
            }
        }
        for (range, log) in [(self.x_range, self.log[0]), (self.y_range, self.log[1])] {
            if let Some((low, high)) = range
                && !(low < high && low.is_finite() && high.is_finite() && !(log && low <= 0.0))
            {
                return Err(format!("the axis range {low} … {high} is not valid"));
            }
        }
        if any { Ok(()) } else { Err("there is nothing to draw".to_owned()) }
    }
}
