"""Systems and mechanisms copied and pickled: equal to what they were, and as good."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import multibody_sym as mbs
from multibody_sym.motion.prepare.problem import structure_key

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").rglob("*.yaml"))


def pickled(value: Any) -> Any:
    """Return a value that went through a pickle."""
    return pickle.loads(pickle.dumps(value))


@pytest.mark.parametrize("again", [copy.copy, copy.deepcopy, pickled])
def test_examples_come_back_equal(again: Callable[[Any], Any]) -> None:
    for path in EXAMPLES:
        system = mbs.load(path)
        back = again(system)
        assert back == system
        assert mbs.dumps(back) == mbs.dumps(system)
        assert list(back.parameters) == list(system.parameters), "the order of names is part of a system"
    assert len(EXAMPLES) > 20


@pytest.mark.parametrize("again", [copy.copy, copy.deepcopy, pickled])
def test_mechanisms_come_back_equal(again: Callable[[Any], Any]) -> None:
    for path in EXAMPLES[::4]:
        mechanism = mbs.mechanism(mbs.load(path))
        assert again(mechanism) == mechanism
        key = structure_key(mechanism, "composite_body")
        assert structure_key(again(mechanism), "composite_body") == key, "its code would not be found in the cache"


def test_what_was_copied_is_still_read_only() -> None:
    back = copy.deepcopy(mbs.load(EXAMPLES[0]))
    with pytest.raises(TypeError):
        back.bodies["new"] = mbs.Body(mass=1)  # type: ignore[index]
    with pytest.raises(AttributeError):
        back.name = "other"  # type: ignore[misc]
