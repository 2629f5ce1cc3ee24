"""Models that run as scenes: turned grips, curves, pressure, rigid surfaces, interfaces, meshes, steps."""

import numpy as np
import pytest

from polymech import Interrupted, Law, SceneError, peri

QUIET = {"output__fields": False}


def test_compressed_then_sheared_is_the_scene(root):
    """Curves as arrays, as a formula and as a function, against the scene's table."""
    scene = peri.run(root / "cases/time/compressed-then-sheared/case.toml")
    corners = (0, 0), (20e-3, 20e-3)
    body = peri.Body.rectangle(*corners, 1e-3, thickness=1e-3, space="plane-strain")
    frame = peri.Body.rectangle(*corners, 1e-3).cut((6e-3, 6e-3), (14e-3, 14e-3))
    tables = [([0, 2, 3], np.array([0.0, 0.0, 1.0])), "min(t, 1)"]
    functions = [lambda t: np.maximum(t - 2, 0), lambda t: np.minimum(t, 1)]
    for curve in (tables, functions):
        model = peri.Model(body, Law("neo-hookean", shear_modulus=0.4e6, bulk_modulus=4e6))
        model.displace(frame, ("0.3*y", "-0.1*y"), curve=curve, name="frame")
        model.time(1, 10).time(1, 1).time(1, 10).add("solver", tolerance=1e-6)
        found = model.run(**QUIET)
        rtol = 0 if curve is tables else 1e-9
        for name in ("stored_energy", "work_of_loads"):
            assert np.isclose(found.report[name], scene.report[name], rtol=rtol, atol=0)


def test_a_stopped_model_resumes(tmp_path):
    """The table of a curve stays beside the checkpoint."""
    body = peri.Body.rectangle((0, 0), (20e-3, 10e-3), 1e-3, thickness=1e-3)
    model = peri.Model(body, "linear", youngs_modulus=1e6).clamp("x-")
    model.displace("x+", (1e-4, None), curve=([0, 0.5, 1], [0, 1, 0])).time(1, 4)
    whole = model.run(**QUIET)
    assert np.allclose(whole.history["load"][1::2] / whole.history["load"].max(), [1, 0], atol=1e-2)
    with pytest.raises(Interrupted) as stopped:
        model.run(tmp_path / "stopped", on_step=lambda step: step.values["time"] < 0.4, **QUIET)
    assert (peri.resume(stopped.value.output).history["load"] == whole.history["load"]).all()
    assert len(list((tmp_path / "stopped").glob("table-*.txt"))) == 1


def test_torque_of_a_twisted_bar():
    """A square bar of 10 particles: T = 0.1406 G a⁴ θ/L (Saint-Venant)."""
    a, length, angle = 10e-3, 30e-3, 0.01
    bar = peri.Body.box((-a / 2, -a / 2, 0), (a / 2, a / 2, length + 6e-3), 1e-3)
    model = peri.Model(bar, "linear", youngs_modulus=1e6)
    model.clamp(("z-", 3e-3)).rotate(("z+", 3e-3), angle, axis=(0, 0, 1), displacement=(0, 0, None))
    model.add("material", surface_correction="energy")
    model.add("output.section", name="middle", point=(0, 0, 18e-3), normal=(0, 0, 1))
    twisted = model.run(**QUIET)
    exact = 0.1406 * 0.4e6 * a**4 * angle / length
    assert abs(twisted.report["middle_moment_z"] / exact - 1) < 0.1
    with pytest.raises(ValueError, match="material, output, rotation: not in `build` and `solve`; use `run`"):
        model.solve()


def test_pressure_follows_and_balances():
    """A block on a wall, pressed from the other side: the reaction is the pressure times the area."""
    body = peri.Body.rectangle((0, 0), (20e-3, 10e-3), 1e-3, thickness=2e-3, space="plane-strain")
    model = peri.Model(body, Law("neo-hookean", 0.4e6, bulk_modulus=0.8e6))
    model.displace("x-", (0, None)).pressure("x+", 1e3).displace(((-1, 4e-3), (1e-3, 6e-3)), (0, 0))
    pressed = model.run(**QUIET, solver__tolerance=1e-6)
    width = 10e-3 * (1 + 0.5e3 / 0.4e6 * 0.25)
    assert abs(pressed.report["reaction_x"] / (1e3 * width * 2e-3) - 1) < 2e-3


def test_rigid_surfaces_are_those_of_a_scene(tmp_path):
    """A ball on a bonded pad, by the texts of a scene and by numbers; its force balances that of the base."""
    body = peri.Body.box((-6e-3, -6e-3, 0), (6e-3, 6e-3, 4e-3), 1e-3)
    rubber = Law("neo-hookean", shear_modulus=1e6, bulk_modulus=4e6)
    model = peri.Model(body, rubber).plane((0, 0, 0), (0, 0, 1), bonded=True, name="base")
    model.displace(((-1.1e-3, -1.1e-3, 0), (1.1e-3, 1.1e-3, 1.1e-3)), (0, 0, None))
    model.sphere((0, 0, 14e-3), 10e-3, (0, 0, -0.5e-3), friction=0.2, name="ball")
    ours = model.run(**QUIET)
    text = """version = 1
program = "peri"
[body]
space = "solid"
spacing = "1 mm"
shapes = [{ add = "box", min = ["-6 mm", "-6 mm", "0 mm"], max = ["6 mm", "6 mm", "4 mm"] }]
[material.solid]
law = "correspondence"
constitutive = { model = "neo-hookean", parameters = { shear_modulus = "1 MPa" }, bulk_modulus = "4 MPa" }
[[boundary]]
min = ["-1.1 mm", "-1.1 mm", "0 mm"]
max = ["1.1 mm", "1.1 mm", "1.1 mm"]
displacement = ["0 mm", "0 mm", "free"]
[contact]
stiffness = 0
[[contact.plane]]
name = "base"
point = ["0 mm", "0 mm", "0 mm"]
normal = [0, 0, 1]
bonded = true
[[contact.indenter]]
name = "ball"
point = ["0 mm", "0 mm", "14 mm"]
radius = "10 mm"
friction = 0.2
displacement = ["0 mm", "0 mm", "-0.5 mm"]
[output]
pictures = false
fields = false
"""
    theirs = peri.run(text)
    assert dict(ours.report) == pytest.approx(dict(theirs.report), rel=1e-9, abs=1e-12)
    assert abs(ours.report["ball_force_z"] / ours.report["base_force_z"] + 1) < 2e-3
    assert ours.report["ball_force_z"] < 0
    cylinder = peri.Model(body, rubber).cylinder((0, 0, 14e-3), (0, 1, 0), 10e-3, force=(0, 0, -1.0))
    block = cylinder.scene()["contact"]["indenter"][0]
    assert block["axis"] == (0, 1, 0) and block["force"] == (0, 0, -1.0) and "displacement" not in block


def test_a_punch_of_an_stl_file(tmp_path):
    """A cube of 4 mm, closed surface of an STL file, pressed by a force."""
    corners = np.array([[x, y, z] for x in (-2, 2) for y in (-2, 2) for z in (0, 4)], dtype=float)
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    lines = ["solid punch"]
    for a, b, c, d in faces:
        for triangle in ((a, b, c), (a, c, d)):
            points = [f"vertex {x:g} {y:g} {z:g}" for x, y, z in corners[list(triangle)]]
            lines += ["facet normal 0 0 0", "outer loop", *points, "endloop", "endfacet"]
    (tmp_path / "punch.stl").write_text("\n".join([*lines, "endsolid"]))
    body = peri.Body.box((-5e-3, -5e-3, 0), (5e-3, 5e-3, 4e-3), 1e-3)
    model = peri.Model(body, Law("neo-hookean", 1e6, bulk_modulus=4e6)).clamp(("z-", 2e-3))
    model.indenter(tmp_path / "punch.stl", 1e-3, (0, 0, 4e-3), force=(0, 0, -1.0), name="punch")
    pressed = model.run(**QUIET)
    assert abs(pressed.report["punch_force_z"] + 1) < 1e-2 and pressed.report["reaction_z"] > 0.9


def test_an_interface_peels():
    """Two arms break along their interface alone, and severed ones at once."""
    upper = peri.Body.rectangle((0, 0), (30e-3, 5e-3), 1e-3, thickness=1e-3, part="upper")
    both = upper.join(peri.Body.rectangle((0, -5e-3), (30e-3, 0), 1e-3, part="lower"))
    both = both.crack((-1e-3, 0), (10.5e-3, 0))
    ends = [((-1e-3, 0), (0.6e-3, 6e-3)), ((-1e-3, -6e-3), (0.6e-3, 0))]

    def peeled(**limit):
        model = peri.Model(both, "linear", youngs_modulus=2e9).displace(("x+", 1e-3), (0, None))
        for region, way in zip(ends, (0.15e-3, -0.15e-3)):
            model.displace(region, (None, way))
        return model.interface("upper", "lower", **limit).steps(10).run()

    weak, strong = peeled(fracture_energy=1.0), peeled(fracture_energy=1e4)
    assert weak.report["broken_bonds"] > 0 and strong.report["broken_bonds"] == 0
    series = weak.fields.pick()
    damage = series.read("point", "damage", [-1])[0]
    rest = series.read("position", "position", [-1])[0] - series.read("point", "displacement", [-1])[0]
    assert damage[np.abs(rest[:, 1]) > 3.1e-3].max() == 0 < damage.max()
    severed = peri.Model(both, "linear", youngs_modulus=1.0).interface("upper", "lower")
    assert severed.scene()["interface"] == [{"between": ["upper", "lower"], "unbonded": True}]


def test_a_body_of_a_mesh_is_the_scene(root):
    """Blocks are parts, sets are regions: the bush of cases/meshes."""
    folder = root / "cases/meshes/bush"
    flat = {"space": "plane-stress", "thickness": 1e-3}
    body = peri.Body.mesh(folder / "bush.msh", 1e-3, 1e-3, ["hub", "inner", "outer", "sleeve"], **flat)
    model = peri.Model(body, "linear", youngs_modulus=1e6, calibration="lattice")
    for part in ("hub", "inner"):
        model.add("material.inclusions", part=part, stiffness=4)
    turned = model.rotate("hub", 0.01).clamp("sleeve").run(**QUIET)
    text = (folder / "case.toml").read_text().split("[[study]]")[0].split("[[expect]]")[0]
    text = text.replace('file = "bush.msh"', f'file = "{folder / "bush.msh"}"')
    scene = peri.run(text, body__spacing="1 mm", output__pictures=False, **QUIET)
    assert turned.report["stored_energy"] == pytest.approx(scene.report["stored_energy"], rel=1e-6)
    with pytest.raises(ValueError, match="mesh: `build` and `solve` compute boxes"):
        model.__class__(body, "linear", youngs_modulus=1e6).build()


def test_a_crack_of_the_second_step():
    """A bar held while a crack appears is one that is pulled with the crack: linear bonds, small strains."""
    body = peri.Body.rectangle((0, 0), (30e-3, 10e-3), 1e-3, thickness=1e-3)
    cut = (15e-3, -1e-3), (15e-3, 5e-3)
    grips = ((-1, -1), (3e-3, 1)), ((27e-3, -1), (31e-3, 1))

    def bar(body):
        model = peri.Model(body, "linear", youngs_modulus=1e6, calibration="lattice")
        return model.clamp(grips[0]).displace(grips[1], (1e-5, 0)).steps(2)

    stepped = bar(body).step().hold(grips[0]).hold(grips[1]).crack(*cut)
    loads = stepped.run(solver__tolerance=1e-8, **{"step[0].solver.tolerance": 1e-8}, **QUIET).history["load"]
    cracked = bar(body.crack(*cut)).run(solver__tolerance=1e-8, **QUIET).history["load"]
    whole = bar(body).run(solver__tolerance=1e-8, **QUIET).history["load"]
    assert loads[1] == pytest.approx(whole[-1], rel=1e-5) and cracked[-1] < 0.9 * whole[-1]
    assert loads[-1] == pytest.approx(cracked[-1], rel=1e-3)
    scene = stepped.scene()
    names = [[load["name"] for load in step["boundary"]] for step in (scene, *scene["step"])]
    assert names == [["region 1", "region 2"]] * 2
    with pytest.raises(ValueError, match="cracks|step"):
        stepped.build()


def test_memory_and_scenes_agree():
    """Sides, boxes and cracks by `solve` and by `run`."""
    body = peri.Body.rectangle((0, 0), (40e-3, 20e-3), 1e-3, thickness=1e-3)
    body = body.crack((-1e-3, 10e-3), (10e-3, 10e-3))
    model = peri.Model(body, youngs_modulus=1e6, critical_stretch=1.4)
    model.clamp("y-").displace(("y+", 2e-3), (0, 2e-3)).steps(2)
    solved, ran = model.solve(), model.run(solver__tolerance=1e-4, solver__method="lbfgs", **QUIET)
    assert np.allclose(solved.history["load"], ran.history["load"], rtol=1e-3)
    block = peri.Body.box((0, 0, 0), (10e-3, 10e-3, 6e-3), 1e-3)
    block = block.crack((5e-3, -1e-3, -1e-3), (0, 12e-3, 0), (0, 0, 5e-3))
    model = peri.Model(block, "linear", youngs_modulus=1e6)
    model.clamp("x-").displace("x+", (0.01e-3, 0, 0)).steps(2)
    solved, ran = model.solve(tolerance=1e-6), model.run(solver__tolerance=1e-6, **QUIET)
    assert np.allclose(solved.history["load"], ran.history["load"], rtol=1e-4)


def test_dynamics_and_forces():
    """A free body under a total force flies by Ft²/2m."""
    body = peri.Body.rectangle((0, 0), (20e-3, 10e-3), 1e-3, thickness=1e-3)
    model = peri.Model(body, "linear", youngs_modulus=1e6).force(((-1, -1), (1, 1)), (2e-3, 0))
    model.dynamics(1000.0, 1e-3, records=5).add("probe", name="way", track="displacement", axis="x")
    flying = model.run(**QUIET)
    assert flying.history["way"][-1] == pytest.approx(0.5 * 2e-3 / 2e-4 * 1e-6, rel=2e-3)


def test_numbers_of_dictionaries_are_si(sheet):
    """Numbers and numpy values, `None`, overrides and sweeps without units."""
    ours = {
        "body": {"space": "plane-stress", "thickness": 1e-3, "spacing": np.float64(2e-3), "shapes": [
            {"add": "box", "min": np.zeros(2), "max": (60e-3, 40e-3)},
            {"cut": "box", "min": [0, 16e-3], "max": [20e-3, 24e-3], "part": None},
        ]},
        "material": {**sheet["material"], "youngs_modulus": 1e6},
        "boundary": [
            {"side": "y-", "layers": 3, "displacement": [0, 0]},
            {"side": "y+", "layers": 3, "displacement": ["0 mm", np.float32(14e-3)]},
        ],
        "solver": {"steps": 14},
        "output": {"pictures": False, "fields": False},
    }
    few = {"solver__steps": 2}
    first, second = peri.run(ours, **few), peri.run(sheet, **few, output__fields=False)
    assert np.allclose(first.history["load"], second.history["load"], rtol=1e-6)
    stiff = peri.run(ours, **few, material__youngs_modulus=2e6)
    assert np.isclose(stiff.report["peak_load"], 2 * first.report["peak_load"], rtol=1e-3)
    table = peri.sweep(ours, {"material.youngs_modulus": [1e6, 2e6]}, **few)
    assert table.rows == 2
    with pytest.raises(SceneError, match="material.youngs_modulus"):
        peri.run(ours, material__youngs_modulus=-1.0)
    with pytest.raises(SceneError, match="spacin"):
        peri.check({**ours, "body": {**ours["body"], "spacin": 1e-3}})


def test_parts_of_two_solids():
    """Layers in series by laws: the stress of both, 2 and 20 MPa of bulk modulus, on the mean strain."""
    soft = peri.Body.rectangle((0, 0), (20e-3, 4e-3), 1e-3, thickness=1e-3, space="plane-strain", part="soft")
    body = soft.join(peri.Body.rectangle((20e-3, 0), (40e-3, 4e-3), 1e-3, part="stiff"))
    laws = [Law("neo-hookean", mu, bulk_modulus=5 * mu) for mu in (0.4e6, 4e6)]

    def load(law, **part):
        model = peri.Model(body, law).displace(("x-", 6e-3), (0, 0)).displace(("x+", 6e-3), (0.2e-3, 0))
        return (model.add("material.inclusions", **part) if part else model).run(**QUIET).report["reaction_x"]

    series = load(laws[0], part="stiff", solid={"law": "correspondence", "constitutive": laws[1]})
    assert series == pytest.approx(2 / (1 / load(laws[0]) + 1 / load(laws[1])), rel=0.15)


def test_refusals():
    body = peri.Body.rectangle((0, 0), (20e-3, 10e-3), 1e-3)
    model = peri.Model(body, youngs_modulus=1e6)
    with pytest.raises(ValueError, match="youngs_modulus: needed by a bond law"):
        peri.Model(body)
    with pytest.raises(ValueError, match="region: found a function; allowed in `run`: a side"):
        peri.Model(body, youngs_modulus=1e6).clamp(lambda x, y: x < 1).run()
    with pytest.raises(ValueError, match="law: found a function; allowed in `run`"):
        peri.Model(body, lambda l: l - 1, youngs_modulus=1e6).clamp("x-").run()
    with pytest.raises(ValueError, match="body_force: `solve` only"):
        peri.Model(body, youngs_modulus=1e6).body_force("x-", (0, 1)).run()
    with pytest.raises(ValueError, match="curve: a function needs `time` or `dynamics`"):
        peri.Model(body, youngs_modulus=1e6).displace("x-", (0, 0), curve=lambda t: t).run()
    with pytest.raises(ValueError, match="scenes have laws with a bulk_modulus"):
        peri.Model(body, Law("gent", 3e5, 80.0)).clamp("x-").run()
    with pytest.raises(ValueError, match="join: found a body with cuts"):
        body.join(body.cut((0, 0), (1e-3, 1e-3)))
    with pytest.raises(SceneError, match="no such key|unknown|did you mean"):
        model.clamp("x-").add("contacts", stiffness=1).check()
