#!/usr/bin/env python3
"""A brick whose total build found on gold and on finer gold, each in some of its cells: `verify` confirms it.

usage: totals_by_cells.py VDVR

Of this scan no one rate of gold gives brick 37 so small a total. Found by scripts/hostile-commands.
"""
import json
import pathlib
import subprocess
import sys
import tempfile

SCAN = ("--phantom foam --detector 32x19 --angles 52 --seed 43 --pitch 0.064157 --pores 18 --noise-sigma 0.00529 --point "
        "--cone 22.622,39.846 --tilt 0.602,0.469").split()


def main():
    vdvr = sys.argv[1]
    with tempfile.TemporaryDirectory() as folder:
        scan, volume = pathlib.Path(folder) / "scan", pathlib.Path(folder) / "v.vdvr"

        def run(*words, expected=0):
            done = subprocess.run([vdvr, *map(str, words)], capture_output=True, text=True, timeout=280, check=False)
            if done.returncode != expected:
                sys.exit("%s ended with %d:\n%s" % (words, done.returncode, done.stderr))
            return done.stdout

        run("simulate", *SCAN, "-o", scan)
        run("build", scan, "--epsilon-abs", ".0895356", "--gold", "4", "-o", volume)
        found = json.loads(run("verify", volume, "--projections", scan, "--exhaustive", "--json"))
        if not found["holds"]:
            sys.exit("a right certificate is refused: " + found["failure"])


if __name__ == "__main__":
    main()
