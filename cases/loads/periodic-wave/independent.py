#!/usr/bin/env python3
"""Standing waves of a periodic lattice of linear bonds, in plain Python: the references of case.toml.

rho w^2 = sum over the stencil 6 k V n_d^2 (1 - cos(q . xi))/|xi| with k = 3E/(2 pi t delta^3) of plane
stress, the displacement along d and q along x. From u = 0 with v = v0 cos(q x), N steps h of velocity Verlet
give u = v0 cos(q x) h sin(N W h)/sin(W h), W h = 2 asin(w h/2).

    python3 cases/loads/periodic-wave/independent.py
"""

from math import asin, cos, hypot, pi, sin

YOUNG, THICKNESS, SPACING, REACH, DENSITY = 1e6, 1e-3, 1e-3, 3.015, 1000.0
COUNT, SPEED, STEP, STEPS = 40, 1e-6, 2e-6, 3000


def frequency(waves, axis):
    """Angular frequency, 1/s, of a number of waves in the cell."""
    stiffness = 3 * YOUNG / (2 * pi * THICKNESS * (REACH * SPACING) ** 3)
    volume = SPACING**2 * THICKNESS
    q = 2 * pi * waves / (COUNT * SPACING)
    total = 0.0
    for x in range(-3, 4):
        for y in range(-3, 4):
            if 0 < x * x + y * y <= REACH**2:
                length = hypot(x, y) * SPACING
                direction = (x, y)[axis] * SPACING / length
                total += direction**2 * (1 - cos(q * x * SPACING)) / length
    return (6 * stiffness * volume / DENSITY * total) ** 0.5


if __name__ == "__main__":
    for waves, axis in ((1, 0), (5, 0), (5, 1), (20, 0)):
        own = frequency(waves, axis)
        phase = 2 * asin(own * STEP / 2)
        place = cos(2 * pi * waves / (COUNT * SPACING) * 0.5 * SPACING)
        moved = SPEED * place * STEP * sin(STEPS * phase) / sin(phase)
        print(f"waves {waves} along {'xy'[axis]}: omega {own:.9g} 1/s, displacement {moved:.9g} m")
