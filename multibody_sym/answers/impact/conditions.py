"""Under which conditions the formulas of an impact hold: what closes and pushes, what sticks and slides."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from multibody_sym.algebra.inequalities import Condition
from multibody_sym.algebra.quotients import NoClosedFormError
from multibody_sym.answers.impact.solve import (
    Blows,
    ImpactFormulas,
    ImpactInstant,
    Needed,
    Order,
    length,
    pressing_impulse,
    row_impulses,
)
from multibody_sym.answers.instant.conditions import told_conditions
from multibody_sym.answers.instant.instant import SolvedInstant
from multibody_sym.answers.instant.states import least_coefficient
from multibody_sym.dynamics.contact.impact_problem import StruckRows, friction_parts
from multibody_sym.dynamics.programs.quantities import StateQuantities
from multibody_sym.errors import ExpressionError
from multibody_sym.mechanics.law_elements import STICKS, FrictionPart, LawElement
from multibody_sym.mechanics.row_kinematics import coefficients
from multibody_sym.records import dataclass
from multibody_sym.scalars import limits
from multibody_sym.scalars.node import ZERO, Node, as_node
from multibody_sym.scalars.vectors import S
from multibody_sym.text.values import Value


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
    except NoClosedFormError as reason:
        solved.reasons[str(reason)] = None
        return told_conditions(solved, found)
    except ExpressionError as reason:
        solved.reasons[reason.message] = None
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
        """Return the coefficient of a part that sticks, and the impulse that presses it."""
        (static,) = coefficients(self.nodes.before, part.rows, [part.static])
        return static, pressing_impulse(self.nodes, element, part, self.rows.mode.sides)

    def by_element(self, speeds: Mapping[str, Node]) -> dict[str, Node]:
        """Return the speeds of opening by the names of elements."""
        return {x.name: speeds[x.normals[0].name] for x in self.order.elements}

    @property
    def alone(self) -> bool:
        """Whether one element alone touches."""
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
