//! Modulus, chain length, sol and fracture energy of a silicone over its stoichiometry:
//! `cargo run --release --example network [sol fraction of your network at r = 1]`.

use polycore::network::{EndLinked, Melt, Reacted};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // strands of 10 kg/mol, four groups a cross-linker of 0.33 kg/mol, 97 % of the groups in deficit
    // reacted
    let melt = Melt::of_polymer("PDMS")?;
    let recipe = |reacted| EndLinked::new(4, 10.0, reacted).linker_mass(0.33);
    println!("    r     G, MPa   sol, %   Kuhn segments   locks at   fracture energy, J/m²");
    for ratio in [0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4] {
        let conversion = 0.97 * f64::min(1.0, 1.0 / ratio);
        let network = recipe(Reacted::Conversion(conversion)).ratio(ratio).network(&melt)?;
        let [low, high] = network.fracture_energy().unwrap_or_default();
        let (segments, locking) = (network.segments(), network.locking_stretch());
        println!(
            "{ratio:5.2} {:10.3} {:8.2} {:15.1} {:10.2}   {low:.1} to {high:.1}",
            network.modulus() / 1e6,
            100.0 * network.sol.mass,
            segments.unwrap_or(f64::NAN),
            locking.unwrap_or(f64::NAN)
        );
    }
    // the conversion from a measured sol fraction, extracted
    let sol = std::env::args().nth(1).map_or(Ok(0.02), |text| text.parse())?;
    let network = recipe(Reacted::SolFraction(sol)).network(&melt.extracted())?;
    let (least, used) = (network.least_conversion.unwrap_or(f64::NAN), network.conversion[0]);
    println!("sol {sol}: conversion {used:.3} (at least {least:.3}), G = {:.3} MPa", network.modulus() / 1e6);
    Ok(())
}
