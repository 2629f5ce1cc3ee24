"""Writes the tables of the stability suite: a compressible neo-Hookean solid, and what can be wrong with its data. Python 3."""

import math
import random

HEAD = "run_id,kind,C11,C22,C33,C12,C13,C23," + ",".join(f"S{n} [MPa]" for n in "11 22 33 12 13 23".split())
MU, BULK = 0.4, 20.0  # MPa


def stress(c):
    """S = μ(1 − C⁻¹) + K ln J C⁻¹ of a diagonal C."""
    j = math.sqrt(c[0] * c[1] * c[2])
    return [MU * (1 - 1 / x) + BULK * math.log(j) / x for x in c[:3]] + [0.0] * 3


def runs(count=9, rows=10):
    rng = random.Random(2)
    for run in range(count):
        axis = run % 3
        for row in range(rows):
            e = 0.03 * (row + 1) * (1 + run / count)
            stretch = [1 - 0.45 * e + 0.002 * rng.random() for _ in range(3)]
            stretch[axis] = 1 + e
            c = [round(x * x, 6) for x in stretch] + [0.0] * 3
            yield [f"r{run}", f"u{axis + 1}", c, stress(c)]


def write(name, rows):
    with open(name, "w") as file:
        print(HEAD, file=file)
        for run, kind, c, s in rows:
            print(",".join([run, kind] + [f"{x:.7g}" for x in c + s]), file=file)


def changed(index, **what):
    rows = list(runs())
    for key, value in what.items():
        rows[index][2 if key == "c" else 3] = value(rows[index][2 if key == "c" else 3])
    return rows


write("good.csv", runs())
write("outlier.csv", changed(34, s=lambda s: [1e6 * x for x in s]))
write("one-run.csv", runs(1, 60))
write("constant.csv", [[r, k, c, [1.0, 2.0, 3.0, 0.0, 0.0, 0.0]] for r, k, c, _ in runs()])
write("no-stress.csv", [[r, k, c, [0.0] * 6] for r, k, c, _ in runs()])
write("no-strain.csv", [[r, k, [1.0, 1.0, 1.0, 0.0, 0.0, 0.0], [x + int(r[1:]) for x in s]] for r, k, _, s in runs()])
write("flat.csv", changed(34, c=lambda c: [c[0], c[1], 1e-12, 0.0, 0.0, 0.0]))
write("inverted.csv", changed(34, c=lambda c: [c[0], c[1], c[2], 1.5, 0.0, 0.0]))
write("stretch-10.csv", changed(89, c=lambda c: [100.0, 0.1, 0.1, 0.0, 0.0, 0.0], s=lambda s: stress([100.0, 0.1, 0.1])))
write("stretch-11.csv", changed(89, c=lambda c: [121.0, 0.1, 0.1, 0.0, 0.0, 0.0]))
write("not-a-number.csv", changed(34, s=lambda s: [math.nan] + s[1:]))
