//! Writes displacements and stresses of every load step for ParaView: `stretched.vtkhdf`.

use harness::output::vtkhdf::ParticleSeries;
use peri::prelude::*;

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    // a block of 20 mm × 10 mm × 10 mm, K/μ = 25, pulled to 1.5 times its length in 5 steps
    let body = Body::lattice(Shape::cuboid([0.0; 3], [20e-3, 10e-3, 10e-3]), 1e-3);
    let model = Model::new(body, EightChainSolid::new(Space::Solid, 0.4e6, 25.0, 10e6)?)
        .clamp(|[x, ..]| x < 3e-3)
        .displace(|[x, ..]| x > 17e-3, [2e-3, 0.0, 0.0]);
    let mut simulation = model.build()?;

    let mut series = ParticleSeries::create(std::env::temp_dir().join("stretched.vtkhdf"))?;
    for step in 1..=5 {
        simulation.solve(Lbfgs { tolerance: 1e-3, ..Lbfgs::default() })?;
        let (points, moved): (Vec<_>, Vec<_>) = simulation.displacements().unzip();
        let stress = simulation.cauchy()?;
        let fields = [
            ("displacement", 3, moved.as_flattened()),
            ("cauchy_stress", 9, stress.as_flattened().as_flattened()),
        ];
        series.step(f64::from(step), &points, &fields)?;
        simulation.factors.push(f64::from(step + 1));
    }
    println!("{}", series.finish()?.display());
    Ok(())
}
