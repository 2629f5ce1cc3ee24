"""Flow of a glassy polymer at a constant true rate, by bisection: python3 independent.py

q = τ₀ asinh(√3 ε̇ η₀ exp(μ_p p/τ₀ + S)/τ₀) with σ = ±√3 q and p = ∓q/√3 (Eyring's viscosity in uniaxial
tension and compression; constants of polycarbonate, Klompen et al. 2005, doi:10.1021/ma050498v), and the
force on 8 mm² at a true strain of 0.1 with the network's stress μ(λ² − 1/λ), μ = 0.01 MPa.
"""
import math

TAU, ETA, PRESSURE, NETWORK, AREA = 0.7, 2.1e11, 0.08, 0.01, 8.0


def flow(rate, sign, softening, pressure=PRESSURE):
    low, high = 0.0, 500.0
    for _ in range(200):
        q = 0.5 * (low + high)
        factor = math.exp(softening - sign * pressure * q / math.sqrt(3) / TAU)
        found = TAU * math.asinh(math.sqrt(3) * rate * ETA * factor / TAU)
        low, high = (q, high) if found > q else (low, q)
    return sign * math.sqrt(3) * low


for name, rate, sign, softening, pressure in [
    ("tension 1e-4", 1e-4, 1, 0, PRESSURE),
    ("tension 1e-2", 1e-2, 1, 0, PRESSURE),
    ("compression 1e-4", 1e-4, -1, 0, PRESSURE),
    ("compression 1e-2", 1e-2, -1, 0, PRESSURE),
    ("aged tension", 1e-2, 1, 26.5, PRESSURE),
    ("aged compression", 1e-2, -1, 26.5, PRESSURE),
    ("no pressure", 1e-2, 1, 0, 0.0),
]:
    stress = flow(rate, sign, softening, pressure)
    stretch = math.exp(0.1 * sign)
    force = (stress + NETWORK * (stretch**2 - 1 / stretch)) * AREA / stretch
    print(f"{name:18} {stress:12.6f} MPa {force:14.6f} N")
