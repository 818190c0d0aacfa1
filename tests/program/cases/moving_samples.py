"""NXtomo files that say where the sample was. Right: a sample that stands still, but for noise far below a pixel, is read; a
helix and a series of heights that no direction sees whole are refused, and the part at rest is named; random shifts are followed,
and said (shifts.py has them by value); motion along the beam is refused."""
import h5py
import numpy as np
from support import DEGREES, FLAT, VIEWS, counts_of, disc

PIXEL = 2e-6


def make(folder):
    counts = counts_of(disc(density=.03))
    flats, darks = np.full((2, 5, 65), FLAT, 'u2'), np.zeros((2, 5, 65), 'u2')
    frames, noise = VIEWS + 4, np.random.default_rng(1)
    steps = np.repeat([0., 1e-3, 2e-3], [44, 50, 30])
    for name, axis, at, unit in (('still', 'z', np.full(frames, .0123), 'm'), ('noise', 'x', 5 + noise.uniform(-.05, .05, frames) * 2, 'um'),
                                 ('helix', 'z', np.linspace(0, 1e-3, frames), 'm'), ('heights', 'z', steps, 'm'),
                                 ('shifts', 'x', noise.uniform(-5, 5, frames), 'um'), ('along', 'y', np.linspace(0, .1, frames), 'MM'),
                                 ('one', 'z', np.array([.3]), 'm'), ('outside', 'z', np.array([7.] * 4 + [1.] * VIEWS), 'm')):
        with h5py.File(folder / f'{name}.nx', 'w') as h:
            detector = h.create_group('entry/instrument/detector')
            detector['data'], detector['image_key'] = np.concatenate([darks, flats, counts]), [2, 2, 1, 1] + [0] * VIEWS
            for side in 'xy':
                size = detector.create_dataset(f'{side}_pixel_size', data=PIXEL)
                size.attrs['units'] = 'm'
            h['entry/sample/rotation_angle'] = np.concatenate([np.zeros(4), DEGREES])
            h.create_dataset(f'entry/sample/{axis}_translation', data=at).attrs['units'] = unit


def check(program):
    for scan in ('still', 'noise', 'one', 'outside'):
        found = program.views(f'{scan}.nx', VIEWS)
        program.expect(not any('shifts' in w for w in found['understood']['warnings']), f'{scan}: taken to move')
    for scan in ('helix', 'heights'):
        program.refused('info', f'{scan}.nx', names=['moves by', 'rows', '--views'])
    program.refused('info', 'along.nx', names=['y_translation', 'moves', 'pixels'])
    found = program.views('shifts.nx', VIEWS)
    program.expect(any('shifts' in w and 'columns' in w for w in found['understood']['warnings']), 'shifts.nx: not said')
    program.views('shifts.nx', VIEWS, '--shifts', 'none')
    program.refused('info', 'heights.nx', names=['--views 40:90'])
    program.views('heights.nx', 50, '--views', '40:90')
