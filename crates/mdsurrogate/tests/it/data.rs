//! Shipped data (cases/ch3/pa12-data), read and measured.

use mdsurrogate::dataset::{
    Dataset, Fractions, ReadOptions, SampledColumns, SplitMethod, Standardisation, leak, noise, read, split,
};
use std::path::PathBuf;

fn shipped(columns: SampledColumns) -> Dataset {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../cases/ch3/pa12-data");
    read(folder.join("runs.csv.gz"), &ReadOptions { columns, ..ReadOptions::default() }).unwrap()
}

/// PROVENANCE.md: 82 of 90 runs, 101 samples, final strain in x 0.5 (rate 2e-4/fs for 2.5 ps), L0 at F = I.
#[test]
fn the_grid_is_read_as_described() {
    let set = shipped(SampledColumns::Averaged);
    assert_eq!((set.paths.len(), set.len(), set.skipped), (82, 8200, 82));
    assert_eq!(set.constant_components(), ["C12", "C13", "C23"]);
    let run = set.paths.iter().find(|path| path.id == "ux_4").unwrap();
    assert_eq!(run.kind, "ux");
    assert!((run.rates[0] / 2e11 - 1.0).abs() < 1e-12 && run.rates[1].is_nan());
    // the mean over the last interval of 25 fs lies half a strain step (0.0025) before the end
    let last = run.rows.last().unwrap();
    assert!((last.deformation.matrix()[(0, 0)] - 1.4975).abs() < 1e-3);
    assert!((last.time - 2.5e-12).abs() < 1e-20);
}

/// PROVENANCE.md: noise of about 700 (x, y), 1,400 (z), 250–350 (shear) MPa instantaneous, 100/100/290/65–85
/// averaged. Its values have one or two digits; the instantaneous ones contain vibrations that are not white
/// noise.
#[test]
fn noise_agrees_with_provenance() {
    let averaged = noise(&shipped(SampledColumns::Averaged), |row| row.cauchy).unwrap();
    for (found, expected) in averaged.deviation.iter().zip([100.0, 100.0, 290.0, 65.0, 85.0, 85.0]) {
        assert!((found / 1e6 / expected - 1.0).abs() < 0.1, "{found} for {expected}");
    }
    assert!((averaged.floor / 119_000e12 - 1.0).abs() < 0.1);
    let instant = noise(&shipped(SampledColumns::Instantaneous), |row| row.cauchy).unwrap();
    for (found, expected) in instant.deviation.iter().zip([700.0, 700.0, 1400.0, 300.0, 300.0, 300.0]) {
        assert!((found / 1e6 / expected - 1.0).abs() < 0.25, "{found} for {expected}");
    }
}

/// formulation.md: the random split of the thesis leaks along paths.
#[test]
fn the_random_split_leaks() {
    let set = shipped(SampledColumns::Averaged);
    let c: Vec<_> = set.rows().map(|row| row.c).collect();
    let measured = |method| {
        let parts = split(&set, method, Fractions::default(), 1).unwrap();
        let standardisation = Standardisation::from_rows(parts.train.iter().map(|&row| &c[row])).unwrap();
        leak(&set, &parts, &standardisation).unwrap()
    };
    let (by_path, random) = (measured(SplitMethod::Path), measured(SplitMethod::Random));
    assert_eq!(by_path.same_path, 0.0);
    assert!(random.same_path > 0.5, "{random:?}");
    assert!(by_path.ratio > random.ratio, "{by_path:?} {random:?}");
}

/// Each row of `cases/ch3/flags` is the derivative of W = K/2 ln(1 + E:D:E/K), S = 2 ∂W/∂C, checked by
/// central differences.
#[test]
fn the_known_law_of_the_flags_case() {
    let energy = |c: &[f64; 6]| {
        let e = [0.5 * (c[0] - 1.0), 0.5 * (c[1] - 1.0), 0.5 * (c[2] - 1.0)];
        let d = [[8e9, 3e9, 4e9], [3e9, 7e9, 4e9], [4e9, 4e9, 60e9]];
        let mut q = 2e9 * c[3] * c[3] + 3e9 * c[4] * c[4] + 3e9 * c[5] * c[5];
        for (row, x) in d.iter().zip(e) {
            q += x * row.iter().zip(e).map(|(stiffness, y)| stiffness * y).sum::<f64>();
        }
        0.75e9 * (1.0 + q / 1.5e9).ln()
    };
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases/ch3/flags");
    for (file, rows, sheared) in [("runs.csv.gz", 2592, false), ("heldout.csv.gz", 1600, true)] {
        let set = read(folder.join(file), &ReadOptions::default()).unwrap();
        assert_eq!(set.len(), rows);
        for row in set.rows() {
            for a in 0..6 {
                let moved = |by: f64| {
                    let mut c: [f64; 6] = row.c.into();
                    c[a] += by;
                    energy(&c)
                };
                let factor = if a < 3 { 2.0 } else { 1.0 };
                let stress = factor * (moved(1e-5) - moved(-1e-5)) / 2e-5;
                // eight decimals of C are 600 Pa; rounding 1e-16 · 1e9/1e-5 = 1e4 Pa, differences h²
                assert!((row.s[a] - stress).abs() < 1e5, "{} {a}: {} {stress}", row.sample, row.s[a]);
            }
        }
        assert_eq!(set.rows().any(|row| row.c[3] != 0.0), sheared);
    }
}
