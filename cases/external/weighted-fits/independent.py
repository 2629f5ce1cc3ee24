#!/usr/bin/env python3
"""Weighted fits to treloar1944_20C.csv by scipy.optimize.curve_fit, each stress P with a standard deviation of
√((0.03 MPa)² + (0.05 P)²): the references of case.toml. Prints constants in MPa with their standard errors, the weighted rms, and χ over the degrees of
freedom.

    python3 cases/external/weighted-fits/independent.py
"""

import csv
import pathlib

import numpy as np
from scipy.optimize import curve_fit

FILE = pathlib.Path(__file__).parent / "../treloar-fits/treloar1944_20C.csv"
ROWS = [r for r in csv.reader(FILE.open()) if r[0] in ("uniaxial", "equibiaxial", "pure-shear") and float(r[2]) != 0]
MODE = np.array([r[0] for r in ROWS])
L, P = (np.array([float(r[i]) for r in ROWS]) for i in (1, 2))
L2 = np.select([MODE == "uniaxial", MODE == "equibiaxial"], [L**-0.5, L], 1.0)
L3 = 1 / (L * L2)
X, Y = L**2 + L2**2 + L3**2 - 3, L**-2 + L2**-2 + L3**-2 - 3
FIRST = 2 * (L - L3**2 / L)
SECOND = FIRST * L2**2
SIGMA = np.hypot(0.03, 0.05 * P)
START = np.sum((FIRST / 2) * P / SIGMA**2) / np.sum((FIRST / 2) ** 2 / SIGMA**2)

# parameters as polycore names them, from the neo-Hookean modulus
LAWS = {
    "neo-hookean": (lambda _, mu: mu * FIRST / 2, [START], "shear_modulus"),
    "reduced-polynomial-2": (lambda _, a, b: FIRST * (a + 2 * b * X), [START / 2, 0], "C10 C20"),
    "biderman": (
        lambda _, a, b, c, d: FIRST * (a + 2 * c * X + 3 * d * X**2) + SECOND * b,
        [START / 2, 0, 0, 0],
        "C10 C01 C20 C30",
    ),
    "gent": (lambda _, mu, j: mu / 2 * FIRST * j / (j - X), [START, 1.5 * X.max()], "shear_modulus J_m"),
    "ogden-1": (lambda _, mu, a: 2 * mu / a * (L ** (a - 1) - L3**a / L), [START, 1.5], "mu_1 alpha_1"),
}

for law, (stress, start, names) in LAWS.items():
    found, covariance = curve_fit(stress, L, P, start, SIGMA, ftol=1e-15, xtol=1e-15, gtol=1e-15, maxfev=100000)
    chi2 = np.sum(((stress(L, *found) - P) / SIGMA) ** 2)
    rms = np.sqrt(chi2 / np.sum(SIGMA**-2.0))
    errors = np.sqrt(np.diag(covariance))
    values = ", ".join(f"{n} {v:.8g} ± {e:.6g}" for n, v, e in zip(names.split(), found, errors))
    print(f"{law:21} rms {rms:.8f} chi {np.sqrt(chi2 / (len(P) - len(start))):.6f}  {values}")
