"""Bounces of several elements, in no cycle that repeats, come to rest together: against a series in 50 digits."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.motion.switching import impact, prepared

ROW = """
multibody_sym: 1
name: row_of_three
gravity: [0, -9.81, 0]
bodies:
  b1: {mass: 0.1}
  b2: {mass: 0.1}
  b3: {mass: 10}
  ground:
    surfaces:
      left: {plane: [0, 0, 0], normal: [0.820271, 0.571976, 0]}
      right: {plane: [0.8, 0.3, 0], normal: [-0.252897, 0.967493, 0]}
joints:
  j1: {type: point, parent: ground, child: b1, q: [x1, y1]}
  j2: {type: point, parent: ground, child: b2, q: [x2, y2], initial: {q: [0.8, 0.3]}}
  j3: {type: point, parent: ground, child: b3, q: [x3, y3], initial: {q: [1.6, 0.6]}}
contacts:
  c1: {between: [b1, ground.left], static: 1.5}
  c3: {between: [b2, ground.right], static: 0.3, kinetic: 0.18}
constraints:
  rope1: {type: rope, path: [b1, b2], slack: true, restitution: 1}
  rope2: {type: rope, path: [b2, b3], slack: true, restitution: 0.5}
outputs: {E: total_energy()}
"""

JERKED = """
multibody_sym: 1
name: jerked
gravity: [0, -9.81, 0]
parameters: {m1: 2, m2: 3.1}
bodies:
  ground:
    points: {o: [0, 5, 0], r: [0.4, 0, 0], l: [-0.4, 0, 0]}
    surfaces: {floor: {plane: [0, 0, 0], normal: y}}
  a: {mass: m1}
  b: {mass: m2}
joints:
  A: {type: prismatic, parent: ground.l, child: a, axis: y, q: y1, initial: {q: 1, u: 1}}
  B: {type: prismatic, parent: ground.r, child: b, axis: y, q: y2}
pulleys: {P: {at: ground.o, radius: 0.4}}
constraints: {s: {type: rope, path: [a, P, b], slack: true, restitution: 1}}
contacts: {c: {between: [b, ground.floor], restitution: EC}}
outputs: {E: total_energy()}
"""


def test_a_row_that_jerks_on_a_rough_slope_comes_to_slide_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """A rope that gives back all, one that gives back half, and a slope: impacts went on and on at one instant.

    What rests a hundred times as high leads to the same motion, though speeds are ten times as large as it rests: the
    impulses of all impacts together are those of the rest, up to the change of the loads meanwhile.
    """
    runs, model = [], mbs.loads(ROW)
    for height in (1.0, 100.0):
        monkeypatch.setattr(impact, "LOST_HEIGHT", height * 1e4 * np.finfo(float).eps)
        runs.append(mbs.simulate(model, t_end=0.42, samples=3, rtol=1e-12, atol=1e-12))
    run, coarse = runs
    assert 50 < len(coarse.events) < len(run.events) < 200
    assert abs(run.energy_residual) < 1e-7
    for name in ("x1", "x2", "x3", "u_x1", "u_x2", "u_x3"):
        assert coarse[name][-1] == pytest.approx(run[name][-1], abs=1e-9), name


def last_of(m1: float, m2: float, e: float) -> tuple[float, int]:
    """Return when the two weights rest (s), b after bounces of e, their rope giving back all, and after how many.

    Each flies on its parabola from impact to impact, until nothing is faster than 1e-20 m/s.
    """
    with mpmath.workdps(50):
        g, p1, p2, e = (mpmath.mpf(str(x)) for x in (9.81, m1, m2, e))
        v1, v2, y2, gap, time, count, rests = mpmath.mpf(1), g * 0, g * 0, g * 0, g * 0, 0, True
        while True:
            falls, opening, count = (g if rests else 2 * g), v1 + v2, count + 1
            taut = (opening + mpmath.sqrt(opening**2 + 2 * falls * gap)) / falls
            lands = mpmath.inf if rests else (v2 + mpmath.sqrt(v2**2 + 2 * g * y2)) / g
            after = min(taut, lands)
            time += after
            gap += opening * after - falls * after**2 / 2
            v1 -= g * after
            if not rests:
                y2, v2 = y2 + v2 * after - g * after**2 / 2, v2 - g * after
            if taut <= lands:
                jerk = -2 * (v1 + v2) / (1 / p1 + 1 / p2)
                v1, v2, gap, rests = v1 + jerk / p1, v2 + jerk / p2, g * 0, False
                if max(abs(v1), abs(v2)) < 1e-20:
                    return float(time), count
            else:
                y2, v2 = g * 0, -e * v2
                rests = v2 < 1e-23


@pytest.mark.parametrize(("m1", "m2", "e"), [(2, 3.1, 0.5), (1.3, 2.9, 0.7)])
def test_weights_on_a_rope_that_gives_back_all_rest_when_the_series_of_their_impacts_does(
    m1: float, m2: float, e: float
) -> None:
    """They rest where they began, to rounding, and have lost what they had; the tail of the series is not followed."""
    end, impacts = last_of(m1, m2, e)
    model = mbs.loads(JERKED.replace("EC", str(e)))
    run = mbs.simulate(model, parameters={"m1": m1, "m2": m2}, t_end=1.05 * end, samples=5)
    assert [run[x][-1] for x in ("y1", "y2")] == [pytest.approx(1.0, abs=1e-14), pytest.approx(0.0, abs=1e-14)]
    assert [run[x][-1] for x in ("u_y1", "u_y2")] == [0.0, 0.0]
    assert sum(event.get("lost", 0.0) for event in run.events) == pytest.approx(m1 / 2, rel=1e-11)
    assert len(run.events) < impacts / 5
    assert max(event["t"] for event in run.events) == pytest.approx(end, abs=1e-4)


@pytest.mark.parametrize("m2", [3e5, 3e6])
def test_a_heavy_weight_that_a_light_one_jerks_lands_when_its_parabola_does(m2: float) -> None:
    """It flies for 1e-6 s, 1e-13 m high, then bounces on unseen: mode and impact ended by rounding of its height later.

    That was half of its flight: the floor took 3.6 N*s of its 2 N*s.
    """
    run = mbs.simulate(mbs.loads(JERKED.replace("EC", "0.5")), parameters={"m1": 1, "m2": m2}, t_end=0.3, samples=3)
    jerk, v = 2 / 9.81, 2 / (1 + m2)
    closed = run.events[-1]
    assert (closed["element"], closed["kind"]) == ("c", "closed")
    assert closed["t"] - jerk == pytest.approx(2 * v / 9.81 / (1 - 0.5), abs=1e-14)
    assert closed["impulse"] == pytest.approx(m2 * v, rel=1e-9)
    assert sum(event["lost"] for event in run.events) == pytest.approx(m2 * v * v / 2, rel=1e-8)
    assert abs(run.energy_residual) < 1e-12


def test_an_impact_that_ends_a_mode_is_decided_once(monkeypatch: pytest.MonkeyPatch) -> None:
    asked, decided = list[float](), prepared.next_state

    def counted(facts, *given, **named):  # type: ignore[no-untyped-def]
        asked.append(facts.t)
        return decided(facts, *given, **named)

    monkeypatch.setattr(prepared, "next_state", counted)
    run = mbs.simulate(mbs.loads(JERKED.replace("EC", "0.5")), t_end=0.9, samples=3)
    assert len(run.events) > 5
    assert len(asked) == len(set(asked))


TIGHT = """
multibody_sym: 1
name: tight_elbow
gravity: [0, -9.81, 0]
bodies:
  ground: {points: {o: [0, 0, 0]}, surfaces: {floor: {plane: [0, -0.713, 0], normal: y}}}
  b1: {shape: {rod: 1.165, mass: 5.57}, points: {e: [1.165, 0, 0]}}
  b2: {shape: {rod: 1.012, mass: 3.28}, points: {e: [1.012, 0, 0]}}
joints:
  j1:
    type: revolute
    parent: ground.o
    child: b1
    q: a
    initial: {q: -0.19}
    limits: {lower: -0.41, upper: 0.709, restitution: 0.5}
  j2:
    type: revolute
    parent: b1.e
    child: b2
    q: b
    initial: {q: -0.188}
    limits: {lower: -0.532, upper: 0.33, restitution: 0.5}
forces:
  rub: {type: friction, joint: j2, static: enough, radius: 0.038}
  push: {type: force, on: b2, value: [w, 0, 0]}
contacts: {c: {between: [b2.e, ground.floor], static: 0.7, kinetic: 0.42, restitution: 1}}
inputs:
  w:
    table: [[0.0, 0.0], [0.25, 14.6174], [0.5, -2.4952], [0.75, -14.1914], [1.0, 4.9176], [1.25, 13.352]]
    interpolation: cubic
outputs: {E: total_energy()}
"""


def test_a_joint_that_sticks_does_not_jam_an_impact_by_rounding_of_its_speed() -> None:
    """An elbow that sticks strikes with its tip as it slides slowly: 2e-17 rad/s of the elbow counted as slip."""
    run = mbs.simulate(mbs.loads(TIGHT), t_end=0.9, samples=3)
    assert run.events[-1]["t"] == pytest.approx(0.88519009, abs=1e-6)
    assert abs(run.energy_residual) < 1e-8
    assert run.drift["position"] < 1e-12


def test_what_gives_all_back_rests_where_it_bounces_lower_than_steps_err() -> None:
    """A block slides to rest and hops by 7e-10 m, 40,000 times a second: friction takes mu times all its impulses.

    That is m g t, less the momentum with which it starts upwards.
    """
    text = """
multibody_sym: 1
name: skims
gravity: [0, -9.81, 0]
bodies: {block: {mass: 2}, ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}}
joints: {j: {type: point, parent: ground, child: block, q: [x, y], initial: {q: [2, 0], u: [3, 1.2e-4]}}}
contacts: {c: {between: [block, ground.floor], static: 0.3, restitution: 1}}
outputs: {E: total_energy()}
"""
    system = mbs.loads(text)
    run = mbs.simulate(system, t_end=1.6, samples=3)
    assert len(run.events) < 300
    assert run["x"][-1] == pytest.approx(2.0 + (3.0 + 0.3 * 1.2e-4) ** 2 / (2.0 * 0.3 * 9.81), rel=1e-9)
    assert run["y"][-1] == pytest.approx(0.0, abs=1e-15)
    assert abs(run.energy_residual) < 1e-8
    finer = mbs.simulate(system, t_end=0.005, samples=3, rtol=1e-12)
    assert len(finer.events) > 180
