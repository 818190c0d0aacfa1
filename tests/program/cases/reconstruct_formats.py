"""`vdvr reconstruct` to every format that `export` writes to, parallel and cone beam. Right: the same samples in each, to the bit;
their grid where the format has a place for it; nothing of a file that was there before, and nothing half-written."""
import gzip
import json

import h5py
import numpy as np
import tifffile
from support import DEGREES, disc, read_mha, write_mha


def make(folder):
    write_mha(folder / 'stack.mha', disc(rows=7).astype('f4'), spacing=(.5, .5, 1))
    (folder / 'angles.txt').write_text('\n'.join(map(str, DEGREES)))
    (folder / 'cone').mkdir()
    write_mha(folder / 'cone/stack.mha', disc(DEGREES * 2, rows=7).astype('f4'))
    (folder / 'cone/scan.json').write_text(json.dumps(
        {'projections': 'stack.mha', 'description': 'line integrals',
         'geometry': {'source_to_axis': 500, 'source_to_detector': 1000, 'pitch': 1, 'angles': (DEGREES * 2).tolist()}}))


def read_zarr(path):
    meta = json.loads((path / '0/zarr.json').read_text())
    out, chunk = np.zeros(meta['shape'], 'f4'), meta['chunk_grid']['configuration']['chunk_shape']
    for file in (path / '0/c').glob('*/*/*'):
        at = [int(n) * c for n, c in zip(file.relative_to(path / '0/c').parts, chunk)]
        part = np.frombuffer(gzip.decompress(file.read_bytes()), '<f4').reshape(chunk)
        to = out[at[0]:at[0] + chunk[0], at[1]:at[1] + chunk[1], at[2]:at[2] + chunk[2]]
        to[...] = part[:to.shape[0], :to.shape[1], :to.shape[2]]
    return out


def slices(folder):
    return np.stack([tifffile.imread(f) for f in sorted(folder.glob('slice_*.tif'))])


def check(program):
    for name, scan in (('parallel', ('stack.mha', '--angles-file', 'angles.txt')), ('cone', ('cone',))):
        def write(output, *options):
            program.ok('reconstruct', *scan, '-o', output, '--upsampling', '2', '--quiet', *options)
            return program.folder / output

        right, fields = read_mha(write(f'{name}.mha'))
        spacing, origin = ([float(n) for n in fields[f].split()][::-1] for f in ('ElementSpacing', 'Offset'))

        def same(output, found, what=None):
            program.expect(found.shape == right.shape and np.array_equal(found, what if what is not None else right), f'{output}: other samples')

        write(f'{name}.nrrd')
        data = (program.folder / f'{name}.nrrd').read_bytes()
        same('nrrd', np.frombuffer(data[data.index(b'\n\n') + 2:], '<f4').reshape(right.shape))
        same('tif', tifffile.imread(write(f'{name}.tif')))
        folder = write(f'{name}_slices/')
        same('slices', slices(folder))
        about = json.loads((folder / 'volume.json').read_text())
        program.expect(about['spacing'] == spacing and about['origin'] == origin and about['certified'] is False, f'volume.json: {about}')
        with h5py.File(write(f'{name}.h5')) as h:
            same('h5', h['volume'][...])
            program.expect(np.array_equal(h['volume'].attrs['spacing'], spacing) and 'epsilon' not in h['volume'].attrs, 'attributes of h5')
        same('npy', np.load(write(f'{name}.npy')))
        same('raw', np.fromfile(write(f'{name}.raw'), '<f4').reshape(right.shape))
        same('zarr', read_zarr(write(f'{name}.zarr')))
        # Of cone beam little memory adds up views in other parts.
        little = read_mha(write(f'{name}_little.mha', '--max-memory', '60M'))[0]
        same('zarr, little memory', read_zarr(write(f'{name}_little.zarr', '--max-memory', '60M')), little)
        codes = tifffile.imread(write(f'{name}_u16.tif', '--samples', 'u16', '--range=-1,3'))
        program.expect(codes.dtype == 'u2', f'u16: {codes.dtype}')
        program.expect(np.abs(codes * (4 / 65535) - 1 - np.clip(right, -1, 3)).max() <= 2.1 / 65535 + 1e-6, 'u16: more than half a step off')
        same('u16', slices(write(f'{name}_u16/', '--samples', 'u16', '--range=-1,3')), codes)

    # What is there stays, and what cannot be is refused before anything is read.
    words = ('reconstruct', 'stack.mha', '--angles-file', 'angles.txt', '-o')
    program.refused(*words, 'parallel.tif', names=('exists already', '--force'))
    program.refused(*words, 'parallel_slices/', names=('exists already', '--force'))
    program.refused(*words, 'parallel.vtm', names=('bricks',))
    program.refused(*words, 'parallel.doc', names=('.tif', '.zarr'))
    program.refused(*words, 'new.tif', '--samples', 'u16', names=('--range',))
    program.refused(*words, 'new.mha', '--samples', 'u16', '--range', '0,1', names=('f32',))
    program.expect(not list(program.folder.glob('new*')) and not list(program.folder.glob('.*')), 'something of a refused output is left')
    program.ok(*words, 'parallel_slices/', '--force')
    (program.folder / 'parallel_slices/own.txt').write_text('mine')
    program.refused(*words, 'parallel_slices/', '--force', names=('own.txt',))
