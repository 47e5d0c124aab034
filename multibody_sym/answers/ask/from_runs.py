"""Paths, times, speeds and values of a motion from a simulation: what has no closed form."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property, reduce
from itertools import pairwise
from typing import Any, Final

import numpy as np

from multibody_sym.analysis.modes.modes import Swing, accuracy, part_of_difference
from multibody_sym.dynamics.start.parameters import known_values
from multibody_sym.mechanics.mechanism import TIME, Mechanism
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.fields import AXES, Names
from multibody_sym.model.state_words import Moment, StateCondition
from multibody_sym.model.system import System
from multibody_sym.motion.prepare.records import LegSamples, ResolvedAlone, RunLabels
from multibody_sym.motion.results.integrals import FineLeg
from multibody_sym.motion.results.trajectory import Trajectory
from multibody_sym.motion.runs.run import FailedRunError
from multibody_sym.motion.simulate import simulate
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, add, as_node, quantity, symbol

ASKED: Final = "asked"
"""The output that is the expression asked for."""
_WHEN: Final = "when"
_SHORT: Final = 1e-3
"""A run that is asked for its start alone ends after this time."""
_SAMPLES: Final = 4000
_RTOL: Final = 1e-11
_ATOL: Final = _RTOL / 10
"""To which coordinates, and in a second paths, are known: less is no motion."""
_MET: Final = 1e-9
"""How near to a value, as contacts touch, a coordinate has it where a state changes."""
_RATES: Final = ("velocity", "acceleration")
_ALL, _FIRST, _LAST = slice(None), slice(1), slice(-1, None)
"""Samples of runs at which an expression is evaluated."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)
_STEPS: Final = 50


@dataclass(frozen=True)
class Simulated:
    """The motion of a system, run again for each question.

    `is_coarse`: with larger tolerances or steps and half of the samples, so that it shows the error of others.
    """

    system: System
    is_coarse: bool = False
    _swings: dict[str, Swing] = field(default_factory=dict, compare=False, repr=False)

    @cached_property
    def coarser(self) -> Simulated:
        """The same motion, known less."""
        return Simulated(self.system, is_coarse=True, _swings=self._swings)

    def swing(self, coordinate: str) -> Swing:
        """Return the periodic motion of a coordinate, whose runs have tolerances of their own. Raises ModelError."""
        if coordinate not in self._swings:
            self._swings[coordinate] = Swing.of(self.system, coordinate)
        return self._swings[coordinate]

    @property
    def part_of_coarser(self) -> float:
        """The part of the difference to coarser runs that bounds the error of this motion."""
        return part_of_difference(self.system)

    @property
    def whole(self) -> Trajectory:
        """The motion to `t_end`, or the stop or failure that ends it."""
        return self._as_far_as_known(self.system.stop)[0]

    @property
    def failure(self) -> FailedRunError | None:
        """What ends the whole motion early, if it fails."""
        return self._as_far_as_known(self.system.stop)[1]

    def until(self, time: float) -> Trajectory:
        """Return the motion until a time."""
        return self._simulated(self.system, time if time > 0.0 else _SHORT)

    def path(self, point: str, duration: float) -> float:
        """Return the length of a point's path until `duration`, the integral of |v|; turning points are met exactly."""
        if duration == 0.0:
            return 0.0
        run = self._run(point, duration)
        v, a = _vectors(run, "velocity"), _vectors(run, "acceleration")
        changes = sorted({float(change["t"]) for change in run.changes})
        way = 0.0
        for k, (begin, end) in enumerate(pairwise(run.t.tolist())):
            edges = [begin, *(t for t in changes if begin < t < end), end]
            if len(edges) == 2:
                way += _way(v[k : k + 2], a[k : k + 2], end - begin)
                continue
            for left, right in pairwise(edges):
                leg = next(x for x in reversed(run.stretches) if x.problem.start <= (left + right) / 2)
                ends = np.array([samples_at(leg, t).evaluated("outputs")[0][0] for t in (left, right)])
                way += _way(ends[:, : len(AXES)], ends[:, len(AXES) :], right - left)
        return way if way > _ATOL * max(1.0, duration) else 0.0

    def time(self, coordinate: str, value: float) -> float | None:
        """Return the first time > 0 at which a coordinate comes to a value, None if that is not before `t_end`.

        One that it has at the start it has at 0 if it keeps it, else when it comes back. A coordinate that only tends
        to a value, but for rounding, does not come to it.
        """
        run, failure = self._as_far_as_known()
        q, rate = run[coordinate] - value, run[f"u_{coordinate}"]
        away = np.flatnonzero(np.abs(q) > _least_distance(np.maximum.accumulate(np.abs(run[coordinate]))))
        if failure is None and not len(away):
            return 0.0
        sides = np.append(np.sign(q[away]), 0.0)  # at samples that are away; 0: none comes any more
        passes = sides[np.searchsorted(away, np.arange(len(q)), side="right")] * q[away[:1]] < 0.0
        changes = sorted({float(change["t"]) for change in run.changes})
        for k in range(int(away[0]) if len(away) else len(q), len(q) - 1):
            step = run.t[k + 1] - run.t[k]
            for change in (t for t in changes if run.t[k] < t <= run.t[k + 1]):
                found = self._until_change(coordinate, value, (float(run.t[k]), float(q[k]), float(rate[k])), change)
                if found is not None:
                    return found
            inside = _first_root(q[k : k + 2], rate[k : k + 2] * step)
            if inside is not None and passes[k]:
                return self._refined(coordinate, value, float(run.t[k] + inside * step))
        if failure is not None:
            raise failure
        return None

    def starts_at(self, coordinate: str, value: float) -> bool:
        start = float(self._as_far_as_known()[0][coordinate][0])
        return abs(start - value) <= float(_least_distance(np.abs([start]))[0])

    def _until_change(
        self, coordinate: str, value: float, before: tuple[float, float, float], change: float
    ) -> float | None:
        """Return when a coordinate has a value by the time of a change of state, which may turn it back there.

        `before`: time, distance from the value, and rate at the sample before.
        """
        t, q, rate = before
        run = self._simulated(self.system, change)
        end, slope = float(run[coordinate][-1]) - value, float(run[f"u_{coordinate}"][-1])
        if abs(end) <= _MET * max(1.0, abs(value)):
            return change
        inside = _first_root([q, end], [rate * (change - t), slope * (change - t)])
        return None if inside is None else self._refined(coordinate, value, t + inside * (change - t))

    def moment(self, moment: Moment, asked: Node | None = None) -> float | None:
        """Return the first time at which a moment comes, 0 if it is there at the start, None if not before `t_end`.

        A state that holds at the start comes when it begins again, if it does.
        An expression that is `asked` at that moment has its value from the same run, if one ends there.
        """
        if isinstance(moment, StateCondition):
            return self.begins(moment) if asked is None else self._begins(moment, asked)
        if isinstance(moment, Mapping):
            ((coordinate, value),) = moment.items()
            return self.time(coordinate, self.number(value))
        run = self._until(moment, asked)
        return None if run.stop is None else float(run.stop["t"])

    def value_at(self, moment: Moment, asked: Node) -> float | None:
        """Return the value of an expression when a moment first comes, None if that is not before `t_end`."""
        time = self.moment(moment, asked)
        if time is None or time == 0.0 or isinstance(moment, Mapping):
            return None if time is None else self.value(asked, time)
        return float(self._values(asked, None, Names({_WHEN: moment}), _LAST)[1][-1])

    def largest_and_rate(self, asked: Node, moment: Moment | None, time: float) -> tuple[float, float]:
        """Return the largest absolute value of an expression until a time, and by how much it changes in 1 s there.

        The time may be that of a `moment`; what jumps at it does not count as such a change.
        """
        if asked.op in ("number", "real"):
            return abs(float(asked.data)), 0.0
        at_time = moment is None or isinstance(moment, Mapping) or not time
        end = (time or _SHORT, None) if at_time else (None, Names({_WHEN: moment}))
        every, values = self._values(asked, *end)
        known = np.isfinite(values)
        values, times = values[known], every[known]
        steps, changes = np.diff(times[-3:-1]), np.diff(values[-3:-1])
        rate = abs(float(changes[0] / steps[0])) if len(steps) and steps[0] > 0.0 else 0.0
        return float(np.abs(values).max(initial=0.0)), rate

    def _until(self, moment: Node | StateCondition, asked: Node | None) -> Trajectory:
        stop = Names({_WHEN: moment})
        if asked is None or self._is_of_state(asked):
            return self._simulated(self.system, None, stop)
        return self.along(asked, None, stop)

    def _is_of_state(self, asked: Node) -> bool:
        """Return whether an expression is of time, coordinates, speeds and parameters: it needs no output."""
        if leaves([asked], "quantity"):
            return False
        return all(x in self._parameters or x in self._moving for x in leaves([asked], "symbol"))

    @cached_property
    def _moving(self) -> frozenset[Node]:
        """Time, coordinates and speeds, which take no run to be known but of several stages."""
        if self.system.then:
            run = self._as_far_as_known()[0]
            names = [*run.coordinates, *run.speeds]
        else:
            resolved = mechanism(self.system)
            names = [*(c.name for c in resolved.coordinates), *(speed.name for speed in resolved.speeds)]
        return frozenset({TIME, *map(symbol, names)})

    def _values(
        self, asked: Node, duration: float | None, stop: Mapping[str, Any] | None = None, places: slice = _ALL
    ) -> tuple[Floats, Floats]:
        """Return times of samples of a run, and the values of an expression at them."""
        if not self._is_of_state(asked):
            run = self.along(asked, duration, stop)
            return run.t[places], run[ASKED][places]
        run, named = self._simulated(self.system, duration, stop), leaves([asked], "symbol")
        moving = [x for x in named if x not in self._parameters]
        columns = {x: (run.t if x == TIME else run[str(x.data)])[places] for x in moving}
        t, known = run.t[places], self._parameters
        if asked in columns:
            return t, columns[asked]
        rows = [{x: float(column[k]) for x, column in columns.items()} for k in range(len(t))]
        return t, np.array([evaluate_float([asked], {**known, **row})[0] for row in rows])

    @cached_property
    def _parameters(self) -> dict[Node, float]:
        return known_values(self.system)

    def number(self, value: Node) -> float:
        """Return the value of an expression of parameters."""
        return self.value(value, 0.0) if value.shadow is None else float(value.shadow)

    def value(self, asked: Node, time: float) -> float:
        """Return the value of an expression at a time; that of a number takes no run to be compiled."""
        if asked.op in ("number", "real"):
            return float(asked.data)
        place = _LAST if time > 0.0 else _FIRST
        return float(self._values(asked, time if time > 0.0 else _SHORT, None, place)[1][0])

    def along(self, asked: Node, duration: float | None, stop: Mapping[str, Any] | None = None) -> Trajectory:
        """Return a run with an expression as its output `ASKED`, which ends at a stop if one is given."""
        system = replace(self.system, outputs=Names({ASKED: asked}))
        return self._simulated(system, duration, stop=stop)

    def displacement(self, point: str, duration: float, direction: Sequence[float]) -> float:
        """Return how far a point is displaced along a unit vector after a time."""
        place = _along("position", point, direction)
        return self.value(place, duration) - self.value(place, 0.0)

    def velocity(self, point: str, time: float, direction: Sequence[float]) -> float:
        """Return a point's velocity along a unit vector at a time."""
        return self.value(_along("velocity", point, direction), time)

    def begins(self, condition: StateCondition) -> float | None:
        """Return the first time after the start at which a state begins, None if not before `t_end`.

        One that holds at the start, and does not begin again, does so at 0.
        """
        if condition.strikes:
            return self.strikes(condition.element)
        run, failure = self._as_far_as_known()
        words = dict(run.ready.state.words)
        from_start = held = condition.holds(words)
        for change in run.changes:
            words[change["element"]] = change["kind"]
            before, held = held, condition.holds(words)
            if held and not before:
                return float(change["t"])
        if failure is not None:
            raise failure
        return 0.0 if from_start else None

    def strikes(self, element: str) -> float | None:
        """Return when an element first strikes after the start, None if not before `t_end`."""
        failure = self._as_far_as_known()[1]
        struck = next((t for t in self._impacts(element) if t > 0.0), None)
        if struck is None and failure is not None:
            raise failure
        return struck

    def strikes_at_start(self, element: str) -> bool:
        return 0.0 in self._impacts(element)

    def _impacts(self, element: str) -> list[float]:
        run = self._as_far_as_known()[0]
        return [float(change["t"]) for change in run.changes if change["element"] == element and change.get("impulse")]

    def _begins(self, condition: StateCondition, asked: Node) -> float | None:
        run = self._until(condition, asked)
        if run.stop is not None:
            return float(run.stop["t"])
        return 0.0 if condition.holds(dict(run.ready.state.words)) else None

    def changes_before(self, time: float) -> float | None:
        """Return when a state first changes before a time, None where none does."""
        run = self._simulated(self.system, time) if time > 0.0 else None
        return next((float(each["t"]) for each in run.changes if each["t"] < time), None) if run is not None else None

    def speed(self, point: str, time: float) -> float:
        if time == 0.0:
            run = self._run(point, 1.0)
            return float(np.linalg.norm(_vectors(run, "velocity")[0]))
        speeds = np.linalg.norm(_vectors(self._run(point, time), "velocity"), axis=1)
        return float(speeds[-1]) if speeds[-1] > max(_ATOL, _RTOL * float(speeds.max())) else 0.0

    def _refined(self, coordinate: str, value: float, time: float) -> float:
        run = self._simulated(self.system, time)
        q, rate = float(run[coordinate][-1]), float(run[f"u_{coordinate}"][-1])
        return time - (q - value) / rate if abs(rate) > abs(q - value) else time

    def _run(self, point: str, duration: float) -> Trajectory:
        asked = {f"{f} {axis}": quantity(f, (point, axis)) for f in _RATES for axis in AXES}
        return self._simulated(replace(self.system, outputs=Names(asked)), duration)

    def _as_far_as_known(
        self, stop: Mapping[str, Any] | None = None
    ) -> tuple[Trajectory, FailedRunError | None]:
        """Return the motion to `t_end` or a stop; one that fails up to there, with the failure."""
        try:
            return self._simulated(self.system, None, stop=stop), None
        except FailedRunError as failure:
            if not failure.trajectory.t[-1] > 0.0:
                raise
            return failure.trajectory, failure

    def _simulated(self, system: System, duration: float | None, stop: Mapping[str, Any] | None = None) -> Trajectory:
        """Return a run; one that was made before is the same again."""
        key = (tuple(system.outputs.items()), duration, tuple((stop or {}).items()))
        if key not in self._known:
            asked = replace(system, stop=stop or Names())
            samples = _SAMPLES // 2 if self.is_coarse else _SAMPLES
            try:
                self._known[key] = simulate(asked, t_end=duration, samples=samples + 1, **self._accuracy)
            except FailedRunError as failure:
                self._known[key] = failure
        known = self._known[key]
        if isinstance(known, FailedRunError):
            raise known
        return known

    @property
    def rtol(self) -> float:
        """The relative tolerance of runs, that of runs with chosen steps where they have a given one."""
        return float(self._accuracy.get("rtol", _RTOL))

    @cached_property
    def _accuracy(self) -> dict[str, Any]:
        return accuracy(self.system, {"rtol": _RTOL, "atol": _ATOL}, is_coarse=self.is_coarse)

    @cached_property
    def _known(self) -> dict[Any, Trajectory | FailedRunError]:
        return {}


def _least_distance(largest: Floats) -> Floats:
    """Return from which distance on coordinates of such sizes are away from a value."""
    return _ATOL * np.maximum(1.0, largest)


def _along(function: str, point: str, direction: Sequence[float]) -> Node:
    parts = [as_node(x) * quantity(function, (point, axis)) for x, axis in zip(direction, AXES, strict=True)]
    return reduce(add, parts)


def samples_at(leg: FineLeg, time: float) -> LegSamples:
    """Return the one sample in a leg of a run at a time, or at its nearest end."""
    problem = leg.problem
    time = max(min(time, leg.until), problem.start)
    q, u = leg.at(time)
    own = RunLabels(ResolvedAlone(leg.mechanism)), leg.compiled, problem.parameters
    return LegSamples(*own, np.array([time]), q[None], u[None], problem.modes)


def state_at(run: Trajectory, mechanism: Mechanism, k: int) -> tuple[list[float], list[float]]:
    """Return coordinates and speeds of a mechanism at a sample of a run."""
    q, u = ([float(run[x.name][k]) for x in group] for group in (mechanism.coordinates, mechanism.speeds))
    return q, u


def _vectors(run: Trajectory, function: str) -> Floats:
    return np.array([run[f"{function} {axis}"] for axis in AXES]).T


def _way(v: Floats, a: Floats, step: float) -> float:
    """Return the integral of |v| over a step, v being the cubic through both ends; halved where v turns back."""
    edges = [0.0, 1.0]
    if float(v[0] @ v[1]) < 0.0:
        along = v[1] - v[0]
        root = _first_root(v @ along, a @ along * step)
        edges = [0.0, 1.0] if root is None else [0.0, root, 1.0]
    total = 0.0
    for left, right in pairwise(edges):
        places = left + (right - left) * (_NODES + 1) / 2
        speeds = [float(np.linalg.norm(_cubic(v, a * step, x))) for x in places]
        total += float(_WEIGHTS @ speeds) * (right - left) / 2 * step
    return total


def _cubic(ends: Any, slopes: Any, x: float) -> Any:
    """Return the cubic on [0, 1] with these values and derivatives at both ends (Hermite)."""
    y = 1.0 - x
    return ends[0] * y * y * (1 + 2 * x) + ends[1] * x * x * (3 - 2 * x) + slopes[0] * x * y * y - slopes[1] * x * x * y


def _first_root(ends: Sequence[float] | Floats, slopes: Sequence[float] | Floats) -> float | None:
    """Return where the cubic on [0, 1] first crosses zero, None if it does not between its ends."""
    if ends[0] * ends[1] > 0.0:
        return None
    low, high = 0.0, 1.0
    for _ in range(_STEPS):
        middle = (low + high) / 2
        low, high = (low, middle) if ends[0] * _cubic(ends, slopes, middle) <= 0.0 else (middle, high)
    return high
