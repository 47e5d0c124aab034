"""Solution: what `solve` finds at the given instant, in numbers and in closed form."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field, fields, replace
from typing import Any, Final, Literal

from multibody_sym.derivation.notation import Notation
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node
from multibody_sym.text.printer import AT, text
from multibody_sym.text.values import SI, Quantity, Units, Value, with_formula

# ----------------------------------------------------------------------------------------------------------------------
# Worked: a solution step by step, as data to be written out.


Words = tuple[Any, ...]
"""A sentence: texts, and expressions (sympy) and quantities that stand in it."""


@dataclass(frozen=True)
class Sentence:
    """A line of words, with expressions between them."""

    words: Words


@dataclass(frozen=True)
class Formula:
    """A line of mathematics: `sides` (sympy) joined by `relation`; `before` and `after` are words around it.

    `tag` is the number by which other lines name it. `value` is what it comes to. Where it is
    `assumed`, its first side has this value under an assumption that is rejected.
    """

    sides: tuple[Any, ...]
    relation: str = "="
    tag: int | None = None
    before: Words = ()
    value: Quantity | None = None
    assumed: bool = False
    after: Words = ()


Line = Sentence | Formula


def formulas_in(lines: Iterable[Line]) -> list[Formula]:
    """Return those of lines that are mathematics."""
    return [line for line in lines if isinstance(line, Formula)]


@dataclass(frozen=True)
class WorkedStep:
    """One step: its title and its lines; `is_later`: about a later time, at which symbols have other values."""

    title: str
    lines: tuple[Line, ...]
    is_later: bool = False


@dataclass(frozen=True)
class Worked:
    """A solution as a book writes it: `steps` in order, and the `notation` of its symbols.

    `values` are the numbers (SI) of all symbols that stand in it: parameters, accelerations, forces.
    """

    name: str
    steps: tuple[WorkedStep, ...]
    notation: Notation
    values: Mapping[Any, float] = field(default_factory=dict)

    def followed_by(self, later: Worked) -> Worked:
        """Return the steps with those of the motion that follows, less what is given there."""
        steps = (replace(step, is_later=True) for step in later.steps if step.title not in ("Given", "State"))
        return replace(self, steps=(*self.steps, *steps), notation=self.notation.joined(later.notation))

    @property
    def formulas(self) -> tuple[Formula, ...]:
        """All lines of mathematics about the start."""
        steps = (step for step in self.steps if not step.is_later)
        return tuple(line for step in steps for line in formulas_in(step.lines))


# ----------------------------------------------------------------------------------------------------------------------
# What a letter in a formula stands for.


@dataclass(frozen=True)
class Definition:
    """A letter that formulas name: its `value` (SI), and what gives it.

    That is an `expression` in parameters and other letters, or an `equation` (left side, right side) that it satisfies,
    with others where they follow from several together. Neither is there for what is told among accelerations as a
    number. `says`: what it is, in words.
    """

    value: float
    expression: Node | None = None
    equation: tuple[Node, Node] | None = None
    unit: str = ""
    says: str = ""

    @property
    def formula(self) -> str:
        """The expression or equation as text; empty where there is neither."""
        if self.expression is not None:
            return text(self.expression)
        return "" if self.equation is None else " = ".join(map(text, self.equation))

    def told(self, units: Units = SI) -> str:
        """Return what follows the letter, for people: `= formula = number unit`, or where an equation gives it."""
        number = units.said(self.value, self.unit)
        if self.equation is not None and self.expression is None:
            return f"= {number}, from {self.formula}"
        return f"= {with_formula(self.formula, number)}"

    def as_json(self) -> dict[str, Any]:
        """Return the object that `--json` prints."""
        equation = None if self.expression is not None or self.equation is None else self.formula
        expression = None if self.expression is None else self.formula
        found = {"value": self.value, "expression": expression, "equation": equation, "unit": self.unit}
        return {**found, "says": self.says}


# ----------------------------------------------------------------------------------------------------------------------
# ImpactFound: what an impact does, in numbers and in closed form.


@dataclass(frozen=True)
class ImpactStep:
    """One of several impacts that follow each other: what is `struck`, and the normal impulse (N s) of each."""

    struck: tuple[str, ...]
    impulses: Mapping[str, float]

    def as_json(self) -> dict[str, Any]:
        """Return the object that `solve --json` prints."""
        return {"struck": list(self.struck), "impulses": dict(self.impulses)}


_OF_IMPACT: Final = (
    "law", "sequence", "impulses", "jumps", "after", "joint_impulses", "apparent_mass", "closing", "opening",
    "energy_lost", "energy_given", "needed", "lost_by", "kinetic_energy", "instantaneous_centres",
    "centre_of_percussion", "conditions", "limits", "not_unique", "notes", "steps",
)
"""The members of an impact's object in `solve --json`."""


@dataclass(frozen=True)
class ImpactFound:
    """What an impact at the given instant does.

    `law` and `sequence` by which it was found. `impulses`: of each contact, rope or stop that strikes `normal`, and
    where it rubs `friction` (in space `friction_1`, `friction_2`), of constraints that begin or hold `impulse`; their
    `states` afterwards in a word: `bounces`, `stays`, with friction `sticks`, `slides+`, `slides-`, `slides`.
    `jumps` of the speeds, and the speeds `after`, by name. `joint_impulses`: of each joint fx .. mz (N s, N m s) on the
    child, about the joint's point, axes of its frame on the parent. `apparent_mass` of each contact along its normal,
    its speed of `closing` before and of `opening` after. `energy_lost` and by which contact (`lost_by`);
    `energy_given` by given impulses and prescribed motion (None where nothing gives any): `kinetic_energy` after is
    that before, and what is given, without what is lost. `needed`: of what is rough enough the least coefficients, the
    impulse of friction over the normal one. `instantaneous_centres` of bodies in a plane, or a `direction` where they
    do not turn; `centres_of_percussion` of bodies about the hinge that carries them. `conditions` under which the
    formulas hold, `limits` what happens where one fails; `notes`: what was decided, left out, and why. `steps`: the
    impacts that follow each other, each with what is struck and its normal impulses (N s).
    """

    law: str
    sequence: str
    impulses: Mapping[str, Mapping[str, Value]]
    states: Mapping[str, str]
    jumps: Mapping[str, Value]
    after: Mapping[str, Value]
    joint_impulses: Mapping[str, Mapping[str, Value]]
    apparent_mass: Mapping[str, Value]
    closing: Mapping[str, Value]
    opening: Mapping[str, Value]
    energy_lost: Value
    lost_by: Mapping[str, Value]
    kinetic_energy: Mapping[str, Value]
    instantaneous_centres: Mapping[str, Mapping[str, tuple[float, float]]] = field(default_factory=dict)
    centres_of_percussion: Mapping[str, Value] = field(default_factory=dict)
    conditions: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    limits: Mapping[str, str] = field(default_factory=dict)
    steps: tuple[ImpactStep, ...] = ()
    energy_given: Value | None = None
    needed: Mapping[str, Value] = field(default_factory=dict)

    @property
    def values(self) -> list[Value]:
        every = (getattr(self, f.name) for f in fields(self))
        return [value for part in every for value in _values(part)]

    def with_values(self, values: Iterable[Value]) -> ImpactFound:
        """Return the same with other `values`, in their order."""
        new = iter(values)
        return replace(self, **{f.name: _with_values(getattr(self, f.name), new) for f in fields(self)})

    @property
    def not_unique(self) -> list[str]:
        """The elements and joints with an impulse for which other values would serve as well."""
        both = {**self.impulses, **self.joint_impulses}
        return [name for name, parts in both.items() if not all(x.unique for x in parts.values())]

    def as_json(self) -> dict[str, Any]:
        """Return the object that `solve --json` prints under `impact`."""
        impulses: dict[str, dict[str, Any]] = {}
        for name, parts in self.impulses.items():
            own = impulses[name] = {**_json(parts), "state": self.states.get(name, "")}
            if "friction_1" in own:  # that of a contact in space as a list of two
                own["friction"] = [own.pop("friction_1"), own.pop("friction_2")]
        centres = self.instantaneous_centres.items()
        plain = {"impulses": impulses, "centre_of_percussion": _json(self.centres_of_percussion)}
        plain["instantaneous_centres"] = {
            name: list(x["centre"]) if "centre" in x else {"direction": list(x["direction"])} for name, x in centres
        }
        return {name: plain[name] if name in plain else _json(getattr(self, name)) for name in _OF_IMPACT}


def _values(part: Any) -> Iterator[Value]:
    if isinstance(part, Value):
        yield part
    elif isinstance(part, Mapping):
        for each in part.values():
            yield from _values(each)


def _with_values(part: Any, new: Iterator[Value]) -> Any:
    if isinstance(part, Value):
        return next(new)
    return {name: _with_values(x, new) for name, x in part.items()} if isinstance(part, Mapping) else part


# ----------------------------------------------------------------------------------------------------------------------

RowKind = Literal["rope", "rod", "force", "multiplier", "contact", "stop", "friction"]
"""What a constraint's multiplier is: a tension of a rope or rod, a force (or moment), or that of an expression.

Contacts, stops and friction in joints have forces of several names.
"""


@dataclass(frozen=True)
class OtherState:
    """A state that fulfils all laws too: the word of each element, and the accelerations (SI), known to `errors`."""

    states: Mapping[str, str]
    accelerations: Mapping[str, float]
    errors: Mapping[str, float] = field(default_factory=dict)

    def as_json(self) -> dict[str, Any]:
        """Return the object that `--json` prints."""
        return {"states": dict(self.states), "accelerations": dict(self.accelerations)}


_OF_SOLUTION: Final = (
    "coordinates", "speeds", "assembled", "shifts", "at_rest", "accelerations", "rates", "reactions", "sums", "states",
    "closing", "directions", "verdict", "others", "searched", "at_limit", "needed", "conditions", "limits", "answers",
    "where", "not_unique", "withheld", "withheld_reasons", "notes", "units",
)
"""The members of a solution's object in `solve --json`."""


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
    the reasons. `rates` of declared states. `units`: the unit of each coordinate and speed. `steps`: how a book gets
    there, where asked for. `angles`: how texts have them, as in `Units`. It is `at_rest` where constraints leave no
    freedom, as those of a structure do.

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
    `stages`: the solutions of the second stage and later ones; `answers` belong to all stages.
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
    rates: Mapping[str, Value] = field(default_factory=dict)
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
    at_rest: bool = False
    angles: str = ""
    stages: tuple[StageFound, ...] = ()

    def __repr__(self) -> str:
        values = self.accelerations if self.impact is None else self.impact.after
        found = ", ".join(f"{name}: {value}" for name, value in values.items())
        what = "accelerations" if self.impact is None else "speeds afterwards"
        told = f"with {what} {found}" if found else "without degrees of freedom"
        return f"<Solution of {self.name} {told}>"

    @property
    def not_unique(self) -> list[str]:
        """The elements with a reaction for which other values would serve as well."""
        return [name for name, parts in self.reactions.items() if not all(x.unique for x in parts.values())]

    def as_json(self) -> dict[str, Any]:
        """Return the object that `solve --json` prints."""
        found: dict[str, Any] = {} if self.impact is None else {"impact": self.impact.as_json()}
        found |= {"stages": _json(self.stages)} if self.stages else {}
        found |= {name: _json(getattr(self, name)) for name in _OF_SOLUTION}
        found["reactions"] = {name: _with_vectors(components) for name, components in found["reactions"].items()}
        return found


@dataclass(frozen=True)
class StageFound:
    """A stage after the first: when it `begins`, and with what, in words; `t`: the time.

    `start`: the coordinates and speeds that it takes over from the stage before, after that its `solution`, without
    answers: an impact or the instant just after it begins. A stage that is never reached has none of these.
    """

    number: int
    begins: str
    t: Value = field(default_factory=lambda: Value(None, unit="s"))
    start: Mapping[str, Value] = field(default_factory=dict)
    solution: Solution | None = None

    def as_json(self) -> dict[str, Any]:
        """Return the object that `solve --json` prints."""
        found = {"stage": self.number, "begins": self.begins, "t": _json(self.t), "start": _json(self.start)}
        solved = {} if self.solution is None else self.solution.as_json()
        return {**found, **{key: x for key, x in solved.items() if key != "answers"}}


def _json(part: Any) -> Any:
    """Return what `--json` prints of a part of a record."""
    if isinstance(part, Mapping):
        return {name: _json(x) for name, x in part.items()}
    if isinstance(part, tuple | list):
        return [_json(x) for x in part]
    return part.as_json() if hasattr(part, "as_json") else part


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
