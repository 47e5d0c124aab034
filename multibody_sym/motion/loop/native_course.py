"""A run from mode to mode as `turns.c` reads it."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Collection, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from multibody_sym.motion.loop.native_problem import NativeProblem, address
from multibody_sym.motion.loop.problem import ActiveRows, Course, CourseMode, KnownTurn, Passage, Problem
from multibody_sym.program.native import NativeFunction, ProblemStruct, ProgramStruct

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

    @classmethod
    def of(cls, problem: Problem) -> NativeCourse | None:
        """Return the course of a problem; None where it has none, or none that leads on."""
        course = problem.course
        return cls(course, problem) if course is not None and any(course.modes[course.mode].turns) else None

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
