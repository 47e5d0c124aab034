"""Absolute values and signs in sums of products, and the whole numbers that a factor's terms share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import sympy

from multibody_sym.algebra.terms import Monomial, Terms, add_to, monomial, replaced


def with_signs(terms: Terms) -> Terms:
    """Return the terms with |x| written as x sign(x), so that x^2 / |x| and |x| are one; sign(x)^2 is 1 beside an x."""
    return _with_keys(terms, _with_signs) if _has(terms, sympy.Abs, sympy.sign) else terms


def with_sizes(terms: Terms) -> Terms:
    """Return the terms with x sign(x) written as |x|, and sign(x) / x as 1 / |x|."""
    return _with_keys(terms, _with_sizes) if _has(terms, sympy.sign) else terms


def _has(terms: Terms, *functions: Any) -> bool:
    return any(isinstance(base, functions) for key in terms for base, _ in key)


def _with_keys(terms: Terms, changed: Callable[[Monomial], Monomial]) -> Terms:
    result: Terms = {}
    for key, factor in terms.items():
        add_to(result, changed(key), factor)
    return result


def _with_signs(key: Monomial) -> Monomial:
    powers = dict(key)
    for x in {base.args[0] for base in powers if isinstance(base, (sympy.Abs, sympy.sign))}:
        size, sign = sympy.Abs(x), sympy.sign(x)
        plain, sizes, signs = found = [powers.get(base, sympy.S.Zero) for base in (x, size, sign)]
        alone = plain == sizes == 0  # sign(x)^2 is not 1 where x is 0
        if all(e.is_Integer for e in found) and not alone:
            powers |= {x: plain + sizes, size: sympy.S.Zero, sign: (sizes + signs) % 2}
    return monomial(powers)


def _with_sizes(key: Monomial) -> Monomial:
    powers = dict(key)
    for sign in [base for base, exponent in key if isinstance(base, sympy.sign) and exponent == 1]:
        (x,) = sign.args
        exponent = powers.get(x, sympy.S.Zero)
        if exponent.is_Integer and exponent != 0:
            outer = sympy.sign(exponent)
            powers |= {x: exponent - outer, sympy.Abs(x): outer, sign: sympy.S.Zero}
    return monomial(powers)


def with_numbers_outside(expression: Any) -> Any:
    """Return an expression with the whole numbers that the terms of a factor share before it: 4 (a - b)^2, 2 |a|."""
    return replaced(expression, _shares_number, _number_outside)


def _shares_number(e: Any) -> bool:
    return any(part.is_Add and _shared_number(part) != 1 for part in _factors_of(e))


def _factors_of(e: Any) -> tuple[Any, ...]:
    """Return the parts of a product, power or absolute value before which a number may be written."""
    is_power = e.is_Pow and e.exp.is_Integer
    return e.args if e.is_Mul else (e.args[0],) if is_power or isinstance(e, sympy.Abs) else ()


def _shared_number(total: Any) -> Any:
    number = total.primitive()[0]
    return number if number.is_Integer else sympy.S.One


def _number_outside(e: Any) -> Any:
    factor, parts = sympy.S.One, []
    for part in _factors_of(e):
        shared = _shared_number(part) if part.is_Add else sympy.S.One
        factor *= shared
        parts.append(part if shared == 1 else sympy.Add(*(x / shared for x in part.args)))
    inner = sympy.Mul(*parts) if e.is_Mul else e.func(parts[0], *e.args[1:])
    return (factor**e.exp if e.is_Pow else factor) * inner
