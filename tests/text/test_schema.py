"""The JSON Schema of model files: it takes what `load` takes, and tells what editors can tell."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import jsonschema
import pytest

import multibody_sym as mbs
from multibody_sym.model import system
from multibody_sym.model.schema import kind_of, with_types
from multibody_sym.text.yaml_tree import read_text

EXAMPLES = Path(__file__).parents[2] / "examples"
FILES = sorted(EXAMPLES.rglob("*.yaml"))
SCHEMA = mbs.schema()
VALIDATOR = jsonschema.Draft202012Validator(SCHEMA)


def content(text: str) -> Any:
    return read_text(text, "model").data


def is_valid(tree: Any) -> bool:
    """Return what the schema says of a file as our reader has it, and as an editor does: they must agree."""
    found = [VALIDATOR.is_valid(tree), VALIDATOR.is_valid(with_types(tree))]
    assert found[0] == found[1]
    return found[0]


def test_it_is_a_schema() -> None:
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    assert SCHEMA["$schema"].endswith("2020-12/schema")


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_every_example_is_valid(path: Path) -> None:
    tree = content(path.read_text(encoding="utf-8"))
    for seen in (tree, with_types(tree)):
        assert [error.message[:200] for error in VALIDATOR.iter_errors(seen)] == []


def test_what_dump_writes_is_valid() -> None:
    for path in FILES[::4]:
        assert is_valid(content(mbs.dumps(mbs.load(path)))), path


def test_every_key_is_explained() -> None:
    assert len(SCHEMA["$defs"]) > 50
    for name, one in {**SCHEMA["$defs"], "System": SCHEMA}.items():
        assert one["additionalProperties"] is False, name
        assert one["description"], name
        for key, entry in one["properties"].items():
            assert entry["description"], f"{name}.{key}"


def test_every_kind_of_field_is_known() -> None:
    """The kind of an unknown class of fields raises KeyError, of items in lists and maps too."""
    elements: list[Any] = [system.System, system.Repeat]
    seen: set[Any] = set()
    while elements:
        cls = elements.pop()
        if cls not in seen:
            seen.add(cls)
            for field in system.fields_of(cls).values():
                kind = kind_of(field)
                assert kind.words
                assert kind.schema
                elements += kind.elements


GOOD = """
multibody_sym: 1
name: arm
gravity: [0, -9.81, 0]
parameters: {m: 2 kg, l: {value: 0.5 m, positive: true}}
bodies:
  ground: {points: {top: [0, 1, 0]}, surfaces: {table: {plane: [0, 0, 0], normal: y}}}
  rod: {mass: m, com: [l/2, 0, 0], inertia: {Izz: m*l^2/12}, points: {end: [l, 0, 0]}}
  ball: {shape: {sphere: 0.1, mass: 1}}
joints:
  A: {type: hinge, parent: ground, child: rod, axis: z, q: phi, initial: {q: 30 deg, u: [null]}}
  B: {type: point, parent: ground, child: ball, axes: xy}
forces:
  spring: {type: spring, between: [ground.top, rod.end], stiffness: 100}
contacts: {c: {between: [ball, ground.table], static: enough}}
inputs: {u: {table: [[0, 0], [1, 2]], interpolation: cubic}}
ask: {first: {x: 2 m}, second: {max: y, until: 2 s}}
stop: {fall: y < 0}
simulation: {t_end: 2 s, constraints: {projection: true}}
"""
WRONG = {
    "a top-level key": ("body", {}),
    "a key of a body": ("bodies.rod.mas", "1"),
    "a key of inertia": ("bodies.rod.inertia.Iz", "1"),
    "a key of a shape": ("bodies.ball.shape.density", "1"),
    "a shape nobody knows": ("bodies.ball.shape", {"cone": "1", "mass": "1"}),
    "two shapes": ("bodies.ball.shape", {"disc": "1", "sphere": "1", "mass": "1"}),
    "a key of a joint": ("joints.A.axes", ["x", "y"]),
    "a type of joint": ("joints.A.type", "hinged"),
    "a joint without child": ("joints.A", {"type": "hinge", "parent": "ground"}),
    "a joint without type": ("joints.A", {"parent": "ground", "child": "rod"}),
    "a key of start values": ("joints.A.initial.v", "1"),
    "a direction": ("joints.A.axis", "w"),
    "two numbers for three": ("gravity", ["0", "-9.81"]),
    "a key of a force": ("forces.spring.stifness", "1"),
    "a spring without stiffness": ("forces.spring", {"type": "spring", "between": ["ground", "rod"]}),
    "a key of a contact": ("contacts.c.mu", "1"),
    "one end of a contact": ("contacts.c.between", ["ball"]),
    "a word of interpolation": ("inputs.u.interpolation", "quadratic"),
    "a key of settings": ("simulation.tend", "1"),
    "a key of stabilisation": ("simulation.constraints.projektion", "true"),
    "a key of a question": ("ask.second.unti", "1"),
    "a parameter without value": ("parameters.l", {"positive": "true"}),
    "a parameter's sign": ("parameters.l.positive", "maybe"),
    "a list for a map": ("bodies", ["rod"]),
    "another version": ("multibody_sym", "2"),
}


def changed(path: str, value: Any) -> Any:
    tree = copy.deepcopy(content(GOOD))
    *steps, last = path.split(".")
    inner = tree
    for step in steps:
        inner = inner[step]
    inner[last] = value
    return tree


def test_the_right_file_is_valid() -> None:
    mbs.loads(GOOD)
    assert is_valid(content(GOOD))


@pytest.mark.parametrize("what", WRONG)
def test_a_wrong_file_is_not(what: str) -> None:
    path, value = WRONG[what]
    tree = changed(path, value)
    assert not is_valid(tree)
    with pytest.raises(mbs.InputError):
        system.system_from_tree(tree)


def test_a_change_of_the_schema_is_the_callers_own() -> None:
    mbs.schema()["properties"].clear()
    assert mbs.schema() == SCHEMA
