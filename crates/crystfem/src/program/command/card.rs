//! `crystfem card`: exports the thermal materials of a scene as material cards.

use crate::error::Error;
use crate::material::{CONSTANT_NAMES, Polymer, ThermalProperty};
use crate::program::scene::{Law, MaterialSpec, PartScene, PointScene, SceneKind, kind};
use harness::scene::{Failure, SceneError, Source};
use polycore::file::atomic_write;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;

/// Options of `crystfem card`.
#[derive(clap::Args)]
pub struct Options {
    /// Scene with the materials.
    scene: PathBuf,
    /// Program that reads the cards.
    #[arg(long, value_enum, default_value_t = CardHost::Abaqus)]
    host: CardHost,
    /// Units of the cards.
    #[arg(long, value_enum, default_value_t = Units::Si)]
    units: Units,
    /// Write temperatures in °C instead of K.
    #[arg(long)]
    celsius: bool,
    /// Folder of the cards; each material gets NAME.inp.
    #[arg(long, short, default_value = "cards")]
    output: PathBuf,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum CardHost {
    Abaqus,
    Calculix,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Units {
    /// m, kg, s.
    Si,
    /// mm, t, s: N, MPa, mJ.
    Mm,
}

impl Units {
    /// Returns 1 J/kg and 1 kg/m³ in these units; 1 W/(m K) is 1 in both systems.
    fn factors(self) -> [f64; 2] {
        match self {
            Self::Si => [1.0, 1.0],
            Self::Mm => [1e6, 1e-12],
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Si => "m, kg, s",
            Self::Mm => "mm, t, s (N, MPa, mJ)",
        }
    }
}

/// Writes the cards and prints their paths.
///
/// # Errors
/// Returns an error for a scene without materials, a material without a card, or an unwritable file.
pub fn write(options: &Options) -> Result<bool, Failure<Error>> {
    let source = Source::read(&options.scene)?;
    let mut written = Vec::new();
    for (name, spec, key) in materials(&source)? {
        let name = if name.is_empty() { "material".to_owned() } else { name };
        let (deck, constants) = card(options, &source, &name, &spec, &key)?;
        written.push((format!("{name}.inp"), deck));
        written.extend(constants.map(|text| (format!("{}.umatht", host_name(&name).to_lowercase()), text)));
    }
    std::fs::create_dir_all(&options.output).map_err(polycore::Error::from_io("create", &options.output))?;
    for (file, text) in written {
        let path = options.output.join(file);
        atomic_write(&path, |out| out.write_all(text.as_bytes()))?;
        harness::say!("{}", path.display());
    }
    Ok(true)
}

/// Returns name, block and key of each material.
fn materials(source: &Source) -> Result<Vec<(String, MaterialSpec, String)>, Failure<Error>> {
    match kind(source)? {
        SceneKind::Part => {
            let scene: PartScene = source.parse()?;
            let located = |(name, spec): (String, MaterialSpec)| {
                let key = format!("materials.{name}");
                (name, spec, key)
            };
            Ok(scene.materials.into_iter().map(located).collect())
        }
        SceneKind::Point => {
            let scene: PointScene = source.parse()?;
            let all = scene.materials(source)?;
            Ok(all.into_iter().map(|(name, spec, key)| (name, spec.clone(), key)).collect())
        }
        SceneKind::Fit => {
            let allowed = "a scene with `[material]` or `[materials]`: the run writes the fitted constants \
                as a block for it";
            Err(source.error("fit", "a fit scene, which has no material", allowed).into())
        }
    }
}

/// Converts a name to capitals, digits and underscores.
fn host_name(name: &str) -> String {
    name.to_uppercase().chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect()
}

/// Returns the card of a material, and for CalculiX the file of the constants that do not fit the card.
fn card(
    options: &Options,
    source: &Source,
    name: &str,
    spec: &MaterialSpec,
    key: &str,
) -> Result<(String, Option<String>), SceneError> {
    let [heat, density] = options.units.factors();
    let degrees = if options.celsius { "°C" } else { "K" };
    let mut text = format!(
        "** {name} of {}, units {}, {degrees}\n*MATERIAL, NAME={}\n",
        source.path.display(),
        options.units.name(),
        host_name(name)
    );
    let density = format!("*DENSITY\n{}\n", digits(density * spec.density.si()));
    if spec.conductivity_factors.is_some() || spec.powder.is_some() || spec.law == Law::AsPublished {
        let found = "an anisotropic, powder or `as-published` material";
        return Err(source.error(key, found, "an isotropic conductor or polymer (others have no card)"));
    }
    if spec.law == Law::Conductor {
        let [conductivity, capacity] = spec.properties(source, key)?;
        let zero = if options.celsius { 273.15 } else { 0.0 };
        text += &format!("*CONDUCTIVITY\n{}", lines(&conductivity, 1.0, zero));
        text += &format!("*SPECIFIC HEAT\n{}", lines(&capacity, heat, zero));
        return Ok((text + &density, None));
    }
    let polymer = spec.polymer(source, key)?;
    let constants = constants(&polymer, options).ok_or_else(|| {
        let allowed = "constants, because the subroutine takes no temperature tables";
        source.error(key, "a temperature table for `conductivity` or `specific_heat`", allowed)
    })?;
    let capacity = constants[1];
    let (listed, rest) = match options.host {
        CardHost::Abaqus => (constants, None),
        CardHost::Calculix => {
            let rest = CONSTANT_NAMES
                .iter()
                .zip(&constants[6..])
                .map(|(name, value)| format!("{name} = {}\n", digits(*value)));
            let head = [&constants[..3], &[3.0], &constants[4..6]].concat();
            (head, Some(format!("# constants 7 to 15 of {name}, SI\n{}", rest.collect::<String>())))
        }
    };
    let _ = writeln!(text, "*USER MATERIAL, TYPE=THERMAL, CONSTANTS={}", listed.len());
    for row in listed.chunks(8) {
        let row: Vec<String> = row.iter().map(|number| digits(*number)).collect();
        let _ = writeln!(text, "{}", row.join(", "));
    }
    text += &density;
    if options.host == CardHost::Calculix {
        let _ = writeln!(text, "*SPECIFIC HEAT\n{}", digits(capacity));
    }
    // CalculiX takes latent heat as a load, computed from a fourth state variable
    let states = if options.host == CardHost::Calculix && polymer.latent_heat.is_some() { 4 } else { 3 };
    let _ = writeln!(text, "*DEPVAR\n{states}");
    Ok((text, rest))
}

/// Returns the fifteen UMATHT constants in the host's units, or `None` for temperature-dependent properties.
fn constants(polymer: &Polymer, options: &Options) -> Option<Vec<f64>> {
    let (ThermalProperty::Constant(conductivity), ThermalProperty::Constant(capacity)) =
        (&polymer.conductivity, &polymer.specific_heat)
    else {
        return None;
    };
    let heat = options.units.factors()[0];
    let latent = polymer.latent_heat.unwrap_or(0.0) * polymer.ultimate_crystallinity;
    let zero = if options.celsius { 273.15 } else { 0.0 };
    let host = if options.host == CardHost::Calculix { 1.0 } else { 0.0 };
    let mut all = vec![*conductivity, heat * capacity, heat * latent, 0.0, zero, host];
    all.extend(polymer.growth_and_melting());
    Some(all)
}

/// Formats a number to 12 digits, without rounding noise.
fn digits(number: f64) -> String {
    let short: f64 = format!("{number:.11e}").parse().unwrap_or(number);
    format!("{short:?}")
}

/// Formats a constant, or one row of value and temperature per table entry.
fn lines(property: &ThermalProperty, factor: f64, zero: f64) -> String {
    match property {
        ThermalProperty::Constant(value) => digits(factor * value) + "\n",
        ThermalProperty::Table(table) => table
            .rows()
            .map(|[temperature, value]| {
                format!("{}, {}\n", digits(factor * value), digits(temperature - zero))
            })
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = r#"
version = 1
program = "crystfem"
[materials.own-pp]
law = "semicrystalline"
density = "905 kg/m^3"
conductivity = "0.2 W/(m K)"
specific_heat = "1900 J/(kg K)"
 kinetics = { growth_rate = "5.3e6 1/s", nucleation = "3.3e5 K^2", equilibrium_melting = "458.2 K",
  frozen = "231.2 K", avrami_exponent = 3.0 }
melting = { sharpness = "0.965 1/K", shape = 8.584, peak = "438 K" }
crystallinity = 0.5
latent_heat = "200 J/g"
[materials.glass]
law = "conductor"
density = "2500 kg/m^3"
conductivity = { temperature = ["0 degC", "100 degC"], value = ["1 W/(m K)", "1.2 W/(m K)"] }
specific_heat = "800 J/(kg K)"
[[point]]
name = "p"
start = "180 degC"
legs = [{ hold = "1 s" }]
"#;

    fn cards(host: CardHost, units: Units, celsius: bool) -> Vec<(String, Option<String>)> {
        let options = Options { scene: "s.toml".into(), host, units, celsius, output: "cards".into() };
        let source = Source::new("s.toml", SCENE);
        let all = materials(&source).unwrap();
        all.iter().map(|(name, spec, key)| card(&options, &source, name, spec, key).unwrap()).collect()
    }

    #[test]
    fn cards_use_units_of_the_host() {
        let [(glass, none), (pp, nothing)] = &cards(CardHost::Abaqus, Units::Mm, true)[..] else {
            panic!("two")
        };
        assert!(none.is_none() && nothing.is_none());
        let expected = "*CONDUCTIVITY\n1.0, 0.0\n1.2, 100.0\n*SPECIFIC HEAT\n800000000.0\n*DENSITY\n2.5e-9\n";
        assert!(glass.ends_with(expected), "{glass}");
        let expected = "*MATERIAL, NAME=OWN_PP\n*USER MATERIAL, TYPE=THERMAL, CONSTANTS=15\n\
                        0.2, 1900000000.0, 100000000000.0, 0.0, 273.15, 0.0, 5300000.0, 330000.0\n\
                        6270.0, 458.2, 231.2, 3.0, 0.965, 8.584, 438.0\n*DENSITY\n9.05e-10\n*DEPVAR\n3\n";
        assert!(pp.ends_with(expected), "{pp}");
    }

    /// CalculiX: six constants, nine in a file, a card for c and a fourth state variable for latent heat.
    #[test]
    fn calculix_card_has_six_constants() {
        let all = cards(CardHost::Calculix, Units::Si, false);
        let (deck, Some(file)) = &all[1] else { panic!("a file") };
        let expected = "CONSTANTS=6\n0.2, 1900.0, 100000.0, 3.0, 0.0, 1.0\n*DENSITY\n905.0\n\
                        *SPECIFIC HEAT\n1900.0\n*DEPVAR\n4\n";
        assert!(deck.ends_with(expected), "{deck}");
        assert_eq!(file.lines().filter(|line| line.contains(" = ")).count(), 9);
        assert!(file.contains("melting_peak = 438.0\n"), "{file}");
    }
}
