"""Exact quotients as a book prints them: factored, with the shorter of sin^2 and 1 - cos^2, with tan and one root."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import reduce
from math import gcd
from operator import mul
from typing import Any, Final

from multibody_sym.algebra.angles.multiples import angles_with_multiples, is_of_angle, single_wave, wave, waves
from multibody_sym.algebra.angles.squares import contracted, shifted
from multibody_sym.algebra.angles.tangents import with_tangents
from multibody_sym.algebra.decimal_sums import decimal_scales, exact_root, looks_decimal, names_pi_alone, power_scale
from multibody_sym.algebra.decimals import is_exact_decimal, is_long
from multibody_sym.algebra.factors import Poly, factored
from multibody_sym.algebra.quotients import Field, Letter, NoClosedFormError, Quotient
from multibody_sym.expressions.printer import text
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.node import ONE, ZERO, Node, add, divide, multiply, negate, number, power

_MOST_FORMS: Final = 8
_MOST_PARTS: Final = 3
_MOST_TERMS: Final = 120
_MOST_TERMS_TRIED: Final = 30
_LONGEST: Final = 600
_MUCH_SHORTER: Final = 0.7
_SMALL: Final = 12
_WHOLE: Final = Fraction(1)
_WHOLE_FOR_DECIMAL: Final = 4

Exponents = tuple[int, ...]


def book_form(a: Quotient) -> Node:
    """Return a quotient in the shortest of its forms; raises NoClosedFormError for one that is too long to be read."""
    if a.is_zero:
        return ZERO
    if a.size > _MOST_TERMS:
        raise NoClosedFormError("the closed form is too long")
    field = a.field
    above, below = (trigonometric_forms(field, p) for p in (a.above, a.below))
    pairs = {field.cancelled(x, y) for x in above for y in below}
    found = min((_fraction(field, *pair) for pair in pairs), key=_reading)
    apart = [node for pair in pairs if (node := _term_by_term(field, *pair)) is not None]
    found = min((x for x in apart if len(text(x)) < _MUCH_SHORTER * len(text(found))), key=_reading, default=found)
    if len(text(found)) > _LONGEST:
        raise NoClosedFormError("the closed form is too long")
    return found


def _reading(node: Node) -> tuple[int, str]:
    written = text(node)
    return len(written), written


def trigonometric_forms(field: Field, p: Poly) -> list[Poly]:
    """Return a polynomial with sin^2 as 1 - cos^2 and with cos^2 as 1 - sin^2, angle by angle."""
    forms = [field.in_ring(p)]
    for k, letter in enumerate(field.letters if len(p) <= _MOST_TERMS_TRIED else ()):
        if letter.cosine is not None and any(m[letter.cosine] > 1 for form in forms for m in form):
            square = 1 - field.ring.gens[k] ** 2
            forms += [field.replaced(form, letter.cosine, square) for form in forms]
    return forms[:_MOST_FORMS]


# --- fractions -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Product:
    """number x factors, each a polynomial with a whole exponent (negative below), written times its scale."""

    number: Fraction
    factors: tuple[tuple[Poly, int], ...]
    scales: Mapping[Poly, Fraction] = field(default_factory=dict)


def _fraction(field: Field, above: Poly, below: Poly) -> Node:
    """Return above / below as one product, or as a whole part and the rest where that is much shorter."""
    single = _single_fraction(field, above, below)
    content, primitive = below.primitive()
    whole, rest = above.div(primitive)
    if not whole or not field.reduced(rest) or below.is_ground:
        return single
    parts = add(_single_fraction(field, whole, field.ring(content)), _single_fraction(field, rest, below))
    size = single.args[0] if single.op == "neg" else single
    is_product = size.op == "div" and size.args[0].op == "mul"
    return parts if len(text(parts)) < (_MUCH_SHORTER if is_product else 1) * len(text(single)) else single


def _term_by_term(field: Field, above: Poly, below: Poly) -> Node | None:
    """Return above / below with its one long sum divided part by part, by sines and cosines; None where none is.

    cos b/sqrt(c) + l sin b/(3 c + l^2) has no shorter common denominator.
    """
    product = _factored(above, below)
    factors = sorted(((p, e) for p, e in product.factors if e > 0), key=lambda factor: -len(factor[0]))
    divisors = [(p, -e) for p, e in product.factors if e < 0]
    if not factors or not divisors or factors[0][1] != 1:
        return None
    longest, others = factors[0][0], factors[1:]
    angles = [k for k, letter in enumerate(field.letters) if _is_of_angle(letter)]
    parts: dict[Exponents, dict[Exponents, Any]] = {}
    for m, c in field.in_ring(longest).items():
        parts.setdefault(tuple(m[k] for k in angles), {})[m] = c
    if not 1 < len(parts) <= _MOST_PARTS:
        return None
    divisor = reduce(mul, (field.in_ring(p) ** e for p, e in divisors))
    turned = 1 if product.number > 0 else -1
    shares = (field.cancelled(field.ring.from_dict(x) * turned, divisor) for x in parts.values())
    terms = sorted((_single_fraction(field, *x) for x in shares), key=lambda x: (x.op == "neg", text(x)))
    outside = replace(product, number=abs(product.number), factors=tuple(others))
    return _product_node(field, outside, [(reduce(add, terms), 1)])


def _is_of_angle(letter: Letter) -> bool:
    return letter.node is not None and letter.node.op in ("sin", "cos")


def _single_fraction(field: Field, above: Poly, below: Poly) -> Node:
    product, root = _taken_roots(field, _factored(above, below))
    outside, root = _root_with_decimals(field, root)
    product = _with_decimals(field, _with_few_signs(field, replace(product, number=product.number * outside)))
    node = _product_node(field, replace(product, number=abs(product.number)), _root(field, root))
    return node if product.number > 0 else negate(node)


def _factored(above: Poly, below: Poly) -> _Product:
    content, factors = factored(above)
    other, other_factors = factored(below)
    exponents = [*factors, *((p, -e) for p, e in other_factors)]
    return _Product(Fraction(int(content), int(other)), tuple(exponents))


def _taken_roots(field: Field, product: _Product) -> tuple[_Product, _Product]:
    """Return the product without its roots, and what stands under the one root that they make.

    A radicand that also divides goes below the root, sqrt(f) / f = sqrt(1 / f); a number does so only beside others.
    """
    radicands = [field.in_ring(r) for p, _ in product.factors if (r := _radicand(field, p)) is not None]
    plain = [(p, e) for p, e in product.factors if _radicand(field, p) is None]
    numeric = [int(r.LC) for r in radicands if r.is_ground]
    inside, outside, under = [], product.number, Fraction(1)
    for radicand in (r for r in radicands if not r.is_ground):
        k = next((k for k, (p, e) in enumerate(plain) if e < 0 and p in (radicand, -radicand)), None)
        inside.append((radicand, 1 if k is None else -1))
        if k is not None:
            outside = outside if plain[k][0] == radicand else -outside
            plain[k] = (plain[k][0], plain[k][1] + 1)
    for prime in numeric:
        moved = bool(inside) and outside.denominator % prime == 0
        outside, under = (outside * prime, under / prime) if moved else (outside, under * prime)
    return _Product(outside, tuple((p, e) for p, e in plain if e)), _Product(under, tuple(inside))


def _root(field: Field, inside: _Product) -> list[tuple[Node, int]]:
    """Return the root of a product as a factor: sqrt(a / b), or 1 / sqrt(b)."""
    if inside.factors and all(e < 0 for _, e in inside.factors) and inside.number.numerator == 1:
        turned = _Product(1 / inside.number, tuple((p, -e) for p, e in inside.factors), inside.scales)
        return [(BUILD["sqrt"](_product_node(field, turned)), -1)]
    node = _product_node(field, inside)
    return [] if node is ONE else [(BUILD["sqrt"](node), 1)]


def _radicand(field: Field, factor: Poly) -> Poly | None:
    """Return the radicand of a factor that is nothing but the letter of a root."""
    if len(factor) != 1:
        return None
    letters = [k for k, exponent in enumerate(factor.LM) if exponent]
    letter = field.letters[letters[0]] if len(letters) == 1 else None
    return letter.square if letter is not None and letter.node is None else None


def _with_few_signs(field: Field, product: _Product) -> _Product:
    """Return the product with sums below that are positive, others without leading signs, and few signs before it.

    -5 g / (14 (R - r)), not 5 g / (14 (r - R)) where R is the larger one; g (m1 - m2) for -g (m2 - m1).
    """
    value, factors = product.number, list(product.factors)
    for k, (p, e) in enumerate(factors):
        is_difference = any(c > 0 for c in p.values())
        if field.value(p) < 0 if e < 0 and is_difference else not is_difference:
            factors[k], value = (-p, e), -value if e % 2 else value
    if value < 0:
        for k, (p, e) in enumerate(factors):
            if e > 0 and e % 2 and any(c < 0 for c in p.values()):
                factors[k], value = (-p, e), -value
                break
    return _Product(value, tuple(factors))


# --- decimals ------------------------------------------------------------------------------------------------------


def _with_decimals(field: Field, product: _Product) -> _Product:
    """Return the product with decimals in sums where this makes it shorter: 2 (a - 0.001) for (1000 a - 1) / 500."""
    for p, e in product.factors:
        if not decimal_scales(p, product.number if e == 1 else _WHOLE):
            product = _scaled(product, p, e, power_scale(p))
    found, together = [product], product
    for p, e in product.factors:
        if product.scales.get(p, _WHOLE) != _WHOLE:
            continue
        scales = decimal_scales(p, product.number if e == 1 else _WHOLE) if looks_decimal(field, p) else set()
        if e == 1 and len(p) > 1 and names_pi_alone(p):
            scales.add(abs(product.number))
        found += [_scaled(product, p, e, scale) for scale in scales]
        together = _scaled(together, p, e, _shortest(field, p, scales or {_WHOLE}))
    return min((*found, together), key=lambda x: _length(field, x))


def _shortest(field: Field, p: Poly, scales: Iterable[Fraction]) -> Fraction:
    """Return the scale with which a sum is shortest."""
    return min(scales, key=lambda scale: (len(text(_sum(field, p, scale))), scale))


def _root_with_decimals(field: Field, inside: _Product) -> tuple[Fraction, _Product]:
    """Return what leaves a root when its sums are written with decimals, and what stays: 5 sqrt(d^2 + 0.04)."""
    outside = _WHOLE
    for p, e in inside.factors:
        scale = _square_scale(field, p)
        outside /= exact_root(scale) ** e
        if e == 1 and scale == power_scale(p, 2) != 1:  # long numbers take in what stands before their sum
            scale, inside = scale * inside.number, replace(inside, number=_WHOLE)
        inside = replace(inside, scales={**inside.scales, p: scale})
    return outside, inside


def _square_scale(field: Field, p: Poly) -> Fraction:
    """Return the square that gives a sum under a root short decimals, 1 if whole numbers are as short."""
    squares = [s for s in decimal_scales(p, _WHOLE) if exact_root(s)] if looks_decimal(field, p) else []
    return _shortest(field, p, (_WHOLE, *squares)) if squares else power_scale(p, 2)


def _scaled(product: _Product, p: Poly, exponent: int, scale: Fraction) -> _Product:
    return replace(product, number=product.number / scale**exponent, scales={**product.scales, p: scale})


def _length(field: Field, product: _Product) -> tuple[int, int]:
    """Return the length of a product's text, more for each sum whose whole numbers look as if they were decimals.

    Among equals the product is best that has the fewest numbers in its sums.
    """
    scales = [(p, product.scales.get(p, _WHOLE)) for p, _ in product.factors]
    whole = sum(looks_decimal(field, p) and scale == 1 for p, scale in scales)
    numbers = sum(abs(int(c) * scale) != 1 for p, scale in scales for c in p.values())
    return len(text(_product_node(field, product))) + _WHOLE_FOR_DECIMAL * whole, numbers


def _product_node(field: Field, product: _Product, atoms: Iterable[tuple[Node, int]] = ()) -> Node:
    """Return a product with a positive number as one quotient, `atoms` (other factors with exponents) included."""
    product, made = _multiples_in_product(field, product)
    if product.number < 0 and not product.scales:
        product = _with_few_signs(field, product)
    if product.number < 0:
        return negate(_product_node(field, replace(product, number=-product.number), [*atoms, *made]))
    powers = [*atoms, *made, *((_sum(field, p, product.scales.get(p, _WHOLE)), e) for p, e in product.factors)]
    powers = with_tangents(powers)
    above = _multiplied([(node, e) for node, e in powers if e > 0])
    below = _multiplied([(node, -e) for node, e in powers if e < 0])
    return _with_number(product.number, above, below)


def _multiples_in_product(field: Field, product: _Product) -> tuple[_Product, list[tuple[Node, int]]]:
    """Return a product without factors that together are the sine or cosine of a multiple of an angle, and these.

    What is met as cos(3 a) has the factors cos(a) and 4 cos(a)^2 - 3.
    """
    made: list[tuple[Node, int]] = []
    for s, c in angles_with_multiples(field):
        for side in (1, -1):
            own = [(field.in_ring(p), e) for p, e in product.factors if e * side > 0 and is_of_angle(field, p, s, c)]
            found = single_wave(field, reduce(mul, (p ** abs(e) for p, e in own), field.ring.one), s, c)
            if found is not None:
                left = tuple((p, e) for p, e in product.factors if (field.in_ring(p), e) not in own)
                product = replace(product, number=product.number * found[1] ** side, factors=left)
                made.append((found[0], side))
    return product, made


def _with_number(value: Fraction, above: Node, below: Node) -> Node:
    """Return value x above / below: small denominators stand below, others make a decimal where they can."""
    if below is ONE:
        return multiply(number(value), above)
    if is_long(value):
        return divide(multiply(number(value), above), below)
    if value.denominator <= _SMALL or not is_exact_decimal(value.denominator):
        above, below = multiply(number(value.numerator), above), multiply(number(value.denominator), below)
        return divide(above, below)
    return divide(multiply(number(value), above), below)


# --- sums and products ---------------------------------------------------------------------------------------------


def _sum(field: Field, p: Poly, scale: Fraction = _WHOLE) -> Node:
    """Return a polynomial times `scale` as a sum, positive terms first.

    g m1 + g m2 becomes g (m1 + m2) where that is shorter.
    """
    terms = {m: c * scale for m, c in contracted(field, p).items()}
    plain = [(_term(field, m), c) for m, c in terms.items()]
    forms = [_added(_grouped(field, terms)), _added(plain), *_with_multiples(field, p, scale)]
    return min(forms, key=lambda node: len(text(node)))


def _with_multiples(field: Field, p: Poly, scale: Fraction) -> Iterator[Node]:
    """Yield a sum with multiples of an angle, for each angle of which the model names them."""
    p = field.in_ring(p)
    for s, c in angles_with_multiples(field):
        found = waves(field, p, s, c)
        if found is not None and any(n > 1 for _, _, n in found):
            yield _added(
                (_multiplied([*_powers(field, rest), (wave(field, s, kind, n), 1)]), x * scale)
                for (rest, kind, n), x in found.items()
            )


def _added(terms: Iterable[tuple[Node, Fraction]]) -> Node:
    ordered = sorted(terms, key=lambda term: (term[1] < 0, term[0] is ONE, text(term[0])))
    return reduce(add, (multiply(number(c), node) for node, c in ordered))


def _grouped(field: Field, terms: dict[Exponents, Fraction]) -> list[tuple[Node, Fraction]]:
    """Return terms that differ in one letter only as a product of what they share and a sum."""
    left = dict(terms)
    found: list[tuple[Node, Fraction]] = []
    while True:
        groups: dict[Exponents, list[Exponents]] = {}
        for m in left:
            for k, exponent in enumerate(m):
                if exponent == 1:
                    groups.setdefault(shifted(m, k, -1), []).append(m)
        worth = [x for x, group in groups.items() if any(x) or _share_number(left, group)]
        shared = max(worth, key=lambda x: (len(groups[x]), _evenness(left, groups[x]), sum(x), x), default=None)
        if shared is None or len(groups[shared]) < 2:
            return [*found, *((_term(field, m), c) for m, c in left.items())]
        inside = {tuple(e - s for e, s in zip(m, shared, strict=True)): left.pop(m) for m in groups[shared]}
        side = _shared_number(inside.values()) * (-1 if all(c < 0 for c in inside.values()) else 1)
        inner = _added([(_term(field, m), c / side) for m, c in inside.items()])
        found.append((_multiplied([*_powers(field, shared), (inner, 1)]), side))


def _shared_number(numbers: Collection[Fraction]) -> Fraction:
    """Return the number that is written before a sum: what whole numbers share, what decimals are if they are equal."""
    if all(c.denominator == 1 for c in numbers):
        return Fraction(gcd(*(int(c) for c in numbers)))
    sizes = {abs(c) for c in numbers}
    return sizes.pop() if len(sizes) == 1 else _WHOLE


def _share_number(terms: Mapping[Exponents, Fraction], group: Collection[Exponents]) -> bool:
    """Return whether letters that are less than the whole sum have the same number before them, and one to be seen."""
    sizes = {abs(terms[m]) for m in group}
    return len(sizes) == 1 and sizes != {_WHOLE} and len(group) < len(terms)


def _evenness(terms: dict[Exponents, Fraction], group: list[Exponents]) -> float:
    """Return how near the coefficients of a group are to each other: 1 for equal ones."""
    sizes = [abs(terms[m]) for m in group]
    return float(min(sizes) / max(sizes))


def _term(field: Field, exponents: Exponents) -> Node:
    return _multiplied(_powers(field, exponents))


def _powers(field: Field, exponents: Exponents) -> list[tuple[Node, int]]:
    powers = []
    for k, exponent in enumerate(exponents):
        if exponent:
            letter = field.letters[k]
            nodes = _written_root(field, letter) if letter.node is None else [letter.node]
            powers += [(node, exponent) for node in nodes]
    return powers


def _written_root(field: Field, letter: Letter) -> list[Node]:
    """Return the factors as which a root is written: 10 and sqrt(h^2 + 0.09)."""
    square = field.in_ring(letter.square)
    scale = _square_scale(field, square)
    return [number(1 / exact_root(scale)), BUILD["sqrt"](_sum(field, square, scale))]


def _multiplied(powers: Iterable[tuple[Node, int]]) -> Node:
    """Return the product of powers: letters first, then their powers, functions, roots, sums."""
    factors = [power(node, number(e)) for node, e in powers if e]
    return reduce(multiply, sorted(factors, key=_place_in_product), ONE)


_PLACES: Final = {"pi": 0, "symbol": 1, "pow": 2, "sqrt": 4, "add": 5}


def _place_in_product(node: Node) -> tuple[int, str]:
    op = node.args[0].op if node.op == "pow" and node.args[0].op != "symbol" else node.op
    return _PLACES.get(op, 3), text(node)
