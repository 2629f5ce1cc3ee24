"""Peridynamic models in a few lines."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _polymech
from ._result import Table, Value
from ._run import OnStep, stepper

if TYPE_CHECKING:
    import pyvista
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
Region: TypeAlias = "Callable[..., Any] | tuple[Sequence[float], Sequence[float]]"


def _numbers(values: Sequence[float], length: int, what: str) -> list[float]:
    found = [float(value) for value in values]
    if len(found) != length:
        raise ValueError(f"{what}: found {len(found)} components; allowed: {length}")
    return found


class Body:
    """Shapes filled with particles on a regular lattice; lengths in m. Methods return a new body and do not change this one.

    Bodies of two dimensions are sheets in plane stress, unless `space` is ``"plane-strain"``.
    """

    def __init__(
        self,
        dimension: int,
        shape: tuple[str, list[float]],
        spacing: float,
        horizon: float = 3.015,
        thickness: float = 1.0,
        space: str | None = None,
        partial_volumes: bool = False,
    ) -> None:
        default = "solid" if dimension == 3 else "plane-stress"
        self.dimension = dimension
        self._spec: dict[str, Any] = {
            "shapes": [("add", *shape)],
            "cracks": [],
            "spacing": float(spacing),
            "horizon": float(horizon),
            "thickness": float(thickness),
            "space": space or default,
            "partial_volumes": bool(partial_volumes),
        }

    @classmethod
    def rectangle(cls, low: Sequence[float], high: Sequence[float], spacing: float, **options: Any) -> Body:
        """Creates a sheet between two corners. Options: `horizon` δ in spacings, `thickness` in m, `space`, `partial_volumes`."""
        return cls(2, ("box", _numbers(low, 2, "corner") + _numbers(high, 2, "corner")), spacing, **options)

    @classmethod
    def disk(cls, centre: Sequence[float], radius: float, spacing: float, **options: Any) -> Body:
        """Creates a round sheet."""
        return cls(2, ("ball", [*_numbers(centre, 2, "centre"), float(radius)]), spacing, **options)

    @classmethod
    def box(cls, low: Sequence[float], high: Sequence[float], spacing: float, **options: Any) -> Body:
        """Creates a cuboid between two corners. Options: `horizon` δ in spacings, `partial_volumes`."""
        return cls(3, ("box", _numbers(low, 3, "corner") + _numbers(high, 3, "corner")), spacing, **options)

    @classmethod
    def ball(cls, centre: Sequence[float], radius: float, spacing: float, **options: Any) -> Body:
        """Creates a sphere."""
        return cls(3, ("ball", [*_numbers(centre, 3, "centre"), float(radius)]), spacing, **options)

    @classmethod
    def cylinder(
        cls, centre: Sequence[float], radius: float, length: float, axis: int, spacing: float, **options: Any
    ) -> Body:
        """Creates a cylinder along the axis 0, 1 or 2."""
        numbers = [*_numbers(centre, 3, "centre"), float(radius), float(length), float(axis)]
        return cls(3, ("cylinder", numbers), spacing, **options)

    def _with(self, **lists: Any) -> Body:
        body = copy.copy(self)
        body._spec = {**self._spec, **{name: self._spec[name] + [item] for name, item in lists.items()}}
        return body

    def join(self, other: Body) -> Body:
        """Adds the shape of another body."""
        return self._with(shapes=("add", *other._spec["shapes"][0][1:]))

    def cut(self, low: Sequence[float], high: Sequence[float]) -> Body:
        """Removes a box."""
        d = self.dimension
        return self._with(shapes=("cut", "box", _numbers(low, d, "corner") + _numbers(high, d, "corner")))

    def cut_ball(self, centre: Sequence[float], radius: float) -> Body:
        """Removes a disk or sphere."""
        return self._with(shapes=("cut", "ball", [*_numbers(centre, self.dimension, "centre"), float(radius)]))

    def crack(self, start: Sequence[float], *edges: Sequence[float]) -> Body:
        """Adds a crack of zero width: in a plane between two points, in space from a corner along two edges."""
        d = self.dimension
        if len(edges) != d - 1:
            raise ValueError(f"crack: found {len(edges)} further points; allowed: {d - 1} in {d} dimensions")
        return self._with(cracks=sum((_numbers(p, d, "crack") for p in (start, *edges)), []))


class BondLaw:
    """A bond law of your own: the tension t of a bond over its stretch l = |ζ|/|ξ|, a function of an array of stretches.

    The function is sampled once, on construction, between two stretches; beyond them it continues along its tangent. Between the
    samples it is a polynomial of degree 10 on 256 panels, accurate to about 1e-12 for a smooth function. The scale of t is arbitrary:
    it is chosen so that the small-strain modulus is that of the model.
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


class Model:
    """A body, its material and its loads, not yet built. Methods change the model and return it.

    `law` is the name of a bond law (``chain-offset``, ``chain-shifted``, ``chain-affine``, ``linear``, ``as-published``), a
    `BondLaw`, or a function of stretches. `youngs_modulus` in Pa. Chains have `links` of a `dissociation` energy, in kθ. Bonds break at
    a `critical_stretch`, or at the one that follows from a `fracture_energy` in J/m². The `convention` says which energy it is:
    ``tearing``, at which a crack runs; ``bonds``, of the bonds across it; ``softening``, of tearing with bonds that soften before they break.

    A region is a function of coordinate arrays in m, such as ``lambda x, y: y < 6e-3``, or two corners of a box.
    """

    def __init__(
        self,
        body: Body,
        law: str | BondLaw | Callable[[Array], ArrayLike] = "chain-offset",
        *,
        youngs_modulus: float,
        links: float = 720.0,
        dissociation: float = 1200.0,
        critical_stretch: float | None = None,
        fracture_energy: float | None = None,
        convention: str = "tearing",
        calibration: str = "continuum",
    ) -> None:
        if calibration not in ("continuum", "lattice"):
            raise ValueError(f"calibration: found {calibration!r}; allowed: continuum, lattice")
        if critical_stretch is not None and fracture_energy is not None:
            raise ValueError("critical_stretch conflicts with fracture_energy: give one of them")
        if convention not in ("tearing", "bonds", "softening"):
            raise ValueError(f"convention: found {convention!r}; allowed: tearing, bonds, softening")
        if not isinstance(law, (str, BondLaw)):
            law = BondLaw(law)
        self.body = body
        self._spec: dict[str, Any] = {
            **body._spec,
            "law": law if isinstance(law, str) else law._law,
            "youngs_modulus": float(youngs_modulus),
            "links": float(links),
            "dissociation": float(dissociation),
            "critical_stretch": critical_stretch,
            "fracture_energy": fracture_energy,
            "convention": convention,
            "lattice_calibration": calibration == "lattice",
            "regions": [],
            "steps": 1,
            "contact": None,
        }

    def clamp(self, region: Region) -> Model:
        """Fixes a region."""
        return self.displace(region, [0.0] * self.body.dimension)

    def displace(self, region: Region, displacement: Sequence[float | None]) -> Model:
        """Displaces a region, m, at the end of the steps; components that are `None` stay free. Later calls replace earlier ones."""
        moved = [None if u is None else float(u) for u in displacement]
        return self._load(region, moved, [0.0] * self.body.dimension)

    def body_force(self, region: Region, force: Sequence[float]) -> Model:
        """Loads a region by a body force, N/m³, at the end of the steps. Forces add up."""
        return self._load(region, [None] * self.body.dimension, [float(f) for f in force])

    def _load(self, region: Region, displacement: list[float | None], force: list[float]) -> Model:
        if callable(region):
            function = region

            def inside(points: Array) -> NDArray[np.bool_]:
                return np.ascontiguousarray(np.broadcast_to(np.asarray(function(*points.T), dtype=bool), len(points)))
        else:
            low, high = (np.asarray(_numbers(corner, self.body.dimension, "corner")) for corner in region)

            def inside(points: Array) -> NDArray[np.bool_]:
                inner: NDArray[np.bool_] = np.all((low <= points) & (points <= high), axis=1)
                return inner

        self._spec["regions"].append((inside, displacement, force))
        return self

    def steps(self, steps: int) -> Model:
        """Applies the loads in equal steps."""
        self._spec["steps"] = int(steps)
        return self

    def contact(self, stiffness: float) -> Model:
        """Makes particles without a bond repel each other: a contact is as compliant as 2/`stiffness` layers of confined material; 2 is usual."""
        self._spec["contact"] = float(stiffness)
        return self

    def build(self) -> Simulation:
        """Builds particles, bonds and loads. Raises `ValueError` for an invalid model, and any exception of a region."""
        return Simulation(_polymech.Simulation(self._spec))

    def solve(self, method: str = "lbfgs", **settings: Any) -> Simulation:
        """Builds and solves: see `Simulation.solve`."""
        return self.build().solve(method, **settings)


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
        """Solves the remaining load steps by ``lbfgs``, dynamic ``relaxation``, or explicit dynamics, ``verlet``.

        Settings: `tolerance`, `max_iterations`, `accept`; for ``verlet`` `density` (kg/m³), `end_time`, `ramp`, `time_step` (s), `damping`
        (1/s), `records`. `on_step` is called after every step. If it returns `False`, or after Ctrl-C, the state is kept, and another
        call continues. Raises `RunError` if no equilibrium is found.
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
