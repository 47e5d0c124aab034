"""What is written does not hang on the order of sets, which the hashes of names decide anew in each process."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from test_book_form import closed, text

from multibody_sym.algebra.book_form import book_form
from multibody_sym.cli.main import main

HERE = Path(__file__).parent
EXAMPLES = HERE.parent.parent / "examples"
LONG = (
    "(m^2*cos(b)*sin(a)^2 - 2*cos(a)*sin(a) + 2*h*r^2 - 2*l*J*cos(a)^2*sin(a) - m*cos(a)*sin(b) + k*J^2*l^2"
    " - k^2*g^2*cos(b)*sin(b)^2 + 3*r*cos(a)^2 - k*sin(b))/(k*m*cos(a)^2 - 2*m*J^2 + J*g^2*cos(a)*cos(b)^2)",
    "(3*J*r*cos(a)*sin(a) + h*l*cos(a)^2*sin(a) + h*J^2*sin(b) + h*k^2*r^2*sin(b) - 2*h*cos(b)*sin(a)^2 - m*sin(a)"
    " + 2*cos(b)^2*sin(a) - 2*g*l*J^2 - 2*h^2*sin(a)*sin(b))/(k*cos(b)*sin(b)^2 + 2*l*cos(a)^2*sin(b)"
    " - 2*k*l*J^2*sin(a)^2) + 2*r*cos(a) - g*l*m*sin(a)^2",
    "(3*J*r*cos(a)*sin(b) - 2*k*l^2*sin(a)^2 + g*h^2 + k*m^2*cos(a)*sin(a) - h*cos(a)*cos(b)^2*sin(b)"
    " + 2*g*r*J^2*sin(a) - 3*J*sin(b)^2 - l*r^2*J^2*sin(a) - 3*h*l*cos(b)^2)/(J*sin(a) - 2*m*r - J*g^2*sin(b)^2)"
    " + 2*l*k^2*sin(b)^2 + g*m^2*cos(b)*sin(b)^2",
)
COMMANDS = (
    ("solve", "textbook/rod_in_bowl", "--json", "--steps"),
    ("derive", "rolling_coin"),
    ("modes", "oscillations/nutating_top"),
)


def write_all() -> None:
    """Print the long forms, and what commands say of some examples."""
    for form in LONG:
        print(text(book_form(closed(form))))
    for command, name, *options in COMMANDS:
        assert main([command, str(EXAMPLES / f"{name}.yaml"), *options]) == 0


def written(seed: int) -> str:
    """Return what `write_all` prints in a process of its own."""
    path = os.pathsep.join([str(HERE), *sys.path])
    environment = {**os.environ, "PYTHONPATH": path, "PYTHONHASHSEED": str(seed)}
    command = [sys.executable, "-c", "import test_hash_seeds; test_hash_seeds.write_all()"]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout


def test_all_is_written_the_same_whatever_the_seed_of_the_hashes_is() -> None:
    """Effort is bounded, so that what is tried first must not come from a set."""
    assert written(1).splitlines() == written(2).splitlines()
