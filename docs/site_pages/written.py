"""What code writes into the checkout: the page of keys, pictures and printed output; a test compares all of it.

    PYTHONPATH=docs python -m site_pages      # writes everything anew
"""

from __future__ import annotations

import contextlib
import io
import re
import tempfile
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from textwrap import wrap

import multibody_sym as mbs
from multibody_sym.cli.main import main
from multibody_sym.documents.derivation import derivation_document
from multibody_sym.documents.document import write_document
from site_pages.gallery import EXAMPLES, ROOT
from site_pages.keys import keys

DOCS = ROOT / "docs"
MOVING = DOCS / "double_pendulum.gif"
"""The moving picture of the README and the first page."""

_BEAM = "beam_with_a_line_load"


def written() -> Mapping[Path, Callable[[], str]]:
    """Return each text file that code writes, with the function that returns its text."""
    tutorials = DOCS / "tutorials"
    return {
        DOCS / "keys.md": keys,
        tutorials / "incline.svg": partial(_drawn, lambda: mbs.loads(printed(tutorials / "student.md", "yaml"))),
        tutorials / "slider_crank.svg": partial(_drawn, lambda: mbs.load(EXAMPLES / "slider_crank.yaml")),
        tutorials / "robot.svg": partial(_drawn, _robot),
        DOCS / "guide" / "beam_diagrams.svg": _diagrams,
        DOCS / "guide" / "phase_portrait.svg": partial(_phase_portrait, "bead_on_hoop", "theta"),
        DOCS / "guide" / "polhodes.svg": partial(_phase_portrait, "tennis_racket", "racket"),
        DOCS / "guide" / f"{_BEAM}.svg": partial(_drawn, lambda: mbs.load(EXAMPLES / "textbook" / f"{_BEAM}.yaml")),
        ROOT / "README.md": _readme,
        DOCS / "index.md": _first_page,
    }


def moving_picture() -> bytes:
    """Return the GIF of the double pendulum."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / MOVING.name
        mbs.animate(mbs.simulate(mbs.load(EXAMPLES / "double_pendulum.yaml")), path)
        return path.read_bytes()


def printed(page: Path, language: str) -> str:
    """Return the first block of a language on a page."""
    found = re.search(rf"^```{language}\n(.*?)^```$", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    assert found
    return found[1]


def _diagrams() -> str:
    return mbs.draw(mbs.load(EXAMPLES / "textbook" / f"{_BEAM}.yaml"), diagrams=True).svg


def _phase_portrait(example: str, of: str) -> str:
    return mbs.draw(mbs.load(EXAMPLES / f"{example}.yaml"), phase=of).svg


def _drawn(load: Callable[[], mbs.System]) -> str:
    return mbs.draw(load()).svg


def _robot() -> mbs.System:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "robot.urdf"
        path.write_text(printed(DOCS / "tutorials" / "roboticist.md", "xml"), encoding="utf-8")
        return mbs.load_urdf(path)


def _readme() -> str:
    """Return the README with the lines that `solve` prints of its model today, of those that it shows."""
    page = ROOT / "README.md"
    shown = printed(page, "text").splitlines()
    lines = _solved(printed(page, "yaml")).splitlines()
    heads = [re.split(r" = |: |,", line)[0] for line in shown]
    today = "".join(f"{next(line for line in lines if line.startswith(head))}\n" for head in heads)
    return page.read_text(encoding="utf-8").replace(printed(page, "text"), today)


def _solved(model: str) -> str:
    """Return the text that `multibody-sym solve` prints of a model file's text."""
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()) as out:
        path = Path(folder) / "model.yaml"
        path.write_text(model, encoding="utf-8")
        main(["solve", str(path)])
    return out.getvalue()


def _first_page() -> str:
    """Return the first page with the equations that `derive` prints of its model, in lines that fit."""
    page = DOCS / "index.md"
    document = derivation_document(mbs.derive(mbs.loads(printed(page, "yaml"))))
    lines = write_document(document, "text").partition("Equations of motion\n")[2].splitlines()
    fitting = [part for line in lines for part in wrap(line, 100, subsequent_indent="      ", break_on_hyphens=False)]
    today = "\n".join(["Equations of motion", *fitting, ""])
    return page.read_text(encoding="utf-8").replace(printed(page, "text"), today)
