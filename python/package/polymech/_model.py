"""Peridynamic models in a few lines."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _polymech
from ._body import Body, cut, numbers
from ._laws import Law
from ._result import Result
from ._run import Program
from ._scene import schema
from ._simulation import BondLaw, Simulation

Array = NDArray[np.float64]
Box: TypeAlias = "tuple[Sequence[float], Sequence[float]]"
Region: TypeAlias = "str | tuple[str, float] | Box | Body | Callable[..., Any]"
Curve: TypeAlias = "str | tuple[ArrayLike, ArrayLike] | Callable[[Array], ArrayLike]"
Curves: TypeAlias = "Curve | list[Curve]"

SIDES = ("x-", "x+", "y-", "y+", "z-", "z+")
# blocks that every step has of its own
OF_STEPS = ("boundary", "body_force", "solver", "time", "dynamics")


class Model:
    """Body, material and loads, not yet built. Methods change the model and return it.

    `law` is the name of a bond law (``chain-offset``, ``chain-shifted``, ``chain-affine``, ``linear``,
    ``as-published``), a `BondLaw`, or a function of stretches. `youngs_modulus` in Pa. Chains have `links` of
    a `dissociation` energy, in kθ. Bonds break at a `critical_stretch`, or at the one that follows from a
    `fracture_energy` in J/m². The `convention` says which energy it is: ``tearing``, at which a crack runs;
    ``bonds``, of the bonds across it; ``softening``, of tearing with bonds that soften before they break. A
    `polymech.Law` with a bulk modulus is a solid with any Poisson ratio, in place of `youngs_modulus`.

    A region is a side, ``"x-"`` to ``"z+"``, as deep as the horizon, or with a depth in m, ``("x-", 3e-3)``;
    two corners of a box; a function of coordinate arrays in m, such as ``lambda x, y: y < 6e-3``; a `Body`;
    or the name of a set of the mesh file of the body.

    `run` computes all of it as a scene and returns a `Result`. `build` and `solve` keep the state in memory:
    for bodies of boxes, balls and cylinders, regions that are sides, boxes or functions, `displace`,
    `body_force`, `contact` and `crack`.

    A `curve` multiplies a load at the time t, s, in place of the load factor: a formula of t, ``"min(t,
    1)"``, times and values, ``(t, value)``, between which it is linear, or a function of an array of times,
    which is sampled 1000 times in every interval of `time`, at all increments among others. A list has one
    curve for each component. Curves need `time` or `dynamics`.
    """

    def __init__(
        self,
        body: Body,
        law: str | BondLaw | Law | Callable[[Array], ArrayLike] = "chain-offset",
        *,
        youngs_modulus: float | None = None,
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
        if isinstance(law, Law) != (youngs_modulus is None):
            raise ValueError("youngs_modulus: needed by a bond law, refused beside a Law")
        if not isinstance(law, (str, BondLaw, Law)):
            law = BondLaw(law)
        self.body = body
        self._law = law
        self._material = {
            "youngs_modulus": None if youngs_modulus is None else float(youngs_modulus),
            "links": float(links),
            "dissociation": float(dissociation),
            "critical_stretch": critical_stretch,
            "fracture_energy": fracture_energy,
            "convention": convention,
            "lattice_calibration": calibration == "lattice",
        }
        self._tables: dict[str, Any] = {}
        self._steps: list[dict[str, Any]] = [{}]

    def add(self, block: str, **keys: Any) -> Model:
        """Adds a block of a scene by its keys, numbers in SI, such as ``"probe"`` or ``"output.section"``.

        Blocks of a list are appended; of others (``"solver"``, ``"stress"``, ``"material"``) keys are set.
        `boundary`, `solver`, `time`, `dynamics` and `body_force` are of the present `step`.
        """
        *path, last = block.split(".")
        table = self._steps[-1] if block.partition(".")[0] in OF_STEPS else self._tables
        for name in path:
            table = table.setdefault(name, {})
        keys = {name: value for name, value in keys.items() if value is not None}
        if schema("peri").is_list(block):
            table.setdefault(last, []).append(keys)
        else:
            table.setdefault(last, {}).update(keys)
        return self

    def clamp(self, region: Region) -> Model:
        """Fixes a region."""
        return self.displace(region, [0.0] * self.body.dimension)

    def hold(self, region: Region, name: str | None = None) -> Model:
        """Holds a region where the step before has left it."""
        return self.displace(region, ["hold"] * self.body.dimension, name=name)

    def displace(
        self,
        region: Region,
        displacement: Sequence[float | str | None],
        *,
        curve: Curves | None = None,
        name: str | None = None,
    ) -> Model:
        """Displaces a region, m, at the end of the steps; components that are `None` stay free.

        Components may be formulas of the position in m, ``"0.3*y"``, or, in a later `step`, ``"hold"``. In
        memory later calls replace earlier ones.
        """
        return self.add("boundary", region=region, displacement=list(displacement), curve=curve, name=name)

    def rotate(
        self,
        region: Region,
        angle: float,
        through: Sequence[float] | None = None,
        axis: Sequence[float] | None = None,
        *,
        displacement: Sequence[float | str | None] | None = None,
        curve: Curves | None = None,
        name: str | None = None,
    ) -> Model:
        """Turns a region by an angle, rad, along the arc, about an axis through a point, m.

        A plane body turns about the point, by default the origin. The angle is right-handed, and in a later
        `step` that from the undeformed region. `displacement`, m, is added; `None` frees its component along
        the axis.
        """
        point = [0.0] * self.body.dimension if through is None else through
        turn = {"point": point, "angle": float(angle), "axis": axis}
        shift = None if displacement is None else list(displacement)
        return self.add("boundary", region=region, rotation=turn, displacement=shift, curve=curve, name=name)

    def force(
        self,
        region: Region,
        force: Sequence[float],
        *,
        rigid: bool = False,
        curve: Curves | None = None,
        name: str | None = None,
    ) -> Model:
        """Loads a region by a total force, N; a `rigid` one moves as a whole, without rotation."""
        return self.add("boundary", region=region, force=force, rigid=rigid or None, curve=curve, name=name)

    def traction(
        self, side: Region, traction: Sequence[float], *, curve: Curves | None = None, name: str | None = None
    ) -> Model:
        """Loads a side by a traction, Pa, of fixed direction."""
        return self.add("boundary", region=side, traction=traction, curve=curve, name=name)

    def pressure(
        self, region: Region, pressure: float, *, curve: Curve | None = None, name: str | None = None
    ) -> Model:
        """Presses on the faces of a region by a pressure, Pa, that follows the deformed surface."""
        return self.add("boundary", region=region, pressure=float(pressure), curve=curve, name=name)

    def body_force(self, region: Region, force: Sequence[float]) -> Model:
        """Loads a region by a body force, N/m³, at the end of the steps, in memory. Forces add up."""
        return self.add("boundary", region=region, body_force=[float(f) for f in force])

    def contact(self, stiffness: float | None = None, friction: float | None = None) -> Model:
        """Makes particles without a bond repel each other.

        A contact is as compliant as 2/`stiffness` layers of confined material; 2 is usual. `friction` is the
        coefficient μ, also of rigid surfaces.
        """
        layers = 2.0 if stiffness is None else float(stiffness)
        return self.add("contact", stiffness=layers, friction=friction)

    def plane(
        self,
        point: Sequence[float],
        normal: Sequence[float],
        displacement: Sequence[float] | None = None,
        *,
        force: Sequence[float] | None = None,
        bonded: bool = False,
        friction: float | None = None,
        curve: Curves | None = None,
        **keys: Any,
    ) -> Model:
        """Adds a rigid plane through a point, m, with a normal towards the body.

        It moves by a displacement, m, or by a force, N, and may be `bonded` to the faces of the body on it,
        or have a coefficient of `friction`. Without `contact` only rigid surfaces touch the body. `keys` of
        all rigid surfaces: `name`, `stiffness`, `velocity` (m/s).
        """
        keys |= {"displacement": displacement, "friction": friction, "curve": curve}
        if force is None:
            return self.add("contact.plane", point=point, normal=normal, bonded=bonded or None, **keys)
        return self.add("contact.indenter", point=point, normal=normal, force=force, **keys)

    def sphere(
        self,
        centre: Sequence[float],
        radius: float,
        displacement: Sequence[float] | None = None,
        *,
        force: Sequence[float] | None = None,
        friction: float | None = None,
        curve: Curves | None = None,
        **keys: Any,
    ) -> Model:
        """Adds a rigid sphere, in a plane body a circle, m.

        It moves by a displacement, m, or by a force, N; see `plane`.
        """
        keys |= {"displacement": displacement, "force": force, "friction": friction, "curve": curve}
        return self.add("contact.indenter", point=centre, radius=float(radius), **keys)

    def cylinder(
        self,
        point: Sequence[float],
        axis: Sequence[float],
        radius: float,
        displacement: Sequence[float] | None = None,
        **keys: Any,
    ) -> Model:
        """Adds a rigid cylinder without ends, of a radius, m, about an axis through a point, m.

        Further keys as of `sphere`.
        """
        return self.sphere(point, radius, displacement, axis=axis, **keys)

    def indenter(
        self,
        path: str | os.PathLike[str],
        unit: float,
        point: Sequence[float] = (0.0, 0.0, 0.0),
        displacement: Sequence[float] | None = None,
        **keys: Any,
    ) -> Model:
        """Adds a rigid closed surface, an STL file.

        `unit` is the length of a unit of the file, m, and its origin lies at `point`, m. Further keys as of
        `sphere`.
        """
        keys |= {"file": os.path.abspath(path), "unit": float(unit), "displacement": displacement}
        return self.add("contact.indenter", point=point, **keys)

    def interface(
        self,
        first: str,
        second: str,
        *,
        critical_stretch: float | None = None,
        fracture_energy: float | None = None,
        strength: float | None = None,
        convention: str | None = None,
        slides: bool = False,
    ) -> Model:
        """Gives the bonds between two parts a limit of their own; without a limit the parts are not bonded.

        The limit is a stretch, or an energy, J/m², and perhaps a strength, Pa; `convention` is that of
        `Model`. The compressed bonds of one that `slides` break, too.
        """
        limits = {"stretch": critical_stretch, "fracture_energy": fracture_energy, "strength": strength}
        given = {**limits, "convention": convention}
        critical = {name: limit for name, limit in given.items() if limit is not None}
        if (slides or critical) and not any(limit is not None for limit in limits.values()):
            raise ValueError("interface: needs `critical_stretch` or `fracture_energy` beside the other keys")
        bonds = {"critical": critical, "slides": slides or None} if critical else {"unbonded": True}
        return self.add("interface", between=[first, second], **bonds)

    def crack(self, start: Sequence[float], *edges: Sequence[float]) -> Model:
        """Adds a crack at the start of the present step, m, as `Body.crack` does."""
        if len(self._steps) == 1:
            self.body = self.body.crack(start, *edges)
        else:
            self._steps[-1].setdefault("cracks", []).append(cut(self.body.dimension, start, edges))
        return self

    def steps(self, steps: int) -> Model:
        """Applies the loads in equal steps."""
        return self.add("solver", steps=int(steps))

    def time(self, duration: float, increments: int, factor: float = 1.0) -> Model:
        """Adds an interval of time, s, of so many equilibria.

        Loads without a curve grow linearly to `factor` of their values; a second interval with the same
        factor is a hold.
        """
        interval = {"duration": float(duration), "increments": int(increments)}
        return self.add("time.step", **interval, factor=float(factor))

    def dynamics(self, density: float, end_time: float, **keys: Any) -> Model:
        """Computes explicit dynamics, with a density in kg/m³ until a time in s.

        `keys` are those of `[dynamics]`: `ramp` (s), `damping` (1/s), `records`, …
        """
        return self.add("dynamics", density=float(density), end_time=float(end_time), **keys)

    def step(self) -> Model:
        """Begins a later step, from the state at the end of the one before; calls that follow describe it.

        Regions that it does not name are free; a displacement is counted from the undeformed body and reached
        from where the region is. Rigid surfaces stay.
        """
        self._steps.append({})
        return self

    def scene(self) -> dict[str, Any]:
        """Returns the model as a dictionary for `peri.run`, `peri.check` and `peri.sweep`, numbers in SI."""
        first, *later = steps = [self._step(step) for step in self._steps]
        # a region has the same name in all steps
        names: dict[str, str] = {}
        for load in (load for step in steps for load in step.get("boundary", []) if later):
            place = repr({name: load[name] for name in ("min", "max", "shapes") if name in load})
            if "name" not in load and not {"side", "set"} & load.keys():
                load["name"] = names.setdefault(place, f"region {len(names) + 1}")
        tables = dict(self._tables)
        material = {**self._bonds(), **tables.pop("material", {})}
        output = {"pictures": False, **tables.pop("output", {})}
        body = {**self.body._scene(), **tables.pop("body", {})}
        if "contact" in tables:
            tables["contact"] = _resolved({"stiffness": 0.0, **tables["contact"]}, self._steps)
        scene = {"body": body, "material": material, **tables, **first, "output": output}
        return {**scene, "step": later} if later else scene

    def run(self, output: str | os.PathLike[str] | None = None, **options: Any) -> Result:
        """Runs the model as a scene, with the options of `peri.run`: ``run("out/bar", progress=True)``.

        Keys are replaced as there: ``solver__tolerance=1e-6``. There are no pictures, unless
        ``add("output", pictures=True)``.
        """
        return Program("peri").run(self.scene(), output, **options)

    def check(self, **overrides: Any) -> list[str]:
        """Describes in lines what `run` builds; raises `SceneError` if the model is invalid."""
        return Program("peri").check(self.scene(), **overrides)

    def build(self) -> Simulation:
        """Builds particles, bonds and loads in memory.

        Raises `ValueError` for an invalid model, and any exception of a region.
        """
        return Simulation(_polymech.Simulation(self._plain()))

    def solve(self, method: str = "lbfgs", **settings: Any) -> Simulation:
        """Builds and solves: see `Simulation.solve`."""
        return self.build().solve(method, **settings)

    def _bonds(self) -> dict[str, Any]:
        """Block `[material]`."""
        own = self._material
        limits = {"stretch": own["critical_stretch"], "fracture_energy": own["fracture_energy"]}
        law: dict[str, Any]
        if isinstance(self._law, Law):
            law = {"solid": {"law": "correspondence", "constitutive": self._law.block()}}
        elif isinstance(self._law, str):
            chains = {} if self._law == "linear" else {name: own[name] for name in ("links", "dissociation")}
            law = {"law": self._law, "youngs_modulus": own["youngs_modulus"], **chains}
            law |= {"calibration": "lattice"} if own["lattice_calibration"] else {}
            law |= {"volume_correction": "linear"} if self.body.partial_volumes else {}
            limits |= {"convention": own["convention"] if own["fracture_energy"] else None}
        else:
            raise ValueError("law: found a function; allowed in `run`: the name of a bond law, or a Law")
        critical = {name: limit for name, limit in limits.items() if limit is not None}
        return {**law, "critical": critical} if critical else law

    def _step(self, step: Mapping[str, Any]) -> dict[str, Any]:
        """Blocks of a step."""
        found: dict[str, Any] = _resolved(step, [step])
        for load in found.get("boundary", []):
            if "body_force" in load:
                raise ValueError("body_force: `solve` only; `run` takes `force`, N")
            if "region" in load:
                load |= self._at(load.pop("region"))
            shift = load.get("displacement")
            if shift is not None:
                formulas = any(isinstance(u, str) and u not in ("free", "hold") for u in shift)
                shift = ["free" if u is None else u for u in shift]
                if formulas:
                    del load["displacement"]
                    load["displacement_field"] = [u if isinstance(u, str) else repr(float(u)) for u in shift]
                else:
                    load["displacement"] = shift
        if "dynamics" in found:
            found["solver"] = {"method": "verlet", **found.get("solver", {})}
        return found

    def _at(self, region: Any) -> dict[str, Any]:
        """Keys of a region."""
        if isinstance(region, Body):
            return {"shapes": region._shapes}
        if isinstance(region, str):
            return {"side" if region in SIDES else "set": region}
        if callable(region):
            allowed = "a side, two corners, a Body, a set of a mesh"
            raise ValueError(f"region: found a function; allowed in `run`: {allowed}")
        if isinstance(region[0], str):
            return {**self._at(region[0]), "depth": float(region[1])}
        low, high = (numbers(corner, self.body.dimension, "corner") for corner in region)
        return {"min": low, "max": high}

    def _plain(self) -> dict[str, Any]:
        """Numbers of the model for the compiled module."""
        first, contact = self._steps[0], self._tables.get("contact", {})
        loads, solver = first.get("boundary", []), first.get("solver", {})
        beyond = {"Law"} if isinstance(self._law, Law) else set()
        beyond |= {"step"} if len(self._steps) > 1 else set()
        beyond |= self._tables.keys() - {"contact"} | contact.keys() - {"stiffness"}
        beyond |= first.keys() - {"boundary", "solver"} | solver.keys() - {"steps"}
        beyond |= {key for load in loads for key in load} - {"region", "displacement", "body_force"}
        if beyond:
            raise ValueError(f"{', '.join(sorted(beyond))}: not in `build` and `solve`; use `run`")
        zero, free = [0.0] * self.body.dimension, [None] * self.body.dimension
        return {
            **self.body._plain(),
            **self._material,
            "law": self._law._law if isinstance(self._law, BondLaw) else self._law,
            "regions": [
                (self._inside(load["region"]), load.get("displacement", free), load.get("body_force", zero))
                for load in loads
            ],
            "steps": solver.get("steps", 1),
            "contact": contact.get("stiffness"),
        }

    def _inside(self, region: Any) -> Callable[[Array], NDArray[np.bool_]]:
        """Function that selects points of a region."""
        if callable(region):

            def inside(points: Array) -> NDArray[np.bool_]:
                found = np.asarray(region(*points.T), dtype=bool)
                return np.ascontiguousarray(np.broadcast_to(found, len(points)))

            return inside
        at = self._at(region)
        if "side" in at:
            axis, sign = "xyz".index(at["side"][0]), 1.0 if at["side"][1] == "-" else -1.0
            depth = at.get("depth", int(self.body.horizon) * self.body.spacing) - 0.499 * self.body.spacing
            return lambda points: sign * points[:, axis] <= (sign * points[:, axis]).min() + depth
        if "min" not in at:
            allowed = "a side, two corners, a function"
            raise ValueError(f"region: found a Body or a set; allowed in `build` and `solve`: {allowed}")
        return lambda points: np.all((at["min"] <= points) & (points <= at["max"]), axis=1)


def _times(steps: Sequence[Mapping[str, Any]]) -> Array:
    """Instants of steps, s, at which functions are sampled."""
    times = [0.0]
    for step in steps:
        whole = [{"duration": step.get("dynamics", {}).get("end_time", 0.0), "increments": 1}]
        for interval in step.get("time", {}).get("step", whole):
            count = interval["increments"] * max(1, 1000 // interval["increments"])
            times += np.linspace(times[-1], times[-1] + interval["duration"], count + 1)[1:].tolist()
    return np.unique(times)


def _resolved(value: Any, steps: Sequence[Mapping[str, Any]]) -> Any:
    """Copies blocks of a scene; curves of arrays and functions become tables."""
    if isinstance(value, Mapping):
        return {n: (_curve if n == "curve" else _resolved)(item, steps) for n, item in value.items()}
    return [_resolved(item, steps) for item in value] if isinstance(value, list) else value


def _curve(curve: Any, steps: Sequence[Mapping[str, Any]]) -> Any:
    """Curve of a scene."""
    if isinstance(curve, list):
        return [_curve(one, steps) for one in curve]
    if callable(curve):
        times = _times(steps)
        if len(times) == 1:
            raise ValueError("curve: a function needs `time` or `dynamics`, between whose ends it is sampled")
        curve = times, np.broadcast_to(np.asarray(curve(times), dtype=float), times.shape)
    if isinstance(curve, tuple):
        instants, values = curve
        return {"file": {"time [s]": instants, "value": values}, "time": "time", "value": "value"}
    return curve
