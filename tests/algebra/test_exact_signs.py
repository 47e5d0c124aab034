"""Signs at the sample, decided exactly: what is zero is told from what is small."""

from __future__ import annotations

import pytest

from multibody_sym.algebra.quotient_functions import decided_sign, exact
from multibody_sym.algebra.quotients import PRECISE, Field, Letter
from multibody_sym.scalars.node import symbol
from multibody_sym.text.parser import parse


def decided(expression: str, **values: str) -> int | None:
    """Return the sign of an expression in letters that have these values."""
    field, exactly = Field(50_000), {symbol(name): parse(value) for name, value in values.items()}
    samples = {node: exact(Field(1000), [value], {})[0].sample for node, value in exactly.items()}
    known = {node: field.letter(node, Letter(node, sample)) for node, sample in samples.items()}
    return decided_sign(exact(field, [parse(expression)], known)[0], exactly)


@pytest.mark.parametrize(
    ("expression", "values"),
    [
        ("mu*cos(a) - sin(a)", {"mu": "1", "a": "pi/4"}),
        ("mu*cos(a) - sin(a)", {"mu": "sqrt(3)/3", "a": "pi/6"}),
        ("mu*cos(a) - sin(a)", {"mu": "tan(pi/7)", "a": "pi/7"}),
        ("mu*cos(a) - sin(a)", {"mu": "3/10", "a": "atan(3/10)"}),
        ("sqrt(x + 2*sqrt(6)) - y", {"x": "5", "y": "sqrt(2) + sqrt(3)"}),
        ("x*sin(a)*sin(3*a) - y", {"x": "1", "a": "pi/10", "y": "1/4"}),
        ("cos(a) - cos(2*a) - y", {"a": "pi/5", "y": "1/2"}),
        ("x*sin(a)*sin(b) - y", {"x": "16", "a": "pi/14", "b": "3*pi/14", "y": "8*(cos(pi/7) - cos(2*pi/7))"}),
        ("x*sin(a)*sin(b)*sin(c) - 1", {"x": "8", "a": "pi/14", "b": "3*pi/14", "c": "5*pi/14"}),
    ],
)
def test_what_is_zero_is_known_to_be(expression: str, values: dict[str, str]) -> None:
    assert decided(expression, **values) == 0


def test_what_is_small_has_a_sign() -> None:
    assert decided("sqrt(x + 2*sqrt(6)) - y", x="5", y="31462643699419723/10000000000000000") == 1
    assert decided("mu*cos(a) - sin(a)", mu="1 - 1/10^30", a="pi/4") == -1


def test_what_is_smaller_than_forty_digits_show_is_not_called_zero() -> None:
    """pi and a quotient of whole numbers that has its first 45 digits differ, which 50 digits do not prove."""
    digits = PRECISE.nstr(+PRECISE.pi, 47)
    near = f"{digits.replace('.', '')}/10^46"
    assert decided("x - y", x="pi", y=near) is None
    assert decided("mu*cos(a) - sin(a)", mu="1 - 1/10^45", a="pi/4") is None
