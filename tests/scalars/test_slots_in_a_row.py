"""Slots that are asked for in a row are those that are asked for one by one; the collector is put back as it was."""

from __future__ import annotations

import gc

import pytest

from multibody_sym.scalars.node import forget_unused, slot, slots, without_collection


def test_they_are_the_same_objects_also_once_others_were_forgotten() -> None:
    first = slots("row", 5)
    assert all(node is slot("row", k) for k, node in enumerate(first))
    kept = slot("row", 7)
    forget_unused()
    assert slots("row", 3, 5)[2] is kept
    assert slots("row", 5) == first
    assert all(a is b for a, b in zip(slots("row", 5), first, strict=True))


@pytest.mark.parametrize("collects", [True, False])
def test_the_collector_is_as_before(collects: bool) -> None:
    before = gc.isenabled()
    try:
        (gc.enable if collects else gc.disable)()
        with pytest.raises(ValueError, match="no"), without_collection():
            _fails()
        assert gc.isenabled() is collects
    finally:
        (gc.enable if before else gc.disable)()


def _fails() -> None:
    assert not gc.isenabled()
    raise ValueError("no")
