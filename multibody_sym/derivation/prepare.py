"""What every derivation in closed form begins with: the mechanism at its start, its symbols, what is told beside it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from math import comb
from typing import Any, Final, Protocol, TypeVar

from multibody_sym.algebra.quotients import Budget
from multibody_sym.algebra.simplify import LARGEST_SUM, Readable, Subexpressions, WrittenOut
from multibody_sym.derivation.lagrange import Energies, energies, energy_nodes
from multibody_sym.derivation.notation import READABLE, Equation, Label, Step, Symbols, symbols_of
from multibody_sym.dynamics.start.initial_geometry import Side, straightened
from multibody_sym.dynamics.start.number_checks import examined
from multibody_sym.dynamics.start.start import Start, start
from multibody_sym.dynamics.start.state import state_at
from multibody_sym.errors import ArgumentError, MultibodyError, shown
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.mechanism import (
    ARRAY,
    Measure,
    Mechanism,
    RopeLength,
    RopeSide,
    TangentAngle,
    TangentDirection,
    TreeBody,
    WrapAngle,
)
from multibody_sym.model.bodies import GROUND
from multibody_sym.model.joints import Follow
from multibody_sym.model.parameters import letters_of
from multibody_sym.model.system import System, with_expressions
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves, postorder
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import ZERO, Node, slot
from multibody_sym.scalars.numbers import number
from multibody_sym.text.printer import text

# ----------------------------------------------------------------------------------------------------------------------
# Constants of the start in equations: a letter, its value beside it; zero where that is so whatever the parameters.


SIDES: Final = "Sides at the start, on which these equations hold"


def measured_start(mechanism: Mechanism, *, project: bool) -> Start | None:
    """Return the start where something is measured there or lies on a side; None without, or where there is none."""
    found = None
    lines = (*(row.line for row in mechanism.rows), *(load.line for load in mechanism.loads))
    if any(entry.measure for entry in mechanism.parameters) or any(lines):
        with suppress(MultibodyError):
            found = start(mechanism, project=project)
    return found


def without_zero_angles(mechanism: Mechanism, begin: Start | None) -> Mechanism:
    """Return the mechanism with zero in place of the angles of tangents that are zero whatever the parameters are.

    That is known where the plane's body is not turned by declared numbers alone, which no assembly changed.
    """
    if begin is None:
        return mechanism
    zeros = {
        slot(ARRAY, k): ZERO
        for k, entry in enumerate(mechanism.parameters)
        if isinstance(entry.measure, TangentAngle)
        and begin.parameters[k] == 0.0
        and _is_numeric(mechanism, begin, entry.measure)
    }
    rows = with_expressions(mechanism.rows, lambda node: evaluate([node], lambda x: zeros.get(x, x))[0])
    return replace(mechanism, rows=rows) if zeros else mechanism


def measured_values(symbols: Symbols, mechanism: Mechanism, begin: Start | None) -> dict[Any, float]:
    """Return the values at the start of the symbols of constants that are measured there."""
    if begin is None:
        return {}
    pairs = zip(symbols.parameters, mechanism.parameters, begin.parameters, strict=True)
    return {symbol: value for symbol, entry, value in pairs if entry.measure is not None}


def sides_step(sides: Sequence[Side], lengths: Sequence[str]) -> tuple[Step, ...]:
    """Return the step that tells on which sides ropes and springs lie, as equations hold only there."""
    notes = [
        f"{side.element}, {side.ends[0]} to {side.ends[1]}: {length} > 0"
        for side, length in zip(sides, lengths, strict=True)
    ]
    return (Step(SIDES, (), "\n".join(notes)),) if notes else ()


def constants_step(mechanism: Mechanism, symbols: Symbols, values: Mapping[Any, float]) -> tuple[Step, ...]:
    """Return the step that tells what is measured at the start; nothing where equations hold no such constant."""
    named = {leaf for row in mechanism.rows for node in _nodes(row) for leaf in leaves([node], "slot")}
    shown = [
        (symbol, entry.measure)
        for k, (symbol, entry) in enumerate(zip(symbols.parameters, mechanism.parameters, strict=True))
        if entry.measure is not None and slot(ARRAY, k) in named
    ]
    equations = tuple(Equation(x, _value(values[x], measure)) for x, measure in shown if x in values)
    notes = [f"{symbol}: {_meaning(mechanism, measure)}" for symbol, measure in shown]
    return (Step("Constants of the start", equations, "\n".join(notes)),) if shown else ()


def _value(value: float, measure: Measure) -> Label:
    return Label(f"{value:.10g} {measure.unit}", rf"{value:.10g}\,\mathrm{{{measure.unit}}}")


def _meaning(mechanism: Mechanism, measure: Measure) -> str:
    if isinstance(measure, RopeLength):
        return f"how long {measure.row} is at the start" + (", less what turned wheels have wound" * measure.winds)
    if isinstance(measure, RopeSide):
        return f"on which side of {measure.pulley} {measure.rope} runs: 1 to the left about the axis, or -1"
    if isinstance(measure, WrapAngle):
        return f"around how much of its wheel the rope of {measure.row} lies at the start"
    if isinstance(measure, TangentDirection):
        return f"at what angle {measure.row} meets its wheel at the start"
    name_of = {leaf: name for name, leaf in mechanism.symbols.items()}
    components = evaluate(list(measure.across), lambda leaf: name_of.get(leaf, leaf))
    vector = ", ".join(text(component) for component in components)
    return f"from [{vector}] on {measure.plane.name} about its normal to t1, which is ground's x at the start"


def _nodes(part: Any) -> Iterator[Node]:
    found: list[Node] = []

    def keep(node: Node) -> Node:
        found.append(node)
        return node

    with_expressions(part, keep)
    yield from found


def _is_numeric(mechanism: Mechanism, begin: Start, measure: TangentAngle) -> bool:
    """Return whether a plane and all joints between its body and ground are at declared numbers at the start."""
    if any(x.shadow is None for x in measure.normal):
        return False
    index = measure.plane.body
    while index >= 0 and mechanism.bodies[index].name != GROUND:
        if not _stands_at_numbers(mechanism, begin, mechanism.bodies[index]):
            return False
        index = mechanism.bodies[index].parent
    return True


def _stands_at_numbers(mechanism: Mechanism, begin: Start, body: TreeBody) -> bool:
    coordinates = [mechanism.coordinates[k] for k in body.q]
    turns = [x for frame in (body.frame_on_parent, body.frame_on_body) for row in frame.rotation for x in row]
    given = [step.motion for step in body.steps if step.motion is not None]
    given += [x for step in body.steps if isinstance(step, Follow) for x in step.place]
    return (
        all(c.initial.shadow is not None and c.name not in begin.assembled for c in coordinates)
        and all(x.shadow is not None for x in turns)
        and not any(leaf.data[0] == ARRAY for leaf in leaves(given, "slot"))
    )


# ----------------------------------------------------------------------------------------------------------------------

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


def prepared(model: System | Mechanism, changes: Overrides) -> Prepared:
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


def _asked(model: System | Mechanism, changes: Overrides) -> System | Mechanism:
    if not isinstance(model, Mechanism):
        return changes.of(model)
    if changes != Overrides():
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
