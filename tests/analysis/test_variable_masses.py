"""Masses that vary in analyses: what is conserved, rest, small motions, and what is told of them in steps."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.documents.document import worked_document, write_document

EXAMPLES = Path(__file__).parents[2] / "examples/variable_mass"


@cache
def example(name: str) -> mbs.System:
    return mbs.load(EXAMPLES / f"{name}.yaml")


def wagon(mass: mbs.VariableMass) -> mbs.System:
    track = mbs.Prismatic("ground", "wagon", axis="x", q="x", initial={"u": 1})
    return mbs.System("wagon", bodies={"wagon": mbs.Body(mass=mass)}, joints={"track": track})


def test_what_falls_in_at_rest_leaves_the_momentum_but_not_the_energy() -> None:
    found = mbs.conserved_quantities(wagon(mbs.VariableMass("2 + t", absolute_velocity=[0, 0, 0])))
    assert [x.name for x in found] == ["momentum(x)"]


def test_what_drops_out_takes_momentum_and_energy_along() -> None:
    assert mbs.conserved_quantities(wagon(mbs.VariableMass("9 - t", relative_velocity=[0, 0, 0]))) == []


def test_a_folded_chain_conserves_its_energy_though_both_arms_change() -> None:
    assert [x.name for x in mbs.conserved_quantities(example("folded_chain"))] == ["total_energy()"]


@pytest.mark.parametrize("name", ["rocket", "cayleys_chain", "jet_damping", "raindrop"])
def test_others_conserve_nothing(name: str) -> None:
    assert mbs.conserved_quantities(example(name)) == []


def balloon() -> mbs.System:
    """A balloon whose chain lies on the ground in part: the higher it is the more it carries."""
    chain = mbs.Body(mass=mbs.VariableMass("1 + 0.5*x", absolute_velocity=[0, 0, 0]), com=[0, "-x/2", 0])
    return mbs.System(
        "balloon",
        gravity=[0, -10, 0],
        bodies={"chain": chain},
        joints={"rise": mbs.Prismatic("ground", "chain", axis="y", q="x", initial={"q": 1})},
        forces={"lift": mbs.Force(on="chain", value=[0, 20, 0])},
    )


def test_a_mass_of_the_height_makes_rest_stable() -> None:
    found = mbs.equilibrium(balloon())
    assert found.positions[0]["x"] == pytest.approx(2.0, rel=1e-12)
    assert found.stable == (True,)
    small = mbs.linearize(balloon(), at="equilibrium")
    np.testing.assert_allclose(small.A, [[0, 1], [-0.5 * 10 / 2, 0]], rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize(
    "asked",
    [
        mbs.equilibrium,
        lambda system: mbs.linearize(system, at="equilibrium"),
        lambda system: mbs.range_of_rest(system, "k"),
    ],
)
def test_nothing_rests_while_its_mass_changes_with_the_time(asked: Any) -> None:
    with pytest.raises(mbs.NoSolutionError, match="the mass of bob changes with the time"):
        asked(example("leaking_pendulum"))


def test_small_motions_while_a_mass_changes_are_refused_by_its_name() -> None:
    with pytest.raises(mbs.NoSolutionError, match="A depends on time, as the mass of bob does"):
        mbs.linearize(example("leaking_pendulum"))


def test_steps_write_meshchersky_s_equation() -> None:
    equations = mbs.derive(example("rocket"))
    (step,) = [step for step in equations.steps if step.title == "Masses that vary"]
    told = [equations.notation.text(x) for e in step.equations for x in (e.left, e.right)]
    assert told == ["m_rocket", "m0 - k*t", "dm_rocket/dt", "-k", "Phi_rocket", "[0, k*c, 0]"]
    assert "Meshchersky" in step.note
    assert "(m0 - k*t)*y'' + g*(m0 - k*t) = k*c" in str(equations)


def test_steps_of_a_solution_name_the_reactive_force() -> None:
    worked = mbs.solve(example("rocket"), steps=True).steps
    assert worked is not None
    assert "k*c: reactive force of what leaves or joins rocket, up" in write_document(worked_document(worked), "text")


def test_equations_in_numbers_are_those_in_symbols() -> None:
    """Lambdified with its parameters: the pendulum that leaks, by hand."""
    t, theta, u = 3.0, 0.4, 1.1
    (udot,) = mbs.derive(example("leaking_pendulum")).lambdify()([theta], [u], t)
    m = 2.0 - 0.1 * t
    moment = -m * 9.81 * 1.5 * np.sin(theta) - 0.1 * (2 * 1.5 * 0.2 + 3 * 0.2**2 / 5) * u
    assert udot == pytest.approx(moment / (m * (1.5**2 + 2 * 0.2**2 / 5)), rel=1e-14)
