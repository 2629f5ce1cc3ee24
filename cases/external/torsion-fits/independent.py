#!/usr/bin/env python3
"""Torsion of a solid rubber cylinder by SciPy: the table torsion.csv and the references of case.toml.

The table is computed, not measured: torque and axial force of Ogden's law of Treloar's rubber (doi:10.1098/rspa.1972.0026:
0.63, 0.0012, −0.01 MPa; 1.3, 5, −2) by `scipy.integrate.quad` over the radius, with errors of about 2 % that are written here, rounded.
The stress at a radius is that of the deformation gradient, by its eigenvectors, with the pressure of a traction-free surface from
dσ_rr/dr = (σ_θθ − σ_rr)/r: no invariants and no other formula of polycore. Fits by `scipy.optimize.curve_fit` to the same
stresses, 2M/(πR³) and N/(πR²), and to Treloar's bar. Prints constants in MPa with standard errors, rms, and errors of left-out modes.

    python3 cases/external/torsion-fits/independent.py
"""

import csv
import pathlib

import numpy as np
from scipy.integrate import quad
from scipy.optimize import curve_fit

HERE = pathlib.Path(__file__).parent
RADIUS, LENGTH = 5.0, 25.0  # mm


def stretches(gradient):
    """Principal stretches and directions of the current configuration."""
    squares, directions = np.linalg.eigh(gradient @ gradient.T)
    return np.sqrt(squares), directions


def extra_stress(slope, held, shear):
    """λᵢ ∂W/∂λᵢ in the axes r, θ, z of F at a local amount of shear."""
    own = held**-0.5
    gradient = np.array([[own, 0, 0], [0, own, own * shear], [0, 0, held]])
    found, directions = stretches(gradient)
    return directions @ np.diag(found * slope(found)) @ directions.T


def torsion(slope, held, shear):
    """2M/(πR³), N/(πR²) for dW/dλ = slope(λ), λ held, ψR = shear; R undeformed, quadrature over s = radius/R."""

    def at(s):
        return extra_stress(slope, held, s * shear)

    torque = 4 * held**-1.5 * quad(lambda s: at(s)[1, 2] * s**2, 0, 1, epsabs=1e-14, epsrel=1e-11)[0]

    def force(s):
        sigma = at(s)
        return (2 * sigma[2, 2] - sigma[1, 1] - sigma[0, 0]) * s

    return torque, quad(force, 0, 1, epsabs=1e-14, epsrel=1e-11)[0] / held


def ogden(terms):
    return lambda l: sum(mu * l ** (a - 1) for mu, a in terms)


def invariants(slopes):
    """dW/dλ of W(I₁, I₂) with slopes(I₁ − 3, I₂ − 3) = W₁, W₂."""

    def slope(l):
        first, second = slopes(np.sum(l**2) - 3, np.sum(l**-2.0) - 3)
        return 2 * l * first - 2 * l**-3.0 * second

    return slope


# starts, and parameters as polycore names them, MPa; the exponent of a term of Ogden's law has a minimum of either sign
LAWS = {
    "neo-hookean": (lambda mu: invariants(lambda x, y: (mu / 2, 0.0)), [[0.4]], "shear_modulus"),
    "mooney-rivlin": (lambda a, b: invariants(lambda x, y: (a, b)), [[0.2, 0.01]], "C1 C2"),
    "yeoh": (lambda a, b, c: invariants(lambda x, y: (a + 2 * b * x + 3 * c * x * x, 0.0)), [[0.2, 0, 0]], "C1 C2 C3"),
    "gent": (lambda mu, j: invariants(lambda x, y: (mu / 2 * j / (j - x), 0.0)), [[0.4, 80]], "shear_modulus J_m"),
    # μ of Abaqus: Σ 2μ/α² (Σ λ^α − 3)
    "ogden-1": (lambda mu, a: ogden([(2 * mu / a, a)]), [[0.4, 1.5], [0.1, -6.0]], "mu_1 alpha_1"),
}


def write():
    source = ogden([(0.63, 1.3), (0.0012, 5.0), (-0.01, -2.0)])
    rows = [(1.0, 45.0 * i) for i in range(1, 10)] + [(1.25, 90.0 * i) for i in range(5)]
    with (HERE / "torsion.csv").open("w", encoding="utf-8") as file:
        file.write("# source: computed by independent.py: Ogden's law of Treloar's rubber, with errors of 2 %\n")
        file.write("stretch,angle [deg],torque [N mm],axial force [N]\n")
        for i, (held, angle) in enumerate(rows):
            torque, force = torsion(source, held, np.radians(angle) * RADIUS / LENGTH)
            torque *= np.pi * RADIUS**3 / 2 * (1 + 0.02 * np.sin(3.0 * i + 1))
            force = force * np.pi * RADIUS**2 + 0.1 * np.cos(5.0 * i)
            file.write(f"{held},{angle:g},{torque:.4g},{force:.4g}\n")


def table():
    """Held stretch, shear, axis and stress of each measurement of torsion.csv."""
    with (HERE / "torsion.csv").open(encoding="utf-8") as file:
        cells = [[float(x) for x in row] for row in csv.reader(row for row in file if row[0] not in "#s")]
    found = []
    for held, angle, torque, force in cells:
        shear = np.radians(angle) * RADIUS / LENGTH
        for axis, stress in enumerate((2 * torque / (np.pi * RADIUS**3), force / (np.pi * RADIUS**2))):
            if stress != 0:
                found.append((held, shear, axis, stress))
    return found


def bar():
    with (HERE / "../treloar-fits/treloar1944_20C.csv").open(encoding="utf-8") as file:
        return [(float(r[1]), float(r[2])) for r in csv.reader(file) if r[0] == "uniaxial" and float(r[2]) != 0]


def of_torsion(law, rows):
    found = {}
    for held, shear, _, _ in rows:
        if (held, shear) not in found:
            found[held, shear] = torsion(law, held, shear)
    return np.array([found[held, shear][axis] for held, shear, axis, _ in rows])


def of_bar(law, rows):
    def nominal(l):
        along, across = law(np.array([l, l**-0.5, l**-0.5]))[:2]
        return along - across * l**-1.5

    return np.array([nominal(l) for l, _ in rows])


def main():
    write()
    twisted, pulled = table(), bar()
    tests = {
        "torsion": (lambda law: of_torsion(law, twisted), np.array([row[3] for row in twisted])),
        "uniaxial": (lambda law: of_bar(law, pulled), np.array([row[1] for row in pulled])),
    }
    for name, (build, starts, names) in LAWS.items():
        for fitted in (["torsion"], ["torsion", "uniaxial"], ["uniaxial"]):
            data = np.concatenate([tests[key][1] for key in fitted])

            def model(_, *p):
                return np.concatenate([tests[key][0](build(*p)) for key in fitted])

            bounds = (-np.inf, np.inf)
            if name == "mooney-rivlin":
                bounds = (0, np.inf)
            if name == "gent":
                bounds = ([0, 60], np.inf)
            found, covariance = min(
                (curve_fit(
                    model, data, data, start, bounds=bounds, method="trf", ftol=1e-14, xtol=1e-14, gtol=1e-14,
                    max_nfev=2000, x_scale=[max(abs(p), 1e-3) for p in start],
                ) for start in starts),
                key=lambda end: np.sum((model(None, *end[0]) - data) ** 2),
            )
            rms = np.sqrt(np.mean((model(None, *found) - data) ** 2))
            pairs = zip(names.split(), found, np.sqrt(np.diag(covariance)))
            values = ", ".join(f"{n} {v:.8g} ± {e:.6g}" for n, v, e in pairs)
            left = ""
            if len(fitted) == 1:
                other = "uniaxial" if fitted == ["torsion"] else "torsion"
                stresses = tests[other][1]
                error = np.sqrt(np.mean((tests[other][0](build(*found)) - stresses) ** 2)) / np.max(np.abs(stresses))
                left = f"  {other} left out {error:.6g}"
            print(f"{name:14} {'+'.join(fitted):17} rms {rms:.8g}  {values}{left}")


if __name__ == "__main__":
    main()
