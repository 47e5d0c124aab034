"""Points at bars without thickness: touched from the side they come from, around their ends, and from behind."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

import multibody_sym as mbs

MODEL = """
multibody_sym: 1
name: thin
gravity: [0, G, 0]
bodies:
  ground: {surfaces: {bar: {segment: [[-1, 0, 0], [1, 0, 0]]NORMAL}}}
  ball: {mass: 1}
joints: {fall: {type: point, parent: ground, child: ball, q: [x, y], initial: {q: [X, Y], u: [U, V]}}}
contacts: {hit: {between: [ball, ground.bar], restitution: 0.5}}
"""


def model(x: float, y: float, u: float, v: float, *, g: float = 0.0, normal: str = "") -> mbs.System:
    text = MODEL.replace("NORMAL", normal).replace("G,", f"{-g},").replace("X, Y", f"{x}, {y}")
    return mbs.loads(text.replace("U, V", f"{u}, {v}"))


@pytest.mark.parametrize("side", [1, -1])
def test_a_point_bounces_off_the_side_from_which_it_comes(side: int) -> None:
    run = mbs.simulate(model(0, 0.2 * side, 0.5, 0, g=10.0 * side), t_end=0.35)
    rest = 0.35 - 0.2  # it strikes with 2 m/s and leaves with 1 m/s
    assert run["y"][-1] == pytest.approx(side * (rest - 5 * rest**2), rel=1e-8)
    assert [event["kind"] for event in run.events] == ["impact"]


@pytest.mark.parametrize("side", [1, -1])
def test_it_comes_to_rest_on_that_side(side: int) -> None:
    run = mbs.simulate(model(0, 0.05 * side, 0, 0, g=10.0 * side), t_end=0.4)
    end = math.sqrt(2 * 0.05 / 10) * 3
    assert run.events[-1]["kind"] == "closed"
    assert run.events[-1]["t"] == pytest.approx(end, rel=1e-8)
    assert run["y"][-1] == pytest.approx(0.0, abs=1e-20)


@pytest.mark.parametrize("native", [False, True])
def test_past_an_end_and_back_from_below_it_strikes_the_other_side(native: bool) -> None:
    """A pendulum around the bar's end: down past the end on its right, and up against the bar from below."""
    system = mbs.loads("""
multibody_sym: 1
name: round the end
bodies:
  ground: {points: {hub: [1.2, 0, 0]}, surfaces: {bar: {segment: [[-1, 0, 0], [1, 0, 0]]}}}
  ball: {mass: 1, points: {tip: [0.7, 0, 0]}, inertia: {Izz: 0.1}}
joints: {A: {type: revolute, parent: ground.hub, child: ball, axis: z, q: a, initial: {q: 3, u: -2}}}
contacts: {hit: {between: [ball.tip, ground.bar], restitution: 0.5}}
""")
    told = {"native": True} if native else {"backend": "python"}
    run = mbs.simulate(system, t_end=5.0, samples=11, **told)
    first = (3 + math.pi) / 2  # from a = 3 clockwise round to -pi, where the tip meets the bar from below
    hits = [event for event in run.events if event["kind"] == "impact"]
    assert [event["t"] for event in hits][:1] == pytest.approx([first], rel=1e-9)
    assert run["u_a"][-1] == pytest.approx(1.0, rel=1e-9)
    assert run["a"][-1] == pytest.approx(-math.pi + (5.0 - first), rel=1e-9)


def test_a_point_that_rests_on_a_bar_stays_on_its_side() -> None:
    run = mbs.simulate(model(0, 0, 0.5, 0, g=10.0), backend="python", t_end=1.0)
    assert abs(run["y"]).max() == 0.0
    assert run["x"][-1] == pytest.approx(0.5, rel=1e-12)


def test_what_comes_in_from_behind_a_face_with_a_normal_is_refused_by_name() -> None:
    """The dropped rod turns on: the table's edge comes in past its end from behind, which no impact put right."""
    written = (Path(__file__).parents[2] / "examples" / "impacts" / "dropped_rod.yaml").read_text(encoding="utf-8")
    with pytest.raises(mbs.RunError, match=r"hit: what it touches comes in past its end from behind.*1\.09"):
        mbs.simulate(mbs.loads(written), t_end=1.2)
    run = mbs.simulate(model(1.5, -0.1, -2.0, 0), t_end=1.0)
    assert run["x"][-1] == pytest.approx(-0.5, rel=1e-12)
    with pytest.raises(mbs.RunError, match="from behind"):
        mbs.simulate(model(1.5, -0.1, -2.0, 0, normal=", normal: y"), t_end=1.0)
