"""Belts, which come back to the wheel where they begin, and bands that brake a drum."""

from __future__ import annotations

import math

import pytest

import multibody_sym as mbs
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.programs.quantities import StateQuantities
from multibody_sym.dynamics.start.state import StartState, examined_state
from multibody_sym.mechanics.motion import motion_of
from multibody_sym.mechanics.state import state_of

BELT = """\
multibody_sym: 1
name: belt
parameters: {R: 0.3, r: 0.1}
bodies:
  ground: {points: {right: [1, 0, 0]}}
  big: {shape: {disc: R, mass: 4}}
  small: {shape: {disc: r, mass: 1}}
joints:
  A: {type: revolute, parent: ground, child: big, q: a}
  B: {type: revolute, parent: ground.right, child: small, q: b}
pulleys: {P: {body: big, radius: R}, Q: {body: small, radius: r}}
constraints: {belt: {type: rope, path: [P, Q, P], wrap: "+"}}
forces: {drive: {type: torque, joint: A, value: 2}, load: {type: torque, joint: B, value: -0.3}}
"""


def acting(text: str) -> tuple[StartState, StateQuantities]:
    """Return the start of a model in the mode that the law finds, solved."""
    found = examined_state(mbs.loads(text))
    mechanism, begin = found.mechanism, found.start
    state = state_of(mechanism, float, 0.0, begin.q, begin.u, begin.parameters)
    solved = forward_dynamics(FORMALISMS["block_ldl"](mechanism, state))
    return found, StateQuantities(motion_of(mechanism, state), solved.udot.tolist(), solved.multipliers.tolist())


@pytest.mark.parametrize(("wrap", "sense"), [('"+"', 1), ('{P: "+", Q: "-"}', -1)])
def test_a_belt_turns_two_wheels_as_their_radii_say(wrap: str, sense: int) -> None:
    """a R = +-b r (open, crossed); (I1 + I2 (R/r)^2) a'' = M1 +- M2 R/r; what presses the belt on is not told."""
    found = mbs.solve(mbs.loads(BELT.replace('"+"', wrap)))
    I1, I2, ratio = 4 * 0.3**2 / 2, 1 * 0.1**2 / 2, 3.0
    expected = (2 - sense * 0.3 * ratio) / (I1 + I2 * ratio**2)
    assert found.accelerations["a"].value == pytest.approx(expected, rel=1e-12)
    assert found.accelerations["b"].value == pytest.approx(sense * ratio * expected, rel=1e-12)
    assert all(not x.unique for x in found.reactions["belt"].values())
    report = mbs.check(mbs.loads(BELT.replace('"+"', wrap)))
    assert set(report.not_unique) >= {"belt.1", "belt.2"}
    assert not [hint for hint in report.hints if "push" in hint], "a belt is laid on with a tension that is not told"


def test_a_belt_without_a_side_is_told_both_readings() -> None:
    with pytest.raises(mbs.ModelError, match=r'wrap: \{P: "\+"\} leads it counter-clockwise .*"-"\} clockwise'):
        mbs.solve(mbs.loads(BELT.replace(', wrap: "+"', "")))


TENSIONED = """\
multibody_sym: 1
name: tensioned
parameters: {R: 0.2}
bodies:
  ground: {points: {right: [1, 0, 0]}}
  left: {shape: {disc: R, mass: 4}}
  slider: {mass: 2}
  wheel: {shape: {disc: R, mass: 1}}
joints:
  A: {type: revolute, parent: ground, child: left, q: a}
  S: {type: prismatic, parent: ground.right, child: slider, axis: x, q: s}
  B: {type: revolute, parent: slider, child: wheel, q: b}
pulleys: {P: {body: left, radius: R}, Q: {body: wheel, radius: R}}
constraints: {belt: {type: rope, path: [P, Q, P], wrap: "+"}}
forces:
  drive: {type: torque, joint: A, value: 3}
  pull: {type: force, on: slider, value: [100, 0, 0]}
"""


def test_a_belt_that_a_slider_tensions_has_two_tensions() -> None:
    """T1 + T2 = F as the slider rests; I2 b'' = (T1 - T2) R on the driven wheel, up to the way round."""
    found = mbs.solve(mbs.loads(TENSIONED))
    T1, T2 = (x.value for x in found.reactions["belt"].values())
    alpha = 3 / ((4 + 1) * 0.2**2 / 2)
    assert found.accelerations["a"].value == pytest.approx(alpha, rel=1e-12)
    assert found.accelerations["s"].value == pytest.approx(0.0, abs=1e-12)
    assert pytest.approx(100.0, rel=1e-12) == T1 + T2
    assert abs(T1 - T2) == pytest.approx(1 * 0.2 * alpha / 2, rel=1e-12)
    assert T2 > T1, "the run that comes to the driving wheel is the tight one"


BRAKE = """\
multibody_sym: 1
name: band_brake
parameters: {mu: 0.3, F: 100, R: 0.2}
bodies:
  ground: {points: {hub: [0, 0, 0], pin: [0.2, -1, 0], fulcrum: [-0.6, -1, 0]}}
  drum: {shape: {disc: R, mass: 50}}
  lever: {mass: 0.5, inertia: {Izz: 0.1}, points: {band: [0.4, 0, 0], end: [1.2, 0, 0]}}
joints:
  axle: {type: revolute, parent: ground.hub, child: drum, q: phi, initial: {u: SPIN}}
  lever: {type: revolute, parent: ground.fulcrum, child: lever, q: angle}
pulleys: {drum: {body: drum, radius: R, rough: mu}}
constraints: {band: {type: rope, path: [lever.band, drum, ground.pin]}}
forces: {hand: {type: force, on: lever, at: end, value: [0, -F, 0]}}
outputs: {loose: "tension(band, 1)", tight: "tension(band, 2)"}
"""


@pytest.mark.parametrize(("spin", "tight"), [(30.0, 2), (-30.0, 1)])
def test_a_band_brake_holds_with_its_loose_end_on_the_lever(spin: float, tight: int) -> None:
    """The band's lever side has T = F 1.2/0.4; over half the drum T2/T1 = exp(mu pi), as the drum turns.

    Path: up from the lever on the left, over the top, down to the pin: clockwise. A drum that turns counter-clockwise
    drags the band back, towards the lever, so that the pin's side is tight.
    """
    found, at = acting(BRAKE.replace("SPIN", str(spin)))
    assert found.words["drum"] == ("slip+" if spin > 0 else "slip-")
    lever, pin = at.tensions["band.1"], at.tensions["band.2"]
    ratio = math.exp(0.3 * math.pi) if tight == 2 else math.exp(-0.3 * math.pi)
    assert lever == pytest.approx(100 * 1.2 / 0.4, rel=1e-12)
    assert pin / lever == pytest.approx(ratio, rel=1e-12)
    assert at.udot[0] == pytest.approx((lever - pin) * 0.2 / (50 * 0.2**2 / 2), rel=1e-12)


def test_a_drum_at_rest_is_held_by_its_band() -> None:
    found, at = acting(BRAKE.replace("SPIN", "0"))
    assert found.words["drum"] == "grip"
    assert at.udot == pytest.approx([0.0, 0.0], abs=1e-12)


def test_a_braked_drum_stops_and_stays() -> None:
    """At t = omega/|alpha|, after omega^2/(2 |alpha|); what it had of energy the band took."""
    run = mbs.simulate(mbs.loads(BRAKE.replace("SPIN", "30")), t_end=0.5, samples=3)
    I, pull = 50 * 0.2**2 / 2, 300 * (math.exp(0.3 * math.pi) - 1)
    stop = 30 / (pull * 0.2 / I)
    ((time, kind, element),) = [(e["t"], e["kind"], e["element"]) for e in run.events]
    assert (kind, element) == ("grip", "drum")
    assert time == pytest.approx(stop, abs=1e-9)
    assert run["phi"][-1] == pytest.approx(15 * stop, abs=1e-8)
    assert run["u_phi"][-1] == 0.0
    assert run["loose"] == pytest.approx([300.0] * 3, rel=1e-9)
    assert run["tight"] == pytest.approx([300.0 * math.exp(0.3 * math.pi)] * 2 + [300.0], rel=1e-9)
