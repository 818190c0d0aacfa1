#!/usr/bin/env python3
"""`vdvr serve` in headless Chromium: loads, is dragged, rolled, re-coloured, on a desk and on a telephone.

  serve_browser.py VDVR CHROMIUM [--volume FILE] [--pictures FOLDER]

Needs websocket-client. Prints the frame rate while dragging; --volume measures that of another volume, --pictures
keeps what the page looked like.
"""
import argparse
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from chromium import Browser
from served import Served, check, make_volume

# What the page shows of the state, by its own controls, and the pixels of its picture.
PIXEL = "(() => {{ const c = document.getElementById('picture'); return [...c.getContext('2d').getImageData({0}, {1}, 1, 1).data]; }})()"
DIGEST = ("crypto.subtle.digest('SHA-256', document.getElementById('picture').getContext('2d')"
          ".getImageData(0, 0, document.getElementById('picture').width, document.getElementById('picture').height).data)"
          ".then(d => [...new Uint8Array(d)].join())")


class Page:
    def __init__(self, browser, pictures):
        self.browser, self.pictures = browser, pictures
        self.stills = 0

    def rest(self, what):
        """Waits for the full picture, and keeps it."""
        self.browser.wait_for("vdvr.full && !vdvr.error")
        if self.pictures:
            self.browser.screenshot(self.pictures / f"{what}.png")

    def changes(self, deed, what):
        """`deed` moves the picture: coarse frames come, then a full one that differs."""
        before, moving = self.browser.value(DIGEST), self.browser.value("vdvr.moving")
        deed()
        self.browser.wait_for(f"vdvr.moving > {moving}")
        self.rest(what)
        check(self.browser.value(DIGEST) != before, f"{what} changes nothing")


def check_still_is_that_of_render(vdvr, volume, browser, folder):
    """The pixels that the page shows, against the file of the command that it names."""
    command = browser.value("document.getElementById('command').textContent")
    words = command.split()
    check(words[:2] == ["vdvr", "render"] and words[3] == "-o", f"the command is {command!r}")
    picture = folder / "picture.png"
    extra = words[5:]
    if "--tf" in extra:
        curve = folder / "curve.json"
        curve.write_text(json.dumps({"points": browser.value("state.transfer")}))
        extra[extra.index("--tf") + 1] = str(curve)
    subprocess.run([vdvr, "render", str(volume), "-o", str(picture), "--force", *extra], check=True, capture_output=True)
    import base64
    data = base64.b64encode(picture.read_bytes()).decode()
    same = browser.value(f"""(async () => {{
      const image = await createImageBitmap(await (await fetchless('{data}')));
      const canvas = document.createElement('canvas');
      canvas.width = image.width; canvas.height = image.height;
      const c = canvas.getContext('2d'); c.drawImage(image, 0, 0);
      const a = c.getImageData(0, 0, image.width, image.height).data;
      const shown = document.getElementById('picture');
      if (shown.width !== image.width || shown.height !== image.height) return 'size';
      const b = shown.getContext('2d').getImageData(0, 0, image.width, image.height).data;
      for (let i = 0; i < a.length; ++i) if (a[i] !== b[i]) return 'byte ' + i;
      return 'same';
      async function fetchless(text) {{
        return new Blob([Uint8Array.from(atob(text), (x) => x.charCodeAt(0))], {{ type: 'image/png' }});
      }}
    }})()""")
    check(same == "same", f"what the page shows is not what `{command}` draws: {same}")


def frame_rate(browser, start, end, seconds=3.0):
    """Coarse frames shown a second while the mouse is dragged to and fro."""
    frames, begin = browser.value("vdvr.moving"), time.monotonic()
    browser.drag(start, end, int(60 * seconds), seconds)
    took = time.monotonic() - begin
    return (browser.value("vdvr.moving") - frames) / took, browser.value("[vdvr.width, vdvr.height]")


def on_a_desk(vdvr, volume, browser, page, folder):
    browser.size(1200, 800)
    page.rest("desk")
    check_still_is_that_of_render(vdvr, volume, browser, folder)
    azimuth = browser.value("state.azimuth")
    page.changes(lambda: browser.drag((300, 300), (500, 350), 30, 0.5), "dragged")
    check(browser.value("state.azimuth") != azimuth, "the drag did not turn")
    check_still_is_that_of_render(vdvr, volume, browser, folder)
    zoom = browser.value("state.zoom")
    page.changes(lambda: browser.wheel(400, 400, -300), "rolled")
    check(browser.value("state.zoom") > zoom, "the wheel did not zoom")
    # Up from the middle of the curve's last point.
    box = browser.value("(() => { const r = curve.getBoundingClientRect(), b = curveBox(), q = points()[points().length - 3];"
                        " return [r.left + b.x(q.value), r.top + b.y(q.opacity)]; })()")
    page.changes(lambda: browser.drag(box, (box[0] - 20, box[1] - 40), 10, 0.3), "recoloured")
    check(browser.value("JSON.stringify(state.transfer) !== JSON.stringify(scene.first.transfer)"), "the curve did not change")
    check_still_is_that_of_render(vdvr, volume, browser, folder)
    for name, mode in (("2", "iso"), ("3", "mip"), ("4", "slice"), ("5", "error")):
        page.changes(lambda: (browser.value("picture.focus()"), browser.key(name, name)), mode)
        check(browser.value("state.mode") == mode, f"key {name} shows {browser.value('state.mode')}")
        check_still_is_that_of_render(vdvr, volume, browser, folder)
    page.changes(lambda: browser.value("document.querySelector('[data-mode=dvr]').click()"), "button")
    browser.value("document.getElementById('cut').open = true")
    page.changes(lambda: browser.value("(() => { const c = document.getElementById('cut3'); c.value = 0;"
                                       " c.dispatchEvent(new Event('input')); })()"), "cut")
    check(abs(browser.value("state.clip[3]")) < 1, f"the cut is {browser.value('state.clip')}")
    check_still_is_that_of_render(vdvr, volume, browser, folder)
    page.changes(lambda: browser.value("document.getElementById('bound').click()"), "bound")
    browser.value("document.querySelectorAll('details').forEach(d => d.open = true)")
    words = browser.value("document.getElementById('certificate').innerText")
    check("certificate holds" in words, f"the certificate says {words!r}")
    browser.value("document.getElementById('theme').click()")
    if page.pictures:
        browser.screenshot(page.pictures / "dark.png")
    check(browser.value("[...document.querySelectorAll('button, input, canvas')].filter(e => e.offsetParent && "
                        "e.tabIndex < 0 && e.getAttribute('role') !== 'radio').length") == 0, "a control that no key reaches")


def on_a_telephone(browser, page):
    browser.value("document.querySelectorAll('details').forEach(d => d.open = false)")
    browser.value("document.getElementById('bound').click()")
    browser.size(390, 844, 2, True)
    browser.wait_for("picture.width === 780")
    page.rest("telephone")
    check(browser.value("document.documentElement.scrollWidth <= innerWidth"), "wider than the telephone")
    check(browser.value("[...document.querySelectorAll('#panel button')].every(b => !b.offsetParent || b.offsetHeight >= 40)"),
          "buttons too small for fingers")

    def one_finger():
        browser.touch("touchStart", [(100, 100)])
        for i in range(10):
            browser.touch("touchMove", [(100 + 8 * i, 100)])
        browser.touch("touchEnd", [])

    def two_fingers():
        browser.touch("touchStart", [(150, 200)])
        browser.touch("touchStart", [(150, 200), (240, 200)])
        for i in range(10):
            browser.touch("touchMove", [(150 - 5 * i, 200), (240 + 5 * i, 200)])
        browser.touch("touchEnd", [])

    azimuth = browser.value("state.azimuth")
    page.changes(one_finger, "finger")
    check(browser.value("state.azimuth") != azimuth, "a finger did not turn")
    zoom = browser.value("state.zoom")
    page.changes(two_fingers, "pinch")
    check(browser.value("state.zoom") > zoom, "two fingers did not zoom")
    check(browser.value("state.drag") == "none", "a drag goes on without fingers")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("vdvr")
    parser.add_argument("chromium")
    parser.add_argument("--volume", type=pathlib.Path)
    parser.add_argument("--pictures", type=pathlib.Path)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        volume = args.volume or make_volume(args.vdvr, folder)
        if args.pictures:
            args.pictures.mkdir(parents=True, exist_ok=True)
        with Served(args.vdvr, volume) as served:
            browser = Browser(args.chromium, folder / "profile")
            try:
                page = Page(browser, args.pictures)
                browser.open(served.address)
                browser.wait_for("window.vdvr && vdvr.full")
                browser.size(1200, 800)
                page.rest("loaded")
                rate, size = frame_rate(browser, (250, 350), (650, 450))
                print(f"serve_browser: {volume.name}: {rate:.1f} frames/s while dragging, 880 x 800 pixels shown, "
                      f"{size[0]} x {size[1]} drawn")
                if not args.volume:
                    on_a_desk(args.vdvr, volume, browser, page, folder)
                    on_a_telephone(browser, page)
                outside = [url for url in browser.requested() if not url.startswith((served.address, "data:", "blob:"))]
                check(not outside, f"the page asked elsewhere: {outside}")
                check(not browser.complaints(), f"the browser complains: {browser.complaints()}")
            finally:
                browser.close()
            code, said = served.interrupt()
            check(code == 130, f"it ended with {code}: {said}")
        shutil.rmtree(folder / "profile", ignore_errors=True)


if __name__ == "__main__":
    main()
