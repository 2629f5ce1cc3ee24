"""Material of a print at a point, and fits of its kinetics to measurements."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _polymech
from ._result import Table, Value

Array = NDArray[np.float64]
Property: TypeAlias = "float | Callable[[Array], ArrayLike] | tuple[ArrayLike, ArrayLike]"

# Table 4.1, column 1: PA12
_PA12 = {
    "growth_rate": 37_869.0,
    "nucleation": 136_235.0,
    "activation_energy": 6270.0,
    "equilibrium_melting": 466.35,
    "frozen": 294.15,
    "avrami_exponent": 2.678,
}


@dataclass(frozen=True)
class Material:
    """A semicrystalline polymer, SI; by default PA12 of Chapter 4.

    `conductivity` and `specific_heat` are numbers, functions of an array of temperatures in K (sampled once, every kelvin over
    `temperatures`), or pairs of temperatures and values.
    """

    density: float = 1010.0
    """ρ, kg/m³."""
    conductivity: Property = 0.25
    """k, W/(m K)."""
    specific_heat: Property = 2200.0
    """c, J/(kg K)."""
    kinetics: dict[str, float] = field(default_factory=lambda: dict(_PA12))
    """`growth_rate` K₀ (1/s), `nucleation` K_G (K²), `activation_energy` U (J/mol), `equilibrium_melting` T₀, `frozen` T∞ (K),
    `avrami_exponent` n."""
    melting: tuple[float, float, float] | None = (0.965, 8.584, 450.0)
    """Sharpness (1/K), shape and peak (K) of Richards' curve; `None`: crystals never melt."""
    crystallinity: float = 0.25
    """Ultimate crystallinity X∞."""
    latent_heat: float | None = 209e3
    """Heat of fusion of crystal, J/kg."""
    seed: float = 0.0
    """α of fresh material."""
    temperatures: tuple[float, float] = (233.15, 573.15)
    """Range in which functions are sampled, K."""

    def _spec(self) -> dict[str, Any]:
        if set(self.kinetics) != set(_PA12):
            raise ValueError(f"kinetics: found {', '.join(self.kinetics)}; allowed: {', '.join(_PA12)}")
        return {
            "density": float(self.density),
            "conductivity": self._sampled(self.conductivity),
            "specific_heat": self._sampled(self.specific_heat),
            "kinetics": [float(self.kinetics[name]) for name in _PA12],
            "melting": None if self.melting is None else list(map(float, self.melting)),
            "crystallinity": float(self.crystallinity),
            "latent_heat": self.latent_heat,
            "seed": float(self.seed),
        }

    def _sampled(self, value: Property) -> tuple[list[float], list[float]]:
        if callable(value):
            at = np.arange(self.temperatures[0], self.temperatures[1] + 0.5)
            value = (at, np.broadcast_to(np.asarray(value(at), dtype=float), at.shape))
        if isinstance(value, tuple):
            temperatures, values = (np.asarray(column, dtype=float).tolist() for column in value)
            return temperatures, values
        return [], [float(value)]


def table(function: Callable[[Array], ArrayLike], low: float, high: float, unit: str, step: float = 1.0) -> dict[str, list[str]]:
    """Samples a function of temperature in °C, from `low` to `high`, as a property of a scene's material.

    For example ``{"specific_heat": crystfem.table(lambda t: 1500 + 6 * t, 20, 220, "J/(kg K)")}``.
    """
    at = np.arange(low, high + 0.5 * step, step)
    values = np.broadcast_to(np.asarray(function(at), dtype=float), at.shape)
    return {"temperature": [f"{t!r} degC" for t in at.tolist()], "value": [f"{v!r} {unit}" for v in values.tolist()]}


def point(
    time: ArrayLike,
    temperature: ArrayLike,
    material: Material | None = None,
    *,
    degree: float = 0.01,
    kelvin: float = 0.5,
) -> Table:
    """Computes the material under a temperature history: `time` in s, `temperature` in K, linear between, both (N,).

    Returns `time`, `temperature`, relative crystallinity `alpha`, `crystallinity`, `energy` (J/kg) and `rate` dα/dt (1/s). No step
    changes α by more than `degree`, or the temperature by more than `kelvin`.
    """
    seconds, kelvins = (np.asarray(x, dtype=float).ravel().tolist() for x in (time, temperature))
    columns = _polymech.course((material or Material())._spec(), seconds, kelvins, degree, kelvin)
    units = {"time": "s", "temperature": "K", "energy": "J/kg", "rate": "1/s"}
    first = {name: columns.pop(name) for name in ("time", "temperature")}
    columns = {**first, **columns}
    return Table(columns, {name: units.get(name, "") for name in columns}, "point")


@dataclass(frozen=True)
class Fit:
    """Fitted constants of the kinetics."""

    parameters: dict[str, Value]
    """`growth_rate`, `nucleation`, `avrami_exponent`."""
    standard_errors: dict[str, float]
    """Standard error of each parameter."""
    intervals: dict[str, tuple[float, float]]
    """95 % confidence intervals."""
    rms: float
    """Root mean square of model minus measurement, in α."""
    draws: Array
    """Draws of the parameters from their posterior, (draws, parameters)."""
    model: Array
    """α of the model at the measurements, in their order."""
    material: Material
    """PA12 with these kinetics."""


def fit(
    runs: Sequence[tuple[ArrayLike, ArrayLike, ArrayLike]],
    *,
    equilibrium_melting: float = _PA12["equilibrium_melting"],
    frozen: float = _PA12["frozen"],
    activation_energy: float = _PA12["activation_energy"],
) -> Fit:
    """Fits K₀, K_G and n of Nakamura's theory with the rate of Hoffman and Lauritzen to measurements.

    A run is a temperature history and α along it: time (s), temperature (K), α, each (N,); it begins in the melt.
    """
    arrays = [[np.ascontiguousarray(column, dtype=np.float64) for column in run] for run in runs]
    known = [float(equilibrium_melting), float(frozen), float(activation_energy)]
    found = _polymech.fit_kinetics(arrays, known)
    values = {name: Value(value, unit) for name, unit, value, _, _ in found["parameters"]}
    errors = {name: error for name, _, _, error, _ in found["parameters"]}
    intervals = {name: (low, high) for name, _, _, _, (low, high) in found["parameters"]}
    kinetics = dict(zip(["equilibrium_melting", "frozen", "activation_energy"], known))
    material = Material(kinetics={**kinetics, **{name: float(value) for name, value in values.items()}})
    return Fit(values, errors, intervals, found["rms"], found["draws"], found["model"], material)
