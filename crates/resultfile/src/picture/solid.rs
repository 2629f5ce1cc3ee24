//! Pictures of solids: shaded surfaces with the colours of a field, in parallel projection with equal axes.

use std::borrow::Cow;
use std::f64::consts::{PI, TAU};
use std::io::Write;
use std::path::Path;

use super::axis::labels;
use super::bar::{ColorBar, TICK};
use super::canvas::{Canvas, Color, LabelAnchor, Text};
use super::film::{FilmPace, film};
use super::picture_error;
use super::shade::{Camera, Sight};
use super::skin::{Skin, View};
use super::strips::Strip;
use polycore::Error;
use polycore::file::atomic_write;

const TITLE: u32 = 28;
const STAGE: u32 = 24;
const MARGIN: usize = 26;
/// Between panels, and from a panel to its bar.
const GAP: usize = 30;
/// A line with the title of a stage.
const LINE: usize = 40;
/// A colour bar at least, and at most.
const LEAST_BAR: usize = 240;
const MOST_BAR: usize = 520;
/// Largest length of an arm of the axes, and distance of its letter from the end, pixels.
const ARM: f64 = 90.0;
const LETTER: f64 = 15.0;
const COLORS: [Color; 3] = [[190, 40, 40], [30, 130, 50], [40, 70, 190]];
/// More pixels than this are a mistake.
const LARGEST: f64 = 1e8;

/// Solids with one or two fields, under common colour bars and at one scale: stages beside one another, or
/// one after another as an animation.
///
/// ```
/// # use resultfile::picture::{ColorMap, Corner, Skin, Solids, Strip, View};
/// let mut skin = Skin::new(None);
/// let corner = |x: f64, y: f64| Corner { at: [x, y, x * y], values: [x + y, f64::NAN] };
/// skin.face(&[corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)]);
/// let solids = Solids {
///     title: "A warped square".into(),
///     bounds: [[0.0; 3], [1.0; 3]],
///     unit: ("m".into(), 1.0),
///     view: View::default(),
///     fields: vec![Strip { label: "T [°C]".into(), range: (0.0, 2.0), colors: ColorMap::Inferno }],
/// };
/// # let directory = tempfile::tempdir().unwrap();
/// # let out = directory.path();
/// solids.write(out.join("solid.png"), 1, |_| Ok((String::new(), skin.clone())))?;
/// solids.turn(out.join("turntable.png"), 4, 0.2, &(String::new(), skin))?;
/// # Ok::<(), polycore::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Solids {
    /// Above everything.
    pub title: String,
    /// Lower and upper corner of a box around all that is shown.
    pub bounds: [[f64; 3]; 2],
    /// Unit of length and its size.
    pub unit: (String, f64),
    /// The viewer.
    pub view: View,
    /// The fields, one or two.
    pub fields: Vec<Strip>,
}

/// A title and a surface.
type SolidStage = (String, Skin);

/// Sizes and places of all parts of a picture, pixels.
struct SolidLayout {
    camera: Camera,
    /// Pixels of a panel.
    panel: [usize; 2],
    /// Stages in rows and fields in columns; else the reverse.
    stacked: bool,
    /// Upper left corner of the first panel, and distance of panels.
    origin: [usize; 2],
    step: [usize; 2],
    /// Colour bars, and their distance from the left side of a panel.
    bars: Vec<ColorBar>,
    bar: usize,
    size: [usize; 2],
    title: Text,
    /// The axes: length of an arm, origin, letters, and a caption with the length.
    arm: f64,
    root: [f64; 2],
    letters: Vec<Text>,
    caption: Text,
}

impl Solids {
    /// Writes stages beside one another into a `.png`, whole or not at all.
    ///
    /// # Errors
    /// [`Error::Data`] for no stage, no or more than two fields, invalid bounds, ranges and units; those of
    /// `stage`; [`Error::Io`].
    pub fn write(
        &self,
        path: impl AsRef<Path>,
        stages: usize,
        mut stage: impl FnMut(usize) -> Result<SolidStage, Error>,
    ) -> Result<(), Error> {
        let path = path.as_ref();
        let fail = |reason: String| picture_error(path, reason);
        let longest = if stages == 1 { 720.0 } else { 560.0 };
        let mut layout = self.layout(stages, &[self.view], longest).map_err(fail)?;
        let mut canvas = Canvas::new(layout.size[0], layout.size[1]);
        let mut beyond = vec![[false; 2]; self.fields.len()];
        for index in 0..stages {
            let seen = self.paint(&layout, self.view, index, &stage(index)?, &mut canvas).map_err(fail)?;
            beyond.iter_mut().zip(seen).for_each(|(all, one)| *all = [all[0] || one[0], all[1] || one[1]]);
        }
        for (bar, (strip, beyond)) in layout.bars.iter_mut().zip(self.fields.iter().zip(beyond)) {
            *bar = ColorBar::new(&strip.label, strip.range, beyond, bar.height).map_err(fail)?;
        }
        self.surround(&layout, &mut canvas);
        let bytes = canvas.encode().map_err(fail)?;
        atomic_write(path, |file| file.write_all(&bytes))
    }

    /// Writes frames one after another into an animated `.png`, a `.gif`, or, by `ffmpeg`, an `.mp4`. It
    /// rests on the last frame, and repeats without end but as MP4; viewers that know no animation show the
    /// first.
    ///
    /// # Errors
    /// As [`Self::write`]; for MP4 no `ffmpeg` on the PATH, or its message.
    pub fn animate(
        &self,
        path: impl AsRef<Path>,
        frames: usize,
        seconds: f64,
        mut frame: impl FnMut(usize) -> Result<SolidStage, Error>,
    ) -> Result<(), Error> {
        self.film(path.as_ref(), &vec![self.view; frames], (seconds, 20), |k| Ok(Cow::Owned(frame(k)?)))
    }

    /// Writes a full turn about z into an animated `.png`, from the view on.
    ///
    /// # Errors
    /// As [`Self::write`].
    pub fn turn(
        &self,
        path: impl AsRef<Path>,
        frames: usize,
        seconds: f64,
        stage: &SolidStage,
    ) -> Result<(), Error> {
        let View { azimuth, elevation } = self.view;
        let turned = |k: usize| View { azimuth: azimuth + TAU * k as f64 / frames as f64, elevation };
        let views: Vec<View> = (0..frames).map(turned).collect();
        self.film(path.as_ref(), &views, (seconds, 1), |_| Ok(Cow::Borrowed(stage)))
    }

    fn film<'s>(
        &self,
        path: &Path,
        views: &[View],
        (seconds, rest): (f64, u16),
        mut stage: impl FnMut(usize) -> Result<Cow<'s, SolidStage>, Error>,
    ) -> Result<(), Error> {
        let fail = |reason: String| picture_error(path, reason);
        let layout = self.layout(views.len().min(1), views, 520.0).map_err(fail)?;
        let mut empty = Canvas::new(layout.size[0], layout.size[1]);
        self.surround(&layout, &mut empty);
        let bytes = film(path, views.len(), FilmPace { seconds, rest }, |index| {
            let mut canvas = empty.clone();
            self.paint(&layout, views[index], 0, &*stage(index)?, &mut canvas).map_err(fail)?;
            Ok(canvas)
        })?;
        atomic_write(path, |file| file.write_all(&bytes))
    }

    /// Draws a stage of all fields, and the axes; returns whether visible values lie below, above the range
    /// of each field.
    fn paint(
        &self,
        layout: &SolidLayout,
        view: View,
        index: usize,
        (title, skin): &SolidStage,
        canvas: &mut Canvas,
    ) -> Result<Vec<[bool; 2]>, String> {
        let camera = Camera { axes: view.axes(), ..layout.camera };
        let sight = Sight::new(skin, camera, layout.panel);
        let title = Text::new(title, STAGE)?;
        let [x, y] = layout.origin.map(|x| x as isize);
        let place = |field: usize| {
            let [column, row] = if layout.stacked { [field, index] } else { [index, field] };
            [x + (column * layout.step[0]) as isize, y + (row * layout.step[1]) as isize]
        };
        let [x, y] = place(0);
        let above = y - LINE as isize / 2;
        if layout.stacked {
            canvas.text(x, above, &title, LabelAnchor::Left);
        } else {
            canvas.text(x + layout.panel[0] as isize / 2, above, &title, LabelAnchor::Center);
        }
        if index == 0 {
            self.arms(layout, camera.axes, canvas);
        }
        let paint = |(field, strip): (usize, &Strip)| {
            let [x, y] = place(field);
            sight.paint(field, strip, canvas, x, y)
        };
        Ok(self.fields.iter().enumerate().map(paint).collect())
    }

    /// Draws title and colour bars.
    fn surround(&self, layout: &SolidLayout, canvas: &mut Canvas) {
        let middle = layout.size[0] as isize / 2;
        canvas.text(middle, (MARGIN + TITLE as usize / 2) as isize, &layout.title, LabelAnchor::Center);
        for (field, (bar, strip)) in layout.bars.iter().zip(&self.fields).enumerate() {
            let [x, y] = layout.origin;
            let [x, y] = if layout.stacked {
                [x + field * layout.step[0] + layout.bar, y]
            } else {
                [x + layout.bar, y + field * layout.step[1]]
            };
            bar.draw(canvas, x as isize, y as isize, strip.colors);
        }
    }

    /// Draws the axes to scale.
    fn arms(&self, layout: &SolidLayout, axes: [[f64; 3]; 3], canvas: &mut Canvas) {
        let length = layout.arm * layout.camera.scale;
        // from back to front
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| axes[2][a].total_cmp(&axes[2][b]));
        for d in order {
            let (x, y) = (axes[0][d], -axes[1][d]);
            let end = |far: f64| [layout.root[0] + far * x, layout.root[1] + far * y];
            canvas.line(layout.root, end(length), 3.0, COLORS[d]);
            // farther from a foreshortened arm
            let far = length + LETTER / x.hypot(y).max(0.2);
            let [x, y] = end(far).map(|x| x.round() as isize);
            canvas.text(x, y, &layout.letters[d], LabelAnchor::Center);
        }
        let [x, y] = layout.root.map(|x| x as isize);
        let reach = (length + 3.0 * LETTER) as isize;
        canvas.text(x + reach, y, &layout.caption, LabelAnchor::Left);
    }

    fn check(&self, stages: usize, views: &[View]) -> Result<(), String> {
        let [low, high] = self.bounds;
        let spans = [0, 1, 2].map(|d| high[d] - low[d]);
        if stages == 0 {
            return Err("there are no stages".into());
        }
        if !(1..=2).contains(&self.fields.len()) {
            return Err(format!("{} fields; allowed: 1 or 2", self.fields.len()));
        }
        if spans.iter().any(|span| !(*span >= 0.0 && span.is_finite())) || spans == [0.0; 3] {
            return Err(format!("the bounds {low:?} … {high:?} hold nothing"));
        }
        if !(self.unit.1 > 0.0 && self.unit.1.is_finite()) {
            return Err(format!("the factor {} of the unit of length must be positive", self.unit.1));
        }
        if views.iter().any(|view| !(view.azimuth.is_finite() && view.elevation.abs() <= 0.5 * PI + 1e-9)) {
            return Err(format!("a view is not valid: {:?}", self.view));
        }
        for Strip { label, range: (low, high), .. } in &self.fields {
            if !(low < high && (high - low).is_finite()) {
                return Err(format!("`{label}`: the range {low} … {high} is not valid"));
            }
        }
        Ok(())
    }

    /// Returns a layout with panels of `longest` pixels that hold the bounds in each of the views.
    fn layout(&self, stages: usize, views: &[View], longest: f64) -> Result<SolidLayout, String> {
        self.check(stages, views)?;
        let [low, high] = self.bounds;
        let centre = [0, 1, 2].map(|d| 0.5 * (low[d] + high[d]));
        // half the size of the projected bounds
        let reach = |axis: fn(&[[f64; 3]; 3]) -> [f64; 3]| {
            let half =
                |view: &View| (0..3).map(|d| 0.5 * (high[d] - low[d]) * axis(&view.axes())[d].abs()).sum();
            views.iter().map(half).fold(0.0, f64::max)
        };
        let half = [reach(|axes| axes[0]), reach(|axes| axes[1])];
        let stacked = half[0] > 1.5 * half[1];
        let scale = 0.5 * longest / half[0].max(half[1]);
        let mut panel = half.map(|half| (2.0 * half * scale).ceil() + 6.0);
        if !stacked {
            // room for the titles of stages
            panel[0] = panel[0].max(350.0);
        }
        let corner = [-0.5 * panel[0] / scale, 0.5 * panel[1] / scale];
        let camera = Camera { axes: self.view.axes(), centre, corner, scale };
        let panel = panel.map(|pixels| pixels as usize);
        let title = Text::new(&self.title, TITLE)?;
        let head = MARGIN + if self.title.is_empty() { 0 } else { TITLE as usize * 3 / 2 };
        let origin = [MARGIN, head + LINE];
        let rows = if stacked { stages * (panel[1] + LINE) - LINE } else { panel[1] };
        let bar = |strip: &Strip| {
            ColorBar::new(&strip.label, strip.range, [false; 2], rows.clamp(LEAST_BAR, MOST_BAR))
        };
        let bars = self.fields.iter().map(bar).collect::<Result<Vec<ColorBar>, String>>()?;
        let of_bars = |size: fn(&ColorBar) -> usize| bars.iter().map(size).max().unwrap_or(0);
        let [wide, tall] = [of_bars(|bar| bar.width), of_bars(|bar| bar.height)];
        let fields = self.fields.len();
        let (step, inner, bar) = if stacked {
            let step = [panel[0] + wide + 2 * GAP, panel[1] + LINE];
            (step, [fields * step[0] - GAP, rows.max(tall)], panel[0] + GAP)
        } else {
            let step = [panel[0] + GAP, panel[1].max(tall) + GAP];
            (step, [stages * step[0] + wide, fields * step[1] - GAP], stages * step[0])
        };
        // the longest arm of 1, 2 or 5 times a power of ten that fits
        let fits = ARM / (scale * self.unit.1);
        let power = 10f64.powf(fits.log10().floor());
        let round = [5.0, 2.0, 1.0].into_iter().find(|factor| factor * power <= fits).unwrap_or(1.0) * power;
        let arm = round * self.unit.1;
        let letters = ["x", "y", "z"].map(|letter| Text::new(letter, TICK));
        let letters = letters.into_iter().collect::<Result<Vec<Text>, String>>()?;
        let caption = labels(&[round]).concat();
        let caption = Text::new(&format!("{caption} {} each", self.unit.0), TICK)?;
        let most = |share: fn(&View) -> f64| views.iter().map(share).fold(0.0, f64::max);
        let up = most(|view| view.elevation.cos().max(view.elevation.sin().abs())) * arm * scale;
        let down = most(|view| view.elevation.sin().abs()) * arm * scale;
        let foot = (origin[1] + inner[1] + GAP / 2) as f64;
        let root = [MARGIN as f64 + arm * scale + LETTER, foot + up + 2.0 * LETTER];
        let height = root[1] + down + 2.0 * LETTER + 0.5 * MARGIN as f64;
        let legend = 2.0 * (arm * scale + LETTER) + 2.0 * LETTER + caption.width as f64;
        let width = (inner[0].max(title.width) as f64).max(legend) + 2.0 * MARGIN as f64;
        let pixels = width * height;
        if !pixels.is_finite() || pixels > LARGEST {
            return Err(format!("{width} × {height} pixels are too many"));
        }
        let size = [width as usize, height as usize];
        Ok(SolidLayout {
            camera,
            panel,
            stacked,
            origin,
            step,
            bars,
            bar,
            size,
            title,
            arm,
            root,
            letters,
            caption,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::color::ColorMap;
    use super::super::skin::Corner;
    use super::*;

    fn solids() -> Solids {
        let strip = |label: &str, colors| Strip { label: label.into(), range: (0.0, 1.0), colors };
        Solids {
            title: "Title".into(),
            bounds: [[0.0; 3], [4e-3, 1e-3, 1e-3]],
            unit: ("mm".into(), 1e-3),
            view: View::default(),
            fields: vec![strip("T [°C]", ColorMap::Inferno), strip("α", ColorMap::Viridis)],
        }
    }

    /// Returns a square across the box, further along at each stage.
    fn stage(index: usize) -> SolidStage {
        let mut skin = Skin::new(None);
        let corner = |y: f64, z: f64| Corner { at: [1e-3 * index as f64, y, z], values: [z * 1e3, 0.5] };
        skin.face(&[corner(0.0, 0.0), corner(1e-3, 0.0), corner(1e-3, 1e-3), corner(0.0, 1e-3)]);
        (format!("{index} s"), skin)
    }

    /// The frames of an animation, drawn over each other, are the pictures of its stages.
    #[test]
    fn animations_hold_their_frames() {
        let directory = tempfile::tempdir().unwrap();
        for turns in [false, true] {
            let path = directory.path().join("film.png");
            let (solids, views) = (solids(), vec![View::default(); 4]);
            if turns {
                solids.turn(&path, 4, 0.1, &stage(2)).unwrap();
            } else {
                solids.animate(&path, 4, 0.1, |k| Ok(stage(k))).unwrap();
            }
            let bytes = std::fs::read(&path).unwrap();
            let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
            assert_eq!(reader.info().animation_control.unwrap().num_frames, 4);
            let (width, height) = (reader.info().width as usize, reader.info().height as usize);
            let mut shown = Canvas::new(width, height);
            for frame in 0..4 {
                let mut buffer = vec![0; reader.output_buffer_size().unwrap()];
                let info = reader.next_frame(&mut buffer).unwrap();
                let part = reader.info().frame_control.map_or([0; 2], |part| [part.x_offset, part.y_offset]);
                for (at, pixel) in buffer[..info.buffer_size()].chunks(3).enumerate() {
                    let (x, y) = (at % info.width as usize, at / info.width as usize);
                    let [x, y] = [x + part[0] as usize, y + part[1] as usize].map(|x| x as isize);
                    shown.set(x, y, [pixel[0], pixel[1], pixel[2]]);
                }
                if !turns {
                    let layout = solids.layout(1, &views, 520.0).unwrap();
                    let mut canvas = Canvas::new(width, height);
                    solids.surround(&layout, &mut canvas);
                    solids.paint(&layout, views[0], 0, &stage(frame), &mut canvas).unwrap();
                    assert!(canvas.encode() == shown.encode(), "frame {frame}");
                }
            }
            assert!(reader.next_frame(&mut vec![0; 1 << 24]).is_err());
        }
    }

    /// The same bytes each time; every panel lies on the sheet, for bodies of any shape.
    #[test]
    fn sheets_hold_their_panels() {
        let directory = tempfile::tempdir().unwrap();
        for (bounds, stages) in
            [([1.0, 1.0, 1.0], 1), ([40.0, 1.0, 1.0], 5), ([1.0, 1.0, 40.0], 5), ([1.0, 0.0, 0.0], 12)]
        {
            let mut solids = solids();
            solids.bounds = [[0.0; 3], bounds];
            let layout = solids.layout(stages, &[solids.view], 560.0).unwrap();
            let [columns, rows] = if layout.stacked { [2, stages] } else { [stages, 2] };
            let last = [columns, rows].map(|count| count - 1);
            for d in 0..2 {
                assert!(layout.origin[d] + last[d] * layout.step[d] + layout.panel[d] < layout.size[d]);
            }
            assert!(layout.bars.iter().all(|bar| bar.width < layout.size[0] && bar.height < layout.size[1]));
            let bytes = || {
                let path = directory.path().join("solid.png");
                solids.write(&path, stages, |k| Ok(stage(k))).unwrap();
                std::fs::read(path).unwrap()
            };
            assert!(bytes() == bytes(), "{bounds:?}");
        }
    }

    #[test]
    fn solids_that_cannot_be_drawn() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.png");
        type Change = fn(&mut Solids);
        let wrong: [(Change, &str); 7] = [
            (|s| s.fields.clear(), "0 fields"),
            (|s| s.fields.extend(s.fields.clone()), "4 fields"),
            (|s| s.fields[0].range = (1.0, 1.0), "range 1 … 1"),
            (|s| s.bounds[1] = [0.0; 3], "hold nothing"),
            (|s| s.bounds[1][0] = f64::NAN, "hold nothing"),
            (|s| s.unit.1 = 0.0, "factor 0"),
            (|s| s.view.elevation = 3.0, "view"),
        ];
        for (change, part) in wrong {
            let mut solids = solids();
            change(&mut solids);
            for error in [
                solids.write(&path, 1, |k| Ok(stage(k))),
                solids.animate(&path, 2, 0.1, |k| Ok(stage(k))),
                solids.turn(&path, 2, 0.1, &stage(0)),
            ] {
                let error = error.unwrap_err().to_string();
                assert!(error.contains(part), "{error}");
            }
        }
        let none = solids().write(&path, 0, |k| Ok(stage(k))).unwrap_err().to_string();
        assert!(none.contains("no stages"), "{none}");
        assert!(solids().animate(&path, 0, 0.1, |k| Ok(stage(k))).is_err());
        // nothing is there, but there is something to draw
        solids().write(&path, 1, |_| Ok((String::new(), Skin::default()))).unwrap();
        assert!(
            solids().write(&path, 1, |_| Err(Error::Data { what: "x".into(), reason: "y".into() })).is_err()
        );
    }
}
