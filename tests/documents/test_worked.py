"""The steps of a solution as text, as LaTeX that compiles, and as HTML."""

from __future__ import annotations

import re
import shutil
import subprocess
from functools import cache
from html.parser import HTMLParser
from pathlib import Path

import pytest

import multibody_sym as mbs
from multibody_sym.answers.records import Worked
from multibody_sym.cli.main import main
from multibody_sym.documents.document import worked_document, write_document
from multibody_sym.documents.formulas import ABOVE
from multibody_sym.text.values import chosen_units

EXAMPLES = Path(__file__).parents[2] / "examples"
ATWOOD = EXAMPLES / "textbook" / "t7_atwood.yaml"

TEXT = """\
t7_atwood: step by step

Given
    g = 10 m/s^2
    m1 = 1 kg
    m2 = 2 kg
    y1: way along y of left, at 0 m, at rest
    y2: way along y of right, at 0 m, at rest

left, cut free
    m1*g: weight, down
    T: tension of string, up
    (1) along y1: m1*y1'' = T - m1*g

right, cut free
    m2*g: weight, down
    T: tension of string, up
    (2) along y2: m2*y2'' = T - m2*g

Relations between accelerations
    (3) string: y1'' + y2'' = 0

Elimination
    from (3): y2'' = -y1''
    from (1): T = m1*y1'' + m1*g
    (2) becomes: (m1 + m2)*y1'' = (m2 - m1)*g
    from (2): y1'' = (m2 - m1)*g/(m1 + m2)

Result
    y1'' = (m2 - m1)*g/(m1 + m2) = 3.33333 m/s^2
    y2'' = (m1 - m2)*g/(m1 + m2) = -3.33333 m/s^2
    T = 2*m1*m2*g/(m1 + m2) = 13.3333 N"""


@cache
def steps(path: Path) -> Worked:
    found = mbs.solve(mbs.load(path), steps=True).steps
    assert found is not None
    return found


def test_text() -> None:
    assert write_document(worked_document(steps(ATWOOD)), "text").partition("\n\nConditions")[0] == TEXT


def test_numbers_are_told_in_chosen_units() -> None:
    text = write_document(worked_document(steps(ATWOOD)), "text", chosen_units("mm,kN"))
    assert "y1'' = (m2 - m1)*g/(m1 + m2) = 3333.33 mm/s^2" in text
    assert "T = 2*m1*m2*g/(m1 + m2) = 0.0133333 kN" in text


def brackets(latex: str) -> list[str]:
    """Return what is wrong with the brackets, environments and dollars of LaTeX."""
    bare = latex.replace(r"\\", "").replace(r"\{", "").replace(r"\}", "").replace(r"\$", "")
    wrong = [] if bare.count("{") == bare.count("}") else ["brackets"]
    depth = 0
    for c in bare:
        depth += (c == "{") - (c == "}")
        wrong += ["bracket that closes nothing"] if depth < 0 else []
    wrong += [] if bare.count("$") % 2 == 0 else ["dollars"]
    opened: list[str] = []
    for word, name in re.findall(r"\\(begin|end)\{(\w+\*?)\}", latex):
        if word == "begin":
            opened.append(name)
        elif not opened or opened.pop() != name:
            wrong.append(name)
    wrong += ["left"] if len(re.findall(r"\\left[(|]", bare)) != len(re.findall(r"\\right[)|]", bare)) else []
    return wrong + opened


@pytest.mark.parametrize("name", ["textbook/t7_atwood", "textbook/incline_pulley", "slider_crank", "four_bar"])
def test_latex_is_a_whole_document(name: str) -> None:
    latex = write_document(worked_document(steps(EXAMPLES / f"{name}.yaml")), "latex")
    assert latex.startswith(r"\documentclass")
    assert latex.endswith("\\end{document}\n")
    assert brackets(latex) == []
    body = latex.partition(r"\begin{document}")[2]
    outside = re.sub(r"\$[^$]*\$|\\begin\{align\*\}.*?\\end\{align\*\}", "", body, flags=re.DOTALL)
    assert not re.search(r"(?<!\\)[_^#%&~]", outside)
    assert not re.search(r"\n\s*\n", body)


def test_wrong_latex_is_seen() -> None:
    assert brackets(r"\begin{align*} \frac{a}{b \end{align*}") != []
    assert brackets(r"$a$ and $b") == ["dollars"]


def test_latex_of_an_equation() -> None:
    latex = write_document(worked_document(steps(ATWOOD)), "latex")
    assert r"& \text{along $y_{1}$: }m_{1} \ddot{y}_{1} = T - m_{1} g \tag{1}" in latex
    assert r"T = \frac{2 m_{1} m_{2} g}{m_{1} + m_{2}} = \ensuremath{13.3333}\ \text{N}" in latex


@pytest.mark.long
@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="needs pdflatex")
@pytest.mark.parametrize(
    "name", ["textbook/t7_atwood", "textbook/t8_blocks_in_a_row", "slider_crank", "four_bar", "furuta"]
)
def test_latex_compiles(name: str, tmp_path: Path) -> None:
    latex = write_document(worked_document(steps(EXAMPLES / f"{name}.yaml")), "latex")
    (tmp_path / "steps.tex").write_text(latex, encoding="utf-8")
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "steps.tex"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-2000:]


class Tags(HTMLParser):
    """Notes tags that are not closed in their order, and what a page would fetch."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.wrong: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag != "meta":
            self.open.append(tag)
        self.wrong += [tag for name, _ in attrs if name in ("src", "href")]

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open.pop() != tag:
            self.wrong.append(tag)


@pytest.mark.parametrize("name", ["textbook/t7_atwood", "four_bar", "pendulum"])
def test_html_is_a_page_that_needs_nothing_beside_it(name: str) -> None:
    html = write_document(worked_document(steps(EXAMPLES / f"{name}.yaml")), "html")
    tags = Tags()
    tags.feed(html)
    assert tags.open == []
    assert tags.wrong == []
    assert "script" not in html


def test_html_of_an_equation() -> None:
    html = write_document(worked_document(steps(ATWOOD)), "html")
    mass = "<msub><mi>m</mi><mrow><mn>1</mn></mrow></msub>"
    acceleration = f'<msub><mover><mi>y</mi><mo {ABOVE}>&#xA8;</mo></mover><mrow><mn>1</mn></mrow></msub>'
    assert f'{mass}<mspace width="0.17em"/>{acceleration}</math>' in html
    assert '<math displaystyle="true"><mo lspace="0">=</mo> <mi>T</mi></math>' in html


def test_command_writes_steps_in_each_format(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["solve", str(ATWOOD), "--steps"]) == 0
    assert capsys.readouterr().out.startswith(TEXT)
    assert main(["solve", str(ATWOOD), "--steps", "--format", "latex"]) == 0
    assert capsys.readouterr().out.startswith(r"\documentclass")
    assert main(["solve", str(ATWOOD), "--format", "html"]) == 0
    assert capsys.readouterr().out.startswith("<!DOCTYPE html>")
    assert main(["solve", str(ATWOOD)]) == 0
    assert capsys.readouterr().out.startswith("t7_atwood at t = 0")
