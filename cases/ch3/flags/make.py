"""Writes runs.csv.gz and heldout.csv.gz: a known law, sampled as in Table 3.2. Python 3, nothing else."""

import gzip
import random

D = [[8.0, 3.0, 4.0], [3.0, 7.0, 4.0], [4.0, 4.0, 60.0]]  # GPa, normal components; the chains lie along 3
SHEAR = [2.0, 3.0, 3.0]  # GPa, 12 13 23
K = 1.5  # GPa
LARGEST = [0.3, 0.3, 0.15]  # engineering strain
LEVELS, STEPS = 8, 12
NAMES = ["11", "22", "33", "12", "13", "23"]


def stress(c):
    """S in MPa of W = K/2 ln(1 + E:D:E/K), orthotropic and softening: S = D:E/(1 + E:D:E/K)."""
    e = [(c[a] - 1) / 2 for a in range(3)] + c[3:]  # shear strains doubled
    linear = [sum(D[a][b] * e[b] for b in range(3)) for a in range(3)] + [g * x for g, x in zip(SHEAR, c[3:])]
    soft = 1 + sum(s * x for s, x in zip(linear, e)) / K
    return [1e3 * s / soft for s in linear]


def paths(between, rng):
    """One or two directions at eight levels, the others shrink by a third; `between` shifts the levels."""
    for first in range(3):
        for second in range(first, 3):
            for i in range(LEVELS):
                for j in range(LEVELS):
                    if first == second and i != j:
                        continue
                    kind = f"u{first + 1}" if first == second else f"b{first + 1}{second + 1}"
                    rows = []
                    for step in range(1, STEPS + 1):
                        e = [0.0] * 3
                        for axis, level in ((first, i), (second, j)):
                            e[axis] = LARGEST[axis] * (level + 1 - between) / LEVELS * step / STEPS
                        pulled = sum(e)
                        for a in range(3):
                            if a not in (first, second):
                                e[a] = -pulled / 3 + 0.004 * (rng.random() - 0.5)
                        rows.append([(1 + x) ** 2 for x in e] + [0.0] * 3)
                    yield f"{kind}-{i + 1}-{j + 1}", kind, rows


def write(name, runs):
    with gzip.GzipFile(name, "wb", mtime=0) as file:
        head = ["run_id", "kind"] + ["C" + n for n in NAMES] + [f"S{n} [MPa]" for n in NAMES]
        file.write((",".join(head) + "\n").encode())
        for run, kind, rows in runs:
            for c in rows:
                c = [round(x, 8) for x in c]
                numbers = [f"{x:.8g}" for x in c] + [f"{x:.10g}" for x in stress(c)]
                file.write((",".join([run, kind] + numbers) + "\n").encode())


rng = random.Random(4)
training = list(paths(0.0, rng))
write("runs.csv.gz", training)
held = [c for _, _, rows in paths(0.5, rng) for c in rows]
box = [[f(c[a] for _, _, rows in training for c in rows) for f in (min, max)] for a in range(3)]


def in_box(larger):
    return [(l + h) / 2 + larger * (h - l) * (rng.random() - 0.5) for l, h in box] + [0.0] * 3


def sheared():
    c = list(rng.choice(held))
    return c[:3] + [0.2 * (rng.random() - 0.5), 0.0, 0.0]


sets = {
    "between": [rng.choice(held) for _ in range(400)],
    "gaps": [in_box(1.0) for _ in range(400)],
    "beyond": [in_box(1.5) for _ in range(400)],
    "sheared": [sheared() for _ in range(400)],
}
write("heldout.csv.gz", [(name, name, sorted(rows, key=lambda c: c[2])) for name, rows in sets.items()])
