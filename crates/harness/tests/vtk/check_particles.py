"""Reads a VTKHDF particle series with VTK and compares it with what was written.

usage: check_particles.py SERIES.vtkhdf EXPECTED.json

EXPECTED.json holds {"times": [...], "steps": [{"points": [[x, y, z], ...], "arrays": {name: [[...], ...]}}, ...]}.
Every step is visited forwards, backwards and once more at random, because readers cache.
"""

import json
import random
import sys

import vtk
from vtk.util.numpy_support import vtk_to_numpy


def check(condition, message):
    if not condition:
        sys.exit(f"VTK {vtk.vtkVersion().GetVTKVersion()}: {message}")


def main():
    series, expected_file = sys.argv[1:]
    with open(expected_file, encoding="utf-8") as file:
        expected = json.load(file)

    errors = []
    vtk.vtkObject.GlobalWarningDisplayOn()
    reader = vtk.vtkHDFReader()
    reader.AddObserver("ErrorEvent", lambda *_: errors.append("vtkHDFReader reported an error"))
    reader.SetFileName(series)
    reader.UpdateInformation()
    times = reader.GetOutputInformation(0).Get(vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS())
    check(list(times or []) == expected["times"], f"times {times}, expected {expected['times']}")

    count = len(expected["times"])
    order = list(range(count)) + list(reversed(range(count))) + random.Random(1).choices(range(count), k=count)
    for step in order:
        reader.UpdateTimeStep(expected["times"][step])
        data = reader.GetOutputDataObject(0)
        check(not errors, f"step {step}: {errors}")
        check(isinstance(data, vtk.vtkPolyData), f"step {step}: got {type(data)}")
        wanted = expected["steps"][step]
        points = vtk_to_numpy(data.GetPoints().GetData()).tolist()
        check(points == wanted["points"], f"step {step}: points differ")
        check(data.GetNumberOfVerts() == len(points), f"step {step}: {data.GetNumberOfVerts()} vertices")
        check(data.GetNumberOfCells() == len(points), f"step {step}: {data.GetNumberOfCells()} cells")
        for cell in (0, len(points) - 1):
            check(data.GetCell(cell).GetPointId(0) == cell, f"step {step}: cell {cell} has another point")
        arrays = data.GetPointData()
        names = sorted(arrays.GetArrayName(i) for i in range(arrays.GetNumberOfArrays()))
        check(names == sorted(wanted["arrays"]), f"step {step}: arrays {names}")
        for name, values in wanted["arrays"].items():
            array = arrays.GetArray(name)
            check(array.GetNumberOfComponents() == len(values[0]), f"step {step}: components of {name}")
            found = vtk_to_numpy(array).reshape(len(values), -1).tolist()
            check(found == values, f"step {step}: {name} differs")
    print(f"VTK {vtk.vtkVersion().GetVTKVersion()}: {count} steps of {len(points)} particles agree")


main()
