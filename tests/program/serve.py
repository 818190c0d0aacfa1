#!/usr/bin/env python3
"""`vdvr serve` by HTTP alone: what it answers, whom it refuses, what strangers cannot do to it, how it ends.

  serve.py answers VDVR     the page, its headers, refusals; still frames are those of `vdvr render` to the bit
  serve.py hostile VDVR     a thousand hostile requests leave it serving, with nothing left open
"""
import json
import pathlib
import random
import re
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from served import Served, check, make_volume


# --- what it answers ---

def check_page(served):
    status, headers, page = served.ask()
    text = page.decode()
    check(status == 200 and headers["Content-Type"].startswith("text/html"), f"no page: {status}")
    for name, part in (("Content-Security-Policy", "default-src 'none'"), ("X-Content-Type-Options", "nosniff"),
                       ("X-Frame-Options", "DENY"), ("Referrer-Policy", "no-referrer"), ("Cache-Control", "no-store"),
                       ("Cross-Origin-Resource-Policy", "same-origin")):
        check(part in headers.get(name, ""), f"header {name} is {headers.get(name)!r}")
    check("unsafe" not in headers["Content-Security-Policy"], "inline code is allowed")
    for name, kind in (("page.js", "text/javascript"), ("page.css", "text/css"), ("scene.json", "application/json")):
        status, headers, body = served.ask(name)
        check(status == 200 and headers["Content-Type"].startswith(kind) and body, f"{name}: {status}")
        text += body.decode()
    check(not re.search(r"(https?:)?//[\w.-]+\.\w+/", text), "the page names another host")
    scene = json.loads(body)
    check(scene["file"] == "marschner-lobb.vdvr" and "certificate holds" in scene["words"][0], f"scene: {scene['words']}")
    check(len(served.path.strip("/")) == 32, f"the token has not 128 bits: {served.path}")
    return scene


STATES = [
    {},
    {"azimuth": -101.3, "elevation": 47.25, "zoom": 1.7},
    {"pan": [0.11, -0.07], "zoom": 2.5},
    {"mode": "iso", "azimuth": 200.5},
    {"mode": "iso", "shading": False, "pan": [-0.2, 0.1]},
    {"mode": "mip", "elevation": -90},
    {"clip": [-9.5, -20, -30, 4.25, 20, 30]},
    {"mode": "iso", "clip": [-30, -30, 1, 30, 30, 30], "pan": [0.05, 0]},
    {"mode": "slice", "slice_axis": 0, "slice_position": 3.3},
    {"mode": "error", "slice_axis": 1, "slice_position": -2.125},
    {"shading": False, "transfer": [{"value": 0.2, "rgb": [0.1, 0.4, 1], "opacity": 0},
                                    {"value": 0.7, "rgb": [1, 0.5, 0.25], "opacity": 0.31}]},
]


def check_still_frames(vdvr, volume, served, folder):
    for i, members in enumerate(STATES):
        line, image = served.frame({"state": {"width": 487, "height": 350, **members}})
        words = list(line["command"])
        if "transfer" in members:
            curve = folder / f"{i}.json"
            curve.write_text(json.dumps({"points": members["transfer"]}))
            words += ["--tf", str(curve)]
        picture = folder / f"{i}.png"
        subprocess.run([vdvr, "render", str(volume), "-o", str(picture), *words], check=True, capture_output=True)
        check(image == picture.read_bytes(), f"the still frame of {members} is not that of vdvr render {' '.join(words)}")
        check(line["full"] and line["type"] == "image/png", f"of a still frame: {line}")
        for name, value in members.items():
            check(line["state"][name] == value, f"{name} came back as {line['state'][name]}")


def check_moving_frames(served):
    asked = {"state": {"width": 600, "height": 400}, "events": [
        {"event_type": "pointer_down", "x": 100, "y": 100, "button": 1},
        {"event_type": "pointer_move", "x": 300, "y": 100}]}
    for _ in range(4):
        line, image = served.frame(asked, "moving")
    check(image[:3] == b"\xff\xd8\xff" and image[-2:] == b"\xff\xd9" and line["type"] == "image/jpeg", "no JPEG while moving")
    # SOF0 or SOF2: height and width.
    frame = re.search(rb"\xff[\xc0\xc2]..\x08(....)", image, re.S)[1]
    check(struct.unpack(">HH", frame) == (line["height"], line["width"]), "the picture has another size than it says")
    check(line["width"] <= 600 and abs(line["width"] * 400 - line["height"] * 600) <= 600, f"another shape: {line}")
    check(abs(line["state"]["azimuth"] - (30 - 180 * 200 / 400)) < 1e-9, f"the drag turned to {line['state']['azimuth']}")


def check_newest_counts(served):
    """Of many frames that one client asks for at once the newest is drawn; others may say 409."""
    answers = {}

    def one(i):
        answers[i] = served.ask("frame/hasty/still", json.dumps({"state": {"width": 900, "height": 900, "azimuth": i}}))

    threads = [threading.Thread(target=one, args=(i,)) for i in range(8)]
    for thread in threads:
        thread.start()
        time.sleep(0.01)
    for thread in threads:
        thread.join()
    states = [answers[i][0] for i in range(8)]
    check(set(states) <= {200, 409} and states[7] == 200, f"answers to one client's frames: {states}")
    check(409 in states, f"no frame was replaced: {states}")


def check_refusals(served):
    host = f"127.0.0.1:{served.port}"
    wrong = "/" + "0" * 32 + "/"
    frame = served.path + "frame/a/still"
    cases = [
        (404, dict(path=wrong)), (404, dict(path="/")), (404, dict(path=served.path[:-1])),
        (404, dict(path=served.path[:-2] + "/")), (404, dict(name="page.html")), (404, dict(name="frame/a/slow")),
        (400, dict(name="../../etc/passwd?x=1")), (404, dict(name="../page.js")), (400, dict(name="%2e%2e/page.js")),
        (404, dict(path=wrong + "frame/a/still", body="{}")),
        (403, dict(headers={"Host": "evil.example"})), (403, dict(headers={"Host": f"evil.example:{served.port}"})),
        (403, dict(headers={"Host": "127.0.0.1.evil.example"})), (403, dict(headers={"Host": ""})),
        (200, dict(headers={"Host": f"localhost:{served.port}"})), (200, dict(headers={"Host": "[::1]:8080"})),
        (403, dict(name="frame/a/still", body="{}", headers={"Origin": "http://evil.example"})),
        (403, dict(name="frame/a/still", body="{}", headers={"Origin": "null"})),
        (403, dict(headers={"Origin": f"https://{host}"})),
        (200, dict(name="frame/a/still", body='{"state": {"width": 9, "height": 9}}', headers={"Origin": f"http://{host}"})),
        (405, dict(path=frame)), (405, dict(name="page.js", body="{}")),
        (400, dict(method="PUT", name="page.js")), (400, dict(method="OPTIONS")),
        (415, dict(name="frame/a/still", body="{}", headers={"Content-Type": "text/plain"})),
        (413, dict(name="frame/a/still", body=" " * 65537)),
        (400, dict(name="frame/a/still", body="{}", headers={"Transfer-Encoding": "chunked"})),
        (400, dict(name="frame/a/still", body="{}", headers={"Content-Encoding": "gzip"})),
        (400, dict(name="frame/a/still", body="")), (400, dict(name="frame/a/still", body='{"state": {"azimuth": NaN}}')),
        (400, dict(name="frame/a/still", body='{"file": "/etc/passwd"}')),
    ]
    for wanted, how in cases:
        how.setdefault("name", "")
        status, _, body = served.ask(**how)
        check(status == wanted, f"{how} gives {status}, not {wanted}: {body[:200]}")
    _, _, said = served.ask("frame/a/still", '{"state": {"zoom": 1e9}}')
    check(b"`zoom` 1000000000" in said, f"a refusal that does not name the member: {said}")


def check_bad_usage(vdvr, volume, served, folder):
    empty = folder / "empty.vdvr"
    empty.write_bytes(b"")
    cases = [
        (2, [str(folder / "missing.vdvr")], "no such file"), (2, [str(empty)], "is empty"),
        (2, [str(folder / "marschner-lobb.h5")], "neither a certified volume"),
        (2, [str(volume), "--port", "70000"], "--port"), (2, [str(volume), "--address", "here"], "--address here is not"),
        (2, [str(volume), "--address", "192.0.2.1"], "192.0.2.1 is none of this machine's"),
        (2, [str(volume), "--name", "a b"], "--name"), (2, [], "FILE"),
        (3, [str(volume), "--port", str(served.port)], f"--port {served.port} of 127.0.0.1 cannot be had: it is in use"),
    ]
    for code, words, part in cases:
        done = subprocess.run([vdvr, "serve", *words], capture_output=True, text=True, timeout=60)
        check(done.returncode == code and part in done.stderr and done.stderr.count("\n") == 1 and not done.stdout,
              f"serve {words} gives {done.returncode}: {done.stderr}")


def check_ends(vdvr, volume):
    with Served(vdvr, volume) as served:
        idle = served.connection()
        idle.request("GET", served.path)
        idle.getresponse().read()
        code, said = served.interrupt()
        check(code == 130 and said.count("\n") == 1 and "ended" in said, f"Ctrl-C gives {code}: {said}")
        idle.close()
    # In the middle of the largest picture that can be asked for.
    with Served(vdvr, volume) as served:
        served.frame({"state": {"width": 64, "height": 64}})
        body = json.dumps({"state": {"width": 4096, "height": 4096, "zoom": 3}})
        busy = served.connection()
        busy.request("POST", served.path + "frame/a/still", body, {"Content-Type": "application/json"})
        time.sleep(0.15)
        code, said = served.interrupt()
        check(code == 130, f"Ctrl-C while drawing gives {code}: {said}")
        busy.close()
    with Served(vdvr, volume, "--address", "0.0.0.0", "--name", "my-machine.example") as served:
        check(served.ask()[0] == 200, "not reached by the loopback")
        check(served.ask(headers={"Host": "My-Machine.example:80"})[0] == 200, "a name that was given is refused")
        _, said = served.interrupt()
        check("anyone who can reach 0.0.0.0" in said, f"no warning: {said}")


def test_answers(vdvr, folder):
    volume = make_volume(vdvr, folder)
    with Served(vdvr, volume) as served:
        check_page(served)
        check_still_frames(vdvr, volume, served, folder)
        check_moving_frames(served)
        check_newest_counts(served)
        check_refusals(served)
        check_bad_usage(vdvr, volume, served, folder)
    check_ends(vdvr, volume)


# --- what strangers send ---

REQUESTS = 1000


class Stranger:
    """Sends one hostile request of a random kind, with the token or without."""

    def __init__(self, served, seed):
        self.served, self.random = served, random.Random(seed)
        self.kinds = [getattr(self, name) for name in dir(self) if name.startswith("send_")]
        self.counts = {}

    def one(self):
        kind = self.random.choice(self.kinds)
        self.counts[kind.__name__] = self.counts.get(kind.__name__, 0) + 1
        with socket.create_connection((self.served.host, self.served.port), timeout=10) as s:
            try:
                kind(s)
                s.settimeout(0.3)
                while s.recv(65536):
                    pass
            except (TimeoutError, ConnectionError):
                pass

    def path(self):
        token = self.served.path if self.random.random() < 0.7 else "/" + "f" * 32 + "/"
        return token + self.random.choice(["", "scene.json", "frame/a/still", "frame/b/moving", "x" * 40, "frame//still"])

    def head(self, method, path, *headers):
        lines = [f"{method} {path} HTTP/1.1", f"Host: 127.0.0.1:{self.served.port}", *headers]
        return "\r\n".join(lines).encode("latin-1") + b"\r\n\r\n"

    def bytes(self, n):
        return self.random.randbytes(n)

    def post(self, body, *headers):
        head = self.head("POST", self.served.path + "frame/s/moving", "Content-Type: application/json",
                         f"Content-Length: {len(body)}", *headers)
        return head + body

    def send_binary(self, s):
        s.sendall(self.bytes(self.random.randrange(1, 5000)))

    def send_long_line(self, s):
        s.sendall(b"GET /" + b"a" * self.random.randrange(200, 100000) + b" HTTP/1.1\r\n\r\n")

    def send_many_headers(self, s):
        s.sendall(self.head("GET", self.path(), *[f"X-{i}: {'y' * self.random.randrange(100)}" for i in range(1000)]))

    def send_huge_header(self, s):
        name = self.random.choice(["Range: bytes=", "Cookie: ", "Accept-Encoding: ", "Connection: ", "Host: "])
        s.sendall(self.head("GET", self.path(), name + "0-1," * self.random.randrange(100, 4000)))

    def send_head_without_end(self, s):
        s.sendall(b"GET " + self.path().encode() + b" HTTP/1.1\r\n")
        for i in range(2000):  # 16 MB, of which 16 KiB are read
            s.sendall(f"X-{i}: {'y' * 8000}\r\n".encode())

    def send_without_end(self, s):
        s.sendall(b"GET " + self.path().encode() + b" HTTP/1.1\r\nHost: x")

    def send_nothing(self, s):
        pass

    def send_slowly(self, s):
        for c in self.head("GET", self.path())[:8]:
            s.sendall(bytes([c]))
            time.sleep(0.01)

    def send_broken_length(self, s):
        length = self.random.choice(["-1", "99999999999999999999", "1e3", "0x10", "70000", "", "12 12", "١"])
        head = self.head("POST", self.served.path + "frame/s/still", "Content-Type: application/json")
        s.sendall(head[:-2] + b"Content-Length: " + length.encode() + b"\r\n\r\n" + self.bytes(100))

    def send_short_body(self, s):
        s.sendall(self.post(b"{}")[:-1])

    def send_two_lengths(self, s):
        s.sendall(self.post(b"{}", "Content-Length: 1"))

    def send_chunked(self, s):
        s.sendall(self.head("POST", self.served.path + "frame/s/still", "Content-Type: application/json",
                            "Transfer-Encoding: chunked") + b"fffffffff\r\n" + self.bytes(1000))

    def send_smuggled(self, s):
        s.sendall(self.head("GET", self.path(), "Content-Length: 30") + self.head("GET", "/"))

    def send_bad_json(self, s):
        body = self.random.choice([b"", b"{", b"nul", b"[" * 60000, b'{"state": ' * 3000, b'"' + b"\\ud800" * 100 + b'"', b"\xff" * 50,
                                   b'{"state": {"azimuth": NaN}}', b'{"state": {"zoom": 1e400}}', b'{"events": [[]]}'])
        s.sendall(self.post(body))

    def send_odd_numbers(self, s):
        number = self.random.choice(["1e308", "-1e308", "1e-320", "-0.0", "9007199254740993", "0.1e1", "null", "true"])
        member = self.random.choice(["azimuth", "elevation", "zoom", "iso", "slice_position", "slice_axis", "width", "height"])
        x = self.random.choice(["x", "y", "dx", "dy", "button", "width"])
        kind = self.random.choice(["pointer_down", "pointer_move", "wheel", "resize", "key_down"])
        body = f'{{"state": {{"{member}": {number}}}, "events": [{{"event_type": "{kind}", "{x}": {number}}}]}}'
        if member in ("width", "height"):
            body = body.replace("9007199254740993", "4097")
        s.sendall(self.post(body.encode()))

    def send_odd_events(self, s):
        events = [{"event_type": self.random.choice(["pointer_down", "pointer_move", "wheel", "key_down", "double_click"]),
                   "x": self.random.uniform(-1e300, 1e300), "y": self.random.gauss(0, 100), "button": self.random.randrange(5),
                   "dy": self.random.gauss(0, 1e5), "key": self.random.choice(["1", "4", "]", "\u0000", "x" * 100])} for _ in range(40)]
        body = {"state": {"width": self.random.randrange(1, 200), "height": self.random.randrange(1, 200)}, "events": events}
        s.sendall(self.post(json.dumps(body).encode()))

    def send_many_at_once(self, s):
        s.sendall(self.post(b'{"state": {"width": 20, "height": 20}}') * 20)

    def send_wrong_host(self, s):
        s.sendall(self.head("GET", self.path()).replace(b"127.0.0.1", b"rebound.example"))


def check_alive(served, truth, what):
    start = time.monotonic()
    _, image = served.frame({"state": {"width": 120, "height": 90}})
    took = time.monotonic() - start
    check(image == truth, f"{what}: the picture changed")
    return took


def half_open(served, n):
    """Connections that a stranger leaves open in the middle of a request."""
    sockets = []
    for i in range(n):
        s = socket.create_connection((served.host, served.port), timeout=10)
        sockets.append(s)
        try:
            if i % 2:
                s.sendall(b"GET " + served.path.encode()[:10])
        except ConnectionError:
            pass
    return sockets


def check_drips(served, truth):
    """Heads that come byte by byte hold nobody up, and end: no limit on the time between bytes sees them."""
    sockets, cut, stop = half_open(served, 24), set(), threading.Event()

    def drip():
        while not stop.wait(0.2):
            for s in sockets:
                try:
                    s.sendall(b"a")
                except OSError:
                    cut.add(s)

    dripping = threading.Thread(target=drip)
    dripping.start()
    took = check_alive(served, truth, "beside heads that come byte by byte")
    check(took < 5, f"beside heads that come byte by byte a frame took {took:.1f} s")
    time.sleep(6)  # a request has 5 s
    stop.set()
    dripping.join()
    for s in sockets:
        s.close()
    check(len(cut) == len(sockets), f"{len(sockets) - len(cut)} of {len(sockets)} endless heads are still read")


def test_hostile(vdvr, folder):
    volume = make_volume(vdvr, folder)
    with Served(vdvr, volume) as served:
        _, truth = served.frame({"state": {"width": 120, "height": 90}})
        # Whom the threads and files belong to that are there anyway.
        time.sleep(0.5)
        files, threads = served.open_files(), served.status_of("Threads")
        strangers = [Stranger(served, seed) for seed in range(16)]

        def send(stranger):
            for _ in range(REQUESTS // len(strangers) + 1):
                stranger.one()

        workers = [threading.Thread(target=send, args=(s,)) for s in strangers]
        for worker in workers:
            worker.start()
        for worker in workers:
            worker.join()
        sent = sum(sum(s.counts.values()) for s in strangers)
        check(sent >= REQUESTS and len({k for s in strangers for k in s.counts}) == len(strangers[0].kinds), f"only {sent} were sent")
        check(served.process.poll() is None, "a hostile request ended it")
        time.sleep(2.5)  # until as many requests are allowed again as before
        check_alive(served, truth, "after the hostile requests")

        sockets = half_open(served, 120)
        took = check_alive(served, truth, "beside 120 half-open connections")
        check(took < 5, f"beside half-open connections a frame took {took:.1f} s")
        for s in sockets:
            s.close()
        check_drips(served, truth)
        for _ in range(100):
            if served.open_files() <= files:
                break
            time.sleep(0.1)
        check(served.open_files() <= files, f"{served.open_files()} files are open, {files} were")
        # The pool's threads are made at the start; nothing adds to them.
        check(served.status_of("Threads") <= threads, f"{served.status_of('Threads')} threads, {threads} were")
        print(f"{sent} hostile requests of {len(strangers[0].kinds)} kinds, 120 half-open connections; "
              f"then a frame within {took:.2f} s; largest memory {served.status_of('VmHWM') // 1024} MiB")
        code, said = served.interrupt()
        check(code == 130 and "ended" in said, f"it ended with {code}: {said}")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as scratch:
        {"answers": test_answers, "hostile": test_hostile}[sys.argv[1]](sys.argv[2], pathlib.Path(scratch))
