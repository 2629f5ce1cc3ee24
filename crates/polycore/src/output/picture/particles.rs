//! From particles to whole pixels.

/// The part of the plane that is drawn, and its resolution.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    /// Lower left corner.
    pub(super) low: [f64; 2],
    /// Upper right corner.
    pub(super) high: [f64; 2],
    /// Pixels per unit of length; a lattice spacing is a whole number of pixels, or a whole number of spacings is a
    /// pixel: any other ratio beats with the lattice (moiré).
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

impl Window {
    /// Around all particles, about `size` pixels in its longer direction; none if a position is not finite.
    pub(super) fn around(positions: &[[f64; 2]], spacing: f64, size: f64) -> Option<Self> {
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for position in positions {
            for axis in 0..2 {
                if !position[axis].is_finite() {
                    return None;
                }
                low[axis] = low[axis].min(position[axis] - spacing / 2.0);
                high[axis] = high[axis].max(position[axis] + spacing / 2.0);
            }
        }
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

    fn pixels(&self) -> [usize; 2] {
        [0, 1].map(|axis| (((self.high[axis] - self.low[axis]) * self.scale).round() as usize).max(1))
    }

    pub(super) fn draw(&self, positions: &[[f64; 2]], values: &[f64], spacing: f64, bridge: f64) -> Raster {
        let [width, height] = self.pixels();
        let mut sums = vec![(0.0, 0u32); width * height];
        let reach = reach(positions, spacing, bridge);
        for ((position, value), reach) in positions.iter().zip(values).zip(&reach) {
            // y runs downwards in pictures
            let x = self.span((position[0] - self.low[0], [reach[0], reach[1]]), width);
            let y = self.span((self.high[1] - position[1], [reach[3], reach[2]]), height);
            for row in y {
                for pixel in &mut sums[row * width..][x.clone()] {
                    *pixel = (pixel.0 + value, pixel.1 + 1);
                }
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

impl Raster {
    /// Blocks are upright, so a sheared lattice leaves single pixels open between them.
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

/// How far each particle's block reaches to the left, right, down and up: half the way to its neighbour there, or half
/// a spacing where the next one is farther than `bridge` spacings (a surface, a hole, a crack).
fn reach(positions: &[[f64; 2]], spacing: f64, bridge: f64) -> Vec<[f64; 4]> {
    let far = spacing * bridge.max(1.0) * (1.0 + 1e-9);
    let cells = Cells::new(positions, far);
    let nearest = |position: &[f64; 2]| {
        let mut gaps = [f64::INFINITY; 4];
        cells.around(position, |other| {
            let d = [other[0] - position[0], other[1] - position[1]];
            for axis in 0..2 {
                let (along, across) = (d[axis].abs(), d[1 - axis].abs());
                // a neighbour in this direction and not a diagonal one
                if across <= 0.6 * along && along > 1e-3 * spacing {
                    let side = 2 * axis + usize::from(d[axis] > 0.0);
                    gaps[side] = gaps[side].min(along);
                }
            }
        });
        gaps.map(|gap| if gap <= far { gap / 2.0 } else { spacing / 2.0 })
    };
    positions.iter().map(nearest).collect()
}

/// Particles sorted into square cells.
struct Cells<'a> {
    positions: &'a [[f64; 2]],
    low: [f64; 2],
    size: f64,
    count: [usize; 2],
    starts: Vec<usize>,
    order: Vec<usize>,
}

impl<'a> Cells<'a> {
    fn new(positions: &'a [[f64; 2]], size: f64) -> Self {
        let fold = |axis: usize, start: f64, pick: fn(f64, f64) -> f64| {
            positions.iter().fold(start, |bound, position| pick(bound, position[axis]))
        };
        let low = [0, 1].map(|axis| fold(axis, f64::INFINITY, f64::min));
        let extent = [0, 1].map(|axis| fold(axis, f64::NEG_INFINITY, f64::max) - low[axis]);
        // scattered particles must not ask for more cells than there are particles
        let most = (4.0 * positions.len() as f64).sqrt() + 1.0;
        let size = size.max(extent[0] / most).max(extent[1] / most);
        let count = extent.map(|extent| (extent / size) as usize + 1);
        let mut cells =
            Self { positions, low, size, count, starts: vec![0; count[0] * count[1] + 1], order: vec![] };
        let homes: Vec<usize> = positions.iter().map(|position| cells.index(cells.home(position))).collect();
        for &home in &homes {
            cells.starts[home + 1] += 1;
        }
        for cell in 1..cells.starts.len() {
            cells.starts[cell] += cells.starts[cell - 1];
        }
        let mut next = cells.starts.clone();
        cells.order = vec![0; positions.len()];
        for (particle, &home) in homes.iter().enumerate() {
            cells.order[next[home]] = particle;
            next[home] += 1;
        }
        cells
    }

    fn home(&self, position: &[f64; 2]) -> [usize; 2] {
        [0, 1]
            .map(|axis| (((position[axis] - self.low[axis]) / self.size) as usize).min(self.count[axis] - 1))
    }

    fn index(&self, home: [usize; 2]) -> usize {
        home[1] * self.count[0] + home[0]
    }

    fn around(&self, position: &[f64; 2], mut each: impl FnMut(&[f64; 2])) {
        let home = self.home(position);
        for row in home[1].saturating_sub(1)..=(home[1] + 1).min(self.count[1] - 1) {
            let first = self.index([home[0].saturating_sub(1), row]);
            let last = self.index([(home[0] + 1).min(self.count[0] - 1), row]);
            for &particle in &self.order[self.starts[first]..self.starts[last + 1]] {
                each(&self.positions[particle]);
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
        Window::around(positions, 1.0, size).unwrap().draw(positions, values, 1.0, 1.5)
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

    #[test]
    fn odd_inputs() {
        assert!(Window::around(&[[0.0, f64::NAN]], 1.0, 100.0).is_none());
        assert!(Window::around(&[], 1.0, 100.0).is_none());
        assert!(Window::around(&[[0.0, 0.0], [1e308, 0.0]], 1e-9, 100.0).is_none());
        let raster = draw(&[[5.0, 5.0]], &[2.0], 100.0);
        assert!(raster.values.iter().all(|value| *value == Some(2.0)) && raster.width == 100);
        let raster = draw(&[[0.0, 0.0], [1e6, 1e6]], &[1.0, 2.0], 100.0);
        assert_eq!(raster.values.iter().flatten().count(), 2);
        let raster = draw(&[[0.0, 0.0], [0.0, 0.0]], &[1.0, 2.0], 10.0);
        assert!(raster.values.iter().all(|value| *value == Some(1.5)));
    }
}
