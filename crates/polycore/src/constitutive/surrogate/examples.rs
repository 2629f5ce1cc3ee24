//! Models for tests.

use super::{Header, Kind, Surrogate, Symmetry};
use crate::constitutive::Error;
use crate::constitutive::network::Activation::{Elu, Sigmoid, Silu, Softplus, Tanh};
use nalgebra::Rotation3;

/// Axes rotated by 0.3, −0.5, 0.8 about x, y, z.
fn turned() -> [[f64; 3]; 3] {
    let q = Rotation3::from_euler_angles(0.3, -0.5, 0.8);
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| q[(i, j)]))
}

/// Builds a model of every kind with random weights, smooth activations, ensembles, rotated axes and scaled
/// inputs: properties by construction hold for them, and exporters can be tested with them.
///
/// # Errors
/// Only those of [`Surrogate::random`].
pub fn examples() -> Result<Vec<(String, Surrogate<f64>)>, Error> {
    let mut headers = Vec::new();
    let mut add = |name: String, mut header: Header| {
        for (index, (mean, deviation)) in
            header.input_mean.iter_mut().zip(&mut header.input_deviation).enumerate()
        {
            (*mean, *deviation) = (0.5 + 0.1 * index as f64, 0.7 + 0.2 * index as f64);
        }
        headers.push((name, header));
    };
    let smooth = [(20, Softplus), (12, Tanh), (9, Silu)];
    add("ann".into(), Header::new(Kind::Ann, &smooth, 1));
    add("ann × 3".into(), Header::new(Kind::Ann, &[(17, Sigmoid), (8, Softplus)], 3));
    for symmetry in Symmetry::ALL {
        add(format!("energy {symmetry:?}"), Header::new(Kind::energy(symmetry), &smooth, 1));
        let kind = Kind::Energy { symmetry, axes: turned(), polyconvex: false, norms: false };
        add(
            format!("energy {symmetry:?} turned × 2"),
            Header::new(kind, &[(16, Softplus), (16, Softplus)], 2),
        );
    }
    for symmetry in [Symmetry::Orthotropic, Symmetry::Transverse, Symmetry::Isotropic] {
        let hidden = [(16, Softplus), (9, Softplus)];
        add(format!("polyconvex {symmetry:?}"), Header::new(Kind::polyconvex_energy(symmetry), &hidden, 1));
        let kind = Kind::Energy { symmetry, axes: turned(), polyconvex: true, norms: false };
        add(format!("polyconvex {symmetry:?} turned × 2"), Header::new(kind, &[(12, Softplus), (7, Elu)], 2));
    }
    let hidden = [(12, Softplus), (7, Elu)];
    add("polyconvex, of norms".into(), Header::new(Kind::energy_of_norms(), &hidden, 2));
    headers.into_iter().map(|(name, header)| Ok((name, Surrogate::random(header, 11)?))).collect()
}
