"""Everything a user can do wrong: a message, a place, an exit code, one JSON object, and never a traceback."""

from __future__ import annotations

from pathlib import Path

import pytest
from command import PENDULUM, answer, here

from multibody_sym.cli.main import main

HINGE = (
    "{multibody_sym: 1, name: m, bodies: {b: {mass: 1, com: [1, 0, 0]}},"
    " joints: {h: {type: revolute, parent: ground, child: b, q: phi}}, "
)


def outcome(capsys: pytest.CaptureFixture[str], *words: str):
    """Return exit code and JSON object of a command run in this process."""
    import json

    code = main([*words, "--json"])
    printed = capsys.readouterr()
    assert printed.out.count("\n") == 1
    return code, json.loads(printed.out), printed.err


@pytest.mark.parametrize(
    ("words", "code", "kind", "message"),
    [
        ((), 2, "usage", "COMMAND"),
        (("simulat",), 2, "usage", "there is no command 'simulat'; did you mean simulate?"),
        (("shwo", PENDULUM), 2, "usage", "did you mean show?"),
        (("zzz",), 2, "usage", "there is no command 'zzz'; known: new, import, check, draw, show, derive, solve"),
        (("--versoin",), 2, "usage", "there is no option '--versoin'; did you mean --version?"),
        (("--t-end", "3", "simulate"), 2, "usage", "there is no option '--t-end'; options stand behind a command"),
        (("simulate", "--plott", "run.png"), 2, "usage", "simulate has no option '--plott'; did you mean --plot?"),
        (("export", PENDULUM, "--too", "c"), 2, "usage", "export has no option '--too'; did you mean --to?"),
        (("simulate", PENDULUM, "--backend", "phyton"), 2, "usage", "did you mean python?"),
        (("solve", PENDULUM, "more.yaml"), 2, "usage", "solve takes no further argument 'more.yaml'"),
        (("simulate",), 2, "usage", "FILE"),
        (("simulate", PENDULUM, "--tend", "3"), 2, "usage", "did you mean --t-end?"),
        (("simulate", PENDULUM, "--t-end"), 2, "usage", "expected one argument"),
        (("simulate", PENDULUM, "--set", "l"), 2, "usage", "NAME=VALUE"),
        (("simulate", PENDULUM, "--backend", "fortran"), 2, "usage", "invalid choice"),
        (("simulate", PENDULUM, "--set", "m=1", "--parameters", "m=2"), 2, "usage", "two values, '1' and '2'"),
        (("linearize", PENDULUM, "--at", "theta=0", "--at", "theta=1"), 2, "usage", "two values, '0' and '1'"),
        (("simulate", PENDULUM, "--t-end", "1", "--t-end", "2"), 2, "usage", "--t-end 1 and --t-end 2 are two values"),
        (("export", PENDULUM, "--to", "c", "-o", "x", "--directory", "y"), 2, "usage", "-o x and --directory y are"),
        (("simulate", "missing.yaml"), 2, "input", "no such file"),
        (("simulate", "."), 2, "input", "directory"),
        (("simulate", PENDULUM, "--set", "ll=1"), 2, "model", "did you mean l?"),
        (("simulate", PENDULUM, "--set", "l=1 kg"), 2, "model", "quantity in m"),
        (("simulate", PENDULUM, "--set", "l=1+"), 2, "expression", "missing"),
        (("simulate", PENDULUM, "--set", "l=-1"), 2, "model", "positive"),
        (("simulate", PENDULUM, "--set", "l=0*g"), 2, "model", "positive"),
        (("simulate", PENDULUM, "--set", "g=9.81/(l-1)"), 2, "model", "no finite value"),
        (("check", PENDULUM, "--set", "m=abc"), 2, "model", "'abc' is not declared; known: l, g"),
        (("simulate", PENDULUM, "--t-end", "nan"), 2, "model", "'nan' is not declared; known: m, l, g"),
        (("simulate", PENDULUM, "--rtol", "a"), 2, "model", "'a' is not declared; known: m, l, g"),
        (("simulate", PENDULUM, "--inputs", "F=thet"), 2, "model", "there is no input 'F'"),
        (("simulate", PENDULUM, "--formalism", "lagrang"), 2, "input", "did you mean lagrange?"),
        (("simulate", PENDULUM, "--method", "rk4"), 2, "model", "needs a step"),
        (("simulate", PENDULUM, "--method", "rk5"), 2, "model", "did you mean RK45?"),
        (("simulate", PENDULUM, "--t-end", "theta"), 2, "model", "names parameters only"),
        (("simulate", PENDULUM, "--t-end", "-1"), 2, "model", "positive"),
        (("simulate", PENDULUM, "--samples", "1"), 2, "model", "whole number"),
        (("simulate", PENDULUM, "--samples", "1e12"), 2, "model", "too many"),
        (("simulate", PENDULUM, "--step", "1e-12"), 2, "model", "too many"),
        (("simulate", PENDULUM, "-o", "out.xlsx"), 2, "input", ".csv, .npz, .parquet"),
        (("simulate", PENDULUM, "--plot", "model.yaml"), 2, "input", ".png, .svg, .pdf"),
        (("simulate", PENDULUM, "-o", "/no/such/folder/out.csv"), 4, "output", "folder"),
        (("new", "pendulun"), 2, "input", "did you mean pendulum?"),
    ],
)
def test_what_is_wrong_is_said(capsys, words, code: int, kind: str, message: str) -> None:
    ended, printed, text = outcome(capsys, *words)
    assert (ended, printed["error"]["code"]) == (code, kind)
    assert message in printed["error"]["message"]
    assert text.startswith("error: ")
    assert set(printed["error"]["where"]) == {"file", "line", "column", "path"}


@pytest.mark.parametrize(
    ("content", "code", "message"),
    [
        ("multibody_sym: 1\nname: [", 2, ""),
        ("multibody_sym: 1\nname: m\n", 2, "nothing can move"),
        ("multibody_sym: 1\nname: m\nbodies: {b: {mas: 1}}", 2, "unknown key 'mas'"),
        ("multibody_sym: 1\nname: m\nbodies: {b: {mass: 1 s}}", 2, "kg"),
        (HINGE + "forces: {f: {type: torque, joint: h, value: k*phi}}}", 2, "'k' is not declared"),
        (HINGE + "outputs: {f: 'reaction(hh, fx)'}}", 2, "hh"),
        (HINGE + "simulation: {t_end: phi}}", 2, "parameters only"),
        (HINGE + "simulation: {method: rk7}}", 2, "rk7"),
        (HINGE.replace("mass: 1", "mass: 0") + "}", 3, "u_phi"),
        (HINGE + "forces: {f: {type: torque, joint: h, value: log(1 - t)}}}", 3, "at t = 1"),
        (HINGE + "constraints: {a: {type: expression, zero: phi - 1}, b: {type: expression, zero: phi - 2}}}", 3, ""),
    ],
)
def test_wrong_models(capsys, tmp_path: Path, content: str, code: int, message: str) -> None:
    file = tmp_path / "model.yaml"
    file.write_text(content)
    ended, printed, _ = outcome(capsys, "simulate", str(file))
    assert ended == code
    assert any(message in each["message"] for each in printed["errors"])
    if code == 2:
        assert printed["error"]["where"]["file"] == str(file)
        assert printed["error"]["where"]["line"] >= 1


def test_an_option_is_blamed_for_what_it_brought(capsys) -> None:
    for words, option in (
        (("--set", "l=-1"), "--set l"),
        (("--t-end", "1 kg"), "--t-end"),
        (("--method", "rk4"), "--method"),
        (("--formalism", "x"), "--formalism"),
    ):
        _, printed, text = outcome(capsys, "simulate", PENDULUM, *words)
        assert printed["error"]["where"] == {"file": None, "line": None, "column": None, "path": option}
        assert text.startswith(f"error: {option}: ")


def test_a_defect_is_one_line_and_a_code_of_its_own(capsys, monkeypatch: pytest.MonkeyPatch) -> None:
    from multibody_sym.motion.runs import run

    def broken(*_arguments: object, **_options: object) -> None:
        raise RuntimeError("first line\nsecond line")

    monkeypatch.setattr(run, "integrate", broken)
    ended, printed, text = outcome(capsys, "simulate", PENDULUM)
    assert (ended, printed["error"]["code"]) == (70, "internal")
    assert "RuntimeError: first line" in text
    assert "report" in text
    assert text.count("\n") == 1
    monkeypatch.setenv("MULTIBODY_SYM_DEBUG", "1")
    with pytest.raises(RuntimeError):
        main(["simulate", PENDULUM])


def test_no_memory_is_said(capsys, monkeypatch: pytest.MonkeyPatch) -> None:
    from multibody_sym.motion.runs import run

    def too_large(*_arguments: object, **_options: object) -> None:
        raise MemoryError

    monkeypatch.setattr(run, "integrate", too_large)
    ended, printed, _ = outcome(capsys, "simulate", PENDULUM)
    assert (ended, printed["error"]["code"]) == (4, "memory")


def test_text_of_an_error_goes_to_standard_error_alone() -> None:
    done = here("simulate", "missing.yaml")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("error: missing.yaml: ")


def test_help_and_version_are_answers() -> None:
    for words in (("--help",), ("simulate", "--help"), ("--version",)):
        done = here(*words)
        assert done.returncode == 0
        assert done.stdout
        assert done.stderr == ""
    assert "exit codes" in here("--help").stdout
    assert "multibody-sym" in answer(here("simulate", "--help", "--json"))["text"]


LOOP = """multibody_sym: 1
name: loop
bodies:
  ground: {points: {pivot: [0.5, 0, 0]}}
  crank: {shape: {rod: 0.2, mass: 1}, points: {end: [0.2, 0, 0]}}
  coupler: {shape: {rod: 0.5, mass: 1}, points: {end: [0.5, 0, 0]}}
  rocker: {shape: {rod: 0.4, mass: 1}, points: {end: [0.4, 0, 0]}}
joints:
  A: {type: revolute, parent: ground, child: crank, axis: z, q: a, initial: {q: 1, known: true}}
  B: {type: revolute, parent: crank.end, child: coupler, axis: z, q: b, initial: {q: -0.5, known: true}}
  D: {type: revolute, parent: ground.pivot, child: rocker, axis: z, q: d, initial: {q: 1.7, known: true}}
  C: {type: revolute, parent: coupler.end, child: rocker.end, axis: z, cut: true}
simulation: {t_end: 0.1}
"""


@pytest.mark.parametrize("name", ["simulate", "linearize", "equilibrium", "solve", "export"])
def test_start_that_misses_is_told_with_its_line(capsys, tmp_path: Path, name: str) -> None:
    model = tmp_path / "loop.yaml"
    model.write_text(LOOP)
    words = (name, str(model), *(("--to", "c", "-o", str(tmp_path / "out")) if name == "export" else ()))
    code, printed, text = outcome(capsys, *words)
    assert (code, printed["error"]["code"]) == (3, "no_solution")
    assert (printed["error"]["where"]["line"], printed["error"]["where"]["path"]) == (12, "joints.C")
    assert f"{model}:12" in text
    assert "C.x misses by" in printed["error"]["message"]


def test_project_puts_known_values_back_and_tells_the_shift(capsys, tmp_path: Path) -> None:
    model = tmp_path / "loop.yaml"
    model.write_text(LOOP)
    code, printed, text = outcome(capsys, "simulate", str(model), "--project")
    assert code == 0
    assert set(printed["start"]["shifts"]) == {"a", "b", "d"}
    assert "given start values were changed to satisfy the constraints: " in text
    assert printed["drift"]["position"] < 1e-12
    _, checked, text = outcome(capsys, "check", str(model), "--project")
    assert checked["shifts"] == pytest.approx(printed["start"]["shifts"])
    assert "given start values were changed" in text


def test_a_value_given_twice_alike_is_taken(capsys) -> None:
    words = ("--set", "m=2", "--set", "m = 2", "--t-end", "0.1", "--t-end", "0.1", "--project", "--no-project")
    assert main(["simulate", PENDULUM, *words, "--backend", "python"]) == 0
    capsys.readouterr()
