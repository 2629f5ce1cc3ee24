//! Presses a rubber disc between two rigid planes: load and width of contact.

use peri::contact::RigidSurface;
use peri::geometry::Shape;
use peri::model::{Body, Model, Rubber};
use peri::potential::Law;
use peri::solver::{DynamicRelaxation, Support};

pub(crate) fn main() -> Result<(), peri::Error> {
    // 20 mm across, 1 mm thick; the upper plane comes down by 2 mm in four steps
    let body = Body::lattice(Shape::Ball { centre: [0.0; 2], radius: 10e-3 }, 0.5e-3).plane_strain(1e-3);
    let lower = RigidSurface::plane([0.0, -10e-3], [0.0, 1.0]);
    let upper = RigidSurface { displacement: [0.0, -2e-3], ..RigidSurface::plane([0.0, 10e-3], [0.0, -1.0]) };
    // the axis keeps its place
    let middle = Support { displacement: [Some(0.0), None], body_force: [0.0; 2] };
    let model = Model::new(body, Rubber::new(Law::ChainOffset, 1e6))
        .support(|[x, _]| x.abs() < 0.5e-3, middle)
        .rigid_surface(lower)
        .rigid_surface(upper)
        .steps(4);
    let mut simulation = model.build()?;
    simulation.solve(DynamicRelaxation { tolerance: 1e-4, ..DynamicRelaxation::default() })?;

    for record in simulation.history() {
        let [below, above] = [record.resting[0], record.resting[1]];
        println!("{:7.3} N  {:5.2} mm wide", below.force[1], 1e3 * below.width);
        assert!((below.force[1] + above.force[1]).abs() < 0.01 * below.force[1]);
    }
    Ok(())
}
