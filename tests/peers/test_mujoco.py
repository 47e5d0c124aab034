"""A double pendulum's motion against MuJoCo's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from multibody_sym.mechanics.model_files import loads
from multibody_sym.motion.simulate import simulate

mujoco = pytest.importorskip("mujoco", reason="the peer mujoco (extra: peers) is not installed")

EXAMPLE = Path(__file__).parents[2] / "examples" / "double_pendulum.yaml"
MJCF = """
<mujoco>
  <option gravity="0 0 -9.81" integrator="RK4" timestep="5e-4"><flag contact="disable" constraint="disable"/></option>
  <worldbody>
    <body>
      <joint type="hinge" axis="0 1 0"/>
      <inertial pos="0 0 -1" mass="1" diaginertia="1e-14 1e-14 1e-14"/>
      <body pos="0 0 -1">
        <joint type="hinge" axis="0 1 0"/>
        <inertial pos="0 0 -1" mass="1" diaginertia="1e-14 1e-14 1e-14"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def test_double_pendulum() -> None:
    model = mujoco.MjModel.from_xml_string(MJCF)
    data = mujoco.MjData(model)
    data.qpos[:] = [-1.0, -0.5]
    mujoco.mj_step(model, data, nstep=6000)
    text = EXAMPLE.read_text().replace("q: theta1, initial: {q: 90 deg}", "q: theta1, initial: {q: 1}")
    assert "initial: {q: 1}" in text
    system = loads(text.replace("q: theta2}", "q: theta2, initial: {q: 0.5}}"), "double_pendulum")
    run = simulate(system, t_end=3, rtol=1e-11, atol=1e-12)
    found = [run["theta1"][-1], run["theta2"][-1], run["u_theta1"][-1], run["u_theta2"][-1]]
    np.testing.assert_allclose(found, -np.concatenate([data.qpos, data.qvel]), rtol=0, atol=2e-8)
