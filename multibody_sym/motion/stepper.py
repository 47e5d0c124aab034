"""A system stepped from outside: a caller holds its inputs for a while, one state or many, and reads the next state.

In: a prepared system, the time of a step and the inputs that are held. Out: states, outputs and events, step by step. A
held input is a parameter of the system that is compiled, so that C, events and impacts take it as they take any other.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import replace
from functools import cached_property
from itertools import pairwise
from threading import Event
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

import numpy as np
import numpy.typing as npt
from numpy.typing import ArrayLike

from multibody_sym.dynamics.start.number_checks import check_numbers, is_driven, is_plain
from multibody_sym.errors import ArgumentError, InputError, MultibodyError, short_repr
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.model.argument_checks import door, whole_number
from multibody_sym.model.system import System
from multibody_sym.motion.function_values import in_si_units
from multibody_sym.motion.loop.integrate import held_at_start, loop_for
from multibody_sym.motion.loop.native_loop import NativeProblem, address, native_loop
from multibody_sym.motion.loop.problem import Hold, Problem
from multibody_sym.motion.prepare.records import LegSamples, PreparedSystem, ResolvedAlone, RunLabels
from multibody_sym.motion.results.samples import RunStart
from multibody_sym.motion.runs.held_inputs import HeldInputs, held_names, positive_time
from multibody_sym.motion.runs.run import run
from multibody_sym.program.native import StateStruct
from multibody_sym.program.runtime_constants import Status
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.numbers import floats, verify_finite

if TYPE_CHECKING:
    from multibody_sym.motion.switching.mode_run import ModeRun

_STATE: Final = np.dtype(StateStruct)
_MOST_STEPS: Final = 1_000_000
"""Steps of the method within one step of a Stepper that are taken by one call; what takes more is driven in pieces."""
_PIECE: Final = 256
"""Systems of which one call takes the step."""
_MOST_SYSTEMS: Final = 10_000_000
_FLOAT: Final = np.dtype(np.float64)

Stops = Mapping[str, Any]
"""The stop that a motion has met: its time `t`, its `kind` and the `element`."""


@dataclass(frozen=True, eq=False)
class StepperState:
    """Where a Stepper stands: time, coordinates q, speeds u and held inputs, of one system or of n in rows.

    `Stepper.restore` goes on from it: it holds which contacts touch, stick or slide as well, and what of the motion
    before decides about that.
    """

    t: Any
    q: Floats
    u: Floats
    inputs: Floats
    _parameters: Floats
    _begun: Floats
    _steps: Floats
    _stops: tuple[Stops | None, ...]
    _runs: tuple[ModeRun | None, ...]


class Stepper:
    """A system that goes on by `dt` (s) a step, while its `inputs` are held: one system, or `count` of them.

    `prepare(system).stepper(dt)` makes it. `sim.step([1.0])` returns it, `sim.t`, `sim.q` (nq,) and `sim.u` (nu,) tell
    the state, `sim["x"]` a coordinate, speed, input or output by name; of n systems t is (n,), q (n, nq) and so on.
    """

    def __init__(
        self,
        system: System,
        start: Callable[[System], RunStart],
        dt: Any,
        inputs: Any,
        count: int | None,
        threads: int,
    ) -> None:
        self.dt = positive_time("dt", dt)
        self.inputs = held_names(system, inputs)
        self.count = whole_number("count", count) if count is not None else None
        if self.count is not None and self.count > _MOST_SYSTEMS:
            raise InputError(f"at most {_MOST_SYSTEMS:,} systems are stepped together, not {short_repr(count)}")
        self._threads = whole_number("threads", threads)
        self._declared, self._start = system, start
        self._held = HeldInputs.of(system, self.inputs, follow=True)
        rows = self.count or 1
        begin = self._begin(None, None)
        self._ready: PreparedSystem = begin.ready
        self._problem = replace(begin.problem, t0=0.0, t_end=self.dt, samples=2)
        places = begin.ready.mechanism.parameters.places
        self._places = [places[name] for name in self._held.parameters.values()]
        self._follows = {name: places[own] for name, own in self._held.follows.items()}
        self._runs: list[ModeRun | None] = [None] * rows
        self._stops: list[Stops | None] = [None] * rows
        self._begun, self._steps = np.zeros(rows), np.zeros(rows)
        self._span = np.tile([0.0, self.dt], (rows, 1))  # the times at which the next step begins and ends
        self._x = np.empty((rows, len(begin.problem.x0)))
        self._parameters = np.empty((rows, len(_values_of(begin))))
        self._events: list[Sequence[Mapping[str, Any]]] = [[] for _ in range(rows)]
        for k in range(rows):
            self._enter(k, begin)
        self._clock()

    def __repr__(self) -> str:
        many, held = "" if self.count is None else f"{self.count} of ", ", ".join(self.inputs) or "no input"
        return f"<Stepper of {many}{self._declared.name}: {self.dt:g} s a step, holds {held}>"

    def __getstate__(self) -> dict[str, Any]:
        """Return all but the calls in C, which are about arrays of this process."""
        return {name: value for name, value in vars(self).items() if name != "_calls"}

    # --- where it stands ----------------------------------------------------------------------------------------------

    @property
    def t(self) -> Any:
        """The time in s: a float, or (n,)."""
        return self._span[0, 0].item() if self.count is None else self._span[:, 0].copy()

    @property
    def x(self) -> Floats:
        """Coordinates and speeds in a row (nq + nu,) or (n, nq + nu), as an `ode` takes them."""
        return self._shown(self._x)

    @property
    def q(self) -> Floats:
        """The coordinates (nq,) or (n, nq)."""
        return self._shown(self._x[:, : self._nq])

    @property
    def u(self) -> Floats:
        """The speeds (nu,) or (n, nu)."""
        return self._shown(self._x[:, self._nq :])

    @property
    def held(self) -> Floats:
        """The values of the held inputs (nw,) or (n, nw), in the order of `inputs`; expressions at this state."""
        return self._shown(self._held_values)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """The names of the coordinates, in the order of q."""
        return tuple(self._ready.told.coordinates)

    @property
    def speeds(self) -> tuple[str, ...]:
        """The names of the speeds, in the order of u."""
        return tuple(self._ready.told.speeds)

    @property
    def outputs(self) -> dict[str, Any]:
        """The declared outputs by name: floats, or (n,). Work and impulses, which add up along a run, are left out."""
        columns = [part.evaluated("outputs")[0] for part in self._parts] if self._ready.told.outputs else []
        values = np.concatenate(columns) if columns else np.empty((0, 0))
        return dict(zip(self._ready.told.outputs, self._columns(values), strict=True))

    @property
    def state(self) -> StepperState:
        """All of where it stands, for `restore`."""
        runs = tuple(None if one is None else one.copied() for one in self._runs)
        own = self._parameters.copy(), self._begun.copy(), self._steps.copy()
        return StepperState(self.t, self.q, self.u, self.held, *own, tuple(self._stops), runs)

    @property
    def stop(self) -> Any:
        """The declared stop that ended the motion, {t, kind, element}, or None; of n systems a list."""
        return self._stops[0] if self.count is None else list(self._stops)

    @property
    def events(self) -> Any:
        """What began to stick, slide, open or close, or struck, in the last step; of n systems a list of lists."""
        return list(self._events[0]) if self.count is None else [list(each) for each in self._events]

    def __getitem__(self, name: str) -> Any:
        """Return a coordinate, speed, held input or output by name. Raises InputError for another name."""
        for names, values in (
            (self.coordinates, self._x[:, : self._nq]),
            (self.speeds, self._x[:, self._nq :]),
            (self.inputs, self._held_values),
        ):
            if isinstance(name, str) and name in names:
                return self._columns(values)[names.index(name)]
        told = self._ready.told.outputs
        if isinstance(name, str) and name in told:
            return self.outputs[name]
        known = [*self.coordinates, *self.speeds, *self.inputs, *told]
        raise InputError(f"nothing here is called {short_repr(name)}", number="M106", word=str(name), known=known)

    # --- going on -----------------------------------------------------------------------------------------------------

    @door
    def step(self, inputs: Mapping[str, ArrayLike] | ArrayLike | None = None) -> Stepper:
        """Go on by `dt`, and return itself.

        `inputs` are held from now on, by name (numbers, or text such as `2 N`) or as a vector in their order; (n, nw)
        for n systems, or the same for all. What is not given stays as it was. A system that has met a stop stays there.
        Raises InputError for wrong inputs, and of a single system that has met a stop; RunError where the step fails,
        which leaves everything as it was.
        """
        if self.count is None and self._stops[0] is not None:
            raise InputError(f"{self._stops[0]['element']} has stopped the motion: reset it, or restore a state")
        if inputs is None:
            self._go_on()
            return self
        before = self._parameters.copy()
        try:
            self._put(inputs, self._parameters)
            self._go_on()
        except BaseException:
            self._parameters[:] = before
            raise
        return self

    @door
    def reset(
        self,
        *,
        initial: Mapping[str, Any] | None = None,
        parameters: Mapping[str, Any] | None = None,
        inputs: Mapping[str, ArrayLike] | ArrayLike | None = None,
        rows: Sequence[int] | Sequence[bool] | npt.NDArray[Any] | None = None,
    ) -> Stepper:
        """Begin again at t = 0, and return itself; of n systems all begin, or those of some `rows` do.

        `rows`: numbers from 0 on, or n times True or False. `initial` and `parameters` as for `simulate`; of n systems
        each name has a number for all that begin, or an array of one for each. `inputs` as for `step`, a row for each
        that begins. Raises InputError and NoSolutionError, and leaves everything as it was then.
        """
        chosen = self._chosen(rows)
        starts = self._starts(len(chosen), parameters, initial)
        values = self._parameters[chosen]
        for row, begin in enumerate(starts):
            values[row] = _values_of(begin)
        if inputs is not None:
            self._put(inputs, values)
        for k, begin in zip(chosen, starts, strict=True):
            self._enter(k, begin)
        self._parameters[chosen] = values
        self._clock()
        return self

    @door
    def restore(self, state: StepperState) -> Stepper:
        """Go on from a `state` that a Stepper of this system had, and return itself; n systems may all begin at one.

        Raises InputError for a state of another Stepper.
        """
        if not isinstance(state, StepperState):
            raise ArgumentError(f"state is what `state` of a Stepper returned, not {short_repr(state)}")
        x = np.hstack([np.atleast_2d(state.q), np.atleast_2d(state.u)])
        rows = len(self._x)
        if x.shape[1] != self._x.shape[1] or state._parameters.shape[1] != self._parameters.shape[1]:
            raise InputError("the state is that of another system, or of one that holds other inputs")
        if len(x) not in (1, rows):
            raise InputError(f"the state is that of {len(x)} systems, not {rows}")
        self._x[:], self._parameters[:] = x, state._parameters
        self._begun[:], self._steps[:] = state._begun, state._steps
        times = rows // len(x)
        self._stops = list(state._stops * times)
        self._runs = [None if one is None else one.copied() for one in state._runs * times]
        self._events = [[] for _ in self._x]
        self._clock()
        return self

    def copy(self) -> Stepper:
        """Return a Stepper that stands where this one does, and goes on by itself; nothing is compiled."""
        other = object.__new__(Stepper)
        vars(other).update(vars(self))
        vars(other).pop("_calls", None)  # which are about the arrays of this one
        for name in ("_x", "_parameters", "_begun", "_steps", "_span"):
            setattr(other, name, getattr(self, name).copy())
        return other.restore(self.state)

    # --- how ----------------------------------------------------------------------------------------------------------

    @cached_property
    def _nq(self) -> int:
        return len(self._problem.q0)

    def _shown(self, values: Floats) -> Floats:
        return values[0].copy() if self.count is None else values.copy()

    @property
    def _held_values(self) -> Floats:
        """The values of the held inputs (n, nw)."""
        values = self._parameters[:, self._places]
        following = {name: self._parameters[:, place] > 0.0 for name, place in self._follows.items()}
        if any(rows.any() for rows in following.values()):
            every = np.concatenate([part.arguments[4] for part in self._parts])
            for name, rows in following.items():
                values[rows, self.inputs.index(name)] = every[rows, self._ready.told.inputs.index(name)]
        return values

    def _columns(self, values: Floats) -> list[Any]:
        """Return the columns of rows of values, as numbers where there is one system."""
        return values[0].tolist() if self.count is None and len(values) else list(values.T)

    def _chosen(self, rows: Any) -> list[int]:
        every = range(len(self._x))
        if rows is None:
            return list(every)
        if not isinstance(rows, (list, tuple, range, np.ndarray)):
            raise ArgumentError(f"rows is a list of numbers, not {short_repr(rows)}")
        if len(rows) and all(isinstance(k, (bool, np.bool_)) for k in rows):
            if len(rows) != len(every):
                raise InputError(f"rows has {len(rows)} times True or False for {len(every)} systems")
            return [k for k in every if rows[k]]
        for k in rows:
            if not isinstance(k, (int, np.integer)) or isinstance(k, bool) or k not in every:
                raise InputError(f"rows has {short_repr(k)}; they are numbers from 0 to {len(every) - 1}")
        return list(dict.fromkeys(map(int, rows)))

    def _starts(self, count: int, parameters: Any, initial: Any) -> list[RunStart]:
        """Return how so many systems begin: alike, or each by its own numbers."""
        given = [
            self._in_columns(kind, x, count) for kind, x in (("parameters", parameters), ("initial", initial))
        ]
        if not count or not any(columns for _, columns in given):
            return [self._begin(parameters, initial)] * count

        def begin(k: int) -> RunStart:
            return self._begin(*(alike if not own else alike | {x: own[x][k] for x in own} for alike, own in given))

        first, (_, columns) = begin(0), given[1]
        places = None if given[0][1] else self._free_places(list(columns))
        if places is None:
            return [first, *map(begin, range(1, count))]
        x = np.tile(first.problem.x0, (count, 1))
        for place, (name, values) in zip(places, columns.items(), strict=True):
            verify_finite(f"initial[{name!r}]", np.array(values))
            x[:, place] = values
        own = first.problem.parameters
        each = (first.problem.with_numbers(own, *np.split(row, [self._nq])) for row in x)
        return [first._replace(problem=problem) for problem in each]

    def _free_places(self, names: Sequence[str]) -> list[int] | None:
        """Return the places in x of coordinates and speeds that start as given, None where starts are found."""
        mechanism, order = self._ready.mechanism, [*self.coordinates, *self.speeds]
        if self._one_way or self._declared.impact or not is_plain(mechanism) or is_driven(mechanism):
            return None
        turns = {k for body in mechanism.bodies for ball in body.quaternions for k in ball}
        places = [order.index(name) for name in names]
        return None if turns.intersection(places) else places

    def _in_columns(self, kind: str, given: Any, count: int) -> tuple[Any, dict[str, list[float]]]:
        """Return the values by name that all systems share, and those with one number a system. Raises InputError."""
        if self.count is None or not isinstance(given, Mapping):
            return given, {}
        alike, columns = dict(given), dict[str, list[float]]()
        for name, value in given.items():
            if isinstance(value, (list, tuple, np.ndarray)) and np.ndim(value):
                values = floats(f"{kind}[{name!r}]", value)
                if values.shape != (count,):
                    raise InputError(f"{kind}[{name!r}] has the shape {values.shape}, not a number or ({count},)")
                del alike[name]
                columns[name] = values.tolist()
        return alike, columns


    def _put(self, inputs: Any, parameters: Floats) -> None:
        """Put inputs into rows of parameters. Raises InputError for unknown names, wrong shapes, what is not finite."""
        rows = len(parameters)
        if isinstance(inputs, Mapping):
            for name, value in inputs.items():
                if name not in self.inputs:
                    message = f"there is no input {name!r}"
                    if name in self._declared.inputs:
                        message = f"the input {name!r} is not held: name it in inputs= of stepper"
                    raise InputError(message, number="M106", word=str(name), known=self.inputs)
                values = floats(f"inputs[{name!r}]", self._in_si_units(name, value))
                if values.shape not in ((), (rows,)) or (values.ndim and self.count is None):
                    wanted = "a number" if self.count is None else f"a number or ({rows},)"
                    raise InputError(f"inputs[{name!r}] has the shape {values.shape}, not {wanted}")
                verify_finite(f"inputs[{name!r}]", values)
                parameters[:, self._places[self.inputs.index(name)]] = values
                if name in self._follows:
                    parameters[:, self._follows[name]] = 0.0
            return
        width = len(self.inputs)
        values = inputs if type(inputs) is np.ndarray and inputs.dtype is _FLOAT else floats("inputs", inputs)
        fits = values.shape == (width,) or (self.count is not None and values.shape == (rows, width))
        if not fits:
            wanted = f"({width},)" if self.count is None else f"({width},) or ({rows}, {width})"
            raise InputError(f"inputs has the shape {values.shape}, not {wanted}: {', '.join(self.inputs) or 'none'}")
        verify_finite("inputs", values)
        parameters[:, self._places] = values
        for place in self._follows.values():
            parameters[:, place] = 0.0

    def _in_si_units(self, name: str, value: Any) -> Any:
        """Return the value of an input, of text such as `2 N` its number in SI units."""
        if not isinstance(value, str):
            return value
        return in_si_units(check_numbers(self._declared), "inputs", {name: value})[name]

    def _begin(self, parameters: Mapping[str, Any] | None, initial: Mapping[str, Any] | None) -> RunStart:
        """Return how a motion begins, its inputs as declared there. Raises InputError and NoSolutionError."""
        declared = Overrides(parameters, initial).of(self._declared)
        changed = self._held.in_system(declared)
        begin = self._start(changed)
        values = self._held.declared(declared, begin)
        return self._held.begun(begin, values, lambda: self._start(Overrides(values).of(changed)))

    def _enter(self, k: int, begin: RunStart) -> None:
        """Put system number k where a motion begins."""
        problem = begin.problem
        self._x[k], self._parameters[k] = problem.x0, _values_of(begin)
        self._begun[k], self._steps[k] = 0.0, 0.0
        self._events[k] = [*map(dict, begin.events), *([] if begin.modes is None else begin.modes.events)]
        self._runs[k] = None if begin.modes is None else cast("ModeRun", begin.modes).copied()
        holding = held_at_start(problem)
        self._stops[k] = None
        if holding is not None:
            self._stops[k] = {"t": 0.0, "kind": "stop", "element": self._ready.told.stops[holding]}

    def _go_on(self) -> None:
        """Take one step of all systems that no stop holds; nothing changes unless all of them succeed."""
        left: Sequence[int] = range(len(self._x))
        ends = self._x
        if self._in_c and not self._one_way:
            calls = self._calls
            left, ends = calls.run(), calls.ends
        if left or any(self._stops):
            self._go_on_apart(left, ends)
            return
        if any(self._events):
            self._events = [[] for _ in self._x]
        self._x[:] = ends
        self._steps += 1.0
        self._span[:, 0] = self._span[:, 1]
        self._span[:, 1] = self._begun + (self._steps + 1.0) * self.dt

    def _go_on_apart(self, left: Sequence[int], ends: Floats) -> None:
        """Take the step of the systems that are `left` one by one; of the others it leads to `ends`."""
        moving = [stop is None for stop in self._stops]
        ended = {k: self._alone(k) for k in left if moving[k]}
        self._events = [[] for _ in self._x]
        for k, one in ended.items():
            ends[k] = one.x
            self._runs[k], self._stops[k], self._events[k] = one.run, one.stop, one.events
        self._x[moving] = ends[moving]
        self._steps += moving
        for k, one in ended.items():
            if one.stop is not None:
                self._begun[k], self._steps[k] = one.t, 0.0
        self._clock()

    def _clock(self) -> None:
        """Say when the next step begins and ends."""
        self._span[:, 0] = self._begun + self._steps * self.dt
        self._span[:, 1] = self._begun + (self._steps + 1.0) * self.dt

    @cached_property
    def _one_way(self) -> bool:
        return any(one is not None for one in self._runs)

    @cached_property
    def _in_c(self) -> bool:
        return loop_for(self._problem) is native_loop

    @cached_property
    def _calls(self) -> _Calls:
        return _Calls(self._problem, self._span, self._parameters, self._x, self._threads)

    def _alone(self, k: int) -> _Ended:
        """Take a step of one system, as a run of its own."""
        (t, until), x, going = self._span[k].tolist(), self._x[k].copy(), self._runs[k]
        if going is None:
            span = {"t0": t, "t_end": until, "parameters": self._parameters[k].copy()}
            problem = replace(self._problem, **span, q0=x[: self._nq], u0=x[self._nq :])
        else:
            going = going.copied()  # a step that fails leaves the run as it was
            problem = going.resumed(t, Hold(until, self._own_parameters(k)), x)
        try:
            reached = run(RunStart(self._ready, problem, going), None)
        except MultibodyError as error:
            if self.count is not None:
                error.under(f"system {k}")
            raise
        end = reached.integration
        events = [] if going is None else list(going.events)
        return _Ended(np.concatenate([end.q_final, end.u_final]), end.t_final, reached.stop, going, events)

    def _own_parameters(self, k: int) -> dict[str, float]:
        """Return the parameters of system number k that change with what is held."""
        places = self._ready.mechanism.parameters.places
        return {name: float(self._parameters[k, places[name]]) for name in self._held.names}

    @property
    def _parts(self) -> list[LegSamples]:
        """The samples of the state: all systems at once, or each in its mode."""
        told = self._ready.told
        t, q, u = np.atleast_1d(self.t), self._x[:, : self._nq], self._x[:, self._nq :]
        if not self._one_way:
            return [LegSamples(told, self._ready.compiled, self._parameters, t, q, u)]
        parts = []
        for k, going in enumerate(self._runs):
            assert going is not None
            leg, here = going.legs[-1], slice(k, k + 1)
            labels = RunLabels(ResolvedAlone(leg.program.mechanism))
            values = leg.of.parameters.copy()
            places = leg.program.mechanism.parameters.places
            for name, value in self._own_parameters(k).items():
                values[places[name]] = value
            parts.append(LegSamples(labels, leg.of.compiled, values, t[here], q[here], u[here], leg.of.modes))
        return parts


class _Ended(NamedTuple):
    """Where a step of one system ended: the state x (nq + nu,), when, at which stop, and the run from mode to mode."""

    x: Floats
    t: float
    stop: Stops | None
    run: ModeRun | None
    events: Sequence[Mapping[str, Any]]


class _Calls:
    """The calls in C, one for each thread, that take a step of n systems from x0 (n, nq + nu) to `ends`."""

    def __init__(self, problem: Problem, spans: Floats, parameters: Floats, x0: Floats, threads: int) -> None:
        self._native = NativeProblem(problem.again())
        self._spans, self._parameters, self._x0 = spans, parameters, x0
        count, width = x0.shape
        self.ends, self._samples = np.empty((count, width)), np.empty((count, 2, width))
        self._states = (StateStruct * count)()
        self._all: Any = np.frombuffer(memoryview(self._states), dtype=_STATE)
        bounds = np.linspace(0, count, min(threads, count) + 1).astype(int).tolist()
        self._kept: list[Floats] = []
        self._given = [self._pieces(a, b) for a, b in pairwise(bounds)]
        self._pool = ThreadPoolExecutor(len(self._given)) if len(self._given) > 1 else None

    def _pieces(self, first: int, last: int) -> list[tuple[Any, ...]]:
        """Return the arguments of the calls of a thread: between them Ctrl-C is heard."""
        work = np.empty(self._native.work)
        self._kept.append(work)
        return [self._arguments(a, min(a + _PIECE, last), work) for a in range(first, last, _PIECE)]

    def _arguments(self, first: int, last: int, work: Floats) -> tuple[Any, ...]:
        states = ctypes.byref(self._states, first * ctypes.sizeof(StateStruct))
        return (
            self._native.handle,
            ctypes.c_longlong(last - first),
            address(self._spans[first:]),
            address(self._parameters[first:]),
            ctypes.c_longlong(self._parameters.shape[1]),
            address(self._x0[first:]),
            states,
            address(work),
            ctypes.c_longlong(_MOST_STEPS),
            address(self._samples[first:]),
            address(self.ends[first:]),
        )

    def run(self) -> list[int]:
        """Take the step; return the numbers of the systems that are not at its end."""
        if self._pool is None:
            self._run_pieces(self._given[0], None)
        else:
            self._run_threads(self._pool)
        if len(self._states) == 1:
            one = self._states[0]
            return [] if one.status == Status.DONE and one.event < 0 and not one.passed else [0]
        found = self._all
        done = (found["status"] == Status.DONE) & (found["event"] < 0) & (found["passed"] == 0)
        return [] if done.all() else np.flatnonzero(~done).tolist()


    def _run_threads(self, pool: ThreadPoolExecutor) -> None:
        stop = Event()
        parts = [pool.submit(self._run_pieces, pieces, stop) for pieces in self._given]
        try:
            for part in parts:
                part.result()
        finally:
            stop.set()
            wait(parts)

    def _run_pieces(self, pieces: Sequence[tuple[Any, ...]], stop: Event | None) -> None:
        for piece in pieces:
            if stop is not None and stop.is_set():
                return
            self._native.library.mbs_integrate_each(*piece)


def _values_of(begin: RunStart) -> Floats:
    """Return the parameters with which a motion begins: those of the mechanism in no mode where it has modes."""
    return begin.ready.parameters if begin.modes is not None else begin.problem.parameters
