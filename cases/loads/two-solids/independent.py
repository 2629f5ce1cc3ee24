#!/usr/bin/env python3
"""Parts of two neo-Hookean solids in plane strain, in plain Python: the references of case.toml.

Layers with F = diag(lx, ly, 1): P = mu (l - 1/l) + lambda/2 (J^2 - 1)/l; across the layers the stress is equal, along
them the stretch. Tube: u = A r + B/r in each wall, the displacement and the radial stress continuous between them.

    python3 cases/loads/two-solids/independent.py
"""

from math import log, pi

SHEAR, BULK, RATIO = 0.4e6, 2e6, 10.0
STRETCH = 1.2
INNER, MIDDLE, OUTER, PRESSURE, WIDTH = 12e-3, 17.25e-3, 22.5e-3, 200.0, 1e-3


def root_of(function, low, high):
    """Bisects a root to the last digits."""
    rises = function(high) > 0
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if (function(middle) > 0) == rises else (middle, high)
    return 0.5 * (low + high)


def stress(factor, along, across):
    """P along the first of two stretches, Pa."""
    shear, lame = factor * SHEAR, factor * (BULK - 2 / 3 * SHEAR)
    volume = along * across
    return shear * (along - 1 / along) + 0.5 * lame * (volume * volume - 1) / along


def layers(mean, other):
    """Stretches of both layers of which `mean` is the mean, with equal stress."""
    soft = root_of(lambda l: stress(1, l, other) - stress(RATIO, 2 * mean - l, other), 0.1, 2 * mean - 0.1)
    return soft, 2 * mean - soft


def tube():
    """Displacement of the hole, m, and strain u/r at 22 mm."""
    # unknown A1, B1, A2, B2: Gaussian elimination
    def radial(factor, r):
        shear, lame = factor * SHEAR, factor * (BULK - 2 / 3 * SHEAR)
        return 2 * (lame + shear), -2 * shear / r**2

    one, two = radial(1, MIDDLE), radial(RATIO, MIDDLE)
    rows = [
        [*radial(1, INNER), 0, 0, -PRESSURE],
        [one[0], one[1], -two[0], -two[1], 0],
        [MIDDLE, 1 / MIDDLE, -MIDDLE, -1 / MIDDLE, 0],
        [0, 0, *radial(RATIO, OUTER), 0],
    ]
    for k in range(4):
        pivot = max(range(k, 4), key=lambda i: abs(rows[i][k]))
        rows[k], rows[pivot] = rows[pivot], rows[k]
        rows[k] = [value / rows[k][k] for value in rows[k]]
        for i in range(4):
            if i != k:
                rows[i] = [a - rows[i][k] * b for a, b in zip(rows[i], rows[k])]
    a1, b1, a2, b2 = (row[4] for row in rows)
    return a1 * INNER + b1 / INNER, a2 + b2 / 22e-3**2


def energy(factor, along, across):
    """W, J/m3."""
    shear, lame = factor * SHEAR, factor * (BULK - 2 / 3 * SHEAR)
    volume = along * across
    whole = 0.5 * shear * (along * along + across * across - 2 - 2 * log(volume))
    return whole + 0.25 * lame * (volume * volume - 1 - 2 * log(volume))


soft, stiff = layers(STRETCH, 1.0)
print(f"series: stretches {soft:.6f} {stiff:.6f}, P11 {stress(1, soft, 1.0):.1f} Pa")
both = 0.5 * (energy(1, soft, 1.0) + energy(RATIO, stiff, 1.0)) * 160e-9
print(f"  energy {both:.6e} J")
soft, stiff = layers(1.0, STRETCH)
along = 0.5 * (stress(1, STRETCH, soft) + stress(RATIO, STRETCH, stiff))
print(f"parallel: P22 {along:.1f} Pa, P11 {stress(1, soft, STRETCH):.1f} Pa")
inner, rim = tube()
work = PRESSURE * pi * INNER * inner * WIDTH
print(f"tube: u(a) {inner:.6e} m, strain at 22 mm {rim:.6e}, work {work:.6e} J")
