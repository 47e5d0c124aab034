"""Formulas in lines: none is wider than the page, and what is broken means what it meant; letters that LaTeX lacks."""

from __future__ import annotations

import random
import re
import shutil
import subprocess
from html import unescape
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
import sympy
from random_formulas import random_formula

import multibody_sym as mbs
from multibody_sym.algebra.writers import LatexScript, TextScript
from multibody_sym.derivation.notation import Label, breakable
from multibody_sym.documents.derivation import derivation_document
from multibody_sym.documents.document import write_document
from multibody_sym.documents.formulas import ROOM, MathmlScript, equation_lines, latex_document
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.text.parser import parse
from multibody_sym.text.printer import latex_width

VALUES = {"m1": 1.1, "k": 0.7, "l": 1.7, "a": 0.3, "b": -1.1, "u": 0.6, "v": -0.8}
EXAMPLES = Path(__file__).parents[2] / "examples"


def product(seed: int) -> Any:
    """A formula with long sums in products, in one that is negative and in a square."""
    rng = random.Random(seed)
    parts = [sum(random_formula(rng, 2) for _ in range(4)) for _ in range(3)]
    return parts[0] * random_formula(rng, 2) / 2 - parts[1] * parts[2] * 3 + parts[0] ** 2


@pytest.mark.parametrize("seed", range(15))
def test_what_is_broken_means_what_it_meant(seed: int) -> None:
    """By a second route: the pieces in the model's language, read by its parser."""
    expression = product(seed)
    pieces = TextScript({}, {}).pieces(expression, 25)
    assert len(pieces) > 3
    node = parse(" ".join(pieces))
    found = evaluate_float([node], {leaf: VALUES[leaf.data] for leaf in leaves([node], "symbol")})[0]
    at = {s: VALUES[s.name] for s in expression.free_symbols}
    assert found == pytest.approx(float(expression.evalf(20, subs=at)), rel=1e-10, abs=1e-10)


@pytest.mark.parametrize("seed", range(8))
def test_pieces_are_whole_in_latex_and_mathml(seed: int) -> None:
    for piece in LatexScript({}, {}).pieces(product(seed), 100.0):
        assert piece.count("{") == piece.count("}")
        assert piece.count(r"\left") == piece.count(r"\right")
    for piece in MathmlScript({}, {}).pieces(product(seed), 20.0):
        ElementTree.fromstring(f"<math>{piece.replace('&#x', '&amp;#x')}</math>")


def test_no_line_of_a_long_energy_is_wider_than_the_page() -> None:
    equations = mbs.derive(mbs.load(EXAMPLES / "double_pendulum.yaml"))
    notation = equations.notation
    square = sum(sympy.expand(x) for x in (equations.kinetic_energy, *equations.mass_matrix)) ** 3
    long = sympy.Integer(7) / 3 * square * equations.kinetic_energy
    lines = equation_lines(notation, Label("T", "T"), long)
    assert len(lines) >= 3
    assert all(latex_width(line) <= ROOM for line in lines)
    wide = sympy.ones(4, 4) * 5 * equations.kinetic_energy
    assert [line[:9] for line in equation_lines(notation, Label("M", "M"), wide)[:2]] == ["{M}_{1,1}", "{M}_{1,2}"]
    both = equation_lines(notation, sympy.expand(long), equations.kinetic_energy, "&")
    assert both[0].startswith("&")
    assert "".join(both).count("= ") == 1
    assert all(latex_width(line) <= ROOM for line in both)
    page = write_document(derivation_document(equations), "html")
    assert all(len(unescape(re.sub("<[^>]*>", "", one))) < 90 for one in re.findall("<math.*?</math>", page))
    assert r"\resizebox" not in write_document(derivation_document(equations), "latex")


def compiled(folder: Path, body: str) -> str:
    if shutil.which("pdflatex") is None:
        pytest.skip("needs pdflatex")
    (folder / "a.tex").write_text(latex_document("Widths", body), encoding="utf-8")
    words = ["pdflatex", "-interaction=nonstopmode", "a.tex"]
    done = subprocess.run(words, cwd=folder, capture_output=True, timeout=300, check=False)
    log = (folder / "a.log").read_text(encoding="latin-1")
    assert done.returncode == 0, log[-2000:]
    return log


@pytest.mark.tex
def test_widths_are_those_of_tex(tmp_path: Path) -> None:
    written = [LatexScript({}, {}).shown(product(seed)) for seed in range(8)]
    written += [r"\ddot{\theta}_{1} l^{2} m_{1}", r"\sin \left(\text{crank angle}\right)", r"\frac{1}{2} m v^{2} + g"]
    body = "\n".join(rf"\setbox0\hbox{{$\displaystyle {x}$}}\typeout{{WIDE \the\wd0}}" for x in written)
    widths = [float(x) for x in re.findall(r"^WIDE ([\d.]+)pt", compiled(tmp_path, body), re.MULTILINE)]
    assert [latex_width(x) for x in written] == pytest.approx(widths, rel=0.15)


@pytest.mark.tex
def test_letters_of_all_kinds_compile_and_stay_in_the_file(tmp_path: Path) -> None:
    hostile = "αΩφ ö ǎ Ħ ℓ → ≤ ₁ 中 \U0001f600 \x85 \ud800 \u202e a\u0301"
    log = compiled(tmp_path, breakable(hostile) + "\n\n" + breakable("averylongname" * 20))
    assert "Overfull" not in log
    text = (tmp_path / "a.tex").read_text(encoding="utf-8")
    assert "αΩφ ö ǎ" in text
    assert r"\DeclareUnicodeCharacter{03B1}{\ensuremath{\alpha}}" in text
    assert r"\DeclareUnicodeCharacter{4E2D}{\unknownsign{4E2D}}" in text
    assert "\x85" not in text
