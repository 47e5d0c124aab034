"""Live pages: their picture is that of animations, they hold what moves smoothly, and refuse the rest."""

from __future__ import annotations

import json
import math
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

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


def printed(folder: Path, html: str, words: str, before: str = "") -> Any:
    """Return as JSON the value of words that follow the scripts and the data of a page, and others, in node."""
    script = re.search(r"<script>\n(const \{ PROGRAMS, motion \} = .*?\n\}\)\(\);)\n(.*?)\nlive\(", html, re.DOTALL)
    data = re.search(r'class="live-data">(.*?)</script>', html, re.DOTALL)
    assert script is not None
    assert data is not None
    known = f"{script[1]}\n{script[2]}\nconst data = {data[1]}, names = data.model;"
    said = f"{known}\n{before}\nconsole.log(JSON.stringify({words}));"
    (folder / "page.js").write_text(said, encoding="utf-8")
    done = subprocess.run([str(NODE), folder / "page.js"], capture_output=True, text=True, timeout=60, check=True)
    return json.loads(done.stdout)


@pytest.mark.skipif(NODE is None, reason="no node")
def test_the_page_computes_the_motion_of_a_run(tmp_path: Path) -> None:
    ending = "(() => { const moves = motion(names); moves.advance(2.0); return [...moves.q, ...moves.u]; })()"
    found = printed(tmp_path, mbs.live(example("four_bar")).html, ending)
    run = mbs.simulate(example("four_bar"), t_end=2.0, samples=2)
    assert np.allclose(found, [*run.q[-1], *run.u[-1]], rtol=1e-7, atol=1e-7)


ROD = """multibody_sym: 1
name: rod
gravity: [0, -g, 0]
parameters: {m: 1 kg, J: m*r^2, r: l/sqrt(12), l: 1 m, g: 9.81, k: 2*J}
bodies: {rod: {mass: m, com: [0, -l/2, 0], inertia: {Izz: J}}}
joints: {hinge: {type: revolute, parent: ground, child: rod, axis: z, q: theta, initial: {q: 1}}}
outputs: {swing: k*theta}
stop: {low: theta < 0.2}
"""


@pytest.mark.skipif(NODE is None, reason="no node")
def test_a_declared_stop_ends_the_motion_of_a_page(tmp_path: Path) -> None:
    ending = "(() => { const moves = motion(names); moves.advance(5.0); return [moves.ended, moves.t, ...moves.q]; })()"
    ended, *found = printed(tmp_path, mbs.live(mbs.loads(ROD)).html, ending)
    run = mbs.simulate(mbs.loads(ROD), t_end=5.0, rtol=1e-10)
    assert ended == "low"
    assert np.allclose(found, [run.t[-1], 0.2], rtol=1e-6)


@pytest.mark.skipif(NODE is None, reason="no node")
def test_parameters_that_depend_on_a_moved_one_follow_it(tmp_path: Path) -> None:
    """J = m l^2/12 by r, which is declared behind it; such parameters have no sliders."""
    html = mbs.live(mbs.loads(ROD)).html
    values = "names.parameters.map(({ name, value }) => name === 'l' ? 3 : value)"
    follow = f"PROGRAMS.follow(0, [], [], {values}, [], [])[0]"
    found = printed(tmp_path, html, f"[data.followers.map((k) => names.parameters[k].name), {follow}, data.shown]")
    assert dict(zip(found[0], found[1], strict=True)) == pytest.approx({"J": 0.75, "r": 3 / math.sqrt(12), "k": 1.5})
    names = [x.name for x in mbs.mechanism(mbs.loads(ROD)).parameters]
    assert {names[k] for k in found[2]} == {"m", "l", "g"}
    assert "The picture keeps the sizes of the declared l." in html
    assert "The picture keeps" not in mbs.live(mbs.loads(ROD.replace("-l/2", "-0.5"))).html


@pytest.mark.skipif(NODE is None, reason="no node")
def test_the_script_of_a_page_takes_numbers_and_keys(tmp_path: Path) -> None:
    """On elements without a browser: the motion for l = 3 is that of such a model as far as the stop."""
    html = mbs.live(mbs.loads(ROD)).html
    stub = Path(__file__).with_name("live_page_stub.js").read_text(encoding="utf-8")
    words = "typed('l', 3); root.model.advance(9); const ends = [root.model.t, ...root.model.q];"
    words += "typed('theta', 0.1); pressed('.'); const said = root.querySelector('.said').textContent;"
    address, said, *ends = printed(tmp_path, html, "[globalThis.address, said, ...ends]", f"{stub}\n{words}")
    run = mbs.simulate(mbs.loads(ROD.replace("l: 1 m", "l: 3 m")), t_end=9.0, rtol=1e-10)
    assert np.allclose(ends, [run.t[-1], 0.2], rtol=1e-6)
    assert said == "The condition of low holds here: the motion ends."
    assert "p.l=3" in address
    assert "p.J" not in address


@pytest.mark.skipif(NODE is None, reason="no node")
def test_a_drag_out_of_reach_winds_no_angle(tmp_path: Path) -> None:
    """Two bars of length 1 towards a far point: they stretch, and no angle turns by more than half a turn."""
    seen = "(q) => [Math.sin(q[0]) + Math.sin(q[0] + q[1]), -Math.cos(q[0]) - Math.cos(q[0] + q[1])]"
    words = f"""[[5, 1], [-4, 3], [0.1, 6], [0.3, -0.2]].map((goal) => {{
        let q = [0.4, 0.3];
        for (let k = 0; k < 200; k++) q = towards(q, {seen}, goal, [true, true]) || q;
        return q;
    }})"""
    found = np.array(printed(tmp_path, mbs.live(mbs.loads(ROD)).html, words))
    assert np.abs(found).max() < np.pi + 0.1
    tips = np.column_stack([np.sin(found[:, 0]) + np.sin(found.sum(1)), -np.cos(found[:, 0]) - np.cos(found.sum(1))])
    goals = np.array([[5, 1], [-4, 3], [0.1, 6]], dtype=float)
    assert np.allclose(tips[:3], 2 * goals / np.linalg.norm(goals, axis=1)[:, None], atol=0.05)
    assert np.allclose(tips[3], [0.3, -0.2], atol=1e-3)


def test_number_fields_have_room_for_six_digits_with_sign_and_exponent() -> None:
    """-1.23456e-10 has 12 characters, of half an em each at most 7.5 rem with the padding."""
    html = mbs.live(mbs.loads(ROD)).html
    columns = re.search(r"\.setting \{[^}]*grid-template-columns: minmax\([^)]*\) 1fr ([0-9.]+)rem", html)
    assert columns is not None
    assert float(columns[1]) >= 12 * 0.56 + 1.0


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
