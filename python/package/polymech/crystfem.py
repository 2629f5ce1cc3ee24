"""Heat and crystallization of parts printed layer by layer: scenes, the material alone, and fits of its constants.

>>> from polymech import crystfem
>>> result = crystfem.run("cases/ch4/printed-bar/case.toml")   # doctest: +SKIP
>>> minutes, kelvin = [0, 60 * 40], [473.15, 373.15]
>>> curve = crystfem.point(minutes, kelvin)
>>> float(round(curve["alpha"][-1], 3))
1.0
"""

from __future__ import annotations

from ._point import Fit, Material, fit, point, table
from ._run import Program

__all__ = ["Fit", "Material", "check", "fit", "point", "resume", "run", "schema", "sweep", "table"]

_program = Program("crystfem")
run, resume, check, sweep, schema = _program.run, _program.resume, _program.check, _program.sweep, _program.schema
