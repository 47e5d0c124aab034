"""Systems whose names try to break out of a picture, a document or a file's name are drawn with their names as text."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
from geometry import faults
from hostile_labels import LABELS

import multibody_sym as mbs

KNOWN = {
    *"version role width height viewBox font-family font-size font-style stroke stroke-linejoin stroke-linecap".split(),
    *"stroke-width stroke-dasharray fill d cx cy r x y textLength lengthAdjust".split(),
    "{http://www.w3.org/XML/1998/namespace}space",
}
"""The attributes that a picture has."""
SVG = "{http://www.w3.org/2000/svg}"


def system_of(names: list[str]) -> mbs.System:
    """Return bodies of these names in a column, on hinges without a coordinate's letter of their own."""
    bodies = {"ground": mbs.Body(points={f"p{k}": [0, k, 0] for k in range(len(names))})}
    bodies |= {name: mbs.Body(mass=1, com=[1, 0, 0]) for name in names}
    joints = {f"j{k}": mbs.Revolute(f"ground.p{k}", name, axis="z", q=f"j{k}") for k, name in enumerate(names)}
    return mbs.System(names[0], bodies=bodies, joints=joints)


def takes(name: str) -> bool:
    try:
        mbs.mechanism(system_of([name]))
    except mbs.InputError:
        return False
    return True


@pytest.fixture(scope="module")
def taken() -> list[str]:
    """Return those that are names of bodies."""
    return [name for name in dict.fromkeys(LABELS) if takes(name)]


def test_many_of_them_are_names(taken: list[str]) -> None:
    assert len(taken) > 50


@pytest.mark.parametrize("part", range(10))
def test_names_are_text_alone(part: int, taken: list[str]) -> None:
    names = taken[part::10]
    figure = mbs.draw(system_of(names), reactions=False)
    root = ElementTree.fromstring(figure.svg)
    tags = {element.tag.removeprefix(SVG) for element in root.iter()}
    assert tags == {"svg", "title", "desc", "rect", "g", "path", "circle", "text", "tspan"}
    attributes = {name for element in root.iter() for name in element.attrib}
    assert attributes <= KNOWN
    assert faults(figure.picture) == []
    commands = set(re.findall(r"\\([a-zA-Z]+)", figure.tex))
    assert not commands & {"input", "write", "immediate", "openout", "csname", "catcode", "def", "loop", "special"}
    assert figure.tex.count(r"\end{document}") == 1


@pytest.mark.parametrize("name", ["../out", "a/b", "\x00", "..", "con", "$(touch pwned)", "; touch pwned"])
def test_no_name_of_a_system_leads_to_a_file(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    body = {"b": mbs.Body(mass=1)}
    try:
        mbs.draw(mbs.System(name, bodies=body, joints={"j": mbs.Prismatic("ground", "b", axis="x")}), "out.svg")
    except mbs.InputError:
        return
    assert [path.name for path in tmp_path.iterdir()] == ["out.svg"]
