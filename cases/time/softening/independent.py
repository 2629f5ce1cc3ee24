"""Cycles of a rubber with a branch and Mullins softening, with noise: data of this case.

Neo-Hookean rubber (mu) with the softening of Ogden and Roxburgh (r, m, beta), and one neo-Hookean branch (nu)
of constant viscosity (eta), incompressible, in tension: d(ln le)/dt = d(ln l)/dt - nu (le^2 - 1/le)/(3 eta) by
the classical Runge-Kutta method, 40 steps between two points. Writes cycles.csv, and prints three standard
errors of each constant from the Jacobian by the logarithms and the noise: the tolerances of case.toml.

    python3 independent.py
"""
import math
import random

MU, R, M, BETA, NU, ETA = 0.5, 1.6, 0.15, 0.2, 0.3, 1.2  # MPa, s
NOISE = 0.002  # MPa
PEAKS = [1.5, 2.0, 2.5, 3.0]  # loaded to each, unloaded to 1.1
RATES = [0.05, 0.5]  # 1/s
POINTS = 25


def stretches():
    path, at = [1.0], 1.0
    for peak in PEAKS:
        for goal in (peak, 1.1):
            path += [at + (goal - at) * k / POINTS for k in range(1, POINTS + 1)]
            at = goal
    return path


def stresses(constants, rate):
    mu, r, m, beta, nu, eta = constants
    path, le, most, found, time = stretches(), 1.0, 0.0, [], 0.0
    for n, end in enumerate(path):
        if n > 0:
            start = path[n - 1]
            step = abs(end - start) / rate / 40
            speed = (end - start) / (40 * step)

            def slope(elapsed, e):
                x = math.exp(e)
                return speed / (start + speed * elapsed) - nu * (x * x - 1 / x) / (3 * eta)

            e = math.log(le)
            for k in range(40):
                t = k * step
                a = slope(t, e)
                b = slope(t + step / 2, e + step / 2 * a)
                c = slope(t + step / 2, e + step / 2 * b)
                d = slope(t + step, e + step * c)
                e += step / 6 * (a + 2 * b + 2 * c + d)
            le, time = math.exp(e), time + 40 * step
        energy = mu / 2 * (end**2 + 2 / end - 3)
        most = max(most, energy)
        zeta = 1 - math.erf((most - energy) / (m + beta * most)) / r
        found.append((time, end, zeta * mu * (end - end**-2) + nu * (le**2 - 1 / le) / end))
    return found


def main():
    constants = [MU, R, M, BETA, NU, ETA]
    random.seed(20261129)
    with open("cycles.csv", "w") as file:
        file.write("# source: independent.py\nrate [1/s],time [s],stretch,nominal [MPa]\n")
        for rate in RATES:
            for time, stretch, stress in stresses(constants, rate):
                file.write(f"{rate},{time:.9g},{stretch:.9g},{stress + random.gauss(0, NOISE):.7g}\n")
    columns = []
    for k, value in enumerate(constants):
        moved = [constants[:k] + [value * math.exp(s * 1e-4)] + constants[k + 1:] for s in (1, -1)]
        ends = [[p[2] for rate in RATES for p in stresses(c, rate)] for c in moved]
        columns.append([(a - b) / 2e-4 for a, b in zip(*ends)])
    size = len(constants)
    product = [[sum(a * b for a, b in zip(one, other)) for other in columns] for one in columns]
    normal = [[entry / NOISE**2 for entry in row] for row in product]
    rows = [row + [float(i == k) for k in range(size)] for i, row in enumerate(normal)]
    for i in range(size):
        rows[i] = [x / rows[i][i] for x in rows[i]]
        for j in range(size):
            if j != i:
                rows[j] = [x - rows[j][i] * y for x, y in zip(rows[j], rows[i])]
    for k, name in enumerate(["mu", "r", "m", "beta", "nu", "eta"]):
        print(f"{name} = {constants[k]}, three standard errors {300 * math.sqrt(rows[k][size + k]):.3f} %")


main()
