"""`angles` of scan.json beside an HDF5 file whose own angles are missing, or are one for each projection and not for each
frame. Right: both are read, and give the volume of the file that has its angles in it."""
import json

import h5py
import numpy as np
from support import DEGREES, FLAT, VIEWS, counts_of, disc

FLATS = np.full((2, 5, 65), FLAT, 'u2')
DARKS = np.zeros((2, 5, 65), 'u2')


def make(folder):
    counts = counts_of(disc(density=.03))
    with h5py.File(folder / 'whole.h5', 'w') as h:
        h['/exchange/data'], h['/exchange/data_white'], h['/exchange/data_dark'] = counts, FLATS, DARKS
        h['/exchange/theta'] = DEGREES
    for name in ('exchange', 'nxtomo'):
        (folder / name).mkdir()
        (folder / name / 'scan.json').write_text(json.dumps({'hdf5': 's.h5', 'angles': DEGREES.tolist()}))
    with h5py.File(folder / 'exchange/s.h5', 'w') as h:
        h['/exchange/data'], h['/exchange/data_white'], h['/exchange/data_dark'] = counts, FLATS, DARKS
    with h5py.File(folder / 'nxtomo/s.h5', 'w') as h:
        h['/entry/instrument/detector/data'] = np.concatenate([DARKS, FLATS, counts])
        h['/entry/instrument/detector/image_key'] = [2, 2, 1, 1] + [0] * VIEWS
        h['/entry/sample/rotation_angle'] = DEGREES
    (folder / 'angles.txt').write_text('\n'.join(map(str, DEGREES)))
    (folder / 'short.txt').write_text('\n'.join(map(str, DEGREES[1:])))


def check(program):
    whole = program.disc('whole.h5', density=.03)
    for name in ('exchange', 'nxtomo'):
        program.views(name, VIEWS)
        program.expect(np.array_equal(program.disc(name, density=.03), whole), f'{name}: another volume')
    # By themselves: one angle for each projection is unambiguous, no angles are not.
    program.expect(np.array_equal(program.disc('nxtomo/s.h5', density=.03), whole), 'nxtomo/s.h5: another volume')
    program.refused('info', 'exchange/s.h5', names=['/exchange/theta', '--angles-file', "'angles'"])
    program.views('exchange/s.h5', VIEWS, '--angles-file', 'angles.txt')
    program.refused('info', 'exchange/s.h5', '--angles-file', 'short.txt', names=['119 angles', '120 projections'])
