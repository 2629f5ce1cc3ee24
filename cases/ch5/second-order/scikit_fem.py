"""The heated block of case.toml by scikit-fem: 10-node tetrahedra and 20-node hexahedra of the same shape and place."""
import numpy as np
from skfem import (Basis, BilinearForm, ElementHexS2, ElementTetP2, FacetBasis, LinearForm, MeshHex, MeshTet,
                   condense, solve)
from skfem.helpers import dot, grad

LINES = [np.linspace(0, size, n + 1) for size, n in ((3e-3, 3), (2e-3, 2), (1e-3, 2))]
SIX = [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]]


def tetrahedra():
    x, y, z = LINES
    number = {}
    points = []
    for k in range(3):
        for j in range(3):
            for i in range(4):
                number[i, j, k] = len(points)
                points.append((x[i], y[j], z[k]))
    corner = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    cells = [[number[i + a, j + b, k + c] for a, b, c in corner]
             for k in range(2) for j in range(2) for i in range(3)]
    return MeshTet(np.array(points).T, np.array([[cell[n] for n in part] for cell in cells for part in SIX]).T)


def temperatures(mesh, element, places):
    basis = Basis(mesh, element, intorder=6)
    stiffness = BilinearForm(lambda u, v, w: 0.25*dot(grad(u), grad(v))).assemble(basis)
    heat = LinearForm(lambda v, w: 1e7*v).assemble(basis)
    side = lambda inside: mesh.facets_satisfying(inside, boundaries_only=True)
    film = FacetBasis(mesh, element, facets=side(lambda x: x[0] > 1e-9), intorder=6)
    stiffness += BilinearForm(lambda u, v, w: 500*u*v).assemble(film)
    heat += LinearForm(lambda v, w: 500*20*v).assemble(film)
    held = basis.get_dofs(side(lambda x: x[0] < 1e-9)).all()
    solution = np.zeros(basis.N)
    solution[held] = 100
    solution = solve(*condense(stiffness, heat, x=solution, D=held))
    nearest = lambda at: np.argmin(np.abs(basis.doflocs.T - at).sum(axis=1))
    return [float(solution[nearest(at)]) for at in places]


if __name__ == '__main__':
    print(temperatures(tetrahedra(), ElementTetP2(), [(3e-3, 2e-3, 1e-3), (1.5e-3, 1e-3, 0.25e-3)]))
    print(temperatures(MeshHex.init_tensor(*LINES), ElementHexS2(), [(3e-3, 2e-3, 1e-3), (1.5e-3, 1e-3, 0.5e-3)]))
