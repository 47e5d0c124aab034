"""Ranges of rest as text."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from math import isclose, pi
from typing import Final

import numpy as np

from multibody_sym.analysis.deviations import NO_EIGENVALUES
from multibody_sym.analysis.equilibrium import TOUCHES, Equilibrium
from multibody_sym.analysis.linearize import Linearization, Multipliers
from multibody_sym.analysis.modes.record import Modes
from multibody_sym.analysis.rest.range_of_rest import LeastForMotion, RangeOfRest, RestBound
from multibody_sym.derivation.notation import escaped
from multibody_sym.documents.formulas import latex_document
from multibody_sym.documents.notes import shifts_text
from multibody_sym.text.printer import text
from multibody_sym.text.units import rate_unit
from multibody_sym.text.values import SI, Units, Value, number_within, with_formula

_NOWHERE: Final = "rest is possible at no value of"


def rest_text(found: RangeOfRest, units: Units = SI) -> str:
    """Return the ranges for a person to read, in chosen units, each with its ends."""
    lines = [_range(found, low, high, units) for low, high in found.ends]
    if not lines:
        why = f" ({', '.join(found.gives_way)})" if found.gives_way else ""
        lines = [f"{_NOWHERE} {found.parameter}{why}"]
    low, high = found.searched
    if low not in (None, 0.0) or high is not None:
        first, last = (units.said(x or 0.0, found.unit, digits=6) for x in (low, high))
        turn = found.unit == "rad" and low is not None and high is not None and isclose(high - low, 2 * pi)
        lines.append(f"note: looked for {'through a whole turn, ' if turn else ''}from {first} to {last}")
    return "\n".join(lines)


def _range(found: RangeOfRest, low: RestBound, high: RestBound, units: Units) -> str:
    name = found.parameter
    if low.value is None or high.value is None:
        if low.value is high.value:
            return f"rest is possible at every value of {name}"
        end, sign = (high, "<=") if low.value is None else (low, ">=")
        sign = sign[0] if end.open else sign
        return f"rest is possible for {name} {sign} {_bound_text(end, found.unit, units)}"
    if found.unit == "rad" and not low.gives_way + high.gives_way and isclose(high.value - low.value, 2 * pi):
        return f"rest is possible at every value of {name}"
    first, last = (_bound_text(x, found.unit, units) + (", excluded" if x.open else "") for x in (low, high))
    if units.said(low.value, found.unit) == units.said(high.value, found.unit):
        return f"rest is possible only for {name} = {min(first, last, key=len)}"
    return f"rest is possible for {name} from {first} to {last}"


def _bound_text(bound: RestBound, unit: str, units: Units) -> str:
    """Return `formula = exact number = number unit (what gives way)`."""
    assert bound.value is not None
    told = units.said(bound.value, unit, error=bound.error)
    for form in dict.fromkeys(text(form) for form in (bound.exact, bound.expression) if form is not None):
        told = with_formula(form, told)
    return f"{told} ({', '.join(bound.gives_way)})" if bound.gives_way else told


def least_text(found: LeastForMotion, units: Units = SI) -> str:
    """Return the least values that hold and that move and where they are least, in chosen units."""
    pairs = [("the least that holds is", found.holds, found.holds_at), ("rest ends first at", found.value, found.at)]
    lines = []
    for words, value, at in pairs:
        if value is not None and at is not None:
            lines.append(f"{words} {found.least} = {_bound_text(value, found.unit, units)}")
            lines.append(f"  where {found.vary} = {_bound_text(at, found.vary_unit, units)}")
    return "\n".join(lines)


# ----------------------------------------------------------------------------------------------------------------------
# Positions of equilibrium as text.


_WORDS: Final = {True: "stable", False: "unstable", None: "indifferent"}


def equilibrium_text(found: Equilibrium, units: Units = SI) -> str:
    """Return the positions for a person to read, in chosen units."""
    lines = []
    ways = zip(found.free, found.beyond, found.one_sided, found.closed, strict=True)
    each = zip(found.positions, found.errors, found.expressions, found.stable, ways, strict=True)
    for position, errors, forms, stable, (free, beyond, one_sided, closed) in each:
        known = {name: units.said(x, found.units[name], errors[name]) for name, x in position.items()}
        values = ", ".join(f"{name} = {with_formula(forms.get(name, ''), number)}" for name, number in known.items())
        along = f"; and so is every position beside it along {', '.join(free)}" if free else ""
        past = f"; beyond the other end of {', '.join(beyond)}" if beyond else ""
        edge = "; a force has no real value on one side of it" if one_sided else ""
        open_ = stable is None and TOUCHES in closed.values()
        holding = "; " + ", ".join(f"{name} {word}" for name, word in closed.items()) if closed else ""
        word = "not decided" if one_sided or open_ else _WORDS[stable] if values else "at rest"
        lines.append(f"{word}: {values or 'nothing is free to move'}{holding}{along}{past}{edge}")
    if found.cut_short:
        lines.append(f"note: cut short after {found.guesses} guesses, as its time was up: there may be others")
    elif not found.complete:
        lines.append(f"note: found from {found.guesses} guesses; it is not proved that there are no others")
    count, every = found.sets
    if count < every:
        lines.append(f"note: {count} of {every} sets of contacts, ropes and stops that may be closed were tried")
    if found.friction_left_out:
        names = ", ".join(found.friction_left_out)
        lines.append(f"note: without friction ({names}), which may hold positions beside these")
    if found.speeds_left_out:
        names = ", ".join(found.speeds_left_out)
        lines.append(f"note: at rest, start speeds are left out ({names}); steady motion: `linearize`")
    return "\n".join(lines)


# ----------------------------------------------------------------------------------------------------------------------
# Small motions as text and as a LaTeX document.


_WIDEST: Final = 78
"""Characters of a matrix that is printed in one piece."""
_MOVES_OFF: Final = "moves off uniformly (omega = 0)"
_ORDER: Final = "frequencies are numbered by their size at the declared parameters"


def modes_text(found: Modes, units: Units = SI) -> str:
    """Return small motions for people to read, in chosen units."""
    sections: dict[str, Sequence[str]] = {
        "motions": list(_modes(found, units)),
        "stability": _stability(found),
        "M": _matrix(found.mass, units),
        "C": _matrix(found.rates, units) if _moves(found.rates) else [],
        "K": _matrix(found.stiffness, units),
        "roots in omega of": [found.characteristic] if found.characteristic else [],
        "eigenvalues, dampers included": [
            f"{real} 1/s" if imaginary == "0" else f"{real} +- {imaginary} i 1/s"
            for real, imaginary, _, _ in (_eigenvalue_pairs(found, 1.0, units.digits) if _moves(found.rates) else ())
        ],
        "motion from the declared start, of its own amplitude": (
            [] if found.period is None else [f"T = {found.period.told(units)}"]
        ),
        "notes": list(found.notes),
    }
    parts = [f"{title}\n" + "\n".join(f"  {line}" for line in lines) for title, lines in sections.items() if lines]
    place = ", ".join(f"{name} = {value.told(units)}" for name, value in found.at.items())
    head = [
        f"{found.name}: small motions about {'an' if found.about == 'equilibrium' else 'a'} {found.about}",
        f"at {place}" + (" (found beside the declared start)" if found.found else ""),
    ]
    if found.held:
        head.append(f"the momenta of {', '.join(found.held)} are held, and leave")
    if found.mass:
        terms = ["M x''", *(["C x'"] if _moves(found.rates) else []), "K x"]
        head.append(f"{' + '.join(terms)} = 0 in x = ({', '.join(found.coordinates)})")
    return "\n".join([*head, *parts])


def _moves(rows: Sequence[Sequence[Value]]) -> bool:
    return any(x.value for row in rows for x in row)


def _matrix(rows: Sequence[Sequence[Value]], units: Units) -> list[str]:
    """Return rows of formulas in columns, or of numbers where there are none; of a wide matrix its elements."""
    cells = [[_short(x, units) for x in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    if sum(widths) + 2 * len(widths) > _WIDEST:
        return [f"[{i}, {j}] {x}" for i, row in enumerate(cells, 1) for j, x in enumerate(row, 1) if x != "0"]
    return ["  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip() for row in cells]


def _short(value: Value, units: Units) -> str:
    """Return the formula, or the number in SI units where there is none."""
    if value.expression is None:
        return number_within(value.value or 0.0, value.error, units.digits)
    return text(value.expression)


def _modes(found: Modes, units: Units) -> Iterator[str]:
    several = len(found.oscillating) > 1
    swinging = 0
    for mode in found.modes:
        if mode.motion == "oscillates" and mode.frequency is not None and mode.period is not None:
            swinging += 1
            place = str(swinging) if several else ""
            yield f"omega{place} = {mode.frequency.told(units)}"
            yield f"  T{place} = {mode.period.told(units)}"
            if mode.rate is not None and mode.rate.value:
                yield f"  {'fades' if mode.rate.value < 0 else 'grows'} like exp({_short(mode.rate, units)}*t)"
        elif mode.motion == "free":
            yield _MOVES_OFF
        else:
            swings = "" if mode.frequency is None else f" while it swings with omega = {mode.frequency.told(units)}"
            told = "unknown" if mode.rate is None else mode.rate.told(units)
            yield f"{'grows' if mode.motion == 'grows' else 'fades'} like exp(rate*t){swings}, rate = {told}"
        if len(found.coordinates) > 1:
            yield f"  shape: {_amplitudes(mode.shape, units)}"
            if mode.quarter:
                yield f"  a quarter of a period ahead: {_amplitudes(mode.quarter, units)}"
    if several:
        yield f"({_ORDER})"
    if swinging:
        place = "1" if several else ""
        yield f"(expressions name omega{place} frequency(1), T{place} period(1))"


def _amplitudes(shape: Mapping[str, Value], units: Units) -> str:
    return ", ".join(f"{name} {_short(value, units)}" for name, value in shape.items())


def _stability(found: Modes) -> list[str]:
    where = f" where {' and '.join(found.conditions)}" if found.conditions else ""
    if found.stable is False:
        return [f"unstable{where}"]
    if found.stable is None and not found.oscillating:
        return ["indifferent: nothing brings it back"]
    return [f"stable{where}" if found.stable else f"oscillations are stable{where}; what moves off uniformly is not"]


def _eigenvalue_pairs(
    found: Modes | Linearization, size: float, digits: int
) -> Iterator[tuple[str, str, complex, float]]:
    """Yield real and imaginary part in a unit of a size, the number and its error; of each pair the upper one."""
    for x, error in zip(found.eigenvalues, found.eigenvalue_errors, strict=True):
        real, imaginary = (number_within(part / size, error / size, digits) for part in (x.real, x.imag))
        if imaginary == "0" or x.imag > 0.0:
            yield real, imaginary, x, error


def modes_document(found: Modes) -> str:
    """Return small motions as a LaTeX document."""
    body = "\n".join(
        [
            rf"Small motions about {'an' if found.about == 'equilibrium' else 'a'} {found.about}.",
            r"\begin{align*}",
            " \\\\\n".join(found.latex_lines()),
            r"\end{align*}",
            *(escaped(line) + r"\par" for line in (*_stability(found), *found.notes)),
        ]
    )
    return latex_document(found.name, body)


# ----------------------------------------------------------------------------------------------------------------------
# A linearisation as text: eigenvalues as people read them, then the matrices.


_FEW: Final = 4
"""Digits of an eigenvalue, and of its frequency and damping ratio, without error."""
_MANY: Final = 12
"""Of more coordinates and speeds than so many only the states are printed."""
_MOST_NAMED: Final = 6
_ROUNDING: Final = 1e-9
_ZERO: Final = 1e-12
"""What a position that was looked for is near to zero at best."""


def linearization_text(found: Linearization, units: Units = SI) -> str:
    """Return the linearisation for a person to read.

    The rates that A and B give are those of the states in their chosen units, in a second; C and D are printed where
    there are outputs.
    """
    if not found.states:
        return "nothing is free to move: there are no states"
    clear = {name: x if abs(x) > _ZERO else 0.0 for name, x in found.at.items()}
    few = clear if len(clear) <= _MANY else {name: x for name, x in clear.items() if name in found.states}
    place = ", ".join(f"{name} = {units.said(x, found.units[name])}" for name, x in few.items())
    more = f"; {len(clear) - len(few)} others follow" if len(few) < len(clear) else ""
    begun = [*([f"about {place}{more}"] if clear else []), *shifts_text(found.shifts, found.units, units)]
    names = ", ".join(units.named(name, found.units[name]) for name in found.states)
    lines = [f"linearised in {names}", *begun, *_linearization_notes(found, units)]
    if found.steady:
        lines += [f"eigenvalues in {units.of('1/s')}", *(f"  {text}" for text in _linear_eigenvalues(found, units))]
    states, inputs = (  # sizes of chosen units in SI units
        np.array([units.size(found.units[name]) for name in names]) for names in (found.states, found.inputs)
    )
    lines += ["A", *_linearization_matrix((found.A * states / states[:, None]).tolist(), units)]
    if found.inputs:
        by = ", ".join(units.named(name, found.units[name]) for name in found.inputs)
        lines += [f"B (by {by})", *_linearization_matrix((found.B * inputs / states[:, None]).tolist(), units)]
    if found.outputs:
        outputs = np.array([units.size(found.units[name]) for name in found.outputs])[:, None]
        named = ", ".join(units.named(name, found.units[name]) for name in found.outputs)
        lines += [f"C (of {named})", *_linearization_matrix((found.C * states / outputs).tolist(), units)]
        if found.inputs:
            lines += ["D", *_linearization_matrix((found.D * inputs / outputs).tolist(), units)]
    return "\n".join(lines)


def multipliers_text(found: Multipliers, units: Units = SI) -> str:
    """Return the multipliers over one period, pure numbers, for a person to read."""
    period = units.said(found.period, "s")
    lines = [f"in {', '.join(found.states)}, over one period of {period}", "multipliers"]
    for x in found.multipliers:
        if abs(x.imag) <= _ROUNDING * abs(x):
            lines.append(f"  {number_within(x.real, most=units.digits)}")
        elif x.imag > 0.0:
            real, imaginary, size = (number_within(part, most=units.digits) for part in (x.real, x.imag, abs(x)))
            lines.append(f"  {real} +- {imaginary} i   (size {size})")
    return "\n".join(lines)


def _linearization_notes(found: Linearization, units: Units) -> list[str]:
    """Return what to know of the state and of what was held."""
    notes = []
    independent = {name: x for name, x in found.accelerations.items() if not found.steady or name in found.states}
    rates = {name: units.said(x, rate_unit(found.units[name])) for name, x in independent.items()}
    changing = [f"{name}' = {rates[name]}" for name, x in independent.items() if abs(x) > _ROUNDING]
    more = f" and {len(changing) - _MOST_NAMED} more" if len(changing) > _MOST_NAMED else ""
    moving = ", ".join(changing[:_MOST_NAMED]) + more
    if not found.steady:
        notes.append(f"note: {NO_EIGENVALUES} ({moving}): its eigenvalues are not given")
    elif moving:
        notes.append(f"note: the state is no equilibrium and no steady motion, but A is constant: {moving}")
    if found.left_out:
        names = ", ".join(found.left_out)
        notes.append(f"note: left out, as nothing depends on them and their rates are not constant: {names}")
    if found.held_inputs:
        notes.append(f"note: held at the values of t = 0, although they change: {', '.join(found.held_inputs)}")
    if found.driving_inputs:
        names = ", ".join(found.driving_inputs)
        notes.append(f"note: without a column in B, as motions and constraints follow their rates too: {names}")
    return notes


def _linear_eigenvalues(found: Linearization, units: Units) -> Iterator[str]:
    """Yield a line for each real eigenvalue and for each pair, with frequency and damping ratio."""
    for real, imaginary, x, error in _eigenvalue_pairs(found, units.size("1/s"), units.digits):
        if imaginary == "0":
            yield real
        else:
            frequency = number_within(abs(x) / (2 * math.pi), error / (2 * math.pi), _FEW)
            damping = number_within(0.0 - x.real / abs(x), error / abs(x), _FEW)
            decays = f"{real} " if x.real else ""
            yield f"{decays}+- {imaginary} i   ({frequency} Hz, damping ratio {damping})"


def _linearization_matrix(rows: Sequence[Sequence[float]], units: Units) -> list[str]:
    """Return numbers in columns, of a wide matrix so many columns below each other as a page holds."""
    cells = [[number_within(x, most=units.digits) for x in row] for row in rows]
    widths = [max(map(len, column)) + 2 for column in zip(*cells, strict=True)]
    lines, first = list[str](), 0
    while first < len(widths):
        last = first + 1
        while last < len(widths) and sum(widths[first : last + 1]) <= _WIDEST:
            last += 1
        if last - first < len(widths):
            lines.append(f"  columns {first + 1} to {last}")
        shown = slice(first, last)
        lines += ["".join(x.rjust(w) for x, w in zip(row[shown], widths[shown], strict=True)) for row in cells]
        first = last
    return lines
