"""Linearisation: matrices by hand, and finite differences of the rates along the constraints' surface."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from mechanisms import random_case, random_state
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import multibody_sym as mbs
from multibody_sym.analysis.deviations import DeviationFlow
from multibody_sym.analysis.linearize import period_multipliers
from multibody_sym.dynamics.closing import ConstraintRows, closed_near
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import motion_of, state_of
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.scalars.vectors import conjugate, quaternion_product

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_cart_pole_upright_by_hand() -> None:
    M, m, l, g = 1.0, 0.2, 1.0, 9.81
    text = (EXAMPLES / "cart_pole.yaml").read_text().replace("95 deg", "90 deg").replace("F: 2 N", "F: 0 N")
    found = mbs.linearize(mbs.loads(text))
    # (M + m) x'' - m l/2 theta'' = w, -m l/2 x'' + m l^2/3 theta'' = m g l/2 theta, theta from upright
    inverse = np.linalg.inv([[M + m, -m * l / 2], [-m * l / 2, m * l**2 / 3]])
    assert found.states == ("x", "theta", "u_x", "u_theta")
    assert found.inputs == ("push",)
    assert found.A[:2] == pytest.approx(np.eye(4)[2:])
    assert found.A[2:, 1] == pytest.approx(inverse[:, 1] * m * g * l / 2)
    assert np.abs(found.A[2:, [0, 2, 3]]).max() < 1e-12
    assert found.B[:, 0] == pytest.approx([0, 0, *inverse[:, 0]])
    assert found.accelerations == pytest.approx({"u_x": 0.0, "u_theta": 0.0}, abs=1e-12)


def pendulum(damping: float) -> mbs.System:
    return mbs.System(
        "pendulum",
        gravity=[0, -9.81, 0],
        bodies={"bob": mbs.Body(mass=2, com=[0, -0.5, 0])},
        joints={"hinge": mbs.Revolute("ground", "bob", q="theta")},
        forces={"bearing": mbs.Damper(damping, joint="hinge")},
    )


def test_damped_pendulum_has_the_roots_of_its_quadratic() -> None:
    """2 l^2 theta'' + c theta' + 2 g l theta = 0."""
    found = mbs.linearize(pendulum(0.3))
    roots = np.roots([2 * 0.25, 0.3, 2 * 9.81 * 0.5])
    assert sorted(found.eigenvalues, key=np.imag) == pytest.approx(sorted(roots, key=np.imag), rel=1e-12)
    assert found.eigenvalues.tolist() == [complex(*pair) for pair in found.as_json()["eigenvalues"]]


def test_a_loop_is_linearised_in_what_is_marked_known() -> None:
    at_rest = (EXAMPLES / "three_cranks.yaml").read_text().replace("u: 1", "u: 0")
    found = mbs.linearize(mbs.loads(at_rest))
    assert found.states[0] == "phi"
    assert len(found.states) == 2


@pytest.mark.parametrize("seed", [40, 42, 43, 45, 46, 47, 50, 51, 52, 53])
def test_random_mechanisms_with_rows_against_finite_differences(seed: int) -> None:
    """dz/dt beside a state, on the constraints: z is moved along X, put back onto them, and the flow compared."""
    case = random_case(seed, bodies=(1, 3), rows=True)
    _, guess, _ = random_state(np.random.default_rng(seed), case)
    rows = ConstraintRows(case.mechanism, case.parameters, range(len(case.mechanism.rows)))
    q = closed_near(rows, np.array(guess))
    assert q is not None, "choose a seed with a closed position near its random one"
    u = admissible(case, q, np.zeros(len(case.mechanism.speeds)))
    flow = DeviationFlow(case.mechanism, case.parameters)
    found, tangents = flow.linearized(q, u), flow.tangents(q, u)
    step = 1e-5
    for column, direction in zip(found.A.T, tangents.X.T, strict=True):
        ahead, behind = (rates_of_deviations(flow, q, u, sign * step * direction) for sign in (1, -1))
        slope = ((ahead - behind) / (2 * step))[tangents.places]
        size = max(1.0, float(np.abs(column).max()))
        assert slope == pytest.approx(column, rel=1e-5, abs=1e-5 * size)
    size = len(u)
    z = tangents.X @ np.full(len(tangents.places), 1e-6)
    beside = displaced(case.mechanism, q, z[:size])
    residual = restricted(case, beside, u + z[size:]) - restricted(case, q, u)
    assert np.abs(residual).max() < 1e-9 * max(1.0, float(np.abs(tangents.X).max()) ** 2)


def displaced(mechanism: Mechanism, q: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """Return q with every attitude turned by the rotation vector that sigma holds in its place."""
    found = q.copy()
    for body in mechanism.bodies:
        for i, k in body.rate_pairs:
            found[i] += sigma[k]
        for places in map(list, body.quaternions):
            turn = Rotation.from_quat(q[places], scalar_first=True) * Rotation.from_rotvec(sigma[list(body.u[-3:])])
            found[places] = turn.as_quat(scalar_first=True)
            found[places] *= np.sign(found[places] @ q[places])
    return found


def rates_of_deviations(flow: DeviationFlow, q: np.ndarray, u: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Return z' beside a motion: of attitudes by the rates of quaternions, theta = 2 vec(q0^* q) where it is small."""
    size = len(u)
    beside, fast = displaced(flow.mechanism, q, z[:size]), u + z[size:]
    rates, there = (flow.rates(flow.known(*state)) for state in ((q, u), (beside, fast)))
    found = np.concatenate([np.zeros(size), there[1] - rates[1]])
    for body in flow.mechanism.bodies:
        for i, k in body.rate_pairs:
            found[k] = (there[0] - rates[0])[i]
        for k in map(list, body.quaternions):
            turning = quaternion_product(conjugate(rates[0][k]), beside[k]), quaternion_product(
                conjugate(q[k]), there[0][k]
            )
            found[list(body.u[-3:])] = 2.0 * (np.array(turning[0][1:]) + np.array(turning[1][1:]))
    return found


def admissible(case, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Return the speeds nearest to u that the rows allow."""
    moving = row_motions(motion_of(case.mechanism, state_of(case.mechanism, float, 0.0, q, u, case.parameters)))
    jacobian = np.array([row.jacobian for row in moving], dtype=float)
    return u - np.linalg.lstsq(jacobian, np.array([row.phidot for row in moving], dtype=float), rcond=None)[0]


def restricted(case, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    moving = row_motions(motion_of(case.mechanism, state_of(case.mechanism, float, 0.0, q, u, case.parameters)))
    return np.array([*(r.phi for r in moving if r.holonomic), *(r.phidot for r in moving)], dtype=float)


def test_the_states_of_a_loop_are_a_coordinate_and_its_own_speed() -> None:
    """A governor that turns steadily: two arms in a plane carry a sleeve, and xi' is u in the first row of A."""
    system = mbs.loads("""
multibody_sym: 1
name: governor
gravity: [0, 0, -9.81]
bodies:
  spindle: {}
  arm: {points: {e: [0, 0, -0.4]}}
  ball: {mass: 1.5}
  rod: {points: {e: [0, 0, -0.4]}}
  sleeve: {mass: 2}
joints:
  S: {type: revolute, parent: ground, child: spindle, axis: z, motion: 12*t}
  A: {type: revolute, parent: spindle, child: arm, axis: y, q: th, initial: {q: -0.8963318164379938, known: true}}
  F: {type: fixed, parent: arm.e, child: ball}
  B: {type: revolute, parent: arm.e, child: rod, axis: y, q: ps, initial: {q: 2}}
  D: {type: prismatic, parent: spindle, child: sleeve, axis: z, q: z, initial: {q: -0.5}}
  C: {type: revolute, parent: rod.e, child: sleeve, axis: y, cut: true}
simulation: {t_end: 3, coordinates: absolute}
""")
    found = mbs.linearize(system)
    assert found.states == ("th", "u_th")
    assert found.A[0] == pytest.approx([0, 1])
    assert max(map(abs, found.accelerations.values())) < 1e-9


# --- steady motions --------------------------------------------------------------------------------------------------

M, L, ACROSS, ALONG = 0.3, 0.04, 3e-4, 2e-4
J1 = ACROSS + M * L**2
SLOWEST = 2 * np.sqrt(M * 9.81 * L * J1) / ALONG


def top(spin: float, *, angles: str | None = None, tilt: float = 0.0, precession: float = 0.0) -> mbs.System:
    """Lagrange's top on its tip; `spin` about its axis (the vertical part of the precession included)."""
    if angles is None:
        initial = {
            "q": [np.cos(tilt / 2), np.sin(tilt / 2), 0, 0],
            "u": [0, precession * np.sin(tilt), spin],
        }
    else:
        rates = [precession, 0, spin - precession * np.cos(tilt)] if angles == "zxz" else [0, 0, spin]
        initial = {"q": [0, tilt, 0], "u": rates}
    return mbs.System(
        "top",
        gravity=[0, 0, -9.81],
        bodies={"top": mbs.Body(mass=M, com=[0, 0, L], inertia={"Ixx": ACROSS, "Iyy": ACROSS, "Izz": ALONG})},
        joints={"tip": mbs.Spherical("ground", "top", angles=angles, initial=initial)},
        outputs={"height": "position(top, z)"},
    )


@pytest.mark.parametrize("angles", [None, "xyz"])
def test_a_top_stands_upright_from_the_spin_that_its_quadratic_asks_for(angles: str | None) -> None:
    """Upright: J1 w^2 - J3 spin w + m g l = 0 has real roots from spin = 2 sqrt(m g l J1)/J3."""
    low, high = 0.99 * SLOWEST, 1.02 * SLOWEST
    while high - low > 5e-7 * SLOWEST:
        middle = (low + high) / 2
        falls = mbs.linearize(top(middle, angles=angles)).eigenvalues.real.max() > 0.0
        low, high = (middle, high) if falls else (low, middle)
    assert low == pytest.approx(SLOWEST, rel=1e-6)
    assert high == pytest.approx(SLOWEST, rel=1e-6)


def test_runs_of_the_top_fall_and_stand_on_either_side_of_the_limit() -> None:
    falling, standing = (
        np.degrees(np.arccos(mbs.simulate(top(part * SLOWEST, tilt=1e-3), t_end=3, samples=301)["height"].min() / L))
        for part in (0.97, 1.03)
    )
    assert falling > 10.0
    assert standing < 0.5


def test_a_tilted_precession_is_steady_in_three_angles_and_nutates_as_its_potential_says() -> None:
    """J1 theta'' = -dV/dtheta with the momenta about the vertical and about the axis constant."""
    tilt, precession = np.radians(30), 4.0
    spin = (M * 9.81 * L + J1 * precession**2 * np.cos(tilt)) / (ALONG * precession)
    about_axis = ALONG * spin
    vertical = J1 * precession * np.sin(tilt) ** 2 + about_axis * np.cos(tilt)

    def potential(theta: float) -> float:
        across = (vertical - about_axis * np.cos(theta)) / np.sin(theta)
        return float(across**2 / (2 * J1) + M * 9.81 * L * np.cos(theta))

    h = 1e-3
    curvature = (potential(tilt + h) - 2 * potential(tilt) + potential(tilt - h)) / h**2
    found = mbs.linearize(top(spin, angles="zxz", tilt=tilt, precession=precession))
    assert found.steady
    moving = found.eigenvalues[np.abs(found.eigenvalues) > 1e-3]
    assert np.abs(moving.imag) == pytest.approx([np.sqrt(curvature / J1)] * 2, rel=1e-4)
    assert moving.real.tolist() == [0.0, 0.0]
    refused = r"attitude of joint tip .* in three angles it is: declare `angles: zxz`"
    with pytest.raises(mbs.NoSolutionError, match=refused):
        mbs.linearize(top(spin, tilt=tilt, precession=precession))


def test_attitudes_deviate_by_rotation_vectors() -> None:
    found = mbs.linearize(top(40))
    assert found.states == ("tip.rx", "tip.ry", "tip.rz", "tip_wx", "tip_wy", "tip_wz")
    assert found.A[:3, :3].tolist() == [[0, 40, 0], [-40, 0, 0], [0, 0, 0]]
    assert found.A[:3, 3:].tolist() == np.eye(3).tolist()
    assert found.eigenvalues.real.max() == pytest.approx(
        mbs.linearize(top(40, angles="xyz")).eigenvalues.real.max(), rel=1e-12
    )


def swinging(speed: float, angle: float = 0.0) -> mbs.System:
    return mbs.System(
        "swinging",
        gravity=[0, -9.81, 0],
        bodies={"bob": mbs.Body(mass=2, com=[0, -0.5, 0])},
        joints={"hinge": mbs.Revolute("ground", "bob", q="theta", initial={"q": angle, "u": speed})},
    )


def test_a_pendulum_that_passes_its_lowest_point_is_not_steady() -> None:
    with pytest.raises(mbs.NoSolutionError, match=r"no steady motion: A depends on what moves: theta \(3 rad/s\)"):
        mbs.linearize(swinging(3.0))


def test_a_pendulum_that_is_let_go_has_a_matrix_and_no_eigenvalues() -> None:
    found = mbs.linearize(swinging(0.0, 1.0))
    assert not found.steady
    assert found.A[1, 0] == pytest.approx(-9.81 / 0.5 * np.cos(1.0))
    assert found.as_json()["eigenvalues"] == []
    with pytest.raises(mbs.NoSolutionError, match="A changes as soon as it is let go"):
        _ = found.eigenvalues


def test_numbers_of_a_start_that_miss_an_equilibrium_by_their_last_digits_will_do() -> None:
    assert mbs.linearize(swinging(0.0, 3.1415927)).eigenvalues.real == pytest.approx(np.array([1, -1]) * 19.62**0.5)


def test_a_fall_is_no_equilibrium_but_its_matrix_is_constant() -> None:
    falling = mbs.System(
        "stone",
        gravity=[0, -9.81, 0],
        bodies={"stone": mbs.Body(mass=1)},
        joints={"fall": mbs.Prismatic("ground", "stone", axis="y")},
    )
    found = mbs.linearize(falling)
    assert found.steady
    assert found.A.tolist() == [[0, 1], [0, 0]]
    assert found.eigenvalues.tolist() == [0, 0]


def test_a_coin_that_rolls_in_a_circle_is_steady_but_for_where_it_is() -> None:
    found = mbs.linearize(mbs.load(EXAMPLES / "rolling_coin.yaml"))
    assert found.left_out == ("x", "y")
    assert found.states == ("heading", "lean", "roll", "u_heading", "u_lean", "u_roll")
    assert Counter(np.abs(found.eigenvalues.real).tolist()) == {0.0: 6}


def stiffened(speed: float, angle: float) -> mbs.System:
    """Two pendulums as one: a spring between them holds them in line, 30,000 times faster than they swing."""
    return mbs.System(
        "stiffened",
        gravity=[0, -9.81, 0],
        bodies={name: mbs.Body(mass=1, com=[0, -1, 0], points={"e": [0, -1, 0]}) for name in ("upper", "lower")},
        joints={
            "A": mbs.Revolute("ground", "upper", q="a", initial={"q": angle, "u": speed}),
            "B": mbs.Revolute("upper.e", "lower", q="b"),
        },
        forces={"line": mbs.SpringDamper(1e9, joint="B")},
    )


def test_what_is_slow_beside_a_stiff_spring_is_looked_at_too() -> None:
    with pytest.raises(mbs.NoSolutionError, match=r"A depends on what moves: a \(0.01 rad/s\)"):
        mbs.linearize(stiffened(0.01, 0.0))
    assert not mbs.linearize(stiffened(0.0, 0.5)).steady
    slow = min(abs(mbs.linearize(stiffened(0.0, 0.0)).eigenvalues))
    assert slow == pytest.approx(np.sqrt(9.81 * 3 / 5), rel=1e-6)  # m g (1 + 2) / (m (1 + 4))


def test_steady_motions_with_known_frequencies() -> None:
    """A conical pendulum: W sqrt(1 + 3 cos^2); one on a turntable: sqrt(g/l) +- W; a body about its middle axis."""
    tilt, W = np.radians(50), np.sqrt(9.81 / np.cos(np.radians(50)))
    bob = mbs.Body(mass=1, com=[0, 0, -1])
    conical = {
        "p": mbs.Revolute("ground", "a", axis="z", q="phi", initial={"u": W}),
        "h": mbs.Revolute("a", "b", axis="y", q="theta", initial={"q": tilt}),
    }
    down = [0, 0, -9.81]
    found = mbs.linearize(mbs.System("c", gravity=down, bodies={"a": mbs.Body(), "b": bob}, joints=conical))
    assert abs(found.eigenvalues).max() == pytest.approx(W * np.sqrt(1 + 3 * np.cos(tilt) ** 2), rel=1e-12)
    turning = mbs.Body(motion=mbs.GroundMotion(turn=[mbs.Turn("z", "0.7*t")]))
    bodies = {"ground": turning, "b": bob}
    found = mbs.linearize(mbs.System("f", gravity=down, bodies=bodies, joints={"U": mbs.Universal("ground", "b")}))
    expected = [9.81**0.5 + 0.7] * 2 + [9.81**0.5 - 0.7] * 2
    assert sorted(abs(found.eigenvalues), reverse=True) == pytest.approx(expected, rel=1e-12)
    body = mbs.Body(mass=1, inertia={"Ixx": 1, "Iyy": 2, "Izz": 3})
    spun = {"S": mbs.Spherical("ground", "b", initial={"u": [0, 5, 0]})}
    found = mbs.linearize(mbs.System("s", bodies={"b": body}, joints=spun))
    assert found.eigenvalues.real.max() == pytest.approx(5 * np.sqrt(1 / 3), rel=1e-12)


# --- periodic motions ------------------------------------------------------------------------------------------------


def test_a_precession_seen_in_body_axes_has_the_multipliers_of_its_eigenvalues_in_angles() -> None:
    """After one turn about its axis, seen from the plane of the tilt, deviations are alike: exp(lambda T)."""
    tilt, precession = np.radians(30), 4.0
    spin = (M * 9.81 * L + J1 * precession**2 * np.cos(tilt)) / (ALONG * precession)
    period = 2 * np.pi / (spin - precession * np.cos(tilt))
    found = period_multipliers(top(spin, tilt=tilt, precession=precession), period)
    steady = mbs.linearize(top(spin, angles="zxz", tilt=tilt, precession=precession)).eigenvalues
    nutating = np.exp(steady[np.abs(steady) > 1e-3] * period)
    others = [x for x in found.multipliers if abs(x - 1) > 1e-3]
    assert sorted(others, key=np.imag) == pytest.approx(sorted(nutating, key=np.imag), abs=1e-6)
    assert len(found.multipliers) == 6


def test_a_shaken_pendulum_has_the_multipliers_of_its_hill_equation() -> None:
    """Upside down: l theta'' = (g + y'') theta with y = a cos(W t), integrated by scipy."""
    g, length, a, W = 9.81, 0.5, 0.05, 100.0
    shaken = mbs.loads(f"""
multibody_sym: 1
name: shaken
gravity: [0, -{g}, 0]
bodies: {{carriage: {{}}, bob: {{mass: 1, com: [0, {length}, 0]}}}}
joints:
  drive: {{type: prismatic, parent: ground, child: carriage, axis: y, motion: {a}*cos({W}*t)}}
  hinge: {{type: revolute, parent: carriage, child: bob, axis: z, q: theta}}
""")
    period = 2 * np.pi / W
    found = period_multipliers(shaken, period)

    def hill(t: float, y: np.ndarray) -> np.ndarray:
        stiffness = (g - a * W**2 * np.cos(W * t)) / length
        return np.concatenate([y[2:], stiffness * y[:2]])

    whole = solve_ivp(hill, (0, period), [1, 0, 0, 1], rtol=1e-11, atol=1e-12).y[:, -1].reshape(2, 2)
    expected = np.linalg.eigvals(whole)
    assert sorted(found.multipliers, key=np.imag) == pytest.approx(sorted(expected, key=np.imag), abs=1e-7)
    assert np.abs(found.multipliers) == pytest.approx([1, 1], abs=1e-7)  # fast shaking holds it upright
    with pytest.raises(mbs.NoSolutionError, match=r"does not repeat itself after 0\.03 s"):
        period_multipliers(shaken, 0.03)


def one_sided(value: str) -> mbs.System:
    """Return a pendulum that hangs, with a torque."""
    swinging = pendulum(0.0)
    forces = {"smooth": mbs.Damper(0.3, joint="hinge"), "f": mbs.Torque(value, joint="hinge")}
    return mbs.System(
        "one_sided", gravity=swinging.gravity, bodies=swinging.bodies, joints=swinging.joints, forces=forces
    )


def test_a_force_without_a_derivative_at_the_start_leaves_no_matrix() -> None:
    """d sqrt(-x)/dx = -1/(2 sqrt(-x)) passes all bounds at 0."""
    for ask in (mbs.linearize, lambda system: period_multipliers(system, 1.0)):
        with pytest.raises(
            mbs.NoSolutionError, match="A has no finite value in this state: f has no derivative"
        ) as caught:
            ask(one_sided("sqrt(0-theta)"))
        assert caught.value.where.path == ("forces", "f")


def test_states_beside_the_start_without_a_value_hide_no_matrix() -> None:
    """d (-x)^(3/2)/dx is 0 at 0, and not real beyond: 2 l^2 theta'' + c theta' + 2 g l theta = 0 is left."""
    found = mbs.linearize(one_sided("(0-theta)**1.5"))
    assert found.A[1] == pytest.approx([-9.81 / 0.5, -0.3 / (2 * 0.25)], rel=1e-12)
