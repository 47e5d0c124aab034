"""The general theorems through the impacts of runs: momenta, energy and what was lost, against the rows' impulses."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.balance import INTEGRAL, THEOREMS
from multibody_sym.motion.results.integrals import impact_balance
from multibody_sym.motion.switching.impact import ImpactOutcome

JUMPS = tuple(INTEGRAL.values())

FLOOR = {"floor": mbs.Surface(plane=[0, 0, 0], normal="y")}


def ran(system: mbs.System, t_end: float) -> mbs.Trajectory:
    return mbs.simulate(system, t_end=t_end, samples=3, rtol=1e-10, atol=1e-12, backend="python")


def worst(run: mbs.Trajectory, jumps: list[ImpactOutcome] | None = None) -> dict[str, float]:
    """Return by how much each theorem is missed at impacts, relative to its terms."""
    assert run.modes is not None
    laws = run.modes.switches.laws
    each = [impact_balance(laws.mechanism, jump) for jump in jumps or run.modes.blows]
    missed = np.array([np.abs(x.changed - x.expected) / np.maximum(x.size, 1e-300) for x in each])
    return {name: float(missed[:, own].max()) for name, own in zip(JUMPS, THEOREMS.values(), strict=True)}


def spinning_ball(**contact: Any) -> mbs.System:
    ball = mbs.Body(shape=mbs.Shape("sphere", [0.1], 2), surfaces={"rim": mbs.Surface(disc=0.1, axis="z")})
    return mbs.System(
        "ball",
        gravity=[0, -10, 0],
        bodies={"ground": mbs.Body(surfaces=FLOOR), "ball": ball},
        joints={"free": mbs.Planar("ground", "ball", q=["x", "y", "phi"], initial={"q": [0, 0.3, 0], "u": [1, 0, 20]})},
        contacts={"c": mbs.Contact(between=["ball.rim", "ground.floor"], restitution=0.7, **contact)},
    )


def rod_on_a_shaken_floor() -> mbs.System:
    """A double pendulum whose end strikes a floor that moves up and down."""
    floor = mbs.Body(surfaces=FLOOR, motion=mbs.GroundMotion(y="0.02*sin(30*t)"))
    half = {"inertia": {"Izz": 0.02}, "com": [0.25, 0, 0]}
    surface = {"tip": mbs.Surface(point=[0.5, 0, 0])}
    return mbs.System(
        "rods",
        gravity=[0, -10, 0],
        bodies={
            "ground": replace(floor, points={"hinge": [0, 0.5, 0]}),
            "upper": mbs.Body(mass=1, points={"end": [0.5, 0, 0]}, **half),
            "lower": mbs.Body(mass=1.5, surfaces=surface, **half),
        },
        joints={
            "A": mbs.Revolute("ground.hinge", "upper", q="a", initial={"q": 0.3}),
            "B": mbs.Revolute("upper.end", "lower", q="b", initial={"q": -0.4}),
        },
        contacts={"c": mbs.Contact(between=["lower.tip", "ground.floor"], restitution=0.6)},
    )


@pytest.fixture(scope="module")
def rubbing() -> mbs.Trajectory:
    return ran(spinning_ball(static=0.3, kinetic=0.25), 0.8)


def test_a_ball_that_rubs(rubbing: mbs.Trajectory) -> None:
    assert rubbing.modes is not None
    assert len(rubbing.modes.blows) >= 2
    assert any(impulse for name, impulse in rubbing.modes.blows[0].rows.items() if name != "c")
    assert max(worst(rubbing).values()) < 1e-13


def test_what_a_moving_floor_gives() -> None:
    run = ran(rod_on_a_shaken_floor(), 0.6)
    assert run.modes is not None
    assert run.modes.blows
    assert max(worst(run).values()) < 1e-12


def test_a_rope_that_goes_taut_takes_energy() -> None:
    system = mbs.System(
        "load",
        gravity=[0, -10, 0],
        bodies={
            "ground": mbs.Body(points={"top": [0, 1, 0]}),
            "load": mbs.Body(mass=3, inertia={"Izz": 0.1}),
        },
        joints={"fall": mbs.Planar("ground", "load", q=["x", "y", "f"], initial={"q": [0.2, 0.7, 0], "u": [1, 0, 0]})},
        constraints={"rope": mbs.Rope(path=["ground.top", "load"], length=1, slack=True)},
    )
    run = ran(system, 0.8)
    assert run.modes is not None
    (blow,) = run.modes.blows
    assert sum(blow.lost.values()) > 0.1
    assert max(worst(run).values()) < 1e-13


@pytest.mark.parametrize("name", JUMPS)
def test_what_is_wrong_is_seen(rubbing: mbs.Trajectory, name: str) -> None:
    assert rubbing.modes is not None
    first = rubbing.modes.blows[0]
    if name == "work":
        wrong = replace(first, lost={name: x * 1.001 for name, x in first.lost.items()})
    else:
        wrong = replace(first, rows={row: 1.001 * x for row, x in first.rows.items()})
    assert worst(rubbing, [wrong])[name] > 1e-5


def test_a_run_tells_it_with_its_theorems(rubbing: mbs.Trajectory) -> None:
    told = rubbing.verified()
    assert max(told[name].relative for name in JUMPS) < 1e-8
    assert rubbing.modes is not None
    rubbing.modes.blows[0] = replace(rubbing.modes.blows[0], lost={})
    struck = rubbing.modes.blows[0].t
    found = rubbing.verified()["work"]
    assert found.relative > 1e-3
    assert found.t >= struck


def test_integrals_end_and_begin_beside_a_force_that_jumps() -> None:
    """Pushed with 3 N until 1/3 s, then with 1 N: impulse and work by hand, though no sample lies at the jump."""
    system = mbs.System(
        "pushed",
        bodies={"block": mbs.Body(mass=2)},
        joints={"slide": mbs.Prismatic("ground", "block", axis="x", q="x")},
        forces={"F": mbs.Force(on="block", value=["where(t < 1/3, 3, 1)", 0, 0])},
        outputs={"I": "impulse(F, x)", "W": "work(F)"},
    )
    run = ran(system, 1.0)
    assert run.outputs["I"][-1] == pytest.approx(1 + 2 / 3, rel=1e-10)
    assert run.outputs["W"][-1] == pytest.approx((1 + 2 / 3) ** 2 / 4, rel=1e-10)
    assert max(miss.relative for miss in run.verified().values()) < 1e-9
