"""How each kind of step moves a body: against differences in time, wherever among others it stands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from multibody_sym.mechanics import motion as steps
from multibody_sym.mechanics.mechanism import Coordinate, Mechanism, Speed
from multibody_sym.mechanics.motion import Motion, accelerations, coordinate_rates, motion_of, state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.bodies import Body, unit_vector
from multibody_sym.model.joints import Fixed
from multibody_sym.model.steps import Ball, Curve, Follow, Rotate, ScrewStep, Step, Translate
from multibody_sym.model.system import System
from multibody_sym.scalars.node import ZERO, as_node

AXIS = unit_vector((as_node(1), as_node(-2), as_node(2)))
CURVES = (
    Follow.along(Curve(x="s + 0.3*s^2", y="sin(s)", z="cos(2*s)", parameter="s")),
    Follow.along(Curve(y="sin(x)"), turns_along=True),
)
KINDS = (Translate(AXIS), Rotate(AXIS), ScrewStep(AXIS, lead=as_node(0.3)), Ball(), *CURVES)
QUESTIONS = [x for x in vars(steps).values() if hasattr(x, "registry")]


def named(of: Step | tuple[Step, ...]) -> str:
    return " ".join(type(step).__name__ for step in (of if isinstance(of, tuple) else (of,)))


def moved_by(*of: Step) -> Mechanism:
    """Return one body on ground, joined by these steps."""
    system = System("one", bodies={"b": Body(mass=1)}, joints={"J": Fixed("ground", "b")})
    resolved = mechanism(system)
    nq, nu = (sum(len(x) for x in parts) for parts in ([s.coordinates for s in of], [s.speeds for s in of]))
    body = replace(resolved.bodies[0], steps=of, q=tuple(range(nq)), u=tuple(range(nu)))
    coordinates = tuple(Coordinate(f"q{k}", "J", "", ZERO, False, False) for k in range(nq))
    speeds = tuple(Speed(f"u{k}", "J", "", ZERO, False, False) for k in range(nu))
    return replace(resolved, bodies=(body,), coordinates=coordinates, speeds=speeds)


def at(resolved: Mechanism, q: Sequence[float], u: Sequence[float]) -> Motion:
    return motion_of(resolved, state_of(resolved, float, 0.0, list(q), list(u), []))


def unit(resolved: Mechanism, q: np.ndarray) -> np.ndarray:
    found = q.copy()
    for places in map(list, resolved.bodies[0].quaternions):
        found[places] /= np.linalg.norm(found[places])
    return found


@pytest.mark.parametrize("of", list(permutations(KINDS, 2)) + [(kind,) for kind in KINDS], ids=named)
def test_velocities_and_accelerations_are_rates(of: tuple[Step, ...]) -> None:
    """With q' = N u and constant u: R' = R [w], p' = R v, and (R v)' = R a, (R w)' = R alpha."""
    resolved, rng, h = moved_by(*of), np.random.default_rng(1), 1e-5
    u = rng.uniform(-1, 1, len(resolved.speeds))
    middle = unit(resolved, rng.uniform(-1, 1, len(resolved.coordinates)))
    rate = np.array(coordinate_rates(resolved, middle.tolist(), u.tolist()))
    second = np.array(coordinate_rates(resolved, rate.tolist(), u.tolist())) - np.array(
        coordinate_rates(resolved, [0.0] * len(middle), u.tolist())
    )  # N is affine in q
    ends = [unit(resolved, middle + k * h * rate + h * h / 2 * second) for k in (-1, 1)]
    (R0, p0), (R1, p1) = (at(resolved, q, u).poses[0] for q in ends)
    motion = at(resolved, middle, u)
    moved, R = motion.bodies[0], np.array(motion.poses[0][0])
    np.testing.assert_allclose(np.subtract(p1, p0) / (2 * h), R @ np.array(moved.v_WB), atol=1e-9)
    spin = R.T @ np.subtract(R1, R0) / (2 * h)
    np.testing.assert_allclose([spin[2, 1], spin[0, 2], spin[1, 0]], moved.w_WB, atol=1e-9)
    ((a, alpha),) = accelerations(motion, [0.0] * len(u))
    turned = [np.array(here.poses[0][0]) @ np.array([here.bodies[0].v_WB, here.bodies[0].w_WB]).T for here in
              (at(resolved, q, u) for q in ends)]
    np.testing.assert_allclose((turned[1] - turned[0]) / (2 * h), R @ np.array([a, alpha]).T, atol=1e-8)


@pytest.mark.parametrize("step", KINDS, ids=named)
def test_small_deviations_move_as_speeds_do(step: Step) -> None:
    rng, h = np.random.default_rng(2), 1e-6
    resolved = moved_by(step)
    q, sigma = unit(resolved, rng.uniform(-1, 1, len(step.coordinates))), rng.uniform(-1, 1, len(step.speeds))
    change = (steps.displaced(step, q, h * sigma) - steps.displaced(step, q, -h * sigma)) / (2 * h)
    np.testing.assert_allclose(change, steps.step_rates(step, q.tolist(), sigma.tolist()), atol=1e-9)


@pytest.mark.parametrize("step", KINDS, ids=named)
def test_frames_moved_along_invariant_directions_move_the_body_just_so(step: Step) -> None:
    """T_d S(q) = S(q) T_d for shifts d along them, of the rotation and position that the step makes."""
    rng = np.random.default_rng(3)
    resolved = moved_by(step)
    q = unit(resolved, rng.uniform(-1, 1, len(step.coordinates)))
    R, _ = at(resolved, q, [0.0] * len(step.speeds)).poses[0]
    for direction in steps.invariant_directions(step):
        d = [float(x.shadow or 0) for x in direction]
        np.testing.assert_allclose(np.array(R) @ d, d, atol=1e-14)


@pytest.mark.parametrize("question", QUESTIONS, ids=lambda question: question.__name__)
def test_every_kind_is_answered_for_and_a_foreign_one_is_refused(question) -> None:
    class Foreign:
        """Of no kind that is known."""

    for kind in (Translate, Rotate, ScrewStep, Ball, Follow):
        assert question.dispatch(kind) is not question.dispatch(object), kind
    with pytest.raises(TypeError, match=r"nothing says .*Foreign"):
        question(Foreign(), *range(question.__wrapped__.__code__.co_argcount - 1))
    assert len(QUESTIONS) >= 7
