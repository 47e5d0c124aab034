"""Tutorials work as they are typed: files as named, commands and programs in order, and what is shown is printed."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

from multibody_sym.cli.main import main

ROOT = Path(__file__).parents[1]
TUTORIALS = sorted((ROOT / "docs" / "tutorials").glob("*.md"))
_BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_FILE = re.compile(r"`([\w.]+\.(?:yaml|urdf|py|c|csv))`[^`]*:\s*$")
_FILES = ("yaml", "xml", "python", "c")


class Block(NamedTuple):
    """A block of code, with the file that the sentence before it names."""

    language: str
    text: str
    file: str | None


def blocks(text: str) -> list[Block]:
    found, end = [], 0
    for match in _BLOCK.finditer(text):
        named = _FILE.search(text[end : match.start()])
        found.append(Block(match[1], match[2], named and named[1]))
        end = match.end()
    return found


def typed(command: str, folder: Path) -> str:
    """Return what a line prints that is typed in a shell where the package is installed."""
    beside = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "MPLBACKEND": "Agg", "PATH": beside}
    done = subprocess.run(
        ["sh", "-ec", command], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    return done.stdout


def called(command: str, folder: Path, capture: pytest.CaptureFixture[str]) -> str:
    """Return what the same line prints where it is a command of the package, in this process, which is cheaper."""
    program, *words = shlex.split(command)
    if program != "multibody-sym":
        return typed(command, folder)
    code, told = main(words), capture.readouterr()
    assert code == 0, f"{command}\n{told.out}{told.err}"
    return told.out


@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_what_is_typed_works_and_prints_what_is_shown(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    follow(page, tmp_path, lambda line: called(line, tmp_path, capsys))


@pytest.mark.long
@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_it_works_in_a_shell(page: Path, tmp_path: Path) -> None:
    follow(page, tmp_path, lambda line: typed(line, tmp_path))


def follow(page: Path, folder: Path, do: Callable[[str], str]) -> None:
    """Do what a tutorial says, in order."""
    printed = ""
    found = blocks(page.read_text(encoding="utf-8"))
    assert len(found) > 5
    for block in found:
        if block.language == "sh":
            printed = "".join(do(line) for line in block.text.splitlines())
        elif block.language == "text":
            lines = printed.splitlines()
            for line in block.text.splitlines():
                assert any(one.startswith(line) for one in lines), f"{line}\nis not in\n{printed}"
        else:
            assert block.language in _FILES
            assert block.file, f"no sentence names the file of\n{block.text}"
            (folder / block.file).write_text(block.text, encoding="utf-8")


def test_there_is_one_for_each_reader() -> None:
    assert [page.stem for page in TUTORIALS] == ["engineer", "roboticist", "student"]
    assert (ROOT / "docs" / "coming_from_sympy.md").exists()
