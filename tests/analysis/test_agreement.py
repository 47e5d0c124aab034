"""All routes give the same motion: random trees of 1-12 bodies with masses 1e-6 to 1e6 and links of none, and rows.

A route's accelerations and multipliers are put into the equations of motion of d'Alembert's principle, body by body.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from mechanisms import Case, random_case, random_state
from random_loops import blocks

from multibody_sym.analysis.check import (
    LARGEST_ON_TREES,
    LARGEST_WITH_ROWS,
    beyond_rounding,
    compare_formalisms,
    dalembert,
    ratio,
)
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.formalisms.equations import Formalism, TreeDynamics
from multibody_sym.dynamics.programs.system import state_derivative
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import State, slot_state
from multibody_sym.program.loading import load
from multibody_sym.program.program import interpret
from multibody_sym.scalars.node import ZERO, slot

NUMERIC = {name: route for name, route in FORMALISMS.items() if name not in ("lagrange", "multipliers")}
LARGEST = {False: LARGEST_ON_TREES, True: LARGEST_WITH_ROWS}


def worst_ratio(case: Case, formalisms: Mapping[str, Formalism], *, compiled: bool = False) -> float:
    """Return the worst ratio of a case's routes over floats and, of every other case, of the Program of one of them."""
    t, q, u = random_state(np.random.default_rng(case.seed), case)
    state = case.state(t, q, u)
    worst = float(np.max(list(compare_formalisms(case.mechanism, [state], formalisms).values())))
    if case.seed % 2:
        return worst
    formalism = formalisms[sorted(formalisms)[case.seed // 2 % len(formalisms)]]
    program = state_derivative(case.mechanism, formalism(case.mechanism, slot_state(case.mechanism)))
    call = load({"state_derivative": program})["state_derivative"] if compiled else partial(interpret, program)
    inputs = [state.slots[slot("inputs", i)] for i in range(len(case.mechanism.inputs))]
    _, udot, multipliers, _ = call(t, q, u, case.parameters, inputs, [])
    return np.maximum(worst, ratio(dalembert(case.motion(t, q, u)), udot, multipliers))


@pytest.mark.parametrize("rows", [False, True])
@pytest.mark.parametrize("block", blocks(20, quick=2))
def test_numeric_routes_agree(block: int, rows: bool) -> None:
    for seed in range(25 * block, 25 * block + 25):
        case = random_case(seed, rows=rows, extreme=not rows)
        assert worst_ratio(case, NUMERIC, compiled=seed % 50 == 0) <= LARGEST[rows], f"seed {seed}"


@pytest.mark.parametrize("rows", [False, True])
@pytest.mark.parametrize("block", blocks(5, quick=2))
def test_routes_derived_by_sympy_agree(block: int, rows: bool) -> None:
    derived = {name: FORMALISMS[name] for name in (["multipliers"] if rows else ["lagrange", "multipliers"])}
    for seed in range(1000 + 5 * block, 1005 + 5 * block):
        case = random_case(seed, bodies=(1, 4), rows=rows)
        assert worst_ratio(case, derived) <= LARGEST[rows], f"seed {seed}"


@pytest.mark.long
@pytest.mark.parametrize("rows", [False, True])
def test_thousands_of_cases_agree(rows: bool) -> None:
    """Prints the worst ratio with its seed (pytest -s)."""
    seeds = range(10_000, 12_500 if rows else 15_000)
    worst = {seed: worst_ratio(random_case(seed, rows=rows, extreme=not rows), NUMERIC) for seed in seeds}
    found = sorted(worst.items(), key=lambda item: -item[1])[:5]
    print(found)
    assert found[0][1] <= LARGEST[rows], found


def test_a_force_through_its_own_joint_has_no_moment_but_for_rounding() -> None:
    """Its moment is a difference of products as large as the force times its lever, and rounds as these do."""
    assert worst_ratio(random_case(12_832, rows=False, extreme=True), NUMERIC) <= LARGEST[False]


def test_a_rope_that_ends_inside_its_wheel_makes_no_case() -> None:
    """Of seed 10277 the first system hangs a body at the centre of a wheel and ties it there: another one is drawn."""
    case = random_case(10277, rows=True)
    assert worst_ratio(case, NUMERIC) <= LARGEST[True]


@pytest.mark.parametrize("rows", [False, True])
def test_measure_sees_a_part_in_a_million(rows: bool) -> None:
    """What the bounds exclude: each of M, Q, c, H and gamma wrong by 1e-6 is far outside them."""
    case = random_case(7, bodies=(3, 6), rows=rows)
    state = case.state(*random_state(np.random.default_rng(7), case))

    def wrong(part: str) -> Formalism:
        def formalism(mechanism, at):
            found = FORMALISMS["composite_body"](mechanism, at)
            if part == "rows":
                return replace(found, rows=[replace(row, gamma=row.gamma * (1 + 1e-6) + 1e-6) for row in found.rows])
            changed = replace(found, **{part: [x * (1 + 1e-6) + 1e-6 for x in getattr(found, part)]})
            pairs = zip(changed.applied, changed.velocity_terms, strict=True)
            return replace(changed, forcing=[q - c for q, c in pairs])

        return formalism

    for part in ("applied", "velocity_terms", *(["rows"] if rows else [])):
        ratios = compare_formalisms(case.mechanism, [state], {part: wrong(part)})
        assert ratios[part] > 1e4
        assert beyond_rounding(case.mechanism, ratios)


def test_ratio_of_nothing_is_zero_and_of_nan_is_nan() -> None:
    case = random_case(3)
    weightless = replace(case, mechanism=replace(case.mechanism, gravity=(ZERO,) * 3, loads=()))
    t, q, u = random_state(np.random.default_rng(3), case)
    reference = dalembert(weightless.motion(t, q, [0.0] * len(u)))
    assert ratio(reference, np.zeros(len(u)), np.zeros(0)) == 0.0
    assert np.isnan(ratio(reference, np.full(len(u), np.nan), np.zeros(0)))

    def nowhere(mechanism: Mechanism, state: State) -> TreeDynamics:
        return replace(FORMALISMS["composite_body"](mechanism, state), forcing=[float("nan")] * len(u))

    ratios = compare_formalisms(case.mechanism, [case.state(t, q, u), case.state(t, q, u)], {"nowhere": nowhere})
    assert np.isnan(ratios["nowhere"])
    assert beyond_rounding(case.mechanism, ratios)
