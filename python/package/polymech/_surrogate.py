"""Learnt laws."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _polymech
from ._laws import Prediction, predicted

Layers = Sequence[tuple[ArrayLike, ArrayLike]]


class Surrogate:
    """A law C → S learnt from data, a file of `mdsurrogate`: ``Surrogate("law.safetensors")``.

    Predictions have tangents, and flags outside the training data.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._law = _polymech.Surrogate.read(os.fspath(path))

    @classmethod
    def _of(cls, law: _polymech.Surrogate) -> Surrogate:
        new = cls.__new__(cls)
        new._law = law
        return new

    @classmethod
    def from_weights(
        cls,
        members: Sequence[Layers] | Layers,
        activations: Sequence[str],
        *,
        strains: ArrayLike,
        transposed: bool = False,
        kind: str | dict[str, Any] = "ann",
        input_mean: ArrayLike | None = None,
        input_deviation: ArrayLike | None = None,
        output_mean: ArrayLike | None = None,
        output_deviation: ArrayLike | None = None,
        provenance: Sequence[str] = (),
    ) -> Surrogate:
        """Creates a law with tangents, flags and exports from your own network of any framework.

        `members` is a list of (W, b), W of shape (outputs, inputs) as in PyTorch, the layers from input to output, or a list of such
        lists, an ensemble; `transposed`: W of shape (inputs, outputs), as in JAX and Keras. `activations` has a name for each layer: ``linear``, ``relu``, ``softplus``, ``tanh``, ``sigmoid``, ``silu``,
        ``elu``; the last is usually ``linear``. `strains`, (N, 6), are the C of your training data: predictions outside their box
        are flagged.

        An ``ann`` maps six standardised components of C to six of S: S = output_mean + output_deviation · N((C − input_mean) /
        input_deviation), in Pa. `kind` may be an energy in the form of `header`, of invariants.
        """
        found: Any = members
        ensemble = [found] if _is_layer(found[0]) else found

        def array(values: ArrayLike) -> NDArray[np.float64]:
            return np.ascontiguousarray(np.asarray(values, dtype=np.float64))

        arrays = [[(array(np.transpose(w) if transposed else w), array(b)) for w, b in layers] for layers in ensemble]
        if len(activations) != len(arrays[0]):
            raise ValueError(f"activations: found {len(activations)}; allowed: {len(arrays[0])}, one for each layer")
        widths = [arrays[0][0][0].shape[1], *(w.shape[0] for w, _ in arrays[0])]
        for layers in arrays:
            for place, (weights, bias) in enumerate(layers):
                allowed = ((widths[place + 1], widths[place]), (widths[place + 1],))
                if (weights.shape, bias.shape) != allowed:
                    raise ValueError(f"layer {place}: found W {weights.shape}, b {bias.shape}; allowed: W {allowed[0]}, b {allowed[1]}")
        seen = np.asarray(strains, dtype=np.float64)
        if seen.ndim != 2 or seen.shape[1] != 6 or len(seen) == 0:
            raise ValueError(f"strains: found the shape {seen.shape}; allowed: (N, 6)")

        def row(values: ArrayLike | None, default: float, length: int) -> list[float]:
            filled = np.full(length, default) if values is None else np.broadcast_to(np.asarray(values, dtype=float), (length,))
            return [float(value) for value in filled]

        header = {
            "kind": kind,
            "architecture": {"widths": widths, "activations": list(activations)},
            "members": len(arrays),
            "input_mean": row(input_mean, 0.0, widths[0]),
            "input_deviation": row(input_deviation, 1.0, widths[0]),
            "output_mean": row(output_mean, 0.0, widths[-1]),
            "output_deviation": row(output_deviation, 1.0, widths[-1]),
            "training_box": np.stack([seen.min(axis=0), seen.max(axis=0)], axis=1).tolist(),
            "spread_limit": None,
            "provenance": list(provenance),
        }
        return cls._of(_polymech.Surrogate.build(json.dumps(header), arrays))

    @property
    def header(self) -> dict[str, Any]:
        """Everything but the weights: kind, architecture, scaling, training box, provenance."""
        found: dict[str, Any] = json.loads(self._law.header())
        return found

    @property
    def weights(self) -> list[list[tuple[NDArray[np.float64], NDArray[np.float64]]]]:
        """W, (outputs, inputs), and b of each layer of each member."""
        return self._law.weights()

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the law as a file that `mdsurrogate export`, `predict` and scenes read."""
        self._law.write(os.fspath(path))

    def predict(self, c: ArrayLike, tangent: bool = False, uncertainty: bool = True) -> Prediction:
        """Computes S and, if requested, ℂ at C = FᵀF of shape (…, 6) or (…, 3, 3), on all threads and without the interpreter's lock.

        Contiguous arrays of float64 are not copied. `uncertainty=False` leaves spread, deviation and flags out.
        Raises `ValueError` with the index of a C that is not positive definite.
        """
        return predicted(lambda rows, rounding: self._law.predict(rows, tangent, uncertainty, rounding), c)

    def __repr__(self) -> str:
        header = self.header
        kind = header["kind"] if isinstance(header["kind"], str) else next(iter(header["kind"]))
        return f"Surrogate({kind}, {header['members']} of {'-'.join(map(str, header['architecture']['widths']))})"


def _is_layer(item: Any) -> bool:
    """Returns true for (W, b), false for a list of layers."""
    return len(item) == 2 and _rank(item[0]) == 2 and _rank(item[1]) == 1


def _rank(item: Any) -> int | None:
    """Number of dimensions of an array; `None` for other objects, such as a layer (W, b)."""
    if isinstance(item, (list, tuple)) and len({np.shape(part) if isinstance(part, np.ndarray) else None for part in item}) > 1:
        return None
    try:
        return np.ndim(item)
    except ValueError:
        return None
