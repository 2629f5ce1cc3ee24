"""Learnt laws as PyTorch modules, and networks of PyTorch or JAX as laws.

>>> from polymech import torch as bridge
>>> module = bridge.Module(surrogate)             # doctest: +SKIP
>>> stress = module(c)                            # doctest: +SKIP
>>> law = bridge.from_sequential(net, strains=c)  # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ._surrogate import Surrogate

try:
    import torch
    from torch import nn
except ImportError as error:  # pragma: no cover
    raise ImportError("polymech.torch needs PyTorch: pip install torch") from error

_MODULES = {"relu": nn.ReLU, "softplus": nn.Softplus, "tanh": nn.Tanh, "sigmoid": nn.Sigmoid, "silu": nn.SiLU, "elu": nn.ELU}


class Module(nn.Module):  # type: ignore[misc, unused-ignore]
    """An ``ann`` law as a module: C (…, 6) → S (…, 6) in Pa, the mean of its members, whose training can be continued."""

    def __init__(self, surrogate: Surrogate) -> None:
        super().__init__()
        header = surrogate.header
        if header["kind"] != "ann":
            raise ValueError(f"Module: found a law of the kind {next(iter(header['kind']))!r}; allowed: 'ann'")
        self.header = header
        self.members = nn.ModuleList([_sequential(layers, header["architecture"]["activations"]) for layers in surrogate.weights])
        for name in ("input_mean", "input_deviation", "output_mean", "output_deviation"):
            self.register_buffer(name, torch.tensor(header[name], dtype=torch.float64))

    def forward(self, c: Any) -> Any:
        """S at C."""
        # an input without variance is mapped to 0
        scale = torch.where(self.input_deviation > 0, 1 / self.input_deviation, torch.zeros_like(self.input_deviation))
        x = (c - self.input_mean) * scale
        y = torch.stack([member(x) for member in self.members]).mean(dim=0)
        return self.output_mean + self.output_deviation * y

    def to_surrogate(self) -> Surrogate:
        """Converts the module back to a law, with the box of its training data."""
        low, high = np.asarray(self.header["training_box"]).T
        weights = [layers_of(member) for member in self.members]
        return Surrogate.from_weights(
            [layers for layers, _ in weights],
            weights[0][1],
            strains=np.stack([low, high]),
            input_mean=self.header["input_mean"],
            input_deviation=self.header["input_deviation"],
            output_mean=self.header["output_mean"],
            output_deviation=self.header["output_deviation"],
            provenance=[*self.header["provenance"], "training continued in PyTorch"],
        )


def _sequential(layers: Sequence[tuple[Any, Any]], activations: Sequence[str]) -> Any:
    modules: list[Any] = []
    for (weights, bias), activation in zip(layers, activations):
        linear = nn.Linear(weights.shape[1], weights.shape[0], dtype=torch.float64)
        with torch.no_grad():
            linear.weight.copy_(torch.from_numpy(np.array(weights)))
            linear.bias.copy_(torch.from_numpy(np.array(bias)))
        modules.append(linear)
        if activation != "linear":
            modules.append(_MODULES[activation]())
    return nn.Sequential(*modules)


def layers_of(sequential: Any) -> tuple[list[tuple[Any, Any]], list[str]]:
    """Returns (W, b) of each linear layer of a `Sequential`, and the names of the activations after them."""
    layers: list[tuple[Any, Any]] = []
    activations: list[str] = []
    names = {module: name for name, module in _MODULES.items()}
    for place, module in enumerate(sequential):
        if isinstance(module, nn.Linear):
            weights = module.weight.detach().double().cpu().numpy()
            bias = np.zeros(len(weights)) if module.bias is None else module.bias.detach().double().cpu().numpy()
            layers.append((weights, bias))
            activations.append("linear")
        elif type(module) in names and activations and activations[-1] == "linear":
            if getattr(module, "alpha", 1.0) != 1.0 or getattr(module, "beta", 1) != 1:
                raise ValueError(f"module {place}: found {module}; allowed: the default parameters")
            activations[-1] = names[type(module)]
        elif not isinstance(module, (nn.Dropout, nn.Identity)):
            allowed = ", ".join(cls.__name__ for cls in _MODULES.values())
            raise ValueError(f"module {place}: found {module}; allowed: Linear, {allowed}")
    return layers, activations


def from_sequential(sequential: Any, *, strains: ArrayLike, **options: Any) -> Surrogate:
    """Converts a `torch.nn.Sequential` of linear layers and activations to a law; options of `Surrogate.from_weights`."""
    layers, activations = layers_of(sequential)
    return Surrogate.from_weights(layers, activations, strains=strains, **options)
