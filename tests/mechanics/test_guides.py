"""Curves that guide: motion along them against 50-digit differences of the curves themselves."""

from __future__ import annotations

from collections.abc import Callable

import mpmath
import numpy as np
import pytest

from multibody_sym.mechanics.motion import Motion, accelerations, motion_of, state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.bodies import Body
from multibody_sym.model.joints import CurveJoint, Custom, Direct
from multibody_sym.model.steps import Curve
from multibody_sym.model.system import System

SEEDS = range(12)
STEP = mpmath.mpf(10) ** -12
"""Differences of order 2 over such steps err by 1e-24 and round off by 1e-26 in 50 digits."""


def random_coordinate(rng: np.random.Generator, letter: str, *, time: bool) -> str:
    """Return a smooth expression of the parameter, and of t if asked."""
    a, b, c, d, e = np.round(rng.uniform(0.3, 1.5, 5), 3)
    moving = f"*(1 + {d}*sin({e}*t))" if time else ""
    forms = [
        f"{a}*{letter} + {b}*sin({c}*{letter}){moving}",
        f"{a}*exp(-{b}*{letter}){moving} + {c}*{letter}^2",
        f"{a}*sqrt(1 + {b}*{letter}^2){moving} + atan({c}*{letter})",
        f"{a}*{letter}^3 - {b}*{letter}{moving} + {c}*log(2 + {letter})",
    ]
    return forms[int(rng.integers(len(forms)))]


def value_of(expression: str, s: mpmath.mpf, t: mpmath.mpf, letter: str) -> mpmath.mpf:
    names = {name: getattr(mpmath, name) for name in ("sin", "exp", "sqrt", "atan", "log")}
    exact = expression.replace("^", "**")
    return eval(exact, {"__builtins__": {}}, {**names, letter: s, "t": t})


def moved(system: System, t: float, q: list[float], u: list[float]) -> Motion:
    resolved = mechanism(system)
    return motion_of(resolved, state_of(resolved, float, t, q, u, []))


def differences(of: Callable[[mpmath.mpf], list[mpmath.mpf]]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return value, rate and second rate at zero."""
    before, here, after = of(-STEP), of(mpmath.mpf(0)), of(STEP)
    rate = [(b - a) / (2 * STEP) for a, b in zip(before, after, strict=True)]
    second = [(a - 2 * x + b) / STEP**2 for a, x, b in zip(before, here, after, strict=True)]
    return tuple(np.array([float(x) for x in v]) for v in (here, rate, second))  # type: ignore[return-value]


@pytest.mark.parametrize("seed", SEEDS)
def test_a_bead_moves_as_differences_of_its_curve_say(seed: int) -> None:
    rng = np.random.default_rng(seed)
    letter, time = ("s", bool(seed % 2))
    texts = {axis: random_coordinate(rng, letter, time=time) for axis in "xyz"}
    curve = Curve(**texts, parameter=letter, unit="m")
    joint = CurveJoint(parent="ground", child="b", curve=curve)
    system = System("bead", bodies={"b": Body(mass=1)}, joints={"J": joint})
    s, u, udot, t = (float(x) for x in rng.uniform(-1, 1, 4))

    def place(h: mpmath.mpf) -> list[mpmath.mpf]:
        at = s + h * u + h * h / 2 * mpmath.mpf(udot)
        return [value_of(texts[axis], at, t + h, letter) for axis in "xyz"]

    with mpmath.workdps(50):
        p, v, a = differences(place)
    motion = moved(system, t, [s], [u])
    np.testing.assert_allclose(motion.poses[0][1], p, rtol=1e-14, atol=1e-14)
    np.testing.assert_allclose(motion.bodies[0].v_WB, v, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(accelerations(motion, [udot])[0][0], a, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_body_that_turns_with_the_tangent_turns_by_its_angle(seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    time = bool(seed % 2)
    texts = {"x": "2*s + " + random_coordinate(rng, "s", time=time), "y": random_coordinate(rng, "s", time=time)}
    curve = Curve(**texts, parameter="s", unit="m")
    joint = CurveJoint(parent="ground", child="b", curve=curve, turns="tangent")
    system = System("cart", bodies={"b": Body(mass=1, inertia={"Izz": 1})}, joints={"J": joint})
    s, u, udot, t = (float(x) for x in rng.uniform(-1, 1, 4))

    def angle(h: mpmath.mpf) -> list[mpmath.mpf]:
        at = s + h * u + h * h / 2 * mpmath.mpf(udot)
        d = mpmath.mpf(10) ** -16
        x, y = (
            value_of(texts[axis], at + d, t + h, "s") - value_of(texts[axis], at - d, t + h, "s") for axis in "xy"
        )
        return [mpmath.atan2(y, x)]

    with mpmath.workdps(60):
        (phi,), (w,), (alpha,) = differences(angle)
    motion = moved(system, t, [s], [u])
    rotation = np.array(motion.poses[0][0], dtype=float)
    np.testing.assert_allclose(rotation[:2, :2], [[np.cos(phi), -np.sin(phi)], [np.sin(phi), np.cos(phi)]], atol=1e-14)
    np.testing.assert_allclose(motion.bodies[0].w_WB[2], w, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(accelerations(motion, [udot])[0][1][2], alpha, rtol=1e-11, atol=1e-11)


def test_a_way_along_a_curve_among_the_freedoms_of_a_custom_joint_is_the_same() -> None:
    curve = Curve(y="x^2/2")
    free = [Direct(curve=curve), Direct(rotate="z")]
    systems = [
        System("a", bodies={"b": Body(mass=1, com=[1, 0, 0])}, joints={"J": joint})
        for joint in (
            CurveJoint(parent="ground", child="b", curve=curve, turns="free"),
            Custom(parent="ground", child="b", free=free),
        )
    ]
    one, other = (moved(system, 0.0, [0.3, 0.4], [0.5, 0.6]) for system in systems)
    assert one.poses == other.poses
    assert accelerations(one, [0.0, 0.0]) == accelerations(other, [0.0, 0.0])
