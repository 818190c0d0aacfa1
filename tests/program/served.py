"""A `vdvr serve` that runs, for serve.py and serve_browser.py: its address, requests to it, its end."""
import http.client
import json
import pathlib
import re
import signal
import subprocess
import sys
import time
import urllib.parse


def check(holds, what):
    if not holds:
        sys.exit(f"serve: {what}")


def make_volume(vdvr, folder, phantom="marschner-lobb", detector="33x33", angles="60", epsilon="10%"):
    scan, volume = folder / f"{phantom}.h5", folder / f"{phantom}.vdvr"
    words = [vdvr, "simulate", "--phantom", phantom, "--detector", detector, "--angles", angles, "-o", str(scan)]
    subprocess.run(words, check=True, capture_output=True)
    words = [vdvr, "build", str(scan), "--epsilon", epsilon, "-o", str(volume)]
    subprocess.run(words, check=True, capture_output=True)
    return volume


class Served:
    def __init__(self, vdvr, volume, *words):
        self.process = subprocess.Popen([vdvr, "serve", str(volume), "--json", *words], stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, text=True)
        text = ""
        while not text.rstrip().endswith("}"):
            line = self.process.stdout.readline()
            if not line:
                sys.exit(f"serve: it ended before it served: {self.process.stderr.read()}")
            text += line
        self.told = json.loads(text)
        self.address = self.told["address"]
        parts = urllib.parse.urlsplit(self.address)
        self.host, self.port, self.path = parts.hostname, parts.port, parts.path

    def connection(self, timeout=60):
        return http.client.HTTPConnection(self.host, self.port, timeout=timeout)

    def ask(self, name="", body=None, method=None, headers=None, path=None):
        """Status, headers, bytes."""
        c = self.connection()
        sent = {"Connection": "close"}
        if body is not None:
            sent["Content-Type"] = "application/json"
        sent.update(headers or {})
        try:
            c.request(method or ("GET" if body is None else "POST"), path or self.path + name, body=body, headers=sent)
            answer = c.getresponse()
            return answer.status, dict(answer.getheaders()), answer.read()
        finally:
            c.close()

    def frame(self, asked, how="still", client="test"):
        """What the answer says of the picture, and its bytes."""
        status, _, body = self.ask(f"frame/{client}/{how}", json.dumps(asked))
        check(status == 200, f"a frame was refused, {status}: {body[:200]}")
        line, _, image = body.partition(b"\n")
        return json.loads(line), image

    def open_files(self):
        return len(list(pathlib.Path(f"/proc/{self.process.pid}/fd").iterdir()))

    def status_of(self, key):
        text = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
        return int(re.search(rf"^{key}:\s+(\d+)", text, re.M)[1])

    def interrupt(self, within=1.0):
        """Exit code and stderr; the end comes within a second."""
        start = time.monotonic()
        self.process.send_signal(signal.SIGINT)
        try:
            code = self.process.wait(timeout=20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            sys.exit("serve: Ctrl-C does not end it")
        took = time.monotonic() - start
        check(took <= within, f"it ended {took:.2f} s after Ctrl-C")
        return code, self.process.stderr.read()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self.process.stdout.close()
        self.process.stderr.close()
