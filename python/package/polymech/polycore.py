"""Fits of laws to tests as scenes: ranking, weights, volumetric tests, foams, laws with time, cards.

>>> from polymech import polycore
>>> result = polycore.run("cases/external/rubber-ranking/case.toml", quick=True)   # doctest: +SKIP

They need the program `polycore` (``cargo install --path crates/polycore-cli``) on the PATH or in the folder
``POLYMECH_PROGRAMS``.
"""

from __future__ import annotations

import contextlib
import functools
import json
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from ._polymech import RunError, SceneError
from ._result import Result
from ._run import _begin, _done, _how
from ._scene import Scene, Schema, read

__all__ = ["check", "run", "schema"]


def _call(*arguments: str | os.PathLike[str]) -> subprocess.CompletedProcess[str]:
    """Runs the program; raises `SceneError` or `RunError` if it fails."""
    folder = os.environ.get("POLYMECH_PROGRAMS")
    program = shutil.which("polycore", path=folder) or shutil.which("polycore")
    if program is None:
        raise RunError("polycore: no such program on the PATH; `cargo install --path crates/polycore-cli`")
    done = subprocess.run([program, *arguments], capture_output=True, text=True, encoding="utf-8")
    if done.returncode == 2:
        raise SceneError(done.stderr.strip())
    return done


@functools.cache
def schema() -> dict[str, Any]:
    """Returns the JSON Schema of scenes."""
    found: dict[str, Any] = json.loads(_call("schema").stdout)
    return found


@contextlib.contextmanager
def _file(scene: Scene, overrides: Mapping[str, Any], folder: Path) -> Iterator[str]:
    """Path of a scene: its own, or that of a file beside it that is then removed."""
    text, path = read(scene, "polycore", overrides, Schema(schema()), folder)
    if not overrides and Path(path).is_file() and not isinstance(scene, Mapping):
        yield path
        return
    handle, name = tempfile.mkstemp(".toml", "polymech-", Path(path).resolve().parent)
    with os.fdopen(handle, "w", encoding="utf-8") as file:
        file.write(text)
    try:
        yield name
    finally:
        os.remove(name)


def run(
    scene: Scene,
    output: str | os.PathLike[str] | None = None,
    *,
    quick: bool = False,
    threads: int | None = None,
    inputs: Mapping[str, str | os.PathLike[str]] | None = None,
    **overrides: Any,
) -> Result:
    """Runs a scene of fits; arguments are those of `peri.run`.

    Tests may be arrays, columns by their headings: ``polycore.run({"fit": {"data": [{"name": "bar", "rank":
    True, "file": {"mode": modes, "stretch": stretch, "nominal [Pa]": stress}}]}})``. The folder `output` has
    the cards and blocks of materials, `tables` their numbers; `polymech.Law.read` reads the cards. With
    ``quick=True`` there are no pictures.
    """
    how, ours = _how(output, quick, threads, inputs=inputs)
    folder = Path(how["output"])
    words = ["--quick"] * quick + ([] if threads is None else ["--threads", str(threads)])
    words += [word for name, place in how["inputs"].items() for word in ("--input", f"{name}={place}")]

    def call() -> tuple[str, str]:
        with _file(scene, overrides, folder) as path:
            (folder / "report.json").unlink(missing_ok=True)
            done = _call("run", path, "--output", folder, *words)
        report = folder / "report.json"
        if not report.is_file():
            raise RunError(done.stderr.strip())
        return report.read_text(encoding="utf-8"), done.stdout

    return _done(how, ours, _begin(how, ours, call))


def check(scene: Scene, **overrides: Any) -> list[str]:
    """Describes in lines what a scene fits and how its tables are understood; raises `SceneError`."""
    with tempfile.TemporaryDirectory() as folder, _file(scene, overrides, Path(folder)) as path:
        return _call("check", path).stdout.splitlines()
