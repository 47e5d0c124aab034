"""Constants of the start in equations: a letter, its value beside it; zero where that is so whatever the parameters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any, Final

from multibody_sym.dynamics.derivation.record import Equation, Label, Step
from multibody_sym.dynamics.derivation.symbols import Symbols
from multibody_sym.dynamics.start.start import Start, start
from multibody_sym.dynamics.start.straight import Side
from multibody_sym.errors import MultibodyError
from multibody_sym.expressions.printer import text
from multibody_sym.model.declaration.curves.follow import Follow
from multibody_sym.model.declaration.system import with_expressions
from multibody_sym.model.mechanism.mass import GROUND
from multibody_sym.model.mechanism.mechanism import Mechanism, TreeBody
from multibody_sym.model.mechanism.parameters import ARRAY
from multibody_sym.model.mechanism.start_constants import (
    Measure,
    RopeLength,
    RopeSide,
    TangentAngle,
    TangentDirection,
    WrapAngle,
)
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import ZERO, Node, slot
from multibody_sym.scalars.traversal import leaves

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
