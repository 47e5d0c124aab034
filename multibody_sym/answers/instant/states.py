"""Which state was found at a start, in words, and the inequalities under which it lasts."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from functools import reduce
from operator import add
from typing import Any, Final, Literal

import numpy as np

from multibody_sym.algebra.book_form import book_form, with_doubles
from multibody_sym.algebra.inequalities import Condition, in_circle, reduced, under_roots, within
from multibody_sym.algebra.quotient_functions import decided_sign
from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.answers.instant.instant import AGREEMENT, SolvedInstant, corner_groups, unit_of
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
from multibody_sym.mechanics.modes import mode_words, taut_ropes, with_coefficients
from multibody_sym.mechanics.motion import motion_of
from multibody_sym.mechanics.points import direction
from multibody_sym.mechanics.row_kinematics import coefficients
from multibody_sym.mechanics.row_records import (
    BrakingRow,
    PlaneSurface,
    ReactionRow,
    RopeSlipRow,
    Sliding,
    VelocityRow,
    plane_of,
)
from multibody_sym.model.bodies import ORIGIN
from multibody_sym.model.fields import Point
from multibody_sym.model.state_words import WAYS
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.elementary import leaves, postorder
from multibody_sym.scalars.functions import absolute, evaluate, sqrt
from multibody_sym.scalars.limits import length
from multibody_sym.scalars.linear_inequalities import outline
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node, quantity, slot, symbol
from multibody_sym.scalars.rank import least_squares
from multibody_sym.scalars.vectors import ZERO_VECTOR, S, cross, dot, subtract
from multibody_sym.text.parser import force_name
from multibody_sym.text.printer import COMPONENTS, text
from multibody_sym.text.values import Value

_TINY: Final = 1e-12
_ENDLESS: Final = 1e17
"""How many times a tension the other one may be at most that is limited at all."""


@dataclass(frozen=True)
class StateFound:
    """The state: a word for each element, slip's directions in space, `lines` for people, `at_limit` and `needed`.

    `closing`: how fast what strikes at the start closes.
    `at_limit`: elements for which another state fits as well, exactly or as far as it is decided, with what is then.
    `needed`: the least coefficients with which parts stick that are rough `enough`.
    """

    words: Mapping[str, str]
    closing: Mapping[str, Value]
    directions: Mapping[str, tuple[float, ...]]
    lines: tuple[str, ...]
    at_limit: Mapping[str, str]
    needed: Mapping[str, Value]


def state_found(solved: SolvedInstant) -> StateFound:
    """Return the state that a start was found in; empty where nothing holds one way only."""
    mechanism, acting = solved.mechanism, ActingForces.at(solved.numbers)
    words = mode_words(mechanism.one_way, mode_of(mechanism))
    directions: dict[str, tuple[float, ...]] = {}
    needed: dict[str, Value] = {}
    for element in mechanism.one_way:
        for part in element.frictions if is_active(mechanism, element) else ():

            def forces(
                instant: StateQuantities, element: LawElement = element, part: FrictionPart = part
            ) -> tuple[S, list[S]]:
                acting = ActingForces.at(instant)
                return acting.pressing(element, part), acting.friction(part)

            needed |= dict(least_coefficient(solved, part, forces))
            if acting.mode.slip(part) == ALONG_VELOCITY:
                given = acting.mode.directions.get(part.name)
                velocity = [float(acting.row(row).phidot) for row in part.rows]
                speed = sum(v * v for v in velocity) ** 0.5
                directions[part.name] = given if given is not None else tuple(v / speed for v in velocity)
    rows = {x.name: x.normals[0] for x in mechanism.one_way if x.name in solved.decided.closing}

    def speeds(instant: StateQuantities) -> Mapping[str, Any]:
        acting = ActingForces.at(instant)
        return {name: -acting.row(row).phidot for name, row in rows.items()}

    units = {name: "rad/s" if row.unit == "N*m" else "m/s" for name, row in rows.items()}
    closing = solved.values(speeds, units) if rows else {}
    strikes = (f"{name} strikes: it closes with {speed} (see the notes)" for name, speed in closing.items())
    lines = (*strikes, *_lines(solved, acting, words, needed))
    return StateFound(words, closing, directions, lines, dict(_at_limit(solved)), needed)


# --- words for people ----------------------------------------------------------------------------------------------


def _lines(
    solved: SolvedInstant, acting: ActingForces, words: Mapping[str, str], needed: Mapping[str, Value]
) -> Iterator[str]:
    """Yield `c1 slides backward: ...`, `c is open`, `j rests at its upper stop`, and about what bodies tip."""
    groups: dict[str, list[LawElement]] = {}
    for element in acting.mechanism.one_way:
        touches, acts = element.name in solved.decided.touching, is_active(acting.mechanism, element)
        if touches and element.group not in ("", element.name):
            groups.setdefault(element.group, []).append(element)
        if not (acts or touches) and element.group != element.name:
            continue  # a corner in the air
        rubbing = [part for part in element.frictions if acts and part.rubs]
        if element.name in words and all(part.name != element.name for part in rubbing):
            word = words[element.name]
            rests = element.kind == "stop" and word == element.words[0]
            yield f"{element.group} rests at its {word} stop" if rests else f"{element.name} is {word}"
        for part in rubbing:
            if part.name in words:
                word = words[part.name]
                plain = word.rstrip("+-")
                does = f"{plain}s {WAYS.get(word[len(plain) :], '')}".rstrip()
                if acting.mode.slip(part) != STICKS:
                    yield f"{part.name} {does}{_why_slipping(solved, acting, element, part)}"
                else:
                    yield f"{part.name} {does}{_why_sticking(solved, acting, element, part, needed)}"
    for name, elements in groups.items():
        held = [x.name.removeprefix(f"{name}.") for x in elements if is_active(acting.mechanism, x)]
        if held and len(held) < len(elements):
            yield f"{name} tips about {', '.join(held)}"


def _why_slipping(solved: SolvedInstant, acting: ActingForces, element: LawElement, part: FrictionPart) -> str:
    """Return what moves where a part slips: the body on an axis, where that is one and friction in its joint slides."""
    mechanism, slip = acting.mechanism, acting.mode.slip(part)
    moves = "moves" if part.name in solved.decided.moving else "starts to move"
    if isinstance(part.rows[0], RopeSlipRow):
        return f": its rope {moves} {'forward' if slip > 0 else 'back'} over it"
    who, line = "it", "its axis" if element.kind == "friction" else "its tangent"
    if element.kind == "friction":
        moving = leaves([row.zero for row in part.rows if isinstance(row, VelocityRow)], "slot")
        joints = {speed.joint for k, speed in enumerate(mechanism.speeds) if slot("u", k) in moving}
        bodies = [body.name for body in mechanism.bodies if {mechanism.speeds[k].joint for k in body.u} & joints]
        if len(joints) == len(bodies) == 1:
            who, line = bodies[0], f"the axis of {joints.pop()}"
    where = "" if slip == ALONG_VELOCITY else f" {'along' if slip > 0 else 'against'} {line}"
    return f": {who} {moves}{where}"


def _why_sticking(
    solved: SolvedInstant, acting: ActingForces, element: LawElement, part: FrictionPart, needed: Mapping[str, Value]
) -> str:
    """Return the friction of a part that sticks, with its limit; of a rope on a wheel the tensions on both sides."""
    row, is_unique = part.rows[0], all(_is_unique(solved, row.name) for row in part.rows)
    if part.enough:
        least = needed.get(part.name)
        if not is_unique:
            return ": friction that is not unique"
        if least is None or not least.value:
            return ": no friction is needed"
        return f": that needs a coefficient of {least} or more"
    if isinstance(row, RopeSlipRow) and all(_is_unique(solved, name) for name in (row.rope.name, *row.rope.rubs)):
        wheel = row.rope.rubs.index(row.name)
        less, greater = sorted(float(acting.tensions[asked]) for asked in row.rope.asked[wheel : wheel + 2])
        ratio = float(acting.tension_ratio(part))
        limit = f", at most {ratio:.6g} times the " if ratio <= _ENDLESS else ", "
        return f": tension {greater:.6g} N{limit}{less:.6g} N on its other side"
    most, size = float(acting.most(element, part)), float(length(acting.friction(part)))
    unit = f" {name}" if (name := unit_of(acting.mechanism, row)) else ""
    if is_unique:
        if not most:
            return ": nothing presses, and there is no friction"
        return f": friction {size:.6g}{unit} of at most {most:.6g}{unit}"
    limited = all(_is_unique(solved, row.name) for row in element.normals_of(part))
    return ": friction that is not unique" + (f", at most {most:.6g}{unit}" if limited else "")


def _is_unique(solved: SolvedInstant, row: str) -> bool:
    values = [float(ActingForces.at(instant).multiplier(row)) for instant in (solved.numbers, *solved.others)]
    size = max((abs(float(x)) for x in solved.numbers.multipliers), default=0.0)
    return all(abs(x - values[0]) <= 1e-8 * size for x in values)


# --- how rough is enough -------------------------------------------------------------------------------------------

def least_coefficient(
    solved: SolvedInstant, part: FrictionPart, forces: Callable[[StateQuantities], tuple[S, Sequence[S]]]
) -> Iterator[tuple[str, Value]]:
    """Yield the least coefficient |F| / N with which a part sticks that is rough `enough`; `forces` gives N and F."""
    pressing, friction = forces(solved.numbers)
    largest = max((abs(float(x)) for x in solved.numbers.multipliers), default=0.0)
    if not part.enough or abs(float(pressing)) <= _TINY * largest:
        return
    sign = -1 if len(friction) == 1 and float(friction[0]) < 0.0 else 1

    def ratio(instant: StateQuantities) -> Mapping[str, Any]:
        pressing, friction = forces(instant)
        size = sign * friction[0] if len(friction) == 1 else length(friction)
        return {"": size / (instant.motion.state.values([part.arm])[0] * pressing)}

    unit = "m" if part.rows[0].unit == "N*m" and part.arm is ONE else ""
    yield part.name, solved.values(ratio, {"": unit})[""]


# --- at the limit --------------------------------------------------------------------------------------------------


def _at_limit(solved: SolvedInstant) -> Iterator[tuple[str, str]]:
    """Yield what is at its limit, by what would happen beyond it, decided exactly where that can be done."""
    if not solved.decided.at_limit:
        return
    values = exact_values(solved)
    acting = ActingForces.at(solved.nodes)
    for inequality in inequalities(acting, solved):
        if not set(inequality.rows) & set(solved.decided.at_limit):
            continue
        conditions: list[Condition] = solved.closed(inequality.conditions) or []
        signs = [decided_sign(condition.value, values) for condition in conditions]
        if 0 in signs:
            yield inequality.broken, "at the limit"
        elif None in signs or not signs:
            yield inequality.broken, "at the limit as far as numbers tell: not decided exactly"


def beyond_limits(solved: SolvedInstant) -> dict[str, float]:
    """Return what exact numbers say is left at limits, by rows, where some of it is negative: the state is another.

    Empty where all is as floats have it.
    """
    found = dict[str, float]()
    if solved.decided.at_limit:
        values = exact_values(solved)
        for inequality in inequalities(ActingForces.at(solved.nodes), solved):
            conditions: list[Condition] = solved.closed(inequality.conditions) or []
            if inequality.rows[0] in solved.decided.at_limit and conditions:
                least = min((condition.value for condition in conditions), key=lambda value: float(value.sample))
                if decided_sign(least, values):
                    found.setdefault(inequality.rows[0], float(least.sample))
    return found if any(value < 0.0 for value in found.values()) else {}


def exact_values(solved: SolvedInstant) -> dict[Node, Node]:
    """Return the exact values of the parameters that formulas name."""
    named = {symbol(entry.name): entry.value for entry in solved.mechanism.parameters}
    known = {node: value for node, value in named.items() if value is not None and not leaves([value], "slot")}
    return {node: known[node] for node in solved.symbolic.letters if node in known}


# ----------------------------------------------------------------------------------------------------------------------
# What is left out, told where it is there: impacts, couples that pads of joints would bear, forces along an axis.


_STATIC_ROUNDING: Final = 1e-9
_LEFT: Final = ".left"
_RIGHT: Final = ".right"
_APART: Final = "give the length over which its pads or bearings are apart"


def left_out(solved: SolvedInstant) -> tuple[str, ...]:
    """Return what strikes at the start, and what reactions of joints that rub hold beside what their friction is of."""
    one_way = solved.mechanism.one_way
    notes = [solved.decided.strikes] if solved.decided.strikes else []
    acting = {x.name for x in one_way if x.unilateral and is_active(solved.mechanism, x)}
    for left in sorted(name for name in acting if name.endswith(_LEFT)):  # both sides of a thin bar in a plane model
        if (right := left.removesuffix(_LEFT) + _RIGHT) in acting:
            notes.append(
                f"{left} and {right} press at once, the two sides of a thin bar, as a slot without play does: give its "
                "segment the normal of the side that is touched, if that is one only"
            )
    return (*notes, *(note for x in one_way if x.kind == "friction" for note in _notes(solved, x)))


def _notes(solved: SolvedInstant, element: LawElement) -> Iterator[str]:
    normals = [row for row in element.normals if isinstance(row, ReactionRow)]
    body = next(body for body in solved.mechanism.bodies if body.joint_name == element.joint)
    turns, slides = any(step.turns for step in body.steps), any(step.slides for step in body.steps)
    if not all(row.share is ONE for row in normals) or sum(len(step.turns) for step in body.steps) == 3:
        return  # on a thread force and couple go together, a ball bears forces only
    if not all(row.constant is ZERO for row in normals):
        return  # nothing of the reaction presses
    held = _Held(solved, element.joint)
    if len(element.frictions) > 1 and all(row.moment is ORIGIN for row in normals):
        yield from _of_pins(held, element)
        return
    if sum(bool(step.slides) for step in body.steps) > 1:
        yield from _of_plate(held, element, normals[0], turns=turns)
        return
    axis = next(axis for step in body.steps for axis in (*step.slides, *step.turns))
    along = held.unit(axis)
    couple = float(np.linalg.norm(held.moment - (held.moment @ along) * along if turns else held.moment))
    if couple > _STATIC_ROUNDING * held.size and all(row.moment is ORIGIN for row in normals):
        yield f"{element.name} rubs with its force alone; the couple of {couple:.6g} N*m there is left out ({_APART})"
    push = abs(float(held.force @ along))
    if turns and not slides and push > _STATIC_ROUNDING * held.size:
        yield f"{element.name} rubs with the force across its axis; {push:.6g} N along the axis are left out"


class _Held:
    """What a joint holds: force and moment on its child, about its point there, in the frame on its parent."""

    def __init__(self, solved: SolvedInstant, joint: str) -> None:
        self._state = solved.numbers.motion.state
        reaction = solved.numbers.reactions[joint]
        self.force, self.moment = np.array([reaction[c] for c in COMPONENTS], dtype=float).reshape(2, 3)
        self.size = float(np.abs(self.force).sum() + np.abs(self.moment).sum())

    def unit(self, axis: Point) -> Floats:
        along = np.array(self._state.values(axis), dtype=float)
        return np.asarray(along / np.linalg.norm(along), dtype=float)


def _of_plate(held: _Held, element: LawElement, row: ReactionRow, *, turns: bool) -> Iterator[str]:
    """Yield the couple that moves the normal force away from the joint's point."""
    normal = held.unit(row.force)
    couple = float(np.linalg.norm(held.moment - (held.moment @ normal) * normal))
    if couple > _STATIC_ROUNDING * held.size:
        pressing = abs(float(held.force @ normal))
        moved = pressing > _STATIC_ROUNDING * held.size
        where = f", which moves that force {couple / pressing:.6g} m aside," if moved else ""
        yield (
            f"{element.name} rubs with the force along its normal alone; the couple of {couple:.6g} N*m there{where} "
            "is left out"
        )
    twist = abs(float(held.moment @ normal))
    if not turns and twist > _STATIC_ROUNDING * held.size:
        yield f"{element.name} rubs with its force alone; the couple of {twist:.6g} N*m about its normal is left out"


def _of_pins(held: _Held, element: LawElement) -> Iterator[str]:
    """Yield the couple that pins and guides one on the other transmit, and the forces along the pins."""
    pins: dict[str, Floats] = {}
    for part in element.frictions:
        rows = element.normals_of(part)
        first, second = (held.unit(row.force) for row in rows if isinstance(row, ReactionRow)) if part.norm else (0, 0)
        if isinstance(part.rows[0], BrakingRow):
            pins[part.name] = np.cross(first, second)
    axes = np.array(list(pins.values())).reshape(-1, 3).T
    free = axes @ least_squares(axes, held.moment) if pins else np.zeros(3)
    couple = float(np.linalg.norm(held.moment - free))
    if couple > _STATIC_ROUNDING * held.size:
        yield f"{element.name} rubs with its force alone; the couple of {couple:.6g} N*m that it transmits is left out"
    for name, pin in pins.items():
        push = abs(float(held.force @ pin))
        if push > _STATIC_ROUNDING * held.size:
            yield f"{name} rubs with the force across it; {push:.6g} N along the pin are left out"


# ----------------------------------------------------------------------------------------------------------------------
# The inequalities of a mode: what must hold so that each element acts, sticks, slides or rests as it does there.


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


def _acting_corners(acting: ActingForces) -> dict[str, list[LawElement]]:
    """Return the declared contacts that have several corners, with those that act."""
    return corner_groups(x for x in acting.mechanism.one_way if is_active(acting.mechanism, x))


def _sticking_corners(acting: ActingForces) -> Iterator[tuple[str, list[LawElement], list[FrictionPart]]]:
    """Yield the declared contacts of which several corners act, with these and their friction, where all stick."""
    for name, elements in _acting_corners(acting).items():
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
    for name, elements in _acting_corners(acting).items():
        face = plane_of(elements[0].surfaces or ())
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
        return part.static if sliding.coefficient is part.kinetic else -part.static

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
    for name in reactions.keys() & normal_forces(solved.mechanism):
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
