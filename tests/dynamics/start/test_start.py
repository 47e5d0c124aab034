"""Start values: parameters in any order, loops that are assembled, and what cannot be."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from itertools import pairwise

import numpy as np
import pytest
from mechanisms import random_case
from random_loops import blocks

from multibody_sym.answers.solve import solve
from multibody_sym.dynamics.closing import ConstraintRows
from multibody_sym.dynamics.formalisms.composite_body import mass_matrix
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.dynamics.start.start import Start, start
from multibody_sym.errors import InputError, ModelError, NoSolutionError
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.model_files import loads
from multibody_sym.mechanics.motion import Motion, motion_of, state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.model.bodies import Body, Element
from multibody_sym.model.constraints import Distance, Expression, PrescribedMotion, Rope, VelocityConstraint
from multibody_sym.model.joints import Free, Initial, Prismatic, Revolute, Spherical
from multibody_sym.model.system import System
from multibody_sym.scalars.elementary import leaves

ROD = {"Izz": 1}


def residuals(resolved: Mechanism, begin: Start) -> tuple[float, float]:
    state = state_of(resolved, float, 0.0, begin.q, begin.u, begin.parameters)
    rows = row_motions(motion_of(resolved, state))
    return max((abs(row.phi) for row in rows if row.holonomic), default=0), max(abs(row.phidot) for row in rows)


def four_bar(**initial: object) -> System:
    """Crank 1, coupler 2, rocker 2 and ground 2.5 long; the coupler's end is pinned to the rocker's by two rows."""
    joints = {
        "A": Revolute("ground", "crank", q="a", initial=initial.get("a")),
        "B": Revolute("crank.end", "coupler", q="b", initial=initial.get("b")),
        "D": Revolute("ground.d", "rocker", q="d", initial=initial.get("d")),
    }
    return System(
        "four_bar",
        bodies={
            "ground": Body(points={"d": [2.5, 0, 0]}),
            "crank": Body(mass=1, inertia=ROD, points={"end": [1, 0, 0]}),
            "coupler": Body(mass=1, inertia=ROD, points={"end": [2, 0, 0]}),
            "rocker": Body(mass=1, inertia=ROD, points={"end": [2, 0, 0]}),
        },
        joints=joints,
        constraints={
            "x": Expression("cos(a) + 2*cos(a + b) - 2.5 - 2*cos(d)"),
            "y": Expression("sin(a) + 2*sin(a + b) - 2*sin(d)"),
        },
    )


# --- parameters ----------------------------------------------------------------------------------------------------


def parameters(**declared: object) -> Mechanism:
    joints = {"j": Prismatic("ground", "b", axis="x")}
    return mechanism(System("p", parameters=declared, bodies={"b": Body(mass=1)}, joints=joints))


def test_parameters_may_name_those_declared_later() -> None:
    resolved = parameters(m2="k*m1", k="1.2", m1="1 kg", big="m1 + m2")
    assert parameter_values(resolved, {}) == pytest.approx([1.2, 1.2, 1.0, 2.2])
    assert parameter_values(resolved, {"k": 3}) == pytest.approx([3.0, 3.0, 1.0, 4.0])
    assert parameter_values(resolved, {"m2": 7}) == pytest.approx([7.0, 1.2, 1.0, 8.0])


def test_long_chain_of_parameters_is_no_recursion() -> None:
    count = 2_000
    declared = {f"p{k}": f"p{k + 1} + 1" for k in range(count)}
    assert parameter_values(parameters(**declared, **{f"p{count}": "0"}), {})[0] == count


@pytest.mark.parametrize(
    ("declared", "overrides", "message", "path"),
    [
        ({"a": "b", "b": "c + 1", "c": "2*a"}, {}, "in a circle: a -> b -> c -> a", ("parameters", "a")),
        ({"a": "a + 1"}, {}, "in a circle: a -> a", ("parameters", "a")),
        ({"a": "1", "b": "1/(a - 1)"}, {}, "no finite value, for 1/(a - 1) has none with a = 1", ("parameters", "b")),
        ({"a": "-1", "b": "sqrt(a) + 1"}, {}, "no finite value, for sqrt(a) has none with a = -1", ("parameters", "b")),
        ({"a": "1"}, {"a": math.nan}, "a has no finite value: nan was given", ("parameters", "a")),
        ({"a": {"value": "1", "positive": True}}, {"a": -2.0}, "a = -2, but it is declared", ("parameters", "a")),
        ({"length": "1"}, {"lenght": 2.0}, "no parameter is called 'lenght'; did you mean length?", ()),
    ],
)
def test_wrong_parameters_are_named(declared, overrides, message: str, path: tuple[str, ...]) -> None:
    with pytest.raises(ModelError) as caught:
        parameter_values(parameters(**declared), overrides)
    assert message in caught.value.message
    assert caught.value.where.path == path


def test_circle_is_cut_by_a_value() -> None:
    assert parameter_values(parameters(a="b", b="a"), {"a": 2.0}) == [2.0, 2.0]


# --- the declared state --------------------------------------------------------------------------------------------


def test_without_rows_the_declared_state_is_the_start() -> None:
    system = System(
        "free",
        parameters={"v": 3},
        bodies={"b": Body(mass=1, inertia={"Ixx": 1, "Iyy": 1, "Izz": 1})},
        joints={"j": Free("ground", "b", initial=Initial(q=[1, 2, 3, 0, 0, 0, 2], u=["v", 0, 0, 0, 0, "2*v"]))},
    )
    begin = start(mechanism(system))
    assert begin.q == pytest.approx((1, 2, 3, 0, 0, 0, 1))
    assert begin.u == pytest.approx((3, 0, 0, 0, 0, 6))
    assert (begin.held, begin.assembled, begin.shift) == ((), (), 0.0)
    assert start(mechanism(system), {"v": 5.0}).u[0] == 5.0


def test_zero_quaternion_is_an_error_with_its_joint() -> None:
    body = Body(mass=1, inertia={"Ixx": 1, "Iyy": 1, "Izz": 1})
    system = System("q", bodies={"b": body}, joints={"j": Spherical("ground", "b", initial=Initial(q=[0, 0, 0, 0]))})
    with pytest.raises(InputError, match="quaternion is zero") as caught:
        start(mechanism(system))
    assert caught.value.where.path == ("joints", "j", "initial", "q")


def test_initial_value_that_is_not_finite_is_named() -> None:
    joints = {"j": Prismatic("ground", "b", axis="x", q="x", initial=Initial(q="1/(a - 1)"))}
    system = System("q", parameters={"a": 1}, bodies={"b": Body(mass=1)}, joints=joints)
    with pytest.raises(ModelError, match="initial value of x is not finite"):
        start(mechanism(system))


def test_force_without_value_at_the_start_is_named() -> None:
    system = System(
        "q",
        bodies={"b": Body(mass=1)},
        joints={"j": Prismatic("ground", "b", axis="x", q="x")},
        forces={"gravitation": {"type": "force", "on": "b", "value": ["-1/x^2", 0, 0]}},
    )
    with pytest.raises(ModelError, match="no finite value at the start") as caught:
        start(mechanism(system))
    assert caught.value.where.path == ("forces", "gravitation")


@pytest.mark.parametrize(
    ("constraint", "why"),
    [
        (PrescribedMotion("x", "1/t"), "no finite value at the start"),
        (PrescribedMotion("x", "sqrt(t)"), "no finite value at the start"),
        (Distance(("a", "ground"), "-1 - t"), "its length is -1 m at the start, and no length is negative"),
        (Distance(("a", "a"), 1), "a and a are at the same place always"),
        (VelocityConstraint("u_a - 1/t"), "no finite value at the start"),
    ],
)
def test_row_without_value_at_the_start_is_named(constraint: Element, why: str) -> None:
    system = System(
        "valueless",
        bodies={"a": Body(mass=1), "b": Body(mass=1)},
        joints={
            "x": Prismatic("ground", "a", axis="x", q="a", initial={"q": 1}),
            "y": Prismatic("ground", "b", axis="y", q="b", initial={"q": 1}),
        },
        constraints={"innocent": Distance(("a", "b"), 2), "wrong": constraint},
    )
    with pytest.raises(ModelError, match=why) as caught:
        start(mechanism(system))
    assert caught.value.where.path[:2] == ("constraints", "wrong")


def test_rods_of_two_lengths_between_coinciding_points_have_no_direction() -> None:
    system = System(
        "coinciding",
        bodies={"a": Body(mass=1)},
        joints={"x": Free("ground", "a")},
        constraints={"r": Distance(("a", "ground"), 1), "s": Distance(("a", "ground"), 2)},
    )
    with pytest.raises(ModelError, match=r"a and ground are at the same place at the start.*initial"):
        start(mechanism(system))


# --- assembly ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("angle", np.linspace(-3, 3, 13))
def test_known_crank_is_held_and_the_loop_closed(angle: float) -> None:
    resolved = mechanism(four_bar(a=Initial(q=float(angle), u=2, known=True)))
    begin = start(resolved)
    assert begin.q[0] == angle
    assert begin.u[0] == 2.0
    assert max(residuals(resolved, begin)) < 1e-12
    assert begin.held == ("a", "u_a")
    assert begin.assembled == ("b", "d", "u_b", "u_d")


def test_no_position_is_computed_twice_on_end(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = list[Sequence[float]]()

    def noted(rows: ConstraintRows, q: np.ndarray, u: np.ndarray) -> Motion:
        asked.append(q.tolist())
        return motion(rows, q, u)

    motion = ConstraintRows.motion
    monkeypatch.setattr(ConstraintRows, "motion", noted)
    start(mechanism(four_bar(a=Initial(q=1, known=True), b=Initial(q=-0.5))))  # d is looked for all around
    twice = sum(one == other for one, other in pairwise(asked))
    assert twice < 0.05 * len(asked)  # phases of the search begin where others have ended


def test_guesses_choose_the_branch() -> None:
    up = start(mechanism(four_bar(a=Initial(q=1, known=True), b=Initial(q=-0.5), d=Initial(q=2))))
    down = start(mechanism(four_bar(a=Initial(q=1, known=True), b=Initial(q=-2), d=Initial(q=-2))))
    assert math.sin(up.q[2]) > 0 > math.sin(down.q[2])


def sarrus(**initial: Initial) -> System:
    """A table on two folding legs in planes that cross, which let it rise and sink only; its own tilt has no guess."""
    legs = {"x": ([1, 0, 0], "y"), "y": ([0, 1, 0], "x")}
    bodies = {"ground": Body(points={"x": [0.5, 0, 0], "y": [0, 0.5, 0]})}
    bodies["table"] = Body(mass=2, inertia={"Ixx": 1, "Iyy": 1, "Izz": 1}, points=bodies["ground"].points)
    joints = {}
    for name, (end, axis) in legs.items():
        bar = Body(mass=1, inertia={"Ixx": 1, "Iyy": 1, "Izz": 1}, points={"end": end})
        bodies |= {f"lower_{name}": bar, f"upper_{name}": bar}
        for joint, parent, child in (
            (f"foot_{name}", f"ground.{name}", f"lower_{name}"),
            (f"knee_{name}", f"lower_{name}.end", f"upper_{name}"),
            (f"top_{name}", f"upper_{name}.end", f"table.{name}"),
        ):
            joints[joint] = Revolute(parent, child, axis=axis, initial=initial.get(joint))
    return System("sarrus", bodies=bodies, joints=joints)


def test_joint_without_a_guess_may_be_anywhere() -> None:
    """The table is level and above the ground, though at the angle zero of its joint it would hang upside down."""
    folded = {"foot_y": Initial(q=0.7), "knee_y": Initial(q=1.6), "knee_x": Initial(q=-1.6)}
    resolved = mechanism(sarrus(foot_x=Initial(q=-0.7, known=True), **folded))
    begin = start(resolved)
    found = dict(zip([c.name for c in resolved.coordinates], begin.q, strict=True))
    wanted = {"foot_x": -0.7, "knee_x": 1.4 - math.pi, "top_x": math.pi - 0.7, "foot_y": 0.7, "knee_y": math.pi - 1.4}
    assert {name: found[name] for name in wanted} == pytest.approx(wanted, abs=1e-12)
    assert residuals(resolved, begin) == pytest.approx((0, 0), abs=1e-12)


def test_given_values_are_held_in_their_order_as_long_as_the_rest_can_close() -> None:
    resolved = mechanism(four_bar(a=Initial(q=1.0, u=1.0), b=Initial(q=-0.3)))
    begin = start(resolved)
    assert begin.q[0] == 1.0
    assert begin.q[1] != -0.3
    assert "a" in begin.held
    assert "b" in begin.assembled
    assert max(residuals(resolved, begin)) < 1e-12


def test_coordinate_that_a_row_does_not_feel_at_zero_is_found() -> None:
    """At y = 0 the rod is level: y changes its length only from there on."""
    system = System(
        "pendulum",
        bodies={"slide": Body(mass=1), "bob": Body(mass=1)},
        joints={
            "A": Prismatic("ground", "slide", axis="x", q="x", initial=Initial(q=0.6)),
            "B": Prismatic("slide", "bob", axis="y", q="y"),
        },
        constraints={"rod": Distance(["ground", "bob"], 1)},
    )
    begin = start(mechanism(system))
    assert begin.q[0] == 0.6
    assert abs(begin.q[1]) == pytest.approx(0.8, rel=1e-12)


def test_all_given_and_near_is_projected_with_least_change() -> None:
    exact = start(mechanism(four_bar(a=Initial(q=1, u=2, known=True))))
    near = [x + 1e-7 for x in exact.q]
    resolved = mechanism(four_bar(**{n: Initial(q=q, u=u) for n, q, u in zip("abd", near, exact.u, strict=True)}))
    begin = start(resolved)
    assert max(residuals(resolved, begin)) < 1e-12
    assert 0 < begin.shift < 1e-6
    assert begin.held == ()


def test_what_moves_along_by_common_mass_is_told() -> None:
    """No row names the angle, but the least change in the mass matrix's norm moves it with the cart that one does."""
    system = loads("""\
multibody_sym: 1
name: near
gravity: [0, -9.81, 0]
bodies: {cart: {mass: 3}, bob: {mass: 1, com: [0, -2, 0]}}
joints:
  X: {type: prismatic, parent: ground, child: cart, axis: x, q: x, initial: {q: 0.1000001}}
  T: {type: revolute, parent: cart, child: bob, axis: z, q: theta, initial: {q: 0.5}}
constraints: {c: {type: expression, zero: x - 0.1, acts: in_joints}}
""")
    begin = start(mechanism(system))
    assert begin.shifts.keys() == {"x", "theta"}
    assert begin.shifts["theta"] == pytest.approx(-begin.shifts["x"] * math.cos(0.5) / 2, rel=1e-5)  # M's second row
    solved = solve(system)
    assert solved.assembled["theta"].value == begin.q[1]
    assert "theta" in {leaf.data for leaf in leaves([solved.accelerations["theta"].expression], "symbol")}


def test_all_given_and_far_are_guesses_but_for_the_first() -> None:
    resolved = mechanism(four_bar(a=Initial(q=1), b=Initial(q=-0.5), d=Initial(q=2)))
    begin = start(resolved)
    assert max(residuals(resolved, begin)) < 1e-12
    assert begin.held == ("a",)
    assert set(begin.shifts) == {"b", "d"}
    assert begin.shifts["b"] == begin.q[1] + 0.5


def test_all_known_and_far_is_an_error_with_residuals_by_name() -> None:
    with pytest.raises(NoSolutionError) as caught:
        start(mechanism(four_bar(**{name: Initial(q=0, known=True) for name in "abd"})))
    assert "the start values do not satisfy the constraints: x misses by 1.5; " in caught.value.message
    assert "--project" in caught.value.message
    assert caught.value.where.path == ("constraints", "x")


def test_loop_that_cannot_close_is_an_error() -> None:
    system = System(
        "apart",
        bodies={"a": Body(mass=1, inertia=ROD, points={"end": [1, 0, 0]}), "ground": Body(points={"far": [5, 0, 0]})},
        joints={"A": Revolute("ground", "a")},
        constraints={"string": Distance(["a.end", "ground.far"], 1)},
    )
    with pytest.raises(NoSolutionError, match="string misses by 3"):
        start(mechanism(system))


def test_known_speeds_that_contradict_are_named() -> None:
    closed = start(mechanism(four_bar(a=Initial(q=1, known=True)))).q
    initial = {name: Initial(q=x, u=1, known=True) for name, x in zip("abd", closed, strict=True)}
    with pytest.raises(NoSolutionError, match="initial speeds do not satisfy the constraints: x misses by"):
        start(mechanism(four_bar(**initial)))


def test_least_change_is_that_of_gauss() -> None:
    """To first order M (q - q0) = H^T lambda: the change does no work on what the rows allow."""
    exact = start(mechanism(four_bar(a=Initial(q=1, u=2, known=True))))
    near = {name: x + 1e-5 * k for k, (name, x) in enumerate(zip("abd", exact.q, strict=True))}
    initial = {name: Initial(q=x, u=k + 1, known=True) for k, (name, x) in enumerate(near.items())}
    resolved = mechanism(four_bar(**initial))
    begin = start(resolved, project=True)
    motion = motion_of(resolved, state_of(resolved, float, 0.0, begin.q, begin.u, begin.parameters))
    allowed = np.linalg.svd([row.jacobian for row in row_motions(motion)])[2][-1]
    matrix = np.array(mass_matrix(motion), dtype=float)
    for values, given in ((begin.q, list(near.values())), (begin.u, [1, 2, 3])):
        change = np.subtract(values, given)
        assert abs(allowed @ matrix @ change) < 1e-4 * np.linalg.norm(matrix @ change)


def test_moving_constraint_moves_the_speeds() -> None:
    system = System(
        "driven",
        bodies={"b": Body(mass=1)},
        joints={"j": Prismatic("ground", "b", axis="x", q="x")},
        constraints={"drive": Expression("x - 2 - 3*t")},
    )
    begin = start(mechanism(system))
    assert begin.q == pytest.approx((2,))
    assert begin.u == pytest.approx((3,))


def test_speeds_take_the_least_kinetic_energy() -> None:
    """The heavier body takes less of what the constraint asks for: u ~ 1 / m."""
    system = System(
        "shared",
        bodies={"a": Body(mass=1), "b": Body(mass=4)},
        joints={"A": Prismatic("ground", "a", axis="x", q="x"), "B": Prismatic("ground", "b", axis="x", q="y")},
        constraints={"sum": Expression("x + y - 5*t")},
    )
    assert start(mechanism(system)).u == pytest.approx((4, 1))


def test_rope_is_measured_in_the_assembled_position() -> None:
    system = System(
        "measured",
        parameters={"h": 2},
        bodies={"a": Body(mass=1), "b": Body(mass=1), "ground": Body(points={"top": [0, "h", 0]})},
        joints={
            "A": Prismatic("ground", "a", axis="y", q="x", initial=Initial(q=0.5)),
            "B": Prismatic("ground", "b", axis="y", q="y"),
        },
        constraints={"string": Rope(["a", "ground.top", "b"]), "stop": Expression("y - 1")},
    )
    resolved = mechanism(system)
    names = [entry.name for entry in resolved.parameters]
    assert names == ["h", "length of string", "most independent rows", "Baumgarte alpha", "Baumgarte beta"]
    assert start(resolved).parameters == pytest.approx((2, 1.5 + 1, 2, 0, 0))
    assert start(resolved, {"h": 3.0}).parameters == pytest.approx((3, 2.5 + 2, 2, 0, 0))


@pytest.mark.parametrize("block", blocks(2, quick=1))
def test_random_systems_with_rows_close_or_say_why(block: int) -> None:
    closed = 0
    for seed in range(10 * block, 10 * block + 10):
        case = random_case(seed, bodies=(1, 3), rows=True)
        with suppress(NoSolutionError, ModelError):
            begin = start(case.mechanism)
            closed += 1
            assert_closed(case.mechanism, begin)
    assert closed >= 5


def assert_closed(resolved: Mechanism, begin: Start) -> None:
    assert max(residuals(resolved, begin)) < 1e-9
    for body in resolved.bodies:
        for places in body.quaternions:
            assert np.linalg.norm(np.array(begin.q)[list(places)]) == pytest.approx(1.0)


def test_a_rod_without_length_is_refused_by_name() -> None:
    bodies = {"rider": Body(), "bob": Body(mass=1)}
    joints = {
        "along": Prismatic("ground", "rider", axis="x", initial=Initial(q=math.sqrt(0.75))),
        "up": Prismatic("rider", "bob", axis="y", initial=Initial(q=-0.5000000000000001)),
    }
    declared = {"rod": Distance(["ground", "bob"], "l")}
    resolved = mechanism(System("m", parameters={"l": 0}, bodies=bodies, joints=joints, constraints=declared))
    with pytest.raises(ModelError, match=r"constraints.rod.value: a rod of no length has no direction"):
        start(resolved)
