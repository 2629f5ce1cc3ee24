"""Types, docstrings, notebooks, and code of the guide."""

import doctest
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import polymech

NOTEBOOKS = sorted((Path(__file__).resolve().parents[1] / "notebooks").glob("*.ipynb"))


def test_types(root, tmp_path):
    pytest.importorskip("mypy")
    run = subprocess.run(
        [sys.executable, "-m", "mypy", "--config-file", root / "python/pyproject.toml", "--cache-dir", tmp_path, root / "python/package/polymech"],
        capture_output=True, text=True, cwd=root / "python",
    )
    assert run.returncode == 0, run.stdout + run.stderr


@pytest.mark.parametrize("name", ["crystfem", "peri", "polycore", "_laws", "_network", "_surrogate", "_result"])
def test_docstrings(name):
    module = __import__(f"polymech.{name}", fromlist=["x"])
    assert doctest.testmod(module).failed == 0


def test_everything_is_documented():
    for name in polymech.__all__:
        thing = getattr(polymech, name)
        assert name == "__version__" or thing.__doc__, name
        for attribute, value in vars(thing).items() if isinstance(thing, type) else []:
            assert attribute.startswith("_") or not callable(value) or value.__doc__, f"{name}.{attribute}"


def test_the_stub_names_what_there_is(root):
    stub = (root / "python/package/polymech/_polymech.pyi").read_text()
    named = set(re.findall(r"^(?:def|class) (\w+)", stub, re.M))
    assert named == {name for name in dir(polymech._polymech) if not name.startswith("_")}


def blocks(file):
    """Python blocks of a page of the guide."""
    return re.findall(r"^```python\n(.*?)^```", file.read_text(encoding="utf-8"), re.M | re.S)


@pytest.mark.parametrize("page", ["docs/guide/src/how-to/python.md", "python/README.md"])
def test_pages(root, page, tmp_path, monkeypatch):
    pytest.importorskip("matplotlib").use("Agg")
    pytest.importorskip("xarray")
    pytest.importorskip("pandas")
    (tmp_path / "cases").symlink_to(root / "cases")
    monkeypatch.chdir(tmp_path)
    names = {"__name__": "page"}
    found = blocks(root / page)
    assert found
    for block in found:
        if "pyvista" in block or ".mesh(" in block:
            try:
                import pyvista  # noqa: F401
            except ImportError:
                continue
        if "polycore.run" in block and not (os.environ.get("POLYMECH_PROGRAMS") or shutil.which("polycore")):
            continue
        exec(compile(block, page, "exec"), names)
    assert (tmp_path / "torn.png").is_file()


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks(notebook, tmp_path, monkeypatch):
    """In an empty folder: no notebook needs the files of this repository."""
    matplotlib = pytest.importorskip("matplotlib")
    pytest.importorskip("xarray")
    matplotlib.use("Agg")
    monkeypatch.chdir(tmp_path)
    names = {"__name__": "notebook"}
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    for number, cell in enumerate(cells):
        source = "".join(cell["source"])
        if cell["cell_type"] == "code":
            exec(compile(source, f"{notebook.name}, cell {number}", "exec"), names)
    figures = matplotlib.pyplot.get_fignums()
    matplotlib.pyplot.close("all")
    assert figures, "a notebook shows a picture"


def test_threads_do_not_change_bits():
    code = "import numpy as np, polymech; c=np.tile([1.2,.9,1,.1,0,0],(3000,1)); print(polymech.Law('gent',3e5,80.).predict(c).stress.tobytes().hex()[:96])"
    texts = {
        subprocess.run([sys.executable, "-c", code], env={**os.environ, "RAYON_NUM_THREADS": n}, capture_output=True, text=True, check=True).stdout
        for n in "12"
    }
    assert len(texts) == 1
