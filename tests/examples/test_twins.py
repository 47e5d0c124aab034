"""Each example stands twice, as a model file and in Python, and both are the same system."""

from __future__ import annotations

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
def test_each_file_starts_with_its_title(name: str) -> None:
    title = FILES[name].read_text(encoding="utf-8").splitlines()[0]
    assert title.startswith("# ")
    assert title.endswith((".", "?"))


@pytest.mark.parametrize("name", ["t7_atwood", "pendulum"])
def test_a_twin_runs_as_a_script(name: str) -> None:
    done = subprocess.run(
        [sys.executable, str(FILES[name].with_suffix(".py"))], capture_output=True, text=True, check=True, timeout=60
    )
    assert " = " in done.stdout
