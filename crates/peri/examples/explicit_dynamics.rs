//! Wave in a bar of rubber with a moving end: position and speed of its front.

use peri::bonds::BodyGeometry;
use peri::calibrate::Calibration;
use peri::geometry::Shape;
use peri::model::{Body, Model, Rubber};
use peri::potential::Law;
use peri::probe::{WaveFront, crossing};
use peri::solver::{Support, VelocityVerlet};

pub(crate) fn main() -> Result<(), peri::Error> {
    // 200 mm × 12 mm; the left end is pulled by 0.1 mm in 2 ms
    let (density, youngs_modulus, spacing) = (1100.0, 1e6, 2e-3);
    let body = Body::lattice(Shape::rectangle([0.0, 0.0], [200e-3, 12e-3]), spacing).plane_stress(1e-3);
    let rubber = Rubber::new(Law::Linear, youngs_modulus).calibration(Calibration::Lattice);
    let pulled = Support { displacement: [Some(-0.1e-3), None], body_force: [0.0; 2] };
    let mut simulation = Model::new(body, rubber).support(|[x, _]| x < 6e-3, pulled).build()?;
    let front = WaveFront::new(&simulation.bonds, simulation.bonds.particles().to_vec(), 0, 0.3);
    let method = VelocityVerlet { ramp: 2e-3, ..VelocityVerlet::new(density, 6e-3) };
    let mut path = Vec::new();
    simulation.solve_with(method, |state| {
        path.push((state.motion.time, front.value(state)));
        Ok(())
    })?;

    let gauges = [60e-3, 120e-3];
    let [from, to] = gauges.map(|place| crossing(&path, place).unwrap_or(f64::NAN));
    let (speed, exact) = ((gauges[1] - gauges[0]) / (to - from), f64::sqrt(youngs_modulus / density));
    println!("{speed:.1} m/s, √(E/ρ) = {exact:.1} m/s");
    assert!((speed / exact - 1.0).abs() < 0.1);
    Ok(())
}
