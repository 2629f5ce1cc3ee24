"""Runs whole scenes on a graphics card and on the processor, and prints a row of a table for each run.

    cargo build --release -p peri --features gpu
    python3 docs/reference/gpu/whole_runs.py target/release/peri [--small] [RUN ...]

Runs: plate (Kalthoff and Winkler, all devices), large-plate (400 x 800 x 36, horizon ratio 6, card only),
bar-adr and bar-lbfgs (a notched bar of 1e7 particles that tears between equilibria), hole (error against run time of the plate with a hole),
cube (elastic cubes, until the card refuses one). `--small` takes sizes for a program that stands for a card.
Seconds are those of the steps or iterations alone; a run that ends with an error is a row with that.
"""

import json
import math
import pathlib
import subprocess
import sys
import tempfile

CASES = pathlib.Path(__file__).resolve().parents[3] / "cases"
DEVICES = [("cpu", "double"), ("gpu", "double"), ("gpu", "single")]
CARD = DEVICES[1:]

CUBE = """
version = 1
program = "peri"
[body]
space = "solid"
spacing = "1 mm"
shapes = [{ add = "box", min = ["0 mm", "0 mm", "0 mm"], max = ["SIDE mm", "SIDE mm", "SIDE mm"] }]
[material]
youngs_modulus = "1 MPa"
law = "linear"
[[boundary]]
side = "x+"
layers = 1
displacement = ["0.01 mm", "free", "free"]
[solver]
method = "verlet"
[dynamics]
density = "1000 kg/m^3"
end_time = "1 ms"
ramp = "1 ms"
records = 2
device = "cpu"
precision = "double"
[output]
pictures = false
fields = false
"""

BAR = """
version = 1
program = "peri"
[body]
space = "solid"
spacing = "SPACING mm"
shapes = [{ add = "box", min = ["0 mm", "0 mm", "0 mm"], max = ["100 mm", "30 mm", "30 mm"] }]
cracks = [{ from = ["50 mm", "-1 mm", "-1 mm"], to = ["50 mm", "10 mm", "-1 mm"], and = ["50 mm", "-1 mm", "31 mm"] }]
[material]
youngs_modulus = "1 MPa"
law = "linear"
critical = { fracture_energy = "20 J/m^2" }
[[boundary]]
side = "x-"
layers = 3
displacement = ["0 mm", "0 mm", "0 mm"]
[[boundary]]
side = "x+"
layers = 3
displacement = ["10 mm", "0 mm", "0 mm"]
[solver]
method = "METHOD"
steps = 4
tolerance = 1e-4
device = "cpu"
precision = "double"
[output]
pictures = false
fields = false
"""


def scene(case, lines):
    """Text of a case with lines replaced, without what it reports, its studies and expectations."""
    text = (CASES / case / "case.toml").read_text()
    for old, new in lines:
        assert old in text, old
        text = text.replace(old, new)
    ends = (text.find(key) for key in ("\n[report]", "\n[[study]]", "\n[[expect]]"))
    return text[: min(end for end in ends if end > 0)] + "\n"


def plate(spacing, ratio):
    lines = [('spacing = "1.5 mm"', f'spacing = "{spacing} mm"\nhorizon_ratio = {ratio}')]
    text = scene("external/kalthoff-winkler", lines)
    return text.replace('\ndevice = "auto"', '\ndevice = "cpu"\nprecision = "double"')


def hole(spacing):
    lines = [
        ("[solver]", '[solver]\ndevice = "cpu"\nprecision = "double"'),
        ('space = "plane-stress"', f'space = "plane-stress"\nspacing = "{spacing} mm"'),
    ]
    return scene("ch2/plate-with-hole", lines) + "[output]\npictures = false\nfields = false\n"


def runs(small):
    """Name, text and devices of each run."""
    yield "plate", plate(4.5 if small else 0.5, 3.015), DEVICES
    yield "large-plate", plate(4.5 if small else 0.25, 6.015), CARD
    for method in ("adr", "lbfgs"):
        text = BAR.replace("SPACING", "5" if small else "0.21").replace("METHOD", method)
        yield f"bar-{method}", text, DEVICES if small else CARD
    for spacing in (10, 5) if small else (5, 2.5, 1.25, 0.625):
        yield "hole", hole(spacing), DEVICES
    for side in (20, 30) if small else (300, 400, 500, 600, 700):
        yield "cube", CUBE.replace("SIDE", str(side)), CARD


def row(peri, name, text, device, precision):
    if device == "cpu":
        text = text.replace('precision = "double"\n', "")
    text = text.replace('device = "cpu"', f'device = "{device}"')
    text = text.replace('precision = "double"', f'precision = "{precision}"')
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "scene.toml"
        path.write_text(text)
        command = [peri, "run", path, "--output", folder + "/out"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode not in (0, 1):
            return [name, device, precision, " ".join(done.stderr.split())]
        report = json.loads((pathlib.Path(folder) / "out/report.json").read_text())
    one = lambda block, key: next((v for k, v in report[block].items() if k.split("[")[0] == key), None)
    value = lambda key: (one("values", key) or {}).get("value")
    bonds, seconds = one("work", "bond_evaluations"), one("seconds", "solve")
    answers = {key: value(key) for key in ("broken_bonds", "crack_speed", "hardy_rmse_inner", "largest_displacement")}
    crack = [value("crack"), value("crack_across")]
    if all(crack):
        answers["angle"] = math.degrees(math.atan2(*crack))
    found = ", ".join(f"{key} {number:.6g}" for key, number in answers.items() if number is not None)
    counts = [one("work", key) for key in ("particles", "directed_bonds", "iterations", "force_evaluations")]
    return [name, device, precision, *counts, f"{seconds:.2f}", f"{bonds / seconds:.3g}", found]


def main(peri, *chosen):
    head = "run device precision particles bonds iterations forces seconds bonds/s answers".split()
    print("|", " | ".join(head), "|\n|" + "---|" * len(head))
    names = [name for name in chosen if name != "--small"]
    for name, text, devices in runs("--small" in chosen):
        for device, precision in devices if not names or name in names else []:
            print("|", " | ".join(map(str, row(peri, name, text, device, precision))), "|", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
