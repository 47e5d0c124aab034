"""What is handed over by mistake is answered in words that say what to do instead."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs

TEXT = """\
multibody_sym: 1
name: s
bodies: {a: {mass: 1, com: [1, 0, 0]}}
forces:
joints: {A: {type: planar, parent: ground, child: a, motion: [null, null, 0], initial: {q: [1, 0]}}}
constraints: {rod: {type: distance, between: [ground, a], value: 1}}
"""
SYSTEM = mbs.loads(TEXT)


@pytest.mark.parametrize(
    ("act", "message"),
    [
        (lambda: mbs.compile(SYSTEM), r"compile\(state_derivative\(system\)\)"),
        (lambda: mbs.compile(mbs.state_derivative(SYSTEM), backend="java"), "no backend 'java'; known: c, python"),
        (lambda: mbs.simulate(SYSTEM, backend="java"), "no backend 'java'; known: c, python"),
        (lambda: mbs.simulate(SYSTEM, t_end=0.1, samples=2)[0], r"asked by name, such as run\['theta'\]"),
        (lambda: mbs.parameters("a b", 5), "2 names, 1 values"),
        (lambda: mbs.parameters(["a", "b"], [1, 2]), "expected names separated by spaces, got a list"),
        (lambda: mbs.load(None), "expected the path of a model file, got None"),
        (lambda: mbs.dumps("pendulum.yaml"), "expected a System, got 'pendulum.yaml'"),
        (lambda: mbs.Body(mass=np.array([1.0, 2.0])), "expected a number or an expression"),
        (lambda: mbs.loads(TEXT.replace("mass: 1,", "mass: ,")), "bodies.a.mass: mass is empty: write what it is"),
        (lambda: mbs.loads(TEXT.replace("[1, 0, 0]", "")), "bodies.a.com: com is empty: write what it is"),
    ],
)
def test_mistakes_are_named(act: Callable[[], Any], message: str) -> None:
    with pytest.raises(mbs.MultibodyError, match=message):
        act()


def test_arrays_and_single_values_are_welcome() -> None:
    (m,) = mbs.parameters("m", "2 kg", positive=True)
    assert mbs.Body(mass=np.array(1.0)) == mbs.Body(mass=1)
    assert mbs.Body(mass=m, com=np.array([1.0, 0.0, 2.0])).com == mbs.Body(com=[1, 0, 2]).com


def test_baumgarte_may_be_given_as_itself() -> None:
    run = mbs.simulate(SYSTEM, t_end=0.1, samples=2, constraints=mbs.Baumgarte(alpha=3))
    assert run.baumgarte == {"alpha": 3.0, "beta": 3.0}


def test_check_without_a_start_tells_no_numbers() -> None:
    longer = "value: 1}, longer: {type: distance, between: [ground, a], value: 2}"
    report = mbs.check(mbs.loads(TEXT.replace("value: 1}", longer)))
    found = report.as_json()
    assert report.failure
    assert [found[name] for name in ("degrees_of_freedom", "rank", "shift", "agreement")] == [None, None, None, {}]
