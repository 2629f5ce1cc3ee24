"""A strip of height 1 and width 4 between rigid plates that approach by 1 %, linear elastic, plane strain: apparent modulus over mu.
scikit-fem 10 or later, quadratic quadrilaterals. Prints, for 20 and 40 elements over the height, the values at K/mu = 5/3, 100, 1000:
2.913, 16.502, 19.114 and 2.913, 16.492, 19.093."""
import numpy as np
from skfem import Basis, BilinearForm, ElementQuad2, ElementVector, MeshQuad, condense, solve
from skfem.helpers import ddot, sym_grad, trace


def strip(bulk, elements, width=4.0, strain=0.01):
    edge = np.linspace(0, 0.2, elements // 2 + 1)
    middle = np.linspace(0.2, width - 0.2, 2 * elements)[1:-1]
    across = np.concatenate([edge, middle, width - edge[::-1]])
    up = 0.5 - 0.5 * np.cos(np.pi * np.linspace(0, 1, elements + 1))
    basis = Basis(MeshQuad.init_tensor(across, up), ElementVector(ElementQuad2()))

    @BilinearForm
    def energy(u, v, _):
        e = sym_grad(u)
        return (bulk - 2 / 3) * trace(e) * trace(sym_grad(v)) + 2 * ddot(e, sym_grad(v))

    matrix = energy.assemble(basis)
    lower = basis.get_dofs(lambda x: np.isclose(x[1], 0.0))
    upper = basis.get_dofs(lambda x: np.isclose(x[1], 1.0))
    pressed = upper.all(["u^2"])
    u = basis.zeros()
    u[pressed] = -strain
    u = solve(*condense(matrix, x=u, D=np.unique(np.concatenate([lower.all(), upper.all()]))))
    return -(matrix @ u)[pressed].sum() / (width * strain)


for elements in (20, 40):
    print(elements, [round(float(strip(bulk, elements)), 4) for bulk in (5 / 3, 100.0, 1000.0)])
