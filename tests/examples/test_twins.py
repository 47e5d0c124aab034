"""Each example stands twice, as a model file and in Python, and both are the same system."""

from __future__ import annotations

import re
import subprocess
import sys

import pytest
from twins import FILES, TWINS, from_file, from_python

import multibody_sym as mbs


@pytest.mark.parametrize("name", TWINS)
def test_file_and_python_declare_the_same_system(name: str) -> None:
    assert from_file(name) == from_python(name)
    assert from_file(name).name == name


@pytest.mark.parametrize("name", FILES)
def test_a_written_example_reads_as_it_was(name: str) -> None:
    assert mbs.loads(mbs.dumps(from_file(name))) == from_file(name)


@pytest.mark.parametrize("name", FILES)
def test_each_file_has_its_statement(name: str) -> None:
    """One to three sentences, which `new --list`, reports and the gallery show; no comment says them again."""
    said = from_file(name).description
    assert said is not None
    assert said[0].isupper() or said[0].isdigit()
    assert 1 <= len(re.findall(r"[.?](?= |$)", said)) <= 3
    assert said.endswith((".", "?"))
    text = FILES[name].read_text(encoding="utf-8")
    comments = " ".join(line.removeprefix("#").strip() for line in text.splitlines() if line.startswith("#"))
    assert not [each for each in re.split(r"(?<=[.?]) ", said) if len(each) > 30 and each in comments]
    assert [line for line in text.splitlines()[:3] if line.startswith("#")] == []


@pytest.mark.parametrize("name", ["t7_atwood", "pendulum"])
def test_a_twin_runs_as_a_script(name: str) -> None:
    done = subprocess.run(
        [sys.executable, str(FILES[name].with_suffix(".py"))], capture_output=True, text=True, check=True, timeout=60
    )
    assert " = " in done.stdout
