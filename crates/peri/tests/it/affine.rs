//! Full network of chains: the checks of all materials, and closed forms of its moduli and of a dilation.

use crate::materials::battery;
use evidence::near;
use peri::bonds::{BodyGeometry, LatticeBonds, VolumeCorrection};
use peri::field::Field;
use peri::geometry::{Operation, Shape, lattice};
use peri::material::{Affine, Family, Material, Pointwise, SolverMaterial};
use polycore::langevin;

#[test]
fn the_full_network_passes_the_battery() {
    for bulk in [5.0 / 3.0, 100.0] {
        let name = format!("full network, K/μ = {bulk}");
        battery::<3>(&name, [4, 4, 3], &|bonds| Affine::new(1.0, 25.0, bulk).unwrap().respond(bonds));
    }
}

/// Returns W of the particle in the middle of a block under a displacement gradient.
fn energy(law: Affine, gradient: [[f64; 3]; 3]) -> f64 {
    let body = [Operation::Add(Shape::Box { min: [0.0; 3], max: [7.0; 3] })];
    let bonds =
        LatticeBonds::new(lattice(&body, 1.0, 1.0).unwrap(), 3.015, VolumeCorrection::None, &[]).unwrap();
    let mut displacement = Field::zeros(bonds.sites());
    let mut middle = 0;
    for &site in bonds.particles() {
        let site = site as usize;
        let place = bonds.position(site);
        if place == [3.5; 3] {
            middle = site;
        }
        let moved = gradient.map(|row| (0..3).map(|b| row[b] * place[b]).sum());
        displacement.set(site, moved);
    }
    let mut material = Pointwise::new(law, &bonds);
    material.prepare(&bonds, &displacement);
    let family = Family::new(&bonds, &displacement, middle);
    law.energy(&family, &material.points()[middle])
}

/// The bulk modulus at small strains is K, and Voigt's mean of both shear moduli of the lattice is μ: it
/// depends on Σŵ(n·n)² = 1 only.
#[test]
fn small_strains_have_both_moduli() {
    let (bulk, step) = (20.0, 1e-3);
    let law = Affine::new(1.0, 25.0, bulk).unwrap();
    let curvature = |of: [[f64; 3]; 3]| {
        let scaled = |sign: f64| of.map(|row| row.map(|x| sign * step * x));
        (energy(law, scaled(1.0)) + energy(law, scaled(-1.0))) / (step * step)
    };
    let dilation = curvature([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    near("full_network_bulk", dilation / 9.0, bulk, 1e-4 * bulk);
    let simple = curvature([[0.0, 0.5, 0.0], [0.5, 0.0, 0.0], [0.0, 0.0, 0.0]]);
    let pure = curvature([[0.5, 0.0, 0.0], [0.0, -0.5, 0.0], [0.0, 0.0, 0.0]]);
    near("full_network_shear", (2.0 * pure + 3.0 * simple) / 5.0, 1.0, 1e-5);
}

/// A dilation stretches every chain equally: W = ∫ψ′ − ⅓ψ′(1) ln λ³ + ¼κ(λ⁶ − 1 − 2 ln λ³).
#[test]
fn a_dilation_stretches_every_chain() {
    let (links, bulk, stretch) = (25.0_f64, 20.0, 1.4);
    let root = links.sqrt();
    // ψ′ in units of c, and c of μ = 1
    let tension = |stretch: f64| root * langevin::inverse(stretch / root);
    let slope = langevin::inverse_derivative(1.0 / root);
    let scale = 1.0 / ((slope - tension(1.0)) / 15.0 + tension(1.0) / 3.0);
    // Simpson's rule
    let (steps, mut chains) = (200, 0.0);
    let width = (stretch - 1.0) / f64::from(steps);
    for k in 0..steps {
        let at = 1.0 + width * f64::from(k);
        chains += width / 6.0 * (tension(at) + 4.0 * tension(at + 0.5 * width) + tension(at + width));
    }
    let volumetric = bulk - scale * (slope + tension(1.0)) / 9.0;
    let volume = 3.0 * stretch.ln();
    let truth = scale * (chains - tension(1.0) * volume / 3.0)
        + 0.25 * volumetric * (stretch.powi(6) - 1.0 - 2.0 * volume);
    let strain = stretch - 1.0;
    let found = energy(
        Affine::new(1.0, links, bulk).unwrap(),
        [[strain, 0.0, 0.0], [0.0, strain, 0.0], [0.0, 0.0, strain]],
    );
    near("full_network_dilation", found, truth, 1e-10 * truth);
}
