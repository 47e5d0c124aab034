"""Work and impulses as outputs, and the general theorems along runs, in every state and as integrals."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.cli.main import main
from multibody_sym.motion.results.integrals import integral, integral_until

G = 9.81
FALL = """
multibody_sym: 1
name: fall
gravity: [0, -9.81, 0]
bodies: {ball: {mass: 2 kg}}
joints: {j: {type: point, parent: ground, child: ball, axes: xy, q: [x, y], initial: {u: [3, 4]}}}
forces:
  air: {type: drag, on: ball, linear: 0.5}
  wind: {type: force, on: ball, value: [cos(t), 0, 0]}
outputs:
  lost: work(air)
  kept: total_energy() - work(air) - work(wind)
  pushed: "impulse(wind, x)"
  weighed: "impulse(weight, y)"
  braked: "impulse(air, ball, x)"
  momentum: "momentum(ball, x)"
  power: power(air)
  turning: "angular_momentum(ball, ground.origin, z)"
simulation: {t_end: 2 s, rtol: 1e-12, method: dormand_prince_8, samples: 21}
"""
SLIDE = """
multibody_sym: 1
name: slide
gravity: [0, -9.81, 0]
bodies:
  box: {mass: 3 kg, surfaces: {sole: {point: [0, 0, 0]}}}
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
joints: {j: {type: point, parent: ground, child: box, axes: xy, q: [x, y], initial: {u: [2, 0]}}}
contacts: {c: {between: [box.sole, ground.floor], static: 0.3, kinetic: 0.2}}
outputs: {rubbed: work(c), across: "impulse(c, x)", up: "impulse(c, y)"}
simulation: {t_end: 2 s, samples: 41}
"""


def loaded(text: str, tmp_path: Path) -> mbs.System:
    (tmp_path / "m.yaml").write_text(text)
    return mbs.load(tmp_path / "m.yaml")


@pytest.fixture(scope="module")
def fall(tmp_path_factory: pytest.TempPathFactory) -> mbs.Trajectory:
    return mbs.simulate(loaded(FALL, tmp_path_factory.mktemp("fall")), backend="python")


def test_the_origin_of_ground_is_a_point_about_which_things_turn(fall: mbs.Trajectory) -> None:
    x, y, u_x, u_y = (fall[name] for name in ("x", "y", "u_x", "u_y"))
    np.testing.assert_allclose(fall["turning"], 2.0 * (x * u_y - y * u_x), rtol=1e-12, atol=1e-12)


def test_work_and_impulses_against_closed_forms(fall: mbs.Trajectory) -> None:
    t, rate = fall.t, 0.5 / 2
    np.testing.assert_allclose(fall["pushed"], np.sin(t), atol=1e-12)
    np.testing.assert_allclose(fall["weighed"], -2 * G * t, atol=1e-11)
    particular = 0.5 * (rate * np.cos(t) + np.sin(t)) / (1 + rate**2)
    vx = particular + (3 - particular[0]) * np.exp(-rate * t)
    np.testing.assert_allclose(fall["momentum"], 2 * vx, atol=1e-10)
    np.testing.assert_allclose(fall["braked"], 2 * vx - 6 - np.sin(t), atol=1e-10)
    vy = (4 + G / rate) * np.exp(-rate * t) - G / rate
    np.testing.assert_allclose(fall["power"], -0.5 * (vx**2 + vy**2), rtol=1e-9)
    np.testing.assert_allclose(fall["kept"], fall["kept"][0], atol=1e-10)
    assert fall["lost"][0] == 0.0
    assert (np.diff(fall["lost"]) < 0.0).all()
    assert fall.output_units["lost"] == "J"
    assert fall.output_units["pushed"] == "kg*m/s"


def test_the_theorems_hold_along_the_run(fall: mbs.Trajectory) -> None:
    found = fall.verified()
    assert set(found) == {"momentum", "angular_momentum", "power", "impulse", "angular_impulse", "work"}
    assert max(found[name].relative for name in ("momentum", "angular_momentum", "power")) < 1e-13
    assert max(miss.relative for miss in found.values()) < 1e-10


def test_integrals_tell_a_coarse_run(fall: mbs.Trajectory) -> None:
    coarse = mbs.simulate(fall.ready.system, method="heun", step=0.1, backend="python").verified()
    assert coarse["work"].relative > 1e-6
    assert 0.0 < coarse["work"].t <= 2.0
    assert coarse["power"].relative < 1e-13


def test_friction_of_a_contact_that_slides_to_rest(tmp_path: Path) -> None:
    run = mbs.simulate(loaded(SLIDE, tmp_path))
    rest = 2 / (0.2 * G)
    t = np.minimum(run.t, rest)
    np.testing.assert_allclose(run["across"], -3 * 0.2 * G * t, atol=1e-7)
    np.testing.assert_allclose(run["rubbed"], -3 * 0.2 * G * (2 * t - 0.1 * G * t**2), atol=1e-7)
    np.testing.assert_allclose(run["up"], 3 * G * run.t, atol=1e-7)
    assert run["rubbed"][-1] == pytest.approx(run.friction_work["c"].total, rel=1e-9)
    assert max(miss.relative for miss in run.verified().values()) < 1e-9


def test_command_tells_misses_and_writes_work(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "m.yaml").write_text(FALL)
    table = tmp_path / "out.csv"
    given = ["simulate", str(tmp_path / "m.yaml"), "--verify", "--backend", "python", "-o", str(table), "--json"]
    assert main(given) == 0
    captured = capsys.readouterr()
    found = json.loads(captured.out)
    assert found["theorems"]["work"]["relative"] < 1e-9
    assert "theorems along the run" in captured.err
    rows = [line.split(",") for line in table.read_text().splitlines()]
    column = rows[0].index("pushed")
    assert float(rows[-1][column]) == pytest.approx(np.sin(2.0), abs=1e-11)
    assert found["outputs"]["pushed"][-1] == pytest.approx(np.sin(2.0), abs=1e-11)


@pytest.mark.parametrize(
    ("section", "text", "what"),
    [
        ("ask", "work(air)", "adds up along a run"),
        ("stop", "work(air) < -1", "adds up along a run"),
        ("outputs", "work(rain)", "no force, constraint, contact or joint"),
        ("outputs", '"momentum(bell, x)"', "did you mean ball"),
        ("outputs", '"angular_momentum(ball, centre, x)"', "no point, nor the word com"),
        ("outputs", '"impulse(air)"', "takes 2 or 3 arguments, not 1"),
        ("outputs", "generalized_momentum(z)", "no coordinate and no speed"),
    ],
)
def test_what_cannot_be_asked(section: str, text: str, what: str, tmp_path: Path) -> None:
    kept = FALL[: FALL.index("outputs:")]
    with pytest.raises(mbs.InputError, match=what):
        mbs.simulate(loaded(f"{kept}{section}: {{a: {text}}}\n", tmp_path), t_end=1, backend="python")


def test_integrals_over_pieces() -> None:
    t = np.linspace(1.0, 3.0, 17)
    values = np.stack([t**4, np.ones_like(t)], axis=1)
    np.testing.assert_allclose(integral(values, t)[-1], [(3**5 - 1) / 5, 2.0], rtol=1e-14)
    at = np.array([1.0, 1.7, 2.5, 3.0])
    np.testing.assert_allclose(integral_until(at, values, t)[:, 0], (at**5 - 1) / 5, rtol=1e-13, atol=1e-14)


def test_bounces_part_what_is_run_once_more(tmp_path: Path) -> None:
    """The weight's work is that from 1 m down to the floor and up again, whatever number of bounces lies between."""
    text = SLIDE.replace("u: [2, 0]", "q: [0, 1], u: [0, 0]").replace("static: 0.3, kinetic: 0.2", "restitution: 0.6")
    text = text[: text.index("outputs:")] + 'outputs: {W: work(weight), h: "position(box, y)"}\n'
    run = mbs.simulate(loaded(text, tmp_path), t_end=1.2, samples=25)
    assert sum(event["kind"] == "impact" for event in run.events) >= 2
    np.testing.assert_allclose(run["W"], 3 * G * (1 - run["h"]), atol=1e-7)
    assert max(miss.relative for miss in run.verified().values()) < 1e-7


def test_impacts_count_in_impulses_and_work(tmp_path: Path) -> None:
    """A box that is thrown onto a rough floor: P+ - P- = J + m g t and T+ - T- = W + W_g, impact by impact."""
    text = SLIDE.replace("u: [2, 0]", "q: [0, 1], u: [3, 0]").replace("kinetic: 0.2", "kinetic: 0.2, restitution: 0.6")
    more = {"px": '"momentum(box, x)"', "py": '"momentum(box, y)"', "E": "total_energy()"}
    text = text.replace("outputs: {", "outputs: {" + "".join(f"{k}: {v}, " for k, v in more.items()))
    run = mbs.simulate(loaded(text, tmp_path), t_end=1.2, samples=25)
    struck = [event for event in run.events if event["kind"] == "impact"]
    assert len(struck) >= 2
    np.testing.assert_allclose(run["up"], run["py"] + 3 * G * run.t, atol=1e-7)
    np.testing.assert_allclose(run["across"], run["px"] - 9, atol=1e-7)
    np.testing.assert_allclose(run["rubbed"], run["E"] - run["E"][0], atol=1e-7)
    v = np.sqrt(2 * G)
    flown = (run.t > 1.01 * v / G) & (run.t < 2 * v / G)
    np.testing.assert_allclose(run["up"][flown], 3 * 1.6 * v, atol=1e-7)
    np.testing.assert_allclose(run["across"][flown], -0.2 * 3 * 1.6 * v, atol=1e-7)


def test_what_dies_out_at_once_in_a_long_run_is_not_missed(tmp_path: Path) -> None:
    """One of two masses is braked within 10 us of 10 s: u = exp(-1e5 t), of which even places over all see nothing."""
    text = """
multibody_sym: 1
name: dies_out
gravity: [0, 0, 0]
bodies: {slow: {mass: 1 kg}, quick: {mass: 1 kg}}
joints:
  a: {type: prismatic, parent: ground, child: slow, axis: x, q: x, initial: {u: 10}}
  b: {type: prismatic, parent: ground, child: quick, axis: y, q: y, initial: {u: 1}}
forces:
  push: {type: force, on: slow, value: [10, 0, 0]}
  brake: {type: drag, on: quick, linear: 1e5}
simulation: {t_end: 10 s, method: radau_5, rtol: 1e-11, atol: 1e-12, samples: 2}
"""
    misses = mbs.simulate(loaded(text, tmp_path)).verified()
    assert max(miss.relative for miss in misses.values()) < 1e-9


@pytest.mark.parametrize("shape", [(1,), (1, 4), (1, 2, 3)])
def test_the_integral_over_a_stretch_that_ends_at_once_is_nothing(shape: tuple[int, ...]) -> None:
    np.testing.assert_array_equal(integral(np.ones(shape), np.array([0.3])), np.zeros(shape))


def test_the_account_closes_where_a_pull_jumps_as_its_points_meet() -> None:
    """A bead is pulled to a point on its wire, 5 N from either side: its power jumps each time it passes."""
    text = """
multibody_sym: 1
name: to_and_fro
gravity: [0, -9.81, 0]
bodies: {bead: {mass: 0.5}, ground: {points: {o: [0, 0, 0]}}}
joints: {wire: {type: prismatic, parent: ground, child: bead, axis: x, q: x, initial: {q: 1}}}
forces:
  pull: {type: pull, between: [ground.o, bead], value: 5 + 0.1*u_x}
  rub: {type: friction, joint: wire, static: 0.02}
"""
    run = mbs.simulate(mbs.loads(text), t_end=4, samples=3)
    assert len(run.events) > 3
    assert abs(run.energy_residual) < 2e-6
