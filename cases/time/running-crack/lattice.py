"""A crack in a relaxed strip on the lattice of this case, in small strain: python3 lattice.py (numpy, scipy).

Correspondence with stabilisation, W = 1/2 H:C:H + 1/2 g r, r = 2 sum w |z|^2/I, z = u_J - u_I - H xi, and the energy that
breaking a bond releases, W + z.P M^-1 xi/xi^2 + g |z|^2/xi^2 without r, mean of both ends. C and g of the law in
equilibrium; four times that act on a sudden change from the relaxed strip.
Prints G/G0 at which the first bond breaks and from which on the crack runs (all bonds beyond the limit break at once).
With MEMORY = False the stabilisation of the branch acts on all of z, not on its change: a sudden step then stiffens the
strip at its grips. Its load rises by 10.8 %, and the crack runs from 2.54 and 3.46 G0.
"""
import itertools
import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import spsolve

MEMORY = True
MU, BULK, BRANCH = 0.4e6, 40e6, 3.0
LAME = (BULK - 2 / 3 * MU) * 2 * MU / (BULK - 2 / 3 * MU + 2 * MU)  # in plane stress
CRITICAL, UNIFORM = 1336.3498558, 5.0 / 0.04  # J/m^3 to break, and of the strip at G0
NX, NY, TIP, CUT = 60, 32, 25.0, 16.0  # in spacings of 2 mm; grips below 7 and above 25
C = np.array([[LAME + 2 * MU, 0, 0, LAME], [0, MU, MU, 0], [0, MU, MU, 0], [LAME, 0, 0, LAME + 2 * MU]])
X = np.array([(i + 0.5, j + 0.5) for j in range(NY) for i in range(NX)])
OFFSETS = [(a, b) for a in range(-3, 4) for b in range(-3, 4) if 0 < a * a + b * b <= 3.015**2]


def crosses(p, q):
    if (p[1] - CUT) * (q[1] - CUT) >= 0:
        return False
    return p[0] + (CUT - p[1]) / (q[1] - p[1]) * (q[0] - p[0]) < TIP - 1e-9


def neighbours(cracked):
    """Neighbours of each particle, and their number without a crack."""
    lists, whole = [[] for _ in X], np.zeros(len(X))
    for j, i in itertools.product(range(NY), range(NX)):
        for a, b in OFFSETS:
            if 0 <= i + a < NX and 0 <= j + b < NY:
                one, other = j * NX + i, (j + b) * NX + i + a
                whole[one] += 1
                if not (cracked and crosses(X[one], X[other])):
                    lists[one].append(other)
    return lists, whole


class Body:
    def __init__(self, lists, whole):
        self.families = []
        for one, own in enumerate(lists):
            xi = X[own] - X[one]
            square = (xi**2).sum(1)
            weight, intact = 1 / (square * whole[one]), len(own) / whole[one]
            inverse = np.linalg.inv((weight[:, None, None] * xi[:, :, None] * xi[:, None, :]).sum(0) / intact)
            self.families.append((np.array(own), xi, square, weight, intact, inverse, (weight / intact)[:, None] * (xi @ inverse)))

    def stiffness(self):
        """Of the mean deformation, and of the stabilisation with mu."""
        rows, columns, mean, rest = [], [], [], []
        for one, (own, xi, _, weight, intact, _, slope) in enumerate(self.families):
            n = len(own)
            gradient, z = np.zeros((4, 2 * n + 2)), np.zeros((2 * n, 2 * n + 2))
            for a in range(2):
                for b in range(2):
                    gradient[2 * a + b, a : 2 * n : 2] = slope[:, b]
                    gradient[2 * a + b, 2 * n + a] = -slope[:, b].sum()
                z[a::2] -= xi[:, :1] * gradient[2 * a] + xi[:, 1:] * gradient[2 * a + 1]
                z[np.arange(a, 2 * n, 2), np.arange(a, 2 * n, 2)] += 1
                z[a::2, 2 * n + a] -= 1
            degrees = np.ravel([(2 * k, 2 * k + 1) for k in (*own, one)])
            rows.append(np.repeat(degrees, len(degrees)))
            columns.append(np.tile(degrees, len(degrees)))
            mean.append((intact * gradient.T @ C @ gradient).ravel())
            rest.append((2 * MU * (z.T * np.repeat(weight, 2)) @ z).ravel())
        place, shape = (np.concatenate(rows), np.concatenate(columns)), (2 * len(X), 2 * len(X))
        return [sparse.csr_matrix((np.concatenate(values), place), shape) for values in (mean, rest)]

    def parts(self, u, one, bond):
        """Parts of the released energy of an end: of the law, and of the stabilisation with mu."""
        own, xi, square, _, _, inverse, slope = self.families[one]
        u = u.reshape(-1, 2)
        change = u[own] - u[one]
        gradient = change.T @ slope
        z = change[bond] - gradient @ xi[bond]
        piola = (C @ gradient.ravel()).reshape(2, 2)
        return np.array([0.5 * (gradient * piola).sum() + z @ piola @ inverse @ xi[bond] / square[bond], MU * z @ z / square[bond]])


GRIPS = [X[:, 1] < 7, X[:, 1] > 25]
HELD = np.repeat(GRIPS[0] | GRIPS[1], 2)
PULLED = np.zeros(2 * len(X))
PULLED[1::2][GRIPS[1]] = 1.0
UNIT = UNIFORM / (0.5 * (LAME + 2 * MU) / 20**2) / CRITICAL  # energies of a unit pull as parts of the limit at G0


def equilibrium(matrix, load):
    u = PULLED.copy()
    u[~HELD] = spsolve(matrix[~HELD][:, ~HELD].tocsc(), (load - matrix @ PULLED)[~HELD])
    return u, (matrix @ u - load)[1::2][GRIPS[1]].sum()


def state(body, rule, relaxed):
    """Displacement and load: in equilibrium ("slow"), or at once from the relaxed one."""
    mean, rest = body.stiffness()
    if rule == "slow":
        return equilibrium(mean + rest, 0 * relaxed)
    return equilibrium((1 + BRANCH) * (mean + rest), BRANCH * (mean @ relaxed + MEMORY * (rest @ relaxed)))


def beyond(body, rule, relaxed):
    """Bonds near the tip with the energy that drives them, over their limit at G0."""
    u, _ = state(body, rule, relaxed)
    for one, family in enumerate(body.families):
        if abs(X[one, 1] - CUT) > 4 or not TIP - 8 < X[one, 0] < TIP + 25:
            continue
        for bond, other in enumerate(family[0]):
            if one < other:
                ends = [(one, bond), (other, list(body.families[other][0]).index(one))]
                law, rest = sum(body.parts(u, *end) for end in ends) / 2
                branch, change = sum(body.parts(u - relaxed, *end) for end in ends) / 2
                branch += change if MEMORY else rest
                energy = law + rest + (BRANCH * branch if rule == "total" else 0)
                yield UNIT * energy, one, other


def runs(rule, load, relaxed, most=90):
    lists, whole = neighbours(True)
    broken = 0
    while broken < most:
        over = [bond for bond in beyond(Body(lists, whole), rule, relaxed) if bond[0] * load > 1]
        if not over:
            return False
        broken += len(over)
        for _, one, other in over:
            lists[one].remove(other)
            lists[other].remove(one)
    return True


if __name__ == "__main__":
    whole, cracked = Body(*neighbours(False)), Body(*neighbours(True))
    relaxed, before = state(whole, "slow", PULLED)
    for name, body in (("whole", whole), ("cracked", cracked)):
        print(name, f"load after a sudden step {state(body, 'total', relaxed)[1] / before:.4f}")
    for rule, low, high in (("slow", 0.8, 1.1), ("total", 2.4, 3.2), ("equilibrium", 3.2, 4.0)):
        first = 1 / max(beyond(cracked, rule, relaxed))[0]
        for _ in range(5):
            middle = (low + high) / 2
            low, high = (low, middle) if runs(rule, middle, relaxed) else (middle, high)
        print(rule, f"first bond {first:.3f}, runs from {low:.3f} to {high:.3f}", flush=True)
