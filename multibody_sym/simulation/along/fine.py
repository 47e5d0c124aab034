"""Stretches of a run in fine samples, and integrals over them.

Between two events nothing jumps. A stretch is run once more with four places in each of many pieces, over which the
polynomial through five places is integrated (Boole's rule at their ends).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Final

import numpy as np

from multibody_sym.integrators.flow import longest_in_modes
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
_LEAST_BESIDE: Final = 1e-14
"""The least part of a time that is left out: kinks are found to rounding."""
MOST_KINKS: Final = 1000
"""Kinks of a stretch that are told apart."""
_NODES: Final = np.linspace(0.0, 1.0, 5)
_POWERS: Final = np.arange(1, 6)
_MONOMIALS: Final = np.linalg.inv(np.vander(_NODES, increasing=True))


@dataclass(frozen=True, eq=False)
class FineLeg:
    """A part of a run in one mode: its Programs, its problem, until when, in how many steps.

    It is looked at in some pieces `per_step`; `near`: no step is longer than a piece then, so that samples lie as near
    to the motion as the ends of steps.
    """

    mechanism: Mechanism
    compiled: Compiled
    problem: Problem
    until: float
    steps: int
    per_step: int = PIECES
    near: bool = False

    @property
    def duration(self) -> float:
        """How long it lasts."""
        return self.until - self.problem.start

    @property
    def pieces(self) -> int:
        """How many pieces its steps ask for, which is even."""
        least = LEAST if self.mechanism.mode is None else IN_MODES
        return max(least, self.per_step * self.steps) + 1 & ~1

    def fine(self, pieces: int | None = None) -> Part:
        """Return evenly spaced samples, one more than four times a number of pieces.

        These are `pieces`, if any are given, and half as many as it takes steps at least.
        """
        pieces = min(pieces or self.pieces, MOST_PIECES)
        run = vars(self).pop("sampled", None)
        if run is None or len(run.t) != 4 * pieces + 1:
            run = self._run(self.until, pieces)
        if 2 * pieces < min(run.statistics.steps, MOST_PIECES):
            return self.fine(run.statistics.steps + 1 & ~1)
        vars(self).setdefault("end", (run.q_final, run.u_final))
        count = 4 * ((len(run.t) - 1) // 4) + 1
        return self.sampled(run.t[:count], run.q[:count], run.u[:count])

    def sampled(self, t: Floats, q: Floats, u: Floats) -> Part:
        """Return samples at times t (m,) in its mode, of q (m, nq) and u (m, nu)."""
        given = self.problem
        return Part(Told(Alone(self.mechanism)), self.compiled, given.parameters, t, q, u, given.modes)

    @cached_property
    def end(self) -> tuple[Floats, Floats]:
        """The state q, u that it reaches, which fine samples find as well."""
        return self.at(self.until, 1)

    def _run(self, until: float, pieces: int) -> Integration:
        """Run until a time with four samples in each piece, and one."""
        return self._to(until, 4 * pieces + 1, pieces if self.near else IN_MODES)

    def _to(self, until: float, samples: int, steps: int) -> Integration:
        """Run from the beginning until a time once more, whatever the mode's switching functions say.

        No step is longer than one of `steps` evenly spaced ones.
        """
        problem = self.problem
        part = longest_in_modes(1.0, problem.rates(problem.start, problem.x0))
        whole = min(problem.lasts, (until - problem.start) / (steps * part))
        problem = replace(problem, t0=problem.start, t_end=until, samples=samples, begun=None, whole=whole)
        return integrate(replace(problem, margins=(NEVER,) * len(problem.margins), limiting=()))

    def at(self, time: float, steps: int = IN_MODES) -> tuple[Floats, Floats]:
        """Return q and u that it reaches at a time in at least some steps, those at its beginning for one before."""
        if time <= self.problem.start:
            return self.problem.q0, self.problem.u0
        reached = self._to(time, 2, steps)
        return reached.q_final, reached.u_final

    def part(self, begin: float, until: float, q: Floats, u: Floats) -> FineLeg:
        """Return the part of it that begins with a state, with its share of the steps."""
        steps = math.ceil(self.steps * (until - begin) / self.duration)
        problem = replace(self.problem, t0=begin, q0=q, u0=u, begun=None)
        return replace(self, problem=problem, until=until, steps=max(1, steps))

    def halves(self) -> list[FineLeg]:
        """Return both halves, or itself if no time lies between its ends."""
        start, middle = self.problem.start, self.until - self.duration / 2
        if not start < middle < self.until:
            return [self]
        first = replace(self, until=middle, steps=max(1, self.steps // 2))
        return [first, self.part(middle, self.until, *self.at(middle))]

    def smooth_parts(self, pieces: int | None = None) -> Iterator[FineLeg]:
        """Yield the parts between kinks, at which forces bend or jump; they end and begin just beside them.

        A kink may end a mode: then the last one ends just before it. Without kinks it is that one itself, of which
        samples in `pieces` are known then.
        """
        problem = self.problem
        if all(problem.terminal[: problem.switches]):
            yield self
            return
        beside, rest, end = max(BESIDE * self.duration, _LEAST_BESIDE * abs(self.until)), self, self.until
        run = self._run(end + beside, min(pieces or self.pieces, MOST_PIECES))
        kinks = [event.time for event in run.events if not event.terminal]
        if not kinks:
            vars(self)["sampled"] = run  # of which the last one is behind the end by rounding
        for time in kinks if len(kinks) <= MOST_KINKS else ():
            before, after = time - beside, time + beside
            if before <= rest.problem.start:
                continue
            if after >= end:
                end = before
                break
            part = rest.part(rest.problem.start, before, rest.problem.q0, rest.problem.u0)
            yield part
            across = self.part(before, after, *part.end)
            rest = self.part(after, end, *across.end)
        yield rest if end == self.until else rest.part(rest.problem.start, end, rest.problem.q0, rest.problem.u0)


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
    stretches: Sequence[FineLeg], make: Callable[[Mechanism], Program], backend: Backend | None = None
) -> Iterator[tuple[FineLeg, Compiled]]:
    """Yield what lasts of stretches with the Program that is made of the mechanism of each."""
    programs: dict[int, Compiled] = {}
    for stretch in stretches:
        if stretch.duration <= 0.0:
            continue
        key = id(stretch.mechanism)
        if key not in programs:
            made = make(stretch.mechanism)
            programs[key] = load({made.name: made}, backend=backend or stretch.compiled.likewise)
        yield stretch, programs[key]
