"""Volumes as programs leave them, each 100 x + 10 y + z at (x, y, z): directions with rounding noise, axes in another order or
backwards, unknown spacings, lines to skip, samples that are no numbers, TIFF of several kinds. Right: 534 at (5, 3, 4) of every
file, and one line that says what to do where there is no right answer."""
import struct

import h5py
import numpy as np
import tifffile
from support import write_mha

Z, Y, X = 16, 20, 24


def imagej_stack(path, v, order='<', cut=0):
    """One directory, the images behind each other: what Fiji writes above 4 GiB."""
    text = f'ImageJ=1.54f\nimages={Z}\nslices={Z}\n\0\0'.encode()
    start = 134 + len(text)
    tags = [(256, 4, 1, X), (257, 4, 1, Y), (258, 3, 1, 16), (259, 3, 1, 1), (262, 3, 1, 1), (270, 2, len(text), 134), (273, 4, 1, start),
            (277, 3, 1, 1), (278, 4, 1, Y), (279, 4, 1, X * Y * 2)]
    out = (b'II' if order == '<' else b'MM') + struct.pack(order + 'HIH', 42, 8, len(tags))
    for tag, kind, count, value in tags:
        short = struct.pack(order + 'HH', value, 0) if kind == 3 else struct.pack(order + 'I', value)
        out += struct.pack(order + 'HHI', tag, kind, count) + short
    data = out + struct.pack(order + 'I', 0) + text + v.astype(order + 'u2').tobytes()
    path.write_bytes(data[:len(data) - cut])


def packed_12(v):
    """12-bit samples, the highest bit first, rows from whole bytes."""
    bits = (v[..., None].astype(int) >> np.arange(11, -1, -1)) & 1
    return np.packbits(bits.reshape(*v.shape[:-1], -1).astype('u1'), axis=-1)


def tiff_12(path, v):
    pages = packed_12(v)
    out, start = b'II' + struct.pack('<HI', 42, 8), 8
    for k, page in enumerate(pages):
        tags = [(256, 4, 1, X), (257, 4, 1, Y), (258, 3, 1, 12), (259, 3, 1, 1), (262, 3, 1, 1), (273, 4, 1, start + 114), (277, 3, 1, 1), (278, 4, 1, Y),
                (279, 4, 1, page.nbytes)]
        after = start + 114 + page.nbytes
        ifd = struct.pack('<H', len(tags)) + b''.join(struct.pack('<HHII', *t) for t in tags)
        out += ifd + struct.pack('<I', 0 if k + 1 == len(pages) else after) + page.tobytes()
        start = after
    path.write_bytes(out)


def make(folder):
    z, y, x = np.mgrid[0:Z, 0:Y, 0:X]
    v = (100 * x + 10 * y + z).astype('<i2')
    b = v.tobytes()
    head = f'NRRD0004\ntype: short\ndimension: 3\nsizes: {X} {Y} {Z}\nendian: little\nencoding: raw\n'

    def nrrd(name, lines, data=b, sizes=None):
        text = head if sizes is None else head.replace(f'{X} {Y} {Z}', sizes)
        (folder / name).write_bytes((text + lines + '\n').encode() + data)

    nrrd('noise.nrrd', 'space directions: (1,1e-12,0) (0,1,0) (0,0,1)\n')
    nrrd('nan.nrrd', 'spacings: nan nan nan\n')
    nrrd('perm.nrrd', 'space: left-posterior-superior\nspace directions: (0,1,0) (0,0,1) (1,0,0)\nspace origin: (0,0,0)\n',
         np.ascontiguousarray(v.transpose(2, 0, 1)).tobytes(), f'{Y} {Z} {X}')
    nrrd('mirrored.nrrd', f'space directions: (-1,0,0) (0,1,0) (0,0,-1)\nspace origin: ({X - 1},0,{Z - 1})\n', np.ascontiguousarray(v[::-1, :, ::-1]).tobytes())
    nrrd('oblique.nrrd', 'space directions: (0.9,0.1,0) (-0.1,0.9,0) (0,0,1)\n')
    nrrd('tilted.nrrd', 'space directions: (1,0.001,0) (-0.001,1,0) (0,0,1)\n')
    (folder / 'skip.nhdr').write_text(head + 'line skip: 2\ndata file: skip.raw\n')
    (folder / 'skip.raw').write_bytes(b'a\nb\n' + b)
    (folder / 'far.nhdr').write_text(head + 'line skip: 2000000\ndata file: skip.raw\n')
    write_mha(folder / 'noise.mha', v, TransformMatrix='1 0 0 0 0.999999999999 0 0 6.1e-17 1')
    write_mha(folder / 'mirrored.mha', np.ascontiguousarray(v[:, ::-1]), TransformMatrix='1 0 0 0 -1 0 0 0 1', Offset=f'0 {Y - 1} 0')
    hole = v.astype('<f4')
    hole[0, 0, 0] = np.nan
    hole[2, 1, 3] = np.inf
    write_mha(folder / 'hole.mha', hole)

    imagej_stack(folder / 'one_directory.tif', v)
    imagej_stack(folder / 'big_endian.tif', v, '>')
    imagej_stack(folder / 'cut.tif', v, cut=3)
    tiff_12(folder / 'bits_12.tif', v)
    tifffile.imwrite(folder / 'half.tif', (v / 8).astype('f2'), photometric='minisblack')
    tifffile.imwrite(folder / 'tiles.tif', v, photometric='minisblack', tile=(16, 16), compression='zlib')
    tifffile.imwrite(folder / 'with_thumbnail.tif', v, photometric='minisblack', metadata=None)
    with tifffile.TiffWriter(folder / 'with_thumbnail.tif', append=True) as t:
        t.write(v[0, ::2, ::2], photometric='minisblack', subfiletype=1, metadata=None)
    (folder / 'mixed').mkdir()
    for k, (first, last) in enumerate(((0, 1), (1, 9), (9, 10), (10, 16))):
        tifffile.imwrite(folder / f'mixed/slices {k} é.tif', v[first:last], photometric='minisblack')
    # Signed 16 bits as ImageJ stores them: from 32768 on, with a calibration that says so.
    tifffile.imwrite(folder / 'signed.tif', (v.astype(int) + 32768).astype('u2'), photometric='minisblack',
                     description=f'ImageJ=1.54f\nimages={Z}\nslices={Z}\ncf=0\nc0=-32768.0\nc1=1.0\n', metadata=None)
    tifffile.imwrite(folder / 'colour.tif', np.zeros((4, 5, 6, 3), 'u1'), photometric='rgb')
    tifffile.imwrite(folder / 'palette.tif', np.zeros((4, 5), 'u1'), photometric='palette', colormap=np.zeros((3, 256), 'u2'))
    tifffile.imwrite(folder / 'channels.tif', np.zeros((4, 2, 5, 6), 'u2'), imagej=True, metadata={'axes': 'ZCYX'})
    with tifffile.TiffWriter(folder / 'sizes.tif') as t:
        t.write(v[0], photometric='minisblack', metadata=None)
        t.write(v[1, 1:], photometric='minisblack', metadata=None)
    with h5py.File(folder / 'scaled.h5', 'w') as h:
        h['v'] = v - 40
        h['v'].attrs.update(scale=1., offset=40.)
    (folder / 'link.tif').symlink_to('half.tif')


RIGHT = {'half.tif': 534 / 8, 'link.tif': 534 / 8}


def check(program):
    (program.folder / 'P.csv').write_text('x,y,z\n5,3,4\n')

    def probe(name, *options):
        out = program.folder / 'V.csv'
        out.unlink(missing_ok=True)
        program.ok('probe', name, '--points', 'P.csv', '-o', out, *options)
        return float(out.read_text().split('\n')[1].split(',')[3]) if out.exists() else None

    for name in ('noise.nrrd', 'nan.nrrd', 'perm.nrrd', 'mirrored.nrrd', 'skip.nhdr', 'noise.mha', 'mirrored.mha', 'one_directory.tif', 'big_endian.tif',
                 'bits_12.tif', 'half.tif', 'tiles.tif', 'with_thumbnail.tif', 'mixed', 'signed.tif', 'scaled.h5:/v', 'link.tif'):
        right, found = RIGHT.get(name, 534), probe(name)
        program.expect(found == right, f'{name}: {found}; {right} is right')
    found = probe('hole.mha', '--nan-as', '-5')
    program.expect(found == 534, f'hole.mha: {found}; 534 is right')
    (program.folder / 'P.csv').write_text('x,y,z\n0,0,0\n')
    found = probe('hole.mha', '--nan-as', '-5')
    program.expect(found == -5, f'the hole: {found}; -5 is right')
    program.refused('info', 'hole.mha', names=('2 of 7680 samples', 'column 0, row 0, slice 0', '--nan-as 0'))
    program.refused('info', 'oblique.nrrd', names=('oblique', 'resample'))
    program.refused('info', 'tilted.nrrd', names=('oblique', 'resample', '0.019'))
    program.refused('info', 'far.nhdr', names=('line skip',))
    program.refused('info', 'cut.tif', names=('truncated',))
    program.refused('info', 'colour.tif', names=('3 samples per pixel', 'greyscale'))
    program.refused('info', 'palette.tif', names=('palette', 'greyscale'))
    program.refused('info', 'channels.tif', names=('2 channels', 'Split Channels'))
    program.refused('info', 'sizes.tif', names=('24 x 19 pixels', '24 x 20'))
