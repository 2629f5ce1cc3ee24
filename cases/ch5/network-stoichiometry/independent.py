"""Expected values of case.toml without the programs: recursion of Miller and Macosko (1976) for four-functional
cross-linkers, phantom junctions and trapped entanglements, stiffness of a Langevin chain, fracture energy of Lake
and Thomas (1967), and a long crack in a strip between grips, W h = G. Load at the tear: C u t l/h, l the length
of uniform strain with the same load: a finite-element solution has 40.49 mm (crack 40 mm, 40 mm ahead of it)."""
from math import sqrt

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import spsolve

R, T = 8.314462618, 298.15
RHO, G_E = 970.0, 0.20e6  # kg/m3, Pa
M, M_LINK, F = 10.0, 0.33, 4  # kg/mol
B, M_K, M_B, U = 1.3e-9, 0.381, 0.037, 60e3  # m, kg/mol, kg/mol, J/mol
H, WIDTH, CRACK, THICKNESS = 0.020, 0.080, 0.040, 0.001  # m


def network(r, p):
    """Shear modulus (Pa), Kuhn segments, and fracture energy (J/m2) of a network with its sol."""
    s = r * p * p
    alpha = sqrt(1 / s - 0.75) - 0.5
    beta = 1 - r * p * (1 - alpha**3)
    strands = RHO / (M + 2 * r / F * M_LINK)
    linkers = 2 * r / F * strands
    three, four = 4 * alpha * (1 - alpha) ** 3, (1 - alpha) ** 4
    nu, mu = linkers * (1.5 * three + 2 * four), linkers * (three + four)
    mass = strands * (1 - beta) ** 2 / nu * M
    n = mass / M_K
    stiffness = 1 + 3 / (5 * n) + 99 / (175 * n**2) + 513 / (875 * n**3) + 42039 / (67375 * n**4)
    shear = (nu - mu) * R * T * stiffness + G_E * (1 - beta) ** 4
    return shear, n, nu * B * sqrt(n) * mass / M_B * U / 2


def effective_length(crack, columns, rows, ratio=1 / 3):
    """Load over C u t/h of the strip, plane stress, bilinear elements in its upper half."""
    size = np.array([WIDTH / columns, H / 2 / rows])
    stiffness = np.array([[1, ratio, 0], [ratio, 1, 0], [0, 0, (1 - ratio) / 2]])  # over C
    element = np.zeros((8, 8))
    for s, t in [(i / sqrt(3), j / sqrt(3)) for i in (-1, 1) for j in (-1, 1)]:
        dx = np.array([t - 1, 1 - t, 1 + t, -1 - t]) / 2 / size[0]
        dy = np.array([s - 1, -1 - s, 1 + s, 1 - s]) / 2 / size[1]
        strain = np.zeros((3, 8))
        strain[0, 0::2], strain[1, 1::2] = dx, dy
        strain[2, 0::2], strain[2, 1::2] = dy, dx
        element += strain.T @ stiffness @ strain * size.prod() / 4
    node = np.arange((columns + 1) * (rows + 1)).reshape(columns + 1, rows + 1)
    corners = [node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]]
    dof = np.stack([2 * np.stack(corners, -1), 2 * np.stack(corners, -1) + 1], -1).reshape(-1, 8)
    place = np.repeat(dof, 8, 1).ravel(), np.tile(dof, (1, 8)).ravel()
    matrix = sparse.csr_matrix((np.tile(element.ravel(), len(dof)), place))
    u, held = np.zeros(2 * node.size), np.zeros(2 * node.size, bool)
    ahead = node[np.arange(columns + 1) * size[0] > crack - 1e-9, 0]
    held[2 * node[:, -1]] = held[2 * node[:, -1] + 1] = held[2 * ahead + 1] = True
    u[2 * node[:, -1] + 1] = 0.5
    u[~held] = spsolve(matrix[~held][:, ~held].tocsc(), -(matrix[~held][:, held] @ u[held]))
    return (matrix @ u)[2 * node[:, -1] + 1].sum() * H


if __name__ == "__main__":
    length = effective_length(CRACK, 640, 80)
    print(f"# effective length {length:.6g} m; crack 2 mm longer: {effective_length(0.042, 640, 80):.6g} m")
    print("r,network_modulus_Pa,locking_stretch,tearing_energy_J_m2,displacement_m,load_N")
    for r in [0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4]:
        shear, n, energy = network(r, 0.97 / max(r, 1.0))
        modulus = 9 * 3 * shear / 8
        u = sqrt(2 * energy * H / modulus)
        load = modulus * u / H * THICKNESS * length
        print(f"{r},{shear:.6g},{sqrt(n):.6g},{energy:.6g},{u:.6g},{load:.6g}")
