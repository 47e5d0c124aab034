"""Live pages: their picture is that of animations, they hold what moves smoothly, and refuse the rest."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.documents.animation.frames import frames_of, strand_points
from multibody_sym.documents.animation.live import picture_program
from multibody_sym.motion.prepare.export import ExportedModel
from multibody_sym.program.program import interpret

EXAMPLES = Path(__file__).parents[2] / "examples"
NODE = shutil.which("node")


def example(name: str) -> mbs.System:
    return mbs.load(EXAMPLES / f"{name}.yaml")


def apart(points: np.ndarray) -> np.ndarray:
    """Return points without those that lie where the one before does, as at pulleys without a radius."""
    return points[[0, *(np.flatnonzero(np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-12) + 1)]]


@pytest.mark.parametrize("name", ["swinging_atwood", "textbook/heavy_pulley", "elastic_pendulum"])
def test_bodies_and_ropes_are_where_an_animation_has_them(name: str) -> None:
    system = example(name)
    run = mbs.simulate(system, t_end=0.7, samples=3, backend="python")
    frames, model = frames_of(run), ExportedModel.of(system, None)
    program, counts = picture_program(frames, model.mechanism, flat=False)
    for placed, t, q, u in zip(frames.placed, run.t, run.q, run.u, strict=True):
        state = t, q, u, run.parameters
        inputs = interpret(model.programs["inputs"], *state)[0]
        poses, points = interpret(program, *(*state, inputs, np.empty(0))[: len(program.inputs)])
        rows = placed.poses[:-1]
        expected = np.concatenate([rows[:, :, :3].reshape(-1, 9), rows[:, :, 3]], axis=1)
        assert np.allclose(poses, expected, rtol=0.0, atol=1e-12)
        assert len(counts) == len(placed.strands)
        for first, count, strand in zip(np.cumsum([0, *counts]), counts, placed.strands, strict=False):
            laid = apart(strand_points([strand])[0])
            assert np.allclose(apart(points[first : first + count]), laid, rtol=0.0, atol=1e-9)


@pytest.mark.skipif(NODE is None, reason="no node")
def test_the_page_computes_the_motion_of_a_run(tmp_path: Path) -> None:
    html = mbs.live(example("four_bar")).html
    script = re.search(r"<script>\n(const \{ PROGRAMS, motion \} = .*?\n\}\)\(\);)\n", html, re.DOTALL)
    data = re.search(r'class="live-data">(.*?)</script>', html, re.DOTALL)
    assert script is not None
    assert data is not None
    ending = "const moves = motion(names); moves.advance(2.0); console.log(JSON.stringify([...moves.q, ...moves.u]));"
    (tmp_path / "page.js").write_text(f"{script[1]}\nconst names = ({data[1]}).model;\n{ending}", encoding="utf-8")
    done = subprocess.run([str(NODE), tmp_path / "page.js"], capture_output=True, text=True, timeout=60, check=True)
    run = mbs.simulate(example("four_bar"), t_end=2.0, samples=2)
    assert np.allclose(json.loads(done.stdout), [*run.q[-1], *run.u[-1]], rtol=1e-7, atol=1e-7)


HELD = "multibody_sym: 1\nname: held\nbodies: {b: {mass: 1}}\njoints: {j: {type: weld, parent: ground, child: b}}\n"


@pytest.mark.parametrize(
    ("name", "said"), [("textbook/t9_block_on_block", "contacts"), ("stages/rope_cut", "holds"), (HELD, "can move")]
)
def test_other_models_are_refused(name: str, said: str) -> None:
    with pytest.raises(mbs.ModelError, match=said):
        mbs.live(mbs.loads(name) if name == HELD else example(name))


def test_a_page_is_html_and_shows_hostile_words_as_text(tmp_path: Path) -> None:
    hostile = "</script><script>document.title='run'</script>"
    text = (EXAMPLES / "pendulum.yaml").read_text().replace("name: pendulum", f"name: {json.dumps(hostile)}")
    page = mbs.live(mbs.loads(text))
    assert hostile not in page.html
    assert "<iframe srcdoc=" in page._repr_html_()
    with pytest.raises(mbs.InputError, match="html file"):
        page.write(tmp_path / "page.gif")
    page.write(tmp_path / "page.html")
    assert (tmp_path / "page.html").read_text(encoding="utf-8") == page.html
