"""Smooth laws that are narrow beside a step: a run meets them wherever they end as good as nothing."""

from __future__ import annotations

from multibody_sym.scalars.sign_changes import fading_functions
from multibody_sym.text.parser import parse


def test_fading_functions_are_zero_where_laws_have_become_as_good_as_constant() -> None:
    def found(law: str) -> list[str]:
        return [str(g) for g in fading_functions([parse(law)])]

    assert len(found("exp(-x^2) + exp(-x^2)*y")) == 1
    assert len(found("tanh(x) + 1/cosh(x)")) == 2
    assert found("sin(x)/x + exp(2) + x^3") == []
