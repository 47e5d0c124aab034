"""The `impact:` section: what is read, written back, and refused with its place."""

from __future__ import annotations

import pytest

import multibody_sym as mbs

HEAD = """multibody_sym: 1
name: struck
parameters: {e: 2}
bodies:
  a: {mass: 1, points: {p: [1, 0, 0]}}
  b: {mass: 2}
joints:
  A: {type: prismatic, parent: ground, child: a, axis: x, initial: {u: 1}}
  B: {type: prismatic, parent: ground, child: b, axis: x}
"""


@pytest.mark.parametrize(
    ("section", "message"),
    [
        ("{between: [a, b], normal: -x, restitution: 1.5}", "1.5 is no coefficient of restitution"),
        ("{between: [a, b], normal: -x, restitution: -1}", "-1 is no coefficient of restitution"),
        ("{between: [a, b], normal: -x, restitution: e}", "the restitution of impact is 2"),
        ("{between: [a, a.p], normal: -x}", "a cannot touch itself"),
        ("{between: [a, b], impulse: [1, 0, 0], at: a}", "an impact is one of"),
        ("{normal: x}", "an impact is one of"),
        ("{impulse: [1, 0, 0]}", "at is missing"),
        ("{impulse: [1 N, 0, 0], at: a}", "'1 N' does not fit here: expected a quantity in N*s"),
        ("{impulse: [1, 0, 0], at: ground}", "ground does not move"),
        ("{contacts: [c]}", "'c' is no contact"),
        ("{begins: A}", "joint 'A' carries its child"),
        ("{couple: [0, 0, 1], on: c}", "no body is called 'c'"),
        ("{between: [a, b], normal: -x, law: hooke}", "'hooke' is no choice here"),
        ("{between: [a, b], normal: x}", "nothing strikes: impact opens with 1 m/s"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(section: str, message: str) -> None:
    with pytest.raises((mbs.ModelError, mbs.NoSolutionError)) as caught:
        mbs.solve(mbs.loads(f"{HEAD}impact: {section}\n"))
    assert message in str(caught.value)


def test_a_couple_on_a_particle_is_refused() -> None:
    placed = HEAD.replace("prismatic, parent: ground, child: b, axis: x}", "point, parent: ground, child: b}")
    with pytest.raises(mbs.ModelError, match=r"impact\.on: 'b' is a particle, which joint 'B' never turns"):
        mbs.solve(mbs.loads(f"{placed}impact: {{couple: [0, 0, 1], on: b}}\n"))


@pytest.mark.parametrize(
    "section",
    [
        "{between: [a, b], normal: -x, restitution: 1}",
        "{between: [a, b], normal: -x, restitution: 1, law: poisson, sequence: simultaneous}",
        "{first: {between: [a, b], normal: -x, static: 0.1}, push: {impulse: [1, 0, 0], at: b}, law: newton}",
        "{impulse: {couple: [0, 0, 1], on: b}}",
        "closing",
        "{}",
    ],
)
def test_what_is_read_is_written_back(section: str) -> None:
    system = mbs.loads(f"{HEAD}impact: {section}\n")
    assert mbs.loads(mbs.dumps(system)) == system
    assert system.impact is not None


def test_two_jumps_of_one_motion_contradict_each_other() -> None:
    """The second one alone used to count."""
    driven = HEAD.replace("axis: x, initial: {u: 1}", "axis: x, motion: 2*t")
    both = "{hit: {motion: A, speed: 1}, back: {motion: A, speed: 2}}"
    with pytest.raises(mbs.ModelError, match=r"the motion of A jumps in hit already") as caught:
        mbs.loads(f"{driven}impact: {both}\n")
    assert (caught.value.where.line, caught.value.where.column) == (10, 53)


def test_errors_point_into_the_file() -> None:
    with pytest.raises(mbs.ModelError) as caught:
        mbs.loads(f"{HEAD}impact: {{between: [a, b], normal: -x, restitution: 1.5}}\n")
    assert (caught.value.where.line, caught.value.where.column) == (10, 52)
