"""Reports: a page that needs nothing beside it, LaTeX that compiles, and bodies cut free whose forces balance."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
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
    assert page.asked == []
    assert page.tags.count("script") == 2
    assert "b" not in page.tags
    titles = ("Parameters", "Equations of motion", "Solution at the start", "Bodies cut free", "Motion", "Checks")
    for title in titles:
        assert f">{title}</h" in hostile.html
    assert page.tags.count("svg") == 4  # the figure, two bodies, the stage
    assert repr(hostile) == "<Report of t5_incline: figure, equations, solution, check, run>"
    assert hostile.html.count("&lt;/script&gt;&lt;b onload=alert(1)&gt;") >= 2


def test_a_statement_may_have_paragraphs() -> None:
    """As a file writes them with `|`; they come back from what is written, and reports keep them apart."""
    text = (EXAMPLES / "pendulum.yaml").read_text(encoding="utf-8")
    system = mbs.loads(re.sub(r"description: >-\n(  .*\n)+", "description: |\n  One.\n  Two.\n\n  Three.\n", text))
    assert system.description == "One.\nTwo.\n\nThree."
    assert mbs.loads(mbs.dumps(system)) == system
    report = mbs.report(system, t_end=0.01, samples=2, backend="python")
    assert '<p class="statement">One.\nTwo.</p>\n<p class="statement">Three.</p>' in report.html
    assert "{\\itshape One.\nTwo.\n\nThree.\\par}" in report.latex()
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
