"""Masses that jump: what leaves or joins at once takes momentum along, which the rate of no flow tells."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

from multibody_sym.dynamics.start.smooth_motions import Jump, first_jump
from multibody_sym.errors import ModelError, at
from multibody_sym.model.declaration.system import System, expressions
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.kinks import switching_functions
from multibody_sym.scalars.node import Node, number, symbol
from multibody_sym.scalars.traversal import leaves

_T: Final = symbol("t")
_PARTS: Final = (("mass", "value"), ("shape", "mass", "value"), ("com",), ("inertia",))
_RANGES: Final = (20, 20_000)
"""Widths (m, rad) about zero in which a law of a coordinate is looked at: near by, and far for what is far."""


@dataclass(frozen=True)
class _Found:
    """The symbol along which a law jumps, and the jump, whose time is the value of the symbol."""

    along: Node
    jump: Jump


def verify_mass_laws(system: System, values: Mapping[Node, float], t_end: float) -> None:
    """Raise ModelError, with path and place, where a mass, centre of mass or inertia jumps.

    `values` are those of parameters, and of the coordinates at the start, by their symbols. Laws of the time are looked
    at until `t_end` (s), those of a coordinate along it, all else as at the start.
    """
    named = {_T, *map(symbol, system.parameters)}
    for path, node, unit in expressions(system):
        if path[0] == "bodies" and any(path[2 : 2 + len(part)] == part for part in _PARTS):
            for found in _jumps(node, values, t_end, frozenset(named)):
                with at(*path):
                    raise ModelError(_message(found, "" if unit is None else unit))


def _jumps(node: Node, values: Mapping[Node, float], t_end: float, named: frozenset[Node]) -> Iterator[_Found]:
    switching = leaves(switching_functions([node]), "symbol")
    if _T in switching and t_end > 0.0:
        jump = first_jump(node, values, t_end, named)
        if jump is not None:
            yield _Found(_T, jump)
    for along in (leaf for leaf in switching if leaf not in named):
        for width in _RANGES:
            place = number(width) * (_T - number(1) / 2)
            known = {leaf: place if leaf is along else leaf for leaf in leaves([node], "symbol") if leaf is not _T}
            (moved,) = evaluate([node], {**known, _T: number(0)})
            jump = first_jump(moved, values, 1.0, named)
            if jump is not None:
                yield _Found(along, Jump(width * (jump.time - 0.5), jump.of, jump.before, jump.after, jump.pole))


def _message(found: _Found, unit: str) -> str:
    jump, name = found.jump, str(found.along.data)
    told = f"it jumps at {name} = {jump.time:.6g}, from {jump.before:.6g} to {jump.after:.6g} {unit}".rstrip()
    return (
        f"{told}: what leaves or joins at once takes momentum along, which no flow tells. Let it change over "
        f"a stretch that is not zero, as with min(max(({name} - {jump.time:.6g})/0.01, 0), 1), or make what leaves a "
        "body of its own"
    )
