"""Pictures as TikZ, PNG and PDF: the page's size, what is drawn, and what users wrote as letters alone."""

from __future__ import annotations

import re
import shutil
import struct
import subprocess
from pathlib import Path

import numpy as np
import pytest
from hostile_labels import LABELS

from multibody_sym.pictures.page.files import DOTS, escaped_tex, raster, tikz
from multibody_sym.pictures.page.layout import laid_out
from multibody_sym.pictures.page.picture import (
    Arc,
    Arrow,
    Hatch,
    Measure,
    Pen,
    Picture,
    Stroke,
    TextMark,
    Wish,
    letters,
    words,
)
from multibody_sym.text.printer import GREEK

PEN = Pen(0.8, "#102030", (3.0, 2.0))


def page(labels: list[str]) -> Picture:
    """Return a picture with one of each mark, and a column of labels."""
    marks = [
        Stroke(np.array([[0.0, 0.0], [60.0, 0.0], [60.0, 30.0]]), Pen(0.9), closed=True, fill="#e4e7eb"),
        Arc(np.array([30.0, 30.0]), 10.0, PEN, 0.5, 4.0),
        Arc(np.array([30.0, 30.0]), 3.0, PEN, fill="#ffffff"),
        Arrow(np.array([[0.0, 40.0], [50.0, 60.0]]), Pen(1.0, "#b01217")),
        Hatch(np.array([[0.0, -5.0], [60.0, -5.0]]), Pen(1.4), side=-1),
        Measure(np.array([0.0, 0.0]), np.array([60.0, 0.0]), letters("l_1"), name="l_1"),
    ]
    column = [Wish(np.array([[200.0, 14.0 * i]]), words(text), name=text) for i, text in enumerate(labels)]
    return laid_out([*marks, *column], "a \\title{x} & co", "d")


def compiled(source: str, folder: Path) -> str:
    """Return the log of pdflatex, which must end without an error."""
    (folder / "figure.tex").write_text(source, encoding="utf-8")
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "-no-shell-escape", "figure.tex"]
    run = subprocess.run(command, cwd=folder, capture_output=True, timeout=120, check=False)
    log = run.stdout.decode(errors="replace")
    assert run.returncode == 0, log[-2000:]
    return log


def has_tikz() -> bool:
    find = shutil.which("kpsewhich")
    return find is not None and bool(subprocess.run([find, "tikz.sty"], capture_output=True, check=False).stdout)


def test_tikz_draws_in_points_of_a_page_of_the_pictures_size() -> None:
    picture = Picture(100, 50, [Stroke(np.array([[0.0, 0.0], [10.0, 50.0]]), PEN)], "t")
    source = tikz(picture)
    assert "paperwidth=100bp,paperheight=50bp" in source
    assert "(0,0) -- (10,50);" in source
    assert "draw={rgb,255:red,16;green,32;blue,48},line width=0.8bp,dash pattern=on 3bp off 2bp" in source
    assert r"\documentclass" not in tikz(picture, alone=False)


def test_tikz_has_the_arc_of_the_picture() -> None:
    source = tikz(Picture(100, 50, [Arc(np.array([50.0, 25.0]), 10.0, PEN, 0.0, np.pi / 2)], "t"))
    assert "(60,25) arc[start angle=0,end angle=90,radius=10];" in source


@pytest.mark.parametrize("label", [*LABELS, "".join(GREEK.values())])
def test_no_label_is_a_command_of_tex(label: str) -> None:
    r"""Of backslashes, braces and the like only those that the writer sets itself are left, and braces pair up."""
    source = escaped_tex("".join(run for run, _ in words(label)))
    own = (
        r"\\text(backslash|asciicircum|asciitilde|less|greater|bar|quotedbl|degree|periodcentered|twosuperior|"
        r"threesuperior|pm|times)\{\}|\\dots\{\}|\\[#$%&_{}]|\{['`-]\}|\$\\mathit\{\\[A-Z][a-z]+\}\$|\$\\[a-z]+\$|\$-\$"
    )
    rest = re.sub(own, "", source)
    assert not re.search(r"[\\{}$%#&^_~\x00-\x1f\x7f]", rest), source


@pytest.mark.tex
@pytest.mark.skipif(not has_tikz(), reason="pdflatex with TikZ is not installed")
def test_a_document_compiles_to_one_page_without_a_word_too_wide(tmp_path: Path) -> None:
    log = compiled(tikz(page([*LABELS, "".join(GREEK.values())])), tmp_path)
    assert "1 page" in log
    assert "Overfull" not in log
    assert not (tmp_path / "pwned").exists()


def test_a_png_is_of_the_pictures_size_and_the_same_every_time() -> None:
    picture = page(LABELS[:3])
    content = raster(picture, "png")
    width, height = struct.unpack(">II", content[16:24])
    assert (width, height) == pytest.approx((picture.width / 72 * DOTS, picture.height / 72 * DOTS), abs=1)
    assert content == raster(picture, "png")
    assert b"Matplotlib" not in content


@pytest.mark.filterwarnings("error")
def test_a_pdf_of_hostile_labels_is_the_same_every_time() -> None:
    picture = page(LABELS)
    content = raster(picture, "pdf")
    assert content.startswith(b"%PDF")
    assert content == raster(picture, "pdf")
    for word in (b"/JavaScript", b"/JS ", b"/Launch", b"/URI"):
        assert word not in content


def test_a_dollar_starts_no_formula() -> None:
    """Letters as wide as they are as text: a formula would leave out its signs."""
    one = Picture(200, 40, [TextMark(np.array([10.0, 10.0]), words(r"$\frac{1}{2}$"), 10.0)], "t")
    assert raster(one, "png")
