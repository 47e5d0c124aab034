"""Under which conditions a solved start holds: inequalities of its mode, and signs that formulas take for granted."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field
from typing import Final

from multibody_sym.algebra.conditions import Condition, reduced, under_roots
from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.answers.closed_form import WORK, ClosedForms
from multibody_sym.answers.instant import AGREEMENT, Solved
from multibody_sym.answers.mode_conditions import Inequality, declared, inequalities, pivots, slipping, twists
from multibody_sym.answers.one_way import Acting
from multibody_sym.dynamics.programs.quantities import Instant
from multibody_sym.errors import NoSolutionError, Where
from multibody_sym.expressions.printer import text
from multibody_sym.expressions.quantities import force_name
from multibody_sym.expressions.values import Value
from multibody_sym.model.mechanism.limits import taut_ropes
from multibody_sym.model.mechanism.mechanism import normal_forces
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node, quantity

_ROUNDING: Final = 1e-12
_NOT_UNIQUE: Final = 1e-8

Reactions = Mapping[str, Mapping[str, Value]]


@dataclass
class Validity:
    """Conditions as comparisons, each with what happens where it fails (empty: the formulas have other signs)."""

    conditions: dict[str, str] = field(default_factory=dict)
    closed: list[Condition] = field(default_factory=list)


def validity(solved: Solved, reactions: Reactions) -> Validity:
    """Return the conditions, as few as say all; those without a closed form name their quantity.

    Raises NoSolutionError where a rope that cannot slacken would push.
    """
    found = Validity()
    _verify_taut(solved, reactions)
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
        found.closed += [*pivots(solved.mechanism, solved.forms), *slipping(solved)]
        found.closed += [Condition(positive, strict=True) for positive in solved.forms.field.positive]
        found.closed += under_roots([*solved.forms.udot, *solved.forms.multipliers])
    found.conditions |= told_conditions(solved, found.closed)
    found.conditions |= dict.fromkeys(_not_decided(solved, reactions), "")
    found.conditions |= dict(_turning(solved))
    found.conditions |= dict.fromkeys(_pulled_wheels(solved, reactions), "")
    return found


def conditions_of_mode(solved: Solved) -> Iterator[Condition]:
    """Yield what holds in the mode of a solved start, and lets others follow where it fails, in closed form."""
    for inequality, known in _inequalities(solved):
        yield from (solved.closed(inequality.conditions) if known else None) or ()
    yield from slipping(solved)


def _inequalities(solved: Solved) -> Iterator[tuple[Inequality, bool | None]]:
    """Yield the inequalities and whether their closed forms are the numbers, None where forces are not unique."""

    def of(instant: Instant) -> Iterator[Inequality]:
        return inequalities(Acting.at(instant), solved)

    numbers = [list(of(instant)) for instant in (solved.numbers, *solved.others)]
    for k, nodes in enumerate(of(solved.nodes)):
        values = [[float(term.data) for term in each[k].terms] for each in numbers]
        size = max((abs(x) for x in (*values[0], *solved.numbers.multipliers)), default=0.0)
        pairs = [pair for other in values[1:] for pair in zip(values[0], other, strict=True)]
        unique = all(abs(a - b) <= _NOT_UNIQUE * size for a, b in pairs)
        yield nodes, _agree(solved, nodes, values[0], size) if unique else None


def _agree(solved: Solved, inequality: Inequality, values: list[float], size: float) -> bool:
    found = solved.closed(lambda forms: forms.of(inequality.terms))
    return found is not None and all(
        abs(float(a.sample) - b) <= AGREEMENT * max(abs(b), size) for a, b in zip(found, values, strict=True)
    )


def told_conditions(solved: Solved, conditions: list[Condition], given: Iterable[Condition] = ()) -> dict[str, str]:
    """Return conditions over quotients in words; what is too long is left out with a reason.

    What is `given` holds for all parameters allowed, beside what is declared.
    """
    if not conditions:
        return {}
    found = {}
    conditions[0].value.field.work += WORK
    try:
        conditions = reduced(conditions, [*declared(solved), *given])
    except NoClosedFormError:
        solved.reasons["a condition is too long"] = None
    for condition in conditions:
        try:
            found[str(condition)] = condition.broken
        except NoClosedFormError:
            solved.reasons["a condition is too long"] = None
    return found


def _verify_taut(solved: Solved, reactions: Reactions) -> None:
    """Raise NoSolutionError where a rope that cannot slacken would push."""
    for k, row in taut_ropes(solved.mechanism):
        rope, component = row.told
        tension = reactions[rope][component].value
        if tension is not None and tension < _least(solved):
            raise NoSolutionError(
                f"rope {rope} would push with {-tension:.6g} N: as declared it cannot slacken, and a rope "
                "cannot push. Write slack: true, so that it may hang loose; a rod is {type: distance, ...}",
                where=Where(path=solved.mechanism.row_path(k)),
                number="N106",
            )


def _least(solved: Solved) -> float:
    """Return the force below which it is not zero by rounding."""
    return -_ROUNDING * max((abs(float(x)) for x in solved.numbers.multipliers), default=0.0)


def _not_decided(solved: Solved, reactions: Reactions) -> Iterator[str]:
    """Yield for each rope with a tension that is not unique that it may be slack."""
    for _, row in taut_ropes(solved.mechanism):
        rope, component = row.told
        if reactions[rope][component].value is None:
            yield f"{text(quantity('tension', (row.name,)))} >= 0 is not decided: the tension is not unique"


def _turning(solved: Solved) -> Iterator[tuple[str, str]]:
    """Yield for contacts whose corners bear a couple that these may reach their limits before all together do."""
    for name, twist in twists(Acting.at(solved.nodes)):

        def of(forms: ClosedForms, twist: Node = twist) -> list[Quotient]:
            return forms.of([twist])

        closed = solved.closed(of)
        if closed is None or not closed[0].is_zero:
            told = f"the corners of {name} share a couple about its normal below their limits"
            yield f"{told}: in no formula, as their forces are not unique", f"{name} turns"


def _pulled_wheels(solved: Solved, reactions: Reactions) -> list[str]:
    """Return for each rolling wheel that its plane would pull that it lifts off; what is not unique says nothing."""
    forces = {name: reactions[name]["tension"] for name in normal_forces(solved.mechanism)}
    pulled = [name for name, force in forces.items() if force.unique and (force.value or 0.0) < _least(solved)]
    wrong = "fails: the plane would pull; in truth the wheel lifts off"
    return [f"{force_name(name, 'multiplier')} >= 0 {wrong}" for name in pulled]
