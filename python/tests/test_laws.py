"""Laws as functions of arrays, against formulas in numpy."""

import pickle
import subprocess
import sys

import numpy as np
import pytest

import polymech
from polymech import Langevin, Law


def test_inverse_langevin_inverts():
    x = np.linspace(-0.999, 0.999, 40_001).reshape(-1, 1)
    beta = Langevin.inverse(x)
    assert beta.shape == x.shape
    with np.errstate(divide="ignore", invalid="ignore"):
        back = np.where(beta == 0, 0, 1 / np.tanh(beta) - 1 / beta)
    # the naive formula loses digits near 0
    assert np.abs(back - x).max() < 1e-12
    assert np.isposinf(Langevin.inverse(1.0)) and np.isnan(Langevin.inverse(1.5))
    assert np.allclose(Langevin.value(beta), x, rtol=1e-14)


def test_approximants_by_name():
    x = np.linspace(0.01, 0.95, 50)
    formulas = {
        "cohen": x * (3 - x**2) / (1 - x**2),
        "treloar": 3 * x / (1 - (3 / 5 * x**2 + 36 / 175 * x**4 + 108 / 875 * x**6)),
        "puso": 3 * x / (1 - x**3),
        "jedynak-2015": x * (3 - 2.6 * x + 0.7 * x**2) / ((1 - x) * (1 + 0.1 * x)),
    }
    for name, expected in formulas.items():
        assert np.allclose(Langevin.inverse(x, name), expected, rtol=1e-13), name
    assert set(formulas) < set(Langevin.methods()) and len(Langevin.methods()) == 12
    exact = Langevin.inverse(x)
    for name in Langevin.methods():
        assert np.abs(Langevin.inverse(x, name) / exact - 1).max() < 0.35, name
    with pytest.raises(ValueError, match="allowed: exact, cohen"):
        Langevin.inverse(x, "cohn")


def test_derivatives_by_differences():
    x = np.linspace(0.05, 0.9, 30)
    h = 1e-6
    for name in ("exact", "cohen", "kroger"):
        slope = (Langevin.inverse(x + h, name) - Langevin.inverse(x - h, name)) / (2 * h)
        assert np.allclose(Langevin.inverse_derivative(x, name), slope, rtol=1e-6)
    slope = (Langevin.free_energy(x + h) - Langevin.free_energy(x - h)) / (2 * h)
    assert np.allclose(slope, x * Langevin.derivative(x), rtol=1e-6)


def test_laws_against_formulas():
    stretch = np.linspace(0.6, 4.0, 18).reshape(3, 6)
    neo = Law("neo-hookean", 4e5)
    assert np.allclose(neo.uniaxial(stretch), 4e5 * (stretch - stretch**-2), rtol=1e-12)
    assert np.allclose(neo.equibiaxial(stretch), 4e5 * (stretch - stretch**-5), rtol=1e-12)
    assert np.allclose(neo.pure_shear(stretch)[..., 0], 4e5 * (stretch - stretch**-3), rtol=1e-12)
    mu, n = 0.273e6, 25.46
    chain = Law("eight-chain", mu, n)
    first = stretch**2 + 2 / stretch
    chains = np.sqrt(first / 3)
    expected = mu / 3 * np.sqrt(n) / chains * Langevin.inverse(chains / np.sqrt(n)) * (stretch - stretch**-2)
    assert np.allclose(chain.uniaxial(stretch), expected, rtol=1e-11)
    with pytest.raises(ValueError, match="locking"):
        chain.uniaxial([1.0, 20.0])


def test_names_of_parameters():
    models = Law.models()
    assert len(models) == 24 and models["gent"]
    names = list(models["gent"])
    law = Law("gent", **{name: float(value) for name, value in models["gent"].items()})
    assert list(law.parameters) and names and law.shear_modulus > 0
    with pytest.raises(ValueError, match="found modulos; allowed: " + ", ".join(names)):
        Law("gent", modulos=1e6)
    with pytest.raises(ValueError, match="found .gnt."):
        Law("gnt", 1.0)


def test_a_foam_keeps_its_sides():
    # ν = β/(1 + 2β) = 0 with β = 0: P = 2μ/α (λ^(α − 1) − 1/λ), no stress on the sides
    foam = Law("hyperfoam-1", mu_1=1e5, alpha_1=8.0, beta_1=0.0)
    stress = foam.first_piola_kirchhoff(np.diag([0.6, 1.0, 1.0]))
    assert np.allclose(stress, np.diag([2e5 / 8 * (0.6**7 - 1 / 0.6), 0, 0]), atol=1e-9)
    with pytest.raises(ValueError, match="has its own"):
        Law("hyperfoam-1", 1e5, 8.0, 0.0, volumetric=("ciarlet", 1e6))


def test_compressible_laws_in_three_dimensions():
    law = Law("mooney-rivlin", 2e5, 5e4, volumetric=("ciarlet", 1e6))
    random = np.random.default_rng(1)
    f = np.eye(3) + 0.1 * random.normal(size=(300, 3, 3))
    c = np.einsum("nki,nkj->nij", f, f)
    c = 0.5 * (c + np.swapaxes(c, 1, 2))
    found = law.predict(c, tangent=True)
    # P = F S, σ = P Fᵀ/J
    p = law.first_piola_kirchhoff(f)
    assert np.allclose(p, f @ found.stress, atol=1e-8 * np.abs(p).max())
    j = np.linalg.det(f)
    assert np.allclose(law.cauchy(f), p @ np.swapaxes(f, 1, 2) / j[:, None, None], atol=1e-8 * np.abs(p).max())
    assert np.allclose(law.energy(f), found.energy, atol=1e-8 * np.abs(found.energy).max())
    # dS = ℂ dE in Voigt's order with doubled shear strains
    pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]
    h = 1e-6
    for b, (i, k) in enumerate(pairs):
        step = np.zeros((3, 3))
        step[i, k] += 0.5
        step[k, i] += 0.5
        up, down = (law.predict(c + s * 2 * h * step).stress for s in (1, -1))
        slope = (up - down) / (2 * h)
        strain = step[i, k] if b < 3 else 2 * step[i, k]
        for a, (m, n) in enumerate(pairs):
            expected = found.tangent[:, a, b] * strain
            assert np.allclose(slope[:, m, n], expected, atol=1e-6 * np.abs(found.tangent).max())
    rest = law.predict(np.eye(3))
    assert rest.stress.shape == (3, 3) and np.abs(rest.stress).max() < 1e-6
    with pytest.raises(ValueError, match="no flags"):
        _ = rest.flagged


def test_shapes_and_refusals():
    law = Law("neo-hookean", 1e6)
    assert law.predict(np.ones((4, 5, 6)) * [1, 1, 1, 0, 0, 0]).stress.shape == (4, 5, 6)
    assert law.predict(np.zeros((0, 6))).stress.shape == (0, 6)
    for shape in [(5,), (3, 5), ()]:
        with pytest.raises(ValueError, match="allowed: .*6"):
            law.predict(np.ones(shape))
    bad = np.tile(np.eye(3), (1000, 1, 1))
    bad[700, 0, 1] = 0.1
    with pytest.raises(ValueError, match="point 700: C: .*symmetric"):
        law.predict(bad)
    bad = np.tile([1.0, 1, 1, 0, 0, 0], (1000, 1))
    bad[613, 0] = -1
    with pytest.raises(ValueError, match="point 613"):
        law.predict(bad)


def test_a_fit_to_treloar(root):
    file = root / "cases/ch1/rubber-fits/treloar1944_uniaxial.csv"
    stretch, nominal = np.loadtxt(file, delimiter=",", comments="#", skiprows=3).T
    nominal *= 1e6
    # neo-Hookean: linear least squares
    shape = stretch - stretch**-2
    measured = nominal != 0
    best = (shape[measured] @ nominal[measured]) / (shape[measured] @ shape[measured])
    fit = polymech.fit("neo-hookean", {"uniaxial": (stretch, nominal)})
    assert abs(float(next(iter(fit.parameters.values()))) / best - 1) < 1e-8
    residual = fit.law.uniaxial(stretch[measured]) - nominal[measured]
    assert np.isclose(fit.rms, np.sqrt(np.mean(residual**2)))
    assert fit.parameters[next(iter(fit.parameters))].unit == "Pa"
    with pytest.raises(ValueError, match="allowed: uniaxial"):
        polymech.fit("gent", {"unaxial": (stretch, nominal)})


def test_torsion():
    """Mooney–Rivlin torsion in closed form: M = πψR⁴(C₁ + C₂), N = −½πψ²R⁴(C₁ + 2C₂); its fit returns it."""
    law = Law("mooney-rivlin", 2e5, 5e4)
    twist, radius = np.linspace(-100, 300, 9), 5e-3
    torque, force = law.torsion(twist, radius)
    assert np.allclose(torque, np.pi * twist * radius**4 * 2.5e5, rtol=1e-9)
    assert np.allclose(force, -np.pi / 2 * twist**2 * radius**4 * 3e5, rtol=1e-9)
    fit = polymech.fit("mooney-rivlin", {"torsion": (twist, torque, radius, force)})
    assert np.allclose([float(value) for value in fit.parameters.values()], [2e5, 5e4], rtol=1e-5)
    held = law.torsion(twist, radius, 1.3)
    again = polymech.fit("neo-hookean", {"torsion": (twist, held[0], radius, 0.0, 1.3)})
    assert np.isclose(float(again.parameters["shear_modulus"]), 2 * (2e5 + 5e4 / 1.3), rtol=1e-6)
    with pytest.raises(ValueError, match="allowed: twist, torque, radius"):
        polymech.fit("gent", {"torsion": (twist, torque)})
    with pytest.raises(ValueError, match="allowed: above 0"):
        polymech.fit("gent", {"torsion": (twist, torque, -radius)})


def test_bad_torsion():
    """Torques against their twist or in another unit, sizes of no cylinder, NaN, arrays that do not fit."""
    law = Law("neo-hookean", 4e5)
    twist, radius = np.linspace(20, 200, 10), 5e-3
    torque, _ = law.torsion(twist, radius)
    turned = np.where(np.arange(10) == 7, -torque, torque)
    for columns, message in [
        ((twist, turned, radius), r"torsion: row 7: found a torque of -0\.06.* rad/m; allowed: a torque with the sign"),
        ((twist, 1e3 * torque, radius), r"allowed: torques of a shear modulus .* it is 4\.000e8 Pa"),
        ((twist, np.where(twist > 100, np.nan, torque), radius), "row 5: found NaN; allowed: finite numbers"),
        ((twist, torque, 0.0), "row 0: found a radius of 0 m; allowed: above 0"),
        ((twist, torque, radius, 0.0, 125.0), "found a stretch of 125; allowed: 0.3 to 20"),
        ((twist, torque[:5], radius), r"torsion: found arrays of the shapes \(10,\), \(5,\), \(\)"),
        (([], [], radius), "torsion: found no rows"),
    ]:
        with pytest.raises(ValueError, match=message):
            polymech.fit("neo-hookean", {"torsion": columns})
    for arguments, message in [
        ((twist, -radius), "point 0: found a radius of -0.005 m; allowed: above 0"),
        ((twist, 0.0), "found a radius of 0 m; allowed: above 0"),
        ((twist, [radius, np.nan]), r"found arrays of the shapes \(10,\), \(2,\), \(\)"),
        (([1.0, np.nan], radius), "point 1: found a twist of NaN rad/m"),
        ((twist, radius, 0.0), "found a stretch of 0; allowed: above 0"),
    ]:
        with pytest.raises(ValueError, match=message):
            law.torsion(*arguments)
    assert law.torsion([], radius)[0].shape == (0,)
    with pytest.warns(UserWarning, match="torsion: the torques imply a shear modulus of 400 Pa"):
        polymech.fit("neo-hookean", {"torsion": (twist, 1e-3 * torque, radius)})


def test_bad_columns():
    stretch, nominal = [1.5, 2.0, 3.0], [0.3e6, 0.5e6, 0.8e6]
    for columns, message in [
        ((stretch, nominal[:2]), r"uniaxial: found columns of the shapes \(3,\), \(2,\); allowed: columns of one length"),
        ((stretch, [*nominal[:2], np.nan]), "uniaxial: row 2: found NaN; allowed: finite numbers"),
        (([], []), "uniaxial: found no rows"),
        (([1.5, -2.0], [1e5, 2e5]), "uniaxial: row 1: "),
        ((stretch, nominal, nominal), "found 3 columns; allowed: 2"),
    ]:
        with pytest.raises(ValueError, match=message):
            polymech.fit("neo-hookean", {"uniaxial": columns})


def test_volumetric():
    """p = −2 (J − 1)/D₁ − 4 (J − 1)³/D₂ returns; its U″ vanishes at |J − 1| = √(−D₂/(6D₁)) = 0.1."""
    ratio = np.linspace(0.99, 0.85, 12)

    def pressure(d1, d2):
        return -2 * (ratio - 1) / d1 - 4 * (ratio - 1) ** 3 / d2

    fit = polymech.fit_volumetric(ratio, pressure(1e-9, 3e-11), 2)
    assert np.allclose(fit.compliances, [1e-9, 3e-11], rtol=1e-9) and np.isclose(fit.bulk_modulus, 2e9)
    assert fit.warnings == () and (fit.standard_errors < 1e-9 * fit.compliances).all() and fit.bulk_error < 1
    with pytest.warns(UserWarning, match="falls with compression at J below 0.9000 .* within the states"):
        fit = polymech.fit_volumetric(ratio, pressure(1e-9, -6e-11), 2)
    assert len(fit.warnings) == 1
    for arguments, message in [
        ((ratio, -pressure(1e-9, 3e-11)), "bulk modulus of -"),
        ((ratio, np.full(12, np.nan)), "state 0: J = 0.99, NaN Pa; allowed: .* finite pressure"),
        ((ratio, [1e6]), "found columns of the shapes"),
        (([], []), "0 states away from rest for 1 terms"),
        ((ratio, pressure(1e-9, 3e-11), 0), "terms: found 0"),
    ]:
        with pytest.raises(ValueError, match=message):
            polymech.fit_volumetric(*arguments)


def test_laws_are_pickled():
    law = Law("gent", 3e5, 80.0, volumetric=("quadratic", 1e6))
    again = pickle.loads(pickle.dumps(law))
    c = [1.2, 0.9, 1.0, 0.1, 0, 0]
    assert (again.predict(c).stress == law.predict(c).stress).all() and repr(again) == repr(law)


@pytest.mark.parametrize("kind", [np.float64, np.float32, np.float16])
def test_symmetry_to_rounding(kind):
    """C turned into other axes is symmetric to rounding of its type; the symmetric part is taken."""
    random = np.random.default_rng(0)
    law = polymech.Law("gent", 1e5, 50.0, volumetric=("ciarlet", 1e6))
    for count in (50, 700):
        f = (np.eye(3) + 0.05 * random.normal(size=(count, 3, 3))).astype(kind)
        q = np.linalg.qr(random.normal(size=(count, 3, 3)))[0].astype(kind)
        c = q @ np.swapaxes(f, 1, 2) @ f @ np.swapaxes(q, 1, 2)
        even = (c.astype(float) + np.swapaxes(c, 1, 2)) / 2
        assert (c != np.swapaxes(c, 1, 2)).any()
        assert (law.predict(c).stress == law.predict(even).stress).all()
    skew = np.array([[1.1, 0.1, 0], [0.11, 1, 0], [0, 0, 1]]).astype(kind)
    if kind != np.float16:
        with pytest.raises(ValueError, match="symmetric"):
            law.predict(skew)


FORKED = """
import concurrent.futures as futures, multiprocessing, sys
import numpy as np, polymech
law = polymech.Law("eight-chain", 0.27e6, 25)
points = np.tile([1.1, 1, 1, 0, 0, 0], (2000, 1))
x = np.linspace(-0.9, 0.9, 100000)
def one(k):
    a = float(law.predict(points).stress[k, 0])
    b = polymech.Langevin.inverse(x)[k]
    fit = polymech.fit("neo-hookean", {"uniaxial": ([1.5, 2, 3], [0.3e6, 0.5e6, 0.8e6])})
    return a, float(b), float(fit.rms), float(law.uniaxial(np.linspace(1, 2, 1000))[k])
own = one(1)
pool = futures.ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("fork"))
done, hung = futures.wait([pool.submit(one, 1) for _ in range(4)], timeout=60)
for process in pool._processes.values(): process.kill()
sys.exit(0 if not hung and all(f.result() == own for f in done) else 1)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="fork")
def test_forked_processes():
    """A pool forked after a call on all threads computes the same, where it hung."""
    found = subprocess.run([sys.executable, "-W", "ignore", "-c", FORKED], capture_output=True, text=True, timeout=120)
    assert found.returncode == 0, found.stderr


LONG = """
import os, signal, threading, time
import numpy as np, polymech
from polymech import crystfem
law = polymech.Law("eight-chain", 0.27e6, 25)
def fits():
    stretch = np.linspace(1.01, 4, 20000)
    for _ in range(1000): polymech.fit("ogden-3", {"uniaxial": (stretch, 1e6 * (stretch - stretch**-2))})
def points():
    c = np.tile([1.1, 1, 1, 0, 0, 0], (3_000_000, 1))
    for _ in range(1000): law.predict(c, tangent=True)
for call in (fits, points):
    asked = []
    def signal_later():
        time.sleep(1.0)
        asked.append(time.perf_counter())
        os.kill(os.getpid(), signal.SIGINT)
    threading.Thread(target=signal_later).start()
    try: call()
    except KeyboardInterrupt: assert time.perf_counter() - asked[0] < 5.0, call
    else: raise SystemExit("no interruption")
os._exit(0)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="signals")
def test_long_calls_hear_ctrl_c():
    found = subprocess.run([sys.executable, "-c", LONG], capture_output=True, text=True, timeout=120)
    assert found.returncode == 0, found.stderr
