"""Energy release rate at which a crack in a relaxed strip runs without waiting: python3 independent.py

Small strain, a law of modulus mu and a branch nu that relaxes. Far ahead the strip is strained by f, and relaxed.
Where the crack is at once, the branch has no time: the strain at its tip is e = f + mu/(mu + nu) (t - f), with t that
of a crack that has been there for long. As lengths, with t = 1 at G0 and f = r t: the energy in equilibrium is mu
e^2, the total one mu e^2 + nu (e - f)^2. For r = 0 these are the limits of a high strip, G0 ((mu + nu)/mu)^2 and G0
(mu + nu)/mu. A bond of a uniform strain f = r t has the energy G0/h, and breaks at that of the lattice (the scene's
`critical_energy`): r^2 = G0/(h critical_energy). The ratios of the table hold at r = 0.3059099761, 24 rows.
Last columns: stretch of the grip, mm, for G less and more by 14 %, the spread of c_G.
"""
import math

MU, NU = 0.4e6, 1.2e6
HEIGHT, INTRINSIC, CRITICAL_ENERGY = 0.04, 5.0, 1336.3498558


def limits(r, nu=NU / MU):
    inside = 1 + nu * r
    return (1 + nu) ** 2 / inside**2, (1 + nu) ** 2 / (inside**2 + nu * (1 - r) ** 2)


def grip(ratio):
    """Displacement of the grip, mm, where h W(1 + u/h) = ratio G0, W = mu/2 (x^2 + x^-2 - 2)."""
    cosh = 1 + ratio * INTRINSIC / HEIGHT / MU
    return 1e3 * HEIGHT * (math.sqrt(cosh + math.sqrt(cosh**2 - 1)) - 1)


if __name__ == "__main__":
    for found, table in zip(limits(0.3059099761), (4.350559281, 3.123163222)):
        assert abs(found / table - 1) < 1e-5, (found, table)
    r = math.sqrt(INTRINSIC / HEIGHT / CRITICAL_ENERGY)
    print(f"r {r:.4f}")
    for name, limit in zip(("equilibrium", "total", "slow"), (*limits(r), 1.0)):
        print(name, f"{limit:.3f}", *(f"{factor * limit:.3f} {grip(factor * limit):.6f}" for factor in (0.86, 1.14)))
    print("creep", *(f"{ratio} {grip(ratio):.6f}" for ratio in (2.0,)))
