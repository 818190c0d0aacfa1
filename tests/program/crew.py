#!/usr/bin/env python3
"""One build by several devices, shares and MPI ranks, some of which are killed: always the same bytes.

usage: crew.py devices|shares|frames|mpi|kills VDVR [--mpi LAUNCHER VDVR-MPI]... [--workers N] [--leaders N]

`kills` kills N ranks that work and N times the one that leads (1 and 1 by default; scripts/long crew-kills is the
long form), at moments that a seed chooses. Without a launcher `mpi` and `kills` are skipped by name.
"""
import argparse
import json
import os
import pathlib
import random
import signal
import subprocess
import sys
import tempfile
import time

ENVIRONMENT = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
               "OMPI_MCA_btl": "self,vader,tcp", "OMPI_MCA_mpi_yield_when_idle": "1"}


class Failure(Exception):
    pass


def check(holds, what):
    if not holds:
        raise Failure(what)


class Work:
    def __init__(self, folder, vdvr, detector="25x13"):
        self.folder, self.vdvr = pathlib.Path(folder), vdvr
        self.scan, self.out = self.folder / "scan.h5", self.folder / "o.vdvr"
        self.run(["simulate", "--phantom", "shepp-logan", "--detector", detector, "--pitch", "5.5", "--angles", "24",
                  "-o", self.scan])

    def build(self, *more):
        return ["build", self.scan, "--epsilon", "15%", "--granularity", "2", "-o", self.out, "--json", *more]

    def call(self, command, **environment):
        return subprocess.run([str(w) for w in command], env={**ENVIRONMENT, **environment}, text=True,
                              capture_output=True, timeout=280, check=False)

    def run(self, words, expected=0, before=None, **environment):
        done = self.call([*(before or [self.vdvr]), *words], **environment)
        check(done.returncode == expected, f"{words} ended with {done.returncode}:\n{done.stderr}")
        return done

    def built(self, *more, before=None, **environment):
        """The certificate, without what says when and how long; the file is taken away."""
        result = json.loads(self.run(self.build(*more), before=before, **environment).stdout)
        self.out.unlink()
        check(list(self.folder.glob("o.vdvr*")) == [], "a journal was left behind")
        return result["certificate"], result

    def same(self, expected, *more, before=None, **environment):
        found, result = self.built(*more, before=before, **environment)
        check(found["content_sha256"] == expected["content_sha256"], f"{more}: other content")
        check(found == expected, f"{more}: another certificate")
        return result


def devices(work, _):
    two = {"POCL_DEVICES": "pthread pthread"}
    listed = work.call([work.vdvr, "devices"], **two).stdout
    expected, _ = work.built("--device", "0")
    work.same(expected, "--device", "0,0")
    if "\n1: " in listed:  # PoCL, which shows the same device twice when it is asked to
        for given in ("0,1", "1,0", "all"):
            work.same(expected, "--device", given, **two)
    # Of cone beam devices make their own gold, and end it where others have done the work.
    parallel, work.scan = work.scan, work.folder / "cone"
    work.run(["simulate", "--phantom", "shepp-logan", "--detector", "27x11", "--pitch", ".08", "--cone", "10,12", "--angles", "40",
              "-o", work.scan])
    expected_of_cone, _ = work.built("--device", "0")
    for given in ("0,0", "0,0,0", "0,0"):
        work.same(expected_of_cone, "--device", given)
    work.scan = parallel
    plan = ["plan", work.scan, "--epsilon", "15%", "--granularity", "2", "--json"]
    alone = json.loads(work.run(plan).stdout)["foreseen"]
    foreseen = json.loads(work.run([*plan, "--ranks", "4", "--machines", "2"]).stdout)["foreseen"]
    spread, one = foreseen["spread"], foreseen["memory_bytes"]  # which differs a little from plan to plan
    memory = spread["memory_bytes"]
    check("spread" not in alone and spread["ranks"] == 4 and spread["machines"] == 2, f"{spread}")
    check(memory["first_machine"] >= one > memory["other_machine"] / 2 > 0, f"{foreseen}")
    refused = work.run([*plan, "--machines", "2"], expected=2)
    check("give --ranks" in refused.stderr, refused.stderr)
    refused = work.run(work.build("--device", "0,,1"), expected=2)
    check("--device" in refused.stderr and "empty" in refused.stderr, refused.stderr)
    check(not work.out.exists(), "something was written")
    unlike = {"POCL_DEVICES": "pthread basic"}
    if "basic" in work.call([work.vdvr, "devices"], **unlike).stdout:
        refused = work.run(work.build("--device", "0,1"), expected=2, **unlike)
        check("--mixed-devices" in refused.stderr, refused.stderr)


def shares(work, _):
    expected, _ = work.built()
    for part in (1, 2, 3):
        work.run(work.build("--share", f"{part}/3"))
    check(not work.out.exists() and len(list(work.folder.glob("o.vdvr.share-*"))) == 3, "three journals")
    result = work.same(expected, "--resume")
    check(result["resumed"]["shares"] == 3 and result["resumed"]["records"] > 3, f"{result['resumed']}")
    # One is missing, one was torn: what they lack is computed.
    for part in (1, 3):
        work.run(work.build("--share", f"{part}/3"))
    torn = work.folder / "o.vdvr.share-3-of-3.journal"
    os.truncate(torn, torn.stat().st_size // 2)
    work.same(expected, "--resume")
    # Of another tolerance.
    work.run(work.build("--share", "1/2"))
    other = work.build("--resume")
    other[3] = "16%"
    refused = work.run(other, expected=2)
    check("epsilon was" in refused.stderr, refused.stderr)
    check(not work.out.exists(), "something was written")
    work.same(expected, "--resume")
    for bad in ("0/3", "4/3", "1", "x/2", "1/2/3"):
        refused = work.run(work.build("--share", bad), expected=2)
        check("--share" in refused.stderr, refused.stderr)


def frames(work, launchers):
    """Pictures and turntables by devices, ranks and pieces: the same files as by one."""
    two = {"POCL_DEVICES": "pthread pthread"}
    work.run(work.build())
    picture, turn = work.folder / "p.png", work.folder / "turn"

    def render(out, *more, before=None, expected=0, **environment):
        words = ["render", work.out, "-o", out, "--size", "72x90", "--json", *more]
        return work.run(words, before=before, expected=expected, **environment)

    def files():
        return {f.name: f.read_bytes() for f in turn.iterdir()}

    def turned(*more, before=None, **environment):
        result = json.loads(render(turn, "--turntable", "6", *more, before=before, **environment).stdout)
        return files(), result

    render(picture, "--device", "0")
    one = picture.read_bytes()
    render(picture, "--force", "--device", "0,0")
    check(picture.read_bytes() == one, "two devices draw another picture")
    if "\n1: " in work.call([work.vdvr, "devices"], **two).stdout:
        render(picture, "--force", "--device", "all", **two)
        check(picture.read_bytes() == one, "all devices draw another picture")
    # Neither base nor index fit; that tiles need not is tests/device/paged_volume_test.cpp.
    refused = render(picture, "--force", "--max-memory", "20K", expected=3)
    check("max-memory" in refused.stderr, refused.stderr)
    whole, _ = turned()
    check(sorted(whole) == ["certificate.json", *(f"frame-{f:04}.png" for f in range(6))], f"{sorted(whole)}")
    # What an interruption leaves: some frames, and what they are of.
    (turn / "certificate.json").unlink()
    (turn / "frame-0003.png").unlink()
    refused = render(turn, "--turntable", "6", expected=2)
    check("--force" in refused.stderr, refused.stderr)
    refused = render(turn, "--turntable", "6", "--resume", expected=2)
    check("--force" in refused.stderr, "frames of unknown origin were kept")
    for job in ("same", "other"):
        running = subprocess.Popen(
            [str(w) for w in (work.vdvr, "render", work.out, "-o", turn, "--size", "72x90", "--json", "--force",
                              "--turntable", "6")],
            env=ENVIRONMENT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while running.poll() is None and not (turn / "frame-0001.png").exists():
            time.sleep(0.002)
        running.kill()
        running.wait()
        if not (turn / "turntable.json").exists():  # it was faster
            continue
        if job == "other":
            refused = render(turn, "--turntable", "6", "--resume", "--zoom", "2", expected=2)
            check("--force" in refused.stderr, "frames of another picture were kept")
        again, result = turned("--resume")
        check(again == whole, "a resumed turntable differs")
        check(result["frames_kept"] >= 1, f"no frame was kept: {result['frames_kept']}")
    for launcher in launchers:
        for ranks in (1, 3):
            again, _ = turned("--force", before=launch(launcher, ranks))
            check(again == whole, f"{ranks} ranks draw another turntable")
        hang_while_drawing(work, launcher, turn)
        check(files() == whole, "a turntable that a rank left differs")
    print(f"frames by devices, pieces and {len(launchers)} kinds of MPI are those of one device")


def hang_while_drawing(work, launcher, turn):
    """Stops a rank of a turntable before it has drawn all; rank 0 draws the rest."""
    for frame in turn.iterdir():
        frame.unlink()
    words = ["render", work.out, "-o", turn, "--size", "72x90", "--turntable", "6", "--force", "--give-up", "1"]
    with open(work.folder / "messages", "w", encoding="utf-8") as messages:
        job = subprocess.Popen([str(w) for w in [*launch(launcher, 3), *words]], env=ENVIRONMENT, stdout=messages,
                               stderr=messages)
    wait_until(job, lambda: "vdvr-mpi render:" in messages_of(work))
    stop_a_rank(job, launcher)


def stop_a_rank(job, launcher):
    """The last of three; the job ends without it."""
    ranks = ranks_of(job.pid, launcher[1])
    if len(ranks) == 3:
        os.kill(ranks[2], signal.SIGSTOP)
    try:
        end(job)
    finally:
        for rank in ranks:
            try:
                os.kill(rank, signal.SIGKILL)
            except ProcessLookupError:
                pass


def launch(mpi, ranks):
    launcher, program = mpi
    # Open MPI starts no more ranks than there are cores unless told to; the others know no such option.
    told = subprocess.run([launcher, "--version"], capture_output=True, text=True).stdout
    more = ["--oversubscribe"] if "Open" in told.partition("\n")[0] else []  # "(OpenRTE) 4.1.4", "(Open MPI) 5.0.7"
    return [launcher, *more, "-n", str(ranks), program]


def mpi(work, launchers):
    expected, _ = work.built()
    for number, launcher in enumerate(launchers):
        for ranks in (1, 2, 3, 4) if number == 0 else (1, 3):
            result = work.same(expected, before=launch(launcher, ranks))
            check((result["messages"]["bytes"] > 0) == (ranks > 1), f"{ranks} ranks: {result['messages']}")
    # Ranks on two machines, as far as the program knows.
    work.same(expected, before=launch(launchers[0], 4), VDVR_MPI_PRETEND_MACHINES="2")
    refused = work.run(["build", work.scan, "-o", work.out], expected=2, before=launch(launchers[0], 2))
    check("give a tolerance" in refused.stderr, refused.stderr)


def ranks_of(launcher, program):
    """Processes of the program below a launcher, the one that leads first: it is started first."""
    parents, found = {}, []
    for entry in pathlib.Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        try:
            text = (entry / "stat").read_text()
            command = (entry / "cmdline").read_bytes().split(b"\0")[0].decode()
        except OSError:
            continue
        parents[int(entry.name)] = int(text.rpartition(")")[2].split()[1])
        if command == program:
            found.append(int(entry.name))

    def below(process):
        while process > 1 and process != launcher:
            process = parents.get(process, 0)
        return process == launcher

    return sorted(p for p in found if below(p))


def start(work, launcher, ranks, *more):
    command = [str(w) for w in [*launch(launcher, ranks), *work.build(*more)]]
    with open(work.folder / "messages", "w", encoding="utf-8") as messages:
        return subprocess.Popen(command, env=ENVIRONMENT, stdout=messages, stderr=messages)


def end(process):
    try:
        return process.wait(timeout=120)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
        raise Failure("the job did not end") from None


def is_done(work):
    return work.out.exists() and not (work.folder / "o.vdvr.journal").exists()


def finish(work, expected, launcher, ranks):
    """After a death: whether or not the job went on, --resume with another number of ranks ends in the same."""
    if is_done(work):
        found = json.loads(work.run(["info", work.out, "--json"]).stdout)
        check(expected["content_sha256"] in json.dumps(found), "the job went on to other content")
        work.out.unlink()
        return False
    work.same(expected, "--resume", "--force", before=launch(launcher, ranks))
    return True


def kills(work, launchers, workers, leaders):
    launcher = launchers[0]
    expected, _ = work.built()
    begin = time.monotonic()
    work.same(expected, before=launch(launcher, 3))
    whole = time.monotonic() - begin
    chance = random.Random(25)
    resumed = went_on = late = kill = 0
    while kill < workers + leaders:
        begin = time.monotonic()
        job = start(work, launcher, 3)
        time.sleep(chance.uniform(0.1, 0.95) * whole)
        ranks = ranks_of(job.pid, launcher[1])
        if ranks:
            victim = ranks[0] if kill >= workers else chance.choice(ranks[1:] or ranks)
            try:
                os.kill(victim, signal.SIGKILL)
            except ProcessLookupError:
                ranks = []
        done_before = is_done(work) or not ranks
        end(job)
        had_to_resume = finish(work, expected, launcher, 1 + kill % 4)
        if done_before and not had_to_resume:  # the machine has become faster: that was no death
            whole = min(whole, time.monotonic() - begin)
            late += 1
            check(late < 4 * (workers + leaders), "jobs end before they can be killed")
            continue
        resumed += had_to_resume
        went_on += not had_to_resume
        kill += 1
    # Ctrl-C of the launcher: nothing but the journal stays.
    job = start(work, launcher, 3)
    time.sleep(0.7 * whole)
    job.send_signal(signal.SIGINT)
    end(job)
    left = {p.name for p in work.folder.iterdir()} - {"scan.h5", "messages", "o.vdvr.journal"}
    check(is_done(work) or not left, f"an interrupted job left {left}")
    finish(work, expected, launcher, 2)
    # A rank that hangs is given up, and its blocks are computed elsewhere; at the end it is not waited for.
    # (While MPI begins nobody can be given up: all ranks take part in that.)
    hang(work, launcher, lambda job: wait_until(job, lambda: "plan" in messages_of(work)))
    finish(work, expected, launcher, 2)
    hang(work, launcher, lambda job: wait_until(job, lambda: "verify" in messages_of(work)))
    finish(work, expected, launcher, 2)
    hang(work, launcher, lambda job: wait_until(job, lambda: work.out.exists()))
    finish(work, expected, launcher, 2)
    print(f"{workers} ranks that work and {leaders} that lead were killed: {resumed} jobs were resumed, "
          f"{went_on} went on by themselves; a whole one takes {whole:.1f} s")


def messages_of(work):
    return (work.folder / "messages").read_text(encoding="utf-8", errors="replace")


def wait_until(job, holds):
    while job.poll() is None and not holds():
        time.sleep(0.002)


def hang(work, launcher, wait):
    """Stops a rank of a job once `wait` returns; the job ends all the same."""
    job = start(work, launcher, 3, "--give-up", "2")
    wait(job)
    stop_a_rank(job, launcher)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("what", choices=["devices", "shares", "frames", "mpi", "kills"])
    parser.add_argument("vdvr")
    parser.add_argument("--mpi", nargs=2, action="append", default=[])
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--leaders", type=int, default=1)
    args = parser.parse_args()
    if args.what in ("mpi", "kills") and not args.mpi:
        print(f"crew_{args.what}_test skipped: vdvr-mpi is not built, no MPI was found")
        return 0
    with tempfile.TemporaryDirectory(prefix="vdvr-crew-") as folder:
        try:
            # Blocks are at most 32 cells wide: shares need some.
            work = Work(folder, args.vdvr, "57x41" if args.what == "shares" else "25x13")
            if args.what == "kills":
                kills(work, args.mpi, args.workers, args.leaders)
            else:
                {"devices": devices, "shares": shares, "frames": frames, "mpi": mpi}[args.what](work, args.mpi)
        except Failure as failure:
            print(f"crew.py {args.what}: {failure}", file=sys.stderr)
            messages = pathlib.Path(folder) / "messages"
            if messages.exists():
                print(messages.read_text(encoding="utf-8"), file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
