"""The textbook's files that ask for which values there is rest, or when something happens: each against its formula."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import SimpleNamespace

import pytest
from test_textbook_friction import given
from twins import from_file

import multibody_sym as mbs

EXACT = 1e-12
Bounds = tuple[float | None, float | None]
RANGES: dict[str, tuple[str, Callable[[SimpleNamespace], Bounds], str]] = {
    "t5_incline": ("mu", lambda p: (1 - 2 * math.sqrt(2) / 3, None), "slips at rub"),
    "t6_double_incline": ("k", lambda p: (1.084884669366288, 1.881524526099541), "slips at c1"),
    "t9_block_on_block": ("F", lambda p: (0.0, 18.0), "slips at between"),
    "capstan": (
        "F",
        lambda p: tuple(p.g * (p.m * math.exp(sign * p.mu * math.pi) - p.m0) for sign in (-1, 1)),
        "slips at post",
    ),
    "two_drums": (
        "M",
        lambda p: (0.0, p.mu * p.m * math.exp(p.mu1 * math.pi / 2 + p.mu2 * math.pi)),
        "slips at drum2",
    ),
    "ladder": ("mu", lambda p: (1 / (2 * math.tan(p.theta)), None), "slips at foot"),
    "jamming_drawer": ("mu", lambda p: (p.l / (2 * p.d), None), "slips at rub"),
    "bracket_on_column": ("x", lambda p: (p.l / (2 * p.mu), None), "slips at rub"),
    "screw_jack": ("mu", lambda p: (p.p / (2 * math.pi * p.r), None), "slips at rub"),
    "slips_or_tips": ("alpha", lambda p: (-math.atan(p.b / p.h), math.atan(p.b / p.h)), "tips about its lower edge"),
    "pulled_box": ("F", lambda p: (0.0, p.m * p.g * p.b / (2 * p.y)), "tips about its right edge"),
    "across_the_slope": (
        "F",
        lambda p: (0.0, p.m * p.g * math.sqrt((p.mu * math.cos(p.alpha)) ** 2 - math.sin(p.alpha) ** 2)),
        "slips at c",
    ),
    "kerb": ("F", lambda p: (0.0, p.m * p.g * math.sqrt(2 * p.R * p.h - p.h**2) / (p.R - p.h)), "lifts off at road"),
}


@pytest.mark.parametrize("name", RANGES)
def test_rest_is_possible_where_the_book_says(name: str) -> None:
    vary, formula, gives_way = RANGES[name]
    system = from_file(name)
    ((low, high),) = mbs.range_of_rest(system, vary).ends
    wanted = formula(given(system))
    for found, value in zip((low.value, high.value), wanted, strict=True):
        assert found == (None if value is None else pytest.approx(value, rel=EXACT, abs=EXACT))
    assert any(gives_way in why for why in (*low.gives_way, *high.gives_way))


@pytest.mark.parametrize(("sign", "beyond"), [(-1, "slide-"), (1, "slide+")])
def test_a_pushed_wedge_holds_its_block_between_the_forces_of_the_book(sign: int, beyond: str) -> None:
    """(M + m) g tan(alpha -+ rho), tan(rho) = mu: the wedge moves, which is no rest, but the block sticks to it."""
    system = from_file("pushed_wedge")
    p = given(system)
    limit = (p.M + p.m) * p.g * math.tan(p.alpha + sign * math.atan(p.mu))
    states = [mbs.solve(system, parameters={"F": limit * (1 + sign * away)}).states["c"] for away in (-1e-9, 1e-9)]
    assert states == ["stick", beyond]


def test_the_least_pull_is_at_the_angle_of_friction() -> None:
    system = from_file("least_pull")
    p, found = given(system), mbs.least_for_motion(system, "F", "beta")
    assert found.value.value == pytest.approx(p.mu * p.m * p.g / math.sqrt(1 + p.mu**2), rel=EXACT)


def test_a_rough_hinge_rubs_with_its_own_reaction() -> None:
    system = from_file("rough_hinge")
    p = given(system)
    arm = p.mu * p.r
    wanted = (arm * p.g - p.g * p.l / 2) / (p.l**2 / 3 - arm * p.l / 2)
    assert mbs.solve(system).accelerations["phi"].value == pytest.approx(wanted, rel=EXACT)


def first_change(name: str, kind: str, t_end: float) -> float:
    """Return when something first becomes what `kind` says."""
    changes = mbs.simulate(from_file(name), t_end=t_end).changes
    return next(float(change["t"]) for change in changes if change["kind"] == kind)


@pytest.mark.parametrize(
    ("name", "kind", "t_end", "formula"),
    [
        ("falling_on_a_rope", "taut", 1.0, lambda p: 2 * p.v0 / p.g),
        ("sliding_into_rolling", "stick", 3.0, lambda p: 2 * p.v0 / (7 * p.mu * p.g)),
        ("mass_on_a_belt", "slide-", 0.7, lambda p: p.mu_s * p.m * p.g / (p.k * p.v)),
        ("growing_force", "slide-", 4.0, lambda p: p.mu * p.g * (p.m1 + p.m2) / p.k),
        ("thrown_up", "slide-", 1.0, lambda p: p.v0 / (p.g * (math.sin(p.alpha) + p.mu * math.cos(p.alpha)))),
        ("drum_brake", "stick", 6.0, lambda p: p.J * p.omega / (p.mu * p.F * p.R)),
    ],
)
def test_it_happens_when_the_book_says(
    name: str, kind: str, t_end: float, formula: Callable[[SimpleNamespace], float]
) -> None:
    assert first_change(name, kind, t_end) == pytest.approx(formula(given(from_file(name))), rel=1e-9)


def test_a_lamp_in_a_rough_socket_spins_as_long_as_the_book_says() -> None:
    """A run tells slip in space from rest down to a billionth of its largest speed."""
    p = given(from_file("ball_in_socket"))
    time = p.J * p.omega / (p.mu * p.r * p.m * p.g)
    run = mbs.simulate(from_file("ball_in_socket"))
    assert run.t[-1] == pytest.approx(time, rel=1e-8)
    w, _, _, z = run.q[-1]
    assert 2 * math.atan2(-z, -w) % (2 * math.pi) == pytest.approx(p.omega * time / 2 % (2 * math.pi), abs=1e-7)
