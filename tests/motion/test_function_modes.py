"""Functions of what may hold or let go, in a mode, and inverse dynamics of what is constrained, by its drives."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from many_digits import slopes
from mpmath import mp
from scipy.linalg import null_space
from test_function import FOUR_BAR

import multibody_sym as mbs
from multibody_sym.program.program import interpret

CART = """
multibody_sym: 1
name: cart
gravity: [0, -9.81, 0]
bodies:
  cart: {mass: 2}
  bob: {mass: 0.5, com: [0.1, -0.8, 0], inertia: {Izz: 0.02}}
joints:
  slide: {type: prismatic, parent: ground, child: cart, axis: x, q: x, initial: {u: 0.4}}
  hinge: {type: revolute, parent: cart, child: bob, axis: z, q: phi, initial: {q: 0.7}}
forces: {rub: {type: friction, joint: slide, static: 0.3, kinetic: 0.2}}
"""
PIN = CART.replace("joint: slide, static", "joint: hinge, radius: 0.05, static")
BOX = """
multibody_sym: 1
name: box
gravity: [0, -9.81, 0]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  box: {mass: 1, com: [0.1, 0, 0], inertia: {Izz: 1}, points: {corner: [0, -1, 0]}}
joints: {free: {type: planar, parent: ground, child: box, initial: {q: [0, 1, 0], u: [1, 0, 0]}}}
contacts: {touch: {between: [box.corner, ground.floor], static: 0.5, kinetic: 0.4}}
"""
CONSTANT = CART.replace("joint: slide, static: 0.3, kinetic: 0.2", "joint: hinge, force: 0.7")
MODELS = {"bar": FOUR_BAR, "cart": CART, "pin": PIN, "box": BOX, "constant": CONSTANT}


def consistent(system: mbs.System, mode: Any = None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return q, u, udot with phi = 0, H u = 0, H udot = gamma near the start."""
    from multibody_sym.dynamics.start.state import examined_state

    q = np.array(examined_state(system).begin.q)
    rows = mbs.function(system, "constraints", mode=mode, backend="python")
    H = rows(0.0, q, np.zeros(3)).jacobian
    N = null_space(H)
    u = N @ np.linspace(1.3, 0.4, N.shape[1])
    return q, u, np.linalg.pinv(H) @ rows(0.0, q, u).gamma + N @ np.linspace(0.7, -0.2, N.shape[1])


def test_the_crank_of_a_four_bar_needs_the_torque_of_eksergians_equation() -> None:
    """tau = J a'' + J' a'^2 / 2 + V', with J and V of the one freedom in closed form."""
    bars = ((0.3, 0.15, 0.002, 0.3), (0.8, 0.4, 0.04, 0.8), (0.6, 0.3, 0.02, 0.6))  # m, com, Izz, length

    def angles(a: Any) -> tuple[Any, Any, Any]:
        x, y = 0.9 - 0.3 * mp.cos(a), -0.3 * mp.sin(a)
        d = mp.sqrt(x * x + y * y)
        coupler = mp.atan2(y, x) + mp.acos((0.64 + d * d - 0.36) / (1.6 * d))
        px, py = 0.3 * mp.cos(a) + 0.8 * mp.cos(coupler) - 0.9, 0.3 * mp.sin(a) + 0.8 * mp.sin(coupler)
        return a, coupler, mp.atan2(py, px)

    def centres(a: Any) -> list[tuple[Any, Any]]:
        turned = angles(a)
        starts = [(0, 0), (0.3 * mp.cos(a), 0.3 * mp.sin(a)), (0.9, 0)]
        pairs = zip(bars, turned, starts, strict=True)
        return [(x + bar[1] * mp.cos(w), y + bar[1] * mp.sin(w)) for bar, w, (x, y) in pairs]

    def J(a: Any) -> Any:
        found = mp.mpf(0)
        for k, (m, _, inertia, _) in enumerate(bars):
            moves = [mp.diff(lambda s, i=i, k=k: centres(s)[k][i], a) for i in (0, 1)]
            found += m * sum(v * v for v in moves) + inertia * mp.diff(lambda s, k=k: angles(s)[k], a) ** 2
        return found

    a, rate, acceleration = mp.mpf("0.7"), 2.0, -3.0
    with mp.workdps(40):
        weight = mp.diff(lambda s: 9.81 * sum(bar[0] * c[1] for bar, c in zip(bars, centres(s), strict=True)), a)
        wanted = J(a) * acceleration + mp.diff(J, a) / 2 * rate**2 + weight
        _, coupler, rocker = angles(a)
        ratios = [mp.mpf(1), mp.diff(lambda s: angles(s)[1], a), mp.diff(lambda s: angles(s)[2], a)]
        bends = [mp.diff(lambda s, k=k: angles(s)[k], a, 2) for k in range(3)]
    q = np.array([float(a), float(coupler - a), float(rocker)])
    u = rate * np.array([1.0, float(ratios[1] - 1), float(ratios[2])])
    turns = [float(r * acceleration + b * rate**2) for r, b in zip(ratios, bends, strict=True)]
    udot = np.array([turns[0], turns[1] - turns[0], turns[2]])
    f = mbs.function(mbs.loads(FOUR_BAR), "inverse_dynamics", drives="a")
    np.testing.assert_allclose(f(0.0, q, u, udot), [float(wanted), 0.0, 0.0], rtol=1e-11, atol=0)
    assert not f.least_norm


def test_drives_of_a_loop_do_the_work_of_all_joints() -> None:
    """Least forces tau with N^T S^T tau = N^T (M udot + c) for the motions N of the loop."""
    system = mbs.loads(FOUR_BAR)
    q, u, udot = consistent(system)
    needed = mbs.function(system, "mass_matrix")(0.0, q, u) @ udot + mbs.function(system, "bias")(0.0, q, u)
    N = null_space(mbs.function(system, "constraints")(0.0, q, u).jacobian)
    for drives in (["a"], ["c"], ["a", "b"], ["b", "a", "c"]):
        driven = ["abc".index(name) for name in drives]
        wanted = np.zeros(3)
        wanted[driven] = np.linalg.pinv(N.T[:, driven]) @ N.T @ needed
        f = pickle.loads(pickle.dumps(mbs.function(system, "inverse_dynamics", drives=drives)))
        np.testing.assert_allclose(f(0.0, q, u, udot), wanted, atol=1e-12)
        assert f.least_norm == (len(drives) > 1) == ("of least norm" in repr(f))
    many = f(0.0, np.tile(q, (3, 1)), u, udot)
    np.testing.assert_array_equal(many[1], f(0.0, q, u, udot))


def test_a_joint_that_mimics_leaves_its_work_to_the_other() -> None:
    """With b = 2 a the motor of a does the work of both: tau = tau_a + 2 tau_b."""
    text = FOUR_BAR[: FOUR_BAR.index("  c: {type")] + "constraints: {tie: {type: coupler, joints: {b: 1, a: -2}}}\n"
    text = text.replace("q: b, initial: {q: 0}", "q: b, initial: {q: 1.4}").replace(
        "  rocker: {mass: 0.6, com: [0.3, 0, 0], inertia: {Izz: 0.02}, points: {end: [0.6, 0, 0]}}\n", ""
    )
    tied, free = mbs.loads(text), mbs.loads(text[: text.index("constraints")])
    at = np.array([0.7, 1.4]), np.array([0.5, 1.0]), np.array([-0.3, -0.6])
    each = mbs.function(free, "inverse_dynamics")(0.0, *at)
    found = mbs.function(tied, "inverse_dynamics", drives=["a"])(0.0, *at)
    np.testing.assert_allclose(found, [each[0] + 2 * each[1], 0.0], rtol=1e-13)


def test_too_few_drives_are_named() -> None:
    bar, cart = mbs.loads(FOUR_BAR), mbs.loads(CART)
    with pytest.raises(mbs.ModelError, match="say which joints are driven"):
        mbs.function(bar, "inverse_dynamics")
    with pytest.raises(mbs.InputError, match="no joint 'd' has a speed"):
        mbs.function(bar, "inverse_dynamics", drives="d")
    with pytest.raises(mbs.NoSolutionError, match=r"2 degrees of freedom need as many drives.*u_x is free.*'slide'"):
        mbs.function(cart, "inverse_dynamics", drives=["hinge"], mode="found")
    with pytest.raises(mbs.InputError, match="has no option drives"):
        mbs.function(bar, "bias", drives="a")


def test_friction_acts_as_the_mode_says() -> None:
    """A block on a guide slows by mu g; the force that keeps its speed is mu m g; where it sticks it stays."""
    block = mbs.loads(CART[: CART.index("  bob")] + CART[CART.index("joints") : CART.index("  hinge")] + RUB)
    found = mbs.function(block, "state_derivative", mode="found")
    assert found.mode == {"rub": "slide+"}
    at = 0.0, np.zeros(1), np.array([0.4])
    for word, sign in (("slide+", 1), ("slide-", -1), ("stick", 0)):
        mode = {"rub": word}
        f = mbs.function(block, "state_derivative", mode=mode)
        assert f.mode == mode
        assert f(*at).udot == pytest.approx(-sign * 0.2 * 9.81, abs=1e-14)
        forces = mbs.function(block, "inverse_dynamics", mode=mode, drives=[] if sign else ["slide"])
        assert forces(*at, np.zeros(1)) == pytest.approx(sign * 0.2 * 2 * 9.81, abs=1e-14)
    rhs = mbs.compile(mbs.state_derivative(block))
    np.testing.assert_array_equal(rhs(0.0, [0.0, 0.4]), np.concatenate([found(*at).qdot, found(*at).udot]))


RUB = "forces: {rub: {type: friction, joint: slide, static: 0.3, kinetic: 0.2}}\n"


def test_contacts_press_and_rub_as_the_mode_says() -> None:
    """The corner of a tilted box: Newton's and Euler's equations with N and -mu N at it."""
    system, q, u = mbs.loads(BOX), np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])
    for word, mu in (("slide+", 0.4), ("slide-", -0.4)):
        mode = {"touch": word}
        # of the centre, 0.1 ahead of the corner and 1 above it: x'' = -mu N, y'' = N - g, w' = -0.1 N - mu N
        # the corner stays on the floor: 0 = y'' - 0.1 w' with w = 0
        N = 9.81 / (1 + 0.01 + 0.1 * mu)
        f = mbs.function(system, ["normal(touch)", "friction(touch)"], mode=mode)
        np.testing.assert_allclose(f(0.0, q, u), [N, -mu * N], rtol=1e-13)
        moving = mbs.function(system, "state_derivative", mode=mode)(0.0, q, u)
        assert moving.udot[2] == pytest.approx(-(0.1 + mu) * N, rel=1e-12)
    falling = mbs.function(system, "state_derivative", mode={})(0.0, q, u)
    np.testing.assert_allclose(falling.udot, [0.0, -9.81, 0.0], atol=1e-14)


def test_wrong_modes_are_told() -> None:
    system = mbs.loads(BOX)
    with pytest.raises(mbs.ModelError, match=r'touch may hold or let go.*mode="found"'):
        mbs.function(system, "state_derivative")
    with pytest.raises(mbs.InputError, match="mode: touch is no 'taut'; it may be open, slide"):
        mbs.function(system, "state_derivative", mode={"touch": "taut"})
    with pytest.raises(mbs.InputError, match="mode: 'touches' is nothing that holds or lets go; did you mean touch"):
        mbs.function(system, "state_derivative", mode={"touches": "stick"})
    with pytest.raises(mbs.InputError, match='mode is "found" or a map'):
        mbs.function(system, "state_derivative", mode="sought")  # type: ignore[arg-type]
    with pytest.raises(mbs.InputError, match="mass_matrix has no option mode"):
        mbs.function(system, "mass_matrix", mode="found")
    with pytest.raises(mbs.ModelError, match=r"touch may hold or let go.*state of them; leave them out"):
        mbs.function(system, "hybrid_dynamics", given=["free"])


@pytest.mark.parametrize(
    ("model", "mode", "drives"),
    [
        ("bar", None, ["a"]),
        ("cart", "found", ()),
        ("pin", {"rub": "slide-"}, ()),
        ("box", "found", ["free"]),
        ("constant", {"rub": "slide-"}, ()),
    ],
)
def test_derivatives_with_fifty_digits(model: str, mode: Any, drives: Any) -> None:
    system = mbs.loads(MODELS[model])
    at = consistent(system, mode) if model in ("bar", "box") else (np.array([0.1, 0.6]), np.array([0.4, -0.9]))
    for what in ("state_derivative", "inverse_dynamics"):
        options: dict[str, Any] = {"drives": drives} if what == "inverse_dynamics" else {}
        f = mbs.function(system, what, mode=mode, **options)
        state = [[0.0], *at[:2], f._question.parameters, [], []]
        state += [np.linspace(0.5, -0.8, len(at[1]))] if what == "inverse_dynamics" else []
        for by, place in {"q": 1, "u": 2, "udot": 6}.items():
            if by == "udot" and what == "state_derivative":
                continue
            found = interpret(f.derivative(by).program, 0.0, *state[1:])
            for exact, wanted in zip(found, slopes(f.program, state, place), strict=True):
                size = max(1.0, np.abs(wanted).max(initial=0.0))
                np.testing.assert_allclose(exact, wanted.reshape(exact.shape), rtol=0, atol=1e-11 * size)
