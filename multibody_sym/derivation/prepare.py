"""What every derivation in closed form begins with.

In: a System or a Mechanism. Out: the mechanism at its start with its symbols, the constants that a run measures there,
and the sides on which ropes and springs lie; then the choice between expressions written out and named parts.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import is_dataclass, replace
from math import comb
from typing import Any, Final, Protocol, TypeVar

import sympy

from multibody_sym.algebra.quotients import Budget
from multibody_sym.algebra.simplify import LARGEST_SUM, Readable, Subexpressions, WrittenOut, tidy_definitions
from multibody_sym.derivation.lagrange import Energies, energies, energy_nodes
from multibody_sym.derivation.notation import READABLE, Equation, Label, Step, Symbols, symbols_of
from multibody_sym.dynamics.start.initial_geometry import SignedLength, fix_directions
from multibody_sym.dynamics.start.number_checks import check_numbers
from multibody_sym.dynamics.start.start import Start, start
from multibody_sym.dynamics.start.state import state_at
from multibody_sym.errors import ArgumentError, MultibodyError, short_repr
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.mechanism import (
    ARRAY,
    Measure,
    Mechanism,
    RopeLength,
    RopeSide,
    TangentAngle,
    TangentDirection,
    WrapAngle,
)
from multibody_sym.mechanics.spanning_tree import letters_of
from multibody_sym.model.bodies import GROUND
from multibody_sym.model.system import System, with_expressions
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves, postorder
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import ZERO, Node, slot
from multibody_sym.scalars.numbers import number
from multibody_sym.stages import doing
from multibody_sym.text.printer import text

SIDES: Final = "Sides at the start, on which these equations hold"
_READABLE_ENERGY: Final = 300
"""Operations in T up to which the equations that follow from it have a chance to be read."""


@dataclass(frozen=True)
class Naming:
    """The book's letters by name, the values of constants of the start, and the sides on which equations hold."""

    labels: Mapping[str, str]
    constants: Mapping[Any, float]
    sides: tuple[SignedLength, ...]


@dataclass(frozen=True)
class DerivationInput:
    """A mechanism in its state at the start, on the sides where things lie there; its symbols and their naming."""

    mechanism: Mechanism
    symbols: Symbols
    naming: Naming


def prepare(model: System | Mechanism, changes: Overrides) -> DerivationInput:
    """Return the input of a derivation, one-way elements in the mode of the start.

    Raises ModelError, NoSolutionError; ArgumentError for changes of a Mechanism.
    """
    labels: Mapping[str, str] = {}
    project = False
    if isinstance(model, System):
        model = changes.of(model)
        labels, project = letters_of(model), model.simulation.project
        mechanism = check_numbers(model)
        if mechanism.one_way:
            mechanism = state_at(mechanism, project=project).mechanism
    elif changes != Overrides():
        raise ArgumentError("a Mechanism is what follows from a System and is not changed; hand over the System")
    else:
        mechanism = model
    begin = _measured_start(mechanism, project=project)
    sides, constants = tuple[SignedLength, ...](), dict[Any, float]()
    if begin is not None:
        mechanism = _without_zero_angles(mechanism, begin)
        mechanism, sides = fix_directions(mechanism, begin.q, begin.u, begin.parameters)
    symbols = symbols_of(mechanism)
    if begin is not None:
        values = zip(symbols.parameters, mechanism.parameters, begin.parameters, strict=True)
        constants = {symbol: value for symbol, entry, value in values if entry.measure is not None}
    return DerivationInput(mechanism, symbols, Naming(labels, constants, sides))


def budget_of(value: object) -> Budget:
    """Return a budget, of the seconds that are given; raises ArgumentError."""
    if value is None or isinstance(value, Budget):
        return value or Budget()
    seconds = number("budget", value)
    if not seconds > 0.0:
        raise ArgumentError(f"budget is a time in seconds, got {short_repr(value)}")
    return Budget(seconds=seconds)


# --- constants of the start: a letter, its value beside it; zero where it is zero whatever the parameters are --------


def _measured_start(mechanism: Mechanism, *, project: bool) -> Start | None:
    """Return the start where something is measured there or lies on a side; None without, or where there is none."""
    lines = (*(row.line for row in mechanism.rows), *(load.line for load in mechanism.loads))
    if any(entry.measure for entry in mechanism.parameters) or any(lines):
        with suppress(MultibodyError):
            return start(mechanism, project=project)
    return None


def _without_zero_angles(mechanism: Mechanism, begin: Start) -> Mechanism:
    """Return the mechanism with zero in place of the angles of tangents that are zero whatever the parameters are.

    That is known where the plane's body is not turned by declared numbers alone, which no assembly changed.
    """
    zeros = {
        slot(ARRAY, k): ZERO
        for k, entry in enumerate(mechanism.parameters)
        if isinstance(entry.measure, TangentAngle)
        and begin.parameters[k] == 0.0
        and _is_numeric(mechanism, begin, entry.measure)
    }
    if not zeros:
        return mechanism
    rows = with_expressions(mechanism.rows, lambda node: evaluate([node], lambda x: zeros.get(x, x))[0])
    return replace(mechanism, rows=rows)


def _is_numeric(mechanism: Mechanism, begin: Start, measure: TangentAngle) -> bool:
    """Return whether a plane and all joints between its body and ground are at declared numbers at the start."""
    if any(x.shadow is None for x in measure.normal):
        return False
    index = measure.plane.body
    while index >= 0 and mechanism.bodies[index].name != GROUND:
        body = mechanism.bodies[index]
        coordinates = [mechanism.coordinates[k] for k in body.q]
        turns = [x for frame in (body.frame_on_parent, body.frame_on_body) for row in frame.rotation for x in row]
        given = [step.motion for step in body.steps if step.motion is not None]
        given += [x for step in body.steps if step.curve is not None for x in step.curve.place]
        if (
            any(c.initial.shadow is None or c.name in begin.assembled for c in coordinates)
            or any(x.shadow is None for x in turns)
            or any(leaf.data[0] == ARRAY for leaf in leaves(given, "slot"))
        ):
            return False
        index = body.parent
    return True


def constants_step(mechanism: Mechanism, symbols: Symbols, values: Mapping[Any, float]) -> tuple[Step, ...]:
    """Return the step with what is measured at the start; nothing where equations hold no such constant."""
    named: set[Node] = set()

    def keep(node: Node) -> Node:
        named.update(leaves([node], "slot"))
        return node

    with_expressions(mechanism.rows, keep)
    shown = [
        (symbol, entry.measure)
        for k, (symbol, entry) in enumerate(zip(symbols.parameters, mechanism.parameters, strict=True))
        if entry.measure is not None and slot(ARRAY, k) in named
    ]
    equations = []
    for symbol, measure in shown:
        if symbol in values:
            value, unit = f"{values[symbol]:.10g}", measure.unit
            equations.append(Equation(symbol, Label(f"{value} {unit}", rf"{value}\,\mathrm{{{unit}}}")))
    notes = [f"{symbol}: {_meaning_of(mechanism, measure)}" for symbol, measure in shown]
    return (Step("Constants of the start", tuple(equations), "\n".join(notes)),) if shown else ()


def _meaning_of(mechanism: Mechanism, measure: Measure) -> str:
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


# --- written out, or with names --------------------------------------------------------------------------------------


class _Sized(Protocol):
    @property
    def operations(self) -> int: ...


R = TypeVar("R", bound=_Sized)


def readable(symbols: Symbols, mechanism: Mechanism) -> Readable:
    """Return how a person writes expressions in the symbols: squares of speeds, quaternions of length one."""
    circles = tuple(tuple(symbols.coordinates[k] for k in q) for b in mechanism.bodies for q in b.quaternions)
    return Readable(frozenset(symbols.speeds), circles)


def shortest(ready: DerivationInput, limits: Budget, derive: Callable[[Subexpressions, Energies], R]) -> R:
    """Return what `derive` makes of the energies: written out where a person can read it, else with named parts."""
    mechanism, symbols = ready.mechanism, ready.symbols
    # the terms that expressions have at most once their products are multiplied out
    roots = [node for part in energy_nodes(mechanism) for node in part]
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
    if sum(sizes[root] for root in roots) <= LARGEST_SUM:
        names = WrittenOut(symbols.free_prefix, limits, readable(symbols, mechanism))
        given = energies(mechanism, symbols, names)
        if given.kinetic.count_ops() <= _READABLE_ENERGY:
            short = derive(names, given)
            if short.operations <= READABLE:
                return short
    doing(f"derive {mechanism.name} with named parts, as a person could not read it written out")
    named = Subexpressions(symbols.free_prefix, limits)
    return derive(named, energies(mechanism, symbols, named))


def map_expressions(part: Any, change: Callable[[Any], Any]) -> Any:
    """Return a record, list or tuple with every sympy expression in it changed."""
    if isinstance(part, sympy.Basic):
        return change(part)
    if is_dataclass(part) and not isinstance(part, type):
        return replace(part, **{name: map_expressions(x, change) for name, x in vars(part).items()})
    return type(part)(map_expressions(x, change) for x in part) if type(part) in (list, tuple) else part


def tidy_record(definitions: Mapping[Any, Any], part: Any, prefix: str) -> tuple[list[tuple[Any, Any]], Any]:
    """Return the definitions that a record's expressions rest on, numbered anew, and the record in their names."""
    roots: list[Any] = []

    def keep(e: Any) -> Any:
        roots.append(e)
        return e

    map_expressions(part, keep)
    kept, replaced = tidy_definitions(definitions, roots, prefix)
    return kept, map_expressions(part, lambda e: e.xreplace(replaced))
