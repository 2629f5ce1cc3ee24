//! Stretches a sheet of viscoelastic rubber and holds it: `cargo run --release --example relax_sheet`.

use peri::calibrate::Space;
use peri::geometry::Shape;
use peri::material::{Driving, NonlocalSolid, ViscousCorrespondence};
use peri::model::{Body, Model};
use peri::solver::Lbfgs;
use polycore::constitutive::hyperelastic::{Compressible, NeoHookean, Volumetric};
use polycore::constitutive::viscoelastic::{Branch, Spring, Viscoelastic, Viscosity};
use std::sync::Arc;

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    // 0.4 MPa in equilibrium, a branch of 0.8 MPa that relaxes in 1 s
    let rubber = Compressible::new(NeoHookean::new(4e5)?, Volumetric::Ciarlet { lame: 4e7 })?;
    let branch = Branch::new(Spring::NeoHookean(NeoHookean::new(8e5)?), Viscosity::Constant(8e5))?;
    let law = Viscoelastic::new(Box::new(rubber), vec![branch])?;
    let solid = ViscousCorrespondence::new::<2>(law, Space::PlaneStress, 1.0, Driving::Equilibrium)?;

    // a sheet of 30 mm x 16 mm x 1 mm between two grips; times (s) and load factors of the steps
    let body = Body::lattice(Shape::rectangle([0.0, 0.0], [30e-3, 16e-3]), 1e-3).plane_stress(1e-3);
    let ramp = (1..=10).map(|k| [0.01 * f64::from(k), 0.1 * f64::from(k)]);
    let hold = (1..=10).map(|k| [0.1 + 0.3 * f64::from(k), 1.0]);
    let model = Model::new(body, NonlocalSolid::new(Arc::new(solid)))
        .clamp(|[x, _]| x < 6e-3)
        .displace(|[x, _]| x > 24e-3, [9e-3, 0.0])
        .programme(ramp.chain(hold));
    let mut simulation = model.build()?;
    simulation.solve(Lbfgs { tolerance: 1e-6, ..Lbfgs::default() })?;

    for row in simulation.history() {
        println!("{:5.2} s  {:7.3} N  {:.5} J dissipated", row.time, row.load, row.dissipated);
    }
    Ok(())
}
