"""The inequalities of a mode: what must hold so that each element acts, sticks, slides or rests as it does there."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.conditions import Condition, within
from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.answers.closed_form import ClosedForms, closed_forms, unknowns
from multibody_sym.answers.instant import Solved
from multibody_sym.answers.one_way import Acting, is_active, rubs, slip_of
from multibody_sym.dynamics.programs.quantities import Instant
from multibody_sym.expressions.printer import text
from multibody_sym.kinematics.motion import motion_of
from multibody_sym.kinematics.rows import coefficients
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.modes import in_mode
from multibody_sym.model.mechanism.one_way import ALONG_VELOCITY, STICKS, FrictionPart, OneWay
from multibody_sym.model.mechanism.rope_rows import RopeSlipRow
from multibody_sym.model.mechanism.rows import RopeRow
from multibody_sym.scalars.node import Node, as_node, quantity

Kind = Literal["least", "more", "within", "circle"]
"""a >= 0; a > 0; |a| <= b; a^2 + b^2 <= c^2."""

_PRESSES: Final = {"contact": ("normal", "opens"), "rope": ("tension", "slackens"), "stop": ("force", "lets go")}


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
            *parts, limit = terms
            square = limit * limit
            for part in parts:
                square = square - part * part
            return [Condition(square, broken=self.broken)]
        return [Condition(terms[0], self.kind == "more", self.broken)]


def inequalities(acting: Acting, touching: Collection[str], moving: Collection[str]) -> Iterator[Inequality]:
    """Yield the inequalities of the mode over Nodes.

    `touching`: the elements that might act; `moving`: the friction parts that slide already.
    """
    mechanism = acting.mechanism
    for element in mechanism.one_way:
        if element.unilateral:
            yield from _normal(acting, element, touching)
        elif len(element.normals) == 1 or not any(part.norm for part in element.frictions):
            yield from _sides(acting, element)
        for part in element.frictions if is_active(mechanism, element) else ():
            if rubs(part):
                yield from _friction(acting, element, part, part.name in moving)
    yield from _groups(acting)
    yield from _taut_ropes(acting)


def _normal(acting: Acting, element: OneWay, touching: Collection[str]) -> Iterator[Inequality]:
    name, (force, fails) = element.name, _PRESSES[element.kind]
    rows = (element.normals[0].name,)
    if is_active(acting.mechanism, element):
        yield Inequality("least", _nodes(acting.normal(element)), f"{force}({name}) >= 0", f"{name} {fails}", rows)
    elif name in touching:
        opening = acting.acceleration(rows[0])
        told = f"{name} opens: its gap's acceleration >= 0"
        yield Inequality("least", _nodes(opening), told, f"{name} {element.words[0]}", rows)


def _sides(acting: Acting, element: OneWay) -> Iterator[Inequality]:
    """Yield on which side each reaction presses that rubs."""
    sides = acting.mechanism.mode.sides if acting.mechanism.mode else {}
    for row in element.normals:
        side = sides.get(row.name, sides.get(element.name, 0))
        if side:
            force = acting.multiplier(row.name)
            told = f"{row.name} {'>=' if side > 0 else '<='} 0"
            broken = f"{element.name} presses on the other side"
            yield Inequality("least", _nodes(force if side > 0 else -force), told, broken, (row.name,))


def _friction(acting: Acting, element: OneWay, part: FrictionPart, moves: bool) -> Iterator[Inequality]:
    name, rows = part.name, tuple(row.name for row in part.rows)
    slip = slip_of(acting.mechanism, part)
    if slip == STICKS:
        if isinstance(part.rows[0], RopeSlipRow):
            yield from _gripping(acting, part, part.rows[0])
        elif not part.enough:
            yield _sticking(acting, element, part, rows)
    elif slip != ALONG_VELOCITY:
        rate = acting.rows[rows[0]].phidot if moves else acting.acceleration(rows[0])
        what = "velocity" if moves else "acceleration"
        told = f"{name} slides: its {what} along the tangent {'>' if slip > 0 else '<'} 0"
        broken = f"{name} does not slide {'+' if slip > 0 else '-'}"
        yield Inequality("more", _nodes(rate if slip > 0 else -rate), told, broken, rows)


def _gripping(acting: Acting, part: FrictionPart, slip: RopeSlipRow) -> Iterator[Inequality]:
    """Yield that neither tension of a rope over a rough wheel is more than exp(mu wrap) times the other."""
    (static,) = coefficients(acting.instant.motion, part.rows, [part.static])
    most, (before, behind) = (2 + static) / (2 - static), slip.rope.asked
    tensions = acting.instant.tensions
    for smaller, larger in ((before, behind), (behind, before)):
        told = " <= ".join((_asked(larger), f"{_asked(smaller)}*exp(static*wrap)"))
        rest = most * tensions[smaller] - tensions[larger]
        yield Inequality("least", _nodes(rest), told, f"{part.name} slips", (slip.name,))


def _asked(rope: str) -> str:
    return text(quantity("tension", (rope,)))


def _sticking(acting: Acting, element: OneWay, part: FrictionPart, rows: tuple[str, ...]) -> Inequality:
    (static,) = coefficients(acting.instant.motion, part.rows, [part.static])
    limit = static * acting.pressing(element, part)
    forces = acting.friction(part)
    told = f"abs(friction({part.name})) <= static*normal({element.name})"
    kind: Kind = "within" if len(forces) == 1 else "circle"
    return Inequality(kind, _nodes(*forces, limit), told, f"{part.name} slips", rows)


def _nodes(*terms: object) -> tuple[Node, ...]:
    return tuple(as_node(x) for x in terms)


def _taut_ropes(acting: Acting) -> Iterator[Inequality]:
    """Yield what ropes need to stay taut that hold both ways as declared."""
    one_way = {row.name for element in acting.mechanism.one_way for row in element.rows}
    for row in acting.mechanism.rows:
        if isinstance(row, RopeRow) and row.name not in one_way:
            told = f"{text(quantity('tension', (row.name,)))} >= 0"
            yield Inequality("least", _nodes(acting.multiplier(row.name)), told, f"{row.name} slackens", (row.name,))


def pivots(mechanism: Mechanism, forms: ClosedForms) -> Iterator[Condition]:
    """Yield that the apparent mass which a sliding contact's force meets has the sign that it has."""
    names = [row.name for row in mechanism.rows]
    for element in mechanism.one_way:
        slides = element.unilateral and any(slip_of(mechanism, part) != STICKS for part in element.frictions)
        if slides and is_active(mechanism, element):
            try:
                given = forms.give(names.index(element.normals[0].name))
            except NoClosedFormError:
                continue
            yield Condition(_turned(given), True, f"{element.name}: no state or several, as with Painleve's rod")


def _turned(a: Quotient) -> Quotient:
    return a if a.sample > 0 else -a


# --- several corners, two coefficients -----------------------------------------------------------------------------


def _groups(acting: Acting) -> Iterator[Inequality]:
    """Yield that corners which all stick do not slip together: their single forces may not be unique, their sum is."""
    groups: dict[str, list[OneWay]] = {}
    for element in acting.mechanism.one_way:
        is_corner = element.kind == "contact" and element.group not in ("", element.name)
        if is_corner and is_active(acting.mechanism, element):
            groups.setdefault(element.group, []).append(element)
    for name, elements in groups.items():
        parts = [part for element in elements for part in element.frictions[:1] if rubs(part) and not part.enough]
        sticking = all(slip_of(acting.mechanism, part) == STICKS for part in parts)
        if len(elements) > 1 and len(parts) == len(elements) and sticking and len(parts[0].rows) == 1:
            yield _sticking_together(acting, name, elements, parts)


def _sticking_together(
    acting: Acting, name: str, elements: Sequence[OneWay], parts: Sequence[FrictionPart]
) -> Inequality:
    statics = [coefficients(acting.instant.motion, part.rows, [part.static])[0] for part in parts]
    pairs = zip(statics, elements, parts, strict=True)
    limit = sum((static * acting.pressing(element, part) for static, element, part in pairs), 0)
    force = sum((acting.friction(part)[0] for part in parts), 0)
    told = f"abs(friction({name})) <= static*normal({name})"
    rows = tuple(row.name for part in parts for row in part.rows)
    return Inequality("within", _nodes(force, limit), told, f"{name} slips", rows)


def slipping(solved: Solved) -> Iterator[Condition]:
    """Yield that parts which slip from rest do so under their static coefficients too, where these are others."""
    mechanism, forms = solved.mechanism, solved.forms
    starting = [
        (element, part)
        for element in mechanism.one_way
        for part in element.frictions
        if slip_of(mechanism, part) in (1, -1) and part.name not in solved.decided.moving
    ]
    if forms is None or all(part.static is part.kinetic for _, part in starting):
        return
    static = _with_static(mechanism, {part.name for _, part in starting})
    try:
        other = closed_forms(static, solved.symbolic)
        instant = Instant(motion_of(static, solved.symbolic.state), *unknowns(static))
        for _, part in starting:
            rate = as_node(Acting(instant).acceleration(part.rows[0].name)) * slip_of(mechanism, part)
            (here,) = forms.of([book_form(other.of([as_node(rate)])[0])])
            yield Condition(here, True, f"{part.name} sticks")
    except NoClosedFormError as reason:
        solved.reasons[str(reason)] = None


def _with_static(mechanism: Mechanism, parts: Collection[str]) -> Mechanism:
    """Return the mechanism in the mode in which parts slide with their static coefficients."""

    def changed(element: OneWay) -> OneWay:
        frictions = (replace(p, kinetic=p.static) if p.name in parts else p for p in element.frictions)
        return replace(element, frictions=tuple(frictions))

    one_way = tuple(changed(element) for element in mechanism.one_way)
    names = {row.name for element in one_way for row in element.rows}
    rows = tuple(row for row in mechanism.rows if row.name not in names)
    assert mechanism.mode is not None
    return in_mode(replace(mechanism, one_way=one_way, rows=rows), mechanism.mode, mechanism.held)
