"""The textbook's problems, from files that say nothing of directions: right to 1e-12, printed as books print them."""

from __future__ import annotations

import math

import pytest
from twins import from_file

import multibody_sym as mbs

EXACT = 1e-12
_ALL = "(m1 + m2 + m3 + m4)"


@pytest.fixture(scope="module")
def solutions() -> dict[str, mbs.Solution]:
    names = ("t1_two_blocks", "t3_three_loads", "t7_atwood", "t8_blocks_in_a_row", "incline_pulley")
    return {name: mbs.solve(from_file(name)) for name in names}


def accelerations(solution: mbs.Solution) -> dict[str, float | None]:
    return {name: found.value for name, found in solution.accelerations.items()}


def formulas(solution: mbs.Solution) -> dict[str, str]:
    return {name: found["expression"] for name, found in solution.as_json()["accelerations"].items()}


def tension(solution: mbs.Solution, rope: str = "string") -> tuple[float | None, str]:
    found = solution.reactions[rope]["tension"]
    return found.value, found.as_json()["expression"]


def test_t1_two_blocks(solutions: dict[str, mbs.Solution]) -> None:
    solution = solutions["t1_two_blocks"]
    assert accelerations(solution) == pytest.approx({"x1": 1.0, "x2": 1.0}, rel=EXACT)
    assert formulas(solution)["x1"] == "(F2 - F1)/(m1 + m2)"
    assert tension(solution) == (pytest.approx(0.3, rel=EXACT), "(F1*m2 + F2*m1)/(m1 + m2)")


def test_t3_three_loads(solutions: dict[str, mbs.Solution]) -> None:
    solution = solutions["t3_three_loads"]
    assert accelerations(solution) == pytest.approx({"y1": -10 / 3, "y2": -10 / 3, "y3": 10 / 3}, rel=EXACT)
    assert formulas(solution) == {"y1": "-g/3", "y2": "-g/3", "y3": "g/3"}
    assert solution.answers["path"].value == pytest.approx(80 / 3, rel=EXACT)
    assert str(solution.answers["path"]) == "8*g/3 = 26.66666667 m"
    assert tension(solution) == (pytest.approx(200 / 3, rel=EXACT), "4*g*m/3")
    assert tension(solution, "link") == (pytest.approx(100 / 3, rel=EXACT), "2*g*m/3")


def test_t7_atwood(solutions: dict[str, mbs.Solution]) -> None:
    solution = solutions["t7_atwood"]
    assert formulas(solution) == {"y1": "g*(m2 - m1)/(m1 + m2)", "y2": "g*(m1 - m2)/(m1 + m2)"}
    assert solution.answers["displacement"].value == pytest.approx(125 / 3, rel=EXACT)
    assert solution.answers["tension"].value == pytest.approx(40 / 3, rel=EXACT)
    assert tension(solution) == (pytest.approx(40 / 3, rel=EXACT), "2*g*m1*m2/(m1 + m2)")
    assert solution.conditions == ("m2 > m1",)  # for the path; the string is taut with all masses


def test_t8_blocks_in_a_row(solutions: dict[str, mbs.Solution]) -> None:
    solution = solutions["t8_blocks_in_a_row"]
    assert accelerations(solution) == pytest.approx(dict.fromkeys(("x1", "x2", "x3", "depth"), 4.0), rel=EXACT)
    assert formulas(solution)["x1"] == "g*m4/(m1 + m2 + m3 + m4)"
    expected = {"string1": (4.0, "m1"), "string2": (12.0, "(m1 + m2)"), "string3": (24.0, "(m1 + m2 + m3)")}
    for rope, (value, drawn) in expected.items():
        printed = f"g*m1*m4/{_ALL}" if drawn == "m1" else f"g*m4*{drawn}/{_ALL}"
        assert tension(solution, rope) == (pytest.approx(value, rel=EXACT), printed)





def test_incline_with_a_pulley(solutions: dict[str, mbs.Solution]) -> None:
    solution = solutions["incline_pulley"]
    assert accelerations(solution) == pytest.approx({"s": 4.0, "depth": 4.0}, rel=EXACT)
    assert formulas(solution)["s"] == "g*(m2 - m1*sin(alpha))/(m1 + m2)"
    assert tension(solution) == (pytest.approx(18.0, rel=EXACT), "g*m1*m2*(sin(alpha) + 1)/(m1 + m2)")
    assert solution.answers["normal_force"].value == pytest.approx(20 * math.sqrt(3) / 2, rel=EXACT)
    assert solution.answers["speed_at_the_top"].value == pytest.approx(4.0, rel=EXACT)


@pytest.mark.parametrize("name", ["t1_two_blocks", "t3_three_loads", "t7_atwood", "t8_blocks_in_a_row"])
def test_the_motion_that_is_simulated_is_the_one_that_was_solved(name: str) -> None:
    run = mbs.simulate(from_file(name), t_end=0.5, samples=3, backend="python")
    for coordinate, found in mbs.solve(from_file(name)).accelerations.items():
        assert found.value is not None
        assert run[coordinate][-1] - run[coordinate][0] == pytest.approx(found.value * 0.5**2 / 2, rel=1e-9)


@pytest.mark.parametrize(("left", "right"), [(1, 2), (2, 1), (3, 3)])
def test_atwood_s_machine_turns_to_the_heavier_side(left: float, right: float) -> None:
    found = mbs.solve(from_file("t7_atwood"), {"m1": left, "m2": right})
    assert found.accelerations["y1"].value == pytest.approx(10 * (right - left) / (left + right), rel=EXACT)
    assert found.answers["displacement"].value == pytest.approx(125 * abs(right - left) / (left + right), rel=EXACT)
