"""TIFF files whose names hold the angle, in an order that is not that of `angles`; and files that only have numbers. Right: the
contradiction is an error, the angles may be taken from the names, and `info` shows the first, second and last file beside their
angles. An angles file with a byte order mark, of UTF-16 and with Latin-1 in a comment is read; decimal commas are named."""
import json

import tifffile
from support import DEGREES, VIEWS, disc

SIGNED = DEGREES - 90


def make(folder):
    def scan(name, names, angles, integrals, **more):
        (folder / name).mkdir()
        for file, image in zip(names, integrals.astype('f4')):
            tifffile.imwrite(folder / name / file, image)
        (folder / name / 'scan.json').write_text(json.dumps(
            {'projections': '*.tif', 'description': 'line integrals', 'angles': angles, **more}))
        return folder / name

    signed = disc(SIGNED)
    names = [f'p_{a:+.1f}.tif' for a in SIGNED]
    scan('signed', names, SIGNED.tolist(), signed)
    scan('from_names', names, 'names', signed)
    scan('listed', names, SIGNED.tolist(), signed, projections=names)
    scan('shifted', names, DEGREES.tolist(), signed)
    scan('worded', [f'view{k:03d}_{a:05.1f}deg.tif' for k, a in enumerate(DEGREES)], (DEGREES / 2).tolist(), disc())
    scan('both', [f'view{k:03d}_{a:05.1f}deg.tif' for k, a in enumerate(DEGREES)], 'names', disc())
    scan('counted', [f'view_{k}.tif' for k in range(VIEWS)], [float(k) for k in range(VIEWS)][::-1], disc(range(VIEWS)[::-1]))
    angles = '\r\n'.join(map(str, DEGREES))
    for name, text in (('mark', b'\xef\xbb\xbf' + angles.encode()), ('utf16', ('\ufeff' + angles).encode('utf-16-le')),
                       ('latin', b'# Winkel in Grad (\xb0), Pr\xfcfling 3\n' + angles.encode()),
                       ('commas', angles.replace('.', ',').encode()), ('half', b'\xff\xfe1')):
        made = scan(name, [f'p_{k}.tif' for k in range(VIEWS)], 'angles.txt', disc())
        (made / 'angles.txt').write_bytes(text)
    made = scan('described', [f'p_{k}.tif' for k in range(VIEWS)], 'angles.txt', disc())
    (made / 'angles.txt').write_text(angles)
    (made / 'scan.json').write_bytes(b'\xef\xbb\xbf{"projections": "p_*.tif", "description": "line integrals", "angles": "angles.txt", '
                                     b'"comment": "Pr\xfcfling"}')


def check(program):
    for scan in ('signed', 'shifted'):
        program.refused('info', scan, names=['scan.json', "'angles'", '"angles": "names"', 'p_+0.0.tif'])
    program.refused('info', 'worded', names=["'angles'", 'view001_001.5deg.tif', '1.5'])
    for scan in ('from_names', 'listed', 'both', 'mark', 'utf16', 'latin', 'described'):
        program.disc(scan)
    # Numbers that only count the files are no angles, whichever way these run.
    program.views('counted', VIEWS)
    program.refused('info', 'commas', names=['angles.txt', 'decimal comma', '0.0'])
    program.refused('info', 'half', names=['angles.txt'])
    found = program.views('listed', VIEWS)
    frames = [(f['view'], f['name'], round(f['angle_deg'], 6)) for f in found['understood']['frames']]
    right = [(0, 'p_-90.0.tif', -90.0), (1, 'p_-88.5.tif', -88.5), (119, 'p_+88.5.tif', 88.5)]
    program.expect(frames == right, f'frames {frames}; {right} are right')
    text = program.ok('info', 'listed')
    for part in ('p_-90.0.tif', 'p_-88.5.tif', 'p_+88.5.tif', 'in steps of 1.5', 'rising', 'line integrals', 'say otherwise'):
        program.expect(part in text, f"info: '{part}' is not in: {text}")
    program.expect(text.count('\n') <= 24, f'info is longer than a screen: {text}')
