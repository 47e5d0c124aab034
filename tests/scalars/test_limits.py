"""What contacts and friction allow: the same over numbers, Nodes and sympy, and as the laws say."""

from __future__ import annotations

import math

import pytest
import sympy

from multibody_sym.scalars import limits
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import symbol

FORCES, SIDES = [3.0, -4.0, 12.0], [1, -1, 0]
NAMES = ["a", "b", "c"]


def test_normal_forces_press_by_their_sizes_or_by_the_length_of_their_vector():
    leaves = dict(zip(map(symbol, NAMES), FORCES, strict=True))
    letters = dict(zip(sympy.symbols(NAMES), FORCES, strict=True))
    for norm, N in ((False, 19.0), (True, 13.0)):
        assert limits.pressing(FORCES, SIDES, norm=norm) == N
        assert evaluate([limits.pressing(list(leaves), SIDES, norm=norm)], leaves, float) == [N]
        assert limits.pressing(list(letters), SIDES, norm=norm).subs(letters) == N


def test_what_slides_rubs_with_its_limit_against_its_velocity():
    along = limits.sliding(0.4, [3.0, 4.0], 5.0)
    assert limits.length(along) == pytest.approx(limits.most(0.4, 1.0), rel=1e-15)
    assert along == pytest.approx([-0.24, -0.32], rel=1e-15)
    assert limits.sliding(0.4, [-1]) == [0.4]


def test_what_creeps_has_the_coefficient_of_its_own_friction():
    velocity, least = [0.03, -0.04], 0.12
    friction = limits.sliding(0.5, velocity, limits.length([*velocity, least]))
    assert limits.length(friction) == pytest.approx(limits.creep_coefficient(0.5, velocity, least), rel=1e-15)
    assert limits.creep_coefficient(0.5, velocity, 1e-12) == pytest.approx(0.5, rel=1e-12)


def test_a_gripping_rope_keeps_the_ratio_of_eytelwein():
    """dT = mu T dphi, summed over small pieces of the wrap, in each of which friction is the most that it can be."""
    mu, wrap, pieces = 0.3, 2.5, 2000
    coefficient = limits.grip_coefficient(math.exp(mu * wrap))
    less, greater = 1.0, limits.tension_ratio(coefficient)
    assert greater - less == pytest.approx(limits.most(coefficient, (less + greater) / 2.0), rel=1e-14)
    pulled = less
    for _ in range(pieces):
        pulled *= limits.tension_ratio(mu * wrap / pieces)
    assert greater == pytest.approx(pulled, rel=1e-7)
    assert limits.tension_ratio(2.0) > 1e17
