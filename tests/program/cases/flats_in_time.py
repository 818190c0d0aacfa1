"""Flats taken before, between and after the projections of a beam that changes, and its current. Right: the disc of density 1, flat
where it is flat, by flats interpolated in the order of frames; off by their mean. NXtomo's image_key and control/data, scan.json's
'flats_at' and 'beam_current', and what `simulate` writes; one line for what does not fit; built, verified, and said."""
import json

import h5py
import numpy as np
from support import COLUMNS, DEGREES, FLAT, ROWS, VIEWS, disc

RUNS = (0, 60, VIEWS)  # projections before each run of two flats


def frames(decay=.0, drift=.3):
    """Frames in order, their keys, and the beam's current in each."""
    order = []
    for k in range(VIEWS + 1):
        order += [(1, -1)] * (2 * RUNS.count(k))
        order += [(0, k)] if k < VIEWS else []
    order = [(2, -1)] + order
    p, out, current = disc(density=.03), [], []
    x = np.linspace(-1, 1, COLUMNS)
    for i, (key, k) in enumerate(order):
        time = i / (len(order) - 1)
        beam = 1 - decay * time
        open_beam = FLAT * beam * (1 + drift * time * x) * np.ones((ROWS, 1))
        out.append(np.zeros((ROWS, COLUMNS)) if key == 2 else np.round(open_beam * (np.exp(-p[k]) if key == 0 else 1)))
        current.append(.2 * beam)
    return np.array(out, 'u2'), [key for key, _ in order], np.array(current), order


def nxtomo(path, data, keys, order, current=None):
    with h5py.File(path, 'w') as h:
        detector = h.create_group('entry/instrument/detector')
        detector['data'], detector['image_key'] = data, keys
        h['entry/sample/rotation_angle'] = [DEGREES[k] if k >= 0 else 0. for _, k in order]
        if current is not None:
            h['entry/control/data'] = current


def make(folder):
    data, keys, _, order = frames()
    nxtomo(folder / 'drift.nx', data, keys, order)
    faded, _, current, _ = frames(decay=.5, drift=.0)
    nxtomo(folder / 'fading.nx', faded, keys, order, current)
    for name, bad in (('short', current[:-1]), ('zero', np.where(np.arange(len(keys)) == 7, 0, current)), ('minus', -current)):
        nxtomo(folder / f'{name}.nx', faded, keys, order, bad)
    keys = np.array(keys)
    for name, said in (('stated', {'flats_at': [r for r in RUNS for _ in range(2)]}), ('few', {'flats_at': [0, 60]}),
                       ('beyond', {'flats_at': [0, 0, 60, 60, VIEWS, VIEWS + 1]}), ('unsaid', {}),
                       ('currents', {'beam_current': [1.] * (VIEWS + 6)}), ('lacking', {'beam_current': [1.] * VIEWS})):
        sub = folder / name
        sub.mkdir()
        with h5py.File(sub / 's.h5', 'w') as h:
            h['/exchange/data'], h['/exchange/data_white'], h['/exchange/data_dark'] = data[keys == 0], data[keys == 1], data[keys == 2]
            h['/exchange/theta'] = DEGREES
        (sub / 'scan.json').write_text(json.dumps({'hdf5': 's.h5', **said}))
    with h5py.File(folder / 'shape.h5', 'w') as h:
        h['/exchange/data'], h['/exchange/data_dark'] = data[keys == 0], data[keys == 2]
        h['/exchange/data_white'], h['/exchange/theta'] = data[keys == 1][:, :, 1:], DEGREES


def check(program):
    for scan in ('drift.nx', 'stated'):
        found = program.info(scan)
        program.notes(found, 'flats in time: 6 flats in 3 runs', '`flats_in_time` off')
        program.disc(scan, density=.03)
    # The mean of all flats tilts the air and the disc in it: more than what is promised above.
    flat, tilted = (program.volume('drift.nx', *more)[0] for more in ((), ('--flats-in-time', 'off')))
    middle = flat.shape[0] // 2
    program.expect(np.abs(flat - tilted)[middle].max() > .0003, 'the mean of all flats makes no difference')
    program.expect(not any('flats in time' in note for note in program.info('unsaid')['report']['notes']), 'unsaid: an order is taken')
    program.refused('reconstruct', 'unsaid', '-o', 'x.mha', '--flats-in-time', 'on', names=['flats_at'])
    program.refused('info', 'few', names=['2 numbers for 6 flats'])
    program.refused('info', 'beyond', names=[f'from 0 to the {VIEWS}'])
    program.refused('info', 'shape.h5', names=['data_white', f'{COLUMNS - 1}'])
    found = program.info('fading.nx')
    program.notes(found, 'beam current', 'control/data', '`beam_current` none')
    program.disc('fading.nx', density=.03)
    program.disc('fading.nx', '--flats-in-time', 'off', density=.03)  # the current alone does it
    program.disc('fading.nx', '--beam-current', 'none', density=.03)  # and so do the flats
    program.notes(program.info('currents'), 'beam current')
    program.refused('info', 'lacking', names=[f'{VIEWS} numbers for {VIEWS} projections and 6 flats'])
    for scan, says in (('short', 'currents of the beam for'), ('zero', '0 in projection'), ('minus', 'in projection 0')):
        program.refused('info', f'{scan}.nx', names=['control/data', says, '--beam-current none'])
        program.views(f'{scan}.nx', VIEWS, '--beam-current', 'none')
    # Built, said and verified; and not by what was not recorded.
    program.ok('build', 'drift.nx', '--epsilon', '10%', '-o', 'v.vdvr', '--force', '--quiet', '--size', '10x10x1')
    program.expect('flats in time' in program.ok('info', 'v.vdvr'), 'info of the volume does not say it')
    said = json.loads(program.ok('verify', 'v.vdvr', '--projections', 'drift.nx', '--json', '--quiet'))
    program.expect(said['holds'], f'{said}')
    run = program.run('verify', 'v.vdvr', '--projections', 'drift.nx', '--flats-in-time', 'off', '--quiet')
    program.expect(run.returncode != 0, 'verified by the mean of all flats')
    # What simulate writes.
    program.ok('simulate', '--phantom', 'sphere', '--photons', '1e7', '--detector', '33x9', '--angles', '48', '--flat-runs', '3',
               '--flat-drift', '0.2', '--beam-decay', '0.3', '-o', 'simulated.h5', '--quiet')
    found = program.info('simulated.h5')
    program.notes(found, 'flats in time: 30 flats in 3 runs')
    program.notes(found, 'beam current')
    program.refused('simulate', '--phantom', 'sphere', '--flat-runs', '2', '-o', 'x.h5', names=['--flat-runs', '--photons'])
