"""Checks a law written as ONNX and prints its outputs: onnx.py MODEL C11,C22,C33,C12,C13,C23 ...

One line for each C: S (6), spread, W, far, outside (6), tangent (36); nan where the law has no such output.
"""

import sys

import numpy as np
import onnxruntime

session = onnxruntime.InferenceSession(sys.argv[1], providers=["CPUExecutionProvider"])
points = np.array([[float(c) for c in point.split(",")] for point in sys.argv[2:]])
single = session.get_inputs()[0].type == "tensor(float)"
points = points.astype(np.float32 if single else np.float64)
names = [output.name for output in session.get_outputs()]
found = dict(zip(names, session.run(None, {"C": points})))
absent = np.full((len(points), 1), np.nan)
columns = [found.get(name, absent) for name in ["S", "spread", "W", "far", "outside"]]
if "tangent" in found:
    assert found["tangent"].shape == (len(points), 6, 6) and found["tangent"].dtype == found["S"].dtype == points.dtype
    columns.append(found["tangent"].reshape(len(points), 36))
for row in np.concatenate([column.astype(float) for column in columns], axis=1):
    print(*(repr(float(value)) for value in row))
