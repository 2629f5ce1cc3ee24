"""A law of one `ann` in PyTorch (`torch LAW`) or onnxruntime (`onnx MODEL`) beside the answers of `mdsurrogate predict`:
differences and microseconds a point (medians), on one thread in doubles, as JSON rows: PyTorch point by point, all points
at once, and compiled where that works. surrogate_peers.py KIND FILE ANSWERS.csv"""
import csv
import json
import statistics
import struct
import sys
import time

import numpy as np

kind, file, answers = sys.argv[1:]
with open(answers) as table:
    headings, *lines = csv.reader(table)
table = dict(zip((name.split(" [")[0] for name in headings), np.array(lines, float).T))
order = ["11", "22", "33", "12", "13", "23"]
strains = np.stack([table["C" + a] for a in order], 1)
stresses = np.stack([table["S" + a] for a in order], 1)
tangents = np.stack([[table[f"tangent {a} {b}"] for b in order] for a in order]).transpose(2, 0, 1)
rows = []


def row(what, value, unit):
    rows.append({"what": f"{name}, {what}", "size": len(strains), "threads": 1, "value": float(value), "unit": unit})


def median_time(run, points):
    """Microseconds a point, the median of seven; once before, for what is compiled or allocated first."""
    run()
    times = []
    for _ in range(7):
        since = time.perf_counter()
        run()
        times.append(time.perf_counter() - since)
    return statistics.median(times) / points * 1e6


if kind == "torch":
    import torch

    torch.set_num_threads(1)
    name = f"PyTorch {torch.__version__.split('+')[0]}"
    data = open(file, "rb").read()
    (length,) = struct.unpack("<Q", data[:8])
    tensors = json.loads(data[8 : 8 + length])
    header = json.loads(tensors.pop("__metadata__")["mdsurrogate law 1"])

    def tensor(key):
        begin, end = (8 + length + offset for offset in tensors[key]["data_offsets"])
        kinds = {"F64": np.float64, "F32": np.float32}
        values = np.frombuffer(data[begin:end], kinds[tensors[key]["dtype"]]).reshape(tensors[key]["shape"])
        return torch.tensor(values, dtype=torch.float64)

    layers = []
    after = {"relu": torch.nn.ReLU, "softplus": torch.nn.Softplus, "linear": torch.nn.Identity}
    for layer, activation in enumerate(header["architecture"]["activations"]):
        weight, bias = (tensor(f"member0.layer{layer}.{part}") for part in ("weight", "bias"))
        linear = torch.nn.Linear(weight.shape[1], weight.shape[0], dtype=torch.float64)
        linear.weight.data, linear.bias.data = weight, bias
        # beyond 20 torch's softplus is x by default: a difference of 2e-9
        layers += [linear, torch.nn.Softplus(threshold=700) if activation == "softplus" else after[activation]()]
    net = torch.nn.Sequential(*layers).requires_grad_(False)
    mean, deviation, output_mean, output_deviation = (
        torch.tensor(header[key], dtype=torch.float64)
        for key in ("input_mean", "input_deviation", "output_mean", "output_deviation")
    )
    inverse = torch.where(deviation == 0, 0, 1 / deviation)

    def stress(c):
        return (net((c - mean) * inverse) * output_deviation + output_mean) / 1e6

    points = torch.tensor(strains)
    with torch.no_grad():
        found = stress(points).numpy()
        single = median_time(lambda: [stress(point) for point in points], len(points))
        batch = median_time(lambda: stress(points), len(points))
    slope = torch.func.jacrev(stress)
    jacobians = np.stack([slope(point).numpy() for point in points])
    # ℂ = 2 ∂S/∂C, C12 counted once
    expected = jacobians * np.array([2, 2, 2, 1, 1, 1])
    row("largest difference of tangents over the largest", abs(expected - tangents).max() / abs(tangents).max(), "")
    row("stress and tangent", median_time(lambda: [(stress(point), slope(point)) for point in points[:64]], 64), "µs/point")

    def both(c):
        """Stress and its slope from one pass."""
        s, pull = torch.func.vjp(stress, c)
        return s, torch.func.vmap(lambda v: pull(v)[0])(torch.eye(6, dtype=torch.float64))

    batched = torch.func.vmap(both)
    assert torch.allclose(batched(points)[1], torch.tensor(jacobians), rtol=1e-9, atol=1e-9 * abs(jacobians).max())
    row("stress and tangent by vmap, all at once", median_time(lambda: batched(points), len(points)), "µs/point")
    compiled = [
        ("stress, torch.compile, one by one", stress, lambda run: [run(point) for point in points]),
        ("stress, torch.compile, all at once", stress, lambda run: run(points)),
        ("stress and tangent by vmap, torch.compile, all at once", batched, lambda run: run(points)),
    ]
    for what, run, measure in compiled:
        try:
            with torch.no_grad():
                fast = torch.compile(run)
                row(what, median_time(lambda: measure(fast), len(points)), "µs/point")
        except Exception as error:  # no compiler, an unsupported operation: no figure, and the reason
            reason = (str(error).strip().splitlines() or [type(error).__name__])[0]
            rows.append({"what": f"{name}, {what}: skipped, {reason}", "size": 0, "threads": 1, "value": None, "unit": ""})
else:
    import onnxruntime

    name = f"onnxruntime {onnxruntime.__version__}"
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    session = onnxruntime.InferenceSession(file, options, providers=["CPUExecutionProvider"])
    stress = lambda c: session.run(["S"], {"C": c})[0]
    found = stress(strains) / 1e6
    single = median_time(lambda: [stress(point[None]) for point in strains], len(strains))
    batch = median_time(lambda: stress(strains), len(strains))

row("largest difference of stresses over the largest", abs(found - stresses).max() / abs(stresses).max(), "")
row("stress, one by one", single, "µs/point")
row("stress, all at once", batch, "µs/point")
print(json.dumps(rows))
