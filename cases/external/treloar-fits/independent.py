#!/usr/bin/env python3
"""Fits of the laws of Chapter 1 to treloar1944_20C.csv in NumPy and SciPy: the references of case.toml.

Laws of one nonlinear parameter are scanned over it, their moduli solved exactly (non-negative least squares); Ogden's
law by exhaustive scans of its exponents, polished by SciPy. Shares no code with polycore.

    python3 cases/external/treloar-fits/independent.py
"""

import itertools
import os

import numpy as np
from scipy.optimize import least_squares, minimize_scalar, nnls

HERE = os.path.dirname(os.path.abspath(__file__))


def table():
    modes, stretch, nominal = [], [], []
    for line in open(os.path.join(HERE, "treloar1944_20C.csv")):
        parts = line.strip().split(",")
        if parts[0] in ("uniaxial", "equibiaxial", "pure-shear") and float(parts[2]) != 0:
            modes.append(parts[0])
            stretch.append(float(parts[1]))
            nominal.append(float(parts[2]))
    return np.array(modes), np.array(stretch), np.array(nominal)


def langevin_inverse(x):
    beta = 3 * x / (1 - x)
    for _ in range(100):
        value = 1 / np.tanh(beta) - 1 / beta - x
        slope = 1 / beta**2 - 1 / np.sinh(np.minimum(beta, 300)) ** 2
        step = value / slope
        beta = np.where(np.abs(step) < 0.5 * beta, beta - step, np.where(step > 0, 0.5 * beta, 1.5 * beta))
    return beta


MODE, L, P = table()
L2 = np.select([MODE == "uniaxial", MODE == "equibiaxial"], [L**-0.5, L], 1.0)
L3 = 1 / (L * L2)
I1 = L**2 + L2**2 + L3**2
I2 = L**-2 + L2**-2 + L3**-2
FIRST = 2 * (L - L3**2 / L)  # P = FIRST (W1 + λ2² W2)
SECOND = FIRST * L2**2


def eight_chain(n):
    return FIRST * np.sqrt(n) * langevin_inverse(np.sqrt(I1 / 3 / n)) / (6 * np.sqrt(I1 / 3))


def three_chain(n):
    force = [np.sqrt(n) / 3 * langevin_inverse(np.clip(l / np.sqrt(n), 1e-9, None)) for l in (L, L3)]
    return force[0] - L3 / L * force[1]


def ogden(a):
    return 2 / a * (L ** (a - 1) - L3**a / L)


def linear(columns, on):
    """rms on the rows, and the moduli."""
    scale = [np.linalg.norm(c[on]) for c in columns]
    found, norm = nnls(np.column_stack([c[on] / s for c, s in zip(columns, scale)]), P[on])
    return norm / np.sqrt(on.sum()), [f / s for f, s in zip(found, scale)]


def scanned(columns_of, lowest, on):
    """Least rms over a limit above `lowest`: a scan in ln(limit/lowest − 1), polished."""
    def rms(q):
        return linear(columns_of(lowest * (1 + np.exp(q))), on)[0]

    grid = np.linspace(-8, 13.8, 300)
    best = min(grid, key=rms)
    end = minimize_scalar(rms, bounds=(best - 0.2, min(best + 0.2, 13.8)), method="bounded", options={"xatol": 1e-10})
    q = end.x if end.fun < rms(best) else best
    columns = columns_of(lowest * (1 + np.exp(q)))
    return columns, linear(columns, on)[1], lowest * (1 + np.exp(q))


def ogden_fit(terms, on):
    exponents = [a for a in np.arange(-12, 20.01, 0.5) if a != 0]
    columns = {a: ogden(a) for a in exponents}
    best = sorted((linear([columns[a] for a in s], on)[0], s) for s in itertools.combinations(exponents, terms))[:5]
    found = None
    for _, start in best:
        # the moduli are solved exactly for the exponents of each step
        def residuals(a):
            c = [ogden(x) for x in a]
            return sum(m * x for m, x in zip(linear(c, on)[1], c))[on] - P[on]

        end = least_squares(residuals, start, xtol=1e-14, ftol=1e-14, gtol=1e-14)
        if found is None or end.cost < found.cost:
            found = end
    columns = [ogden(a) for a in found.x]
    return columns, linear(columns, on)[1], list(found.x)


def polynomial(exponents):
    """Columns of W = Σ C (I1 − 3)^i (I2 − 3)^j."""
    x, y = I1 - 3, I2 - 3
    power = lambda z, n: z**n if n >= 0 else 0 * z
    return [FIRST * i * power(x, i - 1) * y**j + SECOND * j * x**i * power(y, j - 1) for i, j in exponents]


def free(columns, on):
    """Columns and their coefficients of any sign."""
    scale = [np.linalg.norm(c[on]) for c in columns]
    found = np.linalg.lstsq(np.column_stack([c[on] / s for c, s in zip(columns, scale)]), P[on], rcond=None)[0]
    return columns, [f / s for f, s in zip(found, scale)], ""


def arruda_boyce(limit):
    series = [0.5, 1 / 20, 11 / 1050, 19 / 7000, 519 / 673750]
    return FIRST * sum(c * (k + 1) * I1**k / limit ** (2 * k) for k, c in enumerate(series))


def searched(stress, starts, on):
    """A law whose stress is `stress(q)`, from several starts."""
    def residuals(q):
        with np.errstate(all="ignore"):
            found = (stress(q) - P)[on]
        return np.where(np.isfinite(found), found, 1e3)

    ends = [least_squares(residuals, q, x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=5000) for q in starts]
    best = min(ends, key=lambda end: end.cost).x
    with np.errstate(all="ignore"):
        return [np.nan_to_num(stress(best))], [1.0], list(best)


def extended_tube(q):
    """ln G_c, ln δ, ln G_e, ln β."""
    gc, d, ge, beta = np.exp(np.clip(q, -40, 40))
    room = 1 - d**2 * (I1 - 3)
    room = np.where(room > 0, room, np.nan)
    return FIRST * gc / 2 * ((1 - d**2) / room**2 - d**2 / room) - 2 * ge / beta * (L ** (-beta - 1) - L3**-beta / L)


def van_der_waals(q):
    """μ, λ_m, a, and β as ¼q²."""
    mu, limit, a, beta = q[0], q[1], q[2], min(0.25 * q[3] ** 2, 1)
    x = (1 - beta) * I1 + beta * I2 - 3
    eta = np.sqrt(x / (limit**2 - 3))
    slope = mu / 2 * (1 / np.where(eta < 1, 1 - eta, np.nan) - a * np.sqrt(x / 2))
    return slope * ((1 - beta) * FIRST + beta * SECOND)


def main():
    sets = {m: MODE == m for m in ("uniaxial", "equibiaxial", "pure-shear")} | {"all": MODE != ""}
    for name, on in sets.items():
        chain, longest = (I1[on] / 3).max(), (L[on] ** 2).max()
        laws = {
            "neo-hookean": lambda: ([FIRST / 2], linear([FIRST / 2], on)[1], ""),
            "mooney-rivlin": lambda: ([FIRST, SECOND], linear([FIRST, SECOND], on)[1], ""),
            "gent": lambda: scanned(lambda j: [FIRST / 2 * j / (j - I1 + 3 + 1e9 * (I1 - 3 >= j))], (I1[on] - 3).max(), on),
            "three-chain": lambda: scanned(lambda n: [three_chain(np.maximum(n, L**2 * (1 + 1e-9)))], longest, on),
            "eight-chain": lambda: scanned(lambda n: [eight_chain(np.maximum(n, I1 / 3 * (1 + 1e-9)))], chain, on),
            "eight-chain-root-i2": lambda: scanned(
                lambda n: [eight_chain(np.maximum(n, I1 / 3 * (1 + 1e-9))), SECOND / (2 * np.sqrt(I2))], chain, on
            ),
            "reduced-polynomial-2": lambda: free(polynomial([(1, 0), (2, 0)]), on),
            "polynomial-2": lambda: free(polynomial([(1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]), on),
            "biderman": lambda: free(polynomial([(1, 0), (0, 1), (2, 0), (3, 0)]), on),
            "arruda-boyce": lambda: scanned(lambda m: [arruda_boyce(np.maximum(m, 1e-3))], 0.5, on),
            "extended-tube": lambda: searched(
                extended_tube,
                [
                    np.log([0.2, s / np.sqrt(3 * chain - 3), 0.2, b])
                    for s in (0.5, 0.8, 0.95, 0.99)
                    for b in (1e-3, 0.05, 0.2, 1)
                ],
                on,
            ),
            "van-der-waals": lambda: searched(
                van_der_waals,
                [
                    [0.4, s * np.sqrt(3 * chain), a, b]
                    for s in (1.02, 1.1, 1.3, 2)
                    for a in (0, 0.2, 0.4)
                    for b in (0.01, 0.3, 1)
                ],
                on,
            ),
            "ogden-1": lambda: ogden_fit(1, on),
            "ogden-2": lambda: ogden_fit(2, on),
        }
        for law, fit in laws.items():
            columns, moduli, extra = fit()
            error = sum(m * c for m, c in zip(moduli, columns)) - P
            print(f"{name:12} {law:20} rms {np.sqrt(np.mean(error[on] ** 2)):.6f} mae {np.abs(error[on]).mean():.6f}", end=" ")
            for other, rows in sets.items():
                r2 = 1 - np.sum(error[rows] ** 2) / np.sum((P[rows] - P[rows].mean()) ** 2)
                print(f"{other} R2 {r2:.5f} mae {np.abs(error[rows]).mean():.5f}", end="; ")
            print(extra, np.round(moduli, 6))


if __name__ == "__main__":
    main()
