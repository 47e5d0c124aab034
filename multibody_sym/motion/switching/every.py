"""Whether one set of Programs serves a run in all its modes, each of which is data then."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from multibody_sym.dynamics.formalisms.equations import massless_speeds
from multibody_sym.dynamics.programs.repeated_contacts import alike_rows
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.modes import every_row, functions, in_every_mode
from multibody_sym.model.settings import Settings
from multibody_sym.motion.prepare.settings import form_of
from multibody_sym.motion.switching.rare_contacts import ThinBar, with_one_side, with_tips
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

_MOST_ROWS: Final = 24
"""Rows up to which all are computed wherever one acts; of more, few act at a time."""
_MOST_WITH_KINDS: Final = 256
"""The same beside contacts that are derived by kinds and computed where they act, these among them."""
_MOST_BY_KINDS: Final = 25_000
"""Those of contacts by kinds alone: tables of so many take a minute."""
_MOST_ENTRIES: Final = 12
"""Elements of G^-1 for each row up to which they are computed: a robot on four feet has 117 and 12 rows, a row of
eleven rods with one contact 94, which took twice the time."""
_FORMS: Final = ("explicit", "multistep")
"""What methods ask for that take the derivative alone."""


@dataclass(frozen=True)
class LawMechanism:
    """A mechanism in no mode as runs take it: points meet points, and bars have one side; `bars` are those.

    `every` is the same `in_every_mode` where one set of Programs serves all its modes, else None.
    """

    declared: Mechanism
    bars: tuple[ThinBar, ...]
    every: Mechanism | None

    @property
    def functions(self) -> int:
        """The number of the switching functions of all modes."""
        return 0 if self.every is None else len(functions(self.every))

    def numbers(self, mechanism: Mechanism, parameters: Floats) -> tuple[Floats, Floats]:
        """Return the parameters (np,) of Programs of all modes by those of a mechanism in a mode, and no mode (nm,)."""
        assert self.every is not None
        known = {entry.name: x for entry, x in zip(mechanism.parameters, parameters.tolist(), strict=True)}
        values = [known.get(entry.name, 0.0) for entry in self.every.parameters]
        return np.array(values, dtype=float), np.zeros(len(self.every.mode_numbers))

    @staticmethod
    def of(declared: Mechanism, settings: Settings) -> LawMechanism:
        """Return the mechanism of a run of a declared one by some settings."""
        taken, bars = with_one_side(with_tips(declared))
        by_derivative = form_of(settings, constrained=True, varies=True) in _FORMS
        if not by_derivative or not _serves_all_modes(taken):
            return LawMechanism(taken, bars, None)
        every = in_every_mode(taken)
        return LawMechanism(replace(taken, parameters=every.parameters), bars, every)


def _serves_all_modes(declared: Mechanism) -> bool:
    """Return whether one set of Programs serves all modes.

    Not where rows hold what has no mass, there are so many that few of them act at a time, or chains so long, with so
    few rows, that G^-1 takes longer than the motion itself.
    """
    rows, alike = len(every_row(declared)), alike_rows(declared)
    few = rows <= (_MOST_WITH_KINDS if alike else _MOST_ROWS)
    few = few or (rows - alike <= _MOST_ROWS and rows <= _MOST_BY_KINDS)
    entries, before = 0, list[int]()  # of G^-1: those of speeds and of the speeds before them in the tree
    for body in declared.bodies:
        above = before[body.parent] if body.parent >= 0 else 0
        before.append(above + len(body.u))
        entries += len(body.u) * above + len(body.u) * (len(body.u) + 1) // 2
    few = few and entries <= _MOST_ENTRIES * rows
    return few and not declared.minimum_norm and not massless_speeds(declared)
