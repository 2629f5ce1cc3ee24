#!/usr/bin/env python3
"""Errors of laws in modes of deformation left out of their fits, in NumPy and SciPy: the references of case.toml.

Treloar's rubber with the fits of ../treloar-fits/independent.py; Kawabata's with laws that are linear in their
constants, by linear least squares. Error: rms over the largest stress of the mode left out.

    python3 cases/external/rubber-ranking/independent.py
"""

import importlib.util
import pathlib

import numpy as np

HERE = pathlib.Path(__file__).parent
SPEC = importlib.util.spec_from_file_location("treloar", HERE / "../treloar-fits/independent.py")
T = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(T)

TERMS = {
    "neo-hookean": [(1, 0)],
    "reduced-polynomial-2": [(1, 0), (2, 0)],
    "polynomial-2": [(1, 0), (0, 1), (2, 0), (1, 1), (0, 2)],
    "biderman": [(1, 0), (0, 1), (2, 0), (3, 0)],
}


def relative(error, nominal, rows):
    return np.sqrt(np.mean(error[rows] ** 2)) / np.abs(nominal[rows]).max()


def treloar():
    chain = lambda on: (T.I1[on] / 3).max()
    eight = lambda n: T.eight_chain(np.maximum(n, T.I1 / 3 * (1 + 1e-9)))
    laws = {name: lambda on, terms=terms: T.free(T.polynomial(terms), on)[:2] for name, terms in TERMS.items()} | {
        "gent": lambda on: T.scanned(
            lambda j: [T.FIRST / 2 * j / (j - T.I1 + 3 + 1e9 * (T.I1 - 3 >= j))], (T.I1[on] - 3).max(), on
        )[:2],
        "eight-chain": lambda on: T.scanned(lambda n: [eight(n)], chain(on), on)[:2],
        "eight-chain-root-i2": lambda on: T.scanned(
            lambda n: [eight(n), T.SECOND / (2 * np.sqrt(T.I2))], chain(on), on
        )[:2],
        "arruda-boyce": lambda on: T.scanned(lambda m: [T.arruda_boyce(np.maximum(m, 1e-3))], 0.5, on)[:2],
        "extended-tube": lambda on: T.searched(
            T.extended_tube,
            [
                np.log([0.2, s / np.sqrt(3 * chain(on) - 3), 0.2, b])
                for s in (0.5, 0.8, 0.95, 0.99)
                for b in (1e-3, 0.05, 0.2, 1)
            ],
            on,
        )[:2],
        "ogden-2": lambda on: T.ogden_fit(2, on)[:2],
    }
    for law, fit in laws.items():
        for name, pick in (("left out", lambda m: T.MODE != m), ("alone", lambda m: T.MODE == m)):
            found = []
            for mode in ("uniaxial", "equibiaxial", "pure-shear"):
                on = pick(mode)
                columns, moduli = fit(on)
                error = sum(m * c for m, c in zip(moduli, columns)) - T.P
                others = [m for m in ("uniaxial", "equibiaxial", "pure-shear") if not on[T.MODE == m].any()]
                found.append(max(relative(error, T.P, T.MODE == m) for m in others))
            print(f"treloar  {law:20} {name:8}", *(f"{e:.6f}" for e in found), f"largest {max(found):.6f}")


def kawabata():
    rows = np.loadtxt(HERE / "../../ch1/rubber-fits/kawabata1981_biaxial.csv", delimiter=",", comments="#", skiprows=3)
    a, b, stresses = rows[:, 0], rows[:, 1], rows[:, 2:4]
    c = 1 / (a * b)
    x, y = a**2 + b**2 + c**2 - 3, a**-2 + b**-2 + c**-2 - 3
    mode = np.where(b == 1, "pure-shear", np.where(b == a, "equibiaxial", "biaxial"))
    mode = np.where(stresses[:, 1] == 0, "uniaxial", mode)
    # an incompressible bar in compression is in equibiaxial tension under a pressure
    mode = np.where((mode == "uniaxial") & (a < 1), "equibiaxial", mode)
    power = lambda z, n: z**n if n >= 0 else 0 * z
    data = np.concatenate([stresses[:, 0], stresses[:, 1]])
    modes, measured = np.concatenate([mode, mode]), data != 0
    for law, terms in TERMS.items():
        columns = []
        for i, j in terms:
            first, second = i * power(x, i - 1) * y**j, j * x**i * power(y, j - 1)
            nominal = lambda l, o: 2 * (l - c**2 / l) * (first + o**2 * second)
            columns.append(np.concatenate([nominal(a, b), nominal(b, a)]))
        matrix = np.column_stack(columns)
        found = {}
        for one in dict.fromkeys(mode):
            on = measured & (modes != one)
            values = np.linalg.lstsq(matrix[on], data[on], rcond=None)[0]
            found[one] = relative(matrix @ values - data, data, measured & (modes == one))
        print(f"kawabata {law:20} left out", {k: round(v, 6) for k, v in found.items()})


if __name__ == "__main__":
    treloar()
    kawabata()
