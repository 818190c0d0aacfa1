"""What `vdvr bench` prints: a table on a terminal; a line of JSON through a pipe, and with --json.

bench_terminal.py VDVR"""
import json
import os
import pty
import subprocess
import sys

COMMAND = [sys.argv[1], "bench", "fbp", "--size", "32", "--angles", "16", "--repetitions", "1", "--quiet"]


def on_terminal(*words):
    master, slave = pty.openpty()
    with subprocess.Popen([*COMMAND, *words], stdout=slave) as process:
        os.close(slave)
        text = b""
        while True:
            try:
                part = os.read(master, 65536)
            except OSError:  # how Linux says that nobody writes any more
                part = b""
            if not part:
                break
            text += part
    assert process.returncode == 0, process.returncode
    return text.decode().replace("\r\n", "\n")


line = json.loads(subprocess.run(COMMAND, check=True, capture_output=True, text=True).stdout)
assert line["case"] == "fbp" and line["seconds"]["median"] > 0, line
assert json.loads(on_terminal("--json"))["samples"] == [32, 32, 32]

table = on_terminal()
rows = dict(row.strip().split("  ", 1) for row in table.splitlines() if "  " in row.strip())
assert "{" not in table and set(rows) >= {"case", "device", "angles", "seconds", "gups", "back-project"}, table
assert rows["samples"].strip() == "32, 32, 32" and rows["angles"].strip() == "16", table
assert " to " in rows["seconds"] and float(rows["gups"]) > 0, table
print("a table on a terminal, JSON for programs")
