"""Inputs that motions and constraints name: they stand for their expressions, with all their rates."""

from __future__ import annotations

import math
import pickle
import re
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

import multibody_sym as mbs

LIFT = """\
multibody_sym: 1
name: lift
gravity: [0, -g, 0]
parameters: {m: 2, g: 9.81, A: 0.3, w: 4}
bodies:
  cabin: {mass: 5, inertia: {Izz: 1}}
  bob: {mass: m, com: [0, -0.5, 0], inertia: {Izz: 0.01}}
joints:
  guide: {type: prismatic, parent: ground, child: cabin, axis: y, motion: PROFILE}
  hinge: {type: revolute, parent: cabin, child: bob, q: phi, initial: {q: 0.2}}
inputs: {profile: A*sin(w*t), push: 0.1*t}
forces: {drive: {type: torque, joint: hinge, value: push}}
outputs: {carried: "reaction(guide, fy)"}
simulation: {t_end: 0.5, samples: 6}
"""


def lift(motion: str = "profile", old: str = "", new: str = "") -> mbs.System:
    return mbs.loads(LIFT.replace("PROFILE", motion).replace(old, new))


def run(system: mbs.System, *names: str, **given: Any) -> list[Any]:
    done = mbs.simulate(system, backend="python", rtol=1e-8, **given)
    return [done[name] for name in names]


@pytest.mark.parametrize("coordinates", ["relative", "absolute"])
def test_a_motion_follows_an_input(coordinates: str) -> None:
    """Against the same motion written in place: accelerations, and what carries the cabin."""
    given = {"coordinates": coordinates}
    named, plain = lift(), lift("A*sin(w*t)")
    assert mbs.solve(named, **given).reactions == mbs.solve(plain, **given).reactions
    for found, wanted in zip(*(run(x, "phi", "carried", **given) for x in (named, plain)), strict=True):
        assert found == pytest.approx(wanted, rel=1e-9)


def test_a_ground_and_a_motion_constraint_follow_inputs() -> None:
    """A shaken ground and a driven joint, each against the expression in place."""

    def shaken(x: str, angle: str) -> mbs.System:
        joint = mbs.Revolute("ground", "b", q="phi", initial={"q": "angle0", "u": 0.5})
        return mbs.System(
            "shaken",
            parameters={"angle0": 0.1},
            bodies={"ground": mbs.Body(motion={"x": x}), "b": mbs.Body(mass=1, com=[0, -1, 0], inertia={"Izz": 0.2})},
            joints={"A": joint},
            constraints={"drive": mbs.PrescribedMotion("A", angle)},
            inputs={"shake": "0.2*sin(3*t)", "turn": "angle0 + t/2 + t^3"},
            outputs={"moment": "reaction(A, mz)"},
            simulation={"t_end": 0.3, "samples": 4},
        )

    named, plain = shaken("shake", "turn"), shaken("0.2*sin(3*t)", "angle0 + t/2 + t^3")
    for found, wanted in zip(*(run(x, "phi", "moment") for x in (named, plain)), strict=True):
        assert found == pytest.approx(wanted, rel=1e-9, abs=1e-12)


def test_a_cam_is_an_input_of_a_coordinate() -> None:
    """y = 0.1 sin(3 x), x' = 2 without forces along: y'' = 0.1 (-9 sin(3 x) x'^2 + 3 cos(3 x) x'')."""
    system = mbs.System(
        "cam",
        bodies={"a": mbs.Body(mass=1), "b": mbs.Body(mass=0.5)},
        joints={
            "A": mbs.Prismatic("ground", "a", axis="x", q="x", initial={"q": 0.4, "u": 2, "known": True}),
            "B": mbs.Prismatic("ground", "b", axis="y", q="y"),
        },
        inputs={"cam": "0.1*sin(3*x)"},
        constraints={"follow": mbs.Expression("y - cam")},
    )
    found = mbs.solve(system)
    x2, y2 = (found.accelerations[name].value for name in ("x", "y"))
    assert found.coordinates["y"] == pytest.approx(0.1 * math.sin(1.2))
    assert y2 == pytest.approx(0.1 * (-9 * math.sin(1.2) * 4 + 3 * math.cos(1.2) * x2))
    assert mbs.check(system).agrees


def test_a_velocity_constraint_may_name_an_input_of_speeds() -> None:
    joints = {
        name: mbs.Prismatic("ground", name, axis="x", q=f"x_{name}", initial={"u": 1, "known": known})
        for name, known in (("a", True), ("b", False))
    }
    bodies = dict.fromkeys("ab", mbs.Body(mass=1))
    system = mbs.System(
        "s", bodies=bodies, joints=joints, inputs={"lead": "3*u_x_a"},
        constraints={"c": mbs.VelocityConstraint("u_x_b - lead")},
    )
    assert mbs.solve(system).speeds["u_x_b"] == pytest.approx(3)


def test_tables_drive_a_motion_as_smoothly_as_they_are() -> None:
    """A cubic table's second derivative is continuous; a linear one's slope jumps, which takes an impact."""
    rows = "[[-1, -1], [0, 0], [0.1, 0.05], [0.3, 0.1], [2, 0.2]]"
    cubic = lift(old="profile: A*sin(w*t)", new=f"profile: {{table: {rows}, interpolation: cubic}}")
    begin = mbs.simulate(cubic, backend="python")
    assert np.isfinite(begin["carried"]).all()
    linear = lift(old="profile: A*sin(w*t)", new=f"profile: {{table: {rows}}}")
    with pytest.raises(mbs.ModelError, match=r"jumps at t = 0\.1 s") as error:
        mbs.simulate(linear, backend="python")
    assert error.value.where.path == ("joints", "guide", "motion")


def test_a_number_cannot_take_the_place_of_an_input_whose_rates_count() -> None:
    rhs = mbs.compile(mbs.state_derivative(lift()), backend="python")
    assert rhs(0, rhs.x0, inputs={"push": 1.0})[1] > rhs(0, rhs.x0)[1]
    with pytest.raises(mbs.InputError, match=r"profile drives a motion .* change its expression"):
        rhs(0, rhs.x0, inputs={"profile": 1.0})
    with pytest.raises(mbs.InputError, match=r"profile drives a motion"):
        rhs(0, rhs.x0, inputs=[0.0, 1.0])


def test_b_has_no_column_for_such_an_input() -> None:
    """At rest in a lift that stands still: B by the push alone, 1/(I + m l^2)."""
    found = mbs.linearize(lift(old="A*sin(w*t)", new="A"), at={"phi": 0}, inputs={"push": 0})
    assert found.inputs == ("push",)
    assert found.B[found.states.index("u_phi")] == pytest.approx(1 / (0.01 + 2 * 0.25))
    assert found.driving_inputs == ("profile",)
    assert found.as_json()["driving_inputs"] == ["profile"]


def test_an_input_in_a_motion_is_used() -> None:
    assert not [hint for hint in mbs.check(lift()).hints if "not used" in hint]


def road(rows: int, interpolation: str, height: Callable[[Any], Any]) -> mbs.System:
    """Return a wheel on a spring above a road that is a table of its height over time."""
    way, t = mbs.variable("way"), np.linspace(0, 3, rows)
    return mbs.System(
        "quarter_car",
        bodies={"patch": mbs.Body(mass=1), "wheel": mbs.Body(mass=1)},
        joints={
            "R": mbs.Prismatic("ground", "patch", axis="z", motion=way),
            "W": mbs.Prismatic("ground", "wheel", axis="z", q="wheel"),
        },
        forces={"tyre": mbs.Force(on="wheel", value=[0, 0, 100 * (way - mbs.variable("wheel"))])},
        inputs={"way": mbs.Table(table=np.c_[t, height(t)].tolist(), interpolation=interpolation)},
    )


def test_a_motion_by_a_table_costs_no_start_what_it_cost_the_first() -> None:
    """Against scipy's natural spline and integrator; another start costs little more than the integration alone."""
    system = road(400, "cubic", lambda t: 0.05 * np.sin(3 * t) ** 2)
    begun = time.process_time()
    prepared = mbs.prepare(system, t_end=3, samples=7, step=5e-5)
    prepared.run(initial={"wheel": 0.3})
    assert time.process_time() - begun < 3
    spent: dict[bool, list[float]] = {False: [], True: []}
    for another in 6 * (False, True):
        begun = time.process_time()
        found = prepared.run(**({"initial": {"wheel": 0.1}} if another else {}))
        spent[another].append(time.process_time() - begun)
    assert min(spent[True]) < 1.3 * min(spent[False])
    rows = np.array([[x.shadow for x in row] for row in system.inputs["way"].table])
    spline = CubicSpline(*rows.T, bc_type="natural")
    wanted = solve_ivp(
        lambda t, y: [y[1], 100 * (spline(t) - y[0])], (0, 3), [0.1, 0], "DOP853", found.t, rtol=1e-11, atol=1e-13,
        max_step=0.0075,
    )
    assert found["wheel"] == pytest.approx(wanted.y[0], abs=1e-8)
    alone = mbs.simulate(system, t_end=3, samples=7, step=5e-5, initial={"wheel": 0.1})
    assert alone.q.tobytes() == found.q.tobytes()


def test_the_first_knot_at_which_a_table_bends_is_found_however_late_it_comes() -> None:
    """Straight up to the 281st of 400 rows, where the slope goes from 0 to 1/2: known at once, by numpy.diff."""
    t = np.linspace(0, 3, 400)
    system = road(400, "linear", lambda t: 0.5 * np.maximum(t - t[280], 0))
    begun = time.process_time()
    with pytest.raises(mbs.ModelError, match="the rate of this motion jumps") as told:
        mbs.simulate(system, t_end=3)
    assert time.process_time() - begun < 2
    (found,) = re.findall(r"t = ([-\d.e]+) s, from ([-\d.e]+) to ([-\d.e]+)", str(told.value))
    assert [float(x) for x in found] == pytest.approx([t[280], 0, 0.5], rel=1e-5, abs=1e-9)


def test_a_force_by_a_table_of_many_rows_is_integrated_from_row_to_row() -> None:
    """m v' = f: on straight lines v is the trapezoidal sum; another table of as many rows has its own forces."""
    t = np.linspace(0, 10, 3000)
    y = np.cumsum(np.random.default_rng(3).normal(size=len(t))) / np.sqrt(len(t))
    force = mbs.variable("pull")
    for sign in (1, -1):
        system = mbs.System(
            "pulled",
            bodies={"b": mbs.Body(mass=2)},
            joints={"J": mbs.Prismatic("ground", "b", axis="x", q="x")},
            forces={"F": mbs.Force(on="b", value=[force, 0, 0])},
            inputs={"pull": mbs.Table(table=np.c_[t, sign * y])},
        )
        run = mbs.simulate(system, t_end=10, samples=2, rtol=1e-8, atol=1e-10)
        assert run["u_x"][-1] == pytest.approx(sign * np.trapezoid(y, t) / 2, abs=1e-12)


def test_equations_name_a_table_and_their_function_takes_its_values() -> None:
    """A pendulum in a cabin that moves by y: (J + m l^2) phi'' = -m l sin(phi) (g + y''), y'' of scipy's spline."""
    rows = [[-1, -1], [0, 0], [0.1, 0.05], [0.3, 0.1], [2, 0.2]]
    system = lift(old="profile: A*sin(w*t)", new=f"profile: {{table: {rows}, interpolation: cubic}}")
    equations = mbs.derive(system)
    written = str(equations.equations)
    assert "profile''(t)" in written
    assert "where" not in written
    bend = CubicSpline(*np.transpose(rows), bc_type="natural")(0.25, 2)
    wanted = (0.1 * 0.25 - 2 * 0.5 * np.sin(0.2) * (9.81 + bend)) / (0.01 + 2 * 0.25)
    assert equations.lambdify()([0.2], [0.5], 0.25) == pytest.approx([wanted], rel=1e-12)
    assert pickle.loads(pickle.dumps(equations)).lambdify()([0.2], [0.5], 0.25) == pytest.approx([wanted], rel=1e-12)
