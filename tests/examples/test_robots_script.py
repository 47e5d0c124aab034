"""The script that imports robots runs as it is printed."""

from __future__ import annotations

import subprocess
import sys
from importlib.metadata import PackageNotFoundError, distribution

import pytest
from twins import EXAMPLES


def test_a_robot_is_measured_and_falls() -> None:
    try:
        distribution("example-robot-data")
    except PackageNotFoundError:
        pytest.skip("the robots of example-robot-data (extra: peers) are not installed")
    command = [sys.executable, str(EXAMPLES / "robots.py"), "UR5"]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120)
    assert "UR5: 6 degrees of freedom" in done.stdout
    assert "shoulder_pan_joint" in done.stdout
