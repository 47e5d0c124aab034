"""Inequalities under which a closed form holds, as few and as short as possible.

A condition is divided by positive factors: by those that declarations prove positive, by parameters, which get a
condition of their own where no declaration fixes their sign (forces, which may turn, stay), and by other conditions. It
is dropped where no factor is left, and where no values of the parameters break it alone.

In: conditions as quotients over one field. Out: the same without those that follow from others; their texts.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import reduce
from itertools import permutations
from math import prod
from operator import mul
from typing import Any, Final

import numpy as np

from multibody_sym.algebra.book_form import book_form, product_node, with_doubles
from multibody_sym.algebra.quotients import Exponents, Field, NoClosedFormError, Poly, Quotient, factors_of
from multibody_sym.algebra.trigonometry import trigonometric_forms
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.elementary import flatten, leaves, postorder
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import PI, ZERO, Node, add, multiply, negate, sqrt
from multibody_sym.text.printer import text

# ----------------------------------------------------------------------------------------------------------------------
# Values of parameters that break one inequality and keep the others; an inequality without them is superfluous.
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
    """Inequalities over one field, evaluated at many values of their parameters."""

    def __init__(self, field: Field, inequalities: Sequence[Factors]) -> None:
        self._field = field
        self._inequalities = inequalities
        used = {s for factors in inequalities for p in factors for s in field.whole(field.in_ring(p)).symbols}
        self._symbols = sorted(used, key=str)
        places = [field.position(s) for s in self._symbols]
        letters = [None if place is None else field.letters[place] for place in places]
        self._sample = np.array([0.0 if letter is None else float(letter.sample) for letter in letters])
        self._turns = np.array([letter is not None and not letter.positive for letter in letters], dtype=bool)
        self._rng = np.random.default_rng(0)
        # decimal logarithms of factors (n, symbols): of all, of some, near and far
        shape = (_DRAWN, len(self._symbols))
        far = self._rng.uniform(-_DECADES, _DECADES, size=shape)
        some = self._rng.uniform(-_DECADES, _DECADES, size=shape) * (self._rng.random(shape) < 0.4)
        self._drawn = np.concatenate([far, some, far / 3, far / 10, some / 3])
        self._margins = self._margins_at(self._drawn, range(len(inequalities)))

    def broken_alone(self, k: int, kept: Collection[int]) -> bool:
        """Return whether values were found that break inequality k and none of the others in `kept`."""
        others = [j for j in kept if j != k]
        scales, breaches = self._drawn, self._breaches(self._margins, k, others)
        for width in _WIDTHS:
            if breaches.max(initial=-np.inf) > _CLEARLY:
                return True
            best = scales[np.argsort(breaches)[-_BEST:]]
            changes = self._rng.normal(size=(_VARIED, *best.shape)) * (self._rng.random((_VARIED, *best.shape)) < 0.5)
            varied = np.concatenate([best, (best + width * changes).reshape(-1, best.shape[1])])
            scales = np.clip(varied, -_DECADES, _DECADES)
            breaches = self._breaches(self._margins_at(scales, [k, *others]), k, others)
        return bool(breaches.max(initial=-np.inf) > _CLEARLY)

    @staticmethod
    def _breaches(margins: Mapping[int, Floats], k: int, others: Sequence[int]) -> Floats:
        """Return the least margin by which k is broken and the others are kept; -inf where one is undefined."""
        least = np.min([-margins[k], *(margins[j] for j in others)], axis=0)
        return np.where(np.isnan(least), -np.inf, least)

    def _margins_at(self, scales: Floats, which: Collection[int]) -> dict[int, Floats]:
        """Return the values (n,) of inequalities, divided by the sizes of their terms."""
        signs = np.where(self._rng.random(scales.shape) < 0.5, -1.0, 1.0)
        around = np.where(self._sample == 0.0, signs, np.where(self._turns, signs, 1.0) * self._sample)
        points = dict(zip(self._symbols, (around * 10.0**scales).T, strict=True))
        with np.errstate(all="ignore"):
            # nan for letters that depend on other symbols
            n = len(scales)
            letters: list[Any] = []
            for letter in self._field.letters:
                if letter.node is None:
                    letters.append(np.sqrt(_polynomial_value(letter.square, letters)[0]))
                elif all(leaf in points for leaf in leaves([letter.node], "symbol")):
                    letters.append(_node_values(letter.node, points, n))
                else:
                    letters.append(np.full(n, np.nan))
            margins: dict[int, Any] = dict.fromkeys(which, 1.0)
            for k in which:
                for p in self._inequalities[k]:
                    value, size = _polynomial_value(self._field.in_ring(p), letters)
                    margins[k] = margins[k] * value / size
            return margins


def _polynomial_value(p: Poly, letters: Sequence[Any]) -> tuple[Any, Any]:
    """Return the values of a polynomial, and the sums of the sizes of its terms."""
    value, size = 0.0 * letters[0], 0.0 * letters[0]
    for m, c in p.items():
        term = float(c)
        for k, e in enumerate(m):
            term = term * letters[k] ** e if e else term
        value, size = value + term, size + abs(term)
    return value, size


def _node_values(root: Node, points: Mapping[Node, Floats], n: int) -> Floats:
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
    "atan2": np.arctan2, "sinh": np.sinh, "cosh": np.cosh, "tanh": np.tanh, "asinh": np.arcsinh,
    "acosh": np.arccosh, "atanh": np.arctanh, "exp": np.exp, "log": np.log,
    "table": lambda function, order, a: np.asarray(function.values(order, np.ravel(a))),
}  # fmt: skip


# ----------------------------------------------------------------------------------------------------------------------
# Signs that follow from those of parameters: squares and products of these, sines and cosines between -1 and 1.


def least_sign(field: Field, p: Poly, assumed: Collection[int] | None = None) -> int | None:
    """Return 1 for a polynomial that is positive whatever its letters are, 0 for one that is never negative, else None.

    Parameters keep their declared sign. Those in the places `assumed` (None: all that do not turn) keep the sign that
    they have at the sample, if they are not zero there.
    """
    signs = [_sign_by_bounds(field, form, assumed) for form in trigonometric_forms(field, p)]
    return max((sign for sign in signs if sign is not None), default=None)


def _sign_by_bounds(field: Field, p: Poly, assumed: Collection[int] | None) -> int | None:
    """Return the same for one form, by lower bounds of terms with the same positive factors, as |sin|, |cos| <= 1."""
    cosines = {letter.cosine for letter in field.letters if letter.cosine is not None}
    waves = [letter.cosine is not None or k in cosines for k, letter in enumerate(field.letters)]
    least: dict[Exponents, int] = {}
    for m, c in p.items():
        outside = tuple(0 if is_wave else e for e, is_wave in zip(m, waves, strict=False))
        inside = tuple(e if is_wave else 0 for e, is_wave in zip(m, waves, strict=False))
        sign = prod(_letter_sign(field, k, assumed) for k, e in enumerate(outside) if e % 2)
        if sign == 0:
            return None
        certain = c * sign > 0 and not any(e % 2 for e in inside)
        gain = int(c) * sign if not any(inside) else 0 if certain else -abs(int(c))
        least[outside] = least.get(outside, 0) + gain
    if any(bound < 0 for bound in least.values()):
        return None
    never_zero = (m for m, bound in least.items() if bound > 0)
    return int(any(all(_letter_sign(field, k, None) for k, e in enumerate(m) if e) for m in never_zero))


def _letter_sign(field: Field, place: int, assumed: Collection[int] | None) -> int:
    """Return the constant sign of a letter, 0 if it may change."""
    letter = field.letters[place]
    if letter.positive:
        return 1
    kept = letter.node is not None and letter.node.op == "symbol" and not letter.turns
    known = kept and (assumed is None or place in assumed)
    return int(letter.sample > 0) - int(letter.sample < 0) if known else 0


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
    """value > 0 where it is `strict`, else value >= 0; `broken` is the consequence where it fails.

    `size` is (x, y) for one half of |x| <= y; a condition with both halves is `whole`. `circle` is (x, ..., z) for
    sqrt(x^2 + ...) <= z. `under_root`: a root is real, on which others rest. `pivot`: the sign of the forces' divisor;
    its consequence counts where another condition is the same, as no force that turns its sign there lets anything go.
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
            shorter = min((book_form(x), book_form(-x)), key=lambda node: len(text(node)))
            return f"abs({text(with_doubles(shorter))}) {'<' if self.strict else '<='} {text(_form(y))}"
        if self.circle is not None:
            *parts, most = (_form(part) for part in _in_proportion(self.circle))
            size = sqrt(reduce(add, (multiply(part, part) for part in parts)))
            return f"{text(size)} <= {text(most)}"
        return comparison(self.value, self.strict)


def under_roots(values: Iterable[Quotient]) -> list[Condition]:
    """Return the conditions that the roots in quotients are real, each once."""
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
    """Return sqrt(x^2 + ...) <= most for those parts x, ... that are not zero; for one part |x| <= most."""
    left = [part for part in parts if not part.is_zero] or [parts[0]]
    if len(left) == 1:
        return within(left[0], most, broken)
    squares = reduce(lambda a, b: a + b, (part * part for part in left))
    return [Condition(most * most - squares, False, broken, circle=(*left, most))]


def within(x: Quotient, y: Quotient, broken: str = "") -> list[Condition]:
    size = (x, y)
    return [Condition(y - x, False, broken, size), Condition(y + x, False, broken, size)]


def comparison(positive: Quotient, strict: bool = True) -> str:
    """Return `a > b` (`a >= b`) for a positive quotient a - b."""
    return relation(positive, ">" if strict else ">=")


def relation(difference: Quotient, word: str) -> str:
    """Return `a > b` for a - b > 0, and so with >=, == and != as the `word`."""
    sample = {x.node: float(x.sample) for x in difference.field.letters if x.node is not None and x.node.op == "symbol"}
    before_terms = {abs(int(c)) for c in difference.above.values()} if difference.size <= _FEW_TERMS else set()
    scales = [1, *sorted(before_terms - {1})[:2]]
    forms = [form for scale in scales for form in _with_sums_apart(_form(difference / scale))]
    return min((_write_relation(form, sample, word) for form in forms), key=len)


def _with_sums_apart(form: Node) -> Iterator[Node]:
    """Yield a sum as it is, and with one of its products of a sum multiplied out: parts of it go to the other side."""
    yield form
    terms = flatten("add", form)
    for term in terms if len(terms) > 1 else ():
        factors = flatten("mul", term.args[0] if term.op == "neg" else term)
        sums = [x for x in factors if x.op == "add"]
        if len(sums) == 1:
            terms_of_sum = flatten("add", sums[0])
            parts = [product_node((part if x is sums[0] else x, 1) for x in factors) for part in terms_of_sum]
            apart = [negate(part) if term.op == "neg" else part for part in parts]
            yield reduce(add, (part for each in terms for part in (apart if each is term else [each])))


def _write_relation(form: Node, sample: Mapping[Node, float], word: str) -> str:
    """Return `a > b` for a sum a - b; of F (h - R), F (R - h) is subtracted if R is larger at the sample."""
    if form.op == "neg":
        return f"{text(form.args[0])} {word.replace('>', '<')} 0"
    if form.op == "mul" and form.args[0].op == "number" and form.args[0].data > 0:
        form = form.args[1]
    greater, less = list[Node](), list[Node]()
    for term in flatten("add", form):
        factors = flatten("mul", term)
        sums = [x for x in factors if x.op == "add"]
        if term.op == "neg" or (term.op == "number" and term.data < 0):
            less.append(negate(term))
        elif len(sums) != 1 or evaluate_float(sums, sample)[0] >= 0.0:
            greater.append(term)
        else:
            terms = sorted(map(negate, flatten("add", sums[0])), key=lambda x: (x.op == "neg", text(x)))
            less.append(reduce(multiply, (reduce(add, terms) if x is sums[0] else x for x in factors)))
    return f"{text(reduce(add, greater, ZERO))} {word} {text(reduce(add, less, ZERO))}"


def _form(a: Quotient) -> Node:
    return with_doubles(book_form(a))


@dataclass(frozen=True, eq=False)
class _Factored:
    """A condition with the factors on which its sign rests, their product positive where it holds."""

    condition: Condition
    factors: list[Poly]

    @property
    def value(self) -> Quotient:
        """The product of the factors, or their quotient as in the condition, whichever has the shorter text."""
        field, below = self.condition.value.field, self.condition.value.below
        factors = [field.whole(field.in_ring(p)) for p in self.factors]
        divides = [not field.in_ring(below).rem(field.in_ring(p)) for p in self.factors]
        product = reduce(mul, factors)
        if not any(divides) or all(divides):
            return product
        quotient = reduce(mul, (x.power(-1 if under else 1) for x, under in zip(factors, divides, strict=True)))
        return min((product, quotient), key=_length)


def reduced(conditions: Iterable[Condition], given: Iterable[Condition] = ()) -> list[Condition]:
    """Return the conditions that do not follow from the others, in their order.

    All are over one field, and hold at its sample. Those `given` hold for all allowed parameters.
    """
    conditions = list(conditions)
    assumed = {k: None for c in conditions for k in _undeclared_factors(c)}
    own = [_Factored(c, factors) for c in conditions if (factors := _undecided_factors(c, assumed)) is not None]
    own = _divide_by_others(own)
    for k in assumed:  # a parameter keeps the sign that it has at the sample
        field = conditions[0].value.field
        p = field.ring.gens[k] if field.letters[k].sample > 0 else -field.ring.gens[k]
        own.append(_Factored(Condition(field.whole(p), strict=True), [p]))
    distinct: list[_Factored] = []
    for each in own:
        same = next((x for x in distinct if (x.value - each.value).is_zero), None)
        if same is None:
            distinct.append(each)
        elif each.condition.pivot or (each.condition.strict and not same.condition.strict):
            broken = (each if each.condition.pivot else same).condition.broken
            condition = replace(same.condition, strict=True, broken=broken)
            distinct[distinct.index(same)] = _Factored(condition, same.factors)
    own = distinct
    if not own:
        return []
    always = [factors for c in given if (factors := _undecided_factors(c, assumed)) is not None]
    # beside the squares of a circle, its limit is not negative
    circles = (each.condition.circle for each in own)
    limits = [None if circle is None else _undecided_factors(Condition(circle[-1])) for circle in circles]
    bounds = [factors for factors in limits if factors is not None]
    breaking = Breaking(own[0].condition.value.field, [*(each.factors for each in own), *always, *bounds])
    of_limit = {k: len(own) + len(always) + sum(x is not None for x in limits[:k]) for k, x in enumerate(limits) if x}
    kept = list(range(len(own) + len(always)))
    for k in reversed(range(len(own))):
        if not breaking.broken_alone(k, [*kept, *(of_limit[j] for j in kept if j != k and j in of_limit)]):
            kept.remove(k)
    return list(_join_halves([replace(own[k].condition, value=own[k].value) for k in kept if k < len(own)]))


def _undeclared_factors(condition: Condition) -> list[int]:
    """Return the places of parameters that are factors of a condition, and whose sign the sample alone gives."""
    field = condition.value.field
    places: set[int] = set()
    for p in (condition.value.above, condition.value.below):
        shared = map(min, zip(*p, strict=True)) if p else ()
        odd = {k for k, e in enumerate(shared) if e % 2}
        places |= {k for k in odd if not field.letters[k].positive and _letter_sign(field, k, None)}
    return sorted(places)


def _undecided_factors(condition: Condition, assumed: Collection[int] | None = None) -> list[Poly] | None:
    """Return the factors whose signs decide a condition; None where it always holds.

    Parameters in the places `assumed` (None: all) keep the sign that they have at the sample.
    """
    value = condition.value
    field, content, turned = value.field, 1, 1
    left: list[Poly] = []
    even: list[Poly] = []
    if value.is_zero:
        return None
    for p in (value.above, value.below):
        number, factors = (1, [(p, 1)]) if len(p) > _LONGEST_FACTORED else factors_of(p)
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
    """Return a polynomial without a root that is a factor of it: h (2R - h) is the square of a root."""
    p = field.in_ring(p)
    for k, letter in enumerate(field.letters):
        if letter.node is None and any(m[k] for m in p) and not all(m[k] for m in p):
            square = field.in_ring(letter.square)
            multiplied = field.reduced(p * field.ring.gens[k])
            quotient, rest = multiplied.div(square)
            if not rest and len(quotient) <= len(p):
                p = quotient
    return p


def _known_sign(field: Field, p: Poly, condition: Condition, assumed: Collection[int] | None) -> int | None:
    """Return the sign of a factor whatever its letters are (for numbers at the sample), None if it varies.

    A factor that may be zero is undecided in a strict condition. Radicands of the condition are positive, unless the
    condition says so itself.
    """
    p = field.in_ring(p)
    if not field.whole(p).symbols:
        return 1 if field.value(p) > 0 else -1
    roots = [] if condition.under_root else under_roots([condition.value])
    radicands = [field.in_ring(each.value.above) for each in roots]
    for sign, q in ((1, p), (-1, -p)):
        least = 1 if q in radicands else least_sign(field, q, assumed)
        if least == 1 or (least == 0 and not condition.strict):
            return sign
    return None


def _divide_by_others(conditions: Sequence[_Factored]) -> list[_Factored]:
    """Return the conditions without factors of which another condition says that they are positive.

    A condition without a consequence gets that of the divided one.
    """
    divided = list(conditions)
    for k, j in permutations(range(len(divided)), 2):
        each, other = divided[k], divided[j]
        if len(other.factors) != 1 or len(each.factors) == 1:
            continue
        field = each.condition.value.field
        positive, factors = field.in_ring(other.factors[0]), [field.in_ring(p) for p in each.factors]
        place = next((n for n, p in enumerate(factors) if p in (positive, -positive)), None)
        if place is not None:
            left = [*each.factors[:place], *each.factors[place + 1 :]]
            if factors[place] != positive:  # another factor takes the sign
                left = [-left[0], *left[1:]]
            divided[k] = _Factored(each.condition, left)
            broken = other.condition.broken or each.condition.broken
            divided[j] = _Factored(replace(other.condition, broken=broken), other.factors)
    same = all(a is b for a, b in zip(divided, conditions, strict=True))
    return divided if same else _divide_by_others(divided)


def _join_halves(conditions: Sequence[Condition]) -> Iterator[Condition]:
    """Yield the conditions, with the two halves of |x| <= y as one where that is shorter."""
    joined: list[tuple[Quotient, Quotient]] = []
    for condition in conditions:
        if any(condition.size is size for size in joined):
            continue
        halves = [c for c in conditions if c.size is not None and c.size is condition.size]
        if condition.size is not None and len(halves) > 1:
            x, y = condition.size
            ratio = x / y  # without the factors that x and y share
            above, below = (ratio.field.whole(p) for p in (ratio.above, ratio.below))
            if below.sample < 0:
                above, below = -above, -below
            if _undecided_factors(Condition(y / below)) is None:
                whole = replace(condition, size=(above, below), whole=True)
                with suppress(NoClosedFormError):
                    if len(str(whole)) < sum(len(str(half)) for half in halves):
                        joined.append(condition.size)
                        yield whole
                        continue
        yield condition


def _length(a: Quotient) -> int:
    try:
        return len(comparison(a))
    except NoClosedFormError:
        return a.size * _LONGEST_FACTORED


def _in_proportion(parts: tuple[Quotient, ...]) -> tuple[Quotient, ...]:
    """Return quotients in the same proportion without denominators and shared factors, if these are positive."""
    field, last = parts[-1].field, parts[-1]
    ratios = [part / last for part in parts[:-1]]
    scaled = field.whole(reduce(lambda a, b: a.lcm(b), (field.in_ring(ratio.below) for ratio in ratios)))
    if scaled.sample < 0:
        scaled = -scaled
    if _undecided_factors(Condition(last / scaled)) is not None:
        return parts
    return *(x * scaled for x in ratios), scaled
