"""Pages opened in Chromium, which must neither complain nor ask for anything."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any


def opened(browser: Any, page: Path) -> None:
    """Open a page; fail where the console has a word or anything but the page itself is asked for."""
    browser.get_log("performance")
    browser.get(page.as_uri())
    time.sleep(0.2)
    assert [entry["message"] for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []
    events = (json.loads(entry["message"])["message"] for entry in browser.get_log("performance"))
    asked = [event["params"]["request"]["url"] for event in events if event["method"] == "Network.requestWillBeSent"]
    assert [url for url in asked if not url.startswith("data:")] in ([page.as_uri()], [])
