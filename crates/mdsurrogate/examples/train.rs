//! Trains an energy on stresses of a known law, checks that it is elastic, and exports it as C.

use mdsurrogate::dataset::DataRow;
use mdsurrogate::export::c_source;
use mdsurrogate::fitted;
use mdsurrogate::random::SplitMix64;
use mdsurrogate::train::{Settings, fit};
use polycore::constitutive::hyperelastic::{Compressible, Hyperelastic, NeoHookean, Volumetric};
use polycore::constitutive::network::{Activation::Softplus, Architecture};
use polycore::constitutive::surrogate::{Kind, Symmetry};
use polycore::constitutive::verify::{Deviations, deformations};
use polycore::tensor::{DeformationGradient, Tensor, voigt};

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    // deformations with strains of some per cent, and the Cauchy stress of a neo-Hookean solid
    let truth = Compressible::new(NeoHookean::new(1e6)?, Volumetric::Logarithmic { lame: 2e6 })?;
    let mut random = SplitMix64::new(1);
    let mut rows = Vec::new();
    for sample in 0..400 {
        let noise = Tensor::from_fn(|_, _| 0.3 * (random.uniform() - 0.5));
        let f = DeformationGradient::new(Tensor::identity() + noise)?;
        rows.push(DataRow::new(sample, f64::NAN, f, voigt::from_stress(&truth.cauchy(&f)?)));
    }
    let rows: Vec<&DataRow> = rows.iter().collect();

    let kind = Kind::energy(Symmetry::Isotropic);
    let architecture = Architecture::new(kind.inputs(), &[(16, Softplus), (16, Softplus)], 1);
    let header = fitted::header(kind, architecture, 1, &rows, true)?;
    let settings = Settings { epochs: 60, learning_rate: 5e-3, ..Settings::default() };
    let (model, states) = fit(header, &rows, &[], settings)?;
    println!(
        "{} parameters, loss {:.2e} MPa²",
        model.header().architecture.parameters(),
        states[0].best_loss()
    );

    let found = Deviations::measure(&model, &deformations()[..3])?;
    println!(
        "tangent against finite differences {:.1e}, stress at rest {:.1e}",
        found.tangent, found.stress_at_rest
    );
    let shear = model.predict(&[1.0, 1.01, 1.0, 0.1, 0.0, 0.0].into())?.stress[3];
    println!("S12 at a shear of 0.1: {:.4} MPa", shear / 1e6);
    println!("C source: {} bytes", c_source(&model, "law")?.source.len());
    assert!((shear / 1e5 - 1.0).abs() < 0.2, "about the shear modulus times 0.1: {shear} Pa");
    Ok(())
}
