"""Peridynamics of elastomers: scenes, and models in a few lines.

>>> from polymech import peri
>>> result = peri.run("cases/ch2/dent/case.toml", quick=True)   # doctest: +SKIP
>>> body = peri.Body.rectangle((0, 0), (60e-3, 40e-3), spacing=2e-3)
>>> model = peri.Model(body, "chain-offset", youngs_modulus=1e6)
>>> model = model.clamp(lambda x, y: y < 6e-3).displace(lambda x, y: y > 34e-3, (0, 4e-3))
>>> model.build().solve().load   # doctest: +SKIP
"""

from __future__ import annotations

from ._body import Body
from ._model import Model
from ._run import Program
from ._simulation import BondLaw, Simulation

__all__ = ["Body", "BondLaw", "Model", "Simulation", "check", "resume", "run", "schema", "sweep"]

_program = Program("peri")
run, resume, check, sweep, schema = _program.run, _program.resume, _program.check, _program.sweep, _program.schema
