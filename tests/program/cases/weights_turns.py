"""Views that nearly coincide modulo a half turn: a turn that ends a little late or early, three turns that jitter, a dense part
beside a coarse one. All see every direction. Right: the disc of density 1 for each, and no note of limited angle."""
import h5py
import numpy as np
from support import disc


def make(folder):
    random = np.random.default_rng(1)
    for name, degrees in (('over', np.linspace(0, 360.05, 721)), ('under', np.linspace(0, 359.9, 361)),
                          ('three_turns_jitter', np.arange(360) * 3 + random.normal(0, .02, 360)),
                          ('dense_sparse', np.r_[np.arange(0, 90, .25), np.arange(90, 180, 1.5)]),
                          ('control', np.linspace(0, 360, 721)), ('wedge', np.arange(0, 140, .5))):
        with h5py.File(folder / f'{name}.h5', 'w') as h:
            h['/exchange/data'] = disc(degrees).astype('f4')
            h['/exchange/data'].attrs['description'] = 'line integrals'
            h['/exchange/theta'] = degrees
            h['/exchange/theta'].attrs['units'] = 'deg'


def check(program):
    for name in ('over', 'under', 'three_turns_jitter', 'dense_sparse', 'control'):
        program.disc(f'{name}.h5')
        notes = program.info(f'{name}.h5').get('report', {}).get('notes', [])
        program.expect(not any('limited angle' in note for note in notes), f'{name}: a note of limited angle: {notes}')
    # A true wedge is told.
    program.notes(program.info('wedge.h5'), 'limited angle')
