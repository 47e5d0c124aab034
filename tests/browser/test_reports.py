"""Reports in Chromium: every dot of a derivative is seen, answers are on the first screen, paper has everything."""

from __future__ import annotations

import base64
import io
import shutil
import subprocess
import unicodedata
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs

pytestmark = pytest.mark.browser
EXAMPLES = Path(__file__).parents[2] / "examples"
FILES = sorted(EXAMPLES.rglob("*.yaml"))
SOME = FILES[2::5]
SCALE = 2
STRIP = 4000
PAPER = {"paperWidth": 8.27, "paperHeight": 11.69, "preferCSSPageSize": False}
LINE = 673  # pixels of an A4 page between margins of 16 mm
DOTS = """
document.querySelectorAll('details').forEach((x) => { x.open = true; });
return [...document.querySelectorAll('.report mover')].map((m) => {
  const dot = m.children[1], a = dot.getBoundingClientRect();
  return [a.left + scrollX, a.top + scrollY, a.right + scrollX, dot.textContent.charCodeAt(0) === 0xA8];
});
"""
LAST_WORDS = """
const last = (e) => {
  const walk = document.createTreeWalker(e, NodeFilter.SHOW_TEXT); let found = '';
  while (walk.nextNode()) { const text = walk.currentNode.textContent.trim(); if (text) found = text; }
  return found.split(/\\s+/).pop();
};
document.querySelectorAll('details').forEach((x) => { x.open = true; });
const seen = [...document.querySelectorAll('.report h1, .report h2, .report h3, .report p, .report li, .report td, '
  + '.report th, .report summary, .report figcaption')].filter((e) => e.checkVisibility());
return seen.map(last).filter((word) => word);
"""
CUT = """
return [...document.querySelectorAll('.report *')].filter((e) => e.checkVisibility() && !e.closest('svg')
  && e.getBoundingClientRect().right > document.documentElement.clientWidth + 1).map((e) => e.outerHTML.slice(0, 200));
"""
CONTROLS = """
return [...document.querySelectorAll('button, input, select, output, label')].filter((e) => e.checkVisibility()).length;
"""
FIRST = """
const box = document.querySelector('.answers');
return box && [...box.querySelectorAll('p')].map((e) => e.getBoundingClientRect().bottom);
"""


def shown(browser: Any, page: Path, width: int, height: int, *, scale: int = 1, media: str = "") -> None:
    size = {"width": width, "height": height, "deviceScaleFactor": scale, "mobile": False}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": media})
    browser.get(page.as_uri())


def unseen_dots(browser: Any, page: Path) -> list[int]:
    """Return the numbers of those accents of which not each dot is dark, apart from the other and from its letter."""
    image = pytest.importorskip("PIL.Image")
    shown(browser, page, 1280, 800, scale=SCALE)
    dots = browser.execute_script(DOTS)
    unseen = []
    for strip in sorted({int(top // STRIP) for _, top, _, _ in dots}):  # long pages are larger than an image may be
        clip = {"x": 0, "y": strip * STRIP, "width": 1280, "height": STRIP + 20, "scale": 1}
        shot = browser.execute_cdp_cmd("Page.captureScreenshot", {"captureBeyondViewport": True, "clip": clip})
        grey = np.asarray(image.open(io.BytesIO(base64.b64decode(shot["data"]))).convert("L"))
        own = [(k, dot) for k, dot in enumerate(dots) if dot[1] // STRIP == strip]
        unseen += [k for k, (x, y, end, two) in own if not is_seen(grey, x, y - strip * STRIP, end, two)]
    return unseen


def is_seen(grey: Any, left: float, top: float, right: float, two: bool) -> bool:
    """Return whether one dot or two stand at a place of the page, white between them and their letter."""
    rows = slice(round(SCALE * top), round(SCALE * (top + 14)))
    dark = grey[rows, round(SCALE * left) : round(SCALE * right)] < 140
    lines = dark.any(axis=1)
    first = int(np.argmax(lines))
    below = first + int(np.argmin(lines[first:]))
    if not lines.any() or lines[first:].all():  # nothing there, or grown together with the letter
        return False
    columns = dark[first:below].any(axis=0).astype(int)
    return int((np.diff(np.concatenate([[0], columns])) == 1).sum()) == (2 if two else 1)


def paper_of(browser: Any) -> str:
    """Return the text of the printed page without spaces, letters of mathematics as plain ones."""
    if shutil.which("pdftotext") is None:
        pytest.skip("needs pdftotext")
    content = base64.b64decode(browser.execute_cdp_cmd("Page.printToPDF", PAPER)["data"])
    done = subprocess.run(["pdftotext", "-raw", "-", "-"], input=content, capture_output=True, check=True)
    return plain(done.stdout.decode("utf-8"))


def plain(text: str) -> str:
    return "".join(unicodedata.normalize("NFKC", text).split())


def faults_on_paper(browser: Any, page: Path) -> list[str]:
    """Return the last words of blocks that are not printed, what is cut off, and printed controls."""
    shown(browser, page, LINE, 1000, media="print")
    words = Counter(plain(word) for word in browser.execute_script(LAST_WORDS))
    faults = [f"cut: {each}" for each in browser.execute_script(CUT)]
    faults += ["a control"] * browser.execute_script(CONTROLS)
    shown(browser, page, 1280, 800)  # details are shut again: the browser opens them
    told = paper_of(browser)
    return faults + [word for word, count in words.items() if told.count(word) < count]


@pytest.mark.parametrize("file", SOME[::5], ids=lambda path: path.stem)
def test_reports_are_seen_and_printed_whole(browser: Any, file: Path, tmp_path: Path) -> None:
    verify(browser, file, tmp_path)


@pytest.mark.long
@pytest.mark.parametrize("file", FILES, ids=lambda path: path.stem)
def test_all_reports_are_seen_and_printed_whole(browser: Any, file: Path, tmp_path: Path) -> None:
    verify(browser, file, tmp_path)


def verify(browser: Any, file: Path, folder: Path) -> None:
    page = folder / "report.html"
    mbs.report(mbs.load(file)).write(page)
    assert unseen_dots(browser, page) == []
    assert faults_on_paper(browser, page) == []
    shown(browser, page, 1280, 800)
    places = browser.execute_script(FIRST)
    assert places
    assert min(places) <= 800


def test_a_dot_that_lies_on_its_letter_is_found(browser: Any, tmp_path: Path) -> None:
    """The measure itself: dots without a gap, or white ones, count as unseen."""
    gap = "padding-bottom:.1em"
    dots = {"seen": gap, "none": "visibility:hidden", "upon": f"{gap};position:relative;top:.5em"}
    for name, style in dots.items():
        accent = f'<mover><mi>x</mi><mo style="math-depth:0;font-weight:bold;{style}">&#xA8;</mo></mover>'
        page = tmp_path / f"{name}.html"
        page.write_text(f'<!DOCTYPE html><main class="report"><p><math>{accent}</math></main>', encoding="utf-8")
        assert unseen_dots(browser, page) == ([] if name == "seen" else [0]), name
