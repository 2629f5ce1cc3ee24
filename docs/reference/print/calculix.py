"""CalculiX on the block of cases/ch5/thermal-stress, node by node: python calculix.py RESULTS (needs ccx, h5py, numpy).

RESULTS is the output folder of a study; `released` in its name: free, compared after the nearest fit of the bed side.
"""
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np

results = Path(sys.argv[1])
with h5py.File(results / "fields.vtkhdf") as file:
    root = file["VTKHDF"]
    count, cells = int(root["NumberOfPoints"][0]), int(root["NumberOfCells"][0])
    points = root["Points"][:count]
    corners = root["Connectivity"][: 8 * cells].reshape(-1, 8)
    temperature = root["PointData/temperature_degC"][-count:]
    ours = root["PointData/displacement_m"][-count:]


def number(*place):
    return int(np.argmin(((points - np.array(place)) ** 2).sum(1))) + 1


free = "released" in results.name
bed = np.flatnonzero(points[:, 2] < 1e-9)
size = points.max(0)
if free:
    held = [f"{number(0, 0, 0)},1,3", f"{number(size[0], 0, 0)},2,3", f"{number(0, size[1], 0)},3"]
else:
    held = [f"{node + 1},1,3" for node in bed]
deck = ["*NODE,NSET=ALL"] + [f"{i + 1},{x:.12e},{y:.12e},{z:.12e}" for i, (x, y, z) in enumerate(points)]
deck += ["*ELEMENT,TYPE=C3D8I,ELSET=E"]
deck += [",".join(map(str, [i + 1, *(nodes + 1)])) for i, nodes in enumerate(corners)]
deck += ["*MATERIAL,NAME=M", "*ELASTIC", "1.6e9,0.4", "*EXPANSION,ZERO=200", "1e-4"]
deck += ["*SOLID SECTION,ELSET=E,MATERIAL=M", "*INITIAL CONDITIONS,TYPE=TEMPERATURE", "ALL,200"]
deck += ["*STEP", "*STATIC", "*BOUNDARY", *held, "*TEMPERATURE"]
deck += [f"{i + 1},{t:.12e}" for i, t in enumerate(temperature)]
deck += ["*NODE PRINT,NSET=ALL", "U", "*END STEP", ""]
with tempfile.TemporaryDirectory() as folder:
    Path(folder, "block.inp").write_text("\n".join(deck))
    subprocess.run(["ccx", "block"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
    rows = [line.split() for line in Path(folder, "block.dat").read_text().splitlines()]
theirs = np.array([[float(x) for x in row[1:]] for row in rows if len(row) == 4 and row[0].isdigit()])
if free:
    arms = points[bed] - points[bed].mean(0)
    turns = np.array([[np.cross(axis, arm) for axis in np.eye(3)] for arm in arms])
    matrix = np.concatenate([np.tile(np.eye(3), (len(bed), 1, 1)), turns.transpose(0, 2, 1)], axis=2)
    rigid = np.linalg.lstsq(matrix.reshape(-1, 6), theirs[bed].ravel(), rcond=None)[0]
    theirs = theirs - rigid[:3] - np.cross(rigid[3:], points - points[bed].mean(0))
print("largest difference over the largest displacement:", np.abs(ours - theirs).max() / np.abs(theirs).max())
for place in [(1, 0.5, 1), (1, 1, 1), (0.5, 0.5, 1), (0.5, 1, 0.5)]:
    node = number(*(size * place)) - 1
    print(place, "CalculiX", theirs[node], "crystfem", ours[node])
