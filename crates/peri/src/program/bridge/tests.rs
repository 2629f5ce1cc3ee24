use super::{LammpsModel, export, import};
use crate::bonds::{self, BodyGeometry, BondDamage, BondForces, LatticeBonds, VolumeCorrection};
use crate::field::Field;
use crate::geometry::{Operation, Shape, lattice};
use crate::potential::{BondPotential, KernelFit, Law};
use crate::solver::{Loads, Support};
use harness::scene::Source;

fn strip() -> (LatticeBonds<2>, Loads<2>) {
    let body = [Operation::Add(Shape::Box { min: [0.0; 2], max: [0.02, 0.03] })];
    let bonds =
        LatticeBonds::new(lattice(&body, 2e-3, 3e-3).unwrap(), 3.015, VolumeCorrection::Linear, &[]).unwrap();
    let side = |low: f64, high: f64, up: f64| {
        let inside = |&&site: &&u32| (low..high).contains(&bonds.position(site as usize)[1]);
        let sites = bonds.particles().iter().filter(inside).copied().collect();
        (sites, Support { displacement: [None, Some(up)], body_force: [0.0; 2] })
    };
    let loads = Loads::new(bonds.sites(), &[side(0.0, 0.006, 0.0), side(0.024, 0.03, 4e-3)]);
    (bonds, loads)
}

fn law() -> Box<dyn BondPotential> {
    Law::ChainOffset.build(720.0, 1200.0, true).unwrap()
}

/// The forces of the self-check state against the solver's own kernel; each bond is exported once.
#[test]
fn exported_bonds_are_those_of_the_kernel() {
    let ((mut body, loads), law, modulus) = (strip(), law(), 3e12);
    let model = LammpsModel::new(&body, &*law, modulus, Some(2.5), &loads);
    assert_eq!(2 * model.bonds.len() as u64, body.directed_bonds());
    assert_eq!(model.types.len(), 6);
    assert_eq!(model.clamps.len(), 2);
    assert!((model.reach - 4e-3).abs() < 1e-15);
    let places = model.check_state();
    let mut displacement = Field::zeros(body.sites());
    for (k, &site) in body.particles().iter().enumerate() {
        displacement.set(site as usize, [0, 1].map(|d| places[k][d] - model.positions[k][d]));
    }
    let forces = model.forces(&places);
    let fit = KernelFit::new(&*law, [0.5, 2.0], 1e-10).unwrap();
    body.set_law(&fit, modulus);
    let mut found = Field::zeros(body.sites());
    bonds::force(&body, &displacement, &mut found);
    let scale = forces.iter().flatten().fold(0.0, |most: f64, f| most.max(f.abs()));
    for (k, &site) in body.particles().iter().enumerate() {
        let (site, volume) = (site as usize, body.volume(site as usize));
        for d in 0..2 {
            let off = (found.get(site)[d] * volume - forces[k][d]).abs();
            // 28 bonds, each within the fit's bound of its force; of large forces in balance little is left
            assert!(off < 1e-7 * scale, "{off:e} of {scale:e}");
        }
    }
}

/// Tables: the force is minus the derivative of the energy, that of the law up to λc, and linear beyond it.
#[test]
fn tables_hold_the_law() {
    let ((body, loads), law) = (strip(), law());
    let critical = 2.5;
    let model = LammpsModel::new(&body, &*law, 3e12, Some(critical), &loads);
    let (points, mut text) = (model.points(), Vec::new());
    model.write_tables(points, &mut text).unwrap();
    let text = String::from_utf8(text).unwrap();
    let sections: Vec<&str> = text.split("\nB").skip(1).collect();
    assert_eq!(sections.len(), model.types.len());
    for (kind, section) in sections.iter().enumerate() {
        let rows: Vec<[f64; 3]> = section
            .lines()
            .skip(3)
            .filter(|line| !line.is_empty())
            .map(|line| {
                let numbers: Vec<f64> = line.split(' ').skip(1).map(|x| x.parse().unwrap()).collect();
                [numbers[0], numbers[1], numbers[2]]
            })
            .collect();
        assert_eq!(rows.len(), points);
        let (length, scale) = (model.types[kind].length * 1e3, model.types[kind].scale);
        let largest = scale * law.tension(critical);
        for three in rows.windows(3) {
            let [r, _, force] = three[1];
            let l = r / length;
            let slope = (three[2][1] - three[0][1]) / (three[2][0] - three[0][0]);
            // the chain is steep where it is crushed: central differences say little there
            if l > 0.3 {
                assert!((slope + force).abs() < 1e-4 * largest, "l = {l}: {slope} {force}");
            }
            if l < critical {
                assert!((force + scale * law.tension(l)).abs() < 1e-12 * largest, "l = {l}");
            }
        }
        let end = rows.len();
        let bend = rows[end - 1][2] - 2.0 * rows[end - 2][2] + rows[end - 3][2];
        assert!(bend.abs() < 1e-9 * rows[end - 1][2].abs(), "{bend:e}");
        assert!(rows[end - 1][0] / length > 2.0 + 4e-3 / 2e-3);
    }
}

const SCENE: &str = r#"
version = 1
program = "peri"
[body]
space = "plane-stress"
thickness = "1 mm"
spacing = "2 mm"
shapes = [{ add = "box", min = ["0 mm", "0 mm"], max = ["20 mm", "30 mm"] }]
[material]
youngs_modulus = "1 MPa"
law = "linear"
[[boundary]]
side = "y-"
displacement = ["0 mm", "0 mm"]
[[boundary]]
side = "y+"
displacement = ["0 mm", "3 mm"]
"#;

#[test]
fn what_tables_cannot_represent_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let output = directory.path().join("out");
    let refused = |from: &str, to: &str| {
        assert!(SCENE.contains(from), "{from}");
        let source = Source::new("scene.toml", SCENE.replacen(from, to, 1));
        let failure = export(&source, None, &output).unwrap_err().to_string();
        assert!(!output.exists(), "{failure}");
        failure
    };
    let material = "law = \"linear\"";
    for (from, to, expected) in [
        (material, "law = \"linear\"\nsurface_correction = \"energy\"", "material.surface_correction"),
        (
            "youngs_modulus = \"1 MPa\"\nlaw = \"linear\"",
            "[material.solid]\nlaw = \"neo-hooke\"\nshear_modulus = \"1 MPa\"\nbulk_modulus = \"2 MPa\"",
            "material.solid",
        ),
        ("[[boundary]]", "[contact]\n[[boundary]]", "contact"),
        (
            "[[boundary]]",
            "[solver]\nmethod = \"adr\"\nbreaking = \"each-iteration\"\n[[boundary]]",
            "solver.breaking",
        ),
        (
            "[[boundary]]",
            "[[boundary]]\nside = \"x+\"\ntraction = [\"1 kPa\", \"0 kPa\"]\n[[boundary]]",
            "boundary[0].traction`",
        ),
        (
            "[[boundary]]",
            "[[boundary]]\nside = \"x+\"\ntraction_field = [\"y\", \"0\"]\n[[boundary]]",
            "boundary[0].traction_field`: found a traction by formulas",
        ),
        (
            "[body]\nspace = \"plane-stress\"",
            "[[boundary]]\nside = \"x+\"\npressure = \"1 kPa\"\n[body]\nspace = \"plane-strain\"",
            "boundary[0].pressure`: found a pressure",
        ),
        ("\"3 mm\"]", "\"0 mm\"]", "no displacement"),
    ] {
        let failure = refused(from, to);
        assert!(failure.contains(expected), "{expected}: {failure}");
    }
    let several = "[[study]]\nspacing = [\"1 mm\", \"2 mm\"]\n";
    let source = Source::new("scene.toml", format!("{SCENE}{several}"));
    let failure = export(&source, None, &output).unwrap_err().to_string();
    assert!(failure.contains("--variant"), "{failure}");
    let written = export(&source, Some("dx=2mm m=3.015"), &output).unwrap();
    assert_eq!(written.particles, 150);
    for name in ["peri.data", "peri.table", "in.peri", "check.csv", "drive.py", "README.md", "model.json"] {
        assert!(output.join(name).is_file(), "{name}");
    }
}

/// Results made by hand: every particle moved by 0.1 mm along x, one bond broken at the second step.
#[test]
fn results_come_back() {
    let directory = tempfile::tempdir().unwrap();
    let (folder, output) = (directory.path().join("out"), directory.path().join("back"));
    export(&Source::new("scene.toml", SCENE), None, &folder).unwrap();
    let put = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    let failure = import(&folder, &output).unwrap_err().to_string();
    assert!(failure.contains("history.csv"), "{failure}");
    let head = "step,factor,displacement [m],load [N],residual,iterations,rounds,broken";
    put("history.csv", &format!("{head}\n1,0.5,0.0015,2.0,1e-7,10,1,0\n2,1.0,0.003,1.5,1e-7,20,2,1\n"));
    put("broken.0.csv", "2,1,1,2\n");
    let body = std::fs::read_to_string(folder.join("peri.data")).unwrap();
    let (_, atoms) = body.split_once("Atoms # bond\n\n").unwrap();
    let row = |line: &str| {
        let fields: Vec<&str> = line.split(' ').collect();
        let x = fields[3].parse::<f64>().unwrap() + 0.1;
        format!("{} {} {x} {} {} 0 0 0 0\n", fields[0], fields[1], fields[4], fields[5])
    };
    let rows: String = atoms.lines().take_while(|line| !line.is_empty()).map(row).collect();
    let dump = "line\n".repeat(9) + &rows;
    put("step.2.dump", &dump);
    let report = import(&folder, &output).unwrap();
    let scalar = |name: &str| report.scalar(name).unwrap();
    assert_eq!([scalar("peak_load"), scalar("displacement_at_peak")], [2.0, 0.0015]);
    assert_eq!(report.work["iterations"], 30);
    let fields = harness::output::vtkhdf::read(output.join("fields.vtkhdf")).unwrap();
    let (moved, damage) = (fields.data(0, "displacement").unwrap(), fields.data(0, "damage").unwrap());
    assert!(moved.chunks(3).all(|u| (u[0] - 1e-4).abs() < 1e-12 && u[1] == 0.0));
    assert!(damage[0] > 0.0 && damage[1] > 0.0 && damage[2..].iter().all(|&damage| damage == 0.0));
    put("step.2.dump", &dump[..dump.len() - 40]);
    let failure = import(&folder, &output).unwrap_err().to_string();
    assert!(failure.contains("step.2.dump"), "{failure}");
    put("step.2.dump", &dump.replacen(" 0 0 0 0", " nan 0 0 0", 1));
    assert!(import(&folder, &output).unwrap_err().to_string().contains("expected finite numbers"));
}
