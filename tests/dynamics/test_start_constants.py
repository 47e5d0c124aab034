"""Tangents on a plane whose body turns are ground's axes at the start, and are carried along with the body.

A second route: the same system with the table's axes along ground's at the start, whose tangents are constants of it.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from multibody_sym.analysis.check import check
from multibody_sym.answers.solve import solve
from multibody_sym.derivation.derive import derive
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.documents.derivation import derivation_data, derivation_document
from multibody_sym.documents.document import write_document
from multibody_sym.dynamics.start.number_checks import check_numbers
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.model_files import loads
from multibody_sym.mechanics.motion import state_of
from multibody_sym.model.system import System
from multibody_sym.motion.prepare.problem import structure_key
from multibody_sym.motion.simulate import simulate

AXIS = np.array([1.0, 2.0, 3.0]) / np.sqrt(14.0)
ROWS = ("contact.n", "contact.t1", "contact.t2")
NORMAL = np.array([2.0, 3.0, 6.0]) / 7.0


def turned(angle: float, v: np.ndarray) -> list[float]:
    """Return v turned about `AXIS` (Rodrigues)."""
    across = np.cross(AXIS, v)
    return [float(x) for x in v * np.cos(angle) + across * np.sin(angle) + AXIS * (AXIS @ v) * (1 - np.cos(angle))]


def table(angle: float, *, own_axes: bool, extra: str = "") -> System:
    """Return a ball on a table that turns about a skew axis, from an angle; its axes its own, or ground's at the start.

    The plane passes through the axis, the ball's centre stands over a point of it; both spin at the start.
    """
    normal = turned(angle, NORMAL)
    place = [0.1 * x + 0.3 * y for x, y in zip(normal, np.cross(normal, [0.0, 0.0, 1.0]), strict=True)]
    declared = [float(x) for x in NORMAL] if own_axes else normal
    return loads(f"""\
multibody_sym: 1
name: table
gravity: [0, 0, -9.81]
bodies:
  table: {{mass: 3, inertia: {{Ixx: 2, Iyy: 2, Izz: 2}}, surfaces: {{top: {{plane: [0, 0, 0], normal: {declared}}}}}}}
  ball: {{shape: {{sphere: 0.1, mass: 2}}, surfaces: {{skin: {{sphere: 0.1}}}}}}
joints:
  hinge: {{type: revolute, parent: ground, child: table, axis: [1, 2, 3], q: phi,
    initial: {{q: {angle if own_axes else 0}, u: 0.8, known: true}}}}
  ride: {{type: free, parent: ground, child: ball, initial: {{q: [{place[0]}, {place[1]}, {place[2]}, 1, 0, 0, 0]}}}}
constraints: {{contact: {{type: rolling, body: ball.skin, on: table.top}}}}
simulation: {{t_end: 0.6, rtol: 1e-10, atol: 1e-10, samples: 7{extra}}}
""")


def forces(system: System) -> list[float]:
    found = solve(system).reactions
    return [found[row]["tension"].value or 0.0 for row in ROWS]


@pytest.mark.parametrize("angle", [0.7, -2.0, np.pi])
def test_components_are_those_of_the_table_whose_axes_are_grounds(angle: float) -> None:
    expected = forces(table(angle, own_axes=False))
    np.testing.assert_allclose(forces(table(angle, own_axes=True)), expected, rtol=1e-11)
    assert min(map(abs, expected)) > 0.1


def test_tangents_are_carried_along_and_recalled_programs_hold_no_start() -> None:
    models = [table(angle, own_axes=True) for angle in (0.7, -0.4)]
    keys = {structure_key(check_numbers(model), "block_ldl") for model in models}
    assert len(keys) == 1
    for angle, model in zip((0.7, -0.4), models, strict=True):
        run, other = simulate(model), simulate(table(angle, own_axes=False))
        for name in ROWS:
            np.testing.assert_allclose(run.multipliers[name], other.multipliers[name], rtol=1e-7, atol=1e-7)


def test_absolute_coordinates_have_the_same_tangents() -> None:
    free = simulate(table(0.7, own_axes=True, extra=", coordinates: absolute"))
    other = simulate(table(0.7, own_axes=False))
    for name in ROWS:
        np.testing.assert_allclose(free.multipliers[name], other.multipliers[name], rtol=1e-6, atol=1e-6)


def test_every_route_takes_the_same_tangents() -> None:
    assert check(table(0.7, own_axes=True)).agrees


LEVEL = """\
multibody_sym: 1
name: level
gravity: [0, -9.81, 0]
parameters: {{a: {a}}}
bodies:
  table: {{mass: 3, inertia: {{Ixx: 2, Iyy: 2, Izz: 2}}, surfaces: {{top: {{plane: [0, 0, 0], normal: {normal}}}}}}}
  ball: {{shape: {{sphere: 0.1, mass: 2}}, surfaces: {{skin: {{sphere: 0.1}}}}}}
joints:
  hinge: {{type: revolute, parent: ground, child: table, axis: {axis}, q: phi, initial: {{q: {turn}, known: true}}}}
  ride: {{type: free, parent: ground, child: ball, initial: {{q: {place}}}}}
constraints: {{contact: {{type: rolling, body: ball.skin, on: table.top}}}}
forces: {{push: {{type: force, on: ball, at: origin, value: [3, 1, 7]}}}}
"""


ON_LEVEL = {"axis": "y", "place": "[0.2, 0.1, 0.3, 1, 0, 0, 0]"}


@cache
def forces_on_level_ground(turn: float) -> list[float]:
    return forces(loads(LEVEL.format(a=0, normal="y", turn=turn, **ON_LEVEL)))


@pytest.mark.parametrize("turn", [0.0, 0.6])
@pytest.mark.parametrize("a", [-1e-9, 0.0, 1e-9])
def test_forces_vary_continuously_with_the_normal_however_it_is_written(a: float, turn: float) -> None:
    level = {**ON_LEVEL, "turn": turn}
    expected = forces_on_level_ground(turn)
    found = forces(loads(LEVEL.format(a=a, normal="[-sin(a), cos(a), 0]", **level)))
    np.testing.assert_allclose(found, expected, rtol=1e-7)
    free = forces_on_level_ground(0.0)
    np.testing.assert_allclose(found, free, rtol=1e-7)  # t1 is ground's x, wherever the table has turned to


def test_where_x_is_normal_to_the_plane_t1_is_y() -> None:
    """A wall with the normal z, turned so that ground's x stands on it: free in its plane, it takes 2/7 of the push."""
    wall = {"axis": "y", "place": "[0.1, 0.2, 0.3, 1, 0, 0, 0]"}
    text = LEVEL.format(a=0, normal="z", turn="pi/2", **wall)
    for old, new in (
        ("gravity: [0, -9.81, 0]", "gravity: [0, 0, 0]"),
        ("mass: 3, inertia: {Ixx: 2, Iyy: 2, Izz: 2}", "mass: 1e9, inertia: {Ixx: 1e9, Iyy: 1e9, Izz: 1e9}"),
    ):
        assert old in text
        text = text.replace(old, new)
    n, t1, t2 = forces(loads(text))
    np.testing.assert_allclose([n, t1, t2], [-3.0, -2 / 7 * 1, -2 / 7 * 7], rtol=1e-6)


def test_derive_tells_the_constants_of_the_start_and_their_values() -> None:
    system = table(0.7, own_axes=True)
    equations = derive(system, "composite_body")
    resolved = check_numbers(system)
    begin = start(resolved)
    (value,) = equations.constants.values()
    assert value == begin.parameters[0] != 0.0
    assert f"angle_of_contact_t1 = {value:.10g} rad" in write_document(derivation_document(equations), "text")
    assert derivation_data(equations)["constants"] == {"angle_of_contact_t1": value}
    H = equations.lambdify("terms")(begin.q, begin.u)[2]
    state = state_of(resolved, float, 0.0, begin.q, begin.u, begin.parameters)
    dynamics = FORMALISMS["composite_body"](resolved, state)
    np.testing.assert_allclose(H, [row.jacobian for row in dynamics.rows], atol=1e-12)


def test_derive_has_no_angle_where_nothing_is_turned_at_the_start() -> None:
    straight = LEVEL.format(a=0, normal="y", axis="y", turn=0, place="[0.2, 0.1, 0.3, 1, 0, 0, 0]")
    assert "angle_of" not in write_document(derivation_document(derive(loads(straight))), "text")
    by_parameter = straight.replace("initial: {q: 0,", "initial: {q: a,")
    assert "angle_of_contact_t1 = 0 rad" in write_document(derivation_document(derive(loads(by_parameter))), "text")


def test_a_measured_rope_is_told_with_its_length() -> None:
    rope = loads("""\
multibody_sym: 1
name: atwood
bodies: {ground: {points: {top: [0, 1, 0]}}, a: {mass: 1}, b: {mass: 2}}
pulleys: {P: {at: ground.top}}
joints:
  A: {type: prismatic, parent: ground, child: a, axis: y, q: ya, initial: {q: -1}}
  B: {type: prismatic, parent: ground, child: b, axis: y, q: yb, initial: {q: -0.5}}
constraints: {string: {type: rope, path: [a, P, b]}}
""")
    assert "length_of_string = 3.5 m" in write_document(derivation_document(derive(rope)), "text")
