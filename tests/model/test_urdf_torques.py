"""Torques of a robot's joints as inputs."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs

ARM = """
<robot name="arm">
  <link name="base"/>
  {links}
</robot>
"""
LINK = """
  <joint name="{name}" type="{kind}">
    <origin xyz="0.3 0 0" rpy="0 0 0"/><parent link="{parent}"/><child link="{child}"/><axis xyz="{axis}"/>
    <limit lower="-3" upper="3" effort="9" velocity="2"/>{more}
  </joint>
  <link name="{child}"><inertial><origin xyz="0.1 0 0.1"/><mass value="2"/>
    <inertia ixx="0.04" iyy="0.05" izz="0.03" ixy="0.002" ixz="0" iyz="0.001"/></inertial></link>
"""


def arm(folder: Path) -> mbs.System:
    links = LINK.format(name="lift", kind="prismatic", parent="base", child="a", axis="0 0 1", more="")
    links += LINK.format(name="shoulder-1", kind="revolute", parent="a", child="b", axis="0 1 0", more="")
    links += LINK.format(name="elbow", kind="continuous", parent="b", child="c", axis="0 1 0", more="")
    follows = '<mimic joint="elbow" multiplier="2" offset="0.1"/>'
    links += LINK.format(name="wrist", kind="revolute", parent="c", child="d", axis="1 0 0", more=follows)
    (folder / "arm.urdf").write_text(ARM.format(links=links))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", mbs.UrdfNotice)
        return mbs.load_urdf(folder / "arm.urdf", torques=True, mimic=False)


def test_inverse_and_forward_dynamics_agree_through_the_torques(tmp_path: Path) -> None:
    system = arm(tmp_path)
    forward, inverse = (mbs.function(system, what) for what in ("state_derivative", "inverse_dynamics"))
    assert forward.inputs == ("tau_lift", "tau_shoulder_1", "tau_elbow", "tau_wrist")
    q, u, udot = np.random.default_rng(1).standard_normal((3, 4))
    torques = inverse(0.0, q, u, udot)
    np.testing.assert_allclose(forward(0.0, q, u, inputs=torques).udot, udot, atol=1e-12)
    np.testing.assert_allclose(
        forward.derivative("inputs")(0.0, q, u).udot, np.linalg.inv(mbs.function(system, "mass_matrix")(0.0, q, u)),
        atol=1e-12,
    )  # fmt: skip


def test_what_mimics_another_joint_has_no_torque_of_its_own(tmp_path: Path) -> None:
    arm(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", mbs.UrdfNotice)
        system = mbs.load_urdf(tmp_path / "arm.urdf", torques=True)
    assert list(system.inputs) == ["tau_lift", "tau_shoulder_1", "tau_elbow"]


def test_transmissions_say_which_joints_are_driven(tmp_path: Path) -> None:
    arm(tmp_path)
    text = (tmp_path / "arm.urdf").read_text()
    given = "".join(
        f'<transmission name="t{k}"><joint name="{name}"><role>a</role></joint></transmission>'
        for k, name in enumerate(("lift", "shoulder-1", "nothing"))
    )
    (tmp_path / "arm.urdf").write_text(text.replace("</robot>", f"{given}</robot>"))
    with pytest.warns(mbs.UrdfNotice, match="transmissions drive no such joint: nothing"):
        system = mbs.load_urdf(tmp_path / "arm.urdf", torques=True)
    assert list(system.inputs) == ["tau_lift", "tau_shoulder_1"]
    assert str(system.joints["lift"].limits.effort) == "9"


def test_drives_of_joints_that_mimic(tmp_path: Path) -> None:
    """What the elbow needs to move the wrist along, which turns twice as far: tau = tau_elbow + 2 tau_wrist."""
    free = arm(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", mbs.UrdfNotice)
        tied = mbs.load_urdf(tmp_path / "arm.urdf")
    q, u, udot = np.random.default_rng(2).standard_normal((3, 4))
    q[3], u[3], udot[3] = 2 * q[2] + 0.1, 2 * u[2], 2 * udot[2]
    each = mbs.function(free, "inverse_dynamics")(0.0, q, u, udot)
    drives = ["lift", "shoulder-1", "elbow"]
    found = mbs.function(tied, "inverse_dynamics", drives=drives)(0.0, q, u, udot)
    np.testing.assert_allclose(found, [each[0], each[1], each[2] + 2 * each[3], 0.0], atol=1e-12)


def test_joints_rub_as_the_file_says(tmp_path: Path) -> None:
    """tau = M udot + c + friction sign(u), N m of a hinge and N of a slide."""
    arm(tmp_path)
    text = (tmp_path / "arm.urdf").read_text()
    rubbing = text.replace('velocity="2"/>', 'velocity="2"/><dynamics friction="0.4"/>')
    (tmp_path / "rubs.urdf").write_text(rubbing)
    with pytest.warns(mbs.UrdfNotice, match="friction is not applied: lift, shoulder-1"):
        free = mbs.load_urdf(tmp_path / "rubs.urdf", mimic=False)
    with warnings.catch_warnings():
        warnings.simplefilter("error", mbs.UrdfNotice)
        warnings.filterwarnings("ignore", message="mimic is not applied")
        system = mbs.load_urdf(tmp_path / "rubs.urdf", mimic=False, friction=True)
    words = "slide+", "slide-", "slide+", "slide-"
    mode = dict(zip((name for name in system.forces if name.endswith("_friction")), words, strict=True))
    q, u, udot = np.random.default_rng(3).standard_normal((3, 4))
    plain = mbs.function(free, "inverse_dynamics")(0.0, q, u, udot)
    found = mbs.function(system, "inverse_dynamics", mode=mode)(0.0, q, u, udot)
    np.testing.assert_allclose(found - plain, [0.4, -0.4, 0.4, -0.4], atol=1e-12)
