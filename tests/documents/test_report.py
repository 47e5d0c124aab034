"""Reports: a page that needs nothing beside it, LaTeX that compiles, and bodies cut free whose forces balance."""

from __future__ import annotations

import json
import math
import re
import shutil
import subprocess
from html import escape
from pathlib import Path

import numpy as np
import pytest
from writing_pages import Page

import multibody_sym as mbs
from multibody_sym.answers.free_bodies import CutFree, at_start
from multibody_sym.cli.main import main
from multibody_sym.pictures.scene.scene import scene_of

EXAMPLES = Path(__file__).parents[2] / "examples"
HOSTILE = "</script><b onload=alert(1)>\\input{x} $a$ #1 %&_^~ \u03b1\u4e2d \u00f6\u01ce\u0126\u2133"


@pytest.fixture(scope="module")
def hostile() -> mbs.Report:
    text = (EXAMPLES / "textbook" / "t5_incline.yaml").read_text(encoding="utf-8")
    said = f"description: {json.dumps(HOSTILE)}\n"
    text = re.sub(r"description: >-\n(  .*\n)+", lambda _: said, text)
    system = mbs.loads(text.replace("string:", f"{json.dumps(HOSTILE)}:").replace("tension(string)", "0"))
    return mbs.report(system, command=HOSTILE, t_end="0.1 s", samples=9, backend="python")


def test_a_page_has_all_parts_and_asks_for_nothing(hostile: mbs.Report) -> None:
    page = Page(hostile.html)
    assert all(address.startswith("data:image/svg+xml;base64,") for address in page.asked)
    assert page.tags.count("script") == 3
    assert "b" not in page.tags
    for title in ("At the start", "Given", "Solution", "Bodies cut free", "Motion", "Greatest reactions", "Details"):
        assert f">{title}</h" in hostile.html
    details = ("Equations of motion: Lagrange's equations with multipliers", "Checks", "Method of the run", "Command")
    for title in details:
        assert f"<summary>{escape(title)}</summary>" in hostile.html
    assert page.tags.count("svg") == 7  # the figure, two bodies, the stage, three instants for paper
    assert repr(hostile) == "<Report of t5_incline: figure, equations, solution, check, run>"
    assert hostile.html.count("&lt;/script&gt;&lt;b onload=alert(1)&gt;") >= 2


def test_a_statement_may_have_paragraphs() -> None:
    """As a file writes them with `|`; they come back from what is written, and reports keep them apart."""
    text = (EXAMPLES / "pendulum.yaml").read_text(encoding="utf-8")
    system = mbs.loads(re.sub(r"description: >-\n(  .*\n)+", "description: |\n  One.\n  Two.\n\n  Three.\n", text))
    assert system.description == "One.\nTwo.\n\nThree."
    assert mbs.loads(mbs.dumps(system)) == system
    report = mbs.report(system, t_end=0.01, samples=2, backend="python")
    assert '<p class="statement">One. Two.</p><p class="statement">Three.</p>' in report.html
    assert "One. Two.\n\nThree." in report.latex()
    with pytest.raises(mbs.ModelError, match="expected sentences"):
        mbs.System("s", description="\x1b[2J")


@pytest.mark.parametrize(
    "name", ["textbook/t5_incline", "textbook/ladder", "textbook/spool", "textbook/t7_atwood", "four_bar", "pendulum"]
)
def test_forces_on_bodies_cut_free_are_their_masses_times_accelerations(name: str) -> None:
    """By a second route: a_C from the accelerations of a run, which no reaction enters."""
    system = mbs.load(EXAMPLES / f"{name}.yaml")
    scene = scene_of(system)
    free = CutFree(system, scene, scene.motion(), at_start(mbs.solve(system))[0])
    pulls = [pull for pull in free.pulls() if pull.at.body >= 0]
    for k, body in enumerate(scene.mechanism.bodies):
        forces = sum(pull.vector for pull in pulls if pull.at.body == k and not pull.turns)
        run = mbs.simulate(with_places(system, body.name), t_end=1e-4, samples=2, rtol=1e-12)
        rates = np.array([(run[f"v{x}"][1] - run[f"v{x}"][0]) / 1e-4 for x in "xyz"])
        mass = float(free.motion.masses[k].mass)
        scale = max(pull.size for pull in pulls)
        assert np.allclose((forces - mass * rates)[:2] / scale, 0, atol=2e-3), (body.name, forces, mass * rates)


def with_places(system: mbs.System, body: str) -> mbs.System:
    from dataclasses import replace

    com = system.bodies[body].com
    place = body if com is None else f"{body}.centre_of_mass"
    if com is not None:
        own = system.bodies[body]
        bodies = {**system.bodies, body: replace(own, points={**own.points, "centre_of_mass": com})}
        system = replace(system, bodies=bodies)
    return replace(system, outputs={f"v{x}": f"velocity({place}, {x})" for x in "xyz"}, stop={}, ask={})


@pytest.mark.tex
@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="needs pdflatex")
def test_latex_compiles_with_any_names(hostile: mbs.Report, tmp_path: Path) -> None:
    written = hostile.write(tmp_path / "report.tex")
    assert [Path(name).name for name in written] == ["report.tex", "report_plot.pdf"]
    compiled(tmp_path, "report")


def compiled(folder: Path, name: str) -> None:
    words = ["pdflatex", "-interaction=nonstopmode", f"{name}.tex"]
    done = subprocess.run(words, cwd=folder, capture_output=True, timeout=300, check=False)
    log = (folder / f"{name}.log").read_text(encoding="latin-1")
    assert done.returncode == 0, log[-2000:]
    wide = [line for line in log.splitlines() if line.startswith("Overfull")]
    assert not [line for line in wide if float(line.partition("(")[2].partition("pt")[0]) > 10.0]


@pytest.mark.tex
@pytest.mark.long
@pytest.mark.parametrize("file", sorted(EXAMPLES.rglob("*.yaml")), ids=lambda path: path.stem)
def test_reports_of_all_examples_compile(file: Path, tmp_path: Path) -> None:
    if shutil.which("pdflatex") is None:
        pytest.skip("needs pdflatex")
    mbs.report(mbs.load(file)).write(tmp_path / "report.tex")
    compiled(tmp_path, "report")


def test_the_command_writes_a_report(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    asked = ["report", str(EXAMPLES / "pendulum.yaml"), "--t-end", "0.2", "--samples", "9", "--backend", "python"]
    assert main([*asked, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["written"] == ["pendulum.html"]
    assert main([*asked, "-o", "a.docx"]) == 2
    assert ".html or .tex" in capsys.readouterr().err
    stuck = tmp_path / "stuck.yaml"
    stuck.write_text("{multibody_sym: 1, name: s, bodies: {b: {mass: 0}}, joints: {j: {type: prismatic, parent: ground,"
                     " child: b, axis: x}}}", encoding="utf-8")  # fmt: skip
    assert main(["report", str(stuck), "-o", "stuck.html"]) == 0
    assert 'class="missing"' in (tmp_path / "stuck.html").read_text(encoding="utf-8")


PENDULUM = """
multibody_sym: 1
name: let_go
description: >-
  A pendulum of length 0.8 m is let go from the level. How large is the greatest force of its hinge, and when?
gravity: [0, -g, 0]
parameters: {g: 9.81 m/s^2, m: 2 kg, l: 0.8 m, alpha: 90 deg, crank_length: 2*l}
bodies: {bob: {mass: m, com: [0, -l, 0]}}
joints: {hinge: {type: revolute, parent: ground, child: bob, axis: z, q: theta_1, initial: {q: alpha}}}
simulation: {t_end: 1 s, samples: 4001}
"""


@pytest.fixture(scope="module")
def pendulum() -> mbs.Report:
    return mbs.report(mbs.loads(PENDULUM), command="multibody-sym report let_go.yaml", backend="python")


def readable(page: str) -> str:
    """Return the text of a page without scripts, pictures and the command."""
    inside = re.sub(r"<(script|style|svg|code)\b.*?</\1>", "", page.partition("<body>")[2], flags=re.DOTALL)
    return re.sub("<[^>]*>", " ", inside)


def test_question_figure_answers_solution_and_details_follow_each_other(pendulum: mbs.Report) -> None:
    page = pendulum.html
    assert "<h1>A pendulum of length 0.8 m is let go from the level</h1>" in page
    titles = (">Given</h2>", ">Solution</h2>", ">Motion</h2>")
    marks = ("How large is", "<svg", '<div class="answers">', *titles, "<details>")
    places = [page.index(mark) for mark in marks]
    assert places == sorted(places)
    assert page.count("<details>") == page.count("</details>") >= 4
    assert page.rindex("</h2>") < page.index("<summary>Checks")


def test_values_stand_as_declared_with_four_digits(pendulum: mbs.Report) -> None:
    told = readable(pendulum.html).replace("&nbsp;", " ")
    assert "90 deg" in told
    assert "0.8 m" in told
    assert "1.571" not in told
    assert re.search(r"2\s+l\s+=\s+1\.6 m", told)  # what follows from others, with its formula
    assert not re.search(r"[1-9]\d*\.\d{4,}|0\.0*[1-9]\d{4,}", told)


def test_no_formula_is_typed(pendulum: mbs.Report) -> None:
    told = readable(pendulum.html)
    assert not re.search(r"[A-Za-z_0-9]\*|\^|&gt;=|&lt;=|\w''|\d[eE][-+]\d|\btheta_|\bphi\b", told), told


def test_the_greatest_reaction_is_that_of_the_closed_form(pendulum: mbs.Report) -> None:
    """3 m g at the lowest point, which a pendulum let go from the level passes after K(1/2) sqrt(l/g)."""
    from scipy.special import ellipk

    table = re.search(r"Greatest reactions.*?</table>", pendulum.html, re.DOTALL)
    assert table is not None
    cells = [re.sub("<[^>]*>|&nbsp;", " ", cell).split() for cell in re.findall("<td>.*?</td>", table[0])]
    force, time = float(cells[1][0]), float(cells[2][0])
    assert force == pytest.approx(3 * 2 * 9.81, rel=1e-4)
    assert time == pytest.approx(ellipk(0.5) * np.sqrt(0.8 / 9.81), abs=1e-3)


def test_plane_loops_have_no_rows_of_zeros() -> None:
    page = mbs.report(mbs.load(EXAMPLES / "slider_crank.yaml"), t_end=0.01, samples=2, backend="python").html
    derived = page.partition("Equations of motion: ")[2].partition("</details>")[0]
    assert "C.x" in derived
    assert "C.rx" not in derived
    assert re.sub("<[^>]*>", "", derived).count("= 0") == 1  # what phi = 0 means, once


def test_latex_has_lines_and_no_boxes_that_resize(pendulum: mbs.Report) -> None:
    latex = pendulum.latex()
    own = re.sub(r"\\providecommand{\\fitted}.*|\\path.*|\\node.*", "", latex)
    assert r"\resizebox" not in own
    formulas = latex.count(r"\\") + latex.count(r"\begin{align*}")
    assert formulas > 2 * latex.count(r"\begin{align*}")


@pytest.mark.tex
@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="needs pdflatex")
def test_a_fragment_is_taken_in_and_its_equations_are_cited(tmp_path: Path) -> None:
    system = mbs.load(EXAMPLES / "textbook" / "t5_incline.yaml")
    mbs.report(system, tmp_path / "part.tex", fragment=True, t_end=0.1, samples=2, backend="python")
    (tmp_path / "whole.tex").write_text(
        "\\documentclass{article}\n\\usepackage{amsmath,graphicx,longtable,tikz}\n\\usepackage[margin=2cm]{geometry}\n"
        "\\begin{document}\n\\input{part}\nEquation (\\ref{t5-incline:5}).\n\\end{document}\n", encoding="utf-8"
    )  # fmt: skip
    compiled(tmp_path, "whole")
    compiled(tmp_path, "whole")
    assert "undefined" not in (tmp_path / "whole.log").read_text(encoding="latin-1")


@pytest.mark.parametrize(
    ("start", "words"), [("", "It stays at rest."), (", initial: {u: 1 m/s}", "Nothing is accelerated.")]
)
def test_what_has_no_acceleration_rests_only_without_a_speed(start: str, words: str) -> None:
    joint = f"{{type: prismatic, parent: ground, child: b, axis: x, q: x{start}}}"
    system = mbs.loads(f"{{multibody_sym: 1, name: s, bodies: {{b: {{mass: 1}}}}, joints: {{j: {joint}}}}}")
    page = mbs.report(system, t_end=0.1, samples=2, backend="python").html
    told = {each for each in ("It stays at rest.", "Nothing is accelerated.") if each in page}
    assert told == {words}
    assert ("Nothing moves." in page) == (start == "")


def test_answers_are_chosen_by_the_model_and_not_by_words_of_its_description() -> None:
    """On a slope, with mu = 0.1: it slides, rests from mu = tan(30 deg) on, and has come s''/2 far after 1 s."""
    system = mbs.loads("""
multibody_sym: 1
name: pente
description: Un bloc sur une pente. Que fait-il ?
gravity: [0, -9.81, 0]
parameters: {m: 3 kg, mu: 0.1}
bodies: {block: {mass: m}, ground: {frames: {slope: {rotate: [{axis: z, angle: -30 deg}]}}}}
joints: {slide: {type: prismatic, parent: ground.slope, child: block, axis: x, q: s}}
forces: {sole: {type: friction, joint: slide, static: mu, kinetic: mu}}
simulation: {t_end: 1 s}
""")
    answers = readable(mbs.report(system, samples=2, backend="python").html).partition("Given")[0]
    shown = " ".join(answers.replace("&nbsp;", " ").split())
    assert "it rests for" in shown
    assert f"{math.tan(math.radians(30)):.4g}" in shown
    assert f"{9.81 * (math.sin(math.radians(30)) - 0.1 * math.cos(math.radians(30))) / 2:.4g} m at" in shown
