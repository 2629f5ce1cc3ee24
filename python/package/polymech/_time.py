"""Laws with time at a material point, and Prony series."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _polymech
from ._laws import Law


@dataclass(frozen=True)
class Branch:
    """A spring in series with a dashpot; constants as in scenes, in SI units.

    >>> Branch("neo-hookean", "constant", {"nu": 2e5, "eta": 1e6})
    Branch(spring='neo-hookean', viscosity='constant', constants={'nu': 200000.0, 'eta': 1000000.0})
    """

    spring: str
    """`neo-hookean` (`nu`), `lopez-pamies-1`, `lopez-pamies-2` (`nu_1`, `beta_1`, …), `eight-chain` (`chain_modulus`, `links`)."""
    viscosity: str
    """`constant` (`eta`), `kumar-lopez-pamies`, `bergstrom-boyce`, `eyring` (`rate`, `stress`)."""
    constants: Mapping[str, float] = field(default_factory=dict)


class Viscoelastic:
    """An incompressible law with branches: equilibrium law, springs and dashpots, softening of Ogden and Roxburgh.

    >>> rubber = Law("neo-hookean", shear_modulus=1e6)
    >>> law = Viscoelastic(rubber, [Branch("neo-hookean", "constant", {"nu": 2e6, "eta": 6e6})])
    >>> held = law.nominal([1e-6, 1e3], [1.01, 1.01])
    >>> [round(float(stress) / 1e3) for stress in held]
    [89, 30]
    """

    def __init__(self, law: Law, branches: Sequence[Branch], mullins: tuple[float, float, float] | None = None) -> None:
        """`mullins`: r, m (Pa) and β."""
        self.law, self.branches, self.mullins = law, tuple(branches), mullins

    def nominal(
        self, time: ArrayLike, strain: ArrayLike, test: str = "uniaxial", error: float | None = None
    ) -> NDArray[np.float64]:
        """Nominal stress (Pa) at times (s, increasing, above 0) and strains, linear between them, from rest at 0 s.

        `strain` is the stretch of a `uniaxial` test or the amount of a `simple-shear`. Steps are chosen for a local error of `error`,
        Pa (default: 1e-5 of the shear modulus at rest).
        """
        time, strain = (np.ascontiguousarray(values, dtype=float) for values in (time, strain))
        if time.ndim != 1 or time.shape != strain.shape:
            raise ValueError(f"time, strain: found {time.shape}, {strain.shape}; allowed: (N,), (N,)")
        rows = [(branch.spring, branch.viscosity, dict(branch.constants)) for branch in self.branches]
        return _polymech.follow(
            key=self.law.model,
            values=list(self.law.parameters.values()),
            branches=rows,
            mullins=self.mullins,
            test=test,
            time=time,
            strain=strain,
            error=1e-5 * self.law.shear_modulus if error is None else error,
        )


@dataclass(frozen=True)
class Prony:
    """A Prony series: modulus after a long time, moduli (Pa) and relaxation times (s) of the terms, misfits."""

    equilibrium: float
    moduli: NDArray[np.float64]
    times: NDArray[np.float64]
    rms: list[float]
    """Root mean square of model/measurement - 1: of the relaxation modulus, or of storage and loss."""

    def relaxation(self, time: ArrayLike) -> NDArray[np.float64]:
        """Modulus (Pa) at times (s) after a step of strain."""
        decay = np.exp(-np.asarray(time, dtype=float)[..., None] / self.times)
        return self.equilibrium + decay @ self.moduli


def prony(
    *columns: ArrayLike, terms: int | None = None, per_decade: int = 2, loss_weight: float = 0.1
) -> Prony:
    """Fits a Prony series to time (s) and modulus (Pa), or to frequency (Hz), storage and loss modulus (Pa).

    >>> time = np.logspace(-1, 3, 60)
    >>> series = prony(time, 1e6 + 3e6 * np.exp(-time / 5))
    >>> round(series.equilibrium), series.times.round(3)
    (1000000, array([5.]))
    """
    if len(columns) not in (2, 3):
        raise ValueError(f"found {len(columns)} columns; allowed: time, modulus or frequency, storage, loss")
    rows = np.ascontiguousarray(np.column_stack([np.asarray(column, dtype=float) for column in columns]))
    return Prony(**_polymech.prony(rows, terms, per_decade, loss_weight))
