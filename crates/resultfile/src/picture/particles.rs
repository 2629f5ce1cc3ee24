//! Drawing of particles as whole pixels.

use super::blocks::{ParticleBlock, ParticleBlocks};
use polycore::numerics::{bounds, range};

/// The part of the plane that is drawn, and its resolution.
#[derive(Clone, Copy, Debug)]
pub(super) struct PixelWindow {
    /// Lower left corner.
    pub(super) low: [f64; 2],
    /// Upper right corner.
    pub(super) high: [f64; 2],
    /// Pixels per unit of length; a lattice spacing is a whole number of pixels, or a whole number of
    /// spacings is a pixel: any other ratio beats with the lattice (moiré).
    pub(super) scale: f64,
}

/// The mean value of the particles in each pixel, row by row from the top; none where there is no particle.
pub(super) struct Raster {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) values: Vec<Option<f64>>,
}

/// A picture may exceed the asked size by this factor for the sake of whole pixels.
const SLACK: f64 = 1.5;

impl PixelWindow {
    /// Around all particles, about `size` pixels in its longer direction; none if a position is not finite.
    pub(super) fn around(positions: &[[f64; 2]], spacing: f64, size: f64) -> Option<Self> {
        if !positions.iter().flatten().all(|x| x.is_finite()) {
            return None;
        }
        let [low, high] = bounds(positions.iter().copied());
        let (low, high) = (low.map(|x| x - spacing / 2.0), high.map(|x| x + spacing / 2.0));
        let extent = (high[0] - low[0]).max(high[1] - low[1]) / spacing;
        let up = (size / extent).ceil();
        let pixels = if up * extent <= SLACK * size {
            up
        } else if extent <= size {
            (size / extent).floor()
        } else {
            1.0 / (extent / (SLACK * size)).ceil()
        };
        (extent.is_finite() && pixels > 0.0).then_some(Self { low, high, scale: pixels / spacing })
    }

    /// Adds a rim of a part `share` of the longer side, a whole number of pixels.
    pub(super) fn widened(self, share: f64) -> Self {
        let longer = (self.high[0] - self.low[0]).max(self.high[1] - self.low[1]);
        let rim = (share * longer * self.scale).round() / self.scale;
        Self { low: self.low.map(|x| x - rim), high: self.high.map(|x| x + rim), ..self }
    }

    /// Returns the centre of a pixel.
    pub(super) fn pixel_centre(&self, column: usize, row: usize) -> [f64; 2] {
        let [across, down] = [column, row].map(|pixel| (pixel as f64 + 0.5) / self.scale);
        [self.low[0] + across, self.high[1] - down]
    }

    fn pixels(&self) -> [usize; 2] {
        [0, 1].map(|axis| (((self.high[axis] - self.low[axis]) * self.scale).round() as usize).max(1))
    }

    pub(super) fn draw(&self, positions: &[[f64; 2]], values: &[f64], blocks: &ParticleBlocks) -> Raster {
        let [width, height] = self.pixels();
        let mut sums = vec![(0.0, 0u32); width * height];
        for ((position, value), block) in positions.iter().zip(values).zip(&blocks.0) {
            let mut add = |at: usize| sums[at] = (sums[at].0 + value, sums[at].1 + 1);
            match block {
                ParticleBlock::Upright(reach) => {
                    // y runs downwards in pictures
                    let x = self.span((position[0] - self.low[0], [reach[0], reach[1]]), width);
                    let y = self.span((self.high[1] - position[1], [reach[3], reach[2]]), height);
                    y.for_each(|row| x.clone().for_each(|column| add(row * width + column)));
                }
                ParticleBlock::Cell(corners) => self.cell(*position, corners, [width, height], add),
            }
        }
        let mean = |&(sum, count): &(f64, u32)| (count > 0).then(|| sum / f64::from(count));
        let mut raster = Raster { width, height, values: sums.iter().map(mean).collect() };
        // strongly sheared ones leave some that are wider than a pixel
        for _ in 0..3 {
            raster.close_pinholes();
        }
        raster
    }

    /// The pixels whose centres lie in a quadrilateral, and the one that holds its particle.
    fn cell(
        &self,
        position: [f64; 2],
        corners: &[[f64; 2]; 4],
        [width, height]: [usize; 2],
        mut add: impl FnMut(usize),
    ) {
        let place = |p: [f64; 2]| [(p[0] - self.low[0]) * self.scale, (self.high[1] - p[1]) * self.scale];
        let pixel = |x: f64, limit: usize| (x.max(0.0) as usize).min(limit - 1);
        let [x, y] = place(position);
        let middle = [pixel(x, width), pixel(y, height)];
        let corners = corners.map(place);
        let ends = |axis: usize, limit: usize| {
            let along = corners.map(|corner| corner[axis]);
            let [low, high] = range(along);
            pixel(low, limit)..=pixel(high, limit)
        };
        for row in ends(1, height) {
            for column in ends(0, width) {
                let centre = [column as f64 + 0.5, row as f64 + 0.5];
                let [a, b, c, d] = corners;
                if [column, row] == middle || inside([a, b, c], centre) || inside([a, c, d], centre) {
                    add(row * width + column);
                }
            }
        }
    }

    /// The pixels of a block; at least the one with its centre.
    fn span(&self, (centre, [before, after]): (f64, [f64; 2]), limit: usize) -> std::ops::Range<usize> {
        let edge = |x: f64| (x * self.scale + 1e-6).round().max(0.0) as usize;
        let (start, end) = (edge(centre - before), edge(centre + after));
        let middle = ((centre * self.scale).max(0.0) as usize).min(limit - 1);
        if end > start && self.scale * (before + after) >= 1.0 - 1e-6 {
            start.min(limit)..end.min(limit)
        } else {
            middle..middle + 1
        }
    }
}

/// Returns whether a triangle, edges included, contains a point.
fn inside(triangle: [[f64; 2]; 3], point: [f64; 2]) -> bool {
    let side = |k: usize| {
        let ([a, b], [c, d]) = (triangle[k], triangle[(k + 1) % 3]);
        (c - a) * (point[1] - b) - (d - b) * (point[0] - a)
    };
    let sides = [side(0), side(1), side(2)];
    sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0)
}

impl Raster {
    /// ParticleBlocks are upright, so a sheared lattice leaves single pixels open between them.
    fn close_pinholes(&mut self) {
        let (width, height) = (self.width, self.height);
        let before = self.values.clone();
        for y in 1..height.saturating_sub(1) {
            for x in 1..width.saturating_sub(1) {
                let at = y * width + x;
                if before[at].is_none() {
                    let around = [at - 1, at + 1, at - width, at + width].map(|other| before[other]);
                    let known: Vec<f64> = around.into_iter().flatten().collect();
                    if known.len() >= 3 {
                        self.values[at] = Some(known.iter().sum::<f64>() / known.len() as f64);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lattice(columns: usize, rows: usize, map: impl Fn(f64, f64) -> [f64; 2]) -> Vec<[f64; 2]> {
        (0..rows)
            .flat_map(|j| (0..columns).map(move |i| (i, j)))
            .map(|(i, j)| map(i as f64, j as f64))
            .collect()
    }

    fn draw(positions: &[[f64; 2]], values: &[f64], size: f64) -> Raster {
        let blocks = ParticleBlocks::new(positions, None, 1.0, 1.5);
        PixelWindow::around(positions, 1.0, size).unwrap().draw(positions, values, &blocks)
    }

    /// Each particle of a regular lattice is the same number of pixels: no moiré, whatever its size.
    #[test]
    fn lattices_are_exact() {
        for (columns, rows) in [(7, 5), (97, 31), (360, 2), (361, 3), (719, 4)] {
            // positions with rounding errors, as real ones have
            let positions = lattice(columns, rows, |i, j| [0.1 + i * 0.1 / 0.1, (j * 0.7) / 0.7 - 12.3]);
            let values: Vec<f64> = (0..columns * rows).map(|index| index as f64).collect();
            let raster = draw(&positions, &values, 720.0);
            let pixels = raster.width / columns;
            assert_eq!((raster.width, raster.height), (pixels * columns, pixels * rows), "{columns} {rows}");
            assert!((400..=1080).contains(&raster.width), "{columns}: {}", raster.width);
            for (at, value) in raster.values.iter().enumerate() {
                let (x, y) = (at % raster.width / pixels, at / raster.width / pixels);
                assert_eq!(*value, Some(((rows - 1 - y) * columns + x) as f64));
            }
        }
    }

    /// More particles than pixels: every pixel is the mean of the same number of particles.
    #[test]
    fn fine_lattices_are_averaged() {
        let positions = lattice(3000, 6, |i, j| [i, j]);
        let values: Vec<f64> =
            positions.iter().map(|p| if p[0] as i64 % 3 == 0 { 3.0 } else { 0.0 }).collect();
        let raster = draw(&positions, &values, 720.0);
        assert_eq!((raster.width, raster.height), (1000, 2));
        assert!(raster.values.iter().all(|value| *value == Some(1.0)));
    }

    #[test]
    fn deformed_lattices_have_no_gaps_but_cracks_stay_open() {
        for map in [
            |i: f64, j: f64| [1.013 * i, 1.31 * j],
            |i: f64, j: f64| [i + 0.3 * j, j],
            |i: f64, j: f64| [0.9 * i + 0.002 * i * j, 0.8 * j],
        ] {
            let positions = lattice(60, 40, map);
            let raster = draw(&positions, &vec![1.0; positions.len()], 720.0);
            for row in raster.values.chunks(raster.width) {
                let first = row.iter().position(Option::is_some).unwrap();
                let last = row.iter().rposition(Option::is_some).unwrap();
                assert!(row[first..=last].iter().all(Option::is_some));
            }
        }
        let positions = lattice(60, 40, |i, j| [i, if j < 20.0 { j } else { j + 2.0 }]);
        let raster = draw(&positions, &vec![1.0; positions.len()], 720.0);
        let pixels = raster.width / 60;
        let open = raster.values.iter().step_by(raster.width).filter(|value| value.is_none()).count();
        assert_eq!(open, 2 * pixels);
    }

    /// Deformed cells of a lattice, where upright blocks leave holes: stretched to the double, sheared,
    /// turned, and bent.
    #[test]
    fn deformed_cells_have_no_holes() {
        let rest = lattice(60, 40, |i, j| [i, j]);
        let turn = |x: f64, y: f64, angle: f64| {
            [x * angle.cos() - y * angle.sin(), x * angle.sin() + y * angle.cos()]
        };
        let maps: [&dyn Fn(f64, f64) -> [f64; 2]; 4] = [
            &|i, j| turn(0.7 * i, 2.0 * j, 0.5),
            &|i, j| [i + 1.3 * j, 0.8 * j + 0.4 * i],
            &|i, j| turn(i, j, 0.9),
            &|i, j| turn(0.0, 30.0 + 2.5 * j, 0.02 * i),
        ];
        for map in maps {
            let positions: Vec<[f64; 2]> = rest.iter().map(|p| map(p[0], p[1])).collect();
            let blocks = ParticleBlocks::new(&positions, Some(&rest), 1.0, 3.0);
            let raster = PixelWindow::around(&positions, 1.0, 720.0).unwrap();
            let raster = raster.draw(&positions, &vec![1.0; positions.len()], &blocks);
            for row in raster.values.chunks(raster.width) {
                // a turned body has its corners within the outermost rows
                let Some(first) = row.iter().position(Option::is_some) else { continue };
                let last = row.iter().rposition(Option::is_some).unwrap_or(first);
                assert!(row[first..=last].iter().all(Option::is_some));
            }
        }
    }

    /// A crack of a stretched sheet is drawn open, and a lattice at rest as upright blocks.
    #[test]
    fn deformed_cells_show_cracks() {
        let rest = lattice(60, 40, |i, j| [i, j]);
        let torn: Vec<[f64; 2]> =
            rest.iter().map(|p| [p[0], 1.5 * p[1] + if p[1] < 20.0 { 0.0 } else { 3.0 }]).collect();
        let draw = |positions: &[[f64; 2]]| {
            let blocks = ParticleBlocks::new(positions, Some(&rest), 1.0, 4.0);
            let values: Vec<f64> = (0..positions.len()).map(|index| index as f64).collect();
            PixelWindow::around(positions, 1.0, 720.0).unwrap().draw(positions, &values, &blocks)
        };
        let raster = draw(&torn);
        let open = raster.values.iter().step_by(raster.width).filter(|value| value.is_none()).count();
        let pixels = (raster.width / 60) as f64;
        assert!((open as f64 - 3.0 * pixels).abs() <= 1.0, "{open} of {pixels}");
        let whole = draw(&rest);
        let values: Vec<f64> = (0..rest.len()).map(|index| index as f64).collect();
        assert_eq!(whole.values, self::draw(&rest, &values, 720.0).values);
    }

    #[test]
    fn odd_inputs() {
        assert!(PixelWindow::around(&[[0.0, f64::NAN]], 1.0, 100.0).is_none());
        assert!(PixelWindow::around(&[], 1.0, 100.0).is_none());
        assert!(PixelWindow::around(&[[0.0, 0.0], [1e308, 0.0]], 1e-9, 100.0).is_none());
        let raster = draw(&[[5.0, 5.0]], &[2.0], 100.0);
        assert!(raster.values.iter().all(|value| *value == Some(2.0)) && raster.width == 100);
        let raster = draw(&[[0.0, 0.0], [1e6, 1e6]], &[1.0, 2.0], 100.0);
        assert_eq!(raster.values.iter().flatten().count(), 2);
        let raster = draw(&[[0.0, 0.0], [0.0, 0.0]], &[1.0, 2.0], 10.0);
        assert!(raster.values.iter().all(|value| *value == Some(1.5)));
    }
}
