"""A command that made its run before takes it from the cache: the same bytes, without the model and what reads it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from command import ROOT, command, environment

from multibody_sym.cli import runs as prepared
from multibody_sym.cli.main import main
from multibody_sym.motion.runs import replay
from multibody_sym.program import cache

PENDULUM = """multibody_sym: 1
name: pendulum
gravity: [0, -9.81, 0]
parameters: {m: 1 kg, l: 1 m, k: 0}
bodies:
  bob: {mass: m, com: [0, -l, 0]}
joints:
  pin: {type: revolute, parent: ground, child: bob, axis: z, q: phi, initial: {q: 1}}
forces:
  push: {type: torque, joint: pin, value: k/(phi - 2)}
outputs: {twice: 2*phi}
simulation: {t_end: 1 s, samples: 5}
"""
SLOW = ("sympy", "scipy", "yaml", "multibody_sym.mechanics.mechanism", "multibody_sym.mechanics.model_files")


@pytest.fixture(autouse=True)
def counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Give whether each run was recalled, in a folder with the model and compiled code that all tests share."""
    monkeypatch.chdir(tmp_path)
    Path("model.yaml").write_text(PENDULUM)
    found: list[bool] = []
    recall = replay.recall_run

    def told(*given: object) -> object:
        run = recall(*given)  # type: ignore[arg-type]
        found.append(run is not None)
        return run

    monkeypatch.setattr(replay, "recall_run", told)
    return found


def run(capture: pytest.CaptureFixture[str], *words: str) -> tuple[int, str, str]:
    capture.readouterr()
    code = main(["simulate", "model.yaml", *words])
    shown = capture.readouterr()
    return code, shown.out, shown.err


@pytest.mark.parametrize(
    ("example", "t_end"),
    [
        ("four_bar", "0.1"),  # with constraints, outputs and a start that is found
        ("textbook/mass_on_a_belt", "2"),  # sticks and slides, by turns that are taken in C
        ("impacts/bouncing_ball", "2"),
        ("impacts/slammed_door", "0.1"),  # goes on from an impact
        ("variable_mass/rocket", "0.1"),
        ("bicycle", "0.1"),  # wheels that nothing but weight keeps down
    ],
)
def test_a_second_run_imports_nothing_that_reads_models(example: str, t_end: str, tmp_path: Path) -> None:
    model = ROOT / "examples" / f"{example}.yaml"
    words = ["simulate", str(model), "--t-end", t_end, "-o", str(tmp_path / "motion.csv")]
    program = (
        "import sys, json; from multibody_sym.cli.main import main;"
        f"code = main({words!r}); print(json.dumps([code, [m for m in {SLOW!r} if m in sys.modules]]))"
    )
    told, tables = [], []
    for _ in range(2):
        start = [sys.executable, "-c", program]
        done = subprocess.run(start, env=environment(), cwd=ROOT, capture_output=True, text=True, check=True)
        told.append(done.stdout.splitlines())
        tables.append((tmp_path / "motion.csv").read_bytes())
    assert json.loads(told[1][-1]) == [0, []]
    assert told[0][:-1] == told[1][:-1]
    assert tables[0] == tables[1]


@pytest.mark.parametrize(
    "words",
    [(), ("--json",), ("-o", "out.csv"), ("--units", "deg"), ("--verify",), ("--set", "l=2", "--initial", "phi=2 deg")],
)
def test_what_is_told_is_the_same(
    words: tuple[str, ...], counted: list[bool], capsys: pytest.CaptureFixture[str]
) -> None:
    first, second = (run(capsys, *words) for _ in range(2))
    assert first == second
    assert first[0] == 0
    assert counted[-1]


def test_every_option_and_every_byte_of_the_model_counts(
    counted: list[bool], capsys: pytest.CaptureFixture[str]
) -> None:
    """Closed form: a pendulum of length l at rest at 1 rad begins with -g sin(1)/l; l, m, start change what is told."""
    asked = [(), ("--set", "l=2"), ("--set", "l=3"), ("--t-end", "2"), ("--rtol", "1e-6"), ("--initial", "phi=0.5")]
    asked += [("--method", "rk4", "--step", "0.01"), ("--formalism", "sweep"), ("--native",), ("--no-project",)]
    told = []
    for words in asked:
        run(capsys, *words)
        del counted[:]
        told.append(run(capsys, *words))
        assert counted == [True], words
    Path("model.yaml").write_text(PENDULUM.replace("q: 1}", "q: 1.5}"))
    del counted[:]
    told.append(run(capsys))
    assert counted == [False]
    ends = [text.split("at t = ")[-1] for _, text, _ in told]
    assert len({*ends[:4], ends[5], ends[-1]}) == 6
    assert run(capsys, "--set", "l=2") not in told


def test_what_is_damaged_is_made_again(
    counted: list[bool], capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a cache of its own: in the shared one, tests beside it would meet the damage, and may take files away."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    right = run(capsys)
    kept = [path for path in cache.folder().glob("*.json") if b'"asked"' in path.read_bytes()]
    assert kept
    for damage in (b"", b"{}", b"\0" * 99):
        for path in kept:
            path.write_bytes(damage)
        assert run(capsys) == right
    assert counted[-1] is False
    assert run(capsys) == right
    assert counted[-1] is True


def test_what_a_valid_file_says_wrongly_is_made_again(
    counted: list[bool], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As a version would leave it that forgot to change its name."""
    right = run(capsys)
    recall = replay.loading.recall

    def bent(*given: object, **named: object) -> object:
        found = recall(*given, **named)  # type: ignore[arg-type]
        if found is not None and "run" in found.metadata:
            kept = json.loads(found.metadata["run"])
            del kept["told"]["speeds"]
            found.metadata["run"] = json.dumps(kept)
        return found

    monkeypatch.setattr(replay.loading, "recall", bent)
    assert run(capsys) == right
    assert counted[-1] is False


def test_a_recalled_run_that_fails_says_why_and_where(
    counted: list[bool], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The torque k/(phi - 2) has a pole, which a run meets that turns through it; nothing is remembered of failures."""
    words = ("--set", "k=1", "--initial", "phi=1.9", "--initial", "u_phi=20")
    first = run(capsys, *words)
    assert first[0] in (0, 3)
    assert run(capsys, *words) == first
    assert run(capsys)[0] == 0
    from multibody_sym.motion.loop.problem import RunFailure
    from multibody_sym.motion.runs import run as runs
    from multibody_sym.program.runtime_constants import Status

    integrate = runs.integrate

    def failed(*given: object, **named: object) -> object:
        from dataclasses import replace

        done = integrate(*given, **named)  # type: ignore[arg-type]
        return replace(done, failure=RunFailure(Status.NOT_FINITE, 0.5, 1))

    monkeypatch.setattr(runs, "integrate", failed)
    code, out, err = run(capsys)
    assert counted[-1] is True
    assert (code, out) == (3, "")
    assert "the rate of u_phi is no finite number at t = 0.5 s" in err


def test_tables_are_read_each_time(counted: list[bool], capsys: pytest.CaptureFixture[str]) -> None:
    table = "inputs: {pull: {table: {file: pull.csv}}}\nsimulation:"
    pulled = PENDULUM.replace("simulation:", table).replace("value: k/(phi - 2)", "value: pull")
    Path("model.yaml").write_text(pulled)
    ends = []
    for size in (1, 2):
        Path("pull.csv").write_text(f"t,pull\n0,{size}\n5,{size}\n")
        code, told, err = run(capsys)
        assert code == 0, err
        ends.append(told)
    assert ends[0] != ends[1]
    assert not any(counted)


def test_a_pipe_is_read_once(tmp_path: Path) -> None:
    done = command("simulate", "/dev/stdin", input=PENDULUM, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("pendulum: done")


def test_a_recalled_run_is_plotted_without_its_model(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert run(capsys, "--plot", "first.png")[0] == 0
    monkeypatch.setattr(prepared._Anew, "_made", lambda *_: pytest.fail("the model is read once more"))
    assert run(capsys, "--plot", "second.png")[0] == 0
    assert Path("first.png").read_bytes() == Path("second.png").read_bytes()
