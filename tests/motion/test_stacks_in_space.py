"""What stands on more points than it needs in space: tables, boxes on boxes and on plates that move, drawn crates."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.contact.contact_problem import accelerations_of
from multibody_sym.dynamics.start.state import examined_state
from multibody_sym.mechanics.changes import Overrides

FLOOR = """\
multibody_sym: 1
name: stack
gravity: [0, 0, -9.81]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: z}}}
"""
STACK = (
    FLOOR
    + """\
  low: {shape: {box: [0.6, 0.4, 0.3], mass: 12 kg}, surfaces: {top: {plane: [0, 0, 0.15], normal: z}}}
  up: {shape: {box: [0.3, 0.3, 0.2], mass: 5 kg}}
joints:
  J: {type: free, parent: ground, child: low, initial: {q: [0, 0, 0.15, 1, 0, 0, 0]}}
  K: {type: free, parent: ground, child: up, initial: {q: [0.05, 0.02, 0.4, 1, 0, 0, 0]}}
forces: {push: {type: force, on: up, value: [5*t, 2, 0]}}
contacts: {c: {between: [low, ground.floor], static: 0.5}, d: {between: [up, low.top], static: 0.3}}
"""
)
BELT = """\
multibody_sym: 1
name: belt
gravity: [0, 0, -9.81]
bodies:
  ground: {}
  plate: {mass: 5, inertia: {Ixx: 1, Iyy: 1, Izz: 1}, surfaces: {top: {plane: [0, 0, 0], normal: z}}}
  box: {shape: {box: [0.6, 0.4, 0.3], mass: 12 kg}}
joints:
  S: {type: prismatic, parent: ground, child: plate, axis: x}
  J: {type: free, parent: ground, child: box, initial: {q: [0, 0, 0.15, 1, 0, 0, 0]}}
constraints: {drive: {type: expression, zero: "S - 0.5*t"}}
contacts: {c: {between: [box, plate.top], static: 0.5}}
"""
FEET = [(0.5, 0.4), (-0.5, 0.4), (-0.5, -0.4), (0.5, -0.4), (0.7, 0.0), (0.0, 0.1)]


def on_feet(count: int, push: str) -> str:
    points = ", ".join(f"f{k}: [{x}, {y}, -0.2]" for k, (x, y) in enumerate(FEET[:count]))
    contacts = "".join(f"  k{k}: {{between: [table.f{k}, ground.floor], static: 0.4}}\n" for k in range(count))
    return FLOOR + (
        f"  table: {{mass: 20, inertia: {{Ixx: 2, Iyy: 3, Izz: 4}}, points: {{{points}}}}}\n"
        "joints: {J: {type: free, parent: ground, child: table, initial: {q: [0, 0, 0.2, 1, 0, 0, 0]}}}\n"
        f"forces: {{push: {{type: force, on: table, value: {push}}}}}\n"
        f"contacts:\n{contacts}"
    )


@pytest.mark.parametrize("count", [4, pytest.param(6, marks=pytest.mark.long)])
def test_a_table_slips_on_all_its_feet_when_the_push_is_what_friction_holds(count: int) -> None:
    """Where feet press follows the push, so that friction has no moment about the vertical."""
    run = mbs.simulate(mbs.loads(on_feet(count, "[10*t, 20, 0]")), t_end=7.7)
    slips = math.sqrt((0.4 * 20 * 9.81) ** 2 - 400) / 10
    assert sorted(event["element"] for event in run.events) == [f"k{k}" for k in range(count)]
    assert run.events[0]["t"] == pytest.approx(slips, rel=1e-9)
    before = run.t < slips * (1 - 1e-9)
    assert float(np.abs(run.q[before] - run.q[0]).max()) == 0.0


@pytest.mark.long
def test_a_box_on_a_box_slips_when_it_does_and_the_lower_one_stays() -> None:
    run = mbs.simulate(mbs.loads(STACK), t_end=3.1)
    slips = math.sqrt((0.3 * 5 * 9.81) ** 2 - 4) / 5
    assert [event["element"] for event in run.events] == [f"d.corner{k}" for k in range(1, 5)]
    assert run.events[0]["t"] == pytest.approx(slips, rel=1e-9)
    assert float(np.abs(run.q[:, :7] - run.q[0, :7]).max()) == 0.0
    assert run["K_x"][-1] > 0.05


def test_a_box_on_a_plate_that_sets_off_slides_until_it_is_as_fast_and_goes_along() -> None:
    run = mbs.simulate(mbs.loads(BELT), t_end=3.0)
    rests = 0.5 / (0.5 * 9.81)
    assert [event["kind"] for event in run.events] == ["stick"] * 4
    assert run.events[0]["t"] == pytest.approx(rests, rel=1e-9)
    after = run.t > rests
    behind = (run["S"] - run["J_x"])[after]
    assert behind == pytest.approx(0.25 * rests, rel=1e-8)


DRAWN = """\
multibody_sym: 1
name: crate
gravity: [gx, gy, gz]
parameters: {gx: 0 m/s^2, gy: 0 m/s^2, gz: -9.81 m/s^2, a: 1 m, b: 1 m, h: 1 m, m: 1 kg, px: 0 m, py: 0 m, pz: 0 m,
  fx: 0 N, fy: 0 N, fz: 0 N, M: 0 N*m, mu: 0.5, q0: 1, q3: 0}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: z}}}
  crate: {shape: {box: [a, b, h], mass: m}, points: {p: [px, py, pz]}}
joints: {J: {type: free, parent: ground, child: crate, initial: {q: [0, 0, h/2, q0, 0, 0, q3]}}}
forces:
  push: {type: force, on: crate, at: p, value: [fx, fy, fz]}
  turn: {type: torque, on: crate, value: [0, 0, M]}
contacts: {c: {between: [crate, ground.floor], static: mu}}
"""


def drawn(seed: int) -> dict[str, float]:
    """Return sizes, a slope, a push and a turn that one crate in two resists."""
    chance = random.Random(seed)
    a, b, h = (chance.uniform(0.2, 1.0) for _ in range(3))
    m, mu = 10 ** chance.uniform(-1, 2), chance.uniform(0.1, 1.2)
    tilt, down, way = chance.choice([0.0, chance.uniform(0, 0.6)]), chance.uniform(0, 6.28), chance.uniform(0, 6.28)
    F, yaw, middle = m * 9.81 * mu * chance.uniform(0, 1.3), chance.uniform(0, 3.14), chance.choice([0.0, 0.5])
    along = 9.81 * math.sin(tilt)
    return {
        "gx": along * math.cos(down), "gy": along * math.sin(down), "gz": -9.81 * math.cos(tilt),
        "a": a, "b": b, "h": h, "m": m, "mu": mu, "q0": math.cos(yaw), "q3": math.sin(yaw),
        "px": middle * chance.uniform(-a, a), "py": middle * chance.uniform(-b, b), "pz": 0.5 * chance.uniform(-h, h),
        "fx": F * math.cos(way), "fy": F * math.sin(way),
        "fz": m * 9.81 * chance.choice([0.0, chance.uniform(-0.3, 0.3)]),
        "M": chance.choice([0.0, 0.3 * m * 9.81 * mu * max(a, b) * chance.uniform(-1, 1)]),
    }  # fmt: skip


def rests_or_moves_as_solved(seed: int) -> None:
    """Simulate a drawn crate: at rest it stays to the last bit, else it sets off as the laws of its start say.

    Where these have several states a run is in one of them.
    """
    system = mbs.loads(DRAWN)
    state = examined_state(Overrides(drawn(seed)).of(system))
    assert state.found is not None
    assert state.posed is not None
    if not state.modes:  # nothing that slides is found, as where one corner hardly moves: a run says so as well
        with pytest.raises(mbs.NoSolutionError, match="at the start nothing"):
            mbs.simulate(system, t_end=0.01, parameters=drawn(seed))
        return
    run = mbs.simulate(system, t_end=0.01, samples=11, parameters=drawn(seed))
    udot = accelerations_of(state.posed.dynamics, state.found.states[0].x)
    if float(np.abs(udot).max()) < 1e-9:
        assert float(np.abs(run.q - run.q[0]).max()) == 0.0, seed
    elif state.found.verdict == "one":
        assert run.u[1] / run.t[1] == pytest.approx(udot, abs=1e-4 * float(np.abs(udot).max())), seed


def test_drawn_crates_rest_or_move_as_solved() -> None:
    for seed in range(3):
        rests_or_moves_as_solved(seed)


@pytest.mark.long
def test_many_drawn_crates_rest_or_move_as_solved() -> None:
    for seed in range(3, 55):
        rests_or_moves_as_solved(seed)


@pytest.mark.parametrize("angle", [0.2, 0.35, 0.5])
def test_a_box_on_a_box_on_a_slope_slips_on_the_rougher_one_first(angle: float) -> None:
    """mu = 0.4 below, nu = 0.3 between, masses 2 : 1: at rest to tan a = nu; then the upper one, then both slide."""
    text = STACK[: STACK.index("forces")].replace("[0, 0, -9.81]", "[9.81*sin(a), 0, -9.81*cos(a)]")
    slope = f"parameters: {{a: {angle}}}\ncontacts: {{c: {{between: [low, ground.floor], static: 0.4}}, "
    text = text.replace("12 kg", "10 kg").replace("[0.05, 0.02, 0.4", "[0, 0, 0.4")
    system = mbs.loads(text + slope + "d: {between: [up, low], static: 0.3}}\n")
    tangent, normal = 9.81 * math.sin(angle), 9.81 * math.cos(angle)
    up = max(tangent - 0.3 * normal, 0.0)
    low = max(tangent + (0.3 * 5 - 0.4 * 15) * normal / 10, 0.0)
    state = examined_state(system)
    assert state.posed is not None
    udot = accelerations_of(state.posed.dynamics, state.found.states[0].x)
    speeds = [speed.name for speed in state.mechanism.speeds]
    assert [udot[speeds.index(name)] for name in ("u_J_x", "u_K_x")] == pytest.approx([low, up], abs=1e-12)
