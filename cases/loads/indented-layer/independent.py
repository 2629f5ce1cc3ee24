"""Forces and widths of indented-layer and indented-half-space, from closed forms alone: python3 independent.py"""

from math import pi, sqrt

MU, K = 1e6, 5e6 / 3
NU = (3 * K - 2 * MU) / (6 * K + 2 * MU)
E = 2 * MU * (1 + NU)
E_STAR = E / (1 - NU**2)


def layer(depth, radius, thickness):
    """Force, N, on a rigid sphere in an elastic layer bonded to a rigid base, Dimitriadis et al. (2002),
    Eq. (12), doi:10.1016/S0006-3495(02)75620-8: Hertz's law times a series in χ = √(R δ)/h."""
    a0 = -(1.2876 - 1.4678 * NU + 1.3442 * NU**2) / (1 - NU)
    b0 = (0.6387 - 1.0277 * NU + 1.5164 * NU**2) / (1 - NU)
    x = sqrt(radius * depth) / thickness
    series = 1 - 2 * a0 / pi * x + 4 * a0**2 / pi**2 * x**2
    series -= 8 / pi**3 * (a0**3 + 4 * pi**2 / 15 * b0) * x**3
    series += 16 * a0 / pi**4 * (a0**3 + 3 * pi**2 / 5 * b0) * x**4
    return 4 / 3 * E_STAR * sqrt(radius) * depth**1.5 * series, series


def strip(force, radius):
    """Half-width, m, of the contact of a rigid cylinder with a half-space, F per width: Hertz, Johnson
    (1985), Eq. (4.43)."""
    return sqrt(4 * force * radius / (pi * E_STAR))


if __name__ == "__main__":
    print(f"E = {E / 1e6:.4f} MPa, nu = {NU:.4f}, E* = {E_STAR / 1e6:.4f} MPa")
    for depth in [0.1e-3, 0.2e-3]:
        force, series = layer(depth, 80e-3, 8e-3)
        print(f"sphere, depth {depth * 1e3} mm: {force:.5f} N, Hertz times {series:.4f}")
    half = strip(400.0, 80e-3)
    print(f"cylinder, 400 N/m: a = {half * 1e3:.4f} mm, spread a/2 = {half / 2 * 1e3:.4f} mm")
