"""Nodes as text in the model's own language: the fewest parentheses, and the parser reads back the identical Node."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable
from fractions import Fraction
from itertools import groupby
from typing import Final, NamedTuple

from multibody_sym.errors import ExpressionError
from multibody_sym.scalars.node import Node
from multibody_sym.scalars.sign_changes import is_condition

# ----------------------------------------------------------------------------------------------------------------------
# The names of the components of forces of joints, contacts, stops and friction.


COMPONENTS: Final = ("fx", "fy", "fz", "mx", "my", "mz")
"""The components of a joint's reaction: force and moment."""
_NUMBERED: Final = tuple(f"{word}{k}" for word in ("friction", "rolling") for k in ("", "_1", "_2", "_3"))
AT: Final = ("at_x", "at_y", "at_z")
"""The coordinates of the place at which a contact presses."""
FORCE_NAMES: Final = (*COMPONENTS, "normal", "force", *_NUMBERED, *AT)
"""The components that `reaction(.., component)` takes; each is a function too: `fx(hinge)`."""


# ----------------------------------------------------------------------------------------------------------------------

LONGEST_TEXT: Final = 100_000
_LONGEST_DECIMAL: Final = 25
_SMALLEST_PART_OF_PI: Final = 1800  # a tenth of a degree, or 3*pi/10 for 54 degrees
_POWERS_OF_TWO: Final = frozenset(2**k for k in range(17))  # m/256, not 0.00390625*m
_HUNDRED: Final = 100
_EXACT_BITS: Final = 256  # past which a quotient of numbers is no longer exact
OR, AND, COMPARISON, SUM, PRODUCT, POWER, ATOM = 4, 6, 10, 20, 30, 40, 50


_MOST_KEPT: Final = 20_000
_LONGEST_KEPT: Final = 2_000


class _Piece(NamedTuple):
    """The text of a sub-expression and how strongly its outermost operator binds."""

    text: str
    strength: int


_kept: Final[list[dict[Node, _Piece]]] = [{}]
"""The printed expressions with all their parts, which formulas that are tried one after the other share."""


def text(node: Node) -> str:
    """Return `node` in the model's own language, such that the parser returns the identical Node.

    Slots, which only programs hold, print as `q[0]`. Raises ExpressionError past `LONGEST_TEXT` characters.
    """
    pieces, waiting = _kept[0], [node]
    while waiting:
        n = waiting[-1]
        lacking = [a for a in n.args if a not in pieces]
        if lacking:
            waiting.extend(reversed(lacking))
            continue
        waiting.pop()
        if n not in pieces:
            pieces[n] = _PRINTERS.get(n.op, _function)(n, pieces) if n.args else _leaf(n)
            if len(pieces[n].text) > LONGEST_TEXT:
                _kept[0] = {}
                raise ExpressionError(f"the expression is longer than {LONGEST_TEXT} characters; give its parts names")
    whole = pieces[node].text
    if len(pieces) > _MOST_KEPT or len(whole) > _LONGEST_KEPT:
        _kept[0] = {}
    return whole


def _within(piece: _Piece, strength: int) -> str:
    return piece.text if piece.strength >= strength else f"({piece.text})"


def _leaf(n: Node) -> _Piece:
    if n.op == "number":
        return _Piece("-" + _exact(-n.data).text, SUM) if n.data < 0 else _exact(n.data)
    if n.op == "slot":
        return _Piece(f"{n.data[0]}[{n.data[1]}]", ATOM)
    if n.op == "quantity":
        function, names = n.data
        if function in _OWN:
            return _Piece(_OWN[function](names), ATOM)
        if function in ("'", "''"):
            return _Piece(f"{names[0]}{function}", ATOM)
        if function == "reaction" and names[1] in FORCE_NAMES:
            return _Piece(f"{names[1]}({_dotted_name(names[0])})", ATOM)
        numbered = function in ("frequency", "period")
        arguments = (name if numbered and name.isdecimal() else _dotted_name(name) for name in names)
        return _Piece(f"{function}({', '.join(arguments)})", ATOM)
    if n.op == "real":
        return _Piece(f"real({n.data!r})", ATOM)
    if n.op == "declared":
        return _Piece(n.data[0], ATOM)
    return _Piece("pi" if n.op == "pi" else n.data, ATOM)


_OWN: Final[dict[str, Callable[[tuple[str, ...]], str]]] = {
    "span": lambda _: "distance",
    "span_rate": lambda _: "distance_rate",
    "place": lambda names: names[1],
    "arc": lambda _: "s",
    "parameter of a curve": lambda names: names[0],
    "distance from the axis": lambda _: "s",
}
"""The texts of names that laws, curves and profiles have of their own, by their quantities."""


def _dotted_name(name: str) -> str:
    """Return a dotted name; a number at its end is the run of a rope, `tension(string, 2)`."""
    *parts, last = name.split(".")
    if parts and last.isdecimal():
        return f"{'.'.join(map(_quote, parts))}, {last}"
    return ".".join(map(_quote, (*parts, last)))


def _quote(name: str) -> str:
    plain = name.isascii() and name[:1].isalpha() and name.replace("_", "").isalnum()
    return name if plain else "'" + name.replace("'", "''") + "'"


def power_text(base: str, exponent: int | Fraction) -> str:
    """Return a power of a unit: `m`, `m^2`, `m^(1/2)`."""
    if exponent == 1:
        return base
    return f"{base}^{exponent}" if exponent.denominator == 1 else f"{base}^({exponent})"


def _exact(value: int | Fraction) -> _Piece:
    """Return a number that is not negative: an integer, an exact decimal, or a quotient of integers."""
    if value.denominator == 1:
        digits = str(value)
        mantissa = digits.rstrip("0")
        short = len(digits) - len(mantissa) > 6
        return _Piece(_scientific(mantissa, len(digits) - 1) if short else digits, ATOM)
    decimal = _decimal(Fraction(value))
    if decimal:
        return _Piece(decimal, ATOM)
    return _Piece(f"{_exact(value.numerator).text}/{_exact(value.denominator).text}", PRODUCT)


def _scientific(digits: str, exponent: int) -> str:
    return f"{digits[0]}{'.' if len(digits) > 1 else ''}{digits[1:]}e{exponent}"


def _decimal(value: Fraction) -> str | None:
    """Return a fraction as an exact decimal, or None where it has none of reasonable length."""
    twos, rest = _multiplicity(value.denominator, 2)
    fives, rest = _multiplicity(rest, 5)
    if rest != 1:
        return None
    places = max(twos, fives)
    digits = str(value.numerator * 10**places // value.denominator)
    if len(digits) > _LONGEST_DECIMAL and max(value.numerator, value.denominator).bit_length() <= _EXACT_BITS:
        return None
    if len(digits) < places - 3:
        return _scientific(digits, len(digits) - 1 - places)
    digits = digits.rjust(places + 1, "0")
    return f"{digits[:-places]}.{digits[-places:]}"


def _multiplicity(value: int, prime: int) -> tuple[int, int]:
    count = 0
    while value % prime == 0:
        value //= prime
        count += 1
    return count, value


def _neg(n: Node, pieces: dict[Node, _Piece]) -> _Piece:
    return _Piece("-" + _within(pieces[n.args[0]], PRODUCT), SUM)


def _add(n: Node, pieces: dict[Node, _Piece]) -> _Piece:
    a, b = _order_operands(n, pieces)
    first = _within(pieces[a], SUM)
    if b.op == "neg":
        return _Piece(f"{first} - {_within(pieces[b.args[0]], PRODUCT)}", SUM)
    if b.op == "number" and b.data < 0:
        return _Piece(f"{first} - {_exact(-b.data).text}", SUM)
    return _Piece(f"{first} + {_within(pieces[b], SUM + 1)}", SUM)


def _order_operands(n: Node, pieces: dict[Node, _Piece]) -> tuple[Node, Node]:
    """Return the operands of a commutative operation: a nested one first, without parentheses, numbers last."""
    a, b = n.args
    if b.op == "neg" or _rank(n.op, a, pieces) <= _rank(n.op, b, pieces):
        return a, b
    return b, a


def _rank(op: str, n: Node, pieces: dict[Node, _Piece]) -> tuple[int, int, str]:
    if n.op == op or (op == "mul" and n.op == "div"):
        return (0 if n.op == op else 1, 0, "")
    if op == "add" and n.op in ("number", "real"):
        return (3, 0, "")
    if op == "add":
        return (2, 0, pieces[n.args[1] if n.op == "mul" and n.args[0].op == "number" else n].text)
    # numbers, letters, their powers, functions, sums
    place = _PLACE_IN_PRODUCT.get(n.args[0].op if n.op == "pow" else n.op, 3)
    return (2, max(2, place) if n.op == "pow" else place, pieces[n].text)


_PLACE_IN_PRODUCT: Final = {"number": 0, "real": 0, "pi": 1, "symbol": 1, "slot": 1, "add": 4}


def _mul(n: Node, pieces: dict[Node, _Piece]) -> _Piece:
    if n.args[0].op == "number":
        # `m*r^2/12`, `2*x/3`, `0.1*x`, `3*x/256`
        factor = n.args[0].data
        n = n.args[1]
        above, below = factor.numerator, factor.denominator
        small = is_short_fraction(factor) or (n.op == "pi" and below <= _SMALLEST_PART_OF_PI)
        if not small and below != 1 and _decimal(Fraction(factor)):
            return _Piece(f"{_exact(factor).text}*{_behind_number(n, pieces)}", PRODUCT)
        product = f"{_exact(above).text}*{_behind_number(n, pieces)}" if above != 1 else _within(pieces[n], PRODUCT)
        return _Piece(product if below == 1 else f"{product}/{below}", PRODUCT)
    a, b = _order_operands(n, pieces)
    return _Piece(f"{_within(pieces[a], PRODUCT)}*{_within(pieces[b], PRODUCT + 1)}", PRODUCT)


def is_short_fraction(value: int | Fraction) -> bool:
    """Return whether a factor is written as a fraction though it may be a decimal: `m*r^2/12`, `2*x/3`; `0.1*x`."""
    above, below = value.numerator, value.denominator
    part = above == 1 and below < _HUNDRED and below % 10 != 0 and below % 25 != 0
    return (below < 10 and above < 10) or part or is_halved(value)


def is_halved(value: int | Fraction) -> bool:
    """Return whether a number is written over a power of two: `5*x/16`, `m/256`; `122.625*x` is 12.5 times 9.81."""
    above, below = abs(value.numerator), value.denominator
    return below in _POWERS_OF_TWO and (above < _HUNDRED or below > _HUNDRED)


def _behind_number(n: Node, pieces: dict[Node, _Piece]) -> str:
    """Return the text of `n` behind a leading number: a product may follow bare, a quotient may not."""
    first = n
    while first.op == "mul":
        first = _order_operands(first, pieces)[0]
    return f"({pieces[n].text})" if first.op == "div" else _within(pieces[n], PRODUCT)


def _div(n: Node, pieces: dict[Node, _Piece]) -> _Piece:
    a, b = (pieces[x] for x in n.args)
    return _Piece(f"{_within(a, PRODUCT)}/{_within(b, PRODUCT + 1)}", PRODUCT)


def _pow(n: Node, pieces: dict[Node, _Piece]) -> _Piece:
    base, exponent = (pieces[x] for x in n.args)
    return _Piece(f"{_within(base, POWER + 1)}^{_within(exponent, POWER)}", POWER)


def _comparison(n: Node, pieces: dict[Node, _Piece]) -> _Piece:
    a, b = (_within(pieces[x], SUM) for x in n.args)
    return _Piece(f"{a} {'<' if n.op == 'less' else '<='} {b}", COMPARISON)


def _extreme(n: Node, pieces: dict[Node, _Piece]) -> _Piece:
    a, b = _order_operands(n, pieces)
    if is_condition(n):
        word, strength = ("and", AND) if n.op == "min" else ("or", OR)
        return _Piece(f"{_within(pieces[a], strength)} {word} {_within(pieces[b], strength + 1)}", strength)
    first = pieces[a].text
    if a.op == n.op and pieces[a].strength == ATOM:
        first = first[len(n.op) + 1 : -1]
    return _Piece(f"{n.op}({first}, {pieces[b].text})", ATOM)


def _function(n: Node, pieces: dict[Node, _Piece]) -> _Piece:
    name = n.data[0].called(n.data[1]) if n.op == "table" else n.op
    return _Piece(f"{name}({', '.join(pieces[a].text for a in n.args)})", ATOM)


_PRINTERS: Final[dict[str, Callable[[Node, dict[Node, _Piece]], _Piece]]] = {
    "neg": _neg, "add": _add, "mul": _mul, "div": _div, "pow": _pow, "less": _comparison, "less_equal": _comparison,
    "min": _extreme, "max": _extreme,
}


# ----------------------------------------------------------------------------------------------------------------------
# Names of symbols as a book writes them: a letter or words, with an index.
#
# Formulas in LaTeX and MathML and the labels of figures read names here.


GREEK: Final = dict(
    pair.split("=")
    for pair in (
        "alpha=α beta=β gamma=γ delta=δ epsilon=ε zeta=ζ eta=η theta=θ iota=ι kappa=κ lambda=λ mu=μ nu=ν xi=ξ pi=π "
        "rho=ρ sigma=σ tau=τ upsilon=υ phi=φ chi=χ psi=ψ omega=ω Gamma=Γ Delta=Δ Theta=Θ Lambda=Λ Xi=Ξ Pi=Π Sigma=Σ "
        "Upsilon=Υ Phi=Φ Psi=Ψ Omega=Ω"
    ).split()
)
"""The Greek letters that differ from Latin ones, by their names."""
_ABBREVIATED: Final = {"al": "alpha", "th": "theta", "ph": "phi", "om": "omega"}
"""Names of Greek letters by their abbreviations; `be` is a word, and `la` or `ps` may be a letter with an index."""
_FULL_NAMES: Final = {letter: name for name, letter in GREEK.items()} | _ABBREVIATED
_LETTERS: Final = re.compile(r"([^\W\d_]*)_*(.*)", re.DOTALL)
SYMBOL: Final = re.compile(r"[^\W\d_]\w*")
"""The form of a symbol; other names are read as they stand."""
_LOW: Final = {0x2080 + digit: str(digit) for digit in range(10)}


_ENGLISH: Final = frozenset(
    "am an as at ax be by do go he if in is it me my no of oh ok on or ox so to up us we pin pit pie pig pip taut chip "
    "chin nut nun nub mud mug mum".split()
)
"""Words that are no letter with an index."""
_NUMBERED_GREEK: Final = re.compile(rf"^({'|'.join((*GREEK, *_ABBREVIATED))})([0-9]+)$")
_INDEXED: Final = re.compile(rf"({'|'.join(sorted(GREEK, key=len, reverse=True))}|[^\W\d_])([^\W\d_])")


def read_parts(name: str) -> list[str]:
    """Return the letter or words of a name and its indices: theta1 and θ₁ as theta and 1, xa as x and a.

    Adjacent words are one part, pin_force_2 is pin force and 2, but an angle is phi, a radius r: crank_angle_2 is phi,
    crank and 2. Greek letters have their names, which th, ph, al and om abbreviate.
    """
    plain = unicodedata.normalize("NFC", name).translate(_LOW)
    letter, rest = _LETTERS.match(plain).groups()  # type: ignore[union-attr]
    if not letter:
        return [name]
    below = [_NUMBERED_GREEK.sub(r"\1_\2", part).split("_") for part in rest.split("_") if part]
    parts = [_FULL_NAMES.get(part, part) for part in (letter, *(each for group in below for each in group))]
    indexed = None if letter in _ENGLISH or parts[0] in GREEK or letter.isupper() else _INDEXED.fullmatch(letter)
    if indexed is not None:
        parts[:1] = [_FULL_NAMES.get(part, part) for part in indexed.groups()]
    runs = [(word, list(run)) for word, run in groupby(parts, is_word)]
    return [part for word, run in runs for part in (_joined(run) if word else run)]


_KINDS: Final = {"angle": "phi", "radius": "r"}


def _joined(words: list[str]) -> list[str]:
    """Return adjacent words as one part; an angle or radius as its letter and what it is of."""
    letter = _KINDS.get(words[-1]) if words[:-1] else None
    return [" ".join(words)] if letter is None else [letter, " ".join(words[:-1])]


def is_word(part: str) -> bool:
    """Return whether a part of a name is a word and no letter or number."""
    return len(part) > 1 and part.isalpha() and part not in GREEK


# ----------------------------------------------------------------------------------------------------------------------
# The width of mathematics in LaTeX on the page, near enough to break lines.
#
# Estimated in points of Computer Modern at 10 pt for the output of this package: letters, `\frac`, indices,
# parentheses, functions. A width that is a little too large ends a line a little early.


_TOKEN: Final = re.compile(r"\\[A-Za-z]+|\\.|[{}_^]|\s+|.", re.DOTALL)
_LETTER, _DIGIT, _SIGN, _SMALL = 6.0, 5.0, 12.5, 0.75
_WORDS: Final = frozenset("sin cos tan sinh cosh tanh log exp min max arcsin arccos arctan".split())
_BARE: Final = {"left": 0.0, "right": 0.0, ",": 1.7, ";": 2.8, " ": 3.3, "quad": 10.0, "Bigl": 2.0, "Bigr": 2.0}


def latex_width(text: str) -> float:
    """Return the width of mathematics in a line of its own, in points."""
    return _Ruler(_TOKEN.findall(text)).until("")


class _Ruler:
    def __init__(self, tokens: list[str]) -> None:
        self.tokens = tokens
        self.next = 0

    def until(self, closing: str, scale: float = 1.0) -> float:
        """Return the width up to a closing token, and go past that."""
        total = 0.0
        while self.next < len(self.tokens):
            token = self.tokens[self.next]
            self.next += 1
            if token == closing:
                break
            total += self._one(token, scale)
        return total

    def _group(self, scale: float) -> float:
        while self.next < len(self.tokens) and self.tokens[self.next].isspace():
            self.next += 1
        if self.next == len(self.tokens):
            return 0.0
        token = self.tokens[self.next]
        self.next += 1
        return self.until("}", scale) if token == "{" else self._one(token, scale)

    def _one(self, token: str, scale: float) -> float:
        if token == "{":
            return self.until("}", scale)
        if token in ("_", "^"):
            return self._group(_SMALL * scale) + 0.5
        if token.startswith("\\"):
            return self._command(token[1:], scale)
        if token.isspace() or token == "}":
            return 0.0
        return scale * (_SIGN if token in "+-=<>" else _DIGIT if token.isdigit() or token in "().,[]'|" else _LETTER)

    def _command(self, name: str, scale: float) -> float:
        if name == "frac":
            return max(self._group(scale), self._group(scale)) + 2.4
        if name == "sqrt":
            return self._group(scale) + 8.5
        if name in ("text", "mathrm", "operatorname"):
            return 0.82 * self._group(scale) + 1.7
        if name in ("dot", "ddot"):
            return self._group(scale)
        if name in _WORDS:
            return scale * (5.0 * len(name) + 1.7)
        if name in ("le", "ge"):
            return scale * _SIGN
        return scale * _BARE.get(name, _LETTER)
