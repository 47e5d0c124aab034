"""Smooth laws that are narrow beside a step: a run meets them wherever they end as good as nothing."""

from __future__ import annotations

import math

import pytest

import multibody_sym as mbs
from multibody_sym.scalars.sign_changes import fading_functions
from multibody_sym.text.parser import parse

TEXT = """
multibody_sym: 1
name: narrow
parameters: {w: WIDTH, F: 1}
bodies: {a: {mass: 1}}
joints: {A: {type: prismatic, parent: ground, child: a, axis: x, q: x, initial: {q: 0, u: 1}}}
forces: {f: {type: force, on: a, value: ["-F/w*LAW", 0, 0]}}
"""


def final_speed(law: str, width: float, **settings: object) -> float:
    system = mbs.loads(TEXT.replace("WIDTH", str(width)).replace("LAW", law))
    run = mbs.simulate(system, t_end=3, samples=2, backend="python", parameters={"F": 0.1}, **settings)
    return float(run.final["speeds"]["u_x"])


@pytest.mark.parametrize("width", [0.02, 1e-5])
@pytest.mark.parametrize(
    ("law", "area"),
    [
        ("exp(-((x - 1)/w)^2)", math.sqrt(math.pi)),
        ("1/cosh(min(50, max(-50, (x - 1)/w)))^2", 2.0),
        ("(1 - tanh((x - 1)/w)^2)", 2.0),
        ("exp(-abs(x - 1)/w)", 2.0),
        ("(tanh((x - 1)/w) - tanh((x - 1)/w - 1))", 2.0),
    ],
)
def test_a_narrow_smooth_force_takes_its_work(law: str, area: float, width: float) -> None:
    """From 1 m/s a force whose work is -0.1 area J leaves sqrt(1 - 0.2 area)."""
    assert final_speed(law, width) == pytest.approx(math.sqrt(1 - 0.2 * area), abs=1e-6)


@pytest.mark.parametrize("method", ["bogacki_shampine", "dormand_prince_8", "radau_5", "RK45"])
def test_every_method_meets_it(method: str) -> None:
    found = final_speed("exp(-((x - 1)/w)^2)", 1e-3, method=method, rtol=1e-7)
    assert found == pytest.approx(math.sqrt(1 - 0.2 * math.sqrt(math.pi)), abs=1e-4)


def test_a_narrow_pulse_in_time_is_met() -> None:
    text = TEXT.replace("WIDTH", "1e-4").replace("-F/w*LAW", "pulse")
    system = mbs.loads(f'{text}inputs: {{pulse: "-F/w*exp(-((t - 1.234)/w)^2)"}}\n')
    run = mbs.simulate(system, t_end=3, samples=2, backend="python", parameters={"F": 0.1})
    assert run.final["speeds"]["u_x"] == pytest.approx(1 - 0.1 * math.sqrt(math.pi), abs=1e-6)


def test_fading_functions_are_zero_where_laws_have_become_as_good_as_constant() -> None:
    def found(law: str) -> list[str]:
        return [str(g) for g in fading_functions([parse(law)])]

    assert len(found("exp(-x^2) + exp(-x^2)*y")) == 1
    assert len(found("tanh(x) + 1/cosh(x)")) == 2
    assert found("sin(x)/x + exp(2) + x^3") == []
