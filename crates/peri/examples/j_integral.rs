//! J-integral of a long strip with a crack from one end to its middle, as in the tests of Rivlin and Thomas
//! (1953): J = W(λ) h for any ring around the tip.

use peri::calibrate::Space;
use peri::geometry::{Cut, Shape};
use peri::material::EightChainSolid;
use peri::model::{Body, Model};
use peri::probe::JIntegral;
use peri::solver::Lbfgs;

pub(crate) fn main() -> Result<(), peri::Error> {
    let (height, shear, stretch) = (40e-3, 0.4e6, 1.5_f64);
    let strip = Shape::rectangle([-80e-3, -26e-3], [80e-3, 26e-3]);
    let crack = Cut::segment([-81e-3, 0.0], [0.0, 0.0]);
    let body = Body::lattice(strip, 2e-3).plane_stress(2e-3).crack(crack);
    // incompressible in plane stress, and so many links that it is neo-Hookean
    let rubber = EightChainSolid::new(Space::PlaneStress, shear, 1e4, f64::INFINITY)?;
    let model = Model::new(body, rubber)
        .clamp(|[_, y]| y < -20e-3)
        .displace(move |[_, y]| y > 20e-3, [0.0, (stretch - 1.0) * height]);
    let mut simulation = model.steps(5).build()?;
    let evaluator = simulation.evaluator();
    let ring = |radii| JIntegral::new(&simulation.bonds, 2e-3, [0.0, 0.0], radii, 0);
    let rings = [ring([5e-3, 12e-3])?, ring([12e-3, 19e-3])?];
    simulation.solve(Lbfgs { tolerance: 1e-5, ..Lbfgs::default() })?;

    let exact = 0.5 * shear * (stretch.powi(2) + stretch.powi(-2) - 2.0) * height;
    for ring in rings {
        let found = ring.value(&evaluator, &simulation.bonds, &simulation.state);
        println!("J = {found:.0} J/m², W h = {exact:.0} J/m²");
        // grips and flanks give way over a horizon
        assert!((found / exact - 1.0).abs() < 0.12, "{found} {exact}");
    }
    Ok(())
}
