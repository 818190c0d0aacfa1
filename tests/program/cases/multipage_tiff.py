"""TIFF files of several images as projections, flats and darks: all in one, some in each of several, one in each; float16.
Right: the disc, and of the same counts the same volume, whatever the files that they lie in."""
import json

import numpy as np
import tifffile
from support import DEGREES, FLAT, VIEWS, counts_of, disc

HALF = VIEWS // 2


def write(path, images):
    tifffile.imwrite(path, images, photometric='minisblack')


def make(folder):
    counts = counts_of(disc(density=.03))
    flats, darks = np.full((3, 5, 65), FLAT, 'u2'), np.zeros((2, 5, 65), 'u2')
    flats[1] += 20
    flats[2] -= 20

    def scan(name, **members):
        (folder / name).mkdir()
        (folder / name / 'scan.json').write_text(json.dumps({'angles': DEGREES.tolist(), **members}))
        return folder / name

    one = scan('one', projections='p_*.tif', flats=['f_*.tif'], darks=['d_*.tif'])
    for prefix, images in (('p', counts), ('f', flats), ('d', darks)):
        for k, image in enumerate(images):
            write(one / f'{prefix}_{k}.tif', image)
    pages = scan('pages', projections='all.tif', flats=['flats.tif'], darks=['darks.tif'])
    for name, images in (('all', counts), ('flats', flats), ('darks', darks)):
        write(pages / f'{name}.tif', images)
    mixed = scan('mixed', projections='p_*.tif', flats=['f_*.tif'], darks=['darks.tif'])
    write(mixed / 'p_0.tif', counts[:HALF])
    write(mixed / 'p_1.tif', counts[HALF])
    write(mixed / 'p_2.tif', counts[HALF + 1:])
    write(mixed / 'f_0.tif', flats[0])
    write(mixed / 'f_1.tif', flats[1:])
    write(mixed / 'darks.tif', darks)
    imagej = scan('imagej', projections='all.tif', flats=['flats.tif'], darks=['darks.tif'])
    for name, images in (('all', counts), ('flats', flats), ('darks', darks)):
        tifffile.imwrite(imagej / f'{name}.tif', images.reshape(1, len(images), 1, *images.shape[1:]), imagej=True)
    part = scan('part', projections='p_*.tif', flats=['f.tif'], darks=['d.tif'], use=[HALF, VIEWS])
    write(part / 'p_0.tif', counts[:HALF])
    write(part / 'p_1.tif', counts[HALF:])
    write(part / 'f.tif', flats)
    write(part / 'd.tif', darks)
    half = scan('half', projections='all.tif', description='line integrals')
    write(half / 'all.tif', disc().astype('f2'))
    other = scan('other_size', projections='all.tif', flats=['flats.tif'], darks=['darks.tif'])
    write(other / 'all.tif', counts)
    write(other / 'flats.tif', flats[:, 1:])
    write(other / 'darks.tif', darks)
    few = scan('few', projections='all.tif', description='line integrals')
    write(few / 'all.tif', disc().astype('f4')[:-1])


def check(program):
    same = [program.disc(name, density=.03) for name in ('one', 'pages', 'mixed', 'imagej')]
    program.expect(all(np.array_equal(same[0], other) for other in same[1:]), 'the same counts give other volumes')
    program.disc('half')
    program.views('part', HALF)
    program.refused('info', 'other_size', names=('flats.tif', '4 rows x 65 columns', '5 x 65'))
    program.refused('info', 'few', names=('120 angles for 119 projections',))
    # Files of which no view is used do not count in the hash; those of flats do.
    def hash_with(name):
        path = program.folder / 'part' / name
        path.write_bytes(path.read_bytes()[:-1] + b'\1')  # of a sample
        return program.info('part')['report']['sha256']

    before = program.info('part')['report']['sha256']
    program.expect(hash_with('p_0.tif') == before, 'a file of which no view is used counts in the hash')
    program.expect(hash_with('f.tif') != before, 'a file of flats does not count in the hash')
