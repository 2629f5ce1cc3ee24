"""Heat and crystallization from Python."""

import numpy as np
import pytest

from polymech import SceneError, crystfem

BAR = {
    "mesh": {"bar": {"size": ["6 mm", "3 mm"], "layers": 3, "layer_height": "0.5 mm", "elements_per_layer": 1, "element_size": "1 mm"}},
    "materials": {
        "pa12": {
            "law": "semicrystalline",
            "density": "1010 kg/m^3",
            "conductivity": "0.25 W/(m K)",
            "specific_heat": "2200 J/(kg K)",
            "kinetics": "table-4.1-column-1",
            "melting": "pa12",
            "crystallinity": 0.25,
            "latent_heat": "209 J/g",
        }
    },
}


def rate(kelvin):
    """K(T) of Eqs (4.6) and (4.7) with Table 4.1, in numpy."""
    k0, kg, u, t0, frozen, n, r = 37_869.0, 136_235.0, 6270.0, 466.35, 294.15, 2.678, 8.314
    correction = 2 * kelvin / (kelvin + t0)
    exponent = -u / (r * (kelvin - frozen)) - kg / (kelvin * (t0 - kelvin) * correction)
    return np.where((kelvin < t0) & (kelvin > frozen), np.log(2) ** (1 / n) * k0 * np.exp(exponent), 0.0)


def alpha(time, kelvin):
    """α = 1 − exp(−(∫K dt)ⁿ) by the trapezoidal rule on a fine grid."""
    fine = np.linspace(time[0], time[-1], 200_001)
    k = rate(np.interp(fine, time, kelvin))
    z = np.concatenate([[0], np.cumsum(0.5 * (k[1:] + k[:-1]) * np.diff(fine))])
    return lambda at: 1 - np.exp(-(np.interp(at, fine, z) ** 2.678))


def test_a_point_that_cools():
    time, kelvin = [0.0, 4000.0], [463.15, 396.5]
    curve = crystfem.point(time, kelvin, degree=1e-3)
    exact = alpha(time, kelvin)(curve["time"])
    assert np.abs(curve["alpha"] - exact).max() < 1e-4 and curve["alpha"][-1] > 0.999
    assert np.allclose(curve["crystallinity"], 0.25 * curve["alpha"]) and curve.units["temperature"] == "K"
    assert np.allclose(np.interp(curve["time"], time, kelvin), curve["temperature"])


def test_properties_that_are_functions():
    calls = []

    def heat(kelvin):
        calls.append(kelvin.shape)
        return 1500 + 5 * (kelvin - 273.15)

    material = crystfem.Material(specific_heat=heat, latent_heat=None)
    curve = crystfem.point([0, 100], [300.0, 350.0], material)
    change = curve["energy"][-1] - curve["energy"][0]
    assert len(calls) == 1 and np.isclose(change, 1500 * 50 + 2.5 * (76.85**2 - 26.85**2), rtol=1e-6)
    with pytest.raises(ValueError, match="kinetics: found a"):
        crystfem.point([0, 1], [300, 300], crystfem.Material(kinetics={"a": 1.0}))
    with pytest.raises(ValueError, match="time of a history"):
        crystfem.point([1, 0], [300, 300])


def test_constants_are_found_again():
    runs = []
    for per_minute in (2.0, 5.0, 10.0):
        duration = 60 * 75 / per_minute
        history = ([0.0, duration], [463.15, 388.15])
        time = np.linspace(0, duration, 300)
        kelvin = np.interp(time, *history)
        runs.append((time, kelvin, alpha(*history)(time)))
    fit = crystfem.fit(runs)
    for name, value in [("growth_rate", 37_869), ("nucleation", 136_235), ("avrami_exponent", 2.678)]:
        assert abs(fit.parameters[name] / value - 1) < 1e-3, name
        low, high = fit.intervals[name]
        assert low <= fit.parameters[name] <= high
    assert fit.rms < 1e-5 and fit.model.shape == (900,) and fit.parameters["nucleation"].unit == "K^2" or "K" in fit.parameters["nucleation"].unit
    again = crystfem.point(runs[0][0], runs[0][1], fit.material)
    assert np.isclose(again["alpha"][-1], runs[0][2][-1], atol=1e-3)
    with pytest.raises(ValueError, match="alpha"):
        crystfem.fit([([0, 1], [400, 400], [0.5, 3.0])])


def printed(**more):
    scene = {
        **BAR,
        "region": [{"elements": "bar", "material": "pa12", "temperature": "220 degC"}],
        "print": {"layer_time": "10 s", "temperature": "220 degC"},
        "boundary": [{"surface": "bottom", "temperature": "80 degC"}],
        "time": {"end": "40 s", "tolerance": "0.5 K"},
        "output": {"every": "10 s", "pictures": False},
        "probe": [{"name": "first", "at": ["0 mm", "0 mm", "0.25 mm"]}],
    }
    return {**scene, **more}


@pytest.fixture(scope="module")
def bar():
    seen = []
    result = crystfem.run(printed(), on_step=lambda step: seen.append(step.values["time"]))
    return result, seen


def test_a_printed_bar(bar):
    result, seen = bar
    history = result.history
    assert list(result.histories) == ["first"] and history.units["time"] == "s"
    assert seen == sorted(seen) and np.isclose(seen[-1], 40) and len(seen) >= len(history["time"]) - 1
    series = result.fields.pick()
    assert np.allclose(series.times, [0, 10, 20, 30, 40])
    temperature = series.read("point", "temperature_degC")
    assert np.isnan(temperature[0]).any() and not np.isnan(temperature[-1]).any() and np.nanmax(temperature) <= 220 + 1e-9


def test_its_fields(bar):
    pytest.importorskip("xarray")
    fields = bar[0].fields.first
    assert fields.temperature_degC.attrs["units"] == "°C" and fields.exists.dims == ("step", "element")
    assert fields.position.dims == ("node", "i")


def test_its_picture_and_mesh(bar):
    pytest.importorskip("matplotlib").use("Agg")
    assert len(bar[0].plot("alpha").axes) == 3
    pytest.importorskip("pyvista")
    assert bar[0].mesh(step=0).n_cells < bar[0].mesh().n_cells


def test_tables_in_scenes():
    heat = crystfem.table(lambda celsius: 2000 + 2 * celsius, 20, 240, "J/(kg K)", step=20)
    scene = printed(materials={"pa12": {**BAR["materials"]["pa12"], "specific_heat": heat}})
    assert crystfem.check(scene)


def test_a_sweep_of_layer_times(tmp_path):
    table = crystfem.sweep(printed(), {"print.layer_time": ["5 s", "10 s"]}, tmp_path / "sweep", output__fields=False)
    assert table.rows == 2 and table["print.layer_time"].tolist() == ["5 s", "10 s"]


def test_scenes_of_another_program():
    with pytest.raises(SceneError, match="peri"):
        crystfem.run({"version": 1, "program": "peri", **BAR})
