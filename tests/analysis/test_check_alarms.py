"""`check` calls no good model wrong, whatever its terms cancel to, and sees an error of 1e-6 in one of its routes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from random_models import random_model
from rolling_and_loops import linkage, rolling

import multibody_sym as mbs
from multibody_sym.analysis import check as checking
from multibody_sym.analysis.check import LARGEST_WITH_ROWS, short_run_misses
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.formalisms.equations import Formalism, TreeDynamics
from multibody_sym.dynamics.start.start import sampled_states, start
from multibody_sym.dynamics.start.state import state_at
from multibody_sym.mechanics.motion import state_of
from multibody_sym.scalars.vectors import factorize

BALL = """
multibody_sym: 1
name: ball
gravity: [0, -9.81, 0]
bodies:
  ground: {surfaces: {table: {plane: [0, 0, 0], normal: y}}}
  ball: {mass: 2, inertia: {Ixx: 0.008, Iyy: 0.008, Izz: 0.008}, surfaces: {skin: {sphere: 0.1}}}
joints:
  J: {type: free, parent: ground, child: ball, initial: {q: [0, 0.1, 0, 1, 0, 0, 0], u: [0.3, 0, 0.5, 1, 2, 3]}}
constraints: {roll: {type: rolling, body: ball.skin, on: ground.table}}
"""
MODELS: tuple[Callable[[int], mbs.System], ...] = (rolling, linkage)


@pytest.fixture(autouse=True)
def only_what_may_alarm(monkeypatch: pytest.MonkeyPatch) -> None:
    """Look for no conserved quantities: they have no say in whether a model is called wrong, and take a third."""
    monkeypatch.setattr(checking, "find_conserved", lambda *_: [])


def alarms(seeds: range) -> list[tuple[str, float]]:
    """Return the models that are called wrong, with their worst ratio."""
    found = []
    for seed in seeds:
        report = mbs.check(MODELS[seed % 2](seed))
        if not report.agrees:
            found.append((f"{MODELS[seed % 2].__name__} {seed}", max(report.agreement.values(), default=np.nan)))
    return found


def test_a_ball_that_rolls_accelerates_by_rounding_only_and_no_route_is_blamed() -> None:
    report = mbs.check(mbs.loads(BALL))
    assert report.agrees
    assert max(report.agreement.values()) < 1.0


PASSING = """
multibody_sym: 1
name: passing
gravity: [0, -9.81, 0]
bodies:
  ground: {motion: {y: 0.0364*sin(6.476*t)}}
  box: {shape: {box: [0.2, 0.2, 0.2], mass: 0.881}}
joints: {J: {type: prismatic, parent: ground, child: box, axis: x, q: s, initial: {u: -2.972}}}
"""


def test_a_body_that_passes_the_origin_changes_its_angular_momentum_by_rounding_only() -> None:
    """r x p and r x F are zero there, and r' x p cancels: rounding is 1e-16 of |v| |p|."""
    assert mbs.check(mbs.loads(PASSING)).agrees


def test_good_models_raise_no_alarm() -> None:
    assert alarms(range(10)) == []


@pytest.mark.long
def test_no_good_model_of_hundreds_raises_an_alarm() -> None:
    assert alarms(range(500)) == []


def wrong_in(part: str) -> Formalism:
    """Return d'Alembert and Lagrange's route with one of its parts wrong by 1e-6 of itself."""

    def formalism(mechanism: Any, state: Any) -> Any:
        found = FORMALISMS["dalembert_lagrange"](mechanism, state)
        if part == "forcing":
            return replace(found, forcing=[x * (1 + 1e-6) for x in found.forcing])
        if part == "mass_matrix":
            matrix = [[x * (1 + 1e-6) for x in row] for row in found.mass_matrix]
            return replace(found, mass_matrix=matrix, factors=factorize(matrix))
        if part == "gamma":
            return replace(found, rows=[replace(row, gamma=row.gamma * (1 + 1e-6)) for row in found.rows])
        rows = [replace(row, jacobian=[x * (1 + 1e-6) for x in row.jacobian]) for row in found.rows]
        return replace(found, rows=rows)

    return formalism


def planted(model: mbs.System, rng: np.random.Generator) -> tuple[str, Formalism]:
    """Return a part and the route wrong in it; another part where the error changes no answer: M of what rests."""
    resolved = mbs.mechanism(model)
    states = sampled_states(resolved, start(resolved), 3)
    right = FORMALISMS["dalembert_lagrange"]
    for part in rng.permutation(["mass_matrix", "forcing", "gamma", "jacobian"]).tolist():
        wrong = wrong_in(part)
        pairs = ((answers(right(resolved, at)), answers(wrong(resolved, at))) for at in states)
        if any(np.abs(x - y).max() > 1e-8 * np.abs(x).max() for x, y in pairs):
            return part, wrong
    raise AssertionError("no part of the model matters")


def answers(dynamics: TreeDynamics) -> np.ndarray:
    """Return udot and lambda."""
    found = forward_dynamics(dynamics)
    return np.concatenate([found.udot, found.multipliers])


def seen(monkeypatch: pytest.MonkeyPatch, seeds: range) -> tuple[int, list[str]]:
    """Return how many planted errors `check` tells, and what it does not."""
    missed = []
    for seed in seeds:
        model = MODELS[seed % 2](seed)
        part, wrong = planted(model, np.random.default_rng([seed, 3]))
        routes = {"composite_body": FORMALISMS["composite_body"], "block_ldl": FORMALISMS["block_ldl"]}
        monkeypatch.setattr(checking, "FORMALISMS", {**routes, "dalembert_lagrange": wrong})
        report = checking.check(model)
        others = [value for name, value in report.agreement.items() if name != "dalembert_lagrange"]
        assert max(others) <= LARGEST_WITH_ROWS
        if report.agrees:
            missed.append(f"{MODELS[seed % 2].__name__} {seed}: {part}")
    return len(seeds) - len(missed), missed


def test_planted_errors_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    found, missed = seen(monkeypatch, range(8))
    assert found == 8, missed


@pytest.mark.long
def test_nearly_all_of_hundreds_of_planted_errors_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    found, missed = seen(monkeypatch, range(1000, 1200))
    print(found, missed)
    assert found >= 196, missed


LEANING = """
multibody_sym: 1
name: leaning
gravity: [0, -9.81, 0]
bodies:
  bar: {shape: {rod: 0.543, mass: 0.487}, points: {foot: [0, 0, 0], top: [0.543, 0, 0]}}
  bead: {mass: 1.68, inertia: {Izz: 0.01}}
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}, wall: {plane: [0, 0, 0], normal: x}}}
joints:
  J: {type: planar, parent: ground, child: bar, q: [x, y, a], initial: {q: [0.543*cos(1.291), 0, pi - 1.291]}}
  K: {type: prismatic, parent: bar, child: bead, axis: x, q: s, initial: {q: 0.272}}
contacts:
  c1: {between: [bar.foot, ground.floor], static: 0.1}
  c2: {between: [bar.top, ground.wall], static: enough}
forces: {rub: {type: friction, joint: K, static: enough}}
"""
BLOCKS = """
multibody_sym: 1
name: blocks
gravity: [0, -9.81, 0]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  lower: {mass: 4.81, surfaces: {top: {plane: [0, 0.1, 0], normal: y}}}
  upper: {mass: 4.77}
joints:
  J: {type: point, parent: ground, child: lower, q: [x1, y1], initial: {q: [-1, 0]}}
  K: {type: point, parent: ground, child: upper, q: [x2, y2], initial: {q: [-1, 0.1]}}
contacts:
  c1: {between: [lower, ground.floor], static: 0.1}
  c2: {between: [upper, lower.top], static: 0.1}
"""


@pytest.mark.parametrize("text", [LEANING, BLOCKS, random_model(4205844612)], ids=["leaning", "blocks", "loop"])
def test_rest_and_quick_loops_raise_no_alarm(text: str) -> None:
    """The reactions that friction presses with restrict no speeds; where all is at rest, and where a loop's motion
    changes within a step of the method, the theorems miss by rounding and by the method."""
    report = mbs.check(mbs.loads(text))
    assert report.agrees, report.missing
    assert max(report.theorems.values()) < 1e-9


HELD = """
multibody_sym: 1
name: held
gravity: [0, -9.81, 0]
bodies:
  ground: {points: {left: [0, 0, 0], right: [1.6, 0.6, 0]}}
  bob: {mass: 0.628}
joints: {place: {type: point, parent: ground, child: bob, q: [x, y], initial: {q: [0.8, 0.3]}}}
constraints:
  one: {type: rope, path: [ground.left, bob], slack: true}
  other: {type: rope, path: [bob, ground.right], slack: true}
"""


def test_a_position_in_which_ropes_are_in_line_is_no_disagreement() -> None:
    """They depend on each other there and no more beside it: accelerations across do not last, so work misses half.

    Beside it, where ropes are not closed, it is asked.
    """
    system = mbs.loads(HELD)
    report = mbs.check(system)
    assert report.agrees
    assert report.theorems["work"] < 1e-9
    state = state_at(mbs.mechanism(system))
    begun = sampled_states(state.mechanism, state.start, 0)
    assert short_run_misses(state.mechanism, FORMALISMS["composite_body"], begun[0]) == {}


LEVER = """
multibody_sym: 1
name: lever
gravity: [0, 0, 0]
parameters: {alpha: 0.3, turn: 2}
bodies:
  ground: {points: {o: [1 + cos(alpha), sin(alpha), 0]}}
  slider: {mass: 1}
  link: {mass: 0, points: {e: [1, 0, 0]}}
  rocker: {mass: 1, inertia: {Izz: 1}, points: {e: [1, 0, 0]}}
joints:
  j1: {type: prismatic, parent: ground, child: slider, axis: x,
        motion: sin(alpha)*t + (turn*sin(alpha) + cos(alpha)^2 + cos(alpha))*t^2/2}
  j2: {type: revolute, parent: slider, child: link, q: a}
  j3: {type: revolute, parent: ground.o, child: rocker, q: b, initial: {q: pi + alpha, u: 1}}
  j4: {type: revolute, parent: link.e, child: rocker.e, cut: true}
forces:
  rub: {type: friction, joint: j3, static: 0.8, radius: 0.1}
"""


@pytest.mark.parametrize("turn", [2.0, -2.0])
def test_friction_of_a_pin_settles_where_the_lever_of_what_presses_it_is_longer_than_that_of_friction(
    turn: float,
) -> None:
    """With s along the link, sin(alpha) s - 0.08 |s| = turn has no s where sin(alpha) < 0.08 and turn > 0."""
    model = mbs.loads(LEVER)
    slides = state_at(mbs.mechanism(model), project=False).mechanism
    place = [speed.name for speed in slides.speeds].index("u_b")
    for lever in (0.02, 0.07, 0.09, 0.3):
        alpha = float(np.arcsin(lever))
        state = state_of(slides, float, 0.0, [0.0, np.pi + alpha], [-np.cos(alpha), 1.0], [alpha, turn])
        found = forward_dynamics(FORMALISMS["composite_body"](slides, state))
        assert found.settled == (lever > 0.08 or turn < 0)
        if found.settled:
            assert found.udot[place] == pytest.approx(turn)
