"""Kinds of joint step are types that answer for themselves: nobody asks which kind one is, and none answers half."""

from __future__ import annotations

import ast
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import pytest
from package_trees import nodes

import multibody_sym as mbs
from multibody_sym.model.bodies import IDENTITY
from multibody_sym.model.steps import Ball, OneCoordinate, Rotate, ScrewStep, Step, Translate, free_steps
from multibody_sym.scalars.node import ONE

WORDS = {"translate", "rotate", "screw", "ball"}
TYPES = {"Translate", "Rotate", "ScrewStep", "Ball"}
X, Y, Z = IDENTITY


def asked(within: Sequence[ast.AST]) -> Iterator[int]:
    """Yield the lines that ask of which kind a step is: by its name, or by its type. An assertion asks nothing."""
    asserted = [node.test for node in within if isinstance(node, ast.Assert)]
    for node in within:
        if isinstance(node, ast.Compare | ast.MatchValue):
            words = (x.value for x in ast.walk(node) if isinstance(x, ast.Constant) and isinstance(x.value, str))
            if not WORDS.isdisjoint(words):
                yield node.lineno
        elif isinstance(node, ast.Dict):  # a table of what to do with each
            words = {x.value for x in node.keys if isinstance(x, ast.Constant) and isinstance(x.value, str)}
            if len(WORDS & words) > 1:
                yield node.lineno
        elif isinstance(node, ast.Attribute) and node.attr == "ball":
            yield node.lineno
        elif node in asserted:
            continue
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "isinstance":
            names = (x.id for x in ast.walk(node.args[1]) if isinstance(x, ast.Name))
            if not TYPES.isdisjoint(names):
                yield node.lineno


def test_nobody_asks_which_kind_a_step_is() -> None:
    found = {name: lines for name, within in nodes().items() if (lines := list(asked(within)))}
    assert found == {}


@pytest.mark.parametrize(
    "text",
    [
        'step.kind == "translate"',
        '[s.kind for s in body.steps] not in ([], ["rotate"])',
        '{"translate": flat, "rotate": upright}[step.kind]',
        "body.ball",
        "isinstance(step, (Rotate, Ball))",
        'match kind:\n    case "screw":\n        pass',
    ],
)
def test_who_asks_is_found(text: str) -> None:
    assert list(asked(list(ast.walk(ast.parse(text)))))


def test_a_kind_that_leaves_a_question_open_is_refused() -> None:
    @dataclass(frozen=True)
    class Half(OneCoordinate):
        """A step that says nothing but its unit."""

        @property
        def unit(self) -> str:
            return "m"

    with pytest.raises(TypeError, match="abstract") as caught:
        Half(X)  # type: ignore[abstract]
    for question in ("slides", "turns", "stays_in_plane", "is_measured"):
        assert question in str(caught.value)


@pytest.mark.parametrize(
    ("step", "coordinates", "speeds"),
    [
        (Translate(X, "x"), [("x", "m", 0)], [(None, "m/s")]),
        (Rotate(Z, "theta"), [("theta", "rad", 0)], [(None, "rad/s")]),
        (ScrewStep(Y, "1", lead=ONE), [("1", "rad", 0)], [(None, "rad/s")]),
        (
            Ball(),
            [("qw", "", 1), ("qx", "", 0), ("qy", "", 0), ("qz", "", 0)],
            [("wx", "rad/s"), ("wy", "rad/s"), ("wz", "rad/s")],
        ),
    ],
)
def test_coordinates_and_speeds(step: Step, coordinates: list[tuple], speeds: list[tuple]) -> None:
    assert [tuple(c) for c in step.coordinates] == coordinates
    assert [tuple(s) for s in step.speeds] == speeds


@pytest.mark.parametrize(
    ("step", "flat", "free", "hinge"),
    [
        (Translate(X), True, True, False),
        (Translate(Z), False, True, False),
        (Rotate(Z), True, True, True),
        (Rotate(Y), False, True, True),
        (ScrewStep(Z, lead=ONE), False, False, False),
        (Ball(), False, True, False),
    ],
)
def test_what_the_model_asks(step: Step, flat: bool, free: bool, hinge: bool) -> None:
    assert (step.stays_in_plane, step.is_independent, step.is_hinge) == (flat, free, hinge)


def test_places_of_steps_follow_each_other() -> None:
    """A prescribed step has no place; a ball four and three, wherever it stands."""
    steps = (Translate(X), Ball(), Rotate(Z, motion=ONE), Rotate(X))
    places = [(free.step, free.q, free.u) for free in free_steps(steps, range(10, 16), range(20, 25))]
    assert places == [
        (steps[0], (10,), (20,)),
        (steps[1], (11, 12, 13, 14), (21, 22, 23)),
        (steps[3], (15,), (24,)),
    ]
    assert [free.rate_pairs for free in free_steps(steps)] == [((0, 0),), (), ((5, 4),)]


def test_a_freedom_with_a_pitch_is_a_screw() -> None:
    """It has a coordinate: what a turn advances is no motion that is prescribed."""
    (step,) = mbs.Custom("ground", "b", free=[mbs.Direct(rotate="z", pitch=3)]).steps
    assert isinstance(step, ScrewStep)
    assert step.motion is None
    assert step.lead.shadow == pytest.approx(3 / math.tau)
