"""Pictures of written pages, drawn of the models that stand in them when the site is built."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import multibody_sym as mbs
from site_pages.gallery import EXAMPLES

TUTORIALS = Path(__file__).parents[1] / "tutorials"


def pictures() -> Mapping[str, Callable[[], str]]:
    """Return how to draw each picture, by its address."""
    return {
        "tutorials/incline.svg": partial(_drawn, lambda: mbs.loads(_printed("student", "yaml"))),
        "tutorials/slider_crank.svg": partial(_drawn, lambda: mbs.load(EXAMPLES / "slider_crank.yaml")),
        "tutorials/robot.svg": partial(_drawn, _robot),
    }


def _drawn(load: Callable[[], mbs.System]) -> str:
    return mbs.draw(load()).svg


def _printed(page: str, language: str) -> str:
    """Return the first block of a language in a tutorial."""
    found = re.search(rf"^```{language}\n(.*?)^```$", (TUTORIALS / f"{page}.md").read_text(), re.MULTILINE | re.DOTALL)
    assert found
    return found[1]


def _robot() -> mbs.System:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "robot.urdf"
        path.write_text(_printed("roboticist", "xml"), encoding="utf-8")
        return mbs.load_urdf(path)
