//! `cargo xtask bench mdsurrogate -- --training`: seconds per epoch of the thesis' network.

use evidence::measurement::Measurement;
use mdsurrogate::Error;
use mdsurrogate::dataset::DataRow;
use mdsurrogate::kinematics::cauchy_from_material;
use mdsurrogate::network::Architecture;
use mdsurrogate::random::SplitMix64;
use mdsurrogate::surrogate::Kind;
use mdsurrogate::train::{Settings, Training};
use polycore::tensor::{DeformationGradient, Tensor, Voigt};

/// Number of training rows in the thesis: 80 % of 72,720.
const ROWS: usize = 58_176;
const BATCHES: [usize; 5] = [16, 32, 64, 256, 1024];
/// Number of epochs; the median is reported.
const EPOCHS: u32 = 5;

/// Returns the seconds per epoch of ANN-4 for each batch size, on one thread.
pub fn measure() -> Result<Vec<Measurement>, Error> {
    let mut random = SplitMix64::new(1);
    let mut rows = Vec::with_capacity(ROWS);
    for sample in 0..ROWS {
        let mut stretch = || 1.0 + 0.3 * random.uniform();
        let f = Tensor::from_diagonal(&[stretch(), stretch(), stretch()].into());
        let f = DeformationGradient::new(f)?;
        let s = Voigt::from_fn(|a, _| 1e9 * ((a + 1) as f64 * f.matrix()[(a % 3, a % 3)]).sin());
        rows.push(DataRow::new(sample as u64, f64::NAN, f, cauchy_from_material(&f, &s)));
    }
    let rows: Vec<&DataRow> = rows.iter().collect();
    let header = mdsurrogate::fitted::header(Kind::Ann, Architecture::thesis(4)?, 1, &rows, true)?;
    let mut measured = Vec::new();
    for batch in BATCHES {
        let settings = Settings { epochs: EPOCHS, batch, ..Settings::default() };
        let mut training = Training::new(&header, &rows, &[], settings)?;
        let mut times = Vec::new();
        while training.ending().is_none() {
            times.push(training.epoch()?.seconds);
        }
        times.sort_by(f64::total_cmp);
        let what = format!("mdsurrogate, epoch of ANN-4, batch {batch}");
        measured.push(Measurement::new(what, ROWS, 1, times[times.len() / 2], "s"));
    }
    Ok(measured)
}
