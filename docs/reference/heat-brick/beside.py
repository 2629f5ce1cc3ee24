"""Distorted brick of `cargo xtask bench crystfem -- brick --distorted 0.2` by crystfem, scikit-fem and CalculiX on the same mesh.

beside.py [--elements 99] [--step 0.5] [--steps 12] [--solvers NAME,...] [--rounds 1], from the root of the repository.
Needs cargo, ccx, and Python with scikit-fem and scipy (xtask/src/bench/brick.py runs on it).

Prints user seconds of one thread. A step is the difference of a run of --steps and of one of 1 step (scikit-fem: all steps of a
run but the first) over the number of steps between; set-up is all before the first step, for crystfem and CalculiX with making
or reading the mesh. Memory is the peak of the process. Temperatures are compared after the last step.
"""

import argparse
import json
import os
import pathlib
import resource
import statistics
import subprocess
import sys

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[3]
# of address space: a direct solver that wants more fails instead of exhausting the machine
LIMIT = 12_000_000 * 1024
# relative residuals of scikit-fem's Newton iteration and linear solves that leave about crystfem's error (1e-7 K rms a step), by step
TOLERANCES = {0.5: "1e-6 1e-4", 50.0: "1e-7 1e-5"}
DECK = """*INCLUDE,INPUT=brick.inp
*NSET,NSET=NALL,GENERATE
1,{nodes},1
*MATERIAL,NAME=PA12
*CONDUCTIVITY
0.25
*DENSITY
1010
*SPECIFIC HEAT
2200
*PHYSICAL CONSTANTS,ABSOLUTE ZERO=0,STEFAN BOLTZMANN=5.670374419e-8
*SOLID SECTION,ELSET=brick,MATERIAL=PA12
*INITIAL CONDITIONS,TYPE=TEMPERATURE
NALL,493.15
*STEP,INC=100000
*HEAT TRANSFER,DIRECT,SOLVER={solver}
{step},{end}
*BOUNDARY
bottom,11,11,353.15
*FILM
{film}*RADIATE
{radiation}*NODE PRINT,NSET=NALL,FREQUENCY={steps}
NT
*END STEP
"""


def sides(mesh):
    """Element and side of all surfaces but the bottom."""
    inside = False
    with open(mesh) as file:
        for line in file:
            if line.startswith("*"):
                inside = line.startswith("*SURFACE") and "NAME=bottom" not in line
            elif inside:
                yield line.strip().split(",S")


def executable():
    """Of crates/crystfem/benches/measure.rs."""
    build = ["cargo", "build", "--release", "--package=crystfem", "--bench=measure", "--message-format=json"]
    lines = subprocess.run(build, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines()
    return [message["executable"] for message in map(json.loads, lines) if message.get("executable")][-1]


def run(command, folder):
    """User seconds, peak memory in bytes, output; None where it fails."""
    environment = dict(os.environ, OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
    limit = lambda: resource.setrlimit(resource.RLIMIT_AS, (LIMIT, LIMIT))
    with open(folder / "output", "w+") as output:
        process = subprocess.Popen(
            list(map(str, command)), cwd=folder, env=environment, preexec_fn=limit, stdout=output, stderr=output
        )
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = status
        output.seek(0)
        text = output.read()
    return (used.ru_utime, used.ru_maxrss * 1024, text) if status == 0 and "*ERROR" not in text else None


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--elements", type=int, default=99)
    parser.add_argument("--step", type=float, default=0.5)
    parser.add_argument("--steps", type=int, default=12)
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--solvers", default="auto,multigrid,scikit-fem,ITERATIVE SCALING,ITERATIVE CHOLESKY,SPOOLES")
    parser.add_argument("--folder", type=pathlib.Path, default=pathlib.Path("target/heat-brick"))
    options = parser.parse_args()
    folder, nodes = options.folder.resolve(), (options.elements + 1) ** 3
    folder.mkdir(parents=True, exist_ok=True)
    bench = [executable(), "brick", "--threads", 1, "--distorted", 0.2, "--elements", options.elements]
    bench += ["--step", options.step]
    run([*bench, "--steps", 1, "--mesh", "brick.inp"], folder)

    def scikit_fem():
        """As `measure`, from one run."""
        command = [sys.executable, ROOT / "xtask/src/bench/brick.py", "brick.inp", options.steps, "out.csv", options.step]
        command += TOLERANCES.get(options.step, "1e-7 1e-5").split()
        if (ran := run(command, folder)) is None:
            return None
        figures = json.loads(ran[2])
        step = (figures["user_loop"] - figures["user_first"]) / (options.steps - 1)
        return step, figures["user_set_up"], ran[1], np.loadtxt(folder / "out.csv", skiprows=1)

    def once(solver, steps):
        """User seconds, memory, temperatures."""
        if solver in ("auto", "multigrid", "conjugate-gradients", "direct"):
            output = folder / "out.csv"
            ran = run([*bench, "--steps", steps, "--solver", solver, "--temperatures", output], folder)
            return ran and (ran[0], ran[1], np.loadtxt(output, skiprows=1, delimiter=",")[:, 3])
        where = list(sides(folder / "brick.inp"))
        loads = {
            "film": "".join(f"{element},F{side},353.15,15\n" for element, side in where),
            "radiation": "".join(f"{element},R{side},353.15,0.9\n" for element, side in where),
        }
        deck = DECK.format(
            nodes=nodes, solver=solver, step=options.step, end=options.step * steps, steps=steps, **loads
        )
        (folder / "ccx.inp").write_text(deck)
        ran = run(["ccx", "-i", "ccx"], folder)
        return ran and (ran[0], ran[1], np.loadtxt(folder / "ccx.dat", skiprows=3)[:, 1])

    def measure(solver):
        """User seconds of a step and before the first one, memory, temperatures."""
        if solver == "scikit-fem":
            return scikit_fem()
        one, many = once(solver, 1), once(solver, options.steps)
        if one is None or many is None:
            return None
        step = (many[0] - one[0]) / (options.steps - 1)
        return step, one[0] - step, many[1], many[2]

    solvers, found, reference = options.solvers.split(","), {}, None
    for _ in range(options.rounds):
        for solver in solvers:
            if (measured := measure(solver)) is None:
                print(f"{solver}: failed", flush=True)
                continue
            step, set_up, memory, temperatures = measured
            reference = temperatures if reference is None else reference
            apart = np.abs(temperatures - reference).max()
            found.setdefault(solver, []).append((step, set_up, memory, apart, temperatures.mean()))
            print(solver, found[solver][-1], flush=True)
    print("solver | user s/step | over the first | set-up, s | memory, GB | max |ΔT|, K | mean T, K")
    for solver, rounds in found.items():
        step, set_up, memory, apart, mean = map(statistics.median, zip(*rounds))
        first = statistics.median(row[0] for row in found[solvers[0]])
        print(f"{solver} | {step:.3f} | {step / first:.1f} | {set_up:.1f} | {memory / 1e9:.2f} | {apart:.1e} | {mean:.6f}")


main()
