"""Freedoms without mass: what rows hold moves as the textbook says, what nothing holds is an error with its name."""

from __future__ import annotations

import math

import pytest

from multibody_sym.derivation.routes import FORMALISMS, cheapest
from multibody_sym.dynamics.formalisms import equations
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.formalisms.equations import massless_speeds
from multibody_sym.dynamics.start.start import start
from multibody_sym.errors import NoSolutionError
from multibody_sym.mechanics.motion import state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.bodies import Body
from multibody_sym.model.constraints import Expression, Pulley, Rope
from multibody_sym.model.forces import Force
from multibody_sym.model.joints import Direct, Free, Initial, Planar, Prismatic, Revolute, Spherical
from multibody_sym.model.system import System
from multibody_sym.motion.simulate import simulate

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
        joints={"x": Prismatic("ground", "carrier", axis="z"), "y": Prismatic("carrier", "load", axis="y")},
    ))  # fmt: skip
    assert massless_speeds(carried) == ()
    assert cheapest(resolved) == "composite_body"


def test_a_massless_body_that_nothing_holds_is_named() -> None:
    with pytest.raises(NoSolutionError, match="u_y_carrier"):
        start(mechanism(double_atwood(constraints={"long": Rope(["a", "fixed", "b"])})))


def test_block_ldl_says_that_it_needs_inertia() -> None:
    resolved = mechanism(double_atwood())
    begin = start(resolved)
    with pytest.raises(NoSolutionError, match="composite_body"):
        FORMALISMS["block_ldl"](resolved, state_of(resolved, float, 0.0, begin.q, begin.u, begin.parameters))


def particle_on_a_hinge(**changes: object) -> System:
    """A particle that may turn about itself without inertia, held at a distance L by a hinge that closes the loop."""
    declared = {
        "gravity": [0, -G, 0],
        "parameters": {"m": M2, "L": 0.5},
        "bodies": {"bob": Body(mass="m", points={"top": [0, "L", 0]})},
        "joints": {
            "place": Planar("ground", "bob", initial=Initial(q=["L*sin(0.3)", "-L*cos(0.3)", 0.3])),
            "hinge": Revolute("ground", "bob.top", cut=True),
        },
    }
    return System("particle", **(declared | changes))


def test_speeds_without_mass_are_found_once_for_a_mechanism(monkeypatch: pytest.MonkeyPatch) -> None:
    """Numbers ask for them at each state, and they depend on none."""
    resolved, drawn = mechanism(particle_on_a_hinge()), list[object]()
    found = equations._generic_state
    monkeypatch.setattr(equations, "_generic_state", lambda asked: drawn.append(asked) or found(asked))
    assert massless_speeds(resolved) == massless_speeds(resolved) != ()
    assert drawn == [resolved]


@pytest.mark.parametrize("backend", ["c", "python"])
def test_a_particle_that_may_turn_swings_as_a_pendulum(backend: str) -> None:
    whole = simulate(particle_on_a_hinge(), t_end=1.0, backend=backend, samples=11)
    pendulum = {"swing": Revolute("ground", "bob.top", initial=Initial(q=0.3))}
    simple = simulate(particle_on_a_hinge(joints=pendulum), t_end=1.0, backend=backend, samples=11)
    assert whole["place_theta"] == pytest.approx(simple["swing"], abs=1e-8)
    begin = start(mechanism(particle_on_a_hinge()))
    assert begin.q == pytest.approx([0.5 * math.sin(0.3), -0.5 * math.cos(0.3), 0.3])
    tension = [whole.reactions["hinge"][axis][0] for axis in ("fx", "fy")]
    assert math.hypot(*tension) == pytest.approx(M2 * G * math.cos(0.3), rel=1e-12)


def test_directions_of_a_particle_that_nothing_resists() -> None:
    def names(joint: Direct, mass: float = 1.0) -> list[str]:
        resolved = mechanism(System("s", bodies={"p": Body(mass=mass, com=[0, 0.2, 0])}, joints={"j": joint}))
        return [resolved.speeds[k].name for k in massless_speeds(resolved)]

    assert names(Free("ground", "p")) == ["j_wx", "j_wy", "j_wz"]
    assert names(Spherical("ground", "p")) == ["j_wy"], "the particle lies on its axis y"
    assert names(Planar("ground", "p")) == ["u_j_theta"]
    assert names(Revolute("ground", "p", axis="z")) == []
    assert names(Revolute("ground", "p", axis="y")) == ["u_j"]


def test_many_particles_are_judged_at_one_drawn_state(monkeypatch: pytest.MonkeyPatch) -> None:
    """One state of all of them for each would take a time that grows with the square of their number."""
    names = [f"p{k}" for k in range(8)]
    resolved = mechanism(
        System(
            "particles",
            bodies=dict.fromkeys(names, Body(mass=1)),
            joints={f"J{name}": Planar("ground", name) for name in names},
        )
    )
    made: list[object] = []
    monkeypatch.setattr(equations, "state_of", lambda *given: made.append(given) or state_of(*given))
    assert [resolved.speeds[k].name for k in massless_speeds(resolved)] == [f"u_J{name}_theta" for name in names]
    assert len(made) == 1


def test_a_particle_that_nothing_keeps_from_turning_is_named() -> None:
    with pytest.raises(NoSolutionError, match="no inertia resists the speed u_place_theta"):
        start(mechanism(particle_on_a_hinge(joints={"place": Planar("ground", "bob")}, constraints={})))


def carried_alike(**changes: object) -> System:
    """A mass that two sliders in a row move along the same line; the first carries it and has none itself."""
    declared = {
        "bodies": {"a": Body(), "b": Body(mass=2)},
        "joints": {"A": Prismatic("ground", "a", axis="x", q="xa"), "B": Prismatic("a", "b", axis="x", q="xb")},
        "constraints": {"tie": Expression(zero="xb - 2*xa")},
        "forces": {"push": Force(on="b", value=[6, 0, 0])},
    }
    return System("carried_alike", **(declared | changes))


def test_a_body_without_mass_in_mid_chain_moves_as_a_constraint_says() -> None:
    resolved = mechanism(carried_alike())
    assert massless_speeds(resolved) == (0,)
    state = state_of(resolved, float, 0.0, [0.1, 0.2], [0.5, 1.0], start(resolved).parameters)
    for name in ("newton_euler", "dalembert_lagrange", "composite_body", "multipliers"):
        found = forward_dynamics(FORMALISMS[name](resolved, state))
        assert found.udot == pytest.approx([1, 2], rel=1e-12), name  # 3 xa'' = F / m
        assert found.multipliers == pytest.approx([0], abs=1e-12), name


def test_freedoms_that_move_the_same_are_told_as_that() -> None:
    with pytest.raises(NoSolutionError, match="u_xa: freedoms beyond joint 'A' move what it moves in the same way"):
        start(mechanism(carried_alike(constraints={})))


def test_bars_without_mass_that_swing_are_not_massless_speeds() -> None:
    bodies = {"bar": Body(points={"end": [1, 0, 0]}), "bob": Body(mass=2, com=[1, 0, 0])}
    joints = {"A": Revolute("ground", "bar", q="a"), "B": Revolute("bar.end", "bob", q="b", initial={"q": 1})}
    assert massless_speeds(mechanism(System("double", bodies=bodies, joints=joints))) == ()
