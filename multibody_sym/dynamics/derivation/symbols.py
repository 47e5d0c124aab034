"""The sympy symbols of a mechanism: coordinates, speeds, accelerations, parameters, inputs, multipliers, reactions."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence

import sympy

from multibody_sym.expressions.components import COMPONENTS
from multibody_sym.model.mechanism.mechanism import TIME, Mechanism
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node, slot


@dataclass(frozen=True)
class Symbols:
    """The symbols of a mechanism, real, and positive where the model says so.

    `reactions` are six a joint, fx .. mz in tree order. `slots` gives the symbol of each slot; `free_prefix` and a
    number name no other symbol, so that names of sub-expressions can be made from them.
    """

    time: sympy.Symbol
    coordinates: tuple[sympy.Symbol, ...]
    speeds: tuple[sympy.Symbol, ...]
    accelerations: tuple[sympy.Symbol, ...]
    parameters: tuple[sympy.Symbol, ...]
    inputs: tuple[sympy.Symbol, ...]
    multipliers: tuple[sympy.Symbol, ...]
    reactions: tuple[sympy.Symbol, ...]
    slots: Mapping[Node, sympy.Symbol]
    free_prefix: str


def symbols_of(mechanism: Mechanism) -> Symbols:
    """Return the symbols of a mechanism; those of names that cannot stand in expressions are spelt with `_`."""
    return _symbols(
        mechanism,
        [c.name for c in mechanism.coordinates],
        [s.name for s in mechanism.speeds],
        list(mechanism.inputs),
        [p.name for p in mechanism.parameters],
        [row.name for row in mechanism.rows],
        [body.joint_name for body in mechanism.bodies],
    )


def numbered_symbols(mechanism: Mechanism) -> Symbols:
    """Return symbols called by their places, so that what is derived for programs does not depend on any name."""
    m = mechanism
    groups = {"q": m.coordinates, "u": m.speeds, "w": m.inputs, "p": m.parameters.entries, "r": m.rows, "j": m.bodies}
    numbered = ([f"{letter}{i}" for i in range(len(group))] for letter, group in groups.items())
    return _symbols(mechanism, *numbered)


def _symbols(
    mechanism: Mechanism,
    coordinate_names: Sequence[str],
    speed_names: Sequence[str],
    input_names: Sequence[str],
    parameter_names: Sequence[str],
    row_names: Sequence[str],
    joint_names: Sequence[str],
) -> Symbols:
    taken = {"t"}
    time = sympy.Symbol("t", real=True)
    coordinates, speeds = _named(coordinate_names, taken), _named(speed_names, taken)
    inputs = _named(input_names, taken)
    parameters = _named(parameter_names, taken, [p.positive for p in mechanism.parameters])
    accelerations = _named([f"{name}_rate" for name in speed_names], taken)
    multipliers = _named([f"lambda_{name}" for name in row_names], taken)
    reactions = _named([f"{name}_{component}" for name in joint_names for component in COMPONENTS], taken)
    slots = {TIME: time}
    for array, made in (("q", coordinates), ("u", speeds), ("parameters", parameters), ("inputs", inputs)):
        slots.update((slot(array, i), x) for i, x in enumerate(made))
    prefix = _free("z", lambda word: any(re.fullmatch(rf"{word}\d+", name) for name in taken))
    return Symbols(time, coordinates, speeds, accelerations, parameters, inputs, multipliers, reactions, slots, prefix)


def _named(
    names: Sequence[str], taken: set[str], positive: Sequence[bool] | None = None
) -> tuple[sympy.Symbol, ...]:
    made = []
    for name, above_zero in zip(names, positive or [False] * len(names), strict=True):
        spelt = _free(re.sub(r"[^A-Za-z0-9_]+", "_", name), taken.__contains__)
        taken.add(spelt)
        made.append(sympy.Symbol(spelt, positive=True) if above_zero else sympy.Symbol(spelt, real=True))
    return tuple(made)


def _free(word: str, is_taken: Callable[[str], bool]) -> str:
    while is_taken(word):
        word += "_"
    return word
