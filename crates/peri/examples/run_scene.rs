//! Runs a scene from a program, as the command line does, and reads values by name.

use harness::case::{self, Options};
use harness::scene::Source;
use peri::program::run::Peri;

const SCENE: &str = r#"
version = 1
program = "peri"
[body]
space = "plane-stress"
thickness = "1 mm"
spacing = "1 mm"
shapes = [{ add = "box", min = ["0 mm", "0 mm"], max = ["40 mm", "10 mm"] }]
[material]
youngs_modulus = "1 MPa"
law = "linear"
[[boundary]]
side = "x-"
displacement = ["0 mm", "free"]
[[boundary]]
side = "x+"
displacement = ["1 mm", "free"]
[output]
pictures = false
fields = false
"#;

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let directory = std::env::temp_dir().join(format!("run-scene-{}", std::process::id()));
    let source = Source::new("strip.toml", SCENE);
    let finished = case::run::<Peri>(&source, Options::new(&directory))?;
    for name in ["stored_energy", "largest_stretch", "largest_displacement"] {
        println!("{name} = {:.4e}", finished.report.scalar(name).unwrap_or(f64::NAN));
    }
    std::fs::remove_dir_all(directory)?;
    Ok(())
}
