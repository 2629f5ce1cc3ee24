//! Interfaces and parts with a strength beside the fracture energy.

use crate::answers::solve;

/// Two blocks 10 mm high, pulled apart; `rest` are material and interface.
fn blocks(rest: &str, spacing: f64) -> String {
    format!(
        r#"version = 1
program = "peri"
[body]
space = "plane-stress"
thickness = "1 mm"
spacing = "{spacing} mm"
shapes = [
  {{ add = "box", min = ["-20 mm", "0 mm"], max = ["0 mm", "10 mm"], part = "left" }},
  {{ add = "box", min = ["0 mm", "0 mm"], max = ["20 mm", "10 mm"], part = "right" }},
]
{rest}
[[boundary]]
side = "x-"
depth = "3 mm"
displacement = ["0 mm", "free"]
[[boundary]]
side = "x+"
depth = "3 mm"
displacement = ["2.5 mm", "free"]
[solver]
steps = 50
tolerance = 1e-5
[output]
pictures = false
fields = false
"#
    )
}

/// Peak load, N, and released energy, J.
fn torn(text: &str) -> [f64; 2] {
    let directory = tempfile::tempdir().unwrap();
    let finished = solve(text, directory.path());
    let values = &finished.outcomes[0].values;
    ["peak_load", "released_energy"].map(|wanted| values.iter().find(|(name, ..)| name == wanted).unwrap().1)
}

/// The interface bears its strength, 0.3 or 0.6 N over 10 mm², and takes its fracture energy, 0.2 mJ. It
/// bears up to 1/(1 − ν²) = 9/8 of the strength of a free body, as the blocks hold it along its plane, less
/// half a step, 2.5 %. Bonds that the free ends lack are as many times fewer as the spacing is finer.
#[test]
fn cohesive_interfaces_bear_their_strength_and_take_their_energy() {
    for strength in [30.0, 60.0] {
        let found = [1.0, 0.5].map(|spacing| {
            let rest = format!(
                r#"
[material]
youngs_modulus = "2 MPa"
law = "linear"
[[interface]]
between = ["left", "right"]
critical = {{ fracture_energy = "20 J/m^2", convention = "softening", strength = "{strength} kPa" }}
"#
            );
            torn(&blocks(&rest, spacing))
        });
        for [load, _] in found {
            let part = load / (strength * 0.01);
            assert!((0.975..1.125).contains(&part), "{strength} kPa: {part}");
        }
        let [coarse, fine] = found.map(|[_, energy]| 1.0 - energy / 2e-4);
        assert!(coarse > 0.0 && (fine / coarse - 0.5).abs() < 0.05, "{coarse} {fine}");
    }
}

/// A solid bears the strength; a whole plane that opens at once takes more than a crack that runs along it.
#[test]
fn cohesive_interfaces_of_solids_bear_their_strength() {
    let rest = r#"
[material.solid]
law = "correspondence"
[material.solid.constitutive]
model = "neo-hookean"
parameters = { shear_modulus = "0.75 MPa" }
bulk_modulus = "2 MPa"
[[interface]]
between = ["left", "right"]
critical = { fracture_energy = "20 J/m^2", strength = "60 kPa" }
"#;
    let [load, energy] = torn(&blocks(rest, 1.0));
    assert!((load / 0.6 - 1.0).abs() < 0.025, "{load}");
    assert!(energy > 2e-4, "{energy}");
}

/// Peak load, N, of the blocks, of which the right one has another limit.
fn weaker_part(material: &str, own: &str) -> f64 {
    torn(&blocks(&format!("{material}\n[[material.inclusions]]\npart = \"right\"\n{own}"), 1.0))[0]
}

/// Blocks in series bear the lower strength, whichever fracture energy belongs to the higher one, as blocks
/// do that have it both: to half a step, 2.5 %.
#[test]
fn parts_bear_their_own_strength() {
    let limit = |energy: u32, strength: u32| {
        format!(
            "critical = {{ fracture_energy = \"{energy} J/m^2\", convention = \"softening\", \
             strength = \"{strength} kPa\" }}"
        )
    };
    let bonds = "[material]\nyoungs_modulus = \"2 MPa\"\nlaw = \"linear\"\n";
    let whole = torn(&blocks(&format!("{bonds}{}", limit(20, 30)), 1.0))[0];
    for energy in [10, 20, 40] {
        let part = weaker_part(&format!("{bonds}{}", limit(energy, 60)), &limit(20, 30));
        assert!((part / whole - 1.0).abs() < 0.025, "{energy} J/m²: {part} {whole}");
    }
    let limit = |energy: u32, strength: u32| {
        format!("critical = {{ fracture_energy = \"{energy} J/m^2\", strength = \"{strength} kPa\" }}\n")
    };
    let solid = "[material.solid]\nlaw = \"correspondence\"\nconstitutive = { model = \"neo-hookean\", \
                 parameters = { shear_modulus = \"0.75 MPa\" }, bulk_modulus = \"2 MPa\" }\n";
    let whole = torn(&blocks(&format!("[material]\n{}{solid}", limit(20, 40)), 1.0))[0];
    for energy in [10, 20, 40] {
        let part = weaker_part(&format!("[material]\n{}{solid}", limit(energy, 60)), &limit(20, 40));
        assert!((part / whole - 1.0).abs() < 0.025, "{energy} J/m²: {part} {whole}");
    }
}
