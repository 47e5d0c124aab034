"""A run at any time: between its samples as the method's continuous extension tells, at events on either side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from multibody_sym.errors import InputError
from multibody_sym.motion.loop.integrate import integrate
from multibody_sym.motion.loop.problem import Begun, SampleTimes
from multibody_sym.motion.prepare.records import LegSamples
from multibody_sym.motion.results.integrals import NEVER, FineLeg
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.numbers import floats

_ROUNDED: Final = 1e-14
"""The part of a run's time by which a time may be beyond its end."""


def motion_at(legs: Sequence[FineLeg], until: float, t: ArrayLike, *, before: bool) -> list[LegSamples]:
    """Return the motion of a run, which lasts `until` a time, at times (m,), `before` or after events that are there.

    Raises InputError for times that do not increase, or are outside of the run.
    """
    times = _times_within(legs[0].problem.start, until, t)
    starts = np.array([leg.problem.start for leg in legs])
    places = np.searchsorted(starts, times, side="left" if before else "right") - 1
    places = places.clip(0, len(legs) - 1)
    return [_leg_at(legs[k], times[places == k]) for k in np.unique(places).tolist()]


def _times_within(start: float, end: float, t: ArrayLike) -> Floats:
    """Return times (m,) that increase within a run. Raises InputError."""
    given = np.atleast_1d(floats("t", t))
    if given.ndim != 1 or not len(given):
        raise InputError(f"a run is asked at a time or at a list of times, not at an array of shape {np.shape(t)}")
    outside = ~((given >= start) & (given <= end + _ROUNDED * abs(end)))
    if outside.any():
        raise InputError(f"t = {given[outside][0]:g} is outside of the run, which lasts from {start:g} to {end:g} s")
    if not np.all(np.diff(given) > 0.0):
        raise InputError("the times at which a run is asked increase")
    return np.minimum(given, end)


def _leg_at(leg: FineLeg, times: Floats) -> LegSamples:
    """Return the motion at times of a leg, which is integrated once more in its own steps."""
    problem, nq = leg.problem, len(leg.problem.q0)
    start, until = problem.start, leg.until
    x = np.tile(problem.x0, (len(times), 1))
    if until > start:
        between = (times > start) & (times < until)
        samples = SampleTimes((start, *times[between].tolist(), until))
        begun = None if problem.begun is None else Begun(start, 1)
        again = replace(problem, t_end=until, samples=samples, begun=begun, limiting=())
        done = integrate(replace(again, margins=(NEVER,) * len(problem.margins)))
        x[times > start] = np.concatenate([done.q_final, done.u_final])
        x[np.flatnonzero(between)[: len(done.t) - 1]] = np.hstack([done.q, done.u])[1 : 1 + between.sum()]
    return leg.sampled(times, x[:, :nq], x[:, nq:])
