"""All that is told of an impact."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from functools import cached_property
from typing import Any, Final

import numpy as np

from multibody_sym.analysis.struck import PosedImpact, outcome, posed_impact
from multibody_sym.answers.impact.centres import centres_of_percussion, instantaneous_centres
from multibody_sym.answers.impact.conditions import impact_conditions
from multibody_sym.answers.impact.courses import Course, impact_steps
from multibody_sym.answers.impact.needed import needed_friction
from multibody_sym.answers.impact.order import Order
from multibody_sym.answers.impact.record import ImpactFound
from multibody_sym.answers.impact.resting import (
    Befores,
    ImpactInstant,
    befores,
    row_impulses,
    solved_at_rest,
)
from multibody_sym.answers.impact.works import by_works, taken, works
from multibody_sym.answers.instant import Solved
from multibody_sym.dynamics.impacts.impulsive import StruckRows, rubbing, struck_rows
from multibody_sym.dynamics.impacts.problem import Struck
from multibody_sym.dynamics.impacts.program import StruckMode
from multibody_sym.dynamics.impacts.sequence import clusters
from multibody_sym.dynamics.programs.quantities import Instant
from multibody_sym.errors import RunError, Where
from multibody_sym.expressions.values import Value
from multibody_sym.kinematics.energy import kinetic_energy
from multibody_sym.kinematics.motion import Motion
from multibody_sym.model.declaration.system import System
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import OneWay
from multibody_sym.model.mechanism.rows import Row
from multibody_sym.model.mechanism.units import MechanismUnits
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, as_node

IMPULSE_UNITS: Final = {"fx": "N*s", "fy": "N*s", "fz": "N*s", "mx": "N*m*s", "my": "N*m*s", "mz": "N*m*s"}
_AT_REST: Final = 1e-9
"""The part of the largest speed below which a contact stays closed."""
_ROUNDED: Final = 1e-13
"""The part of the works that an impact does below which an energy is rounding."""

_DRIVEN: Final = 1e-9
"""The part of the kinetic energy from which on what moves as prescribed does work in an impact."""

Values = dict[str, Value]


def impact_found(system: System, formalism: str | None = None) -> tuple[ImpactFound, Solved]:
    """Return what the impact of a system does, and the solved mechanism of it.

    Raises InputError, NoSolutionError where nothing strikes or the laws have no solution, and RunError where they
    would make energy.
    """
    posed = posed_impact(system)
    struck = outcome(posed)
    _verify_no_gain(posed, struck)
    answer = _Answer(posed, struck, formalism)
    return answer.told(), answer.solved


def _verify_no_gain(posed: PosedImpact, struck: Struck) -> None:
    if struck.gained > 0.0:
        raise RunError(
            f"by {posed.law.capitalize()}'s law this impact would make energy: {struck.gained:.6g} J. With friction "
            "Newton's coefficient may do that; write law: poisson or law: stronge",
            where=Where(path=("impact", "law")),
            number="N108",
        )


@dataclass(frozen=True, eq=False)
class _Answer:
    """An impact and what it does, as it is put together."""

    posed: PosedImpact
    struck: Struck
    formalism: str | None
    reasons: dict[str, None] = field(default_factory=dict)

    @cached_property
    def rows(self) -> StruckRows:
        """The rows that act."""
        return struck_rows(self.posed.blow, self.struck)

    @cached_property
    def given(self) -> Befores:
        """The motion before."""
        return befores(self.posed)

    @cached_property
    def solved(self) -> Solved:
        """The mechanism of the impact."""
        return self._solved(self.rows.mechanism, self.rows.jumps, self._formula)

    def _solved(
        self, mechanism: Mechanism, jumps: Mapping[int, float], formula: Callable[[Motion], Mapping[int, Node] | None]
    ) -> Solved:
        return solved_at_rest(self.posed, self.given, mechanism, jumps, formula, self.formalism, self.reasons)

    def _formula(self, before: Motion) -> Mapping[int, Node] | None:
        """Return the jumps of rows over Nodes, None where no formula is known."""
        return self.course.jumps(before)

    @cached_property
    def course(self) -> Course:
        """The way of the impact over Nodes."""
        mode = StruckMode(self.posed.blow, self.rows)
        return Course(mode, self.struck, self.given.symbolic.letters, self.reasons, self.posed.law)

    @cached_property
    def order(self) -> Order:
        """Whose turn it is."""
        blow, letters = self.posed.blow, self.given.symbolic.letters
        samples = {node: float(letter.sample) for node, letter in letters.items()}
        found = clusters(self.posed.problem.rows)
        places = {x.name: blow.names.index(x.normals[0].name) for x in blow.elements}
        return Order(
            blow.elements,
            {x.name: as_node(self.given.nodes.state.values([x.restitution])[0]) for x in blow.elements},
            {name: found[k] for name, k in places.items()},
            self.posed.order == "one_by_one",
            lambda node: evaluate_float([node], samples)[0],
        )

    # --- what is told ---------------------------------------------------------------------------------------------

    def told(self) -> ImpactFound:
        """Return all that is told."""
        solved, names = self.solved, [speed.name for speed in self.posed.mechanism.speeds]
        units = {speed.name: speed.unit for speed in self.posed.mechanism.speeds}

        def jumps(instant: Instant) -> Mapping[str, Any]:
            return dict(zip(names, instant.udot, strict=True))

        def after(instant: Instant) -> Mapping[str, Any]:
            return dict(zip(names, _impact(instant).after, strict=True))

        lost = self._lost_by()
        energy_lost = self._energy_lost(lost)
        conditions = impact_conditions(solved, self.rows, self.order, self.course)
        return ImpactFound(
            law=self.posed.law,
            sequence=self.posed.order,
            impulses=self._impulses(),
            states=self._states(),
            jumps=solved.values(jumps, units),
            after=solved.values(after, units),
            joint_impulses=self._joint_impulses(),
            apparent_mass=self._apparent_masses(),
            closing=self._rates("before"),
            opening=self._rates("after"),
            energy_lost=energy_lost,
            energy_given=self._energy_given(energy_lost),
            needed=dict(needed_friction(solved, (*self.rows.acting, *self.rows.rough))),
            lost_by=lost,
            kinetic_energy=self._kinetic_energy(),
            instantaneous_centres=instantaneous_centres(self.posed.system, _impact(solved.numbers)),
            centres_of_percussion=centres_of_percussion(solved),
            conditions=tuple(conditions),
            notes=self._notes(),
            steps=tuple(impact_steps(self.posed.blow.elements, self.posed.blow.names, self.struck)),
            limits={each: broken for each, broken in conditions.items() if broken},
        )

    def _impulses(self) -> dict[str, Values]:
        found: dict[str, Values] = {}
        for element in self.rows.acting:

            def of_element(instant: Instant, element: OneWay = element) -> Mapping[str, Any]:
                return _impulses_of(instant, element)

            units = dict.fromkeys(("normal", "friction", "friction_1", "friction_2"), "N*s")
            found[element.name] = self.solved.values(of_element, units)
        return found | self._impulses_of_groups() | self._impulses_in_joints() | self._impulses_of_constraints()

    def _impulses_in_joints(self) -> dict[str, Values]:
        """Return the friction of each rough joint, of each pad where several rub."""
        found: dict[str, Values] = {}
        for element in self.rows.rough:
            rows = [row for part in rubbing(element) for row in part.rows]
            units = {row.name.removeprefix(f"{element.name}."): f"{row.unit}*s" for row in rows}

            def of_rows(
                instant: Instant, rows: Sequence[Row] = rows, words: Sequence[str] = tuple(units)
            ) -> Mapping[str, Any]:
                return dict(zip(words, row_impulses(_impact(instant), [row.name for row in rows]), strict=True))

            found[element.name] = self.solved.values(of_rows, units)
        return found

    def _impulses_of_groups(self) -> dict[str, Values]:
        """Return for each contact of several corners the sum of their impulses, which is unique where each is not."""
        groups: dict[str, list[OneWay]] = {}
        for element in self.rows.acting:
            if element.kind == "contact" and element.group not in ("", element.name):
                groups.setdefault(element.group, []).append(element)
        found: dict[str, Values] = {}
        for name, elements in groups.items():

            def of_group(instant: Instant, elements: Sequence[OneWay] = elements) -> Mapping[str, Any]:
                every = [_impulses_of(instant, element) for element in elements]
                return {part: sum((each[part] for each in every if part in each), 0) for part in every[0]}

            found[name] = self.solved.values(of_group, dict.fromkeys(("normal", "friction"), "N*s"))
        return found

    def _impulses_of_constraints(self) -> dict[str, Values]:
        """Return the impulses of declared constraints, and of what moves as prescribed and jumps."""
        mechanism, found = self.rows.mechanism, dict[str, Values]()
        acting = {row.name for x in (*self.posed.blow.elements, *self.posed.blow.rough) for row in x.rows}
        units = MechanismUnits(self.posed.blow.mechanism).multipliers
        for k, row in enumerate(mechanism.rows):
            owner, _, part = row.name.rpartition(".")
            if row.name in acting or owner in mechanism.joint_names:
                continue

            def of_row(instant: Instant, k: int = k) -> Mapping[str, Any]:
                return {"impulse": instant.multipliers[k]}

            unit = units.get(row.name, "")
            value = self.solved.values(of_row, {"impulse": f"{unit}*s" if unit else ""})["impulse"]
            found.setdefault(owner or row.name, {})[f"impulse_{part}" if owner else "impulse"] = value
        return found

    def _states(self) -> dict[str, str]:
        found = {}
        before, after = self.struck.before, self.struck.after
        names = {name: k for k, name in enumerate(self.posed.blow.names)}
        kinematic = [k for k, row in enumerate(self.posed.blow.rows) if row.kinematic]
        largest = max((abs(float(x)) for x in (*before[kinematic], *after[kinematic])), default=0.0)
        for element in (*self.rows.acting, *self.rows.rough):
            words = []
            if element.unilateral:
                opens = after[names[element.normals[0].name]] > _AT_REST * largest
                words.append("bounces" if opens else "stays")
            for part in rubbing(element):
                slipping = [float(after[names[row.name]]) for row in part.rows]
                if not any(abs(v) > _AT_REST * largest for v in slipping):
                    words.append("sticks")
                else:
                    words.append("slides" + ("" if len(slipping) > 1 else "+" if slipping[0] > 0 else "-"))
            found[element.name] = ", ".join(dict.fromkeys(words))
        return found

    def _joint_impulses(self) -> dict[str, Values]:
        found: dict[str, Values] = {}
        withheld = self.posed.blow.mechanism.withheld
        for name in self.posed.blow.mechanism.joint_names:

            def of_joint(instant: Instant, name: str = name) -> Mapping[str, Any]:
                return instant.reactions[name]

            values = self.solved.values(of_joint, IMPULSE_UNITS)
            hidden = withheld[name].components if name in withheld else ()
            found[name] = {c: Value(None, unit=IMPULSE_UNITS[c]) if c in hidden else x for c, x in values.items()}
        return found

    def _rates(self, when: str) -> Values:
        """Return the speed at which each contact closes before, or opens after."""
        names = {x.name: x.normals[0].name for x in self.rows.acting}

        def of(instant: Instant) -> Mapping[str, Any]:
            told = _impact(instant)
            rows = told.rows_before if when == "before" else told.rows_after
            sign = -1 if when == "before" else 1
            return {name: sign * rows[row].phidot for name, row in names.items()}

        return self.solved.values(of, dict.fromkeys(names, "m/s"))

    # --- masses and energies --------------------------------------------------------------------------------------

    def _apparent_masses(self) -> Values:
        """Return for each contact the impulse that changes its speed of opening by one, all else free."""
        found: Values = {}
        for element in self.rows.acting:
            mechanism = self.posed.blow.bare(element.normals[0])
            last = len(mechanism.rows) - 1

            def of_last(instant: Instant, last: int = last) -> Mapping[str, Any]:
                return {"": instant.multipliers[last]}

            def unit(_: Motion, last: int = last) -> Mapping[int, Node]:
                return {last: as_node(1)}

            solved = self._solved(mechanism, {last: 1.0}, unit)
            found[element.name] = solved.values(of_last, {"": "kg"})[""]
        return found

    def _lost_by(self) -> Values:
        """Return the energy that each contact takes, and what begins."""
        names = {name: k for k, name in enumerate(self.posed.blow.names)}
        found: Values = {}
        for name, rows in self._losing().items():
            number = sum(float(self.struck.lost[names[row]]) for row in rows)

            found[name] = self._taken(rows, number)
        return found

    def _losing(self) -> dict[str, list[str]]:
        """Return the rows of what takes energy, by its name."""
        names = set(self.posed.blow.names)
        groups = {x.name: [row.name for row in x.rows if row.name in names] for x in self.rows.acting}
        groups |= {x.name: [row.name for part in rubbing(x) for row in part.rows] for x in self.rows.rough}
        return groups | {name: list(rows) for name, rows in self.posed.blow.impact.begins.items()}

    def _energy_lost(self, lost: Values) -> Value:
        if len(lost) == 1:
            return next(iter(lost.values()))
        rows = [row for own in self._losing().values() for row in own]
        return self._taken(rows, sum(x.value or 0.0 for x in lost.values()))

    def _taken(self, rows: Sequence[str], number: float) -> Value:
        """Return the energy that rows take; where it has no formula in one piece their works, impulse by impulse."""
        reasons = dict(self.reasons)
        known = self._known(lambda instant: taken(works(_impact(instant), rows, self.course.striking)), number, "J")
        if known.expression is not None or self.solved.forms is None:
            return known
        known = by_works(self.solved, works(_impact(self.solved.nodes), rows, self.course.striking), known)
        if known.expression is not None:  # then no reason counts why it has none
            self.reasons.clear()
            self.reasons.update(reasons)
        return known

    def _energy_given(self, lost: Value) -> Value | None:
        """Return the energy that given impulses and what moves as prescribed put in; None where nothing does."""
        impact, (before, after) = self.posed.blow.impact, self._kinetic
        if lost.value is None:
            return None
        driven = abs(after - before + lost.value) > _DRIVEN * max(before, after)
        if not (impact.loads or impact.jumps or driven):
            return None
        rows = [row for own in self._losing().values() for row in own]

        def given(instant: Instant) -> Any:
            told = _impact(instant)
            lost_there = taken(works(told, rows, self.course.striking))
            return kinetic_energy(told.later) - kinetic_energy(told.before) + lost_there

        return self._known(given, after - before + lost.value, "J")

    def _known(self, ask: Callable[[Instant], Any], number: float, unit: str) -> Value:
        """Return an energy with the closed form of what `ask` finds, where that is the number; 0 where it is rounding.

        That is so beside the works of which it is made.
        """
        solved, struck = self.solved, self.struck
        works = np.abs(struck.impulses) * (np.abs(struck.before) + np.abs(struck.after)) / 2.0
        number = 0.0 if abs(number) <= _ROUNDED * float(np.nansum(works)) else number
        if solved.forms is None:
            return Value(number, unit=unit)
        scale = float(self._kinetic[0])
        known = solved.value(as_node(ask(solved.nodes)), number, 1e-12 * scale)
        return Value(known.value, known.expression, unit)

    @cached_property
    def _kinetic(self) -> tuple[float, float]:
        instant = _impact(self.solved.numbers)
        return float(kinetic_energy(instant.before)), float(kinetic_energy(instant.later))

    def _kinetic_energy(self) -> Values:
        def of(instant: Instant) -> Mapping[str, Any]:
            told = _impact(instant)
            return {"before": kinetic_energy(told.before), "after": kinetic_energy(told.later)}

        return self.solved.values(of, dict.fromkeys(("before", "after"), "J"))

    def _notes(self) -> tuple[str, ...]:
        numbers = (f"numbers only, where no closed form is given: {reason}" for reason in self.reasons)
        return (*self.struck.notes, *numbers)


def _impact(instant: Instant) -> ImpactInstant:
    assert isinstance(instant, ImpactInstant)
    return instant


def _impulses_of(instant: Instant, element: OneWay) -> dict[str, Any]:
    """Return the impulses of an element: normal, and along its rows of friction."""
    told = _impact(instant)
    found = {"normal": row_impulses(told, [element.normals[0].name])[0]}
    for part in rubbing(element)[:1]:
        along = row_impulses(told, [row.name for row in part.rows])
        names = ["friction"] if len(along) == 1 else ["friction_1", "friction_2"]
        found |= dict(zip(names, along, strict=True))
    return found
