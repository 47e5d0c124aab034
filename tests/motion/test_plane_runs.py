"""Random plane runs against a program that shares nothing with the package: events, impulses and states."""

from __future__ import annotations

import numpy as np
import pytest
from plane_comparison import compare, reference
from plane_geometry import TINY, Geometry
from plane_impacts import Blow, missed
from plane_models import random_model

SOON = (1, 2, 14, 23, 41, 45, 49, 61, 105)
"""Seeds of runs that take little time; they slide, stick, roll, hang on ropes, strike in turn and meet stops."""


@pytest.mark.parametrize("seed", SOON)
def test_a_plane_run_is_that_of_an_independent_program(seed: int) -> None:
    found = compare(reference(random_model(seed)), backend="python")
    assert (found.difference, found.why) == ("", "")
    assert found.events > 0


def test_an_end_is_not_unique_where_two_answers_fulfil_the_laws_and_only_there() -> None:
    """Of two contacts that strike one leaves, or both stay; where only impulses within are open the run goes on."""
    assert "impacts fulfil the laws" in reference(random_model(160)).why
    inner = np.array([[1.0, 0.2], [0.2, 1.0]])
    K = np.block([[inner, np.zeros((2, 2))], [np.zeros((2, 2)), np.ones((2, 2))]])
    v, mu, e = np.array([-1.0, -1.0, 0.1, 0.1]), np.full(2, 0.7), np.array([0.5, 0.5])
    blow = Blow(K, v, mu, mu, e)
    blow.strike()
    assert blow.v == pytest.approx([0.5, 0.5, 0.0, 0.0], abs=1e-12)
    bounds = np.zeros(2), np.zeros(2)
    assert missed(K, v, bounds, (mu, mu), np.array([1.0, 1.0, -0.05, -0.05]) / 1.2) > 0.01
    assert missed(K, v, bounds, (mu, mu), np.array([1 / 1.2, 1 / 1.2, -0.3, 0.2])) < 1e-12


@pytest.mark.long
@pytest.mark.parametrize("seed", range(200))
def test_plane_runs_are_those_of_an_independent_program(seed: int) -> None:
    """They are compared until a disturbance of 1e-10 has grown to 1e-7, or the law has several answers."""
    assert compare(reference(random_model(seed)), backend="python").difference == ""


def test_rows_of_the_independent_program_are_gradients_of_its_gaps() -> None:
    for seed in range(20):
        geometry = Geometry(random_model(seed))
        every, q = list(range(len(geometry.elements))), geometry.start
        for k, way in enumerate(np.eye(geometry.size)):
            z = (q + 1j * TINY * way).tolist()
            for number, element in enumerate(geometry.elements):
                fill = {"contact": geometry._contact, "rope": geometry._rope}.get(element.kind, geometry._stop)
                rows = np.zeros((2, geometry.size), dtype=complex)
                slope = fill(z, element, *rows).imag / TINY
                normal = geometry.rows(q, way, [every[number]]).normal[0]
                assert slope == pytest.approx(normal[k], abs=1e-12), (seed, element.name)
