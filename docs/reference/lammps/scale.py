"""Time and memory of a force evaluation of an exported elastic body in LAMMPS and of peri's kernel, on this machine.

python scale.py PERI LAMMPS MPIEXEC FOLDER DIMENSION CELLS RANKS [RANKS ...]; LAMMPS' libraries come by LD_LIBRARY_PATH.
A square or cube of CELLS particles along each edge (1 mm apart), bond law `chain-affine`, horizon 3.015. Prints a JSON object a row.
"""
import json, os, re, resource, subprocess, sys, time

peri, lammps, mpiexec, folder, dimension, cells, *ranks = sys.argv[1:]
dimension, cells, steps = int(dimension), int(cells), 10
space = {2: 'plane-stress', 3: 'solid'}[dimension]
low, high = [', '.join(f'"{value}"' for value in side) for side in (["0 mm"] * dimension, [f"{cells} mm"] * dimension)]
scene = f"""version = 1
program = "peri"
title = "Block"
[body]
space = "{space}"
{'thickness = "1 mm"' if dimension == 2 else ''}
spacing = "1 mm"
shapes = [{{ add = "box", min = [{low}], max = [{high}] }}]
[material]
youngs_modulus = "1 MPa"
law = "chain-affine"
links = 720
dissociation = 1200
[[boundary]]
side = "x-"
layers = 3
displacement = [{', '.join(['"0 mm"'] * dimension)}]
[[boundary]]
side = "x+"
layers = 3
displacement = ["{0.01 * cells} mm"{', "0 mm"' * (dimension - 1)}]
[solver]
steps = 1
"""
os.makedirs(folder, exist_ok=True)
os.chdir(folder)
with open('block.toml', 'w') as file:
    file.write(scene)


def run(words):
    """Seconds, peak of the largest process in bytes, output."""
    start = time.time()
    ended = subprocess.run(['/usr/bin/env', 'time', '-f', 'PEAK %M', *words], capture_output=True, text=True)
    if ended.returncode:
        sys.exit(ended.stdout[-2000:] + ended.stderr[-2000:])
    peak = re.findall(r'PEAK (\d+)', ended.stderr)
    return time.time() - start, 1024 * int(peak[-1]), ended.stdout


seconds, peak, text = run([peri, 'export', 'lammps', 'block.toml', '-o', 'block'])
print(json.dumps({'export': text.strip().splitlines()[:1], 'seconds': seconds, 'peak': peak, 'data': os.path.getsize('block/peri.data')}), flush=True)
with open('block/in.scale', 'w') as file:
    file.write(f"include in.peri\nfix move all nve\ntimestep 1e-9\nthermo {steps}\nrun {steps}\n")
os.chdir('block')
for count in ranks:
    seconds, peak, text = run([mpiexec, '-n', count, lammps, '-in', 'in.scale', '-log', 'log.scale', '-var', 'cutoff', '4.0'])
    loop, particles = re.search(r'Loop time of (\S+) on .* for \d+ steps with (\d+) atoms', text).groups()
    part = lambda name: float(re.search(name + r'\s*\|\s*\S+\s*\|\s*(\S+)', text)[1])
    row = {'ranks': int(count), 'particles': int(particles), 'seconds a step': float(loop) / steps, 'bonds': part('Bond') / steps,
           'communication': part('Comm') / steps, 'ghosts': re.search(r'Nghost:\s*(\S+)', text)[1],
           'memory a rank': re.search(r'Per MPI rank memory.*?= (.*)', text)[1], 'peak of a rank': peak, 'whole': seconds}
    print(json.dumps(row), flush=True)
