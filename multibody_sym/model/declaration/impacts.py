"""Impacts at the given instant: what strikes, which impulses are given, and by which law."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

from multibody_sym.errors import ModelError, at
from multibody_sym.expressions.printer import text
from multibody_sym.model.declaration.contacts import (
    Coefficient,
    CoefficientField,
    KineticField,
    verify_coefficients,
    verify_restitution,
)
from multibody_sym.model.declaration.fields import Element, ListOf, MapOf, Names, Record, fields_of, fields_tree, holds
from multibody_sym.model.declaration.values import Choice, Direction, Point, Scalar, Text, Vector, described, is_text
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node

ONLY: Final = "impact"
"""What the one impact is called that stands under `impact:` without a name."""
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
    """One thing that strikes or is struck at the given instant.

    `between` two points that meet: along `normal`, from the second to the first, in the axes of `frame` (a body,
    or a frame of one; ground if left out), with a `restitution` of 0 to 1 and friction `static`, `kinetic`; without a
    normal along their relative velocity. Or `contacts`: declared contacts, stops and ropes that close. Or a given
    `impulse` (N s) `at` a point, or a given `couple` (N m s) `on` a body, with components along the axes of `frame`. Or
    what `begins` to hold:
    joints that are `cut` or constraints that did not hold before. Or a prescribed `motion`, a joint or constraint whose
    rate jumps by `speed`. `tangential_restitution` (0 to 1) returns that part of the tangential speed.
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
        for name in ("restitution", "tangential_restitution"):
            verify_restitution(name, getattr(self, name))
        smooth = self.static is None and self.kinetic is None
        if self.between is not None and smooth and self.tangential_restitution is not None:
            raise ModelError(
                "what is smooth stores nothing to give back; give static or kinetic, or leave it out",
                number="M110",
            ).under("tangential_restitution")
        for name in ("static", "kinetic"):
            value = getattr(self, name)
            if isinstance(value, Node) and value.shadow is not None and value.shadow < 0:
                raise ModelError(
                    f"{text(value)} is negative; nothing rubs less than not at all", number="M109"
                ).under(name)
        if isinstance(self.static, Node) and self.kinetic is not None:
            verify_coefficients(self.static.shadow, self.kinetic.shadow)


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
        """Return where a file has an impact."""
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
            raise ModelError(f"expected an impact, or a map of impacts by name, got {described(value)}", number="M103")
        whole = {name: x for name, x in value.items() if name in _WHOLE}
        own = {name: x for name, x in value.items() if name not in _WHOLE}
        if own and not any(name in fields_of(Impact) and not _is_impact(x) for name, x in own.items()):
            return Impacts(Names(self._named(own)), **whole)
        return Impacts(Names({ONLY: Record(Impact).accept(own)} if own else {}), **whole)

    def _named(self, own: Mapping[str, Any]) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for name, x in own.items():
            with at(name):
                found[name] = Record(Impact).accept(x)
        return found

    def tree(self, value: Impacts) -> Any:
        whole = {name: getattr(value, name) for name in _WHOLE if getattr(value, name) is not None}
        trees = {name: fields_tree(impact) for name, impact in value.strikes.items()}
        return {**(trees[ONLY] if list(trees) == [ONLY] else trees), **whole} or _CLOSING


def _is_impact(value: Any) -> bool:
    return isinstance(value, (Mapping, Impact))
