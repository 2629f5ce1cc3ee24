//! Stretches a viscoelastic rubber, holds it, lets it go: `cargo run --release --example
//! rubber_in_time`.

use polycore::constitutive::hyperelastic::{LopezPamies, data::Mode};
use polycore::constitutive::viscoelastic::{
    Branch, History, Pace, Reaction, Spring, Viscoelastic, Viscosity, nominal_of_test, strain_of_test,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // VHB 4910, an acrylic elastomer (doi:10.1016/j.crme.2015.11.004); Pa and s
    let equilibrium = LopezPamies::new(vec![[13.54e3, 1.0], [1.08e3, -2.474]])?;
    let spring = Spring::LopezPamies(LopezPamies::new(vec![[5.42e3, -10.0], [20.78e3, 1.948]])?);
    let viscosity = Viscosity::KumarLopezPamies {
        start: 7014e3,
        end: 100.0,
        thickening: 3507e3,
        thinning: 1e-6,
        exponents: [1.852, 0.26],
    };
    let law = Viscoelastic::new(Box::new(equilibrium), vec![Branch::new(spring, viscosity)?])?;

    // 10 s to a stretch of 2, held until 200 s, back within 10 s
    let stretch = |t: f64| 1.0 + (t / 10.0).min(1.0).min((210.0 - t) / 10.0);
    let strain = |t: f64| strain_of_test(Mode::Uniaxial, stretch(t));
    let times = [0.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 205.0, 210.0];
    let reaction = Reaction::Test(Mode::Uniaxial);
    let history = History { strain: &strain, temperature: &|_| 293.15, times: &times, reaction };

    // second order in time, steps chosen for an error of 10 Pa
    let trace = law.follow(&history, law.rest(), Pace::Within(10.0))?;
    println!("time (s)  stretch  stress (kPa)  dissipated (kJ/m3)");
    for point in &trace.points {
        let stress = nominal_of_test(&strain(point.time), &point.step.prediction.stress) / 1e3;
        let dissipated = point.dissipated / 1e3;
        println!("{:8.0} {:8.2} {stress:13.2} {dissipated:19.3}", point.time, stretch(point.time));
    }
    println!("{} steps, {} rejected", trace.steps, trace.rejected);
    Ok(())
}
