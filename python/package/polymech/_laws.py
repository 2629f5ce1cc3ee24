"""Chain statistics and constitutive laws as functions of arrays."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _polymech
from ._result import Value

Array = NDArray[np.float64]


def flat(x: ArrayLike) -> tuple[Array, tuple[int, ...]]:
    """Flattens an array, without a copy if possible, and returns its shape."""
    array = np.asarray(x, dtype=np.float64)
    return np.ascontiguousarray(array).reshape(-1), array.shape


def aligned(what: str, given: Sequence[ArrayLike]) -> list[Array]:
    """Broadcasts arrays of one shape, and numbers, to that shape."""
    arrays = [np.asarray(x, dtype=np.float64) for x in given]
    try:
        return [np.ascontiguousarray(x) for x in np.broadcast_arrays(*arrays)]
    except ValueError:
        shapes = ", ".join(str(x.shape) for x in arrays)
        raise ValueError(f"{what}: found arrays of the shapes {shapes}; allowed: arrays of one shape, or numbers") from None


class Langevin:
    """The Langevin function 𝓛(β) = coth β − 1/β of chain statistics, its derivative, energy and inverse, for arrays."""

    @staticmethod
    def value(beta: ArrayLike) -> Array:
        """𝓛(β)."""
        return Langevin._at("langevin", beta)

    @staticmethod
    def derivative(beta: ArrayLike) -> Array:
        """𝓛′(β) = 1/β² − 1/sinh² β."""
        return Langevin._at("derivative", beta)

    @staticmethod
    def free_energy(beta: ArrayLike) -> Array:
        """ψ = β𝓛(β) + ln(β/sinh β), the free energy of a chain per link and kθ."""
        return Langevin._at("free_energy", beta)

    @staticmethod
    def inverse(x: ArrayLike, method: str = "exact") -> Array:
        """𝓛⁻¹(x) of the relative extension x, ±∞ at ±1 and NaN beyond: exact to 1.6 ulp, or one of `methods`."""
        return Langevin._at("inverse", x, method)

    @staticmethod
    def inverse_derivative(x: ArrayLike, method: str = "exact") -> Array:
        """d𝓛⁻¹/dx, for an approximant its own derivative."""
        return Langevin._at("inverse_derivative", x, method)

    @staticmethod
    def methods() -> dict[str, str]:
        """Returns the names of the inverses and their publications."""
        return {name: source for name, source, _ in _polymech.langevin_methods()}

    @staticmethod
    def _at(function: str, x: ArrayLike, method: str = "exact") -> Array:
        numbers, shape = flat(x)
        return _polymech.langevin(function, numbers, method).reshape(shape)


@dataclass(frozen=True)
class Prediction:
    """Predictions of a law at each C, in the shape of C: (…, 6) in the order 11, 22, 33, 12, 13, 23, or (…, 3, 3)."""

    stress: Array
    """S, second Piola–Kirchhoff, Pa, in the shape of C."""
    tangent: Array | None
    """ℂ = 2 ∂S/∂C, (…, 6, 6), Pa: dS = ℂ dE with doubled shear strains."""
    energy: Array
    """W, (…), J/m³; NaN for a law without an energy."""
    spread: Array | None = None
    """Root mean square distance of the members of an ensemble from their mean, (…), Pa; this and the following: learnt laws only."""
    deviation: Array | None = None
    """Standard deviation of each component over the members, (…, 6), Pa."""
    outside: NDArray[np.bool_] | None = None
    """Components of C outside the box of the training data, (…, 6)."""
    unseen: NDArray[np.bool_] | None = None
    """Components outside the box that never changed in the training data, (…, 6)."""
    far: NDArray[np.bool_] | None = None
    """True in a gap of the training data, (…)."""
    disagree: NDArray[np.bool_] | None = None
    """True if the members disagree by more than at any training strain, (…)."""

    @property
    def flagged(self) -> NDArray[np.bool_]:
        """True if any flag is set, (…): a learnt law outside its data."""
        if self.outside is None or self.far is None or self.disagree is None:
            raise ValueError("flagged: this prediction has no flags; use a learnt law with uncertainty=True")
        doubt: NDArray[np.bool_] = self.outside.any(axis=-1) | self.far | self.disagree
        return doubt


_PAIRS = ([0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2])


def predicted(evaluate: Callable[[Array, float], dict[str, Any]], c: ArrayLike) -> Prediction:
    """Evaluates a law of the module at C of any shape; tensors may be symmetric up to rounding of their type."""
    given = np.asarray(c)
    # a product of three matrices is accurate to some tens of roundings of its type
    rounding = 64 * float(np.finfo(given.dtype if given.dtype.kind == "f" else np.float64).eps)
    array = np.asarray(given, dtype=np.float64)
    tensors = array.ndim >= 2 and array.shape[-2:] == (3, 3)
    if not tensors and (array.ndim == 0 or array.shape[-1] != 6):
        raise ValueError(f"C: found the shape {array.shape}; allowed: (…, 6) or (…, 3, 3)")
    points = array.shape[:-2] if tensors else array.shape[:-1]
    found = evaluate(np.ascontiguousarray(array).reshape(-1, 9 if tensors else 6), min(rounding, 0.01))
    stress = found["stress"]
    if tensors:
        whole = np.empty((len(stress), 3, 3))
        whole[:, _PAIRS[0], _PAIRS[1]] = stress
        whole[:, _PAIRS[1], _PAIRS[0]] = stress
        stress = whole
    shaped = {"stress": stress.reshape(array.shape), "energy": found["energy"].reshape(points), "tangent": None}
    if "tangent" in found:
        shaped["tangent"] = found["tangent"].reshape(*points, 6, 6)
    if "spread" in found:
        flags = found["flags"].reshape(*points, 8)
        shaped |= {
            "spread": found["spread"].reshape(points),
            "deviation": found["deviation"].reshape(*points, 6),
            "unseen": found["unseen"].reshape(*points, 6),
            "outside": flags[..., :6],
            "far": flags[..., 6],
            "disagree": flags[..., 7],
        }
    return Prediction(**shaped)


def bulk_at_rest(law: _polymech.Law) -> float:
    """Bulk modulus of a law of the module at rest, Pa."""
    tangent = law.predict(np.array([[1.0, 1.0, 1.0, 0.0, 0.0, 0.0]]), True, 1e-12)["tangent"]
    return float(tangent.reshape(6, 6)[:3, :3].mean())


class Law:
    """A hyperelastic law of rubber: ``Law("eight-chain", modulus=0.27e6, links=25)``, parameters in SI, by name or in order.

    Laws are incompressible unless they have a `bulk_modulus` K, Pa, by the energy ¼λ(J² − 1 − 2 ln J) of
    scenes, or `volumetric` names an energy U(J) and its Lamé constant λ in Pa: ``("ciarlet", 10e6)`` (that of
    scenes), ``"quadratic"``, ``"logarithmic"``. Foams (``"hyperfoam-1"`` to ``"hyperfoam-3"``) have their
    own. `Law.models()` lists the laws and their parameters. The `repr` of a law is Python that makes it
    again.
    """

    def __init__(
        self,
        model: str,
        *values: float,
        volumetric: tuple[str, float] | None = None,
        bulk_modulus: float | None = None,
        as_published: bool = False,
        **parameters: float,
    ) -> None:
        known = Law.models().get(model)
        if parameters:
            if values or known is None or set(known) != set(parameters):
                found = [*map(str, values), *parameters]
                allowed = "one of " + ", ".join(Law.models()) if known is None else ", ".join(known)
                raise ValueError(f"{model}: found {', '.join(found)}; allowed: {allowed}")
            values = tuple(parameters[name] for name in known)
        numbers = [float(value) for value in values]
        if bulk_modulus is not None:
            if volumetric is not None:
                raise ValueError("bulk_modulus conflicts with volumetric: give one of them")
            least = bulk_at_rest(_polymech.Law(model, numbers, ("ciarlet", 0.0), as_published))
            if not bulk_modulus >= least:
                raise ValueError(f"bulk_modulus: found {bulk_modulus} Pa; allowed: at least {least:.7g} Pa")
            volumetric = ("ciarlet", bulk_modulus - least)
        self._law = _polymech.Law(model, numbers, volumetric, as_published)
        self._bulk = bulk_modulus
        self.model = model

    @staticmethod
    def models() -> dict[str, dict[str, Value]]:
        """Returns each law and its parameters with example values."""
        return {name: {p: Value(x, unit) for p, unit, x in parameters} for name, parameters in _polymech.models()}

    @property
    def parameters(self) -> dict[str, float]:
        """Names and values, SI."""
        return dict(self._law.parameters())

    @property
    def shear_modulus(self) -> float:
        """μ at rest, Pa."""
        return self._law.shear_modulus()

    def __repr__(self) -> str:
        _, values, volumetric, published = self._law.__getnewargs__()
        given = [f"{name}={value!r}" for name, value in zip(Law.models()[self.model], values, strict=True)]
        if self._bulk is not None:
            given.append(f"bulk_modulus={self._bulk!r}")
        elif volumetric is not None:
            given.append(f"volumetric={volumetric!r}")
        return f"Law({', '.join([repr(self.model), *given, *['as_published=True'][: int(published)]])})"

    @property
    def bulk_modulus(self) -> float | None:
        """K at rest, Pa; `None` of an incompressible law."""
        incompressible = self._law.__getnewargs__()[2] is None and not self.model.startswith("hyperfoam")
        return self._bulk if self._bulk is not None or incompressible else bulk_at_rest(self._law)

    def block(self) -> dict[str, Any]:
        """Returns the law as `constitutive` of a scene, with its units.

        Scenes have laws with a `bulk_modulus`, whose energy is ``"ciarlet"``, and foams.
        """
        _, values, volumetric, published = self._law.__getnewargs__()
        foam = self.model.startswith("hyperfoam")
        if published or not (foam or (volumetric is not None and volumetric[0] == "ciarlet")):
            raise ValueError(f"{self!r}: scenes have laws with a bulk_modulus")
        units = Law.models()[self.model].items()
        pairs = zip(units, values, strict=True)
        parameters = {name: f"{x!r} Pa" if unit.unit == "Pa" else x for (name, unit), x in pairs}
        bulk = {} if foam else {"bulk_modulus": f"{self.bulk_modulus!r} Pa"}
        return {"model": self.model, "parameters": parameters, **bulk}

    @staticmethod
    def read(path: str | os.PathLike[str], stress: float = 1e6) -> dict[str, Law]:
        """Reads the laws of a deck by the names of its materials, with their bulk moduli.

        Decks of Abaqus and CalculiX (`*HYPERELASTIC`, `*HYPERFOAM`, user materials of this project), and
        the materials that a fit writes for Ansys (``.mac``), LS-DYNA (``.k``), FEBio (``.feb``) and MOOSE
        (``.i``). `stress` is the deck's unit of stress, Pa: 1e6 with N and mm, 1 with N and m. Warnings name
        what a law does not take over, and materials left out.
        """
        materials, left_out = _polymech.read_deck(os.fspath(path))
        laws = {}
        for name, model, values, bulk, notes in materials:
            known = Law.models()[model].values()
            numbers = (x * stress if v.unit == "Pa" else x for v, x in zip(known, values, strict=True))
            laws[name] = Law(model, *numbers, bulk_modulus=None if bulk is None else bulk * stress)
            for note in notes:
                warnings.warn(f"{name}: {note}", stacklevel=2)
        for reason in left_out:
            warnings.warn(f"left out: {reason}", stacklevel=2)
        return laws

    def card(self, program: str = "abaqus", name: str = "RUBBER", stress: float = 1e6) -> str:
        """Formats the law as a material of a finite-element program.

        Programs are ``"abaqus"`` (and CalculiX), ``"ansys"``, ``"ls-dyna"``, ``"febio"`` and ``"moose"``.
        `stress` is the unit of stress, Pa: 1e6 with N and mm, 1 with N and m. K of an incompressible law is
        100 times the shear modulus, as in the cards of fits.
        """
        _, values, _, _ = self._law.__getnewargs__()
        known = Law.models()[self.model].values()
        numbers = [x / stress if v.unit == "Pa" else x for v, x in zip(known, values, strict=True)]
        bulk = self.bulk_modulus or 100 * self.shear_modulus
        return _polymech.card(program, name, self.model, numbers, [2 * stress / bulk])

    def biaxial(self, first: ArrayLike, second: ArrayLike) -> Array:
        """Nominal stresses (…, 2), Pa, of an incompressible sheet stretched to λ₁ and λ₂."""
        a, b = aligned("stretches", (first, second))
        return self._law.biaxial(flat(a)[0], flat(b)[0]).reshape(*a.shape, 2)

    def uniaxial(self, stretch: ArrayLike) -> Array:
        """Nominal stress, Pa, of an incompressible bar stretched to λ."""
        stretch = np.asarray(stretch, dtype=float)
        with np.errstate(invalid="ignore", divide="ignore"):
            return self.biaxial(stretch, 1 / np.sqrt(stretch))[..., 0]

    def equibiaxial(self, stretch: ArrayLike) -> Array:
        """Nominal stress, Pa, of an incompressible sheet stretched to λ in both directions."""
        return self.biaxial(stretch, stretch)[..., 0]

    def pure_shear(self, stretch: ArrayLike) -> Array:
        """Nominal stresses (…, 2), Pa, of a wide incompressible strip stretched to λ: along the load and along the width."""
        return self.biaxial(stretch, 1.0)

    def torsion(self, twist: ArrayLike, radius: ArrayLike, stretch: ArrayLike = 1.0) -> tuple[Array, Array]:
        """Torque M, N m, and axial force N, N, of an incompressible solid cylinder, held at a stretch and twisted.

        `twist` is the angle per undeformed length, rad/m, `radius` the undeformed one, m. N is below 0 if the cylinder pushes.
        """
        turn, size, held = aligned("twist, radius, stretch", (twist, radius, stretch))
        found = self._law.torsion(flat(turn)[0], flat(size)[0], flat(held)[0])
        torque, force = (found[:, i].reshape(turn.shape) for i in (0, 1))
        return torque, force

    def energy(self, deformation: ArrayLike) -> Array:
        """W(F), J/m³, (…) for F (…, 3, 3)."""
        return self._of("energy", deformation)[..., 0]

    def first_piola_kirchhoff(self, deformation: ArrayLike) -> Array:
        """P = ∂W/∂F, Pa, (…, 3, 3); for an incompressible law the part that W determines."""
        return self._of("piola", deformation)

    def cauchy(self, deformation: ArrayLike) -> Array:
        """σ = P Fᵀ/J, Pa, (…, 3, 3)."""
        return self._of("cauchy", deformation)

    def _of(self, what: str, deformation: ArrayLike) -> Array:
        array = np.asarray(deformation, dtype=np.float64)
        if array.shape[-2:] != (3, 3):
            raise ValueError(f"F: found the shape {array.shape}; allowed: (…, 3, 3)")
        found = self._law.at_gradient(what, np.ascontiguousarray(array).reshape(-1, 9))
        return found.reshape(*array.shape[:-2], 1) if what == "energy" else found.reshape(array.shape)

    def predict(self, c: ArrayLike, tangent: bool = False) -> Prediction:
        """Computes S, W and, if requested, ℂ at C = FᵀF of shape (…, 6) or (…, 3, 3)."""
        return predicted(lambda rows, rounding: self._law.predict(rows, tangent, rounding), c)


@dataclass(frozen=True)
class Fit:
    """A law fitted to tests of rubber."""

    law: Law
    """The law."""
    parameters: dict[str, Value]
    """Parameters of the law."""
    standard_errors: dict[str, float | None]
    """Standard error of each parameter; `None` if the data do not determine it."""
    rms: float
    """Root mean square of the residuals of the nominal stress, Pa."""
    measurements: int
    """Number of measured stresses."""
    draws: Array
    """Draws of the parameters from their posterior, (draws, parameters)."""


def _rows(name: str, columns: tuple[ArrayLike, ...]) -> Array:
    """Stacks the columns of a test; of torsion numbers and missing columns are filled in."""
    if name == "torsion":
        if not 3 <= len(columns) <= 5:
            allowed = "twist, torque, radius and, if known, axial force and stretch"
            raise ValueError(f"torsion: found {len(columns)} columns; allowed: {allowed}")
        columns = (*aligned(name, (*columns, *(0.0, 1.0)[len(columns) - 3 :])),)
    given = [np.atleast_1d(np.asarray(column, dtype=np.float64)) for column in columns]
    if any(column.shape != (len(given[0]),) for column in given):
        shapes = ", ".join(str(column.shape) for column in given)
        raise ValueError(f"{name}: found columns of the shapes {shapes}; allowed: columns of one length, (N,)")
    return np.ascontiguousarray(np.column_stack(given))


def fit(model: str, tests: Mapping[str, tuple[ArrayLike, ...]]) -> Fit:
    """Fits a law to tests: ``fit("ogden-2", {"uniaxial": (stretch, stress), "equibiaxial": …, "pure-shear": …})``.

    Nominal stresses in Pa, (N,), at stretches (N,), of ``"simple-shear"`` at amounts of shear; for ``"biaxial"`` tests four columns: λ₁, λ₂, P₁, P₂; for
    ``"torsion"`` of solid cylinders twist (angle per undeformed length, rad/m), torque (N m), undeformed radius (m) and, if known, axial force (N) and
    held stretch, each an array or a number. A stress of exactly 0 is a condition, not a measurement. Least squares of the
    stresses by Levenberg–Marquardt from several starts.
    """
    found = _polymech.fit_law(model, [(name, _rows(name, columns)) for name, columns in tests.items()])
    for note in found["notes"]:
        warnings.warn(note, stacklevel=2)
    parameters = {name: Value(value, unit) for name, unit, value, _ in found["parameters"]}
    errors = {name: error for name, _, _, error in found["parameters"]}
    law = Law(model, *(float(value) for value in parameters.values()))
    return Fit(law, parameters, errors, found["rms"], found["measurements"], found["draws"])


@dataclass(frozen=True)
class VolumetricFit:
    """Volumetric energy U = Σ (J − 1)²ⁱ/Dᵢ fitted to a test."""

    bulk_modulus: float
    """K = 2/D₁, Pa."""
    bulk_error: float | None
    """Standard error of K, Pa; `None` if there are as many states as terms."""
    compliances: Array
    """Dᵢ, 1/Pa."""
    standard_errors: Array
    """Standard errors of Dᵢ, 1/Pa; empty if there are as many states as terms."""
    rms: float
    """Root mean square of the residuals of the pressure, Pa."""
    warnings: tuple[str, ...]
    """Defects: errors that are unknown or exceed their values, a pressure that falls with compression."""


def fit_volumetric(ratio: ArrayLike, pressure: ArrayLike, terms: int = 1) -> VolumetricFit:
    """Fits Dᵢ of U = Σ (J − 1)²ⁱ/Dᵢ to pressures, Pa, above 0 in compression, at ratios of volumes J.

    Defects of the fit are warnings: errors of Dᵢ that are unknown or exceed their values, a pressure that falls with
    compression within the test or from J = 0.8 to 1.2.
    """
    rows = _rows("ratio, pressure", (ratio, pressure))
    if terms < 1:
        raise ValueError(f"terms: found {terms}; allowed: 1 or more")
    found = _polymech.fit_volumetric(rows[:, 0].copy(), rows[:, 1].copy(), terms)
    for note in found["notes"]:
        warnings.warn(note, stacklevel=2)
    bulk, error = found["bulk"]
    return VolumetricFit(bulk, error, found["compliances"], found["errors"], found["rms"], tuple(found["notes"]))
