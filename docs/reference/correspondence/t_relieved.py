"""Reference numbers of the corrected gradient on a jittered cloud: forces and F of every particle, intact and with a cut (theta stays that of the intact body). Writes reference_relieved.csv"""
import csv, numpy as np
from corr import *
from t_reference import placed

shape = (11, 10); rng = np.random.default_rng(4)
X = lattice(shape, 1.) + .2 * (2 * rng.random((int(np.prod(shape)), 2)) - 1); V = 1 + .2 * rng.random(len(X))
b = Body(X, V, 3.015, NeoHookean(1., 5 / 3), 'strain'); inner = ((X > 3.) & (X < np.array(shape) - 3.)).all(1); theta = b.correct(inner, 1e-14)
y = placed(X); f = b.force(y); F = b.F; E = b.energy(y)
p, q = X[b.row], X[b.nbr]; dx = np.where(q[:, 0] == p[:, 0], 1, q[:, 0] - p[:, 0]); t = (5.5 - p[:, 0]) / dx
b.d[((p[:, 0] - 5.5) * (q[:, 0] - 5.5) < 0) & (p[:, 1] + t * (q[:, 1] - p[:, 1]) < 5.2)] = 0; b.shape()
b.B = b.B0 + b.wc[:, None] * b.rest(theta) / b.I[b.row][:, None]; g = b.force(y)
print('energy %.12g, cut %.12g; %d inner, %d bonds cut' % (E, b.energy(y), inner.sum(), (b.d == 0).sum()))
with open('reference_relieved.csv', 'w') as h:
    w = csv.writer(h); w.writerow('x y V fx fy Fxx Fxy Fyx Fyy cut_fx cut_fy cut_Fxx cut_Fxy cut_Fyx cut_Fyy inner'.split())
    for i in range(len(X)): w.writerow(['%.17g' % v for v in (*X[i], V[i])] + ['%.12e' % v for v in (*f[i], *F[i].ravel(), *g[i], *b.F[i].ravel())] + [int(inner[i])])
