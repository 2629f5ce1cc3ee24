"""Models in Python."""

import copy
import pickle

import numpy as np
import pytest

from polymech import RunError, peri


def sheet(spacing=2e-3):
    body = peri.Body.rectangle((0, 0), (60e-3, 40e-3), spacing, thickness=1e-3)
    return body.cut((0, 16e-3), (20e-3, 24e-3))


def pulled(body, law="chain-offset", by=14e-3, **options):
    model = peri.Model(body, law, youngs_modulus=1e6, **options)
    return model.clamp(lambda x, y: y < 6e-3).displace(lambda x, y: y > 34e-3, (0, by))


def test_a_sheet_tears_as_in_its_scene():
    from conftest import SHEET

    torn = pulled(sheet(), critical_stretch=1.6).steps(14).solve(tolerance=1e-4)
    scene = peri.run(SHEET, solver__tolerance=1e-4, solver__method="lbfgs", output__fields=False)
    assert torn.finished and torn.history.rows == scene.history.rows
    # the same model by another way: equilibria to 1e-4
    assert np.allclose(torn.history["load"], scene.history["load"], rtol=2e-3, atol=2e-3 * scene.report["peak_load"])
    assert torn.fragments == scene.report["fragments"] and torn.damage.max() > 0.3
    assert torn.load == torn.history["load"][-1] and torn.load.unit == "N"


def test_stress_of_a_strip():
    body = peri.Body.rectangle((0, 0), (40e-3, 20e-3), 1e-3, thickness=1e-3)
    model = peri.Model(body, "linear", youngs_modulus=1e6, calibration="lattice")
    strip = model.clamp(((0, 0), (3e-3, 20e-3))).displace(((37e-3, 0), (40e-3, 20e-3)), (0.2e-3, 0)).solve(tolerance=1e-6)
    x, u = strip.positions, strip.displacements
    assert x.shape == u.shape == (800, 2) and np.isclose(u[:, 0].max(), 0.2e-3)
    middle = np.abs(x - [20e-3, 10e-3]).max(axis=1) < 2e-3
    # the grips hold the width: about E times 0.2 mm over 34 mm
    stress = strip.cauchy()[middle, 0, 0].mean()
    assert abs(stress / (1e6 * 0.2 / 34) - 1) < 0.1
    assert np.allclose(strip.piola()[middle, 0, 0], strip.cauchy()[middle, 0, 0], rtol=0.05)
    gradient = strip.deformation_gradients()[middle].mean(axis=0)
    assert abs(gradient[0, 0] - 1 - 0.2 / 34) < 1e-3
    with pytest.raises(ValueError, match="measure: found .hardi.; allowed: hardy"):
        strip.cauchy("hardi")


def test_a_law_of_python_is_its_own():
    body = sheet()
    ours = pulled(body, lambda l: 3 * (l - 1), by=4e-3).solve(tolerance=1e-8)
    theirs = pulled(body, "linear", by=4e-3).solve(tolerance=1e-8)
    assert np.abs(ours.displacements - theirs.displacements).max() < 1e-7 * 4e-3
    assert abs(ours.load / theirs.load - 1) < 1e-7
    # its scale does not matter, its shape does
    scaled = pulled(body, lambda l: 700 * (l - 1), by=4e-3).solve(tolerance=1e-8)
    assert abs(scaled.load / theirs.load - 1) < 1e-7
    softer = pulled(body, lambda l: 3 * (1 - np.exp(1 - l)), by=4e-3).solve()
    assert 0.5 < softer.load / theirs.load < 0.99


def test_a_law_of_python_breaks_by_its_energy():
    ours = pulled(sheet(), lambda l: 3 * (l - 1), fracture_energy=500.0).steps(7).solve()
    theirs = pulled(sheet(), "linear", fracture_energy=500.0).steps(7).solve()
    assert theirs.damage.max() > 0.3 and (ours.damage == theirs.damage).all()
    # the bonds' energy is 1.4513 times smaller than that of tearing at the default horizon
    bonds = pulled(sheet(), "linear", fracture_energy=500.0 / 1.451324016, convention="bonds").steps(7).solve()
    assert (bonds.damage == theirs.damage).all()


def test_samples_of_a_law():
    calls = []

    def tension(l):
        calls.append(l.shape)
        return np.expm1(2 * (l - 1)) + 0.3 * np.sin(l - 1)

    law = peri.BondLaw(tension, (0.1, 4.0))
    assert len(calls) == 1
    l = np.linspace(0.1, 4.0, 4001)
    s = l - 1
    assert np.allclose(law.tension(l), tension(l), rtol=1e-12, atol=1e-13)
    assert np.allclose(law.derivative(l), 2 * np.exp(2 * s) + 0.3 * np.cos(s), rtol=1e-9)
    energy = (np.expm1(2 * s) - 2 * s) / 2 + 0.3 * (1 - np.cos(s))
    assert np.allclose(law.energy(l), energy, rtol=1e-10, atol=1e-13)
    # beside rest the digits of the strain stay
    tiny = 1 + np.array([-1e-9, 1e-9])
    assert np.allclose(law.tension(tiny) / (tiny - 1), 2.3, rtol=1e-6)
    again = pickle.loads(pickle.dumps(law))
    assert (again.tension(l) == law.tension(l)).all()
    with pytest.raises(ValueError, match="tension at the stretch .*: found NaN"):
        peri.BondLaw(lambda l: np.where(l > 2, np.nan, l - 1))
    with pytest.raises(ValueError, match="dt/dl at rest"):
        peri.BondLaw(lambda l: 1 - l)
    with pytest.raises(ZeroDivisionError):
        peri.BondLaw(lambda l: 1 / 0)


def test_a_solid_and_its_steps():
    body = peri.Body.box((0, 0, 0), (20e-3, 10e-3, 10e-3), 2e-3)
    model = peri.Model(body, "linear", youngs_modulus=1e6)
    model.clamp(lambda x, y, z: x < 6e-3).displace(lambda x, y, z: x > 14e-3, (0.1e-3, None, None)).steps(4)
    block, seen = model.build(), []

    def look(step):
        seen.append(step.fields["displacement"])
        return len(seen) < 2

    block.solve(on_step=look)
    assert not block.finished and block.history.rows == 2 and seen[0].shape == (250, 3)
    block.solve()
    assert block.finished and block.history.rows == 4
    whole = copy.copy(model).build().solve()
    assert (whole.displacements == block.displacements).all()
    assert np.isclose(block.history["load"][3] / block.history["load"][0], 4, rtol=0.02)


def test_dynamics_start_with_a_velocity():
    body = peri.Body.rectangle((0, 0), (20e-3, 10e-3), 1e-3, thickness=1e-3)
    model = peri.Model(body, "linear", youngs_modulus=1e6).body_force(lambda x, y: x > -1, (0, 0))
    flying = model.build().set_velocity(np.tile([2.0, -1.0], (200, 1)))
    flying.solve("verlet", density=1000, end_time=1e-3, records=5)
    assert np.allclose(flying.displacements, [2e-3, -1e-3], atol=1e-9)
    assert flying.history.rows == 5 and np.isclose(flying.history["time"][-1], 1e-3)


def test_refusals():
    body = sheet()
    with pytest.raises(ValueError, match="law: found .rubber.; allowed: chain-offset"):
        peri.Model(body, "rubber", youngs_modulus=1e6).clamp(lambda x, y: x < 1).build()
    with pytest.raises(ValueError, match="region 1 of the loads has no particle"):
        peri.Model(body, youngs_modulus=1e6).clamp(lambda x, y: x > 1).build()
    with pytest.raises(ZeroDivisionError):
        peri.Model(body, youngs_modulus=1e6).clamp(lambda x, y: 1 / 0).build()
    with pytest.raises(ValueError, match="Young's modulus: found -1"):
        pulled(body).__class__(body, youngs_modulus=-1).clamp(lambda x, y: x > 0).build()
    with pytest.raises(ValueError, match="components; allowed: 2"):
        peri.Body.rectangle((0, 0, 0), (1, 1), 0.1)
    with pytest.raises(ValueError, match="a load: found 3 components; allowed: 2"):
        peri.Model(body, youngs_modulus=1e6).displace(lambda x, y: x > 0, (0, 0, 0)).build()
    with pytest.raises(ValueError, match="unexpected setting .tolerence."):
        pulled(body).solve(tolerence=1)
    with pytest.raises(ValueError, match="method: found .newton.; allowed: lbfgs"):
        pulled(body).solve("newton")
    with pytest.raises(RunError, match="not converged"):
        pulled(body).solve(tolerance=1e-12, max_iterations=3)
    with pytest.raises(ValueError, match="one of them"):
        peri.Model(body, youngs_modulus=1e6, critical_stretch=2, fracture_energy=100)
    with pytest.raises(ValueError, match="convention: found .griffith.; allowed: tearing, bonds, softening"):
        peri.Model(body, youngs_modulus=1e6, fracture_energy=100, convention="griffith")


def test_pictures():
    pytest.importorskip("matplotlib").use("Agg")
    torn = pulled(sheet(), critical_stretch=1.6).steps(14).solve()
    figure = torn.plot()
    assert len(figure.axes) == 3
    pytest.importorskip("pyvista")
    assert torn.mesh().point_data["damage"].max() > 0.3
