//! From molecular dynamics to a constitutive law: data sets of (C, S), networks, inference.
//!
//! The `mdsurrogate` command line reads and measures data ([`mod@dataset`], feature `cli`); the same parts from Rust:
//!
//! ```
//! use mdsurrogate::dataset::{Fractions, Method, ReadOptions, Standardisation, noise, read, split};
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
//! // one run to learn from, one to judge by
//! let halves = Fractions { train: 0.5, validation: 0.0, test: 0.5 };
//! let sets = split(&set, Method::Path, halves, 1)?;
//! assert_eq!((sets.train.len(), sets.test.len()), (3, 3));
//!
//! // C12, C13 and C23 never change: (3.8) would divide by zero
//! let c: Vec<_> = set.rows().map(|row| row.c).collect();
//! assert_eq!(Standardisation::of(c.iter())?.constant(), ["22", "12", "13", "23"]);
//!
//! // a second difference of 6 MPa in one of two paths: √(6²/2/6) MPa
//! let noise = noise(&set, |row| row.s).unwrap();
//! assert!((noise.deviation[0] - 3f64.sqrt() * 1e6).abs() < 1.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A law is used without any training framework ([`surrogate`]):
//!
//! ```
//! use mdsurrogate::network::Activation::Softplus;
//! use mdsurrogate::surrogate::{Answer, Header, Kind, Surrogate, Symmetry, Workspace};
//!
//! // an orthotropic energy with random weights, in place of `Surrogate::read("law.safetensors")`
//! let header = Header::new(Kind::energy(Symmetry::Orthotropic), &[(32, Softplus), (32, Softplus)], 2);
//! let law = Surrogate::<f64>::random(header, 1)?;
//! let mut memory = Workspace::default();
//! let rest = law.stress(&[1.0, 1.0, 1.0, 0.0, 0.0, 0.0].into(), &mut memory)?;
//! assert_eq!(rest.stress.norm(), 0.0);
//!
//! // sheared: stress, the tangent 2 ∂S/∂C, and the doubt that no training data had shear
//! let answer = law.tangent(&[1.1, 1.0, 1.0, 0.1, 0.0, 0.0].into(), &mut memory)?;
//! let tangent = answer.tangent.unwrap();
//! assert!((tangent - tangent.transpose()).norm() < 1e-14 * tangent.norm());
//! assert!(answer.flags.unseen[3]);
//!
//! // many points at once: the same bits, at about half the cost
//! let points = vec![[1.1, 1.0, 1.0, 0.0, 0.0, 0.0].into(); 100];
//! let mut answers = vec![Answer::default(); 100];
//! law.stresses(&points, &mut memory, &mut answers)?;
//! # Ok::<(), mdsurrogate::Error>(())
//! ```

pub mod cell;
pub mod dataset;
pub mod error;
pub mod eval;
pub mod kinematics;
pub mod md;
pub mod network;
pub mod random;
#[cfg(feature = "train")]
pub mod search;
pub mod surrogate;
#[cfg(feature = "train")]
pub mod train;

#[cfg(feature = "cli")]
pub mod run;
#[cfg(feature = "cli")]
pub mod scene;

pub use error::Error;
