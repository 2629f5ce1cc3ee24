"""Checks a law written as ONNX and prints its outputs: onnx.py MODEL C11,C22,C33,C12,C13,C23 ...

One line for each C: S (6), spread, W, far, outside (6); nan where the law has no such output.
"""

import sys

import numpy as np
import onnxruntime

session = onnxruntime.InferenceSession(sys.argv[1], providers=["CPUExecutionProvider"])
points = np.array([[float(c) for c in point.split(",")] for point in sys.argv[2:]])
names = [output.name for output in session.get_outputs()]
found = dict(zip(names, session.run(None, {"C": points})))
absent = np.full((len(points), 1), np.nan)
columns = [found.get(name, absent) for name in ["S", "spread", "W", "far", "outside"]]
for row in np.concatenate([column.astype(float) for column in columns], axis=1):
    print(*(repr(float(value)) for value in row))
