"""Writes runs.csv: a compressible neo-Hookean solid at random strains up to stretches of 0.8 and 1.5. Python 3, nothing else."""

import random

MU, K = 0.4, 1.0  # MPa
LAME = K - 2 / 3 * MU
PATHS, ROWS = 600, 10
NAMES = ["11", "22", "33", "12", "13", "23"]


def stress(c):
    """S = μ(1 − C⁻¹) + ½λ(J² − 1)C⁻¹ of W = ½μ(I₁ − 3) − μ ln J + ¼λ(J² − 1 − 2 ln J)."""
    a, b, d, e, f, g = c
    square = a * (b * d - g * g) - e * (e * d - f * g) + f * (e * g - b * f)
    inverse = [b * d - g * g, a * d - f * f, a * b - e * e, f * g - e * d, e * g - f * b, f * e - g * a]
    factor = (0.5 * LAME * (square - 1) - MU) / square
    return [(MU if k < 3 else 0.0) + factor * inverse[k] for k in range(6)]


def rotation(rng):
    """Uniform, of a random quaternion."""
    q = [rng.gauss(0, 1) for _ in range(4)]
    w, x, y, z = (part / sum(p * p for p in q) ** 0.5 for part in q)
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]


rng = random.Random(5)
with open("runs.csv", "w", encoding="utf-8") as file:
    file.write(",".join(["run_id", "kind"] + ["C" + n for n in NAMES] + [f"S{n} [MPa]" for n in NAMES]) + "\n")
    for path in range(PATHS):
        end, axes = [rng.uniform(0.8, 1.5) for _ in range(3)], rotation(rng)
        for row in range(1, ROWS + 1):
            squares = [(1 + (stretch - 1) * row / ROWS) ** 2 for stretch in end]
            pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]
            c = [round(sum(squares[k] * axes[k][i] * axes[k][j] for k in range(3)), 8) for i, j in pairs]
            numbers = [f"{x:.8g}" for x in c] + [f"{x:.10g}" for x in stress(c)]
            file.write(",".join([f"p{path}", "random"] + numbers) + "\n")
