//! A law of your own behind the trait that all laws share, measured by the battery that all laws pass.

use polycore::constitutive::verify::{Deviations, deformations};
use polycore::constitutive::{Error, Law, Prediction, Workspace};
use polycore::tensor::{Voigt, Voigt6x6, voigt};

/// Saint Venant and Kirchhoff: S = λ tr(E) 1 + 2μE.
struct SaintVenantKirchhoff {
    lame: f64,
    shear: f64,
}

impl Law for SaintVenantKirchhoff {
    fn name(&self) -> String {
        "Saint Venant-Kirchhoff".into()
    }

    fn stress(&self, c: &Voigt, memory: &mut Workspace) -> Result<Prediction, Error> {
        Ok(Prediction { tangent: None, ..self.tangent(c, memory)? })
    }

    fn tangent(&self, c: &Voigt, _: &mut Workspace) -> Result<Prediction, Error> {
        // E with its shear doubled, so that S = ℂ E and W = ½ S·E
        let strain = voigt::strain_from_right_cauchy_green(c);
        let tangent = Voigt6x6::from_fn(|a, b| {
            let isotropic = if a == b { if a < 3 { 2.0 * self.shear } else { self.shear } } else { 0.0 };
            isotropic + if a < 3 && b < 3 { self.lame } else { 0.0 }
        });
        let stress = tangent * strain;
        let energy = Some(0.5 * stress.dot(&strain));
        Ok(Prediction { stress, tangent: Some(tangent), energy, ..Prediction::default() })
    }
}

fn main() -> Result<(), Error> {
    let law = SaintVenantKirchhoff { lame: 2e9, shear: 1e9 };
    let moduli = law.moduli(&mut Workspace::default())?;
    println!("{}: K = {:.4e} Pa, μ = {:.4e} Pa", law.name(), moduli.bulk, moduli.shear);
    let found = Deviations::measure(&law, &deformations())?;
    println!("{found:#?}");
    let passes = found.stress.is_some_and(|error| error < 2e-8) && found.tangent < 2e-8 && found.bits == 0.0;
    assert!(passes && found.stress_at_rest == 0.0 && found.objectivity < 1e-12);
    Ok(())
}
