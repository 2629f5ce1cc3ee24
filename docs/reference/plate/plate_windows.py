"""Gaussian, spline and the cell's window (Lehoucq-Silling) as weights of the measures in plate_measures.py, same judge.
plate_windows.py plate_DX_M_SURFACE.npz ...   appends to plate_measures.csv (here: plate_windows.csv). Windows are averaged over a cell by 16^2 points,
bond functions taken by 64 midpoints; the cell's window is its own average, linear interpolation, by 1024 midpoints."""
import sys
import numpy as np
import hardy, plate_measures

AS_SHIPPED = hardy.taps


def shape(kind, q):
    if kind == "gaussian":  # standard deviation: a third of the radius
        return np.where(q < 1, np.exp(-4.5 * q * q), 0)
    return np.where(q < 0.5, 1 - 6 * q**2 + 6 * q**3, np.where(q < 1, 2 * (1 - q) ** 3, 0))


def taps(o, r, kind="normalised", sub=16):
    if kind not in ("gaussian", "spline", "cell-window"):
        return AS_SHIPPED(o, r, kind, sub)
    p = hardy.starts(o, r).astype(float)
    w = np.zeros(len(p))
    if kind == "cell-window":
        for a in (np.arange(1024) + 0.5) / 1024:
            w += np.prod(np.maximum(0, 1 - np.abs(p + a * o)), 1)
    else:
        t = (np.arange(sub) + 0.5) / sub - 0.5
        for s in np.stack(np.meshgrid(t, t, indexing="ij"), -1).reshape(-1, 2):
            for a in (np.arange(64) + 0.5) / 64:
                w += shape(kind, np.sqrt(((p + s + a * o) ** 2).sum(1)) / r)
    w /= w.sum()
    return p[w > 0].astype(int), w[w > 0]


if __name__ == "__main__":
    plate_measures.taps = taps
    plate_measures.MEASURES = [(k, k, 1, "exist") for k in ("gaussian", "spline", "cell-window")]
    for name in sys.argv[1:]:
        plate_measures.analyse(name)
