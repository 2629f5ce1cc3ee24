"""Models of peridynamics in a few lines."""

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
    """Shapes filled with particles on a regular lattice; lengths in m. Methods give a new body and leave this one.

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
        """A sheet between two corners. Options: `horizon` δ in spacings, `thickness` in m, `space`, `partial_volumes`."""
        return cls(2, ("box", _numbers(low, 2, "corner") + _numbers(high, 2, "corner")), spacing, **options)

    @classmethod
    def disk(cls, centre: Sequence[float], radius: float, spacing: float, **options: Any) -> Body:
        """A round sheet."""
        return cls(2, ("ball", [*_numbers(centre, 2, "centre"), float(radius)]), spacing, **options)

    @classmethod
    def box(cls, low: Sequence[float], high: Sequence[float], spacing: float, **options: Any) -> Body:
        """A cuboid between two corners. Options: `horizon` δ in spacings, `partial_volumes`."""
        return cls(3, ("box", _numbers(low, 3, "corner") + _numbers(high, 3, "corner")), spacing, **options)

    @classmethod
    def ball(cls, centre: Sequence[float], radius: float, spacing: float, **options: Any) -> Body:
        """A ball."""
        return cls(3, ("ball", [*_numbers(centre, 3, "centre"), float(radius)]), spacing, **options)

    @classmethod
    def cylinder(
        cls, centre: Sequence[float], radius: float, length: float, axis: int, spacing: float, **options: Any
    ) -> Body:
        """A cylinder along the axis 0, 1 or 2."""
        numbers = [*_numbers(centre, 3, "centre"), float(radius), float(length), float(axis)]
        return cls(3, ("cylinder", numbers), spacing, **options)

    def _with(self, **lists: Any) -> Body:
        body = copy.copy(self)
        body._spec = {**self._spec, **{name: self._spec[name] + [item] for name, item in lists.items()}}
        return body

    def join(self, other: Body) -> Body:
        """Joins the shape of another body to what has been added so far."""
        return self._with(shapes=("add", *other._spec["shapes"][0][1:]))

    def cut(self, low: Sequence[float], high: Sequence[float]) -> Body:
        """Cuts out a box."""
        d = self.dimension
        return self._with(shapes=("cut", "box", _numbers(low, d, "corner") + _numbers(high, d, "corner")))

    def cut_ball(self, centre: Sequence[float], radius: float) -> Body:
        """Cuts out a disk or ball."""
        return self._with(shapes=("cut", "ball", [*_numbers(centre, self.dimension, "centre"), float(radius)]))

    def crack(self, start: Sequence[float], *edges: Sequence[float]) -> Body:
        """A crack of zero width: in a plane from a point to another, in space from a corner along two edges."""
        d = self.dimension
        if len(edges) != d - 1:
            raise ValueError(f"crack: found {len(edges)} further points; allowed: {d - 1} in {d} dimensions")
        return self._with(cracks=sum((_numbers(p, d, "crack") for p in (start, *edges)), []))


class BondLaw:
    """A bond law of your own: the tension t of a bond over its stretch l = |ζ|/|ξ|, a function of an array of stretches.

    It is sampled once, at the construction, between two stretches; beyond them it goes on along its tangent. Between the samples it is
    a polynomial of degree 10 on 256 panels, so a smooth function is kept to about 1e-12. The scale of t is free: it is made to have the
    small-strain modulus of the model.
    """

    def __init__(self, tension: Callable[[Array], ArrayLike], stretches: tuple[float, float] = (0.05, 6.0)) -> None:
        low, high = map(float, stretches)
        sampled = np.asarray(tension(_polymech.BondLaw.stretches(low, high)), dtype=np.float64)
        self._law = _polymech.BondLaw(low, high, np.ascontiguousarray(sampled))

    def tension(self, stretch: ArrayLike) -> Array:
        """t(l), as kernels are fitted to it."""
        return self._evaluate(stretch, 0)

    def derivative(self, stretch: ArrayLike) -> Array:
        """dt/dl."""
        return self._evaluate(stretch, 1)

    def energy(self, stretch: ArrayLike) -> Array:
        """∫t dl from rest."""
        return self._evaluate(stretch, 2)

    def _evaluate(self, stretch: ArrayLike, what: int) -> Array:
        array = np.asarray(stretch, dtype=np.float64)
        return self._law.evaluate(np.ascontiguousarray(array).reshape(-1))[what].reshape(array.shape)


class Model:
    """A body, its material and its loads, before anything is built. Methods change the model and give it back.

    `law` is the name of a bond law (``chain-offset``, ``chain-shifted``, ``chain-affine``, ``linear``, ``as-published``), a
    `BondLaw`, or a function of stretches. `youngs_modulus` in Pa. Chains have `links` of a `dissociation` energy, in kθ. Bonds break at
    a `critical_stretch`, or at that which follows from a `fracture_energy` in J/m²: by the `convention` ``tearing`` the energy at which a
    crack runs, by ``bonds`` that of the bonds across it, by ``softening`` that of tearing of bonds that soften before they break.

    A region is a function of the coordinates, arrays in m, such as ``lambda x, y: y < 6e-3``, or a box: two corners.
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
            raise ValueError("found critical_stretch and fracture_energy; allowed: one of them")
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
        """Moves a region by a displacement, m, at the end of the steps; components that are `None` stay free. The last one counts."""
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
        """Particles without a bond repel each other: 2/`stiffness` layers of confined material are as compliant as a contact; 2 suits."""
        self._spec["contact"] = float(stiffness)
        return self

    def build(self) -> Simulation:
        """Builds particles, bonds and loads. Raises `ValueError` for what cannot be, and what a region raises."""
        return Simulation(_polymech.Simulation(self._spec))

    def solve(self, method: str = "lbfgs", **settings: Any) -> Simulation:
        """Builds and solves: see `Simulation.solve`."""
        return self.build().solve(method, **settings)


class Simulation:
    """A model that is built, and its state. Arrays are in the order of `positions`."""

    def __init__(self, simulation: _polymech.Simulation) -> None:
        self._simulation = simulation
        self.finished = False
        """Whether the last `solve` came to its end."""

    def solve(
        self,
        method: str = "lbfgs",
        *,
        threads: int | None = None,
        on_step: OnStep | None = None,
        **settings: float,
    ) -> Simulation:
        """Solves what is left of the load steps, by ``lbfgs``, dynamic ``relaxation``, or explicit dynamics, ``verlet``.

        Settings: `tolerance`, `max_iterations`, `accept`; of ``verlet`` `density` (kg/m³), `end_time`, `ramp`, `time_step` (s), `damping`
        (1/s), `records`. `on_step` sees every finished step; where it returns `False`, and after Ctrl-C, the state is that reached, and
        another call goes on. Raises `RunError` where no equilibrium is found.
        """
        numbers = {name: float(value) for name, value in settings.items()}
        self.finished = self._simulation.solve(method, numbers, threads, stepper(on_step))
        return self

    def extend(self, factors: Sequence[float]) -> Simulation:
        """Adds load steps, by their load factors."""
        self._simulation.extend([float(factor) for factor in factors])
        return self

    def set_velocity(self, velocity: ArrayLike) -> Simulation:
        """The velocity at the start of explicit dynamics, (N, D), m/s."""
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
        """A row for each finished load step, or of a dynamic history."""
        columns = self._simulation.history()
        return Table({n: data for n, (_, data) in columns.items()}, {n: unit for n, (unit, _) in columns.items()}, "history")

    @property
    def load(self) -> Value:
        """The load of the last step, N."""
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
        """The part of its bonds that each particle has lost, (N,)."""
        return self._simulation.damage()

    @property
    def fragments(self) -> int:
        """Pieces that the body has broken into."""
        return self._simulation.fragments()

    def mesh(self) -> pyvista.PolyData:
        """The particles at their deformed positions as PyVista sees them."""
        import pyvista as pv

        u, x = self.displacements, self.positions
        pad = ((0, 0), (0, 3 - x.shape[1]))
        points = pv.PolyData(np.pad(x + u, pad))
        points.point_data["displacement"] = np.pad(u, pad)
        points.point_data["damage"] = self.damage
        return points

    def plot(self, values: ArrayLike | None = None, label: str = "") -> Figure:
        """A picture on matplotlib: the deformed body in colours of `values`, (N,), or of its displacement, beside the history."""
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
