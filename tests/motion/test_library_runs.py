"""Other libraries' methods on stiff systems: the implicit ones know the exact Jacobian, and what stops one is said."""

from __future__ import annotations

import math

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.motion.integrator.flow import Events, Flow
from multibody_sym.motion.integrator.library_steps import library_steps
from multibody_sym.motion.methods.table import METHODS, SUNDIALS
from multibody_sym.motion.runs.run import FailedRunError

# Nothing depends on the angle s of the spindle: a difference in it tells nothing of any rate.
GOVERNOR = """
multibody_sym: 1
name: governor
gravity: [0, 0, -9.81]
parameters: {k: 1e8, c: 1e4, l: 0.4}
bodies: {spindle: {inertia: {Izz: 1}}, slide: {}, ball: {mass: 1.5}, sleeve: {mass: 2}}
joints:
  S: {type: revolute, parent: ground, child: spindle, axis: z, q: s, initial: {u: 8}}
  X: {type: prismatic, parent: spindle, child: slide, axis: x, q: x, initial: {q: 0.28}}
  Y: {type: prismatic, parent: slide, child: ball, axis: z, q: y, initial: {q: -0.28}}
  D: {type: prismatic, parent: spindle, child: sleeve, axis: z, q: z, initial: {q: -0.56}}
forces:
  arm: {type: spring_damper, between: [spindle, ball], stiffness: k, damping: c, length: l}
  rod: {type: spring_damper, between: [sleeve, ball], stiffness: k, damping: c, length: l}
"""
IMPLICIT = ["Radau", "BDF", "LSODA", "cvode_bdf"]


@pytest.mark.parametrize("name", IMPLICIT)
def test_a_stiff_governor_turns_as_its_angular_momentum_says(name: str) -> None:
    """(Izz + m x^2) s' stays, and the ball does not leave the sphere on which its stiff arm all but holds it."""
    if getattr(METHODS[name], "package", "") == SUNDIALS:
        pytest.importorskip("sksundae")
    run = mbs.simulate(mbs.loads(GOVERNOR), t_end=1, method=name, rtol=1e-7, atol=1e-8, samples=11)
    assert run.t_final == 1
    assert np.ptp((1 + 1.5 * run["x"] ** 2) * run["u_s"]) < 1e-4
    assert np.abs(np.hypot(run["x"], run["y"]) - 0.4).max() < 5e-3
    assert np.ptp(run["x"]) > 0.01
    assert run.statistics["jacobians"] > 0


def test_a_library_that_gives_up_is_named_and_no_coordinate_is_blamed(monkeypatch: pytest.MonkeyPatch) -> None:
    import scipy.integrate

    def gives_up(solver: scipy.integrate.OdeSolver) -> None:
        solver.status = "failed"

    monkeypatch.setattr(scipy.integrate.BDF, "step", gives_up)
    with pytest.raises(FailedRunError) as caught:
        mbs.simulate(mbs.loads(GOVERNOR), t_end=1, method="BDF", samples=11, backend="python")
    assert str(caught.value).startswith("BDF takes no further step at t = 0 s")
    assert "on account of" not in str(caught.value)


@pytest.mark.parametrize("method", ["BDF", "Radau"])
def test_a_rate_without_a_finite_derivative_is_named(method: str) -> None:
    block = """
multibody_sym: 1
name: edge
bodies: {block: {mass: 1}}
joints: {slide: {type: prismatic, parent: ground, child: block, axis: x, q: x}}
forces: {push: {type: force, on: block, value: [1 - sqrt(x), 0, 0]}}
"""
    told = f"the rate of u_x has no finite derivative at t = 0 s, which {method} needs"
    with pytest.raises(FailedRunError, match=told):
        mbs.simulate(mbs.loads(block), t_end=1, method=method, samples=2, backend="python")


PRESSED = """
multibody_sym: 1
name: pressed blocks
gravity: [0, 0, 0]
bodies: {a: {mass: 1}, b: {mass: 2, surfaces: {face: {plane: [0, 0, 0], normal: -x}}}}
joints:
  ja: {type: prismatic, parent: ground, child: a, axis: x, q: xa, initial: {q: 0}}
  jb: {type: prismatic, parent: ground, child: b, axis: x, q: xb, initial: {q: 0.2}}
forces: {ka: {type: force, on: a, value: [2, 0, 0]}, kb: {type: force, on: b, value: [-1, 0, 0]}}
contacts: {ab: {between: [a, b.face], restitution: 0.6}}
"""


@pytest.mark.parametrize(("method", "error"), [("BDF", 1e-6), ("RK45", 1e-9)])
def test_bounces_come_to_rest_on_the_face(method: str, error: float) -> None:
    """They close by 2.5 m/s^2: first after 0.4 s, and the bounces take 2*0.4*e/(1 - e) s."""
    run = mbs.simulate(mbs.loads(PRESSED), t_end=2, method=method, samples=21)
    assert run.events[-1]["kind"] == "closed"
    assert abs(run.events[-1]["t"] - 1.6) < error
    assert np.abs(run["xb"] - run["xa"])[-4:].max() < 1e-12


@pytest.mark.parametrize("method", ["BDF", "RK45"])
def test_what_starts_beyond_a_switch_and_turns_back_short_of_it_ends_the_mode_where_it_started(method: str) -> None:
    events = Events(lambda t, x: -x[:1], (True,), margins=(0.0,))
    flow = Flow(METHODS[method], lambda t, x: np.array([x[1], -2.0]), 0.0, 1.0, np.array([-1e-4, 1e-2]), events=events)
    *_, last = library_steps(flow)
    assert last.event == 0
    assert last.t_new == pytest.approx(0.01, abs=1e-5)
    assert last.x_new == pytest.approx([-1e-4, -1e-2], abs=1e-5)


BESIDE_A_STIFF_SLIDE = """
multibody_sym: 1
name: ball beside a stiff slide
gravity: [0, -9.81, 0]
parameters: {e: 0.5, stiffness: 0, damping: 0}
bodies: {ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}, ball: {mass: 2}, slide: {mass: 1}}
joints:
  free: {type: point, parent: ground, child: ball, q: [x, y], initial: {q: [0, 1]}}
  guide: {type: prismatic, parent: ground, child: slide, axis: x, q: s}
forces: {drive: {type: force, on: slide, value: [stiffness*(sin(t) - s) + damping*(cos(t) - u_s), 0, 0]}}
contacts: {c: {between: [ball, ground.floor], restitution: e}}
"""


STIFF = {"stiffness": 1e6, "damping": 1e4}


@pytest.mark.parametrize(
    ("method", "restitution", "stiff"),
    [("BDF", 0.9, {}), ("LSODA", 0.9, {}), ("BDF", 0.5, STIFF), ("LSODA", 0.5, STIFF), ("cvode_bdf", 0.5, STIFF)],
)
def test_no_height_is_lost_between_bounces(method: str, restitution: float, stiff: dict[str, float]) -> None:
    """After infinitely many impacts, at sqrt(2 h/g) (1 + e)/(1 - e), the ball rests."""
    if getattr(METHODS[method], "package", "") == SUNDIALS:
        pytest.importorskip("sksundae")
    rests, model = math.sqrt(2 / 9.81) * (1 + restitution) / (1 - restitution), mbs.loads(BESIDE_A_STIFF_SLIDE)
    values = {"e": restitution, **stiff}
    run = mbs.simulate(model, t_end=1.05 * rests, method=method, samples=2, rtol=1e-8, parameters=values)
    assert run.events[-1]["kind"] == "closed"
    assert run.events[-1]["t"] == pytest.approx(rests, rel=3e-7)
