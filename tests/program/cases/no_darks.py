"""Scans without darks (photon counters), without flats, and normalised ones, which have neither. Right: each is read when the
user says so, by an option or in scan.json, gives the disc, and the refusal without that names the remedy."""
import json

import h5py
import numpy as np
import tifffile
from support import DEGREES, FLAT, VIEWS, counts_of, disc, write_mha

FLATS = np.full((2, 5, 65), FLAT, 'u2')
DENSITY = .03


def make(folder):
    integrals = disc(density=DENSITY)
    counts, transmission = counts_of(integrals), np.exp(-integrals).astype('f4')
    for name, frames, key in (('nodark', np.concatenate([FLATS, counts]), [1, 1] + [0] * VIEWS),
                              ('noflat', counts, [0] * VIEWS), ('normalised', transmission, [0] * VIEWS)):
        with h5py.File(folder / f'{name}.nx', 'w') as h:
            h['entry/instrument/detector/data'], h['entry/instrument/detector/image_key'] = frames, key
            h['entry/sample/rotation_angle'] = np.concatenate([np.zeros(len(key) - VIEWS), DEGREES])
    with h5py.File(folder / 'nodark.h5', 'w') as h:
        h['/exchange/data'], h['/exchange/data_white'], h['/exchange/theta'] = counts, FLATS, DEGREES
    with h5py.File(folder / 'minus_log.nx', 'w') as h:
        h['entry/instrument/detector/data'], h['entry/instrument/detector/image_key'] = integrals.astype('f4'), [0] * VIEWS
        h['entry/sample/rotation_angle'] = DEGREES
    write_mha(folder / 'transmission.mha', transmission)
    (folder / 'angles.txt').write_text('\n'.join(map(str, DEGREES)))
    (folder / 'tiffs').mkdir()
    for k, image in enumerate(counts):
        tifffile.imwrite(folder / f'tiffs/p_{k}.tif', image)
    tifffile.imwrite(folder / 'tiffs/flat.tif', FLATS[0])
    (folder / 'tiffs/scan.json').write_text(json.dumps(
        {'projections': 'p_*.tif', 'flats': ['flat.tif'], 'angles': DEGREES.tolist()}))
    for name in ('levels', 'hdf5', 'files'):
        (folder / name).mkdir()
    (folder / 'levels/scan.json').write_text(json.dumps({'hdf5': 's.nx', 'flats': FLAT, 'darks': 'none'}))
    (folder / 'levels/s.nx').write_bytes((folder / 'noflat.nx').read_bytes())
    (folder / 'hdf5/scan.json').write_text(json.dumps({'hdf5': 's.nx', 'description': 'transmission'}))
    (folder / 'hdf5/s.nx').write_bytes((folder / 'normalised.nx').read_bytes())
    (folder / 'files/scan.json').write_text(json.dumps({'hdf5': 's.nx', 'flats': 'flats.mha', 'darks': ['dark.tif']}))
    (folder / 'files/s.nx').write_bytes((folder / 'noflat.nx').read_bytes())
    write_mha(folder / 'files/flats.mha', FLATS)
    tifffile.imwrite(folder / 'files/dark.tif', np.zeros((5, 65), 'u2'))


def check(program):
    for scan in ('nodark.nx', 'nodark.h5', 'tiffs'):
        program.refused('info', scan, names=['dark', '--darks none', "'darks'"])
        program.views(scan, VIEWS, '--darks', 'none')
    whole = program.disc('nodark.nx', '--darks', 'none', density=DENSITY)
    for scan, *options in (('nodark.h5', '--darks', 'none'), ('tiffs', '--darks', 'none'), ('tiffs', '--darks', '0'),
                           ('noflat.nx', '--flats', FLAT, '--darks', 'none'), ('levels',), ('files',)):
        program.expect(np.array_equal(program.disc(scan, *options, density=DENSITY), whole), f'{scan} {options}: another volume')
    program.refused('info', 'noflat.nx', names=['marks no flats (key 1)', '--flats LEVEL', '--transmission'])
    program.refused('info', 'noflat.nx', '--darks', 'none', '--flats', 'none', names=['--flats LEVEL', '1 is the open beam'])
    program.refused('info', 'normalised.nx', names=['marks no flats (key 1)', '--transmission'])
    for scan, *options in (('normalised.nx', '--transmission'), ('normalised.nx', '--darks', 'none', '--flats', 'none'),
                           ('hdf5',), ('transmission.mha', '--angles-file', 'angles.txt', '--transmission'),
                           ('minus_log.nx', '--line-integrals')):
        program.disc(scan, *options, density=DENSITY)
    # A stack of transmissions taken for line integrals is read, and says so.
    found = program.info('transmission.mha', '--angles-file', 'angles.txt')
    program.notes(found, 'transmissions', '`transmission`')
    program.refused('info', 'normalised.nx', '--transmission', '--line-integrals', names=['--transmission', '--line-integrals'])
    program.refused('info', 'hdf5', '--darks', 'none', names=['transmission', '--darks'])
    # The certificate keeps what was stated; verify takes it from there.
    program.ok('build', 'normalised.nx', '--transmission', '--views', '0:60,61:120', '--epsilon', '25%', '--size', '48x48x4', '-o',
               'v.vdvr', '--quiet')
    program.ok('verify', 'v.vdvr', '--projections', 'normalised.nx', '--quiet')
    said = json.loads(program.ok('info', 'v.vdvr', '--json'))['certificate']['options'].get('input')
    program.expect(said == {'views': [[0, 60], [61, 120]], 'values': 'transmission'}, f'certificate: {said}')
    run = program.run('verify', 'v.vdvr', '--projections', 'normalised.nx', '--quiet', '--views', '0:120')
    program.expect(run.returncode == 1 and 'views 0:120' in run.stderr, f'verify with other views: {run.returncode} {run.stderr}')
