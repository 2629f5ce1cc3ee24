//! Predicts stress, tangent and uncertainty with a model: `cargo run --release --example predict
//! [law.safetensors]`.

use polycore::constitutive::network::Activation::Softplus;
use polycore::constitutive::surrogate::{Header, Kind, Prediction, Surrogate, Symmetry, Workspace};
use polycore::tensor::Voigt;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let path = std::env::args().nth(1).map_or(folder.path().join("law.safetensors"), Into::into);
    if !path.exists() {
        // without a file: random weights in an ensemble of two orthotropic energies
        let header = Header::new(Kind::energy(Symmetry::Orthotropic), &[(32, Softplus), (32, Softplus)], 2);
        Surrogate::random(header, 1)?.write(&path)?;
    }
    let model = Surrogate::read(&path)?;

    // one point: C in the order 11, 22, 33, 12, 13, 23
    let found = model.predict(&Voigt::new(1.1, 1.0, 1.0, 0.1, 0.0, 0.0))?;
    println!("S11 = {:.4} MPa, spread {:.4} MPa", found.stress[0] / 1e6, found.spread / 1e6);
    println!("C1111 = {:.4} MPa", found.tangent.unwrap_or_default()[(0, 0)] / 1e6);
    println!("outside the training data: {:?}, never varied: {:?}", found.flags.outside, found.flags.unseen);

    // many points: bit-identical at half the cost, without allocations after the first call
    let points: Vec<Voigt> =
        (0..1000).map(|k| Voigt::new(1.0 + 1e-4 * f64::from(k), 1.0, 1.0, 0.0, 0.0, 0.0)).collect();
    let (mut predictions, mut memory) = (vec![Prediction::default(); points.len()], Workspace::default());
    model.stresses(&points, &mut memory, &mut predictions)?;
    let last = predictions.last().ok_or("no points")?;
    println!(
        "at C11 = 1.0999: S11 = {:.4} MPa, W = {:.4} kJ/m³",
        last.stress[0] / 1e6,
        last.energy.unwrap_or(0.0) / 1e3
    );
    Ok(())
}
