"""Writers of sympy expressions in a given order of factors and terms: text in the model's language, and LaTeX."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Any, ClassVar, Final, NamedTuple

import sympy

from multibody_sym.algebra.book_form import is_long, nearest_double
from multibody_sym.scalars.sympy_bridge import TableFunction
from multibody_sym.text.printer import is_short_fraction, latex_width

SUM, PRODUCT, POWER, ATOM = 10, 20, 30, 40
_LONGEST_DECIMAL: Final = 12
_LONGEST_DOUBLE: Final = 40
_SPEED, _ACCELERATION, _MULTIPLIER, _FUNCTION = 5, 6, 7, 8
_RANK: Final = {_ACCELERATION: 0, _SPEED: 1, _MULTIPLIER: 3}
"""Terms with accelerations come first, then those with speeds, then those at rest (2), then multipliers."""


class Piece(NamedTuple):
    """A written sub-expression and how strongly its outermost operator binds."""

    text: str
    strength: int


FactorKey = tuple[int, list[tuple[int, int]], bool, str]


def _base(factor: Any) -> Any:
    return factor.base if factor.is_Pow else factor


def is_negative(term: Any) -> bool:
    """Return whether a term is written with a minus sign."""
    return bool(term.as_coeff_Mul()[0] < 0)


class Script(ABC):
    """Writes expressions; scripts differ in how symbols, products, quotients, powers and functions look.

    `spelling` gives each symbol's letters; `places` its kind and number, which order factors and terms (`notation`
    names the kinds).
    """

    plus: ClassVar[str] = "+ "
    minus: ClassVar[str] = "- "
    opposite: ClassVar[str] = "-"
    """The sign between terms, and that before the first."""
    times: ClassVar[str] = "*"
    opening: ClassVar[str] = "("
    """What stands before a sum in a product, and the parenthesis of one that may end in another line."""

    def __init__(self, spelling: Mapping[Any, str], places: Mapping[Any, tuple[int, int]]) -> None:
        self.spelling = spelling
        self.places = places
        self._known: dict[Any, Piece] = {}
        self._keys: dict[Any, FactorKey] = {}

    def shown(self, expression: Any) -> str:
        if isinstance(expression, sympy.MatrixBase):
            return self.matrix([[self.piece(x).text for x in row] for row in expression.tolist()])
        return self.piece(expression if isinstance(expression, sympy.Basic) else sympy.Integer(expression)).text

    def piece(self, e: Any) -> Piece:
        """Return the text of an expression with its strength."""
        if e not in self._known:
            self._known[e] = self._written(e)
        return self._known[e]

    def _written(self, e: Any) -> Piece:
        if e.is_Symbol:
            return Piece(self.spelling.get(e, e.name), ATOM)
        if e.is_Rational or e.is_Float:
            return self._signed(e) if e < 0 else self._quotient_of(e, [])
        if e.is_Add:
            return Piece(" ".join(self.parts(e)), SUM)
        if e.is_Mul or (e.is_Pow and _is_below(e)):
            number, rest = e.as_coeff_Mul()
            return self._signed(e) if number < 0 else self._quotient_of(*self._taken_apart(number, rest))
        if e.is_Pow:
            return self.root(e.base) if e.exp == sympy.S.Half else self.power(e.base, e.exp)
        return self.other(e)

    # --- order -----------------------------------------------------------------------------------------------------

    def kind(self, expression: Any) -> int:
        """Return the highest kind among an expression's symbols."""
        return max((place[0] for place in self._places_in(expression)), default=-1)

    def factors(self, product: Any) -> list[Any]:
        """Return the factors of a product as written: parameters, coordinates, speeds, functions; sums after each."""
        return self._ordered(sympy.Mul.make_args(product))

    def _ordered(self, factors: Sequence[Any]) -> list[Any]:
        """Return factors as written; sums of functions stand behind single ones: r*w*sin(theta)*(1 + cos(theta))."""
        found = sorted(factors, key=self._product_key)
        if not any(_base(factor).is_Function for factor in found):
            return found
        return sorted(found, key=lambda factor: _base(factor).is_Add and factor.has(sympy.Function))

    def _factor_key(self, factor: Any) -> FactorKey:
        if factor not in self._keys:
            base = _base(factor)
            places = self._places_in(factor)
            kind = _FUNCTION if base.is_Function else max((place[0] for place in places), default=-1)
            self._keys[factor] = kind, places, isinstance(base, sympy.cos), self.piece(base).text
        return self._keys[factor]

    def _product_key(self, factor: Any) -> tuple[int, bool, FactorKey]:
        key = self._factor_key(factor)
        return key[0], _base(factor).is_Add, key

    def _places_in(self, expression: Any) -> list[tuple[int, int]]:
        return sorted(self.places.get(s, (-1, 0)) for s in expression.free_symbols)

    def terms(self, total: Any) -> list[Any]:
        """Return the terms of a sum in the order of writing; one without accelerations begins without a minus."""
        terms = sorted(sympy.Add.make_args(total), key=self._term_key)
        if self.kind(terms[0]) == _ACCELERATION:
            return terms
        first = next((k for k, term in enumerate(terms) if not is_negative(term)), 0)
        return [terms[first], *terms[:first], *terms[first + 1 :]]

    def _term_key(self, term: Any) -> tuple[Any, ...]:
        kind = self.kind(term)
        factors = [self._factor_key(f) for f in self.factors(term)]
        rank = _RANK.get(kind, 2)
        fastest = [] if rank == 2 else [place for place in self._places_in(term) if place[0] == kind]
        functions = sum(key[0] == _FUNCTION for key in factors)
        return rank, fastest, functions, factors

    # --- writing ---------------------------------------------------------------------------------------------------

    def within(self, e: Any, strength: int) -> str:
        """Return the text of an expression, in parentheses where it binds more weakly."""
        piece = self.piece(e)
        return piece.text if piece.strength >= strength else self.brackets(piece.text)

    def number(self, digits: str) -> str:
        """Return a number without a sign."""
        return digits

    def parts(self, e: Any) -> list[str]:
        """Return the terms of a sum one by one, each but the first with its sign before it."""
        if not getattr(e, "is_Add", False):
            return [self.shown(e)]
        return [sign + self.within(term, PRODUCT) for sign, term in self._signed_terms(e)]

    def _signed_terms(self, total: Any) -> Iterator[tuple[str, Any]]:
        """Yield what stands before each term of a sum, and the term without its sign."""
        for k, term in enumerate(self.terms(total)):
            negative = is_negative(term)
            sign = (self.minus if negative else self.plus) if k else (self.opposite if negative else "")
            yield sign, -term if negative else term

    # --- lines -----------------------------------------------------------------------------------------------------

    def width(self, written: str) -> float:
        return float(len(written))

    def pieces(self, e: Any, room: float) -> list[str]:
        """Return an expression in pieces between which a line may end.

        They are the terms of a sum; a term wider than `room` is itself taken apart at its widest sum in parentheses.
        """
        if not getattr(e, "is_Add", False):
            if isinstance(e, sympy.MatrixBase):
                return [self.shown(e)]
            return self._split(e if isinstance(e, sympy.Basic) else sympy.Number(e), room, SUM)
        found: list[str] = []
        for sign, term in self._signed_terms(e):
            first, *others = self._split(term, room, PRODUCT)
            found += [sign + first, *others]
        return found

    def _split(self, e: Any, room: float, strength: int) -> list[str]:
        """Return a product in pieces no wider than `room`, as far as the sums in it allow."""
        whole = self.within(e, strength)
        if self.width(whole) <= room or not (e.is_Mul or e.is_Pow):
            return [whole]
        number, rest = e.as_coeff_Mul()
        if number < 0:
            first, *others = self._split(-e, room, PRODUCT)
            return [self.opposite + first, *others]
        number, factors = self._taken_apart(number, rest)
        bases = [(f, *f.as_base_exp()) for f in factors]
        sums = [f for f, base, e in bases if base.is_Add and e.is_Integer and e > 0]
        if not sums:
            return [whole]
        widest = max(sums, key=lambda f: self.width(self.piece(f).text))
        before = self._quotient_of(number, [f for f in factors if f is not widest])
        head = before.text if before.strength >= PRODUCT else self.brackets(before.text)
        base, exponent = widest.as_base_exp()
        inside = self.pieces(base, room - self.width(head))
        inside[0] = ("" if head == "1" else head + self.times) + self.opening + inside[0]
        inside[-1] += self.closing(exponent)
        return inside

    def closing(self, exponent: Any) -> str:
        """Return the parenthesis behind a sum that may have begun in an earlier line, and its power."""
        return ")" if exponent == 1 else f")^{exponent}"

    def _taken_apart(self, number: Any, product: Any) -> tuple[Any, list[Any]]:
        """Return a number and the factors of a product in the order of writing, square roots joined."""
        number, factors = _with_one_root(number, sympy.Mul.make_args(product))
        return number, self._ordered(factors)

    def _signed(self, e: Any) -> Piece:
        return Piece(self.opposite + self.within(-e, PRODUCT), SUM)

    def _quotient_of(self, number: Any, factors: Sequence[Any]) -> Piece:
        above = [f for f in factors if not _is_below(f) and f != 1]
        below = [1 / f for f in factors if _is_below(f)]
        given = Fraction(int(number.p), int(number.q)) if number.is_Rational else Fraction(float(number))
        shown, places = nearest_double(given), _LONGEST_DOUBLE if is_long(given) else _LONGEST_DECIMAL
        number = sympy.Rational(shown.numerator, shown.denominator)
        point = None if is_short_fraction(shown) else decimal(number, places)
        first, divisor = (point, 1) if point else (str(number.p), number.q)
        before = [self.number(first)] if first != "1" or not above else []
        after = [self.number(str(divisor))] if divisor != 1 else []
        if len(before) + len(above) == 1 and not after and not below:
            return Piece(before[0], ATOM) if before else self.piece(above[0])
        return self.quotient(before, above, after, below)

    @abstractmethod
    def quotient(self, before: list[str], above: list[Any], after: list[str], below: list[Any]) -> Piece:
        """Return the product of numbers and factors `above` over that of those `below`."""

    @abstractmethod
    def power(self, base: Any, exponent: Any) -> Piece:
        """Return base^exponent."""

    @abstractmethod
    def root(self, radicand: Any) -> Piece:
        """Return a square root."""

    @abstractmethod
    def other(self, e: Any) -> Piece:
        """Return a function, constant, case distinction or comparison."""

    @abstractmethod
    def brackets(self, text: str) -> str:
        """Return text in parentheses."""

    @abstractmethod
    def matrix(self, rows: list[list[str]]) -> str:
        """Return a matrix of written elements."""


def _with_one_root(number: Any, factors: Sequence[Any]) -> tuple[Any, Sequence[Any]]:
    """Return a number and factors with sqrt(a)*sqrt(b)/sqrt(c) as sqrt(a*b/c), and sqrt(2)/2 in it as sqrt(1/2).

    sympy takes roots apart of what is positive; here at most one radicand is not known to be.
    """
    roots = [f for f in factors if f.is_Pow and abs(f.exp) == sympy.S.Half]
    if len(roots) < 2 or sum(not f.base.is_positive for f in roots) > 1:
        return number, factors
    above, below = ([f.base for f in roots if f.exp == half] for half in (sympy.S.Half, -sympy.S.Half))
    for root in (x for x in above if x.is_Integer and number.is_Rational and number.q % x == 0):
        number, above, below = number * root, [x for x in above if x is not root], [*below, root]
    radicand = sympy.Mul(*above) / sympy.Mul(*below)
    joined = sympy.Pow(radicand, sympy.S.Half, evaluate=False)
    if not above:
        joined = sympy.Pow(sympy.Mul(*below), -sympy.S.Half, evaluate=False)
    return number, [*(f for f in factors if f not in roots), joined]


def _is_below(factor: Any) -> bool:
    return bool(factor.is_Pow and factor.exp.is_Number and factor.exp < 0)


def decimal(value: Any, places: int = _LONGEST_DECIMAL) -> str | None:
    """Return a positive rational as a decimal with fewer than `places` places, None where there is none."""
    for digits in range(places):
        scaled = value * 10**digits
        if scaled.q == 1:
            whole = str(scaled.p).rjust(digits + 1, "0")
            return f"{whole[:-digits]}.{whole[-digits:]}" if digits else whole
    return None


_COMPARISONS: Final = {
    sympy.StrictLessThan: "<", sympy.LessThan: "<=", sympy.StrictGreaterThan: ">", sympy.GreaterThan: ">=",
}
_WORDS: Final = {"Abs": "abs", "Min": "min", "Max": "max"}


class TextScript(Script):
    """Plain text in the model's own language, with primes for rates."""

    def quotient(self, before: list[str], above: list[Any], after: list[str], below: list[Any]) -> Piece:
        divisors = [*after, *(self.within(f, POWER) for f in below)]
        product = "*".join([*before, *(self.within(f, POWER) for f in above)])
        if not divisors:
            return Piece(product, PRODUCT)
        under = divisors[0] if len(divisors) == 1 else self.brackets("*".join(divisors))
        return Piece(f"{product or '1'}/{under}", PRODUCT)

    def power(self, base: Any, exponent: Any) -> Piece:
        return Piece(f"{self.within(base, ATOM)}^{self.within(exponent, ATOM)}", POWER)

    def root(self, radicand: Any) -> Piece:
        return Piece(f"sqrt({self.piece(radicand).text})", ATOM)

    def other(self, e: Any) -> Piece:
        if isinstance(e, sympy.Piecewise):
            (value, condition), rest = e.args[0], e.args[1:]
            if condition == sympy.true or not rest:
                return self.piece(value)
            parts = [self.piece(condition).text, self.piece(value).text, self.piece(sympy.Piecewise(*rest)).text]
            return Piece(f"where({', '.join(parts)})", ATOM)
        if e.func in _COMPARISONS:
            return Piece(f" {_COMPARISONS[e.func]} ".join(self.piece(a).text for a in e.args), SUM)
        name = _WORDS.get(e.func.__name__, e.func.__name__)
        return Piece(f"{name}({', '.join(self.piece(a).text for a in e.args)})" if e.args else str(e), ATOM)

    def brackets(self, text: str) -> str:
        return f"({text})"

    def matrix(self, rows: list[list[str]]) -> str:
        return "[" + "; ".join(", ".join(row) for row in rows) + "]"


_BACKSLASHED: Final = ("sin", "cos", "tan", "sinh", "cosh", "tanh", "log", "exp", "min", "max", "asin", "acos", "atan")
_UPRIGHT: Final = (r"\mathrm{", r"\text{", r"\dot{\mathrm{", r"\dot{\text{")
_LATEX_WORDS: Final = {"asin": r"\arcsin", "acos": r"\arccos", "atan": r"\arctan"} | {
    name: rf"\operatorname{{{word}}}" for name, word in (("asinh", "arsinh"), ("acosh", "arcosh"), ("atanh", "artanh"))
}


class LatexScript(Script):
    """LaTeX for a mathematics environment."""

    times: ClassVar[str] = " "
    opening: ClassVar[str] = r"\Bigl("

    def width(self, written: str) -> float:
        return latex_width(written)

    def closing(self, exponent: Any) -> str:
        return r"\Bigr)" if exponent == 1 else rf"\Bigr)^{{{exponent}}}"

    def quotient(self, before: list[str], above: list[Any], after: list[str], below: list[Any]) -> Piece:
        if not below:
            number = rf"\frac{{{''.join(before) or 1}}}{{{after[0]}}}" if after else "".join(before)
            return Piece(self._side([number] if number else [], above), PRODUCT)
        return Piece(rf"\frac{{{self._side(before, above) or '1'}}}{{{self._side(after, below)}}}", PRODUCT)

    def _side(self, numbers: list[str], factors: list[Any]) -> str:
        alone = len(numbers) + len(factors) == 1
        return " ".join([*numbers, *(self.within(f, SUM if alone else POWER) for f in factors)])

    def power(self, base: Any, exponent: Any) -> Piece:
        raised = self.piece(exponent).text
        if isinstance(base, (sympy.sin, sympy.cos, sympy.tan)):
            return Piece(rf"\{base.func.__name__}^{{{raised}}} {self._argument(base)}", POWER)
        return Piece(f"{self.within(base, ATOM)}^{{{raised}}}", POWER)

    def root(self, radicand: Any) -> Piece:
        return Piece(rf"\sqrt{{{self.piece(radicand).text}}}", ATOM)

    def other(self, e: Any) -> Piece:
        if isinstance(e, sympy.Piecewise):
            cases = []
            for value, condition in e.args:
                when = r"\text{otherwise}" if condition == sympy.true else self.piece(condition).text
                cases.append(f"{self.piece(value).text} & {when}")
            return Piece(r"\begin{cases}" + r" \\ ".join(cases) + r"\end{cases}", ATOM)
        if e.func in _COMPARISONS:
            sign = _COMPARISONS[e.func].replace("<=", r"\le").replace(">=", r"\ge")
            return Piece(f" {sign} ".join(self.piece(a).text for a in e.args), SUM)
        if isinstance(e, sympy.Abs):
            return Piece(rf"\left|{self.piece(e.args[0]).text}\right|", ATOM)
        if not e.args:
            return Piece(r"\pi" if e is sympy.pi else str(e), ATOM)
        return self._function(e)

    def _function(self, e: Any) -> Piece:
        if isinstance(e, TableFunction):
            function, order = e.own
            spelled = (written for s, written in self.spelling.items() if s.name == function.name)
            name = next(spelled, rf"\mathrm{{{function.name}}}") + "'" * order
            return Piece(f"{name}{self.brackets(self.piece(e.args[0]).text)}", POWER)
        word = _WORDS.get(e.func.__name__, e.func.__name__)
        name = _LATEX_WORDS.get(word, f"\\{word}" if word in _BACKSLASHED else rf"\operatorname{{{word}}}")
        return Piece(f"{name} {self._argument(e)}", POWER)

    def _argument(self, e: Any) -> str:
        """Return the argument of a function: a letter alone, words and sums in parentheses."""
        written = ", ".join(self.piece(a).text for a in e.args)
        is_letter = len(e.args) == 1 and e.args[0].is_Symbol and not written.startswith(_UPRIGHT)
        return written if is_letter else self.brackets(written)

    def brackets(self, text: str) -> str:
        return rf"\left({text}\right)"

    def matrix(self, rows: list[list[str]]) -> str:
        return r"\begin{bmatrix}" + r" \\ ".join(" & ".join(row) for row in rows) + r"\end{bmatrix}"
