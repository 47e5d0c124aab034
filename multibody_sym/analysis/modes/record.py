"""Modes: the small motions of a system as formulas with numbers, and their LaTeX."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import Any, Final, Literal

import sympy

from multibody_sym.algebra.writers import LatexScript
from multibody_sym.derivation.notation import dotted, latex_name
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node
from multibody_sym.scalars.sympy_bridge import to_sympy
from multibody_sym.text.values import Value

Motion = Literal["oscillates", "free", "grows", "decays"]
Matrix = Sequence[Sequence[Value]]
_SHOWN: Final = 5
_DIGITS: Final = 6


@dataclass(frozen=True)
class Mode:
    """A normal mode: its `motion`, its `frequency` omega (rad/s) and `period` (s) where it `oscillates`.

    A mode that `grows` or `decays` does so like exp(rate t); one that swings may have a `rate` too, negative where it
    is damped. A `free` one moves off uniformly. `shape`: the amplitude of each independent deviation, the first that
    moves having 1; `quarter`: that of its part a quarter of a period ahead, where gyroscopic terms turn it.
    """

    motion: Motion
    frequency: Value | None = None
    period: Value | None = None
    rate: Value | None = None
    shape: Mapping[str, Value] = field(default_factory=dict)
    quarter: Mapping[str, Value] = field(default_factory=dict)

    def as_json(self) -> dict[str, Any]:
        """Return the object that `--json` prints."""
        pairs = {"frequency": self.frequency, "period": self.period, "rate": self.rate}
        return {
            "motion": self.motion,
            **{name: None if x is None else x.as_json() for name, x in pairs.items()},
            "shape": {name: x.as_json() for name, x in self.shape.items()},
            "quarter": {name: x.as_json() for name, x in self.quarter.items()},
        }


Rows = tuple[tuple[Value, ...], ...]


@dataclass(frozen=True, repr=False)
class Modes:
    """Small motions M x'' + C x' + K x = 0 of a system about a state, x the deviations of `coordinates` (n).

    `about`: "equilibrium" or "steady motion", `at` its coordinates and speeds, `found` beside the declared start or
    not; `held`: the cyclic coordinates whose momenta are held, so that they are not among x. `mass`, `rates`,
    `stiffness`: M, C and K (n x n), empty where there are numbers of the eigenvalues alone. `modes`: those that
    oscillate first, from the lowest frequency at the declared parameters on, then others. `characteristic`: the
    polynomial whose roots are omega^2. `stable`: None where a mode is free and the others oscillate; `conditions` under
    which motions stay small, or for `stable` False under which they do not; `period`: that of the motion from the
    start, of any size, where it was asked for. `eigenvalues`: those of `linearize`, dampers included, with
    their `eigenvalue_errors`.
    """

    name: str
    coordinates: tuple[str, ...]
    about: Literal["equilibrium", "steady motion"]
    at: Mapping[str, Value]
    found: bool
    mass: Rows
    rates: Rows
    stiffness: Rows
    modes: tuple[Mode, ...]
    stable: bool | None
    conditions: tuple[str, ...] = ()
    held: tuple[str, ...] = ()
    characteristic: str = ""
    notes: tuple[str, ...] = ()
    eigenvalues: tuple[complex, ...] = ()
    eigenvalue_errors: tuple[float, ...] = ()
    period: Value | None = None

    def __repr__(self) -> str:
        told = [str(mode.frequency) for mode in self.oscillating[:_SHOWN]]
        told += ["..."] if len(self.oscillating) > _SHOWN else []
        return f"<Modes of {self.name} about its {self.about}: {', '.join(told) or 'nothing oscillates'}>"

    def _repr_latex_(self) -> str:
        """Return what a notebook shows: the equations, and the oscillating modes."""
        return r"$\displaystyle \begin{aligned}" + r" \\ ".join(self.latex_lines()) + r"\end{aligned}$"

    def latex_lines(self) -> list[str]:
        """Return M x'' + C x' + K x = 0 and each frequency with its period as aligned lines of LaTeX."""
        names, terms, lines = [latex_name(name) for name in self.coordinates], [], []
        for rows, dots in ((self.mass, "ddot"), (self.rates, "dot"), (self.stiffness, "")):
            if any(x.value for row in rows for x in row):
                matrix = _in_brackets([" & ".join(value_latex(x) for x in row) for row in rows])
                terms.append(f"{matrix} {_in_brackets([dotted(name, dots) if dots else name for name in names])}")
        if self.mass:
            lines.append(f"{' + '.join(terms)} &= 0")
        pairs = list(zip(self.frequencies, self.periods, strict=True))
        for k, (omega, duration) in enumerate(pairs, 1):
            place = f"_{{{k}}}" if len(pairs) > 1 else ""
            frequency, period = value_latex(omega, r"\mathrm{rad/s}"), value_latex(duration, r"\mathrm{s}")
            lines.append(rf"\omega{place} &= {frequency}, \quad T{place} = {period}")
        return lines

    @property
    def oscillating(self) -> tuple[Mode, ...]:
        """The modes that oscillate, from the lowest frequency on: `frequency(1)` is that of the first."""
        return tuple(mode for mode in self.modes if mode.motion == "oscillates")

    @property
    def frequencies(self) -> tuple[Value, ...]:
        """The angular frequencies of the modes that oscillate."""
        return tuple(mode.frequency for mode in self.oscillating if mode.frequency is not None)

    @property
    def periods(self) -> tuple[Value, ...]:
        """The periods of the modes that oscillate, the longest first."""
        return tuple(mode.period for mode in self.oscillating if mode.period is not None)

    def as_json(self) -> dict[str, Any]:
        """Return the object that `modes --json` prints."""
        return {
            "about": self.about,
            "found": self.found,
            "at": {name: value.as_json() for name, value in self.at.items()},
            "coordinates": list(self.coordinates),
            "held": list(self.held),
            "M": _json(self.mass),
            "C": _json(self.rates),
            "K": _json(self.stiffness),
            "modes": [mode.as_json() for mode in self.modes],
            "frequencies": [value.as_json() for value in self.frequencies],
            "periods": [value.as_json() for value in self.periods],
            "characteristic": self.characteristic or None,
            "stable": self.stable,
            "conditions": list(self.conditions),
            "notes": list(self.notes),
            "eigenvalues": [[x.real, x.imag] for x in self.eigenvalues],
            "period": None if self.period is None else self.period.as_json(),
        }


def _json(rows: Sequence[Sequence[Value]]) -> list[list[dict[str, Any]]]:
    return [[value.as_json() for value in row] for row in rows]


def value_latex(value: Value, unit: str = "") -> str:
    """Return a formula, or where there is none the number with its unit."""
    if value.expression is not None:
        return node_latex(value.expression)
    return rf"{value.value:.{_DIGITS}g}\,{unit}" if unit else f"{value.value:.{_DIGITS}g}"


def node_latex(node: Node, labels: Mapping[str, str] | None = None) -> str:
    """Return an expression; `labels` are the letters of parameters that have one."""
    book = labels or {}
    expression = to_sympy(node, {})
    letters = sorted(expression.free_symbols, key=lambda s: str(s.name))
    spelling = {s: latex_name(book.get(s.name, s.name)) for s in letters}
    script = LatexScript(spelling, {s: (2, k) for k, s in enumerate(letters)})
    return script.shown(expression) if isinstance(expression, sympy.Basic) else str(expression)


def _in_brackets(lines: Sequence[str]) -> str:
    return r"\begin{bmatrix}" + r" \\ ".join(lines) + r"\end{bmatrix}"
