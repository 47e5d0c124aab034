"""ImpactFound: what an impact does, in numbers and in closed form."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field, fields, replace
from typing import Any

from multibody_sym.expressions.values import Value
from multibody_sym.records import dataclass


@dataclass(frozen=True)
class ImpactStep:
    """One of several impacts that follow each other: what is `struck`, and the normal impulse (N s) of each."""

    struck: tuple[str, ...]
    impulses: Mapping[str, float]


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
        """All values, in one order."""
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
        impulses = {name: {**_told(parts), "state": self.states.get(name, "")} for name, parts in self.impulses.items()}
        return {
            "law": self.law,
            "sequence": self.sequence,
            "impulses": {name: _with_pairs(parts) for name, parts in impulses.items()},
            "jumps": _told(self.jumps),
            "after": _told(self.after),
            "joint_impulses": {name: _told(parts) for name, parts in self.joint_impulses.items()},
            "apparent_mass": _told(self.apparent_mass),
            "closing": _told(self.closing),
            "opening": _told(self.opening),
            "energy_lost": self.energy_lost.as_json(),
            "energy_given": None if self.energy_given is None else self.energy_given.as_json(),
            "needed": _told(self.needed),
            "lost_by": _told(self.lost_by),
            "kinetic_energy": _told(self.kinetic_energy),
            "instantaneous_centres": {
                name: list(x["centre"]) if "centre" in x else {"direction": list(x["direction"])}
                for name, x in self.instantaneous_centres.items()
            },
            "centre_of_percussion": _told(self.centres_of_percussion),
            "conditions": list(self.conditions),
            "limits": dict(self.limits),
            "not_unique": self.not_unique,
            "notes": list(self.notes),
            "steps": [{"struck": list(step.struck), "impulses": dict(step.impulses)} for step in self.steps],
        }


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


def _told(values: Mapping[str, Value]) -> dict[str, Any]:
    return {name: value.as_json() for name, value in values.items()}


def _with_pairs(parts: dict[str, Any]) -> dict[str, Any]:
    """Return the impulses of a contact with friction in space as a list of two."""
    if "friction_1" not in parts:
        return parts
    pair = [parts.pop("friction_1"), parts.pop("friction_2")]
    return {**parts, "friction": pair}
