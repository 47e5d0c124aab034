"""Friction that is made smooth where that is asked for: it creeps as fast as it must, and never sticks."""

from __future__ import annotations

import math

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.start.state import examined_state
from multibody_sym.mechanics.motion import state_of

G, MU, E, A = 9.81, 0.5, 0.01, 0.3
CREEP = E * (math.tan(A) / MU) / math.sqrt(1 - (math.tan(A) / MU) ** 2)
INCLINE = f"""\
multibody_sym: 1
name: incline
gravity: [{G}*sin({A}), -{G}*cos({A}), 0]
bodies: {{b: {{mass: 2}}, ground: {{surfaces: {{floor: {{plane: [0, 0, 0], normal: y}}}}}}}}
joints: {{J: {{type: point, parent: ground, child: b, initial: {{u: [SPEED, 0]}}}}}}
contacts: {{c: {{between: [b, ground.floor], static: {MU}}}}}
simulation: {{friction: {{regularised: {E}}}}}
"""
GUIDE = f"""\
multibody_sym: 1
name: guide
gravity: [{G}*sin({A}), -{G}*cos({A}), 0]
bodies: {{b: {{mass: 2}}}}
joints: {{J: {{type: prismatic, parent: ground, child: b, axis: x, q: x, initial: {{u: SPEED}}}}}}
forces: {{rub: {{type: friction, joint: J, static: {MU}, regularised: {E}}}}}
"""
SPACE = INCLINE.replace("type: point,", "type: point, axes: xyz,").replace("[SPEED, 0]", "[SPEED, 0, SPEED]")


def udot_of(text: str, speed: float) -> np.ndarray:
    found = examined_state(mbs.loads(text.replace("SPEED", repr(speed))))
    state = state_of(found.mechanism, float, 0.0, found.start.q, found.start.u, found.start.parameters)
    return forward_dynamics(composite_body(found.mechanism, state)).udot


@pytest.mark.parametrize("text", [INCLINE, GUIDE])
def test_friction_grows_with_the_speed_up_to_coulomb_s(text: str) -> None:
    for speed in (0.0, 0.003, -0.02, 1.0):
        friction = MU * G * math.cos(A) * speed / math.hypot(speed, E)
        assert udot_of(text, speed)[0] == pytest.approx(G * math.sin(A) - friction, rel=1e-12)


def test_in_space_it_is_against_the_velocity() -> None:
    for speed in (0.004, 1.0):
        friction = MU * G * math.cos(A) * speed / math.sqrt(2 * speed**2 + E**2)
        assert udot_of(SPACE, speed) == pytest.approx([G * math.sin(A) - friction, 0, -friction], rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("text", [INCLINE, GUIDE])
def test_what_would_stick_creeps(text: str) -> None:
    run = mbs.simulate(mbs.loads(text.replace("SPEED", "0")), t_end=0.1, samples=3)
    assert next(iter(run.speeds.values()))[-1] == pytest.approx(CREEP, rel=1e-6)


def test_no_mode_changes_where_friction_is_smooth() -> None:
    """Thrown up a slope it comes back without an event: its friction turns round by itself."""
    run = mbs.simulate(mbs.loads(INCLINE.replace("SPEED", "-0.5")), t_end=0.3, samples=31)
    assert not run.events
    assert min(run["J_x"]) < run["J_x"][-1]


@pytest.mark.parametrize("everywhere", [True, False])
@pytest.mark.parametrize("joint", ["revolute, axis: z", "spherical", "universal"])
def test_what_turns_at_a_radius_is_smooth_by_the_speed_there(joint: str, everywhere: bool) -> None:
    """J omega' = -mu r m g omega r / sqrt((omega r)^2 + e^2), with e in m/s at r = 0.02 m."""
    turns = {"spherical": "u: [0, 0, 0.3]", "universal": "u: [0.3, 0]"}.get(joint, "u: 0.3")
    whole = f"simulation: {{friction: {{regularised: {E}}}}}" if everywhere else ""
    own = "" if everywhere else f", regularised: {E}"
    system = mbs.loads(f"""\
multibody_sym: 1
name: spinning
gravity: {"[0, -9.81, 0]" if "revolute" in joint else "[0, 0, -9.81]"}
bodies: {{b: {{mass: 2, inertia: {{Ixx: 0.1, Iyy: 0.1, Izz: 0.1}}}}}}
joints: {{J: {{type: {joint}, parent: ground, child: b, initial: {{{turns}}}}}}}
forces: {{rub: {{type: friction, joint: J, static: 0.5, radius: 0.02{own}}}}}
{whole}
""")
    found = examined_state(system)
    state = state_of(found.mechanism, float, 0.0, found.start.q, found.start.u, found.start.parameters)
    speed = 0.3 * 0.02
    wanted = 0.5 * 0.02 * 2 * G * speed / math.hypot(speed, E) / 0.1
    size = np.linalg.norm(forward_dynamics(composite_body(found.mechanism, state)).udot)
    assert size == pytest.approx(wanted, rel=1e-12)
