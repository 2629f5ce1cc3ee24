#!/usr/bin/env python3
"""A square array of stiff cylinders under a mean strain, in NumPy and SciPy: the references of case.toml.

Bilinear finite elements with periodic nodes for the local limit of the lattice: C1111 and C1122 = C1212 of
its bonds are in the ratio of the sums of x^4/|xi|^3 and x^2 y^2/|xi|^3 over the stencil of 3.015 spacings,
calibrated to the dilatation of plane strain. Extrapolated over the two finest meshes by the observed order.

    python3 cases/loads/periodic-cell/independent.py
"""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve

YOUNG, RATIO, RADIUS, REACH = 1e6, 10.0, 0.25, 3.015


def moduli():
    """C1111 and C1122 of the lattice in plane strain at a Poisson ratio of 1/4."""
    steps = [(x, y) for x in range(-3, 4) for y in range(-3, 4) if 0 < x * x + y * y <= REACH**2]
    sums = np.array([[x**4, x**2 * y**2] / np.hypot(x, y) ** 3 for x, y in steps]).sum(axis=0)
    lame = YOUNG * 0.25 / (1.25 * 0.5)
    return sums * (4 * lame / sums.sum())


def stiffness(count):
    """Mean C1111, C1122 and C1212 of the cell, divided into count x count elements of 16 subcells each."""
    points = [(a, b) for a in (-1, 1) for b in (-1, 1)]
    first, second = moduli()
    law = np.array([[first, second, 0], [second, first, 0], [0, 0, second]])
    edge = 1 / count
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    element, strains = np.zeros((8, 8)), np.zeros((3, 8))
    for a, b in points:
        x, y = a / np.sqrt(3), b / np.sqrt(3)
        slopes = np.array([[p * (1 + q * y), q * (1 + p * x)] for p, q in corners]) / (2 * edge)
        shape = np.zeros((3, 8))
        shape[0, 0::2], shape[1, 1::2] = slopes[:, 0], slopes[:, 1]
        shape[2, 0::2], shape[2, 1::2] = slopes[:, 1], slopes[:, 0]
        element += shape.T @ law @ shape * edge**2 / 4
        strains += shape * edge**2 / 4
    column, row = np.meshgrid(np.arange(count), np.arange(count))
    parts = (np.arange(16) + 0.5) / 16 - 0.5
    inside = np.zeros((count, count))
    for a in parts:
        for b in parts:
            inside += np.hypot((column + 0.5 + a) * edge - 0.5, (row + 0.5 + b) * edge - 0.5) < RADIUS
    scale = (1 + (RATIO - 1) * inside / 256).ravel()
    node = lambda i, j: (i % count) + count * (j % count)
    nodes = [node(column + (p + 1) // 2, row + (q + 1) // 2).ravel() for p, q in corners]
    freedoms = np.stack([2 * n + d for n in nodes for d in range(2)], axis=1)
    rows = np.repeat(freedoms, 8, axis=1).ravel()
    columns = np.tile(freedoms, (1, 8)).ravel()
    matrix = coo_matrix((np.outer(scale, element.ravel()).ravel(), (rows, columns))).tocsr()
    keep = np.arange(2, 2 * count * count)
    result = []
    for mean, read in (([1, 0, 0], (0, 1)), ([0, 0, 1], (2,))):
        load = np.zeros(2 * count * count)
        pull = strains.T @ law @ np.array(mean)
        np.add.at(load, freedoms.ravel(), -np.outer(scale, pull).ravel())
        moved = np.zeros_like(load)
        moved[keep] = spsolve(matrix[keep][:, keep], load[keep])
        stress = (scale[:, None] * (moved[freedoms] @ strains.T @ law)).sum(axis=0)
        stress += law @ mean * scale.mean()
        result += [stress[k] for k in read]
    return np.array(result)


if __name__ == "__main__":
    print("lattice", moduli())
    found = {count: stiffness(count) for count in (50, 100, 200)}
    for count, value in found.items():
        print(count, value)
    print("limit", found[200] - (found[100] - found[200]) / (2**1.56 - 1))
