"""What lies beside the volume shows nothing: an iso value that no sample reaches, a box outside. Right: the picture, exit code 0,
and a note that says where the volume is; a slice outside is refused."""
import json

import numpy as np
from support import write_mha


def make(folder):
    z, y, x = np.mgrid[-12:12, -12:12, -12:12] + .5
    write_mha(folder / 'ball.mha', (2 * np.clip(8.5 - np.sqrt(x * x + y * y + z * z), 0, 1)).astype('f4'))


def check(program):
    def notes(*words):
        out = program.ok('render', 'ball.mha', '-o', 'X.png', '--size', '64x64', '--force', '--json', *words)
        return ' '.join(json.loads(out)['notes']) if out else ''

    def expect(words, *parts):
        found = notes(*words)
        program.expect(all(p in found for p in parts), f'{words}: {found!r} does not say {parts}')

    expect(('--mode', 'iso', '--iso', '99'), '--iso 99', '0 to 2')
    expect(('--mode', 'iso', '--iso', '1,-3'), '--iso -3', '0 to 2')
    expect(('--clip', '100,0,0,110,9,9'), '--clip', 'along x, 0 to 23')
    program.refused('render', 'ball.mha', '-o', 'Y.png', '--mode', 'slice', '--slice-position', '-4', names=('--slice-position -4', '0 to 23 along z'))
    for words in ((), ('--mode', 'iso', '--iso', '1'), ('--clip', '5,5,5,15,15,15'), ('--mode', 'slice', '--slice-position', '23')):
        program.expect(notes(*words) == '', f'{words}: a note on what is there: {notes(*words)}')
    program.expect('note' in program.ok('render', 'ball.mha', '-o', 'Y.png', '--mode', 'iso', '--iso', '99', '--size', '64x64'), 'no note for people')
