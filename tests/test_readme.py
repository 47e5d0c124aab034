"""Every code block of the README, the guide and other pages runs as it is printed."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from multibody_sym.cli.main import main

ROOT = Path(__file__).parent.parent
GUIDE = [f"docs/guide/{page.name}" for page in sorted((ROOT / "docs" / "guide").glob("*.md"))]
PAGES = ["README.md", *(f"docs/{page.name}" for page in sorted((ROOT / "docs").glob("*.md"))), *GUIDE]
MODELS = {"README.md": "slope.yaml", "docs/guide/first_model.md": "pendulum.yaml"}
"""The model files that pages print; those of the guide use that of its first page."""


def blocks(page: str, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", (ROOT / page).read_text(), re.MULTILINE | re.DOTALL)


def run(arguments: list[str], folder: Path) -> str:
    """Return what a command prints; fail with what it says where it fails."""
    environment = {**os.environ, "MPLBACKEND": "Agg"}
    done = subprocess.run(arguments, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{shlex.join(arguments)}\n{done.stdout}{done.stderr}"
    return done.stdout


@pytest.mark.parametrize("page", PAGES)
def test_python_blocks(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In this process, but for those that start others, which import what they are to do."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    for block in blocks(page, "python"):
        if "__main__" in block or "sweep" in block:
            run([sys.executable, "-c", block], tmp_path)
        else:
            exec(compile(block, page, "exec"), {"__name__": "__main__"})


@pytest.mark.long
@pytest.mark.parametrize("page", PAGES)
def test_python_blocks_in_processes_of_their_own(page: str, tmp_path: Path) -> None:
    for block in blocks(page, "python"):
        run([sys.executable, "-c", block], tmp_path)


def test_commands_on_the_printed_model(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In this process, where what commands share is imported once."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    for words in printed_commands(tmp_path):
        assert main(words) == 0, f"{words}: {capsys.readouterr().err}"


@pytest.mark.long
def test_commands_in_processes_of_their_own(tmp_path: Path) -> None:
    for words in printed_commands(tmp_path):
        run([sys.executable, "-m", "multibody_sym", *words], tmp_path)


def printed_commands(tmp_path: Path) -> list[list[str]]:
    """Write the files that the README and the guide print, and return their commands."""
    for page, name in MODELS.items():
        (model,) = blocks(page, "yaml")
        (tmp_path / name).write_text(model)
    (robot,) = blocks("docs/guide/robots.md", "xml")
    (tmp_path / "robot.urdf").write_text(robot)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    lines = [line for page in ("README.md", *GUIDE) for block in blocks(page, "sh") for line in block.splitlines()]
    commands = [line for line in lines if line.startswith("multibody-sym ")]
    assert len(commands) > 3
    return [shlex.split(command, comments=True)[1:] for command in commands]


def test_the_first_model_has_eight_lines_and_prints_what_the_readme_shows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (model,), (shown,) = blocks("README.md", "yaml"), blocks("README.md", "text")
    Path("slope.yaml").write_text(model)
    assert main(["solve", "slope.yaml"]) == 0
    printed = capsys.readouterr().out.splitlines()
    assert len(model.splitlines()) == 8
    assert [line for line in shown.splitlines() if line not in printed] == []


def test_the_readme_names_the_version_and_the_licence() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert f"Version {project['version']}, {project['license']} licence" in text


def test_set_up_lines_stand_in_a_line_each() -> None:
    """The check from nothing runs both; here only their form is checked."""
    lines = [line for block in blocks("README.md", "sh") for line in block.splitlines()]
    set_up = [line for line in lines if line.startswith("python3 -m venv")]
    assert len(set_up) == 2
    assert "simulate" in set_up[0]
    assert "[test]" in set_up[1]
    assert "pytest" in set_up[1]


def test_every_path_in_how_to_add_is_there() -> None:
    text = (ROOT / "docs" / "how_to_add.md").read_text(encoding="utf-8")
    found = re.findall(r"`([\w/.]+/[\w.]*)`", text)
    paths = [path for path in found if path != "multibody_sym/" and not path.startswith("build/")]  # commands make that
    assert len(paths) > 20
    assert [p for p in paths if not ((ROOT / p).exists() or (ROOT / "multibody_sym" / p).exists())] == []
    for table in ("JOINTS", "FORCES", "CONSTRAINTS", "ROUTES", "LANGUAGES", "SUMMARIES", "COMMANDS"):
        assert f"`{table}`" in text
