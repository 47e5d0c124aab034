"""Boxes that are dropped flat in space, with friction at all corners: how they bounce, and that no run goes on without
an impact that could not be solved."""

from __future__ import annotations

import math

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.contact_laws.impact_problem import ImpactProblem
from multibody_sym.errors import NoSolutionError
from multibody_sym.motion.runs.run import FailedRunError

CRATE = """\
multibody_sym: 1
name: crate
gravity: [0, 0, -9.81]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: z}}}
  crate: {shape: {box: [0.4, 0.2, 0.3], mass: 2 kg}}
joints: {J: {type: free, parent: ground, child: crate, initial: {q: [0, 0, 1.15, 1, 0, 0, 0]}}}
contacts: {c: {between: [crate, ground.floor], static: 0.3, kinetic: 0.3, restitution: 0.5}}
"""


@pytest.fixture(scope="module")
def crate() -> mbs.Mechanism:
    return mbs.loads(CRATE)


def test_bounces_end_when_the_closed_form_says_and_the_box_rests_to_the_last_bit(crate: mbs.Mechanism) -> None:
    end = math.sqrt(2 * 1.0 / 9.81) * (1 + 0.5) / (1 - 0.5)
    run = mbs.simulate(crate, t_end=2.0)
    rests = [event["t"] for event in run.events if event["kind"] == "stick"]
    assert len(rests) == 4
    assert rests == pytest.approx([end] * 4, rel=1e-8)
    resting = run.t > end + 1e-6
    assert not run.u[resting].any()
    assert not (run.q[resting] - run.q[-1]).any()
    assert run.q[-1] == pytest.approx([0, 0, 0.15, 1, 0, 0, 0], abs=1e-8)


def test_a_run_whose_impact_cannot_be_solved_stops_and_says_so(
    crate: mbs.Mechanism, monkeypatch: pytest.MonkeyPatch
) -> None:
    def nothing(problem: ImpactProblem) -> None:
        raise NoSolutionError("no impulses fulfil the laws of the impact at c.corner1", number="N108")

    monkeypatch.setattr("multibody_sym.contact_laws.impact_sequence.strike", nothing)
    why = r"the impact cannot be solved: no impulses fulfil the laws of the impact at c\.corner1"
    with pytest.raises(FailedRunError, match=f"{why} at t = {math.sqrt(2 / 9.81):.6g} s"):
        mbs.simulate(crate, t_end=2.0)
    with pytest.raises(NoSolutionError, match=f"{why} at the start"):
        mbs.simulate(crate, t_end=2.0, initial={"J_z": 0.15, "u_J_z": -1.0})


def test_a_crate_that_slides_rests_once_it_rocks_unseen_from_corner_to_corner() -> None:
    """Corners that rest rebound as others strike. Friction takes mu times all momentum that the floor gives, m g t too.

    It slides with 1.4 m/s and turns slowly, so that its corners slip in directions up to 4 degrees apart.
    """
    began, sinks = (-1.4446, 0.094632), 0.0011259
    turned = "0.998644, -3.6995e-9, -7.0977e-8, -0.052052"
    start = f"q: [0, 0, 0.243921, {turned}], u: [{began[0]}, {began[1]}, {-sinks}, -4.065e-8, 0.0054583, -0.28599]"
    text = CRATE.replace("q: [0, 0, 1.15, 1, 0, 0, 0]", start)
    text = text.replace("0.4, 0.2, 0.3", "0.41254773, 0.5486069, 0.487842845")
    text = text.replace("static: 0.3, kinetic: 0.3, restitution: 0.5", "static: 0.1, kinetic: 0.1, restitution: 0.3")
    run = mbs.simulate(mbs.loads(text), t_end=0.002)
    assert run.u[-1][2:5] == pytest.approx([0, 0, 0], abs=1e-12)
    assert run.q[-1][2:6] == pytest.approx([0.2439214225, run.q[-1][3], 0, 0], abs=1e-12)
    assert math.dist(run.u[-1][:2], began) == pytest.approx(0.1 * (9.81 * 0.002 + sinks), rel=5e-3)
    assert (run.energy[1:] - run.energy[:-1]).max() < 1e-13


@pytest.mark.parametrize(
    ("sizes", "q", "u", "mu", "e", "end"),
    [
        (
            [0.304, 0.371, 0.531],
            [0.44193, 0.99113, 0.019136, 0.121607, 0.050072],
            [1.46848, 0.58053, -0.62157, -0.37981, 0.76524, -0.69552],
            0.1,
            0.4,
            0.42,
        ),
        (
            [0.182, 0.445, 0.417],
            [0.3619, 0.997779, 0.013724, 0.06329, 0.01556],
            [-1.49046, -0.38686, -0.41464, -1.72294, 1.175, -1.07099],
            0.2,
            0.0,
            0.7,
        ),
    ],
)
def test_boxes_that_are_dropped_tilted_go_on_and_their_energy_is_accounted_for(
    sizes: list[float], q: list[float], u: list[float], mu: float, e: float, end: float
) -> None:
    """Corners that rest as others strike leave with them, unseen; a face may land beside the edge it stands on.

    What is left of the energy is what gaps within 1e-9 of the size are closed by, once an impact.
    """
    text = CRATE.replace("0.4, 0.2, 0.3", ", ".join(map(str, sizes)))
    text = text.replace("q: [0, 0, 1.15, 1, 0, 0, 0]", f"q: {[0.0, 0.0, *q]}, u: {u}")
    text = text.replace("static: 0.3, kinetic: 0.3, restitution: 0.5", f"static: {mu}, kinetic: {mu}, restitution: {e}")
    run = mbs.simulate(mbs.loads(text), t_end=end)
    assert run.t_final == end
    assert abs(run.energy_residual) < 1e-8 * run.energy[0]
    assert (run.energy[1:] - run.energy[:-1]).max() < 1e-8 * run.energy[0]
    times = [event["t"] for event in run.events]
    assert times == sorted(times)
    assert _lowest(run.q, sizes) > -1e-9


def _lowest(q: np.ndarray, sizes: list[float]) -> float:
    """Return how high the lowest corner ever is, by the quaternions (w, x, y, z) of samples."""
    w, x, y, z = (q[:, 3:] / np.linalg.norm(q[:, 3:], axis=1)[:, None]).T
    up = np.abs([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]).T
    return float((q[:, 2] - up @ np.array(sizes) / 2).min())


def test_a_cube_that_never_slips_rolls_down_a_ramp_as_in_the_plane_where_one_corner_strikes_alone() -> None:
    """Two corners strike at once in space. Once friction that stops their slip throws them up: nothing presses then."""
    rough = "contacts: {c: {between: [cube, ground.floor], static: enough}}\n"
    flat, deep = (
        mbs.simulate(mbs.loads(f"multibody_sym: 1\nname: cube\n{text}{rough}"), t_end=1.45)
        for text in (
            """\
gravity: [9.81*sin(1.1), -9.81*cos(1.1), 0]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  cube: {shape: {box: [0.2, 0.2, 0.2], mass: 2 kg}}
joints: {J: {type: planar, parent: ground, child: cube, q: [x, y, th], initial: {q: [0, 0.1, 0]}}}
""",
            """\
gravity: [0, 9.81*sin(1.1), -9.81*cos(1.1)]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: z}}}
  cube: {shape: {box: [0.2, 0.2, 0.2], mass: 2 kg}}
joints: {J: {type: free, parent: ground, child: cube, initial: {q: [0, 0, 0.1, 1, 0, 0, 0]}}}
""",
        )
    )
    assert deep.u[-1][:4] == pytest.approx([0, flat["u_x"][-1], flat["u_y"][-1], flat["u_th"][-1]], abs=1e-6)
    assert deep.q[-1][:3] == pytest.approx([0, flat["x"][-1], flat["y"][-1]], abs=1e-7)
    struck = [event for event in flat.events if event["kind"] == "impact"]
    assert [event["impulse"] for event in struck].count(0.0) == 1
    for k, event in enumerate(struck):
        pair = [each for each in deep.events if each["kind"] == "impact"][2 * k : 2 * k + 2]
        assert [each["t"] for each in pair] == pytest.approx([event["t"]] * 2, rel=1e-8)
        assert sum(each["impulse"] for each in pair) == pytest.approx(event["impulse"], rel=1e-7)
        assert sum(each["lost"] for each in pair) == pytest.approx(event["lost"], rel=1e-7)


ROCKING = """\
multibody_sym: 1
name: rocking
gravity: [0, 0, -9.81]
parameters: {th: 0.1}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: z}}}
  box: {shape: {box: [0.2, 0.3, 0.8], mass: 10}}
joints:
  j:
    type: free
    parent: ground
    child: box
    angles: yxz
    initial: {q: [0.1*cos(th) - 0.4*sin(th), 0, 0.1*sin(th) + 0.4*cos(th), -th, 0, 0]}
contacts: {c: {between: [box, ground.floor], static: 1.5}}
"""


def test_both_corners_of_an_edge_strike_at_once_however_long_a_run_is() -> None:
    """The event of the first is found 3e-13 s before its time; the other one, as far away, seemed to fly on.

    The block turns over one edge and falls onto the other, where Housner's 1 - 3/2 sin^2 a of its speed are left (a:
    between its height and its diagonal).
    """
    left = 1.0 - 1.5 * 0.2**2 / (0.2**2 + 0.8**2)
    for t_end in (1.2, 4.0):
        run = mbs.simulate(mbs.loads(ROCKING), t_end=t_end, samples=2)
        impacts = [event for event in run.events if event["impulse"]]
        pairs = list(zip(impacts[::2], impacts[1::2], strict=True))
        assert all(one["t"] == other["t"] for one, other in pairs)
        assert [one["impulse"] for one, _ in pairs] == pytest.approx([other["impulse"] for _, other in pairs], rel=1e-9)
        lost = np.array([one["lost"] + other["lost"] for one, other in pairs])
        assert lost[1:] / lost[:-1] == pytest.approx(left**2, rel=1e-6)
