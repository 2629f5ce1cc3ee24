//! Pulls a sheet with a slot until it tears: load against displacement.

use peri::geometry::Shape;
use peri::model::{Body, Model, Rubber};
use peri::potential::Law;
use peri::solver::Lbfgs;

pub(crate) fn main() -> Result<(), peri::Error> {
    // 60 mm × 40 mm × 1 mm, particles 2 mm apart; a slot of 20 mm from the left edge, as wide as the horizon
    let sheet = Shape::rectangle([0.0, 0.0], [60e-3, 40e-3]);
    let slot = Shape::rectangle([0.0, 16e-3], [20e-3, 24e-3]);
    let body = Body::lattice(sheet, 2e-3).cut(slot).plane_stress(1e-3);

    // three layers at each end are clamped; the upper ones move by 14 mm in 14 steps
    let rubber = Rubber::new(Law::ChainOffset, 1e6).critical_stretch(1.6);
    let model = Model::new(body, rubber)
        .clamp(|[_, y]| y < 6e-3)
        .displace(|[_, y]| y > 34e-3, [0.0, 14e-3])
        .steps(14);
    let mut simulation = model.build()?;
    simulation.solve(Lbfgs { tolerance: 1e-4, ..Lbfgs::default() })?;

    for record in simulation.history() {
        let (millimetres, load, broken) = (1e3 * record.displacement, record.load, record.broken);
        println!("{millimetres:5.1} mm  {load:7.3} N  {broken:4} broken bonds");
    }
    let peak = simulation.history().iter().map(|record| record.load).fold(0.0, f64::max);
    println!("peak {peak:.2} N, {} pieces", simulation.fragments());
    assert!(peak > 0.0 && simulation.state.fracture.broken > 0);
    Ok(())
}
