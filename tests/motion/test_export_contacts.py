"""Exported C goes from state to state of contacts by itself: the same events and motion as a run of the package."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.cli.main import main

EXAMPLES = Path(__file__).parents[2] / "examples"
COMPILER = shutil.which("cc") or shutil.which("gcc")
OWN = ("model.c", "contacts.c", "contact_laws.c", "contact_impacts.c", "simulate.c")
CORNER = """
multibody_sym: 1
name: a particle flies into a corner
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}, wall: {plane: [0, 0, 0], normal: x}}}
  a: {mass: 1}
joints: {j: {type: point, parent: ground, child: a, q: [x, y], initial: {q: [1, 1], u: [-1, -1]}}}
contacts: {c: {between: [a, ground.floor], static: 0.5, OPTIONS}, d: {between: [a, ground.wall], static: 0.5, OPTIONS}}
"""


def shell(line: str, folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(line, shell=True, cwd=folder, capture_output=True, text=True, timeout=120, check=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder into which models are exported one after the other: what they share is compiled once."""
    return tmp_path_factory.mktemp("c")


def simulated(system: mbs.System, folder: Path, *given: str) -> tuple[list[list[str]], np.ndarray, int]:
    """Return the lines that an exported model prints of itself, its rows (t, q, u), and how it exits."""
    mbs.export(system, to="c", directory=folder)
    shared = sorted(file.stem for file in folder.glob("*.c") if file.name not in (*OWN, "selftest.c"))
    missing = [f"{name}.c" for name in shared if not (folder / f"{name}.o").exists()]
    flags = f"{COMPILER} -std=c99 -O0 -Wall -Wextra -Werror -pedantic -ffp-contract=off"
    lines = [f"{flags} -c {' '.join(missing)}"] if missing else []
    lines.append(f"{flags} {' '.join([*OWN, *(f'{name}.o' for name in shared)])} -lm -o simulate")
    for line in lines:
        done = shell(line, folder)
        assert done.returncode == 0, done.stderr
    run = shell(f"./simulate {' '.join(given)}", folder)
    rows = np.array([[float(x) for x in line.split(",")] for line in run.stdout.splitlines()])
    return [line.split(",") for line in run.stderr.splitlines()], rows, run.returncode


@pytest.mark.skipif(COMPILER is None, reason="no C compiler")
def test_numbers_that_are_none_are_refused_in_words(folder: Path) -> None:
    end, samples = "the end of time is a positive number of seconds", "the number of samples is a whole one from 2 on"
    simulated(mbs.load(EXAMPLES / "textbook" / "mass_on_a_belt.yaml"), folder, "0.1", "3")
    for given, reason in {
        "inf": end, "nan": end, "0": end, "-1": end, "1s": end, "1 0": samples, "1 1": samples, "1 2.5": samples,
        "1 inf": samples, "1 2 3": "there are two numbers at most",
    }.items():  # fmt: skip
        run = shell(f"./simulate {given}", folder)
        assert (run.returncode, run.stdout) == (2, "")
        assert run.stderr.startswith(f"{reason}, not {given.split()[-1]}\nusage: ./simulate")


@pytest.mark.skipif(COMPILER is None, reason="no C compiler")
@pytest.mark.parametrize(
    ("name", "more"),
    [
        ("impacts/bouncing_ball", ""),  # bounces lower and lower, and rests
        ("textbook/mass_on_a_belt", ""),  # sticks and slides
        ("impacts/falling_load", "stop: {jerk: rope taut}"),  # what the rope pulls leaves its stand
        ("feet/toppling_rod", ""),  # two rough contacts
    ],
)
def test_events_and_motion_are_those_of_a_run(folder: Path, name: str, more: str) -> None:
    system = mbs.loads((EXAMPLES / f"{name}.yaml").read_text(encoding="utf-8") + more)
    told, rows, code = simulated(system, folder)
    run = mbs.simulate(system)
    events = [line for line in told if line[0] == "event"]
    assert [(line[3], line[2]) for line in events] == [(e["kind"], e["element"]) for e in run.events]
    assert [float(line[1]) for line in events] == pytest.approx([e["t"] for e in run.events], rel=0, abs=1e-9)
    struck = [(float(line[4]), e["impulse"]) for line, e in zip(events, run.events, strict=True) if "impulse" in e]
    assert [own for own, _ in struck] == pytest.approx([impulse for _, impulse in struck], rel=1e-8, abs=1e-12)
    assert rows == pytest.approx(np.column_stack([run.t, run.q, run.u]), rel=0, abs=1e-8)
    assert code == 0


@pytest.mark.skipif(COMPILER is None, reason="no C compiler")
def test_what_it_does_not_solve_ends_the_run_with_its_name(folder: Path) -> None:
    """Two rough contacts strike at once, in a corner, and bounce."""
    told, _, code = simulated(mbs.loads(CORNER.replace("OPTIONS", "restitution: 0.5")), folder)
    assert (told[-1][0], code) == ("end", 1)
    assert "several rough contacts" in told[-1][2]


@pytest.mark.parametrize(
    ("options", "reason"),
    [("tangential_restitution: 1, restitution: 1", "c gives friction back in impacts"), ("kinetic: 0.4", "")],
)
def test_the_command_names_why_a_model_is_not_held(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: str, reason: str
) -> None:
    (tmp_path / "a.yaml").write_text(CORNER.replace("OPTIONS", options), encoding="utf-8")
    assert main(["export", str(tmp_path / "a.yaml"), "--to", "c", "-o", str(tmp_path / "out")]) == 0
    printed = capsys.readouterr().out
    assert (f"without simulate.c, which goes from state to state: {reason}" in printed) == bool(reason)
    assert ("simulate.c goes from state to state;" in printed) == (not reason)
    assert (tmp_path / "out" / "simulate.c").exists() == (not reason)


ON_ONE_LINE = """
multibody_sym: 1
name: a particle on a floor hangs on a rope
gravity: [0, -9.81, 0]
parameters: {m: 1 kg}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}, points: {O: [0, 1, 0]}}
  p: {mass: m}
joints: {p: {type: point, parent: ground, child: p, q: [x, y], initial: {q: [0, 0]}}}
inputs: {F: 0.5*t}
forces: {push: {type: force, on: p, value: [F, 0, 0]}}
contacts: {c: {between: [p, ground.floor], static: 0.3, kinetic: 0.2}}
simulation: {t_end: 1, samples: 3}
"""
ROPE = "constraints: {r: {type: rope, path: [ground.O, p], OPTIONS}}\n"


@pytest.mark.parametrize("options", ["label: S", "slack: true"])
def test_a_rope_and_a_floor_on_one_line_share_forces(tmp_path: Path, options: str) -> None:
    """Neither knows what the other carries: friction holds what it can, and exported C does not go on by itself."""
    system = mbs.loads(ON_ONE_LINE + ROPE.replace("OPTIONS", options))
    run = mbs.simulate(system)
    assert run.q == pytest.approx(np.zeros((3, 2)), abs=1e-12)
    mbs.export(system, to="c", directory=tmp_path)
    assert not (tmp_path / "simulate.c").exists()


@pytest.mark.skipif(COMPILER is None, reason="no C compiler")
def test_parameters_that_no_model_has_end_the_run(tmp_path: Path) -> None:
    mbs.export(mbs.loads(ON_ONE_LINE), to="c", directory=tmp_path)
    source = tmp_path / "simulate.c"
    begun = "mbs_contacts_begin(&run, 0.0, t_end, samples);"
    changed = f'{begun}\n    run.parameters[0] = atof(getenv("MASS"));'
    source.write_text(source.read_text(encoding="utf-8").replace(begun, changed), encoding="utf-8")
    built = shell(f"{COMPILER} -std=c99 -O0 $(ls *.c | grep -v selftest) -lm -o simulate", tmp_path)
    assert built.returncode == 0, built.stderr
    assert shell("MASS=2.5 ./simulate 1 3", tmp_path).returncode == 0
    for value in ("-1", "0", "nan", "inf"):
        run = shell(f"MASS={value} ./simulate 1 3", tmp_path)
        assert (run.stdout, run.returncode) == ("", 1)
        assert "a mass or another one that must be positive is not" in run.stderr.splitlines()[-1]
