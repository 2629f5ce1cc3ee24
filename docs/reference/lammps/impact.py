"""Kalthoff and Winkler's plate, whole runs of LAMMPS' peri/pmb and of peri on one thread each, and what breaks.

python impact.py PERI LAMMPS FOLDER [CELLS] (needs numpy, h5py; LAMMPS' libraries come by LD_LIBRARY_PATH). A plate of 100 mm × 200 mm with two
notches, three particles wide so that no bond of LAMMPS crosses them, is hit between them at 32 m/s; CELLS (75) particles along x, seven through
the thickness. E = 191 GPa, ν = 1/4, 8000 kg/m³, G = 42408 J/m², δ = 3.015 Δx, 90 µs in steps of 0.1 µs. Prints a JSON object.
"""
import glob, json, math, os, re, resource, subprocess, sys
import h5py, numpy

peri, lammps, folder, *rest = sys.argv[1:]
cells = int(rest[0]) if rest else 75
spacing = 0.1 / cells
horizon = 3.015 * spacing
bulk = 191e9 / 1.5
stretch = math.sqrt(5 * 42408 / (9 * bulk * horizon))
steps, step = 900, 1e-7

shape = (cells, 2 * cells, 7)
low = numpy.array([-0.05, -0.1, -3.5 * spacing])
points = low + spacing * (0.5 + numpy.stack(numpy.meshgrid(*map(numpy.arange, shape), indexing='ij'), -1).reshape(-1, 3))
# three rows about y = ±25 mm
row = round((0.125 - 0.5 * spacing) / spacing)
notch = [low[1] + spacing * (row - 1 + 0.01), low[1] + spacing * (row + 2 - 0.01)]
inside = (points[:, 0] < -0.01 * spacing) & (abs(points[:, 1]) > notch[0]) & (abs(points[:, 1]) < notch[1])
points = points[~inside]
hit = (points[:, 0] < -0.05 + spacing) & (abs(points[:, 1]) < notch[0])

os.makedirs(folder, exist_ok=True)
os.chdir(folder)
side = lambda x: '[' + ', '.join(f'"{value!r} m"' for value in map(float, x)) + ']'
cuts = ',\n'.join(
    f'{{ cut = "box", min = {side([-0.051, min(a, b), -1])}, max = {side([-0.01 * spacing, max(a, b), 1])} }}'
    for a, b in [notch, [-x for x in notch]])
with open('plate.toml', 'w') as file:
    file.write(f"""version = 1
program = "peri"
title = "Plate hit between two notches"
[body]
space = "solid"
spacing = "{spacing!r} m"
horizon_ratio = 3.015
shapes = [
{{ add = "box", min = {side(low)}, max = {side(-low)} }},
{cuts},
]
[material]
youngs_modulus = "191 GPa"
law = "linear"
volume_correction = "linear"
critical = {{ stretch = {1 + stretch!r} }}
[[boundary]]
name = "hit"
min = {side([-0.051, -notch[0], -1])}
max = {side([-0.05 + spacing, notch[0], 1])}
displacement = {side([32 * steps * step, 0, 0])}
[solver]
method = "verlet"
[dynamics]
density = "8000 kg/m^3"
end_time = "{steps * step!r} s"
ramp = "{steps * step!r} s"
time_step = "{step!r} s"
records = 1
[output]
pictures = false
""")
with open('plate.data', 'w') as file:
    file.write(f"plate\n\n{len(points)} atoms\n2 atom types\n\n")
    for d, name in enumerate('xyz'):
        file.write(f"{float(points[:, d].min()) - spacing} {float(points[:, d].max()) + spacing} {name}lo {name}hi\n")
    file.write("\nAtoms # peri\n\n")
    for k, ((x, y, z), struck) in enumerate(zip(points.tolist(), hit)):
        file.write(f"{k + 1} {2 if struck else 1} {spacing ** 3!r} 8000 {x!r} {y!r} {z!r}\n")
with open('in.plate', 'w') as file:
    file.write(f"""units si
boundary s s s
atom_style peri
atom_modify map array
neighbor {0.1 * spacing!r} bin
lattice sc {spacing!r}
read_data plate.data
pair_style peri/pmb
pair_coeff * * {18 * bulk / (math.pi * horizon ** 4)!r} {horizon!r} {stretch!r} 0.0
group hit type 2
velocity hit set 32 0 0 units box
fix 1 all nve
fix 2 hit setforce 0 0 0
compute damage all damage/atom
timestep {step!r}
thermo {steps}
run {steps}
write_dump all custom damage.dump id c_damage modify sort id format float %.9g
""")


def run(words):
    """Seconds of a processor, output."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    ended = subprocess.run(words, capture_output=True, text=True, env={**os.environ, 'OMP_NUM_THREADS': '1'})
    if ended.returncode:
        sys.exit(ended.stdout[-2000:] + ended.stderr[-2000:])
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, ended.stdout


ours, _ = run([peri, 'run', 'plate.toml', '-o', 'ours', '--threads', '1'])
theirs, text = run([lammps, '-in', 'in.plate', '-log', 'none'])
bonds = int(re.search(r'total # of bonds = (\d+)', text)[1])
with h5py.File(glob.glob('ours/*.vtkhdf')[0]) as file:
    data = file['VTKHDF']
    count = len(points)
    found = data['Points'][:count] - data['PointData']['displacement'][-count:]
    broken = data['PointData']['damage'][-count:]
place = lambda x: numpy.lexsort(numpy.floor((x - low) / spacing).T)
damage = {
    'peri': numpy.array(broken)[place(found)],
    'LAMMPS': numpy.loadtxt('damage.dump', skiprows=9)[place(points), 1],
}
ordered = points[place(points)]
out = {'particles': len(points), 'directed bonds': bonds, 'steps': steps, 'peri, s of a core': ours, 'LAMMPS, s of a core': theirs, 'ratio': theirs / ours}
for name, share in damage.items():
    torn = ordered[share > 0.3]
    end = max(torn, key=lambda x: abs(x[1]), default=[0, 0, 0])
    out[name] = {
        'mean damage': float(share.mean()), 'largest': float(share.max()), 'particles with damage > 0.3': len(torn),
        'end of the cracks, mm': [float(1e3 * x) for x in end]}
out['largest difference of damage'] = float(abs(damage['peri'] - damage['LAMMPS']).max())
out['particles that differ'] = int((abs(damage['peri'] - damage['LAMMPS']) > 1e-6).sum())
print(json.dumps(out, indent=1))
