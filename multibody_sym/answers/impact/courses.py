"""Formulas for the jumps of rows: in one impact, or through several that follow each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import Final

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.quotients import Letter, NoClosedFormError
from multibody_sym.answers.closed_form import closed_forms
from multibody_sym.answers.impact.order import Blows
from multibody_sym.answers.impact.record import ImpactStep
from multibody_sym.answers.symbolic_state import SymbolicState
from multibody_sym.dynamics.formalisms.forward_dynamics import forward_dynamics
from multibody_sym.dynamics.impacts.impulsive import plane_element, rubbing
from multibody_sym.dynamics.impacts.plane_course import Deciding, Following, plane_contact, plane_course
from multibody_sym.dynamics.impacts.problem import ImpactLaw, Struck
from multibody_sym.dynamics.impacts.program import StruckMode
from multibody_sym.dynamics.laws.assemble import tree_dynamics_of
from multibody_sym.errors import ExpressionError
from multibody_sym.kinematics.impacts import resting
from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.rows import row_motions
from multibody_sym.kinematics.state import State
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import OneWay
from multibody_sym.records import dataclass
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
    """The way of an impact over Nodes: its mode and impacts, and the letters of the start.

    On the way it notes `conditions`: what is positive where slip changes as it does, and what happens else; of several
    impacts the `steps`; and where something pushes first, the speeds of rows with which they are `striking`.
    """

    mode: StruckMode
    struck: Struck
    letters: Mapping[Node, Letter]
    reasons: dict[str, None]
    law: ImpactLaw = "newton"
    conditions: list[tuple[Node, str]] = field(default_factory=list)
    steps: list[Blows] = field(default_factory=list)
    striking: dict[str, Node] = field(default_factory=dict)

    def jumps(self, before: Motion) -> Mapping[int, Node] | None:
        """Return the jumps of the rows of the whole impact by number; None, with the reason noted, without formula."""
        given = self.mode.rows.given
        element = plane_element(self.mode.blow)
        if given and (element is None or element.normals[0].name not in given):
            self.reasons[f"{', '.join(sorted(given))} slides in space, or now this way and now that"] = None
            return None
        try:
            pushed = self._pushed(before) if self.mode.pushes else before
            striking = {row.name for element in self.mode.blow.elements for row in element.rows}
            speeds = _speeds(pushed) if self.mode.pushes else {}
            self.striking.update({name: speed for name, speed in speeds.items() if name in striking})
            if given and element is not None:
                return self._along_plane(element, before, pushed)
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
        return self._solved(mechanism, before, jumps)[0]

    def _solved(self, mechanism: Mechanism, before: Motion, jumps: Mapping[int, Node]) -> tuple[Motion, list[Node]]:
        """Return the motion after jumps of rows, and the impulses."""
        forms = closed_forms(mechanism, SymbolicState(resting(before.state, jumps), self.letters))
        return self.mode.pushed(before, [book_form(x) for x in forms.udot]), [book_form(x) for x in forms.multipliers]

    def _note(
        self, struck: tuple[str, ...], impulses: Sequence[Node], before: Mapping[str, Node], after: Mapping[str, Node]
    ) -> None:
        normals = {x.name: x.normals[0].name for x in self.mode.blow.elements}
        speeds = [{name: each[row] for name, row in normals.items()} for each in (before, after)]
        self.steps.append(Blows(struck, dict(zip(struck, impulses, strict=True)), speeds[0], speeds[1]))

    def _along_plane(self, element: OneWay, before: Motion, pushed: Motion) -> dict[int, Node]:
        """Return the jumps of the mechanism's own rows, and the impulses of a contact whose slip changes on the way."""
        blow, decided = self.mode.blow, Deciding()

        def in_floats(mechanism: Mechanism, state: State) -> list[float]:
            return [float(x) for x in forward_dynamics(tree_dynamics_of(mechanism, state)).udot]

        def in_symbols(mechanism: Mechanism, state: State) -> list[Node]:
            return [book_form(x) for x in closed_forms(mechanism, SymbolicState(state, self.letters)).udot]

        numbers = blow.motion
        if self.mode.pushes:
            own = {k: float(x) for k, x in self.mode.joined(numbers).items()}
            numbers = self.mode.pushed(numbers, in_floats(self.mode.alone, resting(numbers.state, own)))
        plane_course(plane_contact(blow, element, self.law, (blow.motion, numbers), in_floats), decided)
        follows = Following(decided.taken)
        contact = plane_contact(blow, element, self.law, (before, pushed), in_symbols, in_numbers=False)
        impulses = plane_course(contact, follows)
        self.conditions.extend((as_node(x), broken) for x, broken in follows.conditions)
        found = {k: as_node(x) for k, x in self.mode.own(before).items()}
        return found | {k: as_node(x) for k, x in enumerate(impulses, len(blow.mechanism.rows))}

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
            later, impulses = self._solved(blow.resting(rows), now, wanted)
            self._note(step.struck, impulses[own:], speeds, _speeds(later))
            now = later
        start, end = _speeds(before), _speeds(now)
        found = {k: as_node(x) for k, x in self.mode.own(before).items()}
        return found | {k: as_node(end[name] - start[name]) for k, name in enumerate(self.mode.acting) if k >= own}


def _speeds(motion: Motion) -> dict[str, Node]:
    names = (row.name for row in motion.mechanism.rows)
    return {name: as_node(row.phidot) for name, row in zip(names, row_motions(motion), strict=True)}
