"""Every key of a model file says what it means, with an example that is taken where it stands."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from typing import Any

import pytest

from multibody_sym.model import system
from multibody_sym.model.fields import Element, fields_of
from multibody_sym.text.yaml_tree import read_text

INNER = {"Foot"}
"""What is made of declarations, and never written."""


def below(cls: type[Any]) -> Iterator[type[Any]]:
    for one in cls.__subclasses__():
        yield one
        yield from below(one)


assert system  # which imports every class that a file can hold
ELEMENTS = sorted(
    {one for one in below(Element) if one.__module__.startswith("multibody_sym.") and one.__name__ not in INNER},
    key=lambda one: one.__name__,
)


def test_no_key_is_without_a_description() -> None:
    without = [f"{cls.__name__}.{f.name}" for cls in ELEMENTS for f in fields(cls) if not f.metadata["says"].strip()]
    assert without == []
    assert len(ELEMENTS) > 60


@pytest.mark.parametrize("cls", ELEMENTS, ids=lambda cls: cls.__name__)
def test_an_example_is_taken_by_its_field(cls: type[Element]) -> None:
    kinds = fields_of(cls)
    for f in fields(cls):
        if f.name == "extremes":
            continue
        such = f.metadata["such"]
        assert such, f"{cls.__name__}.{f.name} has no example"
        kinds[f.name].accept(read_text(f"key: {such}\n", "example").data["key"])
