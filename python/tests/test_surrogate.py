"""Laws learnt from data, against networks in numpy."""

import json
import pickle
import threading
import time

import numpy as np
import pytest

from polymech import Surrogate

ANN_4 = [6, 224, 96, 64, 96, 6]
ACTIVATIONS = ["relu", "softplus", "relu", "softplus", "linear"]
BOX = np.array([[0.8, 0.8, 0.8, 0, 0, 0], [1.4, 1.4, 1.4, 0, 0, 0]], dtype=float)


def network(seed, widths=ANN_4):
    random = np.random.default_rng(seed)
    return [(random.normal(size=(n, m)) * np.sqrt(2 / m), random.normal(size=n) * 0.1) for m, n in zip(widths, widths[1:])]


def forward(layers, x, activations=ACTIVATIONS):
    for (weights, bias), activation in zip(layers, activations):
        x = x @ weights.T + bias
        x = {"relu": lambda a: np.maximum(a, 0), "softplus": lambda a: np.logaddexp(a, 0), "linear": lambda a: a}[activation](x)
    return x


def strains(count, seed=0):
    random = np.random.default_rng(seed)
    c = random.uniform(0.8, 1.4, size=(count, 6))
    c[:, 3:] = 0
    return c


SCALING = dict(input_mean=[1.1] * 3 + [0.0] * 3, input_deviation=0.3, output_mean=1e5, output_deviation=[1e6] * 5 + [2e6])


def law(members=2):
    return Surrogate.from_weights([network(k) for k in range(members)], ACTIVATIONS, strains=BOX, **SCALING)


def expected(c, members=2):
    x = (c - np.array(SCALING["input_mean"])) / 0.3
    each = np.stack([1e5 + np.array(SCALING["output_deviation"]) * forward(network(k), x) for k in range(members)])
    return each


def test_predictions_are_those_of_numpy():
    c, surrogate = strains(3000), law()
    found = surrogate.predict(c, tangent=True)
    each = expected(c)
    scale = np.abs(each).max()
    assert np.abs(found.stress - each.mean(axis=0)).max() < 1e-12 * scale
    assert np.abs(found.deviation - each.std(axis=0)).max() < 1e-10 * scale
    assert np.abs(found.spread - np.linalg.norm(each.std(axis=0), axis=1)).max() < 1e-10 * scale
    # the same bits without the tangent, point by point, and in tensors
    alone = surrogate.predict(c)
    assert (alone.stress == found.stress).all() and alone.tangent is None
    assert (surrogate.predict(c[5]).stress == found.stress[5]).all()
    tensors = np.zeros((3000, 3, 3))
    tensors[:, [0, 1, 2], [0, 1, 2]] = c[:, :3]
    assert (surrogate.predict(tensors).stress[:, [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]] == found.stress).all()


def test_tangents_by_differences():
    c, surrogate = strains(50, 3), law()
    tangent = surrogate.predict(c, tangent=True).tangent
    h = 1e-7
    for b in range(6):
        step = np.eye(6)[b] * h
        # C₁₂ counts once, C₁₁ twice
        slope = (expected(c + step) - expected(c - step)).mean(axis=0) / (2 * h) * (2 if b < 3 else 1)
        # a kink of `relu` within 2h is rare, not impossible
        close = np.abs(slope - tangent[:, :, b]) < 1e-5 * np.abs(tangent).max()
        assert close.mean() > 0.99


def test_flags():
    c = np.array([[1.1, 1.1, 1.1, 0, 0, 0], [1.5, 1, 1, 0, 0, 0], [1, 1, 1, 0.1, 0, 0]], dtype=float)
    found = law().predict(c)
    assert found.flagged.tolist() == [False, True, True]
    assert found.outside[1].tolist() == [True, False, False, False, False, False]
    assert found.unseen[2].tolist() == [False, False, False, True, False, False]
    bare = law().predict(c, uncertainty=False)
    assert bare.spread is None and (bare.stress == found.stress).all()
    with pytest.raises(ValueError, match="no flags"):
        _ = bare.flagged


def test_views_of_arrays():
    c = np.empty((40, 12))
    c[:, ::2] = strains(40)
    assert (law().predict(c[:, ::2]).stress == law().predict(strains(40)).stress).all()
    assert law().predict(strains(40).astype(np.float32)).stress.dtype == np.float64
    locked = strains(40)
    locked.flags.writeable = False
    assert law().predict(locked).stress.shape == (40, 6)


def test_files_and_pickles(tmp_path):
    surrogate = law()
    surrogate.write(tmp_path / "law.safetensors")
    c = strains(64)
    for again in (Surrogate(tmp_path / "law.safetensors"), pickle.loads(pickle.dumps(surrogate))):
        assert (again.predict(c).stress == surrogate.predict(c).stress).all()
        assert again.header == surrogate.header
        assert all((w == v).all() for (w, _), (v, _) in zip(again.weights[1], surrogate.weights[1]))
    assert surrogate.header["architecture"]["widths"] == ANN_4 and repr(surrogate) == "Surrogate(ann, 2 of 6-224-96-64-96-6)"
    with pytest.raises(OSError, match="nowhere"):
        Surrogate(tmp_path / "nowhere.safetensors")
    (tmp_path / "bad.safetensors").write_bytes(b"no law")
    with pytest.raises(ValueError, match="no safetensors file"):
        Surrogate(tmp_path / "bad.safetensors")


def test_weights_of_other_frameworks():
    layers = network(7)
    as_jax = [(w.T, b) for w, b in layers]
    c = strains(10)
    one = Surrogate.from_weights(layers, ACTIVATIONS, strains=BOX).predict(c).stress
    assert (Surrogate.from_weights(as_jax, ACTIVATIONS, strains=BOX, transposed=True).predict(c).stress == one).all()
    assert np.allclose(one, forward(layers, c), rtol=1e-12)
    with pytest.raises(ValueError, match="layer 0: found W"):
        Surrogate.from_weights([(layers[0][0], layers[0][1][:3])], ["linear"], strains=BOX)
    with pytest.raises(ValueError, match="activations: found 1; allowed: 5"):
        Surrogate.from_weights(layers, ["relu"], strains=BOX)
    with pytest.raises(ValueError, match="strains"):
        Surrogate.from_weights(layers, ACTIVATIONS, strains=[1.0])
    with pytest.raises(ValueError, match="unknown variant|gelu"):
        Surrogate.from_weights(layers, ["gelu"] * 5, strains=BOX)


def test_an_energy_is_symmetric():
    kind = {"energy": {"symmetry": "isotropic", "axes": np.eye(3).tolist()}}
    energy = Surrogate.from_weights(
        network(2, [3, 16, 1]), ["softplus", "linear"], strains=BOX, kind=kind, input_mean=3.0, output_deviation=1e6
    )
    c = strains(20)
    c[:, 3:] = np.random.default_rng(1).uniform(-0.1, 0.1, size=(20, 3))
    found = energy.predict(c, tangent=True)
    assert np.abs(found.tangent - np.swapaxes(found.tangent, 1, 2)).max() < 1e-9 * np.abs(found.tangent).max()
    assert np.abs(energy.predict(np.eye(3)).stress).max() < 1e-6 and not np.isnan(found.energy).any()
    assert json.dumps(energy.header)


def test_others_run_meanwhile():
    """The interpreter's lock is free while a law is evaluated."""
    surrogate, c = law(1), strains(60_000)
    done, counted = threading.Event(), 0

    def work():
        surrogate.predict(c, tangent=True)
        done.set()

    worker = threading.Thread(target=work)
    worker.start()
    while not done.is_set():
        counted += 1
        time.sleep(0)
    worker.join()
    # with the lock held: none, or the few before the call and after it
    assert counted > 1000


def test_speed(capsys):
    """A figure, no verdict."""
    surrogate, c = law(1), strains(200_000)
    begun = time.perf_counter()
    surrogate.predict(c, uncertainty=False)
    ours = time.perf_counter() - begun
    layers, x = network(0), (c - np.array(SCALING["input_mean"])) / 0.3
    begun = time.perf_counter()
    forward(layers, x)
    theirs = time.perf_counter() - begun
    with capsys.disabled():
        print(f"\nANN-4, 200 000 stresses: {ours:.3f} s; numpy in one batch {theirs:.3f} s")


def test_one_hidden_layer():
    """Ensembles of networks of two layers, in lists and tuples, are no layers themselves."""
    members = [network(k, [6, 12, 6]) for k in range(3)]
    c = strains(10)
    each = np.stack([forward(layers, c, ["softplus", "linear"]) for layers in members])
    for given in (members, tuple(map(tuple, members)), members[:2]):
        found = Surrogate.from_weights(given, ["softplus", "linear"], strains=BOX)
        assert found.header["members"] == len(given)
        assert np.allclose(found.predict(c).stress, each[: len(given)].mean(axis=0), rtol=1e-12)
    one = Surrogate.from_weights(members[0], ["softplus", "linear"], strains=BOX)
    assert one.header["members"] == 1 and np.allclose(one.predict(c).stress, each[0], rtol=1e-12)
    square = [network(k, [6, 6, 6]) for k in range(2)]
    assert Surrogate.from_weights(square, ["softplus", "linear"], strains=BOX).header["members"] == 2
    flat = [network(k, [6, 6]) for k in range(2)]
    assert Surrogate.from_weights(flat, ["linear"], strains=BOX).header["members"] == 2
