//! Fits laws of rubber elasticity to a tension test: `cargo run --release --example fit_rubber [table.csv]`.

use polycore::constitutive::hyperelastic::data::TestData;
use polycore::constitutive::hyperelastic::{fit, homogeneous, model};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let treloar =
        concat!(env!("CARGO_MANIFEST_DIR"), "/../../cases/ch1/rubber-fits/treloar1944_uniaxial.csv");
    let table = TestData::read(std::env::args().nth(1).unwrap_or(treloar.into()))?;
    println!("{} stresses: {}", table.measurements(), table.source);
    for key in ["neo-hookean", "gent", "eight-chain"] {
        let fit = fit::fit(model(key)?, &table)?;
        print!("{key:<12} rms {:.4} MPa ", fit.rms / 1e6);
        for parameter in &fit.parameters {
            let error = parameter.standard_error.unwrap_or(f64::NAN);
            print!(" {} = {:.5e} ± {error:.1e} {}", parameter.name, parameter.value, parameter.unit);
        }
        // the nominal stress of a sheet stretched twofold in both directions, which the test did not measure
        println!("; equibiaxial at 2: {:.3} MPa", homogeneous::equibiaxial(&fit.law, 2.0)? / 1e6);
    }
    Ok(())
}
