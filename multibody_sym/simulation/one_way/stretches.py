"""Parts of a run in one mode, and what a switch from one to the next changed."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from multibody_sym.dynamics.programs.switching import Switching
from multibody_sym.model.mechanism.mode_words import mode_words
from multibody_sym.model.mechanism.one_way import INACTIVE, Mode
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.runtime.chain import Leg
from multibody_sym.runtime.problem import Problem
from multibody_sym.simulation.along.fine import Stretch as AlongStretch
from multibody_sym.simulation.one_way.facts import Facts
from multibody_sym.simulation.one_way.modes import Key, ModeProgram, key_of
from multibody_sym.simulation.parts import Part
from multibody_sym.simulation.runs.told import Alone, Told


@dataclass(frozen=True)
class Change:
    """What a switch changed: at a time, the state of an element, or of a part of it.

    Of what was struck also its `impulse` (N s, or N m s), and the energy that was `lost` there (J). Where the laws
    leave several states of an element, `taken` is the one in which the run goes on.
    """

    time: float
    element: str
    word: str
    before: str
    impulse: float | None = None
    lost: float = 0.0
    taken: str = ""

    @property
    def told(self) -> dict[str, Any]:
        """The change as `Trajectory.events` tells it."""
        known = {"t": self.time, "kind": self.word, "element": self.element}
        known |= {"taken": self.taken} if self.taken else {}
        return known if self.impulse is None else known | {"impulse": self.impulse, "lost": self.lost}


def tell(changes: list[Change], time: float, more: Iterable[Change]) -> None:
    """Add what a switch at a time did, in the order of time: what was told to rest later does so by now."""
    late = next((k for k in reversed(range(len(changes))) if changes[k].time <= time), -1) + 1
    changes[late:] = [replace(each, time=time) for each in changes[late:]]
    changes += sorted(more, key=lambda each: each.time)


@dataclass(frozen=True, eq=False)
class Stretch:
    """A part of a run in one mode: the Programs and the problem as it began."""

    program: ModeProgram
    problem: Problem
    mode: Mode

    @property
    def parameters(self) -> list[float]:
        """The parameters (np) of the mechanism in the mode."""
        of, problem = self.program.mechanism, self.problem
        known = {entry.name: x for entry, x in zip(of.parameters, problem.parameters.tolist(), strict=True)}
        known |= zip(of.mode_numbers, problem.modes.tolist(), strict=True)  # where slip in space starts
        return [known.get(entry.name, 0.0) for entry in self.program.entered.parameters]

    def cause(self, index: int) -> Switching:
        """Return a switching function at which the mode may end, by its number."""
        cause = self.program.switchings[index]
        assert cause is not None  # others never become positive
        return cause

    def rates_at(self, at: Facts) -> tuple[Floats, Floats]:
        """Return the rates of coordinates (nq,) and speeds (nu,) in the mode."""
        rates = self.problem.rates(at.t, np.concatenate([at.q, at.u]))
        qdot, udot = np.split(rates, [len(at.q)])
        return qdot, udot

    def udot_at(self, at: Facts) -> Floats:
        """Return the accelerations (nu,) in the mode."""
        return self.rates_at(at)[1]

    def stops_at(self, t: float, x: Floats) -> Floats:
        """Return the functions of declared stops (ns,) at a state, positive where the run stops, nan for kinks."""
        count = self.problem.switches
        values = self.problem.switching(t, x)[:count]
        return np.where(self.problem.terminal[:count], values, np.nan)

    @cached_property
    def key(self) -> Key:
        """What tells the mode apart."""
        return key_of(self.mode)

    @cached_property
    def active(self) -> tuple[str, ...]:
        """The unilateral elements that are closed."""
        elements = self.program.mechanism.one_way
        return tuple(x.name for x in elements if x.unilateral and self.mode.sides.get(x.name, INACTIVE))

    @cached_property
    def words(self) -> dict[str, str]:
        """The state of each one-way element."""
        return mode_words(self.program.mechanism.one_way, self.mode)


def between_jumps(stretch: Stretch, leg: Leg, jumps: Iterable[tuple[float, Floats]]) -> Iterator[AlongStretch]:
    """Yield the parts of a stretch of a run between jumps: their times, with the states (nq + nu,) after them."""
    program, problem = stretch.program, replace(leg.problem, jump=None, course=None)
    nq, lasted = len(problem.q0), leg.until - problem.start
    for until, x in [*jumps, (leg.until, None)]:
        steps = math.ceil(leg.steps * (until - problem.start) / lasted) if lasted > 0.0 else 0
        yield AlongStretch(program.mechanism, program.compiled, problem, until, steps)
        if x is not None:
            problem = replace(problem, begun=None, t0=until, q0=x[:nq], u0=x[nq:])


def parts_of(
    stretches: Iterable[tuple[Stretch, Leg]], samples: tuple[Floats, Floats, Floats], first: int
) -> tuple[Part, ...]:
    """Return samples t, q, u, which begin with number `first` of the run, by the modes they are in."""
    found: list[Part] = []
    for stretch, leg in stretches:
        t, q, u = (each[max(leg.first - first, 0) : max(leg.end - first, 0)] for each in samples)
        if len(t) or not found:
            program = stretch.program
            told = Told(Alone(program.mechanism))
            problem = stretch.problem
            found.append(Part(told, program.compiled, problem.parameters, t, q, u, problem.modes))
    return tuple(found)
