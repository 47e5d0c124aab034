"""Which state was found at a start: in words, with what decided it, what is at its limit, how rough is enough."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np

from multibody_sym.algebra.inequalities import Condition
from multibody_sym.algebra.quotient_functions import decided_sign
from multibody_sym.answers.instant.conditions import inequalities
from multibody_sym.answers.instant.instant import SolvedInstant
from multibody_sym.answers.instant.reactions import unit_of
from multibody_sym.derivation.symbolic_start import ActingForces
from multibody_sym.dynamics.programs.quantities import StateQuantities
from multibody_sym.dynamics.programs.reactions import is_active, mode_of
from multibody_sym.mechanics.law_elements import ALONG_VELOCITY, STICKS, FrictionPart, LawElement
from multibody_sym.mechanics.modes import mode_words
from multibody_sym.mechanics.row_records import BrakingRow, ReactionRow, RopeSlipRow, VelocityRow
from multibody_sym.model.bodies import ORIGIN
from multibody_sym.model.fields import Point
from multibody_sym.model.states import WAYS
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.limits import length
from multibody_sym.scalars.node import ONE, Node, slot, symbol
from multibody_sym.scalars.rank import least_squares
from multibody_sym.scalars.vectors import S
from multibody_sym.text.printer import COMPONENTS
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
    strikes = (f"{name} strikes: it closes with {speed.told()} (see the notes)" for name, speed in closing.items())
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
        return f": that needs a coefficient of {least.told()} or more"
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


_ROUNDING: Final = 1e-9
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
    if couple > _ROUNDING * held.size and all(row.moment is ORIGIN for row in normals):
        yield f"{element.name} rubs with its force alone; the couple of {couple:.6g} N*m there is left out ({_APART})"
    push = abs(float(held.force @ along))
    if turns and not slides and push > _ROUNDING * held.size:
        yield f"{element.name} rubs with the force across its axis; {push:.6g} N along the axis are left out"


class _Held:
    """What a joint holds: force and moment on its child, about its point there, in the frame on its parent."""

    def __init__(self, solved: SolvedInstant, joint: str) -> None:
        self._state = solved.numbers.motion.state
        reaction = solved.numbers.reactions[joint]
        self.force, self.moment = np.array([reaction[c] for c in COMPONENTS], dtype=float).reshape(2, 3)
        self.size = float(np.abs(self.force).sum() + np.abs(self.moment).sum())

    def unit(self, axis: Point) -> Floats:
        """Return the unit vector along an axis."""
        along = np.array(self._state.values(axis), dtype=float)
        return np.asarray(along / np.linalg.norm(along), dtype=float)


def _of_plate(held: _Held, element: LawElement, row: ReactionRow, *, turns: bool) -> Iterator[str]:
    """Yield the couple that moves the normal force away from the joint's point."""
    normal = held.unit(row.force)
    couple = float(np.linalg.norm(held.moment - (held.moment @ normal) * normal))
    if couple > _ROUNDING * held.size:
        pressing = abs(float(held.force @ normal))
        where = f", which moves that force {couple / pressing:.6g} m aside," if pressing > _ROUNDING * held.size else ""
        yield (
            f"{element.name} rubs with the force along its normal alone; the couple of {couple:.6g} N*m there{where} "
            "is left out"
        )
    twist = abs(float(held.moment @ normal))
    if not turns and twist > _ROUNDING * held.size:
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
    if couple > _ROUNDING * held.size:
        yield f"{element.name} rubs with its force alone; the couple of {couple:.6g} N*m that it transmits is left out"
    for name, pin in pins.items():
        push = abs(float(held.force @ pin))
        if push > _ROUNDING * held.size:
            yield f"{name} rubs with the force across it; {push:.6g} N along the pin are left out"
