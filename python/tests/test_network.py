"""Networks from their chemistry, against closed forms."""

import math

import pytest

import polymech


def test_a_perfect_network():
    found = polymech.network(4, 10.0, conversion=1.0, entanglement_modulus=0.0)
    phantom = 970 / 10 / 2 * 8.31446261815324 * 298.15
    assert math.isclose(found.phantom, phantom, rel_tol=1e-12) and found.entangled == 0
    assert found.sol == 0 and math.isclose(found.segments, 10 / 0.381, rel_tol=1e-12)
    assert math.isclose(found.locking_stretch, math.sqrt(found.segments), rel_tol=1e-12)
    assert math.isclose(found.fracture_energy[1] / found.fracture_energy[0], 350 / 60, rel_tol=1e-12)
    assert math.isclose(found.modulus, found.stiffening * found.phantom, rel_tol=1e-12)


def test_sol_and_loops():
    made = polymech.network(4, 10.0, conversion=0.85)
    tree = polymech.network(4, 10.0, sol_fraction=made.sol, loop_factor=0)
    assert math.isclose(tree.conversion, 0.85, rel_tol=1e-9) and tree.least_conversion == tree.conversion
    loops = polymech.network(4, 10.0, sol_fraction=made.sol)
    assert loops.least_conversion < loops.conversion < 1 and loops.modulus > tree.modulus
    extracted = polymech.network(4, 10.0, conversion=0.85, extracted=True)
    assert math.isclose(extracted.entangled / made.entangled, (1 - made.sol) ** -2, rel_tol=1e-12)


def test_mixtures_and_chains_with_one_group():
    mean = polymech.network(3.5, 10.0, conversion=0.9)
    shares = polymech.network({3: 3 / 7, 4: 4 / 7}, 10.0, conversion=0.9)
    assert math.isclose(mean.modulus, shares.modulus, rel_tol=1e-12)
    assert polymech.network(4, 10.0, conversion=0.9, monofunctional=(0.2, 5.0)).modulus < mean.modulus


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"conversion": 0.5}, r"no gel: \(f - 1\) p_A p_B = 0.7500"),
        ({"conversion": 0.9, "ratio": 1.2}, "p_B = r p_A = 1.0800 is above 1"),
        ({}, "exactly one"),
        ({"conversion": 0.9, "sol_fraction": 0.1}, "exactly one"),
        ({"sol_fraction": 0.01, "ratio": 0.8}, "stays soluble"),
        ({"conversion": 0.9, "polymer": "PDMZ"}, "unknown polymer"),
        ({"conversion": 0.9, "polymer": "PEO"}, "density: unknown for PEO"),
    ],
)
def test_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        polymech.network(4, 10.0, **arguments)


def test_vulcanized():
    made = polymech.vulcanized("most-probable", 100.0, units=2.0)
    again = polymech.vulcanized("most-probable", 100.0, sol_fraction=made.sol)
    assert math.isclose(made.sol + math.sqrt(made.sol), 1 / 2, rel_tol=1e-12)  # Charlesby and Pinner
    assert math.isclose(again.modulus, made.modulus, rel_tol=1e-9) and again.conversion == pytest.approx(2.0)
    equal = polymech.vulcanized("one-length", 100.0, units=2.0)
    assert math.isclose(equal.sol, math.exp(-2 * (1 - equal.sol)), rel_tol=1e-12)
    for arguments, message in [
        ({"chains": "broad", "units": 2.0}, "most-probable, one-length"),
        ({"chains": "one-length", "units": 0.9}, "no gel"),
        ({"chains": "one-length"}, "exactly one"),
    ]:
        with pytest.raises(ValueError, match=message):
            polymech.vulcanized(mass=100.0, **arguments)


def test_swelling():
    solvent = polymech.Solvent(106e-6, 0.45)
    fraction = solvent.polymer_fraction(0.2e6)
    stress = 106e-6 * 0.2e6 / (8.31446261815324 * 298.15) * fraction ** (1 / 3)
    assert abs(math.log(1 - fraction) + fraction + 0.45 * fraction**2 + stress) < 1e-15
    assert math.isclose(solvent.modulus(fraction), 0.2e6, rel_tol=1e-9)
    with pytest.raises(ValueError, match="volume fraction"):
        solvent.modulus(1.5)
