//! Bodies of several parts, slots, cracks of several facets, weak layers: bonds between parts, and loads at
//! separation.

use harness::case::{Case, Options, Run};
use harness::output::vtkhdf;
use harness::scene::Source;
use peri::bonds::{
    BodyGeometry, BondDamage, CloudBonds, LatticeBonds, VolumeCorrection, components, fragments,
};
use peri::geometry::{Cut, Gaps, Operation, Shape, lattice};
use peri::model::Body;
use peri::program::run::{FinishedScene, Peri, run};
use peri::program::scene::Scene;

fn solve(text: &str) -> FinishedScene {
    let directory = tempfile::tempdir().unwrap();
    let source =
        Source::new("scene.toml", text.to_owned() + "\n[output]\nfields = false\npictures = false\n");
    let scene = source.parse::<Scene>().unwrap_or_else(|error| panic!("{}", error.render()));
    let mut own = Run::new(const { &Peri::PROGRAM }, &source, Options::new(directory.path()));
    run(&source, &scene, &mut own).unwrap_or_else(|error| panic!("{error}"))
}

fn value(finished: &FinishedScene, name: &str) -> f64 {
    finished.report.scalar(name).unwrap_or_else(|| panic!("no {name} in\n{}", finished.report.table()))
}

fn check(text: &str) -> String {
    let source = Source::new("scene.toml", text);
    let scene = source.parse::<Scene>().unwrap_or_else(|error| panic!("{}", error.render()));
    peri::program::run::explanation(&source, &scene, false)
        .unwrap_or_else(|error| panic!("{error}"))
        .join("\n")
}

fn boxed<const D: usize>(min: [f64; D], max: [f64; D]) -> Operation<D> {
    Operation::Add(Shape::Box { min, max })
}

fn slot<const D: usize>(min: [f64; D], max: [f64; D]) -> Operation<D> {
    Operation::Cut(Shape::Box { min, max })
}

/// Returns the bonds of a lattice of spacing 1 in shapes, with and without gaps.
fn build<const D: usize>(operations: &[Operation<D>]) -> [LatticeBonds<D>; 2] {
    let cells = lattice(operations, 1.0, 1.0).unwrap();
    let gaps = Gaps::of_shapes(operations, &cells, 3.015);
    let whole = LatticeBonds::new(cells.clone(), 3.015, VolumeCorrection::None, &[]).unwrap();
    [LatticeBonds::with_gaps(cells, 3.015, VolumeCorrection::None, &[], gaps.as_ref()).unwrap(), whole]
}

/// Counts the particles of each part.
fn parts<const D: usize>(operations: &[Operation<D>]) -> Vec<usize> {
    let [bonds, whole] = build(operations);
    assert_eq!(fragments(&whole).len(), 1, "all within the horizon");
    let mut sizes: Vec<usize> = fragments(&bonds).iter().map(|part| part.particles).collect();
    sizes.sort_unstable();
    sizes
}

/// Parts counted by hand: gaps of one spacing and of a hundredth, round shapes, points and edges of contact,
/// a sleeve around a shaft.
#[test]
fn parts_that_do_not_touch() {
    let blocks = |gap: f64| [boxed([0.0; 2], [8.0, 5.0]), boxed([0.0, 5.0 + gap], [8.0, 10.0 + gap])];
    assert_eq!(parts(&blocks(1.0)), [40, 40]);
    assert_eq!(parts(&blocks(0.01)), [40, 40]);
    assert_eq!(parts(&blocks(0.0)), [80]);
    assert_eq!(parts(&blocks(1e-6)), [80], "closed, within a thousandth of the spacing");
    assert_eq!(
        parts(&[boxed([0.0; 2], [4.0, 4.0]), boxed([4.0; 2], [8.0, 8.0])]),
        [16, 16],
        "a corner is no face"
    );
    let disk = |x: f64| Operation::Add(Shape::Ball { centre: [x, 0.0], radius: 5.0 });
    assert_eq!(parts(&[disk(-5.0), disk(5.0)]).len(), 2, "a point is no face");
    assert_eq!(parts(&[disk(-4.0), disk(4.0)]).len(), 1);
    let hole = Operation::Cut(Shape::Ball { centre: [0.0, 0.0], radius: 8.0 });
    let disk = |radius: f64| Operation::Add(Shape::Ball { centre: [0.0, 0.0], radius });
    assert_eq!(parts(&[disk(12.0), hole.clone(), disk(7.0)]).len(), 2, "a shaft in a sleeve");
    assert_eq!(parts(&[disk(12.0), hole, disk(8.0)]).len(), 1, "without play");
    let cylinder = |z: f64, radius: f64, axis: usize| {
        Operation::Add(Shape::Cylinder { centre: [0.0, 0.0, z], radius, length: 6.0, axis })
    };
    assert_eq!(parts(&[boxed([-4.0, -4.0, -2.0], [4.0, 4.0, 0.0]), cylinder(4.0, 3.0, 2)]).len(), 2);
    assert_eq!(
        parts(&[boxed([-4.0, -4.0, -2.0], [4.0, 4.0, 0.0]), cylinder(3.0, 3.0, 2)]).len(),
        1,
        "upright"
    );
    assert_eq!(
        parts(&[boxed([-4.0, -4.0, -2.0], [4.0, 4.0, 0.0]), cylinder(3.0, 3.0, 0)]).len(),
        2,
        "on its side"
    );
    assert_eq!(parts(&[cylinder(0.0, 2.0, 0), cylinder(5.0, 2.0, 1)]).len(), 2, "crossed");
    assert_eq!(parts(&[cylinder(0.0, 2.0, 0), cylinder(3.0, 2.0, 1)]).len(), 1);
    let thin = [boxed([0.0; 2], [8.0, 5.0]), boxed([0.0, 5.0], [8.0, 5.2]), boxed([0.0, 5.2], [8.0, 10.2])];
    assert_eq!(parts(&thin).len(), 1, "joined by a plate that holds no particle");
}

/// A slot narrower than the horizon severs what a crack along its middle severs; corners and wide holes keep
/// their bonds.
#[test]
fn slots_sever_bonds() {
    let body = boxed([0.0; 2], [16.0, 11.0]);
    let [slotted, whole] = build(&[body.clone(), slot([-1.0, 5.0], [9.0, 6.0])]);
    let crack = Cut::segment([-1.0, 5.5], [9.0, 5.5]);
    let mut severed = 0;
    for &site in whole.particles() {
        let site = site as usize;
        whole.neighbours(site, &mut |bond| {
            let (a, b) = (whole.position(site), whole.position(bond.site));
            let across = (a[1] - 5.5) * (b[1] - 5.5) < 0.0 && (a[1] - b[1]).abs() > 1.5;
            // through the end of the slot where it leaves neither flank
            let flank = |y: f64| Cut::segment([-1.0, y], [9.0, y]).severs(a, b);
            let passes = across && (flank(5.0) || flank(6.0));
            assert_eq!(slotted.is_bonded(site, bond.site), !passes, "{a:?} {b:?}");
            assert!(passes || !crack.severs(a, b), "{a:?} {b:?}");
            severed += usize::from(passes);
        });
    }
    assert!(severed > 100);
    assert_eq!(parts(&[body.clone(), slot([-1.0, 5.0], [17.0, 6.0])]), [80, 80]);
    assert_eq!(
        parts(&[body.clone(), slot([-1.0, 5.0], [8.0, 6.0]), slot([8.0, 5.0], [17.0, 6.0])]),
        [80, 80]
    );
    // an angle of two boxes, the same cut out of one, and a wide hole: every bond stays
    let angle = [boxed([0.0; 2], [10.0, 4.0]), boxed([0.0; 2], [4.0, 10.0])];
    let cut = [boxed([0.0; 2], [10.0, 10.0]), slot([4.0, 4.0], [10.0, 10.0])];
    let rebate = [boxed([0.0; 2], [10.0, 10.0]), slot([4.0, 8.0], [11.0, 10.0])];
    let hole = [body, Operation::Cut(Shape::Ball { centre: [8.0, 5.5], radius: 3.2 })];
    for operations in [&angle[..], &cut, &rebate, &hole] {
        let [gaps, whole] = build(operations);
        assert_eq!(gaps.intact(), whole.intact());
    }
    // prongs of a fork
    let fork = [boxed([0.0; 2], [4.0, 9.0]), boxed([4.0, 0.0], [12.0, 4.0]), boxed([4.0, 5.0], [12.0, 9.0])];
    let [bonds, _] = build(&fork);
    let at = |x: f64, y: f64| {
        let here = |&&site: &&u32| bonds.position(site as usize) == [x, y];
        *bonds.particles().iter().find(here).unwrap() as usize
    };
    assert!(!bonds.is_bonded(at(8.5, 3.5), at(8.5, 5.5)), "across");
    assert!(bonds.is_bonded(at(3.5, 4.5), at(4.5, 3.5)), "at the root");
}

/// Models of the library keep gaps; points that form a lattice have parts, other points only on request.
#[test]
fn models_and_clouds() {
    let body = || {
        Body::lattice(Shape::rectangle([0.0; 2], [8.0, 5.0]), 1.0)
            .join(Shape::rectangle([0.0, 6.0], [8.0, 9.0]))
    };
    assert_eq!(fragments(&body().build().unwrap()).len(), 2);
    assert_eq!(fragments(&body().bond_gaps().build().unwrap()).len(), 1);
    let mut points: Vec<[f64; 2]> = Vec::new();
    for i in 0..60 {
        let wobble = 0.2 * (7.3 * f64::from(i)).sin();
        points.push([f64::from(i % 10) + wobble, f64::from(i / 10) + if i >= 30 { 1.0 } else { 0.0 }]);
    }
    let gaps = Gaps::of_points(&points, &[1.0; 60], 1.0);
    let cloud = |gaps: Option<&Gaps<2>>| {
        CloudBonds::with_gaps(&points, &[1.0; 60], 1.0, 3.015, VolumeCorrection::None, &[], gaps).unwrap()
    };
    assert_eq!(fragments(&cloud(gaps.as_ref())).len(), 2);
    assert_eq!(fragments(&cloud(None)).len(), 1);
    let roots = components(&cloud(gaps.as_ref()), |_, _| true);
    assert_eq!(roots.len(), 60);
}

const BOXES: &str = r#"version = 1
program = "peri"
[body]
space = "plane-strain"
thickness = "1 mm"
spacing = "1 mm"
shapes = [
 { add = "box", min = ["-15 mm", "-15 mm"], max = ["15 mm", "-10 mm"] },
 { add = "box", min = ["-6 mm", "-9 mm"], max = ["6 mm", "9 mm"] },
 { add = "box", min = ["-15 mm", "10 mm"], max = ["15 mm", "15 mm"] },
]
[material]
youngs_modulus = "2 MPa"
law = "linear"
[contact]
[[boundary]]
side = "y-"
displacement = ["0 mm", "0 mm"]
[[boundary]]
side = "y+"
displacement = ["0 mm", "-PRESS mm"]
[solver]
steps = 4
"#;

/// A free block between two plates has no load before both gaps of 1 mm close, then that of a body in
/// contact. With bonds across the gaps the load is 0.820 N at 1 mm.
#[test]
fn a_block_between_plates_is_pressed_when_gaps_close() {
    let text = BOXES.replace("PRESS", "1");
    let told = check(&text);
    assert!(told.contains("part 1     150 particles of shapes[0]"), "{told}");
    assert!(
        told.contains("part 2     216 particles of shapes[1]") && told.contains("none is bonded"),
        "{told}"
    );
    let open = solve(&text);
    // kθ|ξ| and a strain of 3 %: newtons
    assert!(value(&open, "reaction_y") < 1e-4, "{}", value(&open, "reaction_y"));
    let closed = solve(&BOXES.replace("PRESS", "3"));
    assert!(value(&closed, "contacts") > 0.0 && value(&closed, "reaction_y") > 0.1);
    let bonded = text.replace("spacing = \"1 mm\"\n", "spacing = \"1 mm\"\nbond_gaps = true\n");
    assert!((value(&solve(&bonded), "reaction_y") - 0.820).abs() < 0.01);
    assert!(check(&bonded).contains("1 and 2 are bonded across a gap by"), "{}", check(&bonded));
}

fn layered(shape: &str, more: &str) -> FinishedScene {
    solve(&format!(
        r#"version = 1
program = "peri"
[body]
space = "plane-stress"
thickness = "2 mm"
spacing = "1 mm"
shapes = [{{ add = "box", min = ["-20 mm", "-5 mm"], max = ["20 mm", "5 mm"] }}]
[material]
youngs_modulus = "2 MPa"
law = "linear"
critical = {{ stretch = 1.6 }}
inclusions = [{shape}]
[[boundary]]
side = "x-"
displacement = ["0 mm", "0 mm"]
[[boundary]]
side = "x+"
displacement = ["4 mm", "0 mm"]
[solver]
steps = 40
refine = 64
tolerance = 1e-6
stop_below = 0.02
{more}"#
    ))
}

/// A strip of 20 mm² breaks in its weak layer at E (λ − 1) A = 2.0 N, λ = 1.05; without the layer it carries
/// more than twice that. Layers of one spacing, of a tenth between two columns of particles, two layers, and
/// an oblique staircase.
#[test]
fn weak_layers_break_at_their_own_strength() {
    let weak = |x: f64, width: f64, stretch: f64| {
        let end = x + width;
        format!(
            "{{ shape = {{ add = \"box\", min = [\"{x} mm\", \"-5 mm\"], max = [\"{end} mm\", \"5 mm\"] }}, \
             critical = {{ stretch = {stretch} }} }}"
        )
    };
    let layers = [
        ("one spacing", weak(0.0, 1.0, 1.05)),
        ("without particles", weak(-0.05, 0.1, 1.05)),
        ("the weaker of two", format!("{}, {}", weak(-6.05, 0.1, 1.2), weak(4.95, 0.1, 1.05))),
        (
            "under a stronger one, which does not count",
            format!("{}, {}", weak(-0.05, 0.1, 1.05), weak(6.95, 0.1, 3.0)),
        ),
    ];
    for (name, layer) in layers {
        let torn = layered(&layer, "");
        let (peak, pieces) = (value(&torn, "peak_load"), value(&torn, "fragments"));
        // lateral contraction that the grips hinder, and one step of a 64th: a few parts in a hundred
        assert!((peak / 2.0 - 1.0).abs() < 0.02, "{name}: {peak} N");
        assert!(pieces >= 2.0 && value(&torn, "last_load").abs() < 1e-3, "{name}: {pieces}");
    }
}

const RIDGE: &str = r#"version = 1
program = "peri"
[body]
space = "solid"
spacing = "1 mm"
shapes = [{ add = "box", min = ["-6 mm", "-6 mm", "-9 mm"], max = ["6 mm", "6 mm", "9 mm"] }]
cracks = [
 { from = ["-7 mm", "-7 mm", "0.13 mm"], to = ["0.5 mm", "-7 mm", "0.71 mm"], and = [
  "-7 mm", "7 mm", "0.13 mm"] },
 { from = ["0.5 mm", "-7 mm", "0.71 mm"], to = ["7 mm", "-7 mm", "0.29 mm"], and = [
  "0.5 mm", "7 mm", "CORNER mm"] },
]
[material]
youngs_modulus = "2 MPa"
law = "linear"
critical = { stretch = 5 }
[[boundary]]
side = "z-"
displacement = ["0 mm", "0 mm", "0 mm"]
[[boundary]]
side = "z+"
displacement = ["0 mm", "0 mm", "1 mm"]
"#;

/// Facets whose corners are rounded meet; facets that miss each other by more give a warning. The whole block
/// bears more than 3 N.
#[test]
fn facets_meet() {
    for corner in ["0.71", "0.710001", "0.7099", "0.7105"] {
        let text = RIDGE.replace("CORNER", corner);
        let parted = solve(&text);
        assert_eq!(value(&parted, "fragments"), 2.0, "{corner}");
        assert!(value(&parted, "reaction_z") < 1e-3, "{corner}: {} N", value(&parted, "reaction_z"));
        assert!(!check(&text).contains("warning"), "{}", check(&text));
    }
    let told = check(&RIDGE.replace("CORNER", "0.95"));
    assert!(told.contains("warning    body.cracks[0] misses body.cracks[1] by"), "{told}");
}

/// Plane cracks with ends that meet within a thousandth of the spacing, that miss each other, and that stop
/// before the surface.
#[test]
fn segments_meet() {
    let strip = |cracks: &str| {
        format!(
            r#"version = 1
program = "peri"
[body]
space = "plane-stress"
thickness = "1 mm"
spacing = "1 mm"
shapes = [{{ add = "box", min = ["0 mm", "0 mm"], max = ["10 mm", "20 mm"] }}]
cracks = [{cracks}]
[material]
youngs_modulus = "2 MPa"
law = "linear"
critical = {{ stretch = 5 }}
[[boundary]]
side = "y-"
displacement = ["0 mm", "0 mm"]
[[boundary]]
side = "y+"
displacement = ["0 mm", "1 mm"]
"#
        )
    };
    let two = |x: f64, y: f64| {
        strip(&format!(
            "{{ from = [\"-1 mm\", \"10 mm\"], to = [\"5 mm\", \"10.2 mm\"] }}, {{ from = [\"{x} mm\", \"{y} \
             mm\"], to = [\"11 mm\", \"9.9 mm\"] }}"
        ))
    };
    for (x, y) in [(5.0, 10.2), (5.0003, 10.2), (5.0, 10.2003), (4.9997, 10.1997)] {
        let parted = solve(&two(x, y));
        assert_eq!(value(&parted, "fragments"), 2.0, "{x} {y}");
        assert!(!check(&two(x, y)).contains("warning"), "{x} {y}: {}", check(&two(x, y)));
    }
    let missed = two(5.3, 10.2);
    assert_eq!(value(&solve(&missed), "fragments"), 1.0);
    assert!(check(&missed).contains("misses body.cracks[1] by 0.3000 mm"), "{}", check(&missed));
    let short = strip("{ from = [\"-1 mm\", \"10 mm\"], to = [\"9.3 mm\", \"10 mm\"] }");
    assert!(check(&short).contains("body.cracks[0] ends less than a spacing"), "{}", check(&short));
    let long = strip("{ from = [\"-1 mm\", \"10 mm\"], to = [\"6 mm\", \"10 mm\"] }");
    assert!(!check(&long).contains("warning"), "{}", check(&long));
}

/// Damage includes bonds that cracks of the scene break: the missing fraction of the bonds of a body without
/// the crack, with and without breaking bonds.
#[test]
fn cracks_are_damage() {
    let body = [boxed([0.0; 2], [10e-3, 20e-3])];
    let bonds = |cuts: &[Cut<2>]| {
        LatticeBonds::new(lattice(&body, 1e-3, 1e-3).unwrap(), 3.015, VolumeCorrection::None, cuts).unwrap()
    };
    let [whole, cracked] = [bonds(&[]), bonds(&[Cut::segment([-1e-3, 10e-3], [5e-3, 10e-3])])];
    let lost = whole
        .particles()
        .iter()
        .map(|&site| 1.0 - f64::from(cracked.bonded(site as usize)) / f64::from(whole.bonded(site as usize)));
    let expected: Vec<f64> = lost.collect();
    assert!(expected.iter().any(|&damage| damage > 0.3) && expected.contains(&0.0));
    for critical in ["", "critical = { stretch = 5 }"] {
        let text = format!(
            r#"version = 1
program = "peri"
[body]
space = "plane-stress"
thickness = "1 mm"
spacing = "1 mm"
shapes = [{{ add = "box", min = ["0 mm", "0 mm"], max = ["10 mm", "20 mm"] }}]
cracks = [{{ from = ["-1 mm", "10 mm"], to = ["5 mm", "10 mm"] }}]
[material]
youngs_modulus = "2 MPa"
law = "linear"
{critical}
[[boundary]]
side = "y-"
displacement = ["0 mm", "0 mm"]
[[boundary]]
side = "y+"
displacement = ["0 mm", "0.1 mm"]
[output]
pictures = false
"#
        );
        let directory = tempfile::tempdir().unwrap();
        let source = Source::new("scene.toml", text);
        let scene = source.parse::<Scene>().unwrap_or_else(|error| panic!("{}", error.render()));
        let mut own = Run::new(const { &Peri::PROGRAM }, &source, Options::new(directory.path()));
        run(&source, &scene, &mut own).unwrap_or_else(|error| panic!("{error}"));
        let frames = vtkhdf::read(directory.path().join("dx-1mm_m-3.015.vtkhdf")).unwrap();
        let damage = frames.data(frames.len() - 1, "damage").unwrap();
        // fields are written in single precision
        assert!(damage.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-6) && damage.len() == 200);
    }
}

/// Grips of whole layers change the free length with the spacing; grips of a length that all spacings divide
/// do not.
#[test]
fn free_lengths_of_a_study() {
    let told = |depth: &str| {
        check(&format!(
            r#"version = 1
program = "peri"
[body]
space = "plane-stress"
thickness = "1 mm"
shapes = [{{ add = "box", min = ["0 mm", "0 mm"], max = ["10 mm", "48 mm"] }}]
[material]
youngs_modulus = "2 MPa"
law = "linear"
[[boundary]]
side = "y-"
{depth}
displacement = ["0 mm", "0 mm"]
[[boundary]]
side = "y+"
{depth}
displacement = ["0 mm", "1 mm"]
[[study]]
spacing = ["1 mm", "2 mm"]
"#
        ))
    };
    let layers = told("");
    assert!(
        layers.contains(
            "between y- and y+ is 36.0000 mm at a spacing of 2.0000 mm and 42.0000 mm at 1.0000 mm"
        ),
        "{layers}"
    );
    let depth = told("depth = \"6 mm\"");
    assert!(!depth.contains("warning") && depth.contains("6 layers, 6.0000 mm deep"), "{depth}");
    assert!(told("depth = \"5 mm\"").contains("38.0000 mm at 1.0000 mm"), "{}", told("depth = \"5 mm\""));
}

/// A spacing of a nanometre or a horizon of millions of spacings gives an error with cells and bytes before
/// any allocation.
#[test]
fn bodies_larger_than_memory_are_refused() {
    let build = |spacing: f64, ratio: f64| {
        let body = Body::lattice(Shape::cuboid([0.0; 3], [0.1, 0.05, 0.05]), spacing).horizon(ratio);
        body.build().map(|_| ()).unwrap_err().to_string()
    };
    let error = build(1e-9, 3.015);
    assert!(
        error.contains("found 0.000000001 m") && error.contains("2.500e23 cells") && error.contains("GiB"),
        "{error}"
    );
    assert!(build(1e-300, 3.015).contains("cells"), "{}", build(1e-300, 3.015));
    assert!(build(0.01, 1e7).contains("cells"), "{}", build(0.01, 1e7));
    let plane = Body::lattice(Shape::rectangle([0.0; 2], [1.0, 1.0]), 1e-9).build();
    assert!(plane.map(|_| ()).unwrap_err().to_string().contains("1.000e18 cells"));
}
