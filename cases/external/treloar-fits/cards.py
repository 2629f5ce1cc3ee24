#!/usr/bin/env python3
"""Cards of a run of case.toml in NumPy: each program's stresses from the text of its card beside those of polycore.

The numbers are read from materials_mm.inp (Abaqus, CalculiX), .mac (Ansys), .k (LS-DYNA), .feb (FEBio) and .i (MOOSE); the nominal
stresses at the states of SET_states.csv follow from the energies of the Abaqus Theory Guide, 4.6, and Ansys' Material Reference,
4.6, by differentiation (complex step), for LS-DYNA's polynomials too, and from the stresses that FEBio (`DevStress` of
FEMooneyRivlin.cpp, FEYeoh.cpp, FEGentMaterial.cpp, FEOgdenMaterial.cpp), MOOSE (ComputeNeoHookeanStress.C) and the Theory Manual
of LS-DYNA (*MAT_077_O) have in closed form. Cards have ten digits: they
agree to 3e-9 of the largest stress. Shares no code with polycore.

    cargo run --release --bin polycore -- run cases/external/treloar-fits/case.toml --quick
    python3 cases/external/treloar-fits/cards.py out/treloar-fits
"""

import csv
import pathlib
import re
import sys

import numpy as np

TOLERANCE = 1e-7
STEP = 1e-30
BOYCE = (1 / 2, 1 / 20, 11 / 1050, 19 / 7000, 519 / 673750)


def invariants(l):
    return sum(l**2) - 3, sum(l**-2.0) - 3


def polynomial(powers):
    """Energy Σ c (I₁ − 3)^i (I₂ − 3)^j."""

    def energy(c, l):
        x, y = invariants(l)
        return sum(value * x**i * y**j for value, (i, j) in zip(c, powers))

    return energy


def series(c, l):
    return sum(value * invariants(l)[0] ** (i + 1) for i, value in enumerate(c))


def boyce(c, l):
    first = invariants(l)[0] + 3
    return c[0] * sum(a / c[1] ** (2 * k) * (first ** (k + 1) - 3 ** (k + 1)) for k, a in enumerate(BOYCE))


def gent(c, l):
    return -c[0] * c[1] / 2 * np.log(1 - invariants(l)[0] / c[1])


def tube(c, l):
    x = invariants(l)[0]
    room = 1 - c[1] ** 2 * x
    return c[0] / 2 * ((1 - c[1] ** 2) * x / room + np.log(room)) + 2 * c[2] / c[3] ** 2 * (sum(l ** -c[3]) - 3)


def van_der_waals(c, l):
    mu, most, a, beta = c
    x, y = invariants(l)
    own = (1 - beta) * x + beta * y
    eta = np.sqrt(own / (most**2 - 3))
    return mu * (-(most**2 - 3) * (np.log(1 - eta) + eta) - 2 / 3 * a * (own / 2) ** 1.5)


MOONEY = [(1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3)]
# C10, C01, C11, C20, C02, C30
DYNA = [(1, 0), (0, 1), (1, 1), (2, 0), (0, 2), (3, 0)]


def pairs(c):
    return list(zip(c[0::2], c[1::2]))


def by_energy(energy):
    """λᵢ ∂W/∂λᵢ."""

    def stress(l):
        step = [np.where(np.arange(3) == i, 1j * STEP, 0) for i in range(3)]
        return np.array([l[i] * energy(l + step[i]).imag / STEP for i in range(3)])

    return stress


def abaqus(text):
    for block in re.split(r"\*\* (?=\S+ fitted to )", text)[1:]:
        head, *lines = block.split("\n")
        name = head.split()[0]
        _, keyword, *rows = [line for line in lines if line and not line.startswith("**")]
        kind = [part.strip() for part in keyword.split(",")][1]
        # crate umat; the card of eight chains is the law of five terms
        if keyword.startswith("*USER") or name == "eight-chain":
            continue
        c = [float(cell) for row in rows for cell in row.split(",")]
        order = int(keyword.split("N=")[1]) if "N=" in keyword else 1
        energy, count = {
            "NEO HOOKE": (series, 1),
            "MOONEY-RIVLIN": (polynomial(MOONEY), 2),
            "YEOH": (series, 3),
            "REDUCED POLYNOMIAL": (series, order),
            "POLYNOMIAL": (polynomial(MOONEY), {2: 5, 3: 9}.get(order)),
            "ARRUDA-BOYCE": (boyce, 2),
            "VAN DER WAALS": (van_der_waals, 4),
            "OGDEN": (lambda c, l: sum(2 * m / a**2 * (sum(l**a) - 3) for m, a in pairs(c)), 2 * order),
        }[kind]
        yield name, by_energy(lambda l, e=energy, c=c[:count]: e(c, l))


def ansys(text):
    for name, option, terms, rows in re.findall(r"! (\S+) fitted.*\n(?:! .*\n)*TB,HYPER,\d+,1,((\d+),\w+)\n((?:TBDATA.*\n)+)", text):
        kind, terms = option.split(",")[1], int(terms)
        c = [float(cell) for row in rows.split("\n") if row for cell in row.split(",")[2:]]
        energy, count = {
            "NEO": (lambda c, l: c[0] / 2 * invariants(l)[0], 1),
            "BOYCE": (boyce, 2),
            "GENT": (gent, 2),
            "ETUBE": (tube, 4),
            "YEOH": (series, terms),
            "MOONEY": (polynomial(MOONEY), terms),
            "OGDEN": (lambda c, l: sum(m / a * (sum(l**a) - 3) for m, a in pairs(c)), 2 * terms),
        }[kind]
        yield name, by_energy(lambda l, e=energy, c=c[:count]: e(c, l))


def ls_dyna(text):
    for name, kind, rows in re.findall(r"\$ (\S+) fitted.*\n(?:\$ .*\n)*\*MAT_077_(\w)\+\n.*\n((?:[ \d].*\n)+)", text):
        rows = [[float(cell) for cell in row.split()] for row in rows.split("\n") if row]
        if kind == "H":
            yield name, by_energy(lambda l, c=rows[0]: polynomial(DYNA)(c, l))
        else:
            yield name, lambda l, c=rows: sum(m * (l**a - np.mean(l**a)) for m, a in zip(*c))


def febio(text):
    for name, kind, rows in re.findall(r'<!-- (\S+) fitted.*\n(?:<!-- .*\n)*<material id="\d+" name="\S+" type="(\S+)">\n((?:  <.*\n)+)', text):
        c = {tag: float(value) for tag, value in re.findall(r"<(\w+)>([^<]*)<", rows)}

        def stress(l, c=c, kind=kind):
            b, first = l**2, sum(l**2)
            if kind == "Mooney-Rivlin":
                return 2 * (b * (c["c1"] + c["c2"] * first) - b * b * c["c2"])
            if kind == "Yeoh":
                return 2 * b * sum((i + 1) * c[f"c{i + 1}"] * (first - 3) ** i for i in range(len(c) - 1))
            if kind == "Gent":
                return 2 * b * 0.5 * c["G"] * c["Jm"] / (c["Jm"] - first + 3)
            powers = [(c[f"c{i}"], c[f"m{i}"]) for i in range(1, len(c) // 2 + 1)]
            return sum(value / m * (l**m - np.mean(l**m)) for value, m in powers)

        yield name, stress


def moose(text):
    for name, lame, mu in re.findall(r"# (\S+) fitted.*\n(?:# .*\n)*\[Materials\][^=]*=.*\n\s*lambda = (\S+)\n\s*mu = (\S+)", text):
        # σ = F S Fᵀ, J = 1
        yield name, lambda l, lame=float(lame), mu=float(mu): l**2 * ((lame * np.log(1.0) - mu) * l**-2.0 + mu)


def main(folder):
    failed = False
    readers = [("Abaqus", "inp", abaqus), ("Ansys", "mac", ansys), ("LS-DYNA", "k", ls_dyna), ("FEBio", "feb", febio), ("MOOSE", "i", moose)]
    for program, ending, read in readers:
        text = (folder / f"materials_mm.{ending}").read_text()
        worst, cards = 0.0, 0
        # the sets follow each other
        sets = list(dict.fromkeys(re.findall(r"\S+ fitted to ([\w-]+)", text)))
        for name in sets:
            rows = list(csv.DictReader(open(folder / f"{name}_states.csv")))
            part = "\n".join(own(text, name))
            for law, stress in read(part + "\n"):
                pairs_of = np.array([[float(row[f"{law}_{i} [MPa]"]) for i in (1, 2)] for row in rows])
                found = []
                for row in rows:
                    a, b = float(row["stretch_1"]), float(row["stretch_2"])
                    l = np.array([a, b, 1 / (a * b)])
                    sigma = stress(l) if max(abs(l - 1)) > 0 else np.zeros(3)
                    found.append((sigma[:2] - sigma[2]) / l[:2])
                miss = abs(np.array(found) - pairs_of).max() / abs(pairs_of).max()
                cards += 1
                if not miss < TOLERANCE:
                    failed = True
                    print(f"FAIL  {program}: {law} on {name}: {miss:.1e}")
                worst = max(worst, miss)
        print(f"{program}: {cards} cards, largest difference {worst:.1e} of the largest stress")
    sys.exit(failed)


def own(text, name):
    """Lines of the cards of a set."""
    kept = False
    for line in text.split("\n"):
        if " fitted to " in line:
            kept = re.search(r" fitted to ([\w-]+)", line)[1] == name
        elif " has no law " in line:
            kept = False
        if kept:
            yield line


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
