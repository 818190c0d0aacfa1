"""Seeds of a test program run in many processes: scripts/hostile-builds, hostile-commands and cone-attacks.

The program takes COUNT FIRST_SEED --json and prints a JSON line per seed, with `seed`, `outcome` and `failures`, a list
of {kind, text}; it ends with 0, or with 1 where a seed failed."""
import collections
import json
import os
import queue
import select
import subprocess
import sys
import threading
import time


def run_chunk(command, first, count, limit, done):
    """Seeds first .. first + count - 1, handing each record to `done`; a process that ends early or says nothing for
    `limit` seconds names its seed, and another one goes on behind it."""
    end = first + count
    while first < end:
        process = subprocess.Popen(command + [str(end - first), str(first), "--json"],
                                   stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        text, hangs, told = b"", False, time.monotonic()
        while True:
            ready, _, _ = select.select([process.stdout], [], [], max(0.0, told + limit - time.monotonic()))
            if not ready:
                hangs = True
                process.kill()
                break
            more = os.read(process.stdout.fileno(), 1 << 16)
            if not more:
                break
            text += more
            *lines, text = text.split(b"\n")
            for line in lines:
                done(json.loads(line))
                first, told = first + 1, time.monotonic()
        code = process.wait()
        process.stdout.close()
        if first < end or code not in (0, 1):  # a whole chunk ends with 0 or 1 and a record of its last seed
            kind = "hangs" if hangs else "dies" if first < end else "dies at its end"
            how = "no end after %g s" % limit if hangs else "signal %d" % -code if code < 0 else "exit code %d" % code
            done({"seed": first, "outcome": kind, "message": how, "excuse": "",
                  "failures": [{"kind": kind, "text": how}]})
            first += 1


def add_options(parser, program, count, chunk):
    """What every such script takes; `program` is the name of the one it runs."""
    root = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
    parser.add_argument("count", nargs="?", type=int, default=count)
    parser.add_argument("--first", type=int, default=1, help="the first seed")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes at a time")
    parser.add_argument("--chunk", type=int, default=chunk, help="seeds a process")
    parser.add_argument("--limit", type=float, default=120, help="seconds that one seed may take")
    parser.add_argument("--program", default=os.path.join(root, "build", "tests", program))
    parser.add_argument("--log", help="a JSON line per seed goes here")


def run(parser, print_failures, script=None):
    """The records of all seeds in any order, and the seconds they took. `print_failures` sees each as it comes. A `script`
    runs the seeds in place of the program, which it is told of."""
    options = parser.parse_args()
    if options.count < 1 or options.jobs < 1 or options.chunk < 1:
        parser.error("COUNT, --jobs and --chunk must be at least 1")
    if not os.access(options.program, os.X_OK):
        sys.exit("%s is missing: cmake --build build --target %s" %
                 (options.program, os.path.basename(options.program)))
    log = open(options.log, "w") if options.log else None
    command = [script, "--program", options.program] if script else [options.program]
    command += ["--cone"] if getattr(options, "cone", False) else []
    records, lock, work = [], threading.Lock(), queue.Queue()
    for first in range(options.first, options.first + options.count, options.chunk):
        work.put((first, min(options.chunk, options.first + options.count - first)))

    def done(record):
        with lock:
            records.append(record)
            print_failures(record)
            if log:
                log.write(json.dumps(record) + "\n")
                log.flush()
            if len(records) % 100 == 0:
                print("%d of %d" % (len(records), options.count), file=sys.stderr, flush=True)

    def worker():
        while True:
            try:
                first, count = work.get_nowait()
            except queue.Empty:
                return
            run_chunk(command, first, count, options.limit, done)

    start = time.monotonic()
    workers = [threading.Thread(target=worker) for _ in range(options.jobs)]
    for w in workers:
        w.start()
    for w in workers:
        w.join()
    return records, time.monotonic() - start


def print_outcomes(records, title):
    outcomes = collections.Counter(r["outcome"] for r in records)
    print("\n| outcome | %s |\n| --- | --- |" % title)
    for outcome, count in outcomes.most_common():
        print("| %s | %d |" % (outcome, count))


def print_failing_seeds(records):
    """By kind; whether there are any."""
    kinds = collections.defaultdict(list)
    for r in records:
        for kind in sorted({f["kind"] for f in r["failures"]}):
            kinds[kind].append(r["seed"])
    if kinds:
        print("\n| failure | cases | seeds |\n| --- | --- | --- |")
        for kind, seeds in sorted(kinds.items()):
            shown = ", ".join(str(s) for s in sorted(seeds)[:12]) + (", ..." if len(seeds) > 12 else "")
            print("| %s | %d | %s |" % (kind, len(seeds), shown))
    return bool(kinds)
