"""What the cases share: small scans of a disc, the program run on them, and its answers as numbers.

A case is a file NAME.py beside this one: `make(folder)` writes its inputs, `check(program)` holds the program's
answers to the right ones, which the file's head says. run.py runs it, under CTest as case_NAME_test."""
import json
import pathlib
import subprocess

import numpy as np

VIEWS, ROWS, COLUMNS = 120, 5, 65
DEGREES = np.arange(VIEWS) * 1.5
FLAT = 40000  # counts of the open beam


def disc(degrees=DEGREES, center=(8., 5.), radius=10., density=1., columns=COLUMNS, rows=ROWS):
    """Line integrals [view][row][column] of a disc, in columns from the middle; the same in every row."""
    u = np.arange(columns) - .5 * (columns - 1)
    theta = np.radians(np.asarray(degrees, float))[:, None, None]
    along = u[None, None, :] - center[0] * np.cos(theta) - center[1] * np.sin(theta)
    return density * 2 * np.sqrt(np.maximum(radius ** 2 - along ** 2, 0)) * np.ones((1, rows, 1))


def counts_of(integrals, flat=FLAT):
    return np.round(flat * np.exp(-integrals)).astype('u2')


def write_mha(path, samples, spacing=(1, 1, 1), **fields):
    """[view][row][column] as MetaImage."""
    kind = {'uint8': 'MET_UCHAR', 'uint16': 'MET_USHORT', 'int16': 'MET_SHORT', 'float32': 'MET_FLOAT'}[samples.dtype.name]
    lines = {'NDims': 3, 'DimSize': '{2} {1} {0}'.format(*samples.shape), 'ElementSpacing': '{} {} {}'.format(*spacing), **fields,
             'ElementType': kind, 'ElementDataFile': 'LOCAL'}
    head = ''.join(f'{name} = {value}\n' for name, value in lines.items())
    pathlib.Path(path).write_bytes(head.encode() + samples.astype(samples.dtype.newbyteorder('<')).tobytes())


def read_mha(path):
    """Samples [z][y][x], and the fields of the header."""
    data = pathlib.Path(path).read_bytes()
    head, data = data[:data.index(b'LOCAL\n') + 6].decode(), data[data.index(b'LOCAL\n') + 6:]
    fields = dict(line.split(' = ', 1) for line in head.strip().split('\n'))
    assert fields['ElementType'] == 'MET_FLOAT', fields
    shape = [int(n) for n in fields['DimSize'].split()][::-1]
    return np.frombuffer(data, '<f4').reshape(shape), fields


def places(fields):
    """World coordinates x and y of the samples that read_mha gave."""
    origin, spacing = ([float(n) for n in fields[name].split()] for name in ('Offset', 'ElementSpacing'))
    x, y = (origin[a] + spacing[a] * np.arange(int(fields['DimSize'].split()[a])) for a in (0, 1))
    return x[None, :], y[:, None]


class Program:
    """The program, its working folder and what went wrong."""

    def __init__(self, vdvr, folder):
        self.path, self.folder, self.failures = str(vdvr), pathlib.Path(folder), 0

    def expect(self, condition, what):
        if not condition:
            self.failures += 1
            print('FAILED:', what, flush=True)

    def run(self, *words):
        return subprocess.run([self.path, *map(str, words)], capture_output=True, text=True, cwd=self.folder, timeout=300)

    def ok(self, *words):
        run = self.run(*words)
        self.expect(run.returncode == 0, f'{" ".join(map(str, words))}: exit code {run.returncode}: {run.stderr}')
        return run.stdout

    def info(self, scan, *options):
        """What `vdvr info --json` says."""
        out = self.ok('info', scan, '--json', *options)
        return json.loads(out) if out else {}

    def views(self, scan, count, *options):
        """The scan is read and has so many views."""
        found = self.info(scan, *options)
        views = found.get('geometry', {}).get('views')
        self.expect(views == count, f'{scan} {options}: {views} views; {count} are right')
        return found

    def refused(self, *words, names=()):
        """One line, exit code 2, which holds every text of `names`."""
        run = self.run(*words)
        line = run.stderr.strip()
        self.expect(run.returncode == 2, f'{" ".join(map(str, words))}: exit code {run.returncode}; 2 is right: {run.stderr}')
        self.expect('\n' not in line, f'{words}: more than one line: {line}')
        for name in names:
            self.expect(name in line, f"{words}: '{name}' is not in: {line}")
        return line

    def notes(self, found, *parts):
        """One of the notes of `info` holds all of these."""
        notes = found.get('report', {}).get('notes', [])
        self.expect(any(all(p in note for p in parts) for note in notes), f'no note with {parts} among {notes}')

    def volume(self, scan, *options):
        """Samples [z][y][x] of `vdvr reconstruct`, and the header's fields."""
        out = self.folder / 'volume.mha'
        self.ok('reconstruct', scan, '-o', out, '--force', '--quiet', *options)
        return read_mha(out)

    def disc(self, scan, *options, center=(8., 5.), radius=10., density=1., share=.02):
        """`vdvr reconstruct` gives this disc: its mean density within a share, its centroid within a tenth of a
        column, and outside of it as much less. The ramp rings at the rim, so two columns about it are left out."""
        samples, fields = self.volume(scan, *options)
        x, y = places(fields)
        near = np.hypot(x - center[0], y - center[1])
        plane = samples[samples.shape[0] // 2]
        seen = np.hypot(x, y) <= min(np.abs(x).max(), np.abs(y).max()) - 1
        inside, outside = plane[near <= radius - 2].mean(), np.abs(plane[(near >= radius + 2) & seen]).mean()
        weight = np.where(seen & (near < radius + 2), plane, 0)
        at = [float((weight * axis).sum() / weight.sum()) for axis in (x, y)]
        self.expect(abs(inside - density) <= share * density, f'{scan} {options}: density {inside}; {density} is right')
        self.expect(outside <= .1 * density, f'{scan} {options}: {outside} outside of the disc; 0 is right')
        self.expect(np.hypot(at[0] - center[0], at[1] - center[1]) <= .1, f'{scan} {options}: at {at}; {center} is right')
        return plane
