"""The bridge to PyTorch."""

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from polymech import torch as bridge  # noqa: E402
from test_surrogate import law, strains  # noqa: E402


def test_there_and_back():
    surrogate, c = law(), strains(50)
    module = bridge.Module(surrogate)
    stress = module(torch.from_numpy(c)).detach().numpy()
    assert np.allclose(stress, surrogate.predict(c).stress, rtol=1e-10)
    again = module.to_surrogate()
    assert np.allclose(again.predict(c).stress, surrogate.predict(c).stress, rtol=1e-12)
    assert again.header["training_box"] == surrogate.header["training_box"]


def test_a_network_becomes_a_law():
    net = torch.nn.Sequential(torch.nn.Linear(6, 16), torch.nn.SiLU(), torch.nn.Linear(16, 6)).double()
    c = strains(40)
    found = bridge.from_sequential(net, strains=c).predict(c, tangent=True)
    assert np.allclose(found.stress, net(torch.from_numpy(c)).detach().numpy(), rtol=1e-12)
    with pytest.raises(ValueError, match="allowed: Linear, ReLU"):
        bridge.from_sequential(torch.nn.Sequential(torch.nn.Linear(6, 6), torch.nn.GELU()), strains=c)
