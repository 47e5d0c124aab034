"""Steps that other libraries take, scipy's and SUNDIALS' through the package scikit-sundae, and events within them.

They keep a memory of their own of the way so far: nothing is put back onto constraints while they run. To IDA these are
part of the equations. The implicit ones get the exact Jacobian: a difference tells nothing of a coordinate on which
nothing depends, and scipy lengthens it until the state is no number any more. The libraries are imported when a run
asks for them.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from multibody_sym.errors import MissingPackageError
from multibody_sym.motion.integrator.events import Ends
from multibody_sym.motion.integrator.flow import (
    Events,
    Flow,
    Step,
    StepError,
    hermite,
    longest_in_modes,
    require_finite,
    scaled_norm,
)
from multibody_sym.motion.methods.table import BY_JACOBIAN, IDA, METHODS, SCIPY, Method
from multibody_sym.program.runtime_constants import REPEATS, Status
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.sign_changes import PROBE, first_seen

# ----------------------------------------------------------------------------------------------------------------------
# What begins at zero where another library begins a run in a mode: on which side it is shows only later.
#
# What opens as the force on it passes zero opens with the third power of time, and the libraries that begin at order
# one make an error of the second power in their first steps: however short these are, they may end on the wrong side.


_SOON: Final = 2.0**-20  # s


def with_tolerance(flow: Flow, events: Events, t: float, x: Floats, slope: Floats) -> Events:
    """Return events at the start (t, x) of a run in a mode: what is at zero there may be beyond it within tolerance.

    That is what a function (ng,) changes by if every component of the state changes by its tolerance. What leaves zero
    by more than that in a second, as after an impact, is on its side.
    """
    margins, own = np.array(events.margins), slice(len(events.terminal) - len(events.margins), None)
    here, scales = events.values(t, x)[own], flow.scales(x, x)
    at_zero = np.abs(here) <= margins
    if not at_zero.any():
        return events
    changes = [np.abs(events.values(t, x + scale)[own] - here) for scale in np.diag(scales)]
    wide = np.maximum(margins, np.sum(changes, axis=0))
    soon, later = (events.values(t + h, x + h * slope)[own] for h in (_SOON, 2.0 * _SOON))
    falls = (3.0 * here - 4.0 * soon + later) / (2.0 * _SOON)  # without the bend of the straight way
    stays = at_zero & ~(falls > wide)
    return replace(events, margins=tuple(np.where(stays, wide, margins).tolist()))


def once_left(events: Events, usual: Events, values: Floats) -> Events:
    """Return events of `with_tolerance` with the `usual` margins for what is as far below zero, by values (ng,)."""
    if events.margins == usual.margins:
        return events
    values = values[len(values) - len(events.margins) :]
    margins = [
        least if value < -2.0 * margin else margin  # the values are less the margins
        for value, margin, least in zip(values.tolist(), events.margins, usual.margins, strict=True)
    ]
    return replace(events, margins=tuple(margins))


_STARTERS: Final = {"BDF": "Radau", "LSODA": "Radau", "cvode_bdf": "Radau", "cvode_adams": "DOP853", IDA: "DOP853"}
"""The methods that begin at order one, and the Runge-Kutta method of scipy that takes their first steps after an event.

At order one each step errs by the tolerance, however short the flight between two impacts is.
"""
_STARTING_STEPS: Final = 8
_AT_ONCE: Final = 1e-9  # part of a way that is not worth another step
_ROUNDED: Final = 2.0**-48  # part of the state by which a function may seem to have turned
_UNCONTROLLED: Final = 1e30  # tolerance of multipliers: the error of the motion alone chooses the steps


class _Solver(Protocol):
    """A library's integration under way: at `t`, in state `x`, `t_old` before the last step."""

    t: float
    x: Floats

    def advance(self) -> None:
        """Take a step; raises StepError."""

    def value(self, t: float) -> Floats:
        """Return the state at a time within the last step."""


def _jacobian(flow: Flow) -> Callable[[float, Floats], Floats] | None:
    """Return the exact Jacobian of the derivative for a method that takes it, as far as the flow knows it."""
    stages = flow.stages
    if flow.method.name not in BY_JACOBIAN or stages is None:
        return None

    def jacobian(t: float, x: Floats) -> Floats:
        flow.counts.jacobians += 1
        found = stages.jacobian(t, np.array(x))
        _require_slopes(found, t)
        return found

    return jacobian


def _require_slopes(jacobian: Floats, t: float) -> None:
    """Raise StepError with the first row that is not finite: no library says more of it than that it stops."""
    finite = np.isfinite(jacobian).all(axis=1)
    if not finite.all():
        raise StepError(Status.NO_SLOPE, t, int(np.argmin(finite)))


def _step_after_event(flow: Flow, t: float, x: Floats) -> float | None:
    """Return a step short enough for what begins at an event, of which a long one would see nothing; None: any.

    A method that begins at order one errs by the second power of the step, others by the third at most.
    """
    power = 2.0 if flow.method.name in _STARTERS else 3.0
    scales, slope = flow.scales(x, x), flow.slope(t, x)
    size, speed = scaled_norm(x, scales), scaled_norm(slope, scales)
    soon = _SOON * (size / speed if speed > 0.0 else flow.t_end - t)
    bend = scaled_norm(flow.slope(t + soon, x + soon * slope) - slope, scales) / soon if soon > 0.0 else 0.0
    return min(math.pow(0.01 / bend, 1.0 / power), flow.t_end - t) if bend > 0.0 else None


class _Scipy:
    def __init__(self, flow: Flow, t: float, x: Floats, most: float) -> None:
        import scipy.integrate

        make, jacobian = getattr(scipy.integrate, flow.method.name), _jacobian(flow)
        known: dict[str, Any] = {"max_step": most} if jacobian is None else {"max_step": most, "jac": jacobian}
        if t > flow.t0:
            known["first_step"] = _step_after_event(flow, t, x)
        self.solver: Any = make(flow.slope, t, x, flow.t_end, rtol=flow.rtol, atol=flow.atol, **known)
        self.t, self.x = t, x
        self.dense: Callable[[float], Floats] | None = None

    def advance(self) -> None:
        self.solver.step()
        if self.solver.status == "failed":
            raise StepError(Status.STEP_UNDERFLOW, self.t, -1)
        self.t, self.x, self.dense = float(self.solver.t), np.array(self.solver.y), None

    def value(self, t: float) -> Floats:
        if self.dense is None:
            self.dense = self.solver.dense_output()
        return np.array(self.dense(t))


def _sundials(module: str, method: Method) -> Any:
    try:
        return importlib.import_module(f"sksundae.{module}")
    except ImportError:
        raise MissingPackageError(
            f"method {method.name} needs SUNDIALS: pip install 'multibody-sym[sundials]'"
        ) from None


def _onestep(solver: Any, t: float, t_end: float) -> Any:
    """Return what SUNDIALS' next step from time t came to; asked for a state within one, it returns its end first."""
    for _ in range(2):
        done = solver.step(t_end, method="onestep", tstop=t_end)
        if not done.success:
            raise StepError(Status.STEP_UNDERFLOW, t, -1)
        if done.t > t:
            return done
    raise StepError(Status.STEP_UNDERFLOW, t, -1)


class _Cvode:
    def __init__(self, flow: Flow, t: float, x: Floats, most: float) -> None:
        CVODE = _sundials("cvode", flow.method).CVODE
        self.flow = flow
        family = flow.method.name.removeprefix("cvode_")
        self.exact = _jacobian(flow)
        known: dict[str, Any] = {} if self.exact is None else {"jacfn": self.jacobian}
        self.solver = CVODE(
            self.slope,
            method={"adams": "Adams", "bdf": "BDF"}[family],
            rtol=flow.rtol,
            atol=flow.atol,
            max_step=_unless_infinite(most),
            **known,
        )
        self.solver.init_step(t, x)
        self.t, self.x = t, x

    def slope(self, t: float, x: Floats, into: Floats) -> None:
        into[:] = self.flow.slope(t, np.array(x))

    def jacobian(self, t: float, x: Floats, slope: Floats, into: Floats) -> None:
        assert self.exact is not None
        into[:] = self.exact(t, x)

    def advance(self) -> None:
        done = _onestep(self.solver, self.t, self.flow.t_end)
        self.t, self.x = float(done.t), np.array(done.y)

    def value(self, t: float) -> Floats:
        return np.array(self.solver.step(t).y)


class _Ida:
    """E y' = f(t, y) of `StageEquations`, with those rows and multipliers that are independent at the start."""

    def __init__(self, flow: Flow, t: float, x: Floats, most: float) -> None:
        assert flow.stages is not None
        IDA = _sundials("ida", flow.method).IDA
        self.equations, self.flow, self.size = flow.stages, flow, len(x)
        self.whole = np.concatenate([x, self.equations.multipliers(t, x)])
        kept = self.equations.kept(self.equations.jacobian(t, self.whole))
        self.active = [*range(self.size), *(self.size + k for k in kept)]
        y = self.whole[self.active]
        self.solver = IDA(
            self.residual,
            jacfn=self.jacobian,
            algebraic_idx=[*range(self.size, len(y))] or None,
            rtol=flow.rtol,
            atol=np.array([flow.atol] * self.size + [_UNCONTROLLED] * len(kept)),
            max_step=_unless_infinite(most),
        )
        rates = self.values(t, y)
        rates[self.size :] = 0.0
        self.solver.init_step(t, y, rates)
        self.t, self.x = t, x

    def values(self, t: float, y: Floats) -> Floats:
        self.whole[self.active] = y
        values = self.equations.values(t, self.whole)[self.active]
        require_finite(values, t)
        return values

    def residual(self, t: float, y: Floats, rates: Floats, into: Floats) -> None:
        into[:] = self.values(t, y)
        into[: self.size] -= rates[: self.size]

    def jacobian(self, t: float, y: Floats, rates: Floats, residual: Floats, cj: float, into: Floats) -> None:
        self.flow.counts.jacobians += 1
        self.whole[self.active] = y
        found = self.equations.jacobian(t, self.whole)[np.ix_(self.active, self.active)]
        _require_slopes(found[: self.size], t)
        into[:] = found
        into[range(self.size), range(self.size)] -= cj

    def advance(self) -> None:
        done = _onestep(self.solver, self.t, self.flow.t_end)
        self.t, self.x = float(done.t), np.array(done.y[: self.size])

    def value(self, t: float) -> Floats:
        return np.array(self.solver.step(t).y[: self.size])


def _unless_infinite(most: float) -> float:
    """Return the longest step as SUNDIALS takes it: 0 where there is none."""
    return most if most < math.inf else 0.0


class _Started:
    """A method that begins at order one, after some steps of its starter.

    Just before a jump the implicit starter finds no stages, their first guess is of the near side: the method begins.
    """

    def __init__(self, flow: Flow, t: float, x: Floats, most: float) -> None:
        self.flow, self.most, self.left = flow, most, _STARTING_STEPS
        self.solver: _Solver = _Scipy(replace(flow, method=METHODS[_STARTERS[flow.method.name]]), t, x, most)
        self.t, self.x = t, x

    def advance(self) -> None:
        if not self._advance_starter():
            if self.left == 0:
                self.left, self.solver = -1, _by_method(self.flow, self.t, self.x, self.most)
            self.solver.advance()
        self.t, self.x = self.solver.t, self.solver.x

    def _advance_starter(self) -> bool:
        """Take one of the starter's steps; False if none is left or it finds none."""
        if self.left <= 0:
            return False
        self.left -= 1
        try:
            self.solver.advance()
        except StepError:
            self.left = 0
            return False
        return True

    def value(self, t: float) -> Floats:
        return self.solver.value(t)


def _by_method(flow: Flow, t: float, x: Floats, most: float) -> _Solver:
    package: str = getattr(flow.method, "package", SCIPY)
    if package == SCIPY:
        return _Scipy(flow, t, x, most)
    return _Ida(flow, t, x, most) if flow.method.name == IDA else _Cvode(flow, t, x, most)


def _open_solver(flow: Flow, t: float, x: Floats) -> _Solver:
    most = math.inf
    if flow.events is not None and flow.events.margins:
        most = longest_in_modes(flow.lasts, flow.slope(t, x))
    make = _Started if t > flow.t0 and flow.method.name in _STARTERS else _by_method
    return make(flow, t, x, most)


def library_steps(flow: Flow) -> Iterator[Step]:
    """Yield the steps that the library takes; one with an event in it ends there, and the next one starts afresh.

    What crosses within a step may have bent it: steps are taken again from its start to the crossing.
    Raises StepError and MissingPackageError.
    """
    crossing = _Crossing(flow, flow.start, flow.x0, flow.slope(flow.start, flow.x0))
    t, x, bound, again = flow.start, flow.x0, flow.t_end, 0
    solver = _open_solver(flow, t, x)
    while t < flow.t_end:
        solver.advance()
        sides = crossing.sides
        t_new, event = crossing.first(flow, t, x, solver)
        met = t_new < solver.t or event is not None
        if met and again < REPEATS and t_new - t > _AT_ONCE * abs(t) and bound - t_new > _AT_ONCE * (bound - t):
            crossing.sides, bound, again = sides, t_new, again + 1
            solver = _open_solver(replace(flow, t_end=bound), t, x)
            continue
        t_new = solver.t if event is None else t_new
        x_new = solver.x if t_new == solver.t else solver.value(t_new)
        crossing.passed(t_new, x_new)
        yield _step(flow, solver, t, x, t_new, x_new, event)
        if event is not None and crossing.terminal[event]:
            return
        if event is not None or (t_new == bound and bound < flow.t_end):
            bound, again = flow.t_end, 0 if event is not None else again
            solver = _open_solver(flow, t_new, x_new)
        t, x = t_new, x_new


def _step(flow: Flow, solver: _Solver, t: float, x: Floats, t_new: float, x_new: Floats, event: int | None) -> Step:
    settled = x_new if flow.settle is None else flow.settle(t_new, x_new)
    h = t_new - t
    return Step(t, x, h, t_new, settled, np.empty(0), lambda theta: solver.value(t + theta * h), event=event)


class _Crossing:
    """The sides of zero on which switching functions were last seen; one that is zero at the start has none yet.

    Those of a mode that start beyond zero and turn back have `turned`: they may not exceed these values (ng,), infinite
    for all others, until they have been below zero.
    """

    def __init__(self, flow: Flow, t: float, x: Floats, slope: Floats) -> None:
        self.usual = self.events = events = flow.events
        self.terminal = np.array(events.terminal if events else (), dtype=bool)
        self.sides = events.sides(t, x) if events else np.zeros(0)
        self.turned = np.full(len(self.sides), math.inf)
        if events and events.margins:  # what has just bounced is on its way back
            here, soon = events.beyond(t, x), events.beyond(t + _SOON, x + _SOON * slope)
            back = (here > 0.0) & (soon < here)
            self.sides[back] = 1.0
            back[: len(back) - len(events.margins)] = False
            self.turned[back] = here[back] + _ROUNDED * max(1.0, float(np.abs(x).max(initial=0.0)))
            self.events = with_tolerance(flow, events, t, x, slope)

    def passed(self, t: float, x: Floats) -> None:
        """Tell of the end of a step that was taken: what has left zero there may not exceed it any more."""
        if self.events is not None and self.usual is not None and self.events is not self.usual:
            self.events = once_left(self.events, self.usual, self.events.beyond(t, x))

    def first(self, flow: Flow, t: float, x: Floats, solver: _Solver) -> tuple[float, int | None]:
        """Return where the step from (t, x) ends: at the first function that crosses in it, or at its end.

        Without a function: something may have crossed by that time, as the library's way between the ends is bent.
        """
        if self.events is None:
            return solver.t, None
        end, values = solver.t, self.events.beyond(solver.t, solver.x)
        crossed, event = self._crossed(values), None
        if len(crossed):
            end, event = self._earliest(crossed, t, end, solver)
        seen = self._seen(flow, t, x, solver, end, crossed)
        if seen < end:
            crossed, end, event = self._crossed(self._at(seen, solver)), seen, None
            if len(crossed):
                end, event = self._earliest(crossed, t, seen, solver)
        elif event is None and len(returned := np.flatnonzero((self.sides > 0.0) & (values > self.turned))):
            end, event = min((self._time(int(i), t, end, solver), int(i)) for i in returned)
        if event is None:
            self.sides = np.where(values == 0.0, self.sides, np.sign(values))
            return end, None
        here = self.events.beyond(end, solver.value(end))
        sides = np.where(here == 0.0, self.sides, np.sign(here))
        sides[event] = -self.sides[event]
        self.sides = sides
        return end, event

    def _earliest(self, crossed: NDArray[np.intp], t: float, end: float, solver: _Solver) -> tuple[float, int]:
        """Return when the first of functions crosses that have crossed at a time `end`, and which.

        Where a force jumps what stops the run may cross with it: it comes first.
        """
        times = {int(i): self._time(int(i), t, end, solver) for i in crossed}
        event = min(times, key=lambda i: times[i])
        here = self._crossed(self._at(times[event], solver))
        return times[event], int(next(iter(here[self.terminal[here]]), event))

    def _crossed(self, values: Floats) -> NDArray[np.intp]:
        """Return which functions have crossed: a stop upwards, a kink in both directions."""
        return np.flatnonzero((self.sides * values < 0.0) & (~self.terminal | (values > 0.0)))

    def _at(self, time: float, solver: _Solver) -> Floats:
        assert self.events is not None
        return self.events.beyond(time, solver.x if time == solver.t else solver.value(time))

    def _seen(self, flow: Flow, t: float, x: Floats, solver: _Solver, end: float, crossed: NDArray[np.intp]) -> float:
        """Return the first time before `end` at which something has crossed that has not there; `end` if nothing has.

        It is looked for on the library's way, and on the cubic that nothing between the ends can bend, from each moment
        to the next.
        """
        assert self.events is not None
        h, values_at = solver.t - t, self.events.beyond
        slopes = flow.slope(t, x), flow.slope(solver.t, solver.x)

        def along(time: float) -> Floats:
            return values_at(time, hermite(x, slopes[0], solver.x, slopes[1], h, (time - t) / h))

        for start, stop in pairwise(self._moments(t, end)):
            ways = (along, lambda time: self._at(time, solver))
            seen = min(self._first_seen(way, start, stop, crossed, t, x) for way in ways)
            if seen < stop:
                return seen
        return end

    def _moments(self, t: float, end: float) -> list[float]:
        """Return two times and the moments between them."""
        assert self.events is not None
        found = [t]
        while found[-1] + (way := self.events.to_moment(found[-1])) < end:
            found.append(found[-1] + way)
        return [*found, end]

    def _first_seen(
        self, way: Callable[[float], Floats], begin: float, end: float, crossed: NDArray[np.intp], t: float, x: Floats
    ) -> float:
        """Return the first time before `end` at which something has crossed on a way from (t, x); `end` if nothing has.

        As long as time does not move, everything is on its side, whatever round-off says. So counts a stop above zero
        that comes back there from below.
        """
        assert self.events is not None
        h, least = end - begin, float(np.spacing(abs(begin)))
        start, after, before, values = (way(begin + part * h) for part in (0.0, PROBE, 1.0 - PROBE, 1.0))
        self.sides = np.where(self.sides == 0.0, np.sign(after), self.sides)
        sides, high = self.sides, 1.0
        ends = Ends(np.maximum(sides * start, 0.0), sides * after, sides * before, sides * values)
        looked = ends.uncertain() & ~(self.terminal & (sides > 0.0) & (values < 0.0))
        looked[crossed] = False
        for index in np.flatnonzero(looked).tolist():

            def value(theta: float, i: int = index) -> float:
                found = float(sides[i] * way(begin + theta * h)[i])
                return max(found, 0.0) if theta * h <= least else found

            seen = first_seen(value, *ends.looks(index), self.events.unseen(index, t, x))
            high = high if seen is None else min(high, seen)
        return begin + high * h if high < 1.0 else end

    def _time(self, index: int, t: float, end: float, solver: _Solver) -> float:
        """Return where a function that has crossed at `end` does, within round-off, on the far side.

        Steps that start before a jump that is theirs at once find no stages: their first guess is of the near side.
        """
        from scipy.optimize import brentq

        if not t < end:
            return end
        side, level = float(self.sides[index]), 0.0
        if side > 0.0 and self.turned[index] < math.inf:  # it has not been below zero
            side, level = -1.0, float(self.turned[index])
        size = abs(float(self._at(end, solver)[index]) - level)

        def g(time: float) -> float:
            value = float(self._at(time, solver)[index]) - level if time > t else side * size
            return value or side * 1e-300  # at zero, and at the start, still on its side, whatever round-off says

        found = float(brentq(g, t, end, xtol=4e-16 * max(1.0, abs(end)), rtol=1e-15))
        further = float(np.spacing(abs(found)))
        while found < end and not side * g(found) < 0.0:
            found, further = min(found + further, end), 2.0 * further
        return found
