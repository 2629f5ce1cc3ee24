//! Tables of the closed-form responses.

use std::fmt::Write;

use polycore::constitutive::hyperelastic::{Hyperelastic, homogeneous, model};
use polycore::units::Stress;

use super::MPA;

/// Arguments of `polycore exact eight-chain "0.27 MPa" 25 --to 4`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Law: neo-hookean, mooney-rivlin, gent, ogden-1, ogden-2, ogden-3, three-chain, eight-chain, …
    law: String,
    /// Parameters in order, stresses with their unit ("0.27 MPa"); μ of Ogden in Abaqus' convention.
    #[arg(required = true, allow_negative_numbers = true)]
    parameters: Vec<String>,
    /// Test.
    #[arg(long, value_enum, default_value = "uniaxial")]
    mode: StretchMode,
    /// First stretch.
    #[arg(long, default_value_t = 1.0)]
    from: f64,
    /// Last stretch.
    #[arg(long, default_value_t = 2.0)]
    to: f64,
    /// Number of stretches.
    #[arg(long, default_value_t = 21, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    points: u32,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum StretchMode {
    Uniaxial,
    Equibiaxial,
    PureShear,
}

/// Computes the table as CSV text.
pub fn table(arguments: &Arguments) -> Result<String, String> {
    let law = law(arguments)?;
    let mut text = String::from("stretch_1,stretch_2,nominal_1_MPa,nominal_2_MPa\n");
    for i in 0..arguments.points {
        let share = f64::from(i) / f64::from(arguments.points.max(2) - 1);
        let l = arguments.from + share * (arguments.to - arguments.from);
        let other = match arguments.mode {
            StretchMode::Uniaxial => l.recip().sqrt(),
            StretchMode::Equibiaxial => l,
            StretchMode::PureShear => 1.0,
        };
        let mut nominal = homogeneous::biaxial(&law, l, other).map_err(|error| error.to_string())?;
        if matches!(arguments.mode, StretchMode::Uniaxial) {
            nominal[1] = 0.0; // but for the rounding of λ^{−1/2}
        }
        let _ = writeln!(text, "{l},{other},{},{}", nominal[0] / MPA, nominal[1] / MPA);
    }
    Ok(text)
}

fn law(arguments: &Arguments) -> Result<Box<dyn Hyperelastic>, String> {
    let model = model(&arguments.law).map_err(|error| error.to_string())?;
    let mut values = Vec::new();
    for (i, given) in arguments.parameters.iter().enumerate() {
        let stress = model.parameters.get(i).is_some_and(|parameter| parameter.unit == "Pa");
        let value = if stress {
            given.parse::<Stress>().map(Stress::si).map_err(|error| format!("`{given}`: {error}"))?
        } else {
            given.parse().map_err(|_| format!("`{given}` is not a number"))?
        };
        values.push(value);
    }
    model.law(&values).map_err(|error| error.to_string())
}
