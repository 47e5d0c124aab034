"""Contacts in space that make no sense: each is told with its line and column and what to do, whatever is crossed."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.start.state import state_at
from multibody_sym.mechanics.model_files import load_with_places
from multibody_sym.mechanics.resolve import mechanism

SURFACES = {
    "pl": "{plane: [0, 0, 0]}",
    "di": "{disc: r}",
    "sp": "{sphere: r}",
    "se": "{segment: [[0, -1, 0], [0, 1, 0]]}",
    "pt": "{point: [0, 0, 0.1]}",
    "rv": "{revolution: 0.5*s^2}",
    "bo": "{sphere: 2, inside: true}",
}
FILE = """\
multibody_sym: 1
name: crossed
gravity: [0, 0, -10]
parameters: {{r: 0.3, mu: 0.4}}
bodies:
  ground: {{points: {{o: [0, 0, 0]}}, surfaces: {{{surfaces}}}}}
  b: {{mass: 1, inertia: {{Ixx: 0.1, Iyy: 0.1, Izz: 0.1}}, points: {{p: [0.1, 0, 0]}}, surfaces: {{{surfaces}}}}}
  box: {{shape: {{box: [0.4, 0.6, 0.2], mass: 1}}}}
  rod: {{shape: {{rod: 1, mass: 1}}}}
  cyl: {{shape: {{cylinder: [0.2, 0.5], mass: 1}}}}
joints:
  J: {{type: free, parent: ground, child: b, initial: {{q: [0.1, 0.2, 1.7, {turn}]}}}}
  K: {{type: free, parent: ground, child: box, initial: {{q: [0.1, 0.1, 0.6, 1, 0, 0, 0]}}}}
  R: {{type: revolute, axis: y, parent: ground, child: rod, initial: {{q: 0.3}}}}
  C: {{type: free, parent: ground, child: cyl, initial: {{q: [0.2, 0.1, 0.25, 1, 0, 0, 0]}}}}
contacts:
  c: {contact}
"""
LINE = 17


def begun(tmp_path: Path, contact: str, turn: str = "0.9, 0.3, 0.2, 0.1", **surfaces: str) -> None:
    """Read a file with a contact and find its state at the start, with the places of its lines."""
    every = ", ".join(f"{name}: {surface}" for name, surface in {**SURFACES, **surfaces}.items())
    file = tmp_path / "crossed.yaml"
    file.write_text(FILE.format(surfaces=every, contact=contact, turn=turn))
    system, places = load_with_places(file)
    with places.shown():
        state_at(mechanism(system))


def refused(tmp_path: Path, contact: str) -> str:
    """Return why a contact does not begin, nothing where it does."""
    try:
        begun(tmp_path, contact)
    except mbs.ModelError as error:
        return str(error)
    return ""


ENDS = ["b.pl", "b.di", "b.sp", "b.se", "b.pt", "b.rv", "b.bo", "b.p", "box", "box.top", "box.back_left", "rod", "cyl"]
OTHERS = [*(f"ground.{name}" for name in (*SURFACES, "o")), "box", "box.left", "box.bottom_right", "rod", "cyl"]


@pytest.mark.parametrize("end", ENDS)
def test_each_kind_with_each(tmp_path: Path, end: str) -> None:
    """All begin, or say in which line what is wrong and what to do; nothing ends as a defect."""
    for other in OTHERS:
        told = refused(tmp_path, f"{{between: [{end}, {other}], static: mu}}")
        assert not told or re.search(rf"crossed.yaml:{LINE}:\d+: contacts\.c", told), (end, other, told)
        assert not told or re.search(r"[;:] (name|move|give|turn)|name its body|nothing else does", told), (other, told)


def test_parts_of_shapes_have_the_names_that_results_tell(tmp_path: Path) -> None:
    """Corners and faces of a box, ends and sides of a rod, rims: what a contact of the whole is told by."""
    for end, other in itertools.product(("box.corner3", "rod.end1", "cyl.rim2"), ("ground.pl",)):
        begun(tmp_path, f"{{between: [{end}, {other}], open: true}}")
    begun(tmp_path, "{between: [b.sp, rod.side], open: true}")
    begun(tmp_path, "{between: [b.p, box.front], open: true}")
