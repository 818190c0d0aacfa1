"""The control of the other cases: one scan as Data Exchange, as NXtomo, as TIFF files and as a stack of line integrals. Right:
each gives the disc, and those of the same counts the same volume."""
import json

import h5py
import numpy as np
import tifffile
from support import DEGREES, FLAT, VIEWS, counts_of, disc, write_mha

FLATS = np.full((2, 5, 65), FLAT, 'u2')
DARKS = np.zeros((2, 5, 65), 'u2')


def make(folder):
    counts = counts_of(disc(density=.03))
    with h5py.File(folder / 'exchange.h5', 'w') as h:
        h['/exchange/data'], h['/exchange/data_white'], h['/exchange/data_dark'] = counts, FLATS, DARKS
        h['/exchange/theta'] = DEGREES
    with h5py.File(folder / 'scan.nx', 'w') as h:
        h['/entry/instrument/detector/data'] = np.concatenate([DARKS, FLATS, counts])
        h['/entry/instrument/detector/image_key'] = [2, 2, 1, 1] + [0] * VIEWS
        h['/entry/sample/rotation_angle'] = np.concatenate([np.zeros(4), DEGREES])
    (folder / 'tiffs').mkdir()
    for k, image in enumerate(counts):
        tifffile.imwrite(folder / f'tiffs/view_{k}.tif', image)
    tifffile.imwrite(folder / 'tiffs/flat.tif', FLATS[0])
    tifffile.imwrite(folder / 'tiffs/dark.tif', DARKS[0])
    (folder / 'tiffs/scan.json').write_text(json.dumps(
        {'projections': 'view_*.tif', 'flats': ['flat.tif'], 'darks': ['dark.tif'], 'angles': DEGREES.tolist()}))
    write_mha(folder / 'stack.mha', disc().astype('f4'))
    (folder / 'angles.txt').write_text('\n'.join(map(str, DEGREES)))


def check(program):
    same = [program.disc(scan, density=.03) for scan in ('exchange.h5', 'scan.nx', 'tiffs')]
    program.expect(all(np.array_equal(same[0], other) for other in same[1:]), 'the same counts give other volumes')
    program.disc('stack.mha', '--angles-file', 'angles.txt')
