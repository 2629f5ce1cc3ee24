"""Fixtures of the tests."""

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

SHEET = {
    "body": {
        "space": "plane-stress",
        "thickness": "1 mm",
        "spacing": "2 mm",
        "shapes": [
            {"add": "box", "min": ["0 mm", "0 mm"], "max": ["60 mm", "40 mm"]},
            {"cut": "box", "min": ["0 mm", "16 mm"], "max": ["20 mm", "24 mm"]},
        ],
    },
    "material": {"youngs_modulus": "1 MPa", "law": "chain-offset", "links": 720, "dissociation": 1200, "critical": {"stretch": 1.6}},
    "boundary": [
        {"side": "y-", "layers": 3, "displacement": ["0 mm", "0 mm"]},
        {"side": "y+", "layers": 3, "displacement": ["0 mm", "14 mm"]},
    ],
    "solver": {"steps": 14},
    "output": {"pictures": False, "every": 5},
}


@pytest.fixture
def sheet():
    """A sheet with a slot that tears, as a scene."""
    return SHEET


@pytest.fixture
def root():
    """Root of the repository."""
    return ROOT


@pytest.fixture
def programs():
    """Folder of the command lines, if one is given."""
    folder = os.environ.get("POLYMECH_PROGRAMS")
    if not folder:
        pytest.skip("needs the command lines (POLYMECH_PROGRAMS)")
    return Path(folder)
