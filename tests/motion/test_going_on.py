"""Going on from where a run ended, and what a state in absolute coordinates says when a start is made of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import multibody_sym as mbs

EXAMPLES = Path(__file__).parents[2] / "examples"
RUN: dict[str, Any] = {"backend": "python", "rtol": 1e-10, "atol": 1e-12}


@pytest.mark.parametrize("example", ["double_pendulum", "slider_crank", "gyroscope"])
def test_a_run_goes_on_from_where_another_ended(example: str) -> None:
    """Half the time twice is the whole time once, in a tree, a closed loop with a known crank, and by a quaternion."""
    system = mbs.load(EXAMPLES / f"{example}.yaml")
    still = {"inputs": dict.fromkeys(system.inputs, 0)} if system.inputs else {}
    whole = mbs.simulate(system, t_end=0.2, samples=3, **still, **RUN)
    first = mbs.simulate(system, t_end=0.1, samples=2, **still, **RUN)
    second = mbs.simulate(system, t_end=0.1, samples=2, initial=first.final, **still, **RUN)
    assert second.t[0] == 0.0
    ends = [{**run.final["coordinates"], **run.final["speeds"]} for run in (first, second, whole)]
    assert ends[1] == pytest.approx(ends[2], rel=1e-7, abs=1e-8)
    assert ends[0] != pytest.approx(ends[2], rel=1e-3)


def test_small_motions_are_about_the_end_of_a_run_too() -> None:
    joint = mbs.Prismatic("ground", "b", axis="x", q="x", initial={"q": 1, "u": 3})
    system = mbs.System("cart", bodies={"b": mbs.Body(mass=2)}, joints={"j": joint})
    final = mbs.simulate(system, t_end=0.5, samples=2, **RUN).final
    assert mbs.linearize(system, at=final).at == pytest.approx({"x": 2.5, "u_x": 3.0}, rel=1e-9)


def test_an_end_with_something_else_in_it_is_refused_by_name() -> None:
    system = mbs.load(EXAMPLES / "pendulum.yaml")
    with pytest.raises(mbs.InputError, match="called 'thet'; did you mean theta") as error:
        mbs.simulate(system, initial={"t": 1, "coordinates": {"thet": 1}, "speeds": {}})
    assert error.value.where.path == ("initial", "thet")
    with pytest.raises(mbs.InputError, match="called 't'"):
        mbs.simulate(system, initial={"t": 1, "theta": 1})


@pytest.mark.parametrize("coordinates", ["relative", "absolute"])
def test_a_state_of_bodies_tells_what_a_start_is_made_of(coordinates: str) -> None:
    system = mbs.load(EXAMPLES / "pendulum.yaml")
    rest = mbs.equilibrium(system, coordinates="absolute").positions[0]
    final = mbs.simulate(system, coordinates="absolute", t_end=0.1, samples=2, **RUN).final
    for begun in (
        lambda: mbs.simulate(system, initial=rest, coordinates=coordinates),
        lambda: mbs.simulate(system, initial=final, coordinates=coordinates),
        lambda: mbs.linearize(system, at=rest, coordinates=coordinates),
        lambda: mbs.check(system, initial={"u_bob_angle": 1}, coordinates=coordinates),
    ):
        with pytest.raises(mbs.InputError, match=r"of a body .* those of joints: theta, u_theta; .*relative") as error:
            begun()
        assert error.value.where.path[-1] in ("bob_x", "u_bob_angle")
