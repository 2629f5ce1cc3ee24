//! Interfaces whose compressed bonds break where their parts slide.

use crate::answers::solve;

/// Two blocks of 20 × 10 mm, the right one moved by `motion`; share of the bonds across that are broken,
/// number of broken bonds and of fragments.
fn blocks(slides: bool, motion: &str, solver: &str) -> [f64; 3] {
    blocks_of(slides, motion, solver, [3.015, 1.05])
}

/// The same by horizon ratio and critical stretch.
fn blocks_of(slides: bool, motion: &str, solver: &str, [ratio, stretch]: [f64; 2]) -> [f64; 3] {
    let text = format!(
        r#"version = 1
program = "peri"
[body]
space = "plane-stress"
thickness = "1 mm"
spacing = "1 mm"
horizon_ratio = {ratio}
shapes = [
  {{ add = "box", min = ["-20 mm", "0 mm"], max = ["0 mm", "10 mm"], part = "left" }},
  {{ add = "box", min = ["0 mm", "0 mm"], max = ["20 mm", "10 mm"], part = "right" }},
]
[material]
youngs_modulus = "2 MPa"
law = "linear"
[[interface]]
between = ["left", "right"]
critical = {{ stretch = {stretch} }}
slides = {slides}
[[boundary]]
side = "x-"
depth = "17 mm"
displacement = ["0 mm", "0 mm"]
[[boundary]]
side = "x+"
depth = "17 mm"
displacement = {motion}
{solver}
[output]
pictures = false
fields = false
"#
    );
    let directory = tempfile::tempdir().unwrap();
    let finished = solve(&text, directory.path());
    let value = |wanted: &str| finished.outcomes[0].get(wanted).unwrap_or(0.0);
    ["broken_across_left-right", "broken_bonds", "fragments"].map(value)
}

const STEPS: &str = "[solver]\nsteps = 20";

/// Sheared along the plane, all bonds across break, by steps and in time; without `slides` those under
/// compression stay and hold the parts together.
#[test]
fn parts_that_slide_lose_their_compressed_bonds() {
    let shear = r#"["0 mm", "4 mm"]"#;
    let [broken, _, fragments] = blocks(true, shear, STEPS);
    assert!(broken == 1.0 && fragments == 2.0, "{broken} {fragments}");
    let [held, _, fragments] = blocks(false, shear, STEPS);
    assert!((0.3..0.9).contains(&held) && fragments == 1.0, "{held} {fragments}");
    let time = "[solver]\nmethod = \"verlet\"\n[dynamics]\ndensity = \"1000 kg/m^3\"\n\
                ramp = \"5 ms\"\nend_time = \"5 ms\"\nrecords = 10";
    let [broken, _, fragments] = blocks(true, shear, time);
    assert!(broken == 1.0 && fragments == 2.0, "{broken} {fragments}");
}

/// Bonds across are compressed by more than 1/λ_c. None breaks; at a larger horizon some do in tension, as
/// the blocks bulge, but those under compression stay, except a few at the edges, which slip.
#[test]
fn parts_that_are_pressed_together_stay_bonded() {
    assert_eq!(blocks(true, r#"["-1.5 mm", "0 mm"]"#, STEPS)[1..], [0.0, 1.0]);
    let press = r#"["-1 mm", "0 mm"]"#;
    let [slides, held] = [true, false].map(|slides| blocks_of(slides, press, STEPS, [4.015, 1.005]));
    assert!(held[1] > 0.0 && slides[0] < 0.15 && slides[1] < 1.5 * held[1], "{slides:?} {held:?}");
    assert_eq!([slides[2], held[2]], [1.0; 2]);
}
