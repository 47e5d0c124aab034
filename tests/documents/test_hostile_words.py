"""Two hundred strings that try to break out of reports: as statements, names and labels, in LaTeX, HTML and MathML."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from dataclasses import replace
from html.entities import html5
from pathlib import Path
from xml.etree import ElementTree

import pytest
from hostile import PAYLOADS
from writing_pages import Page

import multibody_sym as mbs
from multibody_sym.derivation.notation import breakable, dotted, escaped, latex_name
from multibody_sym.documents.formulas import latex_document, latex_in_mathml, mathml_name
from multibody_sym.documents.report import Report
from multibody_sym.documents.report_content import Missing, findings

sys.path.insert(0, str(Path(__file__).parents[1] / "drawing"))
from hostile_labels import LABELS

LONG = ["ö" * 300, "αβγ中文" * 60, "\u0301" * 50, "x" * 1000, "a_" * 200, "\U0001f600" * 40, "\u202e\u2066<b>\u2069"]
TEX = [
    rf"{a}{b}"
    for a in ("}", r"\text{", r"\end{longtable}", r"\]", "$$", r"\hspace{0pt}}", r"\unknownsign{", r"\\[9cm]", "~")
    for b in (r"\input{/etc/passwd}", r"\write18{touch pwned}", r"\openout5=pwned", r"\csname end\endcsname{document}")
]
_ENTITIES = ("lt", "gt", "amp", "quot")
WORDS = [*LABELS, *(x for x in PAYLOADS if len(x) < 300), *LONG, *TEX]


def test_there_are_two_hundred() -> None:
    assert len(set(WORDS)) >= 200


@pytest.mark.parametrize("word", WORDS, ids=range(len(WORDS)))
def test_no_name_is_markup_in_mathml(word: str) -> None:
    """What is read back is letters alone, in elements that were meant."""
    letter = latex_name(word)
    for content in (mathml_name(word), latex_in_mathml(letter), latex_in_mathml(dotted(letter, "dot"))):
        clean = re.sub(r"&(\w+);", lambda x: x[0] if x[1] in _ENTITIES else html5[f"{x[1]};"], content)
        clean = re.sub("[\x00-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff]", "", clean)
        tags = {each.tag for each in ElementTree.fromstring(f"<math>{clean}</math>").iter()}
        assert tags <= {"math", "mtext", "mi", "mn", "mo", "mrow", "msub", "msup", "mover", "mspace"}


def test_no_statement_is_markup_in_a_page() -> None:
    pendulum = mbs.load(Path(__file__).parents[2] / "examples" / "pendulum.yaml")
    none = Missing("left out")
    told = replace(
        findings(pendulum, "", {"t_end": 0.01, "samples": 2, "backend": "python"}), equations=none, solution=none,
        check=none, run=none,
    )  # fmt: skip
    plain = Page(Report(replace(told, command="x")).html)
    for word in WORDS:
        said = word if word.isprintable() and word.strip() else "refused by the model"
        html = Report(replace(told, system=replace(pendulum, description=said), command=word or "x")).html
        assert html.encode("utf-8")
        page = Page(html)
        assert page.tags == plain.tags
        assert page.asked == []


@pytest.mark.tex
def test_no_words_are_commands_of_tex(tmp_path: Path) -> None:
    """In paragraphs, titles, typed text and formulas: all of them reach the end of the document."""
    if shutil.which("pdflatex") is None:
        pytest.skip("needs pdflatex")
    shown = [
        rf"{breakable(word)}\par\texttt{{{breakable(word)}}}\par${dotted(latex_name(word[:60]), 'ddot')}$\par"
        rf"\typeout{{WORD {k}}}\subsection{{{escaped(word[:40])}}}"
        for k, word in enumerate(WORDS)
    ]
    (tmp_path / "a.tex").write_text(latex_document(WORDS[0], "\n\n".join(shown)), encoding="utf-8")
    words = ["pdflatex", "-interaction=nonstopmode", "-shell-escape", "a.tex"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, timeout=300, check=False)
    log = (tmp_path / "a.log").read_text(encoding="latin-1")
    assert done.returncode == 0, log[-3000:]
    assert [int(k) for k in re.findall(r"^WORD (\d+)", log, re.MULTILINE)] == [*range(len(WORDS))]
    assert "root:" not in log
    assert {path.suffix for path in tmp_path.iterdir()} <= {".tex", ".log", ".aux", ".pdf"}
    assert not (tmp_path / "pwned").exists()
