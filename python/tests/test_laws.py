"""Laws as functions of arrays, against formulas in numpy."""

import pickle

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
    assert len(models) == 10 and models["gent"]
    names = list(models["gent"])
    law = Law("gent", **{name: float(value) for name, value in models["gent"].items()})
    assert list(law.parameters) and names and law.shear_modulus > 0
    with pytest.raises(ValueError, match="found modulos; allowed: " + ", ".join(names)):
        Law("gent", modulos=1e6)
    with pytest.raises(ValueError, match="found .gnt."):
        Law("gnt", 1.0)


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
    with pytest.raises(ValueError, match="without flags"):
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


def test_laws_are_pickled():
    law = Law("gent", 3e5, 80.0, volumetric=("quadratic", 1e6))
    again = pickle.loads(pickle.dumps(law))
    c = [1.2, 0.9, 1.0, 0.1, 0, 0]
    assert (again.predict(c).stress == law.predict(c).stress).all() and repr(again) == repr(law)
