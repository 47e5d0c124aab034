"""Three different messages: rows that are redundant, rows that contradict each other, directions without inertia."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pytest

import multibody_sym as mbs
from multibody_sym.documents.runs import run_summary
from multibody_sym.dynamics.start.start import start
from multibody_sym.errors import NoSolutionError
from multibody_sym.motion.runs.run import FailedRunError

PLANAR = {"j": mbs.Planar("ground", "plate", initial=mbs.Initial(q=[0.6, 0.8, 0]))}
HINGE = {"j": mbs.Revolute("ground", "plate", q="a")}
DISTANCE = {"between": ["ground.o", "plate.o"]}


def plate(joints: Mapping[str, Any], mass: Any = 1, **constraints: Any) -> mbs.System:
    """A plate with constraints."""
    points = {"o": [0, 0, 0], "p": [1, 0, 0], "r": [1.1, 0, 0]}
    solid = mbs.Body(mass=mass, inertia=mass and {"Izz": mass}, points=points)
    bodies = {"plate": solid, "ground": mbs.Body(points=points)}
    return mbs.System("plate", bodies=bodies, joints=joints, constraints=constraints)


def motion(value: str) -> mbs.PrescribedMotion:
    return mbs.PrescribedMotion(joint="j", value=value)


def contradiction(system: mbs.System) -> tuple[str, tuple[str, ...]]:
    with pytest.raises(NoSolutionError) as caught:
        start(mbs.mechanism(system))
    return caught.value.message, caught.value.where.path


def test_redundant_rows_are_no_error() -> None:
    system = plate(PLANAR, rod1=mbs.Distance(**DISTANCE, value=1), rod2=mbs.Distance(**DISTANCE, value=1))
    run = mbs.simulate(system, t_end=0.1, backend="python", samples=2)
    assert "redundant constraints: rod2 (1 row is left over; the motion is unique all the same)" in run_summary(run)
    assert "each of rod1, rod2 follows from the others" in run_summary(run)
    told = run.as_json()["redundancy"]
    assert (told["rows"], told["rank"], told["redundant"]) == (2, 1, ("rod2",))
    assert told["ambiguous"] == {"rod1": (), "rod2": ()}


def test_two_lengths_of_one_distance_contradict_each_other() -> None:
    rods = {"rod1": mbs.Distance(**DISTANCE, value=1), "rod2": mbs.Distance(**DISTANCE, value=1.1)}
    message, path = contradiction(plate(PLANAR, rod1=rods["rod1"], level=mbs.Expression("j_theta"), rod2=rods["rod2"]))
    assert "contradict each other at the start: no positions satisfy rod1 and rod2 together" in message
    assert path == ("constraints", "rod2")


def test_two_hinges_too_far_apart_contradict_each_other() -> None:
    hinges = {"A": mbs.Revolute("ground.o", "plate.o", cut=True), "B": mbs.Revolute("ground.p", "plate.r", cut=True)}
    free = {"j": mbs.Planar("ground", "plate")}
    message, path = contradiction(plate({**free, **hinges}))
    assert "no positions satisfy A.x and B.x together" in message
    assert path == ("joints", "B")


def test_three_speeds_of_which_two_determine_the_third() -> None:
    speeds = {"v1": "u_j_x - 1", "v2": "u_j_y + u_j_x - 2", "v3": "u_j_y - 2", "v4": "u_j_theta"}
    constraints = {name: mbs.VelocityConstraint(zero) for name, zero in speeds.items()}
    message, _ = contradiction(plate(PLANAR, **constraints))
    assert "no speeds satisfy v1, v2 and v3 together" in message


def test_accelerations_contradict_at_the_start() -> None:
    message, _ = contradiction(plate(HINGE, d1=motion("t^2"), d2=motion("2*t^2")))
    assert "at the start: no accelerations satisfy d1 and d2 together" in message


@pytest.mark.parametrize("backend", ["c", "python"])
@pytest.mark.parametrize("projection", [True, False])
def test_what_contradicts_later_ends_the_run_with_its_time(backend: Any, projection: bool) -> None:
    system = plate(HINGE, d1=motion("where(t < 1, 0, (t - 1)^3)"), d2=motion("where(t < 1, 0, 2*(t - 1)^3)"))
    with pytest.raises(FailedRunError, match=r"at t = 1\.[0-9]* s: no .* satisfy d1 and d2 together"):
        mbs.simulate(system, t_end=2, step=0.1, method="rk4", backend=backend, constraints={"projection": projection})


def test_a_row_that_nothing_can_satisfy() -> None:
    message, _ = contradiction(plate(HINGE, far=mbs.Distance(["ground.o", "plate.p"], 2)))
    far = "its ends are 1 m too near"  # 2 m are wanted, 1 m is there
    assert message == f"constraint far asks at the start for what nothing can move: {far}; correct it, or leave it out"


def test_the_end_of_a_reach_is_no_contradiction() -> None:
    message, _ = contradiction(reach())
    assert "contradict" not in message
    assert "rod misses by" in message


def reach() -> mbs.System:
    """A crank of 1 m that a rod of 1 m cannot tie to a place 3 m away."""
    away = mbs.Body(points={"far": [3, 0, 0]})
    crank = mbs.Body(mass=1, inertia={"Izz": 1}, points={"end": [1, 0, 0]})
    joint = mbs.Revolute("ground", "crank", q="a", initial=mbs.Initial(q=0.4))
    rod = mbs.Distance(["ground.far", "crank.end"], 1)
    return mbs.System("reach", bodies={"ground": away, "crank": crank}, joints={"A": joint}, constraints={"rod": rod})


def test_rods_too_short_to_meet_are_named_without_an_innocent_third() -> None:
    """Pivots 1 m apart and rods of 0.3 m each; z hangs on the point where they would meet."""
    round_body = {"mass": 1, "inertia": {"Izz": 1}}
    system = mbs.System(
        "short",
        bodies={
            "ground": mbs.Body(points={"p": [1, 0, 0]}),
            "m": mbs.Body(**round_body),
            "n": mbs.Body(**round_body),
        },
        joints={
            "h": mbs.Planar("ground", "m", initial=mbs.Initial(q=[0.4, 0.1, 0])),
            "k": mbs.Planar("ground", "n", initial=mbs.Initial(q=[0.4, 0.9, 0])),
        },
        constraints={
            "z": mbs.Distance(["m", "n"], 0.5),
            "a": mbs.Distance(["m", "ground"], 0.3),
            "b": mbs.Distance(["m", "ground.p"], 0.3),
        },
    )
    message, path = contradiction(system)
    assert message.startswith("no positions were found that satisfy a and b together, though they were without any one")
    assert "z misses" not in message
    assert path == ("constraints", "a")


def test_a_direction_without_inertia_is_another_message() -> None:
    message, path = contradiction(plate(PLANAR, mass=None, rod=mbs.Distance(**DISTANCE, value=1)))
    assert message.startswith("no inertia resists the speed u_j_theta: body plate and what joint 'j' moves with it")
    assert path == ("joints", "j")
