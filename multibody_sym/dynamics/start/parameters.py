"""Values of parameters, evaluated in the order of their references, and the errors of values that are undefined."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from itertools import pairwise
from typing import Final

from multibody_sym.errors import ExpressionError, ModelError, Where, at
from multibody_sym.mechanics.law_elements import FrictionPart, LawElement
from multibody_sym.mechanics.load_records import Load
from multibody_sym.mechanics.mechanism import Mechanism, Source
from multibody_sym.mechanics.motion import Motion, accelerations
from multibody_sym.mechanics.points import position
from multibody_sym.mechanics.ropes import NoDirectionError
from multibody_sym.mechanics.row_kinematics import row_motion
from multibody_sym.model.contacts_and_impacts import verify_coefficients, verify_rod_length
from multibody_sym.model.system import System
from multibody_sym.scalars.arrays import UNDEFINED
from multibody_sym.scalars.elementary import leaves, postorder
from multibody_sym.scalars.functions import evaluate, evaluate_float
from multibody_sym.scalars.node import Node, slot, symbol
from multibody_sym.text.printer import text

# ----------------------------------------------------------------------------------------------------------------------
# Expressions without a finite value: which part has none, and with which values.


ARITHMETIC: Final = (ArithmeticError, ValueError, ExpressionError)
"""What arithmetic raises; numpy raises ValueErrors where it meets infinities."""
_SHOWN: Final = 60


def value_or_none(node: Node, known: Mapping[Node, float]) -> float | None:
    """Return the value of an expression; None where it has none, or names a symbol without a value."""
    try:
        return evaluate_float([node], known)[0]
    except (*ARITHMETIC, KeyError):
        return None


def known_values(system: System) -> dict[Node, float]:
    """Return the values of parameters, as far as they follow from each other."""
    known: dict[Node, float] = {}
    waiting = {symbol(name): parameter.value for name, parameter in system.parameters.items()}
    while found := {leaf: x for leaf, node in waiting.items() if (x := value_or_none(node, known)) is not None}:
        known.update(found)
        waiting = {leaf: node for leaf, node in waiting.items() if leaf not in found}
    return known


def undefined_text(node: Node, known: Mapping[Node, float], name: str | None = None) -> str:
    """Return the message that an expression, or a quantity that it defines and a name, has no finite value.

    It names the innermost part without one, and the values of its symbols.
    """
    subject = _brief(node) if name is None else name
    for n in postorder([node]):
        found = n.shadow if n.shadow is not None else known.get(n) if not n.args else value_or_none(n, known)
        if found is None or not math.isfinite(found):
            named = [f"{leaf} = {known[leaf]:g}" for leaf in leaves([n], "symbol")]
            part = "" if n is node and name is None else f", for {_brief(n)} has none"
            return f"{subject} has no finite value{part}{' with ' * bool(named)}{', '.join(named)}"
    return f"{subject} has no finite value"


def _brief(node: Node) -> str:
    shown = text(node)
    return shown if len(shown) <= _SHOWN else f"{shown[:_SHOWN]}..."


# ----------------------------------------------------------------------------------------------------------------------

def parameter_values(mechanism: Mechanism, overrides: Mapping[str, float]) -> list[float]:
    """Return the parameter vector (np): declared values, expressions of others evaluated, `overrides` by name.

    Parameters that are not declared (measured lengths of ropes, Baumgarte's coefficients) are zero.
    Raises ModelError for unknown names, circles, values that are not finite, and `positive` ones that are not.
    """
    entries = mechanism.parameters
    declared_names = [entry.name for entry in entries if entry.source is Source.DECLARED]
    for name in overrides:
        if name not in declared_names:
            raise ModelError(f"no parameter is called {name!r}", number="M106", word=name, known=declared_names)
    values = {slot("parameters", i): 0.0 for i, entry in enumerate(entries) if entry.value is None}
    for index in evaluation_order(mechanism, overrides):
        name, declared = entries[index].name, entries[index].value
        value = overrides[name] if name in overrides else value_or_nan(declared, values)
        if not math.isfinite(value):
            if name in overrides or declared is None:
                raise _parameter_error(name, f"{name} has no finite value: {overrides[name]:g} was given")
            symbols = {slot("parameters", k): symbol(entry.name) for k, entry in enumerate(entries)}
            known = {symbols[leaf]: x for leaf, x in values.items()}
            raise _parameter_error(name, undefined_text(evaluate([declared], symbols)[0], known, name))
        if entries[index].positive and value <= 0:
            raise _parameter_error(name, f"{name} = {value:g}, but it is declared positive")
        values[slot("parameters", index)] = float(value)
    return [values[slot("parameters", i)] for i in range(len(entries))]


def value_or_nan(expression: Node | None, values: Mapping[Node, float]) -> float:
    """Return the value of an expression, nan where it has none."""
    assert expression is not None
    try:
        return evaluate_float([expression], values)[0]
    except UNDEFINED:
        return math.nan


def _parameter_error(name: str, message: str) -> ModelError:
    return ModelError(message, where=Where(path=("parameters", name)), number="M119")


def evaluation_order(mechanism: Mechanism, overrides: Mapping[str, float]) -> list[int]:
    """Return the declared parameters' positions, each after those that its expression names. Raises ModelError."""
    needed = [
        [] if entry.value is None or entry.name in overrides else [n.data[1] for n in leaves([entry.value], "slot")]
        for entry in mechanism.parameters
    ]
    done: set[int] = {i for i, entry in enumerate(mechanism.parameters) if entry.value is None}
    order: list[int] = []
    for root in range(len(needed)):
        path = {} if root in done else {root: None}
        while path:
            index = next(reversed(path))
            missing = next((i for i in needed[index] if i not in done), None)
            if missing is None:
                path.popitem()
                order.append(index)
                done.add(index)
            elif missing in path:
                names = [mechanism.parameters[i].name for i in (*path, missing)][list(path).index(missing) :]
                circle = f"parameters depend on each other in a circle: {' -> '.join(names)}"
                raise _parameter_error(names[0], circle)
            else:
                path[missing] = None
    return order


# ----------------------------------------------------------------------------------------------------------------------
# Rows and forces that have no value at the start: which, and why.


def verify_lengths(motion: Motion) -> None:
    """Raise ModelError naming the first rod or rope whose length is negative, or a rod's zero, wherever bodies are."""
    for k, row in enumerate(motion.mechanism.rows):
        declared = row.declared_length
        if declared is None or any(leaf.data[0] == "q" for leaf in leaves([declared], "slot")):
            continue
        with at(*motion.mechanism.row_path(k)):
            try:
                length = float(motion.state.values([declared])[0])
            except UNDEFINED:
                continue
            if length < 0.0:
                raise ModelError(f"its length is {length:g} m at the start, and no length is negative", number="M109")
            if row.multiplier == "rod":
                verify_rod_length(length)


def verify_values(motion: Motion) -> None:
    """Raise ModelError naming the first row that has no value at a state, and why it has none."""
    bias = accelerations(motion, [0.0] * len(motion.state.u))
    for k, row in enumerate(motion.mechanism.rows):
        with at(*motion.mechanism.row_path(k)):
            for a, b in pairwise(row.line):
                if position(motion, a) == position(motion, b):
                    when, advice = "at the start", "give them different positions (initial: {q: ..})"
                    if a.body == b.body:
                        when, advice = "always", "join other points"
                    raise ModelError(
                        f"{a.name} and {b.name} are at the same place {when}, and what joins them has no direction; "
                        f"{advice}",
                        number="M119",
                    )
            try:
                found = row_motion(row, motion, bias)
                values = (found.gap, found.phidot, found.gamma, *found.jacobian)
                valued = all(math.isfinite(x) for x in values)
            except NoDirectionError:
                raise
            except UNDEFINED:
                valued = False
            if not valued:
                raise ModelError(
                    "it, its rate or its acceleration has no finite value at the start; correct the expression, or "
                    "start from another position (initial: {q: ..})",
                    number="M119",
                )


def verify_direction(motion: Motion, load: Load) -> None:
    """Raise ModelError for a force along the line between points that coincide.

    A spring pulls with k times the way between its ends where it has neither a rest length nor a damper.
    """
    if load.line is None:
        return
    a, b = load.line
    if position(motion, a) == position(motion, b):
        other = ", or the spring neither a length nor damping: it needs no direction then"
        other *= load.spring is not None
        raise ModelError(
            f"{a.name} and {b.name} are at the same place at the start, and what pulls them together has no direction; "
            f"give them different positions (initial: {{q: ..}}){other}",
            number="M119",
        )


@contextmanager
def require_values() -> Iterator[None]:
    """Raise ModelError where an expression inside has no finite value, or a rope leads nowhere."""
    try:
        yield
    except NoDirectionError:
        raise
    except UNDEFINED as error:
        divides = isinstance(error, ZeroDivisionError)
        why = "it divides by zero" if divides else "a root, power, logarithm or the like has none there"
        cure = "correct it, or start elsewhere (initial: {q: ..})"
        raise ModelError(f"an expression has no finite value at the start: {why}; {cure}", number="M115") from None


# ----------------------------------------------------------------------------------------------------------------------
# Values of what touches and rubs.


_ROLLING: Final = ".rolling"
Value = Callable[[Node], float | None]
"""Returns the value of an expression; None where it is not known."""


def value_at(motion: Motion, node: Node) -> float:
    return float(motion.state.values([node])[0])


def verify_contact_values(elements: Iterable[LawElement], value: Value) -> None:
    """Raise ModelError for negative friction and radii, and for more friction in sliding than in sticking.

    Literal numbers were checked when they were read; these are values of parameters.
    """
    value = cache(value)  # contacts share their coefficients
    for element in elements:
        with at(*element.path):
            _verify_range(value(element.restitution), "restitution", 1.0)
            _verify_range(value(element.tangential_restitution), "tangential_restitution", 1.0)
            for force in element.constant_forces:
                _verify_range(value(force), "force", None)
            for part in element.frictions:
                verify_friction(part, value)
            for row in element.rows if element.kind == "contact" else ():
                for radius in map(value, row.radii):
                    if radius is not None and not radius > 0.0:
                        raise ModelError(
                            f"a radius there is {radius:g} m, and what has one is round; give a positive number",
                            number="M109",
                        )


def verify_friction(part: FrictionPart, value: Value) -> None:
    """Raise ModelError, under the coefficient's name, for a negative one, and for more in sliding than in sticking."""
    if part.name.endswith(_ROLLING):
        _verify_range(value(part.static), "rolling_resistance", None)
        return
    static = _verify_range(value(part.static), "static", None)
    kinetic = _verify_range(value(part.kinetic), "kinetic", None)
    if not part.enough:
        verify_coefficients(static, kinetic)


def _verify_range(value: float | None, name: str, most: float | None) -> float | None:
    with at(name):
        if value is not None and value < 0.0:
            raise ModelError(f"{value:g} is negative; nothing rubs or bounces less than not at all", number="M109")
        if most is not None and value is not None and value > most:
            raise ModelError(f"{value:g} is above {most:g}: nothing leaves faster than it came", number="M114")
    return value
