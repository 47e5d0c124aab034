"""Painleve's rod slides where no force holds it: what its friction does then is an impact, though nothing closes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import multibody_sym as mbs
from multibody_sym.dynamics.contact.contact_problem import Scale
from multibody_sym.motion.runs.run import FailedRunError
from multibody_sym.motion.switching.decision import next_state
from multibody_sym.motion.switching.law_values import LawValues

ROD = """
multibody_sym: 1
name: rod
gravity: [0, -9.81, 0]
parameters: {mu: 2, e: 0.4}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  rod: {mass: 1, inertia: {Izz: 1/3, Ixx: 1/3, Iyy: 1/3}, points: {tip: [-1, 0, 0]}}
joints:
  free: {type: planar, parent: ground, child: rod, q: [x, y, th], initial: {q: [0, 2, 1.3], u: [-8, 0, 0]}}
contacts:
  c: {between: [rod.tip, ground.floor], static: mu, kinetic: mu, restitution: e, open: true}
simulation: {t_end: 1e-3, samples: 2}
"""


@pytest.fixture(scope="module")
def sliding() -> LawValues:
    return slides(0.4)


def slides(restitution: float | None) -> LawValues:
    """Return the rod with its tip on the floor, where K_nn - mu K_nt, the inverse of its apparent mass, is negative."""
    given = mbs.loads(ROD if restitution is not None else ROD.replace("restitution: e, ", ""))
    run = mbs.simulate(given, parameters={"e": restitution or 0.0})
    assert run.modes is not None
    q, u = np.array([0.0, math.sin(1.3), 1.3]), np.array([-8.0, 0.0, 0.0])
    return run.modes.switches.laws.at(0.0, q, u, Scale(1.0, 8.0))


def routh(e: float = 0.4) -> tuple[np.ndarray, np.ndarray]:
    """Return the impulses (p_n, p_t) of the rod and its speeds after them."""
    c, s = math.cos(1.3), math.sin(1.3)
    K = np.array([[1 + 3 * c * c, -3 * s * c], [-3 * s * c, 1 + 3 * s * s]])
    assert K[0, 0] + 2 * K[0, 1] < 0.0
    compressed = np.linalg.solve(K, [0.0, 8.0])
    p = compressed + e * compressed[0] * np.array([1.0, -K[0, 1] / K[1, 1]])
    assert abs(p[1]) < 2 * p[0]
    return p, np.array([-8 + p[1], p[0], 3 * (s * p[1] - c * p[0])])


def test_its_impulses_stop_the_slip_and_give_back_what_has_been_compressed(sliding: LawValues) -> None:
    """Routh: (p_n, p_t) compress until v_n = v_t = 0; then it sticks while e p_n more is given back."""
    p, u = routh()
    found = next_state(sliding, ["c"])
    assert found.mode is not None
    assert found.mode.sides == {"c": 0}
    np.testing.assert_allclose(found.facts.u, u, rtol=0, atol=1e-7)
    assert found.blow is not None
    assert found.blow.impulses["c"] == pytest.approx(p[0], rel=1e-7)
    energy = [0.5 * (u[0] ** 2 + u[1] ** 2 + u[2] ** 2 / 3) for u in (sliding.u, found.facts.u)]
    assert found.blow.lost["c"] == pytest.approx(energy[0] - energy[1], rel=1e-7)


def test_without_a_restitution_there_is_no_state_and_it_is_proved() -> None:
    found = next_state(slides(None), ["c"])
    assert (found.mode, found.blow) == (None, None)
    assert found.found is not None
    assert found.found.proved
    assert "declare a restitution" in found.why_none.text


def test_with_a_restitution_of_zero_nothing_is_given_back() -> None:
    """Routh: its tip has stopped after the compression, and leaves, as the rod turns with w^2 sin(th) > g."""
    p, u = routh(0.0)
    found = next_state(slides(0.0), ["c"])
    assert found.mode is not None
    assert found.blow is not None
    np.testing.assert_allclose(found.facts.u, u, rtol=0, atol=1e-7)
    assert found.blow.impulses["c"] == pytest.approx(p[0], rel=1e-7)
    assert u[2] ** 2 * math.sin(1.3) > 9.81
    assert found.mode.sides["c"] == 0


@pytest.mark.parametrize("method", ["dormand_prince", "radau_5"])
def test_a_run_may_begin_with_it(method: str) -> None:
    p, u = routh()
    text = ROD.replace("[0, 2, 1.3]", "[0, sin(1.3), 1.3]").replace(", open: true", "")
    system = mbs.loads(text)
    run = mbs.simulate(system, method=method)
    assert run.modes is not None
    assert run.modes.blows[0].rows["c.normal"] == pytest.approx(p[0], rel=1e-7)
    assert run["u_y"][-1] == pytest.approx(u[1] - 9.81e-3, abs=1e-7)
    assert run["u_th"][-1] == pytest.approx(u[2], abs=1e-7)
    assert run.energy_residual == pytest.approx(0.0, abs=1e-12)
    with pytest.raises(mbs.NoSolutionError, match=r"fulfils the laws.*as a restitution is declared, a run begins"):
        mbs.solve(system)
    with pytest.raises(mbs.NoSolutionError, match=r"all 2 modes; where friction jams, declare a restitution"):
        mbs.simulate(mbs.loads(text.replace(", restitution: e", "")))


def test_a_prepared_run_may_begin_with_it_at_another_start() -> None:
    _, u = routh()
    prepared = mbs.prepare(mbs.loads(ROD.replace("[0, 2, 1.3]", "[0, 2*sin(1.3), 1.3]").replace(", open: true", "")))
    run = prepared.run(initial={"y": math.sin(1.3)})
    assert run["u_th"][-1] == pytest.approx(u[2], abs=1e-7)


CRATE = """
multibody_sym: 1
name: crate
gravity: [0, 0, -9.81]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: z}}}
  crate: {shape: {box: [0.455, 0.453, 0.66], mass: 1.03}}
contacts:
  c: {between: [crate, ground.floor], static: 1.5, restitution: REBOUND}
joints:
  free:
    type: free
    parent: ground
    child: crate
    initial: {q: [0, 0, 0.33, 1, 0, 0, 0], u: [-0.748, 0.114, 0, 0, 0, -2.203]}
simulation: {t_end: 0.1}
"""


SIZES, MASS = np.array([0.455, 0.453, 0.66]), 1.03


@dataclass(frozen=True)
class Corner:
    """The lowest corner of the crate at coordinates q, by hand: r from the centre to it, inertia in ground's axes."""

    q: np.ndarray

    @cached_property
    def turned(self) -> np.ndarray:
        w, *axis = self.q[3:]
        return Rotation.from_quat([*axis, w]).as_matrix()

    @cached_property
    def r(self) -> np.ndarray:
        corners = self.turned @ (np.array(list(product((-0.5, 0.5), repeat=3))) * SIZES).T
        return corners[:, np.argmin(corners[2])]

    def velocity(self, u: np.ndarray) -> np.ndarray:
        return u[:3] + np.cross(self.turned @ u[3:], self.r)

    def change(self, impulse: np.ndarray) -> np.ndarray:
        """Return how an impulse on the corner changes the speeds."""
        inertia = np.diag(MASS / 12.0 * (SIZES @ SIZES - SIZES**2))
        return np.concatenate([impulse / MASS, np.linalg.solve(inertia, self.turned.T @ np.cross(self.r, impulse))])

    def pushed(self, u: np.ndarray, mu: float) -> np.ndarray:
        """Return how speeds change with the normal impulse, as the corner slides."""
        x, y, _ = self.velocity(u)
        return self.change(np.array([-mu * x / math.hypot(x, y), -mu * y / math.hypot(x, y), 1.0]))


def test_a_sliding_corner_that_friction_jams_is_named_and_no_constraint_is_blamed() -> None:
    """Its apparent mass grows without bound: (n + r x n) . M^-1 (n - mu v/|v|) is zero there, by hand."""
    why = r"friction jams: the force at c\.corner4\.normal .*Painleve.* all 2 modes .* at t = 0\.00081"
    with pytest.raises(FailedRunError, match=why) as failed:
        mbs.simulate(mbs.loads(CRATE.replace(", restitution: REBOUND", "")))
    end = failed.value.trajectory.integration
    corner, u = Corner(end.q_final), end.u_final
    smooth, rough = (corner.velocity(corner.pushed(u, mu))[2] for mu in (0.0, 1.5))
    assert abs(rough) < 1e-5 * smooth


def test_with_a_restitution_what_jams_strikes_and_no_tolerance_decides_that() -> None:
    """By hand the push, as its impulse P grows, moves the corner into the floor and stops its slip, then it sticks.

    So v_n is zero at P = 0, goes down, is zero again at P_c, and by Poisson the impulse is twice P_c in the end.
    """
    blows = []
    for tolerance in (1e-5, 1e-7):
        run = mbs.simulate(mbs.loads(CRATE.replace("REBOUND", "1")), t_end=0.002, rtol=tolerance, atol=tolerance)
        assert run.modes is not None
        blows.append(run.modes.blows[0])
        assert blows[-1].t == pytest.approx(0.000813679, rel=1e-4)
    assert run.energy_residual == pytest.approx(0.0, abs=1e-4)
    corner = Corner(blows[1].q)

    def slips(impulse: float, u: np.ndarray) -> float:
        return float(np.hypot(*corner.velocity(u)[:2])) - 1e-6

    slips.terminal = True
    slid = solve_ivp(lambda _, u: corner.pushed(u, 1.5), (0.0, 1.0), blows[1].u, rtol=1e-9, atol=1e-11, events=slips)
    until, u = slid.t_events[0][0], slid.y[:, -1]
    moves = np.column_stack([corner.velocity(corner.change(unit)) for unit in np.eye(3)])
    _, _, speed = corner.velocity(u)
    sticks = np.linalg.solve(moves, [0.0, 0.0, 1.0])  # the impulse for a unit of v_n
    compressed = until - speed * sticks[2]
    after = u + corner.change(sticks * (2.0 * compressed - until) / sticks[2])
    assert math.hypot(*sticks[:2]) < 1.5 * sticks[2]
    for blow in blows:
        assert blow.u + blow.jump == pytest.approx(after, abs=1e-4)
        assert blow.rows["c.corner4.normal"] == pytest.approx(2.0 * compressed, rel=1e-4)


def test_a_corner_that_never_slips_and_carries_nothing_beside_its_friction_is_no_jam() -> None:
    """Friction of a coefficient of a million hardly moves what presses at it, and a block at rest stays there."""
    run = mbs.simulate(mbs.loads(WEDGED_BY_PULLS), t_end=0.5, samples=3)
    assert run["x"].tolist() == [0.0] * 3
    assert run["y"].tolist() == [0.0] * 3


WEDGED_BY_PULLS = """
multibody_sym: 1
name: block in a corner
gravity: [0, -9.81, 0]
bodies:
  block: {mass: 10}
  ground:
    surfaces:
      face1: {plane: [0, 0, 0], normal: [0.388855, 0.921299, 0]}
      face2: {plane: [0, 0, 0], normal: [0.921299, -0.388855, 0]}
joints: {j: {type: point, parent: ground, child: block, q: [x, y]}}
forces: {pull: {type: force, on: block, value: [-89.434, 280.382, 0]}}
contacts:
  c1: {between: [block, ground.face1], static: 0.3, kinetic: 0.18, restitution: 0}
  c2: {between: [block, ground.face2], static: enough, restitution: 0}
"""


def test_what_no_impulse_can_move_is_refused_by_name() -> None:
    """A taut rope across the ways of two sliders, of which one falls faster than the other one may."""
    with pytest.raises(mbs.NoSolutionError, match=r"rope: at the start .*all 2 modes$"):
        mbs.simulate(mbs.loads(ACROSS))


ACROSS = """
multibody_sym: 1
name: sliders that a rope joins across
gravity: [0, -9.81, 0]
bodies:
  ground: {points: {p: [1, 0, 0]}}
  a: {mass: 1}
  b: {mass: 1}
joints:
  ja: {type: prismatic, parent: ground, child: a, axis: -y, q: qa, initial: {u: -1}}
  jb: {type: prismatic, parent: ground.p, child: b, axis: -y, q: qb, initial: {u: 0}}
constraints: {rope: {type: rope, path: [a, b], slack: true, restitution: 0.5}}
"""


STOOL = """
multibody_sym: 1
name: stool
gravity: [0, 0, -9.81]
bodies:
  ground:
    surfaces: {slope: {plane: [0, 0, 0], normal: [-sin(0.5), 0, cos(0.5)]}}
    frames: {on: {rotate: [{axis: y, angle: -0.5}]}}
  stool:
    mass: 0.871
    inertia: {Ixx: 0.01742, Iyy: 0.02613, Izz: 0.03484}
    points: {p1: [0.297, 0, -0.381], p2: [-0.1485, 0.2572, -0.381], p3: [-0.1485, -0.2572, -0.381]}
contacts:
  c1: {between: [stool.p1, ground.slope], static: 1.5, restitution: 0}
  c2: {between: [stool.p2, ground.slope], static: 1.5, restitution: 0}
  c3: {between: [stool.p3, ground.slope], static: 1.5, restitution: 0}
joints:
  j:
    type: free
    parent: ground.on
    child: stool
    initial: {q: [0, 0, 0.381, 1, 0, 0, 0], u: [0, 0, 0, 0, 0, 0.641]}
"""


def test_the_energy_account_closes_over_many_jams_and_what_follows() -> None:
    """A stool jams some ten times as it turns on its feet, and then slides over on two of them: 8 J by friction."""
    run = mbs.simulate(mbs.loads(STOOL), t_end=1)
    assert run.modes is not None
    assert len(run.modes.blows) > 5
    assert sum(work.total for work in run.friction_work.values()) < -8.0
    assert run.energy_residual == pytest.approx(0.0, abs=1e-6)
