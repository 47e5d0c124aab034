"""Resolving a large system walks over its declarations a few times, however many things look at them."""

from __future__ import annotations

import pickle
from collections import Counter
from typing import Any

import pytest

import multibody_sym as mbs
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.fields import Element, scalar
from multibody_sym.model.system import expressions, with_expressions
from multibody_sym.scalars.node import Node
from multibody_sym.text.parser import parse
from multibody_sym.text.printer import text


def chain(count: int) -> mbs.System:
    bodies = {f"b{k}": mbs.Body(mass=1 + 0.1 * k, com=[0, -0.5, "l"], points={"end": [0, -1, 0]}) for k in range(count)}
    joints = {f"j{k}": mbs.Revolute(f"b{k - 1}.end" if k else "ground", f"b{k}", axis="z") for k in range(count)}
    return mbs.System("chain", [0, "-g", 0], {"g": 9.81, "l": 0.1}, bodies, joints)


def test_each_element_is_looked_through_a_few_times(monkeypatch: pytest.MonkeyPatch) -> None:
    system = chain(5)
    looked: Counter[int] = Counter()
    written = Element.written

    def counted(self: Element) -> Any:
        looked[id(self)] += 1
        return written(self)

    monkeypatch.setattr(Element, "written", counted)
    mechanism(system)
    assert max(looked[id(body)] for body in system.bodies.values()) <= 2


def test_what_nothing_changes_in_stays_as_it_is() -> None:
    system = chain(3)
    assert with_expressions(system, lambda node: node) is system
    changed = with_expressions(system, lambda node: parse("2*g") if text(node) == "-g" else node)
    assert changed.gravity == (parse("0"), parse("2*g"), parse("0"))
    assert all(changed.bodies[name] is body for name, body in system.bodies.items())


def test_what_is_remembered_of_a_system_stands_in_no_pickle() -> None:
    system = chain(3)
    before = pickle.dumps(system)
    found = expressions(system)
    assert pickle.dumps(system) == before
    assert expressions(pickle.loads(before)) == found
    found.clear()
    assert expressions(system)


@pytest.mark.parametrize("number", ["0", "-0", "7", "007", "-1.0", "0.10", "-3.25", "123456789012345678.123456789"])
def test_plain_numbers_are_read_as_expressions_are(number: str) -> None:
    found: Node = scalar(number, "m")
    assert found is parse(number)
