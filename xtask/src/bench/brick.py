"""Solves the brick of `crates/crystfem/benches/brick.rs` in scikit-fem, on the same nodes and elements.

brick.py MESH.inp STEPS TEMPERATURES.csv [STEP NEWTON SOLVES]: prints one line of JSON, writes the temperature of each
node. STEP: length of a step, s; NEWTON, SOLVES: tolerances.
Consistent capacity, 2 x 2 x 2 Gauss points, backward Euler, Newton's iteration with conjugate gradients (diagonal
preconditioner).
"""

import json
import os
import resource
import sys
import time

import numpy as np
import scipy.sparse as sparse
import scipy.sparse.linalg as linalg
import skfem
from skfem.helpers import dot, grad
from skfem.refdom import RefHex

CONDUCTIVITY, DENSITY, SPECIFIC_HEAT = 0.25, 1010.0, 2200.0
HOT, COLD = 493.15, 353.15
FILM, EMISSIVITY, STEFAN_BOLTZMANN = 15.0, 0.9, 5.670374419e-8
# length of a step; of a residual's norm over the first one of its step, and of a linear solve
STEP, NEWTON, SOLVES = map(float, sys.argv[4:7] or (0.5, 1e-10, 1e-6))

# corners of C3D8 in the order of Abaqus and CalculiX
CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]


def read(path):
    """Nodes, elements and the nodes of the bottom."""
    sections = {}
    with open(path) as file:
        for line in file:
            if line.startswith("*"):
                lines = sections.setdefault(line.strip(), [])
            else:
                lines.append(line.strip().rstrip(","))
    table = lambda name: np.array([line.split(",") for line in sections[name]], dtype=float)
    nodes = table("*NODE")[:, 1:]
    elements = table("*ELEMENT,TYPE=C3D8")[:, 1:].astype(int) - 1
    bottom = [int(word) - 1 for line in sections["*NSET,NSET=bottom"] for word in line.split(",")]
    return nodes, elements, np.array(bottom)


def main():
    path, steps, output = sys.argv[1], int(sys.argv[2]), sys.argv[3]
    nodes, elements, bottom = read(path)

    start, user = time.perf_counter(), os.times().user
    order = [CORNERS.index(tuple(int(x) for x in corner)) for corner in RefHex.p.T]
    mesh = skfem.MeshHex(np.ascontiguousarray(nodes.T), np.ascontiguousarray(elements[:, order].T))
    basis = skfem.Basis(mesh, skfem.ElementHex1(), intorder=2)
    held = np.zeros(len(nodes), dtype=bool)
    held[bottom] = True
    outer = mesh.boundary_facets()
    outer = outer[~held[mesh.facets[:, outer]].all(axis=0)]
    surface = skfem.FacetBasis(mesh, skfem.ElementHex1(), facets=outer, intorder=2)
    conduction = skfem.BilinearForm(lambda u, v, _: CONDUCTIVITY * dot(grad(u), grad(v))).assemble(basis)
    capacity = skfem.BilinearForm(lambda u, v, _: DENSITY * SPECIFIC_HEAT / STEP * u * v).assemble(basis)
    loss = skfem.LinearForm(
        lambda v, w: (FILM * (w.t - COLD) + EMISSIVITY * STEFAN_BOLTZMANN * (w.t**4 - COLD**4)) * v
    )
    slope = skfem.BilinearForm(lambda u, v, w: (FILM + 4 * EMISSIVITY * STEFAN_BOLTZMANN * w.t**3) * u * v)
    linear = (conduction + capacity).tocsr()
    free = np.flatnonzero(~held)
    temperature = np.where(held, COLD, HOT)
    set_up, user_set_up = time.perf_counter() - start, os.times().user - user

    start, user = time.perf_counter(), os.times().user
    newton, iterations, first_step = 0, 0, None
    for _ in range(steps):
        before, first = temperature.copy(), None
        while True:
            on_surface = surface.interpolate(temperature)
            residual = linear @ temperature - capacity @ before + loss.assemble(surface, t=on_surface)
            norm = np.linalg.norm(residual[free])
            first = norm if first is None else first
            if norm <= NEWTON * first:
                break
            tangent = (linear + slope.assemble(surface, t=on_surface))[free][:, free]
            count = [0]

            def counted(_):
                count[0] += 1

            change, failed = linalg.cg(
                tangent,
                residual[free],
                rtol=SOLVES,
                M=sparse.diags(1 / tangent.diagonal()),
                callback=counted,
            )
            if failed:
                sys.exit(f"conjugate gradients failed: {failed}")
            temperature[free] -= change
            newton, iterations = newton + 1, iterations + count[0]
        first_step = os.times().user - user if first_step is None else first_step
    loop, user_loop = time.perf_counter() - start, os.times().user - user

    np.savetxt(output, temperature, header="temperature [K]", comments="")
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    figures = {"version": skfem.__version__, "set_up": set_up, "loop": loop, "memory": memory}
    figures |= {"user_set_up": user_set_up, "user_first": first_step, "user_loop": user_loop}
    print(json.dumps(figures | {"newton": newton, "iterations": iterations}))


main()
