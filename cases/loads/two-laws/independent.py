#!/usr/bin/env python3
"""Layers of two bond laws in series and in parallel, in plain Python: the references of case.toml.

The local limit: in each layer the bonds of the stencil of 3.015 spacings deform with one F = diag(lx, ly), and
P = k sum t(l) (F xi)_i xi_j/|F xi|, t = 3(l - 1) or that of the rigid Langevin chain less its value at rest,
sqrt(n) L^-1(l/sqrt(n)) - sqrt(n) L^-1(1/sqrt(n)). k makes a small dilatation of t = 3(l - 1) store the energy of a
sheet in plane stress with a Poisson ratio of 1/3. Across the layers their stress is equal, along them their
stretch. Also prints the tangent t'(1) of the chain, with which waves travel in it (../wave-between-laws).

    python3 cases/loads/two-laws/independent.py
"""

from math import cosh, hypot, sinh, sqrt

YOUNG, REACH, LINKS = 1e6, 3.015, 3.0
STEPS = [(x, y) for x in range(-3, 4) for y in range(-3, 4) if 0 < x * x + y * y <= REACH**2]
# C1111 + 2 C1122 + C2222 = 2 E/(1 - nu) of the sheet, and 3 k sum |xi| of the bonds
MODULUS = 2 * YOUNG / (1 - 1 / 3) / (3 * sum(hypot(*step) for step in STEPS))


def root_of(function, low, high):
    """Bisects a root to the last digits."""
    rises = function(high) > 0
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if (function(middle) > 0) == rises else (middle, high)
    return 0.5 * (low + high)


def langevin(beta):
    return cosh(beta) / sinh(beta) - 1 / beta if beta > 1e-3 else beta / 3


def inverse(x):
    return root_of(lambda beta: langevin(beta) - x, 1e-9, 300.0)


def linear(stretch):
    return 3 * (stretch - 1)


def chain(stretch, links=LINKS):
    root = sqrt(links)
    return root * (inverse(stretch / root) - inverse(1 / root))


def stress(law, stretches):
    """P_xx and P_yy of a layer under F = diag(stretches), Pa."""
    sums = [0.0, 0.0]
    for step in STEPS:
        moved = [a * b for a, b in zip(stretches, step)]
        now = hypot(*moved)
        pull = MODULUS * law(now / hypot(*step)) / now
        sums = [total + pull * a * b for total, a, b in zip(sums, moved, step)]
    return sums


def energy(law, stretches, pieces=200):
    """Energy of a layer, J/m3: the work of P along the straight path from rest, by Simpson's rule."""
    rate = [value - 1 for value in stretches]
    power = lambda part: sum(p * r for p, r in zip(stress(law, [1 + part * r for r in rate]), rate))
    weights = [1] + [4, 2] * (pieces // 2 - 1) + [4, 1]
    return sum(w * power(k / pieces) for k, w in enumerate(weights)) / (3 * pieces)


def layers(across, along):
    """Stretches of both layers across them with the mean `across`, at the stretch `along` of both."""
    gap = lambda l: stress(linear, (l, along))[0] - stress(chain, (2 * across - l, along))[0]
    first = root_of(gap, across - 0.15, across + 0.19)
    return first, 2 * across - first


if __name__ == "__main__":
    for name, across, along in (("series", 1.2, 1.0), ("parallel", 1.0, 1.2)):
        first, second = layers(across, along)
        states = (linear, (first, along)), (chain, (second, along))
        pulls = [stress(law, state) for law, state in states]
        print(name, "stretches", first, second)
        print("  P_xx", pulls[0][0], pulls[1][0])
        print("  P_yy", pulls[0][1], pulls[1][1], "mean", (pulls[0][1] + pulls[1][1]) / 2)
        print("  energy", sum(energy(*state) for state in states) / 2)
    for links in (2.0, 3.0):
        step = 1e-5
        print("tangent", links, (chain(1 + step, links) - chain(1 - step, links)) / (2 * step))
