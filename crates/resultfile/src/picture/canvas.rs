//! Pixels, text on them, and the PNG they become.

use kuva::backend::raster::RasterBackend;
use kuva::render::render::{Primitive, Scene, TextAnchor};
use std::path::Path;

use super::picture_error;
use polycore::Error;

pub(super) type Color = [u8; 3];

pub(super) const BLACK: Color = [0, 0, 0];
const WHITE: Color = [255, 255, 255];

/// An RGB image.
#[derive(Clone)]
pub(super) struct Canvas {
    pub(super) width: usize,
    pub(super) height: usize,
    pixels: Vec<Color>,
}

/// Point of a text that its position gives.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum LabelAnchor {
    /// Middle of the left edge.
    Left,
    /// Middle of the right edge.
    Right,
    /// Middle.
    Center,
    /// Middle, the text running upwards.
    Upwards,
}

impl Canvas {
    pub(super) fn new(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![WHITE; width * height] }
    }

    pub(super) fn decode(bytes: &[u8]) -> Result<Self, String> {
        let mut reader =
            png::Decoder::new(std::io::Cursor::new(bytes)).read_info().map_err(|e| e.to_string())?;
        let size = reader.output_buffer_size().ok_or("the picture is too large")?;
        let mut buffer = vec![0; size];
        let info = reader.next_frame(&mut buffer).map_err(|error| error.to_string())?;
        if (info.color_type, info.bit_depth) != (png::ColorType::Rgba, png::BitDepth::Eight) {
            return Err("unexpected pixel format".to_owned());
        }
        let pixels = buffer[..info.buffer_size()].chunks_exact(4).map(|p| [p[0], p[1], p[2]]).collect();
        Ok(Self { width: info.width as usize, height: info.height as usize, pixels })
    }

    pub(super) fn encode(&self) -> Result<Vec<u8>, String> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header().map_err(|error| error.to_string())?;
        writer.write_image_data(self.pixels.as_flattened()).map_err(|error| error.to_string())?;
        writer.finish().map_err(|error| error.to_string())?;
        Ok(bytes)
    }

    /// Pixels outside the canvas are ignored.
    pub(super) fn set(&mut self, x: isize, y: isize, color: Color) {
        if (0..self.width as isize).contains(&x) && (0..self.height as isize).contains(&y) {
            self.pixels[y as usize * self.width + x as usize] = color;
        }
    }

    /// Returns the green of every pixel, row by row: all there is of a grey picture.
    pub(super) fn greens(&self) -> impl Iterator<Item = u8> {
        self.pixels.iter().map(|pixel| pixel[1])
    }

    #[cfg(test)]
    pub(super) fn get(&self, x: usize, y: usize) -> Color {
        self.pixels[y * self.width + x]
    }

    pub(super) fn rectangle(&mut self, x: isize, y: isize, width: isize, height: isize, color: Color) {
        for row in y..y + height {
            for column in x..x + width {
                self.set(column, row, color);
            }
        }
    }

    /// A frame of `thickness` around a rectangle, outside of it.
    pub(super) fn frame(
        &mut self,
        x: isize,
        y: isize,
        width: isize,
        height: isize,
        thickness: isize,
        color: Color,
    ) {
        let t = thickness;
        self.rectangle(x - t, y - t, width + 2 * t, t, color);
        self.rectangle(x - t, y + height, width + 2 * t, t, color);
        self.rectangle(x - t, y, t, height, color);
        self.rectangle(x + width, y, t, height, color);
    }

    /// A straight line between two points.
    pub(super) fn line(&mut self, from: [f64; 2], to: [f64; 2], width: f64, color: Color) {
        let [along, across] = [0, 1].map(|d| to[d] - from[d]);
        let square = (along * along + across * across).max(f64::MIN_POSITIVE);
        let pixels = |d: usize| {
            let (low, high) = (from[d].min(to[d]) - width, from[d].max(to[d]) + width);
            low.floor() as isize..=high.ceil() as isize
        };
        for y in pixels(1) {
            for x in pixels(0) {
                let r = [x as f64 + 0.5 - from[0], y as f64 + 0.5 - from[1]];
                let t = ((r[0] * along + r[1] * across) / square).clamp(0.0, 1.0);
                let off = (r[0] - t * along).hypot(r[1] - t * across);
                self.mix(x, y, (0.5 + 0.5 * width - off).clamp(0.0, 1.0), color);
            }
        }
    }

    /// Covers a part of a pixel with a colour.
    fn mix(&mut self, x: isize, y: isize, part: f64, color: Color) {
        if (0..self.width as isize).contains(&x) && (0..self.height as isize).contains(&y) {
            let pixel = &mut self.pixels[y as usize * self.width + x as usize];
            let mixed = |k: usize| (1.0 - part) * f64::from(pixel[k]) + part * f64::from(color[k]);
            *pixel = [0, 1, 2].map(|k| mixed(k).round() as u8);
        }
    }

    /// Returns the least rectangle (left, top, width, height) outside of which nothing differs from an image
    /// of the same size; one pixel where nothing does.
    pub(super) fn difference(&self, other: &Self) -> [usize; 4] {
        let differs =
            |x: usize, y: usize| self.pixels[y * self.width + x] != other.pixels[y * self.width + x];
        let in_row = |y: &usize| {
            self.pixels[y * self.width..][..self.width] != other.pixels[y * self.width..][..self.width]
        };
        let Some(top) = (0..self.height).find(in_row) else { return [0, 0, 1, 1] };
        let bottom = (top..self.height).rev().find(in_row).unwrap_or(top);
        let in_column = |x: &usize| (top..=bottom).any(|y| differs(*x, y));
        let left = (0..self.width).find(in_column).unwrap_or(0);
        let right = (left..self.width).rev().find(in_column).unwrap_or(left);
        [left, top, right + 1 - left, bottom + 1 - top]
    }

    /// Returns the frame `index` of a film if it has the size of another one.
    ///
    /// # Errors
    /// A frame of another size.
    pub(super) fn sized_as(self, other: &Self, path: &Path, index: usize) -> Result<Self, Error> {
        if [self.width, self.height] == [other.width, other.height] {
            return Ok(self);
        }
        Err(picture_error(path, format!("frame {index} has another size")))
    }

    /// Returns the bytes of a rectangle (left, top, width, height), row by row.
    pub(super) fn bytes_within(&self, [x, y, width, height]: [usize; 4]) -> Vec<u8> {
        let rows = self.pixels.chunks(self.width).skip(y).take(height);
        rows.flat_map(|row| row[x..x + width].as_flattened()).copied().collect()
    }

    /// Returns the image on a white sheet of another size; what is beyond it is cut off.
    pub(super) fn on_sheet(&self, [width, height]: [usize; 2]) -> Self {
        let mut sheet = Self::new(width, height);
        for (row, line) in self.pixels.chunks(self.width.max(1)).take(height).enumerate() {
            let count = line.len().min(width);
            sheet.pixels[row * width..row * width + count].copy_from_slice(&line[..count]);
        }
        sheet
    }

    /// Copies another image to a place where it fits.
    pub(super) fn paste(&mut self, other: &Self, x: usize, y: usize) {
        for (row, line) in other.pixels.chunks(other.width.max(1)).enumerate() {
            let start = (y + row) * self.width + x;
            self.pixels[start..start + line.len()].copy_from_slice(line);
        }
    }

    pub(super) fn text(&mut self, x: isize, y: isize, text: &Text, anchor: LabelAnchor) {
        let (width, height) = (text.width as isize, text.height as isize);
        for row in 0..height {
            for column in 0..width {
                let ink = text.ink[(row * width + column) as usize];
                if ink == 0 {
                    continue;
                }
                let (right, down) = match anchor {
                    LabelAnchor::Left => (column, row - height / 2),
                    LabelAnchor::Right => (column - width, row - height / 2),
                    LabelAnchor::Center => (column - width / 2, row - height / 2),
                    LabelAnchor::Upwards => (row - height / 2, width / 2 - column),
                };
                self.blend(x + right, y + down, ink);
            }
        }
    }

    fn blend(&mut self, x: isize, y: isize, ink: u8) {
        if (0..self.width as isize).contains(&x) && (0..self.height as isize).contains(&y) {
            let pixel = &mut self.pixels[y as usize * self.width + x as usize];
            *pixel = pixel.map(|channel| (u16::from(channel) * (255 - u16::from(ink)) / 255) as u8);
        }
    }
}

/// Returns an animated PNG of images of one size, one after another without end; the last is shown `rest`
/// times as long.
///
/// # Errors
/// Errors of `frame`, and images that cannot be encoded.
pub(super) fn animated_png(
    path: &Path,
    frames: usize,
    seconds: f64,
    rest: u16,
    mut frame: impl FnMut(usize) -> Result<Canvas, Error>,
) -> Result<Vec<u8>, Error> {
    let text = |error: png::EncodingError| picture_error(path, error);
    let mut last = frame(0)?;
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, last.width as u32, last.height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Balanced);
    encoder.set_filter(png::Filter::NoFilter);
    let delay = (1000.0 * seconds).round().clamp(1.0, 60_000.0) as u16;
    if frames > 1 {
        encoder.set_animated(frames as u32, 0).map_err(text)?;
        encoder.set_frame_delay(delay, 1000).map_err(text)?;
    }
    let mut writer = encoder.write_header().map_err(text)?;
    writer.write_image_data(last.pixels.as_flattened()).map_err(text)?;
    for index in 1..frames {
        let next = frame(index)?.sized_as(&last, path, index)?;
        // what changes only
        let part @ [x, y, width, height] = next.difference(&last);
        writer.reset_frame_position().map_err(text)?;
        writer.set_frame_dimension(width as u32, height as u32).map_err(text)?;
        writer.set_frame_position(x as u32, y as u32).map_err(text)?;
        if index + 1 == frames {
            writer.set_frame_delay(delay.saturating_mul(rest), 1000).map_err(text)?;
        }
        writer.write_image_data(&next.bytes_within(part)).map_err(text)?;
        last = next;
    }
    writer.finish().map_err(text)?;
    Ok(bytes)
}

/// A rendered line of text: how much ink each pixel takes.
pub(super) struct Text {
    pub(super) width: usize,
    height: usize,
    ink: Vec<u8>,
}

impl Text {
    /// `size` is the font size in pixels. The height depends on it alone, so that lines of text align.
    pub(super) fn new(text: &str, size: u32) -> Result<Self, String> {
        let letters = text.chars().count().min(500);
        let content: String = text.chars().take(letters).collect();
        let (width, height) = ((letters + 2) * size as usize, size as usize * 3 / 2);
        let mut scene = Scene::new(width as f64, height as f64);
        // the middle of digits and capitals, 0.73 em high, comes to the middle of the image
        let (x, y) = (f64::from(size), height as f64 / 2.0 + 0.365 * f64::from(size));
        let anchor = TextAnchor::Start;
        scene.add(Primitive::Text { x, y, content, size, anchor, rotate: None, bold: false, color: None });
        let image = Canvas::decode(&RasterBackend::new().with_scale(1.0).render_scene(&scene)?)?;
        let ink = |x: usize, y: usize| 255 - image.pixels[y * image.width + x][1];
        let inked = |x: &usize| (0..image.height).any(|y| ink(*x, y) > 0);
        let first = (0..image.width).find(inked).unwrap_or(0);
        let end = (0..image.width).rev().find(inked).map_or(first, |last| last + 1);
        let pixels =
            (0..image.height).flat_map(|y| (first..end).map(move |x| (x, y))).map(|(x, y)| ink(x, y));
        Ok(Self { width: end - first, height: image.height, ink: pixels.collect() })
    }
}
