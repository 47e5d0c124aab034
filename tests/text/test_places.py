"""The places that errors name are those that the file has: its keys, and no numbers where it has none."""

from __future__ import annotations

from pathlib import Path

import pytest

from multibody_sym.errors import ExpressionError, InputError, ModelError
from multibody_sym.mechanics import row_kinematics
from multibody_sym.mechanics.model_files import load, loads, locate_error
from multibody_sym.mechanics.motion import motion_of, slot_state
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.system import system_from_tree
from multibody_sym.text.yaml_tree import read_text

MODEL = """multibody_sym: 1
name: m
parameters:
  k: 2*PARAMETER
bodies:
  rotor:
    mass: 1
    inertia:
      Ixx: 1
      Izz: INERTIA
  rod:
    shape:
      rod: ROD
      mass: 1
  box:
    shape:
      box: [1, BOX, 2]
      mass: SHAPE_MASS
joints:
  A:
    type: revolute
    parent: ground
    child: rotor
    motion: MOTION
  B:
    type: revolute
    parent: rotor
    child: rod
    initial:
      q: ANGLE
  C:
    type: planar
    parent: rod
    child: box
    initial:
      q: [0, LISTED, 0]
outputs:
  o: OUTPUT
ask:
  way: ASKED
"""


@pytest.mark.parametrize(
    ("name", "path"),
    [
        ("PARAMETER", "parameters.k"),
        ("INERTIA", "bodies.rotor.inertia.Izz"),
        ("ROD", "bodies.rod.shape.rod"),
        ("BOX", "bodies.box.shape.box.1"),
        ("SHAPE_MASS", "bodies.box.shape.mass"),
        ("MOTION", "joints.A.motion"),
        ("ANGLE", "joints.B.initial.q"),
        ("LISTED", "joints.C.initial.q.1"),
        ("OUTPUT", "outputs.o"),
        ("ASKED", "ask.way"),
    ],
)
def test_place_is_that_of_the_file(name: str, path: str) -> None:
    content = MODEL
    for other in ("PARAMETER", "INERTIA", "SHAPE_MASS", "MOTION", "ANGLE", "LISTED", "OUTPUT", "ASKED", "ROD", "BOX"):
        content = content if other == name else content.replace(other, "1")
    tree = read_text(content, "m.yaml")
    with pytest.raises(ModelError, match="not declared") as caught:
        mechanism(system_from_tree(tree.data))
    error = locate_error(caught.value, tree, "m.yaml")
    lines = content.splitlines()
    line = next(k for k, text in enumerate(lines, 1) if name in text)
    assert (".".join(error.where.path), error.where.line) == (path, line)
    assert error.where.column is not None
    assert lines[line - 1][error.where.column - 1 :].lstrip("[").startswith((name, f"2*{name}"))


LOOP = """multibody_sym: 1
name: loop
bodies:
  ground: {points: {pivot: [0.5, 0, 0]}}
  crank: {shape: {rod: 0.2, mass: 1}, points: {end: [0.2, 0, 0]}}
  coupler: {shape: {rod: 0.5, mass: 1}, points: {end: [END, 0, 0]}}
  rocker: {shape: {rod: 0.4, mass: 1}, points: {end: [0.4, 0, 0]}}
joints:
  A: {type: revolute, parent: ground, child: crank, axis: z, q: a, initial: {q: 1, known: true}}
  B: {type: revolute, parent: crank.end, child: coupler, axis: z, q: b}
  D: {type: revolute, parent: ground.pivot, child: rocker, axis: z, q: d}
  C: {type: revolute, parent: coupler.end, child: rocker.end, axis: z, q: c, cut: true}
"""


@pytest.mark.parametrize("ask", ["", "outputs: {angle: c}\n"], ids=["cut to rows", "with a double"])
def test_rows_of_a_cut_joint_belong_to_the_joint(ask: str) -> None:
    resolved = mechanism(loads(LOOP.replace("END", "0.5") + ask))
    assert len(resolved.rows) >= 2
    assert {resolved.row_path(k) for k in range(len(resolved.rows))} == {("joints", "C")}


def test_what_is_wrong_with_a_row_of_a_cut_joint_is_told_there(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_arguments: object) -> None:
        raise ExpressionError("a constant is too large")

    resolved = mechanism(loads(LOOP.replace("END", "0.5")))
    monkeypatch.setattr(row_kinematics, "row_motion", refused)
    with pytest.raises(ExpressionError, match="too large") as caught:
        row_kinematics.row_motions(motion_of(resolved, slot_state(resolved)))
    assert caught.value.where.path == ("joints", "C")


@pytest.mark.parametrize(
    ("wanted", "suggested"),
    [
        ("lift", "lift.yaml"), ("Lift.yml", "lift.yaml"), ("foor_bar.yaml", "four_bar.yaml"), ("x.yaml", None),
        ("ab.yaml", None), ("four_bar", "four_bar.yaml"), ("gone/lift.yaml", None),
    ],
)
def test_a_missing_file_is_likened_by_its_name_alone(tmp_path: Path, wanted: str, suggested: str | None) -> None:
    for name in ("lift.yaml", "four_bar.yaml", "q.yaml", "four_bar.txt"):
        (tmp_path / name).write_text("")
    with pytest.raises(InputError) as caught:
        load(tmp_path / wanted)
    message = caught.value.message
    assert ("did you mean" in message) == (suggested is not None)
    assert suggested is None or f"did you mean {tmp_path / suggested}?" in message


def test_known_keys_of_a_file_are_all_listed() -> None:
    with pytest.raises(ModelError) as caught:
        loads("multibody_sym: 1\nname: m\nqqqqq: 1\n")
    assert all(key in caught.value.message for key in ("multibody_sym", "name", "joints", "ask", "repeat"))
    with pytest.raises(ModelError, match="did you mean repeat"):
        loads("multibody_sym: 1\nname: m\nrepeats: 1\n")
