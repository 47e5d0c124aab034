"""What the summary of a run says of energy and of redundant rows."""

from __future__ import annotations

import math

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.documents.runs import run_summary

SWING = """
multibody_sym: 1
name: swing
gravity: [0, -9.81, 0]
bodies: {{rod: {{mass: 1, com: [0, -1, 0]}}}}
joints: {{A: {{type: revolute, parent: ground, child: rod, axis: z, q: theta, initial: {{q: 1}}}}}}
forces: {{{force}}}
"""


@pytest.mark.parametrize(
    ("force", "told"),
    [
        ("", " J"),
        ("turning: {type: spring, joint: A, stiffness: 3}", " J"),
        ("turning: {type: spring, joint: A, stiffness: 3, damping: 0.5}", " J, the work of turning included"),
        ("turning: {type: spring, joint: A, stiffness: 3 + t}", " J, the work of turning included"),
        ("motor: {type: torque, joint: A, value: 5}", " J, the work of motor included"),
    ],
)
def test_work_of_forces_is_told_beside_the_change_of_energy(force: str, told: str) -> None:
    run = mbs.simulate(mbs.loads(SWING.format(force=force)), t_end=0.5, samples=3, backend="python")
    line = next(line for line in run_summary(run).splitlines() if line.startswith("total energy"))
    number, unit, rest = line.partition("changed by at most ")[2].partition(" J")
    assert unit + rest == told
    assert float(number) > (0.01 if "work" in told else -1.0)


def test_what_a_run_does_not_tell_from_zero_is_zero() -> None:
    system = mbs.System(
        "drift",
        bodies={name: mbs.Body(mass=1) for name in ("a", "b", "c")},
        joints={
            "A": mbs.Prismatic("ground", "a", axis="x", q="noise", initial={"u": -1e-15}),
            "B": mbs.Prismatic("ground", "b", axis="x", q="small", initial={"u": 1e-11}),
            "C": mbs.Prismatic("ground", "c", axis="x", q="way", initial={"u": 1}),
        },
    )
    lines = run_summary(mbs.simulate(system, t_end=1, rtol=1e-9, atol=1e-10)).splitlines()
    told = {line.split()[0]: line.split()[1] for line in lines if line.startswith("  ")}
    assert (told["noise"], told["u_noise"], told["small"], told["way"]) == ("0", "0", "1e-11", "1")
    exact = run_summary(mbs.simulate(system, t_end=1, step=0.1, method="rk4"))
    assert "-1e-15 m" in exact  # a step has no tolerance that says what is nothing


def test_a_total_energy_of_rounding_is_zero() -> None:
    """A pendulum let go level has T = V = 0, but for cos(pi/2) = 6e-17."""
    system = mbs.System(
        "level",
        gravity=[0, -9.81, 0],
        bodies={"bob": mbs.Body(mass=3, com=[0, -1, 0])},
        joints={"H": mbs.Revolute("ground", "bob", q="theta", initial={"q": np.pi / 2})},
    )
    assert "total energy 0 J at the start" in run_summary(mbs.simulate(system, t_end=1))


THROWN = """
multibody_sym: 1
name: thrown
gravity: [0, -9.81, 0]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  block: {mass: 2}
joints: {free: {type: point, parent: ground, child: block, q: [x, y], initial: {u: [3, 0]}}}
contacts: {c1: {between: [block, ground.floor], static: 0.3, kinetic: 0.3}}
"""


@pytest.mark.parametrize("force", ["where(t < 1, 15, 0)", "where(x < 2, 15, 0)"])
def test_the_energy_account_closes_where_a_force_jumps_and_gives_the_work_that_outputs_give(force: str) -> None:
    """A push by P of a block that slides: (P - mu m g) s until it ends, s = a t^2/2, and friction takes all of it."""
    push = f'forces: {{push: {{type: force, on: block, value: ["{force}", 0, 0]}}}}'
    text = THROWN.replace("u: [3, 0]", "u: [0, 0]") + push
    told = "outputs: {given: work(push), taken: work(c1)}"
    run = mbs.simulate(mbs.loads(f"{text}\n{told}"), t_end=3, rtol=1e-11, atol=1e-12)
    P, rub, m = 15.0, 0.3 * 2 * 9.81, 2.0
    way = 2.0 if "x" in force else (P - rub) / m / 2
    assert run.modes is not None
    assert run.modes.account.loads == pytest.approx(P * way, rel=1e-10)
    assert run.friction_work["c1"].total == pytest.approx(-P * way, rel=1e-10)
    assert abs(run.energy_residual) < 1e-9 * P * way
    assert (run["given"][-1], run["taken"][-1]) == pytest.approx((P * way, -P * way), rel=1e-10)


def test_work_that_comes_in_blows_shorter_than_places_are_apart_is_not_told() -> None:
    """A force of peaks that last 1e-8 s gives 29.7 J: what the speed has got, where places see 26.6 J of it."""
    push = 'forces: {push: {type: force, on: block, value: ["1e-4/(sin(1e3*t)^2 + 1e-10)", 0, 0]}}'
    text = THROWN.replace("mass: 2", "mass: 1").replace("u: [3, 0]", "u: [1, 0]").replace("0.3", "0")
    run = mbs.simulate(mbs.loads(text + push), t_end=1)
    assert run.energy[-1] - run.energy_at_start > 20.0
    assert math.isnan(run.energy_residual)
    assert math.isnan(run.modes.account.loads)
    assert "the work of push is" not in run_summary(run)


def test_what_slips_out_of_the_energy_account_is_told() -> None:
    """Half of the friction's power that is not accounted leaves half of the energy: the residual is no mere zero."""
    run = mbs.simulate(mbs.loads(THROWN), t_end=2, rtol=1e-11, atol=1e-12)
    assert run.modes is not None
    run.modes.account.friction["c1"].total /= 2
    assert run.energy_residual == pytest.approx(-4.5, rel=1e-9)
