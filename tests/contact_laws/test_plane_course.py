"""The course of one contact in the plane, written out, against the integration that looks for its stretches."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from multibody_sym.contact_laws.impact_problem import ImpactLaw, ImpactProblem
from multibody_sym.contact_laws.impact_sequence import strike
from multibody_sym.contact_laws.problem import FrictionLaw, FrictionRow, LawProblem, Unilateral
from multibody_sym.dynamics.contact.impact_problem import Deciding, Following, PlaneContact, both_ways, plane_course
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import as_node, symbol


def random_contact(rng: np.random.Generator, law: ImpactLaw) -> tuple[PlaneContact, ImpactProblem]:
    A = rng.normal(size=(2, 3))
    K, v = A @ A.T, np.array([-rng.uniform(0.1, 2), rng.normal() * rng.choice([0.02, 0.3, 2.0])])
    kinetic, e = rng.uniform(0, 1.5), rng.uniform(0, 1)
    static = kinetic * rng.choice([1.0, 1.5])
    enough = bool(rng.random() < 0.1)
    returned = 0.0 if enough else float(rng.choice([0.0, 0.0, 0.5, 1.0]))
    laws = (Unilateral(), FrictionRow(0))
    part = FrictionLaw((1,), (0,), static, kinetic, enough=enough)
    rows = LawProblem(A, A.copy(), np.zeros((2, 2)), -v, laws, (part,))
    own = float(K[0, 0]), float(K[0, 1]), float(K[1, 1])
    posed = ImpactProblem(rows, np.array([e, 0.0]), (returned,), law, "one_by_one")
    back, speeds = None if enough else returned, (float(v[0]), float(v[1]))
    return PlaneContact(own, speeds, static, kinetic, e, back, enough, law), posed


@pytest.mark.parametrize("law", ["newton", "poisson", "stronge"])
def test_random_contacts(law: ImpactLaw) -> None:
    rng, courses = np.random.default_rng(1), set[tuple[int, ...]]()
    for _ in range(300):
        contact, posed = random_contact(rng, law)
        struck = strike(posed)
        if struck.impacts != 1:
            continue
        courses.add(struck.course(0))
        found = plane_course(contact, Deciding())
        assert found == pytest.approx(struck.impulses.tolist(), rel=1e-10, abs=1e-12), (contact, struck.course(0))
    assert {(1,), (-1,), (1, 0), (-1, 0), (1, -1), (-1, 1)} <= courses


@pytest.mark.parametrize("law", ["newton", "poisson", "stronge"])
def test_programs_go_both_ways_and_formulas_the_way_of_their_numbers(law: ImpactLaw) -> None:
    rng = np.random.default_rng(2)
    names = [symbol(name) for name in ("a", "b", "c", "n", "t", "s", "k", "e")]
    whole = {
        enough: plane_course(
            PlaneContact(tuple(names[:3]), tuple(names[3:5]), *names[5:], None, enough, law), both_ways
        )
        for enough in (False, True)
    }
    for _ in range(100):
        contact, _ = random_contact(rng, law)
        values = dict(zip(names, (*contact.K, *contact.v, contact.static, contact.kinetic, contact.e), strict=True))
        plain = replace(contact, returned=None)
        decided = Deciding()
        number = plane_course(plain, decided)
        nodes = PlaneContact(tuple(names[:3]), tuple(names[3:5]), *names[5:], None, contact.enough, law)
        follows = Following(decided.taken)
        formula = plane_course(nodes, follows)
        for pair in (whole[contact.enough], formula):
            assert list(evaluate_float(map(as_node, pair), values)) == pytest.approx(number, rel=1e-12)
        conditions = evaluate_float([as_node(x) for x, _ in follows.conditions], values)
        assert all(x >= 0 for x in conditions)
