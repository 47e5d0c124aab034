"""Starts beside closed loops: refused by name where all is known, put back where it is not, on the branch of the guess.

Residuals are measured by the poses of the two frames that a cut joint holds together, not by its rows.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mechanisms import Case
from random_loops import blocks, closed

import multibody_sym as mbs
from multibody_sym.dynamics.start.start import Start, start
from multibody_sym.errors import NoSolutionError
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import motion_of, state_of
from multibody_sym.mechanics.points import position
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.mechanics.row_records import PositionRow
from multibody_sym.model.bodies import Body
from multibody_sym.model.fields import Names
from multibody_sym.model.joints import Fixed, Initial, Prismatic, Revolute
from multibody_sym.model.system import System

EXAMPLES = Path(__file__).parents[3] / "examples"
SIZES = 10.0 ** np.arange(-12, 1)


def declared(
    system: System, mechanism: Mechanism, q: Sequence[float], u: Sequence[float] | None, known: Sequence[str]
) -> System:
    """Return the system with these start values, those of the joints named in `known` marked."""
    joints = dict(system.joints)
    for body in mechanism.bodies:
        if body.q:
            speeds = None if u is None else [u[k] for k in body.u]
            initial = Initial(q=[q[i] for i in body.q], u=speeds, known=body.joint_name in known)
            joints[body.joint_name] = replace(joints[body.joint_name], initial=initial)
    return replace(system, joints=Names(joints))


def loop(seed: int) -> tuple[Case, Start]:
    """Return a random loop and a start of it, assembled from the state at which it was drawn."""
    case, state = closed(seed)
    joints = [body.joint_name for body in case.mechanism.bodies if body.q]
    system = declared(case.system, case.mechanism, state.q, None, ())
    begin = start(mbs.mechanism(system))
    return replace(case, system=declared(system, case.mechanism, begin.q, begin.u, joints)), begin


def gap(resolved: Mechanism, begin: Start) -> tuple[float, float]:
    """Return how far rows are missed in m and rad, and the largest distance of a point from the origin."""
    motion = motion_of(resolved, state_of(resolved, float, 0.0, begin.q, begin.u, begin.parameters))
    points = [position(motion, marker) for marker in resolved.markers.values()] + [p for _, p in motion.poses]
    length = max(math.dist((0, 0, 0), p) for p in points)
    rows = zip(resolved.rows, row_motions(motion), strict=True)
    return max(abs(float(m.phi)) / (length if isinstance(r, PositionRow) else 1.0) for r, m in rows), length


@pytest.mark.parametrize("seed", blocks(60, quick=5))
def test_disturbed_random_loops(seed: int) -> None:
    """All known: refused above 1e-13 of the lengths, or of more that nothing can undo, as in loop 4.

    Projected, or not marked: closed to 1e-12, the shift told.
    """
    case, exact = loop(seed)
    joints = [body.joint_name for body in case.mechanism.bodies if body.q]
    left = gap(mbs.mechanism(case.system), exact)[0]
    rng = np.random.default_rng(seed)
    for size in rng.choice(SIZES, 3, replace=False).tolist():
        q = (np.array(exact.q) + size * rng.uniform(-1, 1, len(exact.q))).tolist()
        known = mbs.mechanism(declared(case.system, case.mechanism, q, exact.u, joints))
        guessed = mbs.mechanism(declared(case.system, case.mechanism, q, exact.u, ()))
        missed, _ = gap(known, replace(exact, q=unit(known, q)))
        if missed > 1.01 * max(1e-13, left):
            with pytest.raises(NoSolutionError, match=r"L0\.\w+ misses by .*--project") as caught:
                start(known)
            assert caught.value.where.path == ("joints", "L0")
        for begin in (start(known, project=True), start(guessed)):
            reached, length = gap(known, begin)
            assert reached * max(length, 1.0) <= 1e-12
            assert max(begin.shift, 1e-13) >= 0.01 * missed
            assert begin.shift <= 20 * max(size, 1e-13) or size > 1e-3


def unit(resolved: Mechanism, q: Sequence[float]) -> tuple[float, ...]:
    found = np.array(q)
    for body in resolved.bodies:
        for places in map(list, body.quaternions):
            found[places] /= np.linalg.norm(found[places])
    return tuple(found.tolist())


@pytest.mark.parametrize("size", 10.0 ** np.arange(-12, 0, 3))
def test_speeds_beside_those_that_a_loop_allows(size: float) -> None:
    system = mbs.load(EXAMPLES / "four_bar.yaml")
    resolved = mbs.mechanism(system)
    exact = start(resolved)
    u = np.array(exact.u) * (1 + size * np.array([1, -1, 1]))
    known = mbs.mechanism(declared(system, resolved, exact.q, u.tolist(), list(system.joints)))
    with pytest.raises(NoSolutionError, match=r"initial speeds .*C\.\w misses by"):
        start(known)
    for begin in (
        start(known, project=True),
        start(mbs.mechanism(declared(system, resolved, exact.q, u.tolist(), ()))),
    ):
        motion = motion_of(resolved, state_of(resolved, float, 0.0, begin.q, begin.u, begin.parameters))
        assert max(abs(row.phidot) for row in row_motions(motion)) < 1e-13
        assert 0.1 * size < begin.shift < 100 * size


def governor(rate: float, angle: float, **spindle: object) -> System:
    """Watt's governor: a planar linkage on a spindle, whose rows C.y, C.rx and C.rz nothing in it can move."""
    arm = {"points": {"e": [0, 0, -0.4]}}
    return System(
        "governor",
        gravity=[0, 0, -9.81],
        bodies={
            "spindle": Body(inertia={"Izz": 1}),
            "arm": Body(**arm),
            "ball": Body(mass=1.5),
            "rod": Body(**arm),
            "sleeve": Body(mass=2),
        },
        joints={
            "S": Revolute("ground", "spindle", axis="z", q=None if "motion" in spindle else "s", **spindle),
            "A": Revolute("spindle", "arm", axis="y", q="th", initial={"q": angle, "u": rate, "known": True}),
            "F": Fixed("arm.e", "ball"),
            "B": Revolute("arm.e", "rod", axis="y", q="ps", initial={"q": 2}),
            "D": Prismatic("spindle", "sleeve", axis="z", q="z", initial={"q": -0.5}),
            "C": Revolute("rod.e", "sleeve", axis="y", cut=True),
        },
    )


@pytest.mark.parametrize("coordinates", ["relative", "absolute"])
@pytest.mark.parametrize(
    ("w", "angle"),
    [(100, -0.7), *(pytest.param(w, a, marks=pytest.mark.long) for w, a in ((1, -1), (8, -0.7), (37, -1)))],
)
def test_speeds_of_a_linkage_on_a_turning_spindle(w: float, coordinates: str, angle: float) -> None:
    """ps = -2 th, z = -0.8 cos(th), whatever the spindle does, free or driven."""
    for spindle in ({"initial": {"u": w}}, {"motion": f"{w}*t"}):
        system = governor(0.3, angle, **spindle)
        run = mbs.simulate(
            replace(system, simulation=replace(system.simulation, coordinates=coordinates)),
            t_end=1e-3,
            samples=2,
            backend="python",
        )
        assert run["u_ps"][0] == pytest.approx(-0.6, abs=1e-12)
        assert run["u_z"][0] == pytest.approx(0.24 * math.sin(angle), abs=1e-12)
        assert run["ps"] == pytest.approx(-2 * run["th"], abs=1e-9)
        assert run["z"] == pytest.approx(-0.8 * np.cos(run["th"]), abs=1e-9)


def test_wrong_known_speeds_are_refused_on_a_turning_spindle() -> None:
    """Parts of 1e-9 are no rounding of a motion that nothing makes large."""
    system = governor(0.3, -1, initial={"q": 0, "u": 8, "known": True})
    right = {"B": -0.6, "D": 0.24 * math.sin(-1)}
    places = {"B": 2.0, "D": -0.8 * math.cos(1)}
    for wrong in (None, "B", "D"):
        joints = dict(system.joints)
        for name, speed in right.items():
            given = Initial(q=places[name], u=speed * (1 + 1e-9 * (name == wrong)), known=True)
            joints[name] = replace(joints[name], initial=given)
        resolved = mbs.mechanism(replace(system, joints=joints))
        if wrong is None:
            start(resolved)
            continue
        with pytest.raises(NoSolutionError, match=r"initial speeds .*C\.\w+ misses by"):
            start(resolved)


@pytest.mark.parametrize(
    ("name", "crank", "mirrored"),
    [
        ("four_bar", "A", {"coupler_angle": -2.4, "rocker_angle": -2.2}),
        ("slider_crank", "A", {"psi": -2.6, "s": -0.2}),
        ("andrews_squeezer", "O", {"delta": -0.3, "phi": 2.8}),
    ],
)
def test_elbows_stay_where_the_guess_was(name: str, crank: str, mirrored: dict[str, float]) -> None:
    """Guesses within 0.3 rad of a position lead back to it; guesses at its mirror image lead there."""
    system = mbs.load(EXAMPLES / f"{name}.yaml")
    resolved = mbs.mechanism(system)
    exact = np.array(start(resolved).q)
    names = [c.name for c in resolved.coordinates]
    held = np.array([c.joint == crank for c in resolved.coordinates])
    sizes = np.where(held, 0.0, [0.3 if c.unit == "rad" else 0.03 for c in resolved.coordinates])
    rng = np.random.default_rng(1)
    for _ in range(5):
        guess = exact + sizes * rng.uniform(-1, 1, len(exact))
        begin = start(mbs.mechanism(declared(system, resolved, guess.tolist(), None, [crank])))
        assert begin.q == pytest.approx(exact, abs=1e-9)
    other = exact.copy()
    other[[names.index(n) for n in mirrored]] = list(mirrored.values())
    begin = start(mbs.mechanism(declared(system, resolved, other.tolist(), None, [crank])))
    turns = [math.remainder(a - b, 2 * math.pi) for a, b in zip(begin.q, exact, strict=True)]
    assert max(map(abs, turns)) > 0.1
    assert gap(resolved, begin)[0] < 1e-13
