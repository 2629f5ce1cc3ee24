"""alpha at three places of a slab whose faces are cooled at once: series of the temperature, quadrature of Nakamura's rate.

python slab_alpha.py FOLDER writes near.csv, middle.csv and far.csv (needs numpy). Data of cases/ch5/part-fit.
"""
import sys

import numpy as np

GAS = 8.314462618
GROWTH, NUCLEATION, ENERGY = 37869.0, 136235.0, 6270.0
MELTING, FROZEN, EXPONENT = 193.2 + 273.15, 21.0 + 273.15, 2.678
LENGTH, DIFFUSIVITY = 4e-3, 0.25 / (1010.0 * 2200.0)
START, LEFT, RIGHT = 473.15, 423.15, 435.15

times = np.linspace(0.0, 600.0, 120001)
orders = np.arange(1, 400)
for name, x in (("near", 0.5e-3), ("middle", 2e-3), ("far", 3.5e-3)):
    sign = (-1.0) ** orders
    amplitude = 2 * (START - LEFT) * (1 - sign) / (orders * np.pi) + 2 * (RIGHT - LEFT) * sign / (orders * np.pi)
    shape = amplitude * np.sin(orders * np.pi * x / LENGTH)
    rates = DIFFUSIVITY * (orders * np.pi / LENGTH) ** 2
    # t = 0 is the start itself, where the series does not converge
    temperature = np.full_like(times, LEFT + (RIGHT - LEFT) * x / LENGTH)
    for s, r in zip(shape, rates):
        temperature += s * np.exp(-r * times)
    temperature[0] = START
    inside = (temperature > FROZEN) & (temperature < MELTING)
    t = np.where(inside, temperature, 400.0)
    barrier = NUCLEATION * (t + MELTING) / (2 * t * t * (MELTING - t))
    rate = np.log(2) ** (1 / EXPONENT) * GROWTH * np.exp(-ENERGY / (GAS * (t - FROZEN)) - barrier)
    rate = np.where(inside, rate, 0.0)
    z = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(times))])
    degree = -np.expm1(-(z**EXPONENT))
    last = np.searchsorted(degree, 0.995)
    rows = np.linspace(0, min(last, len(times) - 1), 41)[1:].astype(int)
    with open(f"{sys.argv[1]}/{name}.csv", "w") as file:
        file.write("time [s],alpha\n")
        file.writelines(f"{times[k]:.3f},{degree[k]:.6f}\n" for k in rows)
