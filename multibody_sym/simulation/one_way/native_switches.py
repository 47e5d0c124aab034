"""What the loop in C knows of a run in modes: the modes it was in, and switches that lead from one to another."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

from multibody_sym.dynamics.laws.assemble import Scale
from multibody_sym.dynamics.programs.switching import Switching
from multibody_sym.integrators.methods.library import LibraryMethod
from multibody_sym.runtime.course import ANGLE, FORCE, LENGTH, SPEED, ActingRows, KnownTurn, Passage
from multibody_sym.runtime.problem import Course, CourseMode, Problem
from multibody_sym.simulation.one_way.at_switches import stops_at_turns
from multibody_sym.simulation.one_way.facts import Laws
from multibody_sym.simulation.one_way.known_switches import ActiveRows, KnownSwitch, plain
from multibody_sym.simulation.one_way.legs import Leg
from multibody_sym.simulation.one_way.modes import Key, key_of

_ROWS: Final = 48


class NativeSwitches:
    """Modes of a mechanism that the loop in C can follow, each by the first leg in it, and what leads between them.

    A switch that comes sooner than `least` (s) after another one is left to others.
    """

    def __init__(self, laws: Laws, least: float) -> None:
        self.laws = laws
        self.least = least
        self.legs: list[Leg] = []
        self._numbers: dict[Key, int] = {}
        self._modes: list[CourseMode] = []

    @classmethod
    def of(cls, laws: Laws, template: Problem, least: float) -> NativeSwitches | None:
        """Return them with no mode yet; None where C cannot follow a run, or where this may stop at a switch."""
        pairs, mechanism = template.pairing, laws.mechanism
        smooth = template.step is None and not isinstance(template.method, LibraryMethod)
        rates = not pairs.balls and len(pairs.plain) == len(mechanism.coordinates)
        follows = laws.compiled.backend == "c" and smooth and rates and all(plain(x) for x in mechanism.one_way)
        return cls(laws, least) if follows and not stops_at_turns(mechanism) else None

    def course(self, passed: Callable[[Passage], None]) -> Course:
        """Return the course of a run, which is told of the turns that the loop in C takes."""
        laws, elements = self.laws, self.laws.mechanism.one_way
        normals = tuple(laws.places[x.normals[0].name] for x in elements)
        angles = tuple(int(x.name in laws.turning) for x in elements)
        about = (laws.parameters, normals, angles, laws.slides, 1.0, self.least, passed)
        return Course(laws.compiled, laws.matrices, *about, modes=self._modes)

    def entered(self, leg: Leg, course: Course, time: float, scale: Scale) -> Course | None:
        """Return the course of a run as a leg begins; None where C cannot follow it in its mode."""
        program, problem = leg.program, leg.of
        rows = program.entered.rows
        if not (problem.project or not rows) or len(rows) > _ROWS or problem.independent < len(rows):
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

    def learn(self, leg: Leg, index: int, switches: Sequence[KnownSwitch]) -> None:
        """Let C know where a switching function of a leg's mode leads."""
        if leg.program.key in self._numbers:
            known = [self._turn(switch) for switch in switches if key_of(switch.mode) in self._numbers]
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
            after=_rows(switch.after),
            before=ActingRows() if switch.before is None else _rows(switch.before),
            cause=-1 if switch.cause is None else switch.cause,
            way=ways[0] if ways else 0,
        )


def _rows(acting: ActiveRows) -> ActingRows:
    return ActingRows(
        acting.active,
        tuple((x.normal, x.tangent, x.part, x.sense, int(x.begins)) for x in acting.slides),
        tuple((x.normal, x.tangent, x.part, 0, 0) for x in acting.sticks),
        acting.pressing,
        acting.apart,
    )
