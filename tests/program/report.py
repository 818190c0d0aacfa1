#!/usr/bin/env python3
"""report.html of `vdvr run`, for a scan whose name is hostile.

  report.py page VDVR        well-formed, escaped, whole; its numbers are those of certificate.json
  report.py browser VDVR     opened from the file alone: pictures load, nothing is requested elsewhere
"""
import base64
import html.parser
import http.server
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import threading

NAME = """"><script>alert('1')&amp;\u00e9.h5"""
VOID = {"meta", "img", "br", "hr", "link", "input"}


class Page(html.parser.HTMLParser):
    """Raises ValueError where an element is not closed in order."""

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.open, self.elements, self.text, self.data = [], [], [], []
        self.feed(text)
        self.close()
        if self.open:
            raise ValueError(f"not closed: {self.open}")

    def handle_starttag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))
        if tag not in VOID:
            self.open.append(tag)
        if tag == "data":
            self.data.append([dict(attributes), ""])

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            raise ValueError(f"</{tag}> closes nothing at {self.getpos()}")

    def handle_data(self, data):
        self.text.append(data)
        if self.open and self.open[-1] == "data":
            self.data[-1][1] += data


def make(vdvr, folder):
    """The folder that `run` wrote, and its page."""
    scan, out = folder / NAME, folder / "out"
    words = [vdvr, "simulate", "--phantom", "sphere", "--detector", "33x9", "--angles", "48", "-o", str(scan)]
    subprocess.run(words, check=True, capture_output=True)
    words = [vdvr, "run", str(scan), "--epsilon", "20%", "--above", "0.5", "-o", str(out), "--json"]
    done = subprocess.run(words, check=True, capture_output=True, text=True)
    return out, (out / "report.html").read_text(encoding="utf-8"), json.loads(done.stdout)


def check(holds, what):
    if not holds:
        sys.exit(f"report.py: {what}")


def check_structure(text, page):
    check(text.startswith("<!DOCTYPE html>"), "no document type")
    tags = [tag for tag, _ in page.elements]
    check(not {"script", "link", "iframe", "object", "base"} & set(tags), f"tags that a page must not have: {set(tags)}")
    for tag, attributes in page.elements:
        for name, value in attributes.items():
            check(not name.startswith("on"), f"<{tag} {name}>")
            check(name not in ("href", "srcset", "action") and (name != "src" or value.startswith("data:image/png;")),
                  f"<{tag} {name}={value[:60]!r}> leads out of the page")
    check("@import" not in text and "url(" not in text, "the style fetches")
    check(NAME in "".join(page.text), "the scan's name is not shown as it is")
    check("<script" not in text.lower(), "the scan's name is not escaped")
    check("nan" not in re.findall(r"[a-z]+", "".join(v for _, v in page.data).lower()), "a number is none")


def check_pictures(out, page):
    pictures = [a for tag, a in page.elements if tag == "img"]
    shown = [base64.b64decode(a["src"].split(",", 1)[1], validate=True) for a in pictures]
    beside = {p.name: p.read_bytes() for p in out.glob("*.png")}
    check(len(beside) >= 5 and sorted(shown) == sorted(beside.values()), "pictures differ from those beside the page")
    check(all(a.get("alt") for a in pictures), "a picture without words")
    captions = "".join(page.text)
    check(all(name in captions for name in beside), "a picture is not named")


def check_numbers(out, page):
    certificate = json.loads((out / "certificate.json").read_text())
    members = set()
    for attributes, shown in page.data:
        value = float(attributes["value"])
        plain = shown.replace("\u202f", "")
        check(abs(float(plain) - value) <= 5e-4 * abs(value), f"{shown} stands for {value}")
        if "data-member" not in attributes:
            continue
        found = certificate
        for key in attributes["data-member"].split("."):
            found = found[key]
        check(found == value, f"{attributes['data-member']}: {value}, certificate.json says {found}")
        members.add(attributes["data-member"])
    wanted = {"epsilon_abs", "reference_range", "total.buffer", "measured_max", "measured_total"}
    wanted |= {f"budget.{term}.value" for term in ("grid", "gold", "projection", "arithmetic", "sampler.buffer")}
    check(wanted <= members, f"missing: {wanted - members}")
    text = "".join(page.text)
    for hash_ in (certificate["input"]["sha256"], certificate["content_sha256"]):
        check(hash_ in text, f"hash {hash_} is not shown")


def check_measured(vdvr, out, page, summary):
    """What `vdvr measure` says of the file stands in the summary and on the page."""
    words = [vdvr, "measure", str(out / "volume.vdvr"), "--above", "0.5", "--json", "--quiet"]
    alone = json.loads(subprocess.run(words, check=True, capture_output=True, text=True).stdout)
    measured = summary["measured"]
    check(all(measured[name] == alone[name] for name in ("volume", "fraction", "region")), f"measured: {measured}")
    check(measured["components"]["certain"] == 1, "the sphere is not one component")
    text = "".join(page.text)
    check("Measured: F at least 0.5" in text and "share of the region" in text, "no section of what is measured")
    check({"measured.png", "components.png"} <= {p.name for p in out.glob("*.png")}, "no pictures of what is measured")


def check_commands(text, page, vdvr, folder):
    """The `verify` line, given to a shell as it stands, measures the certificate again."""
    lines = [line for line in "".join(page.text).splitlines() if "vdvr verify" in line]
    check(len(lines) == 1, f"{len(lines)} lines with `vdvr verify`")
    line = lines[0][lines[0].index("vdvr verify"):].split("--exhaustive")[0] + "--exhaustive --quiet"
    program = folder / "bin"
    program.mkdir()
    (program / "vdvr").symlink_to(pathlib.Path(vdvr).resolve())
    done = subprocess.run(["sh", "-c", f"PATH='{program}':$PATH; {line}"], capture_output=True, text=True)
    check(done.returncode == 0, f"{line}: {done.stderr}")


def test_page(vdvr, folder):
    out, text, summary = make(vdvr, folder)
    page = Page(text)
    check_structure(text, page)
    check_pictures(out, page)
    check_numbers(out, page)
    check_measured(vdvr, out, page, summary)
    check_commands(text, page, vdvr, folder)
    names = list(summary["files"])
    check(names[-2:] == ["report.html", "certificate.json"], f"files: {names}")
    last = max(out.iterdir(), key=lambda p: p.stat().st_mtime_ns).name
    check(last == "certificate.json", f"{last} was written last")


# Whom Chromium asks by itself, whatever page is open; the page names none of them.
OF_THE_BROWSER = ("google.com", "googleapis.com", "gvt1.com", "gstatic.com")


def is_of_the_browser(url):
    host = url.split("://", 1)[-1].split("/")[0].split(":")[0]
    return any(host == own or host.endswith("." + own) for own in OF_THE_BROWSER)


class Proxy(http.server.BaseHTTPRequestHandler):
    asked = []

    def do_GET(self):
        Proxy.asked.append(self.path)
        self.send_error(404)

    do_POST = do_CONNECT = do_HEAD = do_GET

    def log_message(self, *_):
        pass


def opened(chromium, page, folder, port, width):
    """What the browser has of a page once it is loaded; all that it requests goes to our proxy."""
    words = [chromium, "--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking",
             "--disable-component-update", "--disable-sync", "--no-first-run", f"--user-data-dir={folder / 'profile'}",
             f"--proxy-server=127.0.0.1:{port}", f"--window-size={width},900", "--virtual-time-budget=5000", "--dump-dom",
             page.as_uri()]
    return subprocess.run(words, capture_output=True, text=True, timeout=240, check=True).stdout


def test_browser(vdvr, chromium, folder):
    _, text, _ = make(vdvr, folder)
    check(not any(host in text for host in OF_THE_BROWSER), "the page names a host that the browser asks")
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Proxy)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    port = server.server_address[1]
    alone = folder / "alone"
    alone.mkdir()
    probe = ("<script>addEventListener('load', () => { document.title = 'probe ' + JSON.stringify({"
             "pictures: [...document.images].map(i => i.naturalWidth), "
             "wide: document.documentElement.scrollWidth, window: innerWidth}); });</script></body>")

    def seen(name, content, width):
        (alone / name).write_text(content.replace("</body>", probe), encoding="utf-8")
        Proxy.asked.clear()
        dom = opened(chromium, alone / name, folder, port, width)
        found = re.search(r"<title>probe (.*?)</title>", dom)
        check(found, f"{name} was not loaded: {dom[:200]}")
        return json.loads(found[1]), [url for url in Proxy.asked if not is_of_the_browser(url)]

    # The proxy sees what a page fetches, or the rest shows nothing.
    _, asked = seen("control.html", text.replace("</main>", '<img src="http://outside.invalid/x.png"></main>'), 1200)
    check(any("outside.invalid" in url for url in asked), "a request of the control page was not seen")
    for width in (1200, 500):
        state, asked = seen(f"report-{width}.html", text, width)
        check(not asked, f"requested from elsewhere: {asked}")
        check(state["pictures"] and all(state["pictures"]), f"pictures that do not load: {state}")
        check(state["wide"] <= state["window"], f"wider than the window: {state}")
    server.shutdown()


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as scratch:
        if sys.argv[1] == "page":
            test_page(sys.argv[2], pathlib.Path(scratch))
        else:
            program = shutil.which("chromium")
            if not program:
                print("report_browser_test skipped: no chromium")
                sys.exit(0)
            test_browser(sys.argv[2], program, pathlib.Path(scratch))
