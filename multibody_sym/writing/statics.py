"""Positions of equilibrium as text."""

from __future__ import annotations

from typing import Final

from multibody_sym.analysis.equilibrium import TOUCHES, Equilibrium
from multibody_sym.expressions.chosen_units import SI, Units

_WORDS: Final = {True: "stable", False: "unstable", None: "indifferent"}


def equilibrium_text(found: Equilibrium, units: Units = SI) -> str:
    """Return the positions for a person to read, in chosen units."""
    lines = []
    told = [_position(found, number, units) for number in range(len(found.positions))]
    each = zip(told, found.stable, found.free, found.beyond, found.one_sided, found.closed, strict=True)
    for values, stable, free, beyond, one_sided, closed in each:
        along = f"; and so is every position beside it along {', '.join(free)}" if free else ""
        past = f"; beyond the other end of {', '.join(beyond)}" if beyond else ""
        edge = "; a force has no real value on one side of it" if one_sided else ""
        open_ = stable is None and TOUCHES in closed.values()
        holding = "; " + ", ".join(f"{name} {word}" for name, word in closed.items()) if closed else ""
        word = "not decided" if one_sided or open_ else _WORDS[stable] if values else "at rest"
        lines.append(f"{word}: {values or 'nothing is free to move'}{holding}{along}{past}{edge}")
    return "\n".join([*lines, *_notes(found)])


def _position(found: Equilibrium, number: int, units: Units) -> str:
    """Return the coordinates of a position, with the digits that hold."""
    position, errors, known = found.positions[number], found.errors[number], found.units
    return ", ".join(f"{name} = {units.said(x, known[name], 9, errors[name])}" for name, x in position.items())


def _notes(found: Equilibrium) -> list[str]:
    """Return what is not known of the answer, and what it leaves out."""
    notes = []
    if found.cut_short:
        notes.append(f"note: cut short after {found.guesses} guesses, as its time was up: there may be others")
    elif not found.complete:
        notes.append(f"note: found from {found.guesses} guesses; it is not proved that there are no others")
    count, every = found.sets
    if count < every:
        notes.append(f"note: {count} of {every} sets of contacts, ropes and stops that may be closed were tried")
    if found.friction_left_out:
        names = ", ".join(found.friction_left_out)
        notes.append(f"note: without friction ({names}), which may hold positions beside these")
    if found.speeds_left_out:
        names = ", ".join(found.speeds_left_out)
        notes.append(f"note: at rest, start speeds are left out ({names}); steady motion: `linearize`")
    return notes
