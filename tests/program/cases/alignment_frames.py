"""Frames that were taken again after the scan, to see whether the sample moved: image_key 0, image_key_control -1. Right: they
are left out, with a note, and the volume is that of the file without them."""
import h5py
import numpy as np
from support import DEGREES, FLAT, VIEWS, counts_of, disc

AGAIN = [80, 40, 0]


def make(folder):
    counts = counts_of(disc(density=.03))
    flats, darks = np.full((2, 5, 65), FLAT, 'u2'), np.zeros((2, 5, 65), 'u2')
    for name, keys, again in (('plain', 'both', []), ('align', 'both', AGAIN), ('minus', 'one', AGAIN), ('torn', 'both', [])):
        with h5py.File(folder / f'{name}.nx', 'w') as h:
            detector = h.create_group('entry/instrument/detector')
            moved = [np.roll(counts[[k]], 3, 2) for k in again]
            detector['data'] = np.concatenate([darks, flats, counts, *moved])
            control = np.array([2, 2, 1, 1] + [0] * VIEWS + [-1] * len(again), 'i4')
            if name == 'torn':
                control[9] = 1
            detector['image_key'] = control if keys == 'one' else np.array([2, 2, 1, 1] + [0] * (VIEWS + len(again)), 'i4')
            if keys == 'both':
                detector['image_key_control'] = control
            angles = h.create_dataset('entry/sample/rotation_angle', data=np.concatenate([np.zeros(4), DEGREES, DEGREES[again]]))
            angles.attrs['units'] = 'degree'


def check(program):
    plain = program.disc('plain.nx', density=.03)
    for scan in ('align.nx', 'minus.nx'):
        found = program.views(scan, VIEWS)
        program.notes(found, '3 alignment frames', 'left out')
        program.expect(np.array_equal(program.disc(scan, density=.03), plain), f'{scan}: another volume')
    program.refused('info', 'torn.nx', names=['image_key_control', 'frame 9'])
