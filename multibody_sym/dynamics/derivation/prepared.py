"""What every derivation in closed form begins with: the mechanism at its start, its symbols, what is told beside it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import comb
from typing import Any, Final, Protocol, TypeVar

from multibody_sym.algebra.budget import Budget
from multibody_sym.algebra.readable import LARGEST_SUM, Readable
from multibody_sym.algebra.subexpressions import Subexpressions, WrittenOut
from multibody_sym.dynamics.derivation.constants import measured_start, measured_values, without_zero_angles
from multibody_sym.dynamics.derivation.lagrange import Energies, energies, energy_nodes
from multibody_sym.dynamics.derivation.notation import READABLE
from multibody_sym.dynamics.derivation.symbols import Symbols, symbols_of
from multibody_sym.dynamics.start.examined import examined
from multibody_sym.dynamics.start.state import state_at
from multibody_sym.dynamics.start.straight import Side, straightened
from multibody_sym.errors import ArgumentError, shown
from multibody_sym.model.declaration.parameters import letters_of
from multibody_sym.model.declaration.system import System
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.resolution.changes import Changes
from multibody_sym.numerics.numbers import number
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node
from multibody_sym.scalars.traversal import postorder

_READABLE_ENERGY: Final = 300
"""Operations in T up to which the equations that follow from it have a chance to be read."""


@dataclass(frozen=True)
class Told:
    """What equations are told with: the book's letters by name, values of constants of the start, and its sides."""

    labels: Mapping[str, str]
    constants: Mapping[Any, float]
    sides: tuple[Side, ...]


class _Sized(Protocol):
    @property
    def operations(self) -> int: ...


R = TypeVar("R", bound=_Sized)


def shortest(ready: Prepared, limits: Budget, derived: Callable[[Subexpressions, Energies], R]) -> R:
    """Return what `derived` makes of the energies: written out where a person can read it, else with named parts."""
    mechanism, symbols = ready.mechanism, ready.symbols
    if written_out_size(energy_nodes(mechanism)) <= LARGEST_SUM:
        circles = tuple(tuple(symbols.coordinates[k] for k in q) for b in mechanism.bodies for q in b.quaternions)
        names = WrittenOut(symbols.free_prefix, limits, Readable(frozenset(symbols.speeds), circles))
        given = energies(mechanism, symbols, names)
        if given.kinetic.count_ops() <= _READABLE_ENERGY:
            short = derived(names, given)
            if short.operations <= READABLE:
                return short
    named = Subexpressions(symbols.free_prefix, limits)
    return derived(named, energies(mechanism, symbols, named))


@dataclass(frozen=True)
class Prepared:
    """A mechanism in its state at the start, on the sides where things lie there; its symbols, and what is told."""

    mechanism: Mechanism
    symbols: Symbols
    told: Told


def prepared(model: System | Mechanism, changes: Changes) -> Prepared:
    """Return what is derived from a model with changes; raises ModelError, NoSolutionError, ArgumentError."""
    model = _asked(model, changes)
    resolved = model if isinstance(model, Mechanism) else _at_start(model)
    begin = measured_start(resolved, project=isinstance(model, System) and model.simulation.project)
    mechanism, sides = without_zero_angles(resolved, begin), tuple[Side, ...]()
    if begin is not None:
        mechanism, sides = straightened(mechanism, begin.q, begin.u, begin.parameters)
    labels = letters_of(model.parameters) if isinstance(model, System) else {}
    symbols = symbols_of(mechanism)
    return Prepared(mechanism, symbols, Told(labels, measured_values(symbols, mechanism, begin), sides))


def _at_start(system: System) -> Mechanism:
    """Return the mechanism of a system; what holds one way only in the mode that it has at the start."""
    declared = examined(system)
    return state_at(declared, project=system.simulation.project).mechanism if declared.one_way else declared


def _asked(model: System | Mechanism, changes: Changes) -> System | Mechanism:
    if not isinstance(model, Mechanism):
        return changes.of(model)
    if changes != Changes():
        raise ArgumentError("a Mechanism is what follows from a System and is not changed; hand over the System")
    return model


def budget_of(value: object) -> Budget:
    """Return a budget, of the seconds that are given; raises ArgumentError."""
    if value is None or isinstance(value, Budget):
        return value or Budget()
    seconds = number("budget", value)
    if not seconds > 0.0:
        raise ArgumentError(f"budget is a time in seconds, got {shown(value)}")
    return Budget(seconds=seconds)


def written_out_size(parts: Sequence[Sequence[Node]]) -> int:
    """Return how many terms expressions have at most, all together, once their products are multiplied out."""
    roots = [node for part in parts for node in part]
    sizes: dict[Node, int] = {}
    for n in postorder(roots):
        operands = [sizes[a] for a in n.args]
        if n.op == "add":
            sizes[n] = sum(operands)
        elif n.op == "mul":
            sizes[n] = operands[0] * operands[1]
        elif n.op == "pow" and isinstance(n.args[1].data, int) and n.args[1].data > 0:
            sizes[n] = comb(operands[0] + n.args[1].data - 1, n.args[1].data)
        else:
            sizes[n] = operands[0] if n.op in ("neg", "div") else 1
    return sum(sizes[root] for root in roots)
