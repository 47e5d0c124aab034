"""What systems with known answers conserve: exactly that, and nothing else."""

from __future__ import annotations

from dataclasses import replace

import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.conserved import Conserved, find_conserved
from multibody_sym.dynamics.start.number_checks import check_numbers
from multibody_sym.dynamics.start.state import state_at
from multibody_sym.model.bodies import Body
from multibody_sym.model.constraints import Distance, Expression, PrescribedMotion, Rolling
from multibody_sym.model.forces import Damper, Drag, Force, Pull, SpringDamper, Torque
from multibody_sym.model.joints import Free, Initial, Planar, PointJoint, Prismatic, Revolute, Spherical
from multibody_sym.model.system import System

E, H = "total_energy()", "jacobi_integral()"
DOWN, DOWN_Y = [0, 0, -9.81], [0, -9.81, 0]


def P(axes: str) -> list[str]:
    return [f"momentum({axis})" for axis in axes]


def L(axes: str) -> list[str]:
    return [f"angular_momentum({axis})" for axis in axes]


def LC(axes: str) -> list[str]:
    return [f"angular_momentum(system, com, {axis})" for axis in axes]


def G(*freedoms: str) -> list[str]:
    return [f"generalized_momentum({freedom})" for freedom in freedoms]


PARTICLE = {"b": Body(mass=2)}
BODY = {"b": Body(mass=2, inertia={"Ixx": 2, "Iyy": 3, "Izz": 4})}
SYMMETRIC = {"b": Body(mass=2, inertia={"Ixx": 2, "Iyy": 2, "Izz": 3})}
BALL = {"b": Body(mass=2, inertia={"Ixx": 2, "Iyy": 2, "Izz": 2})}
FREE = {"j": Free("ground", "b")}
IN_PLANE = {"j": PointJoint("ground", "b", axes="xy", q=["x", "y"], initial=Initial(q=[1, 0.2], u=[0.3, 1]))}
IN_SPACE = {"j": PointJoint("ground", "b", axes="xyz", q=["x", "y", "z"], initial=Initial(q=[1, 0.2, 0.5]))}
BALL_JOINT = {"j": Spherical("ground", "b")}
KEPLER = {"sun": Pull(between=["ground", "b"], value="5/distance^2")}
ROD = Body(mass=1, com=[0, -0.5, 0], inertia={"Izz": 0.1}, points={"end": [0, -1, 0]})


def top(**inertia: float) -> dict[str, Body]:
    return {"b": Body(mass=2, com=[0, 0, 0.4], inertia=inertia)}


def rods(count: int) -> dict[str, Body]:
    return {f"r{k}": ROD for k in range(count)}


def chain(first: object, count: int) -> dict[str, object]:
    return {"j0": first, **{f"j{k}": Revolute(f"r{k - 1}.end", f"r{k}", q=f"a{k}") for k in range(1, count)}}


def on_turntable(**table: object) -> dict[str, object]:
    """A pendulum whose hinge is fixed on a table that turns about the vertical."""
    return {
        "gravity": DOWN,
        "bodies": {
            "table": Body(mass=3, inertia={"Izz": 1}, points={"edge": [0.7, 0, 0]}),
            "bob": Body(mass=1, com=[0, 0, -0.5], inertia={"Ixx": 0.1, "Iyy": 0.1, "Izz": 0.02}),
        },
        "joints": {
            "axle": Revolute("ground", "table", axis="z", **table),
            "hinge": Revolute("table.edge", "bob", axis="y", q="theta", initial={"q": 0.4}),
        },
    }


def gimbal() -> dict[str, object]:
    """A heavy symmetric top by Euler's angles."""
    return {
        "gravity": DOWN,
        "bodies": {"a": Body(), "c": Body(), **top(Ixx=2, Iyy=2, Izz=3)},
        "joints": {
            "1": Revolute("ground", "a", axis="z", q="phi"),
            "2": Revolute("a", "c", axis="x", q="theta", initial={"q": 0.7}),
            "3": Revolute("c", "b", axis="z", q="psi"),
        },
    }


TWO = {"a": PARTICLE["b"], "b": Body(mass=3)}
TWO_FREE = {
    "1": PointJoint("ground", "a", axes="xy", q=["x1", "y1"], initial=Initial(q=[0, 1])),
    "2": PointJoint("ground", "b", axes="xy", q=["x2", "y2"], initial=Initial(q=[1, 0.2])),
}
BETWEEN = SpringDamper(stiffness=3, length=0.5, between=["a", "b"])
SLEIGH = {"s": Body(mass=1, com=[0.2, 0, 0], inertia={"Izz": 0.1})}
ON_TABLE = {"j": Planar("ground", "s", q=["x", "y", "theta"], initial=Initial(u=[1, 0, 0.1]))}
EDGE = {"edge": mbs.VelocityConstraint("-u_x*sin(theta) + u_y*cos(theta)", acts="in_joints")}
ROLLING = {
    "bodies": {
        "b": Body(mass=2, inertia={"Ixx": 2, "Iyy": 2, "Izz": 2}, surfaces={"skin": mbs.Surface(sphere=0.5)}),
        "ground": Body(surfaces={"floor": mbs.Surface(plane=[0, 0, 0], normal="z")}),
    },
    "joints": {"j": Free("ground", "b", initial=Initial(q=[0, 0, 0.5, 1, 0, 0, 0]))},
    "constraints": {"roll": Rolling(body="b.skin", on="ground.floor")},
}
CART = {"cart": Body(mass=3), "r0": ROD}
CART_JOINTS = {"A": Prismatic("ground", "cart", axis="x", q="x"), "B": Revolute("cart", "r0", q="theta")}

SYSTEMS: dict[str, tuple[dict[str, object], list[str]]] = {
    "central force in the plane": (
        {"bodies": PARTICLE, "joints": IN_PLANE, "forces": {"s": SpringDamper(stiffness=3, between=["ground", "b"])}},
        [E, *L("z")],
    ),
    "Kepler in space": ({"bodies": PARTICLE, "joints": IN_SPACE, "forces": KEPLER}, [E, *L("xyz")]),
    "Kepler with drag": (
        {"bodies": PARTICLE, "joints": IN_SPACE, "forces": {**KEPLER, "air": Drag(on="b", linear=0.1)}}, [],
    ),
    "two centres": (
        {
            "bodies": {**PARTICLE, "ground": Body(points={"other": [3, 0, 0]})},
            "joints": IN_SPACE,
            "forces": {**KEPLER, "2": Pull(between=["ground.other", "b"], value="2/distance^2")},
        },
        [E, *L("x")],
    ),
    "a pull whose potential has no formula": (
        {
            "bodies": PARTICLE,
            "joints": IN_SPACE,
            "forces": {"sun": Pull(between=["ground", "b"], value="sin(distance)/distance")},
        },
        [f"{E} - work(sun)", *L("xyz")],
    ),
    "centre elsewhere": (
        {
            "bodies": {**PARTICLE, "ground": Body(points={"c": [1.5, 0.5, 0]})},
            "joints": IN_PLANE,
            "forces": {"s": SpringDamper(stiffness=3, between=["ground.c", "b"])},
        },
        [E, "angular_momentum(z) + 0.5*momentum(x) - 1.5*momentum(y)"],
    ),
    "free particle": ({"bodies": PARTICLE, "joints": IN_SPACE}, [E, *P("xyz"), *L("xyz")]),
    "particle with drag": ({"bodies": PARTICLE, "joints": IN_SPACE, "forces": {"d": Drag(on="b", linear=1)}}, []),
    "projectile": ({"gravity": DOWN, "bodies": PARTICLE, "joints": IN_SPACE}, [E, *P("xy"), *L("z")]),
    "on a slope": (
        {"gravity": [3, -4, 0], "bodies": PARTICLE, "joints": IN_PLANE}, [E, "momentum(y) + 1.33333333333*momentum(x)"],
    ),
    "free body": ({"bodies": BODY, "joints": FREE}, [E, *P("xyz"), *L("xyz")]),
    "free symmetric body": ({"bodies": SYMMETRIC, "joints": FREE}, [E, *P("xyz"), *L("xyz"), *G("j_wz")]),
    "free ball": ({"bodies": BALL, "joints": FREE}, [E, *P("xyz"), *L("xyz"), *G("j_wx", "j_wy", "j_wz")]),
    "falling body": (
        {"gravity": DOWN, "bodies": BODY, "joints": FREE}, [E, *P("xy"), *L("z"), *LC("xy")],
    ),
    "Euler's top": ({"gravity": DOWN, "bodies": BODY, "joints": BALL_JOINT}, [E, *L("xyz")]),
    "Lagrange's top": (
        {"gravity": DOWN, "bodies": top(Ixx=2, Iyy=2, Izz=3), "joints": BALL_JOINT}, [E, *L("z"), *G("j_wz")],
    ),
    "nearly Lagrange's top": (
        {"gravity": DOWN, "bodies": top(Ixx=2, Iyy=2.0000000001, Izz=3), "joints": BALL_JOINT}, [E, *L("z")],
    ),
    "heavy top without symmetry": (
        {"gravity": DOWN, "bodies": top(Ixx=2, Iyy=2.5, Izz=3), "joints": BALL_JOINT}, [E, *L("z")],
    ),
    "top by Euler's angles": (gimbal(), [E, *L("z"), *G("psi")]),
    "double pendulum": ({"gravity": DOWN_Y, "bodies": rods(2), "joints": chain(Revolute("ground", "r0"), 2)}, [E]),
    "double pendulum on a table": ({"bodies": rods(2), "joints": chain(Revolute("ground", "r0"), 2)}, [E, *L("z")]),
    "free chain": ({"bodies": rods(3), "joints": chain(Planar("ground", "r0"), 3)}, [E, *P("xy"), *L("z")]),
    "falling chain": (
        {"gravity": DOWN_Y, "bodies": rods(3), "joints": chain(Planar("ground", "r0"), 3)}, [E, *P("x"), *LC("z")],
    ),
    "cart and pendulum": ({"gravity": DOWN_Y, "bodies": CART, "joints": CART_JOINTS}, [E, *P("x")]),
    "driven cart": (
        {"gravity": DOWN_Y, "bodies": CART, "joints": CART_JOINTS, "forces": {"f": Force("cart", ["cos(t)", 0, 0])}},
        [],
    ),
    "cart with a weak push": (
        {
            "gravity": DOWN_Y, "bodies": CART, "joints": CART_JOINTS,
            "forces": {"f": Force("cart", ["1e-11*cos(t)", 0, 0])},
        },
        [],
    ),
    "free turntable": (on_turntable(), [E, *L("z")]),
    "turntable turned steadily": (on_turntable(motion="2*t"), [H]),
    "turntable held to a steady turn": (
        {**on_turntable(), "constraints": {"drive": PrescribedMotion(joint="axle", value="2*t")}},
        ["total_energy() - 2*angular_momentum(z)"],
    ),
    "turntable turned unsteadily": (on_turntable(motion="sin(t)"), []),
    "shaken pivot": (
        {
            "gravity": DOWN_Y, "bodies": CART,
            "joints": {"A": Prismatic("ground", "cart", axis="y", motion="sin(3*t)"), "B": CART_JOINTS["B"]},
        },
        [],
    ),
    "pivot in uniform motion": (
        {
            "gravity": DOWN_Y, "bodies": CART,
            "joints": {"A": Prismatic("ground", "cart", axis="x", motion="3*t"), "B": CART_JOINTS["B"]},
        },
        [H],
    ),
    "damped pendulum": (
        {
            "gravity": DOWN_Y, "bodies": rods(1), "joints": {"j0": Revolute("ground", "r0")},
            "forces": {"d": Damper(joint="j0", damping=0.1)},
        },
        [],
    ),
    "uniform field": (
        {"bodies": PARTICLE, "joints": IN_PLANE, "forces": {"f": Force("b", [0, -3, 0])}}, [f"{E} - work(f)", *P("x")],
    ),
    "pendulum with a motor": (
        {
            "gravity": DOWN_Y, "bodies": rods(1), "joints": {"j0": Revolute("ground", "r0")},
            "forces": {"m": Torque(joint="j0", value=1)},
        },
        [],
    ),
    "two by a spring": (
        {"bodies": TWO, "joints": TWO_FREE, "forces": {"s": BETWEEN}}, [E, *P("xy"), *L("z")],
    ),
    "two by a damped spring": (
        {"bodies": TWO, "joints": TWO_FREE, "forces": {"s": replace(BETWEEN, damping=1)}}, [*P("xy"), *L("z")],
    ),
    "two by a rod": (
        {"bodies": TWO, "joints": TWO_FREE, "constraints": {"rod": Distance(["a", "b"], "1.3")}},
        [E, *P("xy"), *L("z")],
    ),
    "two by a rod that grows": (
        {"bodies": TWO, "joints": TWO_FREE, "constraints": {"rod": Distance(["a", "b"], "1.3 + t/5")}},
        [*P("xy"), *L("z")],
    ),
    "Chaplygin's sleigh": ({"bodies": SLEIGH, "joints": ON_TABLE, "constraints": EDGE}, [E]),
    "ball that rolls": (
        {"gravity": DOWN, **ROLLING}, [E, *P("xy"), *L("z"), *G("j_wx", "j_wy", "j_wz")],
    ),
    "bead driven by an expression": (
        {"bodies": PARTICLE, "joints": IN_PLANE, "constraints": {"d": Expression("x - sin(t)")}}, [*P("y")],
    ),
}


def of(declared: dict[str, object]) -> list[Conserved]:
    system = System("s", **declared)
    state = state_at(check_numbers(system), project=system.simulation.project)
    return find_conserved(state.mechanism, state.start)


@pytest.mark.parametrize("name", SYSTEMS)
def test_exactly_what_is_known(name: str) -> None:
    declared, known = SYSTEMS[name]
    found = of(declared)
    assert [each.name for each in found] == known
    assert all(each.exact and each.symmetry for each in found)


def test_what_friction_holds_against_a_push_has_no_symmetry() -> None:
    """Two boxes, which cannot move: none of their momenta is told as one that no force changes; a free slider's is."""
    model = mbs.loads("""
multibody_sym: 1
name: held
gravity: [0, -9.81, 0]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  low: {shape: {box: [0.5, 0.3, 0.5], mass: 8}}
  up: {shape: {box: [0.3, 0.6, 0.3], mass: 4}}
  free: {mass: 1}
joints:
  a: {type: planar, parent: ground, child: low, q: [x1, y1, p1], initial: {q: [0, 0.15, 0]}}
  b: {type: planar, parent: ground, child: up, q: [x2, y2, p2], initial: {q: [0, 0.6, 0]}}
  c: {type: prismatic, parent: ground, child: free, axis: z, q: z}
contacts: {c1: {between: [low, ground.floor], static: 0.35}, c2: {between: [up, low], static: 0.5}}
forces: {push: {type: force, on: up, value: [5, 0, 0]}}
""")
    found = [each.name for each in mbs.conserved_quantities(model)]
    assert {E, *P("z")} <= {*found}
    assert not {*P("xy"), *L("z"), *G("x1", "y1", "p1", "x2", "y2", "p2")} & {*found}
