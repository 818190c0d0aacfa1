"""Angles that cannot be what they say. Right: all views at one angle are refused; radians without a unit are refused; degrees
where ASTRA means radians are refused; units spelled with capitals are read."""
import json

import h5py
import numpy as np
from support import DEGREES, VIEWS, disc, write_mha


def make(folder):
    def write(name, theta, units):
        with h5py.File(folder / f'{name}.h5', 'w') as h:
            h['/exchange/data'] = disc().astype('f4')
            h['/exchange/data'].attrs['description'] = 'line integrals'
            h['/exchange/theta'] = theta
            if units:
                h['/exchange/theta'].attrs['units'] = units

    write('zeros', DEGREES * 0, 'deg')
    write('radians', np.radians(DEGREES), None)
    for name, theta in (('Degrees', DEGREES), ('DEG', DEGREES), ('Radians', np.radians(DEGREES))):
        write(name, theta, name)
    scan = folder / 'astra_deg'
    scan.mkdir()
    write_mha(scan / 's.mha', disc().astype('f4'))
    (scan / 'g.json').write_text(json.dumps(
        {'type': 'cone', 'DetectorSpacingX': .8, 'DetectorSpacingY': .8, 'DetectorRowCount': 5, 'DetectorColCount': 65,
         'ProjectionAngles': np.linspace(0, 360, VIEWS, endpoint=False).tolist(), 'DistanceOriginSource': 100,
         'DistanceOriginDetector': 100}))
    (scan / 'scan.json').write_text(json.dumps({'projections': 's.mha', 'description': 'line integrals', 'astra': 'g.json'}))


def check(program):
    program.refused('reconstruct', 'zeros.h5', '-o', 'v.mha', names=['one direction'])
    program.refused('reconstruct', 'radians.h5', '-o', 'v.mha', names=['radians'])
    program.refused('reconstruct', 'astra_deg', '-o', 'v.mha', names=['radians'])
    program.expect(not (program.folder / 'v.mha').exists(), 'a refused scan left a volume')
    for name in ('Degrees', 'DEG', 'Radians'):
        program.disc(f'{name}.h5')
