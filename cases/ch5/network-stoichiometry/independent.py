"""Expected values of case.toml without the programs: recursion of Miller and Macosko (1976) for four-functional
cross-linkers, phantom junctions and trapped entanglements, stiffness of a Langevin chain, fracture energy of Lake
and Thomas (1967), and a long crack in a strip between grips.

Load: C u t (L - a + h ln 2/pi)/h at the displacement u of the tear: the strip ahead of the crack is strained as a
whole, and its field reaches h ln 2/pi further (a strip in antiplane shear, by conformal mapping: between a clamped
line and one that is free behind the tip)."""
from math import log, pi, sqrt

R, T, N_A = 8.314462618, 298.15, 6.02214076e23
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


if __name__ == "__main__":
    print("r,network_modulus_Pa,locking_stretch,tearing_energy_J_m2,displacement_m,load_N")
    for r in [0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4]:
        shear, n, energy = network(r, 0.97 / max(r, 1.0))
        modulus = 9 * 3 * shear / 8
        u = sqrt(2 * energy * H / modulus)
        load = modulus * u / H * THICKNESS * (WIDTH - CRACK + H * log(2) / pi)
        print(f"{r},{shear:.6g},{sqrt(n):.6g},{energy:.6g},{u:.6g},{load:.6g}")
