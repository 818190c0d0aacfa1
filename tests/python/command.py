#!/usr/bin/env python3
"""The command `vdvr` of the wheel beside the program itself: the same words, volumes and exit codes.

  command.py VDVR
"""
import json
import os
import pathlib
import signal
import subprocess
import sys
import time

PROGRAM, COMMAND = sys.argv[1], str(pathlib.Path(sys.executable).with_name("vdvr"))


def said(program, *words, code=0):
    ended = subprocess.run([program, *words], capture_output=True, text=True)
    assert ended.returncode == code, f"{program} {words}: {ended.returncode} {ended.stderr}"
    return ended


for words in (["--version"], ["--help"], ["build", "--help-all"], ["--man", "verify"]):
    assert said(COMMAND, *words).stdout == said(PROGRAM, *words).stdout, words
for words, code in ((["frobnicate"], 2), (["info", "not-there.h5"], 2), ([], 2)):
    assert said(COMMAND, *words, code=code).stderr == said(PROGRAM, *words, code=code).stderr, words

hashes = []
for program, name in ((PROGRAM, "program"), (COMMAND, "command"), (sys.executable, "module")):
    run = [program] + (["-m", "vdvr"] if name == "module" else [])
    scan, volume = f"{name}.h5", f"{name}.vdvr"
    if name != "module":
        said(*run, "simulate", "--phantom", "sphere", "--detector", "33x9", "--angles", "40", "-o", scan)
    said(*run, "build", "program.h5", "--epsilon", "4%", "-o", volume)
    said(*run, "verify", volume, "--projections", "program.h5")
    hashes.append(json.loads(said(*run, "info", volume, "--json").stdout)["certificate"]["content_sha256"])
assert len(set(hashes)) == 1, hashes
assert pathlib.Path("program.h5").stat().st_size == pathlib.Path("command.h5").stat().st_size

# Ctrl-C ends it as it ends the program: 130, and nothing is left.
said(PROGRAM, "simulate", "--phantom", "shepp-logan", "--detector", "129x65", "--angles", "200", "-o", "long.h5")
with subprocess.Popen([COMMAND, "build", "long.h5", "--epsilon", "0.5%", "-o", "long.vdvr"], stderr=subprocess.PIPE,
                      text=True) as running:
    time.sleep(2)
    running.send_signal(signal.SIGINT)
    words = running.stderr.read()
assert running.returncode == 130 and "interrupted" in words and "Traceback" not in words, (running.returncode, words)
assert not os.path.exists("long.vdvr")
print("command: the program's words, volumes and exit codes")
