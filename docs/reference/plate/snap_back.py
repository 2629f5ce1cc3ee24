"""The notched sheet (cases/ch2/dent, dx = 2, a = 20) along its path of equilibria: the load at which the largest stretch is critical,
to 1e-9 of it; the bonds that have it to 1e-5 break; the next load, smaller or larger.
snap_back.py [NOTCH] -> snap_back.csv: displacement (mm), load (N) before each event, bonds broken before it"""
import csv, sys, time
import numpy as np
from dent_study import Solver
from sheet import Sheet

b = Sheet(dx=2.0, a=float(sys.argv[1]) if len(sys.argv) > 1 else 20.0)
s = Solver(b, 1e-9)
rows, released, broken, U, u, start = [], 0.0, 0, 20.0, None, time.time()


def equilibrium(U, u):
    """Scaled from the last one; its largest stretch."""
    u = 20.0 * b.affine if u is None else u * (U / equilibrium.at)
    equilibrium.at = U
    u[b.held] = (U * b.pull)[b.held]
    u, F, _ = s.qn(u)
    return u, F, (b.stretches(u) * b.alive).max()


def energy(l):
    """The integral of t from 1 to a stretch, by trapezia in the table."""
    fine = np.linspace(1.0, l, 20001)
    t = np.interp(fine, b.l, b.t)
    return float(((t[1:] + t[:-1]) / 2 * np.diff(fine)).sum())


per_bond = energy(b.lc)
while True:
    u, F, top = equilibrium(U, u)
    if b.load(F) < 1e-3:
        break
    known = []
    for _ in range(40):
        known.append((U, top - b.lc))
        if abs(top / b.lc - 1) < 1e-9:
            break
        if len(known) > 1 and known[-1][1] != known[-2][1]:
            (x, f), (y, g) = known[-2:]
            new = y - g * (y - x) / (g - f)
        else:
            new = U * (b.lc - 1) / (top - 1)
        U = min(max(new, 0.5 * U), 1.5 * U)
        u, F, top = equilibrium(U, u)
    over = np.nonzero((b.alive == 1) & (b.stretches(u) > b.lc * (1 - 1e-5)))[0]
    rows.append((U, b.load(F), broken))
    # c = 2 k V / |xi|: both ends together have V (c/2 |xi|) |xi| 2 phi
    released += float((b.c[over] * b.r0[over] ** 2 * b.V).sum()) * per_bond
    b.alive[over] = 0
    broken += len(over)
    print("U %.4f P %.4f broken %d + %d" % (U, rows[-1][1], rows[-1][2], len(over)), flush=True)
rows.append((U, b.load(F), broken))
peak = max(rows, key=lambda r: r[1])
print("peak %.5f N at %.4f mm; %d events, %d bonds, released %.6f mJ; parted at %.4f mm; %.0f s" % (peak[1], peak[0], len(rows) - 1, broken, released, U, time.time() - start))
with open("snap_back.csv", "w", newline="") as f:
    w = csv.writer(f, lineterminator="\n")
    w.writerow(["displacement [mm]", "load [N]", "broken"])
    w.writerows(("%.4f" % r[0], "%.4f" % r[1], r[2]) for r in rows)
