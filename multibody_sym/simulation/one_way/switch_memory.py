"""What the runs of a prepared system remember: where switches led, in modes that the loop in C may follow as well."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Final

from multibody_sym.dynamics.laws.assemble import Scale
from multibody_sym.dynamics.programs.switching import Switching
from multibody_sym.integrators.methods.library import LibraryMethod
from multibody_sym.runtime.course import ANGLE, FORCE, LENGTH, SPEED, ActiveRows, KnownTurn, Passage
from multibody_sym.runtime.problem import Course, CourseMode, Problem
from multibody_sym.simulation.one_way.at_switches import stops_at_turns
from multibody_sym.simulation.one_way.decision import NextState
from multibody_sym.simulation.one_way.facts import Laws
from multibody_sym.simulation.one_way.known_switches import KnownSwitch, known_switch, plain
from multibody_sym.simulation.one_way.legs import Leg
from multibody_sym.simulation.one_way.modes import Key, key_of

_ROWS: Final = 48

_MOST_ENTRIES: Final = 100_000
"""Elements of all rows, zeros too, up to which C follows switches: it looks at all of them."""


class SwitchMemory:
    """Where switching functions of modes led, and the modes that C can follow, each by the first leg in it.

    Whether a run goes that way is decided by the laws alone, so that it does not matter which run remembered it. Those
    that come sooner than `least` (s) after another one are not for C.
    """

    def __init__(self, laws: Laws, template: Problem, least: float) -> None:
        self.laws = laws
        self.least = least
        self.legs: list[Leg] = []
        self._led: dict[tuple[Key, int], tuple[KnownSwitch, ...]] = {}
        self._numbers: dict[Key, int] = {}
        self._modes: list[CourseMode] = []
        pairs, mechanism = template.pairing, laws.mechanism
        smooth = template.step is None and not isinstance(template.method, LibraryMethod)
        rates = not pairs.balls and len(pairs.plain) == len(mechanism.coordinates)
        follows = laws.compiled.backend == "c" and smooth and rates and all(plain(x) for x in mechanism.one_way)
        few = len(laws.places) * len(mechanism.speeds) <= _MOST_ENTRIES
        self.follows = follows and few and not stops_at_turns(mechanism)

    def known(self, leg: Leg, index: int) -> tuple[KnownSwitch, ...]:
        """Return where a switching function of a leg's mode has led."""
        return self._led.get((leg.program.key, index), ())

    def learn(self, found: NextState, leg: Leg, index: int) -> None:
        """Remember where a switch led: for forces at a limit all ways, for others the last one."""
        cause = leg.switching(index)
        switch = known_switch(found, leg.mode, cause)
        others = self.known(leg, index) if cause.limits else ()
        others = tuple(x for x in others if switch is None or x.mode != switch.mode)
        self._led[leg.program.key, index] = (*others, *(() if switch is None else (switch,)))

    # --- the loop in C ------------------------------------------------------------------------------------------------

    def course(self, passed: Callable[[Passage], None]) -> Course | None:
        """Return the course of a run, None where C cannot follow it; `passed` gets each turn that C takes."""
        laws, elements = self.laws, self.laws.mechanism.one_way
        if not self.follows:
            return None
        normals = tuple(laws.places[x.normals[0].name] for x in elements)
        angles = tuple(int(x.name in laws.turning) for x in elements)
        about = (laws.parameters, normals, angles, laws.slides, 1.0, self.least, passed)
        return Course(laws.compiled, laws.matrices, *about, modes=self._modes)

    def entered(self, leg: Leg, course: Course | None, time: float, scale: Scale) -> Course | None:
        """Return the course of a run as a leg begins; None where C cannot follow it in its mode."""
        program, problem = leg.program, leg.of
        rows = program.entered.rows
        kept = problem.project or not rows
        if course is None or not kept or len(rows) > _ROWS or problem.independent < len(rows):
            return None
        number = self._numbers.setdefault(program.key, len(self.legs))
        if number == len(self.legs):
            rules = tuple(self._rule(one) for one in program.switchings)
            closed = tuple(int(x.name in program.active) for x in self.laws.mechanism.one_way)
            turns: list[list[KnownTurn]] = [[] for _ in rules]
            self._modes.append(CourseMode(problem, rules, tuple(program.entered.held), closed, turns))
            self.legs.append(replace(leg, cause=None))
        course.mode, course.since = number, time
        course.length, course.speed = scale.length, scale.speed
        return course

    def tell_c(self, leg: Leg, index: int) -> None:
        """Let C know where a switching function of a leg's mode leads, as far as it knows the modes."""
        if leg.program.key in self._numbers:
            known = [self._turn(switch) for switch in self.known(leg, index) if key_of(switch.mode) in self._numbers]
            self._modes[self._numbers[leg.program.key]].turns[index] = known

    def _rule(self, one: Switching | None) -> tuple[int, int]:
        if one is None or one.limits:
            return FORCE, -1
        if one.part is None:
            return (ANGLE if one.element.name in self.laws.turning else LENGTH), -1
        return SPEED, self.laws.places[one.part.rows[0].name]

    def _turn(self, switch: KnownSwitch) -> KnownTurn:
        places, mechanism = self.laws.places, self.laws.mechanism
        touching = [x for x in mechanism.one_way if x.name in switch.touching]
        rows = (*mechanism.rows, *(x.normals[0] for x in touching))
        ways = [one.sense for one in switch.after.slides if one.tangent == switch.cause]
        return KnownTurn(
            to=self._numbers[key_of(switch.mode)],
            touching=tuple(int(x.name in switch.touching) for x in mechanism.one_way),
            kept=tuple(places[row.name] for row in rows),
            rows=switch.rows,
            signs=tuple((places[part.rows[0].name], sign) for part, sign in switch.signs),
            after=switch.after,
            before=switch.before or ActiveRows(),
            cause=-1 if switch.cause is None else switch.cause,
            way=ways[0] if ways else 0,
        )
