"""Half acquisition: a full turn about an axis off the middle of the detector, which sees the disc whole from one side only. Right:
the disc of density 1 where it is, to either side of the axis, from an odd number of views and from more than a turn; recognised by
axis and arc, and said so, or stated by NXtomo's field, scan.json or an option; one line where it cannot be. And a disc wider than
the detector, whose density in the middle --pad brings nearer."""
import json

import h5py
import numpy as np
from support import disc

WIDE, KEPT = 101, 68  # columns of a detector that would see all of it, and of the one that is there
DISC = {'center': (20., 12.), 'radius': 16.}


def half(degrees, side):
    """Columns of the wide detector from the one edge or the other, and where the axis, its middle, comes to lie."""
    p = disc(degrees, columns=WIDE, **DISC).astype('f4')
    return (p[..., -KEPT:], 50 - (WIDE - KEPT)) if side > 0 else (p[..., :KEPT], 50)


def exchange(path, p, degrees, center=None):
    with h5py.File(path, 'w') as h:
        h['/exchange/data'] = p
        h['/exchange/data'].attrs['description'] = 'line integrals'
        if center is not None:
            h['/exchange/data'].attrs['center'] = float(center)
        h['/exchange/theta'] = degrees
        h['/exchange/theta'].attrs['units'] = 'deg'


def make(folder):
    turn, odd, more = np.arange(360) * 1., np.arange(241) * 360 / 241, np.arange(400) * 1.
    for name, degrees, side in (('right', turn, 1), ('left', turn, -1), ('odd', odd, 1), ('more', more, -1)):
        p, center = half(degrees, side)
        exchange(folder / f'{name}.h5', p, degrees, center)
    p, center = half(turn[:180], 1)
    exchange(folder / 'half_turn.h5', p, turn[:180], center)
    p, center = half(turn, 1)
    exchange(folder / 'narrow.h5', p[..., 14:], turn, center - 14)
    with h5py.File(folder / 'flag.nx', 'w') as h:
        detector = h.create_group('/entry/instrument/detector')
        detector['data'], detector['image_key'], detector['half_acquisition'] = p, [0] * 360, np.uint8(1)
        h['/entry/sample/rotation_angle'] = turn
        h['/entry/sample/rotation_angle'].attrs['units'] = 'degree'
    for name, said in (('yes', True), ('no', False), ('wrong', 'yes')):
        (folder / name).mkdir()
        exchange(folder / name / 's.h5', p, turn, center)
        (folder / name / 'scan.json').write_text(json.dumps({'hdf5': 's.h5', 'half_acquisition': said}))
    exchange(folder / 'cut.h5', disc(np.arange(180.), columns=41, center=(0, 0), radius=30.).astype('f4'), np.arange(180.), 20)


def check(program):
    for name in ('right', 'left', 'odd', 'more'):
        program.disc(f'{name}.h5', **DISC)
        warnings = program.info(f'{name}.h5')['understood']['warnings']
        program.expect(warnings and warnings[0].startswith('half acquisition'), f'{name}: not said: {warnings}')
    program.disc('flag.nx', '--line-integrals', **DISC)
    found = program.info('flag.nx', '--line-integrals')
    program.expect(not found['understood']['warnings'], 'flag.nx: stated, and warned of all the same')
    program.notes(found, 'half acquisition', 'of 68; where opposite views')
    program.disc('yes', **DISC)
    program.expect(program.info('yes')['geometry']['columns'] == KEPT, 'the detector has other columns')
    plain = program.info('no')
    program.expect('longer_rows' not in plain['geometry'], 'scan.json says that it is none')
    program.refused('info', 'wrong', names=['half_acquisition', 'true or false'])
    program.refused('info', 'narrow.h5', names=['overlap by 7.0 columns', '10 are needed'])
    program.refused('plan', 'half_turn.h5', '--epsilon', '3%', '--half-acquisition', 'on', names=['full turn', '--half-acquisition off'])
    # Built, and verified by rows of verify's own.
    for scan, options in (('right.h5', ()), ('cut.h5', ('--pad', 'mirror'))):
        program.ok('build', scan, '--epsilon', '10%', '-o', 'v.vdvr', '--force', '--quiet', '--size', '12x12x2', *options)
        said = json.loads(program.ok('verify', 'v.vdvr', '--projections', scan, '--exhaustive', '--json', '--quiet'))
        program.expect(said['holds'], f'{scan}: {said}')
    program.notes(program.info('cut.h5'), 'do not end in air')
    middle = {}
    for pad in ('none', 'edge', 'mirror'):
        samples, _ = program.volume('cut.h5', '--pad', pad)
        plane = samples[samples.shape[0] // 2]
        n = plane.shape[0] // 2
        middle[pad] = plane[n - 8:n + 9, n - 8:n + 9].mean()
    off = {pad: abs(density - 1) for pad, density in middle.items()}
    program.expect(off['edge'] < .5 * off['none'] and off['mirror'] < off['none'], f'densities {middle}; 1 is right')
