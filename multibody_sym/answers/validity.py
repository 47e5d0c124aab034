"""Under which conditions a solved start holds: inequalities of forces, and signs that formulas take for granted."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

from multibody_sym.algebra.conditions import Condition, reduced
from multibody_sym.algebra.quotients import NoClosedFormError
from multibody_sym.answers.closed_form import WORK
from multibody_sym.answers.instant import AGREEMENT, Solved
from multibody_sym.answers.solution import Value
from multibody_sym.errors import NoSolutionError, Where
from multibody_sym.expressions.printer import text
from multibody_sym.model.mechanism.mechanism import normal_forces
from multibody_sym.model.mechanism.rows import RopeRow
from multibody_sym.scalars.node import quantity

_ROUNDING: Final = 1e-12

Reactions = Mapping[str, Mapping[str, Value]]


def conditions_of(solved: Solved, reactions: Reactions) -> list[str]:
    """Return the conditions as comparisons, as few as say all; those without a closed form name their quantity.

    Raises NoSolutionError where a rope that cannot slacken would push.
    """
    closed: list[Condition] = []
    named: list[str] = []
    for name, condition in _pulls(solved, reactions):
        if condition is None:
            named.append(name)
        else:
            closed.append(condition)
    if solved.forms is not None:
        closed += [Condition(positive, strict=True) for positive in solved.forms.field.positive]
    return [*named, *_told(solved, closed), *_pulled_wheels(solved, reactions)]


def _told(solved: Solved, conditions: list[Condition]) -> list[str]:
    """Return conditions over quotients in words; what is too long is left out with a reason."""
    if not conditions:
        return []
    found = []
    conditions[0].value.field.work += WORK
    try:
        conditions = reduced(conditions)
    except NoClosedFormError:
        solved.reasons["a condition is too long"] = None
    for condition in conditions:
        try:
            found.append(str(condition))
        except NoClosedFormError:
            solved.reasons["a condition is too long"] = None
    return found


def _pulls(solved: Solved, reactions: Reactions) -> Iterator[tuple[str, Condition | None]]:
    """Yield for each rope what it needs to stay taut, in words and over quotients where there is a closed form."""
    least = -_ROUNDING * max(map(abs, solved.numbers.multipliers), default=0.0)
    for k, row in enumerate(solved.mechanism.rows):
        if not isinstance(row, RopeRow):
            continue
        rope, component = row.told
        tension = reactions[rope][component]
        name = f"{text(quantity('tension', (row.name,)))} >= 0"
        if tension.value is None:
            yield f"{name} is not decided: the tension is not unique", None
            continue
        if tension.value < least:
            raise NoSolutionError(
                f"rope {rope} would push with {-tension.value:.6g} N: as declared it cannot slacken, and a rope "
                "cannot push. Write slack: true, so that it may hang loose; a rod is {type: distance, ...}",
                where=Where(path=solved.mechanism.row_path(k)),
            )
        closed = None if solved.forms is None else solved.forms.multipliers[k]
        near = AGREEMENT * abs(tension.value) - least
        agrees = closed is not None and abs(float(closed.sample) - tension.value) <= near
        yield name, Condition(closed) if closed is not None and agrees else None


def _pulled_wheels(solved: Solved, reactions: Reactions) -> list[str]:
    """Return for each rolling wheel that its plane would pull that it lifts off; what is not unique says nothing."""
    least = -_ROUNDING * max(map(abs, solved.numbers.multipliers), default=0.0)
    forces = {name: reactions[name]["tension"] for name in normal_forces(solved.mechanism)}
    pulled = [name for name, force in forces.items() if force.unique and (force.value or 0.0) < least]
    return [f"{name} >= 0 fails: the plane would pull; in truth the wheel lifts off" for name in pulled]
