"""Counts in a bare stack, whose format does not say what its values are. Right: whole numbers need a statement, also where they
are stored as floats and no line integral could be so large; with the open beam's level the disc comes out."""
import numpy as np
from support import DEGREES, VIEWS, counts_of, disc, write_mha

LEVEL = 48000
DENSITY = .04


def make(folder):
    counts = counts_of(disc(density=DENSITY, radius=20., columns=65), LEVEL)
    write_mha(folder / 'counts.mha', counts)
    write_mha(folder / 'floats.mha', counts.astype('f4'))
    write_mha(folder / 'integers.mha', np.round(disc()).astype('u1'))
    (folder / 'angles.txt').write_text('\n'.join(map(str, DEGREES)))


def check(program):
    angles = ('--angles-file', 'angles.txt')
    for scan in ('counts.mha', 'floats.mha'):
        program.refused('run', scan, *angles, '--epsilon', '10%', '-o', 'out', names=[scan, 'whole numbers', '--flats LEVEL', '--line-integrals'])
        program.expect(not (program.folder / 'out').exists(), f'{scan}: a folder was written')
        program.disc(scan, *angles, '--flats', LEVEL, '--darks', 'none', radius=20., density=DENSITY)
        program.refused('info', scan, *angles, '--flats', LEVEL, names=['--darks none'])
    program.refused('info', 'counts.mha', *angles, '--transmission', names=['whole numbers', '--flats LEVEL'])
    found = program.views('counts.mha', VIEWS, *angles, '--line-integrals')
    program.notes(found, 'whole numbers', 'counts')
    # Whole numbers that are line integrals, once that is said.
    program.refused('info', 'integers.mha', *angles, names=['--line-integrals'])
    program.disc('integers.mha', *angles, '--line-integrals', share=.05)
