"""Delay of fracture of a long crack in a strip under a dead load: python3 independent.py (NumPy-free)

Pure shear of a neo-Hookean law (mu = 1) with a neo-Hookean branch (nu = 3, tau = 1): at each time the stretch
follows from the nominal stress P, the branch flows by dC_v/dt = (nu/eta)(C - I1e C_v/3), and the crack starts
when W_eq, or with the rule `total` W_eq + W_branch, reaches G/h = W_eq(1.5). Runge-Kutta of fourth order. The
second and third columns are the delays at G less and more by 14 %, the spread of the energy at which a crack
starts in a strip of ten spacings; the last at a load that is 1.3 % less, for the ends of the strip.
"""
import math

NU, ETA = 3.0, 3.0
CRITICAL = 0.5 * (2.25 + 1 / 2.25 - 2.0)
LOAD = 1.5 - 1.5**-3


def stretch(viscous, stress):
    a, _, c = viscous
    low, high = 1.0, 50.0
    for _ in range(80):
        x = 0.5 * (low + high)
        found = x - x**-3 + NU * (x / a - x**-3 / c)
        low, high = (x, high) if found < stress else (low, x)
    return low


def rate(viscous, stress):
    x = stretch(viscous, stress)
    c = (x * x, 1.0, x**-2)
    mean = sum(c[i] / viscous[i] for i in range(3)) / 3
    return [NU / ETA * (c[i] - mean * viscous[i]) for i in range(3)]


def energy(viscous, stress, total):
    x = stretch(viscous, stress)
    c = (x * x, 1.0, x**-2)
    own = 0.5 * (x * x + x**-2 - 2)
    return own + (0.5 * NU * (sum(c[i] / viscous[i] for i in range(3)) - 3) if total else 0.0)


def delay(ratio, total, critical=CRITICAL, step=0.01):
    viscous, time, stress = [1.0] * 3, 0.0, ratio * LOAD
    before = energy(viscous, stress, total)
    if before >= critical:
        return 0.0
    while time < 60:
        k1 = rate(viscous, stress)
        k2 = rate([v + 0.5 * step * k for v, k in zip(viscous, k1)], stress)
        k3 = rate([v + 0.5 * step * k for v, k in zip(viscous, k2)], stress)
        k4 = rate([v + step * k for v, k in zip(viscous, k3)], stress)
        viscous = [v + step / 6 * (a + 2 * b + 2 * c + d) for v, a, b, c, d in zip(viscous, k1, k2, k3, k4)]
        after = energy(viscous, stress, total)
        if after >= critical:
            return time + step * (critical - before) / (after - before)
        time, before = time + step, after
    return math.inf


if __name__ == "__main__":
    for total in (False, True):
        for ratio in (0.95, 1.25, 1.5, 2.0, 3.0):
            found = [delay(ratio, total, factor * CRITICAL) for factor in (1.0, 0.86, 1.14)]
            found.append(delay(0.987 * ratio, total))
            print("total" if total else "equilibrium", ratio, *(f"{one:.3f}" for one in found))
