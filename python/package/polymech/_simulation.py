"""Built models in memory, and bond laws."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _polymech
from ._result import Table, Value
from ._run import OnStep, stepper

if TYPE_CHECKING:
    import pyvista
    from matplotlib.figure import Figure

Array = NDArray[np.float64]


class BondLaw:
    """A bond law of your own: the tension t of a bond over its stretch l = |ζ|/|ξ|, a function of an array of
    stretches.

    The function is sampled once, on construction, between two stretches; beyond them it continues along its
    tangent. Between the samples it is a polynomial of degree 10 on 256 panels, accurate to about 1e-12 for a
    smooth function. The scale of t is arbitrary: it is chosen so that the small-strain modulus is that of the
    model.
    """

    def __init__(self, tension: Callable[[Array], ArrayLike], stretches: tuple[float, float] = (0.05, 6.0)) -> None:
        low, high = map(float, stretches)
        sampled = np.asarray(tension(_polymech.BondLaw.stretches(low, high)), dtype=np.float64)
        self._law = _polymech.BondLaw(low, high, np.ascontiguousarray(sampled))

    def tension(self, stretch: ArrayLike) -> Array:
        """t(l), to which the kernels are fitted."""
        return self._evaluate(stretch, 0)

    def derivative(self, stretch: ArrayLike) -> Array:
        """dt/dl."""
        return self._evaluate(stretch, 1)

    def energy(self, stretch: ArrayLike) -> Array:
        """Integral of t over l from rest."""
        return self._evaluate(stretch, 2)

    def _evaluate(self, stretch: ArrayLike, what: int) -> Array:
        array = np.asarray(stretch, dtype=np.float64)
        return self._law.evaluate(np.ascontiguousarray(array).reshape(-1))[what].reshape(array.shape)


class Simulation:
    """A built model and its state. Arrays are in the order of `positions`."""

    def __init__(self, simulation: _polymech.Simulation) -> None:
        self._simulation = simulation
        self.finished = False
        """True if the last `solve` completed."""

    def solve(
        self,
        method: str = "lbfgs",
        *,
        threads: int | None = None,
        on_step: OnStep | None = None,
        **settings: float,
    ) -> Simulation:
        """Solves the remaining load steps by ``lbfgs``, dynamic ``relaxation``, or explicit dynamics,
        ``verlet``.

        Settings: `tolerance`, `max_iterations`, `accept`; for ``verlet`` `density` (kg/m³), `end_time`,
        `ramp`, `time_step` (s), `damping` (1/s), `records`. `on_step` is called after every step. If it
        returns `False`, or after Ctrl-C, the state is kept, and another call continues. Raises `RunError` if
        no equilibrium is found.
        """
        numbers = {name: float(value) for name, value in settings.items()}
        self.finished = self._simulation.solve(method, numbers, threads, stepper(on_step))
        return self

    def extend(self, factors: Sequence[float]) -> Simulation:
        """Adds load steps, by their load factors."""
        self._simulation.extend([float(factor) for factor in factors])
        return self

    def set_velocity(self, velocity: ArrayLike) -> Simulation:
        """Sets the initial velocity of explicit dynamics, (N, D), m/s."""
        self._simulation.set_velocity(np.ascontiguousarray(velocity, dtype=np.float64).reshape(-1))
        return self

    @property
    def positions(self) -> Array:
        """Reference positions X, (N, D), m."""
        return self._simulation.positions()

    @property
    def displacements(self) -> Array:
        """Displacements u, (N, D), m."""
        return self._simulation.displacements()

    @property
    def history(self) -> Table:
        """Table with a row for each finished load step, or each record of a dynamic history."""
        columns = self._simulation.history()
        return Table({n: data for n, (_, data) in columns.items()}, {n: unit for n, (unit, _) in columns.items()}, "history")

    @property
    def load(self) -> Value:
        """Load of the last step, N."""
        loads = self.history["load"]
        return Value(loads[-1] if len(loads) else 0.0, "N")

    def cauchy(self, measure: str = "hardy") -> Array:
        """Cauchy stress σ, (N, D, D), Pa."""
        return self._simulation.tensors("cauchy", measure)

    def piola(self, measure: str = "hardy") -> Array:
        """First Piola–Kirchhoff stress P, (N, D, D), Pa."""
        return self._simulation.tensors("piola", measure)

    def deformation_gradients(self) -> Array:
        """F of each particle's family, (N, D, D)."""
        return self._simulation.tensors("deformation", "hardy")

    @property
    def damage(self) -> Array:
        """Share of its bonds that each particle has lost, (N,)."""
        return self._simulation.damage()

    @property
    def fragments(self) -> int:
        """Number of pieces of the body."""
        return self._simulation.fragments()

    def mesh(self) -> pyvista.PolyData:
        """Particles at their deformed positions, for PyVista."""
        import pyvista as pv

        u, x = self.displacements, self.positions
        pad = ((0, 0), (0, 3 - x.shape[1]))
        points = pv.PolyData(np.pad(x + u, pad))
        points.point_data["displacement"] = np.pad(u, pad)
        points.point_data["damage"] = self.damage
        return points

    def plot(self, values: ArrayLike | None = None, label: str = "") -> Figure:
        """Plots the deformed body, coloured by `values`, (N,), or by its displacement, beside the history."""
        import matplotlib.pyplot as plt

        from . import _plot

        u = self.displacements
        if values is None:
            damage = self.damage
            values, label = (damage, "damage") if damage.any() else (np.linalg.norm(u, axis=1), "|displacement| [m]")
        figure, axes = plt.subplots(1, 2, figsize=(11, 4.2), layout="constrained")
        _plot.draw(axes[0], self.positions + u, np.asarray(values, dtype=float), label)
        _plot.history(axes[1], {"": self.history})
        return figure
