"""Formulas for the jumps of rows: in one impact, or through several that follow each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.quotients import Letter, NoClosedFormError
from multibody_sym.answers.closed_form import closed_forms
from multibody_sym.answers.impact.record import ImpactStep
from multibody_sym.answers.symbolic_state import SymbolicState
from multibody_sym.dynamics.impacts.impulsive import rubbing
from multibody_sym.dynamics.impacts.problem import Struck
from multibody_sym.dynamics.impacts.program import StruckMode
from multibody_sym.errors import ExpressionError
from multibody_sym.kinematics.impacts import resting
from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.rows import row_motions
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import OneWay
from multibody_sym.scalars.node import Node, as_node

_MOST: Final = 12
"""Through how many impacts formulas are led, which grow with each."""


def impact_steps(elements: Sequence[OneWay], names: Sequence[str], struck: Struck) -> list[ImpactStep]:
    """Return the impacts in their order."""
    owners = {names.index(element.normals[0].name): element.name for element in elements}
    found = []
    for number in range(1, struck.impacts + 1):
        phases = [phase for phase in struck.phases if phase.number == number]
        rows = sorted({row for phase in phases for row in phase.rows})
        total = {owners[row]: float(sum(phase.impulses[row] for phase in phases)) for row in rows}
        found.append(ImpactStep(tuple(total), total))
    return found


@dataclass(frozen=True, eq=False)
class Course:
    """The way of an impact over Nodes: its mode and impacts, and the letters of the start."""

    mode: StruckMode
    struck: Struck
    letters: Mapping[Node, Letter]
    reasons: dict[str, None]

    def jumps(self, before: Motion) -> Mapping[int, Node] | None:
        """Return the jumps of the rows of the whole impact by number; None, with the reason noted, without formula."""
        if self.mode.rows.given:
            self.reasons[f"{', '.join(sorted(self.mode.rows.given))} changes on the way"] = None
            return None
        try:
            pushed = self._pushed(before) if self.mode.pushes else before
            if self.struck.impacts <= 1:
                return {k: as_node(x) for k, x in self.mode.wanted(before, pushed).items()}
            return self._through(before, pushed)
        except NoClosedFormError as reason:
            self.reasons[str(reason)] = None
        except ExpressionError as reason:
            self.reasons[reason.message] = None
        return None

    def _pushed(self, before: Motion) -> Motion:
        """Return the motion that given impulses, and what begins or jumps, leave: then contacts strike."""
        joined = {k: as_node(x) for k, x in self.mode.joined(before).items()}
        return self._after(self.mode.alone, before, joined)

    def _after(self, mechanism: Mechanism, before: Motion, jumps: Mapping[int, Node]) -> Motion:
        forms = closed_forms(mechanism, SymbolicState(resting(before.state, jumps), self.letters))
        return self.mode.pushed(before, [book_form(x) for x in forms.udot])

    def _through(self, before: Motion, first: Motion) -> dict[int, Node]:
        """Return the jumps of rows from before to the end of impacts one after the other."""
        blow, now = self.mode.blow, first
        by_name = {element.name: element for element in blow.elements}
        steps = impact_steps(blow.elements, blow.names, self.struck)
        if len(steps) > _MOST:
            raise NoClosedFormError(f"{len(steps)} impacts follow each other")
        own = len(blow.mechanism.rows)
        for step in steps:
            striking = [by_name[name] for name in step.struck]
            if self.mode.rows.joints or any(map(rubbing, striking)):
                raise NoClosedFormError("several impacts with friction follow each other")
            speeds = _speeds(now)
            rows = [element.normals[0] for element in striking]
            bounce = [now.state.values([element.restitution])[0] for element in striking]
            wanted = {k: as_node(0) for k in range(own)}
            for k, (row, e) in enumerate(zip(rows, bounce, strict=True), own):
                wanted[k] = as_node(-(1 + e) * speeds[row.name])
            now = self._after(blow.resting(rows), now, wanted)
        start, end = _speeds(before), _speeds(now)
        found = {k: as_node(x) for k, x in self.mode.own(before).items()}
        return found | {
            k: as_node(end[name] - start[name]) for k, name in enumerate(self.mode.told) if k >= own
        }


def _speeds(motion: Motion) -> dict[str, Node]:
    names = (row.name for row in motion.mechanism.rows)
    return {name: as_node(row.phidot) for name, row in zip(names, row_motions(motion), strict=True)}
