"""Systems: equality, declared symbols, round trips, chains, and names that change nothing."""

from __future__ import annotations

import copy
import re
from typing import Any

import numpy as np
import pytest
from mechanisms import random_case, random_state

from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.errors import ModelError
from multibody_sym.mechanics.motion import state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.bodies import Body
from multibody_sym.model.joints import Initial, Revolute
from multibody_sym.model.system import System, expressions, parameters, system_from_tree, tree_from_system, variable
from multibody_sym.scalars.elementary import leaves


def pendulum() -> System:
    m, l, g = parameters("m l g", [1, 0.5, 9.81], positive=True)
    return System(
        "pendulum",
        gravity=[0, -g, 0],
        bodies={"bob": Body(mass=m, com=[0, -l, 0])},
        joints={"hinge": Revolute("ground", "bob", axis="z", q="theta", initial={"q": 0.5})},
    )


PENDULUM = {
    "multibody_sym": "1",
    "name": "pendulum",
    "gravity": ["0", "-g", "0"],
    "parameters": {name: {"value": x, "positive": "true"} for name, x in (("g", "9.81"), ("m", "1"), ("l", "0.5"))},
    "bodies": {"bob": {"mass": "m", "com": ["0", "-l", "0"]}},
    "joints": {
        "hinge": {"type": "revolute", "parent": "ground", "child": "bob", "q": "theta", "initial": {"q": "0.5"}},
    },
}


def test_file_and_python_twin_are_equal() -> None:
    assert system_from_tree(PENDULUM) == pendulum()
    assert pendulum() == pendulum()


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("bodies", "bob", "mass"), "2*m"),
        (("name",), "other"),
        (("joints", "hinge", "initial", "known"), "true"),
        (("parameters", "m"), {"value": "2", "positive": "true"}),
        (("gravity",), ["0", "g", "0"]),
    ],
)
def test_any_change_makes_systems_differ(path: tuple[str, ...], value: Any) -> None:
    tree = copy.deepcopy(PENDULUM)
    part: Any = tree
    for step in path[:-1]:
        part = part[step]
    part[path[-1]] = value
    assert system_from_tree(tree) != pendulum()


def test_order_of_names_counts_because_it_orders_the_coordinates() -> None:
    body, joints = Body(mass=1, inertia={"Izz": 1}), {"a": Revolute("ground", "x"), "b": Revolute("ground", "y")}
    first = System("s", bodies={"x": body, "y": body}, joints=joints)
    second = System("s", bodies={"x": body, "y": body}, joints=dict(reversed(joints.items())))
    assert first != second


def test_symbols_bring_their_declarations_along() -> None:
    (m,) = parameters("m", ["2 kg"])
    (k,) = parameters("k", [3 * m])
    system = System("s", bodies={"b": Body(mass=k, inertia={"Izz": 1})}, joints={"j": Revolute("ground", "b")})
    assert dict(system.parameters) == dict(System("t", parameters={"k": "3*m", "m": "2 kg"}).parameters)
    assert not [leaf for _, node, _ in expressions(system) for leaf in leaves([node], "declared")]
    assert variable("m") in leaves([system.parameters["k"].value], "symbol")


def test_symbol_declared_twice_must_mean_the_same() -> None:
    (one,), (two,) = parameters("m", [1]), parameters("m", [2])
    with pytest.raises(ModelError, match="m is declared twice, with different values") as caught:
        System("s", bodies={"a": Body(mass=one), "b": Body(mass=two)})
    assert caught.value.where.path == ("parameters", "m")
    System("s", bodies={"a": Body(mass=one), "b": Body(mass=parameters("m", [1])[0])})


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("a b", [1]), "2 names, 1 values and 2 units do not match"),
        (("a-b", [1]), "'a-b' cannot stand in expressions"),
        (("t", [1]), "'t' is reserved"),
        (("a", ["2 zz"]), "zz"),
    ],
)
def test_wrong_parameters_in_python(arguments: Any, message: str) -> None:
    with pytest.raises(Exception, match=re.escape(message)):
        parameters(*arguments)


def test_units_of_parameters() -> None:
    m, l = parameters("m l", [500, 2], units="g m")
    system = System("s", bodies={"b": Body(mass=m, com=[l, 0, 0], inertia={"Izz": m * l**2})})
    assert system.parameters["m"].value.shadow == 0.5
    assert str(system.parameters["m"].dimension) == "kg"


@pytest.mark.parametrize("rows", [False, True])
@pytest.mark.parametrize("seed", range(25))
def test_written_and_read_again_a_system_is_the_same(seed: int, rows: bool) -> None:
    system = random_case(seed, rows=rows).system
    tree = tree_from_system(system)
    assert system_from_tree(tree) == system
    assert tree_from_system(system_from_tree(tree)) == tree


@pytest.mark.parametrize("rows", [False, True])
@pytest.mark.parametrize("seed", range(10))
def test_new_names_for_everything_change_no_number(seed: int, rows: bool) -> None:
    case = random_case(seed, bodies=(1, 6), rows=rows)
    renamed = mechanism(system_from_tree(other_names(tree_from_system(case.system), case)))
    t, q, u = random_state(np.random.default_rng(seed), case)
    found = forward_dynamics(composite_body(case.mechanism, case.state(t, q, u)))
    same = forward_dynamics(composite_body(renamed, state_of(renamed, float, t, q, u, case.parameters)))
    assert found.udot.tolist() == same.udot.tolist()
    assert found.multipliers.tolist() == same.multipliers.tolist()


def other_names(tree: Any, case: Any) -> Any:
    """Return the tree with every name of the system spelled otherwise, wherever a text mentions it."""
    resolved = case.mechanism
    system = case.system
    names = {*system.bodies, *system.joints, *system.parameters, *system.inputs, *system.pulleys} - {"ground"}
    table = {name: f"zz_{name[::-1]}_q" for name in names}
    for named in (*resolved.coordinates, *resolved.speeds):  # default names follow from the joint's
        prefix = "u_" if named.name.startswith("u_") else ""
        table[named.name] = prefix + table[named.joint] + named.name.removeprefix(prefix).removeprefix(named.joint)
    pattern = re.compile(r"[A-Za-z_][A-Za-z_0-9]*")

    def spelled(text: str) -> str:
        return pattern.sub(lambda match: table.get(match.group(), match.group()), text)

    def rename(part: Any) -> Any:
        if isinstance(part, dict):
            return {spelled(key): rename(x) for key, x in part.items()}
        return [rename(x) for x in part] if isinstance(part, list) else spelled(part)

    return rename(tree)


# --- chains --------------------------------------------------------------------------------------------------------


def chain(**changes: Any) -> dict[str, Any]:
    repeat = {
        "count": "3",
        "body": {"mass": "1", "com": ["0", "-1", "0"], "points": {"end": ["0", "-2", "0"]}},
        "joint": {"type": "revolute", "parent": "end"},
    }
    return {"multibody_sym": "1", "name": "chain", "repeat": repeat | changes}


def test_repeat_writes_a_chain() -> None:
    system = system_from_tree(chain())
    link = Body(mass=1, com=[0, -1, 0], points={"end": [0, -2, 0]})
    bodies = {f"body{k}": link for k in (1, 2, 3)}
    joints = {
        "joint1": Revolute("ground", "body1"),
        "joint2": Revolute("body1.end", "body2"),
        "joint3": Revolute("body2.end", "body3"),
    }
    assert system == System("chain", bodies=bodies, joints=joints)
    assert system_from_tree(tree_from_system(system)) == system


@pytest.mark.parametrize(
    ("changes", "message", "path"),
    [
        ({"count": "100001"}, "at most 10000 copies", "repeat.count"),
        ({"count": "0"}, "expected a whole number, at least 1", "repeat.count"),
        ({"body": {"maas": "1"}}, "did you mean mass?", "repeat.body.maas"),
        ({"joint": {"type": "revolut"}}, "did you mean revolute?", "repeat.joint.type"),
        ({"body": "x"}, "expected a map, got 'x'", "repeat.body"),
    ],
)
def test_wrong_chains(changes: dict[str, Any], message: str, path: str) -> None:
    with pytest.raises(ModelError) as caught:
        system_from_tree(chain(**changes))
    assert message in caught.value.message
    assert ".".join(caught.value.where.path) == path


def test_chain_does_not_overwrite_a_body() -> None:
    tree = chain() | {"bodies": {"body2": {"mass": "1"}}}
    with pytest.raises(ModelError, match="'body2' a second time; choose another body_name or joint_name"):
        system_from_tree(tree)


def test_known_initial_survives_the_round_trip() -> None:
    joint = Revolute("ground", "b", initial=Initial(q="30 deg", u=10, known=True))
    system = System("s", bodies={"b": Body(mass=1, inertia={"Izz": 1})}, joints={"j": joint})
    assert system_from_tree(tree_from_system(system)) == system
