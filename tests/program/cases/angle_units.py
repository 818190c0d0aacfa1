"""Angles that cannot be what they say. Right: all views at one angle are refused; radians without a unit are refused; degrees
where ASTRA means radians are refused, and so are degrees that a file calls radians; units spelled with capitals are read; what
is stated wins."""
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
    # Steps of 1 degree and a half turn, as a file may hold them by mistake.
    write('wrong_unit', DEGREES, 'rad')
    np.savetxt(folder / 'radians.txt', np.radians(DEGREES))
    listed = folder / 'listed'
    listed.mkdir()
    write_mha(listed / 's.mha', disc().astype('f4'))
    (listed / 'scan.json').write_text(json.dumps(
        {'projections': 's.mha', 'description': 'line integrals', 'angles': np.radians(DEGREES).tolist(), 'angle_unit': 'radians'}))
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
    program.refused('reconstruct', 'wrong_unit.h5', '-o', 'v.mha', names=['--angle-unit degrees'])
    program.disc('wrong_unit.h5', '--angle-unit', 'degrees')
    program.disc('radians.h5', '--angle-unit', 'radians')
    program.disc('zeros.h5', '--angles-file', 'radians.txt', '--angle-unit', 'radians')
    program.disc('listed')
    program.refused('info', 'radians.h5', '--angle-unit', 'turns', names=['degrees or radians'])
    program.refused('info', 'astra_deg', '--angle-unit', 'degrees', names=['astra', 'angle-unit'])
