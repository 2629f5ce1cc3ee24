//! Animations of images of one size: animated PNG, GIF, and MP4 by `ffmpeg`.

use std::ffi::OsStr;
use std::io::{ErrorKind, Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};

use super::canvas::{Canvas, animated_png};
use super::field::FieldMap;
use super::picture_error;
use polycore::Error;
use polycore::file::atomic_write;

/// Program that writes MP4.
const FFMPEG: &str = "ffmpeg";
/// Speed with which colours of a GIF are chosen: 1 is the best, 30 the fastest.
const SPEED: i32 = 3;
/// Characters of a message of `ffmpeg` at most.
const MESSAGE: usize = 400;

/// The last map of an animation is shown so many times as long.
const REST: u16 = 20;

/// Time of frames.
#[derive(Clone, Copy, Debug)]
pub(super) struct FilmPace {
    /// Time of a frame, s.
    pub seconds: f64,
    /// The last is shown so many times as long.
    pub rest: u16,
}

impl FieldMap<'_> {
    /// Writes maps of one window, given to the second argument of `frame`, one after another into an animated
    /// `.png`, a `.gif`, or, by `ffmpeg`, an `.mp4`, each for some `seconds`. It rests on the last, and
    /// repeats without end but as MP4.
    ///
    /// # Errors
    /// Errors of `frame`; as [`Self::write`]; for MP4 no `ffmpeg` on the PATH, or its message.
    pub fn animate(
        path: impl AsRef<Path>,
        frames: usize,
        seconds: f64,
        mut frame: impl FnMut(usize, &mut dyn FnMut(&FieldMap<'_>)) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let path = path.as_ref();
        let mut size = None;
        let bytes = film(path, frames, FilmPace { seconds, rest: REST }, |index| {
            let mut drawn = Err("there is no map".to_owned());
            frame(index, &mut |map| drawn = map.canvas())?;
            let canvas = drawn.map_err(|reason| picture_error(path, reason))?;
            let size = *size.get_or_insert([canvas.width, canvas.height]);
            Ok(if size == [canvas.width, canvas.height] { canvas } else { canvas.on_sheet(size) })
        })?;
        atomic_write(path, |file| file.write_all(&bytes))
    }
}

/// Returns images of one size as an animation of the kind of `path`: GIF (`.gif`), MP4 (`.mp4`), else an
/// animated PNG. Those but MP4 repeat without end.
///
/// # Errors
/// Errors of `frame`; no frame; images that cannot be encoded; for MP4 no `ffmpeg` on the PATH, or its
/// message.
pub(super) fn film(
    path: &Path,
    frames: usize,
    pace: FilmPace,
    frame: impl FnMut(usize) -> Result<Canvas, Error>,
) -> Result<Vec<u8>, Error> {
    if frames == 0 {
        return Err(picture_error(path, "there is no frame"));
    }
    match path.extension().and_then(OsStr::to_str) {
        Some("gif") => gif(path, frames, pace, frame),
        Some("mp4") => mp4(path, frames, pace, frame),
        _ => animated_png(path, frames, pace.seconds, pace.rest, frame),
    }
}

fn gif(
    path: &Path,
    frames: usize,
    FilmPace { seconds, rest }: FilmPace,
    mut frame: impl FnMut(usize) -> Result<Canvas, Error>,
) -> Result<Vec<u8>, Error> {
    let text = |error: gif::EncodingError| picture_error(path, error);
    let mut last = frame(0)?;
    let [width, height] = [last.width, last.height].map(u16::try_from);
    let (Ok(width), Ok(height)) = (width, height) else {
        return Err(picture_error(path, format!("{} × {} pixels are too many", last.width, last.height)));
    };
    let mut encoder = gif::Encoder::new(Vec::new(), width, height, &[]).map_err(text)?;
    encoder.set_repeat(gif::Repeat::Infinite).map_err(text)?;
    let delay = (100.0 * seconds).round().clamp(2.0, 6000.0) as u16;
    let mut part = [0, 0, last.width, last.height];
    for index in 0..frames {
        if index > 0 {
            let next = frame(index)?.sized_as(&last, path, index)?;
            // what changes only
            part = next.difference(&last);
            last = next;
        }
        // the sides of a picture whose sides fit do so as well
        let [left, top, width, height] = part.map(|size| u16::try_from(size).unwrap_or(u16::MAX));
        let pixels = last.bytes_within(part);
        let rest = if index + 1 == frames { rest } else { 1 };
        let image = gif::Frame {
            left,
            top,
            delay: delay.saturating_mul(rest),
            ..gif::Frame::from_rgb_speed(width, height, &pixels, SPEED)
        };
        encoder.write_frame(&image).map_err(text)?;
    }
    encoder.into_inner().map_err(text)
}

/// Sends the images to `ffmpeg`, which writes a file beside `path`.
fn mp4(
    path: &Path,
    frames: usize,
    FilmPace { seconds, rest }: FilmPace,
    mut frame: impl FnMut(usize) -> Result<Canvas, Error>,
) -> Result<Vec<u8>, Error> {
    let fail = |reason: String| picture_error(path, reason);
    let first = frame(0)?;
    let (size, rate) = (format!("{}x{}", first.width, first.height), format!("{}", 1.0 / seconds));
    let part = path.with_extension("part.mp4");
    let mut command = Command::new(FFMPEG);
    command.args(["-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24"]);
    command.args(["-s", &size, "-r", &rate, "-i", "-", "-an", "-c:v", "libx264", "-pix_fmt", "yuv420p"]);
    // sides of an even number of pixels, and players that begin before all is read
    command.args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white", "-movflags", "+faststart"]).arg(&part);
    command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut running = command.spawn().map_err(|error| match error.kind() {
        ErrorKind::NotFound => fail(format!("there is no `{FFMPEG}` on the PATH")),
        _ => fail(format!("`{FFMPEG}`: {error}")),
    })?;
    let (input, messages) = (running.stdin.take(), running.stderr.take());
    // read beside, so that a long message does not hold it up
    let reading = std::thread::spawn(move || {
        let mut text = String::new();
        messages.map(|mut pipe| pipe.read_to_string(&mut text));
        text
    });
    let mut drawn = Ok(());
    if let Some(mut input) = input {
        for index in 0..frames {
            let next = if index == 0 { Ok(first.clone()) } else { frame(index) };
            match next.and_then(|next| next.sized_as(&first, path, index)) {
                Ok(next) => {
                    let times = if index + 1 == frames { rest } else { 1 };
                    let pixels = next.bytes_within([0, 0, next.width, next.height]);
                    // a program that has ended says why
                    if (0..times).any(|_| input.write_all(&pixels).is_err()) {
                        break;
                    }
                }
                Err(error) => {
                    drawn = Err(error);
                    break;
                }
            }
        }
    }
    let ended = running.wait().map_err(|error| fail(format!("`{FFMPEG}`: {error}")))?;
    let message: String = reading.join().unwrap_or_default().trim().chars().take(MESSAGE).collect();
    let bytes = drawn.and_then(|()| match ended.success() {
        true => std::fs::read(&part).map_err(Error::from_io("read", &part)),
        false => Err(fail(format!("`{FFMPEG}` ended with {ended}: {message}"))),
    });
    // whole or not at all
    let _ = std::fs::remove_file(&part);
    bytes
}

#[cfg(test)]
mod tests {
    use super::super::canvas::Color;
    use super::*;

    /// A canvas with a bar that moves, of a few colours.
    fn frame(index: usize) -> Canvas {
        let mut canvas = Canvas::new(40, 30);
        canvas.rectangle(2 + 3 * index as isize, 4, 6, 20, [200, 30 * index as u8, 7]);
        canvas.rectangle(0, 28, 40, 2, [0, 0, 90]);
        canvas
    }

    /// The frames of a GIF, drawn over each other, are the images: few colours are exact.
    #[test]
    fn gifs_hold_their_frames() {
        let pace = FilmPace { seconds: 0.1, rest: 5 };
        let bytes = film(Path::new("a.gif"), 4, pace, |k| Ok(frame(k))).unwrap();
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let mut decoder = options.read_info(&bytes[..]).unwrap();
        assert_eq!((decoder.width(), decoder.height(), decoder.repeat()), (40, 30, gif::Repeat::Infinite));
        let mut shown = Canvas::new(40, 30);
        for index in 0..4 {
            let image = decoder.read_next_frame().unwrap().unwrap();
            assert_eq!(image.delay, if index == 3 { 50 } else { 10 });
            for (at, pixel) in image.buffer.chunks(4).enumerate() {
                let (x, y) = (at % usize::from(image.width), at / usize::from(image.width));
                let color: Color = [pixel[0], pixel[1], pixel[2]];
                shown.set(
                    (x + usize::from(image.left)) as isize,
                    (y + usize::from(image.top)) as isize,
                    color,
                );
            }
            assert!(shown.encode() == frame(index).encode(), "frame {index}");
        }
        assert!(decoder.read_next_frame().unwrap().is_none());
    }

    #[test]
    fn films_of_frames_of_one_size_only() {
        let pace = FilmPace { seconds: 0.1, rest: 5 };
        for kind in ["a.gif", "a.png"] {
            let other = |k: usize| Ok(if k == 2 { Canvas::new(41, 30) } else { frame(k) });
            let error = film(Path::new(kind), 4, pace, other).unwrap_err().to_string();
            assert!(error.contains("frame 2 has another size"), "{error}");
            let none = film(Path::new(kind), 0, pace, |k| Ok(frame(k))).unwrap_err().to_string();
            assert!(none.contains("there is no frame"), "{none}");
        }
    }
}
