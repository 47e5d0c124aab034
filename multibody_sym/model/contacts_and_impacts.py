"""Contacts of two bodies that may touch, with friction and restitution; impacts at the given instant."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, ClassVar, Final

from multibody_sym.errors import ModelError, at
from multibody_sym.model.fields import (
    Choice,
    Count,
    Direction,
    Element,
    Flag,
    ListOf,
    MapOf,
    Names,
    Point,
    Record,
    Scalar,
    Text,
    Vector,
    describe,
    fields_of,
    fields_tree,
    holds,
    is_text,
    scalar,
)
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node, as_node, constant_of
from multibody_sym.text.parser import parse_scalar
from multibody_sym.text.printer import text
from multibody_sym.text.units import Turning

ENOUGH: Final = "enough"
_NUMBER: Final = re.compile(r"#(\+\d{1,3})?")
Coefficient = Node | str
"""A coefficient of friction, or the word `enough`."""


@dataclass(frozen=True)
class CoefficientField:
    """A coefficient of friction: a number, an expression, or the word `enough`."""

    unit: str = ""

    def accept(self, value: Any) -> Coefficient:
        return ENOUGH if is_text(value, ENOUGH) else friction_coefficient(value)

    def tree(self, value: Coefficient) -> str:
        return value if isinstance(value, str) else text(value)


@dataclass(frozen=True)
class KineticField(Scalar):
    """A coefficient of friction of what slides, which is a number."""

    def accept(self, value: Any) -> Node:
        if is_text(value, ENOUGH):
            raise ModelError("what slides rubs with a coefficient; what never slips is static: enough, without kinetic")
        return friction_coefficient(value)


def friction_coefficient(value: Any) -> Node:
    """Return a coefficient of friction; raise ModelError for an angle of friction."""
    node = scalar(value, "")
    if isinstance(value, str) and isinstance(parse_scalar(value)[1], Turning):
        raise ModelError(
            f"{value} is an angle; a coefficient of friction is its tangent, tan({text(node)})", number="M105"
        )
    return node


@dataclass(frozen=True)
class Contact(Element):
    """Two bodies that may touch and then push each other, never pull; the first of `between` against the second.

    `between` names surfaces, `body.surface`, or bodies and points. A box stands for its corners; discs, cylinders and
    spheres stand for themselves, a rod for its ends and sides. Any other body stands for its point. In space corners
    touch faces. Edges of boxes touch only if they are named (`a.bottom_front`); they and sides of bars touch each other
    where they cross, and balls. Without coefficients of Coulomb's friction the contact is smooth. An impact returns a
    part of the speed along the surface as far as friction can. Friction is that on the first, positive along the
    tangent. Contacts that `repeat` between the same two bodies, such as a table's legs, have a sum, as corners do.
    """

    meant: ClassVar[Mapping[str, str]] = {"mu": "static", "friction": "static", "e": "restitution"}

    between: tuple[str, ...] = holds(
        ListOf(Text(), 2, 2), such="[block, wedge.face]",
        says="the two that touch: bodies, points or surfaces; forces and normal act on the first",
    )
    static: Coefficient | None = holds(
        CoefficientField(), None, keyword=True, such="0.4",
        says="coefficient of friction at rest, or enough: it never slips; the kinetic one if left out",
    )
    kinetic: Node | None = holds(
        KineticField(""), None, keyword=True, such="0.3",
        says="coefficient of friction while it slides; the static one if left out",
    )
    restitution: Node | None = holds(
        Scalar(""), None, keyword=True, such="0.5",
        says="which part of the normal speed an impact gives back, 0 to 1; 0 if left out",
    )
    tangential_restitution: Node | None = holds(
        Scalar(""), None, keyword=True, such="0.5",
        says="which part of the speed along the surface an impact gives back, 0 to 1 (a superball)",
    )
    rolling_resistance: Node | None = holds(
        Scalar("m"), None, keyword=True, says="lever arm of the resistance to rolling", such="1 mm"
    )
    tangent: Point | None = holds(
        Direction(), None, keyword=True, such="x",
        says="the direction in which friction counts as positive, in the axes of the body with the plane",
    )
    open: bool = holds(Flag(), False, keyword=True, says="whether it does not touch at the start", such="true")
    repeat: int | None = holds(
        Count(), None, keyword=True, such="49",
        says="so many contacts, with 1, 2, .. for # and the next ones for #+1, #+2 in the names",
    )

    def verify(self) -> None:
        verify_friction(static=self.static, kinetic=self.kinetic, rolling_resistance=self.rolling_resistance)
        _verify_restitutions(self)
        verify_coefficients(self.static, self.kinetic)
        if self.repeat is not None and not any("#" in end for end in self.between):
            message = "number the bodies of contacts that repeat, such as between: [block#, table.top]"
            raise ModelError(message, word="between").under("repeat")


def copies(contacts: Mapping[str, Contact]) -> Iterator[tuple[str, str, Contact]]:
    """Yield each contact, with `repeat` written out, as (declared name, own name, contact).

    `#` in ends is the number of the copy, `#+2` the number after the next. The number stands in the own name where the
    declared one has `#`, else at its end.
    """
    for declared, contact in contacts.items():
        if contact.repeat is None:
            yield declared, declared, contact
            continue
        pattern = declared if "#" in declared else f"{declared}#"
        for k in range(1, contact.repeat + 1):
            ends = tuple(_with_number(end, k) for end in contact.between)
            yield declared, _with_number(pattern, k), replace(contact, between=ends, repeat=None)


def _with_number(name: str, k: int) -> str:
    return _NUMBER.sub(lambda sign: str(k + int(sign[1] or 0)), name)


def contact_names(contacts: Mapping[str, Contact]) -> dict[str, None]:
    """Return the names of all contacts, of their copies, and of the copies together: `leg1`, .. and `leg`."""
    every = (x for declared, name, _ in copies(contacts) for x in (without_number(declared), declared, name))
    return dict.fromkeys(every)


def without_number(name: str) -> str:
    """Return the common name of repeated contacts: `leg` of `leg#`."""
    return _NUMBER.sub("", name)


def verify_friction(**coefficients: Coefficient | None) -> None:
    """Raise ModelError where a constant coefficient is negative; they are given by the names of their fields."""
    for name, value in coefficients.items():
        if value is not None and (constant_of(value) or 0.0) < 0.0:
            raise ModelError(
                f"{text(as_node(value))} is negative; nothing rubs less than not at all", number="M109"
            ).under(name)


def verify_coefficients(static: Coefficient | float | None, kinetic: Node | float | None) -> None:
    """Raise ModelError where static friction is below kinetic friction, as far as both are constants."""
    sticking, sliding = constant_of(static), constant_of(kinetic)
    if sticking is not None and sliding is not None and sticking < sliding:
        raise ModelError(
            f"static {sticking:g} is below kinetic {sliding:g}: what sticks is held at least as fast as what slides; "
            "swap them, or give one for both",
            number="M109",
        ).under("static")


def verify_restitution(name: str, value: Node | None) -> None:
    """Raise ModelError where a constant coefficient of restitution is not one of 0 to 1."""
    if value is not None and value.shadow is not None and not 0 <= value.shadow <= 1:
        raise ModelError(
            f"{text(value)} is no coefficient of restitution, which is between 0 and 1 (0: they stay together; 1: "
            "nothing is lost)",
            number="M109",
        ).under(name)


def _verify_restitutions(element: Contact | Impact) -> None:
    """Raise ModelError for a wrong coefficient of restitution, or a tangential one between smooth surfaces."""
    verify_restitution("restitution", element.restitution)
    verify_restitution("tangential_restitution", element.tangential_restitution)
    smooth = element.static is None and element.kinetic is None
    if element.between is not None and smooth and element.tangential_restitution is not None:
        raise ModelError(
            "what is smooth stores nothing to give back; give static or kinetic, or leave it out", number="M110"
        ).under("tangential_restitution")


def verify_not_negative(name: str, length: Node | None) -> None:
    """Raise ModelError where a constant length, that of the field `name`, is negative."""
    if length is not None and length.shadow is not None and length.shadow < 0.0:
        raise ModelError(f"{text(length)} is negative, and no distance is", number="M109").under(name)


def verify_rod_length(length: float | None) -> None:
    """Raise ModelError for a rod whose length (m) is known to be zero: it has no direction."""
    if length == 0:
        raise ModelError(
            "a rod of no length has no direction in which it pulls; points that stay together are joined by a joint "
            "(type: revolute, spherical; cut: true if it closes a loop), a point that stays on a line by "
            "type: point_on_line",
            number="M109",
        ).under("value")


# ----------------------------------------------------------------------------------------------------------------------
# Impacts at the given instant.


ONLY: Final = "impact"
"""The name of a single impact that stands under `impact:` without a name."""
LAWS: Final = ("newton", "poisson", "stronge")
SEQUENCES: Final = ("simultaneous", "one_by_one")
_KINDS: Final = ("between", "contacts", "impulse", "couple", "begins", "motion")
_FITTING: Final[Mapping[str, tuple[str, ...]]] = {
    "normal": ("between",),
    "restitution": ("between", "contacts"),
    "static": ("between",),
    "kinetic": ("between",),
    "tangential_restitution": ("between", "contacts"),
    "at": ("impulse",),
    "on": ("couple",),
    "frame": ("between", "impulse", "couple"),
    "speed": ("motion",),
}


@dataclass(frozen=True, kw_only=True)
class Impact(Element):
    """An impact at the given instant.

    It is one of these: two points meet (`between`), declared `contacts` close, an `impulse` or a `couple` acts, a joint
    or constraint `begins` to hold, a prescribed `motion` jumps.
    """

    between: tuple[str, ...] | None = holds(
        ListOf(Text(), 2, 2), None, such="[ball, rod.middle]",
        says="the two points that meet; the impulse acts on the first",
    )
    normal: Point | None = holds(
        Direction(), None, such="[0, 1, 0]",
        says="the direction of the impulse, from the second to the first; else along their relative velocity",
    )
    restitution: Node | None = holds(
        Scalar(""), None, says="which part of the normal speed it gives back, 0 to 1", such="1"
    )
    static: Coefficient | None = holds(
        CoefficientField(), None, such="0.4",
        says="coefficient of friction at rest, or enough: it does not slip; the kinetic one if left out",
    )
    kinetic: Node | None = holds(
        KineticField(""), None, says="coefficient of friction while it slips; the static one if left out", such="0.3"
    )
    tangential_restitution: Node | None = holds(
        Scalar(""), None, says="which part of the tangential speed it gives back, 0 to 1", such="0.5"
    )
    contacts: tuple[str, ...] | None = holds(
        ListOf(Text(), 1), None, says="declared contacts, stops and ropes that close", such="[c1, string]"
    )
    impulse: Point | None = holds(
        Vector("N*s"), None, says="components of a given impulse, along the axes of frame", such="[0, I, 0]"
    )
    at: str | None = holds(Text(), None, says="the point on which the given impulse acts", such="coin.edge")
    couple: Point | None = holds(
        Vector("N*m*s"), None, says="components of a given impulse couple, along the axes of frame", such="[0, 0, C]"
    )
    on: str | None = holds(Text(), None, says="the body on which the given couple acts", such="rod")
    begins: tuple[str, ...] | None = holds(
        ListOf(Text(), 1), None, such="[hook]",
        says="joints that are cut, or constraints, that did not hold before and do now",
    )
    motion: str | None = holds(
        Text(), None, says="the joint or constraint with a prescribed motion whose rate jumps", such="drive"
    )
    speed: Node | None = holds(Scalar(), None, says="by how much the rate of that motion jumps; m/s or rad/s", such="w")
    frame: str | None = holds(
        Text(), None, such="ground.slope",
        says="the body, or frame of one, along whose axes the components are; ground if left out",
    )

    def verify(self) -> None:
        given = [name for name in _KINDS if getattr(self, name) is not None]
        if len(given) != 1:
            got = f", not of {' and '.join(given)} together: name several impacts" if given else ""
            raise ModelError(f"an impact is one of {', '.join(_KINDS)}{got}", number="M110")
        for name, kinds in _FITTING.items():
            if getattr(self, name) is not None and given[0] not in kinds:
                raise ModelError(
                    f"{name} goes with {' or '.join(kinds)}, not with {given[0]}", number="M110"
                ).under(name)
        for kind, place in (("impulse", "at"), ("couple", "on"), ("motion", "speed")):
            if given[0] == kind and getattr(self, place) is None:
                raise ModelError(f"{place} is missing: where the {kind} is, or how much of it", number="M102")
        _verify_restitutions(self)
        verify_friction(static=self.static, kinetic=self.kinetic)
        verify_coefficients(self.static, self.kinetic)


@dataclass(frozen=True)
class Impacts(Element):
    """All that happens at the given instant: impacts by name, the `law` of restitution and the `sequence`."""

    strikes: Mapping[str, Impact] = holds(
        MapOf(Record(Impact)), such="{blow: {impulse: [0, I, 0], at: coin.edge}}",
        says="the impacts by name; in a file they stand under impact itself",
    )
    law: str | None = holds(
        Choice(LAWS), None, such="poisson",
        says="the law of restitution; if left out Newton's without friction, else Poisson's",
    )
    sequence: str | None = holds(
        Choice(SEQUENCES), None, says="whether all happen at once or one after the other", such="one_by_one"
    )

    def verify(self) -> None:
        jumping: dict[str, str] = {}
        for name, impact in self.strikes.items():
            if impact.motion is not None and impact.motion in jumping:
                raise ModelError(
                    f"the motion of {impact.motion} jumps in {jumping[impact.motion]} already, and two jumps of one "
                    "motion contradict each other: say by how much it jumps in all",
                    number="M110",
                ).under("motion").under(name)
            if impact.motion is not None:
                jumping[impact.motion] = name

    def written(self) -> Iterator[tuple[tuple[str, ...], Any, str | None]]:
        for name, impact in self.strikes.items():
            yield self.path(name)[1:], impact, None

    def path(self, name: str) -> tuple[str, ...]:
        return (ONLY,) if name == ONLY and len(self.strikes) == 1 else (ONLY, name)


_WHOLE: Final = ("law", "sequence")
_CLOSING: Final = "closing"


@dataclass(frozen=True)
class ImpactsField:
    """What stands under `impact:`: one impact, or a map of names to several; beside either a law and a sequence.

    Nothing but these, or the word `closing`: whatever is declared and closes at the start strikes.
    """

    def accept(self, value: Any) -> Impacts:
        if isinstance(value, Impacts):
            return value
        if isinstance(value, Impact):
            return Impacts(Names({ONLY: value}))
        if is_text(value, _CLOSING):
            return Impacts(Names())
        if not isinstance(value, Mapping):
            raise ModelError(f"expected an impact, or a map of impacts by name, got {describe(value)}", number="M103")
        whole = {name: x for name, x in value.items() if name in _WHOLE}
        own = {name: x for name, x in value.items() if name not in _WHOLE}
        fields = fields_of(Impact)
        if any(name in fields and not isinstance(x, (Mapping, Impact)) for name, x in own.items()):
            return Impacts(Names({ONLY: Record(Impact).accept(own)}), **whole)
        impacts: dict[str, Any] = {}
        for name, x in own.items():
            with at(name):
                impacts[name] = Record(Impact).accept(x)
        return Impacts(Names(impacts), **whole)

    def tree(self, value: Impacts) -> Any:
        whole = {name: getattr(value, name) for name in _WHOLE if getattr(value, name) is not None}
        trees = {name: fields_tree(impact) for name, impact in value.strikes.items()}
        return {**(trees[ONLY] if list(trees) == [ONLY] else trees), **whole} or _CLOSING
