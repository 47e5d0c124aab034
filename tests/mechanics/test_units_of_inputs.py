"""Inputs with a unit of their own are checked where they are used, as parameters are, from every door."""

from __future__ import annotations

from typing import Any

import pytest

from multibody_sym.errors import InputError
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.system import system_from_tree, tree_from_system

BASE: dict[str, Any] = {
    "multibody_sym": "1",
    "name": "one",
    "bodies": {"b": {"mass": "1", "inertia": {"Izz": "1"}}},
    "joints": {"j": {"type": "revolute", "parent": "ground", "child": "b", "q": "phi"}},
}


def model(value: str, **inputs: Any) -> dict[str, Any]:
    return {**BASE, "inputs": inputs, "forces": {"f": {"type": "torque", "joint": "j", "value": value}}}


def resolved(value: str, **inputs: Any) -> Mechanism:
    return mechanism(system_from_tree(model(value, **inputs)))


TABLE = [["0", "1"], ["1", "3"]]


@pytest.mark.parametrize(
    ("value", "inputs"),
    [
        ("tau", {"tau": "3 kN"}),
        ("tau + f", {"tau": "3 kN", "f": {"table": TABLE}}),
        ("f + 2*tau", {"tau": "3 kN", "f": "sin(t)"}),
        ("tau + f", {"tau": "3 kN*m", "f": "2 kg"}),
        ("f", {"f": {"table": [["0", "1 kN"], ["1", "3"]]}}),
        ("tau/f", {"tau": "3 kN", "f": "2 m"}),
        ("sin(tau)", {"tau": "3 m"}),
    ],
)
def test_an_input_in_another_unit_is_refused_where_it_is_used(value: str, inputs: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=r"quantity in|is in") as caught:
        resolved(value, **inputs)
    assert ".".join(map(str, caught.value.where.path)) == "forces.f.value"


@pytest.mark.parametrize("given", ["3 kN", {"table": [["0", "1 N"], ["1", "2 N"]]}])
def test_the_inputs_of_a_call_are_checked_like_those_of_a_file(given: Any) -> None:
    declared = system_from_tree(model("tau + f", tau="2", f="1"))
    mechanism(declared)
    with pytest.raises(InputError, match="a quantity in N; here one in") as caught:
        mechanism(Overrides(inputs={"tau": given}).of(declared))
    assert ".".join(map(str, caught.value.where.path)) == "forces.f.value"


def test_inputs_in_fitting_units_and_numbers_without_are_worth_the_same() -> None:
    with_unit = resolved("tau*f/2", tau="3 kN", f={"table": [["0 s", "1 mm"], ["1 s", "3 mm"]]})
    without = resolved("tau*f/2", tau="3000", f={"table": [["0", "0.001"], ["1", "0.003"]]})
    assert with_unit.inputs == without.inputs
    assert resolved("tau", tau="180 deg").inputs == resolved("tau", tau="pi").inputs  # a pure number fits everywhere


def test_a_prescribed_motion_in_another_unit_is_refused() -> None:
    joint = {key: x for key, x in BASE["joints"]["j"].items() if key != "q"} | {"motion": "turn*t"}
    tree = {**BASE, "joints": {"j": joint}, "inputs": {"turn": "3 m"}}
    mechanism(system_from_tree({**tree, "inputs": {"turn": "3 rpm"}}))
    tree["joints"]["j"]["motion"] = "turn + sin(t)"
    with pytest.raises(InputError, match="a quantity in m; here one in rad"):
        mechanism(system_from_tree(tree))


def test_units_within_a_table_agree_and_its_times_are_times() -> None:
    with pytest.raises(InputError, match="in N and in m"):
        resolved("f", f={"table": [["0", "1 N"], ["1", "3 m"]]})
    with pytest.raises(InputError, match="expected a quantity in s") as caught:
        resolved("f", f={"table": [["0", "1"], ["1 m", "3"]]})
    assert ".".join(map(str, caught.value.where.path)) == "inputs.f.table.1"


@pytest.mark.parametrize("given", ["3 kN*m", "1 N*deg", {"table": [["0", "1 N"], ["1", "3 N"]]}])
def test_the_unit_of_an_input_survives_being_written(given: Any) -> None:
    first = system_from_tree(model("1", tau=given))
    again = system_from_tree(tree_from_system(first))
    assert again == first
    assert again.inputs["tau"].dimension == first.inputs["tau"].dimension is not None
