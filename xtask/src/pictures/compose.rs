//! Crops, scales and joins pictures.

use std::fs;
use std::path::Path;

use miette::{IntoDiagnostic, Result, WrapErr, miette};

/// White space between two panels, pixels.
const GAP: usize = 24;

/// An image in linear order of rows, RGB.
pub struct Image {
    width: usize,
    height: usize,
    pixels: Vec<[u8; 3]>,
}

impl Image {
    fn white(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![[255; 3]; width * height] }
    }

    /// Reads a PNG file of 8 bits per channel; of an animation the first frame.
    pub fn read(path: &Path) -> Result<Self> {
        let name = || path.display().to_string();
        let bytes = fs::read(path).into_diagnostic().wrap_err_with(name)?;
        let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
        decoder
            .set_transformations(png::Transformations::normalize_to_color8() | png::Transformations::ALPHA);
        let mut reader = decoder.read_info().into_diagnostic().wrap_err_with(name)?;
        let size = reader.output_buffer_size().ok_or_else(|| miette!("{}: too large", name()))?;
        let mut buffer = vec![0; size];
        let info = reader.next_frame(&mut buffer).into_diagnostic().wrap_err_with(name)?;
        let channels = info.color_type.samples();
        let pixels = buffer[..info.buffer_size()].chunks_exact(channels).map(|pixel| match pixel {
            [red, green, blue, ..] => [*red, *green, *blue],
            _ => [pixel[0]; 3],
        });
        Ok(Self { width: info.width as usize, height: info.height as usize, pixels: pixels.collect() })
    }

    /// Returns the part `[left, top, width, height]`.
    ///
    /// # Errors
    /// The part is empty or reaches beyond the image.
    pub fn crop(&self, [left, top, width, height]: [usize; 4]) -> Result<Self> {
        if width == 0 || height == 0 || left + width > self.width || top + height > self.height {
            return Err(miette!(
                "crop {left}, {top}, {width}, {height} does not fit into {} × {} pixels",
                self.width,
                self.height
            ));
        }
        let rows = self.pixels.chunks(self.width).skip(top).take(height);
        let pixels = rows.flat_map(|row| row[left..left + width].iter().copied()).collect();
        Ok(Self { width, height, pixels })
    }

    /// Returns the image at a smaller or equal size: each pixel is the mean of those that it covers.
    fn shrink(&self, width: usize, height: usize) -> Self {
        let mut small = Self::white(width, height);
        let range = |index: usize, count: usize, full: usize| {
            let from = index * full / count;
            from..((index + 1) * full / count).max(from + 1)
        };
        for y in 0..height {
            for x in 0..width {
                let (mut sum, mut count) = ([0_u32; 3], 0);
                for row in range(y, height, self.height) {
                    for column in range(x, width, self.width) {
                        let pixel = self.pixels[row * self.width + column];
                        sum = [0, 1, 2].map(|k| sum[k] + u32::from(pixel[k]));
                        count += 1;
                    }
                }
                small.pixels[y * width + x] = sum.map(|channel| ((channel + count / 2) / count) as u8);
            }
        }
        small
    }

    /// Writes a PNG file.
    pub fn write(&self, path: &Path) -> Result<()> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::High);
        let mut writer = encoder.write_header().into_diagnostic()?;
        writer.write_image_data(self.pixels.as_flattened()).into_diagnostic()?;
        writer.finish().into_diagnostic()?;
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).into_diagnostic()?;
        }
        fs::write(path, bytes).into_diagnostic().wrap_err_with(|| path.display().to_string())
    }
}

/// Joins panels of one height from left to right; the whole is at most `width` pixels wide, and no panel is
/// enlarged.
pub fn side_by_side(panels: &[Image], width: usize) -> Image {
    let gaps = GAP * panels.len().saturating_sub(1);
    let aspects: f64 = panels.iter().map(|panel| panel.width as f64 / panel.height as f64).sum();
    let least = panels.iter().map(|panel| panel.height).min().unwrap_or(1);
    let height = (width.saturating_sub(gaps) as f64 / aspects).floor().clamp(1.0, least as f64) as usize;
    let scaled: Vec<Image> = panels
        .iter()
        .map(|panel| panel.shrink((panel.width * height / panel.height).max(1), height))
        .collect();
    let mut whole = Image::white(scaled.iter().map(|panel| panel.width).sum::<usize>() + gaps, height);
    let mut left = 0;
    for panel in &scaled {
        for (row, pixels) in panel.pixels.chunks(panel.width).enumerate() {
            let start = row * whole.width + left;
            whole.pixels[start..start + panel.width].copy_from_slice(pixels);
        }
        left += panel.width + GAP;
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panels_of_one_height() {
        let grey = |width, height, value| {
            let mut image = Image::white(width, height);
            image.pixels.fill([value; 3]);
            image
        };
        let whole = side_by_side(&[grey(100, 100, 0), grey(400, 200, 100)], 174);
        // 150 pixels without the gap, aspects 1 and 2
        assert_eq!((whole.width, whole.height), (174, 50));
        assert_eq!([0, 49, 50, 73, 74, 173].map(|x| whole.pixels[x][0]), [0, 0, 255, 255, 100, 100]);
        // never enlarged
        assert_eq!(side_by_side(&[grey(10, 20, 0)], 1000).height, 20);
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a/b.png");
        whole.write(&path).expect("a file");
        let part = Image::read(&path).expect("an image").crop([40, 10, 40, 5]).expect("a part");
        assert_eq!([0, 10, 34].map(|x| part.pixels[x][0]), [0, 255, 100]);
        assert!(part.crop([0, 0, 41, 5]).is_err());
    }
}
