//! Force and moment across sections of a bent beam.

use peri::geometry::Shape;
use peri::model::{Body, Model, Rubber};
use peri::potential::Law;
use peri::probe::Section;
use peri::solver::Lbfgs;

pub(crate) fn main() -> Result<(), peri::Error> {
    // 40 mm × 8 mm × 1 mm, particles 1 mm apart; the left end is clamped, the right end moves down by 2 mm
    let body = Body::lattice(Shape::rectangle([0.0, 0.0], [40e-3, 8e-3]), 1e-3).plane_stress(1e-3);
    let model = Model::new(body, Rubber::new(Law::ChainOffset, 1e6))
        .clamp(|[x, _]| x < 3e-3)
        .displace(|[x, _]| x > 37e-3, [0.0, -2e-3]);
    let mut simulation = model.build()?;
    let evaluator = simulation.evaluator();
    let section = |x| Section::new(&simulation.bonds, [x, 4e-3], [1.0, 0.0]);
    let sections = [section(10e-3)?, section(20e-3)?, section(30e-3)?];
    simulation.solve(Lbfgs { tolerance: 1e-6, ..Lbfgs::default() })?;

    let load = simulation.history().last().map_or(0.0, |record| record.load);
    for section in sections {
        let ([_, shear], [.., moment]) = section.force(&evaluator, &simulation.bonds, &simulation.state);
        println!("shear {:8.3} mN  moment {:7.2} N mm", 1e3 * shear, 1e3 * moment);
        assert!((shear.abs() / load.abs() - 1.0).abs() < 1e-3, "shear {shear} N, load {load} N");
    }
    Ok(())
}
