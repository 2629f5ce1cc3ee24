//! Fields on regular rasters side by side under common colour bars: stages below one another, or one after
//! another as an animation.

use std::io::Write;
use std::path::Path;

use super::axis::{labels, ticks};
use super::canvas::{BLACK, Canvas, LabelAnchor, Text};
use super::color::ColorMap;
use super::picture_error;
use polycore::Error;
use polycore::file::atomic_write;

const TITLE: u32 = 22;
const TICK: u32 = 18;
const MARGIN: usize = 18;
const GAP: usize = 64;
const BAR: usize = 16;
const TICK_LENGTH: isize = 6;
const LINE: isize = 1;
/// Colours of the palette: greys, then the levels of each column.
const GREYS: usize = 16;
const LEVELS: usize = 120;
/// More pixels than this are a mistake.
const LARGEST: usize = 100_000_000;

/// Data shared by all stages. A sample is a pixel.
///
/// ```
/// # use resultfile::picture::{ColorMap, Strip, Strips};
/// let strips = Strips {
///     title: "Cooling".into(),
///     samples: [60, 20],
///     low: [0.0, 0.0],
///     spacing: 1e-3,
///     unit: ("mm".into(), 1e-3),
///     axes: ["x", "z"],
///     columns: vec![Strip { label: "T [°C]".into(), range: (0.0, 40.0), colors: ColorMap::Inferno }],
/// };
/// let at = |time: f64| vec![(0..1200).map(|k| f64::from(k % 60) - time).collect::<Vec<f64>>()];
/// # let directory = tempfile::tempdir().unwrap();
/// # let out = directory.path();
/// strips.write(out.join("stages.png"), &[("1 s".into(), at(1.0)), ("2 s".into(), at(2.0))])?;
/// strips.animate(out.join("film.png"), 20, 0.1, |frame| Ok((format!("{frame} s"), at(frame as f64))))?;
/// # Ok::<(), polycore::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Strips<'a> {
    /// Above everything.
    pub title: String,
    /// Samples across and up.
    pub samples: [usize; 2],
    /// Lower left corner.
    pub low: [f64; 2],
    /// Distance of samples.
    pub spacing: f64,
    /// Unit of length and its size.
    pub unit: (String, f64),
    /// Names of the axes.
    pub axes: [&'a str; 2],
    /// The fields, one or two.
    pub columns: Vec<Strip>,
}

/// A field.
#[derive(Clone, Debug)]
pub struct Strip {
    /// Stands under its colour bar, with the unit.
    pub label: String,
    /// Ends of the colour bar; values outside take their colours.
    pub range: (f64, f64),
    /// Colours.
    pub colors: ColorMap,
}

/// The values of a stage: a title, and for each field a value a sample, row by row from below; NaN where
/// nothing is.
pub type Stage = (String, Vec<Vec<f64>>);

/// Palette indices of a picture.
struct Sheet {
    width: usize,
    height: usize,
    indices: Vec<u8>,
}

impl Strips<'_> {
    /// Writes stages below one another into a `.png`, whole or not at all.
    ///
    /// # Errors
    /// [`Error::Data`] for no stage, no or more than two fields, arrays of another length, invalid ranges;
    /// [`Error::Io`].
    pub fn write(&self, path: impl AsRef<Path>, stages: &[Stage]) -> Result<(), Error> {
        let path = path.as_ref();
        let fail = |reason: String| picture_error(path, reason);
        let sheet = self.sheet(stages).map_err(fail)?;
        let bytes = self.encode(1, 0.0, |_| Ok(&sheet), &sheet).map_err(fail)?;
        atomic_write(path, |file| file.write_all(&bytes))
    }

    /// Writes frames one after another into an animated `.png`. It repeats without end and rests on the last
    /// frame; viewers that know no animation show the first.
    ///
    /// # Errors
    /// As [`Self::write`]; those of `frame`.
    pub fn animate(
        &self,
        path: impl AsRef<Path>,
        frames: usize,
        seconds: f64,
        mut frame: impl FnMut(usize) -> Result<Stage, Error>,
    ) -> Result<(), Error> {
        let path = path.as_ref();
        let fail = |reason: String| picture_error(path, reason);
        let mut sheets = Vec::with_capacity(frames);
        for index in 0..frames {
            sheets.push(self.sheet(&[frame(index)?]).map_err(fail)?);
        }
        let Some(first) = sheets.first() else { return Err(fail("there is no frame".into())) };
        let bytes = self.encode(frames, seconds, |index| Ok(&sheets[index]), first).map_err(fail)?;
        atomic_write(path, |file| file.write_all(&bytes))
    }

    fn encode<'s>(
        &self,
        frames: usize,
        seconds: f64,
        sheet: impl Fn(usize) -> Result<&'s Sheet, String>,
        first: &Sheet,
    ) -> Result<Vec<u8>, String> {
        let text = |error: png::EncodingError| error.to_string();
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, first.width as u32, first.height as u32);
        encoder.set_color(png::ColorType::Indexed);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_palette(self.palette());
        encoder.set_compression(png::Compression::High);
        encoder.set_filter(png::Filter::NoFilter);
        let delay = (1000.0 * seconds).round().clamp(1.0, 60_000.0) as u16;
        if frames > 1 {
            encoder.set_animated(frames as u32, 0).map_err(text)?;
            encoder.set_frame_delay(delay, 1000).map_err(text)?;
        }
        let mut writer = encoder.write_header().map_err(text)?;
        for index in 0..frames {
            if frames > 1 && index + 1 == frames {
                writer.set_frame_delay(delay.saturating_mul(20), 1000).map_err(text)?;
            }
            writer.write_image_data(&sheet(index)?.indices).map_err(text)?;
        }
        writer.finish().map_err(text)?;
        Ok(bytes)
    }

    fn palette(&self) -> Vec<u8> {
        let greys = (0..GREYS).map(|k| [(255 * k / (GREYS - 1)) as u8; 3]);
        let levels = |strip: &Strip| -> Vec<[u8; 3]> {
            (0..LEVELS).map(|k| strip.colors.color_at(k as f64 / (LEVELS - 1) as f64)).collect()
        };
        greys.chain(self.columns.iter().flat_map(levels)).flatten().collect()
    }

    fn check(&self, stages: &[Stage]) -> Result<(), String> {
        let [across, up] = self.samples;
        if !(1..=2).contains(&self.columns.len()) {
            return Err(format!("{} fields; allowed: 1 or 2", self.columns.len()));
        }
        if stages.is_empty() || across == 0 || up == 0 {
            return Err(format!("{} stages of {across} × {up} samples", stages.len()));
        }
        if across.saturating_mul(up).saturating_mul(stages.len()) > LARGEST {
            return Err(format!("{} stages of {across} × {up} samples are too many", stages.len()));
        }
        for Strip { label, range: (low, high), .. } in &self.columns {
            if !(low < high && (high - low).is_finite()) {
                return Err(format!("`{label}`: the range {low} … {high} is not valid"));
            }
        }
        for (title, fields) in stages {
            if fields.len() != self.columns.len() || fields.iter().any(|f| f.len() != across * up) {
                let found: Vec<usize> = fields.iter().map(Vec::len).collect();
                return Err(format!("`{title}`: found {found:?} values for {across} × {up} samples"));
            }
        }
        Ok(())
    }

    /// Returns the stages below one another, on one axis of lengths and one colour bar a field.
    fn sheet(&self, stages: &[Stage]) -> Result<Sheet, String> {
        self.check(stages)?;
        let [across, up] = self.samples;
        let line = |size: u32| size as usize * 3 / 2;
        // ticks of the vertical axis, no closer than their text is high
        let scale = 1.0 / self.spacing;
        let end = |d: usize| self.low[d] + self.samples[d] as f64 * self.spacing;
        let upwards = ticks(self.low[1] / self.unit.1, end(1) / self.unit.1, (up / line(TICK)).clamp(1, 6));
        let upward_texts = texts(&upwards)?;
        let left = MARGIN + line(TICK) + widest(&upward_texts) + TICK_LENGTH as usize + 8;
        let rightwards = ticks(self.low[0] / self.unit.1, end(0) / self.unit.1, (across / 90).clamp(2, 9));
        let rightward_texts = texts(&rightwards)?;
        let head = if self.title.is_empty() { MARGIN } else { MARGIN + line(TITLE) };
        let row = line(TITLE) + up + MARGIN / 2;
        let foot = 2 * line(TICK) + MARGIN + BAR + 2 * line(TICK) + MARGIN;
        let columns = self.columns.len();
        let width = left + columns * across + (columns - 1) * GAP + 2 * MARGIN;
        let mut canvas = Canvas::new(width, head + stages.len() * row + foot);
        let at = |column: usize| (left + column * (across + GAP)) as isize;
        let top = |stage: usize| (head + stage * row + line(TITLE)) as isize;
        if !self.title.is_empty() {
            let title = Text::new(&self.title, TITLE)?;
            canvas.text(width as isize / 2, (MARGIN + line(TITLE) / 2) as isize, &title, LabelAnchor::Center);
        }
        for (stage, (title, _)) in stages.iter().enumerate() {
            let title = Text::new(title, TITLE)?;
            canvas.text(at(0), top(stage) - line(TITLE) as isize / 2, &title, LabelAnchor::Left);
            for (place, text) in upwards.iter().zip(&upward_texts) {
                let y = top(stage) + ((end(1) - place * self.unit.1) * scale).round() as isize;
                canvas.rectangle(at(0) - LINE - TICK_LENGTH, y, TICK_LENGTH, LINE, BLACK);
                canvas.text(at(0) - LINE - TICK_LENGTH - 4, y, text, LabelAnchor::Right);
            }
            for column in 0..columns {
                canvas.frame(at(column), top(stage), across as isize, up as isize, LINE, BLACK);
            }
        }
        // once for all stages: a thin part is lower than its axis' name is long
        let base = top(stages.len() - 1) + up as isize + LINE;
        let name = Text::new(&format!("{} [{}]", self.axes[1], self.unit.0), TICK)?;
        if name.width <= head + stages.len() * row {
            let middle = ((top(0) + base) / 2).max((name.width / 2) as isize);
            canvas.text((MARGIN + line(TICK) / 2) as isize, middle, &name, LabelAnchor::Upwards);
        }
        let bar = base + (2 * line(TICK) + MARGIN) as isize;
        for (column, strip) in self.columns.iter().enumerate() {
            for (place, text) in rightwards.iter().zip(&rightward_texts) {
                let x = at(column) + ((place * self.unit.1 - self.low[0]) * scale).round() as isize;
                canvas.rectangle(x, base, LINE, TICK_LENGTH, BLACK);
                canvas.text(x, base + TICK_LENGTH + line(TICK) as isize / 2, text, LabelAnchor::Center);
            }
            let name = Text::new(&format!("{} [{}]", self.axes[0], self.unit.0), TICK)?;
            let middle = at(column) + across as isize / 2;
            canvas.text(middle, base + TICK_LENGTH + 3 * line(TICK) as isize / 2, &name, LabelAnchor::Center);
            canvas.frame(at(column), bar, across as isize, BAR as isize, LINE, BLACK);
            let (low, high) = strip.range;
            let marks = ticks(low, high, (across / 90).clamp(2, 8));
            for (mark, text) in marks.iter().zip(&texts(&marks)?) {
                let share = (mark - low) / (high - low);
                let x = at(column) + (share * across as f64).round() as isize;
                canvas.rectangle(x, bar + BAR as isize + LINE, LINE, TICK_LENGTH, BLACK);
                let y = bar + BAR as isize + TICK_LENGTH + line(TICK) as isize / 2 + 2;
                canvas.text(x, y, text, LabelAnchor::Center);
            }
            let label = Text::new(&strip.label, TICK)?;
            let y = bar + BAR as isize + TICK_LENGTH + 3 * line(TICK) as isize / 2 + 2;
            canvas.text(middle, y, &label, LabelAnchor::Center);
        }
        let mut sheet = Sheet::of(&canvas);
        for column in 0..columns {
            for (stage, (_, fields)) in stages.iter().enumerate() {
                for (k, &value) in fields[column].iter().enumerate().filter(|(_, value)| !value.is_nan()) {
                    let (x, y) =
                        (at(column) as usize + k % across, top(stage) as usize + up - 1 - k / across);
                    sheet.indices[y * width + x] = self.index(column, value);
                }
            }
            let (low, high) = self.columns[column].range;
            for y in 0..BAR {
                for x in 0..across {
                    let value = low + (high - low) * (x as f64 + 0.5) / across as f64;
                    sheet.indices[(bar as usize + y) * width + at(column) as usize + x] =
                        self.index(column, value);
                }
            }
        }
        Ok(sheet)
    }

    fn index(&self, column: usize, value: f64) -> u8 {
        let (low, high) = self.columns[column].range;
        let level = ((value - low) / (high - low)).clamp(0.0, 1.0) * (LEVELS - 1) as f64;
        (GREYS + column * LEVELS + level.round() as usize) as u8
    }
}

impl Sheet {
    /// Text and lines as greys.
    fn of(canvas: &Canvas) -> Self {
        let grey = |level: u8| ((usize::from(level) * (GREYS - 1) + 127) / 255) as u8;
        Self { width: canvas.width, height: canvas.height, indices: canvas.greens().map(grey).collect() }
    }
}

fn texts(places: &[f64]) -> Result<Vec<Text>, String> {
    labels(places).iter().map(|label| Text::new(label, TICK)).collect()
}

fn widest(texts: &[Text]) -> usize {
    texts.iter().map(|text| text.width).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strips() -> Strips<'static> {
        let strip = |label: &str, colors| Strip { label: label.into(), range: (0.0, 1.0), colors };
        Strips {
            title: "Title".into(),
            samples: [120, 30],
            low: [0.0, 0.0],
            spacing: 1e-4,
            unit: ("mm".into(), 1e-3),
            axes: ["x", "z"],
            columns: vec![strip("T [°C]", ColorMap::Inferno), strip("α", ColorMap::Viridis)],
        }
    }

    fn stage(value: f64) -> Stage {
        let mut field = vec![value; 3600];
        field[0] = f64::NAN;
        (format!("{value} s"), vec![field.clone(), field])
    }

    /// An animation is read back: frames, colours, white background.
    #[test]
    fn animations_hold_their_frames() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("film.png");
        strips().animate(&path, 3, 0.1, |frame| Ok(stage(frame as f64 / 2.0))).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let mut decoder = png::Decoder::new(std::io::Cursor::new(&bytes));
        decoder.set_transformations(png::Transformations::EXPAND);
        let mut reader = decoder.read_info().unwrap();
        assert_eq!(reader.info().animation_control.unwrap().num_frames, 3);
        let mut buffer = vec![0; reader.output_buffer_size().unwrap()];
        for frame in 0..3 {
            let info = reader.next_frame(&mut buffer).unwrap();
            let pixel = |color: [u8; 3]| {
                buffer.chunks(3).take((info.width * info.height) as usize).filter(|p| *p == color).count()
            };
            for colors in [ColorMap::Inferno, ColorMap::Viridis] {
                // the raster without the sample that is nothing, and a level of the bar
                let last = (LEVELS - 1) as f64;
                let level = (frame as f64 / 2.0 * last).round();
                assert!(pixel(colors.color_at(level / last)) >= 3599, "frame {frame}");
            }
            assert!(pixel([255; 3]) > 3600);
        }
        assert!(reader.next_frame(&mut buffer).is_err());
    }

    #[test]
    fn stages_that_cannot_be_are_named() {
        let directory = tempfile::tempdir().unwrap();
        let write = |strips: &Strips, stages: &[Stage]| {
            strips.write(directory.path().join("a.png"), stages).map_err(|error| error.to_string())
        };
        write(&strips(), &[stage(0.0), stage(1.0)]).unwrap();
        assert!(write(&strips(), &[]).unwrap_err().contains("0 stages"));
        assert!(write(&strips(), &[("x".into(), vec![vec![0.0]])]).unwrap_err().contains("found [1] values"));
        let mut wrong = strips();
        wrong.columns[0].range = (1.0, 1.0);
        assert!(write(&wrong, &[stage(0.0)]).unwrap_err().contains("range 1 … 1"));
        wrong.columns.clear();
        assert!(write(&wrong, &[stage(0.0)]).unwrap_err().contains("0 fields"));
        assert!(strips().animate(directory.path().join("b.png"), 0, 0.1, |_| Ok(stage(0.0))).is_err());
    }
}
