"""Peridynamics of elastomers: scenes, and models in a few lines.

>>> from polymech import peri
>>> result = peri.run("cases/ch2/dent/case.toml", quick=True)   # doctest: +SKIP
>>> body = peri.Body.rectangle((0, 0), (60e-3, 40e-3), spacing=2e-3)
>>> model = peri.Model(body, "chain-offset", youngs_modulus=1e6)
>>> model = model.clamp(lambda x, y: y < 6e-3).displace(lambda x, y: y > 34e-3, (0, 4e-3))
>>> model.build().solve().load   # doctest: +SKIP
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from typing import Any

from . import _polymech, _run
from ._model import Body, BondLaw, Model, Simulation
from ._result import Result, Table
from ._run import OnStep, Progress
from ._scene import Scene

__all__ = ["Body", "BondLaw", "Model", "Simulation", "check", "resume", "run", "schema", "sweep"]

_PROGRAM = "peri"


def run(
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

    `scene` is the path of a TOML file, its text, or a dictionary; `overrides` replace keys of it, with ``__`` for a dot:
    ``material__youngs_modulus="2 MPa"``, or ``**{"a.b[0].c": 1}``.

    `output` is the folder of the results; without it they lie in a temporary folder that goes with the `Result`. `threads` may be
    any number: results are the same to the bit. `progress=True` shows a bar, a function is called as ``progress(part, line)``.
    `on_step` sees every finished step (`Step`: values, fields); where it returns `False` the run stops with `Interrupted`.
    Ctrl-C raises `KeyboardInterrupt`. In both cases the checkpoint stays, and `resume` continues to the same bits.

    Raises `SceneError` (a `ValueError`) for a fault of the scene, `RunError` for a run that fails.
    """
    options = dict(
        quick=quick, threads=threads, checkpoint_every=checkpoint_every, inputs=inputs, progress=progress, on_step=on_step
    )
    return _run.run(_PROGRAM, scene, output, options, overrides)


def resume(
    output: str | os.PathLike[str],
    *,
    threads: int | None = None,
    checkpoint_every: float = 30.0,
    progress: Progress = False,
    on_step: OnStep | None = None,
) -> Result:
    """Continues the run that was stopped or killed in a folder; of a finished one its results."""
    options = dict(threads=threads, checkpoint_every=checkpoint_every, progress=progress, on_step=on_step)
    return _run.resume(_PROGRAM, output, options)


def check(scene: Scene, *, quick: bool = False, **overrides: Any) -> list[str]:
    """What a scene builds and leaves out, in lines; raises `SceneError` for a fault in it."""
    return _run.check(_PROGRAM, scene, quick, overrides)


def sweep(
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
    """Runs a scene for every combination of values, in parallel: ``{"material.fracture_energy": ["50 J/m^2", "100 J/m^2"]}``.

    Gives a row for each run: its settings, and values of its report, of which `columns` names more (``*`` stands for any text).
    The same call into the same folder continues and extends a sweep.
    """
    options = dict(quick=quick, threads=threads, progress=progress)
    return _run.sweep(_PROGRAM, scene, vary, columns, output, options, overrides)


def schema() -> dict[str, Any]:
    """The JSON Schema of scenes."""
    found: dict[str, Any] = json.loads(_polymech.schema(_PROGRAM))
    return found
