"""Builds DES_thermal_model (MIT) in FOLDER, prints 40 layers of its wall, and prints temperatures at 7000 s in
the middle of five layers: python3 peer.py FOLDER. FOLDER/src: github.com/linus131/DES_thermal_model @cfccaa4."""

import bisect
import re
import subprocess
import sys
from pathlib import Path

LAYERS, ALONG, MIDDLE = 40, 47, 23
folder = Path(sys.argv[1])
source, run = folder / "src", folder / "run"
if (source / "src/Interpolator.rs").exists():
    (source / "src/Interpolator.rs").rename(source / "src/interpolator.rs")
# the film coefficient of its input file instead of one that grows with height
main = source / "src/main.rs"
main.write_text(main.read_text().replace("model_orthotropic_td_shc_variable_h::", "model_orthotropic_td_shc::"))
subprocess.run(["cargo", "build", "--release"], cwd=source, check=True)
(run / "inputfiles").mkdir(parents=True, exist_ok=True)
(run / "outputfiles").mkdir(exist_ok=True)
for file in (source / "inputfiles").iterdir():
    text = file.read_text()
    if file.name == "wall.gcode":
        text = "".join(re.split(r"(?m)(?=^G1 Z[\d.]+ F2$)", text)[: LAYERS + 1])
    if file.name == "Input_file.txt":
        text = text.replace("Number_of_threads: 0", "Number_of_threads: 1")
        text = text.replace("time_step: 1.0", f"time_step: {sys.argv[2] if len(sys.argv) > 2 else 0.05}")
    (run / "inputfiles" / file.name).write_text(text)
subprocess.run([(source / "target/release/DES_thermal_simulation").resolve()], cwd=run, check=True)
lines = (run / "outputfiles/elem_temps.csv").read_text().splitlines()
for layer in (1, 10, 20, 30, 38):
    row = [float(cell) for cell in lines[(layer - 1) * ALONG + MIDDLE].split(",") if cell]
    times, kelvin = row[0::2], row[1::2]
    k = bisect.bisect(times, 7000.0)
    part = (7000.0 - times[k - 1]) / (times[k] - times[k - 1])
    print(layer, round(kelvin[k - 1] + part * (kelvin[k] - kelvin[k - 1]) - 273.15, 2))
