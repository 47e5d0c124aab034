"""The expression language: text to Node, by operator precedence on an explicit stack (no recursion, no evaluation).

In: text. Out: a Node, or a number with its dimension; ExpressionError with the column of a mistake.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import reduce
from typing import Final, NamedTuple

from multibody_sym.errors import ExpressionError, nearest
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import BUILD, leaves, maximum, minimum
from multibody_sym.scalars.node import (
    PI,
    Node,
    add,
    as_node,
    divide,
    less,
    less_equal,
    multiply,
    negate,
    number,
    power,
    quantity,
    real,
    subtract,
    symbol,
)
from multibody_sym.scalars.sign_changes import is_condition
from multibody_sym.text.printer import AT, FORCE_NAMES, text
from multibody_sym.text.tokens import Token, exact_number, failure, tokens
from multibody_sym.text.units import DIMENSIONLESS, ENERGY, FORCE, LENGTH, Dimension, InferredUnit, Kind, read_unit

# ----------------------------------------------------------------------------------------------------------------------
# The quantities of the moving system that an expression can name, such as `reaction(C, fx)`.


class QuantityForm(NamedTuple):
    """The kinds of a quantity's arguments, and its dimension (None where that depends on them).

    `others`: the kinds for other numbers of arguments. `of_run`: it adds up along a run. `of_mode`: it belongs to a
    mode of small oscillations, by its number.
    """

    arguments: tuple[str, ...]
    dimension: Dimension | None
    others: tuple[tuple[str, ...], ...] = ()
    of_run: bool = False
    of_mode: bool = False

    def taking(self, count: int) -> tuple[str, ...] | None:
        """Return the kinds of `count` arguments; None for a wrong number."""
        return next((kinds for kinds in (self.arguments, *self.others) if len(kinds) == count), None)


QUANTITIES: Final[dict[str, QuantityForm]] = {
    "position": QuantityForm(("point", "axis"), Dimension(0, 1, 0)),
    "velocity": QuantityForm(("point", "axis"), Dimension(0, 1, -1)),
    "acceleration": QuantityForm(("point", "axis"), Dimension(0, 1, -2)),
    "angular_velocity": QuantityForm(("body", "axis"), Dimension(0, 0, -1)),
    "angular_acceleration": QuantityForm(("body", "axis"), Dimension(0, 0, -2)),
    "rotation": QuantityForm(("frame", "axis", "axis"), DIMENSIONLESS),
    "quaternion": QuantityForm(("frame", "element"), DIMENSIONLESS),
    "angle": QuantityForm(("frame", "axis"), DIMENSIONLESS),
    "distance": QuantityForm(("point", "point"), Dimension(0, 1, 0)),
    "'": QuantityForm(("moving",), None),
    "''": QuantityForm(("coordinate",), None),
    "reaction": QuantityForm(("joint", "component"), None),
    "tension": QuantityForm(("rope",), Dimension(1, 1, -2)),
    "multiplier": QuantityForm(("constraint",), None),
    "total_energy": QuantityForm((), ENERGY),
    "kinetic_energy": QuantityForm((), ENERGY, (("whole",),)),
    "potential_energy": QuantityForm((), ENERGY, (("store",),)),
    "jacobi_integral": QuantityForm((), ENERGY),
    "center_of_mass": QuantityForm(("axis",), Dimension(0, 1, 0)),
    "momentum": QuantityForm(("axis",), Dimension(1, 1, -1), (("whole", "axis"),)),
    "angular_momentum": QuantityForm(("axis",), Dimension(1, 2, -1), (("whole", "axis"), ("whole", "about", "axis"))),
    "generalized_momentum": QuantityForm(("freedom",), None),
    "power": QuantityForm(("exerting",), Dimension(1, 2, -3)),
    "work": QuantityForm(("exerting",), ENERGY, of_run=True),
    "impulse": QuantityForm(("exerting", "axis"), Dimension(1, 1, -1), (("exerting", "whole", "axis"),), of_run=True),
    "frequency": QuantityForm(("mode",), Dimension(0, 0, -1), of_mode=True),
    "period": QuantityForm(("mode",), Dimension(0, 0, 1), of_mode=True),
}
"""Every quantity by its name; the arguments are names of the model, joined by dots.

The primes of `phi'` and `phi''` stand behind their one argument, a coordinate or a speed. A component of a `reaction`
is written as a quantity of its own, `fx(hinge)`, which `reaction(hinge, fx)` spells too.

A `whole` is a body or the word `system`; `about` a point, or the word `com` for its own centre of mass; what is
`exerting` a force, constraint, contact or joint, a body whose mass varies, or the word `weight`; a `store` of potential
energy a body or force.
"""
KINEMATIC: Final = frozenset(("position", "velocity", "acceleration", "angular_velocity", "angular_acceleration"))
"""Quantities of points and bodies that need no forces."""
_AXES: Final = ("x", "y", "z")
SYSTEM, OWN_CENTRE, WEIGHT = "system", "com", "weight"

_ANGULAR: Final = {
    "angle": 1,
    "angular_velocity": 1,
    "angular_acceleration": 1,
    "angular_momentum": None,
    "frequency": 1,
}
_ENERGIES: Final = ("total_energy", "kinetic_energy", "potential_energy", "jacobi_integral", "work")


def of_run(node: Node) -> bool:
    """Return whether an expression names a quantity that adds up along a run: work, an impulse."""
    return any(QUANTITIES[leaf.data[0]].of_run for leaf in leaves([node], "quantity") if leaf.data[0] in QUANTITIES)


def force_name(element: str, component: str) -> str:
    """Return the name of a force in expressions: `fx(hinge)`, `tension(rope, 2)`, `multiplier(row)`, `friction(c)`.

    `component` is one of an element's reactions; other words than those of the language are parts of friction in a
    joint, with a number behind where they have several components.
    """
    if component == "multiplier":
        return text(quantity(component, (element,)))
    if component.startswith("tension"):
        run = component.removeprefix("tension")
        return text(quantity("tension", (f"{element}.{run}" if run else element,)))
    if component not in FORCE_NAMES:
        part, _, number = component.partition("_")
        element, component = f"{element}.{part}", f"friction_{number}" if number else "friction"
    return text(quantity("reaction", (element, component)))


def component_kind(component: str) -> Kind:
    """Return the kind of a component of a reaction: a force, a moment (`mx` .. `mz`, rolling), a length (a place)."""
    if component in AT:
        return Kind(LENGTH)
    turns = component.startswith("m") or component.startswith("rolling")
    return Kind(ENERGY, angle=None) if turns else Kind(FORCE)


def quantity_known(function: str, arguments: Sequence[str]) -> InferredUnit | None:
    """Return the kind of a quantity by its arguments; None where it depends on the constraint or freedom."""
    if function == "reaction":
        return InferredUnit(component_kind(arguments[1]), firm=True)
    dimension = QUANTITIES[function].dimension
    if dimension is None:
        return None
    return InferredUnit(Kind(dimension, _ANGULAR.get(function, 0), function in _ENERGIES), firm=dimension.mass != 0)


# ----------------------------------------------------------------------------------------------------------------------

DEEPEST: Final = 500
_OPEN, _OR, _AND, _COMPARISON, _SUM, _PRODUCT, _POWER = 0, 4, 6, 10, 20, 30, 40


def _join_conditions(word: str, build: Callable[[Node, Node], Node]) -> Callable[[Node, Node], Node]:
    """Return the function that joins two conditions, 1 or 0, by `and` or `or`."""

    def join(a: Node, b: Node) -> Node:
        if not (is_condition(a) and is_condition(b)):
            raise ExpressionError(f"'{word}' joins conditions, such as x > 1 {word} y < 0; one of its sides is none")
        return build(a, b)

    return join


_BINARY: Final[dict[str, tuple[int, Callable[[Node, Node], Node]]]] = {
    "or": (_OR, _join_conditions("or", maximum)),
    "and": (_AND, _join_conditions("and", minimum)),
    "<": (_COMPARISON, less),
    "<=": (_COMPARISON, less_equal),
    ">": (_COMPARISON, lambda a, b: less(b, a)),
    ">=": (_COMPARISON, lambda a, b: less_equal(b, a)),
    "+": (_SUM, add),
    "-": (_SUM, subtract),
    "*": (_PRODUCT, multiply),
    "/": (_PRODUCT, divide),
    "^": (_POWER, power),
    "**": (_POWER, power),
}
_OF_ONE: Final = "sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh exp log sqrt abs sign"
_WORDS: Final = ("and", "or")
FUNCTIONS: Final[dict[str, tuple[str, ...]]] = {
    **dict.fromkeys(_OF_ONE.split(), ("x",)),
    "atan2": ("y", "x"),
    "min": ("a", "b", "..."),
    "max": ("a", "b", "..."),
    "where": ("condition", "a", "b"),
}
"""Every function by its name, with its arguments; `...` stands for any number of further ones."""

_MEANT: Final = {
    "arcsin": "asin(x)", "arccos": "acos(x)", "arctan": "atan(x)", "arctan2": "atan2(y, x)", "ln": "log(x)",
    "arsinh": "asinh(x)", "arcosh": "acosh(x)", "artanh": "atanh(x)",
    "pow": "x^y", "sgn": "sign(x)", "fabs": "abs(x)", "if": "where(condition, a, b)", "log10": "log(x)/log(10)",
    "minimum": "min(a, b)", "maximum": "max(a, b)", "radians": "x*pi/180", "square": "x^2", "power": "x^y",
    "cot": "1/tan(x)", "sec": "1/cos(x)", "csc": "1/sin(x)", "energy": "total_energy()", "speed": "velocity(A, x)",
    "n": "normal(c)",
}


def parse(text: str) -> Node:
    """Return the Node that `text` spells; names without parentheses become symbols, and `t` is one of them.

    Raises ExpressionError with the column of a mistake, also where a constant part has no finite real value.
    """
    return _Parser(text, tokens(text)).whole()


def parse_scalar(text: str) -> tuple[Node, Dimension | None]:
    """Return (value in SI, dimension) of one number with a unit (`-9.81 m/s^2`), or (expression, None).

    Raises ExpressionError with the column of a mistake.
    """
    every = tokens(text)
    sign = every[0].kind in ("-", "+")
    value, unit = every[sign], every[sign + 1 :]
    starts_unit = bool(unit) and (unit[0].kind == "name" or (unit[0].text == "1" and unit[1].kind == "/"))
    if value.kind != "number" or not starts_unit:
        return _Parser(text, every).whole(), None
    try:
        factor, dimension = read_unit(text, unit)
    except ExpressionError as error:
        spelt = "*" in (error.meant or "")  # the word is a product of units, and no name
        if error.where.column == unit[0].column and unit[0].kind == "name" and not spelt:
            message = f"{error.message}; {_product(value, unit[0])}"
            error = failure(text, unit[0].column, message, "E103", error.word, error.meant)
        raise error from None
    try:
        node = number(exact_number(text, value)) * factor
    except ExpressionError as error:
        raise failure(text, value.column, error.message, error.number) from None
    return (negate(node) if every[0].kind == "-" else node), dimension


def _product(before: Token, after: Token) -> str:
    return f"a product is written with *: {before.text[-20:]}*{after.text[:20]}"


@dataclass(slots=True)
class _Frame:
    """A binary operator, a sign, a parenthesis or a call on the stack, which waits for its right side."""

    token: Token
    strength: int
    build: Callable[..., Node] | None = None
    operands: int = 0
    first: int = 0


class _Parser:
    """The state of one reading: the next token, the values read, and the frames that wait for more."""

    def __init__(self, text: str, found: list[Token]) -> None:
        self.text = text
        self.found = found
        self.place = 0
        self.values: list[Node] = []
        self.frames: list[_Frame] = []

    def whole(self) -> Node:
        while True:
            while not self.operand():
                pass
            if self.operator():
                return self.values[0]

    def error(self, token: Token, message: str, number: str | None = None) -> ExpressionError:
        return failure(self.text, token.column, message, number)

    def push(self, frame: _Frame) -> None:
        if len(self.frames) >= DEEPEST:
            raise self.error(frame.token, f"the expression is nested more than {DEEPEST} deep", "E104")
        self.frames.append(frame)

    # --- operands ---

    def operand(self) -> bool:
        """Read one token where an operand must stand; return whether the operand is complete."""
        token = self.found[self.place]
        self.place += 1
        if token.kind == "number":
            self.values.append(self.built(token, number, exact_number(self.text, token)))
        elif token.kind == "name":
            return self.named(token)
        elif token.kind in ("-", "+"):
            waiting = self.frames[-1].strength if self.frames else _OPEN
            self.push(_Frame(token, max(waiting, _SUM), negate if token.kind == "-" else as_node, 1))
            return False
        elif token.kind == "(":
            self.push(_Frame(token, _OPEN))
            return False
        else:
            raise self.error(token, self.no_operand(token))
        return True

    def named(self, token: Token) -> bool:
        if self.found[self.place].kind != "(":
            name, primes = _without_primes(token)
            if not primes and self.found[self.place].kind == "." and self.found[self.place + 1].text in _AXES:
                name = f"{name}.{self.found[self.place + 1].text}"  # a component of an answer
                self.place += 2
            self.values.append(quantity(primes, [name]) if primes else PI if name == "pi" else symbol(name))
            return True
        self.place += 1
        if token.text in FUNCTIONS:
            self.push(_Frame(token, _OPEN, first=len(self.values)))
            return False
        if token.text in _CALLED:
            self.values.append(self.quantity(token))
        elif token.text == "real":
            self.values.append(self.real(token))
        else:
            raise self.no_function(token)
        return True

    def quantity(self, token: Token) -> Node:
        names: list[str] = []
        if self.found[self.place].kind == ")":
            self.place += 1
        else:
            while True:
                names.append(self.mode(token) or self.dotted_name())
                self.numbered_run(token, names)
                closing = self.found[self.place]
                self.place += 1
                if closing.kind == ")":
                    break
                if closing.kind != ",":
                    raise self.error(closing, self.no_name(token, closing))
        form = _CALLED[token.text]
        if form.taking(len(names)) is None:
            raise self.error(token, _arity(token.text, form.arguments, len(names), form.others), "E102")
        return quantity("reaction", [*names, token.text]) if token.text in FORCE_NAMES else quantity(token.text, names)

    def numbered_run(self, function: Token, names: list[str]) -> None:
        """Read the number of a rope's run, which becomes a part of its name: `tension(string, 2)`."""
        number = self.found[self.place + 1] if self.found[self.place].kind == "," else None
        if number is not None and number.text.isdecimal() and _CALLED[function.text].arguments == ("rope",):
            names[-1] = f"{names[-1]}.{number.text}"
            self.place += 2

    def mode(self, function: Token) -> str:
        """Read the number of a mode, as in `frequency(1)`; return an empty text for another argument."""
        number = self.found[self.place]
        if not (_CALLED[function.text].of_mode and number.kind == "number"):
            return ""
        self.place += 1
        return str(int(number.text)) if number.text.isdecimal() else number.text

    def dotted_name(self) -> str:
        parts: list[str] = []
        while True:
            token = self.found[self.place]
            if token.kind not in ("name", "quoted") or _without_primes(token)[1]:
                instead = f", not '{token.text}'" if token.text else ""
                raise self.error(token, f"a name must stand here{instead}; {_QUOTED_NAMES}")
            quote = token.text[0]
            name = token.text if token.kind == "name" else token.text[1:-1].replace(quote * 2, quote)
            if not name:
                raise self.error(token, "the quoted name is empty")
            if "." in name:
                raise self.error(token, "a quoted name holds no dot; quote the parts: 'my rod'.pin")
            parts.append(name)
            self.place += 1
            if self.found[self.place].kind != ".":
                return ".".join(parts)
            self.place += 1

    def no_name(self, function: Token, token: Token) -> str:
        if token.kind == "end":
            return f"the parenthesis of {function.text}( is never closed; {_QUOTE}"
        return f"'{token.text}' has no place in a name; {_QUOTED_NAMES}"

    def real(self, token: Token) -> Node:
        sign = self.found[self.place]
        self.place += sign.kind == "-"
        value, closing = self.found[self.place], self.found[self.place + 1 : self.place + 2]
        if value.kind != "number" or not closing or closing[0].kind != ")":
            raise self.error(token, "real(...) takes one number: real(0.1)")
        self.place += 2
        exact_number(self.text, value)
        return real(-float(value.text) if sign.kind == "-" else float(value.text))

    def no_operand(self, token: Token) -> str:
        before = self.found[self.place - 2] if self.place > 1 else None
        if before is None:
            return f"an expression cannot start with {token.text}" if token.text else "an expression is missing"
        if token.kind == "quoted":
            return "quoted names stand only in the arguments of position(...), reaction(...) and the like"
        if before.text == "*" and token.text == "*":
            return "a power is written ** or ^"
        if before.text == "/" and token.text == "/":
            return "a quotient is written with one /"
        what = f"'{token.text}'" if token.text else "the end"
        return f"something is missing between '{before.text}' and {what}"

    # --- operators ---

    def operator(self) -> bool:
        """Read tokens where an operator must stand, up to a binary one; return whether the expression is complete."""
        while True:
            token = self.found[self.place]
            self.place += 1
            if token.kind in _BINARY or token.text in _WORDS:
                self.binary(token)
                return False
            if token.kind == "end":
                self.finish()
                return True
            if token.kind == ",":
                self.comma(token)
                return False
            if token.kind != ")":
                raise self.error(token, self.no_operator(token))
            self.close(token)

    def binary(self, token: Token) -> None:
        strength, build = _BINARY[token.text]
        self.reduce(strength)
        if strength == _COMPARISON and self.frames and self.frames[-1].strength == _COMPARISON:
            raise self.error(token, "comparisons do not chain; write a < b and b < c for a < b < c")
        self.push(_Frame(token, strength - 1 if strength == _POWER else strength, build, 2))

    def reduce(self, strength: int) -> None:
        """Build every waiting operator that binds at least as strongly as `strength`."""
        while self.frames and self.frames[-1].strength >= max(strength, 1):
            frame = self.frames[-1]
            if frame.strength == strength == _COMPARISON:
                return
            self.frames.pop()
            assert frame.build is not None
            operands = self.values[-frame.operands :]
            del self.values[-frame.operands :]
            self.values.append(self.built(frame.token, frame.build, *operands))

    def close(self, token: Token) -> None:
        self.reduce(_OPEN)
        if not self.frames:
            raise self.error(token, "this ) closes nothing; leave it out, or write the ( that opens before")
        frame = self.frames.pop()
        if frame.token.kind == "name":
            self.call(frame)

    def call(self, frame: _Frame) -> None:
        name, operands = frame.token.text, self.values[frame.first :]
        wanted = FUNCTIONS[name]
        if len(operands) != len(wanted) if wanted[-1] != "..." else len(operands) < 2:
            raise self.error(frame.token, _arity(name, wanted, len(operands)), "E102")
        del self.values[frame.first :]
        build = BUILD[name]
        if wanted[-1] == "...":
            self.values.append(self.built(frame.token, lambda *all_of: reduce(build, all_of), *operands))
        else:
            self.values.append(self.built(frame.token, build, *operands))

    def comma(self, token: Token) -> None:
        self.reduce(_OPEN)
        if not self.frames or self.frames[-1].token.kind != "name":
            before, after = self.found[self.place - 2], self.found[self.place]
            message = "a comma stands only between the arguments of a function"
            if before.kind == after.kind == "number" and not self.frames:
                message += f"; a decimal is written {before.text}.{after.text}"
            raise self.error(token, message)

    def finish(self) -> None:
        self.reduce(_OPEN)
        if self.frames:
            raise self.error(self.frames[-1].token, f"the parenthesis that opens here is never closed; {_QUOTE}")

    def no_function(self, token: Token) -> ExpressionError:
        name = token.text
        near = nearest(name, [*FUNCTIONS, *_CALLED], cutoff=0.7)
        guess = _MEANT.get(name.lower()) or near
        advice = f"did you mean {guess}?" if guess else f"a product is written with *: {name[:20]}*(...)"
        if not guess and f"{name}(t)" in self.text:
            advice = f"what changes with time is written without it: {name[:20]}"
        meant = near if guess == near else None
        return failure(self.text, token.column, f"there is no function '{name}'; {advice}", "E102", name, meant)

    def no_operator(self, token: Token) -> str:
        before = self.found[self.place - 2]
        if before.kind == token.kind == "number":
            both = f"{before.text[-20:]}{token.text[:20]}"
            if before.column + len(before.text) == token.column:
                return f"{both} has two decimal points"
            return f"an operator is missing before '{token.text[:20]}'; a number is written without blanks, {both}"
        if token.kind == ".":
            return (
                "names are joined by a dot only in the arguments of position(...), reaction(...) and the like, "
                "velocity(rod.pin, x); .x, .y and .z are components of answers"
            )
        if before.kind == "number" and token.kind == "name":
            return (
                f"{_product(before, token)}; a unit stands only after a single number that is a value by itself "
                "(give that number a name under parameters)"
            )
        if before.kind == "name" and before.text in FUNCTIONS:
            return f"the argument of {before.text} stands in parentheses: {before.text}(...)"
        if "not" in (before.text, token.text):
            return "'not' is no operator; write the opposite comparison, x >= 1 for not x < 1"
        if token.text in ("if", "else"):
            return f"'{token.text}' is no operator; write where(condition, a, b)"
        return f"an operator is missing before '{token.text[:20]}'; {_product(before, token)}"

    def built(self, token: Token, build: Callable[..., Node], *operands: object) -> Node:
        try:
            return build(*operands)
        except ExpressionError as error:
            raise self.error(token, error.message, error.number) from None


_QUOTE: Final = 'in a list or map {...} an expression that contains a comma is quoted: "atan2(y, x)"'

_QUOTED_NAMES: Final = "names with other characters than letters, digits and _ are quoted: 'rod-2'.pin"


_CALLED: Final = {**QUANTITIES, **dict.fromkeys(FORCE_NAMES, QuantityForm(("element",), None))}


def _without_primes(token: Token) -> tuple[str, str]:
    """Return the name of a token, and the primes behind it."""
    name = token.text.rstrip("'") if token.kind == "name" else token.text
    return name, token.text[len(name) :]


def _arity(name: str, wanted: tuple[str, ...], given: int, others: tuple[tuple[str, ...], ...] = ()) -> str:
    count = "two or more" if wanted and wanted[-1] == "..." else " or ".join(str(len(x)) for x in (wanted, *others))
    plural = "" if count == "1" else "s"
    forms = " or ".join(f"{name}({', '.join(x)})" for x in (wanted, *others))
    return f"{forms} takes {count} argument{plural}, not {given}"
