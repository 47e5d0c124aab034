"""In which SI unit an expression is, as far as that is certain: what is printed beside a number must not be wrong.

A number in an expression may carry a unit that nobody wrote: in `5*x` the 5 may be a stiffness. Beside something that
was declared with a unit, as in `m*l^2/12`, small numbers are pure, as they are for `units.dimension_of`; beside motion
alone only 1, 2 and 1/2 are. A term that is certain tells the unit of its sum: `x - 5*t` is a length, as x is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fractions import Fraction
from typing import Final, NamedTuple

from multibody_sym.errors import InputError
from multibody_sym.expressions.tokens import tokens
from multibody_sym.expressions.units import DIMENSIONLESS, OF_ANGLES, Dimension, Exponent, Turning, is_pure, parse_unit
from multibody_sym.scalars.node import Node
from multibody_sym.scalars.traversal import postorder

_HALVES: Final = (1, 2, Fraction(1, 2))


class Kind(NamedTuple):
    """A dimension, the exponent of angles in it, and whether it is an energy (a moment has the same dimension).

    `angle` is None where it is not known: a stiffness in N*m may be one per radian, and 1/s an angular velocity.
    """

    dimension: Dimension
    angle: Exponent | None = 0
    energy: bool = False

    @property
    def unit(self) -> str:
        """The SI unit; empty for a pure number."""
        if self.energy:
            return "J"
        mass, length, _ = self.dimension
        if self.angle == 1 and mass == length == 0:
            return str(Turning(*self.dimension))
        return "" if self.dimension == DIMENSIONLESS else str(self.dimension)


PURE: Final = Kind(DIMENSIONLESS)
ANGLE: Final = Kind(DIMENSIONLESS, angle=1)


def kind_of(unit: str) -> Kind:
    """Return what a unit is one of; an angle stands first in it, and an energy alone. The empty text is no unit.

    Raises ExpressionError for what is no unit, InputError for an angle elsewhere.
    """
    if not unit:
        return PURE
    dimension = parse_unit(unit)[1]
    names = [token.text for token in tokens(unit) if token.kind == "name"]
    angles = sum(name in OF_ANGLES for name in names)
    if angles and (angles > 1 or names[0] not in OF_ANGLES or dimension.mass or dimension.length):
        raise InputError(
            f"{unit!r} is not a unit to read: an angle stands alone or before a time, as in deg or deg/s", number="U102"
        )
    return Kind(dimension, 1 if angles else 0, len(names) == 1 and names[0].endswith("J"))


class Known(NamedTuple):
    """The kind of an expression: `firm` where numbers that multiply it are pure, `doubtful` where one may not be."""

    kind: Kind
    firm: bool = False
    doubtful: bool = False

    @property
    def certain(self) -> bool:
        """Whether nothing in it can carry a unit that nobody wrote."""
        return self.firm or not self.doubtful

    def times(self, other: Known, exponent: int = 1) -> Known:
        """Return what a product or (exponent -1) quotient is."""
        a, b = self.kind.angle, other.kind.angle
        dimension = self.kind.dimension.times(other.kind.dimension, exponent)
        kind = Kind(dimension, None if a is None or b is None else a + exponent * b)
        return Known(kind, self.firm or other.firm, self.doubtful or other.doubtful)

    def raised(self, exponent: Fraction) -> Known:
        """Return what a power is."""
        angle = self.kind.angle
        dimension = DIMENSIONLESS.times(self.kind.dimension, exponent)
        return self._replace(kind=Kind(dimension, None if angle is None else exponent * angle))


def known(nodes: Iterable[Node], of_leaf: Callable[[Node], Known | None]) -> list[Known | None]:
    """Return what is known of each expression, given what is known of its leaves; None where it is not certain."""
    roots = list(nodes)
    found: dict[Node, Known | None] = {}
    for n in postorder(roots):
        if n.shadow is not None:
            found[n] = None  # whatever stands beside a constant asks what the constant is
        else:
            found[n] = _known(n, [found[a] for a in n.args]) if n.args else of_leaf(n)
    return [x if x is not None and x.certain else None for x in (found[n] for n in roots)]


Operands = list[Known | None]


def _known(n: Node, operands: Operands) -> Known | None:
    if n.op in ("neg", "abs"):
        return operands[0]
    if n.op in ("add", "min", "max", "where"):
        return _common(n.args[-2:], operands[-2:])
    if n.op == "table":  # the input that it is tells its unit
        return None
    if n.op in ("mul", "div"):
        return _product(n, operands)
    if n.op in ("pow", "sqrt"):
        return _power(n, operands)
    return Known(ANGLE if n.op in _ANGLES else PURE)


_ANGLES: Final = ("asin", "acos", "atan", "atan2")


def _product(n: Node, operands: Operands) -> Known | None:
    (left, right), (a, b) = n.args, operands
    if right.shadow is not None:
        return _multiplied(a, right)
    if left.shadow is not None:
        return _multiplied(b if b is None or n.op == "mul" else b.raised(Fraction(-1)), left)
    return None if a is None or b is None else a.times(b, -1 if n.op == "div" else 1)


def _multiplied(known: Known | None, constant: Node) -> Known | None:
    """Return what is known of the product with a constant."""
    if known is None or constant.op == "real" or not is_pure(constant):
        return None
    plain = constant.op == "number" and abs(constant.data) in _HALVES
    return known if plain else known._replace(doubtful=True)


def _power(n: Node, operands: Operands) -> Known | None:
    base = operands[0]
    exponent = Fraction(1, 2) if n.op == "sqrt" else n.args[1].data if n.args[1].op == "number" else None
    if base is None:
        return None
    if exponent is not None:
        return base.raised(Fraction(exponent))
    return base if base.kind == PURE else None


def _common(args: tuple[Node, ...], operands: Operands) -> Known | None:
    """Return what terms of a sum, or values to choose from, are: all of one kind, where the model makes sense."""
    varying = [known for a, known in zip(args, operands, strict=True) if a.shadow is None]
    if not varying or None in varying:
        return None
    certain = [known for known in varying if known is not None and known.certain]
    among = certain or [known for known in varying if known is not None]
    return among[0] if len(among) == 1 else _alike(*among)


def _alike(a: Known, b: Known) -> Known | None:
    """Return the kind of two terms that are both certain, or both doubtful; a pure number fits every dimension."""
    if a.kind.dimension != b.kind.dimension:
        fitting = [y for x, y in ((a, b), (b, a)) if x.kind == PURE]
        return fitting[0] if fitting and not a.doubtful and not b.doubtful else None
    angles = {a.kind.angle, b.kind.angle} - {None}
    angle = angles.pop() if len(angles) == 1 else 1 if angles == {0, 1} else None
    kind = Kind(a.kind.dimension, angle, a.kind.energy or b.kind.energy)
    return Known(kind, a.firm or b.firm, a.doubtful and b.doubtful)
