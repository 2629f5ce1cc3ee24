//! Constitutive laws from molecular dynamics: data sets of (C, S), training and search of models, evaluation
//! and export.
//!
//! ```
//! use mdsurrogate::network::Activation::Softplus;
//! use mdsurrogate::surrogate::{Header, Kind, Prediction, Surrogate, Symmetry, Workspace};
//! use polycore::tensor::Voigt;
//!
//! // random weights instead of training: an orthotropic energy, an ensemble of two
//! let header = Header::new(Kind::energy(Symmetry::Orthotropic), &[(32, Softplus), (32, Softplus)], 2);
//! # let directory = tempfile::tempdir()?;
//! # let file = directory.path().join("law.safetensors");
//! Surrogate::random(header, 1)?.write(&file)?;
//!
//! // stress, tangent 2 ∂S/∂C and uncertainty at a C in the order 11, 22, 33, 12, 13, 23
//! let model = Surrogate::read(&file)?;
//! let found = model.predict(&Voigt::new(1.1, 1.0, 1.0, 0.1, 0.0, 0.0))?;
//! assert!(found.stress[0] != 0.0 && found.tangent.is_some() && found.spread > 0.0);
//! assert!(found.flags.unseen[3], "no training data had shear");
//!
//! // many points: bit-identical at half the cost, without allocation in calls with the same memory
//! let points = vec![Voigt::new(1.1, 1.0, 1.0, 0.0, 0.0, 0.0); 100];
//! let (mut memory, mut predictions) = (Workspace::default(), vec![Prediction::default(); 100]);
//! model.stresses(&points, &mut memory, &mut predictions)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`polycore::constitutive`] evaluates the models without a training framework; they are laws like all
//! others there ([`polycore::constitutive::Law`]), and [`surrogate`] and [`network`] are its modules. This
//! crate adds [`mod@dataset`], [`fitted`], `train` and `search` (feature `train`), [`eval`], [`export`], and
//! molecular dynamics in [`md`].
//!
//! Data sets are tables of runs:
//!
//! ```
//! use mdsurrogate::dataset::{Fractions, ReadOptions, SplitMethod, Standardisation, noise, read, split};
//!
//! // two runs of three rows, C and S in MPa
//! let directory = tempfile::tempdir()?;
//! let file = directory.path().join("runs.csv");
//! std::fs::write(&file, "run_id,C11,C22,C33,C12,C13,C23,S11,S22,S33,S12,S13,S23\n\
//!     a,1.00,1,1,0,0,0,0,0,0,0,0,0\na,1.02,1,1,0,0,0,20,0,0,0,0,0\na,1.04,1,1,0,0,0,46,0,0,0,0,0\n\
//!     b,1,1,1.00,0,0,0,0,0,0,0,0,0\nb,1,1,1.02,0,0,0,0,0,20,0,0,0\nb,1,1,1.04,0,0,0,0,0,40,0,0,0\n")?;
//! let set = read(&file, &ReadOptions::default())?;
//! assert_eq!((set.paths.len(), set.len()), (2, 6));
//!
//! // one run for training, one for the test
//! let halves = Fractions { train: 0.5, validation: 0.0, test: 0.5 };
//! let sets = split(&set, SplitMethod::Path, halves, 1)?;
//! assert_eq!((sets.train.len(), sets.test.len()), (3, 3));
//!
//! // C12, C13 and C23 are constant: (3.8) would divide by zero
//! let c: Vec<_> = set.rows().map(|row| row.c).collect();
//! assert_eq!(Standardisation::from_rows(c.iter())?.constant(), ["22", "12", "13", "23"]);
//!
//! // a second difference of 6 MPa in one of two paths: √(6²/2/6) MPa
//! let noise = noise(&set, |row| row.s).unwrap();
//! assert!((noise.deviation[0] - 3f64.sqrt() * 1e6).abs() < 1.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod cell;
pub mod dataset;
pub mod error;
pub mod eval;
pub mod export;
pub mod fitted;
pub mod kinematics;
pub mod md;
#[cfg(feature = "train")]
pub mod search;
#[cfg(feature = "train")]
pub mod train;

// `cargo bench` compiles a file of `program`, which uses the name of this crate
#[cfg(feature = "case")]
extern crate self as mdsurrogate;

#[cfg(feature = "case")]
pub mod program;

pub use error::Error;
pub use polycore::constitutive::{network, surrogate};
pub use polycore::random;
