"""A mode of a run as a problem to integrate: each mode is made and compiled once, however often a run comes back."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import Final, TypeVar

import numpy as np

from multibody_sym.contact_laws.problem import Places
from multibody_sym.dynamics.programs.reactions import Switching, switchings, switchings_of
from multibody_sym.mechanics.law_elements import INACTIVE, FrictionPart, LawElement, Mode
from multibody_sym.mechanics.mechanism import ALPHA, BETA, INDEPENDENT, Mechanism
from multibody_sym.mechanics.modes import (
    chosen_parameters,
    direction_names,
    functions,
    in_mode,
    mode_words,
    number_places,
    own_numbers,
    taking_part,
    usual_numbers,
)
from multibody_sym.mechanics.points import STARTING
from multibody_sym.motion.loop.problem import NO_MODE, Begun, ModeNumbers, Problem
from multibody_sym.motion.switching.decision import NextState
from multibody_sym.motion.switching.impact import Holding, held_speeds
from multibody_sym.motion.switching.law_mechanism import is_tip, remembered_normals, rounded_meeting
from multibody_sym.motion.switching.law_values import LawValues, has_sliding_friction, rounded_up
from multibody_sym.program.loading import Compiled
from multibody_sym.program.runtime_constants import FORCE_MARGIN, MOST_TIME_MARGIN, SPEED_MARGIN, TIME_MARGIN
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.rank import ROUNDED, rank

_AT_REST: Final = 1e-9
"""The part of a speed along two rows below which what slides in space has stopped."""
_BEGUN: Final = 0.01
_ON_ITS_WAY: Final = 10.0
"""The multiples of the speed up to which slip in space keeps the direction in which it starts, along that: beyond the
first it may turn back, which its direction may do before it has settled; beyond the second it need not keep it."""
_BACK: Final = 1e-8
"""The part of the first by which it has turned back: rounding."""
_SLOW: Final = 3e-3
"""The part of the model's speed that this speed is at most."""
_NEVER: Final = 1e300

MOST_KEPT: Final = 1000
"""Modes that the runs of a prepared system remember, those that were needed last: one among 102
contacts takes 46 kB."""

Key = tuple[tuple[tuple[str, int], ...], ...]
_K = TypeVar("_K")
_V = TypeVar("_V")


def keep(known: dict[_K, _V], key: _K, value: _V, most: int) -> None:
    """Remember a value as the latest, and no more values than `most`."""
    known.pop(key, None)
    known[key] = value
    if len(known) > most:
        del known[next(iter(known))]


def key_of(mode: Mode) -> Key:
    """Return what tells modes apart: not the directions of slip in space, nor shares, which are numbers of a run."""
    sides = tuple(sorted((name, side) for name, side in mode.sides.items() if side != INACTIVE))
    starts = tuple((name, 1) for name in sorted(mode.directions))
    shared = tuple(
        (row, len(x.rows)) for x in (mode.shares.elements if mode.shares is not None else ()) for row in x.rows
    )
    idle = tuple((name, 0) for name in sorted(mode.idle))
    maps = (tuple(sorted(each.items())) for each in (mode.slips, mode.carried))
    return (sides, *maps, starts, idle, shared)


@dataclass(frozen=True, eq=False)
class ModeSwitchings:
    """Switching functions by their numbers: those where all is `apart`, which modes share, but for a mode's `own`."""

    apart: Sequence[Switching | None]
    own: Mapping[int, Switching | None] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.apart)

    def __getitem__(self, index: int) -> Switching | None:
        return self.own[index] if index in self.own else self.apart[index]

    def __iter__(self) -> Iterator[Switching | None]:
        return (self[index] for index in range(len(self.apart)))


@dataclass(frozen=True, eq=False)
class ModeProgram:
    """A mechanism in a mode, `entered`, the mechanism that its Programs are of, and switching functions.

    The Programs are those of the mode alone, or of the mechanism `in_every_mode`; then functions at which this mode
    does not end are None. The `mode` is one of those that only differ in numbers of a run; `own` are the places of all
    functions but those by which what is apart closes.
    """

    entered: Mechanism
    mechanism: Mechanism
    compiled: Compiled
    switchings: ModeSwitchings
    mode: Mode
    every: EveryMode | None
    own: tuple[int, ...]

    @cached_property
    def key(self) -> Key:
        """What tells the mode apart."""
        return key_of(self.mode)

    @cached_property
    def active(self) -> tuple[str, ...]:
        """The unilateral elements that are closed."""
        elements = taking_part(self.mechanism, self.mode)
        return tuple(x.name for x in elements if x.unilateral and self.mode.acts(x))

    @cached_property
    def words(self) -> dict[str, str]:
        """The state of each one-way element."""
        return mode_words(self.mechanism.one_way, self.mode)

    def numbers(self, mode: Mode) -> ModeNumbers:
        """Return the numbers (nm,) by which its Programs know the mode, with what this one chooses."""
        chosen = chosen_parameters(mode)
        if self.every is None or not chosen:
            return self._numbers
        places = number_places(self.every.mechanism)
        return self._numbers.with_own({places[name]: x for name, x in chosen.items()})

    @cached_property
    def limiting(self) -> tuple[int, ...]:
        """The functions that keep adaptive steps short."""
        return tuple(k for k in self.own if (one := self.switchings[k]) is not None and one.shortens)

    def margins(self, mode: Mode, at: LawValues, largest: float) -> tuple[float, ...]:
        """Return by how much each function may exceed zero, as a mode begins with a largest force."""
        found = [0.0] * len(self.switchings) if self.every is None else list(self.every.margins(at.rounded_gaps))
        for k in self.own:
            one = self.switchings[k]
            found[k] = 0.0 if one is None else _margin(one, mode, at, largest)
        return tuple(found)

    @cached_property
    def _numbers(self) -> ModeNumbers:
        if self.every is None:
            return NO_MODE
        watched = {self.every.names[k]: float(one is not None) for k, one in self.switchings.own.items()}
        return ModeNumbers.of(self.every.numbers, own_numbers(self.every.mechanism, self.entered, watched))


def function_of(one: Switching) -> str:
    """Return the name of a switching function among those of all modes."""
    if one.ends == "turns":
        return f"turns {one.element.normals[one.normal].name}"
    kind = _KINDS[one.ends]
    return f"{kind} {one.element.name if one.part is None else one.part.name}"


_KINDS: Final = {
    **dict.fromkeys(("closes", "opens"), "normal"),
    "leaves": "edge",
    "lies flat": "flat",
    **dict.fromkeys(("slips", "stops", "stops in space"), "slip"),
    "moves on": "onward",
    "turns back": "back",
}
_FLATTER: Final = -1e-20
"""The same (rad^2/s) of a rim that has to come flatter first: one that rises ends no mode."""


@dataclass(frozen=True, eq=False)
class EveryMode:
    """A mechanism `in_every_mode` with its Programs, and the switching functions of what is apart."""

    mechanism: Mechanism
    compiled: Compiled
    _margins: list[tuple[Floats, list[float]]] = field(default_factory=list)

    @cached_property
    def places(self) -> dict[str, int]:
        """The places of all functions by their names."""
        return {name: k for k, name in enumerate(self.names)}

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The names of all functions."""
        return tuple(functions(self.mechanism))

    @cached_property
    def numbers(self) -> Floats:
        """The numbers (nm,) that modes share: those where all unilateral elements are apart."""
        found = np.zeros(len(self.mechanism.mode_numbers))
        free = replace(self.mechanism, rows=(), held=(), mode=Mode({}))
        watched = {self.names[k]: 1.0 for k, one in enumerate(self.apart[0]) if one is not None}
        for k, x in (usual_numbers(self.mechanism) | own_numbers(self.mechanism, free, watched)).items():
            found[k] = x
        return found

    @cached_property
    def apart(self) -> tuple[list[Switching | None], dict[str, int]]:
        """The functions where all unilateral elements are apart, each of which closes, and their places by elements."""
        found: list[Switching | None] = [None] * len(self.places)
        places = dict[str, int]()
        for element in (x for x in self.mechanism.one_way if x.unilateral):
            for one in switchings_of(Mode({}), element):
                places[element.name] = self.places[function_of(one)]
                found[places[element.name]] = one
        return found, places

    def of_mode(self, mode: Mode) -> ModeSwitchings:
        """Return the functions at which a mode ends, None where it does not; `own` are those that are no gaps."""
        found, places = self.apart
        own = {places[x.name]: found[places[x.name]] for x in self._tips}
        for element in taking_part(self.mechanism, mode):
            if element.unilateral:
                own[places[element.name]] = None
            own |= {self.places[function_of(one)]: one for one in switchings_of(mode, element)}
        return ModeSwitchings(found, own)

    @cached_property
    def _tips(self) -> list[LawElement]:
        return [x for x in self.mechanism.one_way if is_tip(x)]

    def margins(self, gaps: Floats) -> Sequence[float]:
        """Return the margins of all functions by those of `gaps`, zero for others; the same numbers for the same gaps.

        A run keeps the margins of all its legs, and gaps are rounded coarsely.
        """
        if not self._margins or not np.array_equal(self._margins[-1][0], gaps):
            found = np.zeros(len(self.names))
            found[self.gaps] = gaps
            self._margins[:] = [(gaps, found.tolist())]
        return self._margins[-1][1]

    @cached_property
    def gaps(self) -> Places:
        """The places of the functions by which unilateral elements close, in their order."""
        return np.array([self.apart[1][x.name] for x in self.mechanism.one_way if x.unilateral], dtype=np.intp)


class ModePrograms:
    """The modes that a run of a mechanism has been in; `make` compiles, `template` is the run's problem.

    Rows of every mode are put back after each step if the template is, or `stabilised` by alpha, beta (1/s). `every`
    has the Programs that serve all modes, where one set of them does.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        make: Callable[[Mechanism], Compiled],
        template: Problem,
        stabilised: tuple[float, float] = (0.0, 0.0),
        every: EveryMode | None = None,
    ) -> None:
        self.mechanism = mechanism
        self.every = every
        self.template = template
        self._make = make
        self._chosen = dict(zip((ALPHA, BETA), stabilised, strict=True))
        self._known: dict[tuple[Key, tuple[float, ...]], ModeProgram] = {}
        self._holding: dict[Holding, bool] = {}
        self._terminals: dict[tuple[tuple[bool, ...], int], tuple[bool, ...]] = {}

    def program(self, mode: Mode, at: LawValues) -> ModeProgram:
        """Return the Programs of a mode; which speeds it holds shows at the first instant at which a run is in it."""
        key = key_of(mode), remembered_normals(at, mode)
        found = self._known.get(key)
        if found is None:
            entered = in_mode(self.mechanism, mode)
            values = self.parameters(entered, at.laws.parameters, mode, 0)
            held = held_speeds(entered, values, at, {} if key[1] else self._holding)  # normals change rows
            found = self._made(replace(entered, held=held), mode)
        keep(self._known, key, found, MOST_KEPT)
        return found

    def _made(self, entered: Mechanism, mode: Mode) -> ModeProgram:
        # One contact and a rope on one line share forces, which Programs of all modes do only of several contacts.
        chosen = chosen_parameters(mode).keys()
        if self.every is None or not chosen <= number_places(self.every.mechanism).keys():
            own = switchings(entered)
            every_one = tuple(range(len(own)))
            return ModeProgram(entered, entered, self._make(entered), ModeSwitchings(own), mode, None, every_one)
        every = replace(self.every.mechanism, mode=mode, held=entered.held)
        found = self.every.of_mode(mode)
        return ModeProgram(entered, every, self.every.compiled, found, mode, self.every, tuple(sorted(found.own)))

    def parameters(self, entered: Mechanism, values: Floats, mode: Mode, independent: int) -> Floats:
        """Return the parameters (np,) of a mechanism in a mode, by those of the mechanism in none."""
        base = self.mechanism.parameters.places
        own = chosen_parameters(mode)
        found = []
        for entry in entered.parameters:
            if entry.name == INDEPENDENT:
                found.append(float(independent))
            elif entry.name in self._chosen:
                found.append(self._chosen[entry.name])
            elif entry.name in base:
                found.append(float(values[base[entry.name]]))
            else:
                found.append(own.get(entry.name, 0.0))
        return np.array(found)

    def _terminal(self, entered: Mechanism, count: int) -> tuple[bool, ...]:
        """Return for each switching function whether a run stops there, with `count` of a mode; modes share them."""
        own = self.template.terminal[: len(entered.stops) + len(entered.kinks) + len(entered.fades)]
        key = own, count
        if key not in self._terminals:
            self._terminals[key] = own + (True,) * count
        return self._terminals[key]

    def problem(self, state: NextState, begun: Begun | None) -> tuple[Problem, ModeProgram]:
        """Return the run from an instant on in the mode that was found."""
        at, mode = state.facts, state.mode
        assert mode is not None
        program = self.program(mode, at)
        entered = program.entered
        independent = len(entered.rows)
        if state.posed is not None and entered.rows:
            places = [state.posed.places[row.name] for row in entered.rows]
            laws = state.posed.problem
            independent = int(rank(np.hstack([laws.matrix[places], laws.coupling[places]]), ROUNDED))
        size = min(1.0, _SLOW * at.scale.speed / STARTING)  # directions are shorter where the whole model is slow
        shorter = {name: tuple(size * x for x in way) for name, way in mode.directions.items()}
        mode = replace(mode, directions=shorter)
        values = self.parameters(program.mechanism, at.laws.parameters, mode, independent)
        u = at.u.copy()
        u[list(entered.held)] = 0.0
        problem = replace(
            self.template,
            compiled=program.compiled,
            q0=at.q,
            u0=u,
            parameters=values,
            mode=program.numbers(mode),
            project=bool(entered.rows) and self.template.project,
            independent=float(independent),
            crosses=not has_sliding_friction(at, entered),  # friction may jam there
            terminal=self._terminal(entered, len(program.switchings)),
            margins=program.margins(mode, at, state.largest),
            limiting=program.limiting,
            begun=begun,
        )
        return problem, program


def settled_direction(program: ModeProgram, now: Problem, mode: Mode, part: FrictionPart) -> tuple[Problem, Mode]:
    """Return the run in a mode, and the mode, in which a part that starts to slide in space has come to move so fast.

    First it may turn back from then on: sooner its direction may still settle. Then it does not keep that any more.
    """
    own = {x.ends: k for k, x in enumerate(program.switchings) if x is not None and x.part == part}
    margins, values, numbers = list(now.margins), now.parameters.copy(), now.mode
    if margins[own["turns back"]] == _NEVER:
        margins[own["turns back"]] = _BACK * margins[own["moves on"]]
        margins[own["moves on"]] *= _ON_ITS_WAY / _BEGUN
    else:
        margins[own["turns back"]] = margins[own["moves on"]] = _NEVER
        mode = replace(mode, directions={**mode.directions, part.name: (0.0,) * len(part.rows)})
        if program.mechanism.mode_numbers:
            numbers = program.numbers(mode)
        else:
            values[[program.mechanism.parameters.places[name] for name in direction_names(part)]] = 0.0
    return replace(now, parameters=values, mode=numbers, margins=tuple(margins)), mode


def _margin(one: Switching, mode: Mode, at: LawValues, largest: float) -> float:
    """Return by how much a switching function may exceed zero: what rounding may make of nothing."""
    if one.limits:
        return FORCE_MARGIN * largest
    if one.ends == "leaves" and is_tip(one.element):
        return at.allowed_gap(one.element)
    if one.ends == "closes" and is_tip(one.element):  # points that part where they are have met
        return -rounded_meeting(at, one.element)
    if one.ends == "closes" and one.element.name in mode.idle:
        return at.rounded_idle_gap(one.element)
    if one.ends in ("closes", "leaves"):
        return at.rounded_gap(one.element)
    if one.ends == "lies flat":
        return _FLATTER
    assert one.part is not None
    if one.ends == "turns back":
        return _NEVER
    if one.ends == "moves on":
        way = mode.directions[one.part.name]
        return _BEGUN * STARTING * math.fsum(x * x for x in way) or _NEVER
    if one.ends == "stops":
        row = one.part.rows[0]
        by_time = TIME_MARGIN * abs(at.t) * abs(float(at.known["right"][at.place(row)]))
        return rounded_up(at.allowed_speed(row, SPEED_MARGIN) + min(by_time, at.allowed_speed(row, MOST_TIME_MARGIN)))
    return -at.allowed_slip(one.part, _AT_REST)
