"""From declaration to mechanism: order, names, and every error by its text and path."""

from __future__ import annotations

import copy
from typing import Any

import pytest
from mechanisms import random_case

from multibody_sym.errors import InputError
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.bodies import Body
from multibody_sym.model.joints import Fixed, Free, Initial, Planar, Prismatic, Revolute, Spherical
from multibody_sym.model.system import System, system_from_tree
from multibody_sym.scalars.elementary import leaves

BASE: dict[str, Any] = {
    "multibody_sym": "1",
    "name": "base",
    "gravity": ["0", "-g", "0"],
    "parameters": {"g": "9.81", "m": "1 kg", "l": {"value": "2 m", "positive": "true"}},
    "bodies": {
        "crank": {"mass": "m", "inertia": {"Izz": "m*l^2/12"}, "points": {"pin": ["l", "0", "0"]}},
        "rod": {"mass": "m", "inertia": {"Izz": "1"}, "points": {"end": ["l", "0", "0"]}, "frames": {"F": {}}},
        "ground": {"points": {"o": ["0", "0", "0"]}},
    },
    "joints": {
        "A": {"type": "revolute", "parent": "ground", "child": "crank", "q": "phi"},
        "B": {"type": "revolute", "parent": "crank.pin", "child": "rod", "q": "psi"},
    },
    "pulleys": {"wheel": {"at": "ground.o", "radius": "0.1"}},
    "forces": {"drive": {"type": "torque", "joint": "A", "value": "tau"}},
    "constraints": {"string": {"type": "rope", "path": ["crank.pin", "wheel", "rod.end"]}},
    "inputs": {"tau": "sin(t)"},
    "outputs": {"x": "position(rod.end, x)"},
}


def changed(*changes: tuple[str, Any]) -> dict[str, Any]:
    """Return the base model with values at dotted paths replaced (None: removed)."""
    tree = copy.deepcopy(BASE)
    for path, value in changes:
        *steps, last = path.split("/")
        part = tree
        for step in steps:
            part = part.setdefault(step, {})
        if value is None:
            del part[last]
        else:
            part[last] = value
    return tree


def resolved(*changes: tuple[str, Any]) -> Mechanism:
    return mechanism(system_from_tree(changed(*changes)))


def revolute(parent: str, child: str) -> dict[str, str]:
    return {"type": "revolute", "parent": parent, "child": child}


PUSH = {"type": "force", "on": "rod", "value": ["1", "0", "0"]}
TURN = {"type": "torque", "on": "rod", "value": ["0", "0", "1"]}
LEFT = {key: x for key, x in BASE["joints"]["A"].items() if key != "q"}
ERRORS = [
    # references
    ([("joints/A/child", "crnak")], "no body is called 'crnak'; did you mean crank?", "joints.A.child"),
    ([("joints/B/parent", "crank.pni")], "'crank' has no point or frame 'pni'; did you mean crank.pin?", "joints.B"),
    ([("joints/B/parent", "shaft.pin")], "no body is called 'shaft'", "joints.B.parent"),
    ([("forces/drive/joint", "AA")], "no joint is called 'AA'; did you mean A?", "forces.drive.joint"),
    (
        [("joints/B", {"type": "planar", "parent": "crank", "child": "rod"}), ("forces/drive/joint", "B")],
        "joint 'B' has 3 degrees of freedom; one is needed here",
        "forces.drive.joint",
    ),
    ([("forces/push", PUSH | {"on": "rood"})], "no body is called 'rood'; did you mean rod?", "forces.push.on"),
    ([("forces/push", PUSH | {"at": "top"})], "'rod' has no point or frame 'top'", "forces.push.at"),
    (
        [("forces/push", PUSH | {"at": "crank.pin"})],
        "'rod' has no point or frame 'crank.pin', which is one of crank: write on: crank, at: pin",
        "forces.push.at",
    ),
    ([("forces/push", PUSH | {"at": "rod.pni"})], "'rod' has no point or frame 'pni'", "forces.push.at"),
    ([("forces/push", PUSH | {"on": "pin"})], "no body is called 'pin'; did you mean crank.pin?", "forces.push.on"),
    ([("forces/push", PUSH | {"frame": "crnk"})], "no body is called 'crnk'; did you mean crank?", "forces.push.frame"),
    (
        [("forces/s", {"type": "spring_damper", "stiffness": "1", "between": ["rod", "crank.x"]})],
        "'crank' has no point or frame 'x'",
        "forces.s.between.1",
    ),
    ([("constraints/string/path", ["crank", "whel", "rod"])], "did you mean wheel?", "constraints.string.path.1"),
    ([("pulleys/wheel/at", "ground.p")], "'ground' has no point or frame 'p'", "pulleys.wheel.at"),
    (
        [("joints/B", revolute("ground", "rod") | {"type": "point"}), ("bodies/rod/inertia", None), ("forces/c", TURN)],
        "'rod' is a particle, which joint 'B' never turns, so a couple does nothing to it; leave it out, or give",
        "forces.c.on",
    ),
    # the tree
    ([("joints/B", None), ("constraints", None), ("outputs", None)], "nothing joins 'rod' to the rest", "bodies.rod"),
    ([("joints/B/parent", "rod.F")], "the joint joins 'rod' to itself", "joints.B.child"),
    ([("joints/A", revolute("rod", "crank"))], "hangs on a circle of joints that never reaches ground", "joints."),
    ([("joints/A", revolute("crank", "ground"))], "ground cannot be a child; swap parent and child", "joints.A.child"),
    # names
    ([("joints/A/q", "m")], "'m' cannot be a coordinate: it is a parameter", "joints.A.q"),
    ([("joints/B/q", "phi")], "'phi' cannot be a coordinate: it is one already", "joints.B.q"),
    ([("joints/B/q", "u_phi")], "'u_phi' cannot be a speed: it is a coordinate", "joints."),
    ([("parameters/t", "1")], "'t' cannot be a parameter", "parameters.t"),
    ([("parameters/pi", "3")], "'pi' cannot be a parameter: it is reserved", "parameters.pi"),
    ([("inputs/phi", "1")], "'phi' cannot be an input: it is a coordinate", "inputs.phi"),
    ([("outputs/m", "phi")], "'m' cannot be an output: it is a parameter; choose another name", "outputs.m"),
    ([("parameters/a b", "1")], "'a b' cannot stand in expressions", "parameters.a b"),
    (
        [("joints/left hinge", LEFT), ("joints/A", None), ("forces", None)],
        "'left hinge' cannot stand in expressions: use letters, digits and _, a letter first; name the joint's",
        "joints.left hinge",
    ),
    # expressions
    ([("bodies/rod/mass", "mm")], "'mm' is not declared; did you mean m?", "bodies.rod.mass"),
    ([("bodies/rod/mass", "phi")], "'phi' is a coordinate; here an expression names parameters only", "bodies.rod"),
    ([("constraints/string/length", "u_phi")], "'u_phi' is a speed; here an expression names", "constraints.string"),
    ([("inputs/tau", "other"), ("inputs/other", "1")], "'other' is an input; here", "inputs.tau"),
    ([("forces/drive/value", "position(rod, x)")], "can be asked in outputs, stop and ask only", "forces.drive.value"),
    ([("outputs/x", "position(rood, x)")], "'rood' is no point; did you mean rod?", "outputs.x"),
    ([("outputs/x", "position(rod, w)")], "'w' is no axis", "outputs.x"),
    ([("outputs/x", "reaction(A, q)")], "'q' is no component", "outputs.x"),
    ([("outputs/x", "tension(strin)")], "'strin' is no rope; did you mean string?", "outputs.x"),
    # dimensions
    ([("bodies/rod/mass", "2 m")], "expected a quantity in kg", "bodies.rod.mass"),
    ([("bodies/rod/mass", "m*l")], "in kg*m; here one in kg is wanted (l in m, m in kg)", "bodies.rod.mass"),
    ([("bodies/rod/mass", "m + l")], "a sum of m and kg: l is in m, m is in kg", "bodies.rod.mass"),
    ([("pulleys/wheel/radius", "m")], "the expression is a quantity in kg; here one in m is wanted", "pulleys.wheel"),
    ([("parameters/g", "9.81 m/s"), ("gravity", ["0", "-g", "0"])], "one in m/s^2 is wanted (g in m/s)", "gravity"),
]


@pytest.mark.parametrize("kind", [PUSH, {"type": "drag", "on": "rod", "linear": "2"}])
def test_a_point_of_the_loaded_body_may_be_named_alone_or_with_its_body(kind: dict[str, Any]) -> None:
    alone, whole = (resolved(("forces/push", kind | {"at": at})).loads[-1].at for at in ("F", "rod.F"))
    assert alone == whole


@pytest.mark.parametrize(("changes", "message", "path"), ERRORS)
def test_error(changes: list[tuple[str, Any]], message: str, path: str) -> None:
    with pytest.raises(InputError) as caught:
        resolved(*changes)
    assert message in caught.value.message
    assert ".".join(caught.value.where.path).startswith(path)
    assert caught.value.exit_code == 2


def test_base_is_right() -> None:
    found = resolved()
    assert [body.name for body in found.bodies] == ["crank", "rod"]
    assert [c.name for c in found.coordinates] == ["phi", "psi"]
    assert [s.name for s in found.speeds] == ["u_phi", "u_psi"]
    measured = ["side of string at wheel", "length of string"]
    unnamed = [*measured, "most independent rows", "Baumgarte alpha", "Baumgarte beta"]
    assert [p.name for p in found.parameters] == ["g", "m", "l", *unnamed]
    assert [entry.positive for entry in found.parameters[:3]] == [False, False, True]
    assert set(found.markers) == {"crank", "crank.pin", "rod", "rod.end", "rod.F", "ground", "ground.o"}


def test_coordinates_stand_in_tree_order_then_in_that_of_the_file() -> None:
    body = Body(mass=1, inertia={"Ixx": 1, "Iyy": 1, "Izz": 1})
    names = ["a", "b", "c", "d", "e"]
    system = System(
        "order",
        bodies=dict.fromkeys(names, body),
        joints={
            "e": Revolute("d", "e"),
            "b": Prismatic("a", "b", axis="x"),
            "d": Planar("ground", "d"),
            "a": Spherical("ground", "a"),
            "c": Free("a", "c", q=["x", "y", "z", "q0", "q1", "q2", "q3"]),
        },
    )
    found = mechanism(system)
    assert [b.joint_name for b in found.bodies] == ["d", "e", "a", "b", "c"]
    assert [b.parent for b in found.bodies] == [-1, 0, -1, 2, 2]
    expected = "d_x d_y d_theta e a_qw a_qx a_qy a_qz b x y z q0 q1 q2 q3"
    assert [c.name for c in found.coordinates] == expected.split()
    speeds = "u_d_x u_d_y u_d_theta u_e a_wx a_wy a_wz u_b u_x u_y u_z c_wx c_wy c_wz"
    assert [s.name for s in found.speeds] == speeds.split()
    assert [c.unit for c in found.coordinates][:5] == ["m", "m", "rad", "rad", ""]


def test_random_trees_have_parents_first_and_places_without_gaps() -> None:
    for seed in range(30):
        found = random_case(seed).mechanism
        assert all(body.parent < k for k, body in enumerate(found.bodies))
        assert [k for body in found.bodies for k in body.q] == list(range(len(found.coordinates)))
        assert [k for body in found.bodies for k in body.u] == list(range(len(found.speeds)))
        known = {"t": 1, "q": len(found.coordinates), "u": len(found.speeds), "parameters": len(found.parameters)}
        known["inputs"] = len(found.inputs)
        for load in found.loads:
            for value in vars(load).values():
                nodes = value if isinstance(value, tuple) else (value,)
                for leaf in leaves([n for n in nodes if hasattr(n, "op")], "symbol", "slot"):
                    assert leaf.op == "slot"
                    assert leaf.data[1] < known[leaf.data[0]]


def test_initial_values_default_to_where_the_frames_coincide() -> None:
    body = Body(mass=1, inertia={"Ixx": 1, "Iyy": 1, "Izz": 1})
    joints = {"A": Spherical("ground", "a"), "B": Fixed("a", "b")}
    found = mechanism(System("s", bodies={"a": body, "b": body}, joints=joints))
    assert [c.initial.shadow for c in found.coordinates] == [1, 0, 0, 0]
    assert not any(c.given or c.known for c in found.coordinates)
    hinge = Revolute("ground", "a", initial=Initial(q="30 deg", known=True))
    known = mechanism(System("s", bodies={"a": body}, joints={"A": hinge}))
    assert known.coordinates[0].given
    assert known.coordinates[0].known
    assert not known.speeds[0].given


def test_names_of_bodies_and_joints_may_be_any_text() -> None:
    body = Body(mass=1, inertia={"Izz": 1}, points={"rim.top": [0, 1, 0]})
    system = System(
        "names",
        bodies={"left wheel": body, "a.b": body, "a": Body(mass=1, inertia={"Izz": 1}, points={"c": [0, 0, 0]})},
        joints={
            "j 1": Revolute("ground", "left wheel", q="phi"),
            "j.2": Revolute("left wheel.rim.top", "a.b", q="psi"),
            "j-3": Revolute("a.b.rim.top", "a.c", q="chi"),
        },
    )
    found = mechanism(system)
    assert [body.name for body in found.bodies] == ["left wheel", "a.b", "a"]
    assert [body.parent for body in found.bodies] == [-1, 0, 1]


def test_joint_names_that_no_expression_can_use_need_q() -> None:
    body = {"b": Body(mass=1, inertia={"Ixx": 1, "Iyy": 1, "Izz": 1})}
    with pytest.raises(InputError, match="name the joint's coordinates with q:"):
        mechanism(System("s", bodies=body, joints={"top hinge": Spherical("ground", "b")}))
