"""Fields over time, from the VTKHDF files of a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _polymech

if TYPE_CHECKING:
    import pyvista
    import xarray

# units of arrays whose names do not end with them
_UNITS = {"displacement": "m", "position": "m", "cauchy": "Pa", "piola": "Pa", "temperature": "K"}
_SUFFIXES = {"degC": "°C", "Pa": "Pa", "m": "m", "K": "K", "s": "s", "N": "N"}


def unit_of(name: str) -> str:
    """Returns the unit of an array."""
    stem, _, last = name.rpartition("_")
    return _SUFFIXES.get(last, "") if stem and last in _SUFFIXES else _UNITS.get(name.split("_")[0], "")


class Series:
    """A VTKHDF file; arrays are read on demand."""

    def __init__(self, path: Path) -> None:
        self.path = str(path)
        self.layout: dict[str, Any] = _polymech.layout(self.path)
        self._kept: dict[tuple[str, str], NDArray[np.float64]] | None = None

    @property
    def times(self) -> NDArray[np.float64]:
        """Time, s, or load step, of each step."""
        times: NDArray[np.float64] = self.layout["times"]
        return times

    @property
    def moves(self) -> bool:
        """True for particles, false for a mesh."""
        return not self.layout["cells"]

    def read(self, kind: str, name: str, steps: list[int] | None = None) -> NDArray[np.float64]:
        """Reads an array of `point`s or `cell`s, or the `position`s, (steps, places[, components])."""
        chosen = list(range(len(self.times))) if steps is None else [k % len(self.times) for k in steps]
        if self._kept is not None:
            return self._kept[kind, name][chosen]
        return _polymech.field(self.path, kind, name, chosen)

    def names(self) -> Iterator[tuple[str, str]]:
        """Kind and name of each array."""
        yield from (("point", name) for name, _ in self.layout["arrays"])
        yield from (("cell", name) for name, _ in self.layout["cell_arrays"])
        yield "position", "position"

    def load(self) -> Series:
        """Reads all arrays into memory."""
        if self._kept is None:
            self._kept = {(kind, name): self.read(kind, name) for kind, name in self.names()}
        return self

    def dataset(self) -> xarray.Dataset:
        """Returns all arrays over `step` and `particle`, or `node` and `element`; coordinate `time`."""
        import xarray as xr

        place = "particle" if self.moves else "node"
        variables = {}
        for kind, name in self.names():
            data = self.read(kind, name)
            dims = ["step", "element" if kind == "cell" else place]
            if data.ndim == 3 and data.shape[2] == 9:
                data = data.reshape(*data.shape[:2], 3, 3)
                dims += ["i", "j"]
            elif data.ndim == 3:
                dims += ["component" if data.shape[2] != 3 else "i"]
            if kind == "position" and not self.moves:
                data, dims = data[0], dims[1:]
            variables[name] = (dims, data, {"units": unit_of(name), "long_name": name.replace("_", " ")})
        if self.moves:
            time = ("step", self.times, {"long_name": "load step, or row of a dynamic history"})
        else:
            time = ("step", self.times, {"units": "s", "long_name": "time"})
        return xr.Dataset(variables, coords={"time": time})

    def mesh(self, step: int = -1) -> pyvista.DataSet:
        """Returns a step for PyVista."""
        import pyvista as pv

        points = self.read("position", "position", [step])[0]
        if self.moves:
            grid = pv.PolyData(points)
        else:
            ends = self.layout["ends"].astype(np.int64)
            starts = np.concatenate([[0], ends[:-1]])
            cells = np.insert(self.layout["connectivity"].astype(np.int64), starts, ends - starts)
            grid = pv.UnstructuredGrid(cells, self.layout["types"], points)
        for kind, name in self.names():
            if kind != "position":
                (grid.cell_data if kind == "cell" else grid.point_data)[name] = self.read(kind, name, [step])[0]
        if not self.moves and "exists" in grid.cell_data:
            grid = grid.extract_cells(np.flatnonzero(grid.cell_data["exists"] > 0.5).astype(np.int64))
        return grid


class Fields(Mapping[str, "xarray.Dataset"]):
    """Datasets by the name of the variant or study; each is read on demand."""

    def __init__(self, series: dict[str, Series]) -> None:
        self.series = series
        """Files, for single arrays and steps: ``fields.series[name].read("point", "displacement", [-1])``."""

    @classmethod
    def find(cls, output: Path | None) -> Fields:
        """Finds all VTKHDF files below a folder."""
        if output is None:
            return cls({})
        files = sorted(output.rglob("*.vtkhdf"))
        return cls({str(file.relative_to(output).with_suffix("")): Series(file) for file in files})

    def loaded(self) -> Fields:
        """Returns the same fields, in memory."""
        return Fields({name: one.load() for name, one in self.series.items()})

    def pick(self, name: str | None = None) -> Series:
        """Returns the file of a variant, by default the first."""
        if not self.series:
            raise KeyError("no fields: the scene has `output.fields = false`, or the run writes no fields")
        if name is None:
            return next(iter(self.series.values()))
        if name not in self.series:
            raise KeyError(f"no fields of {name!r}; available: {', '.join(map(repr, self.series))}")
        return self.series[name]

    def __getitem__(self, name: str) -> xarray.Dataset:
        return self.pick(name).dataset()

    def __iter__(self) -> Iterator[str]:
        return iter(self.series)

    def __len__(self) -> int:
        return len(self.series)

    @property
    def first(self) -> xarray.Dataset:
        """Dataset of the first variant, often the only one."""
        return self.pick().dataset()

    def mesh(self, name: str | None = None, step: int = -1) -> pyvista.DataSet:
        """Returns a step of a variant for PyVista."""
        return self.pick(name).mesh(step)
