"""The search of the built site leads a newcomer's word to the right page; 20 words, written before they were tried."""

from __future__ import annotations

import functools
import http.server
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

import pytest

pytestmark = pytest.mark.browser
ROOT = Path(__file__).parents[2]
RIGHT: Final[Mapping[str, str]] = {
    "install": "index", "pip": "index", "windows": "index", "first model": "guide/first_model",
    "friction": "guide/contacts", "contact": "guide/contacts", "rope": "guide/contacts", "pulley": "guide/contacts",
    "impact": "guide/impacts", "bounce": "guide/contacts", "urdf": "guide/robots", "frequency": "guide/questions",
    "equilibrium": "guide/loops", "linearize": "guide/control", "units": "guide/first_model",
    "error M101": "reference/errors", "simulate": "reference/commands", "export C": "reference/commands",
    "table": "guide/forces_and_options", "which command": "which_command",
}  # fmt: skip
FIRST = "const hit = document.querySelector('.md-search-result__item > a'); return hit ? hit.href : null;"


class _Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_words: object) -> None:
        """Print nothing."""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of the built site, served on this machine."""
    pytest.importorskip("material")
    folder = tmp_path_factory.mktemp("site")
    subprocess.run([sys.executable, "-m", "mkdocs", "build", "-q", "-d", str(folder)], cwd=ROOT, check=True)
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(_Quiet, directory=str(folder)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()


def test_the_first_hit_is_right_for_18_of_20_words(site: str) -> None:
    webdriver = pytest.importorskip("selenium.webdriver")
    path = shutil.which("chromedriver")
    if path is None:
        pytest.skip("needs Chromium and its driver")
    options = webdriver.ChromeOptions()
    for word in ("--headless=new", "--no-sandbox", "--window-size=1280,800"):
        options.add_argument(word)
    browser = webdriver.Chrome(options=options, service=webdriver.ChromeService(path))
    wrong = {}
    for word, page in RIGHT.items():
        browser.get(f"{site}index.html?q={word.replace(' ', '%20')}")
        end = time.monotonic() + 20
        while (hit := browser.execute_script(FIRST)) is None and time.monotonic() < end:
            time.sleep(0.1)
        if hit is None or not hit.startswith(f"{site}{page}.html"):
            wrong[word] = hit
    browser.quit()
    assert len(wrong) <= 2, wrong
