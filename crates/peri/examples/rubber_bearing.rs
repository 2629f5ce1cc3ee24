//! Rubber strip between two rigid plates, which bond laws cannot describe: it is stiff because its volume
//! cannot change. Plane strain, eight-chain network; apparent modulus, compared with Gent & Lindley for thin
//! bonded strips (1959, doi:10.1243/PIME_PROC_1959_173_022_02).

use peri::calibrate::Space;
use peri::geometry::Shape;
use peri::material::EightChainSolid;
use peri::model::{Body, Model};
use peri::solver::Lbfgs;

/// Returns the apparent modulus P/(w ε), Pa, of a strip of width w and height h between plates that approach
/// by 1 %.
pub fn apparent_modulus(width: f64, height: f64, spacing: f64, bulk: f64) -> Result<f64, peri::Error> {
    // the plates are two horizons thick, as materials with two passes need
    let plate = 6.0 * spacing;
    let strip = Shape::rectangle([0.0, -plate], [width, height + plate]);
    let body = Body::lattice(strip, spacing).plane_strain(1e-3);
    let rubber = EightChainSolid::new(Space::PlaneStrain, 0.4e6, 25.0, bulk)?;
    let model = Model::new(body, rubber)
        .clamp(|[_, y]| y < 0.0)
        .displace(move |[_, y]| y > height, [0.0, -0.01 * height]);
    let mut simulation = model.build()?;
    simulation.solve(Lbfgs { tolerance: 1e-4, ..Lbfgs::default() })?;
    let load = simulation.history().last().map_or(0.0, |record| record.load.abs());
    Ok(load / (width * 1e-3 * 0.01))
}

#[allow(dead_code, reason = "the tests include this file and call what it shows")]
pub(crate) fn main() -> Result<(), peri::Error> {
    let (height, shear) = (8e-3, 0.4e6);
    println!("width/height   apparent modulus   4μ(1 + S²) in series with K");
    for ratio in [1.0, 2.0, 4.0] {
        let found = apparent_modulus(ratio * height, height, 1e-3, 100.0 * shear)?;
        // S: loaded area over free area, of a strip w/2h
        let shape = 0.5 * ratio;
        let thin = 1.0 / (1.0 / (4.0 * shear * (1.0 + shape * shape)) + 1.0 / (100.0 * shear));
        println!("{ratio:12} {:14.3} MPa {:10.3} MPa", found / 1e6, thin / 1e6);
    }
    Ok(())
}
