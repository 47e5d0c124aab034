"""The inequalities of a mode: what must hold so that each element acts, sticks, slides or rests as it does there."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from functools import reduce
from operator import add
from typing import Final, Literal

import numpy as np

from multibody_sym.algebra.book_form import book_form, with_doubles
from multibody_sym.algebra.inequalities import Condition, in_circle, reduced, under_roots, within
from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.answers.instant.instant import AGREEMENT, SolvedInstant
from multibody_sym.derivation.symbolic_start import WORK, ActingForces, ClosedForms, closed_forms, unknowns
from multibody_sym.dynamics.programs.quantities import StateQuantities
from multibody_sym.dynamics.programs.reactions import is_active, mode_of
from multibody_sym.errors import NoSolutionError, Where
from multibody_sym.mechanics.law_elements import (
    ALONG_VELOCITY,
    FRICTION,
    PRESSING,
    STICKS,
    FrictionPart,
    LawElement,
    Limit,
    component_names,
    components_of,
)
from multibody_sym.mechanics.mechanism import Mechanism, normal_forces
from multibody_sym.mechanics.modes import taut_ropes, with_coefficients
from multibody_sym.mechanics.motion import motion_of
from multibody_sym.mechanics.points import direction
from multibody_sym.mechanics.row_kinematics import coefficients
from multibody_sym.mechanics.row_records import PlaneSurface, RopeSlipRow, Sliding
from multibody_sym.model.states import WAYS
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import postorder
from multibody_sym.scalars.functions import absolute, evaluate, sqrt
from multibody_sym.scalars.linear_inequalities import outline
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node, negate, quantity, symbol
from multibody_sym.scalars.vectors import ZERO_VECTOR, cross, dot, subtract
from multibody_sym.text.parser import force_name
from multibody_sym.text.printer import text
from multibody_sym.text.values import Value

Kind = Literal["least", "more", "within", "circle"]
"""a >= 0; a > 0; |a| <= b; sqrt(a^2 + b^2) <= c."""

_OPENS: Final = {"contact": "opens", "rope": "slackens", "stop": "lets go"}


@dataclass(frozen=True, eq=False)
class Inequality:
    """One inequality of a mode over Nodes: its name for people, what happens where it fails, and its rows' names."""

    kind: Kind
    terms: tuple[Node, ...]
    told: str
    broken: str
    rows: tuple[str, ...]

    def conditions(self, forms: ClosedForms) -> list[Condition]:
        """Return it over quotients. Raises NoClosedFormError."""
        terms = forms.of(self.terms)
        if self.kind == "within":
            return within(terms[0], terms[1], self.broken)
        if self.kind == "circle":
            return in_circle(terms[:-1], terms[-1], self.broken)
        return [Condition(terms[0], self.kind == "more", self.broken)]


def inequalities(acting: ActingForces, solved: SolvedInstant) -> Iterator[Inequality]:
    """Yield the inequalities of the mode of a solved start over Nodes, at this instant or one with other forces."""
    for limit in acting.mode_limits:
        if limit.part is None:
            yield from _normal_inequality(acting, limit, solved.decided.touching)
        elif limit.kind == "slip":
            yield from _slip_inequality(acting, limit, limit.part, limit.part.name in solved.decided.moving)
        elif isinstance(limit.part.rows[0], RopeSlipRow):
            yield from _grip_inequalities(acting, limit.part, limit.part.rows[0])
        else:
            element, part = limit.element, limit.part
            if element.unilateral:
                yield _cone(acting, element.name, component_names(element, part), [element], [part])
            else:
                yield _cone(acting, part.name, components_of(part, FRICTION), [element], [part])
    for name, elements, parts in _sticking_corners(acting):
        if len(parts) == len(elements):  # single forces may not be unique, their sum is
            yield _cone(acting, name, components_of(parts[0], FRICTION), elements, parts)
    yield from _between_corners(acting, ActingForces.at(solved.numbers))
    for _, row in taut_ropes(acting.mechanism):
        told = f"{text(quantity('tension', (row.name,)))} >= 0"
        yield Inequality("least", _nodes(acting.multiplier(row.name)), told, f"{row.name} slackens", (row.name,))


def _normal_inequality(acting: ActingForces, limit: Limit, touching: Collection[str]) -> Iterator[Inequality]:
    """Yield that a force presses, that what touches opens, or on which side a reaction presses that rubs."""
    name, row = limit.element.name, limit.element.normals[limit.normal]
    if limit.kind == "force":
        kind = limit.element.kind
        told, broken = f"{force_name(name, PRESSING[kind])} >= 0", f"{name} {_OPENS[kind]}"
    elif limit.kind == "gap":
        if name not in touching:
            return
        told = f"{name} opens: its gap's acceleration >= 0"
        word, becomes = limit.element.words[0], "becomes " if limit.element.kind == "rope" else ""
        rests = limit.element.kind == "stop"
        broken = f"{limit.element.group} rests at its {word} stop" if rests else f"{name} {becomes}{word}"
    else:
        side = acting.mode.side(limit.element, row)
        if not side:
            return
        told = f"{force_name(row.name, 'multiplier')} {'>=' if side > 0 else '<='} 0"
        broken = f"{name} presses on the other side"
    yield Inequality("least", _nodes(acting.value(limit, acting.acceleration)), told, broken, (row.name,))


def _slip_inequality(acting: ActingForces, limit: Limit, part: FrictionPart, moves: bool) -> Iterator[Inequality]:
    name, slip = part.name, acting.mode.slip(part)
    what = "velocity" if moves else "acceleration"
    if slip != ALONG_VELOCITY:
        told = f"{name} slides: its {what} along the tangent {'>' if slip > 0 else '<'} 0"
        broken = f"{name} does not slide {WAYS['+' if slip > 0 else '-']}"
    elif moves or not acting.begins(part):
        return
    else:
        told, broken = f"{name} slides: its {what} along its direction > 0", f"{name} does not slide"
    rate = acting.value(limit, (lambda row: acting.row(row).phidot) if moves else acting.acceleration)
    yield Inequality("more", _nodes(rate), told, broken, tuple(row.name for row in part.rows))


def _grip_inequalities(acting: ActingForces, part: FrictionPart, slip: RopeSlipRow) -> Iterator[Inequality]:
    """Yield that neither tension of a rope over a rough wheel is more than exp(mu wrap) times the other."""
    most, wheel = acting.tension_ratio(part), slip.rope.rubs.index(slip.name)
    before, behind = slip.rope.asked[wheel : wheel + 2]
    tensions = acting.tensions
    slots = {node: as_node(x) for node, x in acting.motion.state.slots.items()}
    (written,) = evaluate([part.static], {**slots, slip.wrap: symbol("wrap")})
    ratio = next((node for node in postorder([written]) if node.op == "exp"), ONE)
    for smaller, larger in ((before, behind), (behind, before)):
        less, more = (quantity("tension", (rope,)) for rope in (smaller, larger))
        told = f"{text(more)} <= {text(with_doubles(ratio * less))}"
        rest = most * tensions[smaller] - tensions[larger]
        yield Inequality("least", _nodes(rest), told, f"{part.name} slips", (slip.name,))


def _cone(
    acting: ActingForces,
    name: str,
    components: Sequence[str],
    elements: Sequence[LawElement],
    parts: Sequence[FrictionPart],
) -> Inequality:
    """Return that friction, or the sum of that of all corners, is at most a coefficient times the normal force.

    `name` and `components`: by which the condition in words knows the friction.
    """
    (static,) = coefficients(acting.motion, parts[0].rows, [parts[0].static])
    forces = [sum(each[1:], each[0]) for each in zip(*map(acting.friction, parts), strict=True)]
    most = sum(map(acting.most, elements[1:], parts[1:]), acting.most(elements[0], parts[0]))
    named = [quantity("reaction", (name, component)) for component in components]
    size = absolute(named[0]) if len(named) == 1 else sqrt(reduce(add, (x**2 for x in named)))
    limit = with_doubles(as_node(static) * quantity("reaction", (name, "normal")))
    slips = parts[0].name if len(parts) == 1 else name
    rows = tuple(row.name for part in parts for row in part.rows)
    kind: Kind = "within" if len(forces) == 1 else "circle"
    return Inequality(kind, _nodes(*forces, most), f"{text(as_node(size))} <= {text(limit)}", f"{slips} slips", rows)


def _nodes(*terms: object) -> tuple[Node, ...]:
    return tuple(as_node(x) for x in terms)


def pivots(mechanism: Mechanism, forms: ClosedForms) -> Iterator[Condition]:
    """Yield that the apparent mass which a sliding contact's force meets has the sign that it has."""
    names = [row.name for row in mechanism.rows]
    for element in mechanism.one_way:
        slides = element.unilateral and any(mode_of(mechanism).slip(part) != STICKS for part in element.frictions)
        if slides and is_active(mechanism, element):
            try:
                given = forms.give(names.index(element.normals[0].name))
            except NoClosedFormError:
                continue
            broken = f"{element.name}: no state or several, as with Painleve's rod"
            yield Condition(given if given.sample > 0 else -given, True, broken, pivot=True)


# --- several corners, two coefficients -----------------------------------------------------------------------------


def _corner_groups(acting: ActingForces) -> Iterator[tuple[str, list[LawElement]]]:
    """Yield the declared contacts that have several corners, with those that act."""
    groups: dict[str, list[LawElement]] = {}
    for element in acting.mechanism.one_way:
        is_corner = element.kind == "contact" and element.group not in ("", element.name)
        if is_corner and is_active(acting.mechanism, element):
            groups.setdefault(element.group, []).append(element)
    yield from groups.items()


def _sticking_corners(acting: ActingForces) -> Iterator[tuple[str, list[LawElement], list[FrictionPart]]]:
    """Yield the declared contacts of which several corners act, with these and their friction, where all stick."""
    for name, elements in _corner_groups(acting):
        parts = [part for element in elements for part in element.frictions[:1] if part.rubs and not part.enough]
        if len(elements) > 1 and all(acting.mode.slip(part) == STICKS for part in parts):
            yield name, elements, parts


def _couples_of_corners(solved: SolvedInstant) -> Iterator[tuple[str, str]]:
    """Yield for contacts whose corners bear a couple that these may reach their limits before all together do.

    Corners whose forces make one force, F . M = 0, with a point in their outline may share it so that each is below its
    limit if all together are.
    """
    acting = ActingForces.at(solved.nodes)
    for name, elements, parts in _sticking_corners(acting):
        if any(len(part.rows) != 2 for part in parts):
            continue
        rows = [*(x.normals[0] for x in elements), *(row for part in parts for row in part.rows)]
        wrenches = [(acting.multiplier(row.name), acting.row(row).of_body) for row in rows]
        bodies = range(len(wrenches[0][1]))
        body = next(k for k in bodies if any(as_node(x) is not ZERO for x in wrenches[0][1][k][0]))
        force, moment = (
            [sum((z * each[body][k][axis] for z, each in wrenches), 0) for axis in range(3)] for k in range(2)
        )
        twist = as_node(sum((f * m for f, m in zip(force, moment, strict=True)), 0))

        def of(forms: ClosedForms, twist: Node = twist) -> list[Quotient]:
            return forms.of([twist])

        closed = solved.closed(of)
        if closed is None or not closed[0].is_zero:
            told = f"the corners of {name} share a couple about its normal below their limits"
            yield f"{told}: in no formula, as their forces are not unique", f"{name} turns"


def _between_corners(acting: ActingForces, numbers: ActingForces) -> Iterator[Inequality]:
    """Yield that a body on so many corners that their single forces are not unique stands between all of them.

    Their sum acts inside the outline of the corners; where it gets past a side of that the body tips about it.
    `numbers` are the same start in floats, which tell the outline.
    """
    for name, elements in _corner_groups(acting):
        face = next((skin for skin in elements[0].surfaces or () if isinstance(skin, PlaneSurface)), None)
        places = [numbers.place(element) for element in elements]
        if face is None or any(place is None for place in places):
            continue
        normal = np.array(direction(numbers.motion, face.place, face.normal), dtype=float)
        corners = outline(np.array(places, dtype=float), normal)
        if len(elements) > (3 if len(corners) > 2 else 2):
            rows = tuple(element.normals[0].name for element in elements)
            whole = sum((acting.normal(element) for element in elements), 0)
            yield Inequality("least", _nodes(whole), f"{force_name(name, 'normal')} >= 0", f"{name} opens", rows)
            for side in zip(corners, (*corners[1:], corners[0]), strict=True):
                yield _inside_outline(acting, name, elements, face if len(corners) > 2 else None, side)


def _inside_outline(
    acting: ActingForces, name: str, elements: Sequence[LawElement], face: PlaneSurface | None, side: tuple[int, int]
) -> Inequality:
    """Return that the moment of normal forces about a side of the outline of corners presses inward.

    Where all corners are on a line (without a `face`) it is the one about its first corner.
    """
    places = [acting.place(element) or ZERO_VECTOR for element in elements]
    start, along = places[side[0]], subtract(places[side[1]], places[side[0]])
    inward = along if face is None else cross(direction(acting.motion, face.place, face.normal), along)
    arms = (dot(inward, subtract(place, start)) for place in places)
    moment = sum((acting.normal(x) * arm for x, arm in zip(elements, arms, strict=True)), 0)
    about = ", ".join(elements[k].name.removeprefix(f"{name}.") for k in sorted(side[: 1 if face is None else 2]))
    told = f"the normal force of {name} acts on the inner side of {about}"
    rows = tuple(element.normals[0].name for element in elements)
    return Inequality("least", _nodes(moment), told, f"{name} tips about {about}", rows)


def starting_slip(solved: SolvedInstant) -> Iterator[Condition]:
    """Yield that parts which slip from rest do so under their static coefficients too, where these are others."""
    mechanism, forms = solved.mechanism, solved.forms
    here_first, moving = ActingForces.at(solved.nodes), solved.decided.moving
    still = (part for element in mechanism.one_way for part in element.frictions if part.name not in moving)
    starting = [part for part in still if mode_of(mechanism).slip(part) in (1, -1) or here_first.begins(part)]
    if forms is None or all(part.static is part.kinetic for part in starting):
        return
    by_rows = {tuple(row.name for row in part.rows): part for part in starting}

    def static(sliding: Sliding) -> Node:
        part = by_rows.get(tuple(row.name for row in sliding.rows))
        if part is None:
            return sliding.coefficient
        return part.static if sliding.coefficient is part.kinetic else negate(part.static)

    rougher = with_coefficients(mechanism, static)
    try:
        other = closed_forms(rougher, solved.symbolic)
        acting = ActingForces.at(StateQuantities(motion_of(rougher, solved.symbolic.state), *unknowns(rougher)))
        for part in starting:
            rate = as_node(acting.forward(part, acting.acceleration))
            (here,) = forms.of([book_form(other.of([rate])[0])])
            yield Condition(here, True, f"{part.name} sticks")
    except NoClosedFormError as reason:
        solved.reasons[str(reason)] = None


def declared_coefficients(solved: SolvedInstant) -> Iterator[Condition]:
    """Yield what holds of coefficients as they are declared: none is larger in sliding than before."""
    mechanism, forms = solved.mechanism, solved.forms
    for part in (part for element in mechanism.one_way for part in element.frictions):
        if forms is not None and part.static is not part.kinetic and not part.enough:
            static, kinetic = coefficients(solved.nodes.motion, part.rows, [part.static, part.kinetic])
            try:
                yield Condition(forms.of([as_node(static - kinetic)])[0])
            except NoClosedFormError:
                continue


# ----------------------------------------------------------------------------------------------------------------------
# Under which conditions a solved start holds: inequalities of its mode, and signs that formulas take for granted.


_ROUNDING: Final = 1e-12
_NOT_UNIQUE: Final = 1e-8

Reactions = Mapping[str, Mapping[str, Value]]


@dataclass
class Validity:
    """Conditions as comparisons, each with what happens where it fails (empty: the formulas have other signs)."""

    conditions: dict[str, str] = field(default_factory=dict)
    closed: list[Condition] = field(default_factory=list)


def validity(solved: SolvedInstant, reactions: Reactions) -> Validity:
    """Return the conditions, as few as say all; those without a closed form name their quantity.

    Raises NoSolutionError where a rope that cannot slacken would push.
    """
    found = Validity()
    least = -_ROUNDING * max((abs(float(x)) for x in solved.numbers.multipliers), default=0.0)
    open_ropes = []
    for k, row in taut_ropes(solved.mechanism):
        rope, component = row.told
        tension = reactions[rope][component].value
        if tension is None:
            taut = f"{text(quantity('tension', (row.name,)))} >= 0"
            open_ropes.append(f"{taut} is not decided: the tension is not unique")
        elif tension < least:
            raise NoSolutionError(
                f"rope {rope} would push with {-tension:.6g} N: as declared it cannot slacken, and a rope "
                "cannot push. Write slack: true, so that it may hang loose; a rod is {type: distance, ...}",
                where=Where(path=solved.mechanism.row_path(k)),
                number="N106",
            )
    unique = list(_inequalities(solved))
    told = [set(inequality.rows) for inequality, known in unique if known is not None]
    for inequality, known in unique:
        if known is None:
            if inequality.kind in ("within", "circle") and not any(rows.issuperset(inequality.rows) for rows in told):
                found.conditions[f"{inequality.told} is not decided: the forces are not unique"] = ""
            continue
        conditions = solved.closed(inequality.conditions) if known else None
        if conditions is None:
            found.conditions[inequality.told] = inequality.broken
        else:
            found.closed += conditions
    if solved.forms is not None:
        found.closed += [*pivots(solved.mechanism, solved.forms), *starting_slip(solved)]
        found.closed += [Condition(positive, strict=True) for positive in solved.forms.field.positive]
        found.closed += under_roots([*solved.forms.udot, *solved.forms.multipliers])
    found.conditions |= told_conditions(solved, found.closed)
    found.conditions |= dict.fromkeys(open_ropes, "")
    found.conditions |= dict(_couples_of_corners(solved))
    for name in normal_forces(solved.mechanism):
        force = reactions[name]["tension"]
        if force.unique and (force.value or 0.0) < least:
            pulls = "fails: the plane would pull; in truth the wheel lifts off"
            found.conditions[f"{force_name(name, 'multiplier')} >= 0 {pulls}"] = ""
    return found


def conditions_of_mode(solved: SolvedInstant) -> Iterator[Condition]:
    """Yield what holds in the mode of a solved start, and lets others follow where it fails, in closed form."""
    for inequality, known in _inequalities(solved):
        yield from (solved.closed(inequality.conditions) if known else None) or ()
    yield from starting_slip(solved)


def _inequalities(solved: SolvedInstant) -> Iterator[tuple[Inequality, bool | None]]:
    """Yield the inequalities and whether their closed forms are the numbers, None where forces are not unique."""

    def of(instant: StateQuantities) -> Iterator[Inequality]:
        return inequalities(ActingForces.at(instant), solved)

    numbers = [list(of(instant)) for instant in (solved.numbers, *solved.others)]
    for k, nodes in enumerate(of(solved.nodes)):
        values = [[float(term.data) for term in each[k].terms] for each in numbers]
        size = max((abs(x) for x in (*values[0], *solved.numbers.multipliers)), default=0.0)
        pairs = [pair for other in values[1:] for pair in zip(values[0], other, strict=True)]
        if any(abs(a - b) > _NOT_UNIQUE * size for a, b in pairs):
            yield nodes, None
            continue

        def terms(forms: ClosedForms, nodes: Inequality = nodes) -> list[Quotient]:
            return forms.of(nodes.terms)

        closed = solved.closed(terms)
        yield nodes, closed is not None and all(
            abs(float(a.sample) - b) <= AGREEMENT * max(abs(b), size) for a, b in zip(closed, values[0], strict=True)
        )


def told_conditions(
    solved: SolvedInstant, conditions: list[Condition], given: Iterable[Condition] = ()
) -> dict[str, str]:
    """Return conditions over quotients in words; what is too long is left out with a reason.

    What is `given` holds for all parameters allowed, beside what is declared.
    """
    if not conditions:
        return {}
    found = {}
    conditions[0].value.field.work += WORK
    try:
        conditions = reduced(conditions, [*declared_coefficients(solved), *given])
    except NoClosedFormError:
        solved.reasons["a condition is too long"] = None
    for condition in conditions:
        try:
            found[str(condition)] = condition.broken
        except NoClosedFormError:
            solved.reasons["a condition is too long"] = None
    return found
