"""The answer about an impact: state, conditions, formulas."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property, partial, reduce
from operator import add
from typing import Any, Final

import numpy as np

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.inequalities import Condition
from multibody_sym.algebra.quotients import NoClosedFormError
from multibody_sym.answers.ask.named_answers import in_parameters, questions_beside, with_answers
from multibody_sym.answers.impact_solution import (
    Befores,
    Blows,
    ImpactFormulas,
    ImpactInstant,
    Needed,
    Order,
    impact_steps,
    length,
    pressing_impulse,
    row_impulses,
    solve_at_rest,
)
from multibody_sym.answers.instant.instant import (
    AGREEMENT,
    SolvedInstant,
    corner_groups,
    of_joint,
    of_row,
    with_outputs_put_in,
)
from multibody_sym.answers.instant.states import least_coefficient, told_conditions
from multibody_sym.answers.records import ImpactFound
from multibody_sym.contact_laws.impact_problem import ImpactResult
from multibody_sym.contact_laws.impact_sequence import clusters
from multibody_sym.derivation.symbolic_start import declared_state
from multibody_sym.dynamics.contact.impact_problem import StruckRows, friction_parts, struck_rows
from multibody_sym.dynamics.contact.impact_programs import StruckMode
from multibody_sym.dynamics.programs.quantities import StateQuantities, quantities
from multibody_sym.dynamics.start.declared_impact import PosedImpact, from_impact, outcome, posed_impact
from multibody_sym.errors import ExpressionError, RunError, Where, at
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.energy import kinetic_energy
from multibody_sym.mechanics.impacts import before_leaf
from multibody_sym.mechanics.law_elements import STICKS, FrictionPart, LawElement, exerted_by
from multibody_sym.mechanics.mechanism import Mechanism, TreeBody
from multibody_sym.mechanics.motion import Motion, State, pose, slot_state
from multibody_sym.mechanics.points import velocity
from multibody_sym.mechanics.references import in_plane
from multibody_sym.mechanics.row_kinematics import coefficients
from multibody_sym.mechanics.row_records import Marker, Row
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.mechanics.vocabulary import IMPULSES, just_after
from multibody_sym.model.bodies import Pose
from multibody_sym.model.system import System
from multibody_sym.records import dataclass
from multibody_sym.scalars import limits
from multibody_sym.scalars.arrays import UNDEFINED
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate, evaluate_float, sqrt
from multibody_sym.scalars.node import ZERO, Node, as_node
from multibody_sym.scalars.vectors import S, apply, dot, scale, subtract
from multibody_sym.text.values import Value

# ----------------------------------------------------------------------------------------------------------------------
# Under which conditions the formulas of an impact hold: what closes and pushes, what sticks and slides.


def impact_conditions(solved: SolvedInstant, rows: StruckRows, order: Order, course: ImpactFormulas) -> dict[str, str]:
    """Return the conditions as comparisons, each with what happens where it fails; none without closed forms."""
    nodes, forms = solved.nodes, solved.forms
    assert isinstance(nodes, ImpactInstant)
    if forms is None:
        return {}
    found = [Condition(positive, strict=True) for positive in forms.field.positive]
    try:
        for needed in _mode_conditions(_Mode(nodes, rows, order, course)):
            found += needed.over(forms)
        for positive, broken in course.conditions:
            found += Needed(positive, broken).over(forms)
        given = [Condition(x) for x in forms.of(_not_negative(nodes, order.elements))]
    except (NoClosedFormError, ExpressionError) as reason:
        solved.reasons[reason.message if isinstance(reason, ExpressionError) else str(reason)] = None
        return told_conditions(solved, found)
    return told_conditions(solved, found, given)


def _not_negative(nodes: ImpactInstant, elements: Sequence[LawElement]) -> Iterator[Node]:
    """Yield what is not negative of coefficients anyway: none gives back more than all, nor rubs more as it slides."""
    for element in elements:
        e, back = nodes.before.state.values([element.restitution, element.tangential_restitution])
        yield from (as_node(1 - x) for x in (e, back) if as_node(x).shadow is None)
        for part in friction_parts(element):
            static, kinetic = coefficients(nodes.before, part.rows, [part.static, part.kinetic])
            yield from (x for x in map(as_node, (static, kinetic)) if x.shadow is None)
            if not part.enough and static is not kinetic:
                yield as_node(static - kinetic)


@dataclass(frozen=True)
class _Mode:
    nodes: ImpactInstant
    rows: StruckRows
    order: Order
    course: ImpactFormulas

    @property
    def pushed(self) -> Mapping[str, Node]:
        """The speeds of all rows as they strike, after what is given has pushed."""
        return {name: as_node(x.phidot) for name, x in self.nodes.rows_before.items()} | self.course.striking

    def pressed(self, element: LawElement, part: FrictionPart) -> tuple[S, S]:
        (static,) = coefficients(self.nodes.before, part.rows, [part.static])
        return static, pressing_impulse(self.nodes, element, part, self.rows.mode.sides)

    def by_element(self, speeds: Mapping[str, Node]) -> dict[str, Node]:
        return {x.name: speeds[x.normals[0].name] for x in self.order.elements}

    @property
    def alone(self) -> bool:
        return len(self.order.elements) == 1


def _mode_conditions(mode: _Mode) -> Iterator[Needed]:
    acting, order = mode.rows.acting, mode.order
    after = mode.by_element({name: as_node(x.phidot) for name, x in mode.nodes.rows_after.items()})
    struck = [element.name for element in acting]
    steps = mode.course.steps
    if not steps:
        impulses = {x.name: as_node(row_impulses(mode.nodes, [x.normals[0].name])[0]) for x in acting}
        steps = [Blows(tuple(struck), impulses, mode.by_element(mode.pushed), after)]
    for step in steps:
        yield from order.needed(step)
    if not mode.alone:
        yield from order.finally_open(after, struck)
    for element in acting:
        for part in friction_parts(element):
            yield from _friction_conditions(mode, element, part)
    for element in mode.rows.rough:
        if not any(part.norm for part in element.frictions):
            for row in element.normals:
                pressed = limits.towards(mode.rows.mode.side(element, row), *row_impulses(mode.nodes, [row.name]))
                yield Needed(as_node(pressed), f"{element.name} is pressed from the other side")
        for part in friction_parts(element):
            yield from _friction_conditions(mode, element, part)


def _friction_conditions(mode: _Mode, element: LawElement, part: FrictionPart) -> Iterator[Needed]:
    row = part.rows[0].name
    if row in mode.rows.given:
        return
    slip = mode.rows.mode.slip(part)
    if len(part.rows) > 1:
        if not part.enough and slip == STICKS:
            along = length(row_impulses(mode.nodes, [row.name for row in part.rows]))
            yield Needed(as_node(limits.room(*mode.pressed(element, part), [along])), f"{part.name} slips")
    elif slip:
        yield from _slip_conditions(mode, element, part, slip)
    elif not part.enough:
        (impulse,) = row_impulses(mode.nodes, [row])
        yield Needed(as_node(impulse), f"{part.name} slips", limit=as_node(limits.most(*mode.pressed(element, part))))


def _slip_conditions(mode: _Mode, element: LawElement, part: FrictionPart, slip: int) -> Iterator[Needed]:
    """Yield that what slips one way all the while does so: it is pressed, slips so at first and in the end."""
    row, broken = part.rows[0].name, f"{part.name} sticks or turns round"
    first, last = slip * mode.pushed[row], as_node(slip * mode.nodes.rows_after[row].phidot)
    yield Needed(last, broken)
    if not element.unilateral:
        return
    (e,) = mode.nodes.before.state.values([element.restitution])
    if mode.alone:
        yield Needed(first, broken)
        pressed = as_node(row_impulses(mode.nodes, [element.normals[0].name])[0])
        yield Needed(pressed, f"{part.name} stops on the way: the more it slips the harder it is pressed", strict=True)
    elif e is not ZERO:
        yield Needed(last + as_node(e) * first, broken)  # at the end of compression


# ----------------------------------------------------------------------------------------------------------------------
# How rough is enough in an impact: the least coefficient with which what never slips does not.


def needed_friction(solved: SolvedInstant, elements: Sequence[LawElement]) -> Iterator[tuple[str, Value]]:
    """Yield for each part that is rough `enough` the least coefficient that suffices: |p_t| / p_n."""
    for element in elements:
        for part in element.frictions if element.unilateral else ():

            def impulses(
                instant: StateQuantities, element: LawElement = element, part: FrictionPart = part
            ) -> tuple[S, list[S]]:
                assert isinstance(instant, ImpactInstant)
                along = row_impulses(instant, [row.name for row in part.rows])
                return pressing_impulse(instant, element, part, {}), along

            yield from least_coefficient(solved, part, impulses)


# ----------------------------------------------------------------------------------------------------------------------
# Centres of an impact: about which points bodies turn just after it, and where a blow spares the hinge.


_TURNS: Final = 1e-9
"""The angular velocity (rad/s, times the largest if that is more) up to which a body does not turn."""
_NOTHING: Final = 1e-12
_ROUNDED: Final = 1e-14

Centres = dict[str, dict[str, tuple[float, float]]]


def instantaneous_centres(system: System, instant: ImpactInstant) -> Centres:
    """Return for each body of a plane system its `centre` (x, y) just after, or the `direction` if it does not turn.

    What stands still has neither.
    """
    if not in_plane(system):
        return {}
    motion = instant.later
    turning = [float(body.w_WB[2]) for body in motion.bodies]
    least = _TURNS * max(1.0, *map(abs, turning)) if turning else 0.0
    moving = [velocity(motion, Marker("", k, Pose())) for k in range(len(turning))]
    fastest = max((abs(float(x)) for v in moving for x in v), default=0.0)
    found: Centres = {}
    for k, (body, omega, v) in enumerate(zip(motion.mechanism.bodies, turning, moving, strict=True)):
        x, y = float(v[0]), float(v[1])
        speed = float((x * x + y * y) ** 0.5)
        if body.is_double:
            continue
        if abs(omega) > least:
            _, p = motion.poses[k]
            centre = float(p[0]) - y / omega, float(p[1]) + x / omega
            made_of = max(abs(float(p[0])), abs(float(p[1])), fastest / abs(omega))
            place = _without_rounding(centre[0], made_of), _without_rounding(centre[1], made_of)
            found[body.name] = {"centre": place}
        elif speed > _NOTHING * fastest:
            found[body.name] = {"direction": (_without_rounding(x / speed, 1.0), _without_rounding(y / speed, 1.0))}
    return found


def _without_rounding(x: float, made_of: float) -> float:
    """Return 0 for what is rounding beside the largest of what it is made of."""
    return x if abs(x) > _ROUNDED * made_of else 0.0


def centres_of_percussion(solved: SolvedInstant) -> dict[str, Value]:
    """Return for each body that hangs on ground by a hinge, and carries nothing, how far from it a blow spares it.

    That is the length J_A/(m s) from the hinge A through the centre of mass, s away from it.
    """
    bodies = solved.mechanism.bodies
    parents = {body.parent for body in bodies}
    found: dict[str, Value] = {}
    for k, body in enumerate(bodies):
        free = [step for step in body.steps if step.motion is None]
        if body.parent >= 0 or k in parents or not len(body.steps) == len(free) == 1:
            continue
        if len(free[0].turns) != 1 or free[0].slides:
            continue
        number = _length(solved.numbers.motion, k, body)
        if number is None:
            continue
        node = _length(solved.nodes.motion, k, body) if solved.forms is not None else None
        known = Value(float(number)) if node is None else solved.value(as_node(node), float(number))
        found[body.name] = Value(known.value, known.expression, "m")
    return found


def _length(motion: Motion, index: int, body: TreeBody) -> S | None:
    """Return J_A/(m s) over the motion's scalar, None where the centre of mass lies on the axis or there is no mass."""
    mass, (rotation, hinge) = motion.masses[index], pose(motion.state, body.frame_on_body)
    x, y, z = motion.state.values(body.steps[0].turns[0])
    axis = apply(rotation, (x, y, z))
    arm = subtract(mass.com, hinge)
    across = subtract(arm, scale(dot(arm, axis), axis))
    square = dot(across, across)
    static = mass.mass * sqrt(square)
    if isinstance(static, float | int) and static <= 0:
        return None
    return (dot(axis, apply(mass.inertia, axis)) + mass.mass * square) / static


# ----------------------------------------------------------------------------------------------------------------------
# The works of an impact: the impulse along each row times the mean speed along it.


def works(told: ImpactInstant, rows: Sequence[str], striking: Mapping[str, Node]) -> list[tuple[Any, Any]]:
    """Return the impulse along each row, and twice its mean speed.

    Were impulses to grow in proportion that would be their work; of all rows it is exact. Rows that are `striking` do
    so with these speeds, after a push; others act from the start.
    """
    both = ((striking.get(row, told.rows_before[row].phidot), told.rows_after[row].phidot) for row in rows)
    return [(p, v + w) for p, (v, w) in zip(row_impulses(told, rows), both, strict=True)]


def energy_taken(pairs: Sequence[tuple[Any, Any]]) -> Any:
    """Return minus the sum of works."""
    return -sum((p * v for p, v in pairs), 0) / 2


def energy_by_works(solved: SolvedInstant, pairs: Sequence[tuple[Any, Any]], known: Value) -> Value:
    """Return an energy that has no formula in one piece as minus the works, each impulse beside its speeds.

    As it is where one of these has none either, or where they are not the energy.
    """
    if solved.forms is None or known.value is None:
        return known
    found: Node = ZERO
    try:
        for pair in pairs:
            impulse, speeds = (book_form(x) for x in solved.forms.of([as_node(x) for x in pair]))
            found = found - impulse * speeds / 2
        sample = {node: float(letter.sample) for node, letter in solved.symbolic.letters.items()}
        number = float(evaluate_float([found], sample)[0])
    except (NoClosedFormError, ExpressionError, *UNDEFINED):
        return known
    return replace(known, expression=found) if abs(number - known.value) <= AGREEMENT * abs(known.value) else known


# ----------------------------------------------------------------------------------------------------------------------

IMPULSE_UNITS: Final = {"fx": "N*s", "fy": "N*s", "fz": "N*s", "mx": "N*m*s", "my": "N*m*s", "mz": "N*m*s"}
_AT_REST: Final = 1e-9
"""The part of the largest speed below which a contact stays closed."""
_ANSWER_ROUNDED: Final = 1e-13
"""The part of the works that an impact does below which an energy is rounding."""

_DRIVEN: Final = 1e-9
"""The part of the kinetic energy from which on what moves as prescribed does work in an impact."""

Values = dict[str, Value]


def impact_found(system: System, formalism: str | None = None) -> tuple[ImpactFound, SolvedInstant, list[Blows]]:
    """Return what the impact of a system does, the solved mechanism of it, and the impacts that follow each other.

    Raises InputError, NoSolutionError where nothing strikes or the laws have no solution, and RunError where they
    would make energy.
    """
    posed = posed_impact(system)
    struck = outcome(posed)
    if struck.gained > 0.0:
        raise RunError(
            f"by {posed.law.capitalize()}'s law this impact would make energy: {struck.gained:.6g} J. With friction "
            "Newton's coefficient may do that; write law: poisson or law: stronge",
            where=Where(path=("impact", "law")),
            number="N108",
        )
    answer = _Answer(posed, struck, formalism)
    return answer.told(), answer.solved, answer.course.steps


@dataclass(frozen=True, eq=False)
class _Answer:
    """An impact and what it does, as it is put together."""

    posed: PosedImpact
    struck: ImpactResult
    formalism: str | None
    reasons: dict[str, None] = field(default_factory=dict)

    @cached_property
    def rows(self) -> StruckRows:
        return struck_rows(self.posed.blow, self.struck)

    @cached_property
    def given(self) -> Befores:
        blow, begin = self.posed.blow, self.posed.begin
        symbolic = declared_state(self.posed.mechanism, begin)
        own = slot_state(blow.mechanism)
        u = tuple(before_leaf(k) for k in range(len(own.u)))
        slots = {leaf: u[leaf.data[1]] if leaf.data[0] == "u" else x for leaf, x in own.slots.items()}
        in_slots = State(own.scalar, own.q, u, slots)
        return Befores(blow.motion, blow.before(symbolic.state), blow.before(in_slots), symbolic)

    @cached_property
    def solved(self) -> SolvedInstant:
        return self._solved(self.rows.mechanism, self.rows.jumps, self.course.jumps)

    def _solved(
        self, mechanism: Mechanism, jumps: Mapping[int, float], formula: Callable[[Motion], Mapping[int, Node] | None]
    ) -> SolvedInstant:
        return solve_at_rest(self.posed, self.given, mechanism, jumps, formula, self.formalism, self.reasons)

    @cached_property
    def course(self) -> ImpactFormulas:
        mode = StruckMode(self.posed.blow, self.rows)
        return ImpactFormulas(mode, self.struck, self.given.symbolic.letters, self.reasons, self.posed.law)

    @cached_property
    def order(self) -> Order:
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

    # --- the answer -----------------------------------------------------------------------------------------------

    def told(self) -> ImpactFound:
        solved, names = self.solved, [speed.name for speed in self.posed.mechanism.speeds]
        units = {speed.name: speed.unit for speed in self.posed.mechanism.speeds}

        def jumps(instant: StateQuantities) -> Mapping[str, Any]:
            return dict(zip(names, instant.udot, strict=True))

        def after(instant: StateQuantities) -> Mapping[str, Any]:
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
        units = dict.fromkeys(("normal", "friction", "friction_1", "friction_2"), "N*s")
        found = {x.name: self.solved.values(partial(_impulses_of, element=x), units) for x in self.rows.acting}
        return found | self._impulses_of_groups() | self._impulses_in_joints() | self._impulses_of_constraints()

    def _impulses_in_joints(self) -> dict[str, Values]:
        """Return the friction of each rough joint, of each pad where several rub."""
        found: dict[str, Values] = {}
        for element in self.rows.rough:
            rows = [row for part in friction_parts(element) for row in part.rows]
            units = {row.name.removeprefix(f"{element.name}."): f"{row.unit}*s" for row in rows}

            def of_rows(
                instant: StateQuantities, rows: Sequence[Row] = rows, words: Sequence[str] = tuple(units)
            ) -> Mapping[str, Any]:
                return dict(zip(words, row_impulses(_impact(instant), [row.name for row in rows]), strict=True))

            found[element.name] = self.solved.values(of_rows, units)
        return found

    def _impulses_of_groups(self) -> dict[str, Values]:
        """Return for each contact of several corners the sum of their impulses, which is unique where each is not."""
        found: dict[str, Values] = {}
        for name, elements in corner_groups(self.rows.acting).items():

            def of_group(instant: StateQuantities, elements: Sequence[LawElement] = elements) -> Mapping[str, Any]:
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
            unit = f"{units[row.name]}*s" if units.get(row.name) else ""
            value = self.solved.values(partial(of_row, k), {"": unit})[""]
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
            for part in friction_parts(element):
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
            values = self.solved.values(partial(of_joint, name), IMPULSE_UNITS)
            hidden = withheld[name].components if name in withheld else ()
            found[name] = {c: Value(None, unit=IMPULSE_UNITS[c]) if c in hidden else x for c, x in values.items()}
        return found

    def _rates(self, when: str) -> Values:
        """Return the speed at which each contact closes before, or opens after."""
        names = {x.name: x.normals[0].name for x in self.rows.acting}

        def of(instant: StateQuantities) -> Mapping[str, Any]:
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

            def unit(_: Motion, last: int = last) -> Mapping[int, Node]:
                return {last: as_node(1)}

            solved = self._solved(mechanism, {last: 1.0}, unit)
            found[element.name] = solved.values(partial(of_row, last), {"": "kg"})[""]
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
        names = set(self.posed.blow.names)
        groups = {x.name: [row.name for row in x.rows if row.name in names] for x in self.rows.acting}
        groups |= {x.name: [row.name for part in friction_parts(x) for row in part.rows] for x in self.rows.rough}
        return groups | {name: list(rows) for name, rows in self.posed.blow.impact.begins.items()}

    def _energy_lost(self, lost: Values) -> Value:
        if len(lost) == 1:
            return next(iter(lost.values()))
        rows = [row for own in self._losing().values() for row in own]
        return self._taken(rows, sum(x.value or 0.0 for x in lost.values()))

    def _taken(self, rows: Sequence[str], number: float) -> Value:
        """Return the energy that rows take; where it has no formula in one piece their works, impulse by impulse.

        Of several impacts in turn the works of some of the rows are no energies, and without a number nothing tells.
        """
        reasons, every = dict(self.reasons), {row for own in self._losing().values() for row in own}
        if len(self.course.steps) > 1 and set(rows) != every and self._rounded(number) == 0.0:
            return Value(0.0, unit="J")
        striking = self.course.striking
        known = self._known(lambda instant: energy_taken(works(_impact(instant), rows, striking)), number, "J")
        if known.expression is not None or self.solved.forms is None:
            return known
        known = energy_by_works(self.solved, works(_impact(self.solved.nodes), rows, self.course.striking), known)
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

        def given(instant: StateQuantities) -> Any:
            told = _impact(instant)
            lost_there = energy_taken(works(told, rows, self.course.striking))
            return kinetic_energy(told.later) - kinetic_energy(told.before) + lost_there

        return self._known(given, after - before + lost.value, "J")

    def _known(self, ask: Callable[[StateQuantities], Any], number: float, unit: str) -> Value:
        """Return an energy with the closed form of what `ask` finds, where it is the number; 0 where it is rounding."""
        solved, number = self.solved, self._rounded(number)
        if solved.forms is None:
            return Value(number, unit=unit)
        scale = float(self._kinetic[0])
        known = solved.value(as_node(ask(solved.nodes)), number, 1e-12 * scale)
        return Value(known.value, known.expression, unit)

    def _rounded(self, energy: float) -> float:
        """Return an energy, 0 where it is rounding beside the works of which it is made."""
        struck = self.struck
        works = np.abs(struck.impulses) * (np.abs(struck.before) + np.abs(struck.after)) / 2.0
        return 0.0 if abs(energy) <= _ANSWER_ROUNDED * float(np.nansum(works)) else energy

    @cached_property
    def _kinetic(self) -> tuple[float, float]:
        instant = _impact(self.solved.numbers)
        return float(kinetic_energy(instant.before)), float(kinetic_energy(instant.later))

    def _kinetic_energy(self) -> Values:
        def of(instant: StateQuantities) -> Mapping[str, Any]:
            told = _impact(instant)
            return {"before": kinetic_energy(told.before), "after": kinetic_energy(told.later)}

        return self.solved.values(of, dict.fromkeys(("before", "after"), "J"))

    def _notes(self) -> tuple[str, ...]:
        numbers = (f"numbers only, where no closed form is given: {reason}" for reason in self.reasons)
        return (*self.struck.notes, *numbers)


def _impact(instant: StateQuantities) -> ImpactInstant:
    assert isinstance(instant, ImpactInstant)
    return instant


def _impulses_of(instant: StateQuantities, element: LawElement) -> dict[str, Any]:
    """Return the impulses of an element: normal, and along its rows of friction."""
    told = _impact(instant)
    found = {"normal": row_impulses(told, [element.normals[0].name])[0]}
    for part in friction_parts(element)[:1]:
        along = row_impulses(told, [row.name for row in part.rows])
        names = ["friction"] if len(along) == 1 else ["friction_1", "friction_2"]
        found |= dict(zip(names, along, strict=True))
    return found


# ----------------------------------------------------------------------------------------------------------------------
# Answers to `ask` just after an impact: expressions of the speeds then, and of impulses where they name reactions.
# Answers about the motion after it: those of the system that starts with the speeds after it.


def answers_after(solved: SolvedInstant) -> dict[str, Value]:
    """Return the answers to the questions about the instant of an impact."""
    found: dict[str, Value] = {}
    solved = with_outputs_put_in(solved)
    taken = solved.mechanism.symbols
    for name in just_after(solved.system.ask, taken):
        with at("ask", name):
            named = with_answers(solved.system.ask[name], found, taken)
            if named is None:
                found[name] = Value(None)
                continue
            question, closed = named
            assert question.value is not None
            answer = _answer_after(solved, question.value)
            found[name] = answer if closed else replace(answer, expression=None)
    return found


def system_after(solved: SolvedInstant, impact: ImpactFound, answers: Mapping[str, Value]) -> System:
    """Return the system after its impact, with the questions about its motion.

    Its speeds are formulas where these are of parameters alone. `answers` are those just after the impact; questions
    that name one without a value are left out. Raises ModelError for motions whose rates jump.
    """
    system, after = solved.system, from_impact(solved.system)
    formulas = {
        name: formula
        for name, speed in impact.after.items()
        if after.speeds[name] and (formula := in_parameters(system, speed)) is not None
    }
    questions = questions_beside(system, answers, solved.mechanism.symbols)
    return replace(Overrides(initial=formulas).of(after.system), ask=questions)


def _answer_after(solved: SolvedInstant, node: Node) -> Value:
    """Return an expression; of an impulse with several components that it names as one the length."""
    in_slots = evaluate([node], lambda leaf: solved.mechanism.symbols.get(leaf, leaf))
    asked = leaves(in_slots, "quantity")
    impulses = [leaf for leaf in asked if leaf.data[0] in IMPULSES]
    others = [leaf for leaf in asked if leaf not in impulses]

    def ask(instant: StateQuantities) -> Mapping[str, Any]:
        assert isinstance(instant, ImpactInstant)
        later = instant.later
        nothing = [0] * len(later.state.u), [0] * len(later.mechanism.rows)
        known = quantities(later, *nothing, others)
        named = []
        for leaf in impulses:
            rows: list[list[Row]] = []  # of what strikes, by component of the impulse
            if leaf.data[0] == "reaction":
                name, component = leaf.data[1]
                exerted = (exerted_by(element).get(name, {}) for element in instant.motion.mechanism.one_way)
                rows = list(map(list, zip(*(x[component] for x in exerted if component in x), strict=True)))
            sums = [reduce(add, row_impulses(instant, [row.name for row in each])) for each in rows]
            if sums:
                known[leaf] = length(sums) if len(sums) > 1 else sums[0]
            else:
                named.append(leaf)
        known |= quantities(instant.motion, instant.udot, instant.multipliers, named)
        return {"": evaluate(in_slots, {**later.state.slots, **known}, later.state.scalar)[0]}

    (unit,) = MechanismUnits(solved.mechanism).of([node])
    if impulses:  # of a force alone it is that times s, of other expressions nobody knows
        unit = f"{unit}*s" if unit and in_slots[0] in impulses else ""
    return solved.values(ask, {"": unit})[""]
