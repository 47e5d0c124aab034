"""Speeds that a mode holds: what stands still stays where it is to the last bit, whatever moves beside it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.programs.system import programs
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.law_elements import FrictionPart, LawElement, Mode
from multibody_sym.mechanics.modes import in_mode
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.mechanics.row_records import VelocityRow
from multibody_sym.motion.loop.integrate import integrate
from multibody_sym.motion.loop.problem import NO_MODE, Problem
from multibody_sym.motion.methods.table import METHODS
from multibody_sym.program import loading
from multibody_sym.program.backend import Native
from multibody_sym.scalars.node import ZERO, as_node, slot


def cart_with_pendulum(held):
    """Return a cart that sticks to its guide, and the pendulum on it that swings on, in that mode."""
    system = mbs.System(
        "crane",
        gravity=[0, -9.81, 0],
        parameters={"mu": 0.9},
        bodies={"cart": mbs.Body(mass=30.0), "bob": mbs.Body(mass=1.0, com=[0, -0.7, 0])},
        joints={
            "guide": mbs.Prismatic("ground", "cart", axis="x", q="x", initial={"q": 0.1}),
            "hinge": mbs.Revolute("cart", "bob", axis="z", q="phi", initial={"q": 0.5}),
        },
    )
    resolved = mechanism(system)
    along = VelocityRow("rub", slot("u", 0))
    part = FrictionPart("rub", (along,), as_node(1), as_node(1), enough=True, normals=())
    rub = LawElement("rub", "friction", ("forces", "rub"), (), unilateral=False, frictions=(part,), restitution=ZERO)
    return in_mode(replace(resolved, one_way=(rub,)), Mode({"rub": 1}, {"rub": 0}), held)


def run(held, t_end=20.0, method="dormand_prince", step=None, backend="c"):
    resolved = cart_with_pendulum(held)
    begin = start(resolved)
    form = "implicit" if method == "radau_5" else "explicit"
    made = loading.load(programs(resolved, FORMALISMS["composite_body"], form).as_mapping(), Native(backend=backend))
    q, u, p = (np.array(x, dtype=float) for x in (begin.q, begin.u, begin.parameters))
    problem = Problem(
        made, METHODS[method], 0.0, t_end, q, u, p, NO_MODE, step=step, samples=21, project=True, independent=1.0
    )
    return integrate(problem)


@pytest.mark.parametrize(("method", "step"), [("dormand_prince", None), ("radau_5", None), ("rk4", 0.01)])
def test_what_sticks_stays_to_the_last_bit_while_another_body_moves(method, step):
    free, held = run((), 5.0, method, step), run((0,), 5.0, method, step)
    assert held.failure is None
    assert (held.q[:, 0] == 0.1).all()
    assert (held.u[:, 0] == 0.0).all()
    assert np.ptp(held.q[:, 1]) > 0.9
    np.testing.assert_allclose(held.q[:, 1], free.q[:, 1], atol=1e-6)


def test_the_multiplier_of_what_is_held_is_told_all_the_same():
    resolved = cart_with_pendulum((0,))
    begin = start(resolved)
    made = loading.load(programs(resolved, FORMALISMS["composite_body"]).as_mapping(), Native(backend="python"))
    q, u, p = (np.array(x, dtype=float) for x in (begin.q, begin.u, begin.parameters))
    qdot, udot, multipliers, _ = made["state_derivative"](0.0, q, u, p, np.empty(0), np.empty(0))
    swing = -9.81 / 0.7 * np.sin(0.5)
    assert (qdot[0], udot[0]) == (0.0, 0.0)
    assert udot[1] == pytest.approx(swing, rel=1e-13)
    assert multipliers == pytest.approx([0.7 * np.cos(0.5) * swing], rel=1e-12)


def test_projection_leaves_what_is_held_alone():
    resolved = cart_with_pendulum((0,))
    begin = start(resolved)
    made = loading.load(programs(resolved, FORMALISMS["composite_body"]).as_mapping(), Native(backend="python"))
    q, u, p = (np.array(x, dtype=float) for x in (begin.q, [1e-17, 0.3], begin.parameters))
    residual, change = made["project_velocity"](0.0, q, u, p, np.empty(0), np.empty(0))
    assert residual.tolist() == [1e-17]
    assert change.tolist() == [0.0, 0.0]
