"""Bodies of particles."""

from __future__ import annotations

import copy
import os
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike


def numbers(values: ArrayLike, length: int, what: str) -> list[float]:
    """Returns a list of as many numbers as there are axes."""
    found = np.asarray(values, dtype=float).reshape(-1).tolist()
    if len(found) != length:
        raise ValueError(f"{what}: found {len(found)} components; allowed: {length}")
    return list(found)


def cut(dimension: int, start: Sequence[float], edges: Sequence[Sequence[float]]) -> dict[str, list[float]]:
    """Returns a crack of a scene: in a plane between two points, in space from a corner along two edges."""
    if len(edges) != dimension - 1:
        allowed = f"{dimension - 1} in {dimension} dimensions"
        raise ValueError(f"crack: found {len(edges)} further points; allowed: {allowed}")
    corner, *ends = (numbers(point, dimension, "crack") for point in (start, *edges))
    if dimension == 3:
        ends = [(np.array(corner) + end).tolist() for end in ends]
    return dict(zip(("from", "to", "and"), (corner, *ends), strict=False))


class Body:
    """Shapes filled with particles on a regular lattice; lengths in m. Methods return a new body and do not
    change this one.

    Bodies of two dimensions are sheets in plane stress, unless `space` is ``"plane-strain"``. A shape may
    have a name, `part`: parts that touch are bonded, and `Model.interface` gives their bonds another
    strength.
    """

    def __init__(
        self,
        dimension: int,
        shape: dict[str, Any],
        spacing: float,
        horizon: float = 3.015,
        thickness: float = 1.0,
        space: str | None = None,
        partial_volumes: bool = False,
        part: str | None = None,
    ) -> None:
        self.dimension = dimension
        self.spacing = float(spacing)
        self.horizon = float(horizon)
        self.thickness = float(thickness)
        self.space = space or ("solid" if dimension == 3 else "plane-stress")
        self.partial_volumes = bool(partial_volumes)
        self._shapes = [{**shape, **({"part": part} if part else {})}]
        self._cracks: list[dict[str, list[float]]] = []

    @classmethod
    def rectangle(cls, low: Sequence[float], high: Sequence[float], spacing: float, **options: Any) -> Body:
        """Creates a sheet between two corners.

        Options: `horizon` δ in spacings, `thickness` in m, `space`, `partial_volumes`, `part`.
        """
        return cls(2, _box("add", low, high, 2), spacing, **options)

    @classmethod
    def disk(cls, centre: Sequence[float], radius: float, spacing: float, **options: Any) -> Body:
        """Creates a round sheet."""
        return cls(2, _ball("add", centre, radius, 2), spacing, **options)

    @classmethod
    def polygon(cls, points: ArrayLike, spacing: float, **options: Any) -> Body:
        """Creates a sheet from its corners, (N, 2), in order; for `Model.run`."""
        corners = [numbers(point, 2, "corner") for point in np.asarray(points, dtype=float)]
        return cls(2, {"add": "polygon", "points": corners}, spacing, **options)

    @classmethod
    def box(cls, low: Sequence[float], high: Sequence[float], spacing: float, **options: Any) -> Body:
        """Creates a cuboid between two corners. Options: `horizon`, `partial_volumes`, `part`."""
        return cls(3, _box("add", low, high, 3), spacing, **options)

    @classmethod
    def ball(cls, centre: Sequence[float], radius: float, spacing: float, **options: Any) -> Body:
        """Creates a sphere."""
        return cls(3, _ball("add", centre, radius, 3), spacing, **options)

    @classmethod
    def cylinder(
        cls, centre: Sequence[float], radius: float, length: float, axis: int, spacing: float, **options: Any
    ) -> Body:
        """Creates a cylinder along the axis 0, 1 or 2."""
        sizes = {"radius": float(radius), "length": float(length), "axis": "xyz"[axis]}
        shape = {"add": "cylinder", "centre": numbers(centre, 3, "centre"), **sizes}
        return cls(3, shape, spacing, **options)

    @classmethod
    def mesh(
        cls,
        path: str | os.PathLike[str],
        spacing: float,
        unit: float,
        blocks: Sequence[str] = (),
        space: str = "solid",
        **options: Any,
    ) -> Body:
        """Fills the cells of a mesh file, or a closed STL surface, with particles; for `Model.run`.

        `unit` is the length of one unit of the file, m: 1e-3 for mm. Files of Gmsh, Abaqus, CalculiX, VTK and
        Exodus II may be divided: `blocks` (physical groups, element sets) are parts of these names. Sets of
        the file are regions of loads.
        """
        file = {"add": "mesh", "file": os.path.abspath(path), "unit": float(unit)}
        shapes = [{**file, "block": block} for block in blocks] or [file]
        body = cls(3 if space == "solid" else 2, shapes[0], spacing, space=space, **options)
        body._shapes = [{**body._shapes[0], **shape} for shape in shapes]
        return body

    def _with(
        self, shapes: Sequence[dict[str, Any]] = (), cracks: Sequence[dict[str, list[float]]] = ()
    ) -> Body:
        body = copy.copy(self)
        body._shapes, body._cracks = [*self._shapes, *shapes], [*self._cracks, *cracks]
        return body

    def join(self, other: Body) -> Body:
        """Adds the shapes of another body, which has no cuts of its own."""
        if other._cracks or any("cut" in shape for shape in other._shapes):
            raise ValueError("join: found a body with cuts; allowed: one without, cut after joining")
        return self._with(other._shapes)

    def cut(self, low: Sequence[float], high: Sequence[float]) -> Body:
        """Removes a box."""
        return self._with([_box("cut", low, high, self.dimension)])

    def cut_ball(self, centre: Sequence[float], radius: float) -> Body:
        """Removes a disk or sphere."""
        return self._with([_ball("cut", centre, radius, self.dimension)])

    def crack(self, start: Sequence[float], *edges: Sequence[float]) -> Body:
        """Adds a crack of zero width.

        In a plane it lies between two points, in space it has a corner and two edges from there.
        """
        return self._with(cracks=[cut(self.dimension, start, edges)])

    def _scene(self) -> dict[str, Any]:
        """Block `[body]` of a scene."""
        body = {"space": self.space, "spacing": self.spacing, "horizon_ratio": self.horizon}
        flat = {"thickness": self.thickness} if self.dimension == 2 else {}
        cracks = {"cracks": self._cracks} if self._cracks else {}
        return {**body, **flat, "shapes": self._shapes, **cracks}

    def _plain(self) -> dict[str, Any]:
        """Numbers of the body for the compiled module."""
        return {
            "shapes": [_plain(shape) for shape in self._shapes],
            "cracks": [c["from"] + (_edges(c) if "and" in c else c["to"]) for c in self._cracks],
            "spacing": self.spacing,
            "horizon": self.horizon,
            "thickness": self.thickness,
            "space": self.space,
            "partial_volumes": self.partial_volumes,
        }


def _box(what: str, low: Sequence[float], high: Sequence[float], dimension: int) -> dict[str, Any]:
    return {what: "box", "min": numbers(low, dimension, "corner"), "max": numbers(high, dimension, "corner")}


def _ball(what: str, centre: Sequence[float], radius: float, dimension: int) -> dict[str, Any]:
    kind = "disk" if dimension == 2 else "ball"
    return {what: kind, "centre": numbers(centre, dimension, "centre"), "radius": float(radius)}


def _edges(crack: dict[str, list[float]]) -> list[float]:
    return [float(x) for end in ("to", "and") for x in np.subtract(crack[end], crack["from"])]


def _plain(shape: dict[str, Any]) -> tuple[str, str, list[float]]:
    """Operation, kind and numbers of a shape."""
    what = "add" if "add" in shape else "cut"
    if shape[what] == "box":
        return what, "box", shape["min"] + shape["max"]
    if shape[what] in ("disk", "ball"):
        return what, "ball", [*shape["centre"], shape["radius"]]
    if shape[what] == "cylinder":
        axis = float("xyz".index(shape["axis"]))
        return what, "cylinder", [*shape["centre"], shape["radius"], shape["length"], axis]
    raise ValueError(f"{shape[what]}: `build` and `solve` compute boxes, balls and cylinders; use `run`")
