"""At the edges of laws: slopes that are infinite, and forces that have no real value on one side of a position."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

import multibody_sym as mbs
from multibody_sym.documents.analysis import equilibrium_text
from multibody_sym.errors import NoSolutionError

EDGE = """
multibody_sym: 1
name: edge
bodies: {a: {mass: 1}}
joints:
  A: {type: prismatic, parent: ground, child: a, axis: x, q: x, initial: {q: START}}
forces:
  s: {type: force, on: a, value: ["FORCE", 0, 0]}
"""


def ramp(row: str, speed: float) -> mbs.System:
    return mbs.System(
        "ramp",
        bodies={"a": mbs.Body(mass=1), "b": mbs.Body(mass=1), "c": mbs.Body(mass=2)},
        joints={
            "A": mbs.Prismatic("ground", "a", axis="x", q="x", initial=mbs.Initial(q=0, u=speed, known=True)),
            "B": mbs.Prismatic("ground", "b", axis="y", q="y"),
            "C": mbs.Prismatic("ground", "c", axis="z", q="z"),
        },
        constraints={
            "even": mbs.Expression(zero="z - y^2"),
            "ramp": mbs.Expression(zero=row) if "u_" not in row else mbs.VelocityConstraint(zero=row),
        },
    )


@pytest.mark.parametrize("speed", [0.0, 1.0])
@pytest.mark.parametrize("row", ["y - x^2.5", "u_y - u_x*x^1.5"])
def test_linearize_names_the_row_without_finite_slopes(row: str, speed: float) -> None:
    """y = x^2.5 has a curvature at x = 0, which y'' needs, but no third derivative, which A needs."""
    for question in (mbs.linearize, lambda system: mbs.period_multipliers(system, 1.0)):
        with pytest.raises(NoSolutionError) as caught:
            question(ramp(row, speed))
        assert "A has no finite value in this state: what ramp asks of accelerations has no derivative there" in str(
            caught.value
        )
        assert caught.value.where.path == ("constraints", "ramp")


def test_rows_that_are_smooth_enough_are_linearised() -> None:
    found = mbs.linearize(ramp("y - x^3.5", 0.0))
    assert pytest.approx(np.array([[0, 1], [0, 0]]), abs=0) == found.A


def on_edge(force: str, start: float = 0.0) -> mbs.System:
    return mbs.loads(EDGE.replace("FORCE", force).replace("START", str(start)))


def test_a_period_that_meets_the_edge_of_a_force_ends_with_its_time() -> None:
    """x'' = -sqrt(x) from rest at 1 meets x = 0, its edge; when, its energy integral says."""
    met, _ = quad(lambda x: 1 / math.sqrt(4 / 3 * (1 - x**1.5)), 0.0, 1.0)
    with pytest.raises(NoSolutionError) as caught:
        mbs.period_multipliers(on_edge("-sqrt(x)", 1.0), 8.0)
    assert f"the motion cannot be followed over a period past t = {met:.6g} s" in str(caught.value)


@pytest.mark.parametrize("force", ["-x - x^1.5", "-x^1.5 - 3*x", "-x - 0.1*x^2*sqrt(x)"])
def test_a_position_on_the_edge_of_a_force_is_not_called_stable(force: str) -> None:
    found = mbs.equilibrium(on_edge(force))
    (place,) = [k for k, position in enumerate(found.positions) if abs(position["x"]) < 1e-9]
    assert found.stable[place] is None
    assert found.one_sided == (True,)
    assert "not decided: x = 0 m; a force has no real value on one side of it" in equilibrium_text(found)


def test_laws_with_two_sides_are_called_what_they_are() -> None:
    found = mbs.equilibrium(on_edge("-x - max(0, x)^1.5"))
    assert found.stable == (True,)
    assert found.one_sided == (False,)
    assert equilibrium_text(found).startswith("stable: x = 0 m\n")
