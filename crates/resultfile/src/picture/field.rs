//! Fields on particles in the plane, as coloured blocks with a colour bar.

use polycore::numerics::range;
use std::fmt;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;

use rayon::prelude::*;

use super::axis::{labels, ticks};
use super::bar::{ColorBar, LABEL, LINE, TICK, TICK_LENGTH};
use super::blocks::ParticleBlocks;
use super::canvas::{BLACK, Canvas, LabelAnchor, Text};
use super::color::{ColorMap, MISSING, RIGID};
use super::particles::{PixelWindow, Raster};
use super::picture_error;
use polycore::Error;
use polycore::file::atomic_write;

const TITLE: u32 = 28;
const MARGIN: usize = 26;
/// Width of the rim around particles beside rigid bodies, over the longer side of the field.
const RIM: f64 = 0.06;
/// More pixels than this are a mistake.
const LARGEST_PICTURE: usize = 200_000_000;

/// Fields side by side in one PNG.
///
/// ```
/// # use resultfile::picture::{FieldMap, Panel};
/// let positions: Vec<[f64; 2]> = (0..100).map(|i| [f64::from(i % 10), f64::from(i / 10)]).collect();
/// let stress: Vec<f64> = positions.iter().map(|[x, y]| x * y).collect();
/// let map = FieldMap::new()
///     .lengths("mm", 1e-3)
///     .panel(Panel::new("Tension", "σ₁₁ (MPa)", &positions, &stress, 1.0).range(0.0, 60.0));
/// # let directory = tempfile::tempdir().unwrap();
/// map.write(directory.path().join("stress.png"))?;
/// # Ok::<(), polycore::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct FieldMap<'a> {
    panels: Vec<Panel<'a>>,
    columns: Option<usize>,
    size: usize,
    lengths: Option<(String, f64)>,
    names: [&'a str; 2],
    least_width: usize,
}

/// A field: positions of the particles (deformed or not) and their values.
#[derive(Clone, Debug)]
pub struct Panel<'a> {
    title: String,
    label: String,
    positions: &'a [[f64; 2]],
    values: &'a [f64],
    spacing: f64,
    reference: Option<&'a [[f64; 2]]>,
    bridge: f64,
    colors: ColorMap,
    range: Option<(f64, f64)>,
    rigid: Option<RigidOutline<'a>>,
    within: Option<[[f64; 2]; 2]>,
}

/// Height above rigid bodies at a place, negative within them.
#[derive(Clone, Copy)]
struct RigidOutline<'a>(&'a (dyn Fn([f64; 2]) -> f64 + Sync));

impl fmt::Debug for RigidOutline<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("RigidOutline")
    }
}

impl<'a> Panel<'a> {
    /// `label` stands beside the colour bar, with its unit; `spacing` is the lattice spacing in the unit of
    /// the positions. Particles whose value is NaN are grey.
    pub fn new(title: &str, label: &str, positions: &'a [[f64; 2]], values: &'a [f64], spacing: f64) -> Self {
        Self {
            title: title.to_owned(),
            label: label.to_owned(),
            positions,
            values,
            spacing,
            reference: None,
            bridge: 1.5,
            colors: ColorMap::Viridis,
            range: None,
            rigid: None,
            within: None,
        }
    }

    /// Other colours.
    pub fn colors(mut self, colors: ColorMap) -> Self {
        self.colors = colors;
        self
    }

    /// Values outside take the colours of the ends, and the bar gets a point there; by default all values are
    /// inside.
    pub fn range(mut self, low: f64, high: f64) -> Self {
        self.range = Some((low, high));
        self
    }

    /// Sets the positions before the deformation: particles with neighbours one spacing away along the axes
    /// are drawn as deformed cells, the others as upright blocks.
    pub fn reference(mut self, positions: &'a [[f64; 2]]) -> Self {
        self.reference = Some(positions);
        self
    }

    /// Neighbours up to this many spacings apart are drawn without a gap; farther apart there is a crack. By
    /// default 1.5; larger stretches need more.
    pub fn bridge(mut self, spacings: f64) -> Self {
        self.bridge = spacings;
        self
    }

    /// Draws rigid bodies beside the particles in grey: where `height`, in the unit of the positions, is
    /// negative.
    pub fn rigid(mut self, height: &'a (dyn Fn([f64; 2]) -> f64 + Sync)) -> Self {
        self.rigid = Some(RigidOutline(height));
        self
    }

    /// Shows the plane around particles at two corners instead of that around all particles.
    pub fn within(mut self, corners: [[f64; 2]; 2]) -> Self {
        self.within = Some(corners);
        self
    }

    fn outline(&self) -> ParticleBlocks {
        ParticleBlocks::new(self.positions, self.reference, self.spacing, self.bridge)
    }

    /// Returns whether it shows the same particles in the same places.
    fn has_outline_of(&self, other: &Self) -> bool {
        let same = |a: &[[f64; 2]], b: &[[f64; 2]]| std::ptr::eq(a, b);
        let reference = match (self.reference, other.reference) {
            (Some(a), Some(b)) => same(a, b),
            (a, b) => a.is_none() && b.is_none(),
        };
        reference
            && same(self.positions, other.positions)
            && (self.spacing, self.bridge) == (other.spacing, other.bridge)
    }

    fn limits(&self) -> (f64, f64) {
        if let Some(range) = self.range {
            return range;
        }
        let finite = self.values.iter().copied().filter(|value| value.is_finite());
        let [low, high] = range(finite);
        let (low, high) = match self.colors {
            _ if low > high => (0.0, 1.0),
            ColorMap::Diverging => (-low.abs().max(high.abs()), low.abs().max(high.abs())),
            ColorMap::Viridis | ColorMap::Inferno => (low, high),
        };
        // a constant field still needs a bar
        let least = 1e-12 * low.abs().max(high.abs());
        if high - low > least {
            (low, high)
        } else {
            let half = if low == 0.0 { 1.0 } else { 0.05 * low.abs() };
            (low - half, high + half)
        }
    }

    fn check(&self) -> Result<(), String> {
        let panel = &self.title;
        if self.positions.len() != self.values.len() {
            let (positions, values) = (self.positions.len(), self.values.len());
            return Err(format!("panel `{panel}`: {values} values for {positions} particles"));
        }
        if self.positions.is_empty() {
            return Err(format!("panel `{panel}`: there are no particles"));
        }
        if let Some(reference) = self.reference
            && (reference.len() != self.positions.len()
                || reference.as_flattened().iter().any(|x| !x.is_finite()))
        {
            return Err(format!(
                "panel `{panel}`: {} reference positions for {} particles, or one is not finite",
                reference.len(),
                self.positions.len()
            ));
        }
        if !(self.spacing > 0.0 && self.spacing.is_finite()) {
            return Err(format!("panel `{panel}`: spacing {} must be positive", self.spacing));
        }
        if !(1.0..=100.0).contains(&self.bridge) {
            return Err(format!("panel `{panel}`: bridge {} must lie between 1 and 100", self.bridge));
        }
        match self.limits() {
            (low, high) if low < high && low.is_finite() && high.is_finite() && (high - low).is_finite() => {
                Ok(())
            }
            (low, high) => Err(format!("panel `{panel}`: the range {low} … {high} is not valid")),
        }
    }
}

impl Default for FieldMap<'_> {
    fn default() -> Self {
        Self::new()
    }
}

impl<'a> FieldMap<'a> {
    /// No panel yet.
    pub fn new() -> Self {
        Self {
            panels: Vec::new(),
            columns: None,
            size: 720,
            lengths: None,
            names: ["x", "y"],
            least_width: 0,
        }
    }

    /// Adds a field.
    pub fn panel(mut self, panel: Panel<'a>) -> Self {
        self.panels.push(panel);
        self
    }

    /// Starts a new row after so many panels; by default all stand in one row.
    pub fn columns(mut self, columns: usize) -> Self {
        self.columns = Some(columns.max(1));
        self
    }

    /// About how many pixels the longer side of a field takes; 720 by default.
    pub fn size(mut self, pixels: usize) -> Self {
        self.size = pixels.clamp(50, 10_000);
        self
    }

    /// Draws axes: positions are divided by `factor` and given in `unit`. `("mm", 1e-3)` for positions in
    /// metres.
    pub fn lengths(mut self, unit: &str, factor: f64) -> Self {
        self.lengths = Some((unit.to_owned(), factor));
        self
    }

    /// Sets the names of the axes; `x` and `y` by default.
    pub fn axes(mut self, names: [&'a str; 2]) -> Self {
        self.names = names;
        self
    }

    /// Leaves room for a title of so many characters, for pictures of one width.
    pub fn room_for(mut self, characters: usize) -> Self {
        self.least_width = characters * TITLE as usize * 2 / 3 + 2 * MARGIN;
        self
    }

    /// Writes a `.png`, whole or not at all.
    ///
    /// # Errors
    /// [`Error::Data`] for another extension, without panels, for arrays of different lengths, positions that
    /// are not finite or too far apart, invalid spacings and ranges; [`Error::Io`].
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        let path = path.as_ref();
        let fail = |reason: String| picture_error(path, reason);
        if path.extension().is_none_or(|extension| extension != "png") {
            return Err(fail("the file name must end in .png".to_owned()));
        }
        let bytes = self.canvas().and_then(|canvas| canvas.encode()).map_err(fail)?;
        atomic_write(path, |file| file.write_all(&bytes))
    }

    pub(super) fn canvas(&self) -> Result<Canvas, String> {
        if self.panels.is_empty() {
            return Err("there is no panel".to_owned());
        }
        let mut drawn = Vec::with_capacity(self.panels.len());
        // panels of the same particles share their outlines
        let mut last: Option<(&Panel<'_>, Arc<ParticleBlocks>)> = None;
        for panels in self.panels.chunks(rayon::current_num_threads()) {
            let mut outlined = Vec::with_capacity(panels.len());
            for panel in panels {
                panel.check()?;
                let around = panel.within.as_ref().map_or(panel.positions, |corners| &corners[..]);
                let window =
                    PixelWindow::around(around, panel.spacing, self.size as f64).ok_or_else(|| {
                        format!("panel `{}`: positions are not finite or too far apart", panel.title)
                    })?;
                let window = if panel.rigid.is_some() { window.widened(RIM) } else { window };
                let kept = last.take().filter(|(other, _)| panel.has_outline_of(other));
                let blocks = kept.map_or_else(|| Arc::new(panel.outline()), |(_, blocks)| blocks);
                outlined.push((panel, window, Arc::clone(&blocks)));
                last = Some((panel, blocks));
            }
            let draw = |(panel, window, blocks): (_, PixelWindow, Arc<ParticleBlocks>)| {
                self.draw(panel, &window, &blocks)
            };
            drawn.extend(outlined.into_par_iter().map(draw).collect::<Result<Vec<Canvas>, String>>()?);
        }
        let columns = self.columns.unwrap_or(drawn.len()).min(drawn.len());
        let rows = drawn.len().div_ceil(columns);
        let size_of = |index: usize, row: bool| {
            let members = drawn.iter().enumerate();
            let mine =
                members.filter(|(at, _)| if row { at / columns == index } else { at % columns == index });
            mine.map(|(_, canvas)| if row { canvas.height } else { canvas.width }).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..columns).map(|column| size_of(column, false)).collect();
        let heights: Vec<usize> = (0..rows).map(|row| size_of(row, true)).collect();
        let mut canvas = sheet(widths.iter().sum(), heights.iter().sum())?;
        for (index, panel) in drawn.iter().enumerate() {
            let (row, column) = (index / columns, index % columns);
            canvas.paste(panel, widths[..column].iter().sum(), heights[..row].iter().sum());
        }
        Ok(canvas)
    }

    fn draw(
        &self,
        panel: &Panel<'_>,
        window: &PixelWindow,
        blocks: &ParticleBlocks,
    ) -> Result<Canvas, String> {
        let raster = window.draw(panel.positions, panel.values, blocks);
        let (low, high) = panel.limits();
        let beyond =
            [panel.values.iter().any(|value| *value < low), panel.values.iter().any(|value| *value > high)];
        let bar = ColorBar::new(&panel.label, (low, high), beyond, raster.height.max(220))?;
        let axes = self.lengths.as_ref().map(|lengths| Axes::new(window, &raster, lengths, self.names));
        let axes = axes.transpose()?;
        let title = Text::new(&panel.title, TITLE)?;
        let head = MARGIN + if panel.title.is_empty() { 0 } else { TITLE as usize * 3 / 2 + 10 };
        let left = MARGIN + axes.as_ref().map_or(0, |axes| axes.left);
        let bottom = MARGIN + axes.as_ref().map_or(0, |axes| axes.bottom);
        let body = raster.width + 2 * MARGIN + bar.width;
        let width = (left + body).max(title.width + 2 * MARGIN).max(self.least_width);
        let mut canvas = sheet(width, head + bar.height.max(raster.height) + bottom)?;
        let (x, y) = (left as isize, head as isize);
        for (at, value) in raster.values.iter().enumerate() {
            if let Some(value) = value {
                let (column, row) = (at % raster.width, at / raster.width);
                let color = if value.is_nan() {
                    MISSING
                } else {
                    panel.colors.color_at((value - low) / (high - low))
                };
                canvas.set(x + column as isize, y + row as isize, color);
            }
        }
        if let Some(RigidOutline(height)) = panel.rigid {
            let place = |at: usize| (at % raster.width, at / raster.width);
            let within = |at: usize| {
                let (column, row) = place(at);
                height(window.pixel_centre(column, row)) < 0.0
            };
            let inside: Vec<bool> = (0..raster.values.len()).map(within).collect();
            for at in (0..inside.len()).filter(|&at| inside[at] && raster.values[at].is_none()) {
                let (column, row) = place(at);
                let mut around = (row.saturating_sub(1)..(row + 2).min(raster.height)).flat_map(|row| {
                    let columns = column.saturating_sub(1)..(column + 2).min(raster.width);
                    columns.map(move |column| row * raster.width + column)
                });
                let color = if around.all(|next| inside[next]) { RIGID } else { BLACK };
                canvas.set(x + column as isize, y + row as isize, color);
            }
        }
        if let Some(axes) = &axes {
            axes.draw(&mut canvas, x, y, raster.width as isize, raster.height as isize);
        }
        bar.draw(&mut canvas, x + (raster.width + MARGIN) as isize, y, panel.colors);
        if !panel.title.is_empty() {
            let middle = x + raster.width as isize / 2;
            let half = title.width as isize / 2;
            let middle = middle.clamp(half + 4, (width as isize - half - 4).max(half + 4));
            canvas.text(middle, (MARGIN + TITLE as usize * 3 / 4) as isize, &title, LabelAnchor::Center);
        }
        Ok(canvas)
    }
}

fn sheet(width: usize, height: usize) -> Result<Canvas, String> {
    match width.checked_mul(height) {
        Some(pixels) if pixels <= LARGEST_PICTURE => Ok(Canvas::new(width, height)),
        _ => Err(format!("{width} × {height} pixels are too many")),
    }
}

/// A frame around the field with ticks in a unit of length.
struct Axes {
    /// Pixel from the left, or from the top, and its label.
    ticks: [Vec<(isize, Text)>; 2],
    names: [Text; 2],
    left: usize,
    bottom: usize,
}

impl Axes {
    fn new(
        window: &PixelWindow,
        raster: &Raster,
        (unit, factor): &(String, f64),
        names: [&str; 2],
    ) -> Result<Self, String> {
        if !(factor.is_finite() && *factor > 0.0) {
            return Err(format!("the factor {factor} of the unit of length must be positive"));
        }
        let sizes = [raster.width, raster.height];
        let along = |axis: usize| -> Result<Vec<(isize, Text)>, String> {
            let ends = [window.low[axis], window.high[axis]].map(|end| end / factor);
            // a narrow field, too, shows its size: two ticks at least
            let most = (sizes[axis] / 110).clamp(2, 9);
            let tried = (most..most + 5).map(|most| ticks(ends[0], ends[1], most));
            let positions =
                tried.reduce(|kept, next| if kept.len() < 2 { next } else { kept }).unwrap_or_default();
            let texts = labels(&positions).into_iter().map(|text| Text::new(&text, TICK));
            let pixel = |tick: f64| {
                let tick = tick * factor;
                let length = if axis == 0 { tick - window.low[0] } else { window.high[1] - tick };
                (length * window.scale).round() as isize
            };
            let all: Vec<(isize, Text)> = positions
                .iter()
                .zip(texts)
                .map(|(tick, text)| Ok((pixel(*tick), text?)))
                .collect::<Result<_, String>>()?;
            // labels do not touch: every so many of equidistant ticks
            let needed =
                if axis == 0 { all.iter().map(|(_, text)| text.width).max() } else { Some(TICK as usize) };
            let needed = needed.unwrap_or(0) + TICK as usize / 3;
            let gap = all.windows(2).map(|pair| pair[0].0.abs_diff(pair[1].0)).min().unwrap_or(needed).max(1);
            Ok(all.into_iter().step_by(needed.div_ceil(gap)).collect())
        };
        let ticks = [along(0)?, along(1)?];
        let [across, up] = names.map(|name| Text::new(&format!("{name} ({unit})"), LABEL));
        let names = [across?, up?];
        let widest = ticks[1].iter().map(|(_, text)| text.width).max().unwrap_or(0);
        let line = |size: u32| size as usize * 3 / 2;
        let left = widest + TICK_LENGTH as usize + 12 + line(LABEL);
        let bottom = line(TICK) + TICK_LENGTH as usize + 2 + line(LABEL);
        Ok(Self { ticks, names, left, bottom })
    }

    fn draw(&self, canvas: &mut Canvas, x: isize, y: isize, width: isize, height: isize) {
        canvas.frame(x, y, width, height, LINE, BLACK);
        let base = y + height + LINE;
        for (at, text) in &self.ticks[0] {
            canvas.rectangle(x + at - LINE / 2, base, LINE, TICK_LENGTH, BLACK);
            canvas.text(x + at, base + TICK_LENGTH + TICK as isize * 3 / 4 + 2, text, LabelAnchor::Center);
        }
        for (at, text) in &self.ticks[1] {
            canvas.rectangle(x - LINE - TICK_LENGTH, y + at - LINE / 2, TICK_LENGTH, LINE, BLACK);
            canvas.text(x - LINE - TICK_LENGTH - 6, y + at, text, LabelAnchor::Right);
        }
        let under = base + TICK_LENGTH + TICK as isize * 3 / 2 + LABEL as isize * 3 / 4 + 2;
        canvas.text(x + width / 2, under, &self.names[0], LabelAnchor::Center);
        let beside = x - self.left as isize + LABEL as isize * 3 / 4;
        canvas.text(beside, y + height / 2, &self.names[1], LabelAnchor::Upwards);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A slender specimen, too, tells its size: two labels at least, none over another.
    #[test]
    fn narrow_fields_have_ticks() {
        for (half, width) in [(9.0, 70), (10.5, 62), (10.5, 100), (40.0, 240), (0.9, 120), (1e5, 120)] {
            let window =
                PixelWindow { low: [-half, 0.0], high: [half, half], scale: width as f64 / (2.0 * half) };
            let raster = Raster { width, height: width / 2, values: Vec::new() };
            let axes = Axes::new(&window, &raster, &("mm".to_owned(), 1.0), ["x", "y"]).unwrap();
            let across = &axes.ticks[0];
            assert!(across.len() >= 2, "{half} {width}: {}", across.len());
            for pair in across.windows(2) {
                let labels = (pair[0].1.width + pair[1].1.width) / 2;
                assert!(pair[0].0.abs_diff(pair[1].0) > labels, "{half} {width}");
            }
        }
    }
}
