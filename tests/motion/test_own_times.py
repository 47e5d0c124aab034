"""Samples at times of one's own, and a run asked at any time afterwards: against closed forms and each other."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.cli.main import main

BALL = """
multibody_sym: 1
name: ball
gravity: [0, -10, 0]
bodies:
  ball: {mass: 1 kg, points: {low: [0, 0, 0]}}
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
joints: {y: {type: prismatic, parent: ground, child: ball, axis: y, q: y, initial: {q: 5, u: 0, known: true}}}
contacts: {hit: {between: [ball.low, ground.floor], restitution: 0.5}}
simulation: {t_end: 3 s}
"""


def bouncing(t: float) -> tuple[float, float]:
    """Return height and speed of the ball at a time between its impacts, at t = 1, 2, 2.5, 2.75, .."""
    begin, y, v, strikes = 0.0, 5.0, 0.0, 1.0
    while t > strikes:
        v = 0.5 * (10.0 * (strikes - begin) - v)
        begin, y, strikes = strikes, 0.0, strikes + 0.2 * v
    return y + v * (t - begin) - 5.0 * (t - begin) ** 2, v - 10.0 * (t - begin)


@pytest.fixture(scope="module")
def ball():
    return mbs.prepare(mbs.loads(BALL))


@pytest.fixture(scope="module")
def spring():
    """x'' = -4 x, x(0) = 1: x = cos 2t, driven by nothing."""
    return mbs.prepare(
        mbs.System(
            "spring",
            parameters={"k": 4},
            bodies={"block": mbs.Body(mass=1)},
            joints={"x": mbs.Prismatic("ground", "block", axis="x", q="x", initial={"q": 1, "u": 0})},
            forces={"s": mbs.SpringDamper(joint="x", stiffness="k")},
            outputs={"twice": "2*x", "given": "work(s)"},
        )
    )


@pytest.mark.parametrize("samples", [[0, 0.1, 0.5], np.array([0.25, math.pi]), "0.1, 500 ms, 7", [4.0], [0.5, 7]])
def test_rows_are_those_asked_for(spring, samples) -> None:
    run = spring.run(t_end=7, samples=samples)
    times = [0.1, 0.5, 7.0] if isinstance(samples, str) else list(samples)
    assert run.t.tolist() == times
    assert run["x"] == pytest.approx(np.cos(2 * run.t), abs=1e-8)
    assert run["given"] == pytest.approx(2.0 * (1.0 - run["x"] ** 2), abs=1e-7)  # k (1 - x^2)/2
    assert run.final["t"] == 7.0
    assert run.drift["energy"] < 1e-7
    assert run.whole.t[[0, -1]].tolist() == [0.0, 7.0]
    assert len(run.to_dataframe()) == len(run.accelerations["u_x"]) == len(times)


@pytest.mark.parametrize("method", ["rk4", "radau_5", "adams_bashforth_moulton", "gauss_4", "Radau", "python"])
def test_all_methods_take_own_times(method: str) -> None:
    how = {"backend": "python"} if method == "python" else {"method": method}
    how |= {"step": 0.01} if method in ("rk4", "adams_bashforth_moulton", "gauss_4") else {"rtol": 1e-9}
    given = mbs.System(
        "x",
        bodies={"block": mbs.Body(mass=1)},
        joints={"x": mbs.Prismatic("ground", "block", axis="x", q="x", initial={"q": 1, "u": 0})},
        forces={"s": mbs.SpringDamper(joint="x", stiffness=4)},
    )
    times = [0.033, 0.5, 1.777]
    run = mbs.simulate(given, t_end=2, samples=times, **how)
    assert run["x"] == pytest.approx(np.cos(2 * np.array(times)), abs=2e-7)
    even = mbs.simulate(given, t_end=2, samples=3, **how)
    assert even(times).q == pytest.approx(run.q, abs=1e-15)
    assert run.statistics["steps"] == even.statistics["steps"]


def test_impacts_between_own_times(ball) -> None:
    times = [0.3, 1.2, 2.6]
    run = ball.run(samples=times)
    assert run.t.tolist() == times
    assert np.column_stack([run.q, run.u]) == pytest.approx(np.array([bouncing(t) for t in times]), abs=1e-12)
    whole = ball.run()
    assert run.energy_residual == pytest.approx(0.0, abs=1e-11)
    assert run.events == whole.events
    asked = [0.0, *times, 2.7, 2.9]
    found = whole(asked)
    assert np.column_stack([found.q, found.u]) == pytest.approx(np.array([bouncing(t) for t in asked]), abs=1e-12)
    assert found["y"] == pytest.approx(found.q[:, 0])
    struck = whole.events[0]["t"]
    assert whole(struck).u == pytest.approx(np.array([[5.0]]))
    assert whole(struck, before=True).u == pytest.approx(np.array([[-10.0]]))
    assert whole(struck).accelerations["u_y"] == pytest.approx([-10.0])


def test_times_between_samples(spring) -> None:
    run = spring.run(t_end=7, samples=2)
    times = np.linspace(0.0, 7.0, 57)
    found = run(times)
    assert found["x"] == pytest.approx(np.cos(2 * times), abs=1e-8)
    assert found["u_x"] == pytest.approx(-2 * np.sin(2 * times), abs=1e-8)
    assert found["twice"] == pytest.approx(2 * found["x"])
    assert found["given"] == pytest.approx(2.0 * (1.0 - found["x"] ** 2), abs=1e-7)
    again = spring.run(t_end=7, samples=times)
    assert (found.q == again.q).all()  # the same steps, to the bits
    assert (found.u == again.u).all()
    assert run(7.0).q.tolist() == [run.integration.q_final.tolist()]
    assert run(0.5).t.tolist() == [0.5]


def test_a_stop_has_a_row_wherever_it_is() -> None:
    falling = mbs.loads(BALL + "stop: {low: y < 3}\n")
    met = math.sqrt(0.4)
    for samples, rows in (([0.1, 0.2], [0.1, 0.2, met]), ([1.1, 2.5], [met]), ([0.1, 3], [0.1, met])):
        run = mbs.simulate(falling, samples=samples)
        assert run.t == pytest.approx(rows, abs=1e-9)
        assert run(met / 2)["y"] == pytest.approx([5.0 - 5.0 * (met / 2) ** 2])
    with pytest.raises(mbs.InputError, match=r"t = 0\.7 is outside of the run, which lasts from 0 to 0\.632456 s"):
        run(0.7)


@pytest.mark.parametrize(
    ("samples", "message"),
    [
        ([], "samples: expected a number of samples or their times, got an empty list"),
        ([0.1, 0.1], r"samples\.1: times of samples increase; 0.1 comes after 0.1"),
        ([-1, 2], r"samples\.0: t = -1 is not within the run, which lasts from 0 to 2"),
        ([1, 20], r"samples\.1: t = 20 is not within the run"),
        ([1, "1 kg"], r"samples\.1: '1 kg' does not fit here: expected a quantity in s"),
        ([[1, 2]], r"samples\.0: expected a number or an expression, got a list"),
        ([math.nan], r"samples\.0: nan is not a finite number"),
        ({1: 2}, "expected a number or an expression, got a map"),
    ],
)
def test_wrong_samples(spring, samples, message: str) -> None:
    with pytest.raises(mbs.InputError, match=message):
        spring.run(t_end=2, samples=samples)


@pytest.mark.parametrize("t", [[], [0.2, 0.1], [0.1, 0.1], -1, 8, math.nan, "x", None, [[0.1, 0.2]], {}])
def test_wrong_times_of_a_run(spring, t) -> None:
    with pytest.raises(mbs.InputError):
        spring.run(t_end=7, samples=2)(t)


def test_progress_and_families_give_rows_asked_for(spring) -> None:
    told: list[float] = []
    spring.run(t_end=2, samples=[0.5, 1], on_progress=lambda new, _part: told.extend(new.t.tolist()))
    assert told == [0.5, 1.0]
    asked = mbs.prepare(spring.system, t_end=2, samples=[0.5, 1])
    run = asked.run(parameters={"k": 9})
    assert run["x"] == pytest.approx(np.cos(3 * run.t), abs=1e-8)
    study = mbs.sweep(spring.system, {"k": [4, 9]}, t_end=2, samples=[0.5, 1])
    assert study["x end"] == pytest.approx(np.cos([4.0, 6.0]), abs=1e-8)  # at the end, whatever samples are


def test_command_line(tmp_path, capsys) -> None:
    model = tmp_path / "ball.yaml"
    model.write_text(BALL.replace("t_end: 3 s", "t_end: 3 s, samples: [1, 2]"))
    times = tmp_path / "times.csv"
    times.write_text("t,x\n0.25,1\n0.5,2\n")
    asked = {"": [1, 2], "0.1,0.2 s,3": [0.1, 0.2, 3], "0.5,": [0.5], str(times): [0.25, 0.5]}
    for _ in range(2):  # the second run is a recalled one
        for samples, rows in asked.items():
            given = ("--samples", samples) if samples else ()
            assert main(["simulate", str(model), "--json", "-o", str(tmp_path / "out.csv"), *given]) == 0
            assert json.loads(capsys.readouterr().out)["t"] == rows
            lines = (tmp_path / "out.csv").read_text().splitlines()
            assert [float(line.split(",")[0]) for line in lines[1:]] == rows
    assert main(["simulate", str(model), "--samples", "0.1,7"]) == 2
    assert "--samples: t = 7 is not within the run" in capsys.readouterr().err
    assert main(["simulate", str(model), "--samples", str(tmp_path / "no.csv")]) == 2
    assert main(["simulate", str(model), "--samples", str(times), "-o", str(times)]) == 2
    dumped = mbs.dumps(mbs.loads(model.read_text()))
    assert "samples: [1, 2]" in dumped
