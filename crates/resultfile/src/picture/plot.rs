//! The drawing of a line plot from lines, texts and markers.

use std::io::Write;
use std::path::Path;

use kuva::backend::raster::RasterBackend;
use kuva::backend::svg::SvgBackend;
use kuva::render::color::Color;
use kuva::render::render::{PathData, Primitive, Scene, TextAnchor};

use super::axis::PlotAxis;
use super::canvas::{Canvas, LabelAnchor, Text};
use super::line::{LegendPlace, LinePlot, Series, SeriesStyle};
use super::picture_error;
use polycore::Error;
use polycore::file::atomic_write;

/// Pixels of a PNG for each unit of the layout.
const PIXELS: f64 = 2.0;
/// Okabe & Ito's colours, told apart by the colour-blind (<https://jfly.uni-koeln.de/color/>); black is for
/// references.
const COLORS: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f7f7f"];
const GRID: &str = "#dddddd";
const TITLE: u32 = 15;
const LABEL: u32 = 13;
const TICK: u32 = 12;
const LINE: f64 = 1.8;
const MARKER: f64 = 3.8;
/// Lengths of dashes and of the gaps between them.
const DASH: [f64; 2] = [7.0, 4.0];
const LEGEND_ROW: f64 = 18.0;
const LEGEND_SAMPLE: f64 = 24.0;
const PADDING: f64 = 8.0;

/// The label of the y axis, which PNG and SVG draw in their own ways.
pub(super) struct UprightLabel {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) size: u32,
    pub(super) text: String,
}

impl UprightLabel {
    pub(super) fn primitive(&self) -> Primitive {
        // x is the middle of the letters, SVG wants their base line
        let x = self.x + 0.365 * f64::from(self.size);
        text(x, self.y, self.size, TextAnchor::Middle, &self.text, Some(-90.0))
    }
}

impl LinePlot {
    /// Writes a `.png` or `.svg`, whole or not at all.
    ///
    /// # Errors
    /// [`Error::Data`] for another extension, for nothing to draw, for infinite numbers and for numbers ≤ 0
    /// on a logarithmic axis; [`Error::Io`].
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        let path = path.as_ref();
        self.check().map_err(|reason| picture_error(path, reason))?;
        let bytes = match path.extension().and_then(|extension| extension.to_str()) {
            Some("svg") => self.svg().map_err(|reason| picture_error(path, reason))?,
            Some("png") => self.png().map_err(|reason| picture_error(path, reason))?,
            _ => return Err(picture_error(path, "the file name must end in .png or .svg")),
        };
        atomic_write(path, |file| file.write_all(&bytes))
    }

    fn svg(&self) -> Result<Vec<u8>, String> {
        let (mut scene, label) = scene(self)?;
        scene.add(label.primitive());
        Ok(SvgBackend::new().render_scene(&scene).into_bytes())
    }

    fn png(&self) -> Result<Vec<u8>, String> {
        let (scene, label) = scene(self)?;
        let mut canvas =
            Canvas::decode(&RasterBackend::new().with_scale(PIXELS as f32).render_scene(&scene)?)?;
        // the raster back end turns letters pixel by pixel; a quarter turn of ours loses nothing
        let text = Text::new(&label.text, (f64::from(label.size) * PIXELS) as u32)?;
        let [x, y] = [label.x, label.y].map(|at| (at * PIXELS).round() as isize);
        canvas.text(x, y, &text, LabelAnchor::Upwards);
        canvas.encode()
    }
}

/// Draws all but the label of the y axis.
fn scene(plot: &LinePlot) -> Result<(Scene, UprightLabel), String> {
    let (width, height) = plot.size;
    let values = |pick: fn(&(f64, f64)) -> f64| plot.series.iter().flat_map(|s| s.runs()).flatten().map(pick);
    let x = PlotAxis::new(values(|point| point.0), plot.x_range, plot.log[0], (width / 90.0) as usize);
    let y = PlotAxis::new(values(|point| point.1), plot.y_range, plot.log[1], (height / 60.0) as usize);
    let mut legend = 0.0f64;
    let entries = plot.series.iter().filter(|series| !series.joined);
    for series in entries.clone() {
        legend = legend.max(measure(&series.name, TICK)?);
    }
    let named = legend > 0.0;
    let legend = [legend + LEGEND_SAMPLE + 3.0 * PADDING, entries.count() as f64 * LEGEND_ROW + PADDING];
    let mut widest = 0.0f64;
    for (_, label) in &y.ticks {
        widest = widest.max(measure(label, TICK)?);
    }
    let line = |size: u32, text: &str| if text.is_empty() { 0.0 } else { 1.5 * f64::from(size) };
    let outside = named && plot.legend == LegendPlace::Outside;
    let area = Area {
        left: 10.0 + line(LABEL, &plot.y_label) + widest + PADDING,
        top: 14.0 + line(TITLE, &plot.title) + if plot.title.is_empty() { 0.0 } else { PADDING },
        right: width - if outside { legend[0] + 2.0 * PADDING } else { 18.0 },
        bottom: height - 10.0 - line(LABEL, &plot.x_label) - 1.5 * f64::from(TICK) - PADDING / 2.0,
        x,
        y,
    };
    if area.right - area.left < 60.0 || area.bottom - area.top < 60.0 {
        return Err(format!("{width} × {height} pixels leave no room for the axes"));
    }
    let mut scene = Scene::new(width, height);
    scene.font_family = Some("DejaVu Sans, Verdana, Liberation Sans, Arial, sans-serif".to_owned());
    let middle = (area.left + area.right) / 2.0;
    scene.add(text(middle, 14.0 + f64::from(TITLE), TITLE, TextAnchor::Middle, &plot.title, None));
    area.axes(&mut scene);
    scene.add(text(middle, height - 12.0, LABEL, TextAnchor::Middle, &plot.x_label, None));
    area.curves(&mut scene, plot);
    if named {
        let corner = match plot.legend {
            LegendPlace::Outside => [area.right + PADDING, area.top],
            LegendPlace::TopRight => [area.right - legend[0] - PADDING, area.top + PADDING],
            LegendPlace::TopLeft => [area.left + PADDING, area.top + PADDING],
            LegendPlace::BottomRight => [area.right - legend[0] - PADDING, area.bottom - legend[1] - PADDING],
            LegendPlace::BottomLeft => [area.left + PADDING, area.bottom - legend[1] - PADDING],
        };
        key(&mut scene, plot, corner, legend);
    }
    let y = (area.top + area.bottom) / 2.0;
    let label =
        UprightLabel { x: 10.0 + 0.75 * f64::from(LABEL), y, size: LABEL, text: plot.y_label.clone() };
    Ok((scene, label))
}

/// The rectangle between the axes.
struct Area {
    left: f64,
    top: f64,
    right: f64,
    bottom: f64,
    x: PlotAxis,
    y: PlotAxis,
}

impl Area {
    fn place(&self, (x, y): (f64, f64)) -> (f64, f64) {
        // far outside is outside enough, and stays drawable
        let x = self.x.share(x).clamp(-10.0, 11.0);
        let y = self.y.share(y).clamp(-10.0, 11.0);
        (self.left + x * (self.right - self.left), self.bottom - y * (self.bottom - self.top))
    }

    fn axes(&self, scene: &mut Scene) {
        let (width, height) = (self.right - self.left, self.bottom - self.top);
        let column = |value: f64| self.left + self.x.share(value) * width;
        let row = |value: f64| self.bottom - self.y.share(value) * height;
        for (value, _) in &self.x.ticks {
            scene.add(line(column(*value), self.top, column(*value), self.bottom, GRID, 0.8));
        }
        for (value, _) in &self.y.ticks {
            scene.add(line(self.left, row(*value), self.right, row(*value), GRID, 0.8));
        }
        let major = self.x.ticks.iter().map(|(value, _)| (*value, 5.0));
        for (value, length) in major.chain(self.x.minor.iter().map(|value| (*value, 2.5))) {
            for (edge, inwards) in [(self.bottom, -length), (self.top, length)] {
                scene.add(line(column(value), edge, column(value), edge + inwards, "black", 0.8));
            }
        }
        let major = self.y.ticks.iter().map(|(value, _)| (*value, 5.0));
        for (value, length) in major.chain(self.y.minor.iter().map(|value| (*value, 2.5))) {
            for (edge, inwards) in [(self.left, length), (self.right, -length)] {
                scene.add(line(edge, row(value), edge + inwards, row(value), "black", 0.8));
            }
        }
        for (value, label) in &self.x.ticks {
            let y = self.bottom + PADDING / 2.0 + 1.1 * f64::from(TICK);
            scene.add(text(column(*value), y, TICK, TextAnchor::Middle, label, None));
        }
        for (value, label) in &self.y.ticks {
            let y = row(*value) + 0.365 * f64::from(TICK);
            scene.add(text(self.left - PADDING * 0.75, y, TICK, TextAnchor::End, label, None));
        }
        scene.add(Primitive::Rect {
            x: self.left,
            y: self.top,
            width,
            height,
            fill: Color::None,
            stroke: Some("black".into()),
            stroke_width: Some(1.0),
            opacity: None,
        });
    }

    fn curves(&self, scene: &mut Scene, plot: &LinePlot) {
        let (x, y, width, height) = (self.left, self.top, self.right - self.left, self.bottom - self.top);
        scene.add(Primitive::ClipStart { x, y, width, height, id: "area".to_owned() });
        for (series, (color, shape)) in plot.series.iter().zip(looks(plot)) {
            for run in series.runs() {
                let points: Vec<(f64, f64)> = run.iter().map(|point| self.place(*point)).collect();
                match series.style {
                    SeriesStyle::Reference => {
                        dashes(&points).into_iter().for_each(|dash| scene.add(polyline(dash, color, 1.4)));
                    }
                    SeriesStyle::Line | SeriesStyle::Both if points.len() > 1 => {
                        scene.add(polyline(points.clone(), color, LINE))
                    }
                    _ => {}
                }
                // a single point has no line
                if matches!(series.style, SeriesStyle::Markers | SeriesStyle::Both) || points.len() == 1 {
                    points.iter().for_each(|point| scene.add(marker(*point, shape, color)));
                }
            }
        }
        scene.add(Primitive::ClipEnd);
    }
}

/// The box with the names.
fn key(scene: &mut Scene, plot: &LinePlot, [x, y]: [f64; 2], [width, height]: [f64; 2]) {
    scene.add(Primitive::Rect {
        x,
        y,
        width,
        height,
        fill: "white".into(),
        stroke: Some("#999999".into()),
        stroke_width: Some(0.8),
        opacity: Some(0.9),
    });
    let entries = plot.series.iter().zip(looks(plot)).filter(|(series, _)| !series.joined);
    for (index, (series, (color, shape))) in entries.enumerate() {
        let row = y + PADDING / 2.0 + LEGEND_ROW * (index as f64 + 0.5);
        let ends = vec![(x + PADDING, row), (x + PADDING + LEGEND_SAMPLE, row)];
        let middle = (x + PADDING + LEGEND_SAMPLE / 2.0, row);
        match series.style {
            SeriesStyle::Reference => {
                dashes(&ends).into_iter().for_each(|dash| scene.add(polyline(dash, color, 1.4)))
            }
            SeriesStyle::Line | SeriesStyle::Both => scene.add(polyline(ends, color, LINE)),
            SeriesStyle::Markers => {}
        }
        if matches!(series.style, SeriesStyle::Markers | SeriesStyle::Both) {
            scene.add(marker(middle, shape, color));
        }
        let base = row + 0.365 * f64::from(TICK);
        scene.add(text(x + 2.0 * PADDING + LEGEND_SAMPLE, base, TICK, TextAnchor::Start, &series.name, None));
    }
}

/// Colour and shape of each series; references are black and do not count.
fn looks(plot: &LinePlot) -> Vec<(&'static str, usize)> {
    let mut colored = 0;
    let look = |series: &Series| {
        if series.style == SeriesStyle::Reference {
            return ("black", 0);
        }
        colored += usize::from(!series.joined || colored == 0);
        (COLORS[(colored - 1) % COLORS.len()], (colored - 1) % 5)
    };
    plot.series.iter().map(look).collect()
}

/// Cuts a polyline by its length, so that dashes do not depend on how densely it was sampled.
fn dashes(points: &[(f64, f64)]) -> Vec<Vec<(f64, f64)>> {
    let mut result = Vec::new();
    let Some(&first) = points.first() else { return result };
    let mut dash = vec![first];
    let (mut phase, mut left) = (0, DASH[0]);
    for pair in points.windows(2) {
        let (mut from, to) = (pair[0], pair[1]);
        loop {
            let (dx, dy) = (to.0 - from.0, to.1 - from.1);
            let length = dx.hypot(dy);
            if length <= left {
                left -= length;
                dash.push(to);
                break;
            }
            from = (from.0 + dx * left / length, from.1 + dy * left / length);
            dash.push(from);
            if phase == 0 {
                result.push(std::mem::take(&mut dash));
            }
            dash = vec![from];
            phase = 1 - phase;
            left = DASH[phase];
        }
    }
    if phase == 0 && dash.len() > 1 {
        result.push(dash);
    }
    result
}

fn marker((x, y): (f64, f64), shape: usize, color: &str) -> Primitive {
    let r = MARKER;
    let corners: &[(f64, f64)] = match shape {
        0 => {
            let (fill, none) = (color.into(), None);
            return Primitive::Circle {
                cx: x,
                cy: y,
                r,
                fill,
                fill_opacity: none,
                stroke: None,
                stroke_width: none,
            };
        }
        1 => &[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)],
        2 => &[(0.0, -1.2), (1.1, 0.8), (-1.1, 0.8)],
        3 => &[(0.0, -1.3), (1.3, 0.0), (0.0, 1.3), (-1.3, 0.0)],
        _ => &[(0.0, 1.2), (1.1, -0.8), (-1.1, -0.8)],
    };
    let at = |(index, (dx, dy)): (usize, &(f64, f64))| {
        format!("{} {:.3} {:.3} ", if index == 0 { 'M' } else { 'L' }, x + r * dx, y + r * dy)
    };
    let d = corners.iter().enumerate().map(at).collect::<String>() + "Z";
    Primitive::Path(Box::new(PathData {
        d,
        fill: Some(color.into()),
        stroke: color.into(),
        stroke_width: 0.5,
        opacity: None,
        stroke_dasharray: None,
    }))
}

fn polyline(points: Vec<(f64, f64)>, color: &str, stroke_width: f64) -> Primitive {
    Primitive::PolyLine { points, stroke: color.into(), stroke_width, stroke_dasharray: None }
}

fn line(x1: f64, y1: f64, x2: f64, y2: f64, color: &str, stroke_width: f64) -> Primitive {
    Primitive::Line { x1, y1, x2, y2, stroke: color.into(), stroke_width, stroke_dasharray: None }
}

fn text(x: f64, y: f64, size: u32, anchor: TextAnchor, content: &str, rotate: Option<f64>) -> Primitive {
    Primitive::Text { x, y, content: content.to_owned(), size, anchor, rotate, bold: false, color: None }
}

fn measure(content: &str, size: u32) -> Result<f64, String> {
    Ok(Text::new(content, size)?.width as f64)
}
