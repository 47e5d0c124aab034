"""What all friction in joints is made of: parts of the reaction that press, coefficients, words for wrong fields."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from multibody_sym.errors import ModelError
from multibody_sym.model.declaration.forces import Friction
from multibody_sym.model.declaration.joint import Joint
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.force_rows import ReactionRow
from multibody_sym.model.mechanism.markers import NOWHERE
from multibody_sym.model.mechanism.one_way import BOUNDLESS, FrictionPart
from multibody_sym.model.mechanism.rows import Row
from multibody_sym.model.resolution.cuts import normals_of
from multibody_sym.model.resolution.references import Freedom
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node
from multibody_sym.scalars.vectors import Vec, cross

NOWHERE_YET: Final = (NOWHERE, NOWHERE)
"""The frames of a reaction's parts before its joint gives them."""

Made = tuple[list[ReactionRow], list[FrictionPart]]
"""What presses in a joint, and what rubs."""

_KINDS: Final = (
    "friction is for joints with a reaction that presses and coordinates of their own: prismatic, revolute, "
    "cylindrical, screw, curve, planar, universal, spherical, custom without screws, point in a plane; {!r} is "
    "another, or prescribed"
)
_PARALLEL: Final = 1e-9
_UP: Final[Point] = (ZERO, ZERO, ONE)


def aligned(a: Vec, b: Vec) -> bool:
    """Return whether two unit vectors are parallel, as far as parameters' values tell."""
    shadows = [as_node(x).shadow for x in cross(a, b)]
    return all(x is not None and abs(x) < _PARALLEL for x in shadows)


@dataclass(frozen=True)
class Rubbing:
    """Friction that is declared in a joint: the name, what is declared, the joint's freedoms, whether all is `flat`."""

    name: str
    element: Friction
    joint: Joint
    freedoms: tuple[Freedom, ...]
    flat: bool

    @property
    def rates(self) -> list[Node]:
        """The speeds of the joint."""
        return [freedom.rate for freedom in self.freedoms]

    def across(self, axis: Point, *, flat: bool | None = None) -> tuple[Point, ...]:
        """Return unit vectors across an axis: one where nothing leaves the plane."""
        if (self.flat if flat is None else flat) and axis[2] is ZERO:
            x, y, z = cross(_UP, axis)
            return ((x, y, z),)
        return normals_of(axis)

    def reactions(self, shares: Sequence[tuple[Point, Point]], name: str = "") -> list[ReactionRow]:
        """Return rows of the reaction's parts along pairs of a force and a moment."""
        name = name or self.name
        names = [f"{name}.normal"] if len(shares) == 1 else [f"{name}.normal{k}" for k in range(1, len(shares) + 1)]
        pairs = zip(names, shares, strict=True)
        return [ReactionRow(row, self.element.joint, NOWHERE_YET, force, moment) for row, (force, moment) in pairs]

    def part(
        self, rows: tuple[Row, ...], normals: range, arm: Node = ONE, *, norm: bool = False, name: str = ""
    ) -> FrictionPart:
        """Return the friction of some normals at an arm; a coefficient that is left out is the other."""
        element = self.element
        enough = isinstance(element.static, str)
        static = BOUNDLESS if isinstance(element.static, str) else element.static
        kinetic = element.kinetic if element.kinetic is not None else static
        static = static if static is not None else kinetic
        assert static is not None
        assert kinetic is not None
        limits = arm * static, arm * kinetic
        smooth = None if element.regularised is None else element.regularised / arm
        return FrictionPart(name or self.name, rows, *limits, enough, tuple(normals), norm, regularised=smooth, arm=arm)

    def radius(self, advice: str) -> Node:
        """Return the radius. Raises ModelError with advice where none is given."""
        if self.element.radius is None:
            raise ModelError(advice, number="M114").under("radius")
        return self.element.radius

    def another(self) -> ModelError:
        """Return the error of a joint in which nothing says what rubs."""
        error = ModelError(_KINDS.format(self.element.joint), number="M114")
        error.under("joint")
        return error

    def without(self, field: str, advice: str) -> None:
        """Raise ModelError with advice where a field is given that says nothing here."""
        if getattr(self.element, field) is not None:
            raise ModelError(advice, number="M114").under(field)
