"""Scenes of `peri` from Python."""

import json
import os
import pickle
import signal
import subprocess
import threading
import time

import numpy as np
import pytest

from polymech import Interrupted, SceneError, peri

@pytest.fixture(scope="module")
def torn(tmp_path_factory):
    from conftest import SHEET

    return peri.run(SHEET, tmp_path_factory.mktemp("runs") / "torn")


def same(a, b):
    """The same bits in values and histories."""
    assert dict(a.report) == dict(b.report)
    for name, table in a.histories.items():
        for column in table:
            assert np.array_equal(table[column], b.histories[name][column], equal_nan=True), column


def test_values_have_units(torn):
    load = torn.report["peak_load"]
    assert load > 0 and load.unit == "N" and repr(load).endswith(" N")
    assert torn.report.passed and torn.report.work["particles"] > 400 and "peak_load" in repr(torn)
    with pytest.raises(KeyError, match="peak_load"):
        torn.report["peak_lod"]


def test_history(torn):
    history = torn.history
    assert history.rows == 14 and history.units["load"] == "N"
    assert np.isclose(history["displacement"][-1], 14e-3) or history["load"][-1] < 0.1 * history["load"].max()
    assert history["load"].max() == torn.report["peak_load"]
    assert "<td>" in history._repr_html_()
    pandas = pytest.importorskip("pandas")
    frame = history.to_pandas()
    assert isinstance(frame, pandas.DataFrame) and frame.attrs["units"]["load"] == "N"
    assert torn.report.to_pandas().loc["peak_load", "unit"] == "N"


def test_fields_are_read(torn):
    series = torn.fields.pick()
    u = series.read("point", "displacement", [-1])[0]
    x = series.read("position", "position", [-1])[0]
    assert u.shape == x.shape == (torn.report.work["particles"], 3)
    upper = x[:, 1] - u[:, 1] > 34e-3
    assert np.allclose(u[upper, 1], torn.history["displacement"][-1])
    damage = series.read("point", "damage")
    assert damage.shape == (len(series.times), len(x)) and damage.max() > 0.3


def test_xarray(torn):
    pytest.importorskip("xarray")
    fields = torn.fields.first
    assert fields.displacement.attrs["units"] == "m" and fields.displacement.dims == ("step", "particle", "i")
    assert torn.history.to_xarray()["load"].attrs["units"] == "N"
    with pytest.raises(KeyError, match="available"):
        torn.fields["nobody"]


def test_pictures(torn, tmp_path):
    pytest.importorskip("matplotlib").use("Agg")
    for field in (None, "displacement"):
        torn.plot(field).savefig(tmp_path / "torn.png")
        assert (tmp_path / "torn.png").stat().st_size > 10_000
    with pytest.raises(ValueError, match="field: found 'x'"):
        torn.plot("x")


def test_meshes(torn):
    pytest.importorskip("pyvista")
    mesh = torn.mesh()
    assert mesh.n_points == torn.report.work["particles"] and mesh.point_data["damage"].max() > 0.3


def test_results_are_pickled(torn):
    again = pickle.loads(pickle.dumps(torn))
    same(torn, again)
    assert again.output is None
    old, new = torn.fields.pick(), again.fields.pick()
    assert (new.read("point", "damage", [0, -1]) == old.read("point", "damage", [0, -1])).all()


def test_texts_paths_and_overrides(torn, sheet, tmp_path):
    from polymech._scene import dumps

    text = dumps({"version": 1, "program": "peri", **sheet})
    (tmp_path / "sheet.toml").write_text(text)
    stiff = {"material.youngs_modulus": "2 MPa", "output.fields": False}
    for scene in (text, tmp_path / "sheet.toml", str(tmp_path / "sheet.toml")):
        found = peri.run(scene, solver__steps=2, **stiff)
        assert found.history.rows == 2 and not found.fields
        folder = found.output
        assert folder.is_dir()
        del found
        assert not folder.exists()
    with pytest.raises(FileNotFoundError, match="no such scene"):
        peri.run("nowhere.toml")


def test_faults_have_a_caret(sheet):
    with pytest.raises(SceneError) as caught:
        peri.run({**sheet, "material": {**sheet["material"], "youngs_modulos": "1 MPa"}})
    text = str(caught.value)
    assert "did you mean `youngs_modulus`" in text and "youngs_modulos =" in text and "\x1b" not in text
    assert caught.value.key == "material.youngs_modulos" and caught.value.line > 1
    assert any(mark in text for mark in ("┬", "─", "^")) and isinstance(caught.value, ValueError)
    with pytest.raises(SceneError, match="material.links"):
        peri.run(sheet, material__links=-3)
    with pytest.raises(TypeError, match="allowed: numbers"):
        peri.run({"body": object()})
    assert any("particles" in line or "spacing" in line for line in peri.check(sheet))


def test_steps_are_seen(torn, sheet, tmp_path):
    seen = []
    again = peri.run(sheet, tmp_path / "seen", on_step=seen.append)
    same(torn, again)
    assert [step.values["load"] for step in seen] == list(torn.history["load"])
    assert seen[0].values["load"].unit == "N" and seen[0].units["displacement"] == "m"
    assert seen[-1].fields["displacement"].shape == (torn.report.work["particles"], 3)


def test_a_function_stops_and_resume_goes_on(torn, sheet, tmp_path):
    folder = tmp_path / "stopped"
    with pytest.raises(Interrupted, match="resume") as caught:
        peri.run(sheet, folder, on_step=lambda step: step.values["displacement"] < 5e-3)
    assert str(caught.value.output) == str(folder) and (folder / "checkpoint.bin").is_file()
    same(torn, peri.resume(folder, threads=1))
    same(torn, peri.resume(folder))
    assert not (folder / "checkpoint.bin").exists()


def test_errors_of_functions_are_raised(sheet, tmp_path):
    def wrong(step):
        return 1 / 0

    with pytest.raises(ZeroDivisionError):
        peri.run(sheet, tmp_path / "wrong", on_step=wrong)
    with pytest.raises(ZeroDivisionError):
        peri.run(sheet, tmp_path / "wrong", progress=lambda part, line: 1 / 0)


def test_control_c(sheet, tmp_path):
    # processes in the background of a shell ignore it
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        control_c(sheet, tmp_path)
    finally:
        signal.signal(signal.SIGINT, before)


def control_c(sheet, tmp_path):
    fine = {"body.spacing": "0.5 mm", "output.every": 100}
    asked = []

    def interrupt(step):
        asked.append(time.perf_counter())
        os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt) as caught:
        peri.run(sheet, tmp_path / "c", on_step=interrupt, **fine)
    print(f"stopped {time.perf_counter() - asked[0]:.2f} s after the signal")
    assert len(asked) == 1 and (tmp_path / "c" / "checkpoint.bin").is_file()
    assert caught.value.output == str(tmp_path / "c")
    done = []
    with pytest.raises(Interrupted):
        peri.resume(tmp_path / "c", on_step=lambda step: bool(done.append(step.values["factor"])))
    # it goes on after the step that was seen, and does not begin anew
    assert len(done) == 1 and done[0] > 1.5 / 14


def test_a_thread_is_stopped_by_its_function(sheet, tmp_path):
    caught = []

    def work():
        try:
            peri.run(sheet, tmp_path / "thread", on_step=lambda step: False)
        except Interrupted as error:
            caught.append(error)

    worker = threading.Thread(target=work)
    worker.start()
    worker.join()
    assert len(caught) == 1


def test_a_sweep(sheet, tmp_path):
    vary = {"material.youngs_modulus": ["1 MPa", "2 MPa"], "solver.steps": [2]}
    table = peri.sweep(sheet, vary, tmp_path / "sweep", columns=["stored_energy*"], output__fields=False)
    assert table.rows == 2 and table.result is not None and "youngs_modulus" in repr(table)
    energy = next(table[name] for name in table if name.startswith("stored_energy"))
    assert np.isclose(energy[1] / energy[0], 2, rtol=1e-3)


def test_the_command_line_has_the_same_bits(torn, sheet, programs, tmp_path):
    from polymech._scene import dumps

    (tmp_path / "sheet.toml").write_text(dumps({"version": 1, "program": "peri", **sheet}))
    begun = time.perf_counter()
    subprocess.run([programs / "peri", "run", tmp_path / "sheet.toml", "--output", tmp_path / "cli"], check=True, capture_output=True)
    theirs = time.perf_counter() - begun
    begun = time.perf_counter()
    peri.run(sheet, tmp_path / "ours")
    print(f"command line {theirs:.2f} s, Python {time.perf_counter() - begun:.2f} s")
    same(torn, peri.resume(tmp_path / "cli"))


def test_schema():
    assert '"youngs_modulus"' in json.dumps(peri.schema())
