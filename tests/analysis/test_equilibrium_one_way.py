"""Equilibrium of what holds one way only, found from the side on which it does not hold: against statics by hand."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from typing import Any

import pytest

import multibody_sym as mbs
from multibody_sym.analysis import equilibrium_search
from multibody_sym.analysis.equilibrium import Equilibrium
from multibody_sym.analysis.equilibrium_search import SECONDS, EquilibriumSearch, FoundPositions
from multibody_sym.errors import NoSolutionError

G = 9.81
HEAD = f"multibody_sym: 1\nname: rest\ngravity: [0, -{G}, 0]\n"


def rest(model: str) -> Equilibrium:
    return mbs.equilibrium(mbs.loads(HEAD + model))


def only(found: Equilibrium) -> tuple[Mapping[str, float], Mapping[str, str]]:
    assert len(found.positions) == 1
    return found.positions[0], found.closed[0]


def notch(more: int) -> str:
    """Return a particle above a notch, below which there are more planes."""
    walls = {"left": "0, normal: [1, 1, 0]", "right": "0, normal: [-1, 1, 0]"}
    walls |= {f"deep{k}": f"{-1 - k}, normal: y" for k in range(more)}
    skins = ", ".join(f"{name}: {{plane: [0, {rest.replace(',', ', 0],', 1)}}}" for name, rest in walls.items())
    contacts = ", ".join(f"{name}: {{between: [b, ground.{name}], open: true}}" for name in walls)
    return f"""
bodies: {{ground: {{surfaces: {{{skins}}}}}, b: {{mass: 1}}}}
joints: {{s: {{type: point, parent: ground, child: b, q: [x, y], initial: {{q: [0.3, 5]}}}}}}
contacts: {{{contacts}}}
"""


LEANING = """\
multibody_sym: 1
name: leaning
gravity: [0, -9.81, 0]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}, wall: {plane: [0, 0, 0], normal: x}}}
  rod: {shape: {rod: 0.8, mass: 8}, points: {e: [0.8, 0, 0], f: [0, 0, 0]}}
  ring: {mass: 0.3, inertia: {Izz: 0.01}}
joints:
  free: {type: planar, parent: ground, child: rod, q: [x, y, a], initial: {q: [0.8*cos(1), 0, pi - 1]}}
  on: {type: prismatic, parent: rod, child: ring, axis: x, q: s, initial: {q: 0.4}, limits: {lower: 0.1, upper: 0.7}}
contacts: {c1: {between: [rod.f, ground.floor]}, c2: {between: [rod.e, ground.wall]}}
"""


def test_each_set_is_searched_however_long_the_one_of_the_start_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    """A leaning rod slides, since the wall would have to pull; it rests upright or upside down, its ring at a stop.

    With its lower end on the floor V = (m L/2 + n s) g sin(a), and dV/da = 0 where cos(a) = 0.
    """
    spent, real = [0.0], equilibrium_search.search_positions

    def clock() -> float:
        spent[0] += 0.02  # a time that no other process disturbs
        return spent[0]

    def slow(search: EquilibriumSearch, *given: Any, **named: Any) -> FoundPositions:
        sides = search.mechanism.mode.sides if search.mechanism.mode else {}
        if {name for name, side in sides.items() if side} == {"c1", "c2"}:
            spent[0] += 2 * SECONDS
            return FoundPositions(guesses=1, cut_short=True)
        return real(search, *given, **named)

    monkeypatch.setattr(equilibrium_search, "search_positions", slow)
    monkeypatch.setattr(time, "process_time", clock)
    found = mbs.equilibrium(mbs.loads(LEANING))
    rests = {(round(math.sin(x["a"]), 9), round(x["s"], 9)) for x in found.positions}
    assert rests == {(1.0, 0.1), (-1.0, 0.7)}
    assert found.sets == (16, 16)
    assert not any(found.stable)


def test_sets_that_were_not_tried_are_not_called_without_rest() -> None:
    """By hand: the particle rests in the notch, on both of its sides; no other plane is reached."""
    found = rest(notch(0))
    assert dict(only(found)[0]) == pytest.approx({"x": 0.0, "y": 0.0}, abs=1e-9)
    assert found.sets == (4, 4)
    with pytest.raises(NoSolutionError) as caught:
        rest(notch(5))
    assert "none with" not in str(caught.value)
    assert "of 29 sets of left, right, deep0, deep1, .. that may be closed 8 were tried" in str(caught.value)
