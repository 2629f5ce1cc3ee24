"""Results of a run."""

from __future__ import annotations

import csv
import difflib
import html
import shutil
import weakref
from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _polymech
from ._fields import Fields

if TYPE_CHECKING:
    import matplotlib.figure
    import pandas
    import pyvista
    import xarray

Array = NDArray[np.float64]


class Value(float):
    """A number with its unit."""

    unit: str

    def __new__(cls, value: float, unit: str = "") -> Value:
        new = super().__new__(cls, value)
        new.unit = unit
        return new

    def __reduce__(self) -> tuple[Any, ...]:
        return Value, (float(self), self.unit)

    def __repr__(self) -> str:
        return f"{float(self):.6g} {self.unit}".removesuffix(" 1").rstrip()


class Table(Mapping[str, Array]):
    """Columns by name, arrays of equal length, with their `units`."""

    def __init__(self, columns: Mapping[str, Array], units: Mapping[str, str], name: str = "") -> None:
        self._columns = dict(columns)
        self.units = dict(units)
        self.name = name
        self.result: Result | None = None
        """Report and folder of a sweep."""

    @classmethod
    def read(cls, path: str | Path) -> Table:
        """Reads a CSV file with a header ``name [unit],…``; columns without numbers are texts."""
        path = Path(path)
        with path.open(encoding="utf-8", newline="") as file:
            header, *rows = [row for row in csv.reader(file) if row and not row[0].startswith("#")]
        columns, units = {}, {}
        for place, heading in enumerate(header):
            name, _, unit = heading.partition(" [")
            cells = [row[place] for row in rows]
            try:
                columns[name] = np.array([float(cell) if cell else np.nan for cell in cells])
            except ValueError:
                columns[name] = np.array(cells)
            units[name] = unit.rstrip("]")
        return cls(columns, units, path.stem)

    def __getitem__(self, name: str) -> Array:
        if name in self._columns:
            return self._columns[name]
        raise KeyError(_unknown(name, self._columns))

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    def __reduce__(self) -> tuple[Any, ...]:
        return Table, (self._columns, self.units, self.name)

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(next(iter(self._columns.values()), ()))

    def __repr__(self) -> str:
        heads = ", ".join(f"{name} [{unit}]" if unit else name for name, unit in self.units.items())
        return f"Table {self.name!r} of {self.rows} rows: {heads}"

    def to_pandas(self) -> pandas.DataFrame:
        """Converts to a pandas DataFrame; `attrs["units"]` has the units."""
        import pandas as pd

        frame = pd.DataFrame(self._columns)
        frame.attrs["units"] = self.units
        return frame

    def to_xarray(self) -> xarray.Dataset:
        """Converts to an xarray Dataset over `row`; the variables have `units` as attributes."""
        import xarray as xr

        columns = {name: ("row", data, {"units": self.units.get(name, "")}) for name, data in self._columns.items()}
        return xr.Dataset(columns)

    def _repr_html_(self) -> str:
        shown = list(range(self.rows)) if self.rows <= 10 else [*range(5), *range(self.rows - 5, self.rows)]

        def cell(x: Any) -> str:
            return f"{x:.5g}" if isinstance(x, float) else html.escape(str(x))

        head = "".join(f"<th>{html.escape(n)}<br>{html.escape(u)}</th>" for n, u in self.units.items())
        rows = ("<tr>" + "".join(f"<td>{cell(c[k].item())}</td>" for c in self._columns.values()) + "</tr>" for k in shown)
        return f"<table><tr>{head}</tr>{''.join(rows)}</table>"


class Report(Mapping[str, Value]):
    """Values by name, with units: ``report["peak_load"].unit``. With several variants a name has the variant in brackets."""

    def __init__(self, report: dict[str, Any], text: str) -> None:
        self._report = report
        self.text = text
        """Output of the command line."""
        scalars = {name: value for name, value in report["values"].items() if "columns" not in value}
        self._values = {name: Value(float(value["value"]), value["unit"]) for name, value in scalars.items()}

    def __getitem__(self, name: str) -> Value:
        if name in self._values:
            return self._values[name]
        raise KeyError(_unknown(name, self._values))

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    @property
    def passed(self) -> bool:
        """True if all expectations are met and all numbers are finite."""
        return bool(self._report["passed"])

    @property
    def expect(self) -> list[dict[str, Any]]:
        """Expectations of the scene with the values found."""
        found: list[dict[str, Any]] = self._report["expect"]
        return found

    @property
    def curves(self) -> dict[str, Table]:
        """Curves by name."""
        curves = {name: value["columns"] for name, value in self._report["values"].items() if "columns" in value}
        return {
            name: Table({c["name"]: np.array(c["data"], dtype=float) for c in columns}, {c["name"]: c["unit"] for c in columns}, name)
            for name, columns in curves.items()
        }

    @property
    def work(self) -> dict[str, int]:
        """Numbers of steps, iterations, evaluations."""
        return dict(self._report["work"])

    @property
    def seconds(self) -> dict[str, float]:
        """Seconds by phase."""
        return dict(self._report["seconds"])

    @property
    def provenance(self) -> dict[str, Any]:
        """Program, version, scene, machine."""
        return dict(self._report["provenance"])

    def to_pandas(self) -> pandas.DataFrame:
        """Converts to a row for each value, with its unit."""
        import pandas as pd

        rows = {"value": [float(v) for v in self._values.values()], "unit": [v.unit for v in self._values.values()]}
        return pd.DataFrame(rows, index=pd.Index(list(self._values), name="name"))

    def __repr__(self) -> str:
        return self.text.rstrip("\n")


def _unknown(name: str, known: Mapping[str, Any]) -> str:
    near = difflib.get_close_matches(name, known, n=3, cutoff=0.4) or list(known)[:8]
    return f"no {name!r}; available: {', '.join(map(repr, near))}" + (" and others" if len(known) > len(near) else "")


class Page:
    """A self-contained page; notebooks show it."""

    def __init__(self, html: str) -> None:
        self.html = html

    def write(self, path: str | Path) -> None:
        """Writes the page; an error leaves no partial file."""
        path = Path(path)
        part = path.with_name(f".{path.name}.part")
        part.write_text(self.html, encoding="utf-8")
        part.replace(path)

    def _repr_html_(self) -> str:
        return f'<iframe srcdoc="{html.escape(self.html)}" width="100%" height="640" style="border:0"></iframe>'


class Result:
    """A finished run: `report`, `history`, `tables`, `fields`, `mesh()`, `plot()`, `view()`, and the folder `output` of its files.

    Without `output` the results are in a temporary folder, which is deleted with this object. A pickled result contains all numbers, but
    no folder.
    """

    def __init__(self, report: dict[str, Any], text: str, output: Path | None, *, temporary: bool = False) -> None:
        self.report = Report(report, text)
        self.output = output
        if temporary and output is not None:
            self._remove = weakref.finalize(self, shutil.rmtree, output, ignore_errors=True)

    @cached_property
    def tables(self) -> dict[str, Table]:
        """Every CSV file of the run by its name without ending, for studies with their folder: `history_dx-1mm_m-3.015`."""
        if self.output is None:
            return {}
        files = sorted(self.output.rglob("*.csv"))
        return {str(file.relative_to(self.output).with_suffix("")): Table.read(file) for file in files}

    @property
    def histories(self) -> dict[str, Table]:
        """Tables over load steps or time: one for each variant (`peri`), or probe or point (`crystfem`)."""
        found = {}
        for name, table in self.tables.items():
            folder, _, last = name.rpartition("/")
            prefix = next((p for p in ("history_", "probe_") if last.startswith(p)), None)
            if prefix:
                found["/".join(filter(None, [folder, last.removeprefix(prefix)]))] = table
            elif next(iter(table)) == "time":
                found[name] = table
        return found

    @property
    def history(self) -> Table:
        """History of the first variant or probe; `histories` has all."""
        histories = self.histories
        if not histories:
            raise KeyError("no history: a run of one load step, or without probes")
        return next(iter(histories.values()))

    @cached_property
    def fields(self) -> Fields:
        """Fields by variant or study, as xarray Datasets: ``result.fields["dx=1mm"]``, or ``result.fields.first``."""
        return Fields.find(self.output)

    def mesh(self, variant: str | None = None, step: int = -1) -> pyvista.DataSet:
        """Returns a step as a PyVista mesh: particles at their deformed positions, or the existing elements of a part."""
        return self.fields.mesh(variant, step)

    def plot(self, field: str | None = None, variant: str | None = None, step: int = -1) -> matplotlib.figure.Figure:
        """Plots the body, coloured by a field, beside its history."""
        from ._plot import plot

        return plot(self, field, variant, step)

    def view(self) -> Page:
        """Creates an HTML page with the body, coloured by its fields, and its curves. A notebook shows it."""
        if self.output is None:
            raise ValueError("view: this result has no folder; use the result of a run")
        return Page(_polymech.view(str(self.output)))

    def __getstate__(self) -> dict[str, Any]:
        return {"report": self.report, "output": None, "tables": self.tables, "fields": self.fields.loaded()}

    def __repr__(self) -> str:
        place = f"results in {self.output}" if self.output else "without a folder"
        return f"{self.report!r}\n{place}"
