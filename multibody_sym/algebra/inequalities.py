"""Inequalities under which a closed form holds, as few and as short as they can be said.

A condition is divided by what is positive anyway: by what declarations prove, by parameters, of which a condition of
their own says so where no declaration does (forces, which may turn, stay), and by what another condition says. It is
dropped where it then says nothing, and where no values of the parameters break it alone.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import reduce
from itertools import permutations
from math import prod
from operator import mul
from typing import Any, Final

import numpy as np

from multibody_sym.algebra.book_form import book_form, with_doubles
from multibody_sym.algebra.long_sums import multiplied
from multibody_sym.algebra.quotients import Field, NoClosedFormError, Poly, Quotient, factored
from multibody_sym.algebra.trigonometry import trigonometric_forms
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.elementary import flatten, leaves, postorder
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import PI, ZERO, Node, add, multiply, negate, sqrt
from multibody_sym.text.printer import text

# ----------------------------------------------------------------------------------------------------------------------
# Values of parameters that break one inequality and keep the others: what an inequality must have to be worth saying.
#
# Values lie between a thousandth and a thousand times those of the sample, with their sign or, where they may turn,
# with either; what is zero there may be anything of such a size. At first they are drawn, then those that come nearest
# are varied.


Factors = Sequence[Poly]
"""An inequality: the product of these polynomials is positive."""

_DECADES: Final = 3.0
_DRAWN: Final = 1500
_BEST: Final = 100
_VARIED: Final = 8
_WIDTHS: Final = (1.0, 0.3, 0.1, 0.03, 0.01, 0.003)
_CLEARLY: Final = 1e-9


class Breaking:
    """Inequalities over one field, and values of their parameters, at which they are looked at."""

    def __init__(self, field: Field, inequalities: Sequence[Factors]) -> None:
        self._field = field
        self._inequalities = inequalities
        used = {s for factors in inequalities for p in factors for s in field.whole(field.in_ring(p)).symbols}
        self._symbols = sorted(used, key=str)
        self._sample = np.array([float(_sample(field, s)) for s in self._symbols])
        self._turns = np.array([_turns(field, s) for s in self._symbols], dtype=bool)
        self._rng = np.random.default_rng(0)
        self._drawn = self._scales()
        self._margins = self._looked_at(self._drawn, range(len(inequalities)))

    def broken_alone(self, k: int, kept: Collection[int]) -> bool:
        """Return whether values were found that break inequality k and none of the others in `kept`."""
        others = [j for j in kept if j != k]
        scales, found = self._drawn, self._alone(self._margins, k, others)
        for width in _WIDTHS:
            if found.max(initial=-np.inf) > _CLEARLY:
                return True
            best = scales[np.argsort(found)[-_BEST:]]
            changes = self._rng.normal(size=(_VARIED, *best.shape)) * (self._rng.random((_VARIED, *best.shape)) < 0.5)
            varied = np.concatenate([best, (best + width * changes).reshape(-1, best.shape[1])])
            scales = np.clip(varied, -_DECADES, _DECADES)
            found = self._alone(self._looked_at(scales, [k, *others]), k, others)
        return bool(found.max(initial=-np.inf) > _CLEARLY)

    @staticmethod
    def _alone(margins: Mapping[int, Floats], k: int, others: Sequence[int]) -> Floats:
        """Return by how much k is broken and the others are kept, the least of both; -inf where there is no value."""
        found = np.min([-margins[k], *(margins[j] for j in others)], axis=0)
        return np.where(np.isnan(found), -np.inf, found)

    def _scales(self) -> Floats:
        """Return decimal logarithms of factors (n, symbols): of all, of some, near and far."""
        shape = (_DRAWN, len(self._symbols))
        far = self._rng.uniform(-_DECADES, _DECADES, size=shape)
        some = self._rng.uniform(-_DECADES, _DECADES, size=shape) * (self._rng.random(shape) < 0.4)
        return np.concatenate([far, some, far / 3, far / 10, some / 3])

    def _looked_at(self, scales: Floats, which: Collection[int]) -> dict[int, Floats]:
        """Return for inequalities their values (n,), each divided by the size of its terms."""
        signs = np.where(self._rng.random(scales.shape) < 0.5, -1.0, 1.0)
        around = np.where(self._sample == 0.0, signs, np.where(self._turns, signs, 1.0) * self._sample)
        points = dict(zip(self._symbols, (around * 10.0**scales).T, strict=True))
        with np.errstate(all="ignore"):
            letters = _letters(self._field, points, len(scales))
            return {k: _margin(self._field, self._inequalities[k], letters) for k in which}


def _sample(field: Field, symbol: Node) -> Any:
    place = field.position(symbol)
    return field.letters[place].sample if place is not None else 0.0


def _turns(field: Field, symbol: Node) -> bool:
    place = field.position(symbol)
    return place is not None and not field.letters[place].positive


def _margin(field: Field, factors: Factors, letters: Sequence[Any]) -> Any:
    total: Any = 1.0
    for p in factors:
        value, size = _value(field.in_ring(p), letters)
        total = total * value / size
    return total


def _value(p: Poly, letters: Sequence[Any]) -> tuple[Any, Any]:
    """Return the values of a polynomial, and the sums of the sizes of its terms."""
    value, size = 0.0 * letters[0], 0.0 * letters[0]
    for m, c in p.items():
        term = float(c)
        for k, e in enumerate(m):
            term = term * letters[k] ** e if e else term
        value, size = value + term, size + abs(term)
    return value, size


def _letters(field: Field, points: Mapping[Node, Floats], n: int) -> list[Any]:
    """Return the values of all letters; not a number for those that hang on other symbols."""
    found: list[Any] = []
    for letter in field.letters:
        if letter.node is None:
            found.append(np.sqrt(_value(letter.square, found)[0]))
        elif all(leaf in points for leaf in leaves([letter.node], "symbol")):
            found.append(_of_node(letter.node, points, n))
        else:
            found.append(np.full(n, np.nan))
    return found


def _of_node(root: Node, points: Mapping[Node, Floats], n: int) -> Floats:
    known: dict[Node, Any] = dict(points)
    for node in postorder([root]):
        if node is PI:
            known[node] = np.pi
        elif node.op in ("number", "real"):
            known[node] = float(node.data)
        elif node not in known:
            known[node] = _OPERATIONS[node.op](*node.own, *(known[a] for a in node.args))
    return np.broadcast_to(np.asarray(known[root], dtype=float), (n,))


_OPERATIONS: Final[dict[str, Callable[..., Any]]] = {
    "neg": np.negative, "add": np.add, "mul": np.multiply, "div": np.true_divide, "pow": np.float_power,
    "sqrt": np.sqrt, "abs": np.abs, "sign": np.sign, "min": np.minimum, "max": np.maximum,
    "sin": np.sin, "cos": np.cos, "tan": np.tan, "asin": np.arcsin, "acos": np.arccos, "atan": np.arctan,
    "atan2": np.arctan2, "sinh": np.sinh, "cosh": np.cosh, "tanh": np.tanh, "exp": np.exp, "log": np.log,
    "table": lambda function, order, a: np.asarray(function.values(order, np.ravel(a))),
}  # fmt: skip


# ----------------------------------------------------------------------------------------------------------------------
# Signs that follow from those of parameters: squares and products of these, sines and cosines between -1 and 1.


Exponents = tuple[int, ...]


def least_sign(field: Field, p: Poly, assumed: Collection[int] | None = None) -> int | None:
    """Return 1 where a polynomial is positive whatever its letters are, 0 where it is never negative, None else.

    Parameters keep the sign that they are declared to have, and those in the places `assumed` (None: all that do not
    turn) the one that they have at the sample, if they are not zero there.
    """
    found = [_of_form(field, form, assumed) for form in trigonometric_forms(field, p)]
    return max((sign for sign in found if sign is not None), default=None)


def undeclared(field: Field, p: Poly) -> set[int]:
    """Return the places of a polynomial's parameters that have a sign at the sample which no declaration gives them."""
    used = {k for m in p for k, e in enumerate(m) if e % 2}
    return {k for k in used if not field.letters[k].positive and _letter_sign(field, k, None)}


def _of_form(field: Field, p: Poly, assumed: Collection[int] | None) -> int | None:
    """Return the same by bounds: the terms with the same positive factors are at least what |sin|, |cos| <= 1 leave."""
    least: dict[Exponents, int] = {}
    for m, c in p.items():
        outside, inside = _parts(field, m)
        sign = prod(_letter_sign(field, k, assumed) for k, e in enumerate(outside) if e % 2)
        if sign == 0:
            return None
        certain = c * sign > 0 and not any(e % 2 for e in inside)
        gain = int(c) * sign if not any(inside) else 0 if certain else -abs(int(c))
        least[outside] = least.get(outside, 0) + gain
    if any(bound < 0 for bound in least.values()):
        return None
    return int(any(bound > 0 and _never_zero(field, outside) for outside, bound in least.items()))


def _parts(field: Field, m: Exponents) -> tuple[Exponents, Exponents]:
    """Return the exponents of a term's letters without, and with those of sines and cosines alone."""
    cosines = {letter.cosine for letter in field.letters if letter.cosine is not None}
    turning = [letter.cosine is not None or k in cosines for k, letter in enumerate(field.letters)]
    outside = tuple(0 if turns else e for e, turns in zip(m, turning, strict=False))
    return outside, tuple(e if turns else 0 for e, turns in zip(m, turning, strict=False))


def _letter_sign(field: Field, place: int, assumed: Collection[int] | None) -> int:
    """Return the sign that a letter keeps, 0 if it may change."""
    letter = field.letters[place]
    if letter.positive:
        return 1
    kept = letter.node is not None and letter.node.op == "symbol" and not letter.turns
    known = kept and (assumed is None or place in assumed)
    return int(letter.sample > 0) - int(letter.sample < 0) if known else 0


def _never_zero(field: Field, m: Exponents) -> bool:
    return all(_letter_sign(field, k, None) for k, e in enumerate(m) if e)


def surely_positive(a: Quotient) -> bool:
    """Return whether all terms are positive because their letters are."""
    letters = a.field.letters
    return all(
        c > 0 and all(letters[k].positive or e % 2 == 0 for k, e in enumerate(m))
        for p in (a.above, a.below)
        for m, c in p.items()
    )


# ----------------------------------------------------------------------------------------------------------------------

_LONGEST_FACTORED: Final = 60
_FEW_TERMS: Final = 8


@dataclass(frozen=True, eq=False)
class Condition:
    """value > 0 where it is `strict`, else value >= 0; `broken` says what happens where it fails.

    `size` is (x, y) where this is one half of |x| <= y; a condition with both halves is `whole`. `circle` is (x,
    ..., z) where this says sqrt(x^2 + ...) <= z. With `under_root` it says that a root is real, which others rest on.
    `pivot`: it is the sign of what forces are divided by, and where another condition is the same, this one says what
    happens: no force that turns its sign there lets anything go.
    """

    value: Quotient
    strict: bool = False
    broken: str = ""
    size: tuple[Quotient, Quotient] | None = None
    whole: bool = False
    circle: tuple[Quotient, ...] | None = None
    under_root: bool = False
    pivot: bool = False

    def __str__(self) -> str:
        """Return the comparison in the model's own language; raises NoClosedFormError where it is too long."""
        if self.size is not None and self.whole:
            x, y = self.size
            return f"abs({text(with_doubles(_short(x)))}) {'<' if self.strict else '<='} {text(_form(y))}"
        if self.circle is not None:
            *parts, most = (_form(part) for part in _in_proportion(self.circle))
            size = sqrt(reduce(add, (multiply(part, part) for part in parts)))
            return f"{text(size)} <= {text(most)}"
        return comparison(self.value, self.strict)


def under_roots(values: Iterable[Quotient]) -> list[Condition]:
    """Return that the roots in quotients are real, each once."""
    found: dict[int, Condition] = {}
    for a in values:
        waiting = [a.above, a.below]
        while waiting:
            used = {k for m in waiting.pop() for k, exponent in enumerate(m) if exponent}
            for k in sorted(k for k in used - found.keys() if a.field.letters[k].node is None):
                square = a.field.letters[k].square
                found[k] = Condition(a.field.whole(a.field.in_ring(square)), True, under_root=True)
                waiting.append(square)
    return list(found.values())


def in_circle(parts: Sequence[Quotient], most: Quotient, broken: str = "") -> list[Condition]:
    """Return sqrt(x^2 + ...) <= most for parts x, ... of which those that are zero are left out; |x| <= most."""
    left = [part for part in parts if not part.is_zero] or [parts[0]]
    if len(left) == 1:
        return within(left[0], most, broken)
    squares = reduce(lambda a, b: a + b, (part * part for part in left))
    return [Condition(most * most - squares, False, broken, circle=(*left, most))]


def within(x: Quotient, y: Quotient, broken: str = "") -> list[Condition]:
    """Return |x| <= y as its two halves."""
    size = (x, y)
    return [Condition(y - x, False, broken, size), Condition(y + x, False, broken, size)]


def comparison(positive: Quotient, strict: bool = True) -> str:
    """Return `a > b` (`a >= b`) for what is positive: b holds what is subtracted, and is 0 where nothing is."""
    return relation(positive, ">" if strict else ">=")


def relation(difference: Quotient, word: str) -> str:
    """Return `a > b` for a - b > 0, and so with >=, == and != as the `word`."""
    positive = difference
    sample = {x.node: float(x.sample) for x in positive.field.letters if x.node is not None and x.node.op == "symbol"}
    forms = [form for scale in _scales(positive) for form in _with_sums_apart(_form(positive / scale))]
    return min((_compared(form, sample, word) for form in forms), key=len)


def _scales(positive: Quotient) -> list[int]:
    """Return the numbers by which a condition may be divided to be shorter: those before its terms."""
    sizes = {abs(int(c)) for c in positive.above.values()} if positive.size <= _FEW_TERMS else set()
    return [1, *sorted(sizes - {1})[:2]]


def _with_sums_apart(form: Node) -> Iterator[Node]:
    """Yield a sum as it is, and with one of its products of a sum multiplied out: parts of it go to the other side."""
    yield form
    terms = flatten("add", form)
    for term in terms if len(terms) > 1 else ():
        factors = flatten("mul", term.args[0] if term.op == "neg" else term)
        sums = [x for x in factors if x.op == "add"]
        if len(sums) == 1:
            parts = [multiplied((part if x is sums[0] else x, 1) for x in factors) for part in flatten("add", sums[0])]
            apart = [negate(part) if term.op == "neg" else part for part in parts]
            yield reduce(add, (part for each in terms for part in (apart if each is term else [each])))


def _compared(form: Node, sample: Mapping[Node, float], word: str) -> str:
    if form.op == "neg":
        return f"{text(form.args[0])} {word.replace('>', '<')} 0"
    if form.op == "mul" and form.args[0].op == "number" and form.args[0].data > 0:
        form = form.args[1]
    sides: dict[bool, list[Node]] = {True: [], False: []}
    for term in flatten("add", form):
        opposite = _subtracted(term, sample)
        sides[opposite is not None].append(term if opposite is None else opposite)
    greater, less = (text(reduce(add, sides[subtracted], ZERO)) for subtracted in (False, True))
    return f"{greater} {word} {less}"


def _subtracted(term: Node, sample: Mapping[Node, float]) -> Node | None:
    """Return what a term of a sum subtracts, None for one that adds; F (h - R) subtracts F (R - h) if R is larger."""
    if term.op == "neg" or (term.op == "number" and term.data < 0):
        return negate(term)
    sums = [x for x in flatten("mul", term) if x.op == "add"]
    if len(sums) != 1 or evaluate_float(sums, sample)[0] >= 0.0:
        return None
    turned = reduce(add, sorted(map(negate, flatten("add", sums[0])), key=lambda x: (x.op == "neg", text(x))))
    return reduce(multiply, (turned if x is sums[0] else x for x in flatten("mul", term)))


def _form(a: Quotient) -> Node:
    return with_doubles(book_form(a))


def _short(a: Quotient) -> Node:
    """Return a or -a, whichever is shorter."""
    return min((book_form(a), book_form(-a)), key=lambda node: len(text(node)))


# --- fewer ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Said:
    """A condition with the factors on which its sign rests, their product positive where it holds."""

    condition: Condition
    factors: list[Poly]

    @property
    def value(self) -> Quotient:
        """The product of the factors, or their quotient as the condition has them, whichever is the shorter text."""
        field, below = self.condition.value.field, self.condition.value.below
        found = [field.whole(field.in_ring(p)) for p in self.factors]
        divides = [not field.in_ring(below).rem(field.in_ring(p)) for p in self.factors]
        product = reduce(mul, found)
        if not any(divides) or all(divides):
            return product
        quotient = reduce(mul, (x.power(-1 if under else 1) for x, under in zip(found, divides, strict=True)))
        return min((product, quotient), key=_length)


def reduced(conditions: Iterable[Condition], given: Iterable[Condition] = ()) -> list[Condition]:
    """Return the conditions that say something, none of which follows from the others, in their order.

    All are over one field, and hold at its sample; so do those that are `given`: they hold for all parameters allowed.
    """
    conditions = list(conditions)
    assumed = {k: None for c in conditions for k in _alone(c)}
    said = [_Said(c, factors) for c in conditions if (factors := _undecided(c, assumed)) is not None]
    said = _without_doubles([*_divided(said), *(_sign_of(conditions[0].value.field, k) for k in assumed)])
    if not said:
        return []
    always = [factors for c in given if (factors := _undecided(c, assumed)) is not None]
    limits = [_limit(each.condition) for each in said]
    bounds = [factors for factors in limits if factors is not None]
    breaking = Breaking(said[0].condition.value.field, [*(each.factors for each in said), *always, *bounds])
    of_limit = {k: len(said) + len(always) + sum(x is not None for x in limits[:k]) for k, x in enumerate(limits) if x}
    kept = list(range(len(said) + len(always)))
    for k in reversed(range(len(said))):
        if not breaking.broken_alone(k, [*kept, *(of_limit[j] for j in kept if j != k and j in of_limit)]):
            kept.remove(k)
    return list(_joined([replace(said[k].condition, value=said[k].value) for k in kept if k < len(said)]))


def _alone(condition: Condition) -> list[int]:
    """Return the places of parameters that are factors of a condition, and have their sign at the sample alone."""
    field = condition.value.field
    found: set[int] = set()
    for p in (condition.value.above, condition.value.below):
        shared = tuple(map(min, zip(*p, strict=True))) if p else ()
        found |= undeclared(field, field.in_ring(p.ring.from_dict({shared: 1}))) if p else set()
    return sorted(found)


def _sign_of(field: Field, place: int) -> _Said:
    """Return that a parameter keeps the sign that it has at the sample."""
    p = field.ring.gens[place]
    p = p if field.letters[place].sample > 0 else -p
    return _Said(Condition(field.whole(p), strict=True), [p])


def _limit(condition: Condition) -> list[Poly] | None:
    """Return what a circle says besides its squares: that its limit is not negative; None where that is so anyway."""
    return None if condition.circle is None else _undecided(Condition(condition.circle[-1]))


def _undecided(condition: Condition, assumed: Collection[int] | None = None) -> list[Poly] | None:
    """Return the factors whose signs decide a condition, none positive anyway; None where it holds anyway.

    Parameters in the places `assumed` (None: all) keep the sign that they have at the sample.
    """
    value = condition.value
    field, content, turned = value.field, 1, 1
    left: list[Poly] = []
    even: list[Poly] = []
    if value.is_zero:
        return None
    for p in (value.above, value.below):
        number, factors = (1, [(p, 1)]) if len(p) > _LONGEST_FACTORED else factored(p)
        content = content if number > 0 else -content
        for factor, exponent in factors:
            sign = _known_sign(field, factor, condition, assumed)
            if exponent % 2 == 0:
                even += [factor] if sign is None else []
                continue
            turned = turned if sign is None or sign > 0 else -turned
            left += [factor] if sign is None else []
    left = [_without_root(field, p) for p in left]
    if not left and content * turned < 0:  # minus a square: it holds where that is zero
        left, content = [-(p * p) for p in map(field.in_ring, even[:1])], -content
    for k, p in enumerate(left):
        if content * turned < 0 and (field.value(p) < 0 or k == len(left) - 1):
            left[k], content = -p, -content
    return left or None


def _without_root(field: Field, p: Poly) -> Poly:
    """Return a polynomial without a root that is a factor of it: h (2R - h) is the square of its root."""
    p = field.in_ring(p)
    for k, letter in enumerate(field.letters):
        if letter.node is None and any(m[k] for m in p) and not all(m[k] for m in p):
            square = field.in_ring(letter.square)
            multiplied = field.reduced(p * field.ring.gens[k])
            quotient, rest = multiplied.div(square)
            if not rest and len(quotient) <= len(p):
                p = quotient
    return p


def _known_sign(field: Field, p: Poly, said: Condition, assumed: Collection[int] | None) -> int | None:
    """Return the sign that a factor has whatever its letters are (that of the sample, for numbers), None if it varies.

    What can be zero is undecided only where zero is not enough; what stands under a root of the condition itself is
    positive, unless it is that which is to be said.
    """
    p = field.in_ring(p)
    if not field.whole(p).symbols:
        return 1 if field.value(p) > 0 else -1
    radicands = [] if said.under_root else [field.in_ring(each.value.above) for each in under_roots([said.value])]
    for sign, q in ((1, p), (-1, -p)):
        least = 1 if q in radicands else least_sign(field, q, assumed)
        if least == 1 or (least == 0 and not said.strict):
            return sign
    return None


def _divided(said: Sequence[_Said]) -> list[_Said]:
    """Return the conditions without factors of which another one says that they are positive.

    Where nothing is said of what happens where that one fails, this one says it.
    """
    found = list(said)
    for k, j in permutations(range(len(found)), 2):
        each, other = found[k], found[j]
        if len(other.factors) == 1 and len(each.factors) > 1:
            left = _without(each.condition.value.field, each.factors, other.factors[0])
            if len(left) < len(each.factors):
                found[k] = _Said(each.condition, left)
                broken = other.condition.broken or each.condition.broken
                found[j] = _Said(replace(other.condition, broken=broken), other.factors)
    return found if all(a is b for a, b in zip(found, said, strict=True)) else _divided(found)


def _without(field: Field, factors: list[Poly], positive: Poly) -> list[Poly]:
    """Return factors without one that is positive; where its negative stands, another one takes the sign."""
    positive = field.in_ring(positive)
    for k, p in enumerate(map(field.in_ring, factors)):
        if p in (positive, -positive):
            left = [*factors[:k], *factors[k + 1 :]]
            return left if p == positive else [-left[0], *left[1:]]
    return factors


def _without_doubles(said: Sequence[_Said]) -> list[_Said]:
    found: list[_Said] = []
    for each in said:
        same = next((x for x in found if (x.value - each.value).is_zero), None)
        if same is None:
            found.append(each)
        elif each.condition.pivot or (each.condition.strict and not same.condition.strict):
            broken = (each if each.condition.pivot else same).condition.broken
            found[found.index(same)] = _Said(replace(same.condition, strict=True, broken=broken), same.factors)
    return found


def _joined(conditions: Sequence[Condition]) -> Iterator[Condition]:
    """Yield the conditions, the two halves of |x| <= y as one, without the factors that x and y share."""
    told: list[tuple[Quotient, Quotient]] = []
    for condition in conditions:
        if any(condition.size is size for size in told):
            continue
        halves = [c for c in conditions if c.size is not None and c.size is condition.size]
        size = _without_shared(*condition.size) if condition.size is not None and len(halves) > 1 else None
        whole = replace(condition, size=size, whole=True)
        if condition.size is not None and size is not None and _is_shorter(whole, halves):
            told.append(condition.size)
            yield whole
        else:
            yield condition


def _is_shorter(whole: Condition, halves: Sequence[Condition]) -> bool:
    """Return whether |x| <= y is shorter than both its halves."""
    try:
        return len(str(whole)) < sum(len(str(half)) for half in halves)
    except NoClosedFormError:
        return False


def _length(a: Quotient) -> int:
    try:
        return len(comparison(a))
    except NoClosedFormError:
        return a.size * _LONGEST_FACTORED


def _in_proportion(parts: tuple[Quotient, ...]) -> tuple[Quotient, ...]:
    """Return quotients without denominators and without what all share, as far as that is positive; the last counts."""
    field, last = parts[-1].field, parts[-1]
    ratios = [part / last for part in parts[:-1]]
    scaled = field.whole(reduce(lambda a, b: a.lcm(b), (field.in_ring(ratio.below) for ratio in ratios)))
    if scaled.sample < 0:
        scaled = -scaled
    return parts if _undecided(Condition(last / scaled)) is not None else (*(x * scaled for x in ratios), scaled)


def _without_shared(x: Quotient, y: Quotient) -> tuple[Quotient, Quotient] | None:
    """Return (x, y) divided by what they share; None where that may change its sign."""
    ratio = x / y
    above, below = (ratio.field.whole(p) for p in (ratio.above, ratio.below))
    if below.sample < 0:
        above, below = -above, -below
    return (above, below) if _undecided(Condition(y / below)) is None else None
