"""Small motions as text and as a LaTeX document."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from multibody_sym.answers.small_motions.record import Mode, Modes
from multibody_sym.dynamics.derivation.notation import escaped
from multibody_sym.expressions.chosen_units import SI, Units
from multibody_sym.expressions.held_digits import held
from multibody_sym.expressions.values import Value
from multibody_sym.writing.documents import latex_document

_DIGITS: Final = 9
"""Digits of an eigenvalue without error."""
_MOVES_OFF: Final = "moves off uniformly (omega = 0)"
_ORDER: Final = "frequencies are numbered by their size at the declared parameters"


def modes_text(found: Modes, units: Units = SI) -> str:
    """Return small motions for people to read, in chosen units."""
    sections: dict[str, Sequence[str]] = {
        "M": _matrix(found.mass),
        "C": _matrix(found.rates) if _moves(found.rates) else [],
        "K": _matrix(found.stiffness),
        "roots in omega of": [found.characteristic] if found.characteristic else [],
        "motions": list(_modes(found, units)),
        "stability": _stability(found),
        "eigenvalues, dampers included": _eigenvalues(found) if _moves(found.rates) else [],
        "motion from the declared start, of its own amplitude": [] if found.period is None else [
            f"T = {found.period.told(units)}"
        ],
        "notes": list(found.notes),
    }
    parts = [f"{title}\n" + "\n".join(f"  {line}" for line in lines) for title, lines in sections.items() if lines]
    return "\n".join([*_head(found, units), *parts])


def _head(found: Modes, units: Units) -> Iterator[str]:
    yield f"{found.name}: small motions about {'an' if found.about == 'equilibrium' else 'a'} {found.about}"
    place = ", ".join(f"{name} = {value.told(units)}" for name, value in found.at.items())
    yield f"at {place}" + (" (found beside the declared start)" if found.found else "")
    if found.held:
        yield f"the momenta of {', '.join(found.held)} are held, and leave"
    if found.mass:
        terms = ["M x''", *(["C x'"] if _moves(found.rates) else []), "K x"]
        yield f"{' + '.join(terms)} = 0 in x = ({', '.join(found.coordinates)})"


def _moves(rows: Sequence[Sequence[Value]]) -> bool:
    return any(x.value for row in rows for x in row)


def _matrix(rows: Sequence[Sequence[Value]]) -> list[str]:
    """Return rows of formulas in columns, or of numbers where there are none."""
    cells = [[_short(x) for x in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    return ["  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip() for row in cells]


def _short(value: Value) -> str:
    told = value.as_json()
    return str(told["expression"]) if told["expression"] is not None else value.digits


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
                yield f"  {'fades' if mode.rate.value < 0 else 'grows'} like exp({_exponent(mode.rate)})"
        else:
            yield _other(mode)
        yield from _shape(mode, len(found.coordinates))
    if several:
        yield f"({_ORDER})"
    if swinging:
        place = "1" if several else ""
        yield f"(expressions name omega{place} frequency(1), T{place} period(1))"


def _exponent(rate: Value) -> str:
    return f"{_short(rate)}*t"


def _other(mode: Mode) -> str:
    if mode.motion == "free":
        return _MOVES_OFF
    word = "grows" if mode.motion == "grows" else "fades"
    swings = "" if mode.frequency is None else f" while it swings with omega = {mode.frequency}"
    return f"{word} like exp(rate*t){swings}, rate = {mode.rate}"


def _shape(mode: Mode, size: int) -> Iterator[str]:
    """Yield the amplitudes, where there is more than one freedom."""
    if size < 2:
        return
    yield f"  shape: {_amplitudes(mode.shape)}"
    if mode.quarter:
        yield f"  a quarter of a period ahead: {_amplitudes(mode.quarter)}"


def _amplitudes(shape: Mapping[str, Value]) -> str:
    return ", ".join(f"{name} {_short(value)}" for name, value in shape.items())


def _stability(found: Modes) -> list[str]:
    if found.stable is False:
        where = f" where {' and '.join(found.conditions)}" if found.conditions else ""
        return [f"unstable{where}"]
    where = " where " + " and ".join(found.conditions) if found.conditions else ""
    if found.stable is None and not found.oscillating:
        return ["indifferent: nothing brings it back"]
    return [f"stable{where}" if found.stable else f"oscillations are stable{where}; what moves off uniformly is not"]


def _eigenvalues(found: Modes) -> list[str]:
    lines = []
    for x, error in zip(found.eigenvalues, found.eigenvalue_errors, strict=True):
        real, imaginary = (held(part, error, _DIGITS) for part in (x.real, x.imag))
        if imaginary == "0":
            lines.append(f"{real} 1/s")
        elif x.imag > 0.0:
            lines.append(f"{real} +- {imaginary} i 1/s")
    return lines


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
