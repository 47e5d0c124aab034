"""The textbook's problems that hold one way only, each against the formula that a book has: right to 1e-9."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import SimpleNamespace

import pytest
from twins import from_file

import multibody_sym as mbs

EXACT = 1e-9
Given = SimpleNamespace
_g = 10.0


def given(system: mbs.System) -> Given:
    """Return the parameters of a system as numbers."""
    from multibody_sym.dynamics.start.parameters import parameter_values
    from multibody_sym.mechanics.resolve import mechanism

    resolved = mechanism(system)
    values = parameter_values(resolved, {})
    return Given(**{entry.name: value for entry, value in zip(resolved.parameters, values, strict=True)
                    if entry.name.isidentifier()})


def t2(p: Given) -> dict[str, float]:
    pulled = p.F1 * (math.cos(p.alpha) + p.mu * math.sin(p.alpha))
    held = p.F2 * (math.cos(p.beta) - p.mu * math.sin(p.beta))
    a = (pulled - held) / (p.m1 + p.m2) - p.mu * p.g
    assert a == pytest.approx(3.5906618162532906, rel=1e-14)
    T = p.m2 * a + p.F2 * math.cos(p.beta) + p.mu * (p.m2 * p.g - p.F2 * math.sin(p.beta))
    return {
        "x1''": -a, "x2''": -a, "y1''": 0.0, "string.tension": T, "c1": "slide-", "c2": "slide-",
        "c1.normal": p.m1 * p.g - p.F1 * math.sin(p.alpha),
        "c1.friction": p.mu * (p.m1 * p.g - p.F1 * math.sin(p.alpha)),
    }


def t4(p: Given) -> dict[str, float]:
    a = p.g * (p.m2 - p.mu * p.m1) / (p.m1 + p.m2)
    return {"x''": a, "depth''": a, "string.tension": p.m2 * (p.g - a), "c.normal": p.m1 * p.g,
            "c.friction": -p.mu * p.m1 * p.g, "c": "slide+"}


def t5(p: Given) -> dict[str, float]:
    a = p.g * (p.m1 * (1 - p.mu) / math.sqrt(2) - p.m2) / (p.m1 + p.m2)
    return {"s''": -a, "depth''": -a, "string.tension": p.m2 * (p.g + a), "rub": "slide-"}


def t6(p: Given) -> dict[str, float]:
    return {"s1''": -0.248967813447245, "s2''": -0.248967813447245, "string.tension": 6.114993217231683,
            "c1": "slide-", "c2": "slide-"}


def t9(p: Given) -> dict[str, float]:
    return {"x1''": -4.625, "x2''": 4.625, "string.tension": 22.875, "between.normal": 30.0, "table.normal": 80.0,
            "between": "slide+"}


def free_wedge(p: Given) -> dict[str, float]:
    c, s = math.cos(p.alpha), math.sin(p.alpha)
    recoil = p.g * p.m * c * s / (p.M + p.m * s * s)
    return {"x''": recoil, "c.normal": p.M * recoil / s}


def pushed_wedge(p: Given) -> dict[str, float]:
    a = -p.F / (p.M + p.m)
    along = p.m * (a * math.cos(p.alpha) + p.g * math.sin(p.alpha))
    return {"x''": a, "bx''": 0.0, "by''": 0.0, "c": "stick", "c.friction": along}


def spool(p: Given) -> dict[str, float]:
    a = p.F * p.R * (p.R * math.cos(p.beta) - p.r) / (p.J + p.m * p.R**2)
    return {"x''": a, "phi''": -a / p.R, "c": "stick"}


def yo_yo(p: Given) -> dict[str, float]:
    return {"y''": -p.g * p.m * p.r**2 / (p.J + p.m * p.r**2),
            "cord.tension": p.m * p.g * p.J / (p.J + p.m * p.r**2)}


def heavy_pulley(p: Given) -> dict[str, float]:
    return {"y1''": 2.0, "y2''": -2.0, "axle.fy": 68.0}


def drum_hoist(p: Given) -> dict[str, float]:
    a = p.R * (p.tau - p.m * p.g * p.R) / (p.J + p.m * p.R**2)
    return {"y''": a, "phi''": a / p.R, "cable.tension": p.m * (p.g + a)}


def drum_brake(p: Given) -> dict[str, float]:
    return {"phi''": -p.mu * p.F * p.R / p.J, "c.normal": p.F}


def cylinder_in_corner(p: Given) -> dict[str, float]:
    alpha = -2 * p.g * p.mu * (1 + p.mu) / (p.R * (1 + p.mu**2))
    return {"phi''": alpha, "x''": 0.0, "y''": 0.0, "floor.normal": p.m * p.g / (1 + p.mu**2)}


def sliding_into_rolling(p: Given) -> dict[str, float]:
    return {"x''": -p.mu * p.g, "c": "slide+"}


def rod_in_bowl(p: Given) -> dict[str, float]:
    c = math.sqrt(p.R**2 - p.l**2)
    return {"phi''": -3 * p.g * math.sin(p.beta) * c / (3 * c * c + p.l**2)}


def crate(p: Given) -> dict[str, float]:
    return {"xc''": -p.mu * p.g, "c.normal": p.m * p.g}


def beam(p: Given) -> dict[str, float]:
    return {"left.normal": p.m * p.g / 2 + p.F * (p.l - p.c) / p.l, "right.normal": p.m * p.g / 2 + p.F * p.c / p.l}


def plank(p: Given) -> dict[str, float]:
    return {"x''": -2 * p.mu * p.g * p.s / p.d}


def ring(p: Given) -> dict[str, float]:
    normal = abs(p.m * p.g - p.F * math.sin(p.beta))
    return {"s''": (p.F * math.cos(p.beta) - p.mu * normal) / p.m, "rub": "slide+"}


def rolling_cylinder(p: Given) -> dict[str, float]:
    return {"s''": -2 * p.g * math.sin(p.alpha) / 3, "c": "stick", "c.friction": p.m * p.g * math.sin(p.alpha) / 3}


def movable_pulley(p: Given) -> dict[str, float]:
    a = p.g * (2 * p.m2 - p.m1) / (p.m1 + 4 * p.m2)
    return {"y1''": a, "y2''": -2 * a, "rope.tension": 3 * p.g * p.m1 * p.m2 / (p.m1 + 4 * p.m2)}


def thrown_up(p: Given) -> dict[str, float]:
    return {"s''": -p.g * (math.sin(p.alpha) + p.mu * math.cos(p.alpha)), "c": "slide+"}


def ladder(p: Given) -> dict[str, float]:
    push = p.m * p.g / (2 * math.tan(p.theta))
    return {"phi''": 0.0, "foot": "stick", "top.normal": push, "foot.normal": p.m * p.g, "foot.friction": push}


def ball_in_socket(p: Given) -> dict[str, float]:
    friction = p.mu * p.r * p.m * p.g
    return {"socket_wx''": 0.0, "socket_wy''": 0.0, "socket_wz''": -friction / p.J, "rub.friction_3": -friction,
            "socket.fz": p.m * p.g, "rub": "slide"}


def two_drums(p: Given) -> dict[str, float]:
    first, k = math.exp(p.mu1 * math.pi / 2), math.exp(p.mu1 * math.pi / 2 + p.mu2 * math.pi)
    a = p.g * (p.M - p.mu * p.m * k) / (p.M + p.m * k)
    T1 = p.m * (a + p.mu * p.g)
    return {"x''": a, "depth''": a, "rope.tension1": T1, "rope.tension2": T1 * first, "rope.tension3": p.M * (p.g - a),
            "c": "slide+", "drum1": "slip+", "drum2": "slip+"}


def ball_on_rails(p: Given) -> dict[str, float]:
    a = p.g * math.sin(p.alpha) / (1 + 2 * p.r**2 / (5 * (p.r**2 - p.b**2)))
    return {"free_x''": a, "free_wy''": a / math.sqrt(p.r**2 - p.b**2),
            "A.friction_1": p.m * (a - p.g * math.sin(p.alpha)) / 2}


def across_the_slope(p: Given) -> dict[str, float]:
    return {"x''": 0.0, "y''": 0.0, "c": "stick", "c.friction_1": -p.m * p.g * math.sin(p.alpha), "c.friction_2": -p.F}


PROBLEMS: dict[str, Callable[[Given], dict[str, float]]] = {
    "t2_rough_plane": t2,
    "t4_table_edge": t4,
    "t5_incline": t5,
    "t6_double_incline": t6,
    "t9_block_on_block": t9,
    "free_wedge": free_wedge,
    "pushed_wedge": pushed_wedge,
    "spool": spool,
    "yo_yo": yo_yo,
    "heavy_pulley": heavy_pulley,
    "drum_hoist": drum_hoist,
    "drum_brake": drum_brake,
    "cylinder_in_corner": cylinder_in_corner,
    "sliding_into_rolling": sliding_into_rolling,
    "rod_in_bowl": rod_in_bowl,
    "crate_on_a_truck": crate,
    "beam": beam,
    "plank_on_rollers": plank,
    "ring_on_a_rod": ring,
    "cylinder_down_an_incline": rolling_cylinder,
    "movable_pulley": movable_pulley,
    "thrown_up": thrown_up,
    "ladder": ladder,
    "ball_in_socket": ball_in_socket,
    "two_drums": two_drums,
    "ball_on_rails": ball_on_rails,
    "across_the_slope": across_the_slope,
}


@pytest.mark.parametrize("name", PROBLEMS)
def test_a_problem_is_solved_as_the_book_does(name: str) -> None:
    system = from_file(name)
    solution = mbs.solve(system)
    size = max(abs(x.value or 0.0) for x in solution.accelerations.values()) or 1.0
    for asked, wanted in PROBLEMS[name](given(system)).items():
        if asked.endswith("''"):
            found = solution.accelerations[asked[:-2]].value
            assert found == pytest.approx(wanted, rel=EXACT, abs=EXACT * size), asked
        elif "." in asked:
            element, component = asked.split(".")
            assert solution.reactions[element][component].value == pytest.approx(wanted, rel=EXACT), asked
        else:
            assert solution.states[asked] == wanted
