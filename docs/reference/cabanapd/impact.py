"""Whole runs of CabanaPD (PMB) and of peri, the same scene in both: time and what breaks.

python impact.py PERI BESIDE FOLDER [SCENE] [THREADS] [REPEATS] [STEPS] (needs numpy, h5py). BESIDE is beside.cpp, built among CabanaPD's examples.
Prints a JSON object. SCENE is one of
plate (default): Kalthoff and Winkler's plate of ../lammps/impact.py, 75 × 150 × 7 cubic cells, horizon 3.015 cells, K = E/1.5, 32 m/s, 90 µs;
its notches have no width here;
deck: the same plate as CabanaPD's regression test has it, 75 × 151 × 7 cells with unequal sides, horizon 2 mm, K = E, 16 m/s, 70 µs;
cylinder: the fragmenting cylinder of CabanaPD's example with particles at the middles of its cells, without contact; contact: with it.
All first run for 10 µs: in the plates no bond breaks in that time, the cylinder's bonds cannot break then. With LATE set in the
environment, a bond of CabanaPD (without contact) acts once more in the second half of the step in which it breaks, as in peri.
"""
import glob, json, math, os, re, resource, statistics, subprocess, sys, time
import h5py, numpy

peri, beside, folder, *rest = sys.argv[1:]
scene, threads, repeats, most = (rest + ['plate', '1', '1', '0'][len(rest):])[:4]
os.makedirs(folder, exist_ok=True)
os.chdir(folder)
side = lambda x: '[' + ', '.join(f'"{value!r} m"' for value in map(float, x)) + ']'


class Plate:
    speed, step, density = 32, 1e-7, 8000

    def __init__(self, deck):
        self.cells = numpy.array([75, 151 if deck else 150, 7])
        size = numpy.array([0.1, 0.2, 0.009 if deck else 0.7 / 75])
        self.low, self.spacing = -size / 2, size / self.cells
        self.horizon = 0.002 if deck else 3.015 * self.spacing[0]
        self.bulk, self.energy, self.steps = 191e9 if deck else 191e9 / 1.5, 42408, 900
        if deck:
            self.speed, self.steps = 16, 700
        self.stretch = math.sqrt(5 * self.energy / (9 * self.bulk * (self.horizon + 1e-10)))
        self.deck = deck

    def json(self, steps, _):
        return dict(
            low_corner=list(self.low), high_corner=list(-self.low), num_cells=self.cells.tolist(), density=self.density,
            bulk_modulus=self.bulk, fracture_energy=self.energy, horizon=self.horizon, impactor_velocity=self.speed)

    def toml(self, steps, _):
        low, spacing, end = self.low, self.spacing, steps * self.step
        body = f"""spacing = "{float(spacing[0])!r} m"
horizon_ratio = {float((self.horizon + 1e-10) / spacing[0])!r}
shapes = [{{ add = "box", min = {side(low)}, max = {side(-low)} }}]"""
        if self.deck:
            body = f"""grid = {{ min = {side(low)}, max = {side(-low)}, cells = {self.cells.tolist()} }}
horizon = "{self.horizon + 1e-10!r} m\""""
        # CabanaPD also breaks bonds through the rim of a notch
        cracks = ',\n'.join(
            f'{{ from = {side([-0.06, y, -1])}, to = {side([1e-6 * spacing[0], y, -1])}, and = {side([-0.06, y, 1])} }}'
            for y in [low[1] / 4, -low[1] / 4])
        # CabanaPD holds a first layer that is half a cell higher than what it gives a velocity
        edge, depth = -low[1] / 4, low[0] + spacing[0]
        held = [('hit', -edge, edge, self.speed * end), ('above', edge, edge + 0.25 * spacing[0], 0), ('below', -edge - 0.25 * spacing[0], -edge, 0)]
        middles = low[1] + (numpy.arange(self.cells[1]) + 0.5) * spacing[1]
        boundaries = ''.join(f"""
[[boundary]]
name = "{name}"
min = {side([2 * low[0], a, -1])}
max = {side([depth, b, 1])}
displacement = {side([way, 0, 0])}""" for name, a, b, way in held if ((middles > a) & (middles < b)).any())
        return f"""[body]
space = "solid"
{body}
cracks = [
{cracks},
]
{boundaries}
"""


class Cylinder:
    step, density, bulk, stretch, horizon, steps = 1.7e-7, 7800, 130e9, 0.02, 0.00417462, 1411
    spacing = numpy.full(3, 0.001)

    def __init__(self, contact):
        self.contact = contact
        self.low = -numpy.array([0.1, 0.1, 0.15] if contact else [0.04, 0.04, 0.06])
        self.cells = numpy.rint(-2000 * self.low).astype(int)

    def json(self, steps, breaks):
        return dict(
            low_corner=list(self.low), high_corner=list(-self.low), num_cells=self.cells.tolist(), density=self.density,
            bulk_modulus=self.bulk, critical_stretch=self.stretch if breaks else 1e3, horizon=self.horizon,
            contact_radius=0.0009 if self.contact else 0, contact_skin=0.0005,
            cylinder_outer_radius=0.025, cylinder_inner_radius=0.02, cylinder_height=0.1,
            max_radial_velocity=200, min_radial_velocity=50, max_vertical_velocity=100)

    def toml(self, steps, _):
        shape = lambda word, radius: f'{{ {word} = "cylinder", centre = ["0 m", "0 m", "0 m"], radius = "{radius} mm", length = "100 mm", axis = "z" }}'
        radial = '(200 - 50*(z/0.05)^2)*{}/hypot(x, y)'
        return f"""[body]
space = "solid"
spacing = "1 mm"
horizon_ratio = {(self.horizon + 1e-10) / 0.001!r}
shapes = [
{shape('add', 25)},
{shape('cut', 20).replace('100 mm', '200 mm')},
]
{'[contact]' if self.contact else ''}
{'short_range = 15' if self.contact else ''}
[[boundary]]
name = "all"
min = ["-1 m", "-1 m", "-1 m"]
max = ["1 m", "1 m", "1 m"]
velocity_field = ["{radial.format('x')}", "{radial.format('y')}", "100*z/0.05"]
"""


it = Plate(scene == 'deck') if scene in ('plate', 'deck') else Cylinder(scene == 'contact')
it.steps = int(most) or it.steps


def run(words, count):
    """Seconds of the clock and of processors, output."""
    begin, before = time.time(), resource.getrusage(resource.RUSAGE_CHILDREN)
    ended = subprocess.run(words, capture_output=True, text=True, env={**os.environ, 'OMP_NUM_THREADS': count, 'OMP_PROC_BIND': 'false'})
    if ended.returncode or 'RESULT' not in ended.stdout and words[0] == beside:
        sys.exit(ended.stdout[-2000:] + ended.stderr[-2000:])
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    user = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    return time.time() - begin, user, ended.stdout


def place(x):
    """Order of the particles by their cells."""
    return numpy.lexsort(numpy.floor((x - it.low) / it.spacing).T)


def ours(steps, breaks):
    ramp = f'ramp = "{steps * it.step!r} s"' if isinstance(it, Plate) else ''
    with open('scene.toml', 'w') as file:
        file.write(f"""version = 1
program = "peri"
title = "Beside CabanaPD"
{it.toml(steps, breaks)}
[material]
youngs_modulus = "{1.5 * it.bulk!r} Pa"
law = "linear"
critical = {{ stretch = {1 + it.stretch if breaks else 1e3!r} }}
[solver]
method = "verlet"
[dynamics]
density = "{it.density} kg/m^3"
end_time = "{steps * it.step!r} s"
{ramp}
time_step = "{it.step!r} s"
records = 1
[output]
pictures = false
""")
    wall, user, _ = run([peri, 'run', 'scene.toml', '-o', 'ours', '--threads', threads], threads)
    with open('ours/report.json') as file:
        values = {key: entry['value'] for key, entry in json.load(file)['values'].items()}
    with h5py.File(glob.glob('ours/*.vtkhdf')[0]) as file:
        data = file['VTKHDF']
        points = data['Points'][:]
        count = len(points)
        u, damage = data['PointData']['displacement'][-count:], data['PointData']['damage'][-count:]
    order = place(points - u)
    return wall, user, values, u[order], damage[order]


def theirs(steps, breaks):
    deck = {**it.json(steps, breaks), 'final_time': (steps + 0.5) * it.step, 'timestep': it.step, 'output_frequency': steps, 'output_reference': True}
    if 'LATE' in os.environ:
        deck['late'] = 1
    units = lambda key: {'unit': 'm'} if 'corner' in key else {}
    with open('deck.json', 'w') as file:
        json.dump({key: {'value': value, **units(key)} for key, value in deck.items()}, file, default=float)
    wall, user, text = run([beside, 'deck.json'], threads)
    rows = numpy.fromfile('end.bin').reshape(-1, 12)
    return wall, user, json.loads(re.search('RESULT (.*)', text)[1]), rows[place(rows[:, :3])]


def sizes(label):
    count = numpy.sort(numpy.unique(label, return_counts=True)[1])[::-1]
    mass = it.density * it.spacing.prod()
    return {'fragments': int((count > 1).sum()), 'single particles': int((count == 1).sum()),
            'largest masses, g': [float(1e3 * mass * x) for x in count[:5]]}


plate = isinstance(it, Plate)
out = {'scene': scene, 'threads': int(threads)}
early = round(1e-5 / it.step)
_, _, values, u, damage = ours(early, plate)
_, _, result, rows = theirs(early, plate)
still = (rows[:, 0] < it.low[0] + it.spacing[0]) & (abs(rows[:, 1]) < -it.low[1] / 4) if plate else numpy.zeros(len(rows), bool)
held = 0.5 * it.density * it.spacing.prod() * (rows[still, 6:9] ** 2).sum()
out['early'] = {
    'steps': early, 'broken': [float(values['broken_bonds']), result['broken bonds']],
    'largest difference of displacement over largest displacement': float(abs(u - rows[:, 3:6]).max() / abs(u).max()),
    'stored, J': [values['stored_energy'], result['stored, J']],
    'kinetic without held particles, J': [values['kinetic_energy'], result['kinetic, J'] - held]}
times = {'peri': [], 'CabanaPD': []}
for _ in range(int(repeats)):
    wall, user, values, u, damage = ours(it.steps, True)
    times['peri'].append((wall, user))
    wall, user, result, rows = theirs(it.steps, True)
    times['CabanaPD'].append((wall, user))
out |= {'particles': len(rows), 'directed bonds': result['directed bonds'], 'steps': it.steps, 'times, s (wall, processors)': times}
middle = {name: [statistics.median(column) for column in zip(*pairs)] for name, pairs in times.items()}
out['medians, s'] = middle
out['ratio of processors'] = middle['CabanaPD'][1] / middle['peri'][1]
x = rows[:, :3]
theirs_damage = 1 - rows[:, 10] / rows[:, 9]
for name, share, broken, stored in [
        ('peri', damage, values['broken_bonds'], values['stored_energy']),
        ('CabanaPD', theirs_damage, result['broken bonds'], result['stored, J'])]:
    torn = x[share > 0.3]
    it_is = out[name] = {'broken bonds': broken, 'mean damage': float(share.mean()), 'particles with damage > 0.3': len(torn), 'stored, J': stored}
    if plate:
        it_is['largest |y| of damage > 0.3, mm'] = float(1e3 * abs(torn[:, 1]).max()) if len(torn) else 0
        it_is['upper end x, y, mm'] = [float(1e3 * t) for t in torn[torn[:, 1].argmax()]] if len(torn) else 0
out['peri']['kinetic'] = values['kinetic_energy']
out['CabanaPD']['kinetic'] = result['kinetic, J']
if plate:
    out['CabanaPD']['kinetic'] -= 0.5 * it.density * it.spacing.prod() * (rows[still, 6:9] ** 2).sum()
else:
    out['peri'] |= {key: values[key] for key in ('fragments', 'detached_particles')}
    out['CabanaPD'] |= sizes(rows[:, 11])
out['largest difference of damage'] = float(abs(damage - theirs_damage).max())
out['particles that differ'] = int((abs(damage - theirs_damage) > 1e-6).sum())
out['largest difference of displacement, mm'] = float(1e3 * abs(u - rows[:, 3:6]).max())
numpy.savez('ends.npz', x=x, u=u, damage=damage, rows=rows)
print(json.dumps(out, indent=1))
