"""The sympy symbols of a mechanism: one for each coordinate, speed, acceleration, parameter, input and multiplier."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import sympy
from multibody_sym.model.mechanism import TIME, Mechanism
from multibody_sym.scalars.node import Node, slot


@dataclass(frozen=True)
class Symbols:
    """The symbols of a mechanism, real, and positive where the model says so.

    `slots` gives the symbol of each slot; `free_prefix` begins no other symbol's name, so that names of sub-expressions
    can be made from it.
    """

    time: sympy.Symbol
    coordinates: tuple[sympy.Symbol, ...]
    speeds: tuple[sympy.Symbol, ...]
    accelerations: tuple[sympy.Symbol, ...]
    parameters: tuple[sympy.Symbol, ...]
    inputs: tuple[sympy.Symbol, ...]
    multipliers: tuple[sympy.Symbol, ...]
    slots: Mapping[Node, sympy.Symbol]
    free_prefix: str


def symbols_of(mechanism: Mechanism) -> Symbols:
    """Return the symbols of a mechanism; those of names that cannot stand in expressions are spelt with `_`."""
    taken = {"t"}
    time = sympy.Symbol("t", real=True)
    coordinates = _named((c.name for c in mechanism.coordinates), taken)
    speeds = _named((s.name for s in mechanism.speeds), taken)
    inputs = _named(mechanism.inputs, taken)
    positive = [p.positive for p in mechanism.parameters]
    parameters = _named((p.name for p in mechanism.parameters), taken, positive)
    accelerations = _named((f"{s.name}_rate" for s in mechanism.speeds), taken)
    multipliers = _named((f"lambda_{row.name}" for row in mechanism.rows), taken)
    slots = {TIME: time}
    for array, made in (("q", coordinates), ("u", speeds), ("parameters", parameters), ("inputs", inputs)):
        slots.update((slot(array, i), x) for i, x in enumerate(made))
    prefix = _free("z", lambda word: any(name.startswith(word) for name in taken))
    return Symbols(time, coordinates, speeds, accelerations, parameters, inputs, multipliers, slots, prefix)


def _named(
    names: Iterable[str], taken: set[str], positive: Iterable[bool] | None = None
) -> tuple[sympy.Symbol, ...]:
    made = []
    words = list(names)
    for name, above_zero in zip(words, positive or [False] * len(words), strict=True):
        spelt = _free(re.sub(r"[^A-Za-z0-9_]+", "_", name), taken.__contains__)
        taken.add(spelt)
        made.append(sympy.Symbol(spelt, positive=True) if above_zero else sympy.Symbol(spelt, real=True))
    return tuple(made)
