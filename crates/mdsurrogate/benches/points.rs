//! Laws and strains of the benchmarks.

use mdsurrogate::Error;
use mdsurrogate::network::{Activation::Softplus, Architecture, Real};
use mdsurrogate::surrogate::{Header, Kind, Surrogate, Symmetry};
use nalgebra::{SVector, Scalar};

/// Points per repetition.
pub const POINTS: usize = 512;

/// Returns the thesis' network and an energy, with random weights.
pub fn laws() -> Result<Vec<(String, Surrogate<f64>)>, Error> {
    let mut ann = Header::new(Kind::Ann, &[], 1);
    ann.architecture = Architecture::thesis(4)?;
    let hidden = [(96, Softplus), (96, Softplus)];
    let energy = Header::new(Kind::energy(Symmetry::Orthotropic), &hidden, 1);
    let named = [("ann-4", ann), ("energy 2 × 96", energy)];
    named.into_iter().map(|(name, header)| Ok((name.to_owned(), Surrogate::random(header, 1)?))).collect()
}

/// Returns C with stretches of 0.9 to 1.3 and a little shear.
pub fn points<T: Real + Scalar>() -> Vec<SVector<T, 6>> {
    let [low, high] = [0.9, 1.3];
    let point = |k: usize| {
        let at = |a: usize| low + (high - low) * ((k * (2 * a + 3)) % 97) as f64 / 97.0;
        SVector::<T, 6>::from_fn(|a, _| T::from_f64(if a < 3 { at(a) } else { 0.1 * (at(a) - 1.0) }))
    };
    (0..POINTS).map(point).collect()
}
