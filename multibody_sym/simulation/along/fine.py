"""Stretches of a run in fine samples, and integrals over them.

Between two events nothing jumps. A stretch is run once more with four places in each of many pieces, over which the
polynomial through five places is integrated (Boole's rule at their ends).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from multibody_sym.integrators.flow import LEAST_STEPS
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.numerics.arrays import Floats
from multibody_sym.program.program import Program
from multibody_sym.records import dataclass
from multibody_sym.runtime.integration import Integration, integrate
from multibody_sym.runtime.loading import Backend, Compiled, load
from multibody_sym.runtime.problem import Problem
from multibody_sym.simulation.parts import Part
from multibody_sym.simulation.runs.told import Alone, Told

NEVER: Final = 1e300
"""A margin that no switching function exceeds."""
LEAST, IN_MODES, PIECES = 1024, 64, 4
"""The fewest pieces of a whole run, of a stretch in one of many modes, and of a step: those of order 8 are long."""
MOST_PIECES: Final = 100_000
"""Of a stretch: a stiff run takes millions of steps, and as many samples would fill the memory."""
BESIDE: Final = 1e-12
"""The part of a stretch beside a kink that is left out: there the force is that of either side."""
MOST_KINKS: Final = 1000
"""Kinks of a stretch that are told apart."""
_NODES: Final = np.linspace(0.0, 1.0, 5)
_POWERS: Final = np.arange(1, 6)
_MONOMIALS: Final = np.linalg.inv(np.vander(_NODES, increasing=True))


@dataclass(frozen=True, eq=False)
class Stretch:
    """A part of a run in one mode: its Programs, its problem, until when, in how many steps."""

    mechanism: Mechanism
    compiled: Compiled
    problem: Problem
    until: float
    steps: int

    @property
    def duration(self) -> float:
        """How long it lasts."""
        return self.until - self.problem.start

    @property
    def middle(self) -> float:
        """The time in its middle."""
        return self.problem.start + self.duration / 2

    def fine(self, finer: int = 1) -> Part:
        """Return evenly spaced samples, one more than four times a number of pieces; `finer` times as many."""
        least = LEAST if self.mechanism.mode is None else IN_MODES
        pieces = min(finer * (max(least, PIECES * self.steps) + 1 & ~1), MOST_PIECES)
        problem = self.problem
        run = self._run(self.until, 4 * pieces + 1)
        count = 4 * ((len(run.t) - 1) // 4) + 1
        told = Told(Alone(self.mechanism))
        return Part(told, self.compiled, problem.parameters, run.t[:count], run.q[:count], run.u[:count], problem.modes)

    def _run(self, until: float, samples: int) -> Integration:
        """Run from the beginning until a time once more, whatever the mode's switching functions say."""
        problem = self.problem
        whole = min(problem.lasts, LEAST_STEPS / IN_MODES * (until - problem.start))
        problem = replace(problem, t0=problem.start, t_end=until, samples=samples, begun=None, whole=whole)
        return integrate(replace(problem, margins=(NEVER,) * len(problem.margins), limiting=()))

    def at(self, time: float) -> tuple[Floats, Floats]:
        """Return q and u that it reaches at a time, those at its beginning for one before."""
        if time <= self.problem.start:
            return self.problem.q0, self.problem.u0
        reached = self._run(time, 2)
        return reached.q_final, reached.u_final

    def cut(self, *times: float) -> list[Stretch]:
        """Return the parts before, between and behind times, each from the state that the one before it reaches."""
        found, rest = list[Stretch](), self
        for time in times:
            if rest.problem.start < time < rest.until:
                reached = rest._run(time, 2)
                steps = max(1, reached.statistics.steps)
                found.append(replace(rest, until=time, steps=steps))
                begin = replace(self.problem, t0=time, q0=reached.q_final, u0=reached.u_final, begun=None)
                rest = replace(rest, problem=begin, steps=max(1, rest.steps - steps))
        return [*found, rest]

    def smooth_parts(self) -> list[Stretch]:
        """Return the parts between kinks, at which forces bend or jump; they end and begin just beside them.

        A kink may end a mode: then the last one ends just before it.
        """
        problem = self.problem
        if all(problem.terminal[: problem.switches]):
            return [self]
        beside, found, rest, end = BESIDE * self.duration, [], self, self.until
        kinks = [event.time for event in self._run(end + beside, 2).events if not event.terminal]
        for time in kinks if len(kinks) <= MOST_KINKS else ():
            before, after = time - beside, time + beside
            if before <= rest.problem.start:
                continue
            if after >= end:
                end = before
                break
            reached = rest._run(after, 2)
            steps = reached.statistics.steps
            found.append(replace(rest, until=before, steps=max(1, steps)))
            begin = replace(problem, t0=after, q0=reached.q_final, u0=reached.u_final, begun=None)
            rest = replace(rest, problem=begin, steps=max(1, rest.steps - steps))
        return [*found, replace(rest, until=end)]


def integral(values: Floats, t: Floats) -> Floats:
    """Return the integrals (pieces + 1, ...) of values (4 pieces + 1, ...) from the first time to the end of pieces."""
    pieces = (len(t) - 1) // 4
    weights = integrated(1.0)
    of_piece = sum(weights[k] * values[k : 4 * pieces + k : 4] for k in range(4)) if pieces else values[:0]
    of_piece = of_piece + weights[4] * values[4 : 4 * pieces + 1 : 4] if pieces else of_piece
    lengths = (t[4::4] - t[:-4:4]).reshape(-1, *(1,) * (values.ndim - 1))
    found: Floats = np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(of_piece * lengths, axis=0)])
    return found


def integrated(part: float) -> Floats:
    """Return the weights (5) of a piece's values in the integral over its first part."""
    found: Floats = (part**_POWERS / _POWERS) @ _MONOMIALS
    return found


def integral_until(times: Floats, values: Floats, t: Floats) -> Floats:
    """Return the integrals (times, ...) of values at t (4 pieces + 1) from the first of t until each of some times."""
    found = np.zeros((len(times), *values.shape[1:]))
    whole, ends = integral(values, t), t[::4]
    for k, time in enumerate(times):
        piece = int(np.clip(np.searchsorted(ends, time, side="right") - 1, 0, max(len(ends) - 2, 0)))
        found[k] = whole[piece]
        if len(ends) > 1:
            length = ends[piece + 1] - ends[piece]
            weights = integrated(float(np.clip((time - ends[piece]) / length, 0.0, 1.0))) * length
            found[k] += np.tensordot(weights, values[4 * piece : 4 * piece + 5], axes=1)
    return found


def with_program(
    stretches: Sequence[Stretch], make: Callable[[Mechanism], Program], backend: Backend | None = None
) -> Iterator[tuple[Stretch, Compiled]]:
    """Yield what lasts of stretches, in parts between kinks, with the Program that is made of the mechanism of each."""
    programs: dict[int, Compiled] = {}
    for stretch in stretches:
        if stretch.duration <= 0.0:
            continue
        key = id(stretch.mechanism)
        if key not in programs:
            made = make(stretch.mechanism)
            programs[key] = load({made.name: made}, backend=backend or stretch.compiled.likewise)
        yield from ((part, programs[key]) for part in stretch.smooth_parts())
