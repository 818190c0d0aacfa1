"""What a message must say: its remedy by name, and that the remedy works."""
import json

import h5py
import numpy as np
from support import write_mha

VIEWS = 90
DEGREES = np.arange(VIEWS) * 4.
COUNTS, FLATS, DARKS = np.full((VIEWS, 5, 33), 1000, 'u2'), np.full((2, 5, 33), 4000, 'u2'), np.zeros((2, 5, 33), 'u2')


def nxtomo(file, entry, lab=False, unit='mm'):
    detector = file.create_group(entry + '/instrument/detector')
    detector['data'], detector['image_key'] = np.concatenate([DARKS, FLATS, COUNTS]), [2, 2, 1, 1] + [0] * VIEWS
    file[entry + '/sample/rotation_angle'] = np.concatenate([np.zeros(4), DEGREES])
    for name, value in (('detector/x_pixel_size', .8), ('detector/y_pixel_size', .8), ('detector/distance', 100.),
                        ('source/distance', -100.)) if lab else ():
        stored = file.create_dataset(entry + '/instrument/' + name, data=value)
        stored.attrs['units'] = unit


def exchange(path, counts, flats=FLATS, darks=DARKS):
    with h5py.File(path, 'w') as h:
        h['/exchange/data'], h['/exchange/data_white'], h['/exchange/data_dark'] = counts, flats, darks
        h['/exchange/theta'] = DEGREES / 2


def make(folder):
    (folder / 'rtk').mkdir()
    views = ''.join(f'<Projection><GantryAngle>{a}</GantryAngle></Projection>' for a in DEGREES)
    (folder / 'rtk/g.xml').write_text(
        '<RTKThreeDCircularGeometry version="3"><SourceToIsocenterDistance>100</SourceToIsocenterDistance>'
        f'<SourceToDetectorDistance>200</SourceToDetectorDistance>{views}</RTKThreeDCircularGeometry>')
    (folder / 'rtk/scan.json').write_text(json.dumps({'projections': 's.mha', 'description': 'line integrals', 'rtk_geometry': 'g.xml'}))
    ones = np.ones((VIEWS, 33, 65), 'f4')
    write_mha(folder / 'rtk/s.mha', ones, (.8, .8, 1))
    (folder / 'placed').mkdir()
    for name in ('g.xml', 'scan.json'):
        (folder / 'placed' / name).write_bytes((folder / 'rtk' / name).read_bytes())
    write_mha(folder / 'placed/s.mha', ones, (.8, .8, 1), Offset='-25.6 -12.8 0')
    blank = COUNTS.copy()
    blank[40] = 0
    exchange(folder / 'blank.h5', blank)
    blank[70:72] = 0
    exchange(folder / 'three.h5', blank)
    (folder / 'use').mkdir()
    exchange(folder / 'use/s.h5', blank)
    (folder / 'use/scan.json').write_text(json.dumps({'hdf5': 's.h5', 'use': [[0, 40], [41, 70], [72, 90]]}))
    half = COUNTS.copy()
    half[:, :, :11] = 0
    exchange(folder / 'dead.h5', half)
    saturated = FLATS.copy()
    saturated[:, :, 5:9] = 4095
    exchange(folder / 'saturated.h5', COUNTS, saturated)
    with h5py.File(folder / 'two.nx', 'w') as h:
        nxtomo(h, 'entry0000')
        nxtomo(h, 'entry0001')
    with h5py.File(folder / 'lab.nx', 'w') as h:
        nxtomo(h, 'entry', True)
    with h5py.File(folder / 'capitals.nx', 'w') as h:
        nxtomo(h, 'entry', True, 'Millimeters')


def check(program):
    # A stack whose Offset was forgotten.
    program.refused('info', 'rtk', names=["the stack's origin is 0", 'Offset -25.6 -12.8'])
    program.views('placed', VIEWS)
    # Blank frames amid the scan: the ranges that the message gives leave them out.
    for scan, ranges, left in (('blank.h5', '0:40,41:90', 89), ('three.h5', '0:40,41:70,72:90', 87)):
        program.refused('info', scan, names=['projection 40', f'--views {ranges}'])
        program.views(scan, left, '--views', ranges)
    program.views('use', 87)
    program.views('use', 20, '--views', ':10,20:30')
    for ranges in ('5:3', '0:91', '3:8,6:9', 'x', '', '1:2:3', '0:-4'):
        program.refused('info', 'blank.h5', '--views', ranges, names=['views' if ranges in ('x', '', '1:2:3', '0:-4') else 'range'])
    # Two complete scans.
    program.refused('info', 'two.nx', names=['entry0000', 'entry0001', '--entry'])
    program.views('two.nx', VIEWS, '--entry', 'entry0001')
    program.refused('info', 'two.nx', '--entry', 'entry7', names=['entry7', 'entry0000, entry0001'])
    # A laboratory scanner read as parallel beam: said on stderr, too.
    run = program.run('info', 'lab.nx', '--json')
    program.expect(run.returncode == 0 and 'WARNING' in run.stderr and '--beam cone' in run.stderr, f'lab.nx: {run.stderr}')
    found = json.loads(run.stdout)
    program.expect(any('magnification 2' in w for w in found['understood']['warnings']), f"lab.nx: {found['understood']}")
    cones = [program.info(scan, '--beam', 'cone')['cone'] for scan in ('lab.nx', 'capitals.nx')]
    for cone in cones:
        program.expect(abs(cone['magnification'] - 2) < 1e-6, f'magnification {cone.get("magnification")}')
    program.expect('WARNING' not in program.run('info', 'lab.nx', '--beam', 'parallel').stderr, 'a warning of what was stated')
    # A third of the samples dead; saturated flats.
    program.refused('info', 'dead.h5', names=['dead', '33 %'])
    program.notes(program.info('saturated.h5'), 'flats are saturated', '12.1 %', '4095')
