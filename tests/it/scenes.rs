//! Small valid scenes.

/// A plate with a hole on a lattice of `spacing` ("20 mm" has 2468 particles), under tension, against Kirsch.
pub fn plate(spacing: &str, tolerance: &str) -> String {
    format!(
        r#"version = 1
program = "peri"
title = "Small plate"

[body]
space = "plane-stress"
thickness = "10 mm"
shapes = [
  {{ add = "box", min = ["-500 mm", "-500 mm"], max = ["500 mm", "500 mm"] }},
  {{ cut = "disk", centre = ["0 mm", "0 mm"], radius = "60 mm" }},
]

[material]
youngs_modulus = "1 MPa"
law = "chain-offset"
links = 720
dissociation = 1200

[[boundary]]
side = "x+"
traction = ["1 kPa", "0 Pa"]

[[boundary]]
side = "x-"
traction = ["-1 kPa", "0 Pa"]

[solver]
tolerance = {tolerance}

[stress]
measures = ["hardy", "one-point"]

[exact]
problem = "kirsch"
radius = "60 mm"
remote_stress = "1 kPa"

[[study]]
spacing = [{spacing}]
"#
    )
}

/// A bar 200 × 40 × 40 mm with a crack across a part of it, stretched by 10 % in three steps.
pub fn bar() -> &'static str {
    r#"version = 1
program = "peri"

[body]
space = "solid"
spacing = "10 mm"
shapes = [{ add = "box", min = ["0 mm", "0 mm", "0 mm"], max = ["200 mm", "40 mm", "40 mm"] }]
cracks = [{ from = ["100 mm", "0 mm", "0 mm"], to = ["100 mm", "20 mm", "0 mm"],
    and = ["100 mm", "0 mm", "40 mm"] }]

[material]
youngs_modulus = "1 MPa"
law = "chain-affine"
links = 100
dissociation = 1200
volume_correction = "linear"
surface_correction = "energy"

[[boundary]]
side = "x-"
displacement = ["0 mm", "0 mm", "0 mm"]

[[boundary]]
side = "x+"
displacement = ["20 mm", "free", "free"]

[solver]
tolerance = 1e-4
steps = 3

[stress]
measures = ["one-point"]
"#
}

/// A strip of scattered points, `points.csv` beside the scene, pulled to the right.
pub fn strip() -> &'static str {
    r#"version = 1
program = "peri"

[body]
space = "plane-strain"
thickness = "1 mm"
horizon = "3.2 mm"
points = "points.csv"

[material]
youngs_modulus = "1 MPa"
law = "linear"

[[boundary]]
side = "x-"
displacement = ["0 mm", "0 mm"]

[[boundary]]
side = "x+"
force = ["0.1 N", "0 N"]

[solver]
tolerance = 1e-6

[stress]
measures = ["hardy"]
"#
}

/// The points of [`strip`]: 80 × 20 of them, 1 mm apart, each moved by up to 0.2 mm.
pub fn points() -> String {
    let mut random = Random(1);
    let mut text = String::from("# m and m³\nx,y,volume\n");
    for index in 0..80 * 20 {
        let at = |cell: i32, shift: f64| (f64::from(cell) + 0.4 * (shift - 0.5)) * 1e-3;
        let (x, y) = (at(index % 80, random.next()), at(index / 80, random.next()));
        text += &format!("{x},{y},1e-9\n");
    }
    text
}

/// A sheet with a notch, pulled apart in explicit dynamics.
pub fn cracking(spacing: &str, precision: &str) -> String {
    format!(
        r#"version = 1
program = "peri"

[body]
space = "plane-stress"
thickness = "1 mm"
spacing = "{spacing}"
shapes = [{{ add = "box", min = ["-40 mm", "-60 mm"], max = ["40 mm", "60 mm"] }}]
cracks = [{{ from = ["-41 mm", "0 mm"], to = ["0 mm", "0 mm"] }}]

[material]
youngs_modulus = "32 GPa"
law = "linear"
critical = {{ fracture_energy = "100 J/m^2" }}

[[boundary]]
side = "y+"
displacement = ["free", "0.06 mm"]

[[boundary]]
side = "y-"
displacement = ["free", "-0.06 mm"]

[solver]
method = "verlet"
fit_bound = 1e-6

[dynamics]
density = "2500 kg/m^3"
end_time = "0.1 ms"
ramp = "0.1 ms"
precision = "{precision}"
records = 20
"#
    )
}

/// A cracked sheet that is pulled apart, with fields of its stages; `solver` adds lines to its settings.
pub fn fracture(spacing: &str, solver: &str) -> String {
    format!(
        r#"version = 1
program = "peri"

[body]
space = "plane-stress"
thickness = "3 mm"
spacing = "{spacing}"
shapes = [{{ add = "box", min = ["-40 mm", "-100 mm"], max = ["40 mm", "100 mm"] }}]
cracks = [{{ from = ["-41 mm", "0 mm"], to = ["-20 mm", "0 mm"] }}]

[material]
youngs_modulus = "0.6 MPa"
law = "chain-offset"
links = 720
dissociation = 1200
critical = {{ percent_over_contour = 1.2 }}

[[boundary]]
name = "grip"
side = "y-"
displacement = ["0 mm", "0 mm"]

[[boundary]]
side = "y+"
displacement = ["0 mm", "240 mm"]

[solver]
steps = 60
stop_below = 0.02
{solver}

[stress]
measures = ["hardy"]

[output]
every = 10
load_at = ["20 mm"]
"#
    )
}

/// Small random generator in [0, 1) (Knuth's MMIX constants), the same in every run.
pub struct Random(pub u64);

impl Random {
    /// Returns the next number.
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// A block on a rough floor below a press, which move by curves over the time of three steps: equilibria,
/// explicit dynamics, equilibria.
pub const STEPS_IN_CONTACT: &str = r#"version = 1
program = "peri"
[body]
space = "plane-strain"
thickness = "1 mm"
spacing = "0.5 mm"
shapes = [{ add = "box", min = ["0 mm", "0 mm"], max = ["16 mm", "8 mm"] }]
[material.solid]
law = "correspondence"
constitutive = { model = "neo-hookean", parameters = { shear_modulus = "1 MPa" }, bulk_modulus = "2 MPa" }
[[boundary]]
side = "x-"
displacement = ["0 mm", "free"]
[contact]
stiffness = 0
[[contact.plane]]
name = "floor"
point = ["0 mm", "0 mm"]
normal = [0, 1]
stiffness = 5
friction = 0.3
displacement = ["1 mm", "0 mm"]
curve = "0.2 * max(t - 1, 0)"
[[contact.indenter]]
name = "press"
point = ["8 mm", "12 mm"]
radius = "4 mm"
stiffness = 5
displacement = ["0 mm", "-0.4 mm"]
curve = "min(t, 1) - max(t - 1.001, 0)"
[[time.step]]
duration = "1 s"
increments = 3
[solver]
tolerance = 1e-7
[[step]]
boundary = [{ side = "x-", displacement = ["hold", "free"] }]
dynamics = { density = "1000 kg/m^3", end_time = "1 ms" }
[[step]]
boundary = [{ side = "x-", displacement = ["hold", "free"] }]
time = { step = [{ duration = "0.6 s", increments = 3, factor = 1 }] }
solver = { tolerance = 1e-7 }
"#;
