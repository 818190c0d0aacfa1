"""Segmentations: 0 outside, one value or labels inside; the same with a value outside that is not 0, and one below it inside; and
densities with one hot sample. Right: every mode of `render` draws the ball, by itself, where its rays meet it."""
import pathlib
import struct
import sys
import zlib

import numpy as np
from support import write_mha

sys.path.insert(0, str(pathlib.Path(__file__).parents[1]))
from served import Served  # noqa: E402

RADIUS, SIDE = 8., 24
EYE = 70.
MODES = ('dvr', 'iso', 'slice', 'mip', 'integral')


def ball():
    z, y, x = np.mgrid[0:SIDE, 0:SIDE, 0:SIDE] - .5 * (SIDE - 1)
    return np.sqrt(x * x + y * y + z * z)


def make(folder):
    r = ball()
    inside = r < RADIUS
    rng = np.random.default_rng(1)
    hot = (rng.normal(1, .02, r.shape) * inside + rng.normal(0, .02, r.shape)).astype('f4')
    hot[12, 12, 12] = 1e7
    for name, samples in {
            'mask': (255 * inside).astype('u1'), 'floats': inside.astype('f4'), 'labels': (inside * (1 + (r < 5) + 3 * (r < 3))).astype('u2'),
            'offset': (1000 + 24 * inside).astype('i2'), 'below': (-1. * inside).astype('f4'), 'hot': hot}.items():
        write_mha(folder / f'{name}.mha', samples, Offset=' '.join([str(-.5 * (SIDE - 1))] * 3))
    for name, value in (('zeros', 0), ('sevens', 7)):
        write_mha(folder / f'{name}.mha', np.full((4, 5, 6), value, 'u1'))


def read_png(path):
    """[row][column][channel] of 8 bits."""
    data, at, packed = path.read_bytes(), 8, b''
    while at < len(data):
        length, kind = struct.unpack('>I4s', data[at:at + 8])
        if kind == b'IHDR':
            width, height, _, colour = struct.unpack('>IIBB', data[at + 8:at + 18])
        if kind == b'IDAT':
            packed += data[at + 8:at + 8 + length]
        at += length + 12
    channels = {0: 1, 2: 3, 6: 4}[colour]
    rows = np.frombuffer(zlib.decompress(packed), 'u1').reshape(height, 1 + width * channels)
    out = np.zeros((height, width, channels), int)
    for y, (kind, *row) in enumerate(rows.tolist()):
        line = np.array(row).reshape(width, channels)
        for x in range(width):
            a = out[y, x - 1] if x else 0 * line[0]
            b = out[y - 1, x] if y else 0 * line[0]
            c = out[y - 1, x - 1] if x and y else 0 * line[0]
            p = a + b - c
            paeth = np.where((abs(p - a) <= abs(p - b)) & (abs(p - a) <= abs(p - c)), a, np.where(abs(p - b) <= abs(p - c), b, c))
            out[y, x] = line[x] + (0, a, b, (a + b) // 2, paeth)[kind] & 255
    return out


def passes_at(size):
    """How far from the ball's centre the ray of each pixel passes; the eye looks along -y, 30 degrees high."""
    half = np.tan(np.radians(15))
    t = (np.arange(size) + .5) / size * 2 - 1
    right, up = np.meshgrid(t * half, t * half)
    return EYE * np.sqrt(right ** 2 + up ** 2) / np.sqrt(1 + right ** 2 + up ** 2)


def check(program):
    size = 60
    camera = ('--camera-position', f'0,{EYE},0', '--camera-focal-point', '0,0,0', '--camera-view-angle', '30', '--size', f'{size}x{size}')
    near = passes_at(size)
    hits, misses = near < RADIUS - 1, near > RADIUS + 1
    for name in ('mask', 'floats', 'labels', 'offset', 'below', 'hot'):
        for mode in MODES:
            picture = program.folder / f'{name}_{mode}.png'
            program.ok('render', f'{name}.mha', '-o', picture, '--mode', mode, '--size', '96x96')
            if (name, mode) in (('below', 'mip'), ('hot', 'integral')):
                continue  # the largest along every ray is what lies around; the window is that of all integrals
            rgb = read_png(picture)[..., :3].sum(axis=2)
            apart = abs(rgb[44:52, 44:52].mean() - rgb[:4, :4].mean())
            program.expect(apart > 60, f'{name}, {mode}: the middle and the corner of the picture are {apart} of 765 apart')
        program.ok('render', f'{name}.mha', '-o', 'dvr.npy', '--force', *camera)
        v = np.load(program.folder / 'dvr.npy')
        # Of labels the least are a veil, and the surface is that of the largest. So is noise around the ball.
        seen = near < 2 if name == 'labels' else hits
        program.expect(v[seen].min() > .2 + v[misses].max(), f'{name}: opacity {v[seen].min()} on the ball, {v[misses].max()} beside it')
        program.expect(v[hits].min() > .03, f'{name}: opacity {v[hits].min()} within the ball')
        program.expect(name == 'hot' or v[misses].max() < .05, f'{name}: opacity {v[misses].max()} beside the ball')
        program.ok('render', f'{name}.mha', '-o', 'iso.npy', '--force', '--mode', 'iso', *camera)
        v = np.load(program.folder / 'iso.npy')
        program.expect(np.isfinite(v[seen]).all() and np.isnan(v[misses]).all(), f'{name}: no surface where the ball is')
    for name in ('zeros', 'sevens'):
        for mode in MODES:
            program.ok('render', f'{name}.mha', '-o', f'{name}_{mode}.png', '--mode', mode, '--size', '64x64')
    served = Served(program.path, program.folder / 'mask.mha')
    for mode in ('dvr', 'iso', 'slice', 'mip'):
        told, image = served.frame({'state': {'width': 64, 'height': 64, 'mode': mode}})
        program.expect(len(image) > 100, f'serve, {mode}: {told}')
    served.interrupt(within=20)
