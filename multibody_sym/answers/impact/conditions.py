"""Under which conditions the formulas of an impact hold: what closes and pushes, what sticks and slides."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from multibody_sym.algebra.conditions import Condition, within
from multibody_sym.algebra.quotients import NoClosedFormError
from multibody_sym.answers.closed_form import ClosedForms
from multibody_sym.answers.impact.resting import ImpactInstant, length, row_impulses
from multibody_sym.answers.instant import Solved
from multibody_sym.answers.validity import told_conditions
from multibody_sym.dynamics.impacts.impulsive import StruckRows, rubbing
from multibody_sym.errors import ExpressionError
from multibody_sym.kinematics.rows import coefficients
from multibody_sym.model.mechanism.one_way import FrictionPart, OneWay
from multibody_sym.scalars.node import Node, as_node
from multibody_sym.scalars.vectors import S


def impact_conditions(
    solved: Solved, rows: StruckRows, elements: tuple[OneWay, ...], course: Sequence[tuple[Node, str]]
) -> dict[str, str]:
    """Return the conditions as comparisons, each with what happens where it fails; none without closed forms.

    `course`: what is positive where slip changes on the way as it does.
    """
    nodes, forms = solved.nodes, solved.forms
    assert isinstance(nodes, ImpactInstant)
    if forms is None:
        return {}
    found = [Condition(positive, strict=True) for positive in forms.field.positive]
    try:
        for needed in _needed(_Mode(nodes, rows, elements)):
            found += needed.over(forms)
        for positive, broken in course:
            found += _Needed(positive, broken).over(forms)
    except NoClosedFormError as reason:
        solved.reasons[str(reason)] = None
    except ExpressionError as reason:
        solved.reasons[reason.message] = None
    return told_conditions(solved, found)


@dataclass(frozen=True)
class _Needed:
    """That a term is positive (`strict`) or not negative, or with a `limit` not larger than that; else `broken`."""

    term: Node
    broken: str
    strict: bool = False
    limit: Node | None = None

    def over(self, forms: ClosedForms) -> list[Condition]:
        if self.limit is not None:
            term, limit = forms.of([self.term, self.limit])
            return within(term, limit, self.broken)
        return [Condition(forms.of([self.term])[0], self.strict, self.broken)]


@dataclass(frozen=True)
class _Mode:
    nodes: ImpactInstant
    rows: StruckRows
    elements: tuple[OneWay, ...]


def _needed(mode: _Mode) -> Iterator[_Needed]:
    before, after = mode.nodes.rows_before, mode.nodes.rows_after
    for element in mode.elements:
        normal = element.normals[0].name
        if element not in mode.rows.acting:
            yield _Needed(as_node(after[normal].phidot), f"{element.name} is struck too")
            continue
        if len(mode.elements) == 1:
            yield _Needed(as_node(-before[normal].phidot), f"{element.name} separates and nothing strikes", strict=True)
        else:
            yield _Needed(as_node(row_impulses(mode.nodes, [normal])[0]), f"{element.name} is not struck")
        for part in rubbing(element):
            yield from _of_friction(mode, element, part)
    for element in mode.rows.rough:
        if not any(part.norm for part in element.frictions):
            for row in element.normals:
                pressed = mode.rows.sides[row.name] * row_impulses(mode.nodes, [row.name])[0]
                yield _Needed(as_node(pressed), f"{element.name} is pressed from the other side")
        for part in rubbing(element):
            yield from _of_friction(mode, element, part)


def _of_friction(mode: _Mode, element: OneWay, part: FrictionPart) -> Iterator[_Needed]:
    row = part.rows[0].name
    if row in mode.rows.given:
        return
    if len(part.rows) > 1:
        yield from _in_space(mode, element, part)
        return
    slip = mode.rows.slips.get(part.name, 0)
    if slip:
        slipping = mode.nodes.rows_after[row].phidot
        yield _Needed(as_node(slipping if slip > 0 else -slipping), f"{part.name} sticks or turns round")
    elif not part.enough:
        (static,) = coefficients(mode.nodes.before, part.rows, [part.static])
        (along,) = row_impulses(mode.nodes, [row])
        limit = static * _pressing(mode, element, part)
        yield _Needed(as_node(along), f"{part.name} slips", limit=as_node(limit))


def _in_space(mode: _Mode, element: OneWay, part: FrictionPart) -> Iterator[_Needed]:
    """Yield that what sticks in the end stays within its cone."""
    if not part.enough and mode.rows.slips.get(part.name, 0) == 0:
        (static,) = coefficients(mode.nodes.before, part.rows, [part.static])
        along = length(row_impulses(mode.nodes, [row.name for row in part.rows]))
        yield _Needed(as_node(static * _pressing(mode, element, part) - along), f"{part.name} slips")


def _pressing(mode: _Mode, element: OneWay, part: FrictionPart) -> S:
    """Return the impulse that presses where a part rubs."""
    names = [element.normals[k].name for k in part.normals]
    impulses = row_impulses(mode.nodes, names)
    if part.norm:
        return length(impulses)
    return sum((mode.rows.sides.get(name, 1) * x for name, x in zip(names, impulses, strict=True)), 0)
