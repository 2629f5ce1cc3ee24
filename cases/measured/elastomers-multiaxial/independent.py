"""Eight-chain law fitted to tension of Meunier's silicone, by a scan over the chain length with the exact modulus, and
judged in pure shear and equibiaxial tension: with the exact inverse Langevin function, and with Cohen's Padé form of it
(doi:10.1007/BF00366640), whose error near locking makes the difference of the two predictions. States at rest are
left out. Prints rms in MPa: python3 independent.py"""
import csv
import math
import pathlib

FILE = pathlib.Path(__file__).with_name("rubber_multiaxial.csv")
ROWS = list(csv.DictReader(line for line in FILE.open() if not line.startswith("#")))
TESTS = {
    mode: [(float(row["lambda1"]), float(row["value"])) for row in ROWS
           if row["source"] == "Meunier2008" and row["mode"] == mode and float(row["value"]) != 0]
    for mode in ("UT", "PS", "ET")
}
SQUARES = {"UT": lambda l: l * l + 2 / l, "PS": lambda l: l * l + 1 + l**-2, "ET": lambda l: 2 * l * l + l**-4}
SHAPES = {"UT": lambda l: l - l**-2, "PS": lambda l: l - l**-3, "ET": lambda l: l - l**-5}


def pade(x):
    return x * (3 - x * x) / (1 - x * x)


def exact(x):
    beta = pade(x)
    for _ in range(50):
        slope = 1 / beta**2 - (1 / math.sinh(beta) ** 2 if beta < 300 else 0)
        beta -= (1 / math.tanh(beta) - 1 / beta - x) / slope
    return beta


def unit_stress(inverse, links, mode, stretch):
    x = math.sqrt(SQUARES[mode](stretch) / 3 / links)
    return inverse(x) / x / 3 * SHAPES[mode](stretch)


def misfit(inverse, links, modulus, mode):
    errors = [modulus * unit_stress(inverse, links, mode, l) - p for l, p in TESTS[mode]]
    return math.sqrt(sum(error**2 for error in errors) / len(errors))


for name, inverse in (("exact", exact), ("Padé", pade)):
    best = (math.inf,)
    for k in range(8000):
        links = 2.0 + k * 5e-4
        if max(SQUARES["UT"](l) for l, _ in TESTS["UT"]) >= 3 * links:
            continue
        unit = [unit_stress(inverse, links, "UT", l) for l, _ in TESTS["UT"]]
        modulus = sum(u * p for u, (_, p) in zip(unit, TESTS["UT"])) / sum(u * u for u in unit)
        best = min(best, (misfit(inverse, links, modulus, "UT"), links, modulus))
    print(name, {mode: round(misfit(inverse, *best[1:], mode), 5) for mode in TESTS})
