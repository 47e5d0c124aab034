"""Units of measurement: their factors to SI, the dimensions of expressions, and the units that are certain for them."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from fractions import Fraction
from typing import Final, NamedTuple

from multibody_sym.errors import ExpressionError, InputError, gathered, nearest
from multibody_sym.scalars.elementary import postorder
from multibody_sym.scalars.node import ONE, PI, Node, as_node
from multibody_sym.text.printer import power_text
from multibody_sym.text.printer import text as printed
from multibody_sym.text.tokens import Token, exact_number, failure, tokens

Exponent = int | Fraction
_LARGEST_UNIT_EXPONENT: Final = 20
_SHOWN: Final = 40
_PURE_ABOVE, _PURE_BELOW = 10, 100  # 2, 1/12 and 3/10 are pure numbers; 10, 9.81 and 0.033 may be measured ones


class Dimension(NamedTuple):
    """The exponents of mass, length and time; angles have none. Prints as a unit that `parse_unit` reads."""

    mass: Exponent = 0
    length: Exponent = 0
    time: Exponent = 0

    def times(self, other: Dimension, exponent: Exponent = 1) -> Dimension:
        """Return the dimension of a * b^exponent."""
        return Dimension(*(a + exponent * b for a, b in zip(self, other, strict=True)))

    def __str__(self) -> str:
        return _NAMED.get(self) or self.in_base()

    def in_base(self) -> str:
        """Return the unit made of kg, m and s."""
        above = [power_text(unit, e) for unit, e in zip(_BASE, self, strict=True) if e > 0]
        below = [power_text(unit, -e) for unit, e in zip(_BASE, self, strict=True) if e < 0]
        return "/".join(["*".join(above) or "1", *below])


class InBase(Dimension):
    """A dimension written with units of mass, length and time alone: kg/s of a mass flow prints as kg/s."""

    __slots__ = ()

    def __str__(self) -> str:
        return self.in_base()


class Turning(Dimension):
    """The dimension of an angle, or of one per power of time, written with its unit: rad/s, not 1/s."""

    __slots__ = ()

    def __str__(self) -> str:
        below = Dimension(time=self.time).in_base().removeprefix("1")
        return f"rad*{below}" if self.time > 0 else f"rad{below}"


_BASE: Final = ("kg", "m", "s")
DIMENSIONLESS: Final = Dimension()
FORCE, ENERGY = Dimension(1, 1, -2), Dimension(1, 2, -2)
LENGTH, TIME, MASS = Dimension(0, 1, 0), Dimension(0, 0, 1), Dimension(1, 0, 0)
_NAMED: Final = {
    FORCE: "N", ENERGY: "N*m", Dimension(1, 0, -2): "N/m", Dimension(1, 0, -1): "N*s/m",
    Dimension(1, 2, -3): "W", Dimension(1, -1, -2): "Pa",
}



def rate_unit(unit: str) -> str:
    """Return the unit of the rate of a quantity in a unit, empty if that is: Pa/s of a pressure, m/s^2 of a speed."""
    if not unit:
        return ""
    if "/" not in unit:
        return f"{unit}/s"
    dimension = parse_unit(unit)[1]
    return str((Turning if isinstance(dimension, Turning) else Dimension)(*dimension.times(TIME, -1)))


_DEGREE: Final = PI / 180
_UNITS: Final[dict[str, tuple[Node, Dimension, str]]] = {
    # name: factor to SI, dimension, prefixes that people use with it
    "m": (ONE, LENGTH, "k d c m u n"),
    "g": (as_node(Fraction(1, 1000)), MASS, "k m u"),
    "s": (ONE, TIME, "m u n"),
    "N": (ONE, FORCE, "k M G m u"),
    "Nm": (ONE, ENERGY, "k M m"),
    "J": (ONE, ENERGY, "k M m"),
    "W": (ONE, Dimension(1, 2, -3), "k M m"),
    "Pa": (ONE, Dimension(1, -1, -2), "k M G h"),
    "Hz": (ONE, Dimension(0, 0, -1), "k M"),
    "rad": (ONE, DIMENSIONLESS, "m u"),
    "deg": (_DEGREE, DIMENSIONLESS, ""),
    "turn": (2 * PI, DIMENSIONLESS, ""),
    "rev": (2 * PI, DIMENSIONLESS, ""),
    "rpm": (PI / 30, Dimension(0, 0, -1), ""),
    "min": (as_node(60), TIME, ""),
    "h": (as_node(3600), TIME, ""),
    "bar": (as_node(100_000), Dimension(1, -1, -2), "m"),
    "in": (as_node(Fraction("0.0254")), LENGTH, ""),
    "inch": (as_node(Fraction("0.0254")), LENGTH, ""),
    "ft": (as_node(Fraction("0.3048")), LENGTH, ""),
    "lb": (as_node(Fraction("0.45359237")), MASS, ""),
    "lbf": (as_node(Fraction("0.45359237") * Fraction("9.80665")), FORCE, ""),
    "kgf": (as_node(Fraction("9.80665")), FORCE, ""),
}
_PREFIXES: Final = {"G": 9, "M": 6, "k": 3, "h": 2, "d": -1, "c": -2, "m": -3, "u": -6, "n": -9}


def _with_prefixes() -> dict[str, tuple[Node, Dimension]]:
    table = {name: (factor, dimension) for name, (factor, dimension, _) in _UNITS.items()}
    for name, (factor, dimension, prefixes) in _UNITS.items():
        for prefix in prefixes.split():
            table.setdefault(prefix + name, (as_node(Fraction(10) ** _PREFIXES[prefix]) * factor, dimension))
    return table


UNITS: Final = _with_prefixes()
"""Every unit by its symbol: (factor to SI, dimension)."""
OF_ANGLES: Final = frozenset({"rpm", *(name for name, (_, dimension) in UNITS.items() if dimension == DIMENSIONLESS)})
"""The units of angles, and of an angle in a time."""

_WORDS: Final = {
    "metre": "m", "meter": "m", "second": "s", "sec": "s", "gram": "g", "kilogram": "kg", "kilo": "kg", "newton": "N",
    "joule": "J", "watt": "W", "pascal": "Pa", "radian": "rad", "degree": "deg", "grad": "deg", "minute": "min",
    "hour": "h", "pound": "lb", "foot": "ft", "newtonmeter": "N*m", "gm": "g", "mtr": "m", "hertz": "Hz",
}


_POWER_WITHOUT_SIGN: Final = re.compile(r"([A-Za-z]+)([2-4])")
_OTHERS: Final = ("C", "A", "V", "F", "T", "K", "H", "Wb", "mol", "cd", "lm", "Ohm")
_ELSEWHERE: Final = frozenset(prefix + unit for unit in _OTHERS for prefix in ("", "m", "u", "n"))
"""Units of electricity, heat and light."""


# --- reading ----------------------------------------------------------------------------------------------------


def parse_unit(text: str) -> tuple[Node, Dimension]:
    """Return (factor to SI, dimension) of a unit such as `kg*m/s^2`, `N m`, `1/s` or `N/(m*s)`.

    The dimension prints with the names of the unit: `g/s` as kg/s, `N*s/m` as N*s/m.
    Raises ExpressionError with the column of a word that is no unit.
    """
    return read_unit(text, tokens(text))


def read_unit(text: str, rest: list[Token]) -> tuple[Node, Dimension]:
    """Return (factor, dimension) of the unit that the tokens `rest` of `text` (to its end) spell."""
    try:
        return _Unit(text, rest).whole()
    except ExpressionError as error:
        if error.where.column is None:
            raise failure(text, rest[0].column, "the factor of this unit is out of range", "E103") from None
        raise


class _Unit:
    """The reader of one unit: products and quotients of powers, one level of parentheses."""

    def __init__(self, text: str, rest: list[Token]) -> None:
        self.text, self.rest, self.place = text, rest, 0

    def whole(self) -> tuple[Node, Dimension]:
        result = self.product(inside=False)
        token = self.rest[self.place]
        if token.kind != "end":
            raise self.not_a_unit(token)
        if self.of_angle(result[1]):
            return result[0], Turning(*result[1])
        named = [UNITS[token.text][1] for token in self.rest if token.kind == "name"]
        return (result[0], InBase(*result[1])) if all(sum(map(bool, x)) < 2 for x in named) else result

    def of_angle(self, dimension: Dimension) -> bool:
        """Return whether the unit is an angle, alone or before a time, as deg/s and rpm."""
        first, then = self.rest[:2]
        angles = [token for token in self.rest if token.kind == "name" and token.text in OF_ANGLES]
        alone = angles == [first] and then.kind not in ("^", "**")
        return alone and not dimension.mass and not dimension.length

    def product(self, inside: bool) -> tuple[Node, Dimension]:
        if self.rest[self.place].text == "1":
            self.place += 1
            factor, dimension = ONE, DIMENSIONLESS
        else:
            factor, dimension = self.power(inside)
        divided = False
        while (kind := self.rest[self.place].kind) in ("*", "/", "name"):
            if kind == "name" and divided:
                message = "write a unit with several parts below the line with parentheses: N/(m*s)"
                raise failure(self.text, self.rest[self.place].column, message, "E103")
            self.place += kind != "name"
            divided = kind == "/"
            other, its_dimension = self.power(inside)
            factor = factor / other if divided else factor * other
            dimension = dimension.times(its_dimension, -1 if divided else 1)
        return factor, dimension

    def power(self, inside: bool) -> tuple[Node, Dimension]:
        factor, dimension = self.base(inside)
        token = self.rest[self.place]
        if token.kind not in ("^", "**"):
            return factor, dimension
        self.place += 1
        exponent = self.exponent()
        if abs(exponent) > _LARGEST_UNIT_EXPONENT:
            message = f"the exponent of a unit is at most {_LARGEST_UNIT_EXPONENT}"
            raise failure(self.text, token.column, message, "E103")
        return factor**exponent, DIMENSIONLESS.times(dimension, exponent)

    def base(self, inside: bool) -> tuple[Node, Dimension]:
        token = self.rest[self.place]
        self.place += 1
        if token.kind == "name" and token.text in UNITS:
            return UNITS[token.text]
        if token.kind != "(" or inside:
            raise self.not_a_unit(token)
        result = self.product(inside=True)
        closing = self.rest[self.place]
        if closing.kind != ")":
            raise failure(self.text, token.column, "this parenthesis of the unit is never closed", "E103")
        self.place += 1
        return result

    def exponent(self) -> Fraction:
        token = self.rest[self.place]
        self.place += 1
        if token.kind in ("-", "+"):
            return (-1 if token.kind == "-" else 1) * self.plain_number()
        if token.kind != "(":
            self.place -= 1
            return self.plain_number()
        result = self.exponent_quotient()
        if self.rest[self.place].kind != ")":
            raise failure(self.text, token.column, "this parenthesis of the unit is never closed", "E103")
        self.place += 1
        return result

    def exponent_quotient(self) -> Fraction:
        sign = -1 if self.rest[self.place].kind == "-" else 1
        self.place += sign < 0
        above = sign * self.plain_number()
        if self.rest[self.place].kind != "/":
            return above
        self.place += 1
        token, below = self.rest[self.place], self.plain_number()
        if below == 0:
            raise failure(self.text, token.column, "division by zero", "E105")
        return above / below

    def plain_number(self) -> Fraction:
        token = self.rest[self.place]
        if token.kind != "number":
            raise failure(self.text, token.column, "the exponent of a unit is a number", "E103")
        self.place += 1
        return exact_number(self.text, token)

    def not_a_unit(self, token: Token) -> ExpressionError:
        guess = None
        if token.kind == "end":
            message = "the unit is not complete"
        elif token.kind != "name":
            message = (
                f"'{token.text}' has no place in a unit: a value is one number with a unit, or an expression "
                "without units (give the number with the unit a name under parameters)"
            )
        elif token.text in _ELSEWHERE:
            message = (
                f"'{token.text}' is not a unit here, where units are made of mass, length, time and angles; write the "
                "number without it, in SI units"
            )
        else:
            power = _POWER_WITHOUT_SIGN.fullmatch(token.text)
            word, raised = (power[1], f"^{power[2]}") if power else (token.text, "")
            # a product such as `Ns`, `kgm` or `Pas`; `kgs` is a plural, and none, nor is `kgg`
            splits = [(word[:k], word[k:]) for k in range(1, len(word))]
            units = [pair for pair in splits if all(unit in UNITS for unit in pair)]
            products = [(a, b) for a, b in units if UNITS[a][1].mass and UNITS[a][1] != UNITS[b][1]]
            plain = [(first, second) for first, second in products if second != "s" or not first.islower()]
            split = "*".join(next((pair for pair in plain if pair[1] == "s"), plain[0])) if plain else None
            if power and word in UNITS:
                guess = f"{word}{raised}"
            elif self.rest[self.place].kind != "(":  # with one it is a call
                guess = _WORDS.get(token.text.lower().removesuffix("s"))
                if guess is None and split is not None:
                    divided = self.rest[self.place - 2 : self.place - 1]
                    guess = f"({split}{raised})" if divided and divided[0].kind == "/" else f"{split}{raised}"
                guess = guess or nearest(token.text, UNITS, cutoff=0.75)
            message = f"'{token.text}' is not a unit" + (f"; did you mean {guess}?" if guess else "")
        return failure(self.text, token.column, message, "E103", token.text, guess)


# --- dimensions of expressions ----------------------------------------------------------------------------------


class Measured(NamedTuple):
    """The dimension of an expression, as far as it is known, and whether a number in it may carry an unwritten unit.

    `firm`: the dimension comes from a unit that the model gives, beside which small numbers are pure. `numbered`: a
    number multiplies it, which beside motion alone may be a stiffness: the 5 of `5*x`.
    """

    dimension: Dimension
    firm: bool = False
    numbered: bool = False

    @property
    def certain(self) -> bool:
        """Whether no number in it can carry an unwritten unit."""
        return self.firm or not self.numbered

    def times(self, other: Measured, exponent: Exponent = 1) -> Measured:
        """Return the dimension of a * b^exponent; a ratio of two lengths is no firmer than a number."""
        dimension = self.dimension.times(other.dimension, exponent)
        firm = (self.firm or other.firm) and dimension != DIMENSIONLESS
        return Measured(dimension, firm, self.numbered or other.numbered)


NUMBER: Final = Measured(DIMENSIONLESS, numbered=True)
"""A pure number, which fits every dimension."""


def given_in(dimension: Dimension | None) -> Measured | None:
    """Return the dimension of a number that the model gives in a unit; None for a number without one."""
    return None if dimension is None else Measured(dimension, firm=dimension != DIMENSIONLESS)


def infer_dimension(node: Node, known: Callable[[Node], Measured | None]) -> Measured | None:
    """Return the dimension of `node`, given those of its symbols and quantities; None where it is unknown.

    A pure number fits every dimension: in a sum it fits the other side, and one known part gives the dimension of a
    sum. A factor that is no quotient of small integers (9.81) may carry a unit, and so may any beside motion alone.
    Raises ExpressionError where dimensions contradict each other, with all such places; a result of one is unknown.
    """
    dimensions: dict[Node, Measured | None] = {}
    wrong = gathered()
    for n in postorder([node]):
        if n.shadow is not None:
            dimensions[n] = NUMBER if is_pure(n) else None
        elif not n.args:
            dimensions[n] = known(n)
        else:
            dimensions[n] = None
            with wrong:
                dimensions[n] = _measure_operation(n, [dimensions[a] for a in n.args])
    wrong.told()
    return dimensions[node]


Operands = list[Measured | None]


def is_pure(n: Node) -> bool:
    """Return whether a constant is a pure number; `9.81` in `9.81*m` carries an unwritten unit."""
    if n.op == "number":
        return bool(abs(n.data.numerator) < _PURE_ABOVE and n.data.denominator <= _PURE_BELOW)
    return True


def _measure_operation(n: Node, operands: Operands) -> Measured | None:
    if n.op in ("neg", "abs"):
        return operands[0]
    if n.op in ("add", "min", "max", "where"):
        return _common(n, operands)
    if n.op == "table":  # its input has the unit
        return None
    if n.op in ("mul", "div"):
        a, b = operands
        return None if a is None or b is None else a.times(b, -1 if n.op == "div" else 1)
    if n.op in ("pow", "sqrt"):
        base, exponent = operands[0], n.args[-1]
        if n.op == "pow" and exponent.op != "number":
            _require_pure(exponent, operands[1], "an exponent")
            return NUMBER if base is not None and base.dimension == DIMENSIONLESS else None
        power = Fraction(1, 2) if n.op == "sqrt" else Fraction(exponent.data)
        return None if base is None else base._replace(dimension=DIMENSIONLESS.times(base.dimension, power))
    if n.op in ("less", "less_equal", "atan2"):
        _common(n, operands)
    elif n.op != "sign":
        for argument, its in zip(n.args, operands, strict=True):
            _require_pure(argument, its, f"{n.op}()")
    return NUMBER


def _common(n: Node, operands: Operands) -> Measured | None:
    """Return the common dimension of operands that are added, compared or chosen from, if one of them is certain."""
    given = [(a, x) for a, x in list(zip(n.args, operands, strict=True))[-2:] if x is not None]
    certain = [(a, x) for a, x in given if x.certain]
    if len(certain) == 2 and certain[0][1].dimension != certain[1][1].dimension:
        (a, x), (b, y) = certain
        b = b.args[0] if b.op == "neg" else b
        verb = _VERBS.get(n.op, f"{n.op}() combines")
        raise ExpressionError(
            f"{verb} {_in_words(x)} and {_in_words(y)}: {_brief(a)} {_is_in(x)}, {_brief(b)} {_is_in(y)}", number="E106"
        )
    if certain:
        return max((x for _, x in certain), key=lambda x: x.firm)
    alike = len(given) == 2 and given[0][1].dimension == given[1][1].dimension
    return given[0][1] if alike else None


_VERBS: Final = {"add": "a sum of", "less": "a comparison of", "less_equal": "a comparison of", "where": "a choice of"}


def _require_pure(a: Node, found: Measured | None, what: str) -> None:
    in_time = found is not None and found.dimension == TIME and not found.firm  # sin(t) turns with 1 rad/s
    if found is not None and found.certain and found.dimension != DIMENSIONLESS and not in_time:
        raise ExpressionError(
            f"{what} wants a pure number or an angle, and {_brief(a)} {_is_in(found)}", number="E106"
        )


def _in_words(found: Measured) -> str:
    return "a pure number" if found.dimension == DIMENSIONLESS else str(found.dimension)


def _is_in(found: Measured) -> str:
    return "has no unit" if found.dimension == DIMENSIONLESS else f"is in {found.dimension}"


def _brief(n: Node) -> str:
    try:
        shown = printed(n)
    except ExpressionError:
        return "this expression"
    return shown if len(shown) <= _SHOWN else shown[: _SHOWN - 3] + "..."


# ----------------------------------------------------------------------------------------------------------------------
# The SI unit of an expression, where it is certain: a unit beside a printed number must not be wrong.
#
# A number in an expression may carry an unwritten unit: in `5*x` the 5 may be a stiffness. Beside a part with a
# declared unit, as in `m*l^2/12`, small numbers are pure, as they are for dimensions above; beside motion alone only 1,
# 2 and 1/2 are. A certain term gives the unit of its sum: `x - 5*t` is a length, as x is.


_HALVES: Final = (1, 2, Fraction(1, 2))


class Kind(NamedTuple):
    """A dimension, the exponent of angles in it, and whether it is an energy (a moment has the same dimension).

    `angle` is None where it is unknown: a stiffness in N*m may be one per radian, and 1/s an angular velocity.
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
    """Return the kind of a unit, in which an angle stands first, and an energy alone; the empty text is a pure number.

    Raises ExpressionError for a word that is no unit, InputError for an angle elsewhere.
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


class InferredUnit(NamedTuple):
    """The kind of an expression: `firm` where numbers that multiply it are pure, `doubtful` where one may not be."""

    kind: Kind
    firm: bool = False
    doubtful: bool = False

    @property
    def certain(self) -> bool:
        """Whether no number in it can carry an unwritten unit."""
        return self.firm or not self.doubtful

    def times(self, other: InferredUnit, exponent: int = 1) -> InferredUnit:
        """Return the kind of a product or (exponent -1) quotient."""
        a, b = self.kind.angle, other.kind.angle
        dimension = self.kind.dimension.times(other.kind.dimension, exponent)
        kind = Kind(dimension, None if a is None or b is None else a + exponent * b)
        return InferredUnit(kind, self.firm or other.firm, self.doubtful or other.doubtful)

    def raised(self, exponent: Fraction) -> InferredUnit:
        """Return the kind of a power."""
        angle = self.kind.angle
        dimension = DIMENSIONLESS.times(self.kind.dimension, exponent)
        return self._replace(kind=Kind(dimension, None if angle is None else exponent * angle))


def infer_units(nodes: Iterable[Node], of_leaf: Callable[[Node], InferredUnit | None]) -> list[InferredUnit | None]:
    """Return the kind of each expression, given those of its leaves; None where it is not certain."""
    roots = list(nodes)
    kinds: dict[Node, InferredUnit | None] = {}
    for n in postorder(roots):
        if n.shadow is not None:
            kinds[n] = None  # the operation beside a constant looks at the constant itself
        else:
            kinds[n] = _infer_operation(n, [kinds[a] for a in n.args]) if n.args else of_leaf(n)
    return [x if x is not None and x.certain else None for x in (kinds[n] for n in roots)]


_ANGLES: Final = ("asin", "acos", "atan", "atan2")


def _infer_operation(n: Node, operands: list[InferredUnit | None]) -> InferredUnit | None:
    if n.op in ("neg", "abs"):
        return operands[0]
    if n.op in ("add", "min", "max", "where"):
        return _common_kind(n.args[-2:], operands[-2:])
    if n.op == "table":  # its input has the unit
        return None
    if n.op in ("mul", "div"):
        (left, right), (a, b) = n.args, operands
        if right.shadow is not None:
            return _times_constant(a, right)
        if left.shadow is not None:
            return _times_constant(b if b is None or n.op == "mul" else b.raised(Fraction(-1)), left)
        return None if a is None or b is None else a.times(b, -1 if n.op == "div" else 1)
    if n.op in ("pow", "sqrt"):
        base = operands[0]
        exponent = Fraction(1, 2) if n.op == "sqrt" else n.args[1].data if n.args[1].op == "number" else None
        if base is None or exponent is None:
            return base if base is not None and base.kind == PURE else None
        return base.raised(Fraction(exponent))
    return InferredUnit(ANGLE if n.op in _ANGLES else PURE)


def _times_constant(known: InferredUnit | None, constant: Node) -> InferredUnit | None:
    """Return the kind of the product with a constant."""
    if known is None or constant.op == "real" or not is_pure(constant):
        return None
    if known.kind.angle in (1, -1) and _is_turn(constant):
        kind = Kind(Dimension(*known.kind.dimension), angle=0)
        return known._replace(kind=kind)  # 2*pi/omega is a time, omega/(2*pi) a rate
    plain = constant.op == "number" and abs(constant.data) in _HALVES
    return known if plain else known._replace(doubtful=True)


def _is_turn(constant: Node) -> bool:
    """Return whether a constant is pi or 2 pi."""
    of_circle = any(leaf.op == "pi" for leaf in postorder([constant]))
    return of_circle and constant.shadow is not None and constant.shadow in (math.pi, 2 * math.pi)


def _common_kind(args: tuple[Node, ...], operands: list[InferredUnit | None]) -> InferredUnit | None:
    """Return the kind of the terms of a sum, or of values to choose from, if all are of one kind.

    Among two terms that are both certain, or both doubtful, a pure number fits every dimension.
    """
    varying = [known for a, known in zip(args, operands, strict=True) if a.shadow is None]
    kinds = [known for known in varying if known is not None]
    if not kinds or len(kinds) < len(varying):
        return None
    among = [known for known in kinds if known.certain] or kinds
    if len(among) == 1:
        return among[0]
    a, b = among
    if a.kind.dimension != b.kind.dimension:
        fitting = [y for x, y in ((a, b), (b, a)) if x.kind == PURE]
        return fitting[0] if fitting and not a.doubtful and not b.doubtful else None
    angles = {a.kind.angle, b.kind.angle} - {None}
    angle = angles.pop() if len(angles) == 1 else 1 if angles == {0, 1} else None
    kind = Kind(a.kind.dimension, angle, a.kind.energy or b.kind.energy)
    return InferredUnit(kind, a.firm or b.firm, a.doubtful and b.doubtful)
