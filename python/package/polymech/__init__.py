"""Polymer mechanics across scales.

>>> import polymech
>>> result = polymech.peri.run("sheet.toml")            # results of a scene: values, arrays and pictures
>>> result.history["load"], result.report["peak_load"]  # doctest: +SKIP

`peri` (fracture of elastomers), `crystfem` (heat and crystallization of prints) and `polycore` (fits) run scenes, as their command lines do.
`Langevin`, `Law`, `Surrogate`, `fit` and `fit_volumetric` are constitutive laws as functions of arrays, `network` and `vulcanized` give modulus and chains
of a network from its chemistry, `Solvent` its swelling, `Viscoelastic` and `prony` are laws with time. All numbers are SI unless a name says
otherwise (``temperature_degC``); `Result.report` and `Table` have units beside the numbers.
"""

from . import crystfem, peri, polycore
from ._laws import Fit, Langevin, Law, Prediction, VolumetricFit, fit, fit_volumetric
from ._network import Network, Solvent, network, vulcanized
from ._polymech import Interrupted, RunError, SceneError, __version__
from ._result import Report, Result, Table, Value
from ._surrogate import Surrogate
from ._time import Branch, Prony, Viscoelastic, prony

__all__ = [
    "Branch", "Fit", "Interrupted", "Langevin", "Law", "Network", "Prediction", "Prony", "Report", "Result", "RunError", "SceneError",
    "Solvent", "Surrogate", "Table", "Value", "Viscoelastic", "VolumetricFit", "__version__", "crystfem", "fit", "fit_volumetric",
    "network", "peri", "polycore", "prony", "vulcanized",
]
