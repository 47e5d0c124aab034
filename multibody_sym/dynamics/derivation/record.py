"""Derivation: how equations of motion came about, step by step, as data to be written out."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import replace
from typing import Any, Final, NamedTuple

from multibody_sym.records import dataclass


class Label(NamedTuple):
    """Something with a fixed spelling, such as a symbol or dT/dq: as text and as LaTeX."""

    text: str
    latex: str


@dataclass(frozen=True)
class Equation:
    """left = right; the left side is a label or an expression, the right side an expression or a matrix (sympy)."""

    left: Any
    right: Any


@dataclass(frozen=True)
class Step:
    """One step: its title, its equations, and a note."""

    title: str
    equations: tuple[Equation, ...] = ()
    note: str = ""


Derivation = tuple[Step, ...]


def with_free_letters(steps: Derivation, taken: Collection[str]) -> Derivation:
    """Return steps in which no letter of a function or matrix, such as T, V and H, is one that the model has `taken`.

    Such a letter is followed by _, and calligraphic in LaTeX; the p that stands for any momentum in notes is p_k.
    """
    letters = [letter for letter in _LETTERS if letter in taken]
    if not letters and "p" not in taken:
        return steps
    for letter in letters:
        free = letter
        while free in taken:
            free += "_"
        steps = tuple(_relettered(step, letter, free) for step in steps)
    if "p" in taken:
        steps = tuple(replace(step, note=_put(step.note, "p", "p_k")) for step in steps)
    return steps


_LETTERS: Final = ("T", "V", "D", "R", "H", "L", "M", "C", "f")
_FUNCTION: Final = re.compile(r"(d/dt )?(\(N\^T )?d?([A-Zf])(?=$|/d)")


def _relettered(step: Step, letter: str, free: str) -> Step:
    """Return a step in which a function or matrix has another letter."""
    equations = tuple(
        replace(x, left=_spelt(x.left, letter, free)) if isinstance(x.left, Label) else x for x in step.equations
    )
    title = re.sub(rf"(Gradient of ){letter}$", rf"\g<1>{free}", step.title)
    return replace(step, title=title, equations=equations, note=_put(step.note, letter, free))


def _spelt(label: Label, letter: str, free: str) -> Label:
    found = _FUNCTION.match(label.text)
    if found is None or found[3] != letter:
        return label
    latex = re.sub(rf"(\\partial |^){letter}(?![A-Za-z_])", rf"\g<1>\\mathcal{{{letter}}}", label.latex)
    return Label(_put(label.text, letter, free), latex)


def _put(text: str, letter: str, free: str) -> str:
    """Return a text with another letter where one stands by itself, or as a differential: dT/du."""
    return re.sub(rf"(?<![A-Za-z_^])(d?){letter}(?![A-Za-z_])", rf"\g<1>{free}", text)
