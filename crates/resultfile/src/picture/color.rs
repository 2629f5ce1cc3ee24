//! Colours of fields.

use std::sync::LazyLock;

use kuva::plot::ColorMap as Kuva;

/// Map from numbers to colours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColorMap {
    /// Dark blue to yellow, perceptually uniform, legible in grey and to the colour-blind.
    #[default]
    Viridis,
    /// Dark violet over red to light yellow, perceptually uniform: temperatures.
    Inferno,
    /// Blue over white to red, for signed numbers; symmetric about zero unless a range is set.
    Diverging,
}

/// Colour of points without a number.
pub(super) const MISSING: [u8; 3] = [190, 190, 190];
/// Colour of rigid bodies.
pub(super) const RIGID: [u8; 3] = [222, 222, 222];

type ColorTable = [[u8; 3]; 256];

static VIRIDIS: LazyLock<ColorTable> = LazyLock::new(|| table(&Kuva::Viridis, 0.0, 1.0));
// without its black, which is no colour of anything
static INFERNO: LazyLock<ColorTable> = LazyLock::new(|| table(&Kuva::Inferno, 0.15, 1.0));
// the scheme runs from red to blue; hot is positive
static DIVERGING: LazyLock<ColorTable> = LazyLock::new(|| table(&Kuva::RedBlue, 1.0, 0.0));

impl ColorMap {
    /// Returns the colour at `share` between 0 and 1 (clamped); grey for NaN.
    pub(super) fn color_at(self, share: f64) -> [u8; 3] {
        if share.is_nan() {
            return MISSING;
        }
        let table = match self {
            Self::Viridis => &*VIRIDIS,
            Self::Inferno => &*INFERNO,
            Self::Diverging => &*DIVERGING,
        };
        table[(share.clamp(0.0, 1.0) * 255.0).round() as usize]
    }
}

/// Returns a part of a scheme.
fn table(map: &Kuva, from: f64, to: f64) -> ColorTable {
    std::array::from_fn(|index| {
        // none only for custom maps
        map.map_rgb(from + (to - from) * index as f64 / 255.0).map_or(MISSING, |(r, g, b)| [r, g, b])
    })
}
