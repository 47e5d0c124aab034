"""Dependent rows: rank, which rows are left over, and whose forces are not unique."""

from __future__ import annotations

import pytest

from multibody_sym.analysis.check import check
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.redundancy import Redundancy, redundancy
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.motion import motion_of, state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.bodies import Body
from multibody_sym.model.constraints import Distance, Expression
from multibody_sym.model.joints import Initial, Planar, Prismatic, Revolute
from multibody_sym.model.system import System
from multibody_sym.motion.simulate import simulate
from multibody_sym.program.backend import Backend


def found_in(system: System) -> Redundancy:
    resolved = mechanism(system)
    begin = start(resolved)
    state = state_of(resolved, float, 0.0, begin.q, begin.u, begin.parameters)
    return redundancy(motion_of(resolved, state), composite_body(resolved, state))


def platform(cranks: int) -> System:
    """A platform on parallel rods of equal length: every rod after the second is one too many."""
    points = {f"p{k}": [k, 0, 0] for k in range(cranks)}
    return System(
        "platform",
        bodies={"plate": Body(mass=1, inertia={"Izz": 1}, points=points), "ground": Body(points=points)},
        joints={"j": Planar("ground", "plate", initial=Initial(q=[0.6, 0.8, 0]))},
        constraints={f"rod{k}": Distance([f"ground.p{k}", f"plate.p{k}"], 1) for k in range(cranks)},
    )


def test_no_rows_no_redundancy() -> None:
    system = System("s", bodies={"b": Body(mass=1)}, joints={"j": Prismatic("ground", "b", axis="x")})
    assert found_in(system) == Redundancy(0, (), ())


def test_independent_rows_are_unique() -> None:
    assert found_in(platform(2)) == Redundancy(2, (), ())


def test_third_crank_is_one_too_many() -> None:
    found = found_in(platform(3))
    assert (found.rank, len(found.redundant)) == (2, 1)
    assert set(found.not_unique) == {"rod0", "rod1", "rod2"}, "together they exert nothing on the plate's joint"


def test_joint_that_a_combination_of_rows_loads_is_not_unique() -> None:
    """The guide holds y as the rods do: the reaction of the slider itself is shared with them."""
    system = System(
        "guided",
        bodies={
            "b": Body(mass=1, points={"p": [0, 1, 0]}),
            "ground": Body(points={"up": [0, 3, 0], "down": [0, -2, 0]}),
        },
        joints={"j": Prismatic("ground", "b", axis="y", q="y", initial=Initial(q=0))},
        constraints={"top": Distance(["ground.up", "b.p"], 2), "bottom": Distance(["b", "ground.down"], 2)},
    )
    found = found_in(system)
    assert (found.rank, found.redundant) == (1, ("bottom",))
    assert found.not_unique == ("top", "bottom")


def test_reaction_along_the_rods_across_a_slider() -> None:
    system = System(
        "across",
        bodies={"b": Body(mass=1), "ground": Body(points={"l": [-1, 1, 0], "r": [1, 1, 0]})},
        joints={"j": Prismatic("ground", "b", axis="y", q="y", initial=Initial(q=0))},
        constraints={"l": Distance(["ground.l", "b"], "sqrt(2)"), "r": Distance(["ground.r", "b"], "sqrt(2)")},
    )
    found = found_in(system)
    assert found.rank == 1
    assert set(found.not_unique) == {"l", "r", "j"}


def test_row_that_holds_nothing_is_left_over() -> None:
    system = System(
        "empty",
        bodies={"b": Body(mass=1)},
        joints={"j": Prismatic("ground", "b", axis="x", q="x")},
        constraints={"nothing": Expression("0*x"), "hold": Expression("x")},
    )
    alone, named = ("nothing",), ("multiplier(nothing)",)
    assert found_in(system) == Redundancy(1, alone, alone, (alone,), {"nothing": ()}, ambiguous_forces=named)


@pytest.mark.parametrize("factor", [1e-6, 1.0, 1e6])
def test_rank_does_not_depend_on_units(factor: float) -> None:
    system = System(
        "scaled",
        bodies={"a": Body(mass=1e-3), "b": Body(mass=1e3)},
        joints={"A": Prismatic("ground", "a", axis="x", q="x"), "B": Prismatic("ground", "b", axis="x", q="y")},
        constraints={"one": Expression(f"{factor:.0e}*(x - y)"), "two": Expression(f"{factor:.0e}*(x + y)")},
    )
    assert found_in(system).rank == 2


@pytest.mark.parametrize("backend", ["c", "python"])
def test_a_second_hinge_about_an_oblique_axis_changes_nothing(backend: Backend) -> None:
    """All that is left of its rows is rounding, which has directions but no meaning."""

    def door(hinges: int) -> System:
        points = {f"p{k}": [0.1 * (k + 1), 0.2 * (k + 1), 0.3 * (k + 1)] for k in range(hinges)}
        leaf = Body(mass=20, com=[0.4, 0, 1], inertia={"Ixx": 7, "Iyy": 8, "Izz": 2}, points=points)
        joints = {f"j{k}": Revolute(f"ground.p{k}", f"leaf.p{k}", axis=[1, 2, 3]) for k in range(hinges)}
        return System("door", gravity=[0, 0, -10], bodies={"leaf": leaf, "ground": Body(points=points)}, joints=joints)

    one, two = (simulate(door(hinges), t_end=1, samples=5, backend=backend) for hinges in (1, 2))
    assert two["j0"] == pytest.approx(one["j0"], rel=1e-12)
    assert two.redundancy.redundant == ("j1.x", "j1.y", "j1.z", "j1.r1", "j1.r2")
    assert float(abs(two.reactions["j1"]["fz"]).max()) == 0.0
    report = check(door(2))
    assert report.agrees
    assert not [hint for hint in report.hints if "singular" in hint]
