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
from multibody_sym.simulation.one_way.facts import Laws
from multibody_sym.simulation.one_way.legs import Leg
from multibody_sym.simulation.one_way.modes import Key, key_of
from multibody_sym.simulation.one_way.turns import Acting, Turn, plain

_ROWS: Final = 48


class NativeSwitches:
    """The course of a run, as far as C can follow it, and the last leg in each mode; `least` as for `Course`."""

    def __init__(self, laws: Laws, template: Problem, least: float, passed: Callable[[Passage], None]) -> None:
        self.laws = laws
        self.course: Course | None = None
        self.legs: list[Leg] = []
        self._numbers: dict[Key, int] = {}
        pairs, mechanism = template.pairing, laws.mechanism
        smooth = template.step is None and not isinstance(template.method, LibraryMethod)
        rates = not pairs.balls and len(pairs.plain) == len(mechanism.coordinates)
        if laws.compiled.backend == "c" and smooth and rates and all(plain(x) for x in mechanism.one_way):
            normals = [laws.places[x.normals[0].name] for x in mechanism.one_way]
            angles = [int(x.name in laws.turning) for x in mechanism.one_way]
            about = (tuple(normals), tuple(angles), laws.slides, 1.0, least)
            self.course = Course(laws.compiled, laws.matrices, laws.parameters, *about, passed)

    def entered(self, leg: Leg, time: float, scale: Scale) -> Leg:
        """Return a leg that begins, which knows the course if C can follow it in its mode."""
        program, problem = leg.program, leg.of
        rows = program.entered.rows
        kept = problem.project or not rows
        if self.course is None or not kept or len(rows) > _ROWS or problem.independent < len(rows):
            self.course = None
            return leg
        course, number = self.course, self._numbers.setdefault(program.key, len(self.legs))
        if number == len(self.legs):
            rules = tuple(self._rule(one) for one in program.switchings)
            closed = tuple(int(x.name in program.active) for x in self.laws.mechanism.one_way)
            turns: list[list[KnownTurn]] = [[] for _ in rules]
            course.modes.append(CourseMode(problem, rules, tuple(program.entered.held), closed, turns))
            self.legs.append(leg)
        course.mode, course.since = number, time
        course.length, course.speed = scale.length, scale.speed
        self.legs[number] = replace(leg, of=replace(problem, course=course), cause=None)
        return replace(self.legs[number], cause=leg.cause)

    def learn(self, leg: Leg, index: int, turns: Sequence[Turn]) -> None:
        """Let C know where a switching function of a leg's mode leads."""
        if self.course is not None:
            known = [self._turn(turn) for turn in turns if key_of(turn.mode) in self._numbers]
            self.course.modes[self._numbers[leg.program.key]].turns[index] = known

    def _rule(self, one: Switching | None) -> tuple[int, int]:
        if one is None or one.limits:
            return FORCE, -1
        if one.part is None:
            return (ANGLE if one.element.name in self.laws.turning else LENGTH), -1
        return SPEED, self.laws.places[one.part.rows[0].name]

    def _turn(self, turn: Turn) -> KnownTurn:
        places, mechanism = self.laws.places, self.laws.mechanism
        touching = [x for x in mechanism.one_way if x.name in turn.touching]
        rows = (*mechanism.rows, *(x.normals[0] for x in touching))
        ways = [one.sense for one in turn.after.slides if one.tangent == turn.cause]
        return KnownTurn(
            to=self._numbers[key_of(turn.mode)],
            touching=tuple(int(x.name in turn.touching) for x in mechanism.one_way),
            kept=tuple(places[row.name] for row in rows),
            rows=turn.rows,
            signs=tuple((places[part.rows[0].name], sign) for part, sign in turn.signs),
            after=_rows(turn.after),
            before=ActingRows() if turn.before is None else _rows(turn.before),
            cause=-1 if turn.cause is None else turn.cause,
            way=ways[0] if ways else 0,
        )


def _rows(acting: Acting) -> ActingRows:
    return ActingRows(
        acting.active,
        tuple((x.normal, x.tangent, x.part, x.sense, int(x.begins)) for x in acting.slides),
        tuple((x.normal, x.tangent, x.part, 0, 0) for x in acting.sticks),
        acting.pressing,
        acting.apart,
    )
