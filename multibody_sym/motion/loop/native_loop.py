"""The integration loop of runtime.c: a problem as it reads it, driven in pieces of about a tenth of a second."""

from __future__ import annotations

import ctypes
import math
import time
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from multibody_sym.motion.integrator.flow import steps_before
from multibody_sym.motion.loop.problem import (
    SECONDS,
    ActiveRows,
    Course,
    CourseMode,
    Event,
    Jump,
    KnownTurn,
    Passage,
    Problem,
    Progress,
    RunFailure,
    Statistics,
    chatters,
)
from multibody_sym.motion.methods.explicit import RungeKutta, Tableau
from multibody_sym.motion.methods.table import Method
from multibody_sym.program.native import (
    CollocationStruct,
    MethodStruct,
    NativeFunction,
    ProblemStruct,
    ProgramStruct,
    StateStruct,
    SystemStruct,
)
from multibody_sym.program.runtime_constants import Family, Phase, Status
from multibody_sym.scalars.arrays import Floats

if TYPE_CHECKING:
    from multibody_sym.motion.methods.multistep import Collocation

# ----------------------------------------------------------------------------------------------------------------------
# Methods of integration as the loop in C reads them.


def address(array: NDArray[Any]) -> ctypes.c_void_p:
    """Return where the elements of an array begin, for C; the array must live as long."""
    return ctypes.c_void_p(array.ctypes.data)


def method_struct(method: Method) -> MethodStruct:
    """Return the method for C; it points into the method's arrays, which must live as long.

    Modules of kinds that few runs take are imported for those.
    """
    if isinstance(method, RungeKutta):
        return _struct(Family.EXPLICIT, method, method.tableau, {})
    from multibody_sym.motion.methods.multistep import AdamsBashforthMoulton, Collocation, Stoermer, StoermerVerlet

    if isinstance(method, Collocation):
        return _collocation(method)
    if not isinstance(method, (AdamsBashforthMoulton, Stoermer, StoermerVerlet)):
        raise TypeError(f"{method!r} is no method")
    kinds = {AdamsBashforthMoulton: Family.ADAMS, Stoermer: Family.STOERMER, StoermerVerlet: Family.VERLET}
    weights = {name: address(values) for name, values in method.tables.items()}
    return _struct(kinds[type(method)], method, method.starter, {"past": method.past, **weights})


def _collocation(method: Collocation) -> MethodStruct:
    scheme = method.scheme
    arrays = {"c": scheme.c, "w": scheme.W, "start": scheme.start, "end": scheme.end, "transform": scheme.T}
    structure = CollocationStruct(
        stages=len(scheme.c),
        **{name: address(values) for name, values in arrays.items()},
        inverse=address(scheme.T_inverse),
        gamma=scheme.gamma,
        alpha=scheme.alpha,
        beta=scheme.beta,
        filter=scheme.filter,
        error=None if scheme.error is None else address(scheme.error),
        dense=address(scheme.dense),
        hermite=scheme.hermite,
    )
    return MethodStruct(
        family=Family.COLLOCATION,
        order=method.order,
        error_order=method.error_order,
        collocation=ctypes.pointer(structure),
    )


def _struct(family: Family, method: Method, tableau: Tableau, more: Mapping[str, Any]) -> MethodStruct:
    return MethodStruct(
        family=family,
        stages=tableau.stages,
        all_stages=len(tableau.c),
        order=method.order,
        error_order=method.error_order,
        dense_degree=tableau.dense.shape[1],
        a=address(tableau.A),
        c=address(tableau.c),
        error=None if tableau.error is None else address(tableau.error),
        coarse_error=None if tableau.coarse_error is None else address(tableau.coarse_error),
        dense=address(tableau.dense),
        **more,
    )


Integers = NDArray[np.intc]

_PROGRAMS: Final = (
    "inputs",
    "state_derivative",
    "jacobian",
    "index_2",
    "index_2_by_state",
    "index_2_by_multipliers",
    "project_position",
    "project_velocity",
    "missed",
    "put_back",
    "normalize",
    "events",
)


class NativeProblem:
    """The structures of a problem, with all that they point into: `handle` for C, `margins` that may be written.

    `work`: doubles of room that the loop takes.
    """

    work: int

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        derivative = problem.compiled["state_derivative"]
        assert isinstance(derivative, NativeFunction)
        self.library = derivative.library
        if problem.like is None:
            given = (problem.parameters, problem.modes, problem.margins, problem.moments)
            self._given = tuple(np.array(values, dtype=float) for values in given)
            pairs = problem.pairing
            lists: dict[str, Sequence[Any]] = {"terminal": problem.terminal, "plain": pairs.plain, "ball": pairs.balls}
            lists["limiting"] = problem.limiting
            self._whole = {name: np.array(values, dtype=np.intc).ravel() for name, values in lists.items()}
            self._method = method_struct(problem.method)
            self._system = _system(problem, self._given, self._whole)
            self._times = None if isinstance(problem.samples, int) else problem.times()
            names = ("t0", "t_end", "rtol", "atol", "contradiction", "closure", "independent", "whole", "max_steps")
            self.structure = ProblemStruct(
                method=ctypes.pointer(self._method),
                system=ctypes.pointer(self._system),
                step=problem.step or 0.0,
                samples=problem.sample_count,
                times=None if self._times is None else address(self._times),
                project=problem.project,
                crosses=problem.crosses,
                **{name: getattr(problem, name) for name in names},
            )
            self.work = int(self.library.mbs_work(ctypes.byref(self.structure)))
            if self.work < 0:
                raise ValueError(f"{problem.method.name} is not among the methods that the Programs were compiled for")
        else:
            if "native" not in problem.like.kept:
                problem.like.kept["native"] = NativeProblem(problem.like)
            self._take_over(problem.like.kept["native"])
        self.margins = self._given[2]
        self.handle = ctypes.byref(self.structure)

    def _take_over(self, like: NativeProblem) -> None:
        """Copy the structures of a problem that differs in its numbers alone, and point them to those of this one."""
        parameters = np.array(self.problem.parameters, dtype=float)
        self._given = parameters, like._given[1], like._given[2].copy(), like._given[3]
        self._whole, self._method, self.work = like._whole, like._method, like.work
        self._system = SystemStruct.from_buffer_copy(like._system)
        self._system.parameters = parameters.ctypes.data
        if len(self._given[2]):
            self._system.margins = self._given[2].ctypes.data
        self.structure = ProblemStruct.from_buffer_copy(like.structure)
        self.structure.t0, self.structure.t_end = self.problem.t0, self.problem.t_end
        self.structure.system = ctypes.pointer(self._system)
        self._like = like  # which owns what the copies point into


def _system(problem: Problem, given: tuple[Floats, ...], whole: dict[str, Integers]) -> SystemStruct:
    """Return the system for C; it points into the arrays, which must live as long."""
    parameters, modes, margins, moments = given
    programs = {}
    for name in _PROGRAMS:
        if name in problem.compiled and (name != "inputs" or problem.inputs):
            function = problem.compiled[name]
            assert isinstance(function, NativeFunction)
            programs[name] = ctypes.addressof(function.structure)
    return SystemStruct(
        **programs,
        parameters=address(parameters),
        modes=address(modes),
        nq=len(problem.q0),
        nu=len(problem.u0),
        ns=problem.rows,
        nw=problem.inputs,
        ng=len(problem.terminal),
        plains=len(problem.pairing.plain),
        balls=len(problem.pairing.balls),
        margins=address(margins),
        switches=len(margins),
        limits=len(problem.limiting),
        moments=address(moments),
        moment_count=len(moments),
        **{name: address(values) for name, values in whole.items()},
    )


_FIRST_PIECE: Final = 200  # steps; of small systems more, each of which takes less
_SMALL: Final = 20_000  # numbers of the state in the first piece
_LARGEST_PIECE: Final = 10_000_000


def native_loop(problem: Problem, samples: Floats) -> Iterator[Progress]:
    """Integrate in C; see `Loop`. What was written before an interruption stays in `samples`."""
    course = None
    if problem.course is not None and any(problem.course.modes[problem.course.mode].turns):  # it leads on
        course = NativeCourse(problem.course, problem)
    now = NativeProblem(problem) if course is None else course.now
    x0 = problem.x0
    state, steps, done = StateStruct(), piece_of(problem), False
    events: list[Event] = []
    singular: list[float] = []
    library, at = now.library, ctypes.byref(state)
    work = np.zeros(now.work if course is None else course.work)
    room, first, width = address(work), samples.ctypes.data, samples.itemsize * len(x0)
    library.mbs_start(now.handle, address(x0), at, room)
    if problem.begun is not None:
        state.t = state.t_new = problem.begun.time
        state.sample = problem.begun.written
        if problem.step is not None:
            state.grid = steps_before(problem.t0, problem.begun.time, problem.step)
    while not done:
        begin, before = time.perf_counter(), state.steps
        left = steps
        while left > 0 and not done and not (left < steps and time.perf_counter() - begin > SECONDS):
            rows = ctypes.c_longlong(problem.sample_count - state.sample)
            piece = ctypes.c_longlong(left)
            to = ctypes.c_void_p(first + width * state.sample)
            if course is None:
                library.mbs_integrate(now.handle, at, room, piece, rows, to)
            else:
                library.mbs_follow(course.handle, at, room, piece, rows, to)
                course.passed()
                now = course.now
            done = state.status != Status.RUNNING
            left = before + steps - state.steps
            if state.event >= now.problem.switches and _jump_if_due(problem.jump, now, state, work):
                done = False
            elif state.event >= 0:
                events.append(Event(state.t, state.event, now.problem.terminal[state.event]))
                if chatters(problem, events):
                    state.status, state.failure_time, state.component = Status.CHATTERS, state.t, -1
                    done = True
            singular += state.singular[: state.passed]
        seconds = max(time.perf_counter() - begin, 1e-6)
        steps = max(1, min(10 * steps, int(steps * SECONDS / seconds), _LARGEST_PIECE))
        status, failure = Status(state.status), None
        if status not in (Status.RUNNING, Status.DONE, Status.STOPPED):
            failure = RunFailure(status, state.failure_time, state.component if state.component >= 0 else None)
        x, statistics = work[: len(x0)].copy(), statistics_of(problem, state)
        yield Progress(state.sample, state.t, x, statistics, failure, tuple(events), tuple(singular))


def piece_of(problem: Problem) -> int:
    """Return how many steps of a problem take no time that anybody waits for."""
    return max(_FIRST_PIECE, _SMALL // len(problem.x0))


def _jump_if_due(jump: Jump | None, now: NativeProblem, state: StateStruct, work: Floats) -> bool:
    """Let a run that stands at a switch go on with the state after a jump, if there is one."""
    problem = now.problem
    index, size = state.event - problem.switches, len(problem.x0)
    after = None if jump is None or problem.is_over(state.t) else jump(state.t, work[:size].copy(), index)
    if after is None:
        return False
    work[:size] = after
    now.margins[index] = min(now.margins[index], 0.0)
    state.status, state.phase, state.crossing, state.origin = Status.RUNNING, Phase.STARTING, -1, -1
    return True


def statistics_of(problem: Problem, state: StateStruct) -> Statistics:
    """Return what a run took until now."""
    rows, steps = math.isfinite(state.least_rank), state.steps
    return Statistics(  # in their order: with names it takes twice as long, once a run
        steps,
        state.rejected,
        state.evaluations,
        state.jacobians,
        state.factorisations,
        (state.t - problem.start) / steps if steps else 0.0,
        state.drift_position,
        state.drift_velocity,
        state.removed_position,
        state.removed_velocity,
        state.quaternion_deviation,
        int(state.least_rank) if rows else 0,
        int(state.greatest_rank),
        state.conditioning if rows else 1.0,
        state.conditioning_time,
    )

# ----------------------------------------------------------------------------------------------------------------------
# A run from mode to mode as `turns.c` reads it.


_MOST: Final = 256  # turns in a piece of a run
_INT, _VOID, _DOUBLE = ctypes.c_int, ctypes.c_void_p, ctypes.c_double
_USED: Final = (
    *("phi", "phidot", "jacobian", "matrix", "exerted", "right", "driven", "coefficients", "reaches", "past_ends"),
    "inverse",
)


class ActingStruct(ctypes.Structure):
    """`mbs_acting` of turns.h."""

    _fields_ = (
        *((name, _INT) for name in ("actives", "slidings", "stickings", "pressings", "aparts")),
        *((name, _VOID) for name in ("active", "sliding", "sticking", "pressing", "apart")),
    )


class TurnStruct(ctypes.Structure):
    """`mbs_turn` of turns.h."""

    _fields_ = (
        *((name, _INT) for name in ("to", "keeps", "parts", "takes", "cause", "way")),
        *((name, _VOID) for name in ("touching", "kept", "rows", "signs")),
        ("after", ActingStruct),
        ("before", ActingStruct),
    )


class ModeStruct(ctypes.Structure):
    """`mbs_mode` of turns.h."""

    _fields_ = (
        ("problem", ctypes.POINTER(ProblemStruct)),
        *((name, _VOID) for name in ("margins", "rules", "held", "closed", "turns")),
        ("turn", ctypes.POINTER(TurnStruct)),
        ("holds", _INT),
    )


class EntriesStruct(ctypes.Structure):
    """`mbs_entries` of turns.h."""

    _fields_ = (
        *((name, _INT) for name in ("count", "size")),
        *((name, _VOID) for name in ("places", "values", "base", "whole")),
    )


class LawsStruct(ctypes.Structure):
    """`mbs_laws` of turns.h."""

    _fields_ = (
        *((name, _VOID) for name in ("inputs", "laws", "parameters", "given", "outputs", "entries", *_USED)),
        *((name, _INT) for name in ("matrices", "rows", "elements")),
        *((name, _VOID) for name in ("normals", "angles", "slides")),
        *((name, _DOUBLE) for name in ("length", "speed")),
    )


class PassageStruct(ctypes.Structure):
    """`mbs_passage` of turns.h."""

    _fields_ = (("time", _DOUBLE), *((name, ctypes.c_longlong) for name in ("turn", "samples", "steps")))


class CourseStruct(ctypes.Structure):
    """`mbs_course` of turns.h."""

    _fields_ = (
        ("laws", ctypes.POINTER(LawsStruct)),
        ("modes", ctypes.POINTER(ModeStruct)),
        ("passages", ctypes.POINTER(PassageStruct)),
        *((name, _VOID) for name in ("states", "margins", "room")),
        *((name, _DOUBLE) for name in ("since", "least")),
        *((name, _INT) for name in ("mode", "most", "passed", "width")),
    )


class NativeCourse:
    """The structures of a course, with all that they point into; `work` doubles suffice for all its modes."""

    def __init__(self, course: Course, problem: Problem) -> None:
        self.course = course
        self._kept: list[Any] = []
        self._modes = [NativeProblem(mode.problem) for mode in course.modes]
        self._modes[course.mode] = NativeProblem(problem)
        self._turns = [[turn for turns in mode.turns for turn in turns] for mode in course.modes]
        for mode in self._modes:
            mode.structure.max_steps = problem.max_steps
        pairs = zip(course.modes, self._modes, self._turns, strict=True)
        modes = (ModeStruct * len(course.modes))(*[self._mode(*pair) for pair in pairs])
        size = len(course.modes[0].problem.x0)
        self._states, self._laws = np.empty((_MOST, size)), self._laws_struct()
        width = max(len(mode.rules) for mode in course.modes)
        self._margins = np.empty((_MOST, width))
        self._structure = CourseStruct(
            laws=ctypes.pointer(self._laws),
            modes=modes,
            passages=(PassageStruct * _MOST)(),
            states=address(self._states),
            margins=address(self._margins),
            since=course.since,
            least=course.least,
            mode=course.mode,
            most=_MOST,
            width=width,
        )
        self.handle = ctypes.byref(self._structure)
        room = self.now.library.mbs_room
        room.restype = ctypes.c_longlong
        self._structure.room = self._array(np.empty(room(self.handle)))
        self.work = max(mode.work for mode in self._modes)

    @property
    def now(self) -> NativeProblem:
        """The problem in which the run is."""
        return self._modes[self.course.mode]

    def passed(self) -> None:
        """Tell of the turns that were taken."""
        told = self._structure
        for k in range(told.passed):
            each = told.passages[k]
            turn = self._turns[self.course.mode][each.turn]
            self.course.mode, self.course.since = turn.to, each.time
            self.course.speed = self._laws.speed
            margins = self._margins[k, : len(self.course.modes[turn.to].rules)]
            reached = self._states[k].copy(), self._laws.speed, tuple(margins.tolist())
            self.course.passed(Passage(each.time, turn.to, each.samples, each.steps, *reached))
        told.passed = 0

    def _array(self, values: NDArray[Any]) -> ctypes.c_void_p:
        self._kept.append(values)
        return address(values)

    def _pointers(self, places: Collection[ctypes.c_void_p]) -> int:
        pointers = (_VOID * len(places))(*places)
        self._kept.append(pointers)
        return ctypes.addressof(pointers)

    def _ints(self, values: Sequence[Any] | NDArray[Any]) -> ctypes.c_void_p:
        return self._array(np.array(values, dtype=np.intc).ravel())

    def _mode(self, mode: CourseMode, native: NativeProblem, turns: list[KnownTurn]) -> ModeStruct:
        return ModeStruct(
            problem=ctypes.pointer(native.structure),
            margins=address(native.margins),
            rules=self._ints(mode.rules),
            held=self._ints(mode.held),
            closed=self._ints(mode.closed),
            turns=self._ints([len(each) for each in mode.turns]),
            turn=(TurnStruct * max(len(turns), 1))(*[self._turn(turn) for turn in turns]),
            holds=len(mode.held),
        )

    def _turn(self, turn: KnownTurn) -> TurnStruct:
        return TurnStruct(
            to=turn.to,
            keeps=len(turn.kept),
            parts=len(turn.signs),
            takes=len(turn.rows),
            cause=turn.cause,
            way=turn.way,
            **{name: self._ints(getattr(turn, name)) for name in ("touching", "kept", "rows", "signs")},
            after=self._acting(turn.after),
            before=self._acting(turn.before),
        )

    def _acting(self, acting: ActiveRows) -> ActingStruct:
        names = ("active", "slides", "sticks", "pressing", "apart")
        return ActingStruct(
            *[len(getattr(acting, name)) for name in names], *[self._ints(getattr(acting, name)) for name in names]
        )

    def _laws_struct(self) -> LawsStruct:
        course = self.course
        laws = course.compiled["laws"]
        signature = laws.signature
        outputs = {name: self._array(np.empty(max(int(np.prod(shape)), 1))) for name, shape in signature.outputs}
        inputs, used = dict(signature.inputs)["inputs"], [name for name in course.matrices if name in _USED]
        wholes = {name: np.zeros(max(math.prod(course.matrices[name][0]), 1)) for name in used}
        self._kept.append(wholes)
        entries = (EntriesStruct * len(wholes))(*[self._entries(name, outputs[name], wholes) for name in wholes])
        self._kept.append(entries)
        return LawsStruct(
            inputs=_program(course.compiled["inputs"]) if inputs[0] else None,
            laws=_program(laws),
            parameters=self._array(np.array(course.parameters, dtype=float)),
            given=self._array(np.zeros(inputs[0] + 1)),
            outputs=self._pointers(outputs.values()),
            entries=ctypes.addressof(entries),
            **{name: outputs[name] for name in _USED if name not in wholes},
            **{name: address(whole) for name, whole in wholes.items()},
            matrices=len(wholes),
            rows=dict(signature.outputs)["phi"][0],
            elements=len(course.normals),
            normals=self._ints(course.normals),
            angles=self._ints(course.angles),
            slides=self._array(np.array(course.slides, dtype=float)),
            length=course.length,
            speed=course.speed,
        )

    def _entries(self, name: str, values: ctypes.c_void_p, wholes: dict[str, NDArray[Any]]) -> EntriesStruct:
        """Return how a matrix is filled in: the forces of rows by what differs from their own directions."""
        _, places = self.course.matrices[name]
        base = address(wholes["matrix"]) if name == "exerted" else None
        whole = wholes[name]
        return EntriesStruct(len(places), whole.size, self._ints(places), values, base, address(whole))


def _program(function: Any) -> int:
    assert isinstance(function, NativeFunction)
    structure: ProgramStruct = function.structure
    return ctypes.addressof(structure)
