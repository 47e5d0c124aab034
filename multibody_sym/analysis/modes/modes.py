"""`modes`: small motions about an equilibrium or a steady motion as formulas; periods of motions of any amplitude.

Period and action are found by quadrature for one freedom that keeps its energy, else from runs.

A coordinate that swings turns where its speed vanishes, or where an impact reverses it; its period is the time from one
turn to the next but one. One that goes around has advanced by 2 pi. Runs end at the times that were found, which are
corrected by Newton's method; the times of impacts are those of the run.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, Final

import numpy as np

from multibody_sym.analysis.linearize import At
from multibody_sym.analysis.modes.record import Modes
from multibody_sym.analysis.modes.small_motion import SmallMotion, named_with_time, period_of_drive
from multibody_sym.dynamics.start.number_checks import numbers_of
from multibody_sym.dynamics.start.start import Start
from multibody_sym.dynamics.start.state import examined_state
from multibody_sym.errors import ModelError
from multibody_sym.errors import at as under
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.energy import kinetic_energy, moved_by_time, potential_energy, working_names, works_unseen
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import motion_of, state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.argument_checks import text
from multibody_sym.model.fields import Names
from multibody_sym.model.system import System
from multibody_sym.motion.loop.integrate import COARSER, LEFT
from multibody_sym.motion.methods.table import AUTO
from multibody_sym.motion.results.trajectory import Trajectory
from multibody_sym.motion.simulate import simulate
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED
from multibody_sym.scalars.node import TWO, multiply, quantity
from multibody_sym.text.values import Value

# ----------------------------------------------------------------------------------------------------------------------
# One freedom whose energy is conserved, by quadrature: over a swing or a turn the period T is the integral of dq/u, the
# action J that of p dq, divided by 2 pi.
#
# With u^2 = 2 (E - V(q))/M(q) between turning points c - a and c + a, and q = c + a sin(s), the integrand a cos(s)/u
# is smooth and periodic in s, as 1/u is for what goes around: equal steps converge faster than any power of their
# number.


_FEWEST: Final = 32
_MOST: Final = 4096
_CONVERGED: Final = 1e-12
_BESIDE: Final = 1e-3
"""The part of a swing beside a turn, as a run tells it, within which it is looked for."""
_ROUNDED: Final = 4 * 2.3e-16
_WORTH: Final = 1e-12
"""The relative error up to which a number of runs is stated: these are good to about 1e-11."""


@dataclass(frozen=True)
class Energy:
    """The energy of one freedom, (M(q) u^2)/2 + V(q), in the motion from a start."""

    mechanism: Mechanism
    begin: Start

    @classmethod
    def of(cls, system: System, coordinate: str) -> Energy | None:
        """Return the energy of a system, None where its one freedom is another, or something does work."""
        state = examined_state(system)
        mechanism, begin = state.in_joints
        one = len(mechanism.coordinates) == len(mechanism.speeds) == 1 and not mechanism.rows
        if not one or mechanism.coordinates[0].name != coordinate or state.declared.one_way or mechanism.inputs:
            return None
        if working_names(mechanism) or works_unseen(mechanism) or moved_by_time(mechanism):
            return None
        found = cls(mechanism, begin)
        return found if found.parts(begin.q[0], 0.0)[0] == 0.0 else None

    def parts(self, q: float, u: float) -> tuple[float, float]:
        """Return kinetic and potential energy."""
        motion = motion_of(self.mechanism, state_of(self.mechanism, float, 0.0, [q], [u], list(self.begin.parameters)))
        return float(kinetic_energy(motion)), float(potential_energy(motion))

    def square(self, q: float) -> float:
        """Return u^2 at a place, negative where the motion does not come."""
        moving, stored = self.parts(q, 1.0)
        q0, u0 = self.begin.q[0], self.begin.u[0]
        first = self.parts(q0, u0)
        return (first[0] + (first[1] - stored)) / moving

    def over_period(
        self, f: Callable[[float, float], float], swung: tuple[float, float] | None
    ) -> tuple[float, float] | None:
        """Return the integral of f(q, |u|) dq over a period, and the part by which steps twice as long miss it.

        The way leads there and back between the turns that a run tells by its ends (`swung`); None: once around.
        """
        if swung is None:
            middle, half, turns = self.begin.q[0], 2.0, False
        else:
            low, high = swung
            ends = [self._turn(low, high - low, -1.0), self._turn(high, high - low, 1.0)]
            if ends[0] is None or ends[1] is None:
                return None
            middle, half = (ends[0] + ends[1]) / 2, (ends[1] - ends[0]) / 2
            turns = True

        def integrand(s: float) -> float:
            q = middle + half * (math.sin(s) if turns else s)
            return f(q, math.sqrt(self.square(q))) * half * (2 * math.cos(s) if turns else 1.0)

        return self._known(_integral(integrand), middle)

    def momentum(self, q: float, u: float) -> float:
        """Return p = M(q) u."""
        return 2 * self.parts(q, 1.0)[0] * u

    def _known(self, found: tuple[float, float] | None, middle: float) -> tuple[float, float] | None:
        """Return what was found with what rounding makes of E - V in it; None where runs know it better."""
        if found is None:
            return None
        total = sum(map(abs, (*self.parts(self.begin.q[0], self.begin.u[0]), self.parts(middle, 0.0)[1])))
        rounded = _ROUNDED * total / (self.square(middle) * self.parts(middle, 1.0)[0])
        missed = max(found[1], rounded)
        return (found[0], missed) if missed <= _WORTH else None

    def _turn(self, near: float, size: float, side: float) -> float | None:
        """Return the turning point near a place; the start itself where it is at rest there."""
        q0, u0 = self.begin.q[0], self.begin.u[0]
        if u0 == 0.0 and abs(q0 - near) <= _BESIDE * size:
            return float(q0)
        from scipy.optimize import brentq  # scipy takes longer to import than most answers take

        inside, outside = near - side * _BESIDE * size, near + side * _BESIDE * size
        if not self.square(inside) > 0.0 > self.square(outside):
            return None
        return float(brentq(self.square, inside, outside, xtol=_ROUNDED * abs(near) or _ROUNDED, rtol=_ROUNDED))


def _integral(f: Callable[[float], float]) -> tuple[float, float] | None:
    """Return the integral of a function over -pi/2 .. pi/2, of which it has the period pi, and how far it converged."""
    count, before = _FEWEST, math.inf
    best: tuple[float, float] | None = None
    while count <= _MOST:
        step = math.pi / count
        try:
            total = step * math.fsum(f(-math.pi / 2 + (k + 0.5) * step) for k in range(count))
        except (ValueError, *UNDEFINED):
            return best
        missed = abs(total - before) / total
        if best is not None and missed <= _CONVERGED:
            return total, missed
        best = (total, missed)
        count, before = 2 * count, total
    return best if best is not None and best[1] <= math.sqrt(_CONVERGED) else None


# ----------------------------------------------------------------------------------------------------------------------
# The error of numbers from runs, as coarser runs show it: larger tolerances, or twice the step.


def accuracy(system: System, tolerances: Mapping[str, float], *, is_coarse: bool) -> dict[str, Any]:
    """Return the arguments of `simulate` for runs with these tolerances, or the system's own step, or coarse ones."""
    step = system.simulation.step
    if step is None:
        return {name: COARSER * x if is_coarse else x for name, x in tolerances.items()}
    return {"step": multiply(TWO, step)} if is_coarse else {}


def part_of_difference(system: System) -> float:
    """Return the part of the difference to coarse runs that bounds the error of the others."""
    return LEFT if system.simulation.step is None else 1.0


# ----------------------------------------------------------------------------------------------------------------------

_SAMPLES: Final = 2001
_EXACTLY: Final = {"rtol": 1e-13, "atol": 1e-15}
_PLAIN: Final = (AUTO, "dormand_prince")
_LONGER: Final = 12
_TURNS: Final = 6
"""How many turns are wanted: those of two periods and a half, so that it is seen that the second is as the first."""
_DENSE: Final = 60
"""With more turns than this a run is too long for its samples to tell each of them."""
_SAME: Final = 1e-6
_ALIKE: Final = 1e-4
"""How well the samples tell where a coordinate turns, and when it does."""
_ROOT: Final = 4 * float(np.finfo(float).eps)
"""The part of a time to which a turn is found."""
_STILL: Final = 1e-13
"""A speed that is rounding."""
_CORRECTIONS: Final = 3
_BY_RUNS: Final = "by runs"
_FINEST: Final = 1e-15
_MOMENTUM: Final = "momentum of the swing"
_EQUAL_STEPS: Final = 512
_NO_OUTPUTS: Final = Names()


class NoPeriodError(Exception):
    """The motion does not repeat itself; its text says how."""


class RestingError(NoPeriodError):
    """The coordinate does not move."""


@dataclass(frozen=True)
class MotionNumber:
    """A number of a periodic motion; `means` by which it was found, and to which part of it, `missed`, it is known."""

    number: float
    means: str
    missed: float

    @property
    def how(self) -> str:
        """How it was found, and how well it is known, in words."""
        return f"{self.means}, to {self.missed:.0e}"

    def value(self, unit: str) -> Value:
        """Return the number with its error."""
        return Value(self.number, unit=unit, error=self.missed * abs(self.number))


@dataclass(frozen=True)
class Swing:
    """The motion of one coordinate of a system; `around`: it is an angle, which may go around.

    `is_coarse`: with larger tolerances or steps, so that it shows the error of others.
    """

    system: System
    coordinate: str
    around: bool
    is_coarse: bool = False

    @classmethod
    def of(cls, system: System, coordinate: str) -> Swing:
        """Return the motion of a coordinate. Raises ModelError where there is none of this name with a rate."""
        resolved = mechanism(system)
        own = resolved.relative or resolved
        paired = [own.coordinates[q] for body in own.bodies for q, _ in body.rate_pairs]
        found = next((c for c in paired if c.name == coordinate), None)
        if found is None:
            raise ModelError(
                f"no coordinate is called {coordinate!r}",
                number="M106",
                word=coordinate,
                known=[c.name for c in paired],
            )
        return cls(system, coordinate, found.unit == "rad")

    @cached_property
    def period(self) -> MotionNumber:
        """The period (s). Raises NoPeriodError."""
        return self._by_energy(lambda _energy, _q, u: 1 / u) or self._with_error(lambda swing: swing._seconds)

    @cached_property
    def action(self) -> MotionNumber:
        """The integral of p dq over a period, divided by 2 pi, p = M u. Raises NoPeriodError."""
        resolved = mechanism(self.system)
        rows = (resolved.relative or resolved).rows
        if rows:
            raise NoPeriodError(f"an action is that of independent coordinates, and {rows[0].name} restricts them")
        exactly = self._by_energy(lambda energy, q, u: energy.momentum(q, u) / (2 * math.pi))
        return exactly or self._with_error(Swing._action_by_runs)

    @cached_property
    def _coarse(self) -> Swing:
        return replace(self, is_coarse=True)

    @cached_property
    def _moving(self) -> tuple[Trajectory, list[float]]:
        """A run with a few turns, and these. Raises NoPeriodError where nothing moves."""
        run = self._long_enough()
        if np.abs(run[f"u_{self.coordinate}"]).max() <= _STILL:
            raise RestingError(f"{self.coordinate} does not move")
        return run, self._turns(run)

    def _with_error(self, of: Callable[[Swing], float]) -> MotionNumber:
        """Return a number of runs with its error, as coarse runs show it."""
        found = of(self)
        try:
            other = of(self._coarse)
        except NoPeriodError:
            return MotionNumber(found, _BY_RUNS, _SAME)
        missed = part_of_difference(self.system) * abs(other - found) / abs(found)
        return MotionNumber(found, _BY_RUNS, max(missed, _FINEST))

    @cached_property
    def _seconds(self) -> float:
        """The period by runs."""
        run, turns = self._moving
        return self._swung(run, turns) if len(turns) >= _TURNS else self._around(run)

    def _action_by_runs(self) -> float:
        """Return the integral of p u dt over a period by equal steps, divided by 2 pi."""
        asked = {_MOMENTUM: quantity("generalized_momentum", (self.coordinate,))}
        run = self._run(self._seconds, samples=_EQUAL_STEPS + 1, outputs=Names(asked))
        along = (run[_MOMENTUM] * run[f"u_{self.coordinate}"])[:-1]
        return float(along.mean()) * self._seconds / (2 * math.pi)

    def _by_energy(self, f: Callable[[Energy, float, float], float]) -> MotionNumber | None:
        """Return the integral of f dq over a period by quadrature, None where energy does not tell the speed."""
        run, turns = self._moving
        swings = len(turns) >= _TURNS
        energy = Energy.of(self.system, self.coordinate)
        if energy is None or not (swings or self._goes_around(run)):
            return None
        q = run[self.coordinate]
        swung = (float(q.min()), float(q.max())) if swings else None
        found = energy.over_period(lambda q, u: f(energy, q, u), swung)
        return None if found is None else MotionNumber(found[0], "by quadrature", max(found[1], _FINEST))

    def _swung(self, run: Trajectory, turns: list[float]) -> float:
        """Return the time from one turn to the next but one."""
        about = turns[:_TURNS]
        if _repeats(about, [self._at(run, t) for t in about]):
            begin = about[0] if about[0] == 0.0 else self._turned(about[0], run)
            return self._turned(about[2], run) - begin
        exact = [t if t == 0.0 else self._turned(t, run) for t in about]  # a turn may be narrower than a step
        if not _repeats(exact, [self._at(run, t) if t == 0.0 else self._there(t) for t in exact]):
            raise NoPeriodError(f"the motion of {self.coordinate} does not repeat itself{self._driven(run)}")
        return exact[2] - exact[0]

    def _driven(self, run: Trajectory) -> str:
        """Return what is to be said of the motion where something in the model depends on time; else nothing."""
        drives = named_with_time(self.system)
        if not drives:
            return ""
        period = period_of_drive(self.system, run.ready.parameter_values)
        told = f" from its start: {' and '.join(drives)} drives it by t, and a free motion is beside that"
        return told + ("" if period is None else f"; where dampers end it the drive's period is left, {period:.10g} s")

    # --- runs -----------------------------------------------------------------------------------------------------

    def _long_enough(self) -> Trajectory:
        """Return a run with a few turns, or one as long as any is tried."""
        run = self._run(None)
        duration = float(run.t[-1])
        for _ in range(_LONGER):
            count = len(self._turns(run))
            if np.abs(run[f"u_{self.coordinate}"]).max() <= _STILL:
                return run
            if count > _DENSE:
                duration /= 16.0
            elif count < _TURNS and not self._goes_around(run):
                duration *= 2.0
            else:
                return run
            run = self._run(duration)
        return run

    def _run(self, duration: float | None, samples: int = _SAMPLES, outputs: Names = _NO_OUTPUTS) -> Trajectory:
        quiet = replace(self.system, stop=Names(), outputs=outputs)
        return simulate(quiet, t_end=duration, samples=samples, **self._accuracy)

    @property
    def _accuracy(self) -> dict[str, Any]:
        settings = self.system.simulation
        finer = settings.step is None and settings.method in _PLAIN
        method = {"method": "dormand_prince_8"} if finer else {}
        return {**method, **accuracy(self.system, _EXACTLY, is_coarse=self.is_coarse)}

    def _turns(self, run: Trajectory) -> list[float]:
        """Return the first times at which the speed changes its sign; those of a start at rest begin with 0.

        Interpolated where it vanishes, exact where an impact reverses it.
        """
        u = run[f"u_{self.coordinate}"]
        found = [0.0] if u[0] == 0.0 and u.any() else []
        signs = np.sign(u)
        for k in np.flatnonzero(signs[1:-1] * signs[2:] < 0) + 1:
            struck = self._reversed(run, int(k))
            vanishes = float(run.t[k] - u[k] * (run.t[k + 1] - run.t[k]) / (u[k + 1] - u[k]))
            found.append(vanishes if struck is None else struck)
        found += [float(t) for t in run.t[1:][signs[1:] == 0]]
        return sorted(found)

    def _reversed(self, run: Trajectory, k: int) -> float | None:
        """Return when an impact reverses the speed between two samples, None where it passes through zero there."""
        u, t = run[f"u_{self.coordinate}"], run.t
        later = min(k + 2, len(u) - 1)
        for time in _impacts(run):
            if t[k] <= time <= t[k + 1]:
                before = u[k] + (u[k] - u[k - 1]) * (time - t[k]) / (t[k] - t[k - 1])
                after = u[k + 1] - (u[later] - u[k + 1]) * (t[k + 1] - time) / (t[k + 1] - t[k])
                if before * u[k] > 0.0 and after * u[k + 1] > 0.0:
                    return time
        return None

    def _at(self, run: Trajectory, time: float) -> float:
        """Return the coordinate at a time, by the cubic through the samples and slopes on both sides.

        At an impact, where slopes jump, it is that of a run which ends there.
        """
        if time in _impacts(run):
            return self._there(time)
        q, u = run[self.coordinate], run[f"u_{self.coordinate}"]
        k = min(int(np.searchsorted(run.t, time, side="right")), len(q) - 1)
        step = float(run.t[k] - run.t[k - 1])
        x = (time - float(run.t[k - 1])) / step
        y = 1.0 - x
        ends = q[k - 1] * y * y * (1 + 2 * x) + q[k] * x * x * (3 - 2 * x)
        return float(ends + step * (u[k - 1] * x * y * y - u[k] * x * x * y))

    def _there(self, time: float) -> float:
        """Return the coordinate at the end of a run to a time."""
        return float(self._run(time)[self.coordinate][-1])

    def _turned(self, time: float, run: Trajectory) -> float:
        """Return the time of a turn, by runs that end beside it; that of an impact as it is."""
        name, k = f"u_{self.coordinate}", int(np.searchsorted(run.t, time))
        ends = {float(run.t[j]): float(run[name][j]) for j in (k - 1, k)}
        before, after = ends
        if time in _impacts(run) or not ends[before] * ends[after] < 0.0:
            return time
        from scipy.optimize import brentq  # scipy takes longer to import than most answers take

        def speed(t: float) -> float:
            return ends[t] if t in ends else float(self._run(t)[name][-1])

        return float(brentq(speed, before, after, xtol=_ROOT * after, rtol=_ROOT))

    # --- around ---------------------------------------------------------------------------------------------------

    def _goes_around(self, run: Trajectory) -> bool:
        q = run[self.coordinate]
        return self.around and bool(np.abs(q - q[0]).max() > 4.5 * math.pi)

    def _around(self, run: Trajectory) -> float:
        """Return the time in which an angle advances by 2 pi, its speed being then what it was."""
        q, u = run[self.coordinate], run[f"u_{self.coordinate}"]
        if not self._goes_around(run):
            raise NoPeriodError(f"{self.coordinate} does not turn back within {float(run.t[-1]):.4g} s")
        advanced = math.copysign(2 * math.pi, float(u[-1]))
        times = [self._passed(run, float(q[0]) + n * advanced) for n in (1, 2)]
        speeds = [float(np.interp(t, run.t, u)) for t in times]
        fast = float(np.abs(u).max())
        if abs(speeds[0] - speeds[1]) > _ALIKE * fast or abs(times[1] - 2 * times[0]) > _ALIKE * times[0]:
            raise NoPeriodError(f"the motion of {self.coordinate} does not repeat itself{self._driven(run)}")
        return self._passed_exactly(times[0], float(q[0]) + advanced)

    def _passed(self, run: Trajectory, value: float) -> float:
        """Return when a coordinate passes a value, by the cubic through both sides. Raises NoPeriodError."""
        q = run[self.coordinate] - value
        passes = np.flatnonzero(q[:-1] * q[1:] <= 0)
        if not len(passes):
            raise NoPeriodError(f"{self.coordinate} goes around, and turns back")
        k = int(passes[0])
        return float(run.t[k] - q[k] * (run.t[k + 1] - run.t[k]) / (q[k + 1] - q[k]))

    def _passed_exactly(self, time: float, value: float) -> float:
        for _ in range(_CORRECTIONS):
            run = self._run(time)
            time -= float(run[self.coordinate][-1] - value) / float(run[f"u_{self.coordinate}"][-1])
        return time


def _impacts(run: Trajectory) -> list[float]:
    """Return the times of a run's impacts."""
    return [float(change["t"]) for change in run.changes if change["kind"] == "impact"]


def _repeats(times: Sequence[float], places: Sequence[float]) -> bool:
    """Return whether turns at times and places are those of a motion that repeats itself after every second one."""
    size = max(places) - min(places)
    first, second = times[2] - times[0], times[4] - times[2]
    alike = max(abs(places[k] - places[k + 2]) for k in range(len(places) - 2)) <= _SAME * size
    return alike and abs(second - first) <= _ALIKE * first


# ----------------------------------------------------------------------------------------------------------------------


def modes(
    system: System,
    *,
    at: At = None,
    period: str | None = None,
    parameters: Mapping[str, Any] | None = None,
    initial: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Any] | None = None,
    coordinates: str | None = None,
    project: bool | None = None,
    formalism: str | None = None,
) -> Modes:
    """Return the small motions of a system about its start, in formulas as far as there are any.

        M x'' + C x' + K x = 0        det(K - omega^2 M) = 0

    The start if it is an equilibrium or a steady motion, else the one found beside it (`Modes.found`), a stable one
    if there is any; `at` another state, as for `linearize`. In a steady motion the momenta of cyclic coordinates are
    held (Routh). Frequencies are ordered by size at the declared parameters. With dampers and more freedoms than one,
    frequencies are those without them. `period`: a coordinate whose period in the motion from the start is returned too
    (`Modes.period`), whatever its amplitude: a number, with its accuracy in a note. `parameters` .. `project`: what the
    call changes of the system (`Overrides`); `formalism` for the numbers.
    Raises InputError, and NoSolutionError where there is no such state or nothing is free to move.
    """
    changed = Overrides(parameters, initial, inputs, coordinates, project).of(system)
    with numbers_of(changed):
        found = SmallMotion.of(changed, formalism, at).as_modes()
        if period is None:
            return found
        with under("period"):
            coordinate = text("period", period)
            try:
                known = Swing.of(changed, coordinate).period
                note, value = f"the period of {coordinate} is known {known.how}", known.value("s")
            except NoPeriodError as reason:
                note, value = f"no period is told: {reason}", Value(None, None, "s")
            return replace(found, period=value, notes=(*found.notes, note))
