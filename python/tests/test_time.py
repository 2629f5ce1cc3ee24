"""Laws with time, against closed forms."""

import numpy as np
import pytest

import polymech


def test_relaxation_at_a_stretch():
    """λ_e from F(λ_e) = F(λ) − νt/(3η) (Kumar and Lopez-Pamies' flow, neo-Hookean spring): 1.21102324 at t = η/ν from 2."""
    branch = polymech.Branch("neo-hookean", "constant", {"nu": 1e6, "eta": 1e6})
    law = polymech.Viscoelastic(polymech.Law("neo-hookean", shear_modulus=1.0), [branch])
    stress = law.nominal([1e-9, 1.0], [2.0, 2.0], error=1.0)[1]
    elastic = 1.21102324
    assert abs(stress / (1e6 * (elastic**2 - 1 / elastic) / 2.0) - 1) < 1e-4


def test_steady_shear_of_a_viscous_branch():
    """s⁵ − s² = κ², shear stress νκ/s³, κ = ηγ̇/ν."""
    branch = polymech.Branch("neo-hookean", "constant", {"nu": 1e5, "eta": 1e5})
    law = polymech.Viscoelastic(polymech.Law("neo-hookean", shear_modulus=1e-3), [branch])
    time = np.linspace(0.5, 20, 40)
    stress = law.nominal(time, time, test="simple-shear", error=1.0)
    s = max(np.roots([1, 0, 0, -1, 0, -1]).real)
    assert abs(stress[-1] / (1e5 / s**3) - 1) < 1e-3


def test_prony_comes_back():
    time = np.logspace(-2, 4, 80)
    series = polymech.prony(time, 1e6 + 2e6 * np.exp(-time / 0.5) + 1e6 * np.exp(-time / 100))
    assert np.allclose(series.times, [0.5, 100], rtol=1e-3) and np.allclose(series.moduli, [2e6, 1e6], rtol=1e-3)
    assert np.allclose(series.relaxation([0.0, 1e9]), [4e6, 1e6], rtol=1e-3)


@pytest.mark.parametrize(
    ("spring", "viscosity", "constants", "message"),
    [
        ("neo-hooke", "constant", {}, "neo-hooke"),
        ("neo-hookean", "constant", {"nu": 1.0}, "no `eta`"),
        ("neo-hookean", "constant", {"nu": 1.0, "eta": 1.0, "tau": 1.0}, "unknown `tau`"),
        ("neo-hookean", "constant", {"nu": 1.0, "eta": -1.0}, "-1"),
    ],
)
def test_refused(spring, viscosity, constants, message):
    law = polymech.Viscoelastic(polymech.Law("neo-hookean", shear_modulus=1.0), [polymech.Branch(spring, viscosity, constants)])
    with pytest.raises(ValueError, match=message):
        law.nominal([1.0], [1.1])


def test_refused_times():
    law = polymech.Viscoelastic(polymech.Law("neo-hookean", shear_modulus=1.0), [])
    with pytest.raises(ValueError, match="row 1: found 1 s"):
        law.nominal([1.0, 1.0], [1.1, 1.2])
    with pytest.raises(ValueError, match="found 1 columns"):
        polymech.prony([1.0])
