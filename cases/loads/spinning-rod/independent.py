#!/usr/bin/env python3
"""A long compressible rubber rod that spins with free ends, in NumPy and SciPy: the references of case.toml.

Stationary point of ∫ (W − ρω²r²/2) R dR with W = μ/2 (J^(−2/3) I₁ − 3) + K/2 (J − 1)², over the axial stretch and
r = R Σ aₖ (R/R₀)^2k, k < 6, by Gauss quadrature.

    python3 cases/loads/spinning-rod/independent.py
"""

import numpy as np
from scipy.optimize import root

MU, BULK, DENSITY, SPEED, RADIUS, GAUGE = 0.4e6, 20e6, 1000.0, 2313.67, 9e-3, 3.6e-3
POWERS = 2 * np.arange(6)
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(40)
POINTS, WEIGHTS = (POINTS + 1) / 2, WEIGHTS / 2


def residual(unknowns, bulk):
    """Derivatives of the potential by the axial stretch and the coefficients, over μ."""
    axial, coefficients = unknowns[0], unknowns[1:]
    hoops = POINTS[:, None] ** POWERS
    radials = (POWERS + 1) * hoops
    radial, hoop = radials @ coefficients, hoops @ coefficients
    jacobian = radial * hoop * axial
    first = radial**2 + hoop**2 + axial**2

    def stress(stretch):
        shear = MU * jacobian ** (-2 / 3) * (stretch - first / (3 * stretch))
        return shear + bulk * (jacobian - 1) * jacobian / stretch

    area = WEIGHTS * POINTS
    body = DENSITY * (SPEED * RADIUS * POINTS) ** 2 * hoop
    across = area * stress(radial) @ radials + area * (stress(hoop) - body) @ hoops
    return np.append(area @ stress(axial), across) / MU


def free_rod(bulk):
    """Axial strain, and mean strain across the gauge."""
    guess = np.append([0.95, 1.02], np.zeros(len(POWERS) - 1))
    found = root(residual, guess, args=(bulk,), tol=1e-13)
    assert np.abs(found.fun).max() < 1e-9, found.message
    return found.x[0] - 1, found.x[1:] @ (GAUGE / RADIUS) ** POWERS - 1


if __name__ == "__main__":
    for ratio in (50, 500, 5000):
        print("K/mu = %d: axial %.5f, across %.5f" % (ratio, *free_rod(ratio * MU)))
    print("incompressible: axial -0.10000, across %.5f" % (0.9**-0.5 - 1))
