"""Fields: what each kind of field takes, how it is written back, and the errors of elements by text and path."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy

from multibody_sym.errors import InputError, ModelError
from multibody_sym.model.bodies import Body, Shape
from multibody_sym.model.constraints import Distance, Rope
from multibody_sym.model.fields import (
    Condition,
    Count,
    Direction,
    Flag,
    ListOf,
    MapOf,
    Scalar,
    ScalarOrVector,
    Scalars,
    Text,
    Vector,
)
from multibody_sym.model.forces import Damper, Friction, SpringDamper, Torque
from multibody_sym.model.joints import JOINTS, Custom, Initial, Limits, Planar, PointJoint, Revolute, Spherical
from multibody_sym.model.system import system_from_tree
from multibody_sym.scalars.node import PI, as_node, symbol

X, Y = symbol("x"), symbol("y")


@pytest.mark.parametrize(
    ("field", "value", "content", "tree"),
    [
        (Scalar("kg"), "500 g", as_node(1) / 2, "0.5"),
        (Scalar(""), "45 deg", PI / 4, "pi/4"),
        (Scalar(), 0.1, as_node(1) / 10, "0.1"),
        (Scalar(), np.float64(0.25), as_node(1) / 4, "0.25"),
        (Scalar(), np.int64(3), as_node(3), "3"),
        (Scalar(), sympy.Symbol("x") * 2, 2 * X, "2*x"),
        (Scalar(), "x*y^2", X * Y**2, "x*y^2"),
        (Vector("m"), ["1 mm", 0, "x"], (as_node(1) / 1000, as_node(0), X), ["0.001", "0", "x"]),
        (Vector(), np.array([1.0, 2.0, 3.5]), tuple(map(as_node, (1.0, 2.0, 3.5))), ["1", "2", "3.5"]),
        (Direction(), "-y", tuple(map(as_node, (0, -1, 0))), "-y"),
        (Direction(), [0, 0, 2], tuple(map(as_node, (0, 0, 2))), ["0", "0", "2"]),
        (Scalars("m"), "2 m", (as_node(2),), "2"),
        (Scalars(), [1, "x"], (as_node(1), X), ["1", "x"]),
        (ScalarOrVector("N*m"), "x", X, "x"),
        (ScalarOrVector(), [1, 2, 3], tuple(map(as_node, (1, 2, 3))), ["1", "2", "3"]),
        (Condition(), "x < 2*y", X < 2 * Y, "x < 2*y"),
        (Condition(), "x >= 2*y", 2 * Y <= X, "2*y <= x"),
        (Flag(), "true", True, "true"),
        (Flag(), False, False, "false"),
        (Count(), "12", 12, "12"),
        (Text(), " rod.pin ", "rod.pin", "rod.pin"),
        (ListOf(Text()), "a", ("a",), ["a"]),
    ],
)
def test_content_and_what_a_file_holds(field: Any, value: Any, content: Any, tree: Any) -> None:
    found = field.accept(value)
    assert found == content
    assert field.tree(found) == tree
    assert field.accept(field.tree(found)) == content


@pytest.mark.parametrize(
    ("field", "value", "message", "path"),
    [
        (Scalar("kg"), "2 m", "'2 m' does not fit here: expected a quantity in kg", ()),
        (Scalar(""), "2 m", "expected a quantity in no unit", ()),
        (Scalar(), None, "expected a number or an expression, got nothing", ()),
        (Scalar(), [1], "expected a number or an expression, got a list", ()),
        (Scalar(), {"a": 1}, "expected a number or an expression, got a map", ()),
        (Scalar(), True, "expected a number or an expression", ()),
        (Scalar(), float("nan"), "not a finite number", ()),
        (Scalar(), "1/0", "division by zero", ()),
        (Vector(), [1, 2], "expected a list of three numbers or expressions, got a list", ()),
        (Vector(), "x", "expected a list of three", ()),
        (Vector("m"), [1, "2 kg", 3], "'2 kg' does not fit here: expected a quantity in m", ("1",)),
        (Direction(), "w", "'w' is no direction: write x, y, z, -x, -y, -z or a list of three", ()),
        (Direction(), [0, 0, 0], "a direction cannot be zero", ()),
        (Flag(), "yes", "expected true or false, got 'yes'", ()),
        (Flag(), 1, "expected true or false, got 1", ()),
        (Count(), "2.5", "expected a whole number, at least 1, got '2.5'", ()),
        (Count(), 0, "expected a whole number, at least 1", ()),
        (Text(), "", "expected a name, got nothing", ()),
        (Text(), "a\nb", "expected a name", ()),
        (ListOf(Text(), 2, 2), ["a"], "expected a list of 2, got 1", ()),
        (ListOf(Text(), 2), ["a"], "expected a list of at least 2, got 1", ()),
        (MapOf(Scalar()), [1], "expected a map of names, got a list", ()),
        (MapOf(Scalar()), {"a": "1", "b": []}, "expected a number or an expression, got a list", ("b",)),
    ],
)
def test_errors_of_fields(field: Any, value: Any, message: str, path: tuple[str, ...]) -> None:
    with pytest.raises(InputError) as caught:
        field.accept(value)
    assert message in caught.value.message
    assert caught.value.where.path == path


@pytest.mark.parametrize(
    ("make", "message", "path"),
    [
        (lambda: Revolute("ground", "b", axis="w"), "is no direction", ("axis",)),
        (lambda: Revolute("a", "b", initial={"q": [1, 2]}), "needs 1 initial values here, got 2", ("initial", "q")),
        (lambda: Planar("ground", "b", q=["x"]), "a planar joint has 3 coordinates, q names 1", ()),
        (lambda: PointJoint("ground", "b", q=["x", "y", "z"]), "q names 3; in space write axes: xyz", ()),
        (lambda: Spherical("a", "b", initial={"q": [1, 0, 0]}), "needs 4 initial values here, got 3", ("initial", "q")),
        (lambda: Spherical("ground", "b", angles="xxy"), "'xxy' names no three successive axes", ("angles",)),
        (lambda: Custom("ground", "b"), "free is missing", ()),
        (lambda: Custom("ground", "b", free=[{}]), "a freedom is {translate: axis} or {rotate: axis}", ("free", "0")),
        (lambda: Custom("a", "b", free=[{"translate": "x", "pitch": 1}]), "a pitch goes with rotate", ("free", "0")),
        (lambda: Torque("1"), "a torque acts either in a joint (joint:) or on a body (on:)", ()),
        (lambda: Torque("1", on="b"), "a joint's torque is one number, a body's torque a list of three", ()),
        (lambda: Torque([1, 2, 3], joint="j"), "a joint's torque is one number", ()),
        (lambda: SpringDamper(1), "it acts either between two points (between: [a, b]) or in a joint (joint:)", ()),
        (lambda: Damper(1, between=["a", "b"], joint="j"), "it acts either between", ()),
        (lambda: SpringDamper(1, between=["a"]), "expected a list of 2, got 1", ("between",)),
        (lambda: Distance(["a", "b"], "2 kg"), "expected a quantity in m", ("value",)),
        (lambda: Rope(["a"]), "expected a list of at least 2, got 1", ("path",)),
        (lambda: Friction("j"), "friction needs a coefficient: static, kinetic or both", ("static",)),
        (lambda: Friction("j", -0.1), "a coefficient of friction is not negative", ("static",)),
        (lambda: Friction("j", 0.1, 0.2), "static 0.1 is below kinetic 0.2", ("static",)),
        (lambda: Friction("j", 0.1, radius="2 kg"), "expected a quantity in m", ("radius",)),
        (lambda: Friction("j", 0.1, radius=0), "it must be greater than zero", ("radius",)),
        (lambda: Limits(lower=0, restitution=2), "2 is no coefficient of restitution, which is", ("restitution",)),
        (lambda: Body(mass=1, shape={"rod": 1, "mass": 1}), "a shape gives the mass and inertia", ()),
        (lambda: Body(shape={"rod": 1}), "the shape's mass is missing", ("shape",)),
        (lambda: Body(shape={"ball": 1, "mass": 1}), "unknown key 'ball'; known: rod, disc", ("shape", "ball")),
        (lambda: Body(shape={"rod": 1, "disc": 1, "mass": 1}), "expected one of rod, disc", ("shape",)),
        (lambda: Body(shape={"spher": 1, "mass": 1}), "did you mean sphere?", ("shape", "spher")),
        (lambda: Body(shape={"box": [1, 2], "mass": 1}), "a box has 3 sizes, got 2: box: [x, y, z]", ("shape",)),
        (lambda: Shape("disk", [1], 1), "did you mean disc?", ("kind",)),
        (lambda: Body(inertia={"Iyx": 1}), "unknown key 'Iyx'; did you mean Ixy?", ("inertia", "Iyx")),
        (lambda: Body(inertia={"Ixx": "1 kg"}), "expected a quantity in kg*m^2", ("inertia", "Ixx")),
        (lambda: Body(points={"p": [0, 0]}), "expected a list of three", ("points", "p")),
        (lambda: Body(points={"p": [0, 0, 0]}, frames={"p": {}}), "'p' is both a point and a frame", ()),
        (lambda: Body(frames={"F": {"rotate": [{"axis": "z"}]}}), "angle is missing", ("frames", "F", "rotate", "0")),
    ],
)
def test_errors_of_elements(make: Any, message: str, path: tuple[str, ...]) -> None:
    with pytest.raises(ModelError) as caught:
        make()
    assert message in caught.value.message
    assert caught.value.where.path == path


FILE = {"multibody_sym": "1", "name": "x"}


@pytest.mark.parametrize(
    ("tree", "message", "path"),
    [
        ([], "a model file is a map, got a list", ""),
        ({"name": "x"}, "a model file says 'multibody_sym: 1' first, got nothing", "multibody_sym"),
        ({"multibody_sym": "2", "name": "x"}, "got '2'", "multibody_sym"),
        ({"multibody_sym": "1"}, "name is missing", ""),
        (FILE | {"body": {}}, "unknown key 'body'; did you mean bodies?", "body"),
        (FILE | {"bodies": {"b": {"maas": "1"}}}, "did you mean mass?", "bodies.b.maas"),
        (FILE | {"joints": {"j": {"parent": "a"}}}, "type is missing; known: revolute", "joints.j"),
        (FILE | {"joints": {"j": {"type": "hing"}}}, "did you mean hinge?", "joints.j.type"),
        (FILE | {"joints": {"j": {"type": "hinge"}}}, "parent and child are missing", "joints.j"),
        (FILE | {"joints": {"j": ["a"]}}, "expected a map with a type", "joints.j"),
        (FILE | {"parameters": {"a": {"value": ""}}}, "needs a sample value", "parameters.a"),
        (FILE | {"ask": {"a": {"x": "1", "y": "2"}}}, "name one coordinate", "ask.a"),
        (FILE | {"simulation": {"tend": "1"}}, "did you mean t_end?", "simulation.tend"),
        (FILE | {"forces": {"F": {"type": "force", "force": [1, 0, 0]}}}, "did you mean value?", "forces.F.force"),
        (FILE | {"constraints": {"r": {"type": "rope", "rough": 1}}}, "belongs to the pulley", "constraints.r.rough"),
    ],
)
def test_errors_of_files(tree: Any, message: str, path: str) -> None:
    with pytest.raises(InputError) as caught:
        system_from_tree(tree)
    assert message in caught.value.message
    assert ".".join(caught.value.where.path) == path


def test_joints_have_the_names_people_bring_along() -> None:
    for alias, kind in JOINTS.aliases.items():
        tree = {"type": alias, "parent": "ground", "child": "b", **({"axis": "x"} if kind == "prismatic" else {})}
        assert JOINTS.tree(JOINTS.accept(tree))["type"] == kind


def test_known_is_a_word_in_a_file_and_a_truth_in_python() -> None:
    assert Initial(q=1, known="true") == Initial(q=1, known=True)
