"""A sample taller than the detector, in stands and on a helix. Right: a ball of density 1 where it is, whole, by NXtomo's
z_translation, by shifts of a file and of HDF5; as many views as one stand has where these look alike; noise from the flats;
certified, verified and compared with the measured rows; half acquisition recognised, and said; one line where heights are missing."""
import json

import h5py
import numpy as np
from support import FLAT, counts_of

COLUMNS, ROWS, PIXEL = 49, 12, 2e-6
BALL, RADIUS = (5., 3., 1.), 11.


def ball(degrees, moved, columns=COLUMNS, center=None, density=1.):
    """[view][row][column]; `moved`: how far the ball stands towards higher rows, by view; z counts from the detector's middle."""
    u = np.arange(columns) - (.5 * (columns - 1) if center is None else center)
    v = np.arange(ROWS) - .5 * (ROWS - 1)
    theta = np.radians(np.asarray(degrees, float))[:, None, None]
    along = u[None, None, :] - BALL[0] * np.cos(theta) - BALL[1] * np.sin(theta)
    height = v[None, :, None] - BALL[2] - np.asarray(moved, float)[:, None, None]
    return (density * 2 * np.sqrt(np.maximum(RADIUS ** 2 - along ** 2 - height ** 2, 0))).astype('f4')


def stands(steps, arc, views):
    return np.tile(np.arange(views) * arc / views, len(steps)), np.repeat(steps, views)


def exchange(path, degrees, moved, center=.5 * (COLUMNS - 1), columns=COLUMNS):
    with h5py.File(path, 'w') as h:
        h['/exchange/data'] = ball(degrees, moved, columns, center)
        h['/exchange/data'].attrs['description'] = 'line integrals'
        h['/exchange/data'].attrs['center'] = float(center)
        h['/exchange/theta'] = degrees
        h['/exchange/theta'].attrs['units'] = 'deg'
        h['/exchange/shifts'] = np.stack([0 * moved, moved], 1)


def nxtomo(path, degrees, moved):
    views, random = len(degrees), np.random.default_rng(3)
    counts = np.concatenate([np.zeros((10, ROWS, COLUMNS)), random.poisson(FLAT, (10, ROWS, COLUMNS)),
                             random.poisson(counts_of(ball(degrees, moved, density=.05)))]).astype('u2')
    with h5py.File(path, 'w') as h:
        detector = h.create_group('entry/instrument/detector')
        detector['data'], detector['image_key'] = counts, [2] * 10 + [1] * 10 + [0] * views
        for side in 'xy':
            detector.create_dataset(f'{side}_pixel_size', data=PIXEL).attrs['units'] = 'm'
        h['entry/sample/rotation_angle'] = np.concatenate([np.zeros(20), degrees])
        at = np.concatenate([np.zeros(20), PIXEL * (moved - moved[0])])
        h.create_dataset('entry/sample/z_translation', data=at).attrs['units'] = 'm'


def make(folder):
    degrees, moved = stands([-8., 0., 8.], 180., 90)
    nxtomo(folder / 'stands.nx', degrees, moved)
    exchange(folder / 'stands.h5', degrees, moved + .3)
    turned = degrees + np.repeat([0., .6, 1.1], 90)
    exchange(folder / 'turned.h5', turned, moved)
    views = np.arange(420)
    exchange(folder / 'helix.h5', views * 3., (views - 209.5) / 120 * 10)
    exchange(folder / 'gap.h5', *stands([-15., 15.], 180., 40))
    exchange(folder / 'steep.h5', views * 3., (views - 209.5) / 120 * 40)
    exchange(folder / 'half.h5', *stands([-8., 0., 8.], 360., 180), center=10., columns=36)


def check(program):
    def right(scan, *options, share=.02, scale=1.):
        samples, fields = program.volume(scan, *options)
        spacing = [float(s) for s in fields['ElementSpacing'].split()]
        origin = [float(s) for s in fields['Offset'].split()]
        z, y, x = (np.moveaxis(origin[a] + spacing[a] * np.arange(samples.shape[2 - a])[:, None, None], 0, 2 - a) / spacing[2]
                   for a in (2, 1, 0))
        first = program.info(scan, *options)['geometry']['series']
        # The scan's middle, in rows from the first view's, where it stood.
        moved = {'stands.nx': -8., 'stands.h5': -7.7, 'turned.h5': -8., 'helix.h5': -209.5 / 12, 'half.h5': -8.}[scan]
        middle = first['first'] + .5 * (samples.shape[0] - 1) - .5 * (ROWS - 1)
        height = BALL[2] + moved - middle
        near = np.sqrt((x - BALL[0]) ** 2 + (y - BALL[1]) ** 2 + (z - height) ** 2)
        inside, outside = samples[near < RADIUS - 2].mean(), np.abs(samples[(near > RADIUS + 2) & (np.hypot(x, y) < 16)]).mean()
        program.expect(abs(inside - scale) < share * scale and outside < .1 * scale, f'{scan}: {inside} inside, {outside} outside')
        weight = np.where(near < RADIUS + 1, samples, 0)
        for axis, at, true in (('x', x, BALL[0]), ('y', y, BALL[1]), ('z', z, height)):
            found = float((weight * at).sum() / weight.sum())
            program.expect(abs(found - true) < .15, f'{scan}: the ball lies at {axis} {found}, not {true}')
        return samples.shape[0]

    density = .05 / PIXEL
    for scan, views, heights, scale in (('stands.nx', 90, 28, density), ('stands.h5', 90, 28, 1.), ('turned.h5', 270, 28, 1.),
                                        ('helix.h5', 120, 32, 1.)):
        found = program.views(scan, views)
        rows = found['geometry']['rows']
        program.expect(rows >= heights and rows == right(scan, scale=scale), f'{scan}: {rows} heights')
        program.notes(found, 'series of heights', 'seen from every direction')
    program.expect('from repeated flats' in program.ok('info', 'stands.nx'), 'stands.nx: no noise from the flats')
    two = [program.volume('stands.h5', '--views', '0:180', *options)[0].shape[0] for options in ((), ('--heights', 'common'))]
    program.expect(two == [20, 4], f'stands.h5: {two} rows')
    for scan, *options in (('stands.nx',), ('helix.h5',)):
        program.ok('build', scan, '--epsilon', '10%', '-o', 'v.vdvr', '--force', '--quiet', '--size', '10x10x12', *options)
        said = json.loads(program.ok('verify', 'v.vdvr', '--projections', scan, '--exhaustive', '--json', '--quiet'))
        program.expect(said['holds'], f'{scan}: {said}')
        program.ok('residual', scan, 'v.vdvr', '-o', 'r.npy', '--rows', '2', '--quiet', '--force')
        rest = np.load(program.folder / 'r.npy')
        program.expect(np.isfinite(rest).any(), f'{scan}: no residual')
        program.ok('center', scan, '-o', 'sheet.png', '--force', '--quiet')
    run = program.run('verify', 'v.vdvr', '--projections', 'helix.h5', '--shifts', 'none', '--quiet')
    program.expect(run.returncode != 0, 'verified without the heights that were built')
    program.refused('info', 'gap.h5', names=['moves by 30 rows', 'what lies between is not', '--views'])
    program.refused('info', 'steep.h5', names=['none of', 'seen from every direction', '--views'])
    right('half.h5')
    warnings = program.info('half.h5')['understood']['warnings']
    program.expect(any(w.startswith('half acquisition') for w in warnings), f'half.h5: not said: {warnings}')
    program.refused('plan', 'half.h5', '--epsilon', '10%', '--half-acquisition', 'on', '--views', '0:90',
                    names=['half acquisition', 'full turn'])
    program.refused('plan', 'stands.h5', '--epsilon', '10%', '--heights', 'all', '--axis-roll', '1', names=['leans', '--heights'])
