use super::*;

/// Points and cells of a box of n cells, by a map of the lattice of unit cells.
fn brick(n: [usize; 3], map: impl Fn([f64; 3]) -> [f64; 3]) -> (Vec<[f64; 3]>, Vec<[u32; 8]>) {
    let [nx, ny, nz] = n;
    let node = |i: usize, j: usize, k: usize| (i + (nx + 1) * (j + (ny + 1) * k)) as u32;
    let mut points = Vec::new();
    for k in 0..=nz {
        for j in 0..=ny {
            points.extend((0..=nx).map(|i| map([i as f64, j as f64, k as f64])));
        }
    }
    let mut cells = Vec::new();
    for k in 0..nz {
        for j in 0..ny {
            for i in 0..nx {
                let face = |k| [node(i, j, k), node(i + 1, j, k), node(i + 1, j + 1, k), node(i, j + 1, k)];
                let ([a, b, c, d], [e, f, g, h]) = (face(k), face(k + 1));
                cells.push([a, b, c, d, e, f, g, h]);
            }
        }
    }
    (points, cells)
}

/// Boxes of an edge that fill a box from the origin.
fn particles(n: [usize; 3], edge: [f64; 3]) -> Vec<Cuboid> {
    let of = |index: usize| {
        let at = [index % n[0], index / n[0] % n[1], index / (n[0] * n[1])];
        Cuboid {
            min: std::array::from_fn(|d| at[d] as f64 * edge[d]),
            max: std::array::from_fn(|d| (at[d] + 1) as f64 * edge[d]),
        }
    };
    (0..n.iter().product()).map(of).collect()
}

/// Cells of 1 mm to particles of 0.7 mm.
#[test]
fn cells_to_particles() {
    let (points, cells) = brick([7, 1, 1], |p| p);
    let boxes = particles([10, 1, 1], [0.7, 1.0, 1.0]);
    let overlap = Overlap::new(&points, &cells, &boxes).unwrap();
    let values = [1.0, 3.0, 2.0, 5.0, 4.0, 7.0, 6.0];
    let means: Vec<f64> = overlap.from_cells(&values).unwrap().into_iter().flatten().collect();
    for (index, expected) in [(1, 2.142_857), (4, 4.142_857), (5, 4.714_286)] {
        assert!((means[index] - expected).abs() < 1e-6, "{index}: {}", means[index]);
    }
    let sum: f64 = means.iter().map(|mean| 0.7 * mean).sum();
    assert!((sum - 28.0).abs() < 28.0 * 1e-14, "{sum}");
    // and back
    let back: Vec<f64> = overlap.to_cells(&means).unwrap().into_iter().flatten().collect();
    assert!((back.iter().sum::<f64>() - 28.0).abs() < 28.0 * 1e-14);
    assert_eq!(
        overlap.from_cells(&[1.0; 3]).unwrap_err().to_string(),
        "a field to transfer: 3 values for 7 cells"
    );
}

/// A box that touches a cell, up to rounding, has no intersection with it.
#[test]
fn boxes_that_touch() {
    let (points, cells) = brick([3, 1, 1], |[x, y, z]| [1e-4 * (0.1 + 0.2) * x, 1e-3 * y, 1e-3 * z]);
    for (ends, expected) in
        [([3e-5, 6e-5], vec![1]), ([2.9e-5, 6e-5], vec![0, 1]), ([5.9e-5, 6.1e-5], vec![1, 2])]
    {
        let one = Cuboid { min: [ends[0], 0.0, 0.0], max: [ends[1], 1e-3, 1e-3] };
        let overlap = Overlap::new(&points, &cells, &[one]).unwrap();
        assert_eq!(overlap.cells_of(0).collect::<Vec<_>>(), expected, "{ends:?}");
    }
}

/// Any field over nodes keeps its integral, and a linear one its values.
#[test]
fn nodes_to_particles() {
    let (points, cells) = brick([3, 4, 2], |[x, y, z]| [0.4 * x * (1.0 + 0.1 * x), 0.25 * y, 0.5 * z]);
    let extent = *points.last().unwrap();
    let n = [5, 3, 7];
    let boxes = particles(n, std::array::from_fn(|d| extent[d] / n[d] as f64));
    let overlap = Overlap::new(&points, &cells, &boxes).unwrap();
    let rough: Vec<f64> = (0..points.len()).map(|k| ((7 * k * k) % 11) as f64 - 3.0).collect();
    let means: Vec<f64> = overlap.from_nodes(&rough).unwrap().into_iter().flatten().collect();
    let sum: f64 = means.iter().zip(&boxes).map(|(mean, b)| mean * b.volume()).sum();
    let [volume, exact] = integral(&points, &cells, &rough).unwrap();
    assert!((sum - exact).abs() < 1e-12 * volume, "{sum} {exact}");
    let linear = |p: [f64; 3]| 2.0 + p[0] - 3.0 * p[1] + 0.5 * p[2];
    let nodal: Vec<f64> = points.iter().map(|&p| linear(p)).collect();
    let means: Vec<f64> = overlap.from_nodes(&nodal).unwrap().into_iter().flatten().collect();
    for (mean, b) in means.iter().zip(&boxes) {
        let middle = std::array::from_fn(|d| 0.5 * (b.min[d] + b.max[d]));
        assert!((mean - linear(middle)).abs() < 1e-14, "{mean}");
    }
    // the lumped projection conserves the integral over the boxes
    let back: Vec<f64> = overlap.to_nodes(&means).unwrap().into_iter().flatten().collect();
    let sum: f64 = means.iter().zip(&boxes).map(|(mean, b)| mean * b.volume()).sum();
    let [_, kept] = integral(&points, &cells, &back).unwrap();
    assert!((sum - kept).abs() < 1e-12, "{sum} {kept}");
}

/// Skewed hexahedra: integrals are kept; the volume of a box is found to the width of the points.
#[test]
fn general_hexahedra() {
    let (points, cells) = brick([4, 3, 3], |[x, y, z]| [x + 0.2 * y, y, z + 0.1 * (x * y).sin()]);
    let boxes = particles([14, 8, 9], [0.5; 3]).into_iter().map(|mut b| {
        b.min[2] -= 0.5;
        b.max[2] -= 0.5;
        b
    });
    let boxes: Vec<Cuboid> = boxes.collect();
    let overlap = Overlap::new(&points, &cells, &boxes).unwrap();
    let field: Vec<f64> = points.iter().map(|p| 1.0 + p[0] * p[1] - p[2]).collect();
    let [volume, exact] = integral(&points, &cells, &field).unwrap();
    let means = overlap.from_nodes(&field).unwrap();
    let sum: f64 =
        means.iter().enumerate().filter_map(|(k, mean)| Some((*mean)? * overlap.covered_volume(k))).sum();
    let covered: f64 = (0..boxes.len()).map(|k| overlap.covered_volume(k)).sum();
    assert!((covered - volume).abs() < 1e-12 * volume, "{covered} {volume}");
    assert!((sum - exact).abs() < 1e-12 * volume, "{sum} {exact}");
    // a box in the middle is full
    let middle = boxes.iter().position(|b| b.min == [2.0, 1.0, 1.0]).unwrap();
    let full = overlap.covered_volume(middle) / 0.125;
    assert!((full - 1.0).abs() < 0.15, "{full}");
}

#[test]
fn what_does_not_fit() {
    let (mut points, cells) = brick([1, 1, 1], |p| p);
    let unit = [Cuboid { min: [0.0; 3], max: [1.0; 3] }];
    let told =
        |points: &[[f64; 3]], boxes: &[Cuboid]| Overlap::new(points, &cells, boxes).unwrap_err().to_string();
    assert!(told(&points, &[Cuboid { min: [0.0; 3], max: [1.0, 0.0, 1.0] }]).contains("without volume"));
    let far = Overlap::new(&points, &cells, &[Cuboid { min: [2.0; 3], max: [3.0; 3] }]).unwrap();
    assert_eq!((far.from_cells(&[1.0]).unwrap(), far.covered_volume(0)), (vec![None], 0.0));
    assert!(Overlap::new(&points, &cells, &[]).unwrap().from_cells(&[1.0]).unwrap().is_empty());
    let turned: Vec<[f64; 3]> = points.iter().map(|&[x, y, z]| [1.0 - x - 0.1 * y, y, z]).collect();
    assert!(told(&turned, &unit).contains("turned inside out"));
    points[3][1] = f64::NAN;
    assert!(told(&points, &unit).contains("not finite"));
    points.pop();
    assert!(told(&points, &unit).contains("does not exist"));
}
