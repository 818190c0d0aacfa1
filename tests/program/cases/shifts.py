"""Samples that were moved between views. Right: the disc where it is, by shifts of a file, of HDF5, of scan.json and of NXtomo's
x_translation, and not without them; heights that all views see, by z_translation; certified and verified; one line for shifts of
another length, that are no numbers, in another unit, or that leave no common height."""
import json

import h5py
import numpy as np
from support import COLUMNS, DEGREES, FLAT, ROWS, VIEWS, counts_of, disc, places

MOVED = np.round(np.random.default_rng(4).uniform(-3, 3, VIEWS), 3)
PIXEL = 2e-6


def moved_disc(center=(8., 5.), radius=10.):
    u = np.arange(COLUMNS) - .5 * (COLUMNS - 1)
    theta = np.radians(DEGREES)[:, None, None]
    along = u[None, None, :] - MOVED[:, None, None] - center[0] * np.cos(theta) - center[1] * np.sin(theta)
    return (2 * np.sqrt(np.maximum(radius ** 2 - along ** 2, 0)) * np.ones((1, ROWS, 1))).astype('f4')


def exchange(path, p, **more):
    with h5py.File(path, 'w') as h:
        h['/exchange/data'] = p
        h['/exchange/data'].attrs['description'] = 'line integrals'
        h['/exchange/data'].attrs['center'] = .5 * (COLUMNS - 1)
        h['/exchange/theta'] = DEGREES
        for name, values in more.items():
            h[f'/exchange/{name}'] = values


def nxtomo(path, p, **axes):
    counts = counts_of(.03 * p)
    with h5py.File(path, 'w') as h:
        detector = h.create_group('entry/instrument/detector')
        detector['data'] = np.concatenate([np.zeros((2, ROWS, COLUMNS), 'u2'), np.full((2, ROWS, COLUMNS), FLAT, 'u2'), counts])
        detector['image_key'] = [2, 2, 1, 1] + [0] * VIEWS
        for side in 'xy':
            detector.create_dataset(f'{side}_pixel_size', data=PIXEL).attrs['units'] = 'm'
        h['entry/sample/rotation_angle'] = np.concatenate([np.zeros(4), DEGREES])
        for axis, at in axes.items():
            h.create_dataset(f'entry/sample/{axis}_translation', data=np.concatenate([np.zeros(4), at])).attrs['units'] = 'm'


def make(folder):
    p = moved_disc()
    exchange(folder / 'plain.h5', p)
    exchange(folder / 'own.h5', p, shifts=np.stack([MOVED, 0 * MOVED], 1))
    np.savetxt(folder / 'shifts.txt', MOVED, fmt='%.3f')
    np.savetxt(folder / 'pairs.csv', np.stack([MOVED, 0 * MOVED], 1), fmt='%.3f', delimiter=',')
    with h5py.File(folder / 'shifts.h5', 'w') as h:
        h['/moved'], h['/lengths'] = MOVED, MOVED
        h['/lengths'].attrs['units'] = 'um'
    (folder / 'short.txt').write_text('\n'.join(map(str, MOVED[:-1])))
    (folder / 'nan.txt').write_text('\n'.join(map(str, [*MOVED[:-1], float('nan')])))
    for name, said in (('list', list(MOVED)), ('file', 'shifts.txt'), ('table', [[m, 0.] for m in MOVED]), ('wrong', list(MOVED[:5]))):
        sub = folder / name
        sub.mkdir()
        exchange(sub / 's.h5', p)
        np.savetxt(sub / 'shifts.txt', MOVED, fmt='%.3f')
        (sub / 'scan.json').write_text(json.dumps({'hdf5': 's.h5', 'shifts': said}))
    nxtomo(folder / 'stage.nx', p, x=PIXEL * (MOVED - MOVED[0]))
    nxtomo(folder / 'heights.nx', disc(), z=PIXEL * np.linspace(0, 2.5, VIEWS))
    nxtomo(folder / 'helix.nx', disc(), z=PIXEL * np.linspace(0, 40, VIEWS))


def check(program):
    for scan, *options in (('plain.h5', '--shifts', 'shifts.txt'), ('plain.h5', '--shifts', 'pairs.csv'),
                           ('plain.h5', '--shifts', 'shifts.h5:/moved'), ('own.h5',), ('list',), ('file',), ('table',)):
        program.disc(scan, *options)
    off, sizes = [], []
    for options in (('--shifts', 'shifts.txt'), ()):
        samples, fields = program.volume('plain.h5', *options)
        x, y = places(fields)
        plane, far = samples[samples.shape[0] // 2], np.hypot(x - 8, y - 5)
        near = (np.hypot(x, y) < 26) & (np.abs(far - 10) > 2)
        off.append(np.sqrt(np.mean((plane - (far < 10))[near] ** 2)))
        sizes.append(samples.shape[1])
    program.expect(off[0] < .4 * off[1], f'errors with and without shifts: {off}')
    program.expect(sizes[0] < sizes[1], 'what every view sees is no smaller')
    for name, says in (('short.txt', f'{VIEWS - 1} numbers for {VIEWS} projections'), ('nan.txt', 'nan'),
                       ('shifts.h5:/nothing', 'no such dataset'), ('shifts.h5:/lengths', "units 'um'")):
        program.refused('info', 'plain.h5', '--shifts', name, names=[says])
    program.refused('info', 'wrong', names=["'shifts'", '5 numbers'])
    found = program.info('stage.nx')
    program.expect('x_translation' in ' '.join(found['understood']['warnings']), 'stage.nx: not said')
    found = program.info('heights.nx')
    program.expect(found['geometry']['rows'] == ROWS - 3, f"heights.nx: {found['geometry']['rows']} rows")
    program.notes(found, 'common heights', f'of {ROWS} rows {ROWS - 3}')
    program.refused('info', 'helix.nx', names=['none of', 'seen from every direction', '--views'])
    for scan, *options in (('plain.h5', '--shifts', 'shifts.txt'), ('heights.nx',)):
        program.ok('build', scan, '--epsilon', '10%', '-o', 'v.vdvr', '--force', '--quiet', '--size', '10x10x1', *options)
        said = json.loads(program.ok('verify', 'v.vdvr', '--projections', scan, '--exhaustive', '--json', '--quiet', *options))
        program.expect(said['holds'], f'{scan}: {said}')
    run = program.run('verify', 'v.vdvr', '--projections', 'heights.nx', '--shifts', 'none', '--quiet')
    program.expect(run.returncode != 0, 'verified without the heights that were built')
    program.ok('build', 'own.h5', '--epsilon', '10%', '-o', 'w.vdvr', '--force', '--quiet', '--size', '10x10x1')
    program.expect(program.run('verify', 'w.vdvr', '--projections', 'own.h5', '--shifts', 'none', '--quiet').returncode != 0,
                   'verified without the shifts that were built')
    program.ok('residual', 'own.h5', 'w.vdvr', '-o', 'r.npy', '--rows', '2', '--quiet', '--force')
    # What simulate writes, and reads.
    np.savetxt(program.folder / 'few.txt', MOVED[:24])
    program.ok('simulate', '--phantom', 'sphere', '--detector', '33x9', '--angles', '24', '--shifts', 'few.txt', '-o', 's.h5', '--quiet')
    program.notes(program.info('s.h5'), 'shifts', '/exchange/shifts')
    program.refused('simulate', '--phantom', 'sphere', '--angles', '25', '--shifts', 'few.txt', '-o', 'x.h5', names=['24 numbers for 25'])
