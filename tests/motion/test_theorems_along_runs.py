"""Work and impulses as outputs, and the general theorems along runs, in every state and as integrals."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from multibody_sym.cli.main import main
from multibody_sym.motion.results.integrals import integral, integral_until

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


def test_integrals_over_pieces() -> None:
    t = np.linspace(1.0, 3.0, 17)
    values = np.stack([t**4, np.ones_like(t)], axis=1)
    np.testing.assert_allclose(integral(values, t)[-1], [(3**5 - 1) / 5, 2.0], rtol=1e-14)
    at = np.array([1.0, 1.7, 2.5, 3.0])
    np.testing.assert_allclose(integral_until(at, values, t)[:, 0], (at**5 - 1) / 5, rtol=1e-13, atol=1e-14)


@pytest.mark.parametrize("shape", [(1,), (1, 4), (1, 2, 3)])
def test_the_integral_over_a_stretch_that_ends_at_once_is_nothing(shape: tuple[int, ...]) -> None:
    np.testing.assert_array_equal(integral(np.ones(shape), np.array([0.3])), np.zeros(shape))
