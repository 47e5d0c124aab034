"""Derivation: how equations of motion came about, step by step, as data to be written out."""

from __future__ import annotations

from typing import Any, NamedTuple

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
