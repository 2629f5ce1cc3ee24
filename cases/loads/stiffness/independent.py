"""Load, stiffness and loss of the block of case.toml, from closed forms alone: python3 independent.py"""

from math import exp

MU, K, NU = 1e6, 5e6 / 3, 1e6  # Pa; NU of the branch
M, EDGE, DEPTH, TIME = K + 4 * MU / 3, 16e-3, 1e-3, 1.0

# confined neo-Hookean block: P = M (1/λ − λ)/2, its area EDGE × DEPTH, its height EDGE
for depth in [1.6e-3, 3.2e-3]:
    stretch = 1 - depth / EDGE
    load = 0.5 * M * (1 / stretch - stretch) * EDGE * DEPTH
    slope = 0.5 * M * (1 / stretch**2 + 1) * DEPTH
    print(f"{depth * 1e3} mm: {load:.5f} N, secant {load / depth:.2f} N/m, tangent {slope:.2f} N/m")

# a strain of 1 % in a time T and back in T, T one relaxation time of the branch, whose confined modulus is 4ν/3:
# ∮ σ dε = (4ν/3) ε² (2 − (1 − q)(3 − q)), q = exp(−1)
q = exp(-1)
loss = 4 / 3 * NU * 0.01**2 * (2 - (1 - q) * (3 - q)) * EDGE**2 * DEPTH
print(f"loss of the loop: {loss:.4e} J")
