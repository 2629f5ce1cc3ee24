"""Runs of scenes, for all programs."""

from __future__ import annotations

import json
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from . import _polymech
from ._result import Result, Table, Value
from ._scene import Schema, Scene, literal, read, schema


@dataclass(frozen=True)
class Step:
    """A finished step of a run, the argument of `on_step`."""

    values: dict[str, Value]
    """Numbers with units: `load`, `displacement`, `broken_bonds`, `time`, …"""
    fields: dict[str, NDArray[np.float64]]
    """Arrays at particles or nodes, (N, 3) or (N,): `position` and `displacement` in m; `temperature_degC`, `alpha`, …"""
    units: dict[str, str]
    """Unit of each value and field."""


OnStep: TypeAlias = Callable[[Step], Any]
Progress: TypeAlias = "bool | Callable[[float, str], Any]"


def stepper(on_step: OnStep | None) -> Callable[..., Any] | None:
    """Wraps a Python function for the module."""
    if on_step is None:
        return None

    def call(values: dict[str, float], units: dict[str, str], fields: dict[str, NDArray[np.float64]]) -> Any:
        return on_step(Step({name: Value(x, units[name]) for name, x in values.items()}, fields, units))

    return call


def _bar(part: float, line: str) -> None:
    """Draws a progress bar in one line, on terminals and in notebooks."""
    done = round(30 * min(max(part, 0.0), 1.0))
    sys.stderr.write(f"\r[{'█' * done}{'·' * (30 - done)}] {100 * part:3.0f} %  {line[:80]:<80}")
    sys.stderr.flush()


def _how(
    output: str | os.PathLike[str] | None,
    quick: bool = False,
    threads: int | None = None,
    checkpoint_every: float = 30.0,
    inputs: Mapping[str, str | os.PathLike[str]] | None = None,
    progress: Progress = False,
    on_step: OnStep | None = None,
) -> tuple[dict[str, Any], bool]:
    """Returns the options for the module, and whether the folder is temporary."""
    ours = output is None
    folder = tempfile.mkdtemp(prefix="polymech-") if output is None else os.fspath(output)
    how = {
        "output": folder,
        "quick": quick,
        "threads": threads,
        "checkpoint_every": float(checkpoint_every),
        "inputs": {name: os.fspath(place) for name, place in (inputs or {}).items()},
        "progress": (_bar if progress is True else progress) or None,
        "on_step": stepper(on_step),
    }
    return how, ours


def _done(how: dict[str, Any], ours: bool, told: tuple[str, str]) -> Result:
    if how["progress"] is _bar:
        sys.stderr.write("\r" + " " * 120 + "\r")
    return Result(json.loads(told[0]), told[1], Path(how["output"]), temporary=ours)


def _begin(how: dict[str, Any], ours: bool, call: Callable[[], Any]) -> Any:
    """Calls a run; if it is stopped, its folder is kept and named in the exception."""
    try:
        return call()
    except BaseException as error:
        folder = Path(how["output"])
        if (folder / "checkpoint.bin").is_file() or (folder / "sweep.csv").is_file() or not ours:
            if isinstance(error, KeyboardInterrupt):
                error.args = error.args or (f"stopped; continue with resume({str(folder)!r})",)
                error.output = str(folder)  # type: ignore[attr-defined]
        else:
            shutil.rmtree(folder, ignore_errors=True)
        raise


class Program:
    """Commands of a program, for `peri` and `crystfem`."""

    def __init__(self, name: str) -> None:
        self._name = name

    @property
    def _schema(self) -> Schema:
        return schema(self._name)

    def _read(self, scene: Scene, overrides: Mapping[str, Any], folder: str) -> tuple[str, str]:
        return read(scene, self._name, overrides, self._schema, Path(folder))

    def run(
        self,
        scene: Scene,
        output: str | os.PathLike[str] | None = None,
        *,
        quick: bool = False,
        threads: int | None = None,
        checkpoint_every: float = 30.0,
        inputs: Mapping[str, str | os.PathLike[str]] | None = None,
        progress: Progress = False,
        on_step: OnStep | None = None,
        **overrides: Any,
    ) -> Result:
        """Runs a scene to its end.

        `scene` is the path of a TOML file, its text, or a dictionary. In a dictionary numbers without a unit
        are SI (m, Pa, K, rad, …), keys that are `None` are left out, and a table, `file`, may be a dictionary
        of columns by their headings, such as ``{"time [s]": t, "pull": pull}``. `overrides` replace keys,
        with ``__`` for a dot: ``material__youngs_modulus=2e6``, or ``**{"a.b[0].c": 1}``.

        `output` is the folder of the results; the default is a temporary folder that is deleted with the
        `Result`. `threads` may be any number: results have the same bits. `progress=True` shows a bar, a
        function is called as ``progress(part, line)``. `on_step` is called with every finished step (`Step`:
        values, fields); if it returns `False` the run stops with `Interrupted`. Ctrl-C raises
        `KeyboardInterrupt`. In both cases the checkpoint is kept, and `resume` continues to the same bits.

        Raises `SceneError` (a `ValueError`) for an invalid scene, `RunError` for a failed run.
        """
        how, ours = _how(output, quick, threads, checkpoint_every, inputs, progress, on_step)

        def call() -> tuple[str, str]:
            return _polymech.run(self._name, *self._read(scene, overrides, how["output"]), how)

        return _done(how, ours, _begin(how, ours, call))

    def resume(
        self,
        output: str | os.PathLike[str],
        *,
        threads: int | None = None,
        checkpoint_every: float = 30.0,
        progress: Progress = False,
        on_step: OnStep | None = None,
    ) -> Result:
        """Continues a run that was stopped or killed in a folder; a finished run returns its results."""
        how, _ = _how(output, threads=threads, checkpoint_every=checkpoint_every, progress=progress, on_step=on_step)
        return _done(how, False, _begin(how, False, lambda: _polymech.resume(self._name, how)))

    def check(self, scene: Scene, *, quick: bool = False, **overrides: Any) -> list[str]:
        """Describes in lines what a scene builds and what it omits; raises `SceneError` if it is invalid."""
        how, _ = _how(Path("out") / "check", quick=quick)
        with tempfile.TemporaryDirectory(prefix="polymech-") as folder:
            return _polymech.check(self._name, *self._read(scene, overrides, folder), how)

    def sweep(
        self,
        scene: Scene,
        vary: Mapping[str, Sequence[Any]],
        output: str | os.PathLike[str] | None = None,
        *,
        columns: Sequence[str] = (),
        quick: bool = False,
        threads: int | None = None,
        progress: Progress = False,
        **overrides: Any,
    ) -> Table:
        """Runs a scene for every combination of values, in parallel: ``{"print.layer_time": ["10 s", "20 s"]}``.

        Returns a row for each run with its settings and values of its report; `columns` adds values (``*``
        matches any text). The same call with the same folder continues and extends a sweep.
        """
        how, ours = _how(output, quick=quick, threads=threads, progress=progress)
        # overrides are keys with one value
        each = {**{name.replace("__", "."): [value] for name, value in overrides.items()}, **vary}
        values = []
        for name, column in each.items():
            known = self._schema.at(name)
            si = [self._schema.si(value, known, None) for value in column]
            values.append((name, [value if isinstance(value, str) else literal(value) for value in si]))

        def call() -> tuple[str, str]:
            text, path = self._read(scene, {}, how["output"])
            return _polymech.sweep(self._name, text, path, values, list(columns), how)

        told = _begin(how, ours, call)
        result = _done(how, ours, told)
        table = Table.read(Path(how["output"]) / "sweep.csv")
        table.result = result
        return table

    def schema(self) -> dict[str, Any]:
        """Returns the JSON Schema of scenes."""
        found: dict[str, Any] = json.loads(_polymech.schema(self._name))
        return found
