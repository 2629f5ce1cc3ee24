//! Pictures of cases, reduced so that all fit in one page.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::BufReader;
use std::path::{Path, PathBuf};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;

use crate::outcome::CaseOutcome;

/// Width of the widest picture, pixels; pages are about 900 wide, and finer pictures gain little.
const WIDTH: u32 = 1100;

/// Picture with its links.
#[derive(Clone, Serialize)]
pub struct ReportPicture {
    /// `data:image/png;base64,…`.
    pub data: String,
    /// Name of the file in words.
    pub caption: String,
    /// `ch2/dent`.
    pub case: String,
    /// Link to the case file.
    pub href: String,
    /// Case file, relative to the root.
    pub file: String,
    /// Command that draws it.
    pub command: String,
}

/// Reader of pictures; each appears in one place of the page only.
#[derive(Default)]
pub struct Gallery {
    shown: BTreeSet<PathBuf>,
}

impl Gallery {
    /// Returns the picture `name` among an outcome's results; `None` if there is no such file.
    pub fn picture(&mut self, outcome: &CaseOutcome, name: &str) -> Option<ReportPicture> {
        let path = outcome.output.join(name);
        let data = embed(&path)?;
        self.shown.insert(path);
        Some(ReportPicture {
            data,
            caption: words(name),
            case: outcome.case.clone(),
            href: outcome.href.clone(),
            file: outcome.file.clone(),
            command: outcome.command.clone(),
        })
    }

    /// Returns up to `most` pictures among an outcome's results that are not shown yet.
    pub fn rest(&mut self, outcome: &CaseOutcome, most: usize) -> Vec<ReportPicture> {
        let mut names = names(&outcome.output);
        names.retain(|name| !self.shown.contains(&outcome.output.join(name)));
        names.iter().take(most).filter_map(|name| self.picture(outcome, name)).collect()
    }
}

/// Lists the PNG files of a folder, in alphabetical order.
pub fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    names.retain(|name| name.ends_with(".png"));
    names.sort();
    names
}

/// Converts a file name to words: stages_dx-2mm_m-3.015_r-20mm.png → stages dx=2mm m=3.015 r=20mm.
fn words(name: &str) -> String {
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    stem.replace('_', " ")
}

/// Encodes a file as a data URI; PNG files are scaled down to [`WIDTH`].
pub fn embed(path: &Path) -> Option<String> {
    let bytes = fs::read(path).ok()?;
    if path.extension().is_some_and(|extension| extension == "svg") {
        return Some(format!("data:image/svg+xml;base64,{}", STANDARD.encode(bytes)));
    }
    let bytes = smaller(path).unwrap_or(bytes);
    Some(format!("data:image/png;base64,{}", STANDARD.encode(bytes)))
}

/// Scales a picture down and compresses it with a palette; `None` if the file is small enough.
fn smaller(path: &Path) -> Option<Vec<u8>> {
    let mut decoder = png::Decoder::new(BufReader::new(File::open(path).ok()?));
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().ok()?;
    let mut pixels = vec![0; reader.output_buffer_size()?];
    let info = reader.next_frame(&mut pixels).ok()?;
    if info.width <= WIDTH {
        return None;
    }
    let channels = info.color_type.samples();
    let height = (u64::from(info.height) * u64::from(WIDTH) / u64::from(info.width)).max(1) as u32;
    let source = (info.width as usize, info.height as usize);
    let scaled = average(&pixels, source, (WIDTH as usize, height as usize), channels);
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, WIDTH, height);
    encoder.set_color(info.color_type);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    encoder.write_header().ok()?.write_image_data(&scaled).ok()?;
    Some(bytes)
}

/// Averages pixels: each pixel of `target` is the mean of the pixels of `source` that it covers, weighted by
/// their covered part.
fn average(pixels: &[u8], source: (usize, usize), target: (usize, usize), channels: usize) -> Vec<u8> {
    let columns = spans(source.0, target.0);
    let rows = spans(source.1, target.1);
    let mut scaled = Vec::with_capacity(target.0 * target.1 * channels);
    for row in &rows {
        for column in &columns {
            for channel in 0..channels {
                let (mut sum, mut weights) = (0.0, 0.0);
                for &(y, weight_y) in row {
                    for &(x, weight_x) in column {
                        let weight = weight_x * weight_y;
                        sum += weight * f64::from(pixels[(y * source.0 + x) * channels + channel]);
                        weights += weight;
                    }
                }
                scaled.push((sum / weights).round() as u8);
            }
        }
    }
    scaled
}

/// Computes which of `from` pixels, and how much of each, every one of `to` pixels covers.
fn spans(from: usize, to: usize) -> Vec<Vec<(usize, f64)>> {
    let ratio = from as f64 / to as f64;
    let span = |k: usize| {
        let (low, high) = (k as f64 * ratio, (k + 1) as f64 * ratio);
        let last = (high.ceil() as usize).min(from);
        let cover = |x: usize| (x, high.min((x + 1) as f64) - low.max(x as f64));
        (low as usize..last).map(cover).filter(|(_, weight)| *weight > 1e-9).collect()
    };
    (0..to).map(span).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_of_what_is_covered() {
        // three grey pixels onto two: each covers one and a half
        assert_eq!(average(&[0, 90, 180], (3, 1), (2, 1), 1), [30, 150]);
        assert_eq!(average(&[10, 20, 30, 40], (2, 2), (1, 1), 1), [25]);
        // two channels stay apart
        assert_eq!(average(&[0, 100, 50, 200], (2, 1), (1, 1), 2), [25, 150]);
    }

    #[test]
    fn large_pictures_become_smaller_and_small_ones_stay() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.png");
        let write = |width: u32| {
            let mut encoder = png::Encoder::new(File::create(&path).expect("a file"), width, 2);
            encoder.set_color(png::ColorType::Rgb);
            let pixels = vec![77; width as usize * 6];
            encoder.write_header().and_then(|mut w| w.write_image_data(&pixels)).expect("a picture");
        };
        write(10);
        assert!(smaller(&path).is_none());
        write(3 * WIDTH);
        let bytes = smaller(&path).expect("a smaller one");
        let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().expect("a picture");
        let mut pixels = vec![0; reader.output_buffer_size().expect("a size")];
        let info = reader.next_frame(&mut pixels).expect("pixels");
        assert_eq!((info.width, info.height), (WIDTH, 1));
        assert!(pixels.iter().all(|&value| value == 77));
        assert!(embed(&path).is_some_and(|data| data.starts_with("data:image/png;base64,iVBOR")));
        assert!(embed(&folder.path().join("b.png")).is_none());
    }
}
