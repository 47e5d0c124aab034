"""Conditions of closed forms: as few as say all, none that always holds, and each one can fail alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from scipy.optimize import linprog

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.inequalities import Condition, reduced, within
from multibody_sym.algebra.quotient_functions import exact
from multibody_sym.algebra.quotients import Field, Letter, Quotient
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import symbol
from multibody_sym.text.parser import parse

Reader = Callable[[str], Quotient]

INCLINES = {"m1": "2", "m2": "3", "F1": "30", "F2": "5", "alpha": "pi/6", "beta": "pi/9", "mu": "1/10", "g": "10"}


def reader(values: dict[str, str], positive: str = "") -> Reader:
    """Return what reads an expression of parameters with these values over one field."""
    field = Field(200_000)
    known = {}
    for name, value in values.items():
        sample = exact(Field(1000), [parse(value)], {})[0].sample
        known[symbol(name)] = field.letter(symbol(name), Letter(symbol(name), sample, name in positive.split()))
    return lambda text: exact(field, [parse(text)], known)[0]


def told(conditions: Sequence[Condition]) -> list[str]:
    return [str(condition) for condition in reduced(conditions)]


# --- textbook problems, their inequalities written as expressions ---------------------------------------------------

PULLED = "(F1*(cos(alpha) + mu*sin(alpha)) - F2*(cos(beta) - mu*sin(beta)))/(m1 + m2) - mu*g"
RAMP = "g*(m1*(sin(alpha) - mu*cos(alpha)) - m2)/(m1 + m2)"
RIDGE = "g*(m1*(sin(alpha) - mu*cos(alpha)) - m2*(sin(beta) + mu*cos(beta)))/(m1 + m2)"


def two_pulled_blocks(read: Reader) -> list[Condition]:
    """Two blocks on a rough plane, pulled apart at angles; they slide to the left."""
    tension = f"m2*({PULLED}) + F2*cos(beta) + mu*(m2*g - F2*sin(beta))"
    return [
        Condition(read("m1*g - F1*sin(alpha)"), broken="c1 opens"),
        Condition(read("m2*g - F2*sin(beta)"), broken="c2 opens"),
        Condition(read(PULLED), strict=True, broken="c1 does not slide so"),
        Condition(read(PULLED), strict=True, broken="c2 does not slide so"),
        Condition(read(tension), broken="string slackens"),
        Condition(read("m1 + m2"), strict=True),
    ]


def test_two_blocks_pulled_apart_have_the_four_conditions_of_the_book() -> None:
    found = reduced(two_pulled_blocks(reader(INCLINES, "m1 m2 F1 F2 mu g")))
    assert [(str(condition), condition.broken) for condition in found] == [
        ("g*m1 >= F1*sin(alpha)", "c1 opens"),
        ("g*m2 >= F2*sin(beta)", "c2 opens"),
        (
            "F1*cos(alpha) + F1*mu*sin(alpha) + F2*mu*sin(beta) > F2*cos(beta) + g*mu*(m1 + m2)",
            "c1 does not slide so",
        ),
        ("F1*m2*cos(alpha) + F2*m1*cos(beta) + F1*m2*mu*sin(alpha) >= F2*m1*mu*sin(beta)", "string slackens"),
    ]


def test_a_tension_that_follows_from_the_direction_of_motion_is_not_said() -> None:
    """A block slides down and draws a load up: T = m2 (g + a) is positive as a is."""
    read = reader({"m1": "6", "m2": "4", "mu": "1/50", "g": "10", "alpha": "pi/4"}, "m1 m2 mu g")
    conditions = [
        Condition(read("m1*g*cos(alpha)")),
        Condition(read(RAMP), strict=True),
        Condition(read(f"m2*(g + {RAMP})")),
    ]
    assert told(conditions) == ["cos(alpha) >= 0", "m1*sin(alpha) > m1*mu*cos(alpha) + m2"]


def test_two_inclines() -> None:
    read = reader({"m1": "1", "m2": "1", "mu": "1/10", "g": "10", "alpha": "pi/4", "beta": "pi/6"}, "m1 m2 mu g")
    conditions = [
        Condition(read("m1*g*cos(alpha)")),
        Condition(read("m2*g*cos(beta)")),
        Condition(read(RIDGE), strict=True),
    ]
    assert told(conditions) == [
        "cos(alpha) >= 0",
        "cos(beta) >= 0",
        "m1*sin(alpha) > m1*mu*cos(alpha) + m2*mu*cos(beta) + m2*sin(beta)",
    ]


def test_numbers_alone_have_no_conditions() -> None:
    read = reader({"g": "10"})
    assert told([Condition(read("3/10")), Condition(read("10 - sqrt(2)"), strict=True)]) == []


# --- what always holds ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "always",
    [
        "M + m*sin(alpha)^2",
        "M + m - m*cos(alpha)^2",
        "M + 2*m + 2*m*cos(alpha)",
        "m*l^2*(4 - 3*sin(alpha)*cos(beta))",
        "(M - m)^2 + M*m",
        "sqrt(M^2 + x^2)",
        "M*g/(M + m*(1 - cos(alpha)))",
    ],
)
def test_what_always_holds_is_not_said(always: str) -> None:
    read = reader({"M": "5", "m": "1", "l": "2", "x": "0", "g": "10", "alpha": "pi/6", "beta": "1"}, "M m l g")
    assert told([Condition(read(always), strict=True)]) == []


def test_signs_that_no_declaration_gives_are_said() -> None:
    """A load on a slope of a table: where g or the place x may be negative, that is said, alone or within a sum."""
    read = reader({"m": "1", "g": "10", "l": "2", "x": "1/2", "alpha": "pi/6"}, "m l")
    assert told([Condition(read("m*g*cos(alpha)"))]) == ["cos(alpha) >= 0", "g > 0"]
    assert told([Condition(read("g*m*(l + x)"))]) == ["l + x >= 0", "g > 0"]
    assert told([Condition(read("-g*m*(x - l)/x"), True), Condition(read("g"), True)]) == ["l > x", "g > 0", "x > 0"]
    falling = reader({"m": "1", "g": "-10", "alpha": "2*pi/3"}, "m")
    assert told([Condition(falling("m*g*cos(alpha)"))]) == ["cos(alpha) <= 0", "g < 0"]


def test_the_sign_of_an_apparent_mass_is_said_where_it_can_change() -> None:
    """Painleve's rod: the normal force is divided by it, and its own condition is that g cos(alpha) has a sign."""
    read = reader({"m": "1", "mu": "2", "g": "10", "alpha": "pi/6"}, "m mu g")
    apparent = "4 - 3*mu*sin(alpha)*cos(alpha)"
    conditions = [Condition(read(f"g*cos(alpha)/(m*({apparent}))")), Condition(read(apparent), strict=True)]
    assert told(conditions) == ["cos(alpha) >= 0", "4 > 3*mu*cos(alpha)*sin(alpha)"]


# --- sticking -------------------------------------------------------------------------------------------------------


def test_sticking_is_said_with_a_size_where_both_sides_can_fail() -> None:
    read = reader({"m": "1", "mu": "4/5", "g": "10", "alpha": "pi/6", "F": "1"}, "m mu g")
    normal = Condition(read("m*g*cos(alpha)"))
    limit = read("mu*m*g*cos(alpha)")
    assert told([normal, *within(read("m*g*sin(alpha)"), limit)]) == ["abs(sin(alpha)) <= mu*cos(alpha)"]
    assert told([normal, *within(read("m*g*sin(alpha) - F"), limit)]) == [
        "abs(g*m*sin(alpha) - F) <= g*m*mu*cos(alpha)"
    ]


def test_sticking_is_said_with_one_side_where_the_other_cannot_fail() -> None:
    read = reader({"m": "1", "mu": "4/5", "g": "10", "F": "1"}, "m mu g F")
    assert told([Condition(read("m*g")), *within(read("-F"), read("mu*m*g"))]) == ["g*m*mu >= F"]


def test_both_sides_are_said_where_they_are_shorter_than_a_size() -> None:
    """A rope round half a post, F and m g at its ends: Euler and Eytelwein."""
    read = reader({"m": "10", "mu": "1/2", "g": "10", "F": "50"}, "m mu g")
    slip = within(read("(exp(mu*pi) + 1)*(g*m - F)"), read("(F + g*m)*(exp(mu*pi) - 1)"), "it slips")
    assert told(slip) == ["F*exp(mu*pi) >= g*m", "g*m*exp(mu*pi) >= F"]


# --- as people write them -------------------------------------------------------------------------------------------


def test_quotients_stay_where_they_are_shorter() -> None:
    """A ladder at a smooth wall: its foot holds for mu >= cot(theta)/2."""
    read = reader({"m": "12", "mu": "2/5", "g": "10", "theta": "pi/3"}, "m mu g")
    conditions = [*within(read("g*m/(2*tan(theta))"), read("mu*g*m")), Condition(read("g*m/tan(theta)"))]
    assert told(conditions) == ["2*mu >= 1/tan(theta)", "1/tan(theta) >= 0"]


def test_roots_leave_sums_and_what_is_negative_changes_sides() -> None:
    """A wheel at a kerb lifts off the road when the pull exceeds m g sqrt(h (2 R - h))/(R - h)."""
    read = reader({"m": "10", "g": "10", "R": "1/2", "h": "1/10", "F": "50"}, "m R h F g")
    assert told([Condition(read("F*(h - R)/sqrt(h*(2*R - h)) + g*m"))]) == ["g*m*sqrt(h*(2*R - h)) >= F*(R - h)"]


# --- nothing is lost, nothing is idle -------------------------------------------------------------------------------


def linear_systems(n: int) -> list[list[dict[str, float]]]:
    """Return random homogeneous inequalities in five positive parameters, coefficients by letter; all hold at 1."""
    rng = np.random.default_rng(3)
    found = []
    for _ in range(n):
        rows = []
        while len(rows) < rng.integers(2, 7):
            row = rng.integers(-3, 4, size=5) * (rng.random(5) < 0.6)
            if row.sum() > 0:
                rows.append(dict(zip("abcde", map(float, row), strict=True)))
        found.append(rows)
    return found


@pytest.mark.parametrize("rows", linear_systems(20))
def test_what_is_dropped_follows_and_what_is_said_does_not(rows: list[dict[str, float]]) -> None:
    """By linear programming: the least value of each inequality where all others hold that are said."""
    read = reader(dict.fromkeys("abcde", "1"), "a b c d e")
    texts = [" + ".join(f"({int(c)})*{x}" for x, c in row.items()) for row in rows]
    conditions = [Condition(read(text)) for text in texts]
    kept = {text for c in reduced(conditions) for text in texts if (c.value / read(text)).symbols == set()}
    matrix = {
        text: np.array([*row.values()]) / max(map(abs, row.values())) for text, row in zip(texts, rows, strict=True)
    }
    for text, row in matrix.items():
        others = [-matrix[other] for other in kept if (matrix[other] != row).any()]
        bounds = {"A_ub": others, "b_ub": np.zeros(len(others))} if others else {}
        least = linprog(row, bounds=[(1e-3, 1e3)] * 5, **bounds).fun
        assert (least < -1e-6) == (text in kept), text


def test_where_the_conditions_hold_all_inequalities_do() -> None:
    conditions = two_pulled_blocks(reader(INCLINES, "m1 m2 F1 F2 mu g"))
    kept = [book_form(condition.value) for condition in reduced(conditions)]
    all_of_them = [book_form(condition.value) for condition in conditions]
    rng, inside = np.random.default_rng(1), 0
    sample = {symbol(name): evaluate_float([parse(value)], {})[0] for name, value in INCLINES.items()}
    for _ in range(300):
        values = {node: value * 10 ** rng.uniform(-1, 1) for node, value in sample.items()}
        holds = [min(evaluate_float(nodes, values)) >= 0.0 for nodes in (kept, all_of_them)]
        assert holds[0] == holds[1]
        inside += holds[0]
    assert inside > 20


def test_conditions_are_divided_by_what_division_leaves_and_say_what_happens_there() -> None:
    read = reader(dict(zip("abcde", "31425", strict=True)), "a b c d e")
    conditions = [
        Condition(read("(c - d)*(e - d)"), strict=True, broken="opens"),
        Condition(read("(a - b)*(c - d)"), strict=True, broken="slides"),
        Condition(read("a - b"), strict=True),
    ]
    found = reduced(conditions)
    said = {(str(each), each.broken) for each in found}
    assert said == {("e > d", "opens"), ("c > d", "slides"), ("a > b", "slides")}
