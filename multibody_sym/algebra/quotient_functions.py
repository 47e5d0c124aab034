"""Functions of exact quotients: signs, roots, sines and cosines; and the exact value of Nodes."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fractions import Fraction
from functools import partial
from math import gcd, lcm
from operator import truediv
from typing import Any, Final

from sympy.ntheory import factorint

from multibody_sym.algebra.angles.exponentials import known_power, of_hyperbolic, of_logarithms, square_of_root
from multibody_sym.algebra.angles.squares import trigonometric_forms
from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.factors import Poly, factored
from multibody_sym.algebra.positivity import surely_positive
from multibody_sym.algebra.quotients import PRECISE, Field, Letter, NoClosedFormError, Quotient, known_angle
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.node import PI, TWO, ZERO, Node, multiply, symbol
from multibody_sym.scalars.rows import Tabulated
from multibody_sym.scalars.traversal import postorder

_HIGHEST_MULTIPLE: Final = 12
_LONGEST_FACTORED: Final = 60
_ON_TURN: Final = PRECISE.mpf(10) ** -40


# --- signs ---------------------------------------------------------------------------------------------------------


def sign(a: Quotient) -> int:
    """Return the sign of a at the sample (0 only for the constant 0), and note in the field what it rests on."""
    if a.is_zero:
        return 0
    if a.vanishes:
        raise NoClosedFormError("a sign changes at the given values")
    field = a.field
    for p in (a.above, a.below):
        factors = [(p, 1)] if len(p) > _LONGEST_FACTORED else factored(p)[1]
        for factor, exponent in factors:
            if exponent % 2:
                _note_positive(field.whole(field.in_ring(factor)))
    return 1 if a.sample > 0 else -1


def _note_positive(a: Quotient) -> None:
    """Add a or -a to the signs that are taken for granted, unless it is positive whatever its letters are."""
    positive = a if a.sample > 0 else -a
    known = a.field.positive
    if not surely_positive(positive) and not any((positive - other).is_zero for other in known):
        known.append(positive)


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
    """Return (s, factors) with p = s^2 times the factors, each positive at the sample."""
    content, factors = factored(p)
    outside, primes = _square_part(abs(int(content)))
    root, rest = field.constant(outside), [field.ring(prime) for prime in primes]
    for factor, multiplicity in factors:
        root = root * field.whole(field.reduced(factor)).power(multiplicity // 2)
        if multiplicity % 2:
            rest.append(factor if field.value(factor) > 0 else -factor)
    return root, rest


def _square_part(n: int) -> tuple[int, list[int]]:
    """Return (s, primes) with n = s^2 times the primes; a large n without small factors stays whole."""
    if n == 0:
        return 1, []
    outside, rest = 1, []
    for prime, exponent in factorint(n, limit=10**5).items():
        outside *= prime ** (exponent // 2)
        if exponent % 2:
            rest.append(prime)
    return outside, rest


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
        s, c = _multiple(*_letters(base), multiple)
        sine, cosine = sine * c + cosine * s, cosine * c - sine * s
    return sine, cosine


def _parts(angle: Quotient) -> Iterable[tuple[Quotient, int]]:
    """Return an angle as whole multiples of base angles: its constant part and the rest, or term by term.

    A constant, such as a multiple of pi, is a base angle; so are acos(x) and its like, and whatever is no polynomial.
    """
    field = angle.field
    if not angle.below.is_ground:
        return [(angle, 1)]
    terms = {m: Fraction(int(c), int(angle.below.LC)) for m, c in field.in_ring(angle.above).items()}
    constant = {m: c for m, c in terms.items() if sum(m) == m[0] <= 1}
    inverse = {m: c for m, c in terms.items() if c.denominator == 1 and _is_inverse(field, m)}
    rest = {m: c for m, c in terms.items() if m not in constant and m not in inverse}
    alone = [{m: c} for m, c in (*constant.items(), *inverse.items())]
    parts = [*alone, *([{m: c} for m, c in rest.items()] if field.expands else [rest])]
    return [_multiple_of(field, part, part.keys() <= constant.keys()) for part in parts if part]


def _is_inverse(field: Field, m: tuple[int, ...]) -> bool:
    """Return whether a monomial is nothing but an angle such as acos(x)."""
    return sum(m) == 1 and field.letters[m.index(1)].node in field.inverses


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


def _letters(angle: Quotient) -> tuple[Quotient, Quotient]:
    """Return (sin, cos) of a base angle: numbers where there are any, those of twice the half angle, or two letters."""
    field, node = angle.field, book_form(angle)
    turns = _turns(node)
    if turns is not None:
        return _turned(field, turns)
    half = book_form(angle / 2)
    if field.position(("cos", half)) is not None:
        s, c = _letters(angle / 2)
        return 2 * s * c, 2 * c * c - 1
    if node in field.inverses:
        return _of_inverse(node.op, *field.inverses[node])
    field.arguments[node] = angle
    return _new_letters(field, node, PRECISE.sin(angle.sample), PRECISE.cos(angle.sample))


def _of_inverse(op: str, *arguments: Quotient) -> tuple[Quotient, Quotient]:
    """Return (sin, cos) of asin x, acos x, atan x or atan2(y, x)."""
    y, x = (arguments[0], arguments[-1]) if op == "atan2" else (arguments[0], arguments[0].field.constant(1))
    if op in ("asin", "acos"):
        across = _across(y)
        return (y, across) if op == "asin" else (across, y)
    length = sqrt(x * x + y * y)
    return y / length, x / length


def _across(a: Quotient) -> Quotient:
    """Return sqrt(1 - a^2), under one root where no square leaves it: sqrt(1 - x^2), not sqrt(1 - x) sqrt(1 + x)."""
    field = a.field
    radicand = field.reduced(a.below * a.below - a.above * a.above)
    if radicand.is_ground or field.value(radicand) <= 0 or any(e > 1 for _, e in factored(radicand)[1]):
        return sqrt(-(a * a) + 1)
    return _root(field, radicand) / absolute(field.whole(a.below))


def _new_letters(field: Field, angle: Node, sine: Any, cosine: Any) -> tuple[Quotient, Quotient]:
    """Return the letters for (sin, cos) of an angle, given their values at the sample."""
    letter = field.letter(("cos", angle), Letter(BUILD["cos"](angle), cosine))
    square = 1 - letter.above**2
    made = Letter(BUILD["sin"](angle), sine, square=square, cosine=field.position(("cos", angle)))
    return field.letter(("sin", angle), made), letter


def _turns(angle: Node) -> Fraction | None:
    """Return angle / pi where it is a rational multiple of pi."""
    if angle.op == "mul" and angle.args[1] is PI and angle.args[0].op == "number":
        return Fraction(angle.args[0].data)
    return Fraction(1) if angle is PI else None


def _turned(field: Field, turns: Fraction) -> tuple[Quotient, Quotient]:
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


def _multiple(sine: Quotient, cosine: Quotient, n: int) -> tuple[Quotient, Quotient]:
    """Return (sin, cos) of n times the angle."""
    s, c = sine.field.constant(0), sine.field.constant(1)
    for _ in range(abs(n)):
        s, c = s * cosine + c * sine, c * cosine - s * sine
    return (s, c) if n > 0 else (-s, c)


def doubled(a: Quotient) -> Quotient:
    """Return a quotient with half angles that come in pairs only written as whole ones.

    sin x cos x = sin 2x / 2, cos^2 x = (1 + cos 2x) / 2, for letters such as sin(a/2).
    """
    field = a.field
    for k, letter in enumerate(list(field.letters)):
        if letter.cosine is not None and letter.node is not None and _is_half(letter.node.args[0]):
            polynomials = [field.in_ring(p) for p in (a.above, a.below)]
            degrees = [m[k] + m[letter.cosine] for p in polynomials for m in p]
            if any(degrees) and not any(degree % 2 for degree in degrees):
                above, below = (_with_double_angle(field, p, k, letter.cosine) for p in polynomials)
                a = above / below
    return a


def _is_half(angle: Node) -> bool:
    halved = angle.op == "mul" and angle.args[0].op == "number" and Fraction(angle.args[0].data).denominator % 2 == 0
    return halved and angle.shadow is None


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
    """Return Nodes over the field; `known` holds what symbols and slots stand for, and takes in all that is found.

    Raises NoClosedFormError where a choice (a sign, a divisor) is undecided at the sample, or the work has run out.
    """
    roots = list(nodes)
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
    angles = [n.args[0] for n in postorder(nodes) if n.op in ("sin", "cos", "tan")]
    found = exact(field, dict.fromkeys(angles), known)
    for angle in sorted(found, key=lambda x: -int(x.below.LC) if x.below.is_ground else 0):
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


def _opaque(op: str, *arguments: Quotient) -> Quotient:
    """Return a letter for a function's value."""
    inverse = op in ("asin", "acos", "atan", "atan2")
    known = _part_of_turn(op, *arguments) if inverse else of_hyperbolic(op, arguments[0])
    if known is not None:
        return known
    node, sample = BUILD[op](*map(book_form, arguments)), _PRECISE_OPERATIONS[op](*(a.sample for a in arguments))
    if isinstance(sample, PRECISE.mpc):
        raise NoClosedFormError(f"{op} has no real value")
    if inverse:
        arguments[0].field.inverses[node] = arguments
    if op in ("exp", "log"):
        field = arguments[0].field
        (field.arguments if op == "exp" else field.logarithms)[node] = arguments[0]
    return arguments[0].field.letter(node, Letter(node, sample, op == "exp"))


def _exponential(a: Quotient) -> Quotient:
    power, rest = of_logarithms(a)
    return power * (known_power(rest) or _opaque("exp", rest))


def _logarithm(a: Quotient) -> Quotient:
    square = square_of_root(a)
    return _opaque("log", a) if square is None else _opaque("log", square) / 2


def _direction(y: Quotient, x: Quotient) -> Quotient:
    """Return atan2(y, x): along an axis right angles, or the angle of which these are sine and cosine."""
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


def _tabulated(function: Tabulated, order: int, a: Quotient) -> Quotient:
    """Return the polynomial that holds at the sample, and note in the field between which rows."""
    x = symbol("x")
    for edge in function.edges(float(a.sample)):
        sign(a - a.field.constant(Fraction(repr(edge))))
    return exact(a.field, [function.piece(order, float(a.sample), x)], {x: a})[0]


_PRECISE_OPERATIONS: Final[dict[str, Callable[..., Any]]] = {
    "pow": PRECISE.power, "asin": PRECISE.asin, "acos": PRECISE.acos, "atan": PRECISE.atan, "atan2": PRECISE.atan2,
    "sinh": PRECISE.sinh, "cosh": PRECISE.cosh, "tanh": PRECISE.tanh, "exp": PRECISE.exp, "log": PRECISE.log,
}  # fmt: skip

_OPERATIONS: Final[dict[str, Callable[..., Quotient]]] = {
    **{op: partial(_opaque, op) for op in _PRECISE_OPERATIONS},
    "atan2": _direction,
    "exp": _exponential,
    "log": _logarithm,
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
    "table": _tabulated,
}
