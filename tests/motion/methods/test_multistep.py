"""Methods that look back: what construction refuses, textbook coefficients, bodies that turn, restarts, energy."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from multibody_sym.motion.integrator.flow import Flow, Pairing
from multibody_sym.motion.integrator.loop import solution, steps
from multibody_sym.motion.methods.multistep import MULTISTEP
from multibody_sym.motion.methods.table import METHODS

ADAMS, STOERMER, VERLET = (make() for make in MULTISTEP.values())
INERTIA = np.array([1.0, 2.0, 3.0])
BALL = Pairing(4, (), ((0, 0),))


def test_the_coefficients_of_adams_are_those_of_every_textbook() -> None:
    assert [24 * x for x in ADAMS.predictor] == [55, -59, 37, -9]
    assert [24 * x for x in ADAMS.corrector] == [9, 19, -5, 1]


@pytest.mark.parametrize(
    ("method", "change", "message"),
    [
        (ADAMS, {"order": 5}, "the predictor has order 5; it has 4"),
        (ADAMS, {"predictor": (Fraction(3, 2), Fraction(-1, 2))}, "the predictor has order 4; it has 2"),
        (ADAMS, {"corrector": (Fraction(1, 2), Fraction(1, 2))}, "the corrector has order 4; it has 2"),
        (STOERMER, {"position": (Fraction(1),)}, "the position has order 6; it has 2"),
        (STOERMER, {"predictor": (Fraction(1, 2),)}, "the predictor of speeds has order 6; it has 2"),
        (STOERMER, {"corrector": (Fraction(1, 2),)}, "the corrector of speeds has order 6"),
    ],
)
def test_construction_refuses_what_is_not_true(method, change, message) -> None:
    with pytest.raises(ValueError, match=message):
        replace(method, **change)


def turning(t, x):
    """A body about its centre, with a moment that depends on time, attitude and speed."""
    w, a, b, c = x[:4]
    p, q, r = x[4:]
    rates = [-a * p - b * q - c * r, w * p + b * r - c * q, w * q + c * p - a * r, w * r + a * q - b * p]
    moment = np.array([0.3 * np.sin(t) * a, -0.1 * q, 0.2 * w])
    return np.array([*(0.5 * np.array(rates)), *((moment - np.cross(x[4:], INERTIA * x[4:])) / INERTIA)])


def unit(_, x):
    return np.array([*(x[:4] / np.linalg.norm(x[:4])), *x[4:]])


def end_of_turning(name: str, count: int, pairs: Pairing = BALL) -> np.ndarray:
    x0 = np.array([1, 0, 0, 0, 0.3, 2.0, 0.4])
    *_, last = steps(Flow(METHODS[name], turning, 0.0, 4.0, x0, unit, step=4.0 / count, pairs=pairs))
    return last.x_new


@pytest.mark.parametrize(
    ("name", "count"), [("adams_bashforth_moulton", 400), ("stoermer_6", 200), ("stoermer_verlet", 400)]
)
def test_a_body_turns_with_the_order_of_the_method(name: str, count: int) -> None:
    exact = end_of_turning("dormand_prince_8", 300)
    coarse, fine = (np.abs(end_of_turning(name, n) - exact).max() for n in (count, 2 * count))
    assert np.log2(coarse / fine) == pytest.approx(METHODS[name].order, abs=0.2)


def test_a_body_that_turns_too_far_in_a_few_steps_is_left_to_the_starter() -> None:
    exact = end_of_turning("dormand_prince_8", 300)
    assert np.abs(end_of_turning("stoermer_6", 12) - exact).max() < 1e-4


def test_steps_after_a_restart_are_those_of_the_starter() -> None:
    """x'' = -x: in the steps that look back there are two evaluations, in the others twelve."""
    calls: list[float] = []

    def oscillator(t, x):
        calls.append(t)
        return np.array([x[1], -x[0]])

    taken = list(steps(Flow(METHODS["stoermer_6"], oscillator, 0.0, 2.0, np.array([1.0, 0.0]), step=0.1)))
    assert len(taken) == 20
    assert len(calls) == 1 + 5 * 12 + 15 * 2
    assert taken[-1].x_new[0] == pytest.approx(np.cos(2.0), abs=1e-7)


def test_verlet_keeps_the_energy_of_an_oscillator_bounded() -> None:
    _, x = solution(VERLET, lambda t, x: np.array([x[1], -x[0]]), 0.0, 2000.0, np.array([1.0, 0.0]), step=0.2)
    energy = x[:, 0] ** 2 + x[:, 1] ** 2
    assert np.abs(energy - 1).max() < 0.2**2
    assert abs(energy[-100:].mean() - energy[:100].mean()) < 1e-3


def test_stoermer_loses_no_digits_over_many_steps() -> None:
    """Displacements are summed: formed from coordinates, they would leave an error of 1e-11 after 10,000 steps."""
    _, x = solution(STOERMER, lambda t, x: np.array([x[1], -x[0]]), 0.0, 50.0, [1.0, 0.0], step=0.005, samples=2)
    assert abs(x[-1, 0] - np.cos(50.0)) < 2e-13
