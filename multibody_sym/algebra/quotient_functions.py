"""Functions of exact quotients: signs, roots, sines and cosines; the exact value of Nodes; linear equations.

In: quotients over one field, or Nodes. Out: quotients, in new letters where a function has no exact value.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from functools import partial
from math import gcd, lcm, log10
from operator import truediv
from typing import Any, Final

from mpmath import MPContext
from sympy.ntheory import factorint

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.inequalities import surely_positive
from multibody_sym.algebra.quotients import (
    PRECISE,
    Field,
    Letter,
    NoClosedFormError,
    Poly,
    Quotient,
    factors_of,
    known_angle,
)
from multibody_sym.algebra.trigonometry import (
    known_power,
    of_hyperbolic,
    of_logarithms,
    square_of_root,
    trigonometric_forms,
)
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import BUILD, postorder
from multibody_sym.scalars.node import PI, TWO, ZERO, Node, multiply, symbol
from multibody_sym.scalars.tabulated import Tabulated

_HIGHEST_MULTIPLE: Final = 12
_LONGEST_FACTORED: Final = 60
_ON_TURN: Final = PRECISE.mpf(10) ** -40


# --- signs ---------------------------------------------------------------------------------------------------------


def sign(a: Quotient) -> int:
    """Return the sign of a at the sample (0 only for the constant 0), and note in the field on which signs it rests."""
    if a.is_zero:
        return 0
    if a.vanishes:
        raise NoClosedFormError("a sign changes at the given values")
    field = a.field
    for p in (a.above, a.below):
        factors = [(p, 1)] if len(p) > _LONGEST_FACTORED else factors_of(p)[1]
        for factor, exponent in factors:
            if exponent % 2 == 0:
                continue
            positive = field.whole(field.in_ring(factor))
            positive = positive if positive.sample > 0 else -positive
            if not surely_positive(positive) and not any((positive - other).is_zero for other in field.positive):
                field.positive.append(positive)
    return 1 if a.sample > 0 else -1


def absolute(a: Quotient) -> Quotient:
    """Return |a|, with the sign that a has at the sample."""
    return a * sign(a)


# --- roots ---------------------------------------------------------------------------------------------------------


def sqrt(a: Quotient) -> Quotient:
    """Return the square root of a: squares leave it, each factor that stays becomes a letter."""
    if a.is_zero:
        return a
    if a.sample < 0:
        raise NoClosedFormError("the square root of a negative number")
    field = a.field
    product = a.above * a.below
    if len(product) > _LONGEST_FACTORED:
        raise NoClosedFormError("a root's radicand is too long")
    splits = [_split(field, form) for form in trigonometric_forms(field, product)]
    outside, inside = min(splits, key=lambda split: sum(len(p) for p in split[1]))
    root = absolute(outside / field.whole(a.below))
    for factor in inside:
        root = root * _root(field, factor)
    return root


def _split(field: Field, p: Poly) -> tuple[Quotient, list[Poly]]:
    """Return (s, factors) with p = s^2 times the factors, positive at the sample; a large number may stay whole."""
    content, factors = factors_of(p)
    outside, rest = 1, []
    number = abs(int(content))
    for prime, exponent in factorint(number, limit=10**5).items() if number else ():
        outside *= prime ** (exponent // 2)
        rest += [field.ring(prime)] if exponent % 2 else []
    root = field.constant(outside)
    for factor, multiplicity in factors:
        root = root * field.whole(field.reduced(factor)).power(multiplicity // 2)
        if multiplicity % 2:
            rest.append(factor if field.value(factor) > 0 else -factor)
    return root, rest


def _root(field: Field, radicand: Poly) -> Quotient:
    """Return the letter for the root of a prime or of a polynomial that is no product."""
    radicand = field.reduced(radicand)
    terms = frozenset((tuple((k, e) for k, e in enumerate(m) if e), int(c)) for m, c in radicand.items())
    return field.letter(("root", terms), Letter(None, PRECISE.sqrt(field.value(radicand)), True, radicand))


# --- sines and cosines ---------------------------------------------------------------------------------------------

_SQUARED_SINES: Final = {
    Fraction(0): Fraction(0),
    Fraction(1, 6): Fraction(1, 4),
    Fraction(1, 4): Fraction(1, 2),
    Fraction(1, 3): Fraction(3, 4),
    Fraction(1, 2): Fraction(1),
}
"""sin^2 of these multiples of pi."""


def sine_and_cosine(angle: Quotient) -> tuple[Quotient, Quotient]:
    """Return (sin, cos) of an angle: sums and whole multiples written out, exact numbers where there are any."""
    field = angle.field
    sine, cosine = field.constant(0), field.constant(1)
    for base, multiple in _parts(angle):
        field.multiples.setdefault(book_form(base), set()).add(abs(multiple))
        one_sine, one_cosine = _base_letters(base)
        s, c = field.constant(0), field.constant(1)
        for _ in range(abs(multiple)):
            s, c = s * one_cosine + c * one_sine, c * one_cosine - s * one_sine
        s = s if multiple > 0 else -s
        sine, cosine = sine * c + cosine * s, cosine * c - sine * s
    return sine, cosine


def _parts(angle: Quotient) -> Iterable[tuple[Quotient, int]]:
    """Return an angle as whole multiples of base angles: its constant part and the rest, or term by term.

    Base angles are constants, such as a multiple of pi, angles such as acos(x), and whatever is no polynomial.
    """
    field = angle.field
    if not angle.below.is_ground:
        return [(angle, 1)]
    terms = {m: Fraction(int(c), int(angle.below.LC)) for m, c in field.in_ring(angle.above).items()}
    constant = {m: c for m, c in terms.items() if sum(m) == m[0] <= 1}
    inverse = {
        m: c
        for m, c in terms.items()
        if c.denominator == 1 and sum(m) == 1 and field.letters[m.index(1)].node in field.inverses
    }
    rest = {m: c for m, c in terms.items() if m not in constant and m not in inverse}
    alone = [{m: c} for m, c in (*constant.items(), *inverse.items())]
    parts = [*alone, *([{m: c} for m, c in rest.items()] if field.expands else [rest])]
    return [_multiple_of(field, part, part.keys() <= constant.keys()) for part in parts if part]


def _multiple_of(field: Field, terms: dict[tuple[int, ...], Fraction], constant: bool) -> tuple[Quotient, int]:
    """Return an angle as (base angle, whole number)."""
    below = lcm(*(c.denominator for c in terms.values()))
    above = {m: int(c * below) for m, c in terms.items()}
    whole = 1 if constant else gcd(*above.values())
    whole = 1 if whole > _HIGHEST_MULTIPLE else whole
    first = min(above, key=lambda m: [str(field.letters[k].node) for k, e in enumerate(m) if e])
    whole = whole if above[first] > 0 else -whole
    base = field.ring.from_dict({m: c // whole for m, c in above.items()})
    return field.whole(base) / below, whole


def _base_letters(angle: Quotient) -> tuple[Quotient, Quotient]:
    """Return (sin, cos) of a base angle: exact numbers, those of twice the half angle, or two letters."""
    field, node = angle.field, book_form(angle)
    if node is PI:
        return _of_half_turns(field, Fraction(1))
    if node.op == "mul" and node.args[1] is PI and node.args[0].op == "number":
        return _of_half_turns(field, Fraction(node.args[0].data))
    half = book_form(angle / 2)
    if field.position(("cos", half)) is not None:
        s, c = _base_letters(angle / 2)
        return 2 * s * c, 2 * c * c - 1
    if node in field.inverses:
        return _of_inverse(node.op, *field.inverses[node])
    field.arguments[node] = angle
    return _new_letters(field, node, PRECISE.sin(angle.sample), PRECISE.cos(angle.sample))


def _of_inverse(op: str, *arguments: Quotient) -> tuple[Quotient, Quotient]:
    """Return (sin, cos) of asin x, acos x, atan x or atan2(y, x)."""
    y, x = (arguments[0], arguments[-1]) if op == "atan2" else (arguments[0], arguments[0].field.constant(1))
    if op not in ("asin", "acos"):
        length = sqrt(x * x + y * y)
        return y / length, x / length
    # sqrt(1 - y^2) is under one root where no square leaves it, not sqrt(1 - y) sqrt(1 + y)
    field = y.field
    radicand = field.reduced(y.below * y.below - y.above * y.above)
    if radicand.is_ground or field.value(radicand) <= 0 or any(e > 1 for _, e in factors_of(radicand)[1]):
        other = sqrt(-(y * y) + 1)
    else:
        other = _root(field, radicand) / absolute(field.whole(y.below))
    return (y, other) if op == "asin" else (other, y)


def _new_letters(field: Field, angle: Node, sine: Any, cosine: Any) -> tuple[Quotient, Quotient]:
    """Return the letters for (sin, cos) of an angle, given their values at the sample."""
    letter = field.letter(("cos", angle), Letter(BUILD["cos"](angle), cosine))
    of_sine = Letter(BUILD["sin"](angle), sine, square=1 - letter.above**2, cosine=field.position(("cos", angle)))
    return field.letter(("sin", angle), of_sine), letter


def _of_half_turns(field: Field, turns: Fraction) -> tuple[Quotient, Quotient]:
    """Return (sin, cos) of turns x pi: numbers at multiples of 30 and 45 degrees, else those of the first quadrant."""
    quarters, rest = divmod(turns * 2, 1)
    if rest / 2 in _SQUARED_SINES:
        s, c = (sqrt(field.constant(_SQUARED_SINES[x])) for x in (rest / 2, (1 - rest) / 2))
    else:
        angle = field.letter(PI, field.letters[0]) * field.constant(rest / 2)
        s, c = _new_letters(field, book_form(angle), PRECISE.sin(angle.sample), PRECISE.cos(angle.sample))
    for _ in range(int(quarters) % 4):
        s, c = c, -s
    return s, c


def with_whole_angles(a: Quotient) -> Quotient:
    """Return a quotient with whole angles in place of half angles that come in pairs only.

    sin x cos x = sin 2x / 2, cos^2 x = (1 + cos 2x) / 2, for letters such as sin(a/2). So x stands for (x^(1/3))^3.
    """
    a = _with_whole_powers(a)
    field = a.field
    for k, letter in enumerate(list(field.letters)):
        if letter.cosine is None or letter.node is None:
            continue
        angle = letter.node.args[0]
        factor = angle.args[0] if angle.op == "mul" else angle
        if factor.op == "number" and Fraction(factor.data).denominator % 2 == 0 and angle.shadow is None:
            polynomials = [field.in_ring(p) for p in (a.above, a.below)]
            degrees = [m[k] + m[letter.cosine] for p in polynomials for m in p]
            if any(degrees) and not any(degree % 2 for degree in degrees):
                above, below = (_with_double_angle(field, p, k, letter.cosine) for p in polynomials)
                a = above / below
    return a


def book_node(a: Quotient) -> Node:
    """Return a quotient in the shortest of its forms, with whole angles. Raises NoClosedFormError as book_form does."""
    return book_form(with_whole_angles(a))


def _with_whole_powers(a: Quotient) -> Quotient:
    """Return a quotient with x in place of (x^(1/3))^3."""
    field = a.field
    for node, base in field.bases.items():
        k, exponent = field.position(node), node.args[1].data
        polynomials = [field.in_ring(p) for p in (a.above, a.below)]
        if k is None or all(m[k] < exponent.denominator for p in polynomials for m in p):
            continue
        totals = []
        for p in polynomials:
            total = field.constant(0)
            for m, coefficient in p.items():
                times, left = divmod(m[k], exponent.denominator)
                rest = field.whole(field.ring.from_dict({(*m[:k], left, *m[k + 1 :]): coefficient}))
                total = total + rest * base.power(times * exponent.numerator)
            totals.append(total)
        a = totals[0] / totals[1]
    return a


def _with_double_angle(field: Field, p: Poly, s: int, c: int) -> Quotient:
    sine, cosine = field.letters[s], field.letters[c]
    assert sine.node is not None
    samples = 2 * sine.sample * cosine.sample, 2 * cosine.sample**2 - 1
    angle = multiply(TWO, sine.node.args[0])
    known = field.inverses.get(angle)
    sin_2x, cos_2x = _new_letters(field, angle, *samples) if known is None else _of_inverse(angle.op, *known)
    total = field.constant(0)
    for m, coefficient in field.in_ring(p).items():
        rest = {tuple(0 if k in (s, c) else e for k, e in enumerate(m)): coefficient}
        pairs = ((1 + cos_2x) / 2).power((m[c] - m[s]) // 2)
        total = total + field.whole(field.ring.from_dict(rest)) * pairs * (sin_2x / 2).power(m[s])
    return total


# --- Nodes ---------------------------------------------------------------------------------------------------------


def exact(field: Field, nodes: Iterable[Node], known: dict[Node, Quotient]) -> list[Quotient]:
    """Return Nodes over the field; `known` holds the values of symbols and slots, and takes in those of all Nodes.

    Raises NoClosedFormError where a choice (a sign, a divisor) is undecided at the sample, or the work has run out.
    """
    roots = list(nodes)
    powers = [n for n in postorder(roots) if n.op == "exp" and n not in known]
    if len(powers) > 1:  # the smallest exponents first: exp(2 x) then follows from exp(x)
        exponents = exact(field, [n.args[0] for n in powers], known)
        for n, exponent in sorted(zip(powers, exponents, strict=True), key=lambda pair: abs(pair[1].sample)):
            known[n] = _exp(exponent)
    for n in postorder(roots):
        if n in known:
            continue
        if n.op == "number":
            known[n] = field.constant(n.data)
        elif n.op == "real":
            known[n] = field.constant(Fraction(repr(n.data)))
        elif n is PI:
            known[n] = field.letter(PI, field.letters[0])
        else:
            known[n] = _OPERATIONS[n.op](*n.own, *(known[a] for a in n.args))
    return [known[root] for root in roots]


def register_angles(field: Field, nodes: Iterable[Node], known: dict[Node, Quotient]) -> None:
    """Make letters for the sines of all angles in Nodes, the smallest parts first: sin a then follows from a / 2."""
    nodes_of_angles = dict.fromkeys(n.args[0] for n in postorder(nodes) if n.op in ("sin", "cos", "tan"))
    angles = exact(field, nodes_of_angles, known)
    for angle in sorted(angles, key=lambda x: -int(x.below.LC) if x.below.is_ground else 0):
        sine_and_cosine(angle)


def _power(a: Quotient, b: Quotient) -> Quotient:
    if b.above.is_ground and b.below.is_ground:
        exponent = Fraction(int(b.above.LC if b.above else 0), int(b.below.LC))
        if exponent.denominator <= 2:
            base = a if exponent.denominator == 1 else sqrt(a)
            return base.power(exponent.numerator)
    whole = Fraction(int(b.above.coeff(1)), int(b.below.LC)) if b.below.is_ground else Fraction(0)
    if whole and whole.denominator == 1 and not a.vanishes:  # a^(n + 1) is a a^n, so that such powers cancel
        return a.power(int(whole)) * _power(a, b - int(whole))
    return _opaque("pow", a, b)


def odd_root(a: Quotient, n: int) -> Quotient:
    """Return the real n-th root of a quotient, n odd, by its sign at the sample."""
    side = sign(a)
    return a * 0 if side == 0 else _power(a * side, a.field.constant(Fraction(1, n))) * side


def _part_of_turn(op: str, *arguments: Quotient) -> Quotient | None:
    """Return an angle such as atan2(1, 0) that is a multiple of pi / 12, by its exact sine and cosine; else None."""
    field = arguments[0].field
    parts = 12 * _PRECISE_OPERATIONS[op](*(a.sample for a in arguments)) / PRECISE.pi
    if isinstance(parts, PRECISE.mpc) or abs(parts - PRECISE.nint(parts)) > _ON_TURN:
        return None
    angle = field.letter(PI, field.letters[0]) * field.constant(Fraction(int(PRECISE.nint(parts)), 12))
    sine, cosine = sine_and_cosine(angle)
    y, x = arguments[0], arguments[-1] if op == "atan2" else field.constant(1)
    apart = {"asin": y - sine, "acos": y - cosine}.get(op, y * cosine - x * sine)
    return angle if apart.is_zero else None


def _of_wave(op: str, a: Quotient) -> Quotient | None:
    """Return asin(sin(x)) and the like as the angle x, plus turns by the sample; None of another argument."""
    field = a.field
    if op not in ("asin", "acos") or len(a.above) != 1 or not a.below.is_ground:
        return None
    for s, letter in enumerate(list(field.letters)):
        if letter.cosine is None:
            continue
        waves = [field.whole(field.ring.gens[k]) for k in (s, letter.cosine)]
        for wave, other in (waves, reversed(waves)):
            if (a - wave).is_zero or (a + wave).is_zero:
                size = absolute(other)
                return _angle_of(a, size) if op == "asin" else _angle_of(size, a)
    return None


def _opaque(op: str, *arguments: Quotient) -> Quotient:
    inverse = op in ("asin", "acos", "atan", "atan2")
    if inverse:
        known = _part_of_turn(op, *arguments) or _of_wave(op, arguments[0])
    else:
        known = of_hyperbolic(op, arguments[0], sqrt)
    if known is not None:
        return known
    arguments = tuple(map(_with_whole_powers, arguments))
    node, sample = BUILD[op](*map(book_form, arguments)), _PRECISE_OPERATIONS[op](*(a.sample for a in arguments))
    if isinstance(sample, PRECISE.mpc):
        raise NoClosedFormError(f"{op} has no real value")
    if op == "pow" and node.op == "pow" and node.args[1].op == "number":
        arguments[0].field.bases[node] = arguments[0]
    if inverse:
        arguments[0].field.inverses[node] = arguments
    if op in ("exp", "log"):
        field = arguments[0].field
        (field.arguments if op == "exp" else field.logarithms)[node] = arguments[0]
    return arguments[0].field.letter(node, Letter(node, sample, op == "exp"))


def _exp(a: Quotient) -> Quotient:
    power, rest = of_logarithms(a)
    square, left = of_logarithms(rest + rest)
    if left.is_zero:  # halves of logarithms
        return power * sqrt(square)
    return power * (known_power(rest) or _opaque("exp", rest))


def _log(a: Quotient) -> Quotient:
    if not a.below.is_ground and a.above.is_ground and abs(int(a.above.LC)) == 1:
        return -_log(a.power(-1))
    square = square_of_root(a)
    return _opaque("log", a) if square is None else _log(square) / 2


def _angle_of(y: Quotient, x: Quotient) -> Quotient:
    """Return atan2(y, x): a multiple of a right angle, or the angle of which these are sine and cosine."""
    field = y.field
    if y.is_zero and not x.is_zero:
        return exact(field, [PI if sign(x) < 0 else ZERO], {})[0]
    if x.is_zero and not y.is_zero:
        return exact(field, [PI / 2], {})[0] * sign(y)
    angle = known_angle(y, x)
    if angle is None:
        return _opaque("atan2", y, x)
    letters = {x.node: x for x in field.letters if x.node is not None and not x.node.args}
    found, turn = exact(field, [angle, 2 * PI], {node: field.letter(node, x) for node, x in letters.items()})
    return found + turn * int(PRECISE.nint((PRECISE.atan2(y.sample, x.sample) - found.sample) / turn.sample))


def _table_piece(function: Tabulated, order: int, a: Quotient) -> Quotient:
    """Return the polynomial of a table at the sample, and note in the field between which rows it holds."""
    x = symbol("x")
    for edge in function.edges(float(a.sample)):
        sign(a - a.field.constant(Fraction(repr(edge))))
    return exact(a.field, [function.piece(order, float(a.sample), x)], {x: a})[0]


_PRECISE_OPERATIONS: Final[dict[str, Callable[..., Any]]] = {
    "pow": PRECISE.power, "asin": PRECISE.asin, "acos": PRECISE.acos, "atan": PRECISE.atan, "atan2": PRECISE.atan2,
    "sinh": PRECISE.sinh, "cosh": PRECISE.cosh, "tanh": PRECISE.tanh, "exp": PRECISE.exp, "log": PRECISE.log,
}  # fmt: skip

def _inverse_hyperbolic(op: str, a: Quotient) -> Quotient:
    """Return asinh, acosh or atanh of a as a logarithm."""
    if op == "atanh":
        return _log((a + 1) / (-a + 1)) / 2
    return _log(a + sqrt(a * a + (1 if op == "asinh" else -1)))


_OPERATIONS: Final[dict[str, Callable[..., Quotient]]] = {
    **{op: partial(_opaque, op) for op in _PRECISE_OPERATIONS},
    "atan2": _angle_of,
    "exp": _exp,
    "log": _log,
    **{op: partial(_inverse_hyperbolic, op) for op in ("asinh", "acosh", "atanh")},
    "neg": lambda a: -a,
    "add": lambda a, b: a + b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b,
    "pow": _power,
    "sqrt": sqrt,
    "sin": lambda a: sine_and_cosine(a)[0],
    "cos": lambda a: sine_and_cosine(a)[1],
    "tan": lambda a: truediv(*sine_and_cosine(a)),
    "abs": absolute,
    "sign": lambda a: a.field.constant(sign(a)),
    "min": lambda a, b: a if sign(b - a) >= 0 else b,
    "max": lambda a, b: a if sign(a - b) >= 0 else b,
    "less": lambda a, b: a.field.constant(int(sign(b - a) > 0)),
    "less_equal": lambda a, b: a.field.constant(int(sign(b - a) >= 0)),
    "where": lambda c, a, b: b if c.is_zero else a,
    "table": _table_piece,
}


# ----------------------------------------------------------------------------------------------------------------------
# The sign of a quotient at the sample, decided exactly: by 50 digits, and where 40 of these are zero by proof.
#
# For the proof it is written in the exact values of its letters. A sum of products of integers, roots and sines of
# rational multiples of pi is an algebraic integer of known degree D, and so are its conjugates, none of which exceeds a
# computable number U. Their product is a whole number, hence a value that is not zero is at least 1 / U^(D - 1): so
# many digits decide. (A minimal polynomial decides the same, but not for such degrees.)


_UNDECIDED: Final = PRECISE.mpf(10) ** -40
_WORK: Final = 10_000
_MOST_DIGITS: Final = 20_000
_SPARE_DIGITS: Final = 20


def decided_sign(a: Quotient, values: Mapping[Node, Node]) -> int | None:
    """Return the sign of a quotient where its symbols have exact `values`; None where it is not decided."""
    if a.is_zero:
        return 0
    field = a.field
    terms = (abs(field.value(field.ring.from_dict({m: c}))) for m, c in field.in_ring(a.above).items())
    size = sum(terms, PRECISE.mpf(0)) / abs(field.value(a.below))
    if abs(a.sample) > _UNDECIDED * size:
        return 1 if a.sample > 0 else -1
    if not a.symbols <= values.keys():
        return None
    try:
        # its symbols' values put in, in a field of numbers
        there = Field(_WORK)
        known = dict(zip(values, exact(there, values.values(), {}), strict=True))
        letters: dict[int, Quotient] = {}
        for k in sorted(_letters_in(a.field, a.above)):
            node = a.field.letters[k].node
            if node is None:
                letters[k] = sqrt(_value(there, a.field.letters[k].square, letters))
            else:
                (letters[k],) = exact(there, [node], known)
        value = _value(there, a.above, letters)
    except NoClosedFormError:
        return None
    return 0 if value.is_zero or _is_zero(value.field, value.above) else None


def _value(field: Field, p: Poly, letters: Mapping[int, Quotient]) -> Quotient:
    total = field.constant(0)
    for m, c in p.items():
        term = field.constant(int(c))
        for k, e in enumerate(m):
            term = term * letters[k].power(e) if e else term
        total = total + term
    return total


def _is_zero(field: Field, p: Poly) -> bool:
    """Return whether a polynomial of roots and sines is zero by its bound; False also where this is not decided."""
    letters = [field.letters[k] for k in _letters_in(field, p)]
    turns = [_half_turns(letter.node) for letter in letters if letter.node is not None]
    algebraic = [x for x in turns if x is not None]
    if len(algebraic) < len(turns):
        return False
    # each root doubles the degree; sines of multiples of pi/n lie in the field of one root of unity, the (4n)-th
    degree = int(2 ** (len(letters) - len(turns)) * 4 * lcm(*(x.denominator for x in algebraic)))
    halves = max((sum(m) for m in p), default=0)
    digits = degree * (log10(1 + _largest(field, p)) + halves * log10(2)) + _SPARE_DIGITS
    if digits > _MOST_DIGITS:
        return False
    context = MPContext()
    context.dps = int(digits) + _SPARE_DIGITS
    return bool(abs(_precise(field, p, context)) < context.mpf(10) ** -int(digits))


def _letters_in(field: Field, p: Poly) -> set[int]:
    """Return the places of the letters of a polynomial and of the radicands in it."""
    waiting, seen = [p], set[int]()
    while waiting:
        for m in waiting.pop():
            new = {k for k, e in enumerate(m) if e} - seen
            seen |= new
            waiting += [field.letters[k].square for k in new if field.letters[k].node is None]
    return seen


def _half_turns(node: Node) -> Fraction | None:
    """Return x of sin(x pi) or cos(x pi), a rational number."""
    if node.op not in ("sin", "cos"):
        return None
    angle = exact(Field(_WORK), node.args, {})[0]
    is_multiple = angle.below.is_ground and all(m[0] == 1 == sum(m) for m in angle.above)
    return Fraction(int(angle.above.LC), int(angle.below.LC)) if is_multiple else None


def _largest(field: Field, p: Poly) -> float:
    """Return a bound of all conjugates: each root at most the root of its radicand's bound, each sine at most 1."""
    total = 0.0
    for m, c in p.items():
        term = float(abs(int(c)))
        for k, e in enumerate(m):
            if e and field.letters[k].node is None:
                term *= max(1.0, _largest(field, field.letters[k].square)) ** (e / 2)
        total += term
    return total


def _precise(field: Field, p: Poly, context: Any) -> Any:
    """Return a polynomial's value in a context of many digits."""
    total = context.mpf(0)
    for m, c in p.items():
        term = context.mpf(int(c))
        for k, e in enumerate(m):
            if not e:
                continue
            letter = field.letters[k]
            if letter.node is None:
                value = context.sqrt(_precise(field, letter.square, context))
            else:
                turns = _half_turns(letter.node)
                assert turns is not None
                function = context.sinpi if letter.node.op == "sin" else context.cospi
                value = function(context.mpf(turns.numerator) / turns.denominator)
            term *= value**e
        total += term
    return total


# ----------------------------------------------------------------------------------------------------------------------
# Linear equations over exact quotients, by elimination with pivots that do not vanish at the sample.


_PIVOT: Final = 1e-8
"""The part of an equation's largest coefficient below which another one may vanish at a sample of doubles."""


@dataclass
class _Equation:
    """sum coefficients[k] x_k = right, zero coefficients left out."""

    coefficients: dict[int, Quotient]
    right: Quotient

    def __post_init__(self) -> None:
        self.size: Any = max((abs(a.sample) for a in self.coefficients.values()), default=0)
        """The largest size of a coefficient at the sample, as the equation was given."""


def exact_solve(matrix: Sequence[Sequence[Quotient]], right: Sequence[Quotient]) -> list[Quotient]:
    """Return x with matrix x = right; unknowns that dependent equations leave open are 0.

    No equations have no unknowns. Raises NoClosedFormError where equations contradict, or depend on each other at the
    sample only.
    """
    done, waiting = _eliminate(matrix, right)
    if any(equation.coefficients or not equation.right.is_zero for equation in waiting):
        raise NoClosedFormError("at the given values the equations depend on each other, which they do not in general")
    x = [right[0].field.constant(0)] * len(matrix[0]) if matrix else []
    for k, equation in reversed(done):
        rest = equation.right
        for j, a in equation.coefficients.items():
            if j != k:
                rest = rest - a * x[j]
        x[k] = rest / equation.coefficients[k]
    return x


def conditions_left(matrix: Sequence[Sequence[Quotient]], right: Sequence[Quotient]) -> list[Quotient]:
    """Return the right sides that must vanish for matrix x = right to have a solution.

    Raises NoClosedFormError where equations depend on each other at the sample only.
    """
    waiting = _eliminate(matrix, right, _PIVOT)[1]
    if any(equation.coefficients for equation in waiting):
        raise NoClosedFormError("at the given values the equations depend on each other, which they do not in general")
    return [equation.right for equation in waiting if not equation.right.is_zero]


def _eliminate(
    matrix: Sequence[Sequence[Quotient]], right: Sequence[Quotient], least: float = 0.0
) -> tuple[list[tuple[int, _Equation]], list[_Equation]]:
    """Return the equations that give an unknown each, and those that are left over.

    No pivot is less than the part `least` of the largest entry of its equation.
    """
    waiting = [
        _Equation({k: a for k, a in enumerate(row) if not a.is_zero}, r) for row, r in zip(matrix, right, strict=True)
    ]
    done: list[tuple[int, _Equation]] = []
    while (pivot := _pivot(waiting, least)) is not None:
        equation, k = pivot
        waiting.remove(equation)
        for other in waiting:
            if k not in other.coefficients:
                continue
            factor = other.coefficients.pop(k) / equation.coefficients[k]
            for j, a in equation.coefficients.items():
                if j == k:
                    continue
                changed = other.coefficients[j] - factor * a if j in other.coefficients else -(factor * a)
                if changed.is_zero:
                    other.coefficients.pop(j, None)
                else:
                    other.coefficients[j] = changed
            other.right = other.right - factor * equation.right
        done.append((k, equation))
    return done, waiting


def _pivot(waiting: Sequence[_Equation], least: float) -> tuple[_Equation, int] | None:
    """Return the entry that fills in least (Markowitz), among equals the shortest."""
    uses: dict[int, int] = {}
    for equation in waiting:
        for k in equation.coefficients:
            uses[k] = uses.get(k, 0) + 1
    entries = [
        (a.size > 2, (len(equation.coefficients) - 1) * (uses[k] - 1), a.size, i, k)
        for i, equation in enumerate(waiting)
        for k, a in equation.coefficients.items()
        if not a.vanishes and abs(a.sample) >= least * equation.size
    ]
    if not entries:
        return None
    _, _, _, i, k = min(entries)
    return waiting[i], k
