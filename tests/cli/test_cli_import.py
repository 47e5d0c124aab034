"""`import`: a robot description becomes a model file; nothing is replaced, what was left out is told."""

from __future__ import annotations

from pathlib import Path

from command import ROOT, answer, here

import multibody_sym as mbs

ARM = str(ROOT / "tests" / "text" / "data" / "arm.urdf")


def test_a_robot_becomes_a_model_file(tmp_path: Path) -> None:
    done = here("import", ARM, "-o", "arm.yaml", "--floating", cwd=tmp_path)
    assert done.returncode == 0
    assert "note: friction is not applied: shoulder-pan" in done.stderr
    assert "18 speeds" in done.stdout
    assert len(mbs.mechanism(mbs.load(tmp_path / "arm.yaml")).speeds) == 18
    again = here("import", ARM, "-o", "arm.yaml", cwd=tmp_path)
    assert again.returncode == 2
    assert "exists already" in again.stderr


def test_without_a_file_the_model_is_the_output() -> None:
    text = here("import", ARM, "--no-damping").stdout
    assert not mbs.loads(text).forces
    assert answer(here("import", ARM, "--no-damping", "--json"))["model"] == text


def test_a_mistake_ends_with_its_place(tmp_path: Path) -> None:
    (tmp_path / "robot.urdf").write_text('<robot name="r">\n<link/>\n</robot>')
    done = here("import", "robot.urdf", cwd=tmp_path)
    assert done.returncode == 2
    assert "robot.urdf:2:1: link: <link> needs name=" in done.stderr
