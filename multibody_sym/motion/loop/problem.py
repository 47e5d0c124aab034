"""What is integrated and what comes of it: the records that both loops, in C and in Python, take and give."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from multibody_sym.motion.integrator.flow import Pairing, sample_times
from multibody_sym.motion.methods.table import COLLOCATION, Method
from multibody_sym.program.loading import Compiled
from multibody_sym.program.runtime_constants import LEAST_LEFT, Status
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import EPSILON, Floats

SEVERAL: Final = "several states"
"""The word for the event of an element of which the laws leave several states."""

# ----------------------------------------------------------------------------------------------------------------------
# What the loop in C has to know to go on at switches that were decided before: records for `turns.h`.


Rule = tuple[int, int]
"""By what a switching function may exceed zero: a part of forces, of the model's size, or of the speed along a row."""


class Rub(NamedTuple):
    """The places of a normal and a tangent, the number of a friction part, which way it slides; whether from rest."""

    normal: int
    tangent: int
    part: int
    sense: int = 0
    begins: bool = False


@dataclass(frozen=True)
class ActiveRows:
    """What acts in a mode, by places among all rows: `mbs_acting`.

    `active` ones have a = 0, `pressing` and `apart` are normals.
    """

    active: tuple[int, ...] = ()
    slides: tuple[Rub, ...] = ()
    sticks: tuple[Rub, ...] = ()
    pressing: tuple[int, ...] = ()
    apart: tuple[int, ...] = ()


@dataclass(frozen=True)
class KnownTurn:
    """A switch that was decided: `mbs_turn`."""

    to: int
    touching: tuple[int, ...]
    kept: tuple[int, ...]
    rows: tuple[int, ...]
    signs: tuple[tuple[int, int], ...]
    after: ActiveRows
    before: ActiveRows
    cause: int
    way: int


@dataclass(frozen=True)
class Passage:
    """A turn that was taken: when, to which mode, after so many samples and steps, and the state (nq + nu,) then.

    `speed` is the largest that was met, `margins` those of the mode from then on.
    """

    time: float
    to: int
    written: int
    steps: int
    x: Floats
    speed: float
    margins: tuple[float, ...]


SECONDS: Final = 0.1
"""How long a piece of a run lasts, about, after which it tells its progress."""
_CROSSINGS: Final = 300
"""Kinks crossed one after the other in a part `_NO_TIME` of a run that are too many."""
_NO_TIME: Final = 1e-6


@dataclass(frozen=True, eq=False)
class ModeNumbers:
    """The numbers (nm,) by which Programs know a mode: those of a `base`, which modes share, but `values` at `places`.

    A run keeps those of all its legs.
    """

    base: Floats
    places: NDArray[np.intp]
    values: Floats

    @staticmethod
    def of(base: Floats, own: Mapping[int, float]) -> ModeNumbers:
        """Return the numbers of a base but for those `own`, by their places."""
        return ModeNumbers(base, np.array(list(own), dtype=np.intp), np.array(list(own.values()), dtype=float))

    def with_own(self, own: Mapping[int, float]) -> ModeNumbers:
        """Return them with others `own`, by their places."""
        return ModeNumbers.of(self.base, dict(zip(self.places.tolist(), self.values.tolist(), strict=True)) | {**own})

    def whole(self) -> Floats:
        """Return all numbers, which may not be written."""
        if not len(self.places):
            return self.base
        found = self.base.copy()
        found[self.places] = self.values
        return found


NO_MODE: Final = ModeNumbers.of(np.zeros(0), {})
"""The numbers where Programs know no mode."""


@dataclass(frozen=True)
class SampleTimes:
    """The `times` (s) of samples, rising, from the start of a run to its end, of which a user may not have asked."""

    times: tuple[float, ...]
    start: bool = True
    end: bool = True

    def asked(self, first: int, t: Floats) -> slice:
        """Return which of the samples from number `first` on, at times t (m,), were asked for; where a run stops is."""
        begin = 0 if self.start or first else 1
        is_end = not self.end and len(t) > 0 and first + len(t) == len(self.times) and t[-1] == self.times[-1]
        return slice(begin, len(t) - is_end)


@dataclass(frozen=True)
class Begun:
    """What was done of a run that goes on: until `time`, with `written` samples."""

    time: float
    written: int


Jump = Callable[[float, Floats, int], Floats | None]
"""Returns from time, state and the number of a mode's switching function that crossed the state after a jump of speeds.

The run goes on from there in the same mode, and that function may not exceed zero any more; None: the mode ends.
"""


class Hold(NamedTuple):
    """Inputs that are held `until` a time: their values, by the names of the parameters that they are."""

    until: float
    values: Mapping[str, float]


Holds = Callable[[float, Floats], Hold]
"""Returns what is held from a time and a state (nq + nu,) on."""


@dataclass(frozen=True)
class Problem:
    """An initial value problem for the programs in `compiled`, x = (q, u).

    Arguments: `q0` (nq,), `u0` (nu,), `parameters` (np,), `mode` (nm,); `step` fixed, or None: adaptive by `rtol`,
    `atol`; `samples`: so many, evenly spaced from t0 to t_end, both among them, or their times; `project`: each
    accepted step and each sample is put back onto the constraints. `contradiction`: rows contradict each other if both
    the scaled residual of dependent ones and max |phidot| / (1 + max |u|) exceed it; `closure`: the largest |phi| / (1
    + max |q|), and the like for u, that a projection may leave; `independent`: how many rows are so but in singular
    positions; `crosses`: whether steps lead across these; `whole`: how long (s) the run is of which this one is or
    repeats a part, in steps as long; 0 if it is none. `terminal`: for each switching function of the program `events`
    whether the run stops where it becomes positive; where another one changes sign, a step ends and the next starts
    afresh. `pairs`: which speeds are rates of which coordinates; None where each is that of the coordinate in its
    place. The last switching functions are those of a mode, with `margins` by which they may exceed zero, of which
    those at the places `limiting` keep adaptive steps short, and no adaptive step leads over one of the `moments`
    (`motion.integrator.flow.Events`). `like` is one that differs in numbers alone, from which it was made. `begun`: the
    run goes on from q0, u0 at another time than t0. `jump` may let it go on where a mode would end, and the loop in C
    may follow a `course` from mode to mode.
    Raises ValueError.
    """

    compiled: Compiled
    method: Method
    t0: float
    t_end: float
    q0: Floats
    u0: Floats
    parameters: Floats
    mode: ModeNumbers
    step: float | None = None
    rtol: float = 1e-8
    atol: float = 1e-8
    samples: int | SampleTimes = 1001
    project: bool = False
    max_steps: int = 10_000_000
    contradiction: float = 1e-3
    closure: float = 1e-8
    independent: float = 0.0
    whole: float = 0.0
    crosses: bool = True
    terminal: tuple[bool, ...] = ()
    pairs: Pairing | None = None
    margins: tuple[float, ...] = ()
    limiting: tuple[int, ...] = ()
    moments: tuple[float, ...] = ()
    begun: Begun | None = None
    jump: Jump | None = None
    course: Course | None = None
    like: Problem | None = field(init=False, default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        for true, claim in (
            (self.t_end > self.t0, "t_end is later than t0"),
            (self.step is None or self.step > 0.0, "step is positive"),
            (self.step is not None or self.method.error_order > 0, f"{self.method.name} has a step, no tolerances"),
            (self.rtol >= 0.0 and self.atol > 0.0, "rtol is not negative and atol is positive"),
            (self.sample_count >= 2, "there are at least two samples"),
            (self.max_steps >= 1, "max_steps is at least one"),
        ):
            if not true:
                raise ValueError(f"not true that {claim}")
        if self.method.name in COLLOCATION and not ("jacobian" in self.compiled or self.index_2):
            raise ValueError(f"{self.method.name} is implicit and needs the program jacobian, or index_2")
        values = dict(self.compiled["events"].signature.outputs)["values"] if "events" in self.compiled else (0,)
        if values != (len(self.terminal),):
            raise ValueError(f"terminal has {len(self.terminal)} entries, not {values[0]}")
        arrays = {"q": self.q0, "u": self.u0, "parameters": self.parameters, "modes": self.modes}
        for name, shape in self.compiled["state_derivative"].signature.inputs:
            if name in arrays and arrays[name].shape != shape:
                raise ValueError(f"{name} has the shape {arrays[name].shape}, not {shape}")

    @property
    def modes(self) -> Floats:
        """The numbers (nm,) by which Programs know the mode."""
        return self.mode.whole()

    @property
    def lasts(self) -> float:
        """How long (s) the whole run is."""
        return self.whole or self.t_end - self.t0

    @property
    def run_end(self) -> float:
        """The end of the run of which it may be a part."""
        return self.t_end if isinstance(self.samples, int) else self.samples.times[-1]

    @property
    def is_last(self) -> bool:
        """Whether the run ends where it does."""
        return self.t_end == self.run_end

    @property
    def due(self) -> int:
        """The number of samples of the run until its end."""
        if self.is_last:
            return self.sample_count
        return int(self._times.searchsorted(self.t_end + 8.0 * EPSILON * abs(self.t_end), side="right"))

    def samples_before(self, time: float) -> int:
        """Return the number of samples of the run that are earlier than a time, by more than round-off."""
        return int(self._times.searchsorted(time - 8.0 * EPSILON * abs(time)))

    @property
    def in_parts(self) -> Problem:
        """The problem with the times of its samples, and with the length of the run, which its parts keep."""
        if self.whole and not isinstance(self.samples, int):
            return self
        samples = SampleTimes(tuple(self._times.tolist())) if isinstance(self.samples, int) else self.samples
        return replace(self, samples=samples, whole=self.lasts)

    def part(self, until: float, parameters: Floats, begun: Begun | None, x: Floats) -> Problem:
        """Return the part of the run, from a state x (nq + nu,) on until a time, by other parameters."""
        nq = len(self.q0)
        part = self.in_parts.with_numbers(parameters, x[:nq], x[nq:])
        vars(part).update(t0=self.t0 if begun is None else begun.time, t_end=until, begun=begun)
        return part

    def is_like(self, other: Problem) -> bool:
        """Return whether another one differs in numbers alone."""
        return self.compiled is other.compiled and np.array_equal(self.modes, other.modes)

    def with_numbers(self, parameters: Floats, q0: Floats, u0: Floats) -> Problem:
        """Return the problem with other numbers, of the same shapes: what was verified of this one holds of it."""
        other = object.__new__(Problem)
        vars(other).update(vars(self), parameters=parameters, q0=q0, u0=u0, like=self.like or self)
        for made in ("kept", "x0"):
            vars(other).pop(made, None)
        return other

    def again(self) -> Problem:
        """Return the problem with the same numbers, and all that was made of it."""
        return self.with_numbers(self.parameters, self.q0, self.u0)

    def __getstate__(self) -> dict[str, Any]:
        """Return what a copy in another process has: nothing of what was made here for those that are like it."""
        return {name: value for name, value in vars(self).items() if name != "kept"} | {"like": None}

    @cached_property
    def kept(self) -> dict[str, Any]:
        """What was made of this problem for all that are like it."""
        return {}

    @property
    def start(self) -> float:
        """The time of q0 and u0."""
        return self.t0 if self.begun is None else self.begun.time

    @cached_property
    def x0(self) -> Floats:
        """The state (nq + nu,) at the start, which nobody writes."""
        return np.concatenate([self.q0, self.u0]).astype(float)

    def is_over(self, time: float) -> bool:
        """Return whether no step leads on from a time: a switch so near the end is the end."""
        return time >= self.t_end - LEAST_LEFT * abs(time)

    def rates(self, t: float, x: Floats) -> Floats:
        """Return x' (nq + nu,) at a time and a state x."""
        return self.pushed(t, x)[0]

    def pushed(self, t: float, x: Floats) -> tuple[Floats, Floats, float]:
        """Return x' (nq + nu,) at a time and a state x, the multipliers of all rows, and how independent these are.

        That is 1 at most, and 0 where they, or what they push with the friction of what slides, depend on each other.
        """
        qdot, udot, multipliers, report = self.compiled["state_derivative"](*self._arguments(t, x))
        return np.concatenate([qdot, udot]), multipliers, float(report[1])

    def switching(self, t: float, x: Floats, multipliers: Floats | None = None) -> Floats:
        """Return the values of the switching functions (ng,) at a time and a state, with multipliers if known."""
        known = self._arguments(t, x)
        program = self.compiled["events"]
        if len(program.signature.inputs) > len(known):
            known += (self.compiled["state_derivative"](*known)[2] if multipliers is None else multipliers,)
        found: Floats = program(*known)[0]
        return found

    def _arguments(self, t: float, x: Floats) -> tuple[Any, ...]:
        """Return what every Program takes at a time and a state."""
        q, u = x[: len(self.q0)], x[len(self.q0) :]
        known, inputs = (t, q, u, self.parameters), np.zeros(0)
        if self.inputs:
            (inputs,) = self.compiled["inputs"](*known)
        return *known, inputs, self.modes

    @property
    def switches(self) -> int:
        """The number of the first switching function of the mode."""
        return len(self.terminal) - len(self.margins)

    @property
    def pairing(self) -> Pairing:
        """Which speeds are rates of which coordinates."""
        return self.pairs or Pairing.of_equals(len(self.u0))

    @property
    def rows(self) -> int:
        """The number of constraint rows."""
        return dict(self.compiled["state_derivative"].signature.outputs)["multipliers"][0]

    @property
    def inputs(self) -> int:
        """The number of inputs, which the program of that name computes."""
        return dict(self.compiled["state_derivative"].signature.inputs)["inputs"][0]

    @property
    def index_2(self) -> bool:
        """Whether the rows are part of the equations, on positions and on speeds, which makes them of index 2."""
        return "index_2" in self.compiled

    @property
    def sample_count(self) -> int:
        """The number of samples, those at both ends among them."""
        return self.samples if isinstance(self.samples, int) else len(self.samples.times)

    def asked(self, first: int, t: Floats) -> slice:
        """Return which of the samples from number `first` on, at times t (m,), were asked for."""
        return slice(0, len(t)) if isinstance(self.samples, int) else self.samples.asked(first, t)

    def times(self) -> Floats:
        """Return the times of all samples, which may be written."""
        return self._times.copy()

    @property
    def _times(self) -> Floats:
        kept = (self.like or self).kept
        if "times" not in kept:
            kept["times"] = (
                sample_times(self.t0, self.t_end, self.samples)
                if isinstance(self.samples, int)
                else np.array(self.samples.times)
            )
        times: Floats = kept["times"]
        return times


@dataclass(eq=False)
class CourseMode:
    """A mode, with the turns that are known of each of its switching functions: `mbs_mode`."""

    problem: Problem
    rules: tuple[Rule, ...]
    held: tuple[int, ...]
    closed: tuple[int, ...]
    turns: list[list[KnownTurn]]


@dataclass(eq=False)
class Course:
    """A run from mode to mode: the Programs `laws` and `inputs`, their parameters, and what that is measured by.

    `matrices`: the shape of each matrix of which `laws` computes entries, and their places, counted row by row.

    `normals` and `angles`: of each element the place of its normal, and 1 where its gap is an angle; `slides`: of each
    speed 1 in m/s. `mode` is the number of the one in which the run is `since` a time; what happens sooner than `least`
    after it is left to others. `speed` is the largest that was met. `passed` is told of each turn that was taken.
    """

    compiled: Compiled
    matrices: Mapping[str, tuple[tuple[int, int], NDArray[np.intp]]]
    parameters: Floats
    normals: tuple[int, ...]
    angles: tuple[int, ...]
    slides: Floats
    length: float
    least: float
    passed: Callable[[Passage], None]
    speed: float = 0.0
    since: float = 0.0
    mode: int = 0
    modes: list[CourseMode] = field(default_factory=list)


@dataclass(frozen=True)
class Statistics:
    """What a run took and how well it held; the fields are those of `mbs_state` in runtime.h.

    `drift_position`, `drift_velocity`: largest |phi|, |phidot| of the integrated state; with projection after it at
    each step, without at the steps in which a sample falls. `removed_position`, `removed_velocity`: largest |phi|,
    |phidot| that projection found after a step. `quaternion_deviation`: of a quaternion's length from 1 after a step,
    before it was normalised. `least_rank`, `greatest_rank` of the rows; `conditioning`: smallest part of a kept
    row that others leave, or of the longest that one is long, seen at `conditioning_time`. Without rows the ranks are 0
    and conditioning is 1.
    """

    steps: int = 0
    rejected: int = 0
    evaluations: int = 0
    jacobians: int = 0
    factorisations: int = 0
    mean_step: float = 0.0
    drift_position: float = 0.0
    drift_velocity: float = 0.0
    removed_position: float = 0.0
    removed_velocity: float = 0.0
    quaternion_deviation: float = 0.0
    least_rank: int = 0
    greatest_rank: int = 0
    conditioning: float = 1.0
    conditioning_time: float = 0.0

    def joined(self, later: Statistics) -> Statistics:
        """Return what two parts of a run took together."""
        if not self.steps:
            return later
        steps = self.steps + later.steps
        worse = self if self.conditioning <= later.conditioning else later
        return Statistics(  # in their order: with names it takes twice as long, once a sample of an input
            steps,
            self.rejected + later.rejected,
            self.evaluations + later.evaluations,
            self.jacobians + later.jacobians,
            self.factorisations + later.factorisations,
            (self.mean_step * self.steps + later.mean_step * later.steps) / steps,
            max(self.drift_position, later.drift_position),
            max(self.drift_velocity, later.drift_velocity),
            max(self.removed_position, later.removed_position),
            max(self.removed_velocity, later.removed_velocity),
            max(self.quaternion_deviation, later.quaternion_deviation),
            min(self.least_rank, later.least_rank),
            max(self.greatest_rank, later.greatest_rank),
            worse.conditioning,
            worse.conditioning_time,
        )


@dataclass(frozen=True)
class Reason:
    """Why a run could not go on, in words; `ends`: the motion of the model has no continuation there, as it is shown.

    Where none was found, or steps or accuracy were at fault, the motion may well go on.
    """

    text: str
    ends: bool = False


@dataclass(frozen=True)
class RunFailure:
    """Why a run ended early: `status` at `time`, in a `component`.

    NOT_FINITE, STEP_UNDERFLOW, NOT_CONVERGED: component of (q, u) whose derivative is not finite, whose error does not
    get small, or that Newton's iteration moves most; NO_SLOPE: the one whose rate has no finite derivative;
    NOT_CLOSED, CONTRADICTION, LEFT: the row that is broken; None for STEP_LIMIT, INTERRUPTED,
    NO_MODE: nothing is found in which the run could go on, for a `reason`; CHATTERS: a force jumps to and fro and time
    does not go on; and SINGULAR: rows become dependent there.
    """

    status: Status
    time: float
    component: int | None
    reason: Reason | None = None


@dataclass(frozen=True)
class Event:
    """Switching function `index` crossed zero at `time`; the run stopped there if it is `terminal`."""

    time: float
    index: int
    terminal: bool


def chatters(problem: Problem, events: Sequence[Event]) -> bool:
    """Tell whether kinks are crossed so often that a run never ends: at that pace hundreds of million times in it.

    So does what a force that jumps with a speed holds at rest: it is pushed to and fro over the jump.
    """
    if len(events) < _CROSSINGS or events[-1].terminal:
        return False
    return events[-1].time - events[-_CROSSINGS].time < _NO_TIME * (problem.t_end - problem.t0)


@dataclass(frozen=True)
class Chunk:
    """Samples from number `first` on, just written: t (m,), q (m, nq), u (m, nu); the run has got to `time`."""

    first: int
    t: Floats
    q: Floats
    u: Floats
    time: float

    def beyond(self, number: int) -> Chunk:
        """Return what of it comes after so many samples of the run."""
        return self.part(slice(max(0, number - self.first), len(self.t)))

    def part(self, of: slice) -> Chunk:
        """Return a part of its samples."""
        return Chunk(self.first + of.start, self.t[of], self.q[of], self.u[of], self.time)


@dataclass(frozen=True)
class Progress:
    """Where a loop stands: samples written, time and state reached, statistics, failure.

    And the events so far, and when singular positions, in which rows depend on each other, were passed.
    """

    written: int
    time: float
    x: Floats
    statistics: Statistics
    failure: RunFailure | None
    events: tuple[Event, ...] = ()
    singular: tuple[float, ...] = ()


Loop = Callable[[Problem, Floats], Iterator[Progress]]
"""Writes samples (samples, nq + nu) row by row and yields now and then, the last time when the run has ended."""
