//! The colour bar beside a field.

use super::axis::{labels, ticks};
use super::canvas::{BLACK, Canvas, LabelAnchor, Text};
use super::color::ColorMap;

/// Sizes of letters: of a bar's name, of its ticks.
pub(super) const LABEL: u32 = 25;
pub(super) const TICK: u32 = 22;
const BAR_WIDTH: usize = 26;
pub(super) const TICK_LENGTH: isize = 8;
pub(super) const LINE: isize = 2;

/// The colour bar with its ticks.
pub(super) struct ColorBar {
    ticks: Vec<(f64, Text)>,
    label: Text,
    below: bool,
    above: bool,
    /// Title of the colour bar.
    pub(super) width: usize,
    pub(super) height: usize,
}

impl ColorBar {
    /// Creates a bar for `low` to `high`; `beyond` says whether some values lie below, above.
    pub(super) fn new(
        label: &str,
        (low, high): (f64, f64),
        [below, above]: [bool; 2],
        height: usize,
    ) -> Result<Self, String> {
        let positions = ticks(low, high, (height / 70).clamp(3, 9));
        let texts =
            labels(&positions).iter().map(|text| Text::new(text, TICK)).collect::<Result<Vec<_>, _>>()?;
        let widest = texts.iter().map(|text| text.width).max().unwrap_or(0);
        let beside = if label.is_empty() { 0 } else { LABEL as usize * 3 / 2 + 8 };
        let label = Text::new(label, LABEL)?;
        Ok(Self {
            ticks: positions.iter().map(|tick| (tick - low) / (high - low)).zip(texts).collect(),
            below,
            above,
            width: BAR_WIDTH + TICK_LENGTH as usize + 8 + widest + beside,
            height: height.max(label.width),
            label,
        })
    }

    pub(super) fn draw(&self, canvas: &mut Canvas, x: isize, y: isize, colors: ColorMap) {
        let (width, height) = (BAR_WIDTH as isize, self.height as isize);
        // points at the ends say that there are values beyond
        let (top, bottom) = (if self.above { width } else { 0 }, if self.below { width } else { 0 });
        let (start, length) = (y + top, height - top - bottom);
        for row in 0..length {
            let share = 1.0 - (row as f64 + 0.5) / length as f64;
            canvas.rectangle(x, start + row, width, 1, colors.color_at(share));
        }
        canvas.frame(x, start, width, length, LINE, BLACK);
        for (there, base, direction, share) in
            [(self.above, start - LINE, -1, 1.0), (self.below, start + length + LINE, 1, 0.0)]
        {
            if there {
                for step in 0..width / 2 {
                    let row = if direction < 0 { base - 1 - step } else { base + step };
                    canvas.rectangle(x + step, row, width - 2 * step, 1, colors.color_at(share));
                    for edge in [x + step, x + width - 1 - step] {
                        canvas.rectangle(edge - 1, row, LINE + 1, 1, BLACK);
                    }
                }
            }
        }
        for (share, text) in &self.ticks {
            let at = start + ((1.0 - share) * length as f64).round() as isize;
            let at = at.clamp(start, start + length - 1);
            canvas.rectangle(x + width + LINE, at - LINE / 2, TICK_LENGTH, LINE, BLACK);
            canvas.text(x + width + LINE + TICK_LENGTH + 6, at, text, LabelAnchor::Left);
        }
        let far = x + self.width as isize - LABEL as isize * 3 / 4;
        canvas.text(far, start + length / 2, &self.label, LabelAnchor::Upwards);
    }
}
