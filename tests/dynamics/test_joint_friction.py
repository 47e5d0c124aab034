"""Friction in joints from the joint's own reaction: guides, pads and screws by every route, against bodies cut free."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pytest

from multibody_sym import derive, loads, solve
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.formalisms.constrained import Accelerations, forward_dynamics
from multibody_sym.dynamics.programs.system import programs
from multibody_sym.dynamics.start.start import start
from multibody_sym.errors import ModelError
from multibody_sym.mechanics.law_elements import Mode
from multibody_sym.mechanics.modes import in_mode
from multibody_sym.mechanics.motion import state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.program.program import interpret

G, M, MU, F, A = 9.81, 2.0, 0.3, 20.0, 0.3
BLOCK = f"""\
multibody_sym: 1
name: guide
gravity: [0, -{G}, 0]
parameters: {{mu: {MU}, l: 0.2}}
bodies: {{b: {{mass: {M}, inertia: {{Izz: 0.1}}, points: {{p: [0.1, 0.2, 0]}}}}}}
joints: {{J: {{type: prismatic, parent: ground, child: b, axis: x, q: x, initial: {{u: 1}}}}}}
forces:
  push: {{type: force, on: b, value: [{F}*cos({A}), -{F}*sin({A}), 0], at: p}}
  rub: {{type: friction, joint: J, static: mu}}
"""
SCREW = f"""\
multibody_sym: 1
name: jack
gravity: [0, 0, -{G}]
bodies: {{b: {{mass: {M}, inertia: {{Ixx: 0.1, Iyy: 0.1, Izz: 0.01}}}}}}
joints: {{J: {{type: screw, parent: ground, child: b, axis: z, pitch: 0.02, q: phi, initial: {{u: 1}}}}}}
forces:
  turn: {{type: torque, joint: J, value: 0.7}}
  rub: {{type: friction, joint: J, static: {MU}, radius: 0.03}}
"""
PUSH = np.array([F * math.cos(A), -F * math.sin(A)])


def by_routes(text: str, sides: Mapping[str, int], slip: int) -> Accelerations:
    """Return what all routes find in a mode, having compared them."""
    resolved = in_mode(mechanism(loads(text)), Mode(sides, {"rub": slip}))
    begin = start(resolved)
    state = state_of(resolved, float, 0.0, begin.q, begin.u, begin.parameters)
    routes = {name: route for name, route in FORMALISMS.items() if name != "lagrange"}
    found = [forward_dynamics(route(resolved, state)) for route in routes.values()]
    for each in found:
        assert each.udot == pytest.approx(found[0].udot, rel=1e-13, abs=1e-13)
        assert each.multipliers == pytest.approx(found[0].multipliers, rel=1e-13, abs=1e-13)
    return found[0]


@pytest.mark.parametrize("slip", [1, -1])
def test_a_guide_rubs_with_the_force_across_it(slip: int) -> None:
    found = by_routes(BLOCK, {"rub": 1}, slip)
    normal = M * G - PUSH[1]
    assert found.multipliers == pytest.approx([normal], rel=1e-14)
    assert found.udot == pytest.approx([(PUSH[0] - slip * MU * normal) / M], rel=1e-14)


def test_a_guide_pressed_from_below_rubs_as_well() -> None:
    found = by_routes(BLOCK.replace(f"-{F}*sin", f"100 + {F}*sin"), {"rub": -1}, 1)
    normal = 100 + F * math.sin(A) - M * G
    assert found.multipliers == pytest.approx([-normal], rel=1e-14)
    assert found.udot == pytest.approx([(PUSH[0] - MU * normal) / M], rel=1e-14)


def test_what_sticks_has_its_friction_as_a_multiplier() -> None:
    found = by_routes(BLOCK.replace("u: 1", "u: 0"), {"rub": 1}, 0)
    assert found.udot == pytest.approx([0], abs=1e-15)
    assert found.multipliers == pytest.approx([M * G - PUSH[1], -PUSH[0]], rel=1e-14)


def test_pads_take_their_shares_of_force_and_moment() -> None:
    """The moment about the joint's point, which both pads bear, is that of the push alone; friction has no arm."""
    moment = -(0.1 * PUSH[1] - 0.2 * PUSH[0])
    force = M * G - PUSH[1]
    pads = force / 2 + moment / 0.2, force / 2 - moment / 0.2
    assert pads[0] > 0 > pads[1]
    text = BLOCK.replace("static: mu", "static: mu, length: l")
    found = by_routes(text, {"rub.pad1.normal": 1, "rub.pad2.normal": -1}, 1)
    assert found.multipliers == pytest.approx(pads, rel=1e-14)
    assert found.udot == pytest.approx([(PUSH[0] - MU * (pads[0] - pads[1])) / M], rel=1e-13)


@pytest.mark.parametrize("slip", [1, -1])
def test_a_screw_rubs_on_its_thread(slip: int) -> None:
    """Cut free: m a = N cos - T sin .. along the axis, J alpha = 0.7 - r (N sin + T cos) about it, T = slip mu N."""
    r, lead = 0.03, 0.02 / (2 * math.pi)
    cos, sin = r / math.hypot(r, lead), lead / math.hypot(r, lead)
    friction = slip * MU
    # unknown alpha, N: the nut's flank pushes N (-sin, cos) at right angles to the thread, and friction along it
    equations = np.array([[M * lead, -(cos - friction * sin)], [0.01, r * (sin + friction * cos)]])
    alpha, normal = np.linalg.solve(equations, [-M * G, 0.7])
    found = by_routes(SCREW, {"rub": 1}, slip)
    assert found.udot == pytest.approx([alpha], rel=1e-12)
    assert found.multipliers == pytest.approx([normal], rel=1e-12)


def test_a_screw_that_sticks_tells_what_presses_on_its_thread() -> None:
    r, lead = 0.03, 0.02 / (2 * math.pi)
    cos, sin = r / math.hypot(r, lead), lead / math.hypot(r, lead)
    # at rest: N cos + T sin = m g, r (T cos - N sin) + 0.7 = 0
    normal, tangential = np.linalg.solve([[cos, sin], [-r * sin, r * cos]], [M * G, -0.7])
    found = by_routes(SCREW.replace("u: 1", "u: 0"), {"rub": 1}, 0)
    assert found.udot == pytest.approx([0], abs=1e-12)
    assert found.multipliers == pytest.approx([normal, tangential], rel=1e-12)


# --- journals ------------------------------------------------------------------------------------------------------

PENDULA = f"""\
multibody_sym: 1
name: double
gravity: [0, -{G}, 0]
bodies:
  a: {{mass: 2, com: [0.5, 0, 0], inertia: {{Izz: 0.2}}, points: {{e: [1, 0, 0]}}}}
  b: {{mass: 1, com: [0.3, 0.1, 0], inertia: {{Izz: 0.05}}}}
joints:
  A: {{type: revolute, parent: ground, child: a, q: alpha, initial: {{q: 0.3, u: 2}}}}
  B: {{type: revolute, parent: a.e, child: b, q: beta, initial: {{q: -1, u: -5}}}}
forces:
  rub: {{type: friction, joint: A, static: 0.2, radius: 0.1}}
  scrape: {{type: friction, joint: B, static: 0.4, radius: 0.1}}
"""


def pendula_by_hand() -> tuple[np.ndarray, np.ndarray]:
    """Return udot and the bearings' forces of both bodies cut free, friction from the forces of the pass before."""
    alpha, turned, w1, w2 = 0.3, 0.3 - 1, 2.0, 2.0 - 5
    c1 = 0.5 * np.array([math.cos(alpha), math.sin(alpha)])
    c2 = np.array([[math.cos(turned), -math.sin(turned)], [math.sin(turned), math.cos(turned)]]) @ [0.3, 0.1]
    e = 2 * c1
    turn, weight = np.array([[0, -1], [1, 0]]), np.array([0, -G])
    friction = np.zeros(2)
    for _ in range(100):
        K, right = np.zeros((6, 6)), np.zeros(6)  # unknown: accelerations of both angles in space, A, B
        K[:2, 0], K[:2, 2:4], K[:2, 4:6], right[:2] = 2 * turn @ c1, -np.eye(2), np.eye(2), 2 * (weight + w1**2 * c1)
        K[2:4, 0], K[2:4, 1], K[2:4, 4:6] = turn @ e, turn @ c2, -np.eye(2)
        right[2:4] = weight + w1**2 * e + w2**2 * c2
        K[4, 0], K[4, 2:4], K[4, 4:6] = 0.2, -np.array([c1[1], -c1[0]]), -np.array([e[1] - c1[1], c1[0] - e[0]])
        right[4] = friction[0] - friction[1]
        K[5, 1], K[5, 4:6], right[5] = 0.05, -np.array([c2[1], -c2[0]]), friction[1]
        found = np.linalg.solve(K, right)
        sizes = np.linalg.norm(found[2:4]), np.linalg.norm(found[4:6])
        friction = np.array([-0.2 * 0.1 * sizes[0], 0.4 * 0.1 * sizes[1]])  # alpha' > 0, beta' < 0
    return np.array([found[0], found[1] - found[0]]), np.array(sizes)


def test_journals_rub_with_the_lengths_of_their_own_forces() -> None:
    resolved = in_mode(mechanism(loads(PENDULA)), Mode({"rub": 1, "scrape": 1}, {"rub": 1, "scrape": -1}))
    begin = start(resolved)
    state = state_of(resolved, float, 0.0, begin.q, begin.u, begin.parameters)
    udot, sizes = pendula_by_hand()
    for name, route in FORMALISMS.items():
        if name != "lagrange":
            found = forward_dynamics(route(resolved, state))
            assert found.udot == pytest.approx(udot, rel=1e-12)
            assert np.hypot(found.multipliers[::2], found.multipliers[1::2]) == pytest.approx(sizes, rel=1e-12)
    program = programs(resolved, FORMALISMS["composite_body"]).state_derivative
    run = interpret(program, 0.0, begin.q, begin.u, begin.parameters, np.zeros(0), np.zeros(0))
    assert run[1] == pytest.approx(udot, rel=1e-12)
    assert derive(resolved).lambdify()(begin.q, begin.u) == pytest.approx(udot, rel=1e-12)


DOOR = f"""\
multibody_sym: 1
name: door
gravity: [0, 0, -{G}]
bodies: {{d: {{mass: 20, com: [0.4, 0, 0.3], inertia: {{Ixx: 2, Iyy: 3, Izz: 1}}}}}}
joints: {{H: {{type: revolute, parent: ground, child: d, axis: z, q: phi, initial: {{u: 2}}}}}}
forces: {{rub: {{type: friction, joint: H, static: 0.2, radius: 0.01, length: 1.2}}}}
"""


def test_two_hinges_of_a_door_rub_with_the_force_of_each() -> None:
    """By hand: m a_C = R1 + R2 across the axis, and about the middle of the hinges 0.6 e x (R1 - R2) = the moment."""
    resolved = in_mode(mechanism(loads(DOOR)), Mode({"rub": 1}, {"rub.pad1": 1, "rub.pad2": 1}))
    begin = start(resolved)
    state = state_of(resolved, float, 0.0, begin.q, begin.u, begin.parameters)
    found = forward_dynamics(FORMALISMS["sweep"](resolved, state))
    (alpha,), w, m, (x, z) = found.udot, 2.0, 20, (0.4, 0.3)
    force = m * np.array([-w * w * x, alpha * x])  # both hinges together, along the door and across it
    # the rates of angular momentum about the middle: J_C is diagonal, and c x m (a_C - g)
    moment = np.array([0, 0]) + np.array([-z * force[1], z * force[0] - x * m * G])
    apart = np.array([moment[1], -moment[0]]) / 1.2
    pads = force / 2 + apart, force / 2 - apart
    lengths = [float(np.linalg.norm(pad)) for pad in pads]
    assert np.hypot(found.multipliers[::2], found.multipliers[1::2]) == pytest.approx(lengths, rel=1e-12)
    # about the axis: (Izz + m x^2) alpha = - mu r (|R1| + |R2|)
    assert (1 + m * x * x) * alpha == pytest.approx(-0.2 * 0.01 * sum(lengths), rel=1e-12)


def test_what_friction_leaves_out_is_told() -> None:
    """Of the hinge: the weight at 0.4 m, and what takes the centre, 0.3 m up, round: m (g 0.4 + w^2 0.4 0.3)."""
    alone = solve(loads(DOOR.replace(", length: 1.2", ""))).notes
    assert [note.split("; ")[1].split(" are")[0].split(" there")[0] for note in alone] == [
        f"the couple of {20 * (G * 0.4 + 4 * 0.4 * 0.3):.6g} N*m",
        "196.2 N along the axis",
    ]
    assert [note for note in solve(loads(DOOR)).notes if "left out" in note] == [
        "rub rubs with the force across its axis; 196.2 N along the axis are left out"
    ]
    couple = 0.2 * PUSH[0] - 0.1 * PUSH[1]
    assert f"the couple of {couple:.6g} N*m there is left out" in solve(loads(BLOCK)).notes[0]


@pytest.mark.parametrize(
    ("joint", "friction", "match"),
    [
        ("revolute", {"force": 2, "static": 0.1}, "a constant force has no coefficients"),
        ("revolute", {"force": -2}, "friction is not negative"),
        ("planar", {"force": 2}, "a constant force acts in a hinge or a slider"),
    ],
)
def test_constant_friction_stands_alone(joint: str, friction: dict[str, object], match: str) -> None:
    text = f"""
multibody_sym: 1
name: rubs
gravity: [0, -9.81, 0]
bodies: {{b: {{mass: 1, com: [0.1, 0, 0], inertia: {{Izz: 0.1}}}}}}
joints: {{A: {{type: {joint}, parent: ground, child: b}}}}
forces: {{rub: {{type: friction, joint: A, {", ".join(f"{k}: {v}" for k, v in friction.items())}}}}}
"""
    with pytest.raises(ModelError, match=match):
        mechanism(loads(text))
