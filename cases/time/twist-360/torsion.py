"""Moment and normal force of a compressible neo-Hookean cylinder twisted at fixed length.

Minimises the energy per length over the radius of each shell, linear between nodes, by Newton's method; M and N
are differences of the least energy by the twist and by the axial stretch. W = μ/2 (I₁ − 3 − 2 ln J) +
κ/4 (J² − 1 − 2 ln J), κ = K − 2μ/3. Needs NumPy. Prints M = 0.1214 N m, N = -18.69 N.
"""

import numpy as np

MU, K, RADIUS, LENGTH, ANGLE = 0.4e6, 20e6, 5e-3, 20e-3, 2 * np.pi
NODES = 81
POINTS = 0.5 + 0.5 * np.array([-1, 1]) / np.sqrt(3)


def energy(radii, twist, stretch):
    """Energy per length at rest, J/m; `radii` over RADIUS at all nodes but the axis."""
    at_rest = np.linspace(0, RADIUS, NODES)
    now = np.concatenate(([0], radii)) * RADIUS
    width = at_rest[1]
    slope = np.diff(now) / width
    total = 0
    for part in POINTS:
        place = at_rest[:-1] + part * width
        hoop = (now[:-1] + part * width * slope) / place
        j = slope * hoop * stretch
        first = slope**2 + hoop**2 * (1 + (twist * place) ** 2) + stretch**2
        density = MU / 2 * (first - 3 - 2 * np.log(j)) + (K - 2 * MU / 3) / 4 * (j * j - 1 - 2 * np.log(j))
        total += np.sum(density * 2 * np.pi * place) * width / 2
    return total


def least_energy(twist, stretch):
    radii = np.linspace(0, 1, NODES)[1:] / np.sqrt(stretch)
    steps = np.eye(NODES - 1) * 1e-30j

    def gradient(radii):
        return np.array([energy(radii + step, twist, stretch).imag for step in steps]) / 1e-30

    for _ in range(12):
        hessian = np.zeros((NODES - 1, NODES - 1))
        for first in range(3):  # nodes at a distance of three share no element
            change = np.zeros(NODES - 1)
            change[first::3] = 1e-6
            column = (gradient(radii + change) - gradient(radii - change)) / 2e-6
            for row in range(NODES - 1):
                for k in range(max(row - 1, 0), min(row + 2, NODES - 1)):
                    if k % 3 == first:
                        hessian[row, k] = column[row]
        radii = radii - np.linalg.solve(hessian, gradient(radii))
    return energy(radii, twist, stretch)


twist, h = ANGLE / LENGTH, 1e-4
moment = (least_energy(twist * (1 + h), 1) - least_energy(twist * (1 - h), 1)) / (2 * h * twist)
normal = (least_energy(twist, 1 + h) - least_energy(twist, 1 - h)) / (2 * h)
print(f"M = {moment:.4f} N m, N = {normal:.2f} N")
