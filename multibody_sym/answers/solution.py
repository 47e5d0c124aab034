"""Solution: what `solve` finds at the given instant, in numbers and in closed form."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Any, Final, Literal

from multibody_sym.answers.impact.record import ImpactFound
from multibody_sym.answers.in_letters.record import Definition
from multibody_sym.answers.worked.record import Worked
from multibody_sym.expressions.components import AT
from multibody_sym.expressions.values import Value
from multibody_sym.records import dataclass

RowKind = Literal["rope", "rod", "force", "multiplier", "contact", "stop", "friction"]
"""What a constraint's multiplier is: a tension of a rope or rod, a force (or moment), or that of an expression.

Contacts, stops and friction in joints have forces of several names.
"""


"""Where a normal force acts."""


@dataclass(frozen=True)
class OtherState:
    """A state that fulfils all laws too: the word of each element, and the accelerations (SI), known to `errors`."""

    states: Mapping[str, str]
    accelerations: Mapping[str, float]
    errors: Mapping[str, float] = field(default_factory=dict)

    def as_json(self) -> dict[str, Any]:
        """Return the object that `--json` prints."""
        return {"states": dict(self.states), "accelerations": dict(self.accelerations)}


@dataclass(frozen=True, repr=False)
class Solution:
    """The solved instant t = 0 of a system.

    `accelerations`: of each coordinate by its name; where the speeds are not the coordinates' rates (quaternions), of
    each speed by its own. `assembled`: the coordinates and speeds that follow from the constraints; those without an
    expression stand in formulas by their names. `shifts`: by how much start values that were given were changed for
    that, by name (SI). `reactions`: of a joint fx .. mz (on the child, about the joint's point, axes of its frame on
    the parent), of an expression `multiplier`, of any other constraint `tension`, which is one of ropes and rods (their
    `kinds`). `conditions` under which all this holds; `answers` to `ask`; `notes`: what was left out, and why.
    `withheld`: components of joints' reactions without a value, as constraints do not say where their forces act, with
    the reasons. `units`: the unit of each coordinate and speed. `steps`: how a book gets there, where asked for.

    What holds one way only is in the state that `states` tells, a word for each element: a contact `stick`, `slide+`,
    `slide-` (in space `slide`, its direction along the tangents in `directions`), `closed` or `open`, a rope `taut` or
    `slack`. `closing`: the speeds of what closes at the start and strikes, of which nothing else here tells. `found`
    says the same for people. Its forces are among `reactions`: of a contact `normal` and `friction`
    (in space `friction_1`, `friction_2`), of several corners together also `at_x`, `at_y`, `at_z`, where their normal
    force acts. `limits`: by condition, what happens where it fails. `at_limit`: what happens a little further on, with
    how that was decided. `needed`: the least coefficients with which what is rough enough sticks. `sums`: forces of
    separate contacts that are unique together though not alone, such as `friction(c) + friction(d)`. `verdict`: `one`,
    or `several` where the laws leave more than one motion, among which `others`; `searched`: what was looked at.
    `where`: what the letters stand for that formulas name beside those of the model, where loops leave no closed form.
    `labels`: the letters by which parameters that have one are known where formulas are typeset.

    Of a system with an `impact` that is told instead: no accelerations, no reactions, `answers` just after it.
    """

    name: str
    coordinates: Mapping[str, float]
    speeds: Mapping[str, float]
    accelerations: Mapping[str, Value]
    reactions: Mapping[str, Mapping[str, Value]]
    conditions: tuple[str, ...]
    answers: Mapping[str, Value]
    notes: tuple[str, ...] = ()
    assembled: Mapping[str, Value] = field(default_factory=dict)
    shifts: Mapping[str, float] = field(default_factory=dict)
    kinds: Mapping[str, RowKind] = field(default_factory=dict)
    withheld: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    withheld_reasons: tuple[str, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    steps: Worked | None = None
    states: Mapping[str, str] = field(default_factory=dict)
    closing: Mapping[str, Value] = field(default_factory=dict)
    directions: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    found: tuple[str, ...] = ()
    limits: Mapping[str, str] = field(default_factory=dict)
    at_limit: Mapping[str, str] = field(default_factory=dict)
    needed: Mapping[str, Value] = field(default_factory=dict)
    others: tuple[OtherState, ...] = ()
    verdict: str = "one"
    searched: str = ""
    impact: ImpactFound | None = None
    sums: Mapping[str, Value] = field(default_factory=dict)
    labels: Mapping[str, str] = field(default_factory=dict)
    where: Mapping[str, Definition] = field(default_factory=dict)

    def __repr__(self) -> str:
        found = ", ".join(f"{name}: {value}" for name, value in self.accelerations.items())
        return f"<Solution of {self.name} with accelerations {found or 'of nothing'}>"

    @property
    def not_unique(self) -> list[str]:
        """The elements with a reaction for which other values would serve as well."""
        return [name for name, parts in self.reactions.items() if not all(x.unique for x in parts.values())]

    def as_json(self) -> dict[str, Any]:
        """Return the object that `solve --json` prints."""
        found = {} if self.impact is None else {"impact": self.impact.as_json()}
        return found | {
            "coordinates": dict(self.coordinates),
            "speeds": dict(self.speeds),
            "assembled": _json(self.assembled),
            "shifts": dict(self.shifts),
            "accelerations": _json(self.accelerations),
            "reactions": {name: _with_vectors(_json(components)) for name, components in self.reactions.items()},
            "sums": _json(self.sums),
            "states": dict(self.states),
            "closing": _json(self.closing),
            "directions": {name: list(direction) for name, direction in self.directions.items()},
            "verdict": self.verdict,
            "others": [other.as_json() for other in self.others],
            "searched": self.searched,
            "at_limit": dict(self.at_limit),
            "needed": _json(self.needed),
            "conditions": list(self.conditions),
            "limits": dict(self.limits),
            "answers": _json(self.answers),
            "where": {name: one.as_json() for name, one in self.where.items()},
            "not_unique": self.not_unique,
            "withheld": {name: list(components) for name, components in self.withheld.items()},
            "withheld_reasons": list(self.withheld_reasons),
            "notes": list(self.notes),
            "units": dict(self.units),
        }


def _json(values: Mapping[str, Value]) -> dict[str, Any]:
    return {name: value.as_json() for name, value in values.items()}


_VECTORS: Final = {"friction": ("friction_1", "friction_2"), "rolling": ("rolling_1", "rolling_2"), "at": AT}


def _with_vectors(components: dict[str, Any]) -> dict[str, Any]:
    """Return components with vectors as one object each, whose value and expression are lists."""
    found = dict(components)
    for name, parts in _VECTORS.items():
        if all(part in found for part in parts):
            each = [found.pop(part) for part in parts]
            lists = {key: [x[key] for x in each] for key in ("value", "expression")}
            found[name] = {**lists, "unit": each[0]["unit"]}
    return found
