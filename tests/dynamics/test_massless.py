"""Freedoms without mass: what rows hold moves as the textbook says, what nothing holds is an error with its name."""

from __future__ import annotations

import pytest

from multibody_sym.dynamics.composite_body import composite_body
from multibody_sym.dynamics.formalisms import FORMALISMS, cheapest
from multibody_sym.dynamics.forward_dynamics import forward_dynamics
from multibody_sym.dynamics.massless import massless_speeds
from multibody_sym.dynamics.start import start
from multibody_sym.errors import NoSolutionError
from multibody_sym.kinematics.state import state_of
from multibody_sym.model.constraints import Rope
from multibody_sym.model.elements import Body, Pulley
from multibody_sym.model.joints import Prismatic
from multibody_sym.model.resolve import mechanism
from multibody_sym.model.system import System
from multibody_sym.simulation.simulate import simulate

M1, M2, M3, G = 3.0, 2.0, 1.0, 10.0


def double_atwood(**changes: object) -> System:
    """A mass over a fixed pulley against a massless movable one with two masses."""

    def hanging(child: str, depth: float) -> Prismatic:
        return Prismatic("ground", child, axis="-y", q=f"y_{child}", initial={"q": depth})

    declared = {
        "gravity": [0, -G, 0],
        "bodies": {"a": Body(mass=M1), "carrier": Body(), "b": Body(mass=M2), "c": Body(mass=M3)},
        "joints": {child: hanging(child, depth) for child, depth in {"a": 2, "carrier": 2, "b": 5, "c": 4}.items()},
        "pulleys": {"fixed": Pulley(at="ground"), "movable": Pulley(at="carrier")},
        "constraints": {"long": Rope(["a", "fixed", "carrier"]), "short": Rope(["b", "movable", "c"])},
    }
    return System("double_atwood", **(declared | changes))


def test_accelerations_and_tensions_of_the_double_atwood_machine() -> None:
    resolved = mechanism(double_atwood())
    begin = start(resolved)
    dynamics = composite_body(resolved, state_of(resolved, float, 0.0, begin.q, begin.u, begin.parameters))
    found = forward_dynamics(dynamics)
    below = M1 * (M2 + M3) + 4 * M2 * M3  # by hand, from m a = m g - T for each body, T_long = 2 T_short
    assert found.udot[0] == pytest.approx(G * (M1 * (M2 + M3) - 4 * M2 * M3) / below, rel=1e-13)
    assert found.multipliers == pytest.approx([8 * G * M1 * M2 * M3 / below, 4 * G * M1 * M2 * M3 / below], rel=1e-13)


def test_the_motion_keeps_its_energy_and_its_constraints() -> None:
    run = simulate(double_atwood(), t_end=0.5, backend="python", samples=11)
    acceleration = G * (M1 * (M2 + M3) - 4 * M2 * M3) / (M1 * (M2 + M3) + 4 * M2 * M3)
    assert run["y_a"][-1] == pytest.approx(2 + acceleration * 0.5**2 / 2, rel=1e-12)
    assert run.drift["energy"] < 1e-10
    assert run.drift["position"] < 1e-12


def test_massless_speeds_are_those_that_move_no_mass() -> None:
    resolved = mechanism(double_atwood())
    assert [resolved.speeds[k].name for k in massless_speeds(resolved)] == ["u_y_carrier"]
    carried = mechanism(System(
        "cart", bodies={"carrier": Body(), "load": Body(mass=1)},
        joints={"x": Prismatic("ground", "carrier"), "y": Prismatic("carrier", "load", axis="y")},
    ))  # fmt: skip
    assert massless_speeds(carried) == []
    assert cheapest(resolved) == "composite_body"


def test_a_massless_body_that_nothing_holds_is_named() -> None:
    with pytest.raises(NoSolutionError, match="u_y_carrier"):
        start(mechanism(double_atwood(constraints={"long": Rope(["a", "fixed", "b"])})))


def test_block_ldl_says_that_it_needs_inertia() -> None:
    resolved = mechanism(double_atwood())
    begin = start(resolved)
    with pytest.raises(NoSolutionError, match="composite_body"):
        FORMALISMS["block_ldl"](resolved, state_of(resolved, float, 0.0, begin.q, begin.u, begin.parameters))
