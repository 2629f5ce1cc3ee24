"""Fits as scenes, decks and cards."""

import numpy as np
import pytest

from polymech import Law, SceneError, polycore


def test_laws_are_python():
    law = Law("ogden-2", 0.1 + 0.2, 2.0, 1e5, -1.5, bulk_modulus=4e6)
    again = eval(repr(law))
    assert repr(again) == repr(law) and again.parameters == law.parameters and again.bulk_modulus == 4e6
    lame = Law("neo-hookean", shear_modulus=0.3e6, volumetric=("ciarlet", 3.8e6))
    assert lame.bulk_modulus == pytest.approx(4e6) and "volumetric=('ciarlet', 3800000.0)" in repr(lame)
    # K = dp/dJ at rest
    j = 1 + 1e-6
    pressure = np.trace(Law("gent", 3e5, 80.0, bulk_modulus=5e6).cauchy(np.eye(3) * j ** (1 / 3))) / 3
    assert pressure / 1e-6 == pytest.approx(5e6, rel=1e-4)
    assert Law("gent", 3e5, 80.0).bulk_modulus is None
    assert Law("gent", 3e5, 80.0, volumetric=("ciarlet", 0.0)).bulk_modulus == pytest.approx(207.5e3)
    mu = {"mu_1": "0.30000000000000004 Pa", "mu_2": "100000.0 Pa"}
    assert law.block()["parameters"] == {**mu, "alpha_1": 2.0, "alpha_2": -1.5}
    with pytest.raises(ValueError, match="found 200000.0 Pa; allowed: at least 207500 Pa"):
        Law("gent", 3e5, 80.0, bulk_modulus=2e5)
    with pytest.raises(ValueError, match="bulk_modulus conflicts with volumetric"):
        Law("gent", 3e5, 80.0, bulk_modulus=5e6, volumetric=("quadratic", 1e6))


ENDINGS = {"abaqus": "inp", "ansys": "mac", "ls-dyna": "k", "febio": "feb"}


@pytest.mark.parametrize("program", ENDINGS)
def test_cards_return(program, tmp_path):
    ending = ENDINGS[program]
    law = Law("yeoh", 0.2e6, 2e3, 50.0, bulk_modulus=40e6)
    if program == "ls-dyna":
        law = Law("ogden-1", 0.4e6, 2.2, bulk_modulus=40e6)
    for stress in (1e6, 1.0):
        (tmp_path / f"deck.{ending}").write_text(law.card(program, "BAR", stress))
        (found,) = Law.read(tmp_path / f"deck.{ending}", stress).values()
        assert found.model == law.model
        assert found.parameters == pytest.approx(law.parameters, rel=1e-9)
        assert found.bulk_modulus == pytest.approx(40e6, rel=1e-6)
    assert "5.000000000e-2" in Law("neo-hookean", 0.4e6, bulk_modulus=40e6).card()
    with pytest.raises(ValueError, match="program: found .ansis.; allowed: abaqus"):
        law.card("ansis")
    with pytest.raises(ValueError, match="has no law"):
        law.card("moose")


def test_a_deck_of_rubbers(root, tmp_path):
    laws = Law.read(root / "crates/umat/examples/rubbers.inp")
    assert laws and all(law.bulk_modulus > law.shear_modulus > 1e5 for law in laws.values())
    rubber = "*MATERIAL, NAME=SEAL\n*HYPERELASTIC, NEO HOOKE\n0.2, 0.05\n*DENSITY\n1.1e-9\n"
    (tmp_path / "two.inp").write_text(rubber + "*MATERIAL, NAME=STEEL\n*ELASTIC\n210000., 0.3\n")
    with pytest.warns(UserWarning) as told:
        (seal,) = Law.read(tmp_path / "two.inp").values()
    assert seal.shear_modulus == pytest.approx(0.4e6) and seal.bulk_modulus == 40e6
    assert any("SEAL: " in str(one.message) and "DENSITY" in str(one.message) for one in told)
    (tmp_path / "none.inp").write_text("*MATERIAL, NAME=STEEL\n*ELASTIC\n210000., 0.3\n")
    with pytest.raises(ValueError, match="STEEL|no "):
        Law.read(tmp_path / "none.inp")
    with pytest.raises(OSError, match="nowhere"):
        Law.read(tmp_path / "nowhere.inp")


def test_fits_of_arrays(programs, tmp_path):
    """A law that is known comes back, ranked first, in the report and by its card."""
    law, stretch = Law("yeoh", 0.2e6, 2e3, 50.0), np.linspace(1.2, 4, 9)
    stress = np.r_[law.uniaxial(stretch), law.equibiaxial(stretch)]
    modes = ["uniaxial"] * 9 + ["equibiaxial"] * 9
    table = {"mode": modes, "stretch": np.r_[stretch, stretch], "nominal [Pa]": stress}
    scene = {"fit": {"laws": ["yeoh", "neo-hookean"], "data": [{"name": "bar", "file": table, "rank": True}]}}
    fitted = polycore.run(scene, tmp_path / "fit", quick=True, **{"fit.data[0].deviation": "2 %"})
    assert fitted.report["bar.yeoh.C1"] == pytest.approx(0.2, rel=1e-6) and fitted.report.passed
    assert fitted.report["bar.yeoh.C1"].unit == "MPa"
    assert fitted.report["bar.yeoh.rank"] == 1 and fitted.tables["fits"].rows > 3
    back = Law.read(tmp_path / "fit/materials_mm.inp")["YEOH_BAR"]
    assert [back.parameters[name] for name in ("C1", "C2", "C3")] == pytest.approx([0.2e6, 2e3, 50.0], rel=1e-6)
    assert back.bulk_modulus == pytest.approx(100 * law.shear_modulus, rel=1e-6)
    assert any("18 states" in line for line in polycore.check(scene)) and "<html" in fitted.view().html
    with pytest.raises(SceneError, match="did you mean `fit`"):
        polycore.check({"fitt": {}})
    with pytest.raises(ValueError, match="file: found columns of"):
        polycore.check({"fit": {"data": [{"name": "bar", "file": {"stretch": [1, 2], "nominal [Pa]": [1]}}]}})


def test_foams_of_a_case(programs, root):
    found = polycore.run(root / "cases/measured/foams/case.toml", quick=True)
    assert found.report and found.output is not None and list(found.output.glob("*_foam.inp"))
