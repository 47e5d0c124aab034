"""The formalism chosen by default takes hardly more operations than any other that generates code."""

from __future__ import annotations

import pytest

from multibody_sym.derivation.routes import FORMALISMS, cheapest
from multibody_sym.dynamics.programs.system import state_derivative
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import slot_state
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.bodies import Body, Frame
from multibody_sym.model.joints import Free, Joint, Revolute, Spherical
from multibody_sym.model.system import System
from multibody_sym.program.program import operation_count


def legs(root: Joint, count: int, length: int, *, balls: bool = False) -> Mechanism:
    """Return a body with `count` legs of `length` links each."""
    inertia = [0.1, 0.2, 0.25, 0.01, 0.02, 0.03]
    link = Body(mass=2, com=[0.1, 0.02, 0.2], inertia=inertia, frames={"end": Frame([0, 0.1, 0.5])})
    bodies, joints = {"trunk": link}, {"root": root}
    for leg in range(count):
        for k in range(length):
            name, parent = f"leg{leg}_{k}", f"leg{leg}_{k - 1}.end" if k else "trunk.end"
            bodies[name] = link
            joints[f"j{leg}_{k}"] = Spherical(parent, name) if balls else Revolute(parent, name, axis="xyz"[k % 3])
    return mechanism(System("legs", gravity=[0, 0, -9.81], bodies=bodies, joints=joints))


HINGE = Revolute("ground", "trunk", axis="z")
CASES = {
    "pendulum": legs(HINGE, 0, 0),
    "arm": legs(HINGE, 1, 5),
    "two hands": legs(HINGE, 2, 3),
    "snake": legs(HINGE, 1, 11),
    "balls": legs(Spherical("ground", "trunk"), 1, 3, balls=True),
    "floating": legs(Free("ground", "trunk"), 4, 3),
}


@pytest.mark.parametrize("name", CASES)
def test_default_is_nearly_the_cheapest(name: str) -> None:
    resolved = CASES[name]
    found = {
        formalism: operation_count(
            state_derivative(resolved, FORMALISMS[formalism](resolved, slot_state(resolved)))
        ).total
        for formalism in ("composite_body", "block_ldl", "sweep")
    }
    assert found[cheapest(resolved)] <= 1.1 * min(found.values()), found


def test_each_of_two_is_chosen_somewhere() -> None:
    assert {cheapest(resolved) for resolved in CASES.values()} == {"composite_body", "block_ldl"}
