"""Functions of scalars take numbers and expressions: text, and what hides text, is refused and never read by sympy."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy

import multibody_sym as mbs
from multibody_sym.errors import InputError
from multibody_sym.scalars.node import symbol

TEXT = "__import__('pathlib').Path('canary').touch()"
UNARY = [mbs.sin, mbs.cos, mbs.tan, mbs.asin, mbs.acos, mbs.atan, mbs.exp, mbs.log, mbs.sqrt, mbs.absolute, mbs.sign]
BINARY = [mbs.atan2, mbs.minimum, mbs.maximum]


class Told(str):
    """Text of a class of its own."""


class Spelt:
    """What sympy would ask for its text."""

    def __str__(self) -> str:
        return TEXT

    def _sympy_(self) -> str:
        return TEXT


DISGUISES: list[Any] = [
    TEXT, Told(TEXT), Spelt(), [TEXT], (TEXT,), {"x": TEXT}, np.str_(TEXT), np.array(TEXT), np.array([TEXT]),
    np.array(TEXT, dtype=object), TEXT.encode(), "1", "x",
]
OTHERS: list[Any] = [None, 1j, np.complex128(1), object(), [1.0], np.array([1.0, 2.0]), sympy.Matrix([1]), sympy.sin]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("value", [*DISGUISES, *OTHERS], ids=lambda value: type(value).__name__)
def test_functions_take_no_text(value: Any, folder: Path) -> None:
    calls: list[Callable[[], Any]] = [lambda f=f: f(value) for f in UNARY]
    for other in (1.0, symbol("q"), sympy.Symbol("q")):
        calls += [lambda f=f, other=other: f(value, other) for f in BINARY]
        calls += [lambda f=f, other=other: f(other, value) for f in BINARY]
        calls += [lambda other=other: mbs.where(value, other, 1), lambda other=other: mbs.where(other, value, 1)]
        calls += [lambda other=other: mbs.where(other, 1, value)]
    for call in calls:
        with pytest.raises(InputError, match="takes numbers and expressions"):
            call()
    assert not list(folder.iterdir())


def test_text_is_told_where_it_is_read() -> None:
    with pytest.raises(InputError, match=r"sin takes numbers and expressions, no text.*parameters\(\.\.\.\).*'2\*x'"):
        mbs.sin("2*x")


def test_numbers_of_every_kind_are_taken() -> None:
    for one in (1, 1.0, Fraction(1), np.float64(1), np.float32(1), np.int64(1), np.array(1.0), np.longdouble(1)):
        assert float(mbs.sin(one)) == math.sin(1.0)
        assert mbs.maximum(one, 3) == 3
        assert mbs.atan2(symbol("x"), one) is mbs.atan2(symbol("x"), 1)
    assert mbs.sin(sympy.Symbol("x")) == sympy.sin(sympy.Symbol("x"))


@pytest.mark.parametrize(
    "call",
    [lambda: mbs.sqrt(-1), lambda: mbs.log(0.0), lambda: mbs.acos(2), lambda: mbs.exp(1e3), lambda: mbs.sin(math.inf),
     lambda: mbs.sqrt(10**400), lambda: mbs.sin(10**400), lambda: mbs.minimum(sympy.I, sympy.Symbol("x"))],
)
def test_what_has_no_value_is_told(call: Callable[[], Any]) -> None:
    with pytest.raises(InputError, match=r"finite real number|no real value"):
        call()


def test_symbols_of_other_names_stay_symbols(folder: Path) -> None:
    """A symbol that someone else named in code is a name that no model declares, and nothing else."""
    with pytest.raises(InputError, match="cannot stand in expressions"):
        mbs.Body(mass=sympy.Symbol(TEXT), com=[0, -1, 0])
    assert not list(folder.iterdir())
