"""Functions of a system: one state or many, derivatives against differences, inputs, parameters, wrong calls."""

from __future__ import annotations

import pickle
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from rolling_and_loops import FOUR_BAR

import multibody_sym as mbs
from multibody_sym.errors import MissingPackageError
from multibody_sym.scalars.vectors import quaternion_rotation

ARM = """
multibody_sym: 1
name: arm
gravity: [0, -9.81, 0]
parameters: {m: 0.7, k: 30, s: k/3}
bodies:
  ground: {points: {hook: [1, 0.4, 0]}}
  cart: {mass: 2}
  upper: {mass: m, com: [0, -0.25, 0], inertia: {Izz: 0.02}, points: {end: [0, -0.5, 0]}}
  lower: {mass: 0.4, com: [0.1, -0.2, 0], inertia: {Izz: 0.01}, points: {tip: [0, -0.4, 0]}}
joints:
  rail: {type: prismatic, parent: ground, child: cart, axis: x, q: x}
  hinge: {type: revolute, parent: cart, child: upper, q: a}
  knee: {type: revolute, parent: upper.end, child: lower, q: b}
forces:
  spring: {type: spring_damper, between: [ground.hook, lower.tip], stiffness: k, damping: s/10, length: 0.2}
  drive: {type: force, on: cart, value: [push, 0, 0]}
inputs: {push: -2*x - u_x}
outputs: {height: "position(lower.tip, y)"}
"""  # a cart with two links, on whose end a spring pulls

BALL = """
multibody_sym: 1
name: ball
gravity: [0.3, 0, -9.81]
bodies:
  top: {mass: 1.5, com: [0, 0.1, 0.3], inertia: {Ixx: 0.04, Iyy: 0.05, Izz: 0.03, Ixy: 0.002, Iyz: 0.001}}
  rod: {mass: 0.5, com: [0, 0.2, 0], inertia: {Ixx: 0.01, Iyy: 0.002, Izz: 0.01}}
joints:
  foot: {type: free, parent: ground, child: top}
  hinge: {type: revolute, parent: top, child: rod, axis: [1, 0.2, 0], q: a}
"""  # a free body with a quaternion, which carries a hinged rod

def arm() -> mbs.System:
    return mbs.loads(ARM)


SYSTEMS = {"arm": ARM, "ball": BALL, "four_bar": FOUR_BAR}
TREES = ("inverse_dynamics",)
EVERY = (
    "state_derivative",
    "mass_matrix",
    "bias",
    "gravity",
    "energies",
    "momentum",
    "centroidal_momentum",
    "constraints",
    "reactions",
)


@pytest.fixture(scope="module", params=SYSTEMS)
def system(request: pytest.FixtureRequest) -> mbs.System:
    return mbs.loads(SYSTEMS[request.param])


def state(f: mbs.Function, seed: int = 1) -> list[Any]:
    """Return t, q, u and accelerations if they are taken."""
    rng, mechanism = np.random.default_rng(seed), mbs.mechanism(f.system)
    q, u = rng.standard_normal(len(mechanism.coordinates)), rng.standard_normal(len(mechanism.speeds))
    for body in mechanism.bodies:
        for places in body.quaternions:
            q[list(places)] /= np.linalg.norm(q[list(places)])
    return [0.3, q, u, *([rng.standard_normal(len(u))] if "udot" in f.arguments else [])]


def parts(result: Any) -> list[np.ndarray]:
    return list(result) if isinstance(result, tuple) else [result]


@pytest.mark.parametrize("what", [*EVERY, *TREES])
def test_many_states_have_the_bits_of_each_alone(system: mbs.System, what: Any) -> None:
    if what in TREES and system.name == "four_bar":
        with pytest.raises(mbs.ModelError, match="closes a loop"):
            mbs.function(system, what)
        return
    f = mbs.function(system, what)
    states = [state(f, seed) for seed in range(70)]
    stacked = [np.array([one[k] for one in states]) for k in range(len(states[0]))]
    alone = [parts(f(*one)) for one in states]
    for threads in (1, 2):
        for k, whole in enumerate(parts(f(*stacked, threads=threads))):
            assert whole.shape == (70, *f.shapes[f.names[k]])
            assert all(np.array_equal(whole[n], each[k]) for n, each in enumerate(alone))
    slow = mbs.function(system, what, backend="python")
    for quick, plain in zip(parts(f(*states[0])), parts(slow(*states[0])), strict=True):
        np.testing.assert_array_equal(quick, plain)
    for quick, plain in zip(parts(f(*stacked)), parts(slow(*stacked)), strict=True):
        np.testing.assert_array_equal(quick, plain)


def moved(system: mbs.System, q: np.ndarray, way: np.ndarray, f: mbs.Function) -> np.ndarray:
    """Return the configuration from which q has gone on for one second at speeds `way`."""
    rates = mbs.function(system, "state_derivative")
    steps = 40
    for _ in range(steps):  # Runge-Kutta's method of order 4, whose error is far below that of differences
        k1 = rates(0.3, q, way).qdot
        k2 = rates(0.3, q + k1 / (2 * steps), way).qdot
        k3 = rates(0.3, q + k2 / (2 * steps), way).qdot
        k4 = rates(0.3, q + k3 / steps, way).qdot
        q = q + (k1 + 2 * k2 + 2 * k3 + k4) / (6 * steps)
    return q


def differences(function: Callable[[float], list[np.ndarray]], step: float = 3e-4) -> list[np.ndarray]:
    """Return derivatives at 0 by differences of order 4."""
    near, far = [function(k * step) for k in (-1, 1)], [function(k * step) for k in (-2, 2)]
    pairs = zip(*near, *far, strict=True)
    return [(8 * (b - a) - (d - c)) / (12 * step) for a, b, c, d in pairs]


@pytest.mark.parametrize("by", ["t", "q", "u", "udot"])
@pytest.mark.parametrize("what", ["state_derivative", "inverse_dynamics", "mass_matrix", "centroidal_momentum"])
def test_derivatives_are_limits_of_differences(system: mbs.System, what: Any, by: Any) -> None:
    if what == "inverse_dynamics" and system.name == "four_bar":
        return
    f = mbs.function(system, what)
    if by == "udot" and "udot" not in f.arguments:
        with pytest.raises(mbs.InputError, match="no function of"):
            f.derivative(by)
        return
    given = state(f)
    found = parts(f.derivative(by)(*given))
    place = ["t", "q", "u", "udot"].index(by)
    for column in range(1 if by == "t" else len(given[2])):
        way = np.zeros(1 if by == "t" else len(given[2]))
        way[column] = 1.0

        def along(size: float, way: np.ndarray = way) -> list[np.ndarray]:
            there = list(given)
            there[place] = moved(system, given[1], size * way, f) if by == "q" else given[place] + size * way
            there[0] = float(np.ravel(there[0])[0])
            return parts(f(*there))

        for exact, limit in zip(found, differences(along), strict=True):
            size = max(1.0, float(np.abs(exact).max(initial=0.0)))
            np.testing.assert_allclose(exact[..., column], limit, atol=3e-9 * size, rtol=0)


def test_parameters_that_follow_others_move_with_them() -> None:
    f = mbs.function(arm(), "state_derivative")
    assert f.parameters == ("m", "k", "s")
    assert f.independent_parameters == ("m", "k")
    given = state(f)
    found = f.derivative("parameters")(*given).udot
    for column, (name, value) in enumerate({"m": 0.7, "k": 30.0}.items()):
        (limit,) = differences(lambda d, name=name, value=value: [f(*given, parameters={name: value + d}).udot])
        np.testing.assert_allclose(found[:, column], limit, atol=1e-9, rtol=1e-9)


def test_inputs_are_declared_or_given() -> None:
    system = arm()
    f = mbs.function(system, "state_derivative")
    t, q, u = state(f)
    declared = -2 * q[0] - u[0]
    plain = f(t, q, u).udot
    np.testing.assert_array_equal(plain, f(t, q, u, inputs={"push": declared}).udot)
    np.testing.assert_array_equal(plain, f(t, q, u, inputs=[declared]).udot)
    pushed = f(t, q, u, inputs={"push": np.array([declared, 0.0, 5.0])})
    np.testing.assert_array_equal(pushed.udot[0], plain)
    np.testing.assert_array_equal(pushed.udot[2], f(t, q, u, inputs={"push": 5.0}).udot)
    slope = f.derivative("inputs")(t, q, u).udot
    np.testing.assert_allclose(pushed.udot[2] - pushed.udot[1], 5.0 * slope[:, 0], atol=1e-12)
    with pytest.raises(mbs.InputError, match="no input 'pull'"):
        f(t, q, u, inputs={"pull": 1.0})


SPRINGS = {"k": "-4*x", "F": 0, "s": "-x^3"}


@pytest.mark.parametrize("given", [{"F": 1.0}, {"k": -4.0}, {"s": 2.0, "F": 1.0}, {"k": 0.0, "s": 1}])
def test_inputs_that_are_not_given_follow_the_state_in_derivatives_too(given: dict[str, float]) -> None:
    """x'' = k + F + s at x = 1, by hand; the same by differences of the function."""
    cart = mbs.Prismatic("ground", "b", axis="x", q="x")
    force = mbs.Force("b", ["k + F + s", 0, 0])
    system = mbs.System(
        "springs", bodies={"b": mbs.Body(mass=1)}, joints={"j": cart}, inputs=SPRINGS, forces={"f": force}
    )
    f, at = mbs.function(system, "state_derivative"), (0.0, np.ones(1), np.zeros(1))
    assert f(*at, inputs=given).udot.item() == sum(({"k": -4.0, "F": 0.0, "s": -1.0} | given).values())
    slope = (0 if "k" in given else -4) + (0 if "s" in given else -3)
    first, second = f.derivative("q"), f.derivative("q").derivative("q")
    assert first(*at, inputs=given).udot.item() == slope
    assert second(*at, inputs=given).udot.item() == (0 if "s" in given else -6)
    assert f.jvp(*at, rates={"q": [1.0]}, inputs=given).udot.item() == slope
    both = f.with_derivatives("q", "inputs", of="udot")(*at, inputs=given)
    assert both.udot_by_q.item() == slope
    assert both.udot_by_inputs.tolist() == [[1, 1, 1]]
    assert f.derivative("q", inputs="free")(*at, inputs=given).udot.item() == 0


def test_inputs_that_drive_motions_have_no_column() -> None:
    arm = mbs.Revolute("cart", "rod", axis="z", q="a")
    system = mbs.System(
        "shaken",
        bodies={"cart": mbs.Body(mass=1), "rod": mbs.Body(shape={"rod": 1, "mass": 3})},
        joints={"rail": mbs.Prismatic("ground", "cart", axis="x", motion="x0"), "arm": arm},
        inputs={"x0": "0.1*sin(3*t)", "T": 0},
        forces={"motor": mbs.Torque("T", joint="arm")},
    )
    f, at = mbs.function(system, "state_derivative"), (0.3, [1.0], [0.0])
    assert f.inputs == ("T",)
    assert f.derivative("inputs")(*at).udot == pytest.approx(np.array([[1.0]]), rel=1e-14)  # 3 kg*(1 m)^2/3
    assert f(*at, inputs=[2.0]).udot == f(*at, inputs={"T": 2.0}).udot
    with pytest.raises(mbs.InputError, match="x0 drives a motion"):
        f(*at, inputs={"x0": 1.0})


def test_arguments_broadcast_by_their_axes() -> None:
    f = mbs.function(arm(), "energies")
    t, q, u = state(f)
    many = f(t, np.stack([q, 2 * q]), u, parameters={"m": 1.0})
    assert many.kinetic.shape == many.potential.shape == (2,)
    assert many.potential[1] == f(t, 2 * q, u, parameters={"m": 1.0}).potential
    masses = np.array([[0.7, 30.0, 10.0], [1.0, 30.0, 10.0]])
    assert f(t, q, u, parameters=masses).kinetic[0] == f(t, q, u).kinetic
    assert f(t, np.empty((0, 3)), u).kinetic.shape == (0,)
    out = (np.empty(2), np.empty(2))
    assert f(t, np.stack([q, q]), u, out=out) is out
    assert out[0][1] == f(t, q, u).kinetic


def test_wrong_calls_are_told() -> None:
    system = arm()
    f = mbs.function(system, "mass_matrix")
    t, q, u = state(f)
    with pytest.raises(mbs.InputError, match=r"q has the shape \(2,\), not \(3,\) or \(n, 3\)"):
        f(t, q[:2], u)
    with pytest.raises(mbs.InputError, match="different numbers of states"):
        f(t, np.stack([q, q]), np.stack([u, u, u]))
    with pytest.raises(mbs.InputError, match="takes no udot"):
        f(t, q, u, u)
    with pytest.raises(mbs.InputError, match="contiguous arrays of floats"):
        f(t, q, u, out=np.empty((3, 2)))
    with pytest.raises(mbs.InputError, match="q has masked elements"):
        f(0.0, np.ma.array([0.1, 0.2, 0.3], mask=[False, True, False]), np.zeros(3))
    f(0.0, np.ma.array([0.1, 0.2, 0.3]), np.zeros(3))
    with pytest.raises(mbs.InputError, match=r"^Function\.jvp is missing rates=$"):
        f.jvp(0.0, np.zeros(3), np.zeros(3), threads=2)
    with pytest.raises(mbs.InputError, match=r"^Function\.vjp is missing by=$"):
        f.vjp(0.0, np.zeros(3), np.zeros(3), weights=1.0)
    with pytest.raises(mbs.InputError, match="complex"):
        f(t, q + 1j, u)
    with pytest.raises(mbs.InputError, match="no function 'mass'"):
        mbs.function(system, "mass")  # type: ignore[arg-type]
    with pytest.raises(mbs.InputError, match="no frame 'tool'"):
        mbs.function(system, "frame", frame="tool")
    with pytest.raises(mbs.InputError, match="no option frame"):
        mbs.function(system, "bias", frame="cart")
    with pytest.raises(mbs.InputError, match="no axes 'body'"):
        mbs.function(system, "frame", frame="cart", axes="body")  # type: ignore[arg-type]
    with pytest.raises(mbs.ModelError, match="may hold or let go"):
        mbs.function(
            mbs.System(
                "box",
                bodies={
                    "ground": mbs.Body(surfaces={"floor": mbs.Surface(plane=[0, 0, 0], normal="y")}),
                    "box": mbs.Body(mass=1, inertia={"Izz": 1}, points={"corner": [0, -1, 0]}),
                },
                joints={"free": mbs.Planar("ground", "box", initial={"q": [0, 2, 0]})},
                contacts={"touch": mbs.Contact(["box.corner", "ground.floor"])},
            ),
            "state_derivative",
        )


@pytest.mark.parametrize("axes", ["world", "local", "local_world_aligned"])
def test_frames_move_as_their_jacobians_say(system: mbs.System, axes: Any) -> None:
    name = {"arm": "lower.tip", "ball": "rod", "four_bar": "coupler.end"}[system.name]
    frame = mbs.function(system, "frame", frame=name, axes=axes)
    jacobian = mbs.function(system, "jacobian", frame=name, axes=axes)
    given = state(frame)
    moves, columns = frame(*given), jacobian(*given)
    np.testing.assert_allclose(moves.velocity, columns.jacobian @ given[2], atol=1e-12)
    np.testing.assert_allclose(moves.drift, columns.rate @ given[2], atol=1e-11)
    np.testing.assert_allclose(quaternion_rotation(moves.quaternion), moves.rotation, atol=1e-14)
    udot = np.linspace(-1.0, 2.0, len(given[2]))
    rate = mbs.function(system, "acceleration", frame=name, axes=axes)(*given, udot)
    np.testing.assert_allclose(rate, columns.jacobian @ udot + moves.drift, atol=1e-11)
    if axes == "local_world_aligned":
        place = frame.derivative("q")(*given).position
        np.testing.assert_allclose(columns.jacobian[:3], place, atol=1e-12)
    slope = frame.derivative("u")(*given).velocity
    np.testing.assert_allclose(columns.jacobian, slope, atol=1e-12)


def test_expressions_and_declared_outputs_are_asked_alike() -> None:
    system = arm()
    f, g = mbs.function(system, "outputs"), mbs.function(system, ["position(lower.tip, y)", "2*x", "kinetic_energy()"])
    given = state(f)
    assert f(*given) == g(*given)[0]
    assert g(*given)[1] == 2 * given[1][0]
    assert g(*given)[2] == pytest.approx(mbs.function(system, "energies")(*given).kinetic, rel=1e-14)
    tip = mbs.function(system, "jacobian", frame="lower.tip", axes="local_world_aligned")(*given).jacobian
    np.testing.assert_allclose(f.derivative("q")(*given), tip[1], atol=1e-13)


def test_equations_of_motion_hold_between_functions(system: mbs.System) -> None:
    f = mbs.function(system, "state_derivative")
    given = state(f)
    rates = f(*given)
    rows = mbs.function(system, "constraints")(*given)
    if system.name == "ball":
        left = mbs.function(system, "mass_matrix")(*given) @ rates.udot + mbs.function(system, "bias")(*given)
        np.testing.assert_allclose(left, 0.0, atol=1e-11)
    np.testing.assert_allclose(rows.jacobian @ rates.udot, rows.gamma, atol=1e-10)
    rest = mbs.function(system, "bias")(given[0], given[1], 0 * given[2])
    np.testing.assert_allclose(rest, mbs.function(system, "gravity")(*given), atol=1e-12)


def test_the_regressor_is_linear_in_masses_and_inertias() -> None:
    for model in (ARM, BALL):
        system = mbs.loads(model)
        f = mbs.function(system, "regressor")
        given = state(f)
        found = f(*given)
        left = mbs.function(system, "mass_matrix")(*given[:3]) @ given[3] + mbs.function(system, "bias")(*given[:3])
        np.testing.assert_allclose(found.regressor @ found.theta, left, atol=1e-12)
        assert found.theta[0] == {"arm": 2.0, "ball": 1.5}[system.name]


def test_christoffels_symbols_make_a_skew_matrix(system: mbs.System) -> None:
    if system.name == "ball":
        with pytest.raises(mbs.ModelError, match="Christoffel"):
            mbs.function(system, "coriolis_matrix")
        return
    f = mbs.function(system, "coriolis_matrix")
    given = state(f)
    C, u = f(*given), given[2]
    of_velocities = mbs.function(system, "bias")(*given) - mbs.function(system, "gravity")(*given)
    np.testing.assert_allclose(C @ u, of_velocities, atol=1e-12)
    rate = mbs.function(system, "mass_matrix").derivative("q")(*given) @ u - 2 * C
    np.testing.assert_allclose(rate, -rate.T, atol=1e-12)


def test_functions_are_pickled_by_their_model() -> None:
    f = mbs.function(arm(), "state_derivative").derivative("q")
    again = pickle.loads(pickle.dumps(f))
    given = state(f)
    np.testing.assert_array_equal(again(*given).udot, f(*given).udot)
    assert hash(again) == hash(f)
    assert again == f == mbs.function(arm(), "state_derivative").derivative("q")
    assert f not in (mbs.function(arm(), "state_derivative"), mbs.function(arm(), "bias").derivative("q"), 1)
    assert repr(mbs.function(arm(), "bias")) == (
        "<Function bias of arm: (t [s], q (3,) [m, rad], u (3,) [m/s, rad/s]) -> bias (3,) [N, N*m]>"
    )
    assert f.operations.total > 0
    assert f.units == {"qdot": None, "udot": None, "multipliers": None}
    assert mbs.function(arm(), "state_derivative").units["udot"] == ("m/s^2", "rad/s^2", "rad/s^2")


def test_solvers_take_the_ode_with_its_jacobian(system: mbs.System) -> None:
    from scipy.integrate import solve_ivp

    f = mbs.function(system, "state_derivative")
    rhs = f.ode()
    _, q, u = state(f)
    x = np.concatenate([q, u])
    balls = [list(places) for body in mbs.mechanism(f.system).bodies for places in body.quaternions]

    def of_directions(there: np.ndarray) -> np.ndarray:
        there = there.copy()
        for places in balls:
            there[places] /= np.linalg.norm(there[places])
        return rhs(0.3, there)

    if balls:
        x[balls[0]] *= 1.3
    for k, way in enumerate(np.eye(len(x))):
        (limit,) = differences(lambda size, way=way: [of_directions(x + size * way)])
        np.testing.assert_allclose(rhs.jac(0.3, x)[:, k], limit, atol=1e-8 * max(1.0, np.abs(limit).max()))
    run = solve_ivp(rhs, (0, 0.1), np.concatenate([q, u]), method="Radau", jac=rhs.jac, rtol=1e-9, atol=1e-10)
    other = solve_ivp(rhs, (0, 0.1), np.concatenate([q, u]), rtol=1e-10, atol=1e-11)
    assert run.success
    np.testing.assert_allclose(run.y[:, -1], other.y[:, -1], atol=1e-6)


def test_products_with_derivatives(system: mbs.System) -> None:
    f = mbs.function(system, "state_derivative")
    given = state(f)
    rng, count = np.random.default_rng(3), len(given[2])
    dq, du, weights = rng.standard_normal((3, count))
    forward = f.jvp(*given, rates={"q": dq, "u": du, "t": 1.0})
    by_q, by_u, by_t = (f.derivative(by)(*given) for by in ("q", "u", "t"))
    np.testing.assert_allclose(forward.udot, by_q.udot @ dq + by_u.udot @ du + by_t.udot[:, 0], atol=1e-12)
    back = f.vjp(*given, by="q", weights={"udot": weights})
    np.testing.assert_allclose(back @ dq, weights @ (by_q.udot @ dq), atol=1e-11 * max(1.0, np.abs(back).max()))
    with pytest.raises(mbs.InputError, match=r"rates\['q'\] has the shape"):
        f.jvp(*given, rates={"q": np.zeros(count + 1)})
    with pytest.raises(mbs.InputError, match=r"weights\['udot'\] has the shape"):
        f.vjp(*given, by="q", weights={"udot": 1.0})


@pytest.mark.parametrize("many", [1, 3, 5])
def test_products_for_many_states_are_those_of_each(many: int) -> None:
    f, M = (mbs.function(arm(), what) for what in ("state_derivative", "mass_matrix"))
    rng = np.random.default_rng(4)
    q, u, dq, w = rng.standard_normal((4, many, 3))
    W = rng.standard_normal((many, 3, 3))
    forward, back = f.jvp(0.0, q, u, rates={"q": dq}), f.vjp(0.0, q, u, by="q", weights={"udot": w})
    of_matrix = M.vjp(0.0, q, u, by="q", weights=W)
    assert (forward.udot.shape, back.shape, of_matrix.shape) == ((many, 3),) * 3
    for k in range(many):
        alone = f.jvp(0.0, q[k], u[k], rates={"q": dq[k]})
        np.testing.assert_allclose(forward.udot[k], alone.udot, atol=1e-12)
        np.testing.assert_allclose(back[k], f.vjp(0.0, q[k], u[k], by="q", weights={"udot": w[k]}), atol=1e-11)
        np.testing.assert_allclose(of_matrix[k], M.vjp(0.0, q[k], u[k], by="q", weights=W[k]), atol=1e-12)


def test_nothing_of_the_caller_is_changed() -> None:
    rhs = mbs.function(mbs.loads(BALL), "state_derivative").ode()
    x = np.zeros(15)
    x[3] = 2.0
    x.setflags(write=False)
    rhs.jac(0.0, x)
    np.testing.assert_array_equal(rhs(0.0, x), rhs(0.0, np.where(np.arange(15) == 3, 1.0, x)))
    f = mbs.function(arm(), "mass_matrix")
    _, q, u = state(f)
    out = np.zeros((3, 3))
    out.setflags(write=False)
    with pytest.raises(mbs.InputError, match="may be written to"):
        f(0.0, q, u, out=out)
    whole = np.zeros((5, 3))
    with pytest.raises(mbs.InputError, match="share memory"):
        mbs.function(arm(), "bias")(0.0, np.tile(q, (4, 1)), whole[:4], out=whole[1:])


def test_results_are_pickled_by_their_names() -> None:
    found = mbs.function(arm(), "energies")(*state(mbs.function(arm(), "energies")))
    again = pickle.loads(pickle.dumps(found))
    assert again == found
    assert again.kinetic == found.kinetic


@pytest.mark.parametrize("what", ["state_derivative", "inverse_dynamics", "energies"])
def test_results_come_together_with_their_derivatives(what: Any) -> None:
    f = mbs.function(mbs.loads(BALL), what)
    given, name = state(f), f.names[-2:][0]
    by = ("q", "u", *(["udot"] if "udot" in f.arguments else []))
    g = f.with_derivatives(*by, of=name)
    assert g.names == (name, *(f"{name}_by_{x}" for x in by))
    alone = [f, *(f.derivative(x) for x in by)]
    for found, one in zip(parts(g(*given)), alone, strict=True):
        wanted = dict(zip(one.names, parts(one(*given)), strict=True))[name]
        np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-12 * max(1.0, np.abs(wanted).max()))
    beside = f.derivative(*by)
    for k, together in enumerate(parts(beside(*given))):
        np.testing.assert_array_equal(together, np.concatenate([parts(one(*given))[k] for one in alone[1:]], axis=-1))
    slow = mbs.function(f.system, what, backend="python").with_derivatives(*by, of=name)
    for quick, plain in zip(parts(g(*given)), parts(slow(*given)), strict=True):
        np.testing.assert_array_equal(quick, plain)
    again = pickle.loads(pickle.dumps(g))
    assert (again.name, again.names, again.units) == (g.name, g.names, g.units)
    with pytest.raises(mbs.InputError, match="returns no speed"):
        f.with_derivatives("q", of="speed")
    with pytest.raises(mbs.InputError, match="each result once"):
        f.with_derivatives("q", "q")
    with pytest.raises(mbs.InputError, match="by variables, each once"):
        f.derivative("q", "q")
    with pytest.raises(mbs.InputError, match="no function of"):
        f.with_derivatives("force")  # type: ignore[arg-type]


def test_third_derivatives_are_functions(system: mbs.System) -> None:
    f = mbs.function(system, "state_derivative")
    second = f.derivative("u").derivative("u")
    third = second.derivative("u")
    given = state(f)
    way = np.eye(len(given[2]))[0]
    (limit,) = differences(lambda size: [second(*given[:2], given[2] + size * way).udot])
    found = third(*given).udot[..., 0]
    np.testing.assert_allclose(found, limit, atol=1e-7 * max(1.0, np.abs(found).max()))


def test_parameters_are_those_that_are_declared() -> None:
    f = mbs.function(mbs.loads(FOUR_BAR.replace("gravity: [0, -9.81, 0]", GIVEN)), "state_derivative")
    assert f.parameters == ("g", "half")
    np.testing.assert_array_equal(f.parameter_values, [9.81, 4.905])
    t, q, u = state(f)
    np.testing.assert_array_equal(f(t, q, u, parameters=f.parameter_values).udot, f(t, q, u).udot)
    many = f(t, q, u, parameters=np.array([[9.81, 4.905], [5.0, 2.5]])).udot
    np.testing.assert_array_equal(many[1], f(t, q, u, parameters={"g": 5.0}).udot)
    masses = mbs.function(arm(), "mass_matrix")
    with pytest.raises(mbs.ModelError, match="mass"):
        masses(*state(masses), parameters=[[-1.0, 30.0, 10.0]])


GIVEN = "gravity: [0, -g, 0]\nparameters: {g: 9.81, half: g/2}"


def test_what_no_function_has_is_told() -> None:
    with pytest.raises(mbs.ModelError, match="declares no outputs"):
        mbs.function(mbs.loads(BALL), "outputs")
    mass = "{mass: 0.5, com: [0, 0.2, 0], inertia: {Ixx: 0.01, Iyy: 0.002, Izz: 0.01}}"
    massless = BALL.replace(mass, "{}")
    with pytest.raises(mbs.NoSolutionError, match="hinge"):
        mbs.function(mbs.loads(massless), "state_derivative")
    driven = ARM.replace("axis: x, q: x}", "axis: x, motion: push}").replace("-2*x - u_x", "sin(t)")
    driven = driven.replace("  drive: {type: force, on: cart, value: [push, 0, 0]}\n", "")
    with pytest.raises(mbs.InputError, match="drives a motion"):
        mbs.function(mbs.loads(driven), "energies").derivative("inputs")


def test_units_of_outputs_are_those_of_their_expressions() -> None:
    system = mbs.loads(ARM.replace('{height: "position(lower.tip, y)"}', '{momentum: "position(lower.tip, y)"}'))
    assert mbs.function(system, "outputs").units == {"momentum": "m"}


def test_functions_without_forces_do_not_ask_what_touches() -> None:
    box = BOX.format(contacts="contacts: {touch: {between: [box.corner, ground.floor], static: 0.5}}")
    touching, free = mbs.loads(box), mbs.loads(BOX.format(contacts=""))
    for what in ("mass_matrix", "bias", "energies", "momentum"):
        f, g = (mbs.function(each, what) for each in (touching, free))
        for one, other in zip(parts(f(*state(f))), parts(g(*state(f))), strict=True):
            np.testing.assert_array_equal(one, other)


BOX = """
multibody_sym: 1
name: box
gravity: [0, -9.81, 0]
bodies:
  ground: {{surfaces: {{floor: {{plane: [0, 0, 0], normal: y}}}}}}
  box: {{mass: 1, com: [0.1, 0, 0], inertia: {{Izz: 1}}, points: {{corner: [0, -1, 0]}}}}
joints: {{free: {{type: planar, parent: ground, child: box, initial: {{q: [0, 2, 0]}}}}}}
{contacts}
"""


def test_zeros_by_construction_are_no_part_of_the_sparsity() -> None:
    f = mbs.function(arm(), "mass_matrix").derivative("q")
    rows, columns, ways = f.sparsity["mass_matrix"]
    assert 0 not in ways  # the mass matrix does not depend on where the cart is
    found = f(*state(f))
    dense = np.zeros_like(found)
    dense[rows, columns, ways] = found[rows, columns, ways]
    np.testing.assert_array_equal(dense, found)


def test_errors_of_expressions_name_their_place_and_text() -> None:
    for wrong, match in {
        "2*y": r"^expression 2, '2\*y': 'y' is not declared",
        "position(lower.tap, y)": r"^expression 2, .*'lower.tap' is no point; did you mean lower.tip",
        "x +": r"^expression 2, 'x \+': something is missing",
    }.items():
        with pytest.raises(mbs.InputError, match=match):
            mbs.function(arm(), ["x", wrong])


def test_a_centre_of_mass_is_a_frame() -> None:
    frame, both = (
        mbs.function(arm(), "frame", frame="lower.com"),
        mbs.function(arm(), [f"{what}(lower.com, {axis})" for what in ("position", "velocity") for axis in "xy"]),
    )
    given = state(frame)
    found = mbs.function(arm(), "frame", frame="lower.com", axes="local_world_aligned")(*given)
    np.testing.assert_allclose([*found.position[:2], *found.velocity[:2]], both(*given), atol=1e-14)
    with pytest.raises(mbs.InputError, match=r"no frame 'ground.com'"):
        mbs.function(arm(), "frame", frame="ground.com")


def test_a_parameter_by_name_may_have_many_values() -> None:
    f = mbs.function(arm(), "state_derivative")
    given = state(f)
    many = f(*given, parameters={"m": [0.7, 1.0, 0.7], "k": 20.0}).udot
    for n, m in enumerate((0.7, 1.0, 0.7)):
        np.testing.assert_array_equal(many[n], f(*given, parameters={"m": m, "k": 20.0}).udot)
    with pytest.raises(mbs.ModelError, match="mass of upper is -1 kg"):
        f(*given, parameters={"m": [0.7, -1.0]})
    with pytest.raises(mbs.InputError, match="different numbers of states"):
        f(*given, parameters={"m": [0.7, 1.0], "k": [1.0, 2.0, 3.0]})


@pytest.mark.parametrize("backend", ["c", "python"])
def test_states_without_an_answer_are_found(backend: Any) -> None:
    f = mbs.function(arm(), "state_derivative", backend=backend)
    t, q, u = state(f)
    many = np.stack([q, q + np.nan, q])
    found = f(t, many, u)
    np.testing.assert_array_equal(f.failed(found), [False, True, False])
    np.testing.assert_array_equal(found.udot[2], f(t, q, u).udot)
    assert not f.failed(f(t, q, u))
    with pytest.raises(mbs.InputError, match="no results of state_derivative"):
        f.failed((1.0, 2.0, 3.0))


def test_operational_space_inertia_is_that_of_the_jacobian() -> None:
    """A free body with a hinged rod: (J M^-1 J^T)^-1, of the body alone its own mass where the rod is light."""
    system = mbs.loads(BALL)
    f = mbs.function(system, "operational_space", frame="rod.com", axes="local_world_aligned")
    given = state(f)
    J = mbs.function(system, "jacobian", frame="rod.com", axes="local_world_aligned")(*given).jacobian
    mobility = J @ np.linalg.solve(mbs.function(system, "mass_matrix")(*given), J.T)
    found = f(*given)
    np.testing.assert_allclose(found.mobility, mobility, rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(found.inertia @ mobility, np.eye(6), atol=1e-10)


@pytest.mark.parametrize("tool", ["casadi", "jax"])
def test_a_tool_that_is_not_installed_is_an_error_with_its_extra(tool: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, tool, None)
    f = mbs.function(mbs.loads(ARM), "energies")
    with pytest.raises(MissingPackageError, match=rf"pip install 'multibody-sym\[{tool}\]'"):
        getattr(f, f"to_{tool}")()
